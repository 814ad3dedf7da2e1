//! One ray through the wide tree, nearest boxes first.

use super::asked::Asked;
use super::order::{self, Item, Limit};
use super::query::{Any, Closest, Query};
use super::slab::SlabLanes;
use super::walk::Walk;
use super::wide::{MAX_LEAF, WideNode, WideTree};
use super::{Visits, leaf};
use crate::numeric::prepared::PreparedRay;
use crate::simd::Simd;
use crate::world::{Hit, World};

/// Items that are still to be visited; kept between rays, so that no ray allocates.
#[derive(Debug)]
pub struct Stack<'a> {
    keys: &'a mut [u32],
    children: &'a mut [u32],
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
#[derive(Debug, Default)]
pub struct Mailboxes {
    tested: Vec<(u64, u32)>,
}

/// Shared leaves that a ray remembers.
const N_REMEMBERED: usize = 1 << 14;

/// Walks all rays of a batch, one after another.
#[inline(always)]
pub fn run<S: Simd, Q: Query>(simd: S, asked: &mut Asked<Q>) {
    let (accel, world) = (asked.accel, asked.world);
    let mut items = vec![0; 2 * accel.tree.stack_size()];
    let mut stack = Stack::new(&mut items, Mailboxes::new(&accel.tree));
    let mut walk = Walk::nowhere();
    let is_large = accel.tree.is_large();
    while let Some(ray_idx) = asked.start(simd, &mut walk) {
        let is_over = if is_large {
            traverse::<S, Q, true>(simd, &accel.tree, world, &mut walk, &mut stack)
        } else {
            traverse::<S, Q, false>(simd, &accel.tree, world, &mut walk, &mut stack)
        };
        asked.end(&walk, is_over, ray_idx);
    }
}

/// Items that fit onto a stack of fixed size: trees of sixteen levels.
pub const FEW_ITEMS: usize = 128;

/// The closest hit of an object ray in the tree of a prototype.
#[inline(always)]
pub fn closest_below<S: Simd>(simd: S, below: &WideTree, world: &World, ray: PreparedRay) -> Option<Hit> {
    let (_, mut walk) = walk_below::<S, Closest>(simd, below, world, ray);
    leaf::settle(below, &mut walk);
    walk.best.hit.is_some().then_some(walk.best.hit)
}

/// Whether an object ray meets anything in the tree of a prototype.
#[inline(always)]
pub fn any_below<S: Simd>(simd: S, below: &WideTree, world: &World, ray: PreparedRay) -> bool {
    walk_below::<S, Any>(simd, below, world, ray).0
}

/// Walks the tree of a prototype; whether the query was over before its end, and the walk.
#[inline(always)]
fn walk_below<S: Simd, Q: Query>(simd: S, below: &WideTree, world: &World, ray: PreparedRay) -> (bool, Walk) {
    let mut walk = Walk::nowhere();
    walk.begin_one(simd, &ray, &below.surroundings(0.0, true));
    let (mut few, mut many) = ([0; 2 * FEW_ITEMS], Vec::new());
    let n_items = below.stack_size();
    let items = if n_items <= FEW_ITEMS {
        &mut few[..]
    } else {
        many.resize(2 * n_items, 0);
        &mut many[..]
    };
    // A leaf that stands in several nodes may be tested more than once.
    let mut stack = Stack::new(items, Mailboxes::default());
    let is_over = traverse::<S, Q, false>(simd, below, world, &mut walk, &mut stack);
    (is_over, walk)
}

/// Walks the tree from the root until the query is over or nothing is left; whether it is over. Memory is only asked for ahead of
/// time where the tree is `LARGE`.
#[inline(always)]
fn traverse<S: Simd, Q: Query, const LARGE: bool>(
    simd: S,
    tree: &WideTree,
    world: &World,
    walk: &mut Walk,
    stack: &mut Stack<'_>,
) -> bool {
    if tree.nodes.is_empty() {
        return false;
    }
    stack.begin();
    let (slab, octant) = (walk.slab.lanes(simd), walk.slab.octant);
    let nodes = tree.nodes.as_slice();
    let mut item = Item::ROOT;
    loop {
        let tag = item.tag();
        if !tag.is_leaf() {
            if let Some(nearest) = stack.open(simd, nodes, &slab, octant, walk.t_max, item.child()) {
                if LARGE {
                    stack.prefetch(simd, tree);
                }
                item = nearest;
                continue;
            }
        } else if !stack.tested.has(item, stack.ray) && Q::leaf(simd, tree, world, walk, item.child(), tag) {
            return true;
        }
        let Some(next) = stack.pop(walk.limit) else { return false };
        item = next;
    }
}

impl<'a> Stack<'a> {
    /// A stack for the rays of one batch, with two numbers for each of [`WideTree::stack_size`] items.
    pub fn new(items: &'a mut [u32], tested: Mailboxes) -> Stack<'a> {
        let (keys, children) = items.split_at_mut(items.len() / 2);
        Stack { keys, children, n_items: 0, tested, ray: 0, visits: Visits::default() }
    }

    /// Starts a ray.
    #[inline(always)]
    pub fn begin(&mut self) {
        self.n_items = 0;
        self.ray += 1;
    }

    /// Takes the nearest child that the ray may meet, and pushes the others.
    #[inline(always)]
    pub fn open<S: Simd>(
        &mut self,
        simd: S,
        nodes: &[WideNode],
        slab: &SlabLanes<S::F32>,
        octant: u8,
        t_max: f32,
        node: u32,
    ) -> Option<Item> {
        let (keys, children) = (&mut self.keys[self.n_items..], &mut self.children[self.n_items..]);
        let node = &nodes[node as usize];
        let (nearest, n_others) = order::open_node(simd, node, slab, octant, t_max, keys, children)?;
        self.n_items += n_others;
        Some(nearest)
    }

    /// Asks for the memory of the nearest item.
    #[inline(always)]
    pub fn prefetch<S: Simd>(&self, simd: S, tree: &WideTree) {
        if let Some(last) = self.n_items.checked_sub(1) {
            Item::new(self.keys[last], self.children[last]).prefetch(simd, tree);
        }
    }

    /// Takes the nearest item within the limit.
    #[inline(always)]
    pub fn pop(&mut self, limit: Limit) -> Option<Item> {
        order::pop(self.keys, self.children, &mut self.n_items, limit)
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
        if !leaf.tag().is_shared() || self.tested.is_empty() {
            return false;
        }
        let now = (ray, leaf.child());
        let slot = &mut self.tested[leaf.child() as usize / MAX_LEAF % N_REMEMBERED];
        std::mem::replace(slot, now) == now
    }
}
