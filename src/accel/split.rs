//! Large triangles in several boxes each, before the tree is built: the triangle splitting of Karras and Aila, *Fast Parallel
//! Construction of High-Quality Bounding Volume Hierarchies*, High Performance Graphics 2013.
//!
//! A long triangle fills little of its box, and a large one reaches into many parts of a scene. Cut at planes that all
//! triangles have in common, its pieces have boxes that lie in one part each. A piece is a box and the whole triangle: a ray
//! that meets the triangle meets it inside of one of the boxes, and whichever leaf it finds it in, the hit is the same.
//!
//! Meshes gain nothing from it, whose triangles are all about as large as their share of the scene: only where a ray would meet
//! boxes many times as large is anything cut.
//!
//! As in the paper, a triangle gets splits in proportion to the cube root of what its box wastes, weighted by the plane that would
//! cut it: 2⁻ⁱ for one of the 2ⁱ planes that halve the cells of level i. Departure: the splits that a piece has left are
//! shared between its halves by the area of their boxes, which needs no second weight.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::area::Scale;
use crate::numeric::U;
use crate::world::{Bounds, PrimKind, PrimRef, World};

/// A box is large when its area is so many times an equal share of the scene's. Those of meshes are mostly below ten.
const LARGE: f64 = 16.0;

/// So many large boxes a random ray through the scene must meet for cutting to be worth it. In meshes it is 0.2 at most, in
/// a building of slabs, columns and pipes 33. Where it is hundreds, nearly everything is large: slivers in all directions, or many in one
/// box ([`super::sliver`]).
const LARGE_MET: std::ops::Range<f64> = 4.0..400.0;

/// Levels of planes along each axis.
const LEVELS: u32 = 16;

/// Most splits of one triangle.
const MAX_SPLITS: u32 = 255;

/// Rounding of a point where an edge meets a plane, in shares of the largest coordinate (`docs/NUMERICS.md`, "Boxes of pieces").
pub(super) const CLIP_ERROR: f64 = 20.0 * U;

/// Corners of a piece at most: a plane adds one, and along each axis only the last plane of either side still cuts.
const MAX_CORNERS: usize = 9;

/// Cuts triangles until there are up to `share` times as many boxes more; nothing where that gains nothing.
pub fn split(world: &World, prims: &mut Vec<PrimRef>, boxes: &mut Vec<Bounds>, scale: &Scale, share: f64) {
    let planes = Planes::of(scale);
    // Where most of a scene is large, a few cuts are lost on it.
    if !LARGE_MET.contains(&planes.n_large_met(boxes)) {
        return;
    }
    let weights: Vec<f32> = prims.par_iter().zip(&*boxes).map(|(&prim, b)| planes.weight(world, prim, b)).collect();
    let budget = (share * prims.len() as f64) as u64;
    let Some(factor) = factor_of(&weights, budget) else { return };
    let pieces: Vec<(Vec<PrimRef>, Vec<Bounds>)> = (0..prims.len().div_ceil(CHUNK))
        .into_par_iter()
        .map(|chunk| {
            let rows = chunk * CHUNK..prims.len().min((chunk + 1) * CHUNK);
            let (mut cut_prims, mut cut_boxes) = (Vec::with_capacity(rows.len()), Vec::with_capacity(rows.len()));
            for row in rows {
                match splits_of(weights[row], factor) {
                    0 => cut_boxes.push(boxes[row]),
                    n => planes.cut(world.triangles.corners(prims[row].row()), boxes[row], n, &mut cut_boxes),
                }
                cut_prims.resize(cut_boxes.len(), prims[row]);
            }
            (cut_prims, cut_boxes)
        })
        .collect();
    prims.clear();
    boxes.clear();
    for (cut_prims, cut_boxes) in pieces {
        prims.extend(cut_prims);
        boxes.extend(cut_boxes);
    }
}

/// Primitives that one thread works on at a time.
const CHUNK: usize = 4096;

fn splits_of(weight: f32, factor: f64) -> u32 {
    // The cast is the floor.
    ((f64::from(weight) * factor) as u32).min(MAX_SPLITS)
}

/// The factor that turns weights into as many splits as the budget allows, by bisection; `None` when nothing is to be cut.
fn factor_of(weights: &[f32], budget: u64) -> Option<f64> {
    // Sums of whole numbers and of runs in their order do not depend on threads.
    let sums: Vec<f64> = weights.par_chunks(CHUNK).map(|run| run.iter().map(|&w| f64::from(w)).sum()).collect();
    let sum: f64 = sums.iter().sum();
    if budget == 0 || sum <= 0.0 {
        return None;
    }
    let n_splits = |factor: f64| weights.par_iter().map(|&w| u64::from(splits_of(w, factor))).sum::<u64>();
    // Floors lose less than one split a triangle, so that this is too little at most.
    let (mut low, mut high) = (budget as f64 / sum, (budget as f64 + weights.len() as f64) / sum);
    for _ in 0..8 {
        let middle = 0.5 * (low + high);
        if n_splits(middle) <= budget { low = middle } else { high = middle }
    }
    Some(low)
}

