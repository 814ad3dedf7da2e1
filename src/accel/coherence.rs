//! Finding packets: whether sixteen rays have one origin and run about the same way, and what they have in common.

use glam::DVec3;

use super::slab::{SlabRay, Surroundings};
use crate::numeric::four::is_ordinary;
use crate::numeric::lane::{depth_slack, sound_reciprocal};
use crate::numeric::packet::{PacketShear, REACH_PER_RESIDUAL, Span};
use crate::numeric::prepared::{PreparedRay, lanes, tame};
use crate::numeric::rounding::{f32_at_least, f32_at_most};
use crate::simd::{F64Lanes, MaskLanes, Simd, WIDTH, WIDTH64};
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

/// The packet of sixteen rays; `None` when they are not coherent, or any of them is not an ordinary one.
#[inline(always)]
pub fn packet<S: Simd>(simd: S, rays: &[Ray; N_RAYS], around: &Surroundings) -> Option<Packet> {
    let [lo, hi] = common(simd, rays)?;

    // Octant. Zeros run upwards, with either sign.
    let zero = simd.splat64(0.0);
    let (upwards, downwards) = (zero.le(lo).bits() & 0b111, hi.lt(zero).bits() & 0b111);
    if upwards | downwards != 0b111 {
        return None;
    }
    let (size_lo, size_hi) = (lo.abs(), hi.abs());
    let (smallest, largest) = (-(-size_lo).max(-size_hi), size_lo.max(size_hi));
    let t_min = rays.iter().fold(f64::INFINITY, |t_min, ray| if ray.t_min < t_min { ray.t_min } else { t_min });
    let axes = PreparedRay::new(rays[0].origin, rays[0].direction, 0.0, 1.0)?.axes();
    let [shortest, longest] = [smallest.to_array()[axes[2] % WIDTH64], largest.to_array()[axes[2] % WIDTH64]];
    if !is_ordinary(rays[0].origin.abs().max_element(), [shortest, longest]) {
        return None;
    }
    let sizes = [smallest, largest];
    let slab =
        SlabRay::around(simd, lanes(simd, rays[0].origin), sizes, hi.lt(zero), shortest, f32_at_most(t_min), around);

    // Slopes.
    let Slopes { middle: slope, dx, dy, reciprocal } = Slopes::new(rays, axes);
    let spans = [span(&dx[0], &dy[0]), span(&dx[1], &dy[1])];
    let spread = farthest(dx.as_flattened()).max(farthest(dy.as_flattened()));
    // Negated so that NaN fails.
    if !(slope[0].abs().max(slope[1].abs()) <= 1.0 && spread <= WIDEST) {
        return None;
    }
    let origin = DVec3::from_array(axes.map(|axis| rays[0].origin[axis]));
    let rounded = origin.as_vec3();
    let residual = f32_at_least((origin - rounded.as_dvec3()).abs().max_element());
    let shear =
        PacketShear { origin: rounded.to_array(), slope, spread, reach: residual * REACH_PER_RESIDUAL, axis: axes[2] };
    let (t_min, t_max) = intervals(rays);
    Some(Packet { slab, shear, spans, dx, dy, reciprocal, slack: depth_slack(residual), t_min, t_max })
}

/// Checks what takes no division: one origin, all numbers tame, intervals that are not empty. Then the smallest and
/// largest components of the directions.
#[inline(always)]
fn common<S: Simd>(simd: S, rays: &[Ray; N_RAYS]) -> Option<[S::F64; 2]> {
    // Most rays that are no packet are found out by the first and the last.
    if rays[0].origin != rays[N_RAYS - 1].origin {
        return None;
    }
    let origin = lanes(simd, rays[0].origin);
    let zero = simd.splat64(0.0);
    let (mut lowest, mut hi) = (simd.splat64(f64::NEG_INFINITY), simd.splat64(f64::NEG_INFINITY));
    let mut same = zero.le(zero);
    let mut sound = true;
    for ray in rays {
        let (o, d) = (lanes(simd, ray.origin), lanes(simd, ray.direction));
        // Tame numbers are finite.
        same = same & o.le(origin) & origin.le(o) & tame(simd, d);
        lowest = (-d).max(lowest);
        hi = d.max(hi);
        sound &= ray.t_min >= 0.0 && ray.t_min < ray.t_max;
    }
    let sound = sound && (same & tame(simd, origin)).bits() == 0b1111;
    sound.then_some([-lowest, hi])
}

