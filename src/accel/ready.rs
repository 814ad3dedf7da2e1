//! Rays ready to walk: four at a time are made of the rays of a batch.

use super::slab::{SlabRay, Surroundings};
use crate::numeric::four::FourRays;
use crate::numeric::lane::LaneRay;
use crate::numeric::prepared::PreparedRay;
use crate::numeric::rounding::{f32_at_least, f32_at_most};
use crate::simd::{Simd, WIDTH64, bytes_of_bits, set_bits};
use crate::world::Ray;

/// Up to four rays that are ready.
#[derive(Clone, Copy, Debug)]
pub struct Four {
    /// For boxes.
    pub slabs: [SlabRay; WIDTH64],
    /// For triangles in lanes.
    pub lanes: [LaneRay; WIDTH64],
    /// Whether their numbers are tame.
    pub tame: [u8; WIDTH64],
    /// Their places in the batch.
    places: [u32; WIDTH64],
    /// Which of them are still to be taken, one bit each.
    left: u32,
}

impl Four {
    /// None.
    pub const NONE: Four = Four {
        slabs: [SlabRay::everywhere(0.0); WIDTH64],
        lanes: [LaneRay::unknown([0.0; 2], [1.0; 2], 0); WIDTH64],
        tame: [0; WIDTH64],
        places: [0; WIDTH64],
        left: 0,
    };

    /// A ray by itself, as the first of four.
    #[inline(always)]
    pub fn one<S: Simd>(simd: S, ray: &PreparedRay, around: &Surroundings) -> Four {
        let mut four = Four::NONE;
        let rays = FourRays::same(simd, ray);
        if rays.ordinary(simd) == 0 {
            four.set_extraordinary(0, ray);
            return four;
        }
        let (inverse, intervals) = (rays.inverse_sizes(simd), rays.intervals(simd));
        SlabRay::four(simd, &rays, inverse, intervals[0], around, &mut four.slabs);
        LaneRay::four(simd, &rays, inverse, intervals, &mut four.lanes);
        four.tame[0] = ray.tame.into();
        four
    }

    /// Takes the next one, in their order: which of the four it is, and its place in the batch.
    #[inline(always)]
    pub fn next(&mut self) -> Option<(usize, usize)> {
        if self.left == 0 {
            return None;
        }
        let lane = self.left.trailing_zeros() as usize % WIDTH64;
        self.left &= self.left - 1;
        Some((lane, self.places[lane] as usize))
    }

    /// Makes the first `n` of some rays of a batch ready. Which of them hit nothing, not even the box around all, comes back, one
    /// bit each: they are not taken.
    #[inline(always)]
    pub fn fill<S: Simd>(
        &mut self,
        simd: S,
        batch: &[Ray],
        places: [u32; WIDTH64],
        n: usize,
        around: &Surroundings,
    ) -> u32 {
        let [a, b, c, d] = places.map(|place| &batch[place as usize]);
        let rays = FourRays::new(simd, [a.numbers(), b.numbers(), c.numbers(), d.numbers()]);
        let wanted = (1 << n) - 1;
        let ordinary = rays.ordinary(simd);
        let (inverse, intervals) = (rays.inverse_sizes(simd), rays.intervals(simd));
        let near = SlabRay::four(simd, &rays, inverse, intervals[0], around, &mut self.slabs);
        LaneRay::four(simd, &rays, inverse, intervals, &mut self.lanes);
        self.tame = bytes_of_bits(rays.tame(simd)).to_le_bytes();
        self.places = places;
        self.left = wanted & ordinary & if around.is_all { near } else { wanted };
        if wanted & !ordinary != 0 {
            self.fill_extraordinary(batch, wanted & !ordinary);
        }
        wanted & !self.left
    }

    /// Of rays that are not ordinary those are taken that can hit anything.
    #[cold]
    #[inline(never)]
    fn fill_extraordinary(&mut self, batch: &[Ray], lanes: u32) {
        for lane in set_bits(lanes) {
            let lane = lane % WIDTH64;
            if let Some(ray) = batch[self.places[lane] as usize].prepare() {
                self.set_extraordinary(lane, &ray);
                self.left |= 1 << lane;
            }
        }
    }

    /// A ray whose numbers f32 does not hold: every box may be met, and every primitive is tested exactly.
    #[cold]
    #[inline(never)]
    fn set_extraordinary(&mut self, lane: usize, ray: &PreparedRay) {
        let t_min = [f32_at_most(ray.t_min), f32_at_least(ray.t_min)];
        let t_max = [f32_at_most(ray.t_max), f32_at_least(ray.t_max)];
        self.slabs[lane] = SlabRay::everywhere(t_min[0]);
        self.lanes[lane] = LaneRay::unknown(t_min, t_max, ray.axis);
        self.tame[lane] = ray.tame.into();
    }
}
