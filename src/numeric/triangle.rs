//! Ray against triangle with f32 corners: exact decision, certified parameter.
//!
//! The test is that of Woop, Benthin and Wald, "Watertight Ray/Triangle Intersection" (JCGT 2013): translate by the
//! origin, shear so that the ray runs along its dominant axis, and look at the signs of three 2D edge functions. Here
//! each sign carries a certificate; a sign that f64 cannot certify is found in exact arithmetic. The parameter comes
//! from the plane, in double-double, since the sheared depth loses digits on needles.

use glam::{DVec3, Vec3};

use super::U;
use super::double::{Double3, two_product, two_sum};
use super::dyadic::Dyadic;
use super::edge::{Sheared, shear};
use super::plane::{Pair, plane_quotient};
use super::prepared::PreparedRay;
use super::ratio::{Parameter, Ratio, ratio_inside};
use super::tally::count_exact_test;
use crate::simd::F64Lanes;

/// A triangle's hit: parameter and barycentric weights of the second and third corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TriangleHit {
    /// Ray parameter.
    pub at: Parameter,
    /// Weight of the second corner, in [0, 1].
    pub u: f64,
    /// Weight of the third corner, in [0, 1].
    pub v: f64,
}

/// The hit of a ray with a triangle of finite corners, if its parameter lies in the ray's open interval.
///
/// Edges and corners belong to the triangle; a ray in its plane misses.
#[inline(always)]
pub fn intersect(ray: &PreparedRay, corners: [Vec3; 3]) -> Option<TriangleHit> {
    let pair = pair(ray, corners);
    match edges(&pair) {
        Edges::Outside => None,
        Edges::Uncertain => intersect_exact(ray, corners),
        Edges::Inside(inside) => {
            let (t_low, _) = inside.t_range(ray);
            if t_low >= ray.t_max {
                return None;
            }
            match depth(ray, &pair) {
                Ratio::Inside(at) => Some(TriangleHit { at, u: inside.u, v: inside.v }),
                Ratio::Outside => None,
                Ratio::Uncertain => intersect_exact(ray, corners),
            }
        }
    }
}

/// Whether [`intersect`] finds a hit. Seldom needs the exact parameter: the f64 one, with its error, mostly lies inside
/// the interval or outside.
#[inline(always)]
pub fn occludes(ray: &PreparedRay, corners: [Vec3; 3]) -> bool {
    let pair = pair(ray, corners);
    match edges(&pair) {
        Edges::Outside => false,
        Edges::Uncertain => intersect_exact(ray, corners).is_some(),
        Edges::Inside(inside) => {
            let (t_low, t_high) = inside.t_range(ray);
            if t_low >= ray.t_max || t_high <= ray.t_min {
                return false;
            }
            (t_low > ray.t_min && t_high < ray.t_max)
                || match depth(ray, &pair) {
                    Ratio::Inside(_) => true,
                    Ratio::Outside => false,
                    Ratio::Uncertain => intersect_exact(ray, corners).is_some(),
                }
        }
    }
}

/// Whether a ray's line, or which of several, certainly meets the triangle's plane behind the origin: f64 mostly knows it of the
/// triangle that a ray has just left, and of nothing else is it asked. Origin and direction must be tame
/// ([`is_tame`](super::double::is_tame)).
///
/// In units of u, edges are wrong by 1, products of them by 3 and a component of n by 4 of its two products; n·(a − o) adds
/// 1 for a − o, 1 for the product and 2 for sums, n·d one less.
#[inline(always)]
pub fn is_behind<F: F64Lanes>(origin: [F; 3], direction: [F; 3], corners: [Vec3; 3]) -> F::Mask {
    let [a, b, c] = corners.map(|corner| corner.as_dvec3());
    let (e, f) = (b - a, c - a);
    let (p, q) = (DVec3::new(e.y * f.z, e.z * f.x, e.x * f.y), DVec3::new(e.z * f.y, e.x * f.z, e.y * f.x));
    let (n, size) = (p - q, p.abs() + q.abs());
    let [x, y, z] = origin;
    let to_plane = [x.same(a.x) - x, y.same(a.y) - y, z.same(a.z) - z];
    let (numerator, of_numerator) = (dot(n, to_plane), dot(size, to_plane.map(F::abs)));
    let (denominator, of_denominator) = (dot(n, direction), dot(size, direction.map(F::abs)));
    let certain =
        (of_numerator * x.same(9.0 * U)).lt(numerator.abs()) & (of_denominator * x.same(8.0 * U)).lt(denominator.abs());
    let (below, against) = (numerator.lt(x.same(0.0)), denominator.lt(x.same(0.0)));
    certain & ((below & !against) | (!below & against))
}

