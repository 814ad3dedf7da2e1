//! Mesh files: PLY, OBJ and STL, plain or gzipped, read into triangles over shared vertices.
//!
//! The readers are our own. The crates that exist (`ply-rs-bw`, `serde-ply`, `tobj`, `stl_io`, `nom_stl`) were tried
//! first: they pass on indices that name no vertex, name no line or byte when they refuse a file, stop at non-UTF-8
//! comments or line continuations, and take 5 to 25 times as long as a direct reader on files of two million triangles.
//!
//! ```text
//! source (bytes, gunzip) ─▶ ply | obj | stl ─▶ Soup { positions, faces } ─▶ polygons cut ─▶ MeshFile
//!                                 └ Obj: normals too, and names of materials ─▶ libraries ─┘
//! ```
//! Readers work on a byte slice and know no path; what they have to say is a `Finding` at an offset,
//! and only here it becomes a [`Problem`] with a file and a line or a byte.

mod ear;
mod faces;
mod finding;
mod number;
mod obj;
mod ply;
mod polygon;
mod source;
mod stl;
mod weld;

use std::path::Path;

use glam::Vec3;

use crate::error::{Error, Place, Problem};
use crate::world::Material;
use faces::Faces;
use finding::{Finding, Outcome, counted};
use obj::library::Materials;
use obj::{MaterialStatements, Obj};
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
    /// Share of the light that passes, from 0 to 1; noted, but not yet part of [`Material`].
    pub transmittance: f64,
    /// Index of refraction, if the file states it; noted like `transmittance`.
    pub ior: Option<f64>,
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
const MAX_VERTICES: usize = i32::MAX as usize;

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
    load_with(path, Attributes::default())
}

/// [`load`] with more than positions and faces, where the file has it. Libraries of materials are looked for beside the
/// file; what is wrong with them is a warning.
///
/// # Errors
/// As [`load`].
pub fn load_with(path: &Path, wanted: Attributes) -> Result<MeshFile, Error> {
    read(&Source::open(path)?, wanted, obj::library::load)
}

/// Reads a mesh from bytes in memory, plain or gzipped; `name` tells the format and stands in messages.
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
    read(&Source::from_bytes(name, bytes)?, wanted, no_libraries)
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

fn read(
    source: &Source,
    wanted: Attributes,
    load_materials: impl Fn(&Source, &MaterialStatements) -> Materials,
) -> Result<MeshFile, Error> {
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
        Format::Ply => ply::parse(bytes).and_then(cut_polygons),
        Format::Obj => obj::parse(bytes, wanted).and_then(|obj| cut_obj(obj, |named| load_materials(source, named))),
        Format::Stl => stl::parse(bytes).and_then(cut_polygons),
    };
    match cut {
        Ok((mut mesh, findings)) => {
            mesh.warnings.splice(0..0, findings.into_iter().map(|finding| source.problem(finding)));
            Ok(mesh)
        }
        Err(finding) => Err(source.problem(*finding).into()),
    }
}

fn cut_polygons(soup: Soup) -> Outcome<(MeshFile, Vec<Finding>)> {
    let Soup { positions, faces, mut findings } = soup;
    let n_faces = faces.len();
    let triangles = faces.cut(&positions, &mut findings)?;
    findings.extend(nothing_to_render(&positions, &triangles));
    Ok((MeshFile { positions, triangles, n_faces, ..MeshFile::default() }, findings))
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
