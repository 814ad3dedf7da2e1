//! The box around the part of a quadric that lies in a clip.
//!
//! All of it is interval arithmetic ([`Interval`]), so that the box holds the part whatever was rounded. Where nothing
//! bounds the part on some axis there is no box.

use glam::DVec3;

use super::Bounds;
use crate::numeric::clip::Clip;
use crate::numeric::interval::Interval;
use crate::numeric::quadric::Quadric;

/// Per axis, relative to the surface's own centre.
type Reach = [Interval; 3];

/// What lies between two parallel planes: n·h within a range, h being relative to the surface's own centre.
#[derive(Clone, Copy, Debug)]
struct Slab {
    n: DVec3,
    range: Interval,
}

/// The box around what is left of a surface that has a box of its own or none; `None` when nothing bounds it.
pub fn clip_box(surface: &Quadric, clip: &Clip, own: Option<Bounds>) -> Option<Bounds> {
    let slabs = slabs(surface, clip);

    // What bounds the part: its own box, planes across an axis, three pairs of planes, slices between two planes.
    let mut reach = [Interval::ALL; 3];
    let mut bound = |by: Reach| reach = [0, 1, 2].map(|axis| reach[axis].and(by[axis]));
    if let Some(own) = own {
        bound([0, 1, 2].map(|axis| {
            let (lo, hi) = (f64::from(own.lo[axis]), f64::from(own.hi[axis]));
            Interval { lo, hi } - Interval::new(surface.center[axis])
        }));
    }
    slabs.iter().for_each(|slab| bound(slab.across_axis()));
    for (i, first) in slabs.iter().enumerate() {
        for (j, second) in slabs.iter().enumerate().skip(i + 1) {
            slabs.iter().skip(j + 1).for_each(|third| bound(parallelepiped([first, second, third])));
        }
    }
    slabs.iter().filter_map(|slab| slices(surface, slab)).for_each(&mut bound);

    // Nothing is left where an axis has an empty range: any box will do.
    let reach = reach.map(|axis| if axis.lo > axis.hi { Interval::new(0.0) } else { axis });
    let [x, y, z] = [0, 1, 2].map(|axis| reach[axis] + Interval::new(surface.center[axis]));
    Bounds::around(DVec3::new(x.lo, y.lo, z.lo), DVec3::new(x.hi, y.hi, z.hi))
}

/// The rows of a clip that clip, and the surface itself where it is a plane.
fn slabs(surface: &Quadric, clip: &Clip) -> Vec<Slab> {
    let (from, to) = (vector(clip.center), vector(surface.center));
    let moved = [0, 1, 2].map(|axis| to[axis] - from[axis]);
    let rows = (0..3).filter(|&i| clip.lo[i].is_finite() || clip.hi[i].is_finite());
    let mut slabs: Vec<Slab> = rows
        .map(|i| {
            let ends = Interval { lo: clip.lo[i], hi: clip.hi[i] };
            Slab { n: clip.rows[i], range: ends - dot(&vector(clip.rows[i]), &moved) }
        })
        .collect();
    if surface.diagonal == DVec3::ZERO && surface.off_diagonal == DVec3::ZERO {
        let range = Interval::new(-0.5) * Interval::new(surface.constant);
        slabs.push(Slab { n: surface.linear, range });
    }
    slabs
}

fn vector(v: DVec3) -> Reach {
    v.to_array().map(Interval::new)
}

fn dot(a: &Reach, b: &Reach) -> Interval {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: &Reach, b: &Reach) -> Reach {
    let component = |i: usize, j: usize| a[i] * b[j] - a[j] * b[i];
    [component(1, 2), component(2, 0), component(0, 1)]
}

impl Slab {
    /// The range of a coordinate that the planes are across; one of them may be missing.
    fn across_axis(&self) -> Reach {
        [0, 1, 2].map(|axis| {
            let is_across = (0..3).all(|i| (self.n[i] == 0.0) == (i != axis));
            if is_across { divided(self.range, self.n[axis]) } else { Interval::ALL }
        })
    }
}

/// range/n with ends that may be infinite.
fn divided(range: Interval, n: f64) -> Interval {
    let (a, b) = (range.lo / n, range.hi / n);
    Interval { lo: a.min(b).next_down(), hi: a.max(b).next_up() }
}

