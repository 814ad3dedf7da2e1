//! Eight triangles against one ray in f32, certified: what f32 is sure of is decided here, the rest is left open.
//!
//! The edge functions are those of [`edge`](super::edge) in f32, where the ray is its f64 self rounded: the slope carries a
//! rounding anyway, and the origin's is part of the bound. Bounds use the m and Z of each triangle, not of the scene: a
//! wider one leaves a hundred times as many lanes open.
//!
//! (No closures here: they are not always inlined, and what is not inlined is compiled for the baseline.)

use super::four::FourRays;
use super::prepared::PreparedRay;
use super::triangle::LARGEST_SHARE;
use crate::simd::{F32Lanes, F64Lanes, Portable, Simd, WIDTH64};

/// Unit roundoff of f32, 2⁻²⁴.
pub const U32: f32 = f32::EPSILON / 2.0;

/// A ray as the lanes want it, in its sheared axes. Numbers stand in fours, as they are written.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct LaneRay {
    /// Origin, rounded; and what the rounding adds to Z in the bound of an edge function.
    origin: [f32; WIDTH64],
    /// Slopes, rounded; 1 over the direction along the last axis; and what the origin's rounding adds to the error of a depth.
    /// NaN stands for a reciprocal that f32 cannot hold well: no interval is then certain.
    slope: [f32; WIDTH64],
    /// What the ends of the interval are rounded to: the lower one down and up, the upper one down and up.
    interval: [f32; WIDTH64],
    /// The axis along which the direction is longest.
    axis: u8,
}

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

impl LaneRay {
    /// A ray of which f32 knows nothing: every lane is open, and none certain.
    #[inline(always)]
    pub const fn unknown(t_min: [f32; 2], t_max: [f32; 2], axis: usize) -> LaneRay {
        LaneRay {
            origin: [0.0, 0.0, 0.0, f32::INFINITY],
            slope: [0.0, 0.0, f32::NAN, 0.0],
            interval: [t_min[0], t_min[1], t_max[0], t_max[1]],
            axis: axis as u8,
        }
    }

    /// Four rays, each number rounded once, with the inverse magnitudes of their directions and what their intervals are rounded
    /// to. Of ordinary rays ([`FourRays::ordinary`]) the reciprocal is well held.
    #[inline(always)]
    pub fn four<S: Simd>(
        simd: S,
        rays: &FourRays<S::F64>,
        inverse_sizes: [S::F64; 3],
        intervals: [[f32; WIDTH64]; 4],
        to: &mut [LaneRay; WIDTH64],
    ) {
        let [x, y, z] = rays.in_axes(rays.origin);
        let [dx, dy, dz] = rays.in_axes(rays.direction);
        // The longest component is never taken to be larger than it is.
        let [_, _, inverse] = rays.in_axes(inverse_sizes);
        let inverse = (-inverse).select(dz.lt(simd.splat64(0.0)), inverse);

        let rounded = [x.to_f32(), y.to_f32(), z.to_f32()];
        let off = [x - simd.widen(rounded[0]), y - simd.widen(rounded[1]), z - simd.widen(rounded[2])];
        let residual = off[0].abs().max(off[1].abs()).max(off[2].abs());
        let reach = (residual * simd.splat64(REACH_PER_RESIDUAL)).to_f32();
        let underflow = simd.splat64(f32::MIN_POSITIVE.into());
        let slack = residual.mul_add(simd.splat64(SLACK_PER_RESIDUAL), underflow).to_f32();

        let slopes = [(dx * inverse).to_f32(), (dy * inverse).to_f32()];
        let origins = simd.rows32([rounded[0], rounded[1], rounded[2], reach]);
        let slopes = simd.rows32([slopes[0], slopes[1], inverse.to_f32(), slack]);
        let intervals = simd.rows32(intervals);
        let axes = rays.axes();
        for lane in 0..WIDTH64 {
            to[lane] =
                LaneRay { origin: origins[lane], slope: slopes[lane], interval: intervals[lane], axis: axes[lane] };
        }
    }

    /// A ray by itself: for the search for the worst case.
    pub(crate) fn of(ray: &PreparedRay) -> LaneRay {
        let mut four = [LaneRay::unknown([0.0; 2], [1.0; 2], 0); WIDTH64];
        let rays = FourRays::same(Portable, ray);
        LaneRay::four(Portable, &rays, rays.inverse_sizes(Portable), rays.intervals(Portable), &mut four);
        four[0]
    }

    /// What its parts are rounded to: origin, slope, and the reach of the origin's rounding as a residual.
    pub(crate) fn parts(&self) -> ([f32; 3], [f32; 2], f32) {
        let [x, y, z, reach] = self.origin;
        ([x, y, z], [self.slope[0], self.slope[1]], reach / REACH_PER_RESIDUAL as f32)
    }

    /// An f32 below the interval's lower end: what is smaller certainly lies outside.
    #[inline(always)]
    pub fn t_min_below(&self) -> f32 {
        self.interval[0]
    }

