//! Mesh files: PLY, OBJ, STL and OFF, plain or compressed by gzip or zstd, read into triangles over shared vertices.
//!
//! The readers are our own. The crates that exist (`ply-rs-bw`, `serde-ply`, `tobj`, `stl_io`, `nom_stl`) were tried
//! first: they pass on indices that name no vertex, name no line or byte when they refuse a file, stop at non-UTF-8
//! comments or line continuations, and take 5 to 25 times as long as a direct reader on files of two million triangles.
//!
//! ```text
//! source (bytes, unpacked) ─▶ ply | obj | stl | off ─▶ Soup { positions, normals, faces } ─▶ polygons cut ─▶ MeshFile
//! ```
//! Readers work on a byte slice and know no path; what they have to say is a `Finding` at an offset,
//! and only here it becomes a [`Problem`] with a file and a line or a byte.

mod duplicate;
mod ear;
mod faces;
mod finding;
mod format;
mod given_normals;
mod number;
mod obj;
mod off;
mod ply;
mod polygon;
mod stl;
mod weld;

use std::path::Path;

use glam::Vec3;

use super::machine;
use super::source::Source;
use crate::error::{Error, Place, Problem};
use faces::Faces;
use finding::{Finding, Outcome, counted};
use format::Format;

pub use duplicate::count_duplicate_faces;
pub use format::{has_mesh_content, is_mesh_path};

/// What a mesh file holds, polygons already cut into triangles.
#[derive(Clone, Debug, Default)]
pub struct MeshFile {
    /// Vertex positions as they stand in the file, rounded to f32; may hold NaN or infinity. The corners of an STL
    /// file are welded: positions that are equal number for number are one row.
    pub positions: Vec<Vec3>,
    /// Rows of `positions`; every index is in range. Faces stand in the order of the file.
    pub triangles: Vec<[u32; 3]>,
    /// Unit normals, one per position, when the file has them and they are wanted. What the file gives is brought to
    /// unit length; a normal that is zero or not finite is replaced by the one that the faces give, with a warning.
    pub normals: Option<Vec<Vec3>>,
    /// Faces as the file counts them, before polygons and strips were cut.
    pub n_faces: usize,
    /// What was mended or ignored.
    pub warnings: Vec<Problem>,
}

/// What a caller has use for; what it has none for is not read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wants {
    /// Vertex normals.
    pub normals: bool,
}

impl Default for Wants {
    fn default() -> Wants {
        Wants { normals: true }
    }
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
const MAX_VERTICES: usize = i32::MAX as usize;

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
    load_wanted(path, Wants::default())
}

/// [`load`] of what is wanted only.
///
/// # Errors
/// As [`load`].
pub fn load_wanted(path: &Path, wants: Wants) -> Result<MeshFile, Error> {
    read(Source::open(path)?, wants)
}

/// Reads a mesh from bytes in memory, plain or compressed; `name` tells the format and stands in messages.
///
/// # Errors
/// As [`load`].
pub fn from_bytes(name: &Path, bytes: Vec<u8>) -> Result<MeshFile, Error> {
    read(Source::from_bytes(name, bytes)?, Wants::default())
}

fn read(mut source: Source, wants: Wants) -> Result<MeshFile, Error> {
    let format = format::of(&mut source)?;
    if source.bytes().is_empty() {
        return Err(Error::new(source.end(), "the file is empty"));
    }
    check_memory(&source)?;
    let bytes = source.bytes();
    let parsed = match format {
        Format::Ply => ply::parse(bytes, wants),
        Format::Obj => obj::parse(bytes),
        Format::Stl => stl::parse(bytes),
        Format::Off => off::parse(bytes, wants),
    };
    let read = parsed.and_then(cut_polygons);
    source.check_unchanged()?;
    match read {
        Ok((mesh, findings)) => {
            let warnings = findings.into_iter().map(|finding| finding.into_problem(&source)).collect();
            Ok(MeshFile { warnings, ..mesh })
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
    let Soup { positions, mut normals, faces, mut findings } = soup;
    let n_faces = faces.len();
    let triangles = faces.cut(&positions, &mut findings)?;
    if let Some(normals) = &mut normals {
        findings.extend(given_normals::mend(normals, &positions, &triangles));
    }
    if triangles.is_empty() {
        findings.push(Finding::file(match positions.len() {
            0 => "the mesh is empty".to_string(),
            n => {
                format!("the file has {} and no triangle: there is nothing to render", counted(n, "vertex", "vertices"))
            }
        }));
    }
    Ok((MeshFile { positions, triangles, normals, n_faces, warnings: Vec::new() }, findings))
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
