//! Eight triangles against one ray in f32, certified: what f32 is sure of is decided here, the rest is left open.
//!
//! The edge functions are those of [`edge`](super::edge) in f32, where the ray is its f64 self rounded: the slope carries a
//! rounding anyway, and the origin's is part of the bound. Bounds use the m and Z of each triangle, not of the scene: a
//! wider one leaves a hundred times as many lanes open.
//!
//! (No closures here: they are not always inlined, and what is not inlined is compiled for the baseline.)

use super::prepared::{PreparedRay, lanes};
use super::triangle::LARGEST_SHARE;
use crate::simd::{F32Lanes, F64Lanes, Portable, Simd, WIDTH64};

/// Unit roundoff of f32, 2⁻²⁴.
pub const U32: f32 = f32::EPSILON / 2.0;

/// A ray as the lanes want it, in its sheared axes.
#[derive(Clone, Copy, Debug)]
pub struct LaneRay {
    /// Origin, rounded.
    origin: [f32; 3],
    /// Slopes, rounded.
    slope: [f32; 2],
    /// What the rounding of the origin adds to Z in the bound of an edge function.
    reach: f32,
    /// What it adds to the error of a depth.
    slack: f32,
    /// 1 over the direction along the last axis. NaN where f32 cannot hold it well: no interval is then certain.
    reciprocal: f32,
    /// An f32 above the interval's lower end: what is larger certainly lies inside.
    pub t_min_above: f32,
    /// An f32 below it: what is smaller certainly lies outside.
    pub t_min_below: f32,
    /// An f32 below the interval's upper end as it was at first.
    pub t_max_below: f32,
    /// The axis along which the direction is longest.
    axis: u8,
}

/// What the parts of a ray are rounded to; the last of four numbers is not used.
#[derive(Clone, Copy, Debug)]
pub struct RoundedRay<F> {
    /// The origin, down and up.
    pub origin: [[f32; WIDTH64]; 2],
    /// 1 over the direction, within an ulp; −0.0 counts as 0.0.
    pub inverse: F,
    /// The lower end of the interval, down and up.
    pub t_min: [f32; 2],
    /// The upper end, down and up.
    pub t_max: [f32; 2],
}

/// Where the nine coordinates of a triangle stand among its columns, by that axis.
pub(super) const COLUMNS: [[u32; 9]; 3] =
    [[1, 2, 0, 4, 5, 3, 7, 8, 6], [2, 0, 1, 5, 3, 4, 8, 6, 7], [0, 1, 2, 3, 4, 5, 6, 7, 8]];

/// Eight triangles seen along a ray.
#[derive(Clone, Copy, Debug)]
pub struct LaneEdges<F> {
    /// The edge functions opposite the first, second and third corner.
    pub(super) weights: [F; 3],
    /// What each may be wrong by.
    pub(super) error: F,
    /// Depths of the corners.
    pub(super) depths: [F; 3],
    /// The largest magnitude among them.
    pub(super) largest_depth: F,
}

/// The first-order error of an edge function is below 16·u·m·(m + Z) in f32, where a slope is within u; the rest covers
/// the second order and the rounding of the bound.
pub(super) const EDGE_ERROR: f32 = 16.5;

impl<F: F64Lanes> RoundedRay<F> {
    /// Rounds each part once, in lanes.
    #[inline(always)]
    pub fn new<S: Simd<F64 = F>>(simd: S, ray: &PreparedRay) -> RoundedRay<F> {
        let [t_down, t_up] = simd.load64(&[ray.t_min, ray.t_max, 0.0, 0.0]).outwards();
        RoundedRay {
            origin: lanes(simd, ray.origin).outwards(),
            inverse: simd.splat64(1.0) / (lanes(simd, ray.direction) + simd.splat64(0.0)),
            t_min: [t_down[0], t_up[0]],
            t_max: [t_down[1], t_up[1]],
        }
    }
}

impl LaneRay {
    /// A ray of no consequence.
    pub const NOWHERE: LaneRay = LaneRay {
        origin: [0.0; 3],
        slope: [0.0; 2],
        reach: 0.0,
        slack: 0.0,
        reciprocal: 1.0,
        t_min_above: 0.0,
        t_min_below: 0.0,
        t_max_below: 1.0,
        axis: 0,
    };

    /// A ray from what its parts have been rounded to.
    #[inline(always)]
    pub fn new<F: F64Lanes>(ray: &PreparedRay, rounded: &RoundedRay<F>) -> LaneRay {
        let [x, y, z] = ray.axes();
        let RoundedRay { origin: [origin, above], inverse, t_min, t_max } = rounded;
        // Infinite where the origin is beyond f32: every lane is then left open.
        let off = |i: usize| above[i] - origin[i];
        let residual = off(0).max(off(1)).max(off(2));
        let inverse = inverse.to_array()[z];
        LaneRay {
            origin: [origin[x], origin[y], origin[z]],
            slope: [(ray.direction[x] * inverse) as f32, (ray.direction[y] * inverse) as f32],
            reach: residual * (0.5 / U32),
            slack: depth_slack(residual),
            reciprocal: sound_reciprocal(inverse),
            t_min_above: t_min[1],
            t_min_below: t_min[0],
            t_max_below: t_max[0],
            axis: z as u8,
        }
    }

    /// A ray by itself: for the search for the worst case.
    pub(crate) fn of(ray: &PreparedRay) -> LaneRay {
        LaneRay::new(ray, &RoundedRay::new(Portable, ray))
    }

    /// What its parts are rounded to: origin, slope, and the reach of the origin's rounding as a residual.
    pub(crate) fn parts(&self) -> ([f32; 3], [f32; 2], f32) {
        (self.origin, self.slope, self.reach / (0.5 / U32))
    }