/// The planes that halve a scene again and again along each axis.
struct Planes<'a> {
    scale: &'a Scale,
    lo: DVec3,
    extent: DVec3,
}

/// A plane across an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Plane {
    axis: usize,
    at: f64,
    /// Planes of level i halve the cells of level i.
    level: u32,
}

impl Planes<'_> {
    fn of(scale: &Scale) -> Planes<'_> {
        Planes { scale, lo: scale.whole.lo.as_dvec3(), extent: scale.whole.extent() }
    }

    fn half_area(&self, bounds: &Bounds) -> f64 {
        f64::from(self.scale.half_area(bounds))
    }

    /// How many large boxes a random ray through the scene meets.
    fn n_large_met(&self, boxes: &[Bounds]) -> f64 {
        let whole = self.half_area(&self.scale.whole);
        let large = LARGE * whole / boxes.len() as f64;
        let area = |b: &Bounds| Some(self.half_area(b)).filter(|&area| area > large).unwrap_or(0.0);
        // Runs in their order, so that the sum does not depend on threads.
        let sums: Vec<f64> = boxes.par_chunks(CHUNK).map(|run| run.iter().map(area).sum()).collect();
        sums.iter().sum::<f64>() / whole
    }

    /// The plane of the lowest level that cuts a box, across its longest edge where several are of that level.
    fn best(&self, bounds: &Bounds) -> Option<Plane> {
        let n_cells = f64::from(1u32 << LEVELS);
        let cell = |p: Vec3, axis: usize| {
            let cell = (f64::from(p[axis]) - self.lo[axis]) / self.extent[axis] * n_cells;
            // NaN, along an axis in which the scene is flat, counts as 0.
            cell.clamp(0.0, n_cells - 1.0) as u32
        };
        let mut best: Option<Plane> = None;
        for axis in 0..3 {
            let (low, high) = (cell(bounds.lo, axis), cell(bounds.hi, axis));
            if low == high {
                continue;
            }
            let bit = (low ^ high).ilog2();
            let at = self.lo[axis] + self.extent[axis] * (f64::from(high >> bit << bit) / n_cells);
            let plane = Plane { axis, at, level: LEVELS - 1 - bit };
            // Rounding may have put the plane on the edge of the box.
            let cuts = f64::from(bounds.lo[axis]) < at && at < f64::from(bounds.hi[axis]);
            let longer = |other: Plane| bounds.extent()[axis] > bounds.extent()[other.axis];
            let is_better = |other: Plane| plane.level < other.level || (plane.level == other.level && longer(other));
            if cuts && best.is_none_or(is_better) {
                best = Some(plane);
            }
        }
        best
    }

    /// How much a primitive wants to be cut; 0 for what is not.
    fn weight(&self, world: &World, prim: PrimRef, bounds: &Bounds) -> f32 {
        if prim.kind() != PrimKind::Triangle {
            return 0.0;
        }
        let Some(plane) = self.best(bounds) else { return 0.0 };
        let [a, b, c] = world.triangles.corners(prim.row()).map(|corner| self.scale.point(corner).as_dvec3());
        // The least area that the boxes of ever more pieces can have, seen along the three axes.
        let least = 0.5 * (b - a).cross(c - a).abs().element_sum();
        let waste = self.half_area(bounds) - least;
        // Cube roots from the platform may differ in their last bit; libm's do not.
        libm::cbrt((waste * 0.5_f64.powi(plane.level as i32)).max(0.0)) as f32
    }

    /// Boxes around the pieces of a triangle.
    fn cut(&self, corners: [Vec3; 3], bounds: Bounds, n_splits: u32, boxes: &mut Vec<Bounds>) {
        let mut stack = vec![(Piece::of(corners), bounds, n_splits)];
        while let Some((piece, bounds, n_splits)) = stack.pop() {
            let plane = if n_splits == 0 { None } else { self.best(&bounds) };
            let Some([(low, low_box), (high, high_box)]) = plane.and_then(|plane| piece.cut(plane, &bounds)) else {
                boxes.push(bounds);
                continue;
            };
            let (low_area, high_area) = (self.half_area(&low_box), self.half_area(&high_box));
            let share = low_area / (low_area + high_area);
            let left = n_splits - 1;
            let n_low = ((f64::from(left) * share).round() as u32).min(left);
            stack.push((high, high_box, left - n_low));
            stack.push((low, low_box, n_low));
        }
    }
}

/// A convex part of a triangle.
#[derive(Clone, Copy, Debug)]
struct Piece {
    corners: [DVec3; MAX_CORNERS],
    n_corners: usize,
    /// What corners may be off by.
    error: f64,
    largest: f64,
}

impl Piece {
    fn of(corners: [Vec3; 3]) -> Piece {
        let mut piece = Piece { corners: [DVec3::ZERO; MAX_CORNERS], n_corners: 3, error: 0.0, largest: 0.0 };
        for (to, corner) in piece.corners.iter_mut().zip(corners) {
            *to = corner.as_dvec3();
            piece.largest = piece.largest.max(to.abs().max_element());
        }
        piece
    }

