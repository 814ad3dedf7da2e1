//! Smooth normals with sharp edges: vertices are split along creases.
//!
//! An edge joins two faces when the angle between their normals is at most the crease angle; two corners are on one edge
//! when their faces name the same two vertices, whatever their winding. Around a vertex, faces that are joined, directly
//! or by way of others, are a fan, and each fan has a row and a normal of its own.

use glam::Vec3;
use rayon::prelude::*;

use super::normals::{FaceNormals, Sum, Weight};
use crate::numeric::U;

/// A mesh whose vertices are split along creases.
#[derive(Clone, Debug)]
pub struct Creased {
    /// The positions that were there, and behind them those of further fans.
    pub positions: Vec<Vec3>,
    /// The triangles, in the same order.
    pub triangles: Vec<[u32; 3]>,
    /// One unit normal per position.
    pub normals: Vec<Vec3>,
}

/// Faces at an edge beyond which it joins none: pairs are compared one by one. Surfaces have two.
const MOST_FACES_AT_EDGE: usize = 16;

/// More than the roundings of two normalisations, of their dot product and of the crease angle's cosine add up to: an edge
/// that is exactly as sharp as the crease angle must not fall to either side by chance (`docs/NUMERICS.md`).
const COSINE_ROUNDING: f64 = 16.0 * U;

/// Splits vertices along edges that are sharper than an angle. Each fan's normal is the sum of its faces' as in
/// [`FaceNormals::smooth_normals`]. The fan of a vertex's first face keeps its row; the rows of others follow behind all
/// vertices, in the order of vertices and then of the fans' first faces. Faces without a normal stay with the first fan.
///
/// All indices must be in range. The result does not depend on the number of threads.
pub fn split_at_creases(
    positions: Vec<Vec3>,
    mut triangles: Vec<[u32; 3]>,
    weight: Weight,
    crease_angle_degrees: f64,
) -> Creased {
    let faces = FaceNormals::new(&positions, &triangles);
    let incidence = Incidence::new(positions.len(), &triangles);
    let least_cosine = libm::cos(crease_angle_degrees.to_radians()) - COSINE_ROUNDING;

    // The fans of each vertex, in pieces of vertices whose number does not depend on threads.
    const VERTICES_TOGETHER: usize = 1 << 12;
    let n_pieces = positions.len().div_ceil(VERTICES_TOGETHER);
    let fans_of_piece = |piece: usize| {
        let first = piece * VERTICES_TOGETHER;
        let mut around = Around::default();
        let mut fans = Fans::default();
        for vertex in first..positions.len().min(first + VERTICES_TOGETHER) {
            let corners = incidence.corners(vertex);
            around.find(vertex as u32, corners, &triangles, &faces, least_cosine);
            around.sum(corners, &faces, weight, &mut fans);
        }
        fans
    };
    let pieces: Vec<Fans> = (0..n_pieces).into_par_iter().map(fans_of_piece).collect();

    // Rows of further fans, behind all vertices.
    let n_more: usize = pieces.iter().map(|fans| fans.more_normals.len()).sum();
    let mut normals = Vec::with_capacity(positions.len() + n_more);
    pieces.iter().for_each(|fans| normals.extend_from_slice(&fans.first_normals));
    let mut split_from = Vec::with_capacity(n_more);
    let mut moved = Vec::new();
    for fans in &pieces {
        let first_row = normals.len() as u32;
        normals.extend_from_slice(&fans.more_normals);
        split_from.extend_from_slice(&fans.split_from);
        moved.extend(fans.moved.iter().map(|&(corner, fan)| (corner, first_row + fan)));
    }
    for (corner, row) in moved {
        triangles[corner as usize / 3][corner as usize % 3] = row;
    }
    let mut positions = positions;
    positions.reserve_exact(n_more);
    for vertex in split_from {
        positions.push(positions[vertex as usize]);
    }
    Creased { positions, triangles, normals }
}

/// The corners of faces at each vertex, in the order of the faces; corner 3·face + place.
struct Incidence {
    /// By vertex: where its corners begin; one more at the end.
    first: Vec<u32>,
    corners: Vec<u32>,
}

impl Incidence {
    fn new(n_vertices: usize, triangles: &[[u32; 3]]) -> Incidence {
        let mut first = vec![0_u32; n_vertices + 1];
        triangles.iter().flatten().for_each(|&vertex| first[vertex as usize + 1] += 1);
        for vertex in 0..n_vertices {
            first[vertex + 1] += first[vertex];
        }
        let mut next = first.clone();
        let mut corners = vec![0; 3 * triangles.len()];
        for (corner, &vertex) in triangles.iter().flatten().enumerate() {
            corners[next[vertex as usize] as usize] = corner as u32;
            next[vertex as usize] += 1;
        }
        Incidence { first, corners }
    }

