//! Vertex normals of smooth meshes.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

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

/// What a face counts for in the normal of a vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weight {
    /// All the same (Gouraud 1971).
    Uniform,
    /// Its area: large faces keep their plane beside the small ones of a bevel.
    Area,
    /// Its angle at the vertex (Thürmer and Wüthrich 1998): how it is cut into triangles makes no difference.
    Angle,
}

/// The normals of the faces of a mesh, from which those of its vertices are made.
///
/// Faces are worked on by all threads of the pool; every sum is made in the order of the faces whatever their number.
#[derive(Debug)]
pub struct FaceNormals<'a> {
    positions: &'a [Vec3],
    triangles: &'a [[u32; 3]],
    /// One per face: zero for one without area, with a NaN or infinite corner, or with an index out of range.
    normals: Vec<DVec3>,
}

impl<'a> FaceNormals<'a> {
    /// Computes them.
    pub fn new(positions: &'a [Vec3], triangles: &'a [[u32; 3]]) -> FaceNormals<'a> {
        let normal = |vertices: &[u32; 3]| match vertices.map(|vertex| positions.get(vertex as usize)) {
            [Some(&a), Some(&b), Some(&c)] => face_normal([a, b, c]).unwrap_or(DVec3::ZERO),
            _ => DVec3::ZERO,
        };
        FaceNormals { positions, triangles, normals: triangles.par_iter().map(normal).collect() }
    }

    /// One unit normal per vertex: the sum of the unit normals of its faces, weighted, normalised. With
    /// [`Weight::Uniform`] as the original does it. Sums are made in f64 in the order of the faces.
    ///
    /// Faces without area and faces with a NaN or infinite corner contribute nothing. Where the sum is zero the normal of
    /// the vertex's first face stands in; a vertex without a face gets +z. The result never holds a NaN. Indices out of
    /// range are passed over.
    pub fn smooth_normals(&self, weight: Weight) -> Vec<Vec3> {
        match weight {
            Weight::Uniform => self.smooth_by(|_, _| 1.0),
            Weight::Area => self.smooth_by(|face, _| self.twice_area(face)),
            Weight::Angle => self.smooth_by(|face, corner| self.angle(face, corner)),
        }
    }

    fn smooth_by(&self, weight: impl Fn(usize, usize) -> f64 + Sync) -> Vec<Vec3> {
        let mut sums = vec![Sum::default(); self.positions.len()];
        // Each thread passes over all faces and keeps to vertices of its own: for the sums' order, and because looking
        // at an index costs little beside a random access to memory.
        let n_vertices_each = sums.len().div_ceil(rayon::current_num_threads().min(8)).max(1);
        sums.par_chunks_mut(n_vertices_each).enumerate().for_each(|(part, sums)| {
            let first = (part * n_vertices_each) as u32;
            for (face, (&normal, vertices)) in self.normals.iter().zip(self.triangles).enumerate() {
                for (corner, vertex) in vertices.iter().enumerate() {
                    if let Some(sum) = sums.get_mut(vertex.wrapping_sub(first) as usize) {
                        sum.add(normal, || weight(face, corner));
                    }
                }
            }
        });
        self.replace_cancelled(&mut sums);
        sums.par_iter().map(|sum| sum.unit().unwrap_or(Vec3::Z)).collect()
    }

    /// Puts the normal of a vertex's first face in the place of a sum that cancels.
    fn replace_cancelled(&self, sums: &mut [Sum]) {
        if !sums.par_iter().any(Sum::is_cancelled) {
            return;
        }
        for (&normal, vertices) in self.normals.iter().zip(self.triangles) {
            if normal != DVec3::ZERO {
                for sum in vertices.map(|vertex| vertex as usize) {
                    if sums[sum].is_cancelled() {
                        sums[sum] = Sum { normal, weight: 1.0 };
                    }
                }
            }
        }
    }

    /// Which vertices have a face with a normal.
    pub fn has_faces(&self) -> Vec<bool> {
        let mut has_faces = vec![false; self.positions.len()];
        for (&normal, vertices) in self.normals.iter().zip(self.triangles) {
            if normal != DVec3::ZERO {
                vertices.iter().for_each(|&vertex| has_faces[vertex as usize] = true);
            }
        }
        has_faces
    }

    /// Adds a corner of a face to the sum of its vertex.
    pub(super) fn add_corner(&self, sum: &mut Sum, weight: Weight, face: usize, corner: usize) {
        sum.add(self.normals[face], || match weight {
            Weight::Uniform => 1.0,
            Weight::Area => self.twice_area(face),
            Weight::Angle => self.angle(face, corner),
        });
    }

    /// The unit normal of a face; zero where it has none.
    pub(super) fn of_face(&self, face: usize) -> DVec3 {
        self.normals[face]
    }

    /// Corners of a face that has a normal.
    fn corners(&self, face: usize) -> [DVec3; 3] {
        self.triangles[face].map(|vertex| self.positions[vertex as usize].as_dvec3())
    }

    fn twice_area(&self, face: usize) -> f64 {
        let [a, b, c] = self.corners(face);
        (b - a).cross(c - a).length()
    }

    /// The angle of a face at a corner, in radians.
    fn angle(&self, face: usize, corner: usize) -> f64 {
        let corners = self.corners(face);
        let [a, b, c] = [0, 1, 2].map(|step| corners[(corner + step) % 3]);
        let (to_b, to_c) = (b - a, c - a);
        libm::atan2(to_b.cross(to_c).length(), to_b.dot(to_c))
    }

    /// The share of face corners whose vertex normal lies within `angle_cos` of the face's own; 1 for a mesh without area.
    pub fn share_of_gentle_corners(&self, normals: &[Vec3], angle_cos: f64) -> f64 {
        let count = |(normal, vertices): (&DVec3, &[u32; 3])| {
            if *normal == DVec3::ZERO {
                return (0, 0);
            }
            let vertex_normal = |vertex: u32| normals.get(vertex as usize).map_or(DVec3::ZERO, |n| n.as_dvec3());
            let is_gentle = |&vertex: &u32| vertex_normal(vertex).dot(*normal) >= angle_cos;
            (3, vertices.iter().filter(|vertex| is_gentle(vertex)).count())
        };
        let add = |a: (usize, usize), b: (usize, usize)| (a.0 + b.0, a.1 + b.1);
        let faces = self.normals.par_iter().zip(self.triangles);
        let (n_corners, n_gentle) = faces.map(count).reduce(|| (0, 0), add);
        if n_corners == 0 { 1.0 } else { n_gentle as f64 / n_corners as f64 }
    }
}

