//! Prototypes and the objects that place them: `[[prototype]]`, and `[[hittable]]` of type `instance`.

use std::collections::HashMap;
use std::path::Path;

use glam::{DAffine3, DVec3};

use super::compile::Base;
use super::desc::{HittableDesc, InstanceDesc, RepeatDesc, Rows4, ShapeDesc, Spanned};
use super::machine;
use super::mesh::finding::{Finding, Outcome, quoted};
use super::mesh::number::{is_blank, is_line_end, parse_f64};
use super::nearest::nearest;
use super::report::Report;
use super::source::Source;
use super::toml::Table;
use super::transform::Transform;
use super::validate::COORDINATE;
use super::{geometry, validate};
use crate::error::{Error, Place, Problem};
use crate::world::{MaterialId, ObjectId, PrototypeId, World};

/// Placements of one object at most.
const MAX_COUNT: u64 = 100_000_000;

/// Bytes that a placement takes while its tree is built: 240 in the table, 24 for its box, 220 in the builder.
const BYTES_PER_PLACEMENT: u64 = 500;

/// Reads the keys of an instance.
pub fn read_instance(table: &mut Table<'_>) -> Option<ShapeDesc> {
    table.require("of", "the name of a [[prototype]]");
    let of = table.string("of", "the name of a [[prototype]]");
    let repeat = table.tables("repeat").into_iter().filter_map(read_repeat).collect();
    let file_path = table.string("placements", "the path of a file of transforms");
    Some(ShapeDesc::Instance(InstanceDesc { of: of?, repeat, file_path }))
}

fn read_repeat(mut table: Table<'_>) -> Option<RepeatDesc> {
    table.require("count", "a whole number");
    table.require("step", "3 numbers, from one to the next");
    let count = table.integer("count", 1..=MAX_COUNT, "a whole number from 1 to 100000000");
    let step = table.vec3("step", &COORDINATE);
    table.finish();
    Some(RepeatDesc { count: count?, step: step?.value })
}

/// The prototypes of a scene.
#[derive(Debug)]
pub struct Prototypes<'a> {
    /// By name; `None` for one that is there but wrong.
    ids: HashMap<&'a str, Option<PrototypeId>>,
    base: &'a Base,
}

