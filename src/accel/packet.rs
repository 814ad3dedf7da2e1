//! Sixteen rays of one origin together: boxes are tested once for all of them, and a triangle of a leaf against all of them
//! at once.
//!
//! Neighbouring camera rays are such packets, and so are shadow rays, which end in one light and are walked from there. What
//! else a batch has is left for [`stream`](super::stream).

use super::coherence::{Column, N_LANES, N_RAYS, Packet, packet};
use super::order::{Item, Limit};
use super::query::{Any, Asked, Closest, Query};
use super::single::{Mailboxes, Stack};
use super::walk::Pending;
use super::wide::{N_COORDINATES, Tag, WideTree};
use crate::numeric::four::FourRays;
use crate::numeric::lane::LaneEdges;
use crate::numeric::rounding::{f32_at_least, f32_at_most};
use crate::numeric::triangle;
use crate::simd::{Batch, F32Lanes, MaskLanes, Simd, WIDTH, WIDTH64, set_bits};
use crate::world::{Hit, Ray};

/// What the rays of a packet have found so far.
pub struct Found<'a, A> {
    rays: &'a [Ray; N_RAYS],
    answers: &'a mut [A; N_RAYS],
    /// Upper ends of what is still of interest, rounded up; negative for a ray that needs no more.
    t_max: Column,
    /// Lower bounds of the closest parameters.
    t_low: Column,
    /// Bit per ray whose best hit is a triangle that is still to be described: which one.
    is_pending: u32,
    pending: [Pending; N_RAYS],
}

/// A query that packets can ask.
pub trait PacketQuery: Query {
    /// Leaves that a packet may test; with more of them its rays had better gone alone (`docs/BENCHMARKS.md`).
    const MANY_LEAVES: usize;

    /// Takes what eight rays of a packet have found of a triangle: rays that may hit it, of these the ones that certainly do,
    /// and the intervals that their parameters lie in.
    fn meet<S: Simd>(simd: S, tree: &WideTree, found: &mut Found<Self::Answer>, meeting: &Meeting<S::F32>);
}

/// Eight rays and a triangle.
pub struct Meeting<F: F32Lanes> {
    /// Which eight rays.
    lanes: usize,
    /// The triangle.
    triangle: Pending,
    /// Rays that may hit it.
    open: F::Mask,
    /// Rays that certainly do.
    certain: F::Mask,
    t_low: F,
    t_high: F,
}

/// Answers the packets of a batch; the places of all other rays come back.
#[inline(always)]
pub fn run<S: Simd, Q: PacketQuery>(simd: S, asked: &mut Asked<Q>) -> Vec<u32> {
    let tree = &asked.accel.tree;
    let mut items = vec![0; 2 * tree.stack_size()];
    let mut stack = Stack::new(&mut items, Mailboxes::new(tree));
    let around = asked.accel.surroundings();
    let mut others = Vec::with_capacity(asked.rays.len());
    let n_rays = asked.rays.len();
    let mut patience = Patience::default();
    let mut first = 0;
    while first < n_rays {
        // No closures: they are not always inlined, and what is not inlined is compiled for the baseline.
        let rays = asked.rays[first..].first_chunk::<N_RAYS>();
        let coherent = match rays {
            Some(rays) if patience.tries() => packet(simd, rays, &around, Q::IS_ANY),
            _ => None,
        };
        let (Some(rays), Some(packet)) = (rays, coherent) else {
            let end = n_rays.min(first + N_RAYS);
            others.extend(first as u32..end as u32);
            first = end;
            continue;
        };
        let mut answers = [Q::NOTHING; N_RAYS];
        let mut found = Found {
            rays,
            answers: &mut answers,
            t_max: packet.t_max[0],
            t_low: [[f32::INFINITY; WIDTH]; N_LANES],
            is_pending: 0,
            pending: [Pending::NOTHING; N_RAYS],
        };
        let n_leaves = traverse::<S, Q>(simd, tree, &packet, &mut found, &mut stack);
        patience.saw(n_leaves, Q::MANY_LEAVES);
        if n_leaves > Q::MANY_LEAVES {
            others.extend(first as u32..(first + N_RAYS) as u32);
        } else {
            let Found { is_pending, pending, .. } = found;
            asked.answers[first..first + N_RAYS].copy_from_slice(&answers);
            asked.describe_later(first, is_pending, &pending);
        }
        first += N_RAYS;
    }
    others
}

/// Packets that are not tried at most, once some had better not been.
const MOST_LEFT_OUT: usize = 256;

/// Where triangles are smaller than packets, rays are left to go alone, and a packet is tried now and then: four times as seldom
/// each time that it is no better, and twice as often each time that it is.
#[derive(Default)]
struct Patience {
    /// Packets that are still to be left out.
    left_out: usize,
    /// How many were left out last.
    last: usize,
}

