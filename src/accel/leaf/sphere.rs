//! Leaves of spheres, four lanes at a time.

use super::super::walk::{Pending, Walk};
use super::super::wide::{Tag, WideTree};
use super::{AnyByOne, take};
use crate::numeric::rounding::{f32_at_least, f32_at_most};
use crate::numeric::sphere_lanes::{N_COLUMNS, SphereLanes, SphereRays, see};
use crate::simd::{F64Lanes, Simd, WIDTH64, set_bits};

/// Tests a leaf for the closest hit.
#[inline(always)]
pub fn closest<S: Simd>(simd: S, tree: &WideTree, walk: &mut Walk, first: u32, tag: Tag) {
    for start in (0..tag.n_prims()).step_by(WIDTH64) {
        let seen = four(simd, tree, walk, first, tag, start);
        if seen.open == 0 {
            continue;
        }
        let (low, high) = (seen.t_low.to_array(), seen.t_high.to_array());
        for lane in set_bits(seen.open) {
            let lane = lane % WIDTH64;
            let candidate = Pending::new(first, tag, start + lane);
            let t = (f32_at_most(low[lane]), f32_at_least(high[lane]));
            take(simd, tree, walk, candidate, (seen.certain >> lane & 1 == 1).then_some(t));
        }
    }
}

/// Tests a leaf for any hit.
#[inline(always)]
pub fn any<S: Simd>(simd: S, tree: &WideTree, walk: &Walk, first: u32, tag: Tag) -> bool {
    for start in (0..tag.n_prims()).step_by(WIDTH64) {
        let seen = four(simd, tree, walk, first, tag, start);
        if seen.open & seen.certain != 0 {
            return true;
        }
        if seen.open != 0 {
            let mut is_hit = false;
            let open = seen.open << start;
            simd.apart(AnyByOne { tree, walk, first, tag, open, is_hit: &mut is_hit });
            if is_hit {
                return true;
            }
        }
    }
    false
}

/// Columns of up to four spheres of a leaf, from `start` on; behind the last are other numbers.
#[inline(always)]
pub fn columns<S: Simd>(simd: S, tree: &WideTree, first: u32, n_prims: usize, start: usize) -> [S::F64; N_COLUMNS] {
    let (mut columns, mut at) = ([simd.splat64(0.0); N_COLUMNS], N_COLUMNS * first as usize + start);
    for column in &mut columns {
        // As many zeros stand behind the last column as lanes may read there.
        if let Some(numbers) = tree.spheres[at..].first_chunk() {
            *column = simd.load64(numbers);
        }
        at += n_prims;
    }
    columns
}

/// Sees up to four spheres of a leaf, from `start` on.
#[inline(always)]
fn four<S: Simd>(simd: S, tree: &WideTree, walk: &Walk, first: u32, tag: Tag, start: usize) -> SphereLanes<S::F64> {
    let n_prims = tag.n_prims();
    let columns = columns(simd, tree, first, n_prims, start);
    let within = (1 << (n_prims - start).min(WIDTH64)) - 1;
    if !walk.tame {
        // Products may lose more than the bounds allow for.
        let endless = simd.splat64(f64::INFINITY);
        return SphereLanes { open: within, certain: 0, t_low: -endless, t_high: endless };
    }
    let seen = see(simd, &SphereRays::one(simd, &walk.prepared()), columns);
    SphereLanes { open: seen.open & within, certain: seen.certain & within, ..seen }
}
