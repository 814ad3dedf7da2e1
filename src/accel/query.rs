//! What is asked of a batch of rays, and the batch on its way: where rays come from and answers go to.

use super::coherence::N_RAYS;
use super::describe::packet::{self, SEVERAL};
use super::describe::{Rest, Undescribed};
use super::leaf::{self, Seen};
use super::ready::Four;
use super::slab::Surroundings;
use super::walk::{Best, Pending, Walk};
use super::wide::{Tag, WideTree};
use super::{Accel, linear};
use crate::numeric::prepared::PreparedRay;
use crate::simd::{F32Lanes, Simd, WIDTH, WIDTH64, set_bits};
use crate::world::{Hit, Ray, World};

/// What a batch asks.
pub trait Query {
    /// The answer to one ray.
    type Answer: Copy;
    /// The answer to a ray that can hit nothing.
    const NOTHING: Self::Answer;
    /// Whether any hit is as good as the closest; none is then described.
    const IS_ANY: bool;

    /// The answer of the full scan.
    fn scan(world: &World, ray: &PreparedRay) -> Self::Answer;

    /// Asks the primitives outside of the tree: a hit to begin the walk with, or the answer where none is needed.
    fn begin<S: Simd>(simd: S, accel: &Accel, world: &World, walk: &Walk) -> Result<Hit, Self::Answer>;

    /// What is to be known of the triangles of a leaf.
    type Seen: Copy + Default;

    /// What is kept of what a leaf was seen to be.
    fn kept<F: F32Lanes>(seen: Seen<F>) -> Self::Seen;

    /// Sees the triangles of a leaf, without a branch.
    #[inline(always)]
    fn see<S: Simd>(simd: S, tree: &WideTree, walk: &Walk, first: u32, tag: Tag) -> Self::Seen {
        Self::kept(leaf::see(simd, tree, walk, first, tag))
    }

    /// Takes what was seen of the triangles of a leaf; whether the walk is over.
    fn take<S: Simd>(simd: S, tree: &WideTree, walk: &mut Walk, first: u32, tag: Tag, seen: &Self::Seen) -> bool;

    /// Tests a leaf of another kind; whether the walk is over.
    fn other_leaf<S: Simd>(simd: S, tree: &WideTree, world: &World, walk: &mut Walk, first: u32, tag: Tag) -> bool;

    /// Tests a leaf; whether the walk is over.
    #[inline(always)]
    fn leaf<S: Simd>(simd: S, tree: &WideTree, world: &World, walk: &mut Walk, first: u32, tag: Tag) -> bool {
        if tag.is_triangles() {
            return match leaf::see_unless_missed(simd, tree, walk, first, tag) {
                Some(seen) => Self::take(simd, tree, walk, first, tag, &Self::kept(seen)),
                None => false,
            };
        }
        Self::other_leaf(simd, tree, world, walk, first, tag)
    }

    /// Writes the answer of a finished walk, and notes what is still to be described.
    fn end(walk: &Walk, is_over: bool, ray_idx: usize, answer: &mut Self::Answer, rest: &mut Rest);

    /// Describes what rays of a packet, one bit each, have hit, if it can be done for all of them together; whether it could.
    fn describe_packet<S: Simd>(
        simd: S,
        tree: &WideTree,
        rays: &[Ray; N_RAYS],
        which: u32,
        pending: Pending,
        answers: &mut [Self::Answer; N_RAYS],
    ) -> bool;

    /// Describes what is still to be described.
    fn describe<S: Simd>(simd: S, tree: &WideTree, rays: &[Ray], rest: &mut Rest, answers: &mut [Self::Answer]);
}

/// The closest hit.
#[derive(Clone, Copy, Debug)]
pub struct Closest;

/// Whether anything is hit.
#[derive(Clone, Copy, Debug)]
pub struct Any;

impl Query for Closest {
    type Answer = Hit;
    const NOTHING: Hit = Hit::MISS;
    const IS_ANY: bool = false;

    #[inline(always)]
    fn scan(world: &World, ray: &PreparedRay) -> Hit {
        linear::closest_hit(world, ray)
    }

    #[inline(always)]
    fn begin<S: Simd>(simd: S, accel: &Accel, world: &World, walk: &Walk) -> Result<Hit, Hit> {
        Ok(accel.closest_unbounded(simd, world, walk))
    }

    type Seen = Seen<[f32; WIDTH]>;

    #[inline(always)]
    fn kept<F: F32Lanes>(seen: Seen<F>) -> Self::Seen {
        let Seen { open, certain, t_low, t_high } = seen;
        Seen { open, certain, t_low: t_low.to_array(), t_high: t_high.to_array() }
    }