impl Patience {
    /// Whether the next packet is tried.
    fn tries(&mut self) -> bool {
        let tries = self.left_out == 0;
        self.left_out = self.left_out.saturating_sub(1);
        tries
    }

    /// Learns how many leaves a packet has tested, and how many are too many.
    fn saw(&mut self, n_leaves: usize, many: usize) {
        // One that has met nothing says nothing.
        if n_leaves > many {
            self.last = (4 * self.last).clamp(4, MOST_LEFT_OUT);
        } else if n_leaves > 0 {
            self.last /= 2;
        }
        self.left_out = self.last;
    }
}

/// Walks the tree with a packet; how many leaves it has tested. With too many of them it is given up.
#[inline(always)]
fn traverse<S: Simd, Q: PacketQuery>(
    simd: S,
    tree: &WideTree,
    packet: &Packet,
    found: &mut Found<Q::Answer>,
    stack: &mut Stack<'_>,
) -> usize {
    let mut n_leaves = 0;
    if tree.nodes.is_empty() {
        return n_leaves;
    }
    stack.begin();
    let mut farthest = found.farthest();
    let (slab, octant) = (packet.slab.lanes(simd), packet.slab.octant);
    let mut item = Item::ROOT;
    loop {
        let tag = item.tag();
        if tag.n_prims() == 0 {
            if let Some(nearest) = stack.open(simd, &tree.nodes, &slab, octant, farthest, item.child()) {
                item = nearest;
                continue;
            }
        } else if !stack.tested.has(item, stack.ray) {
            n_leaves += 1;
            if n_leaves > Q::MANY_LEAVES {
                return n_leaves;
            }
            if test_leaf::<S, Q>(simd, tree, packet, found, item.child(), tag) {
                farthest = found.farthest();
                if farthest < 0.0 {
                    return n_leaves;
                }
            }
        }
        let Some(next) = stack.pop(Limit::at(farthest)) else { return n_leaves };
        item = next;
    }
}

/// Tests a leaf of triangles; whether any ray may have met one.
#[inline(always)]
fn test_leaf<S: Simd, Q: PacketQuery>(
    simd: S,
    tree: &WideTree,
    packet: &Packet,
    found: &mut Found<Q::Answer>,
    first: u32,
    tag: Tag,
) -> bool {
    let n_prims = tag.n_prims();
    let seen = packet.shear.edges(simd, &tree.corners, N_COORDINATES * first as usize, n_prims);
    let all = (1 << n_prims) - 1;
    let open = [packet.spans[0].open(simd, &seen) & all, packet.spans[1].open(simd, &seen) & all];
    if open == [0; N_LANES] {
        return false;
    }
    let mut any = false;
    let columns = seen.columns();
    for (lanes, triangles) in open.into_iter().enumerate() {
        let (dx, dy) = (simd.load(&packet.dx[lanes]), simd.load(&packet.dy[lanes]));
        for lane in set_bits(triangles) {
            let edges: LaneEdges<S::F32> = columns.edges(simd, lane, dx, dy);
            let open = edges.open();
            if open.bits() == 0 {
                continue;
            }
            let (t_low, t_high) = edges.t_ranges(simd, simd.load(&packet.reciprocal[lanes]), simd.splat(packet.slack));
            let [min_above, min_below] = &packet.t_min;
            let outside = simd.load(&found.t_max[lanes]).lt(t_low) | t_high.lt(simd.load(&min_below[lanes]));
            let open = open & !outside;
            if open.bits() == 0 {
                continue;
            }
            let within = simd.load(&min_above[lanes]).lt(t_low) & t_high.lt(simd.load(&packet.t_max[1][lanes]));
            let certain = open & edges.certain() & within;
            let triangle = Pending { first, tag, lane: lane as u8 };
            Q::meet(simd, tree, found, &Meeting { lanes, triangle, open, certain, t_low, t_high });
            any = true;
        }
    }
    any
}

impl PacketQuery for Closest {
    const MANY_LEAVES: usize = 32;

    #[inline(always)]
    fn meet<S: Simd>(simd: S, tree: &WideTree, found: &mut Found<Hit>, meeting: &Meeting<S::F32>) {
        let &Meeting { lanes, triangle, open, certain, t_low, t_high } = meeting;
        let (best_low, best_high) = (simd.load(&found.t_low[lanes]), simd.load(&found.t_max[lanes]));
        let closer = certain & t_high.lt(best_low);
        found.t_low[lanes] = t_low.select(closer, best_low).to_array();
        found.t_max[lanes] = t_high.select(closer, best_high).to_array();
        let closer = closer.bits();
        found.is_pending |= closer << (lanes * WIDTH);
        for lane in set_bits(closer) {
            found.pending[lanes * WIDTH + lane] = triangle;
        }
        for lane in set_bits(open.bits() & !closer) {
            simd.apart(ClosestByOne { tree, found, i: lanes * WIDTH + lane, triangle });
        }
    }
}

impl PacketQuery for Any {
    const MANY_LEAVES: usize = 8;

