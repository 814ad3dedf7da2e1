//! From the binary tree to the wide one: which subtrees become leaves, and which eight boxes share a node.

use super::build::BinaryTree;
use super::slab::WIDTH;
use super::wide::{MAX_LEAF, Tag, WideNode, WideTree};
use crate::world::{Bounds, PrimKind, PrimRef, World};

/// Cost of one level of the binary tree in units of a primitive test. Times hardly change between 1 and 8, for nodes
/// are fetched from memory and leaves stream; at 3 the tree takes two thirds of the memory that it takes at 1.
const LEVEL_COST: f64 = 3.0;

/// Levels of the wide tree below which a subtree is cut into equal runs instead of followed: eight levels of wide
/// nodes hold 16 million leaves, so a path this long is a chain that the builder could not balance.
const MAX_DEPTH: usize = 40;

/// What becomes a child of a wide node.
#[derive(Clone, Copy, Debug)]
enum Child {
    /// A node of the binary tree.
    Subtree(u32),
    /// A run of primitives in leaf order that is to be cut by index.
    Run { first: u32, n_prims: u32 },
}

/// Builds the wide tree.
pub fn collapse(world: &World, binary: &BinaryTree) -> WideTree {
    if binary.nodes.is_empty() {
        return WideTree::default();
    }
    let leaf = choose_leaves(binary);
    Collapser { world, binary, leaf }.run()
}

/// Whether each node of the binary tree becomes a leaf: when testing all its primitives is expected to cost no more
/// than walking on (MacDonald and Booth 1990). A leaf holds one kind, so a mixed subtree is never one.
fn choose_leaves(binary: &BinaryTree) -> Vec<bool> {
    let mut cost = vec![0.0f64; binary.nodes.len()];
    let mut leaf = vec![false; binary.nodes.len()];
    for (index, node) in binary.nodes.iter().enumerate().rev() {
        let run = &binary.order[node.first as usize..][..node.n_prims as usize];
        let as_leaf = match can_be_leaf(run) {
            true => half_area(&node.bounds) * run.len() as f64,
            false => f64::INFINITY,
        };
        let as_node = match node.children {
            Some([left, right]) => half_area(&node.bounds) * LEVEL_COST + cost[left as usize] + cost[right as usize],
            None => f64::INFINITY,
        };
        leaf[index] = as_leaf <= as_node && as_leaf.is_finite();
        // A leaf of the binary tree that is too large is cut by index later.
        cost[index] = as_leaf.min(as_node).min(half_area(&node.bounds) * run.len() as f64);
    }
    leaf
}

fn half_area(bounds: &Bounds) -> f64 {
    let e = bounds.extent();
    e.x * e.y + e.y * e.z + e.z * e.x
}

fn can_be_leaf(run: &[PrimRef]) -> bool {
    run.len() <= MAX_LEAF && run.windows(2).all(|pair| pair[0].kind() == pair[1].kind())
}

struct Collapser<'a> {
    world: &'a World,
    binary: &'a BinaryTree,
    leaf: Vec<bool>,
}

