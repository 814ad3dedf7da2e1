//! Quadrics without a box, which stand outside of the tree: every ray is tested against each.
//!
//! Out of line, and with the ray by value: inlined where rays begin, or with an address taken there, they would cost scenes that have none registers.

use super::Accel;
use super::walk::Walk;
use crate::numeric::prepared::PreparedRay;
use crate::simd::{Batch, Simd};
use crate::world::{Hit, World};

impl Accel {
    /// The closest hit outside of the tree.
    #[inline(always)]
    pub fn closest_unbounded<S: Simd>(&self, simd: S, world: &World, walk: &Walk) -> Hit {
        if self.unbounded.is_empty() {
            return Hit::MISS;
        }
        let mut best = Hit::MISS;
        simd.apart(ClosestUnbounded { accel: self, world, ray: walk.prepared(), best: &mut best });
        best
    }

    /// Whether anything outside of the tree is hit.
    #[inline(always)]
    pub fn is_any_unbounded<S: Simd>(&self, simd: S, world: &World, walk: &Walk) -> bool {
        if self.unbounded.is_empty() {
            return false;
        }
        let mut is_hit = false;
        simd.apart(AnyUnbounded { accel: self, world, ray: walk.prepared(), is_hit: &mut is_hit });
        is_hit
    }
}

struct ClosestUnbounded<'a> {
    accel: &'a Accel,
    world: &'a World,
    ray: PreparedRay,
    best: &'a mut Hit,
}

impl Batch for ClosestUnbounded<'_> {
    #[inline(always)]
    fn run<S: Simd>(self, _simd: S) {
        let ClosestUnbounded { accel, world, mut ray, best } = self;
        for prim in &accel.unbounded {
            // Quadrics alone have no box.
            if let Some(found) = world.quadrics.intersect(prim.row(), &ray)
                && found.is_before(best)
            {
                *best = found;
                ray.t_max = ray.t_max.min(found.t.next_up());
            }
        }
    }
}

struct AnyUnbounded<'a> {
    accel: &'a Accel,
    world: &'a World,
    ray: PreparedRay,
    is_hit: &'a mut bool,
}

impl Batch for AnyUnbounded<'_> {
    #[inline(always)]
    fn run<S: Simd>(self, _simd: S) {
        let AnyUnbounded { accel, world, ray, is_hit } = self;
        for prim in &accel.unbounded {
            if world.quadrics.occludes(prim.row(), &ray) {
                *is_hit = true;
                return;
            }
        }
    }
}
