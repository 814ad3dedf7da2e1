//! Where a line meets a triangle's plane: t = n·(a − o) / n·d with n = (b − a)×(c − a), in compensated arithmetic.
//!
//! Written once for one ray and for lanes of rays, so that a ray has the same bits either way. Sums of products carry
//! what each operation loses (Ogita, Rump and Oishi, "Accurate sum and dot product", SIAM J. Sci. Comput. 26, 2005); the
//! result is as if computed in twice the precision and rounded once.

use super::double::{Double, two_product, two_sum};
use super::ratio::Bounded;
use crate::simd::F64Lanes;

/// A ray and a triangle, in axes of which the last is the one along which the direction is longest.
#[derive(Clone, Copy, Debug)]
pub struct Pair<F> {
    /// Origin of the ray.
    pub origin: [F; 3],
    /// Direction of the ray.
    pub direction: [F; 3],
    /// Corners of the triangle.
    pub corners: [[F; 3]; 3],
}

/// Error of numerator and denominator in u² of the summed magnitudes of all products of coordinates that go in
/// (`docs/NUMERICS.md` counts 53).
const PLANE_ERROR: f64 = 70.0;

/// The parameter at which the ray's line meets the triangle's plane, as a numerator and a denominator. Ray and corners must be tame
/// ([`is_tame`](super::double::is_tame)).
#[inline(always)]
pub fn plane_quotient<F: F64Lanes>(pair: &Pair<F>) -> [Bounded<F>; 2] {
    let [a, b, c] = pair.corners;
    let (e, f) = (difference(b, a), difference(c, a));
    let normal = [component(&e, &f, 1, 2), component(&e, &f, 2, 0), component(&e, &f, 0, 1)];
    let to_plane = difference(a, pair.origin);
    let zero = a[0].same(0.0);
    let [x, y, z] = pair.direction;
    let direction = [Double { hi: x, lo: zero }, Double { hi: y, lo: zero }, Double { hi: z, lo: zero }];
    let (n, n_size) = dot(&normal, &to_plane);
    let (d, d_size) = dot(&normal, &direction);
    [Bounded::new(n, PLANE_ERROR, n_size), Bounded::new(d, PLANE_ERROR, d_size)]
}

/// `to - from` without error.
#[inline(always)]
fn difference<F: F64Lanes>(to: [F; 3], from: [F; 3]) -> [Double<F>; 3] {
    [two_sum(to[0], -from[0]), two_sum(to[1], -from[1]), two_sum(to[2], -from[2])]
}

/// A component of the normal: value, what it lost, and the magnitudes of its two products.
#[derive(Clone, Copy)]
struct Component<F> {
    hi: F,
    lo: F,
    size: F,
}

/// e_j·f_k − e_k·f_j.
#[inline(always)]
fn component<F: F64Lanes>(e: &[Double<F>; 3], f: &[Double<F>; 3], j: usize, k: usize) -> Component<F> {
    let (p, q) = (two_product(e[j].hi, f[k].hi), two_product(e[k].hi, f[j].hi));
    let difference = two_sum(p.hi, -q.hi);
    // Edges between corners of very different exponents are rounded too; their rests are zero on most meshes.
    let of_p = e[j].hi.mul_add(f[k].lo, e[j].lo * f[k].hi);
    let of_q = e[k].hi.mul_add(f[j].lo, e[k].lo * f[j].hi);
    let lo = difference.lo + ((p.lo - q.lo) + (of_p - of_q));
    Component { hi: difference.hi, lo, size: p.hi.abs() + q.hi.abs() }
}

/// The dot product with the normal, and the summed magnitudes of its terms.
#[inline(always)]
fn dot<F: F64Lanes>(normal: &[Component<F>; 3], v: &[Double<F>; 3]) -> (Double<F>, F) {
    let [x, y, z] = *normal;
    let (px, py, pz) = (two_product(x.hi, v[0].hi), two_product(y.hi, v[1].hi), two_product(z.hi, v[2].hi));
    let xy = two_sum(px.hi, py.hi);
    let xyz = two_sum(xy.hi, pz.hi);
    let rest_x = x.hi.mul_add(v[0].lo, x.lo.mul_add(v[0].hi, px.lo));
    let rest_y = y.hi.mul_add(v[1].lo, y.lo.mul_add(v[1].hi, py.lo));
    let rest_z = z.hi.mul_add(v[2].lo, z.lo.mul_add(v[2].hi, pz.lo));
    let lo = (rest_x + rest_y) + (rest_z + (xy.lo + xyz.lo));
    let size = x.size.mul_add(v[0].hi.abs(), y.size.mul_add(v[1].hi.abs(), z.size * v[2].hi.abs()));
    // The rest may be larger than the value where much cancelled: a full sum.
    let sum = two_sum(xyz.hi, lo);
    (sum, size)
}
