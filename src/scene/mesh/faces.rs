//! Faces on their way to triangles.
//!
//! Triangles are kept as they are. Larger polygons wait until all positions are known, since a file may name its faces
//! before its vertices; each has its place among the triangles reserved, so that the order of the file is kept.

use std::sync::atomic::{AtomicUsize, Ordering};

use glam::Vec3;
use rayon::prelude::*;

use super::finding::{At, Finding, Outcome, Tally, counted};
use super::polygon::Cutter;

/// Marks a reserved triangle that its polygon did not need.
const VACANT: [u32; 3] = [u32::MAX; 3];

/// Faces in the order of the file. Whoever adds one has seen that its indices are in range.
#[derive(Debug, Default)]
pub(super) struct Faces {
    triangles: Vec<[u32; 3]>,
    polygons: Vec<Polygon>,
    /// Corners of all polygons, one after the other.
    corners: Vec<u32>,
    n_faces: usize,
    too_short: Tally,
}

#[derive(Debug)]
struct Polygon {
    /// Where its `n - 2` reserved triangles begin.
    first_triangle: usize,
    n_corners: usize,
    at: At,
}

impl Faces {
    /// Faces that are triangles all.
    pub fn of_triangles(triangles: Vec<[u32; 3]>) -> Faces {
        Faces { n_faces: triangles.len(), triangles, ..Faces::default() }
    }

    /// Makes room for triangles; only for counts that the data bears out.
    pub fn reserve(&mut self, n_triangles: usize) {
        self.triangles.reserve_exact(n_triangles);
    }

    /// Faces added so far, also those with too few corners.
    pub fn len(&self) -> usize {
        self.n_faces
    }

    #[inline]
    pub fn push_triangle(&mut self, corners: [u32; 3]) {
        self.triangles.push(corners);
        self.n_faces += 1;
    }

    /// Adds triangles, found by all threads, up to the first that is none; returns how many.
    pub fn extend_triangles(&mut self, triangles: impl IndexedParallelIterator<Item = Option<[u32; 3]>>) -> usize {
        let before = self.triangles.len();
        let n_right = AtomicUsize::new(triangles.len());
        self.triangles.par_extend(triangles.enumerate().map(|(row, triangle)| {
            triangle.unwrap_or_else(|| {
                n_right.fetch_min(row, Ordering::Relaxed);
                VACANT
            })
        }));
        let n_right = n_right.into_inner();
        self.triangles.truncate(before + n_right);
        self.n_faces += n_right;
        n_right
    }

    /// Gives every vertex the row that `rows` has for it.
    pub fn renumber(&mut self, rows: &[u32]) {
        let renumber = |vertex: &mut u32| {
            // Reserved places stay what they are.
            if let Some(&row) = rows.get(*vertex as usize) {
                *vertex = row;
            }
        };
        self.triangles.par_iter_mut().flatten().for_each(renumber);
        self.corners.iter_mut().for_each(renumber);
    }

    /// Adds a polygon. One with fewer than three corners is left out and counted.
    #[inline]
    pub fn push(&mut self, corners: &[u32], at: At) {
        match *corners {
            [a, b, c] => self.push_triangle([a, b, c]),
            [_, _, _, ..] => self.push_polygon(corners, at),
            _ => {
                self.too_short.add(at);
                self.n_faces += 1;
            }
        }
    }

    fn push_polygon(&mut self, corners: &[u32], at: At) {
        self.polygons.push(Polygon { first_triangle: self.triangles.len(), n_corners: corners.len(), at });
        self.corners.extend_from_slice(corners);
        self.triangles.resize(self.triangles.len() + corners.len() - 2, VACANT);
        self.n_faces += 1;
    }

    /// Adds a triangle strip, every second triangle turned; triangles that name a vertex twice only steer the strip and
    /// are left out. Counts as one face.
    pub fn push_strip(&mut self, strip: &[u32]) {
        for (row, corners) in strip.windows(3).enumerate() {
            if let &[a, b, c] = corners
                && a != b
                && b != c
                && c != a
            {
                self.triangles.push(if row % 2 == 0 { [a, b, c] } else { [b, a, c] });
            }
        }
        self.n_faces += 1;
    }

    /// Cuts the polygons, and hands over the triangles of all faces in the order of the file.
    ///
    /// # Errors
    /// When a polygon is too tangled to be cut in reasonable time.
    pub fn cut(self, positions: &[Vec3], findings: &mut Vec<Finding>) -> Outcome<Vec<[u32; 3]>> {
        let Faces { mut triangles, polygons, corners, too_short, .. } = self;
        let left_out = too_short.finding(|count| {
            let faces = counted(
                count,
                "face has fewer than three corners and is",
                "faces have fewer than three corners and are",
            );
            format!("{faces} left out")
        });
        findings.extend(left_out.map(Finding::defect));
        let mut cutter = Cutter::new(corners.len());
        let mut rest = corners.as_slice();
        let mut n_vacant = 0;
        for Polygon { first_triangle, n_corners, at } in polygons {
            let (corners, behind) = rest.split_at(n_corners);
            rest = behind;
            let cut = cutter.cut(corners, positions);
            let Some(cut) = cut else {
                return Err(Finding::new(at, "a polygon is too tangled to be cut into triangles in reasonable time")
                    .found(format!("{n_corners} corners"))
                    .help("triangulate it in the program that wrote it")
                    .into());
            };
            triangles[first_triangle..][..cut.len()].copy_from_slice(cut);
            n_vacant += n_corners - 2 - cut.len();
        }
        if n_vacant > 0 {
            triangles.retain(|&corners| corners != VACANT);
        }
        Ok(triangles)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polygons_keep_their_place_among_triangles() {
        let square = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(x, y)| Vec3::new(x, y, 0.0));
        let mut faces = Faces::default();
        faces.push(&[2, 1, 0], At::File);
        faces.push(&[0, 1, 2, 3], At::File);
        faces.push(&[0, 1], At::Line(0));
        faces.push(&[3, 2, 1], At::File);
        assert_eq!(faces.len(), 4);
        let mut findings = Vec::new();
        assert_eq!(faces.cut(&square, &mut findings).unwrap(), [[2, 1, 0], [0, 1, 2], [0, 2, 3], [3, 2, 1]]);
        assert_eq!(findings[0].what, "1 face has fewer than three corners and is left out");
    }

    #[test]
    fn a_strip_turns_every_second_triangle_and_drops_those_that_only_steer_it() {
        let mut faces = Faces::default();
        faces.push_strip(&[0, 1, 2, 3, 3, 4]);
        assert_eq!(faces.cut(&[], &mut Vec::new()).unwrap(), [[0, 1, 2], [2, 1, 3]]);
    }
}
