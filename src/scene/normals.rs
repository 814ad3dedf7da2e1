//! Vertex normals of smooth meshes.

use glam::{DVec3, Vec3};

use crate::numeric::triangle::is_degenerate;

/// The unit normal of a face by its winding; `None` when the face has no area or a corner is not finite.
fn face_normal(corners: [Vec3; 3]) -> Option<DVec3> {
    if !corners.iter().all(|corner| corner.is_finite()) || is_degenerate(corners) {
        return None;
    }
    // Differences of f32 span at most 2·3.4e38 and their products 1e78, or at least 1e-90: both lie well within f64.
    let [a, b, c] = corners.map(|corner| corner.as_dvec3());
    (b - a).cross(c - a).try_normalize()
}

/// One unit normal per vertex: the sum of the unit normals of its faces, unweighted, normalised, as the original does
/// it. Sums are made in f64 in the order of the faces.
///
/// Faces without area and faces with a NaN or infinite corner contribute nothing. Where the sum is zero the normal of
/// the vertex's first face stands in; a vertex without a face gets +z. The result never holds a NaN. Indices out of
/// range are passed over.
pub fn smooth_normals(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<Vec3> {
    let mut sums = vec![DVec3::ZERO; positions.len()];
    for (normal, vertices) in face_normals(positions, triangles) {
        for vertex in vertices {
            sums[vertex as usize] += normal;
        }
    }
    // A sum of unit vectors that cancel is zero or a rounding residue of a few u; its direction would be noise.
    // Each of n additions of partial sums below n rounds by at most n·u: 1e-9 covers vertices of 3000 faces.
    const CANCELLED: f64 = 1e-9;
    let mut cancelled: Vec<bool> = sums.iter().map(|sum| sum.length_squared() < CANCELLED * CANCELLED).collect();
    if cancelled.contains(&true) {
        for (normal, vertices) in face_normals(positions, triangles) {
            for vertex in vertices.map(|vertex| vertex as usize) {
                if std::mem::take(&mut cancelled[vertex]) {
                    sums[vertex] = normal;
                }
            }
        }
    }
    sums.into_iter().map(|sum| sum.normalize_or(DVec3::Z).as_vec3()).collect()
}

/// The unit normals of all faces that have one, in order.
fn face_normals(positions: &[Vec3], triangles: &[[u32; 3]]) -> impl Iterator<Item = (DVec3, [u32; 3])> {
    triangles.iter().filter_map(|&vertices| {
        let [Some(&a), Some(&b), Some(&c)] = vertices.map(|vertex| positions.get(vertex as usize)) else { return None };
        Some((face_normal([a, b, c])?, vertices))
    })
}

/// The share of face corners whose vertex normal lies within `angle_cos` of the face's own; 1 for a mesh without area.
pub fn share_of_gentle_corners(positions: &[Vec3], triangles: &[[u32; 3]], normals: &[Vec3], angle_cos: f64) -> f64 {
    let (mut n_corners, mut n_gentle) = (0_usize, 0_usize);
    for (normal, vertices) in face_normals(positions, triangles) {
        for vertex in vertices {
            n_corners += 1;
            let vertex_normal = normals.get(vertex as usize).map_or(DVec3::ZERO, |n| n.as_dvec3());
            n_gentle += usize::from(vertex_normal.dot(normal) >= angle_cos);
        }
    }
    if n_corners == 0 { 1.0 } else { n_gentle as f64 / n_corners as f64 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_vertex_normal_is_the_unweighted_mean_of_its_faces_whatever_their_area() {
        // A large face in the xy plane and a small one in the yz plane share the y axis edge.
        let positions = [Vec3::ZERO, Vec3::new(0.0, 1.0, 0.0), Vec3::new(100.0, 0.0, 0.0), Vec3::new(0.0, 0.0, 0.01)];
        let normals = smooth_normals(&positions, &[[0, 2, 1], [0, 1, 3]]);
        let half = Vec3::new(1.0, 0.0, 1.0).normalize();
        assert!(normals[0].abs_diff_eq(half, 1e-7) && normals[1].abs_diff_eq(half, 1e-7), "{normals:?}");
        assert_eq!((normals[2], normals[3]), (Vec3::Z, Vec3::X));
    }

    #[test]
    fn cancelled_degenerate_unused_and_non_finite_corners_still_get_unit_normals() {
        let nan = Vec3::splat(f32::NAN);
        let positions = [Vec3::ZERO, Vec3::X, Vec3::Y, nan, Vec3::splat(9.0)];
        // Two opposite faces cancel; a line and a NaN face contribute nothing; vertex 4 has no face.
        let faces = [[0, 0, 1], [0, 1, 3], [0, 2, 1], [0, 1, 2], [7, 0, 1]];
        let normals = smooth_normals(&positions, &faces);
        assert_eq!(normals[0], Vec3::NEG_Z, "the first face that has a normal");
        assert!(normals.iter().all(|normal| (normal.length() - 1.0).abs() < 1e-6), "{normals:?}");
    }

    #[test]
    fn the_smallest_and_largest_triangles_have_right_normals() {
        for scale in [1e-38_f32, 1e-45, 3e38] {
            let positions = [Vec3::ZERO, Vec3::X * scale, Vec3::Y * scale];
            assert_eq!(smooth_normals(&positions, &[[0, 1, 2]]), [Vec3::Z; 3], "{scale}");
        }
    }

    #[test]
    fn a_cube_with_shared_corners_is_not_gentle() {
        let positions: Vec<Vec3> =
            (0..8).map(|i| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32)).collect();
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let faces: Vec<[u32; 3]> = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        let normals = smooth_normals(&positions, &faces);
        assert_eq!(share_of_gentle_corners(&positions, &faces, &normals, 0.9), 0.0);
        assert!(normals[0].dot(Vec3::splat(-1.0)) > 1.0, "outward");
    }
}
