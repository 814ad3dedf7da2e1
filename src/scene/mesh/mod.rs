//! Mesh files: PLY, OBJ and STL, plain or gzipped, read into triangles over shared vertices.
//!
//! The readers are our own. The crates that exist (`ply-rs-bw`, `serde-ply`, `tobj`, `stl_io`, `nom_stl`) were tried
//! first: they pass on indices that name no vertex, name no line or byte when they refuse a file, stop at non-UTF-8
//! comments or line continuations, and take 5 to 25 times as long as a direct reader on files of two million triangles.
//!
//! ```text
//! source (bytes, gunzip) ─▶ ply | obj | stl ─▶ Soup { positions, faces } ─▶ polygons cut ─▶ MeshFile
//! ```
//! Readers work on a byte slice and know no path; what they have to say is a `Finding` at an offset,
//! and only here it becomes a [`Problem`] with a file and a line or a byte.

mod ear;
pub(super) mod faces;
pub(super) mod finding;
pub(super) mod number;
mod obj;
mod ply;
pub(super) mod polygon;
pub(super) mod source;
mod stl;
mod weld;

use std::path::Path;

use glam::Vec3;

use crate::error::{Error, Place, Problem};
use faces::Faces;
use finding::{Finding, Outcome, counted};
use source::Source;

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
    /// What was mended or ignored.
    pub warnings: Vec<Problem>,
}

/// The formats that can be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Ply,
    Obj,
    Stl,
}

/// What a reader hands on: positions, and faces whose indices are all in range.
#[derive(Debug)]
struct Soup {
    positions: Vec<Vec3>,
    faces: Faces,
    /// Things mended or ignored, in the order of the file.
    findings: Vec<Finding>,
}

/// More vertices than this are refused, so that an index fits 31 bits and no sign is lost in a signed index type.
pub(super) const MAX_VERTICES: usize = i32::MAX as usize;

/// Reads a mesh file, told apart by extension: `.ply`, `.obj`, `.stl`, each plain or with `.gz` behind, in any case of
/// letters. A file that begins with the PLY magic is read as PLY under any name, and gzip is known by its magic too.
///
/// A file without faces (a point cloud, an empty mesh) loads with a warning. Non-finite coordinates pass through:
/// [`World::add_mesh`](crate::world::World::add_mesh) drops and counts their faces.
///
/// # Errors
/// When the file cannot be read, is not of its format, ends early, or names vertices that do not exist. The message
/// names the line of a text file and the byte of a binary one, counted in the decompressed data.
pub fn load(path: &Path) -> Result<MeshFile, Error> {
    read(Source::open(path)?)
}

/// Reads a mesh from bytes in memory, plain or gzipped; `name` tells the format and stands in messages.
///
/// # Errors
/// As [`load`].
pub fn from_bytes(name: &Path, bytes: Vec<u8>) -> Result<MeshFile, Error> {
    read(Source::from_bytes(name, bytes)?)
}

/// Whether a path has the extension of a mesh file: `.ply`, `.obj` or `.stl`, each also with `.gz` behind, in any case
/// of letters. Reads nothing.
pub fn is_mesh_path(path: impl AsRef<Path>) -> bool {
    format_by_name(path.as_ref()).is_some()
}

fn format_by_name(path: &Path) -> Option<Format> {
    let name = path.file_name()?.to_string_lossy().to_ascii_lowercase();
    let (_, extension) = name.strip_suffix(".gz").unwrap_or(&name).rsplit_once('.')?;
    match extension {
        "ply" => Some(Format::Ply),
        "obj" => Some(Format::Obj),
        "stl" => Some(Format::Stl),
        _ => None,
    }
}

fn read(source: Source) -> Result<MeshFile, Error> {
    let bytes = source.bytes();
    let format = if ply::has_magic(bytes) { Some(Format::Ply) } else { format_by_name(source.path()) };
    let Some(format) = format else {
        return Err(Problem::new(Place::file(source.path()), "the format of the mesh is unknown")
            .found(source.path().extension().map_or("no extension".into(), |e| format!("`.{}`", e.to_string_lossy())))
            .expected("`.ply`, `.obj` or `.stl`, each also with `.gz` behind")
            .into());
    };
    if bytes.is_empty() {
        return Err(Error::new(Place::file(source.path()), "the file is empty"));
    }
    let cut = match format {
        Format::Ply => ply::parse(bytes),
        Format::Obj => obj::parse(bytes),
        Format::Stl => stl::parse(bytes),
    }
    .and_then(cut_polygons);
    match cut {
        Ok((mesh, findings)) => {
            let warnings = findings.into_iter().map(|finding| source.problem(finding)).collect();
            Ok(MeshFile { warnings, ..mesh })
        }
        Err(finding) => Err(source.problem(*finding).into()),
    }
}

fn cut_polygons(soup: Soup) -> Outcome<(MeshFile, Vec<Finding>)> {
    let Soup { positions, faces, mut findings } = soup;
    let n_faces = faces.len();
    let triangles = faces.cut(&positions, &mut findings)?;
    if triangles.is_empty() {
        findings.push(Finding::file(match positions.len() {
            0 => "the mesh is empty".to_string(),
            n => {
                format!("the file has {} and no triangle: there is nothing to render", counted(n, "vertex", "vertices"))
            }
        }));
    }
    Ok((MeshFile { positions, triangles, n_faces, warnings: Vec::new() }, findings))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mesh_paths_are_known_by_their_extension_in_any_case_plain_or_gzipped() {
        for path in ["a.ply", "b/c.OBJ", "d.Stl", "e.ply.gz", "f.tar.obj.GZ", ".stl"] {
            assert!(is_mesh_path(path), "{path}");
        }
        for path in ["a.toml", "ply", "a.ply.zip", "a.gz", "a.off", "stl/", ""] {
            assert!(!is_mesh_path(path), "{path}");
        }
    }

    #[test]
    fn an_unknown_extension_is_refused_with_those_that_are_known() {
        let error = from_bytes(Path::new("x.fbx"), b"stuff".to_vec()).unwrap_err().to_string();
        assert_eq!(
            error,
            "x.fbx: the format of the mesh is unknown: found `.fbx`, expected `.ply`, `.obj` or `.stl`, each also with \
             `.gz` behind"
        );
    }

    #[test]
    fn an_empty_file_is_refused_whatever_its_format() {
        for name in ["a.ply", "a.obj", "a.stl"] {
            let error = from_bytes(Path::new(name), Vec::new()).unwrap_err().to_string();
            assert_eq!(error, format!("{name}: the file is empty"));
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
