//! Ray against sphere: exact decision, certified parameter.

use glam::DVec3;

use super::U;
use super::double::{Double3, is_tame, is_tame3, two_product};
use super::dyadic::Dyadic;
use super::prepared::PreparedRay;
use super::quadratic::{ExactCoefficients, first_root};
use super::ratio::{Bounded, Parameter};
use super::tally::count_exact_test;
use crate::simd::F64Lanes;

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

/// b² − ac in f64, and what it may be wrong by.
#[inline(always)]
pub(crate) fn discriminant(ray: &PreparedRay, center: DVec3, radius: f64) -> (f64, f64) {
    let h = ray.origin - center;
    let (a, b, h2, r2) = (ray.direction.length_squared(), h.dot(ray.direction), h.length_squared(), radius * radius);
    (b * b - a * (h2 - r2), 24.0 * U * a * (h2 + r2))
}

/// The double-double tier of a sphere by itself.
#[inline(always)]
pub(crate) fn double_coefficients(ray: &PreparedRay, center: DVec3, radius: f64) -> [Bounded; 3] {
    coefficients(ray.origin.to_array(), ray.direction.to_array(), center.to_array(), radius)
}

/// The double-double tier: 6u² for d·d, 9u² for h·d, 15u² for h·h − r², each of the magnitudes summed.
#[inline(always)]
pub fn coefficients<F: F64Lanes>(origin: [F; 3], d: [F; 3], center: [F; 3], radius: F) -> [Bounded<F>; 3] {
    let h = Double3::between(origin, center);
    let a = two_product(d[0], d[0]) + two_product(d[1], d[1]) + two_product(d[2], d[2]);
    let r2 = two_product(radius, radius);
    let h2 = h.dot(&h);
    let [x, y, z] = h.xyz;
    let h_d = x.hi.abs() * d[0].abs() + y.hi.abs() * d[1].abs() + z.hi.abs() * d[2].abs();
    [Bounded::new(a, 6.0, a.hi), Bounded::new(h.dot_lanes(d), 9.0, h_d), Bounded::new(h2 - r2, 15.0, h2.hi + r2.hi)]
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
