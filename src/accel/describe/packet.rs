//! Rays of one origin that hit the same: what depends on it and on the origin alone is computed once for all.

use super::super::coherence::{Fours, N_RAYS, fours};
use super::super::walk::Pending;
use super::super::wide::WideTree;
use super::{DescribeOne, Described, sphere, triangle};
use crate::numeric::plane::Pair;
use crate::simd::{CYCLIC, Simd, WIDTH64, set_bits};
use crate::world::{Hit, PrimRef, Ray};

/// Rays that have to have hit the same for it to be described for them together.
pub const SEVERAL: u32 = 6;

/// Rays of a packet and what they have certainly hit in common. All rays must be tame and have the same origin.
pub struct Together<'a, A> {
    /// The tree.
    pub tree: &'a WideTree,
    /// The packet.
    pub rays: &'a [Ray; N_RAYS],
    /// Which of its rays, one bit each.
    pub which: u32,
    /// What they have hit.
    pub pending: Pending,
    /// The packet's answers.
    pub answers: &'a mut [A; N_RAYS],
}

impl Together<'_, Hit> {
    /// Describes the hits; whether it could be done together.
    #[inline(always)]
    pub fn describe<S: Simd>(self, simd: S) -> bool {
        let fours = fours(simd, self.rays);
        if self.pending.is_triangle() {
            // Rays along different axes have their sums in different orders.
            let axis = fours[0].axes()[0];
            if !fours.iter().all(|four| four.axes() == [axis; WIDTH64]) {
                return false;
            }
            self.triangle(simd, &fours, CYCLIC[usize::from(axis) % CYCLIC.len()]);
        } else {
            self.sphere(simd, &fours);
        }
        true
    }

    /// Describes a triangle; its normal and distance do not change from turn to turn of the loop.
    #[inline(always)]
    fn triangle<S: Simd>(mut self, simd: S, fours: &Fours<S>, axes: [usize; 3]) {
        let (mut origin, mut corners) = ([simd.splat64(0.0); 3], [[simd.splat64(0.0); 3]; 3]);
        let of = self.pending.corners(self.tree);
        for (i, axis) in axes.into_iter().enumerate() {
            origin[i] = simd.splat64(self.rays[0].origin[axis]);
            for (corner, of) in corners.iter_mut().zip(&of) {
                corner[i] = simd.splat64(of[axis].into());
            }
        }
        let prim = self.pending.prim(self.tree);
        for (i, four) in fours.iter().enumerate() {
            if self.is_asked(i) {
                let pair = Pair { origin, direction: four.in_axes(four.direction), corners };
                let described = triangle::describe(simd, &pair);
                self.write(simd, i, prim, &described);
            }
        }
    }

    /// Describes a sphere, in the same way.
    #[inline(always)]
    fn sphere<S: Simd>(mut self, simd: S, fours: &Fours<S>) {
        let (o, (c, r)) = (self.rays[0].origin, self.pending.sphere(self.tree));
        let origin = [simd.splat64(o.x), simd.splat64(o.y), simd.splat64(o.z)];
        let (center, radius) = ([simd.splat64(c.x), simd.splat64(c.y), simd.splat64(c.z)], simd.splat64(r));
        let prim = self.pending.prim(self.tree);
        for (i, four) in fours.iter().enumerate() {
            if self.is_asked(i) {
                let described = sphere::describe(simd, origin, four.direction, center, radius);
                self.write(simd, i, prim, &described);
            }
        }
    }

    /// Whether any of four rays is asked for.
    #[inline(always)]
    fn is_asked(&self, four: usize) -> bool {
        self.which >> (four * WIDTH64) & 0b1111 != 0
    }

    /// Writes those of four hits that are asked for.
    #[inline(always)]
    fn write<S: Simd>(&mut self, simd: S, four: usize, prim: PrimRef, described: &Described) {
        let which = self.which >> (four * WIDTH64) & 0b1111;
        for lane in set_bits(which & described.certain) {
            described.write_one(lane % WIDTH64, prim, &mut self.answers[(four * WIDTH64 + lane) % N_RAYS]);
        }
        for lane in set_bits(which & !described.certain) {
            let i = (four * WIDTH64 + lane) % N_RAYS;
            simd.apart(DescribeOne {
                tree: self.tree,
                ray: &self.rays[i],
                pending: self.pending,
                hit: &mut self.answers[i],
            });
        }
    }
}