impl Collapser<'_> {
    fn run(&self) -> WideTree {
        let mut tree = WideTree { nodes: vec![WideNode::EMPTY], ..WideTree::default() };
        let mut stack = vec![(0u32, Child::Subtree(0), 1usize)];
        while let Some((index, child, depth)) = stack.pop() {
            tree.depth = tree.depth.max(depth);
            let (children, n_children) = self.children(child, depth);
            let mut node = WideNode::EMPTY;
            for (slot, &child) in children[..n_children].iter().enumerate() {
                let bounds = self.bounds(child);
                if let Some(run) = self.leaf_run(child) {
                    let (first, tag) = tree.push_leaf(self.world, run);
                    node.set(slot, &bounds, first, tag);
                } else {
                    let next = tree.nodes.len() as u32;
                    tree.nodes.push(WideNode::EMPTY);
                    node.set(slot, &bounds, next, Tag::NODE);
                    stack.push((next, child, depth + 1));
                }
            }
            tree.nodes[index as usize] = node;
        }
        tree
    }

    /// The children of a wide node: the largest is opened until there are eight.
    fn children(&self, root: Child, depth: usize) -> ([Child; WIDTH], usize) {
        let mut children = [root; WIDTH];
        let mut n_children = 1;
        loop {
            let openable = (0..n_children).filter(|&i| self.leaf_run(children[i]).is_none());
            let weight = |i: usize| half_area(&self.bounds(children[i]));
            // Runs share one box: the longest is opened first.
            let key = |i: usize| (weight(i), self.span(children[i]).1);
            let largest = openable.max_by(|&i, &j| {
                let ((a, n), (b, m)) = (key(i), key(j));
                a.total_cmp(&b).then(n.cmp(&m))
            });
            let Some(largest) = largest.filter(|_| n_children < WIDTH) else { break };
            let [left, right] = self.open(children[largest], depth);
            children[largest] = left;
            children[n_children] = right;
            n_children += 1;
        }
        (children, n_children)
    }

    /// The two halves of what is not a leaf.
    fn open(&self, child: Child, depth: usize) -> [Child; 2] {
        if let Child::Subtree(index) = child
            && let Some([left, right]) = self.binary.nodes[index as usize].children
            && depth < MAX_DEPTH
        {
            return [Child::Subtree(left), Child::Subtree(right)];
        }
        let (first, n_prims) = self.span(child);
        let run = &self.binary.order[first as usize..][..n_prims as usize];
        // Kinds stand in order within a group: cut between them first, else in the middle at a multiple of a leaf.
        let kind = run[0].kind();
        let same_kind = run.iter().take_while(|prim| prim.kind() == kind).count() as u32;
        let half = n_prims / 2;
        let middle = half.next_multiple_of(MAX_LEAF as u32);
        let cut = match same_kind < n_prims {
            true => same_kind,
            false if middle < n_prims => middle,
            false => half,
        };
        [Child::Run { first, n_prims: cut }, Child::Run { first: first + cut, n_prims: n_prims - cut }]
    }

    fn span(&self, child: Child) -> (u32, u32) {
        match child {
            Child::Subtree(index) => {
                let node = &self.binary.nodes[index as usize];
                (node.first, node.n_prims)
            }
            Child::Run { first, n_prims } => (first, n_prims),
        }
    }

    fn leaf_run(&self, child: Child) -> Option<&[PrimRef]> {
        let (first, n_prims) = self.span(child);
        let run = &self.binary.order[first as usize..][..n_prims as usize];
        let is_leaf = match child {
            Child::Subtree(index) => self.leaf[index as usize],
            Child::Run { .. } => can_be_leaf(run),
        };
        is_leaf.then_some(run)
    }

    fn bounds(&self, child: Child) -> Bounds {
        match child {
            Child::Subtree(index) => self.binary.nodes[index as usize].bounds,
            Child::Run { first, n_prims } => {
                let run = &self.binary.order[first as usize..][..n_prims as usize];
                let everything = Bounds { lo: glam::Vec3::MIN, hi: glam::Vec3::MAX };
                run.iter().filter_map(|prim| prim.bounds(self.world)).reduce(Bounds::union).unwrap_or(everything)
            }
        }
    }
}

impl WideTree {
    /// Appends a leaf of one kind; returns where it begins and what it is.
    fn push_leaf(&mut self, world: &World, run: &[PrimRef]) -> (u32, Tag) {
        let kind = run[0].kind();
        let first = match kind {
            PrimKind::Triangle => {
                let first = self.corners.len();
                self.corners.extend(run.iter().map(|prim| world.triangles.corners(prim.row())));
                self.triangle_rows.extend(run.iter().map(|prim| prim.row() as u32));
                first
            }
            PrimKind::Sphere | PrimKind::Quadric => {
                let first = self.prims.len();
                self.prims.extend_from_slice(run);
                first
            }
        };
        (first as u32, Tag::leaf(kind, run.len()))
    }
}
