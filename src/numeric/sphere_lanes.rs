//! Four spheres against one ray in f64, certified: what f64 is sure of is decided here, the rest is left open.
//!
//! (No closures here: they are not always inlined, and what is not inlined is compiled for the baseline.)

use super::U;
use super::prepared::PreparedRay;
use crate::simd::{F64Lanes, MaskLanes, Simd};

/// Columns of a sphere: x, y, z of its centre, and its radius.
pub const N_COLUMNS: usize = 4;

/// More than products of tame rays with centres and radii of any size lose to underflow: they are off by 2⁻¹⁰⁷⁴ each, times
/// at most 2³⁰⁶.
const UNDERFLOW: f64 = f64::from_bits((1023 - 700) << 52);

/// By so much the discriminant is above its error where a hit is certain: the root is then known to a share of 2⁻²⁴, as well
/// as f32 holds it.
const CLEAR: f64 = (1_u64 << 24) as f64;

/// Four spheres seen along a ray.
#[derive(Clone, Copy, Debug)]
pub struct SphereLanes<F> {
    /// Those that are not certainly missed within the ray's interval, one bit each.
    pub open: u32,
    /// Those of the open ones that are certainly hit.
    pub certain: u32,
    /// Where a hit is certain, its parameter is at least this.
    pub t_low: F,
    /// And at most this.
    pub t_high: F,
}

