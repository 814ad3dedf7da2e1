//! Closed meshes.

use std::collections::HashMap;
use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec3, dvec3};

use crate::world::MeshInput;

/// A mesh around a centre.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Vertices.
    pub positions: Vec<Vec3>,
    /// Triangles, counter-clockwise from outside.
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// As a world takes it.
    pub fn input(&self) -> MeshInput {
        MeshInput { positions: self.positions.clone(), triangles: self.triangles.clone(), ..MeshInput::default() }
    }

    /// The corners of a triangle.
    pub fn corners(&self, triangle: usize) -> [Vec3; 3] {
        self.triangles[triangle].map(|vertex| self.positions[vertex as usize])
    }

    /// The mesh scaled and moved, rounded to f32.
    pub fn placed(&self, size: f64, at: DVec3) -> Mesh {
        let place = |p: &Vec3| (size * p.as_dvec3() + at).as_vec3();
        Mesh { positions: self.positions.iter().map(place).collect(), triangles: self.triangles.clone() }
    }

    /// Cuts each triangle of a mesh on the unit sphere into four.
    fn quarter(&mut self) {
        let mut middles = HashMap::new();
        for [a, b, c] in std::mem::take(&mut self.triangles) {
            let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(from, to)| {
                *middles.entry((from.min(to), from.max(to))).or_insert_with(|| {
                    let sum = self.positions[from as usize].as_dvec3() + self.positions[to as usize].as_dvec3();
                    self.positions.push(sum.normalize().as_vec3());
                    self.positions.len() as u32 - 1
                })
            });
            self.triangles.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
    }

    fn quad(&mut self, [a, b, c, d]: [u32; 4]) {
        self.triangles.push([a, b, c]);
        self.triangles.push([a, c, d]);
    }
}

/// A unit sphere of rings and segments.
pub fn lat_long(n_segments: u32, n_rings: u32) -> Mesh {
    let mut mesh = Mesh { positions: vec![Vec3::Y], triangles: Vec::new() };
    for ring in 1..n_rings {
        let (sin, cos) = libm::sincos(PI * f64::from(ring) / f64::from(n_rings));
        for segment in 0..n_segments {
            let (s, c) = libm::sincos(TAU * f64::from(segment) / f64::from(n_segments));
            mesh.positions.push(dvec3(sin * c, cos, -sin * s).as_vec3());
        }
    }
    let south = mesh.positions.len() as u32;
    mesh.positions.push(Vec3::NEG_Y);
    let vertex = |ring: u32, segment: u32| 1 + (ring - 1) * n_segments + segment % n_segments;
    for s in 0..n_segments {
        mesh.triangles.push([0, vertex(1, s), vertex(1, s + 1)]);
        for ring in 1..n_rings - 1 {
            let (next, below) = (s + 1, ring + 1);
            mesh.quad([vertex(ring, s), vertex(below, s), vertex(below, next), vertex(ring, next)]);
        }
        mesh.triangles.push([vertex(n_rings - 1, s), south, vertex(n_rings - 1, s + 1)]);
    }
    mesh
}

/// An icosahedron inscribed in the unit sphere, its faces quartered a number of times.
pub fn icosphere(n_subdivisions: u32) -> Mesh {
    let golden = 0.5 * (1.0 + 5.0_f64.sqrt());
    let mut corners = Vec::new();
    for (short, long) in [(1.0, golden), (-1.0, golden), (1.0, -golden), (-1.0, -golden)] {
        corners.extend([dvec3(0.0, short, long), dvec3(short, long, 0.0), dvec3(long, 0.0, short)]);
    }
    let mut mesh = Mesh { positions: corners.iter().map(|p| p.normalize().as_vec3()).collect(), triangles: Vec::new() };
    // Faces are the triples of neighbours; neighbours are 2 apart.
    let neighbours = |a: usize, b: usize| corners[a].distance_squared(corners[b]) < 4.1;
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if neighbours(a, b) && neighbours(b, c) && neighbours(c, a) {
                    let outwards = corners[a].dot(corners[b].cross(corners[c])) > 0.0;
                    let [a, b, c] = [a, b, c].map(|corner| corner as u32);
                    mesh.triangles.push(if outwards { [a, b, c] } else { [a, c, b] });
                }
            }
        }
    }
    (0..n_subdivisions).for_each(|_| mesh.quarter());
    mesh
}

/// The cube [−1, 1]³ of twelve triangles.
pub fn cube() -> Mesh {
    let corner = |i: u32| Vec3::new(f32::from(i & 1 != 0), f32::from(i & 2 != 0), f32::from(i & 4 != 0)) * 2.0 - 1.0;
    let mut mesh = Mesh { positions: (0..8).map(corner).collect(), triangles: Vec::new() };
    for quad in [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]] {
        mesh.quad(quad);
    }
    mesh
}

/// A block with a bumpy top of n × n cells over a flat bottom, in [−1, 1]³.
pub fn bumpy_block(n: u32) -> Mesh {
    let mut mesh = Mesh::default();
    let across = |i: u32| 2.0 * f64::from(i) / f64::from(n) - 1.0;
    for level in [0, 1] {
        for j in 0..=n {
            for i in 0..=n {
                let (x, y) = (across(i), across(j));
                let top = 0.7 + 0.25 * libm::sin(11.0 * x + 3.0 * y) * libm::cos(7.0 * y - 5.0 * x);
                mesh.positions.push(dvec3(x, y, if level == 0 { -1.0 } else { top }).as_vec3());
            }
        }
    }
    let at = |level: u32, i: u32, j: u32| level * (n + 1) * (n + 1) + j * (n + 1) + i;
    for j in 0..n {
        for i in 0..n {
            mesh.quad([at(1, i, j), at(1, i + 1, j), at(1, i + 1, j + 1), at(1, i, j + 1)]);
            mesh.quad([at(0, i, j), at(0, i, j + 1), at(0, i + 1, j + 1), at(0, i + 1, j)]);
        }
        mesh.quad([at(0, j, 0), at(0, j + 1, 0), at(1, j + 1, 0), at(1, j, 0)]);
        mesh.quad([at(0, j + 1, n), at(0, j, n), at(1, j, n), at(1, j + 1, n)]);
        mesh.quad([at(0, 0, j + 1), at(0, 0, j), at(1, 0, j), at(1, 0, j + 1)]);
        mesh.quad([at(0, n, j), at(0, n, j + 1), at(1, n, j + 1), at(1, n, j)]);
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn meshes_are_closed_and_turned_outwards() {
        for mesh in [lat_long(16, 9), lat_long(3, 20), icosphere(0), icosphere(2), cube(), bumpy_block(6)] {
            let mut edges = HashMap::new();
            let mut volume = 0.0;
            for (index, &[a, b, c]) in mesh.triangles.iter().enumerate() {
                for (from, to) in [(a, b), (b, c), (c, a)] {
                    *edges.entry((from, to)).or_insert(0) += 1;
                }
                let [p, q, r] = mesh.corners(index).map(|corner| corner.as_dvec3());
                volume += p.dot(q.cross(r));
            }
            assert!(edges.iter().all(|(&(from, to), &n)| n == 1 && edges.get(&(to, from)) == Some(&1)));
            assert!(volume > 1.0, "{volume}");
        }
    }
}
