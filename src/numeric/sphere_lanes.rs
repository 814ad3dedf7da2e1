//! Four spheres against one ray in f64, certified: what f64 is sure of is decided here, the rest is left open.
//!
//! (No closures here: they are not always inlined, and what is not inlined is compiled for the baseline.)

use super::U;
use super::four::FourRays;
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

/// Four rays as spheres see them, or one ray four times.
#[derive(Clone, Copy, Debug)]
pub struct SphereRays<F> {
    origin: [F; 3],
    direction: [F; 3],
    /// Squared lengths of the directions, lengths, and 1 over the squares.
    squared: F,
    length: F,
    of_squared: F,
    /// Lower ends of the intervals.
    t_min: F,
    /// Upper ends.
    pub t_max: F,
}

/// Four pairs of a sphere and a ray.
#[derive(Clone, Copy, Debug)]
pub struct SphereLanes<F> {
    /// Those in which the sphere is not certainly missed within the ray's interval, one bit each.
    pub open: u32,
    /// Those of the open ones in which it is certainly hit.
    pub certain: u32,
    /// Where a hit is certain, its parameter is at least this; elsewhere −∞.
    pub t_low: F,
    /// And at most this; elsewhere ∞.
    pub t_high: F,
}

impl<F: F64Lanes> SphereRays<F> {
    /// A ray, four times.
    #[inline(always)]
    pub fn one<S: Simd<F64 = F>>(simd: S, ray: &PreparedRay) -> SphereRays<F> {
        let (o, d) = (ray.origin, ray.direction);
        let squared = d.length_squared();
        SphereRays {
            origin: [simd.splat64(o.x), simd.splat64(o.y), simd.splat64(o.z)],
            direction: [simd.splat64(d.x), simd.splat64(d.y), simd.splat64(d.z)],
            squared: simd.splat64(squared),
            length: simd.splat64(squared.sqrt()),
            of_squared: simd.splat64(1.0 / squared),
            t_min: simd.splat64(ray.t_min),
            t_max: simd.splat64(ray.t_max),
        }
    }

    /// Four rays.
    #[inline(always)]
    pub fn four<S: Simd<F64 = F>>(simd: S, rays: &FourRays<F>) -> SphereRays<F> {
        let [x, y, z] = rays.direction;
        let squared = x * x + y * y + z * z;
        SphereRays {
            origin: rays.origin,
            direction: rays.direction,
            squared,
            length: squared.sqrt(),
            of_squared: simd.splat64(1.0) / squared,
            t_min: rays.t_min,
            t_max: rays.t_max,
        }
    }

    /// The same rays, up to other ends.
    #[inline(always)]
    pub fn until(self, t_max: F) -> SphereRays<F> {
        SphereRays { t_max, ..self }
    }
}