    #[inline(always)]
    fn take<S: Simd>(simd: S, tree: &WideTree, walk: &mut Walk, first: u32, tag: Tag, seen: &Self::Seen) -> bool {
        leaf::take_closest(simd, tree, walk, first, tag, seen);
        false
    }

    #[inline(always)]
    fn other_leaf<S: Simd>(simd: S, tree: &WideTree, world: &World, walk: &mut Walk, first: u32, tag: Tag) -> bool {
        leaf::closest(simd, tree, world, walk, first, tag);
        false
    }

    #[inline(always)]
    fn end(walk: &Walk, _is_over: bool, ray_idx: usize, answer: &mut Hit, rest: &mut Rest) {
        // Without a branch, which would go wrong where some rays hit and others do not.
        *answer = walk.best.hit;
        let Best { pending, is_pending, .. } = walk.best;
        rest.push_if(is_pending, Undescribed { ray_idx: ray_idx as u32, pending, tame: walk.tame });
    }

    #[inline(always)]
    fn describe_packet<S: Simd>(
        simd: S,
        tree: &WideTree,
        rays: &[Ray; N_RAYS],
        which: u32,
        pending: Pending,
        answers: &mut [Hit; N_RAYS],
    ) -> bool {
        packet::describe(simd, tree, rays, which, pending, answers)
    }

    #[inline(always)]
    fn describe<S: Simd>(simd: S, tree: &WideTree, rays: &[Ray], rest: &mut Rest, answers: &mut [Hit]) {
        rest.describe(simd, tree, rays, answers);
    }
}

impl Query for Any {
    type Answer = bool;
    const NOTHING: bool = false;
    const IS_ANY: bool = true;

    #[inline(always)]
    fn scan(world: &World, ray: &PreparedRay) -> bool {
        linear::occluded(world, ray)
    }

    #[inline(always)]
    fn begin<S: Simd>(simd: S, accel: &Accel, world: &World, walk: &Walk) -> Result<Hit, bool> {
        if accel.is_any_unbounded(simd, world, walk) { Err(true) } else { Ok(Hit::MISS) }
    }

    type Seen = Seen<()>;

    #[inline(always)]
    fn kept<F: F32Lanes>(seen: Seen<F>) -> Self::Seen {
        let Seen { open, certain, .. } = seen;
        Seen { open, certain, t_low: (), t_high: () }
    }

    #[inline(always)]
    fn take<S: Simd>(simd: S, tree: &WideTree, walk: &mut Walk, first: u32, tag: Tag, seen: &Self::Seen) -> bool {
        leaf::take_any(simd, tree, walk, first, tag, seen)
    }

    #[inline(always)]
    fn other_leaf<S: Simd>(simd: S, tree: &WideTree, world: &World, walk: &mut Walk, first: u32, tag: Tag) -> bool {
        leaf::any(simd, tree, world, walk, first, tag)
    }

    #[inline(always)]
    fn end(_walk: &Walk, is_over: bool, _ray_idx: usize, answer: &mut bool, _rest: &mut Rest) {
        *answer = is_over;
    }

    #[inline(always)]
    fn describe_packet<S: Simd>(
        _simd: S,
        _tree: &WideTree,
        _rays: &[Ray; N_RAYS],
        _which: u32,
        _pending: Pending,
        _answers: &mut [bool; N_RAYS],
    ) -> bool {
        false
    }

    #[inline(always)]
    fn describe<S: Simd>(_simd: S, _tree: &WideTree, _rays: &[Ray], _rest: &mut Rest, _answers: &mut [bool]) {}
}

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

    /// Describes what rays of a packet, the first being at `first`, have certainly hit, or notes it to be described later.
    #[inline(always)]
    pub fn describe_packet<S: Simd>(&mut self, simd: S, first: usize, mut left: u32, pending: &[Pending; N_RAYS]) {
        let tree = &self.accel.tree;
        let mut alone = 0;
        while left.count_ones() >= SEVERAL {
            let lead = pending[left.trailing_zeros() as usize % N_RAYS];
            let mut same = 0;
            for (i, &pending) in pending.iter().enumerate() {
                same |= u32::from(pending == lead) << i;
            }
            same &= left;
            left &= !same;
            if same.count_ones() >= SEVERAL
                && let Some(rays) = self.rays[first..].first_chunk()
                && let Some(answers) = self.answers[first..].first_chunk_mut()
                && Q::describe_packet(simd, tree, rays, same, lead, answers)
            {
                continue;
            }
            alone |= same;
        }
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
