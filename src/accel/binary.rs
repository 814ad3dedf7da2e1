//! The binary tree, depth first: a subtree is one run of nodes over one run of items.

use std::collections::VecDeque;
use std::ops::Range;

use rayon::prelude::*;

use super::duplicate::{Cluster, Item};
use crate::world::Bounds;

/// Pieces that a tree is cut into for the threads. A number of its own, so that the outcome does not depend on them.
const N_PIECES: usize = 256;

/// A node of a [`BinaryTree`].
#[derive(Clone, Copy, Debug)]
pub struct BinaryNode {
    /// The box.
    pub bounds: Bounds,
    /// The right child, or 0 for a leaf. The left child stands behind its parent.
    right: u32,
    /// First item below, in the order.
    pub first: u32,
    /// Items below.
    pub n_items: u32,
}

/// A binary tree over runs of items.
#[derive(Clone, Debug, Default)]
pub struct BinaryTree {
    /// Nodes; the root is the first.
    pub nodes: Vec<BinaryNode>,
    /// What lies in the leaves, in their order.
    pub order: Vec<Item>,
    /// Disjoint subtrees, in order, for work in parallel: each one run of nodes. Few nodes lie in none.
    pub pieces: Vec<Range<usize>>,
}

/// A tree that stands in any order.
pub trait Source: Sync {
    /// The children of a node; none of a leaf. The root is node 0.
    fn children(&self, node: u32) -> Option<[u32; 2]>;

    /// What lies in a leaf.
    fn cluster(&self, leaf: u32) -> Cluster;
}

impl BinaryNode {
    /// A node whose children are not known yet.
    fn open(first: u32) -> BinaryNode {
        BinaryNode { bounds: Bounds { lo: glam::Vec3::ZERO, hi: glam::Vec3::ZERO }, right: 0, first, n_items: 0 }
    }

    /// The children of the node that stands at `index`; none of a leaf.
    #[inline]
    pub fn children(&self, index: u32) -> Option<[u32; 2]> {
        (self.right != 0).then_some([index + 1, self.right])
    }
}

impl BinaryTree {
    /// Brings a tree into depth-first order, and its items into that of the leaves.
    pub fn flatten(source: &impl Source, items: &[Item]) -> BinaryTree {
        let roots = piece_roots(source);
        let pieces: Vec<BinaryTree> = roots.par_iter().map(|&root| walk(source, root, items)).collect();
        let mut by_root: Vec<(u32, BinaryTree)> = roots.into_iter().zip(pieces).collect();
        by_root.sort_unstable_by_key(|(root, _)| *root);

        let mut tree = BinaryTree::default();
        let (n_nodes, n_items) = by_root.iter().fold((0, 0), |(n, m), (_, p)| (n + p.nodes.len(), m + p.order.len()));
        tree.nodes.reserve_exact(n_nodes + N_PIECES);
        tree.order.reserve_exact(n_items);
        let mut top = Vec::new();
        let mut stack = vec![(0u32, None)];
        while let Some((node, left_of)) = stack.pop() {
            let index = tree.nodes.len() as u32;
            if let Some(parent) = left_of {
                let parent: &mut BinaryNode = &mut tree.nodes[parent as usize];
                parent.right = index;
            }
            if let Ok(piece) = by_root.binary_search_by_key(&node, |(root, _)| *root) {
                tree.append(std::mem::take(&mut by_root[piece].1));
            } else if let Some([left, right]) = source.children(node) {
                top.push(index);
                tree.nodes.push(BinaryNode::open(tree.order.len() as u32));
                stack.push((right, Some(index)));
                stack.push((left, None));
            }
        }
        for index in top.into_iter().rev() {
            tree.sum_up(index as usize);
        }
        tree
    }

    /// Appends a piece.
    fn append(&mut self, piece: BinaryTree) {
        let (node, first) = (self.nodes.len() as u32, self.order.len() as u32);
        let moved = |n: &BinaryNode| BinaryNode {
            right: if n.right == 0 { 0 } else { n.right + node },
            first: n.first + first,
            ..*n
        };
        self.nodes.par_extend(piece.nodes.par_iter().map(moved));
        self.order.extend_from_slice(&piece.order);
        self.pieces.push(node as usize..self.nodes.len());
    }

    /// The box and the items of an inner node, from its children's.
    fn sum_up(&mut self, index: usize) {
        if let Some([left, right]) = self.nodes[index].children(index as u32) {
            let (left, right) = (self.nodes[left as usize], self.nodes[right as usize]);
            let node = &mut self.nodes[index];
            node.bounds = left.bounds.union(right.bounds);
            node.n_items = left.n_items + right.n_items;
        }
    }
}

/// Roots of disjoint subtrees that hold all leaves: level by level until there are enough.
pub fn piece_roots(source: &impl Source) -> Vec<u32> {
    let mut queue = VecDeque::from([0]);
    let mut roots = Vec::new();
    while roots.len() + queue.len() < N_PIECES
        && let Some(node) = queue.pop_front()
    {
        match source.children(node) {
            Some(children) => queue.extend(children),
            None => roots.push(node),
        }
    }
    roots.extend(queue);
    roots
}

/// The subtree of a node as a tree of its own.
fn walk(source: &impl Source, root: u32, items: &[Item]) -> BinaryTree {
    let mut tree = BinaryTree::default();
    let mut stack = vec![(root, None)];
    while let Some((node, left_of)) = stack.pop() {
        let index = tree.nodes.len() as u32;
        if let Some(parent) = left_of {
            let parent: &mut BinaryNode = &mut tree.nodes[parent as usize];
            parent.right = index;
        }
        let first = tree.order.len() as u32;
        match source.children(node) {
            Some([left, right]) => {
                tree.nodes.push(BinaryNode::open(first));
                stack.push((right, Some(index)));
                stack.push((left, None));
            }
            None => {
                let cluster = source.cluster(node);
                tree.order.extend_from_slice(&items[cluster.first as usize..][..cluster.n_items as usize]);
                let Cluster { bounds, n_items, .. } = cluster;
                tree.nodes.push(BinaryNode { bounds, right: 0, first, n_items });
            }
        }
    }
    for index in (0..tree.nodes.len()).rev() {
        tree.sum_up(index);
    }
    tree
}
