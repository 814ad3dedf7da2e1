//! Finding packets: whether sixteen rays have one origin and run about the same way, and what they have in common.
//!
//! Rays that end in one point, as shadow rays do in a light, are packets too: they are walked backwards, from t = 1 on. Their
//! ends o + d are rounded, so that the point is only near each of them: the rays have one origin that each is a little off, by no
//! more than the packet says.

use glam::{DVec3, dvec3};

use super::slab::{Apex, SlabRay, Surroundings};
use crate::numeric::U;
use crate::numeric::four::FourRays;
use crate::numeric::lane::depth_slack;
use crate::numeric::packet::{PacketShear, REACH_PER_RESIDUAL, Span};
use crate::numeric::prepared::{lanes, longest_axis};
use crate::numeric::rounding::{f32_at_least, f32_at_most};
use crate::simd::{CYCLIC, F64Lanes, MaskLanes, Simd, WIDTH, WIDTH64};
use crate::world::Ray;

/// Lanes of eight rays in a packet.
pub const N_LANES: usize = 2;

/// Rays of a packet.
pub const N_RAYS: usize = N_LANES * WIDTH;

/// One number per ray.
pub type Column = [[f32; WIDTH]; N_LANES];

/// The widest that a packet may be, as the largest difference of a slope from the middle one: in wider ones boxes would be
/// tested for rays that do not exist.
const WIDEST: f32 = 0.0625;

/// The farthest that a ray may miss the point where all end, as a share of its direction: what f32 rounds it by and some more.
/// The errors of f32 would not be small in a wider beam.
const FARTHEST_OFF: f64 = 1.0 / (1 << 18) as f64;

/// More than what 1 − t is rounded by, for t from 0 to 1.
const TURNED_ERROR: f64 = 2.0 * U;

/// Sixteen rays of one origin.
#[derive(Clone, Debug)]
pub struct Packet {
    /// What the rays have in common, for boxes.
    pub slab: SlabRay,
    /// The same for triangles.
    pub shear: PacketShear,
    /// What is left of the slopes, eight rays at a time.
    pub spans: [Span; N_LANES],
    /// The same ray by ray.
    pub dx: Column,
    /// See `dx`.
    pub dy: Column,
    /// 1 over the directions along the common axis.
    pub reciprocal: Column,
    /// What the rounding of the origin adds to the error of a depth.
    pub slack: f32,
    /// f32 above and below the lower ends of the intervals, and below and above the upper ends.
    pub t_min: [Column; 2],
    /// See `t_min`.
    pub t_max: [Column; 2],
}

/// The packet of sixteen rays; `None` when they are not coherent, or any of them is not an ordinary one. It may be of rays turned
/// around if `both_ways`, where any hit is as good as the closest.
#[inline(always)]
pub fn packet<S: Simd>(simd: S, rays: &[Ray; N_RAYS], around: &Surroundings, both_ways: bool) -> Option<Packet> {
    // Most rays that are no packet are found out by the first and the last.
    let [first, .., last] = rays;
    let Bundle { apex, direction, off, fours, interval } = if first.origin == last.origin {
        Bundle::onwards(simd, rays)?
    } else if both_ways && is_near(first.origin + first.direction, last.origin + last.direction, first) {
        Bundle::turned(simd, rays)?
    } else {
        return None;
    };
    let (lo, hi) = directions(simd, &fours);

    // Octant. Zeros run upwards, with either sign.
    let zero = simd.splat64(0.0);
    let (upwards, downwards) = (zero.le(lo), hi.lt(zero));
    if (upwards | downwards).bits() & 0b111 != 0b111 {
        return None;
    }

    // Slopes.
    let axis = longest_axis(direction);
    let axes = CYCLIC[axis % CYCLIC.len()];
    let (slopes, ends) = slopes(simd, &fours, axes);
    let slope = middles(&ends);
    let (dx, dy) = (remainders(simd, &slopes[0], slope[0]), remainders(simd, &slopes[1], slope[1]));
    let spans = [span(&ends[0], slope), span(&ends[1], slope)];
    let spread = spans[0].farthest().max(spans[1].farthest());
    // Negated so that NaN fails.
    if !(slope[0].abs().max(slope[1].abs()) <= 1.0 && spread <= WIDEST) {
        return None;
    }

    // Boxes.
    let (size_lo, size_hi) = (lo.abs(), hi.abs());
    let sizes = [size_lo.min(size_hi), size_lo.max(size_hi)];
    let shortest = sizes[0].to_array()[axis % WIDTH64];
    let (t_min, t_max, lowest) = intervals(simd, &interval, &fours);
    let slab =
        SlabRay::around(simd, Apex { origin: lanes(simd, apex), off }, sizes, downwards, shortest, lowest, around);

    let origin = dvec3(apex[axes[0]], apex[axes[1]], apex[axes[2]]);
    let rounded = origin.as_vec3();
    let residual = f32_at_least((origin - rounded.as_dvec3()).abs().max_element() + off);
    let shear = PacketShear { origin: rounded.to_array(), slope, spread, reach: residual * REACH_PER_RESIDUAL, axis };
    let reciprocal = [halves::<S>(slopes[2][0], slopes[2][1]), halves::<S>(slopes[2][2], slopes[2][3])];
    Some(Packet { slab, shear, spans, dx, dy, reciprocal, slack: depth_slack(residual), t_min, t_max })
}