    /// An f32 above it: what is larger certainly lies inside.
    #[inline(always)]
    pub fn t_min_above(&self) -> f32 {
        self.interval[1]
    }

    /// An f32 below the interval's upper end as it was at first.
    #[inline(always)]
    pub fn t_max_below(&self) -> f32 {
        self.interval[2]
    }

    /// An f32 above it.
    #[inline(always)]
    pub fn t_max_above(&self) -> f32 {
        self.interval[3]
    }

    /// The axis along which the direction is longest.
    #[inline(always)]
    pub fn axis(&self) -> usize {
        self.axis.into()
    }

    /// The edge functions of eight triangles whose columns begin at `base` and are `stride` apart.
    #[inline(always)]
    pub fn edges<S: Simd>(&self, simd: S, corners: &[f32], base: usize, stride: usize) -> LaneEdges<S::F32> {
        let [[ax, ay, az], [bx, by, bz], [cx, cy, cz]] = simd.load_corners(corners, base, stride, self.axis.into());
        let (ox, oy, oz) = (simd.splat(self.origin[0]), simd.splat(self.origin[1]), simd.splat(self.origin[2]));
        let (sx, sy) = (simd.splat(-self.slope[0]), simd.splat(-self.slope[1]));
        let (az, bz, cz) = (az - oz, bz - oz, cz - oz);
        let (ax, ay) = (sx.mul_add(az, ax - ox), sy.mul_add(az, ay - oy));
        let (bx, by) = (sx.mul_add(bz, bx - ox), sy.mul_add(bz, by - oy));
        let (cx, cy) = (sx.mul_add(cz, cx - ox), sy.mul_add(cz, cy - oy));
        let weights = [bx.mul_add(cy, -(by * cx)), cx.mul_add(ay, -(cy * ax)), ax.mul_add(by, -(ay * bx))];
        let m = ax.abs().max(ay.abs()).max(bx.abs().max(by.abs())).max(cx.abs().max(cy.abs()));
        let largest_depth = az.abs().max(bz.abs()).max(cz.abs());
        let reach = largest_depth + simd.splat(self.origin[3]);
        // The product overflows where those of the edge functions may.
        let error = (m * (m + reach)).mul_add(simd.splat(EDGE_ERROR * U32), simd.splat(f32::MIN_POSITIVE));
        LaneEdges { weights, error, depths: [az, bz, cz], largest_depth }
    }

    /// Intervals around the parameters at which the line meets the triangles ([`LaneEdges::t_ranges`]).
    #[inline(always)]
    pub fn t_ranges<S: Simd>(&self, simd: S, edges: &LaneEdges<S::F32>) -> (S::F32, S::F32) {
        edges.t_ranges(simd, simd.splat(self.slope[2]), simd.splat(self.slope[3]))
    }
}

/// What the rounding of the origin adds to Z in the bound of an edge function: r/2u.
const REACH_PER_RESIDUAL: f64 = 0.5 / U32 as f64;

/// What it adds to the error of a depth.
const SLACK_PER_RESIDUAL: f64 = 4.0;

/// What the rounding of an origin by `residual` adds to the error of a depth, and what underflow may.
#[inline(always)]
pub fn depth_slack(residual: f32) -> f32 {
    SLACK_PER_RESIDUAL as f32 * residual + f32::MIN_POSITIVE
}

impl<F: F32Lanes> LaneEdges<F> {
    /// The edge functions of a lane and what each may be wrong by.
    pub(crate) fn of_lane(&self, lane: usize) -> ([f64; 3], f64) {
        let weights = self.weights.map(|weight| f64::from(weight.to_array()[lane]));
        (weights, self.error.to_array()[lane].into())
    }

    /// Intervals around the parameters at which lines meet triangles, if they do; NaN or infinite where that is not
    /// certain. They hold what the parameters are rounded to in f64. `reciprocal` is 1 over the directions along the longest
    /// axis, NaN where f32 cannot hold it well, `slack` what the origins' rounding adds to a depth ([`depth_slack`]).
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
        let rounding = self.largest_depth.mul_add(simd.splat(8.0 * U32), slack);
        let z_error = weight_error.mul_add(to_b.abs() + to_c.abs(), rounding);
        let t = z * reciprocal;
        let underflow = simd.splat(f32::MIN_POSITIVE);
        let error = z_error.mul_add(reciprocal.abs(), t.abs().mul_add(simd.splat(8.0 * U32), underflow));
        (t - error, t + error)
    }

    /// Lanes that the line does not certainly pass outside of: no two edge functions have certain signs that differ. Where one
    /// is NaN the error is infinite, and nothing certain.
    #[inline(always)]
    pub fn open(&self) -> F::Mask {
        let [a, b, c] = self.weights;
        self.error.not_lt(a.max(b).max(c)) | a.min(b).min(c).not_lt(-self.error)
    }

    /// Lanes in which all three signs are certain and the same: the line passes inside.
    #[inline(always)]
    pub fn certain(&self) -> F::Mask {
        let [a, b, c] = self.weights;
        self.error.lt(a.min(b).min(c)) | a.max(b).max(c).lt(-self.error)
    }
}
