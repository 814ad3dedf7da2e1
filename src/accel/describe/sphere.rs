//! Parameters of spheres that were certainly hit.

use super::super::wide::WideTree;
use super::{DescribeOne, Undescribed, filled, rays_of};
use crate::numeric::double::Double;
use crate::numeric::quadratic::{discriminant, stable_sum};
use crate::numeric::ratio::{Bounded, Parameter};
use crate::numeric::sphere::coefficients;
use crate::simd::{F64Lanes, MaskLanes, Simd, WIDTH64};
use crate::world::{Hit, PrimKind, Ray};

/// The same arithmetic as [`sphere::intersect`](crate::numeric::sphere::intersect), for which the lanes are that are not certain.
///
/// What is certainly hit is hit at the first root from outside, and at the second from inside, where the first is negative.
#[inline(always)]
pub fn describe_four<S: Simd>(simd: S, tree: &WideTree, rays: &[Ray], four: &[Undescribed], hits: &mut [Hit]) {
    let filled = filled(four);
    let lanes = rays_of(simd, rays, filled);
    let mut rows = [[0.0; WIDTH64]; WIDTH64];
    for (row, of) in rows.iter_mut().zip(filled) {
        let (center, radius) = of.pending.sphere(tree);
        *row = [center.x, center.y, center.z, radius];
    }
    let [x, y, z, radius] = simd.columns64(rows.each_ref());
    let [a, b, c] = coefficients(lanes.origin, lanes.direction, [x, y, z], radius);

    // The roots are q/a and c/q; which is the larger hangs on the sign of b.
    let discriminant = discriminant(a, b, c);
    let q = stable_sum(b, discriminant);
    let exists = discriminant.error.lt(discriminant.value.hi) & b.error.lt(b.value.hi.abs());
    let zero = simd.splat64(0.0);
    let is_q_over_a = c.value.hi.lt(zero) & b.value.hi.lt(zero);
    let (n, d) = (select(q, is_q_over_a, c), select(a, is_q_over_a, q));
    let (at, accepted) = n.accepted_quotient(d);
    let (t, rest) = (at.hi.to_array(), (at.lo / at.hi).to_array());
    let right = (exists & accepted).bits();

    for (lane, of) in four.iter().enumerate() {
        let (ray, hit) = (&rays[of.ray_idx as usize], &mut hits[of.ray_idx as usize]);
        if of.tame && right >> lane & 1 == 1 {
            debug_assert!(t[lane] > ray.t_min && t[lane] < ray.t_max);
            let at = Parameter { t: t[lane], t_rest: rest[lane] as f32 };
            *hit = Hit::of_surface(at, PrimKind::Sphere, of.pending.row(tree));
        } else {
            simd.apart(DescribeOne { tree, ray, pending: of.pending, hit });
        }
    }
}

/// One lane by lane where the mask says so, else the other.
#[inline(always)]
fn select<F: F64Lanes>(one: Bounded<F>, mask: F::Mask, other: Bounded<F>) -> Bounded<F> {
    let hi = one.value.hi.select(mask, other.value.hi);
    let lo = one.value.lo.select(mask, other.value.lo);
    Bounded { value: Double { hi, lo }, error: one.error.select(mask, other.error) }
}