/// Sees spheres, given by columns, by tame rays.
///
/// The roots lie between (−b ∓ √(D + δ))/a, δ being the error of the discriminant D. In units of u, b is wrong by
/// 4·|h||d|, which is at most 4·(|b| + √D + r|d|) where there is a root, since a·h² = b² − D + a·r²; the root, the sum and
/// the quotient add 3 of |b| + √D, and a another 3: together below 16 of |b| + √(D + δ) + r|d|. Where D > 2²⁴·δ, the root of D
/// itself is not below √(D + δ)·(1 − 2⁻²⁴).
///
/// From outside of a sphere, which the sign of h·h − r² tells (wrong by 6 of h·h + r²), both roots have the sign of −b; from inside one is
/// negative. So the first that is hit is known, as long as it lies within the interval for certain.
///
/// Lanes of NaN are open and not certain.
#[inline(always)]
pub fn see<S: Simd>(simd: S, rays: &SphereRays<S::F64>, columns: [S::F64; N_COLUMNS]) -> SphereLanes<S::F64> {
    let [x, y, z, r] = columns;
    let &SphereRays { origin: [ox, oy, oz], direction: [dx, dy, dz], t_min, t_max, .. } = rays;
    let &SphereRays { squared: a, length, of_squared: of_a, .. } = rays;
    let (hx, hy, hz) = (ox - x, oy - y, oz - z);
    let b = hx * dx + hy * dy + hz * dz;
    let (h2, r2) = (hx * hx + hy * hy + hz * hz, r * r);
    let (size, c) = (h2 + r2, h2 - r2);
    let underflow = simd.splat64(UNDERFLOW);

    // The roots of the discriminant as it may be at most.
    let discriminant = b * b - a * c;
    let error = simd.splat64(24.0 * U) * a * size + underflow;
    let largest = discriminant + error;
    let root = largest.sqrt();
    let margin = simd.splat64(16.0 * U) * (b.abs() + root + r * length) + underflow;
    let (first_low, last_high) = (-(b + root + margin) * of_a, (root - b + margin) * of_a);

    // Where the ray starts.
    let c_error = simd.splat64(8.0 * U) * size + underflow;
    let (is_outside, is_inside) = (c_error.lt(c), c.lt(-c_error));
    let leaves = is_outside & margin.lt(b);
    let missed = largest.lt(simd.splat64(0.0)) | t_max.lt(first_low) | last_high.lt(t_min) | leaves;

    // The root that is hit first.
    let slack = root * simd.splat64(1.0 / CLEAR) + margin;
    let (first_high, last_low) = ((slack - (b + root)) * of_a, (root - b - slack) * of_a);
    let t_low = first_low.select(is_outside, last_low);
    let t_high = first_high.select(is_outside, last_high);
    let exists = (error * simd.splat64(CLEAR)).lt(discriminant);
    let known = is_inside | (is_outside & b.lt(-margin));
    let certain = exists & known & t_min.lt(t_low) & t_high.lt(t_max);
    let endless = simd.splat64(f64::INFINITY);
    SphereLanes {
        open: (!missed).bits(),
        certain: certain.bits(),
        t_low: t_low.select(certain, -endless),
        t_high: t_high.select(certain, endless),
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
        fn run<S: Simd>(mut self, simd: S) {
            let columns = spheres();
            let row = |lane: usize| columns.map(|column| column[lane]);
            for four in self.rays.chunks_exact(WIDTH64) {
                // Each ray and all spheres, then all rays and each sphere.
                for ray in four {
                    let seen = see(simd, &SphereRays::one(simd, ray), columns.map(|column| simd.load64(&column)));
                    for lane in 0..WIDTH64 {
                        self.judge(ray, row(lane), &seen, lane);
                    }
                }
                let rays =
                    FourRays::new(simd, [four[0], four[1], four[2], four[3]].map(|ray| ray.numbers()).each_ref());
                let rays = SphereRays::four(simd, &rays);
                for sphere in 0..WIDTH64 {
                    let seen = see(simd, &rays, row(sphere).map(|x| simd.splat64(x)));
                    for (lane, ray) in four.iter().enumerate() {
                        self.judge(ray, row(sphere), &seen, lane);
                    }
                }
            }
        }
    }

    impl Compare<'_> {
        fn judge<F: F64Lanes>(
            &mut self,
            ray: &PreparedRay,
            [x, y, z, r]: [f64; 4],
            seen: &SphereLanes<F>,
            lane: usize,
        ) {
            let hit = intersect(ray, dvec3(x, y, z), r);
            let (open, certain) = (seen.open >> lane & 1 == 1, seen.certain >> lane & 1 == 1);
            let (low, high) = (seen.t_low.to_array()[lane], seen.t_high.to_array()[lane]);
            assert!(open || hit.is_none(), "missed: {ray:?} {x} {hit:?}");
            assert!(open || !certain, "{ray:?} {x}");
            if certain {
                let t = hit.unwrap_or_else(|| panic!("not hit: {ray:?} {x}")).t;
                assert!(low <= t && t <= high, "{ray:?} {x}: {t} {low:?} {high:?}");
                assert!(high - low <= 1e-6 * (t + r / ray.direction.length()));
            } else {
                assert_eq!([low, high], [f64::NEG_INFINITY, f64::INFINITY]);
            }
            self.counts[if !open { 0 } else { 2 - usize::from(certain) }] += 1;
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
            assert!(missed > 2 * rays.len() && hit > rays.len() / 2, "{counts:?}");
            // Rays that touch what they start on are most of the rest.
            assert!(open < (missed + hit) / 3, "{counts:?}");
        }
    }

    #[test]
    fn what_is_not_a_number_is_open() {
        let ray = PreparedRay::new(dvec3(0.0, 0.0, -9.0), DVec3::Z, 0.0, f64::INFINITY).unwrap();
        let (portable, nothing) = (crate::simd::Portable, [[f64::NAN; WIDTH64]; N_COLUMNS]);
        let seen = see(portable, &SphereRays::one(portable, &ray), nothing.map(|column| portable.load64(&column)));
        assert_eq!((seen.open & 0b1111, seen.certain), (0b1111, 0));
    }
}