    /// The edge functions of eight triangles whose columns begin at `base` and are `stride` apart.
    #[inline(always)]
    pub fn edges<S: Simd>(&self, simd: S, corners: &[f32], base: usize, stride: usize) -> LaneEdges<S::F32> {
        let [ax, ay, az, bx, by, bz, cx, cy, cz] =
            simd.load_columns(corners, base, stride, &COLUMNS[self.axis as usize % 3]);
        let (ox, oy, oz) = (simd.splat(self.origin[0]), simd.splat(self.origin[1]), simd.splat(self.origin[2]));
        let (sx, sy) = (simd.splat(-self.slope[0]), simd.splat(-self.slope[1]));
        let (az, bz, cz) = (az - oz, bz - oz, cz - oz);
        let (ax, ay) = (sx.mul_add(az, ax - ox), sy.mul_add(az, ay - oy));
        let (bx, by) = (sx.mul_add(bz, bx - ox), sy.mul_add(bz, by - oy));
        let (cx, cy) = (sx.mul_add(cz, cx - ox), sy.mul_add(cz, cy - oy));
        let weights = [bx.mul_add(cy, -(by * cx)), cx.mul_add(ay, -(cy * ax)), ax.mul_add(by, -(ay * bx))];
        let m = ax.abs().max(ay.abs()).max(bx.abs().max(by.abs())).max(cx.abs().max(cy.abs()));
        let largest_depth = az.abs().max(bz.abs()).max(cz.abs());
        let reach = largest_depth + simd.splat(self.reach);
        // The product overflows where those of the edge functions may.
        let error = (m * (m + reach)).mul_add(simd.splat(EDGE_ERROR * U32), simd.splat(f32::MIN_POSITIVE));
        LaneEdges { weights, error, depths: [az, bz, cz], largest_depth }
    }

    /// Intervals around the parameters at which the line meets the triangles ([`LaneEdges::t_ranges`]).
    #[inline(always)]
    pub fn t_ranges<S: Simd>(&self, simd: S, edges: &LaneEdges<S::F32>) -> (S::F32, S::F32) {
        edges.t_ranges(simd, simd.splat(self.reciprocal), simd.splat(self.slack))
    }
}

/// 1 over a direction along the longest axis, for [`LaneEdges::t_ranges`]: NaN where f32 cannot hold it well.
#[inline(always)]
pub fn sound_reciprocal(inverse: f64) -> f32 {
    let reciprocal = inverse as f32;
    let sound = (SMALLEST_RECIPROCAL..=1.0 / SMALLEST_RECIPROCAL).contains(&reciprocal.abs());
    if sound { reciprocal } else { f32::NAN }
}

/// What the rounding of an origin by `residual` adds to the error of a depth.
#[inline(always)]
pub fn depth_slack(residual: f32) -> f32 {
    4.0 * residual
}

/// Reciprocals between this and its inverse keep their precision in f32, and products with depths their range.
const SMALLEST_RECIPROCAL: f32 = 1.0 / (1u128 << 100) as f32;

impl<F: F32Lanes> LaneEdges<F> {
    /// The edge functions of a lane and what each may be wrong by.
    pub(crate) fn of_lane(&self, lane: usize) -> ([f64; 3], f64) {
        let weights = self.weights.map(|weight| f64::from(weight.to_array()[lane]));
        (weights, self.error.to_array()[lane].into())
    }

    /// Intervals around the parameters at which lines meet triangles, if they do; NaN or infinite where that is not
    /// certain. They hold what the parameters are rounded to in f64. `reciprocal` is 1 over the directions along the longest
    /// axis ([`sound_reciprocal`]), `slack` what the origins' rounding adds to a depth ([`depth_slack`]).
    #[inline(always)]
    pub fn t_ranges<S: Simd<F32 = F>>(&self, simd: S, reciprocal: F, slack: F) -> (F, F) {
        let [weight_a, weight_b, weight_c] = self.weights;
        let [a, b, c] = self.depths;
        let of_sum = simd.splat(1.0) / (weight_a + weight_b + weight_c);
        let (to_b, to_c) = (b - a, c - a);
        let z = a + (weight_b * of_sum).mul_add(to_b, weight_c * of_sum * to_c);
        let share = self.error * of_sum.abs();
        let weight_error = share.mul_add(simd.splat(4.5), simd.splat(12.0 * U32));
        let known = share.lt(simd.splat(LARGEST_SHARE as f32));
        let weight_error = weight_error.select(known, simd.splat(f32::INFINITY));
        let rounding = self.largest_depth.mul_add(simd.splat(8.0 * U32), slack + simd.splat(f32::MIN_POSITIVE));
        let z_error = weight_error.mul_add(to_b.abs() + to_c.abs(), rounding);
        let t = z * reciprocal;
        let underflow = simd.splat(f32::MIN_POSITIVE);
        let error = z_error.mul_add(reciprocal.abs(), t.abs().mul_add(simd.splat(8.0 * U32), underflow));
        (t - error, t + error)
    }

    /// Lanes that the line does not certainly pass outside of: no two edge functions have certain signs that differ.
    #[inline(always)]
    pub fn open(&self) -> F::Mask {
        let [a, b, c] = self.weights;
        let outside = self.error.lt(a.max(b).max(c)) & a.min(b).min(c).lt(-self.error);
        !outside
    }

    /// Lanes in which all three signs are certain; in an open lane the line then certainly passes inside.
    #[inline(always)]
    pub fn certain(&self) -> F::Mask {
        let [a, b, c] = self.weights;
        self.error.lt(a.abs().min(b.abs()).min(c.abs()))
    }
}
