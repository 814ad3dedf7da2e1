//! Mesh files: PLY, OBJ, STL and OFF, plain or compressed by gzip or zstd, read into triangles over shared vertices.
//!
//! The readers are our own. The crates that exist (`ply-rs-bw`, `serde-ply`, `tobj`, `stl_io`, `nom_stl`) were tried
//! first: they pass on indices that name no vertex, name no line or byte when they refuse a file, stop at non-UTF-8
//! comments or line continuations, and take 5 to 25 times as long as a direct reader on files of two million triangles.
//!
//! ```text
//! source (bytes, unpacked) ─▶ ply | obj | stl | off ─▶ Soup { positions, normals, faces } ─▶ polygons cut ─▶ MeshFile
//!                                       └ Obj: also names of materials ─▶ libraries ─┘
//! ```
//! Readers work on a byte slice and know no path; what they have to say is a `Finding` at an offset,
//! and only here it becomes a [`Problem`] with a file and a line or a byte.

mod duplicate;
mod ear;
pub(super) mod faces;
pub(super) mod finding;
mod format;
pub(super) mod number;
mod obj;
mod off;
mod ply;
pub(super) mod polygon;
mod stl;
mod weld;

use std::path::Path;

use glam::Vec3;

use super::machine;
use super::source::Source;
use crate::error::{Error, Place, Problem};
use crate::world::Material;
use faces::Faces;
use finding::{Finding, Outcome, counted};
use format::Format;
use obj::library::Materials;
use obj::{MaterialStatements, Obj};

pub use duplicate::count_duplicate_faces;
pub(super) use format::is_mesh;
pub use format::is_mesh_path;

/// What a mesh file holds, polygons already cut into triangles.
#[derive(Clone, Debug, Default)]
pub struct MeshFile {
    /// Vertex positions as they stand in the file, rounded to f32; may hold NaN or infinity. The corners of an STL
    /// file are welded: positions that are equal number for number are one row.
    pub positions: Vec<Vec3>,
    /// Rows of `positions`; every index is in range. Faces stand in the order of the file.
    pub triangles: Vec<[u32; 3]>,
    /// Faces as the file counts them, before polygons and strips were cut.
    pub n_faces: usize,
    /// Where [`Attributes::normals`] asks for them and the file has any: one per position, as they stand in the file;
    /// of any length, zero or not finite where the file gives no direction.
    pub normals: Option<Vec<Vec3>>,
    /// Rows at the end of `positions` that repeat an earlier row with another normal: which.
    pub split_from: Vec<u32>,
    /// Where [`Attributes::materials`] asks for them: those in use.
    pub materials: Vec<MeshMaterial>,
    /// Where materials begin, in the order of `triangles`; those before the first have none.
    pub material_ranges: Vec<MaterialRange>,
    /// What was mended or ignored.
    pub warnings: Vec<Problem>,
}

/// A material that came with a mesh file.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshMaterial {
    /// Its name in the file.
    pub name: String,
    /// What the shading formula knows of it.
    pub material: Material,
}

/// Triangles with one material, up to where the next range begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MaterialRange {
    /// Row of `triangles`.
    pub first_triangle: u32,
    /// Row of [`MeshFile::materials`]; `None` for one that no library has.
    pub material: Option<u32>,
}

/// What to read of a file beside positions and faces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Attributes {
    /// Normals of vertices.
    pub normals: bool,
    /// Materials, also from the files that name them.
    pub materials: bool,
}

/// What a reader hands on: positions, and faces whose indices are all in range.
#[derive(Debug, Default)]
struct Soup {
    positions: Vec<Vec3>,
    /// As they stand in the file, one per position.
    normals: Option<Vec<Vec3>>,
    faces: Faces,
    /// Things mended or ignored, in the order of the file.
    findings: Vec<Finding>,
}

/// More vertices than this are refused, so that an index fits 31 bits and no sign is lost in a signed index type.
pub(super) const MAX_VERTICES: usize = i32::MAX as usize;

impl MeshFile {
    /// Takes the normals away, and with them the rows that were split for their sake.
    pub fn drop_normals(&mut self) {
        self.normals = None;
        let split_from = std::mem::take(&mut self.split_from);
        let n_unsplit = self.positions.len() - split_from.len();
        self.positions.truncate(n_unsplit);
        for vertex in self.triangles.iter_mut().flatten() {
            if let Some(&of) = (*vertex as usize).checked_sub(n_unsplit).and_then(|row| split_from.get(row)) {
                *vertex = of;
            }
        }
    }
}

/// Reads a mesh file: `.ply`, `.obj`, `.stl` or `.off`, each plain or with `.gz` or `.zst` behind, in any case of
/// letters. Content that can be nothing else (the keyword of PLY or OFF, a whole STL file) is read as what it is under
/// any name, and compression is known by its content alone.
///
/// A file without faces (a point cloud, an empty mesh) loads with a warning. Non-finite coordinates pass through:
/// [`World::add_mesh`](crate::world::World::add_mesh) drops and counts their faces.
///
/// # Errors
/// When the file cannot be read, is not of its format, ends early, or names vertices that do not exist. The message
/// names the line of a text file and the byte of a binary one, counted in the decompressed data.
pub fn load(path: &Path) -> Result<MeshFile, Error> {
    load_with(path, Attributes::default())
}

/// [`load`] with more than positions and faces, where the file has it. Libraries of materials are looked for beside the
/// file; what is wrong with them is a warning.
///
/// # Errors
/// As [`load`].
pub fn load_with(path: &Path, wanted: Attributes) -> Result<MeshFile, Error> {
    read(Source::open(path)?, wanted, obj::library::load)
}