/// What lies in three slabs: h = Σ wᵢ·(nⱼ×nₖ)/det with wᵢ in their ranges.
fn parallelepiped(slabs: [&Slab; 3]) -> Reach {
    let [a, b, c] = slabs.map(|slab| vector(slab.n));
    let [a_range, b_range, c_range] = slabs.map(|slab| slab.range);
    let columns = [cross(&b, &c), cross(&c, &a), cross(&a, &b)];
    let inverse = dot(&a, &columns[0]).recip();
    if !inverse.is_finite() || !slabs.iter().all(|slab| slab.range.is_finite()) {
        return [Interval::ALL; 3];
    }
    [0, 1, 2].map(|axis| {
        let [p, q, r] = columns.each_ref().map(|column| column[axis] * inverse);
        a_range * p + b_range * q + c_range * r
    })
}

/// Pieces that the way between two planes is cut into; within each, centre and half width of the slices are bounded apart.
/// More make the box of a slanted cone or a ball tighter, none makes that of an upright cylinder or cone better than it is.
const N_PIECES: usize = 16;

/// A surface of which every plane across n cuts an ellipse, or nothing: cylinders and cones about n, and all whose axis is
/// not too far from n.
///
/// A point of the plane n·h = s is h = s·m + y₁·B₁ + y₂·B₂, with m = eⱼ/nⱼ for the largest component j and B the other two axes,
/// moved along j to lie in the plane. There the surface is yᵀPy + 2(u + s·v)·y + r(s) = 0: an ellipse with the centre
/// −P⁻¹(u + s·v), as long as P is definite, which along an axis reaches √(w·k(s)) to either side, k(s) = k₀ + 2k₁s + k₂s².
struct Slices {
    /// Centres along each axis: c₀ + c₁·s.
    centers: [[Interval; 2]; 3],
    /// w.
    widths: Reach,
    /// k₀, k₁, k₂.
    level: [Interval; 3],
}

/// The box around a surface between two planes, if its slices are ellipses.
fn slices(surface: &Quadric, slab: &Slab) -> Option<Reach> {
    if !slab.range.is_finite() {
        return None;
    }
    let slices = Slices::new(surface, slab.n)?;
    let Interval { lo, hi } = slab.range;
    let end = |piece: usize| if piece == N_PIECES { hi } else { lo + (hi - lo) * (piece as f64 / N_PIECES as f64) };
    let mut reach = [Interval::EMPTY; 3];
    for piece in 0..N_PIECES {
        let s = Interval { lo: end(piece), hi: end(piece + 1).max(end(piece)) };
        if let Some(by) = slices.between(s) {
            reach = [0, 1, 2].map(|axis| reach[axis].or(by[axis]));
        }
    }
    Some(reach)
}

