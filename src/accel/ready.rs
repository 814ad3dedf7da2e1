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
        let rays = Ray::in_lanes(simd, places.map(|place| &batch[place as usize]));
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
                (self.slabs[lane], self.lanes[lane]) = extraordinary(&ray);
                self.tame[lane] = ray.tame.into();
                self.left |= 1 << lane;
            }
        }
    }
}

/// A ray by itself, for boxes and for lanes: the first of four that are the same.
#[inline(always)]
pub fn one<S: Simd>(simd: S, ray: &PreparedRay, around: &Surroundings) -> (SlabRay, LaneRay) {
    let rays = FourRays::same(simd, ray);
    if rays.ordinary(simd) == 0 {
        return extraordinary(ray);
    }
    let Four { mut slabs, mut lanes, .. } = Four::NONE;
    let (inverse, intervals) = (rays.inverse_sizes(simd), rays.intervals(simd));
    SlabRay::four(simd, &rays, inverse, intervals[0], around, &mut slabs);
    LaneRay::four(simd, &rays, inverse, intervals, &mut lanes);
    (slabs[0], lanes[0])
}

/// A ray whose numbers f32 does not hold: every box may be met, and every primitive is tested exactly.
#[cold]
#[inline(never)]
fn extraordinary(ray: &PreparedRay) -> (SlabRay, LaneRay) {
    let t_min = [f32_at_most(ray.t_min), f32_at_least(ray.t_min)];
    let t_max = [f32_at_most(ray.t_max), f32_at_least(ray.t_max)];
    (SlabRay::everywhere(t_min[0]), LaneRay::unknown(t_min, t_max, ray.axis))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::Portable;
    use crate::world::Bounds;
    use glam::{DVec3, Vec3, dvec3};

    const AROUND: Bounds = Bounds { lo: Vec3::splat(-1.0), hi: Vec3::ONE };

    #[test]
    fn rays_that_miss_the_box_around_all_and_those_that_hit_nothing_are_left_out() {
        let to_it = Ray::new(dvec3(0.0, 0.0, 5.0), -DVec3::Z);
        let batch = [
            to_it,
            Ray::new(dvec3(3.0, 0.0, 5.0), -DVec3::Z),
            to_it.until(3.0),
            Ray::new(DVec3::ZERO, DVec3::NAN),
            Ray::new(dvec3(0.0, 0.0, 5.0), DVec3::Z),
            Ray::new(dvec3(0.0, 0.0, 1e35), dvec3(0.0, 0.0, -1.0)),
        ];
        let take = |places: [u32; 4], n: usize, is_all: bool| {
            let mut four = Four::NONE;
            let missed = four.fill(Portable, &batch, places, n, &Surroundings::new(AROUND, 0.0, is_all));
            let taken: Vec<usize> = std::iter::from_fn(|| four.next()).map(|(_, place)| place).collect();
            (missed, taken)
        };
        assert_eq!(take([0, 1, 2, 3], 4, true), (0b1110, vec![0]));
        assert_eq!(take([0, 1, 2, 3], 4, false), (0b1000, vec![0, 1, 2]));
        // Of what f32 does not hold nothing is known.
        assert_eq!(take([4, 5, 0, 4], 3, true), (0b0001, vec![5, 0]));
        assert_eq!(take([1, 1, 1, 1], 1, true), (0b0001, vec![]));
    }

    #[test]
    fn a_ray_is_the_same_alone_and_among_four() {
        let ray = |i: u32| {
            let x = f64::from(i);
            Ray::new(dvec3(0.1 * x, 0.3, -2.0 + x), dvec3(x.sin(), x.cos(), (3.0 * x).sin())).until(10.0 + x)
        };
        let batch: Vec<Ray> = (0..4).map(ray).collect();
        let around = Surroundings::new(AROUND, 0.0, false);
        let mut four = Four::NONE;
        four.fill(Portable, &batch, [0, 1, 2, 3], 4, &around);
        for (lane, ray) in batch.iter().enumerate() {
            let ray = ray.prepare().unwrap();
            let alone = one(Portable, &ray, &around);
            assert_eq!(format!("{alone:?}"), format!("{:?}", (four.slabs[lane], four.lanes[lane])));
            assert_eq!(u8::from(ray.tame), four.tame[lane]);
        }
    }
}