/// Reads a mesh from bytes in memory, plain or compressed; `name` tells the format and stands in messages.
///
/// # Errors
/// As [`load`].
pub fn from_bytes(name: &Path, bytes: Vec<u8>) -> Result<MeshFile, Error> {
    from_bytes_with(name, bytes, Attributes::default())
}

/// [`from_bytes`] with more than positions and faces. No other file is opened: no library of materials is found.
///
/// # Errors
/// As [`load`].
pub fn from_bytes_with(name: &Path, bytes: Vec<u8>, wanted: Attributes) -> Result<MeshFile, Error> {
    let no_libraries = |_: &Source, statements: &MaterialStatements| Materials {
        of_name: vec![None; statements.names.len()],
        ..Materials::default()
    };
    read(Source::from_bytes(name, bytes)?, wanted, no_libraries)
}

fn read(
    mut source: Source,
    wanted: Attributes,
    load_materials: impl Fn(&Source, &MaterialStatements) -> Materials,
) -> Result<MeshFile, Error> {
    let format = format::of(&mut source)?;
    if source.bytes().is_empty() {
        return Err(Error::new(source.end(), "the file is empty"));
    }
    check_memory(&source)?;
    let bytes = source.bytes();
    let cut = match format {
        Format::Ply => ply::parse(bytes, wanted).and_then(cut_polygons),
        Format::Obj => obj::parse(bytes, wanted).and_then(|obj| cut_obj(obj, |named| load_materials(&source, named))),
        Format::Stl => stl::parse(bytes).and_then(cut_polygons),
        Format::Off => off::parse(bytes, wanted).and_then(cut_polygons),
    };
    source.check_unchanged()?;
    match cut {
        Ok((mut mesh, findings)) => {
            mesh.warnings.splice(0..0, findings.into_iter().map(|finding| finding.into_problem(&source)));
            Ok(mesh)
        }
        Err(finding) => Err(finding.into_problem(&source).into()),
    }
}

/// Refuses a file whose tables would not fit beside it. They take about as much as a binary file and half of a text;
/// only strips of one-byte indices grow to twelve times their size, and those name 256 vertices.
fn check_memory(source: &Source) -> Result<(), Error> {
    let n_bytes = source.bytes().len() as u64;
    if n_bytes <= machine::NOT_ASKED_BYTES {
        return Ok(());
    }
    match machine::available_bytes().filter(|&available| n_bytes > available) {
        None => Ok(()),
        Some(available) => Err(Problem::new(Place::file(source.path()), "the mesh does not fit into memory")
            .found(format!("{n_bytes} bytes"))
            .expected(format!("at most the {available} bytes that are free"))
            .into()),
    }
}

fn cut_polygons(soup: Soup) -> Outcome<(MeshFile, Vec<Finding>)> {
    let Soup { positions, normals, faces, mut findings } = soup;
    let n_faces = faces.len();
    let triangles = faces.cut(&positions, &mut findings)?;
    findings.extend(nothing_to_render(&positions, &triangles));
    Ok((MeshFile { positions, triangles, normals, n_faces, ..MeshFile::default() }, findings))
}

fn cut_obj(
    obj: Obj,
    load_materials: impl FnOnce(&MaterialStatements) -> Materials,
) -> Outcome<(MeshFile, Vec<Finding>)> {
    let Obj { positions, faces, normals, split_from, materials: statements, mut findings } = obj;
    let n_faces = faces.len();
    let (triangles, marks) = faces.cut_with_marks(&positions, &mut findings)?;
    findings.extend(nothing_to_render(&positions, &triangles));
    let Materials { materials, of_name, warnings } = load_materials(&statements);
    let mut material_ranges: Vec<MaterialRange> = Vec::new();
    for (&name, first_triangle) in statements.uses.iter().zip(marks) {
        let material = of_name.get(name as usize).copied().flatten();
        let begins_here = |range: &mut MaterialRange| range.first_triangle as usize == first_triangle;
        material_ranges.pop_if(begins_here);
        if material_ranges.last().and_then(|range| range.material) != material {
            material_ranges.push(MaterialRange { first_triangle: first_triangle as u32, material });
        }
    }
    let mesh = MeshFile { positions, triangles, n_faces, normals, split_from, materials, material_ranges, warnings };
    Ok((mesh, findings))
}

fn nothing_to_render(positions: &[Vec3], triangles: &[[u32; 3]]) -> Option<Finding> {
    triangles.is_empty().then(|| {
        Finding::file(match positions.len() {
            0 => "the mesh is empty".to_string(),
            n => {
                format!("the file has {} and no triangle: there is nothing to render", counted(n, "vertex", "vertices"))
            }
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_empty_file_is_refused_whatever_its_format() {
        for name in ["a.ply", "a.obj", "a.stl", "a.off"] {
            let error = from_bytes(Path::new(name), Vec::new()).unwrap_err().to_string();
            assert_eq!(error, format!("{name}:1: the file is empty"));
        }
    }

    #[test]
    fn a_ply_under_another_name_is_read_as_ply() {
        let text = b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n\
                     end_header\n1 2 3\n";
        let mesh = from_bytes(Path::new("scan.obj"), text.to_vec()).unwrap();
        assert_eq!(mesh.positions, [Vec3::new(1.0, 2.0, 3.0)]);
        assert_eq!(
            mesh.warnings[0].to_string(),
            "scan.obj: the file has 1 vertex and no triangle: there is nothing to render"
        );
    }
}