impl Slices {
    fn new(surface: &Quadric, n: DVec3) -> Option<Slices> {
        // The frame of the planes.
        let j = if n.abs().max_element() == n.x.abs() {
            0
        } else if n.y.abs() >= n.z.abs() {
            1
        } else {
            2
        };
        if n[j] == 0.0 {
            return None;
        }
        let zero = Interval::new(0.0);
        let inverse = Interval::new(n[j]).recip();
        let mut m = [zero; 3];
        m[j] = inverse;
        let basis = [1, 2].map(|step| {
            let axis = (j + step) % 3;
            let mut column = [zero; 3];
            column[axis] = Interval::new(1.0);
            column[j] = -(Interval::new(n[axis]) * inverse);
            column
        });

        // The surface in that frame, its sign such that P is positive.
        let (d, o) = (vector(surface.diagonal), vector(surface.off_diagonal));
        let rows = [[d[0], o[2], o[1]], [o[2], d[1], o[0]], [o[1], o[0], d[2]]];
        let times = |v: &Reach| rows.each_ref().map(|row| dot(row, v));
        let g = vector(surface.linear);
        let bent = [times(&basis[0]), times(&basis[1])];
        let p = [dot(&basis[0], &bent[0]), dot(&basis[0], &bent[1]), dot(&basis[1], &bent[1])];
        let flip = if p[0].hi < 0.0 { Interval::new(-1.0) } else { Interval::new(1.0) };
        let p = p.map(|x| flip * x);
        let u = [0, 1].map(|i| flip * dot(&basis[i], &g));
        let v = [0, 1].map(|i| flip * dot(&m, &bent[i]));
        let r = [Interval::new(surface.constant), dot(&m, &g), dot(&m, &times(&m))].map(|x| flip * x);
        let determinant = p[0] * p[2] - p[1] * p[1];
        if p[0].lo <= 0.0 || determinant.lo <= 0.0 {
            return None;
        }

        // Centres, widths, levels.
        let inverse = determinant.recip();
        let solve = |x: &[Interval; 2]| [inverse * (p[2] * x[0] - p[1] * x[1]), inverse * (p[0] * x[1] - p[1] * x[0])];
        let pair = |a: &[Interval; 2], b: &[Interval; 2]| a[0] * b[0] + a[1] * b[1];
        let (of_u, of_v) = (solve(&u), solve(&v));
        let level = [pair(&u, &of_u) - r[0], pair(&v, &of_u) - r[1], pair(&v, &of_v) - r[2]];
        let along = |axis: usize| [basis[0][axis], basis[1][axis]];
        let centers = [0, 1, 2].map(|axis| [-pair(&along(axis), &of_u), m[axis] - pair(&along(axis), &of_v)]);
        let widths = [0, 1, 2].map(|axis| pair(&along(axis), &solve(&along(axis))));
        Some(Slices { centers, widths, level })
    }

