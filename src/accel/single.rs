//! One ray through the wide tree, nearest boxes first.

use super::Visits;
use super::order::{self, Item};
use super::query::{Asked, Query};
use super::slab::SlabRay;
use super::walk::Walk;
use super::wide::{MAX_LEAF, WideTree};
use crate::simd::Simd;
use crate::world::World;

/// Items that are still to be visited; kept between rays, so that no ray allocates.
#[derive(Debug)]
pub struct Stack {
    items: Vec<u64>,
    n_items: usize,
    /// Leaves that have been tested.
    pub tested: Mailboxes,
    /// Counts rays, from 1.
    pub ray: u64,
    /// What has been visited.
    pub visits: Visits,
}

/// Of leaves that stand in several nodes, which ray tested them last, with the leaf: a direct-mapped cache, for a leaf that
/// is tested twice costs time and nothing else (mailboxing, Amanatides and Woo 1987). Empty when no leaf is shared.
#[derive(Debug)]
pub struct Mailboxes {
    tested: Vec<(u64, u32)>,
}

/// Shared leaves that a ray remembers.
const N_REMEMBERED: usize = 1 << 14;

/// Walks all rays of a batch, one after another; what they visited.
#[inline(always)]
pub fn run<S: Simd, Q: Query>(simd: S, asked: &mut Asked<Q>) -> Visits {
    let (accel, world) = (asked.accel, asked.world);
    let mut stack = Stack::new(&accel.tree);
    let mut walk = Walk::nowhere(simd);
    while let Some(ray_idx) = asked.start(simd, &mut walk) {
        let is_over = traverse::<S, Q>(simd, &accel.tree, world, &mut walk, &mut stack);
        asked.end(&walk, is_over, ray_idx);
    }
    stack.visits
}

/// Walks the tree from the root until the query is over or nothing is left; whether it is over.
#[inline(always)]
fn traverse<S: Simd, Q: Query>(simd: S, tree: &WideTree, world: &World, walk: &mut Walk, stack: &mut Stack) -> bool {
    if tree.nodes.is_empty() {
        return false;
    }
    stack.begin();
    let mut item = Item::ROOT;
    loop {
        let tag = item.tag();
        if tag.n_prims() == 0 {
            stack.push_children(simd, tree, &walk.slab, walk.t_max, item.child());
        } else if !stack.tested.has(item, stack.ray) {
            stack.visits.leaves += 1;
            if Q::leaf(simd, tree, world, walk, item.child(), tag) {
                return true;
            }
        }
        let Some(next) = stack.pop(walk.limit) else { return false };
        item = next;
    }
}

impl Stack {
    /// A stack for the rays of one batch.
    pub fn new(tree: &WideTree) -> Stack {
        Stack {
            items: vec![0; tree.stack_size()],
            n_items: 0,
            tested: Mailboxes::new(tree),
            ray: 0,
            visits: Visits::default(),
        }
    }

    /// Starts a ray.
    #[inline(always)]
    pub fn begin(&mut self) {
        self.n_items = 0;
        self.ray += 1;
    }

    /// Pushes the children that the ray may meet, the nearest last.
    #[inline(always)]
    pub fn push_children<S: Simd>(&mut self, simd: S, tree: &WideTree, slab: &SlabRay, t_max: f32, node: u32) {
        self.visits.nodes += 1;
        let room = &mut self.items[self.n_items..];
        self.n_items += order::pack_children(simd, &tree.nodes[node as usize], slab, t_max, room);
    }

    /// Takes the nearest item within the limit.
    #[inline(always)]
    pub fn pop(&mut self, limit: Item) -> Option<Item> {
        order::pop(&self.items, &mut self.n_items, limit)
    }
}

impl Mailboxes {
    /// None tested.
    pub fn new(tree: &WideTree) -> Mailboxes {
        Mailboxes { tested: if tree.has_shared_leaves { vec![(0, 0); N_REMEMBERED] } else { Vec::new() } }
    }

    /// Whether a ray, by its number from 1 on, has tested the leaf already; from then on it has.
    #[inline(always)]
    pub fn has(&mut self, leaf: Item, ray: u64) -> bool {
        if !leaf.tag().is_shared() {
            return false;
        }
        let now = (ray, leaf.child());
        let slot = &mut self.tested[leaf.child() as usize / MAX_LEAF % N_REMEMBERED];
        std::mem::replace(slot, now) == now
    }
}
