//! Ray against sphere: exact decision, certified parameter.

use glam::DVec3;

use super::U;
use super::double::{Double3, is_tame, is_tame3, two_product};
use super::dyadic::Dyadic;
use super::prepared::PreparedRay;
use super::quadratic::{ExactCoefficients, first_root};
use super::ratio::{Bounded, Parameter};
use super::tally::count_exact_test;
use crate::simd::{F64Lanes, MaskLanes, Simd, WIDTH64};

/// The first parameter in the ray's open interval at which the ray meets the sphere's surface. A tangent meets it.
/// `center` is finite, `radius` finite and positive.
#[inline(always)]
pub fn intersect(ray: &PreparedRay, center: DVec3, radius: f64) -> Option<Parameter> {
    let tame = ray.tame && is_tame3(center) && is_tame(radius);
    if tame && certainly_misses(ray, center, radius) {
        return None;
    }
    let coefficients = if tame { double_coefficients(ray, center, radius) } else { [Bounded::UNKNOWN; 3] };
    first_root(coefficients, ray.t_min, ray.t_max, || exact_coefficients(ray, center, radius))
}

/// The f64 tier: only misses are decided here, and they are the most frequent answer.
///
/// With h = o − c, first-order bounds in units of u: h·d is wrong by 4·|h||d|, h·h − r² by 6·(h·h + r²), the
/// discriminant by 22·(d·d)(h·h + r²).
#[inline(always)]
fn certainly_misses(ray: &PreparedRay, center: DVec3, radius: f64) -> bool {
    let h = ray.origin - center;
    let (a, b, h2, r2) = (ray.direction.length_squared(), h.dot(ray.direction), h.length_squared(), radius * radius);
    let size = h2 + r2;
    let c = h2 - r2;
    let leaving = ray.t_min >= 0.0 && c > 8.0 * U * size && b > 0.0 && b * b > 32.0 * U * U * a * h2;
    let (discriminant, error) = discriminant(ray, center, radius);
    leaving || discriminant < -error
}

/// Four spheres: those that the ray does not certainly miss within its interval, one bit each. `columns` are x, y, z of the
/// centres and the radii.
///
/// The roots lie between (−b ∓ √(D + δ))/a, δ being the error of the discriminant D. In units of u, b is wrong by
/// 4·|h||d|, which is at most 4·(|b| + √D + r|d|) where there is a root, since a·h² = b² − D + a·r²; the root, the sum and
/// the quotient add 3 of |b| + √D: together below 16 of |b| + √(D + δ) + r|d|.
#[inline(always)]
pub fn open_lanes<S: Simd>(simd: S, ray: &PreparedRay, columns: &[[f64; WIDTH64]; 4]) -> u32 {
    let (o, d) = (ray.origin, ray.direction);
    let (hx, hy, hz) = (
        simd.splat64(o.x) - simd.load64(&columns[0]),
        simd.splat64(o.y) - simd.load64(&columns[1]),
        simd.splat64(o.z) - simd.load64(&columns[2]),
    );
    let r = simd.load64(&columns[3]);
    let a = d.length_squared();
    let b = hx * simd.splat64(d.x) + hy * simd.splat64(d.y) + hz * simd.splat64(d.z);
    let (h2, r2) = (hx * hx + hy * hy + hz * hz, r * r);
    let discriminant = b * b - simd.splat64(a) * (h2 - r2);
    let underflow = simd.splat64(UNDERFLOW);
    let largest = discriminant + (simd.splat64(24.0 * U * a) * (h2 + r2) + underflow);
    let root = largest.sqrt();
    let margin = simd.splat64(16.0 * U) * (b.abs() + root + r * simd.splat64(a.sqrt())) + underflow;
    let of_a = simd.splat64(1.0 / a);
    let (t_low, t_high) = (-(b + root + margin) * of_a, (root - b + margin) * of_a);
    let missed = largest.lt(simd.splat64(0.0)) | simd.splat64(ray.t_max).lt(t_low) | t_high.lt(simd.splat64(ray.t_min));
    // Products of what is not tame may lose more than the bounds allow for.
    if ray.tame { (!missed).bits() } else { (1 << WIDTH64) - 1 }
}