/// Sixteen rays that start near one point.
struct Bundle<S: Simd> {
    apex: DVec3,
    /// Of the first.
    direction: DVec3,
    /// How far any is off the apex at most, along each axis.
    off: f64,
    fours: Fours<S>,
    interval: Interval,
}

/// The interval of the first ray, and how wrong those of all are.
struct Interval {
    t_min: f64,
    t_max: f64,
    error: f64,
}

/// Four rays at a time.
pub type Fours<S> = [FourRays<<S as Simd>::F64>; N_FOURS];

/// Fours in a packet.
pub const N_FOURS: usize = N_RAYS / WIDTH64;

impl<S: Simd> Bundle<S> {
    /// Rays as they are; `None` unless all start where the first does and are ordinary and tame.
    #[inline(always)]
    fn onwards(simd: S, rays: &[Ray; N_RAYS]) -> Option<Bundle<S>> {
        let first = &rays[0];
        let mut fours = fours(simd, rays);
        let (x, y, z) = (simd.splat64(first.origin.x), simd.splat64(first.origin.y), simd.splat64(first.origin.z));
        let mut sound = 0b1111;
        for four in &mut fours {
            let [ox, oy, oz] = four.origin;
            let same = ox.equals(x) & oy.equals(y) & oz.equals(z);
            // What is to be known of the origin is then asked once.
            four.origin = [x, y, z];
            sound &= same.bits() & four.ordinary(simd) & four.tame(simd);
        }
        let interval = Interval { t_min: first.t_min, t_max: first.t_max, error: 0.0 };
        (sound == 0b1111).then_some(Bundle {
            apex: first.origin,
            direction: first.direction,
            off: 0.0,
            fours,
            interval,
        })
    }

    /// Rays turned around: the point at t is at 1 − t. `None` unless all end near where the first does, no later than at 1, and
    /// are tame, and ordinary once they are turned.
    #[inline(always)]
    fn turned(simd: S, rays: &[Ray; N_RAYS]) -> Option<Bundle<S>> {
        let first = &rays[0];
        let apex = first.origin + first.direction;
        let (zero, one) = (simd.splat64(0.0), simd.splat64(1.0));
        let target = [simd.splat64(apex.x), simd.splat64(apex.y), simd.splat64(apex.z)];
        let mut fours = fours(simd, rays);
        let limit = simd.splat64(FARTHEST_OFF * first.direction.abs().max_element());
        let (mut off, mut sound) = (zero, 0b1111);
        for four in &mut fours {
            for (axis, at) in target.iter().enumerate() {
                let by = (four.origin[axis] + four.direction[axis] - *at).abs();
                sound &= by.le(limit).bits();
                off = off.max(by);
            }
            let ([x, y, z], [dx, dy, dz]) = (target, four.direction);
            sound &= (four.t_max.le(one) & zero.le(four.t_min)).bits() & four.tame(simd);
            four.turn([x, y, z], [-dx, -dy, -dz], one - four.t_max, one - four.t_min);
            sound &= four.ordinary(simd);
        }
        // Each sum is rounded by u of itself, which u of the apex and of the distance from it are not less than.
        let [a, b, c, d] = off.to_array();
        let off = a.max(b).max(c.max(d)) * (1.0 + 4.0 * U) + 2.0 * U * apex.abs().max_element();
        let interval = Interval { t_min: 1.0 - first.t_max, t_max: 1.0 - first.t_min, error: TURNED_ERROR };
        (sound == 0b1111).then_some(Bundle { apex, direction: -first.direction, off, fours, interval })
    }
}

