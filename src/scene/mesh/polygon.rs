//! Polygons cut into triangles: seen along the main axis of their normal, by exact orientation tests.

use glam::{DVec3, Vec3};
use robust::{Coord, orient2d};

use super::ear::{Budget, EarClipper};

/// Cuts polygons of a file one after the other, in buffers that are kept.
#[derive(Debug)]
pub(in crate::scene) struct Cutter {
    /// Corners without repetitions.
    ring: Vec<u32>,
    /// The same, projected so that the polygon runs counter-clockwise.
    points: Vec<Coord<f64>>,
    triangles: Vec<[u32; 3]>,
    budget: Budget,
}

impl Cutter {
    /// For a file with so many polygon corners in all.
    pub fn new(n_corners: usize) -> Cutter {
        Cutter { ring: Vec::new(), points: Vec::new(), triangles: Vec::new(), budget: Budget::for_corners(n_corners) }
    }

    /// The triangles of a polygon of at least three corners, wound as it is; at most `corners - 2`. `None` when the work
    /// that a file of this size may cause is used up.
    ///
    /// Strictly convex polygons become a fan about their first corner. Others are cut ear by ear ([`EarClipper`]).
    /// A corner that repeats the one before it is skipped; a corner on a straight edge is used, so that neighbouring
    /// faces still meet it. A polygon with a non-finite corner becomes a fan, which the world will drop.
    pub fn cut(&mut self, corners: &[u32], positions: &[Vec3]) -> Option<&[[u32; 3]]> {
        if !self.is_cut_plainly(corners, positions) {
            let Cutter { ring, points, triangles, budget } = self;
            EarClipper::new(points).run(budget, |ear| triangles.push(ear.map(|corner| ring[corner as usize])))?;
        }
        Some(&self.triangles)
    }

    /// [`Cutter::cut`] of a polygon that needs no ears; `None` for another.
    pub fn cut_plain(&mut self, corners: &[u32], positions: &[Vec3]) -> Option<&[[u32; 3]]> {
        self.is_cut_plainly(corners, positions).then_some(&self.triangles)
    }

    /// Cuts a polygon that is strictly convex, a quad, or has no area; of another only the ring is left to be cut.
    fn is_cut_plainly(&mut self, corners: &[u32], positions: &[Vec3]) -> bool {
        let Cutter { ring, points, triangles, budget: _ } = self;
        triangles.clear();
        if !skip_repetitions(corners, positions, ring)
            || !project(ring, positions, points)
            || is_strictly_convex(points)
        {
            fan(ring, triangles);
        } else if let Some(diagonal) = diagonal_of_quad(points) {
            ring.rotate_left(diagonal);
            fan(ring, triangles);
        } else {
            return false;
        }
        true
    }
}

fn fan(ring: &[u32], triangles: &mut Vec<[u32; 3]>) {
    if let [apex, rim @ ..] = ring {
        triangles.extend(rim.windows(2).map(|edge| [*apex, edge[0], edge[1]]));
    }
}

fn position(corner: u32, positions: &[Vec3]) -> Vec3 {
    positions.get(corner as usize).copied().unwrap_or(Vec3::NAN)
}

/// Fills `ring` with the corners that differ from the one before; false when a corner is not finite, all are kept then.
fn skip_repetitions(corners: &[u32], positions: &[Vec3], ring: &mut Vec<u32>) -> bool {
    ring.clear();
    ring.extend_from_slice(corners);
    let at = |corner: u32| position(corner, positions);
    if !ring.iter().all(|&corner| at(corner).is_finite()) {
        return false;
    }
    ring.dedup_by(|later, earlier| at(*later) == at(*earlier));
    while ring.len() > 1 && at(ring[0]) == at(ring[ring.len() - 1]) {
        ring.pop();
    }
    true
}

/// Drops the coordinate along which the Newell normal is longest, so that the polygon runs counter-clockwise in the
/// plane of the other two. Exact: coordinates are only copied. False when the normal is zero or there is no triangle.
fn project(ring: &[u32], positions: &[Vec3], points: &mut Vec<Coord<f64>>) -> bool {
    let at = |corner: u32| position(corner, positions).as_dvec3();
    let [first, rim @ ..] = ring else { return false };
    // Newell's sum, taken from the first corner so that a place far from the origin costs no digits.
    let first = at(*first);
    let twice_area: DVec3 = rim.windows(2).map(|edge| (at(edge[0]) - first).cross(at(edge[1]) - first)).sum();
    let [x, y, z] = twice_area.abs().to_array();
    if x + y + z == 0.0 {
        return false;
    }
    let (u, v, normal) = if x >= y && x >= z {
        (1, 2, twice_area.x)
    } else if y >= z {
        (2, 0, twice_area.y)
    } else {
        (0, 1, twice_area.z)
    };
    let (u, v) = if normal < 0.0 { (v, u) } else { (u, v) };
    points.clear();
    points.extend(ring.iter().map(|&corner| Coord { x: at(corner)[u], y: at(corner)[v] }));
    if relative_edge_length(points, |p| p.x) > relative_edge_length(points, |p| p.y) {
        // A quarter turn: the clipper sorts by x, and is fast where ears are narrow in x.
        points.iter_mut().for_each(|p| *p = Coord { x: p.y, y: -p.x });
    }
    true
}

/// Length of all edges along an axis, over the extent of the polygon along it.
fn relative_edge_length(points: &[Coord<f64>], along: fn(&Coord<f64>) -> f64) -> f64 {
    let length: f64 = points.windows(2).map(|edge| (along(&edge[1]) - along(&edge[0])).abs()).sum();
    let (low, high) = points.iter().map(along).fold((f64::MAX, f64::MIN), |(low, high), x| (low.min(x), high.max(x)));
    length / (high - low).max(f64::MIN_POSITIVE)
}

/// Whether every corner turns left and the ring goes around once. A ring of left turns goes around as often as its
/// edges change from pointing right to pointing left.
fn is_strictly_convex(points: &[Coord<f64>]) -> bool {
    let n = points.len();
    let at = |row: usize| points[row % n];
    let points_right = |row: usize| {
        let (from, to) = (at(row), at(row + 1));
        (from.x, from.y) < (to.x, to.y)
    };
    let mut n_changes = 0;
    for row in 0..n {
        if orient2d(at(row), at(row + 1), at(row + 2)) <= 0.0 {
            return false;
        }
        n_changes += usize::from(points_right(row) != points_right(row + 1));
    }
    n_changes == 2
}

/// The corner of a quad from which a diagonal cuts it: the one that does not turn left. `None` when it is no quad, or
/// crosses itself.
fn diagonal_of_quad(points: &[Coord<f64>]) -> Option<usize> {
    let &[a, b, c, d] = points else { return None };
    let turns_left =
        [orient2d(d, a, b), orient2d(a, b, c), orient2d(b, c, d), orient2d(c, d, a)].map(|turn| turn > 0.0);
    match turns_left {
        [false, true, true, true] | [true, true, false, true] => Some(0),
        [true, false, true, true] | [true, true, true, false] => Some(1),
        _ => None,
    }
}

#[cfg(test)]
mod tests;
