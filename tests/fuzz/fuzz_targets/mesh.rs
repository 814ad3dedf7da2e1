//! What must hold of any bytes that are read as a mesh.

use std::path::Path;

use flatray::scene::mesh;

/// Reads bytes as a file of this name: whatever is accepted is whole, whatever is refused is refused by name.
pub fn check(name: &str, bytes: &[u8]) {
    match mesh::from_bytes(Path::new(name), bytes.to_vec()) {
        Ok(mesh) => {
            let n_vertices = mesh.positions.len();
            assert!(mesh.triangles.iter().flatten().all(|&vertex| (vertex as usize) < n_vertices));
            let normals = mesh.normals.unwrap_or_default();
            assert!(normals.is_empty() || normals.len() == n_vertices);
            assert!(normals.iter().all(|normal| (normal.length() - 1.0).abs() < 1e-5));
            mesh::count_duplicate_faces(&mesh.positions, &mesh.triangles);
        }
        Err(error) => assert!(error.to_string().starts_with(name)),
    }
}