/// Whether two points are so near that a packet may start at both, for all that is known yet.
#[inline(always)]
fn is_near(p: DVec3, q: DVec3, first: &Ray) -> bool {
    (p - q).abs().max_element() <= FARTHEST_OFF * first.direction.abs().max_element()
}

/// The rays of a packet, four at a time.
#[inline(always)]
pub fn fours<S: Simd>(simd: S, rays: &[Ray; N_RAYS]) -> Fours<S> {
    let mut fours = [Ray::in_lanes(simd, [&rays[0]; WIDTH64]); N_FOURS];
    for (four, of) in fours.iter_mut().zip(rays.as_chunks().0) {
        *four = Ray::in_lanes(simd, of.each_ref());
    }
    fours
}

/// The smallest and the largest components of the directions, by axis in lanes.
#[inline(always)]
fn directions<S: Simd>(simd: S, fours: &Fours<S>) -> (S::F64, S::F64) {
    let (mut lo, mut hi) = (fours[0].direction, fours[0].direction);
    for four in &fours[1..] {
        for axis in 0..3 {
            lo[axis] = lo[axis].min(four.direction[axis]);
            hi[axis] = hi[axis].max(four.direction[axis]);
        }
    }
    (across(simd, [lo[0], lo[1], lo[2], lo[2]], false), across(simd, [hi[0], hi[1], hi[2], hi[2]], true))
}

/// The smallest lane of each of four, or the largest.
#[inline(always)]
fn across<S: Simd>(simd: S, of: [S::F64; WIDTH64], largest: bool) -> S::F64 {
    let [a, b, c, d] = simd.columns64([&of[0].to_array(), &of[1].to_array(), &of[2].to_array(), &of[3].to_array()]);
    if largest { a.max(b).max(c.max(d)) } else { a.min(b).min(c.min(d)) }
}

/// The slopes along the first axis and the second and 1 over the directions along the last, in lanes of rays; and between what
/// the slopes of eight rays lie: the smaller ends along both axes, then the larger ones.
#[inline(always)]
#[allow(clippy::type_complexity)]
fn slopes<S: Simd>(
    simd: S,
    fours: &Fours<S>,
    [x, y, z]: [usize; 3],
) -> ([[S::F64; N_FOURS]; 3], [[f64; WIDTH64]; N_LANES]) {
    let mut slopes = [[simd.splat64(0.0); N_FOURS]; 3];
    for (i, four) in fours.iter().enumerate() {
        let inverse = simd.splat64(1.0) / four.direction[z];
        slopes[0][i] = four.direction[x] * inverse;
        slopes[1][i] = four.direction[y] * inverse;
        slopes[2][i] = inverse;
    }
    let mut ends = [[0.0; WIDTH64]; N_LANES];
    for (half, ends) in ends.iter_mut().enumerate() {
        let ([ax, bx], [ay, by]) =
            ([slopes[0][2 * half], slopes[0][2 * half + 1]], [slopes[1][2 * half], slopes[1][2 * half + 1]]);
        // The larger ends as the smaller ones of the negatives.
        let [lo_x, lo_y, hi_x, hi_y] =
            across(simd, [ax.min(bx), ay.min(by), (-ax).min(-bx), (-ay).min(-by)], false).to_array();
        *ends = [lo_x, lo_y, -hi_x, -hi_y];
    }
    (slopes, ends)
}

