//! Parameters of spheres that were certainly hit.

use super::super::wide::WideTree;
use super::{Described, Undescribed, rays_of};
use crate::numeric::double::Double;
use crate::numeric::quadratic::{discriminant, stable_sum};
use crate::numeric::ratio::Bounded;
use crate::numeric::sphere::coefficients;
use crate::simd::{F64Lanes, MaskLanes, Simd, WIDTH64};
use crate::world::Ray;

/// Four rays and the spheres that they hit.
#[inline(always)]
pub fn of_four<S: Simd>(simd: S, tree: &WideTree, rays: &[Ray], four: [&Undescribed; WIDTH64]) -> Described {
    let lanes = rays_of(simd, rays, four);
    let mut rows = [[0.0; WIDTH64]; WIDTH64];
    for (row, of) in rows.iter_mut().zip(four) {
        let (center, radius) = of.pending.sphere(tree);
        *row = [center.x, center.y, center.z, radius];
    }
    let [x, y, z, radius] = simd.columns64(rows.each_ref());
    describe(simd, lanes.origin, lanes.direction, [x, y, z], radius)
}

/// The same arithmetic as [`sphere::intersect`](crate::numeric::sphere::intersect), for which the lanes are that are not certain.
///
/// What is certainly hit is hit at the first root from outside, and at the second from inside, where the first is negative.
#[inline(always)]
pub fn describe<S: Simd>(
    simd: S,
    origin: [S::F64; 3],
    direction: [S::F64; 3],
    center: [S::F64; 3],
    radius: S::F64,
) -> Described {
    let [a, b, c] = coefficients(origin, direction, center, radius);

    // The roots are q/a and c/q; which is the larger hangs on the sign of b.
    let discriminant = discriminant(a, b, c);
    let q = stable_sum(b, discriminant);
    let exists = discriminant.error.lt(discriminant.value.hi) & b.error.lt(b.value.hi.abs());
    let zero = simd.splat64(0.0);
    let is_q_over_a = c.value.hi.lt(zero) & b.value.hi.lt(zero);
    let (n, d) = (select(q, is_q_over_a, c), select(a, is_q_over_a, q));
    let (at, accepted) = n.accepted_quotient(d);
    Described {
        t: at.hi.to_array(),
        t_rest: (at.lo / at.hi).to_array(),
        u: [0.0; WIDTH64],
        v: [0.0; WIDTH64],
        certain: (exists & accepted).bits(),
    }
}

/// One lane by lane where the mask says so, else the other.
#[inline(always)]
fn select<F: F64Lanes>(one: Bounded<F>, mask: F::Mask, other: Bounded<F>) -> Bounded<F> {
    let hi = one.value.hi.select(mask, other.value.hi);
    let lo = one.value.lo.select(mask, other.value.lo);
    Bounded { value: Double { hi, lo }, error: one.error.select(mask, other.error) }
}
