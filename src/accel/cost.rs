//! What the parts of a tree are expected to cost a ray, and which eight subtrees share a node: the optimum by dynamic
//! programming (Ylitie, Karras and Laine 2017, section 3).

use std::ops::Range;

use rayon::prelude::*;

use super::area::Scale;
use super::binary::BinaryTree;
use super::cluster::kind_of;
use super::duplicate::{Groups, Item};
use super::slab::WIDTH;
use super::wide::MAX_LEAF;

/// Cost of testing the eight boxes of a node, times the chance to meet the node's own box.
const NODE: f32 = 1.0;

/// Cost of testing a leaf, however many triangles its lanes hold.
const LEAF: f32 = 1.0;

/// What each of its primitives adds: kinds other than triangles are tested one after another, and uncertain triangles
/// are redone singly.
const PRIM: f32 = 0.02;

/// What a node costs by being there, which is memory, as so many times a visit of a box of the average primitive's share
/// of the scene's area. Without it the lowest nodes are half empty where that saves next to nothing.
const NODE_MEMORY: f32 = 30.0;

/// Costs of a subtree when it may take up to 1, 2, … 7 slots of a node.
type Costs = [f32; WIDTH - 1];

/// Costs of all subtrees.
pub struct CostTable<'a> {
    binary: &'a BinaryTree,
    groups: &'a Groups,
    costs: Vec<Costs>,
    /// Cost of a node whether it is visited or not.
    idle: f32,
}

impl CostTable<'_> {
    /// Finds the costs, from the leaves up.
    pub fn of<'a>(binary: &'a BinaryTree, groups: &'a Groups) -> CostTable<'a> {
        let root = binary.nodes.first().map_or(0.0, |root| groups.scale.half_area(&root.bounds));
        let idle = NODE_MEMORY * root / binary.order.len().max(1) as f32;
        let mut table = CostTable { binary, groups, costs: Vec::new(), idle };
        let mut costs = vec![[0.0; WIDTH - 1]; binary.nodes.len()];
        let mut pieces: Vec<(Range<usize>, &mut [Costs])> = Vec::new();
        let (mut rest, mut at) = (costs.as_mut_slice(), 0);
        for piece in &binary.pieces {
            let (_, behind) = rest.split_at_mut(piece.start - at);
            let (costs, behind) = behind.split_at_mut(piece.len());
            pieces.push((piece.clone(), costs));
            (rest, at) = (behind, piece.end);
        }
        pieces.into_par_iter().for_each(|(piece, costs)| {
            for index in piece.clone().rev() {
                costs[index - piece.start] = table.costs_of(index, |child| &costs[child - piece.start]);
            }
        });
        let mut is_done = vec![false; binary.nodes.len()];
        for piece in &binary.pieces {
            is_done[piece.clone()].fill(true);
        }
        for index in (0..binary.nodes.len()).rev().filter(|&index| !is_done[index]) {
            costs[index] = table.costs_of(index, |child| &costs[child]);
        }
        table.costs = costs;
        table
    }

    fn costs_of<'c>(&self, index: usize, costs: impl Fn(usize) -> &'c Costs) -> Costs {
        let leaf = self.leaf_cost(index);
        let Some([left, right]) = self.binary.nodes[index].children(index as u32) else { return [leaf; WIDTH - 1] };
        let (left, right) = (costs(left as usize), costs(right as usize));
        let mut all = [f32::INFINITY; WIDTH - 1];
        all[0] = leaf.min(self.area(index) * NODE + self.idle + share(left, right, WIDTH).1);
        for slots in 2..WIDTH {
            all[slots - 1] = all[slots - 2].min(share(left, right, slots).1);
        }
        all
    }

    fn area(&self, index: usize) -> f32 {
        let scale: &Scale = &self.groups.scale;
        scale.half_area(&self.binary.nodes[index].bounds)
    }

    /// The cost of a node of the binary tree as one leaf; ∞ when it is none.
    fn leaf_cost(&self, index: usize) -> f32 {
        let node = &self.binary.nodes[index];
        let run = &self.binary.order[node.first as usize..][..node.n_items as usize];
        let n_prims = match run {
            [Item::List(list)] => self.groups.lists[*list as usize].len(),
            _ => run.len(),
        };
        let is_end = node.children(index as u32).is_none();
        if !is_end && !is_leaf(run) {
            return f32::INFINITY;
        }
        // What is larger than a leaf has nodes of its own.
        let n_leaves = n_prims.div_ceil(MAX_LEAF) as f32;
        let n_nodes = (n_leaves - 1.0) / (WIDTH - 1) as f32;
        self.area(index) * (LEAF * n_leaves + PRIM * n_prims as f32 + NODE * n_nodes)
    }

    /// The subtrees that become children of a wide node over a node of the binary tree; none when that one is an end.
    pub fn children(&self, index: u32) -> ([u32; WIDTH], usize) {
        let mut children = [0; WIDTH];
        let mut n_children = 0;
        let Some([left, right]) = self.binary.nodes[index as usize].children(index) else { return (children, 0) };
        let (left_slots, _) = share(&self.costs[left as usize], &self.costs[right as usize], WIDTH);
        let mut stack = vec![(right, WIDTH - left_slots), (left, left_slots)];
        while let Some((index, mut slots)) = stack.pop() {
            let costs = &self.costs[index as usize];
            while slots > 1 && costs[slots - 1] == costs[slots - 2] {
                slots -= 1;
            }
            match self.binary.nodes[index as usize].children(index) {
                Some([left, right]) if slots > 1 => {
                    let (left_slots, _) = share(&self.costs[left as usize], &self.costs[right as usize], slots);
                    stack.extend([(right, slots - left_slots), (left, left_slots)]);
                }
                _ => {
                    children[n_children] = index;
                    n_children += 1;
                }
            }
        }
        (children, n_children)
    }

    /// Whether a node of the binary tree is best as one leaf.
    pub fn is_leaf(&self, index: u32) -> bool {
        self.leaf_cost(index as usize) <= self.costs[index as usize][0]
    }
}

/// Whether a run of items fits into a leaf: a few primitives of one kind.
pub fn is_leaf(run: &[Item]) -> bool {
    let kind = run.first().and_then(|&item| kind_of(item));
    kind.is_some() && run.len() <= MAX_LEAF && run.iter().all(|&item| kind_of(item) == kind)
}

/// How many of some slots the left of two subtrees best takes, and the cost of both.
#[inline]
fn share(left: &Costs, right: &Costs, slots: usize) -> (usize, f32) {
    let mut best = (1, left[0] + right[slots - 2]);
    for left_slots in 2..slots {
        let cost = left[left_slots - 1] + right[slots - left_slots - 1];
        if cost < best.1 {
            best = (left_slots, cost);
        }
    }
    best
}
