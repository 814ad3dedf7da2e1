//! Parameters of spheres that were certainly hit.

use super::super::wide::WideTree;
use super::{DescribeOne, Undescribed, filled, rays_of};
use crate::numeric::quadratic::{discriminant, stable_sum};
use crate::numeric::ratio::{ACCEPTED_RELATIVE_ERROR, Bounded, Parameter};
use crate::numeric::sphere::coefficients;
use crate::simd::{F64Lanes, MaskLanes, Simd, WIDTH64};
use crate::world::{Hit, PrimKind, Ray};

/// A root in lanes.
struct Roots {
    t: [f64; WIDTH64],
    rest: [f64; WIDTH64],
    /// Whether it is good enough to be reported, one bit each.
    accepted: u32,
}

/// The same arithmetic as [`sphere::intersect`](crate::numeric::sphere::intersect), for which the lanes are that are not certain.
#[inline(always)]
pub fn describe_four<S: Simd>(simd: S, tree: &WideTree, rays: &[Ray], four: &[Undescribed], hits: &mut [Hit]) {
    let filled = filled(four);
    let lanes = rays_of(simd, rays, filled);
    let mut rows = [[0.0; WIDTH64]; WIDTH64];
    for (row, of) in rows.iter_mut().zip(filled) {
        let (center, radius) = of.pending.sphere(tree);
        *row = [center.x, center.y, center.z, radius];
    }
    let [x, y, z, radius] = simd.columns64(rows);
    let [a, b, c] = coefficients(lanes.origin, lanes.direction, [x, y, z], radius);

    // The roots q/a and c/q.
    let discriminant = discriminant(a, b, c);
    let q = stable_sum(b, discriminant);
    let exists = discriminant.error.lt(discriminant.value.hi) & b.error.lt(b.value.hi.abs());
    let exists = exists.bits();
    let roots = [quotient(simd, q, a), quotient(simd, c, q)];

    for (lane, of) in four.iter().enumerate() {
        let (ray, hit) = (&rays[of.ray_idx as usize], &mut hits[of.ray_idx as usize]);
        let is_known = of.tame && (exists & roots[0].accepted & roots[1].accepted) >> lane & 1 == 1;
        // Roots outside of the interval, negative ones included, are not the first inside.
        let inside = |root: &&Roots| root.t[lane] > ray.t_min && root.t[lane] < ray.t_max;
        let first = roots.iter().filter(inside).min_by(|x, y| x.t[lane].total_cmp(&y.t[lane]));
        match first {
            Some(root) if is_known => {
                let at = Parameter { t: root.t[lane], t_rest: root.rest[lane] as f32 };
                *hit = Hit::of_surface(at, PrimKind::Sphere, of.pending.row(tree));
            }
            _ => simd.apart(DescribeOne { tree, ray, pending: of.pending, hit }),
        }
    }
}

#[inline(always)]
fn quotient<S: Simd>(simd: S, n: Bounded<S::F64>, d: Bounded<S::F64>) -> Roots {
    let (at, relative_error) = n.quotient(d);
    let accepted = n.error.lt(n.value.hi.abs())
        & d.error.lt(d.value.hi.abs())
        & relative_error.le(simd.splat64(ACCEPTED_RELATIVE_ERROR));
    Roots { t: at.hi.to_array(), rest: (at.lo / at.hi).to_array(), accepted: accepted.bits() }
}
