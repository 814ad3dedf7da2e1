//! Parameters and weights of triangles that were certainly hit.

use glam::Vec3;

use super::super::wide::WideTree;
use super::{Described, Undescribed, rays_of};
use crate::numeric::edge::{Sheared, shear};
use crate::numeric::plane::{Pair, plane_quotient};
use crate::simd::{F64Lanes, MaskLanes, Simd, WIDTH64};
use crate::world::Ray;

/// Four rays and the triangles that they hit.
#[inline(always)]
pub fn of_four<S: Simd>(simd: S, tree: &WideTree, rays: &[Ray], four: [&Undescribed; WIDTH64]) -> Described {
    let lanes = rays_of(simd, rays, four);
    let [a, b, c, d] = four;
    let all = [a.pending.corners(tree), b.pending.corners(tree), c.pending.corners(tree), d.pending.corners(tree)];
    let mut corners = lanes_of(simd, &all);
    // Each in its ray's axes. (No closures: they are not always inlined.)
    for corner in &mut corners {
        *corner = lanes.in_axes(*corner);
    }
    describe(simd, &Pair { origin: lanes.in_axes(lanes.origin), direction: lanes.in_axes(lanes.direction), corners })
}

/// The corners of four triangles in lanes.
#[inline(always)]
fn lanes_of<S: Simd>(simd: S, [a, b, c, d]: &[[Vec3; 3]; WIDTH64]) -> [[S::F64; 3]; 3] {
    let mut lanes = [[simd.splat64(0.0); 3]; 3];
    for (i, lanes) in lanes.iter_mut().enumerate() {
        *lanes = [
            simd.widen([a[i].x, b[i].x, c[i].x, d[i].x]),
            simd.widen([a[i].y, b[i].y, c[i].y, d[i].y]),
            simd.widen([a[i].z, b[i].z, c[i].z, d[i].z]),
        ];
    }
    lanes
}

/// The same arithmetic as [`triangle::intersect`](crate::numeric::triangle::intersect), for which the lanes are that are not certain.
#[inline(always)]
pub fn describe<S: Simd>(simd: S, pair: &Pair<S::F64>) -> Described {
    // Weights.
    let Sheared { weights: [weight_a, weight_b, weight_c], error, .. } = shear(pair);
    let reciprocal = simd.splat64(1.0) / (weight_a + weight_b + weight_c);
    let inside = error.lt(weight_a.abs()) & error.lt(weight_b.abs()) & error.lt(weight_c.abs());

    // Parameter.
    let [n, d] = plane_quotient(pair);
    let (at, accepted) = n.accepted_quotient(d);
    Described {
        t: at.hi.to_array(),
        t_rest: (at.lo / at.hi).to_array(),
        u: (weight_b * reciprocal).to_array(),
        v: (weight_c * reciprocal).to_array(),
        certain: (inside & accepted).bits(),
    }
}
