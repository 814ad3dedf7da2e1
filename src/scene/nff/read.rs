//! From the words of an NFF text to its statements. Nothing is reserved by a count of the file.

use std::collections::HashMap;

use glam::DVec3;

use super::super::mesh::MAX_VERTICES;
use super::super::mesh::faces::Faces;
use super::super::mesh::finding::{At, Finding, Outcome, Tally, counted};
use super::super::validate::{COORDINATE, FOV, NON_NEGATIVE, NumberRule, SIDE_PX};
use super::cone::Cone;
use super::statement::{Light, Run, Sphere, Statements, View};
use super::words::{Words, shown};
use crate::world::{Material, MaterialId, Spheres};

const IOR: NumberRule = NumberRule { expected: "a number", holds: |_| true };

/// Reads a whole text, up to the first statement that is wrong.
///
/// # Errors
/// For a statement that is unknown, not complete or out of range.
pub(super) fn read(bytes: &[u8]) -> Outcome<Statements> {
    let mut reader = Reader { words: Words::new(bytes), ..Reader::default() };
    while !reader.words.peek().is_empty() {
        reader.statement()?;
    }
    Ok(reader.finish())
}

/// What is read so far.
#[derive(Debug, Default)]
struct Reader<'a> {
    words: Words<'a>,
    out: Statements,
    /// The fill that is in force, once there is one.
    fill: Option<MaterialId>,
    /// Fills by the bits of their numbers.
    known_fills: HashMap<[u64; 8], MaterialId>,
    /// Corners of the polygon that is being read.
    corners: Vec<u32>,
    tallies: Tallies,
}

/// Defects by kind.
#[derive(Debug, Default)]
struct Tallies {
    second_views: Tally,
    without_fill: Tally,
    bad_spheres: Tally,
    bad_cones: Tally,
    zero_normals: Tally,
    turned_patches: Tally,
}