/// More than products of tame rays with centres and radii of any size lose to underflow: they are off by 2⁻¹⁰⁷⁴ each, times
/// at most 2³⁰⁶.
const UNDERFLOW: f64 = f64::from_bits((1023 - 700) << 52);

/// b² − ac in f64, and what it may be wrong by.
#[inline(always)]
pub(crate) fn discriminant(ray: &PreparedRay, center: DVec3, radius: f64) -> (f64, f64) {
    let h = ray.origin - center;
    let (a, b, h2, r2) = (ray.direction.length_squared(), h.dot(ray.direction), h.length_squared(), radius * radius);
    (b * b - a * (h2 - r2), 24.0 * U * a * (h2 + r2))
}

/// The double-double tier: 6u² for d·d, 9u² for h·d, 15u² for h·h − r², each of the magnitudes summed.
#[inline(always)]
pub(crate) fn double_coefficients(ray: &PreparedRay, center: DVec3, radius: f64) -> [Bounded; 3] {
    let d = ray.direction;
    let h = Double3::difference(ray.origin, center);
    let [dx2, dy2, dz2] = [two_product(d.x, d.x), two_product(d.y, d.y), two_product(d.z, d.z)];
    let a = dx2 + dy2 + dz2;
    let r2 = two_product(radius, radius);
    let h2 = h.dot(&h);
    [
        Bounded::new(a, 6.0, a.hi),
        Bounded::new(h.dot_f64(d), 9.0, h.hi().abs().dot(d.abs())),
        Bounded::new(h2 - r2, 15.0, h2.hi + r2.hi),
    ]
}

#[cold]
fn exact_coefficients(ray: &PreparedRay, center: DVec3, radius: f64) -> ExactCoefficients {
    count_exact_test();
    let d = Dyadic::vector(ray.direction);
    let h = Dyadic::difference(&Dyadic::vector(ray.origin), &Dyadic::vector(center));
    let r = Dyadic::new(radius);
    let c = Dyadic::dot(&h, &h).sub(&r.mul(&r));
    [Dyadic::dot(&d, &d), Dyadic::dot(&h, &d), c]
}

/// The way from `p`, close to the surface, to the surface along the unit normal `n`: (r² − |p − c|²)/2r, the numerator in
/// double-double.
pub fn to_surface(center: DVec3, radius: f64, p: DVec3, n: DVec3) -> DVec3 {
    let h = Double3::difference(p, center);
    let off = two_product(radius, radius) - h.dot(&h);
    n * (off.hi / (2.0 * radius))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::dvec3;

    fn ray(origin: DVec3, direction: DVec3) -> PreparedRay {
        PreparedRay::new(origin, direction, 0.0, f64::INFINITY).unwrap()
    }

    #[test]
    fn a_sphere_is_hit_from_outside_and_from_inside_and_not_behind() {
        let at = |x: f64| intersect(&ray(dvec3(x, 0.0, 0.0), DVec3::X), DVec3::ZERO, 1.0).map(|hit| hit.t);
        assert_eq!(at(-3.0), Some(2.0));
        assert_eq!(at(0.5), Some(0.5));
        assert_eq!(at(1.0), None);
        assert_eq!(at(-1.0), Some(2.0));
        assert_eq!(at(2.0), None);
    }

    #[test]
    fn tangents_hit_and_the_next_ray_misses() {
        let past = |y: f64| intersect(&ray(dvec3(-2.0, y, 0.0), DVec3::X), DVec3::ZERO, 1.0).map(|hit| hit.t);
        assert_eq!(past(1.0), Some(2.0));
        assert_eq!(past(1.0f64.next_up()), None);
        assert!(past(1.0f64.next_down()).is_some());
    }

    #[test]
    fn the_length_of_the_direction_scales_the_parameter_and_nothing_else() {
        for exponent in -60..60 {
            let scale = 2f64.powi(exponent);
            let hit = intersect(&ray(dvec3(-3.0, 0.1, 0.2), dvec3(0.9, 0.05, 0.0) * scale), DVec3::ZERO, 1.0);
            let unit = intersect(&ray(dvec3(-3.0, 0.1, 0.2), dvec3(0.9, 0.05, 0.0)), DVec3::ZERO, 1.0);
            assert_eq!(hit.map(|hit| hit.t), unit.map(|hit| hit.t / scale));
        }
    }
}