impl<'a> Prototypes<'a> {
    /// None yet, of a scene that lies there.
    pub fn new(base: &'a Base) -> Prototypes<'a> {
        Prototypes { ids: HashMap::new(), base }
    }

    /// Makes a prototype of the triangles from a row on, which `desc` has added.
    pub fn add(&mut self, desc: &'a HittableDesc, first_triangle: usize, world: &mut World, report: &Report) {
        let Some(name) = &desc.name else {
            let problem = Problem::new(Place::default(), "missing key").expected("a string, the name to place it by");
            return report.mistake(&desc.span, &format!("{}.name", desc.key), problem);
        };
        if !matches!(desc.shape, Some(ShapeDesc::Mesh(_)) | None) {
            let problem = Problem::new(Place::default(), "only a mesh can be placed").help("use type = \"mesh\"");
            report.mistake(&desc.span, &format!("{}.type", desc.key), problem);
        }
        let id = (!report.has_mistakes()).then(|| world.add_prototype(first_triangle));
        if self.ids.insert(name, id).is_some() {
            let problem = Problem::new(Place::default(), "a prototype of this name exists already");
            report.mistake(&desc.span, &format!("{}.name", desc.key), problem.found(format!("\"{name}\"")));
        }
    }

    /// Places a prototype, once or many times.
    pub fn place(
        &self,
        desc: &InstanceDesc,
        hittable: &HittableDesc,
        material: Option<MaterialId>,
        object: ObjectId,
        world: &mut World,
        report: &Report,
    ) {
        let InstanceDesc { of, repeat, file_path } = desc;
        let Some(prototype) = self.ids.get(of.value.as_str()) else {
            let help = match nearest(&of.value, self.ids.keys().copied()) {
                Some(near) => format!("did you mean \"{near}\"?"),
                None => "the scene has no [[prototype]] of this name".to_owned(),
            };
            let found = format!("\"{}\"", of.value);
            let problem = Problem::new(Place::default(), "unknown prototype").found(found).help(help);
            return report.mistake(&of.span, &format!("{}.of", hittable.key), problem);
        };
        let Some(listed) = self.listed(file_path.as_ref(), hittable, report) else { return };
        let n_placements = repeat.iter().fold(listed.len() as u64, |n, repeat| n.saturating_mul(repeat.count));
        if let Some(problem) = too_many(n_placements) {
            return report.mistake(&hittable.span, &hittable.key, problem);
        }
        // A scene that is refused anyway needs no tables.
        let (Some(prototype), false) = (*prototype, report.has_mistakes()) else { return };
        for index in 0..n_placements {
            let added = transform_of(index, repeat, &listed, &hittable.transform)
                .and_then(|transform| world.add_instance(prototype, transform, material, object));
            let Err(error) = added else { continue };
            for mut problem in error.problems {
                if n_placements > 1 {
                    problem.what = format!("placement {index} of {n_placements}: {}", problem.what);
                }
                report.mistake(&hittable.span, &hittable.key, problem);
            }
            return;
        }
    }

    /// The transforms of the file that an instance names, or the one that changes nothing; `None` after a mistake.
    fn listed(
        &self,
        file_path: Option<&Spanned<String>>,
        hittable: &HittableDesc,
        report: &Report,
    ) -> Option<Vec<Transform>> {
        let Some(Spanned { value, span }) = file_path else { return Some(vec![Transform::IDENTITY]) };
        let found = geometry::find_file(value, "file of placements", self.base);
        match found.map(|path| read_placements(&path)) {
            Ok(Ok(transforms)) => return Some(transforms),
            Ok(Err(error)) => report.mistakes_elsewhere(span, error.problems),
            Err(problem) => report.mistake(span, &format!("{}.placements", hittable.key), *problem),
        }
        None
    }
}

/// Where a placement stands; the first row of repetitions is the innermost.
fn transform_of(index: u64, repeat: &[RepeatDesc], listed: &[Transform], outer: &Transform) -> Result<DAffine3, Error> {
    let (mut rest, mut shift) = (index, DVec3::ZERO);
    for RepeatDesc { count, step } in repeat {
        shift += (rest % count) as f64 * *step;
        rest /= count;
    }
    let inner = &listed[rest as usize];
    let place = if *inner == Transform::IDENTITY { Some(*outer) } else { outer.of(inner) };
    let Some(Transform { linear, translation, .. }) = place else {
        return Err(Error::new(Place::default(), "the transform is beyond the range of 64-bit floats"));
    };
    Ok(DAffine3 { matrix3: linear, translation: translation + shift })
}

fn too_many(n_placements: u64) -> Option<Problem> {
    let n_bytes = n_placements.saturating_mul(BYTES_PER_PLACEMENT);
    if n_placements > MAX_COUNT {
        let problem = Problem::new(Place::default(), "too many placements of one object");
        return Some(problem.found(n_placements).expected(format!("at most {MAX_COUNT}")));
    }
    machine::available_bytes().filter(|&available| n_bytes > available).map(|available| {
        Problem::new(Place::default(), "so many placements do not fit into memory")
            .found(format!("{n_placements}, which take {n_bytes} bytes"))
            .expected(format!("at most the {available} bytes that are free"))
    })
}

/// Reads a file of transforms: twelve numbers each, the first three rows of `world_from_object`, row by row; anything
/// that is blank, a comma, or a comment from `#` to the end of its line may stand between.
fn read_placements(path: &Path) -> Result<Vec<Transform>, Error> {
    let mut source = Source::open(path)?;
    source.skip_byte_order_mark();
    let read = parse_placements(source.bytes());
    source.check_unchanged()?;
    read.map_err(|finding| finding.into_problem(&source).into())
}

fn parse_placements(bytes: &[u8]) -> Outcome<Vec<Transform>> {
    let mut transforms = Vec::new();
    let mut row = Vec::with_capacity(12);
    let mut at = 0;
    let mut first_at = 0;
    loop {
        at += bytes[at..].iter().take_while(|&&byte| is_blank(byte) || is_line_end(byte) || byte == b',').count();
        match bytes.get(at) {
            None => break,
            Some(b'#') => {
                at += bytes[at..].iter().take_while(|&&byte| !is_line_end(byte)).count();
                continue;
            }
            Some(_) => {}
        }
        let end = at + bytes[at..].iter().take_while(|&&b| !is_blank(b) && !is_line_end(b) && b != b',').count();
        let number = parse_f64(&bytes[..end], at).filter(|&(value, to)| to == end && (validate::ENTRY.holds)(value));
        let Some((value, _)) = number.filter(|(value, _)| value.is_finite()) else {
            let found = quoted(&bytes[at..end]);
            return Err(Finding::line(at, "not a number of a transform").found(found).expected("a number").into());
        };
        if row.is_empty() {
            first_at = at;
        }
        row.push(value);
        at = end;
        if let [a, b, c, d, e, f, g, h, i, j, k, l] = row[..] {
            let rows: Rows4 = [[a, b, c, d], [e, f, g, h], [i, j, k, l], [0.0, 0.0, 0.0, 1.0]];
            transforms.push(Transform::from_rows(&rows).map_err(|problem| {
                Finding::line(first_at, format!("a transform is {}", problem.what)).expected("an invertible matrix")
            })?);
            row.clear();
        }
    }
    if !row.is_empty() {
        let finding = Finding::line(first_at, "the last transform is not complete").found(row.len());
        return Err(finding.expected("12 numbers, 3 rows of 4").into());
    }
    Ok(transforms)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn placements_are_read_across_lines_commas_and_comments() {
        let text = b"# moved\n1 0 0 5, 0 1 0 6\n0 0 1 7 # end\n0,0,1,0\r\n1,0,0,0\r\n0,1,0,0";
        let transforms = parse_placements(text).unwrap();
        assert_eq!(transforms.len(), 2);
        assert_eq!(transforms[0].point(DVec3::ZERO), DVec3::new(5.0, 6.0, 7.0));
        assert_eq!(transforms[1].point(DVec3::new(1.0, 2.0, 3.0)), DVec3::new(3.0, 1.0, 2.0));
        assert!(parse_placements(b"  # nothing\n").unwrap().is_empty());
    }

    #[test]
    fn what_is_no_transform_is_refused_with_its_line() {
        let refused = |text: &str| {
            let finding = parse_placements(text.as_bytes()).unwrap_err();
            let line = match finding.at {
                super::super::mesh::finding::At::Line(at) => text[..at].matches('\n').count() + 1,
                _ => 0,
            };
            (line, finding.what)
        };
        let row = "1 0 0 0 0 1 0 0 0 0 1 0\n";
        assert_eq!(refused(&format!("{row}1 0 0")), (2, "the last transform is not complete".to_owned()));
        assert_eq!(refused(&format!("{row}1 0 nan")), (2, "not a number of a transform".to_owned()));
        assert_eq!(refused("1 0 0x"), (1, "not a number of a transform".to_owned()));
        let flat = refused("1 0 0 0 0 1 0 0 0 0 0 0");
        assert_eq!(flat, (1, "a transform is not invertible".to_owned()));
    }
}
