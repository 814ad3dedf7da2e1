//! Mesh files.

use std::path::Path;

use glam::Vec3;

use crate::error::{Error, Problem};

/// What a mesh file holds, polygons already cut into triangles.
#[derive(Clone, Debug, Default)]
pub struct MeshFile {
    /// Vertex positions as they stand in the file, rounded to f32; may hold NaN or infinity.
    pub positions: Vec<Vec3>,
    /// Rows of `positions`; every index is in range.
    pub triangles: Vec<[u32; 3]>,
    /// What was mended or ignored.
    pub warnings: Vec<Problem>,
}

/// Reads a mesh file, told apart by extension: `.ply`, `.obj`, `.stl`, each plain or with `.gz` behind.
///
/// # Errors
/// When the file cannot be read, is not of its format, ends early, or names vertices that do not exist.
pub fn load(path: &Path) -> Result<MeshFile, Error> {
    let _ = path;
    unimplemented!()
}
