//! Sixteen rays of one origin together: boxes are tested once for all of them, and a triangle or a sphere of a leaf against all
//! of them at once.
//!
//! Neighbouring camera rays are such packets, and so are shadow rays, which end in one light and are walked from there. What
//! else a batch has is left for [`stream`](super::stream).

mod meet;
mod quadric;
mod sphere;
mod triangle;

use quadric::{QuadricQuery, Quadrics};

use super::asked::Asked;
use super::coherence::{Column, N_LANES, N_RAYS, Packet, packet};
use super::order::{Item, Limit};
use super::single::{Mailboxes, Stack};
use super::walk::Pending;
use super::wide::WideTree;
use crate::simd::{F32Lanes, Simd, WIDTH};
use crate::world::{PrimKind, Ray, World};

/// What the rays of a packet have found so far.
pub struct Found<'a, A> {
    rays: &'a [Ray; N_RAYS],
    answers: &'a mut [A; N_RAYS],
    /// Upper ends of what is still of interest, rounded up; negative for a ray that needs no more.
    t_max: Column,
    /// Lower bounds of the closest parameters.
    t_low: Column,
    /// Bit per ray whose best hit is a triangle or a sphere that is still to be described: which one.
    is_pending: u32,
    pending: [Pending; N_RAYS],
}

/// A query that packets can ask.
pub trait PacketQuery: QuadricQuery {
    /// Takes what eight rays of a packet have found of a primitive.
    fn meet<S: Simd>(simd: S, tree: &WideTree, found: &mut Found<Self::Answer>, meeting: &Meeting<S::F32>);
}

/// Eight rays and a triangle or a sphere.
pub struct Meeting<F: F32Lanes> {
    /// Which eight rays.
    lanes: usize,
    /// The primitive.
    candidate: Pending,
    /// Rays that may hit it, one bit each.
    open: u32,
    /// Those of them that certainly do.
    certain: u32,
    /// Where, at least.
    t_low: F,
    /// And at most; ∞ for a ray that does not certainly hit it.
    t_high: F,
}

/// The `t_max` of a ray that is answered: nothing lies in front of it.
const DONE: f32 = f32::NEG_INFINITY;

/// Answers the packets of a batch; the places of all other rays come back.
#[inline(always)]
pub fn run<S: Simd, Q: PacketQuery>(simd: S, asked: &mut Asked<Q>) -> Vec<u32> {
    let (accel, world, all) = (asked.accel, asked.world, asked.rays);
    let tree = &accel.tree;
    let mut items = vec![0; 2 * tree.stack_size()];
    let mut stack = Stack::new(&mut items, Mailboxes::new(tree));
    let around = accel.surroundings();
    let mut others = Vec::with_capacity(all.len());
    let n_rays = all.len();
    let mut patience = Patience::default();
    let mut first = 0;
    while first < n_rays {
        // No closures: they are not always inlined, and what is not inlined is compiled for the baseline.
        let rays = all[first..].first_chunk::<N_RAYS>();
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
        if !accel.unbounded.is_empty() {
            simd.apart(Quadrics::<Q> { tree, world, found: &mut found, quadrics: &accel.unbounded, t_near: 0.0 });
        }
        let n_leaves = traverse::<S, Q>(simd, (tree, world), &packet, &mut found, &mut stack);
        patience.saw(n_leaves);
        if n_leaves > MANY_LEAVES {
            others.extend(first as u32..(first + N_RAYS) as u32);
        } else {
            let Found { is_pending, pending, .. } = found;
            asked.end_packet(simd, first, answers, is_pending, &pending, rays);
        }
        first += N_RAYS;
    }
    others
}

/// Leaves that a packet may test; with more of them its rays had better gone alone (`docs/BENCHMARKS.md`).
const MANY_LEAVES: usize = 32;

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

    /// Learns how many leaves a packet has tested.
    fn saw(&mut self, n_leaves: usize) {
        // One that has met nothing says nothing.
        if n_leaves > MANY_LEAVES {
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
    (tree, world): (&WideTree, &World),
    packet: &Packet,
    found: &mut Found<Q::Answer>,
    stack: &mut Stack<'_>,
) -> usize {
    let mut n_leaves = 0;
    if tree.nodes.is_empty() {
        return n_leaves;
    }
    stack.begin();
    let mut seen_by_spheres = None;
    let mut farthest = found.farthest();
    let (slab, octant) = (packet.slab.lanes(simd), packet.slab.octant);
    let mut item = Item::ROOT;
    loop {
        let tag = item.tag();
        if !tag.is_leaf() {
            if let Some(nearest) = stack.open(simd, &tree.nodes, &slab, octant, farthest, item.child()) {
                stack.prefetch(simd, tree);
                item = nearest;
                continue;
            }
        } else if !stack.tested.has(item, stack.ray) {
            n_leaves += 1;
            if n_leaves > MANY_LEAVES {
                return n_leaves;
            }
            let first = item.child();
            let any_met = match tag.kind() {
                PrimKind::Triangle => triangle::test_leaf::<S, Q>(simd, tree, packet, found, first, tag),
                PrimKind::Sphere => {
                    let rays = match &mut seen_by_spheres {
                        Some(rays) => rays,
                        none => none.insert(sphere::rays(simd, found.rays)),
                    };
                    sphere::test_leaf::<S, Q>(simd, tree, (&slab, octant), rays, found, first, tag)
                }
                // Where anything is placed there are no packets.
                PrimKind::Quadric | PrimKind::Instance => {
                    let quadrics = &tree.prims[first as usize..][..tag.n_prims()];
                    simd.apart(Quadrics::<Q> { tree, world, found, quadrics, t_near: item.t_near() });
                    true
                }
            };
            if any_met {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packets_are_tried_ever_more_seldom_while_they_are_no_better() {
        let mut patience = Patience::default();
        let tried: Vec<usize> = (0..700)
            .filter(|_| {
                let tries = patience.tries();
                if tries {
                    patience.saw(MANY_LEAVES + 1);
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
                patience.saw(if n_tried % 2 == 0 { 0 } else { MANY_LEAVES });
            }
        }
        assert!(n_tried > 200 && patience.tries(), "{n_tried}");
    }
}