/// The weighted normals of faces around a vertex.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sum {
    normal: DVec3,
    weight: f64,
}

impl Sum {
    /// Adds a face, unless it has no normal.
    #[inline]
    fn add(&mut self, normal: DVec3, weight: impl FnOnce() -> f64) {
        if normal != DVec3::ZERO {
            let weight = weight();
            self.normal += weight * normal;
            self.weight += weight;
        }
    }

    /// Whether faces were added, and cancel. The sum is then zero or a rounding residue of a few u of the weights, and its
    /// direction would be noise.
    fn is_cancelled(&self) -> bool {
        // Each of n additions rounds by at most u of the weight so far: 1e-9 covers vertices of a million faces.
        const CANCELLED: f64 = 1e-9;
        self.weight > 0.0 && self.normal.length() < CANCELLED * self.weight
    }

    /// Its direction; `None` where it cancels or no face was added.
    pub(super) fn unit(&self) -> Option<Vec3> {
        if self.is_cancelled() {
            return None;
        }
        self.normal.try_normalize().map(|unit| unit.as_vec3())
    }
}

/// [`FaceNormals::smooth_normals`] of a mesh, as the original does it.
pub fn smooth_normals(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<Vec3> {
    FaceNormals::new(positions, triangles).smooth_normals(Weight::Uniform)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of numbers from 1/2 to 1.
    const ULP: f32 = 0.5 * f32::EPSILON;

    #[test]
    fn a_vertex_normal_is_the_unweighted_mean_of_its_faces_whatever_their_area() {
        // A large face in the xy plane and a small one in the yz plane share the y axis edge.
        let positions = [Vec3::ZERO, Vec3::new(0.0, 1.0, 0.0), Vec3::new(100.0, 0.0, 0.0), Vec3::new(0.0, 0.0, 0.01)];
        let normals = smooth_normals(&positions, &[[0, 2, 1], [0, 1, 3]]);
        let half = Vec3::new(1.0, 0.0, 1.0).normalize();
        assert!(normals[0].abs_diff_eq(half, ULP) && normals[1].abs_diff_eq(half, ULP), "{normals:?}");
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
        assert!(normals.iter().all(|normal| (normal.length() - 1.0).abs() <= 2.0 * f32::EPSILON), "{normals:?}");
    }

    #[test]
    fn weights_are_areas_and_angles_of_the_faces() {
        // In the xy plane two faces share a right angle at the origin; in the yz plane one has it alone, a tenth as long.
        let positions =
            [Vec3::ZERO, Vec3::X * 10.0, Vec3::new(10.0, 10.0, 0.0), Vec3::Y * 10.0, Vec3::new(0.0, 0.0, 1.0)];
        let faces = [[0, 1, 2], [0, 2, 3], [0, 3, 4]];
        let normal = |weight| FaceNormals::new(&positions, &faces).smooth_normals(weight)[0];
        assert!(normal(Weight::Uniform).abs_diff_eq(Vec3::new(1.0, 0.0, 2.0).normalize(), ULP));
        assert!(normal(Weight::Area).abs_diff_eq(Vec3::new(5.0, 0.0, 100.0).normalize(), ULP));
        assert!(normal(Weight::Angle).abs_diff_eq(Vec3::new(1.0, 0.0, 1.0).normalize(), ULP));
    }

    #[test]
    fn weights_of_the_smallest_and_largest_triangles_neither_vanish_nor_overflow() {
        for scale in [1e-38_f32, 1e-45, 3e38] {
            let positions = [Vec3::ZERO, Vec3::X * scale, Vec3::Y * scale];
            for weight in [Weight::Area, Weight::Angle] {
                assert_eq!(FaceNormals::new(&positions, &[[0, 1, 2]]).smooth_normals(weight), [Vec3::Z; 3], "{scale}");
            }
        }
    }

    #[test]
    fn threads_do_not_show_in_the_bits() {
        let ring: Vec<Vec3> =
            (0..1000).map(|i| Vec3::new((i as f32).sin(), (i as f32).cos(), (i % 7) as f32)).collect();
        let faces: Vec<[u32; 3]> = (0..998).map(|i| [i, i + 1, (i * 37 + 5) % 1000]).collect();
        let with = |n_threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().unwrap();
            pool.install(|| smooth_normals(&ring, &faces))
        };
        assert_eq!(with(1), with(3));
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
        assert_eq!(FaceNormals::new(&positions, &faces).share_of_gentle_corners(&normals, 0.9), 0.0);
        assert!(normals[0].dot(Vec3::splat(-1.0)) > 1.0, "outward");
    }
}