    /// The parts on either side of a plane, with boxes inside of the piece's; `None` when one of them is empty or has too many
    /// corners.
    fn cut(&self, plane: Plane, bounds: &Bounds) -> Option<[(Piece, Bounds); 2]> {
        let side = |sign: f64| {
            let part = self.part(plane, sign)?;
            let (mut lo, mut hi) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
            for &corner in &part.corners[..part.n_corners] {
                lo = lo.min(corner - part.error);
                hi = hi.max(corner + part.error);
            }
            let around = Bounds::around(lo, hi).unwrap_or(*bounds);
            let inside = Bounds { lo: around.lo.max(bounds.lo), hi: around.hi.min(bounds.hi) };
            inside.lo.cmple(inside.hi).all().then_some((part, inside))
        };
        Some([side(-1.0)?, side(1.0)?])
    }

    /// The part on one side of a plane (Sutherland and Hodgman 1974).
    fn part(&self, plane: Plane, sign: f64) -> Option<Piece> {
        let mut part = Piece { n_corners: 0, error: self.error + CLIP_ERROR * self.largest, ..*self };
        let mut push = |corner: DVec3| {
            *part.corners.get_mut(part.n_corners)? = corner;
            part.n_corners += 1;
            Some(())
        };
        let distance = |corner: DVec3| sign * (corner[plane.axis] - plane.at);
        for i in 0..self.n_corners {
            let (a, b) = (self.corners[i], self.corners[(i + 1) % self.n_corners]);
            let (at_a, at_b) = (distance(a), distance(b));
            if at_a >= 0.0 {
                push(a)?;
            }
            if (at_a < 0.0) != (at_b < 0.0) && at_a != 0.0 && at_b != 0.0 {
                push(a + (b - a) * (at_a / (at_a - at_b)))?;
            }
        }
        (part.n_corners > 0).then_some(part)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Triangles of all shapes and sizes.
    fn soup(n: usize) -> World {
        let mut state = 7_u64;
        let mut random = move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f32 / (1 << 24) as f32 - 0.5
        };
        let mut positions = Vec::new();
        for i in 0..n {
            let scale = [0.01, 0.1, 1.0][i % 3];
            let center = 10.0 * Vec3::new(random(), random(), random());
            positions.extend((0..3).map(|_| center + 10.0 * scale * Vec3::new(random(), random(), random())));
        }
        let triangles = (0..n as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        World::from_triangles(positions, triangles).unwrap()
    }

    #[test]
    fn every_point_of_a_triangle_lies_in_one_of_its_boxes_and_the_budget_is_kept() {
        let world = soup(600);
        let mut prims: Vec<PrimRef> = (0..600).map(|row| PrimRef::new(PrimKind::Triangle, row)).collect();
        let whole: Vec<Bounds> = (0..600).map(|row| world.triangles.bounds(row)).collect();
        let mut boxes = whole.clone();
        let scale = Scale::of(&boxes);
        split(&world, &mut prims, &mut boxes, &scale, 2.0);
        assert_eq!(prims.len(), boxes.len());
        assert!((900..=1800).contains(&prims.len()), "{} boxes", prims.len());
        for (row, whole) in whole.iter().enumerate() {
            let own: Vec<&Bounds> = prims.iter().zip(&boxes).filter(|(p, _)| p.row() == row).map(|(_, b)| b).collect();
            assert!(!own.is_empty());
            assert!(own.iter().all(|b| b.lo.cmpge(whole.lo).all() && b.hi.cmple(whole.hi).all()));
            let [a, b, c] = world.triangles.corners(row).map(|corner| corner.as_dvec3());
            for i in 0..=40 {
                for j in 0..=40 - i {
                    let p = a + (b - a) * (f64::from(i) / 40.0) + (c - a) * (f64::from(j) / 40.0);
                    let inside = |s: &&Bounds| p.cmpge(s.lo.as_dvec3()).all() && p.cmple(s.hi.as_dvec3()).all();
                    assert!(own.iter().any(inside), "{row}: {p}");
                }
            }
        }
        let area = |boxes: &[Bounds]| boxes.iter().map(|b| scale.half_area(b)).sum::<f32>();
        assert!(area(&boxes) < area(&whole), "{} of {}", area(&boxes), area(&whole));
    }

    #[test]
    fn what_cannot_be_cut_is_left_alone() {
        let world = World::from_triangles(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]]).unwrap();
        let mut prims = vec![PrimRef::new(PrimKind::Triangle, 0)];
        let mut boxes = vec![world.triangles.bounds(0)];
        let scale = Scale::of(&boxes);
        split(&world, &mut prims, &mut boxes, &scale, 0.0);
        assert_eq!(prims.len(), 1);
        let (mut none, mut no_boxes) = (Vec::new(), Vec::new());
        split(&world, &mut none, &mut no_boxes, &Scale::of(&[]), 1.0);
        assert!(none.is_empty());
    }
}