/// The dot product of one vector with one or several.
#[inline(always)]
fn dot<F: F64Lanes>(n: DVec3, [x, y, z]: [F; 3]) -> F {
    x.same(n.x) * x + y.same(n.y) * y + z.same(n.z) * z
}

/// What f64 can tell of a ray's line and the edges.
enum Edges {
    /// It certainly passes outside.
    Outside,
    /// It certainly passes inside.
    Inside(Inside),
    /// Exact arithmetic has to say.
    Uncertain,
}

/// A line that certainly passes inside, and where.
struct Inside {
    /// Weights of the second and third corner.
    u: f64,
    v: f64,
    /// Sheared depth of the hit, and what it may be wrong by.
    z: f64,
    z_error: f64,
}

impl Inside {
    /// An interval around the exact parameter, wide enough to hold what it is rounded to. NaN or infinite where it
    /// cannot be known: it then decides nothing.
    #[inline(always)]
    fn t_range(&self, ray: &PreparedRay) -> (f64, f64) {
        let direction = ray.direction[ray.axis];
        let t = self.z / direction;
        let error = self.z_error / direction.abs() + 8.0 * U * t.abs();
        (t - error, t + error)
    }
}

/// The edge functions opposite the first, second and third corner, and what each may be wrong by.
pub(crate) fn edge_functions(ray: &PreparedRay, corners: [Vec3; 3]) -> ([f64; 3], f64) {
    let Sheared { weights, error, .. } = shear(&pair(ray, corners));
    (weights, error)
}

/// The ray and a triangle in the ray's axes.
#[inline(always)]
pub(crate) fn pair(ray: &PreparedRay, corners: [Vec3; 3]) -> Pair<f64> {
    let [x, y, z] = ray.axes();
    let (o, d) = (ray.origin, ray.direction);
    let [a, b, c] = corners;
    Pair {
        origin: [o[x], o[y], o[z]],
        direction: [d[x], d[y], d[z]],
        corners: [
            [a[x].into(), a[y].into(), a[z].into()],
            [b[x].into(), b[y].into(), b[z].into()],
            [c[x].into(), c[y].into(), c[z].into()],
        ],
    }
}

#[inline(always)]
fn edges(pair: &Pair<f64>) -> Edges {
    let Sheared { weights: [weight_a, weight_b, weight_c], error, depths: [a, b, c], largest_depth } = shear(pair);

    // Certain of opposite signs: outside, whatever the third is.
    let any_positive = (weight_a > error) | (weight_b > error) | (weight_c > error);
    let any_negative = (weight_a < -error) | (weight_b < -error) | (weight_c < -error);
    if any_positive & any_negative {
        return Edges::Outside;
    }
    let all_certain = (weight_a.abs() > error) & (weight_b.abs() > error) & (weight_c.abs() > error);
    if !all_certain {
        return Edges::Uncertain;
    }

    // Inside: interpolate the depth from the first corner on, so that its error is a share of the differences.
    let reciprocal = 1.0 / (weight_a + weight_b + weight_c);
    let (u, v) = (weight_b * reciprocal, weight_c * reciprocal);
    let (to_b, to_c) = (b - a, c - a);
    let z = a + (u * to_b + v * to_c);
    let share = error * reciprocal.abs();
    let weight_error = if share < LARGEST_SHARE { 4.5 * share + 12.0 * U } else { f64::INFINITY };
    let z_error = weight_error * (to_b.abs() + to_c.abs()) + 8.0 * U * largest_depth;
    Edges::Inside(Inside { u, v, z, z_error })
}

/// Up to this share of their sum the weights' error may be for first-order bounds of quotients of them to hold, with an
/// eighth to spare.
pub const LARGEST_SHARE: f64 = 1.0 / 32.0;

/// t = n·(a − o) / n·d.
#[inline(always)]
fn depth(ray: &PreparedRay, pair: &Pair<f64>) -> Ratio {
    if !ray.tame {
        return Ratio::Uncertain;
    }
    let [n, d] = plane_quotient(pair);
    ratio_inside(n, d, ray.t_min, ray.t_max)
}

/// The edges from the first corner, if f64 holds them exactly; it does unless their exponents lie far apart.
#[inline(always)]
fn exact_edges(a: DVec3, b: DVec3, c: DVec3) -> Option<(DVec3, DVec3)> {
    let (e, f) = (b - a, c - a);
    let rounded = |to: f64, from: f64| two_sum(to, -from).lo != 0.0;
    let any = |to: DVec3| rounded(to.x, a.x) | rounded(to.y, a.y) | rounded(to.z, a.z);
    (!(any(b) | any(c))).then_some((e, f))
}

/// The cross product of exact vectors; each component within 3u² of itself.
#[inline(always)]
fn cross(e: DVec3, f: DVec3) -> Double3 {
    let component = |p: f64, q: f64, r: f64, s: f64| two_product(p, q) - two_product(r, s);
    Double3 { xyz: [component(e.y, f.z, e.z, f.y), component(e.z, f.x, e.x, f.z), component(e.x, f.y, e.y, f.x)] }
}