    fn corners(&self, vertex: usize) -> &[u32] {
        &self.corners[self.first[vertex] as usize..self.first[vertex + 1] as usize]
    }
}

/// What was found around the vertices of a piece.
#[derive(Default)]
struct Fans {
    /// One for each vertex.
    first_normals: Vec<Vec3>,
    /// One for each further fan, and the vertex it belongs to.
    more_normals: Vec<Vec3>,
    split_from: Vec<u32>,
    /// Corners that belong to a further fan: which of `more_normals`.
    moved: Vec<(u32, u32)>,
}

/// The fans around one vertex, in memory that is used again.
#[derive(Default)]
struct Around {
    vertex: u32,
    /// By place in the list of corners: another of its fan, or itself; an earlier one always.
    earlier: Vec<usize>,
    /// The other end of an edge, and the place of the corner whose face has it.
    edges: Vec<(u32, usize)>,
    /// By place, for those that begin a fan: the sum of its faces, and its row among the further ones.
    sums: Vec<Sum>,
    rows: Vec<Option<u32>>,
}

impl Around {
    /// Joins the corners of a vertex to fans.
    fn find(&mut self, vertex: u32, corners: &[u32], triangles: &[[u32; 3]], faces: &FaceNormals, least_cosine: f64) {
        self.vertex = vertex;
        self.earlier.clear();
        self.earlier.extend(0..corners.len());
        self.edges.clear();
        for (place, &corner) in corners.iter().enumerate() {
            let (face, corner) = (corner as usize / 3, corner as usize % 3);
            if faces.of_face(face) != glam::DVec3::ZERO {
                self.edges.extend([1, 2].map(|step| (triangles[face][(corner + step) % 3], place)));
            }
        }
        self.edges.sort_unstable();
        let edges = std::mem::take(&mut self.edges);
        for edge in edges.chunk_by(|a, b| a.0 == b.0).filter(|edge| edge.len() <= MOST_FACES_AT_EDGE) {
            for (at, &(_, a)) in edge.iter().enumerate() {
                for &(_, b) in &edge[at + 1..] {
                    let [normal_a, normal_b] = [a, b].map(|place| faces.of_face(corners[place] as usize / 3));
                    if normal_a.dot(normal_b) >= least_cosine {
                        self.join(a, b);
                    }
                }
            }
        }
        self.edges = edges;
    }

    /// The earliest corner of the fan of a corner.
    fn begin(&mut self, mut place: usize) -> usize {
        while self.earlier[place] != place {
            self.earlier[place] = self.earlier[self.earlier[place]];
            place = self.earlier[place];
        }
        place
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.begin(a), self.begin(b));
        self.earlier[a.max(b)] = a.min(b);
    }

    /// Sums up the normals of each fan and names the corners of all but the first.
    fn sum(&mut self, corners: &[u32], faces: &FaceNormals, weight: Weight, fans: &mut Fans) {
        self.sums.clear();
        self.sums.resize(corners.len(), Sum::default());
        self.rows.clear();
        self.rows.resize(corners.len(), None);
        let mut first_fan = None;
        for (place, &corner) in corners.iter().enumerate() {
            let (face, in_face) = (corner as usize / 3, corner as usize % 3);
            if faces.of_face(face) == glam::DVec3::ZERO {
                continue;
            }
            let begin = self.begin(place);
            faces.add_corner(&mut self.sums[begin], weight, face, in_face);
            if *first_fan.get_or_insert(begin) == begin {
                continue;
            }
            let row = *self.rows[begin].get_or_insert_with(|| {
                fans.split_from.push(self.vertex);
                fans.split_from.len() as u32 - 1
            });
            fans.moved.push((corner, row));
        }
        // Where a sum cancels the fan's first face stands in.
        let unit = |begin: usize| {
            self.sums[begin].unit().unwrap_or_else(|| faces.of_face(corners[begin] as usize / 3).as_vec3())
        };
        fans.first_normals.push(first_fan.map_or(Vec3::Z, unit));
        fans.more_normals.extend((0..corners.len()).filter(|&place| self.rows[place].is_some()).map(unit));
    }
}

#[cfg(test)]
mod tests;