    #[inline(always)]
    fn meet<S: Simd>(simd: S, tree: &WideTree, found: &mut Found<bool>, meeting: &Meeting<S::F32>) {
        let &Meeting { lanes, triangle, open, certain, .. } = meeting;
        let mut hits = certain.bits();
        let uncertain = open.bits() & !hits;
        if uncertain != 0 {
            simd.apart(AnyByOne { tree, rays: found.rays, lanes, triangle, uncertain, hits: &mut hits });
        }
        for lane in set_bits(hits) {
            found.answers[lanes * WIDTH + lane] = true;
            found.t_max[lanes][lane] = DONE;
        }
    }
}

/// The `t_max` of a ray that is answered: nothing lies in front of it.
const DONE: f32 = f32::NEG_INFINITY;

/// Which of eight rays have a triangle in their interval, where f32 is not certain.
struct AnyByOne<'a> {
    tree: &'a WideTree,
    rays: &'a [Ray; N_RAYS],
    /// Which eight.
    lanes: usize,
    triangle: Pending,
    /// Those that are asked for, one bit each.
    uncertain: u32,
    /// Those that hit.
    hits: &'a mut u32,
}

impl Batch for AnyByOne<'_> {
    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let corners = self.triangle.corners(self.tree);
        let rays = &self.rays[self.lanes * WIDTH..][..WIDTH];
        // Most have just left the triangle, which f64 knows of several at once. Rays of packets are tame.
        let mut left = self.uncertain;
        for (i, of) in rays.chunks_exact(WIDTH64).enumerate() {
            let numbers = [of[0].numbers(), of[1].numbers(), of[2].numbers(), of[3].numbers()];
            let four = FourRays::new(simd, numbers);
            left &= !(triangle::is_behind(four.origin, four.direction, corners).bits() << (i * WIDTH64));
        }
        for lane in set_bits(left) {
            if rays[lane].prepare_with(simd).is_some_and(|ray| triangle::occludes(&ray, corners)) {
                *self.hits |= 1 << lane;
            }
        }
    }
}

/// Compares a triangle with the best hit of a ray, where intervals are not enough.
struct ClosestByOne<'a, 'b> {
    tree: &'a WideTree,
    found: &'a mut Found<'b, Hit>,
    i: usize,
    triangle: Pending,
}

impl Batch for ClosestByOne<'_, '_> {
    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let ClosestByOne { tree, found, i, triangle } = self;
        // A triangle that was cut stands in several leaves.
        if found.is_pending >> i & 1 == 1 && found.pending[i].row(tree) == triangle.row(tree) {
            return;
        }
        let Some(ray) = found.rays[i].prepare_with(simd) else { return };
        if found.is_pending >> i & 1 == 1 {
            found.is_pending &= !(1 << i);
            // A triangle is only pending when it is certainly hit.
            let best = found.pending[i].intersect(tree, &ray);
            debug_assert!(best.is_some());
            found.keep(i, best.unwrap_or(Hit::MISS));
        }
        if let Some(hit) = triangle.intersect(tree, &ray)
            && hit.is_before(&found.answers[i])
        {
            found.keep(i, hit);
        }
    }
}

impl<A> Found<'_, A> {
    /// The largest `t_max` of any ray.
    #[inline(always)]
    fn farthest(&self) -> f32 {
        let mut farthest = [DONE; WIDTH];
        for lanes in &self.t_max {
            for (farthest, &t_max) in farthest.iter_mut().zip(lanes) {
                *farthest = if t_max > *farthest { t_max } else { *farthest };
            }
        }
        let mut n = WIDTH;
        while n > 1 {
            n /= 2;
            for i in 0..n {
                farthest[i] = if farthest[i + n] > farthest[i] { farthest[i + n] } else { farthest[i] };
            }
        }
        farthest[0]
    }
}

impl Found<'_, Hit> {
    fn keep(&mut self, i: usize, hit: Hit) {
        self.answers[i] = hit;
        self.t_low[i / WIDTH][i % WIDTH] = f32_at_most(hit.t);
        self.t_max[i / WIDTH][i % WIDTH] = f32_at_least(hit.t);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packets_are_tried_ever_more_seldom_while_they_are_no_better() {
        const MANY: usize = 8;
        let mut patience = Patience::default();
        let tried: Vec<usize> = (0..700)
            .filter(|_| {
                let tries = patience.tries();
                if tries {
                    patience.saw(MANY + 1, MANY);
                }
                tries
            })
            .collect();
        assert_eq!(tried, [0, 5, 22, 87, 344, 601]);
        // Some that are better, and all are tried again; one that meets nothing changes nothing.
        let mut n_tried = 0;
        for _ in 0..1000 {
            if patience.tries() {
                n_tried += 1;
                patience.saw(if n_tried % 2 == 0 { 0 } else { MANY }, MANY);
            }
        }
        assert!(n_tried > 200 && patience.tries(), "{n_tried}");
    }
}
