//! A batch on its way: where its rays come from and its answers go to.

use super::Accel;
use super::coherence::N_RAYS;
use super::describe::packet::{SEVERAL, Together};
use super::describe::{Rest, Undescribed};
use super::query::Query;
use super::ready::Four;
use super::slab::Surroundings;
use super::walk::{Pending, Walk};
use crate::simd::{Simd, WIDTH64, set_bits};
use crate::world::{Ray, World};

/// Which rays of a batch are still to be started.
pub enum Todo {
    /// A run of them.
    Run(std::ops::Range<usize>),
    /// These.
    Some(std::vec::IntoIter<u32>),
}

impl Todo {
    /// How many of them there are.
    fn len(&self) -> usize {
        match self {
            Todo::Run(range) => range.len(),
            Todo::Some(places) => places.len(),
        }
    }

    /// The next up to four, and how many they are; the others repeat the first.
    #[inline(always)]
    fn next_four(&mut self) -> Option<([u32; WIDTH64], usize)> {
        let n = self.len().min(WIDTH64);
        if n == 0 {
            return None;
        }
        let mut four = [0; WIDTH64];
        match self {
            Todo::Run(range) => {
                let first = range.start as u32;
                range.start += n;
                for (lane, place) in four.iter_mut().enumerate() {
                    *place = first + if lane < n { lane as u32 } else { 0 };
                }
            }
            Todo::Some(places) => {
                let next = places.as_slice();
                for (lane, place) in four.iter_mut().enumerate() {
                    *place = next[if lane < n { lane } else { 0 }];
                }
                // As many as there are.
                places.by_ref().take(n).for_each(drop);
            }
        }
        Some((four, n))
    }
}

/// A batch on its way.
pub struct Asked<'a, Q: Query> {
    /// The structure.
    pub accel: &'a Accel,
    /// What it was built over.
    pub world: &'a World,
    /// The rays.
    pub rays: &'a [Ray],
    /// One answer per ray.
    pub answers: &'a mut [Q::Answer],
    /// Places of rays that are still to be started.
    todo: Todo,
    /// The next of them.
    four: Four,
    around: Surroundings,
    /// Rays whose answers are still to be described.
    rest: Rest,
}

impl<'a, Q: Query> Asked<'a, Q> {
    /// Nothing started yet.
    pub fn new(accel: &'a Accel, world: &'a World, rays: &'a [Ray], answers: &'a mut [Q::Answer]) -> Asked<'a, Q> {
        Asked {
            accel,
            world,
            rays,
            answers,
            todo: Todo::Run(0..0),
            four: Four::NONE,
            around: accel.surroundings(),
            rest: Rest::new(if Q::IS_ANY { 0 } else { rays.len() }),
        }
    }

    /// Says which rays are to be started, in this order.
    #[inline(always)]
    pub fn plan(&mut self, todo: Todo) {
        self.todo = todo;
    }

    /// How many rays are still to be started.
    pub fn n_left(&self) -> usize {
        self.todo.len()
    }

    /// Takes the next ray that has to walk, and says its place in the batch.
    #[inline(always)]
    pub fn start<S: Simd>(&mut self, simd: S, walk: &mut Walk) -> Option<usize> {
        loop {
            let Some((lane, ray_idx)) = self.four.next() else {
                if !self.fill(simd) {
                    return None;
                }
                continue;
            };
            walk.begin(&self.four, lane, &self.rays[ray_idx]);
            match Q::begin(simd, self.accel, self.world, walk) {
                Ok(hit) => {
                    if hit.is_some() {
                        walk.keep(hit);
                    }
                    return Some(ray_idx);
                }
                Err(answer) => self.answers[ray_idx] = answer,
            }
        }
    }

    /// Makes the next rays ready; whether there were any.
    #[inline(always)]
    fn fill<S: Simd>(&mut self, simd: S) -> bool {
        let Some((places, n)) = self.todo.next_four() else { return false };
        for lane in set_bits(self.four.fill(simd, self.rays, places, n, &self.around)) {
            self.answers[places[lane % WIDTH64] as usize] = Q::NOTHING;
        }
        true
    }

    /// Answers all rays by the full scan.
    pub fn scan(&mut self) {
        for (ray, answer) in self.rays.iter().zip(self.answers.iter_mut()) {
            *answer = ray.prepare().map_or(Q::NOTHING, |ray| Q::scan(self.world, &ray));
        }
    }

    /// Takes the answers of a packet whose first ray is at `first`. What some rays have certainly hit, one bit each, is described now
    /// where several have hit the same, or noted to be described later.
    #[inline(always)]
    pub fn end_packet<S: Simd>(
        &mut self,
        simd: S,
        first: usize,
        mut answers: [Q::Answer; N_RAYS],
        mut left: u32,
        pending: &[Pending; N_RAYS],
        rays: &[Ray; N_RAYS],
    ) {
        let tree = &self.accel.tree;
        let mut alone = 0;
        while left.count_ones() >= SEVERAL {
            let lead = pending[left.trailing_zeros() as usize % N_RAYS];
            let mut which = 0;
            for (i, &pending) in pending.iter().enumerate() {
                which |= u32::from(pending == lead) << i;
            }
            which &= left;
            left &= !which;
            let together = Together { tree, rays, which, pending: lead, answers: &mut answers };
            if which.count_ones() < SEVERAL || !Q::describe_packet(simd, together) {
                alone |= which;
            }
        }
        self.answers[first..first + N_RAYS].copy_from_slice(&answers);
        for i in set_bits(alone | left) {
            // Rays of packets are tame.
            self.rest
                .push_if(true, Undescribed { ray_idx: (first + i) as u32, tame: true, pending: pending[i % N_RAYS] });
        }
    }

    /// Takes the result of a walk.
    #[inline(always)]
    pub fn end(&mut self, walk: &Walk, is_over: bool, ray_idx: usize) {
        Q::end(walk, is_over, ray_idx, &mut self.answers[ray_idx], &mut self.rest);
    }

    /// Describes what is left once all have ended.
    #[inline(always)]
    pub fn describe<S: Simd>(&mut self, simd: S) {
        Q::describe(simd, &self.accel.tree, self.rays, &mut self.rest, self.answers);
    }
}
