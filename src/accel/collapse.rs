//! From the binary tree to the wide one, in parallel.
//!
//! Nodes stand depth first, those that share a parent side by side, and so do their leaves: what a ray visits next lies
//! near. The upper levels are made first and end in cuts, the subtrees below each on its own.

use glam::Vec3;
use rayon::prelude::*;

use super::binary::BinaryTree;
use super::cost::{self, CostTable};
use super::duplicate::{Groups, Item};
use super::slab::WIDTH;
use super::slot;
use super::wide::{Entry, Tag, WideNode, WideTree};
use crate::world::{Bounds, PrimRef, World};

/// Levels of the wide tree below which a subtree is cut into equal runs instead of followed: eight levels of wide
/// nodes hold 16 million leaves, so a path this long is a chain that the builder could not balance.
const MAX_DEPTH: usize = 40;

/// A subtree is made on its own when it holds no more than one in so many items. The number does not depend on threads,
/// so that the outcome does not.
const N_PIECES: usize = 128;

/// Items of a subtree that is too small to be made on its own.
const MIN_PIECE: usize = 1024;

/// What becomes a child of a wide node.
#[derive(Clone, Copy, Debug)]
enum Child {
    /// A node of the binary tree.
    Subtree(u32),
    /// A run of items in leaf order that is to be cut by index.
    Run { first: u32, n_items: u32 },
}

/// A slot of the upper levels that waits for its subtree.
struct Cut {
    node: u32,
    slot: usize,
    child: Child,
    depth: usize,
}

/// Builds the wide tree.
pub fn collapse(world: &World, groups: &Groups, binary: BinaryTree) -> WideTree {
    if binary.nodes.is_empty() {
        return WideTree::default();
    }
    let opener = Opener { world, groups, binary: &binary, costs: CostTable::of(&binary, groups) };
    let piece = (binary.order.len() / N_PIECES).max(MIN_PIECE);
    let (top, cuts) = opener.grow(Child::Subtree(0), 1, piece);
    let pieces: Vec<WideTree> = cuts.par_iter().map(|cut| opener.grow(cut.child, cut.depth, 0).0).collect();
    drop(opener);
    drop(binary);
    let places: Vec<(u32, usize)> = cuts.iter().map(|cut| (cut.node, cut.slot)).collect();
    let mut tree = WideTree::join(top, &places, pieces);
    tree.fill_columns(world);
    tree.measure_depth();
    tree.measure_bounds();
    tree.move_to_large_pages();
    tree
}

/// What is not opened any further.
enum End {
    Leaf(Vec<PrimRef>),
    List(u32),
}

/// Finds the children of wide nodes.
struct Opener<'a> {
    world: &'a World,
    groups: &'a Groups,
    binary: &'a BinaryTree,
    costs: CostTable<'a>,
}

impl Opener<'_> {
    /// The wide tree below a child, but for subtrees of at most `piece` items, which are cut off.
    fn grow(&self, root: Child, depth: usize, piece: usize) -> (WideTree, Vec<Cut>) {
        let mut tree = WideTree { nodes: vec![WideNode::EMPTY], ..WideTree::default() };
        let mut cuts = Vec::new();
        let mut stack = vec![(0u32, root, depth)];
        while let Some((index, child, depth)) = stack.pop() {
            let (children, n_children) = self.children(child, depth);
            let children = &children[..n_children];
            let mut boxes = [self.bounds(child); WIDTH];
            for (bounds, &child) in boxes.iter_mut().zip(children) {
                *bounds = self.bounds(child);
            }
            let slots = slot::assign(&boxes[..n_children]);
            let mut node = WideNode::EMPTY;
            for ((&child, bounds), slot) in children.iter().zip(boxes).zip(slots) {
                let entry = match self.end(child) {
                    Some(End::Leaf(run)) => tree.push_leaf(self.world, &run),
                    Some(End::List(list)) => tree.push_list(self.world, &self.groups.lists[list as usize]),
                    None if self.run(child).len() <= piece => {
                        cuts.push(Cut { node: index, slot, child, depth: depth + 1 });
                        Entry { bounds, child: 0, tag: Tag::NODE }
                    }
                    None => {
                        let next = tree.nodes.len() as u32;
                        tree.nodes.push(WideNode::EMPTY);
                        stack.push((next, child, depth + 1));
                        Entry { bounds, child: next, tag: Tag::NODE }
                    }
                };
                node.set(slot, &Entry { bounds, ..entry });
            }
            tree.nodes[index as usize] = node;
        }
        (tree, cuts)
    }

    /// The children of a wide node; an end that stands alone is its own only child.
    fn children(&self, child: Child, depth: usize) -> ([Child; WIDTH], usize) {
        if let Child::Subtree(index) = child
            && depth < MAX_DEPTH
            && !self.is_end(child)
        {
            let (subtrees, n_children) = self.costs.children(index);
            if n_children > 0 {
                return (subtrees.map(Child::Subtree), n_children);
            }
        }
        // A run is cut into halves, the longest first.
        let mut children = [child; WIDTH];
        let mut n_children = 1;
        while n_children < WIDTH {
            let openable = (0..n_children).filter(|&i| !self.is_end(children[i]));
            let Some(longest) = openable.max_by_key(|&i| self.run(children[i]).len()) else { break };
            let (first, n_items) = self.span(children[longest]);
            let cut = n_items / 2;
            children[longest] = Child::Run { first, n_items: cut };
            children[n_children] = Child::Run { first: first + cut, n_items: n_items - cut };
            n_children += 1;
        }
        (children, n_children)
    }

    fn span(&self, child: Child) -> (u32, u32) {
        match child {
            Child::Subtree(index) => {
                let node = &self.binary.nodes[index as usize];
                (node.first, node.n_items)
            }
            Child::Run { first, n_items } => (first, n_items),
        }
    }

    fn run(&self, child: Child) -> &[Item] {
        let (first, n_items) = self.span(child);
        &self.binary.order[first as usize..][..n_items as usize]
    }

    fn is_end(&self, child: Child) -> bool {
        let run = self.run(child);
        let wants = match child {
            Child::Subtree(index) => self.costs.is_leaf(index),
            Child::Run { .. } => true,
        };
        run.len() == 1 || (wants && cost::is_leaf(run))
    }

    fn end(&self, child: Child) -> Option<End> {
        let run = self.run(child);
        if let &[Item::List(list)] = run {
            return Some(End::List(list));
        }
        let prims = |item: &Item| match item {
            Item::Prim(prim) => Some(*prim),
            Item::List(_) => None,
        };
        self.is_end(child).then(|| {
            let mut leaf: Vec<PrimRef> = run.iter().filter_map(prims).collect();
            // Pieces of one triangle.
            leaf.sort_unstable();
            leaf.dedup();
            End::Leaf(leaf)
        })
    }

    fn bounds(&self, child: Child) -> Bounds {
        let bounds_of = |prim: &PrimRef| prim.bounds(self.world);
        match child {
            Child::Subtree(index) => self.binary.nodes[index as usize].bounds,
            Child::Run { .. } => {
                let boxes = self.run(child).iter().flat_map(|item| match item {
                    Item::Prim(prim) => std::slice::from_ref(prim).iter().filter_map(bounds_of),
                    Item::List(list) => self.groups.lists[*list as usize].iter().filter_map(bounds_of),
                });
                boxes.reduce(Bounds::union).unwrap_or(Bounds { lo: Vec3::MIN, hi: Vec3::MAX })
            }
        }
    }
}