/// Sees four spheres.
///
/// The roots lie between (−b ∓ √(D + δ))/a, δ being the error of the discriminant D. In units of u, b is wrong by
/// 4·|h||d|, which is at most 4·(|b| + √D + r|d|) where there is a root, since a·h² = b² − D + a·r²; the root, the sum and
/// the quotient add 3 of |b| + √D, and a another 3: together below 16 of |b| + √(D + δ) + r|d|. Where D > 2²⁴·δ, the root of D
/// itself is not below √(D + δ)·(1 − 2⁻²⁴).
///
/// From outside of a sphere, which the sign of h·h − r² tells (wrong by 6 of h·h + r²), both roots have the sign of −b; from inside one is
/// negative. So the first that is hit is known, as long as it lies within the interval for certain.
///
/// Every lane is open and none certain where ray is not tame: products may then lose more than the bounds allow for. Lanes of NaN are open
/// and not certain.
#[inline(always)]
pub fn see<S: Simd>(simd: S, ray: &PreparedRay, columns: [S::F64; N_COLUMNS]) -> SphereLanes<S::F64> {
    let [x, y, z, r] = columns;
    let (o, d) = (ray.origin, ray.direction);
    let (hx, hy, hz) = (simd.splat64(o.x) - x, simd.splat64(o.y) - y, simd.splat64(o.z) - z);
    let a = d.length_squared();
    let b = hx * simd.splat64(d.x) + hy * simd.splat64(d.y) + hz * simd.splat64(d.z);
    let (h2, r2) = (hx * hx + hy * hy + hz * hz, r * r);
    let (size, c) = (h2 + r2, h2 - r2);
    let underflow = simd.splat64(UNDERFLOW);

    // The roots of the discriminant as it may be at most.
    let discriminant = b * b - simd.splat64(a) * c;
    let error = simd.splat64(24.0 * U * a) * size + underflow;
    let largest = discriminant + error;
    let root = largest.sqrt();
    let margin = simd.splat64(16.0 * U) * (b.abs() + root + r * simd.splat64(a.sqrt())) + underflow;
    let of_a = simd.splat64(1.0 / a);
    let (first_low, last_high) = (-(b + root + margin) * of_a, (root - b + margin) * of_a);

    // Where the ray starts.
    let c_error = simd.splat64(8.0 * U) * size + underflow;
    let (is_outside, is_inside) = (c_error.lt(c), c.lt(-c_error));
    let leaves = is_outside & margin.lt(b);
    let (t_min, t_max) = (simd.splat64(ray.t_min), simd.splat64(ray.t_max));
    let missed = largest.lt(simd.splat64(0.0)) | t_max.lt(first_low) | last_high.lt(t_min) | leaves;

    // The root that is hit first.
    let slack = root * simd.splat64(1.0 / CLEAR) + margin;
    let (first_high, last_low) = ((slack - (b + root)) * of_a, (root - b - slack) * of_a);
    let t_low = first_low.select(is_outside, last_low);
    let t_high = first_high.select(is_outside, last_high);
    let exists = (error * simd.splat64(CLEAR)).lt(discriminant);
    let known = is_inside | (is_outside & b.lt(-margin));
    let certain = exists & known & t_min.lt(t_low) & t_high.lt(t_max);
    if ray.tame {
        SphereLanes { open: (!missed).bits(), certain: certain.bits(), t_low, t_high }
    } else {
        SphereLanes { open: u32::MAX, certain: 0, t_low, t_high }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::sphere::intersect;
    use crate::simd::{Batch, Isa, WIDTH64};
    use glam::{DVec3, dvec3};

    /// Spheres of any size around the origin and far from it.
    fn spheres() -> [[f64; WIDTH64]; N_COLUMNS] {
        [[0.0, 3.0, 1e6, -0.1], [0.0, 1.0 / 3.0, -2e6, 0.0], [0.0, -7.0, 5e5, 1e-9], [1.0, 0.3, 1e-2, 1e3]]
    }

    struct Compare<'a> {
        rays: &'a [PreparedRay],
        /// Pairs that are certainly missed, certainly hit, and left open.
        counts: &'a mut [usize; 3],
    }

    impl Batch for Compare<'_> {
        fn run<S: Simd>(self, simd: S) {
            let columns = spheres();
            for ray in self.rays {
                let seen = see(simd, ray, columns.map(|column| simd.load64(&column)));
                let (low, high) = (seen.t_low.to_array(), seen.t_high.to_array());
                for lane in 0..WIDTH64 {
                    let center = dvec3(columns[0][lane], columns[1][lane], columns[2][lane]);
                    let hit = intersect(ray, center, columns[3][lane]);
                    let (open, certain) = (seen.open >> lane & 1 == 1, seen.certain >> lane & 1 == 1);
                    assert!(open || hit.is_none(), "missed: {ray:?} {center} {hit:?}");
                    assert!(open || !certain, "{ray:?} {center}");
                    if certain {
                        let t = hit.unwrap_or_else(|| panic!("not hit: {ray:?} {center}")).t;
                        assert!(low[lane] <= t && t <= high[lane], "{ray:?} {center}: {t} {low:?} {high:?}");
                        assert!(high[lane] - low[lane] <= 1e-6 * (t + columns[3][lane] / ray.direction.length()));
                    }
                    self.counts[if !open { 0 } else { 2 - usize::from(certain) }] += 1;
                }
            }
        }
    }

    /// Rays between points on and near the spheres' surfaces: tangents, rays that leave, rays from inside, and any others.
    fn rays() -> Vec<PreparedRay> {
        let mut state = 7_u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        };
        let columns = spheres();
        let mut rays = Vec::new();
        for i in 0..40_000 {
            let mut point = |lane: usize, share: f64| {
                let center = dvec3(columns[0][lane], columns[1][lane], columns[2][lane]);
                let n = dvec3(random(), random(), random()).normalize_or(DVec3::X);
                (center + share * columns[3][lane] * n, n)
            };
            let share = [1.0, 1.0, 1.0 + 1e-15, 1.0 - 1e-15, 0.5, 1.5, 100.0][i % 7];
            let ((from, n), (to, _)) = (point(i % 4, share), point(i / 4 % 4, 1.0));
            let direction = match i / 16 % 4 {
                0 => to - from,
                // A tangent, and one that is nearly so.
                1 => n.any_orthogonal_vector(),
                2 => n.any_orthogonal_vector() + 1e-8 * n,
                _ => n * [1.0, -1e-3][i % 2],
            };
            let t_max = [f64::INFINITY, 1.0, 1e-3][i % 3];
            let t_min = if i % 11 == 0 { 0.5 * t_max.min(1.0) } else { 0.0 };
            rays.extend(PreparedRay::new(from, direction, t_min, t_max));
        }
        rays
    }

    #[test]
    fn what_is_certain_is_what_exact_arithmetic_says() {
        let rays = rays();
        for isa in Isa::ALL {
            let mut counts = [0; 3];
            isa.dispatch(Compare { rays: &rays, counts: &mut counts });
            let [missed, hit, open] = counts;
            assert!(missed > rays.len() && hit > rays.len() / 4, "{counts:?}");
            // Rays that touch what they start on are most of the rest.
            assert!(open < (missed + hit) / 3, "{counts:?}");
        }
    }

    #[test]
    fn nothing_is_certain_where_numbers_are_not_tame() {
        let ray = PreparedRay::new(dvec3(1e-60, 0.0, -9.0), DVec3::Z, 0.0, f64::INFINITY).unwrap();
        let portable = crate::simd::Portable;
        let seen = see(portable, &ray, spheres().map(|column| portable.load64(&column)));
        assert_eq!((seen.open & 0b1111, seen.certain), (0b1111, 0));
        let ray = PreparedRay::new(dvec3(0.0, 0.0, -9.0), DVec3::Z, 0.0, f64::INFINITY).unwrap();
        let seen = see(portable, &ray, [[f64::NAN; WIDTH64]; N_COLUMNS].map(|column| portable.load64(&column)));
        assert_eq!((seen.open & 0b1111, seen.certain), (0b1111, 0));
    }
}
