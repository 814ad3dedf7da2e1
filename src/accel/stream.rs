//! Many rays in flight: while one is tested, the nodes and leaves of the others come from memory.
//!
//! Each ray takes one step at a time. Rays that stand before a node are stepped together, then those that stand before a
//! leaf, so that each loop runs the same code over and over and steps of different rays, which do not depend on each
//! other, overlap in the processor.

use super::order::{Item, ORDER};
use super::query::{Asked, Query};
use super::single::Mailboxes;
use super::walk::Walk;
use super::wide::{N_COORDINATES, WideTree};
use crate::simd::{Simd, WIDTH};

/// Rays in flight: enough to cover a fetch from memory, few enough to stay in the first-level cache.
const IN_FLIGHT: usize = 16;

/// A ray in flight.
struct Flight {
    walk: Walk,
    ray_idx: usize,
    /// Counts walks, for the mailboxes.
    number: u64,
    /// Where it stands.
    item: Item,
    /// What is left to be visited.
    stack: Vec<u64>,
    n_items: usize,
    is_over: bool,
}

/// Before what rays stand: the numbers of flights in three lists.
struct Lists {
    flights: [[u8; IN_FLIGHT]; 3],
    n: [usize; 3],
}

const NODE: usize = 0;
const LEAF: usize = 1;
const ENDED: usize = 2;

/// Walks all rays of a batch.
#[inline(always)]
pub fn run<S: Simd, Q: Query>(simd: S, asked: &mut Asked<Q>) {
    let (accel, world) = (asked.accel, asked.world);
    let tree = &accel.tree;
    let mut mailboxes = Mailboxes::new(tree);
    let mut flights = Vec::with_capacity(IN_FLIGHT);
    let mut lists = Lists { flights: [[0; IN_FLIGHT]; 3], n: [0; 3] };
    let mut number = 0;
    let begin = if tree.nodes.is_empty() { ENDED } else { NODE };
    while flights.len() < IN_FLIGHT {
        let mut walk = Walk::nowhere(simd);
        let Some(ray_idx) = asked.start(simd, &mut walk) else { break };
        number += 1;
        lists.add(begin, flights.len());
        let stack = vec![0; tree.stack_size()];
        flights.push(Flight { walk, ray_idx, number, item: Item::ROOT, stack, n_items: 0, is_over: false });
    }

    while lists.n[NODE] + lists.n[LEAF] + lists.n[ENDED] > 0 {
        // Nodes: first all boxes, which takes no branch that could go wrong, then what to do next.
        let n_at_nodes = lists.take(NODE);
        for &index in &lists.flights[NODE][..n_at_nodes] {
            let Some(flight) = flights.get_mut(usize::from(index)) else { continue };
            flight.push_children(simd, tree);
        }
        for i in 0..n_at_nodes {
            let index = usize::from(lists.flights[NODE][i]) % IN_FLIGHT;
            let Some(flight) = flights.get_mut(index) else { continue };
            let place = flight.advance(simd, tree);
            lists.add(place, index);
        }

        // Leaves.
        for i in 0..lists.take(LEAF) {
            let index = usize::from(lists.flights[LEAF][i]) % IN_FLIGHT;
            let Some(flight) = flights.get_mut(index) else { continue };
            let (item, tag) = (flight.item, flight.item.tag());
            if !mailboxes.has(item, flight.number) {
                flight.is_over = Q::leaf(simd, tree, world, &mut flight.walk, item.child(), tag);
            }
            let place = flight.advance(simd, tree);
            lists.add(place, index);
        }

        // Ends, and new rays.
        for i in 0..lists.take(ENDED) {
            let index = usize::from(lists.flights[ENDED][i]) % IN_FLIGHT;
            let Some(flight) = flights.get_mut(index) else { continue };
            asked.end(&flight.walk, flight.is_over, flight.ray_idx);
            if let Some(ray_idx) = asked.start(simd, &mut flight.walk) {
                number += 1;
                (flight.ray_idx, flight.number) = (ray_idx, number);
                (flight.item, flight.n_items, flight.is_over) = (Item::ROOT, 0, false);
                lists.add(begin, index);
            }
        }
    }
}

impl Lists {
    /// Empties a list, whose entries may still be read, and says how many there were.
    #[inline(always)]
    fn take(&mut self, place: usize) -> usize {
        std::mem::take(&mut self.n[place])
    }

    /// Appends to a list. While a list is worked through, what is appended to it never reaches what is still to be read.
    #[inline(always)]
    fn add(&mut self, place: usize, index: usize) {
        let n = &mut self.n[place];
        self.flights[place][*n % IN_FLIGHT] = index as u8;
        *n += 1;
    }
}

impl Flight {
    #[inline(always)]
    fn push_children<S: Simd>(&mut self, simd: S, tree: &WideTree) {
        let node = &tree.nodes[self.item.child() as usize];
        let (t_near, mask) = self.walk.slab.hits(simd, &node.slabs, self.walk.t_max);
        let order = &ORDER[self.walk.slab.octant as usize % WIDTH][mask as usize % 256];
        if let Some(to) = self.stack[self.n_items..].first_chunk_mut() {
            simd.pack(t_near, node.tag_bits(), &node.child, order, to);
            self.n_items += mask.count_ones() as usize;
        }
    }

    /// Goes on to the next item and asks for its memory; says before what the ray then stands.
    #[inline(always)]
    fn advance<S: Simd>(&mut self, simd: S, tree: &WideTree) -> usize {
        let limit = self.walk.limit;
        loop {
            if self.n_items == 0 || self.is_over {
                return ENDED;
            }
            self.n_items -= 1;
            self.item = Item(self.stack[self.n_items]);
            if self.item <= limit {
                break;
            }
        }
        // Without a branch, since either is as likely: a leaf of another kind asks for memory in vain.
        let (tag, child) = (self.item.tag(), self.item.child() as usize);
        let is_leaf = tag.n_prims() > 0;
        simd.prefetch_either(&tree.nodes, &tree.corners, is_leaf, if is_leaf { N_COORDINATES * child } else { child });
        if is_leaf { LEAF } else { NODE }
    }
}