/// The slopes of sixteen rays.
struct Slopes {
    /// About the middle one, by axis.
    middle: [f32; 2],
    /// What is left of each, along the first axis and the second.
    dx: Column,
    dy: Column,
    /// 1 over the directions along the last axis.
    reciprocal: Column,
}

impl Slopes {
    #[inline(always)]
    fn new(rays: &[Ray; N_RAYS], [x, y, z]: [usize; 3]) -> Slopes {
        let mut slopes = [[0.0; N_RAYS]; 2];
        let mut reciprocal = [[0.0; WIDTH]; N_LANES];
        for (i, ray) in rays.iter().enumerate() {
            let inverse = 1.0 / ray.direction[z];
            slopes[0][i] = ray.direction[x] * inverse;
            slopes[1][i] = ray.direction[y] * inverse;
            reciprocal[i / WIDTH][i % WIDTH] = sound_reciprocal(inverse);
        }
        let (middle_x, dx) = around_middle(&slopes[0]);
        let (middle_y, dy) = around_middle(&slopes[1]);
        Slopes { middle: [middle_x, middle_y], dx, dy, reciprocal }
    }
}

/// The middle of slopes, and how far each is from it.
#[inline(always)]
fn around_middle(slopes: &[f64; N_RAYS]) -> (f32, Column) {
    let (mut lo, mut hi) = (f64::INFINITY, f64::NEG_INFINITY);
    for &slope in slopes {
        lo = if slope < lo { slope } else { lo };
        hi = if slope > hi { slope } else { hi };
    }
    let middle = (0.5 * (lo + hi)) as f32;
    let mut column = [[0.0; WIDTH]; N_LANES];
    for (i, &slope) in slopes.iter().enumerate() {
        column[i / WIDTH][i % WIDTH] = (slope - f64::from(middle)) as f32;
    }
    (middle, column)
}

/// The largest magnitude. NaN, which a direction of zero leaves, counts for nothing: its ray hits nothing.
#[inline(always)]
fn farthest(values: &[f32]) -> f32 {
    let mut farthest = 0.0;
    for &value in values {
        farthest = if value.abs() > farthest { value.abs() } else { farthest };
    }
    farthest
}

/// The δ that eight rays lie between.
#[inline(always)]
fn span(dx: &[f32; WIDTH], dy: &[f32; WIDTH]) -> Span {
    let ((x, wx), (y, wy)) = (middle_and_reach(dx), middle_and_reach(dy));
    Span { middle: [x, y], reach: [wx, wy] }
}

#[inline(always)]
fn middle_and_reach(values: &[f32; WIDTH]) -> (f32, f32) {
    let (mut lo, mut hi) = (values[0], values[0]);
    for &value in values {
        lo = if value < lo { value } else { lo };
        hi = if value > hi { value } else { hi };
    }
    let middle = 0.5 * (lo + hi);
    // Differences of f32 are rounded once, upwards.
    let from = |end: f32| (f64::from(end) - f64::from(middle)).abs();
    (middle, f32_at_least(from(hi).max(from(lo))))
}

/// The ends of the intervals, rounded both ways; rays of a packet mostly have the same.
#[inline(always)]
fn intervals(rays: &[Ray; N_RAYS]) -> ([Column; 2], [Column; 2]) {
    let Ray { t_min, t_max, .. } = rays[0];
    let (mut t_mins, mut t_maxs) = (both(t_min), both(t_max));
    let mut uniform = true;
    for ray in rays {
        uniform &= ray.t_min == t_min && ray.t_max == t_max;
    }
    if !uniform {
        for (i, ray) in rays.iter().enumerate() {
            let (lanes, lane) = (i / WIDTH, i % WIDTH);
            (t_mins[0][lanes][lane], t_mins[1][lanes][lane]) = (f32_at_least(ray.t_min), f32_at_most(ray.t_min));
            (t_maxs[0][lanes][lane], t_maxs[1][lanes][lane]) = (f32_at_least(ray.t_max), f32_at_most(ray.t_max));
        }
    }
    (t_mins, t_maxs)
}

/// A number above and below `t`, for all rays.
#[inline(always)]
fn both(t: f64) -> [Column; 2] {
    [[[f32_at_least(t); WIDTH]; N_LANES], [[f32_at_most(t); WIDTH]; N_LANES]]
}
