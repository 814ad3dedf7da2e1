//! Many rays in flight: while one is tested, the nodes and leaves of the others come from memory.
//!
//! Each ray takes one step at a time. Rays that stand before a node are stepped together, then those that stand before a
//! leaf, so that each loop runs the same code over and over and steps of different rays, which do not depend on each
//! other, overlap in the processor. The sets of rays are masks, and all that a ray has lies in one place of fixed size:
//! keeping books must not cost more than testing boxes.

use super::asked::Asked;
use super::order::{self, Item};
use super::query::Query;
use super::single::Mailboxes;
use super::walk::Walk;
use super::wide::{N_STATIONS, Tag, WideNode, WideTree};
use crate::simd::{Simd, WIDTH, set_bits};

/// Rays in flight at most: enough to cover a fetch from memory.
const IN_FLIGHT: usize = 32;

/// Rays in flight where the tree lies in the caches: what the rays carry then fits into the nearest one.
const FEW_IN_FLIGHT: usize = 16;

/// Items that a ray in flight has room for, a power of two: enough for trees of 15 levels.
const STACK_SIZE: usize = 128;

/// A ray in flight.
#[derive(Clone)]
struct Flight {
    walk: Walk,
    /// Where it stands.
    item: Item,
    n_items: usize,
    ray_idx: usize,
    /// Counts walks, for the mailboxes.
    number: u64,
    is_over: bool,
    /// What is left to be visited; eight are written at a time.
    keys: [u32; STACK_SIZE + WIDTH],
    children: [u32; STACK_SIZE + WIDTH],
}

/// Which flights stand before what, by station, one bit per flight. (The last is none.)
#[derive(Clone, Copy, Default)]
struct Places([u32; N_STATIONS + 1]);

/// Whether rays of this tree fit in flight: ten million triangles take 11 levels, and deeper trees are rare enough to be
/// walked ray by ray.
pub fn can_run(tree: &WideTree) -> bool {
    tree.stack_size() < STACK_SIZE
}

/// Walks all rays of a batch.
#[inline(always)]
pub fn run<S: Simd, Q: Query>(simd: S, asked: &mut Asked<Q>) {
    if asked.accel.tree.is_large() {
        fly::<S, Q, true>(simd, asked, IN_FLIGHT);
    } else {
        fly::<S, Q, false>(simd, asked, FEW_IN_FLIGHT);
    }
}

/// Walks all rays, so many at a time; memory is only asked for ahead of time where the tree is `LARGE`.
#[inline(always)]
fn fly<S: Simd, Q: Query, const LARGE: bool>(simd: S, asked: &mut Asked<Q>, n_flights: usize) {
    let (accel, world) = (asked.accel, asked.world);
    let tree = &accel.tree;
    let mut mailboxes = Mailboxes::new(tree);
    let mut flights = vec![Flight::nowhere(); n_flights.min(asked.n_left())];
    let is_empty = tree.nodes.is_empty();
    let mut at = Places::default();
    let mut number = 0;
    for (i, flight) in flights.iter_mut().enumerate() {
        number += 1;
        at.begin(i, is_empty, flight.begin(simd, asked, number));
    }

    let nodes = tree.nodes.as_slice();
    let mut seen = [Q::Seen::default(); IN_FLIGHT];
    while at.any() {
        // Nodes: first all boxes, which takes no branch that could go wrong, then what to do next.
        let before_nodes = at.take(Tag::AT_NODE);
        for i in set_bits(before_nodes) {
            flights[i].push_children(simd, nodes);
        }
        for i in set_bits(before_nodes) {
            flights[i].advance::<S, LARGE>(simd, tree, &mut at, i);
        }

        // Leaves: first what is seen of triangles, then what follows from it, for the same reason.
        let (mut repeated, before_leaves) = (0, at.take(Tag::AT_LEAF));
        for i in set_bits(before_leaves) {
            let flight = &flights[i];
            let (first, tag) = (flight.item.child(), flight.item.tag());
            repeated |= u32::from(mailboxes.has(flight.item, flight.number)) << i;
            if tag.is_triangles() {
                seen[i] = Q::see(simd, tree, &flight.walk, first, tag);
            }
        }
        for i in set_bits(before_leaves) {
            let flight = &mut flights[i];
            let (first, tag) = (flight.item.child(), flight.item.tag());
            let is_over = if repeated >> i & 1 == 1 {
                false
            } else if tag.is_triangles() {
                Q::take(simd, tree, &mut flight.walk, first, tag, &seen[i])
            } else {
                Q::other_leaf(simd, tree, world, &mut flight.walk, first, tag)
            };
            // Where the walk is over the end comes next.
            flight.is_over = is_over;
            flight.n_items = if is_over { 1 } else { flight.n_items };
            flight.advance::<S, LARGE>(simd, tree, &mut at, i);
        }

        // Ends, and new rays.
        for i in set_bits(at.take(Tag::AT_END)) {
            let flight = &mut flights[i];
            asked.end(&flight.walk, flight.is_over, flight.ray_idx);
            number += 1;
            at.begin(i, is_empty, flight.begin(simd, asked, number));
        }
    }
}