/// The middle slope of all rays, along both axes.
#[inline(always)]
fn middles([a, b]: &[[f64; WIDTH64]; N_LANES]) -> [f32; 2] {
    [(0.5 * (a[0].min(b[0]) + a[2].max(b[2]))) as f32, (0.5 * (a[1].min(b[1]) + a[3].max(b[3]))) as f32]
}

/// What is left of slopes about the middle one.
#[inline(always)]
fn remainders<S: Simd>(simd: S, slopes: &[S::F64; N_FOURS], middle: f32) -> Column {
    let middle = simd.splat64(middle.into());
    [halves::<S>(slopes[0] - middle, slopes[1] - middle), halves::<S>(slopes[2] - middle, slopes[3] - middle)]
}

/// Eight f32 of twice four f64.
#[inline(always)]
fn halves<S: Simd>(lower: S::F64, upper: S::F64) -> [f32; WIDTH] {
    let ([a, b, c, d], [e, f, g, h]) = (lower.to_f32(), upper.to_f32());
    [a, b, c, d, e, f, g, h]
}

/// The δ that eight rays lie between: rounding keeps their order, so the ends are those of the rounded ones.
#[inline(always)]
fn span([lo_x, lo_y, hi_x, hi_y]: &[f64; WIDTH64], [x, y]: [f32; 2]) -> Span {
    let (middle_x, reach_x) = middle_and_reach((lo_x - f64::from(x)) as f32, (hi_x - f64::from(x)) as f32);
    let (middle_y, reach_y) = middle_and_reach((lo_y - f64::from(y)) as f32, (hi_y - f64::from(y)) as f32);
    Span { middle: [middle_x, middle_y], reach: [reach_x, reach_y] }
}

#[inline(always)]
fn middle_and_reach(lo: f32, hi: f32) -> (f32, f32) {
    let middle = 0.5 * (lo + hi);
    // Differences of f32 are rounded once, upwards.
    let (below, above) = (f64::from(middle) - f64::from(lo), f64::from(hi) - f64::from(middle));
    (middle, f32_at_least(if below > above { below } else { above }))
}

/// The ends of the intervals, rounded both ways, and the lowest of all; rays of a packet mostly have the same.
#[inline(always)]
fn intervals<S: Simd>(simd: S, first: &Interval, fours: &Fours<S>) -> ([Column; 2], [Column; 2], f32) {
    let (t_min, t_max) = (simd.splat64(first.t_min), simd.splat64(first.t_max));
    let mut same = t_min.equals(t_min);
    for four in fours {
        same = same & four.t_min.equals(t_min) & four.t_max.equals(t_max);
    }
    let (mut t_mins, mut t_maxs) = (both(first.t_min, first.error), both(first.t_max, first.error));
    if same.bits() == 0b1111 {
        return (t_mins, t_maxs, t_mins[1][0][0]);
    }
    let (error, zero) = (simd.splat64(first.error), simd.splat64(0.0));
    let mut lowest = f32::INFINITY;
    for (i, four) in fours.iter().enumerate() {
        let (lanes, start) = (i / 2, i % 2 * WIDTH64);
        let ([min_down, _], [_, min_up]) = ((four.t_min - error).max(zero).outwards(), (four.t_min + error).outwards());
        let ([max_down, _], [_, max_up]) = ((four.t_max - error).max(zero).outwards(), (four.t_max + error).outwards());
        for lane in 0..WIDTH64 {
            t_mins[0][lanes][start + lane] = min_up[lane];
            t_mins[1][lanes][start + lane] = min_down[lane];
            t_maxs[0][lanes][start + lane] = max_up[lane];
            t_maxs[1][lanes][start + lane] = max_down[lane];
            lowest = lowest.min(min_down[lane]);
        }
    }
    (t_mins, t_maxs, lowest)
}

/// A number above and one below `t`, which is wrong by `error`, for all rays; none below 0.
#[inline(always)]
fn both(t: f64, error: f64) -> [Column; 2] {
    let below = t - error;
    let below = if below > 0.0 { below } else { 0.0 };
    [[[f32_at_least(t + error); WIDTH]; N_LANES], [[f32_at_most(below); WIDTH]; N_LANES]]
}