/// [`intersect`] in exact arithmetic.
#[cold]
pub fn intersect_exact(ray: &PreparedRay, corners: [Vec3; 3]) -> Option<TriangleHit> {
    count_exact_test();
    let origin = Dyadic::vector(ray.origin);
    let direction = Dyadic::vector(ray.direction);
    let [a, b, c] = corners.map(|corner| Dyadic::difference(&Dyadic::vector(corner.as_dvec3()), &origin));
    let weight = |p, q| Dyadic::dot(&direction, &Dyadic::cross(p, q));
    let weights = [weight(&b, &c), weight(&c, &a), weight(&a, &b)];
    let signs = weights.each_ref().map(Dyadic::sign);
    let sum = weights[0].add(&weights[1]).add(&weights[2]);
    if (signs.contains(&1) && signs.contains(&-1)) || sum.sign() == 0 {
        return None;
    }
    let n = Dyadic::cross(&Dyadic::difference(&b, &a), &Dyadic::difference(&c, &a));
    let at = Dyadic::dot(&n, &a).guarded_quotient(&Dyadic::dot(&n, &direction))?.to_parameter();
    let share = |i: usize| weights[i].guarded_quotient(&sum).map_or(0.0, |w| w.to_f64());
    (at.t > ray.t_min && at.t < ray.t_max).then(|| TriangleHit { at, u: share(1), v: share(2) })
}

/// Whether the corners lie on one line or point, so that no ray can hit the triangle. Corners must be finite.
#[inline]
pub fn is_degenerate(corners: [Vec3; 3]) -> bool {
    let (a, b, c) = (corners[0].as_dvec3(), corners[1].as_dvec3(), corners[2].as_dvec3());
    // f32 corners are tame, so differences are exact or rounded by u: 3u for each product, u for their difference. A
    // component of the cross product is certainly not zero when it is above 5u of the sizes of its two products, and
    // those are at most that of the longest edges' components.
    let (e, f) = (b - a, c - a);
    let n = e.cross(f).abs();
    let most = e.abs().max_element() * f.abs().max_element();
    n.max_element() <= 2.0 * most * (5.0 * U) && is_degenerate_exact([a, b, c])
}

/// [`is_degenerate`] in exact arithmetic.
#[cold]
fn is_degenerate_exact(corners: [DVec3; 3]) -> bool {
    normal_dyadic(corners).iter().all(|component| component.sign() == 0)
}

/// The normal by the winding, as long as it comes.
fn normal_dyadic(corners: [DVec3; 3]) -> [Dyadic; 3] {
    let [a, b, c] = corners.map(Dyadic::vector);
    Dyadic::cross(&Dyadic::difference(&b, &a), &Dyadic::difference(&c, &a))
}

/// The unit normal by the winding, of a triangle that is not degenerate; each component within a few u.
#[inline(always)]
pub fn unit_normal(corners: [Vec3; 3]) -> DVec3 {
    let (a, b, c) = (corners[0].as_dvec3(), corners[1].as_dvec3(), corners[2].as_dvec3());
    let n = match exact_edges(a, b, c) {
        Some((e, f)) => cross(e, f).hi(),
        None => normal_exact([a, b, c]),
    };
    // f32 corners bound the normal by 2²⁵⁸ and 2⁻²⁹⁸: its square cannot leave the range of f64 (2^±1022).
    n.normalize_or_zero()
}

/// The normal of edges that f64 cannot hold, rounded.
#[cold]
fn normal_exact(corners: [DVec3; 3]) -> DVec3 {
    DVec3::from_array(normal_dyadic(corners).map(|component| component.to_f64()))
}