impl Places {
    /// Whether any flight stands anywhere.
    #[inline(always)]
    fn any(&self) -> bool {
        self.0[0] | self.0[1] | self.0[2] != 0
    }

    /// Takes those at a station.
    #[inline(always)]
    fn take(&mut self, station: u8) -> u32 {
        std::mem::take(&mut self.0[usize::from(station)])
    }

    /// Puts a flight where it begins, if there was a ray for it.
    #[inline(always)]
    fn begin(&mut self, i: usize, is_empty: bool, has_begun: bool) {
        let station = if is_empty { Tag::AT_END } else { Tag::AT_NODE };
        self.0[usize::from(station)] |= u32::from(has_begun) << i;
    }
}

impl Flight {
    /// A place for rays.
    fn nowhere() -> Flight {
        Flight {
            walk: Walk::nowhere(),
            item: Item::ROOT,
            n_items: 1,
            ray_idx: 0,
            number: 0,
            is_over: false,
            // The first one is never overwritten.
            keys: [Item::END.key(); STACK_SIZE + WIDTH],
            children: [0; STACK_SIZE + WIDTH],
        }
    }

    /// Takes the next ray of the batch; whether there was one.
    #[inline(always)]
    fn begin<S: Simd, Q: Query>(&mut self, simd: S, asked: &mut Asked<Q>, number: u64) -> bool {
        let Some(ray_idx) = asked.start(simd, &mut self.walk) else { return false };
        (self.ray_idx, self.number) = (ray_idx, number);
        (self.item, self.n_items, self.is_over) = (Item::ROOT, 1, false);
        true
    }

    #[inline(always)]
    fn push_children<S: Simd>(&mut self, simd: S, nodes: &[WideNode]) {
        let node = &nodes[self.item.child() as usize];
        // `can_run` has seen to it that the stack suffices.
        let n = self.n_items % STACK_SIZE;
        let (keys, children) = (&mut self.keys[n..], &mut self.children[n..]);
        self.n_items += order::pack_children(simd, node, &self.walk.slab, self.walk.t_max, keys, children);
    }

    /// Goes on to the next item, asks for its memory, and notes before what the ray then stands: without a branch but where
    /// items are dropped, since what comes next cannot be foreseen.
    #[inline(always)]
    fn advance<S: Simd, const LARGE: bool>(&mut self, simd: S, tree: &WideTree, at: &mut Places, i: usize) {
        let mut n = self.n_items - 1;
        // The end is within every limit.
        while !self.walk.limit.allows(self.keys[n]) {
            n -= 1;
        }
        let item = Item::new(self.keys[n], self.children[n]);
        (self.item, self.n_items) = (item, n);
        if LARGE {
            item.prefetch(simd, tree);
        }
        at.0[item.tag().station()] |= 1 << i;
    }
}
