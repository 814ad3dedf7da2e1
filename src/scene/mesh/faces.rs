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
pub(in crate::scene) struct Faces {
    triangles: Vec<[u32; 3]>,
    polygons: Vec<Polygon>,
    /// Corners of all polygons, one after the other.
    corners: Vec<u32>,
    n_faces: usize,
    too_short: Tally,
    /// Places between faces that are to be found again: how many triangles, reserved ones too, stood before each.
    marks: Vec<usize>,
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

    /// Marks the place behind the faces added so far.
    pub fn mark(&mut self) {
        self.marks.push(self.triangles.len());
    }

    /// Adds the faces of what follows in the file.
    pub fn append(&mut self, next: Faces) {
        let Faces { triangles, polygons, corners, n_faces, too_short, marks } = next;
        let n_before = self.triangles.len();
        self.triangles.extend(triangles);
        self.polygons.extend(
            polygons
                .into_iter()
                .map(|polygon| Polygon { first_triangle: n_before + polygon.first_triangle, ..polygon }),
        );
        self.corners.extend(corners);
        self.n_faces += n_faces;
        self.too_short.append(too_short);
        self.marks.extend(marks.into_iter().map(|mark| n_before + mark));
    }

    /// Visits the corners of all faces with three or more, in the order of the file.
    pub fn for_each_corner(&mut self, mut visit: impl FnMut(&mut u32)) {
        let Faces { triangles, polygons, corners, .. } = self;
        let mut corners = corners.iter_mut();
        let mut n_visited = 0;
        for Polygon { first_triangle, n_corners, .. } in polygons {
            triangles[n_visited..*first_triangle].iter_mut().flatten().for_each(&mut visit);
            corners.by_ref().take(*n_corners).for_each(&mut visit);
            n_visited = *first_triangle + *n_corners - 2;
        }
        triangles[n_visited..].iter_mut().flatten().for_each(visit);
    }

    /// Cuts the polygons, and hands over the triangles of all faces in the order of the file.
    ///
    /// # Errors
    /// When a polygon is too tangled to be cut in reasonable time.
    pub fn cut(self, positions: &[Vec3], findings: &mut Vec<Finding>) -> Outcome<Vec<[u32; 3]>> {
        let mut cutter = Cutter::new(self.corners.len());
        self.cut_with(&mut cutter, positions, findings)
    }

    /// [`Faces::cut`] with a cutter that meshes of one file share, and with it the work that the file may cause.
    ///
    /// # Errors
    /// As [`Faces::cut`].
    pub fn cut_with(
        self,
        cutter: &mut Cutter,
        positions: &[Vec3],
        findings: &mut Vec<Finding>,
    ) -> Outcome<Vec<[u32; 3]>> {
        self.cut_marked(cutter, positions, findings).map(|(triangles, _)| triangles)
    }

    /// [`Faces::cut`], and how many triangles stand before each mark.
    ///
    /// # Errors
    /// As [`Faces::cut`].
    pub fn cut_with_marks(
        self,
        positions: &[Vec3],
        findings: &mut Vec<Finding>,
    ) -> Outcome<(Vec<[u32; 3]>, Vec<usize>)> {
        let mut cutter = Cutter::new(self.corners.len());
        self.cut_marked(&mut cutter, positions, findings)
    }

    fn cut_marked(
        self,
        cutter: &mut Cutter,
        positions: &[Vec3],
        findings: &mut Vec<Finding>,
    ) -> Outcome<(Vec<[u32; 3]>, Vec<usize>)> {
        let Faces { mut triangles, polygons, corners, too_short, mut marks, .. } = self;
        let left_out = too_short.finding(|count| {
            let faces = counted(
                count,
                "face has fewer than three corners and is",
                "faces have fewer than three corners and are",
            );
            format!("{faces} left out")
        });
        findings.extend(left_out.map(Finding::defect));
        let tangled = cut_polygons(cutter, &mut triangles, &polygons, &corners, positions);
        if let Some(Polygon { n_corners, at, .. }) = tangled {
            return Err(Finding::new(*at, "a polygon is too tangled to be cut into triangles in reasonable time")
                .found(format!("{n_corners} corners"))
                .help("triangulate it in the program that wrote it")
                .into());
        }
        if !polygons.is_empty() {
            drop_vacant(&mut triangles, &mut marks);
        }
        Ok((triangles, marks))
    }
}

/// Polygons that a thread cuts at a time.
const POLYGONS_TOGETHER: usize = 1 << 12;

/// Cuts polygons into their places among the triangles. Most are convex or quads and are cut by all threads; the others
/// follow on one, so that what they may cost in all is counted in the order of the file. The polygon at which that is
/// used up, if any.
fn cut_polygons<'a>(
    cutter: &mut Cutter,
    triangles: &mut [[u32; 3]],
    polygons: &'a [Polygon],
    corners: &[u32],
    positions: &[Vec3],
) -> Option<&'a Polygon> {
    let mut work = Vec::with_capacity(polygons.len().div_ceil(POLYGONS_TOGETHER));
    let (mut free, mut n_taken, mut rest) = (&mut *triangles, 0, corners);
    for polygons in polygons.chunks(POLYGONS_TOGETHER) {
        let (Some(first), Some(last)) = (polygons.first(), polygons.last()) else { continue };
        let n_corners = polygons.iter().map(|polygon| polygon.n_corners).sum();
        let (corners, behind) = rest.split_at(n_corners);
        rest = behind;
        let (_, from_first) = std::mem::take(&mut free).split_at_mut(first.first_triangle - n_taken);
        n_taken = last.first_triangle + last.n_corners - 2;
        let (places, behind) = from_first.split_at_mut(n_taken - first.first_triangle);
        free = behind;
        work.push((polygons, corners, places));
    }
    let cut_plain = |(polygons, mut corners, places): (&'a [Polygon], &[u32], &mut [[u32; 3]])| {
        let mut cutter = Cutter::new(0);
        let mut others = Vec::new();
        for polygon in polygons {
            let (ring, behind) = corners.split_at(polygon.n_corners);
            corners = behind;
            match cutter.cut_plain(ring, positions) {
                Some(cut) => {
                    places[polygon.first_triangle - polygons[0].first_triangle..][..cut.len()].copy_from_slice(cut)
                }
                None => others.push((polygon, ring.to_vec())),
            }
        }
        others
    };
    let others: Vec<Vec<(&Polygon, Vec<u32>)>> = work.into_par_iter().map(cut_plain).collect();
    for (polygon, ring) in others.into_iter().flatten() {
        let Some(cut) = cutter.cut(&ring, positions) else { return Some(polygon) };
        triangles[polygon.first_triangle..][..cut.len()].copy_from_slice(cut);
    }
    None
}

/// Closes the gaps that polygons left which needed less than their place.
fn drop_vacant(triangles: &mut Vec<[u32; 3]>, marks: &mut [usize]) {
    let (mut n_seen, mut n_kept) = (0, 0);
    let mut marks = marks.iter_mut().peekable();
    triangles.retain(|&corners| {
        while let Some(mark) = marks.next_if(|mark| **mark == n_seen) {
            *mark = n_kept;
        }
        let is_kept = corners != VACANT;
        n_seen += 1;
        n_kept += usize::from(is_kept);
        is_kept
    });
    marks.for_each(|mark| *mark = n_kept);
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
