//! Leaves of spheres against a packet.

use super::super::coherence::{N_FOURS, N_LANES, N_RAYS, fours};
use super::super::leaf::sphere::columns;
use super::super::slab::{SlabLanes, Slabs};
use super::super::walk::Pending;
use super::super::wide::{Tag, WideTree};
use super::{DONE, Found, Meeting, PacketQuery};
use crate::numeric::sphere_lanes::{SphereLanes, SphereRays, see};
use crate::simd::{F64Lanes, Simd, WIDTH64, set_bits};
use crate::world::Ray;

/// The rays of a packet as spheres see them: as they were asked, not turned around.
pub type Seeing<F> = [SphereRays<F>; N_FOURS];

/// See [`Seeing`].
#[inline(always)]
pub fn rays<S: Simd>(simd: S, rays: &[Ray; N_RAYS]) -> Seeing<S::F64> {
    let [a, b, c, d] = &fours(simd, rays);
    [SphereRays::four(simd, a), SphereRays::four(simd, b), SphereRays::four(simd, c), SphereRays::four(simd, d)]
}

/// Tests a leaf of spheres; whether any ray may have met one.
#[inline(always)]
pub fn test_leaf<S: Simd, Q: PacketQuery>(
    simd: S,
    tree: &WideTree,
    slab: (&SlabLanes<S::F32>, u8),
    seeing: &Seeing<S::F64>,
    found: &mut Found<Q::Answer>,
    first: u32,
    tag: Tag,
) -> bool {
    let n_prims = tag.n_prims();
    let boxes = boxes(simd, tree, first, n_prims);
    let mut any = false;
    // Each sphere by itself: the box around all of them is larger.
    let (_, met) = slab.0.hits(simd, &boxes, slab.1, found.farthest());
    for i in set_bits(met & ((1 << n_prims) - 1)) {
        let (center, radius) = tree.sphere_of(first as usize, n_prims, i);
        let sphere = [simd.splat64(center.x), simd.splat64(center.y), simd.splat64(center.z), simd.splat64(radius)];
        for lanes in 0..N_LANES {
            let t_max = &found.t_max[lanes];
            let lower = seen::<S, Q>(simd, &seeing[2 * lanes], sphere, [t_max[0], t_max[1], t_max[2], t_max[3]]);
            let upper = seen::<S, Q>(simd, &seeing[2 * lanes + 1], sphere, [t_max[4], t_max[5], t_max[6], t_max[7]]);
            let open = lower.open | upper.open << WIDTH64;
            if open == 0 {
                continue;
            }
            let certain = lower.certain | upper.certain << WIDTH64;
            let [t_low, _] = outwards(simd, lower.t_low, upper.t_low);
            let [_, t_high] = outwards(simd, lower.t_high, upper.t_high);
            let candidate = Pending::new(first, tag, i);
            Q::meet(simd, tree, found, &Meeting { lanes, candidate, open, certain, t_low, t_high });
            any = true;
        }
    }
    any
}

/// A sphere seen by four rays, up to the best hits that they have.
#[inline(always)]
fn seen<S: Simd, Q: PacketQuery>(
    simd: S,
    rays: &SphereRays<S::F64>,
    sphere: [S::F64; 4],
    t_max: [f32; WIDTH64],
) -> SphereLanes<S::F64> {
    let best = simd.widen(t_max);
    let t_max = if Q::IS_ANY {
        // The packet may be turned around: then its parameters are others.
        let done = simd.splat64(DONE.into());
        done.select(best.le(done), rays.t_max)
    } else {
        best.min(rays.t_max)
    };
    see(simd, &rays.until(t_max), sphere)
}

/// Twice four f64 rounded to f32, downwards and upwards.
#[inline(always)]
fn outwards<S: Simd>(simd: S, lower: S::F64, upper: S::F64) -> [S::F32; 2] {
    let ([a_down, a_up], [b_down, b_up]) = (lower.outwards(), upper.outwards());
    [joined(simd, a_down, b_down), joined(simd, a_up, b_up)]
}

#[inline(always)]
fn joined<S: Simd>(simd: S, [a, b, c, d]: [f32; WIDTH64], [e, f, g, h]: [f32; WIDTH64]) -> S::F32 {
    simd.load(&[a, b, c, d, e, f, g, h])
}

/// More than what rounding a coordinate of a box to f32 makes it smaller by, as a share of centre and radius.
const BOX_MARGIN: f64 = 1.0 / (1 << 22) as f64;

/// Boxes around the spheres of a leaf, a little larger than those.
#[inline(always)]
fn boxes<S: Simd>(simd: S, tree: &WideTree, first: u32, n_prims: usize) -> Slabs {
    let mut slabs = Slabs::EMPTY;
    let largest = simd.splat64(f32::MAX.into());
    for start in (0..n_prims).step_by(WIDTH64) {
        let [x, y, z, radius] = columns(simd, tree, first, n_prims, start);
        for (axis, center) in [x, y, z].into_iter().enumerate() {
            let margin = simd.splat64(BOX_MARGIN);
            let reach = (center.abs() + radius).mul_add(margin, radius + simd.splat64(f32::MIN_POSITIVE.into()));
            let [lo, hi] = &mut slabs.planes[axis];
            lo[start..start + WIDTH64].copy_from_slice(&(center - reach).min(largest).to_f32());
            hi[start..start + WIDTH64].copy_from_slice(&(center + reach).max(-largest).to_f32());
        }
    }
    slabs
}
