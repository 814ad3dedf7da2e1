//! One ray through the wide tree, nearest boxes first.

use super::slab::{SlabRay, WIDTH};
use super::wide::{MAX_LEAF, Tag, WideTree};
use crate::numeric::prepared::PreparedRay;
use crate::numeric::rounding::f32_at_least;
use crate::numeric::triangle;
use crate::world::{Hit, PrimKind, World};

/// Boxes that are still to be entered; kept between rays, so that no ray allocates.
#[derive(Debug)]
pub struct Stack {
    entries: Vec<Entry>,
    /// Of shared leaves, which ray tested them last, with the leaf: a direct-mapped cache, for a leaf that is tested
    /// twice costs time and nothing else (mailboxing, Amanatides and Woo 1987). Empty when no leaf is shared.
    tested: Vec<(u64, u32)>,
    /// Counts rays, from 1.
    ray: u64,
}

/// Shared leaves that a ray remembers.
const N_REMEMBERED: usize = 1 << 14;

#[derive(Clone, Copy, Debug)]
struct Entry {
    /// Lower bound of the parameter at which the ray enters.
    t_near: f32,
    child: u32,
    tag: Tag,
}

/// The closest of `best` and everything in the tree.
#[inline(always)]
pub fn closest_hit(tree: &WideTree, world: &World, ray: &mut PreparedRay, stack: &mut Stack, mut best: Hit) -> Hit {
    let slab_ray = SlabRay::new(ray);
    let mut t_max = f32_at_least(ray.t_max);
    stack.begin(tree);
    while let Some(entry) = stack.entries.pop() {
        // A box at exactly the best t may hold a hit of a lower id.
        if entry.t_near > t_max {
            continue;
        }
        match entry.tag.n_prims() {
            0 => stack.push_children(tree, &slab_ray, entry.child, t_max),
            _ if stack.has_tested(&entry) => {}
            n_prims => {
                closest_in_leaf(tree, world, ray, entry, n_prims, &mut best);
                t_max = f32_at_least(ray.t_max);
            }
        }
    }
    best
}

/// Whether anything in the tree lies in the ray's interval.
#[inline(always)]
pub fn occluded(tree: &WideTree, world: &World, ray: &PreparedRay, stack: &mut Stack) -> bool {
    let slab_ray = SlabRay::new(ray);
    let t_max = f32_at_least(ray.t_max);
    stack.begin(tree);
    while let Some(entry) = stack.entries.pop() {
        match entry.tag.n_prims() {
            0 => stack.push_children(tree, &slab_ray, entry.child, t_max),
            _ if stack.has_tested(&entry) => {}
            n_prims if any_in_leaf(tree, world, ray, entry, n_prims) => return true,
            _ => {}
        }
    }
    false
}

impl Stack {
    /// A stack for the rays of one batch.
    pub fn new(tree: &WideTree) -> Stack {
        let tested = if tree.has_shared_leaves { vec![(0, 0); N_REMEMBERED] } else { Vec::new() };
        Stack { entries: Vec::new(), tested, ray: 0 }
    }

    /// Whether this ray has tested the leaf already; from then on it has.
    #[inline(always)]
    fn has_tested(&mut self, leaf: &Entry) -> bool {
        if !leaf.tag.is_shared() {
            return false;
        }
        let now = (self.ray, leaf.child);
        let slot = &mut self.tested[leaf.child as usize / MAX_LEAF % N_REMEMBERED];
        std::mem::replace(slot, now) == now
    }

    #[inline(always)]
    fn begin(&mut self, tree: &WideTree) {
        self.ray += 1;
        self.entries.clear();
        if !tree.nodes.is_empty() {
            self.entries.push(Entry { t_near: f32::NEG_INFINITY, child: 0, tag: Tag::NODE });
        }
    }

    /// Pushes the children that the ray may meet, the nearest last.
    #[inline(always)]
    fn push_children(&mut self, tree: &WideTree, ray: &SlabRay, node: u32, t_max: f32) {
        let node = &tree.nodes[node as usize];
        let hits = ray.hits(&node.slabs, t_max);
        let base = self.entries.len();
        let mut mask = hits.mask;
        while mask != 0 {
            let slot = mask.trailing_zeros() as usize % WIDTH;
            mask &= mask - 1;
            let entry = Entry { t_near: hits.t_near[slot], child: node.child[slot], tag: node.tag[slot] };
            // Insertion sort: seldom more than three children are met.
            self.entries.push(entry);
            let mut at = self.entries.len() - 1;
            while at > base && self.entries[at - 1].t_near < entry.t_near {
                self.entries[at] = self.entries[at - 1];
                at -= 1;
            }
            self.entries[at] = entry;
        }
    }
}

/// Tests a leaf. The ray is cut behind the best hit, which itself stays inside: a tie goes by id.
#[inline(always)]
fn closest_in_leaf(tree: &WideTree, world: &World, ray: &mut PreparedRay, leaf: Entry, n_prims: usize, best: &mut Hit) {
    let first = leaf.child as usize;
    let mut keep = |hit: Option<Hit>, ray: &mut PreparedRay| {
        if let Some(hit) = hit.filter(|hit| hit.is_before(best)) {
            *best = hit;
            ray.t_max = ray.t_max.min(hit.t.next_up());
        }
    };
    match leaf.tag.kind() {
        PrimKind::Triangle => {
            let rows = &tree.triangle_rows[first..first + n_prims];
            for (i, &row) in rows.iter().enumerate() {
                let hit = triangle::intersect(ray, tree.corners_of(first, n_prims, i));
                keep(hit.map(|hit| Hit::of_triangle(&hit, row as usize)), ray);
            }
        }
        PrimKind::Sphere => {
            for prim in &tree.prims[first..first + n_prims] {
                let hit = world.spheres.intersect(prim.row(), ray);
                keep(hit, ray);
            }
        }
        PrimKind::Quadric => {
            for prim in &tree.prims[first..first + n_prims] {
                let hit = world.quadrics.intersect(prim.row(), ray);
                keep(hit, ray);
            }
        }
    }
}

#[inline(always)]
fn any_in_leaf(tree: &WideTree, world: &World, ray: &PreparedRay, leaf: Entry, n_prims: usize) -> bool {
    let rows = leaf.child as usize..leaf.child as usize + n_prims;
    // Loops rather than `any`: its closures are not always inlined, and must be, to be compiled for the batch's ISA.
    match leaf.tag.kind() {
        PrimKind::Triangle => {
            for i in 0..n_prims {
                if triangle::occludes(ray, tree.corners_of(rows.start, n_prims, i)) {
                    return true;
                }
            }
        }
        PrimKind::Sphere => {
            for prim in &tree.prims[rows] {
                if world.spheres.intersect(prim.row(), ray).is_some() {
                    return true;
                }
            }
        }
        PrimKind::Quadric => {
            for prim in &tree.prims[rows] {
                if world.quadrics.intersect(prim.row(), ray).is_some() {
                    return true;
                }
            }
        }
    }
    false
}