impl Reader<'_> {
    fn statement(&mut self) -> Outcome<()> {
        let (word, at) = self.words.next();
        match word {
            b"v" => self.view(at),
            b"b" => {
                self.words.begin("b R G B");
                self.out.background = self.words.ruled_vector("a colour", &NON_NEGATIVE)?;
                Ok(())
            }
            b"l" => self.light(),
            b"f" => self.fill(at),
            b"s" => self.sphere(at),
            b"c" => self.cone(at),
            b"p" => self.polygon(false, at),
            b"pp" => self.polygon(true, at),
            _ => Err(Finding::new(at, "an unknown statement")
                .found(shown(word))
                .expected("`v`, `b`, `l`, `f`, `s`, `c`, `p`, `pp` or a comment that begins with `#`")
                .into()),
        }
    }

    /// The lines of a view in any order; `hither` is read and ignored.
    fn view(&mut self, at: At) -> Outcome<()> {
        let words = &mut self.words;
        let (mut from, mut look_at, mut up, mut angle, mut size) = (None, None, None, None, None);
        loop {
            match words.peek() {
                b"from" | b"at" | b"up" => {
                    words.begin("from X Y Z` and `at X Y Z` and `up X Y Z");
                    let (key, _) = words.next();
                    let vector = words.ruled_vector("a coordinate", &COORDINATE)?;
                    *(match key {
                        b"from" => &mut from,
                        b"at" => &mut look_at,
                        _ => &mut up,
                    }) = Some(vector);
                }
                b"angle" => {
                    words.next();
                    words.begin("angle DEGREES");
                    angle = Some(words.ruled("the angle", &FOV)?);
                }
                b"hither" => {
                    words.next();
                    words.begin("hither DISTANCE");
                    words.number()?;
                }
                b"resolution" => {
                    words.next();
                    words.begin("resolution WIDTH HEIGHT");
                    let mut side = || words.whole(SIDE_PX.0, SIDE_PX.1).map(|side| side as u32);
                    size = Some([side()?, side()?]);
                }
                _ => break,
            }
        }
        let missing = |key: &str| {
            Finding::new(at, format!("the view has no `{key}`"))
                .expected("`from`, `at`, `up`, `angle` and `resolution` behind `v`")
        };
        if self.out.view.is_some() {
            self.tallies.second_views.add(at);
        }
        self.out.view = Some(View {
            from: from.ok_or_else(|| missing("from"))?,
            look_at: look_at.ok_or_else(|| missing("at"))?,
            up: up.ok_or_else(|| missing("up"))?,
            angle_degrees: angle.ok_or_else(|| missing("angle"))?,
            size_px: size.ok_or_else(|| missing("resolution"))?,
            at,
        });
        Ok(())
    }

    fn light(&mut self) -> Outcome<()> {
        self.words.begin("l X Y Z` or `l X Y Z R G B");
        let position = self.words.ruled_vector("a coordinate", &COORDINATE)?;
        let has_color = self.words.number_follows();
        let color = has_color.then(|| self.words.ruled_vector("a colour", &NON_NEGATIVE)).transpose()?;
        self.out.lights.push(Light { position, color });
        Ok(())
    }

    /// Phong without an ambient term; highlights are white, and what they weigh is mirrored too.
    fn fill(&mut self, at: At) -> Outcome<()> {
        let words = &mut self.words;
        words.begin("f R G B Kd Ks SHINE T IOR");
        let diffuse = words.ruled_vector("a colour", &NON_NEGATIVE)?;
        let k_d = words.ruled("Kd", &NON_NEGATIVE)?;
        let k_s = words.ruled("Ks", &NON_NEGATIVE)?;
        let shininess = words.ruled("the shine", &NON_NEGATIVE)?;
        let k_t = words.ruled("the transmittance", &NON_NEGATIVE)?;
        let ior = words.ruled("the index of refraction", &IOR)?;
        if k_t > 0.0 && ior <= 0.0 {
            let problem = Finding::new(at, "the index of refraction of a transparent fill is out of range");
            return Err(problem.found(ior).expected("a number above 0").into());
        }
        if k_d * diffuse.max_element() > f64::from(f32::MAX) {
            return Err(Finding::new(at, "a colour times its weight is beyond the range of 32-bit floats").into());
        }
        // Where nothing passes, the index means nothing; files have 0 there.
        let ior = if k_t > 0.0 { ior } else { Material::default().ior };
        let fill =
            Material { ambient: DVec3::ZERO, k_a: 0.0, diffuse, k_d, k_s, shininess, k_t, ior, ..Material::default() };
        let key = [diffuse.x, diffuse.y, diffuse.z, k_d, k_s, shininess, k_t, ior].map(f64::to_bits);
        let fills = &mut self.out.fills;
        self.fill = Some(*self.known_fills.entry(key).or_insert_with(|| {
            fills.push(fill);
            MaterialId(fills.len() as u32 - 1)
        }));
        Ok(())
    }

    /// The fill in force; a default one before the first `f`.
    fn fill_for(&mut self, at: At) -> MaterialId {
        if self.fill.is_none() {
            self.tallies.without_fill.add(at);
            self.out.fills.push(Material { ambient: DVec3::ZERO, k_a: 0.0, ..Material::default() });
        }
        *self.fill.get_or_insert(MaterialId(self.out.fills.len() as u32 - 1))
    }

    fn sphere(&mut self, at: At) -> Outcome<()> {
        self.words.begin("s X Y Z RADIUS");
        let center = self.words.vector()?;
        // A negative radius asks for the inside to be seen; both sides are.
        let radius = self.words.number()?.abs();
        if radius > 0.0 && Spheres::box_of(center, radius).is_some() {
            let fill = self.fill_for(at);
            self.out.spheres.push(Sphere { center, radius, fill });
        } else {
            self.tallies.bad_spheres.add(at);
        }
        Ok(())
    }

    fn cone(&mut self, at: At) -> Outcome<()> {
        self.words.begin("c X Y Z RADIUS X Y Z RADIUS");
        let (base, base_radius) = (self.words.vector()?, self.words.number()?);
        let (apex, apex_radius) = (self.words.vector()?, self.words.number()?);
        if base_radius.min(apex_radius) < 0.0 && base_radius.max(apex_radius) > 0.0 {
            return Err(Finding::new(at, "the radii of a cone have different signs")
                .found(format!("{base_radius} and {apex_radius}"))
                .expected("both from 0 up, or both from 0 down")
                .into());
        }
        // Negative radii ask for the inside to be seen; both sides are.
        let (base_radius, apex_radius) = (base_radius.abs(), apex_radius.abs());
        let in_range = |end: DVec3, radius: f64| Spheres::box_of(end, radius).is_some();
        let is_real = base != apex && base_radius.max(apex_radius) > 0.0;
        let is_real = is_real && in_range(base, base_radius) && in_range(apex, apex_radius);
        match is_real.then(|| Cone::new(base, base_radius, apex, apex_radius)).flatten() {
            Some(cone) => {
                let fill = self.fill_for(at);
                self.out.cones.push((cone, fill));
            }
            None => self.tallies.bad_cones.add(at),
        }
        Ok(())
    }

    fn polygon(&mut self, is_patch: bool, at: At) -> Outcome<()> {
        self.words.begin(if is_patch { "pp CORNERS X Y Z NX NY NZ …" } else { "p CORNERS X Y Z …" });
        let n_corners = self.words.whole(0..=MAX_VERTICES as u64, "a number of corners")?;
        let fill = self.fill_for(at);
        if !self.out.runs.last().is_some_and(|run| run.fill == fill && run.normals.is_some() == is_patch) {
            let normals = is_patch.then(Vec::new);
            self.out.runs.push(Run { fill, positions: Vec::new(), normals, faces: Faces::default() });
        }
        let Some(run) = self.out.runs.last_mut() else { return Ok(()) };
        self.corners.clear();
        // Newell's normal as the corners turn, and the sum of the normals at them.
        let (mut first, mut before) = (DVec3::ZERO, DVec3::ZERO);
        let (mut turn, mut sum) = (DVec3::ZERO, DVec3::ZERO);
        for corner in 0..n_corners {
            let position = self.words.vector()?;
            if corner == 0 {
                (first, before) = (position, position);
            }
            turn += (before - first).cross(position - first);
            before = position;
            if let Some(normals) = &mut run.normals {
                let normal = self.words.vector()?.try_normalize();
                if normal.is_none() {
                    self.tallies.zero_normals.add(at);
                }
                sum += normal.unwrap_or(DVec3::ZERO);
                normals.push(normal.unwrap_or(DVec3::ZERO).as_vec3());
            }
            if run.positions.len() >= MAX_VERTICES {
                let problem = Finding::new(at, "too many corners");
                return Err(problem.expected(format!("at most {MAX_VERTICES} in a row of one fill")).into());
            }
            self.corners.push(run.positions.len() as u32);
            run.positions.push(position.as_vec3());
        }
        // The normals of a patch say where its front is, also in files that wind it the other way.
        if turn.dot(sum) < 0.0 {
            self.corners.reverse();
            self.tallies.turned_patches.add(at);
        }
        run.faces.push(&self.corners, at);
        Ok(())
    }

    fn finish(self) -> Statements {
        let Reader { mut out, tallies, .. } = self;
        let Tallies { second_views, without_fill, bad_spheres, bad_cones, zero_normals, turned_patches } = tallies;
        let tell = |tally: Tally, one: &'static str, many: &'static str| tally.finding(|n| counted(n, one, many));
        let defect = |tally, one, many| tell(tally, one, many).map(Finding::defect);
        let told = [
            tell(second_views, "view more than one: the last is used", "views more than one: the last is used"),
            without_fill.finding(|_| "objects before the first fill: they are light grey".to_owned()),
            defect(
                bad_spheres,
                "sphere without a radius or beyond the range of 32-bit floats left out",
                "spheres without a radius or beyond the range of 32-bit floats left out",
            ),
            defect(
                bad_cones,
                "cone without length or radius or beyond the range of 32-bit floats left out",
                "cones without length or radius or beyond the range of 32-bit floats left out",
            ),
            defect(
                zero_normals,
                "normal of a patch is zero or not finite, and does not count",
                "normals of patches are zero or not finite, and do not count",
            ),
            tell(
                turned_patches,
                "patch runs clockwise about its normals and is turned round",
                "patches run clockwise about their normals and are turned round",
            ),
        ];
        out.findings.extend(told.into_iter().flatten());
        out
    }
}