/// The way from `p` to the plane of a triangle that is not degenerate, along its normal. The distance is computed in
/// double-double from the unrounded normal: a rounded one would tilt the plane by as much as `p` is far from a corner.
#[inline(always)]
pub fn to_plane(corners: [Vec3; 3], p: DVec3) -> DVec3 {
    let (a, b, c) = (corners[0].as_dvec3(), corners[1].as_dvec3(), corners[2].as_dvec3());
    match exact_edges(a, b, c) {
        Some((e, f)) => {
            let n = cross(e, f);
            let distance = n.dot(&Double3::difference(a, p)).hi;
            n.hi() * (distance / n.hi().length_squared())
        }
        None => {
            let n = unit_normal(corners);
            n * n.dot(a - p)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::four::FourRays;
    use crate::simd::{MaskLanes, Portable};
    use glam::{dvec3, vec3};

    fn ray(origin: DVec3, direction: DVec3) -> PreparedRay {
        PreparedRay::new(origin, direction, 0.0, f64::INFINITY).unwrap()
    }

    const CORNERS: [Vec3; 3] = [vec3(0.0, 0.0, 0.0), vec3(1.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0)];

    #[test]
    fn a_hit_has_its_depth_and_weights_from_both_sides() {
        for side in [1.0, -1.0] {
            let down = ray(dvec3(0.25, 0.5, 2.0 * side), dvec3(0.0, 0.0, -side));
            let at = Parameter::new(2.0, 0.0);
            assert_eq!(intersect(&down, CORNERS), Some(TriangleHit { at, u: 0.25, v: 0.5 }));
        }
    }

    /// Where to start beside a plane: on it but for some roundings, or well off it.
    const PLACES_OFF: [f64; 7] = [0.0, 1e-17, 1e-16, -1e-16, 1e-15, -1e-15, 0.1];

    #[test]
    fn what_f64_knows_to_lie_behind_is_never_hit_and_is_the_same_of_four_rays() {
        let (mut n_behind, mut n_hit) = (0, 0);
        for i in 0..4000_u32 {
            let unit = |k: u32| f64::from((i * 31 + k).wrapping_mul(2_654_435_761) >> 8) / f64::from(1 << 24) - 0.5;
            let corner = |k: u32| dvec3(unit(k), unit(k + 1), unit(k + 2)).as_vec3();
            let corners = [corner(0), corner(3), corner(6)];
            let [a, b, c] = corners.map(|corner| corner.as_dvec3());
            let normal = (b - a).cross(c - a);
            let off = PLACES_OFF[i as usize % PLACES_OFF.len()];
            let origin = (a + b + c) / 3.0 + off * normal.normalize_or_zero();
            let direction = dvec3(unit(9), unit(10), unit(11));
            let behind = is_behind(origin.to_array(), direction.to_array(), corners);
            let is_hit = occludes(&ray(origin, direction), corners);
            assert!(!(behind && is_hit), "{corners:?}, {origin}, {direction}");
            (n_behind, n_hit) = (n_behind + u32::from(behind), n_hit + u32::from(is_hit));

            let four = FourRays::same(Portable, &ray(origin, direction));
            let bits = is_behind(four.origin, four.direction, corners).bits();
            assert_eq!(bits, if behind { 0b1111 } else { 0 }, "{corners:?}, {origin}, {direction}");
        }
        assert!(n_behind > 500 && n_hit > 1000, "{n_behind} {n_hit}");
    }

    #[test]
    fn edges_and_corners_are_inside_and_the_next_float_is_not() {
        for (x, y) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.5, 0.5), (0.25, 0.0), (0.0, 0.75)] {
            let hit = intersect(&ray(dvec3(x, y, 1.0), dvec3(0.0, 0.0, -1.0)), CORNERS);
            let at = Parameter::new(1.0, 0.0);
            assert_eq!(hit, Some(TriangleHit { at, u: x, v: y }), "({x}, {y})");
        }
        let beside = ray(dvec3((-0.0f64).next_down(), 0.5, 1.0), dvec3(0.0, 0.0, -1.0));
        assert_eq!(intersect(&beside, CORNERS), None);
        let beyond = ray(dvec3(0.5f64.next_up(), 0.5, 1.0), dvec3(0.0, 0.0, -1.0));
        assert_eq!(intersect(&beyond, CORNERS), None);
    }

    #[test]
    fn a_ray_in_the_plane_misses() {
        assert_eq!(intersect(&ray(dvec3(-1.0, 0.25, 0.0), dvec3(1.0, 0.0, 0.0)), CORNERS), None);
        assert_eq!(intersect(&ray(dvec3(-1.0, 0.0, 0.0), dvec3(1.0, 0.0, 0.0)), CORNERS), None);
    }

    #[test]
    fn collinear_corners_are_degenerate_and_needles_are_not() {
        assert!(is_degenerate([Vec3::ZERO, Vec3::ONE, Vec3::splat(3.0)]));
        assert!(is_degenerate([Vec3::ONE; 3]));
        assert!(is_degenerate([vec3(0.1, 0.2, 0.3), vec3(0.1, 0.2, 0.3), vec3(5.0, 6.0, 7.0)]));
        assert!(!is_degenerate([Vec3::ZERO, Vec3::ONE, vec3(3.0, 3.0, 3.0f32.next_up())]));
        assert!(!is_degenerate([Vec3::ZERO, vec3(1e-40, 0.0, 0.0), vec3(0.0, 1e-40, 0.0)]));
    }

    #[test]
    fn normals_of_tiny_and_huge_triangles_are_of_unit_length() {
        for size in [1e-40f32, 1e-20, 1.0, 1e20, 1e38] {
            let n = unit_normal([Vec3::ZERO, vec3(size, 0.0, 0.0), vec3(0.0, size, 0.0)]);
            assert_eq!(n, DVec3::Z, "{size:e}");
        }
    }
}