    /// The box around all slices of a range; `None` when there are none.
    fn between(&self, s: Interval) -> Option<Reach> {
        // Around the middle: k(s₀ + e) = k(s₀) + 2·(k₁ + k₂s₀)·e + k₂e².
        let middle = Interval::new(0.5 * s.lo + 0.5 * s.hi);
        let half = (s - middle).size();
        let half = Interval { lo: 0.0, hi: half };
        let [k0, k1, k2] = self.level;
        let two = Interval::new(2.0);
        let slope = Interval::new((k1 + k2 * middle).size());
        let bend = Interval { lo: 0.0, hi: k2.hi.max(0.0) };
        let level = k0 + middle * (two * k1 + k2 * middle) + two * slope * half + bend * half * half;
        if level.hi < 0.0 {
            return None;
        }
        Some([0, 1, 2].map(|axis| {
            let [c0, c1] = self.centers[axis];
            let center = c0 + c1 * s;
            let squared = Interval::new(self.widths[axis].hi.max(0.0)) * Interval::new(level.hi);
            let reach = squared.hi.sqrt().next_up();
            center + Interval { lo: -reach, hi: reach }
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::{MaterialId, ObjectId, Quadrics};
    use glam::{DMat3, DMat4, dvec3};

    const EVERYWHERE: f64 = f64::INFINITY;

    /// xx·x² + yy·y² + zz·z² + x·X + y·Y + z·Z + constant.
    fn matrix(squares: [f64; 3], linear: [f64; 3], constant: f64) -> DMat4 {
        let ([a, b, c], [g, h, i]) = (squares, linear.map(|term| 0.5 * term));
        DMat4::from_cols_array_2d(&[[a, 0.0, 0.0, g], [0.0, b, 0.0, h], [0.0, 0.0, c, i], [g, h, i, constant]])
    }

    fn bounds(a: DMat4, clip: Clip) -> Option<Bounds> {
        let mut quadrics = Quadrics::default();
        quadrics.add_clipped(a, clip, MaterialId(0), ObjectId(0));
        quadrics.bounds[0]
    }

    fn assert_box(a: DMat4, clip: Clip, lo: [f64; 3], hi: [f64; 3], slack: f64) {
        let found = bounds(a, clip).unwrap();
        let (lo, hi) = (DVec3::from_array(lo), DVec3::from_array(hi));
        let (low, high) = (found.lo.as_dvec3(), found.hi.as_dvec3());
        assert!(low.cmple(lo).all() && high.cmpge(hi).all(), "{found:?} does not hold {lo} {hi}");
        assert!((lo - low).max_element() <= slack && (high - hi).max_element() <= slack, "{found:?} for {lo} {hi}");
    }

    #[test]
    fn cylinders_cones_and_planes_have_tight_boxes() {
        let cylinder = matrix([1.0, 0.0, 1.0], [0.0; 3], -0.25);
        assert_box(cylinder, Clip::along(DVec3::ZERO, 2.0 * DVec3::Y), [-0.5, 0.0, -0.5], [0.5, 2.0, 0.5], 1e-6);
        let cone = matrix([1.0, -0.25, 1.0], [0.0; 3], 0.0);
        assert_box(cone, Clip::along(DVec3::Y, DVec3::Y), [-1.0, 1.0, -1.0], [1.0, 2.0, 1.0], 1e-6);
        let plane = matrix([0.0; 3], [0.0, 1.0, 0.0], 1.0);
        let rectangle = Clip::world_box(dvec3(-2.0, -EVERYWHERE, -3.0), dvec3(2.0, EVERYWHERE, 4.0));
        assert_box(plane, rectangle, [-2.0, -1.0, -3.0], [2.0, -1.0, 4.0], 1e-6);
    }

    #[test]
    fn half_a_ball_and_a_bowl_have_boxes_near_their_own() {
        let ball = matrix([1.0; 3], [0.0; 3], -1.0);
        let upper = Clip::world_box(dvec3(-EVERYWHERE, 0.0, -EVERYWHERE), DVec3::INFINITY);
        assert_box(ball, upper, [-1.0, 0.0, -1.0], [1.0; 3], 1e-6);
        let cap = Clip::world_box(dvec3(-EVERYWHERE, 0.6, -EVERYWHERE), dvec3(EVERYWHERE, 2.0, EVERYWHERE));
        assert_box(ball, cap, [-0.8, 0.6, -0.8], [0.8, 1.0, 0.8], 0.1);
        let bowl = matrix([1.0, 0.0, 1.0], [0.0, -1.0, 0.0], 0.0);
        assert_box(bowl, Clip::along(DVec3::ZERO, 4.0 * DVec3::Y), [-2.0, 0.0, -2.0], [2.0, 4.0, 2.0], 1e-6);
    }

    #[test]
    fn a_leaning_cylinder_has_the_box_of_its_rims() {
        let axis = dvec3(2.0, 3.0, 6.0) / 7.0;
        let around = DMat3::IDENTITY - DMat3::from_cols(axis * axis.x, axis * axis.y, axis * axis.z);
        let center = dvec3(1000.0, -500.0, 20.0);
        let g = -(around * center);
        let columns = [around.x_axis.extend(g.x), around.y_axis.extend(g.y), around.z_axis.extend(g.z)];
        let a = DMat4::from_cols(columns[0], columns[1], columns[2], g.extend(-g.dot(center) - 1.0));
        let rim = DVec3::from_array([0, 1, 2].map(|i| (1.0 - axis[i] * axis[i]).sqrt()));
        let top = center + 5.0 * axis;
        let (lo, hi) = (center.min(top) - rim, center.max(top) + rim);
        assert_box(a, Clip::along(center, 5.0 * axis), (lo + 1e-9).to_array(), (hi - 1e-9).to_array(), 2e-4);
    }

    #[test]
    fn what_nothing_bounds_has_no_box_and_what_is_empty_has_one() {
        let cylinder = matrix([1.0, 0.0, 1.0], [0.0; 3], -0.25);
        let half = Clip::world_box(dvec3(-EVERYWHERE, 0.0, -EVERYWHERE), DVec3::INFINITY);
        assert_eq!(bounds(cylinder, half), None);
        let beside = Clip::world_box(dvec3(2.0, 0.0, 2.0), dvec3(3.0, 1.0, 3.0));
        assert!(bounds(cylinder, beside).is_some());
        let saddle = matrix([1.0, 0.0, -1.0], [0.0, -1.0, 0.0], 0.0);
        assert_eq!(bounds(saddle, Clip::along(DVec3::ZERO, DVec3::Y)), None);
        assert_box(saddle, Clip::world_box(DVec3::NEG_ONE, DVec3::ONE), [-1.0; 3], [1.0; 3], 1e-6);
    }
}
