//! What a packet makes of what it has met.

use super::super::coherence::N_RAYS;
use super::super::query::{Any, Closest};
use super::super::walk::Pending;
use super::super::wide::WideTree;
use super::{DONE, Found, Meeting, PacketQuery};
use crate::numeric::prepared::PreparedRay;
use crate::numeric::rounding::{f32_at_least, f32_at_most};
use crate::numeric::triangle;
use crate::simd::{Batch, F32Lanes, MaskLanes, Simd, WIDTH, WIDTH64, set_bits};
use crate::world::{Hit, Ray};

impl PacketQuery for Closest {
    #[inline(always)]
    fn meet<S: Simd>(simd: S, tree: &WideTree, found: &mut Found<Hit>, meeting: &Meeting<S::F32>) {
        let &Meeting { lanes, candidate, open, t_low, t_high, .. } = meeting;
        let (best_low, best_high) = (simd.load(&found.t_low[lanes]), simd.load(&found.t_max[lanes]));
        let closer = t_high.lt(best_low);
        found.t_low[lanes] = t_low.select(closer, best_low).to_array();
        found.t_max[lanes] = t_high.select(closer, best_high).to_array();
        let closer = closer.bits();
        found.is_pending |= closer << (lanes * WIDTH);
        for lane in set_bits(closer) {
            found.pending[lanes * WIDTH + lane] = candidate;
        }
        for lane in set_bits(open & !closer) {
            simd.apart(ClosestByOne { tree, found, i: lanes * WIDTH + lane, candidate });
        }
    }
}

impl PacketQuery for Any {
    #[inline(always)]
    fn meet<S: Simd>(simd: S, tree: &WideTree, found: &mut Found<bool>, meeting: &Meeting<S::F32>) {
        let &Meeting { lanes, candidate, open, certain, .. } = meeting;
        let (mut hits, uncertain) = (certain, open & !certain);
        if uncertain != 0 {
            simd.apart(AnyByOne { tree, rays: found.rays, lanes, candidate, uncertain, hits: &mut hits });
        }
        for lane in set_bits(hits) {
            found.stop(lanes * WIDTH + lane);
        }
    }
}

/// Which of eight rays have a primitive in their interval, where lanes are not certain.
struct AnyByOne<'a> {
    tree: &'a WideTree,
    rays: &'a [Ray; N_RAYS],
    /// Which eight.
    lanes: usize,
    candidate: Pending,
    /// Those that are asked for, one bit each.
    uncertain: u32,
    /// Those that hit.
    hits: &'a mut u32,
}

impl Batch for AnyByOne<'_> {
    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let AnyByOne { tree, rays, lanes, candidate, mut uncertain, hits } = self;
        let rays = &rays[lanes * WIDTH..][..WIDTH];
        if candidate.is_triangle() {
            // Most have just left the triangle, which f64 knows of several at once. Rays of packets are tame.
            let corners = candidate.corners(tree);
            for (i, of) in rays.as_chunks::<WIDTH64>().0.iter().enumerate() {
                let four = Ray::in_lanes(simd, of.each_ref());
                uncertain &= !(triangle::is_behind(four.origin, four.direction, corners).bits() << (i * WIDTH64));
            }
        }
        for lane in set_bits(uncertain) {
            if rays[lane].prepare_with(simd).is_some_and(|ray| candidate.occludes(tree, &ray)) {
                *hits |= 1 << lane;
            }
        }
    }
}

/// Compares a primitive with the best hit of a ray, where intervals are not enough.
struct ClosestByOne<'a, 'b> {
    tree: &'a WideTree,
    found: &'a mut Found<'b, Hit>,
    i: usize,
    candidate: Pending,
}

impl Batch for ClosestByOne<'_, '_> {
    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let ClosestByOne { tree, found, i, candidate } = self;
        // A triangle that was cut stands in several leaves.
        if found.is_pending >> i & 1 == 1 && found.pending[i].prim(tree) == candidate.prim(tree) {
            return;
        }
        let Some(ray) = found.rays[i].prepare_with(simd) else { return };
        if let Some(hit) = candidate.intersect(tree, &ray) {
            found.offer(tree, i, &ray, hit);
        }
    }
}

impl Found<'_, bool> {
    /// Takes a ray as one that something lies in front of.
    #[inline(always)]
    pub fn stop(&mut self, i: usize) {
        self.answers[i] = true;
        self.t_max[i / WIDTH][i % WIDTH] = DONE;
    }
}

impl Found<'_, Hit> {
    /// Takes a hit of a ray if it is closer than the best.
    #[inline(always)]
    pub fn offer(&mut self, tree: &WideTree, i: usize, ray: &PreparedRay, hit: Hit) {
        if self.is_pending >> i & 1 == 1 {
            self.is_pending &= !(1 << i);
            // Only what is certainly hit is pending.
            let best = self.pending[i].intersect(tree, ray);
            debug_assert!(best.is_some());
            self.keep(i, best.unwrap_or(Hit::MISS));
        }
        if hit.is_before(&self.answers[i]) {
            self.keep(i, hit);
        }
    }

    /// Takes a hit as the best of a ray.
    pub fn keep(&mut self, i: usize, hit: Hit) {
        self.answers[i] = hit;
        self.t_low[i / WIDTH][i % WIDTH] = f32_at_most(hit.t);
        self.t_max[i / WIDTH][i % WIDTH] = f32_at_least(hit.t);
    }
}
