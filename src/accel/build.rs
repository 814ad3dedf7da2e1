//! The binary tree, built by obvhs (this is its only importer): PLOC (Meister and Bittner 2018) with reinsertion
//! (Meister and Bittner 2018, "Parallel Reinsertion for Bounding Volume Hierarchy Optimization").
//!
//! obvhs pairs neighbours, and among boxes that are all the same a pairing pass finds one pair: a thousand copies give
//! a chain a thousand deep, and a hundred thousand do not finish. So each distinct box is handed over once, with what
//! shares it in a list ([`super::duplicate`]).

use glam::Vec3A;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};
use rayon::prelude::*;

use super::Preset;
use super::duplicate::{Groups, Item};
use crate::world::Bounds;

/// A binary tree over runs of primitives. Children stand behind their parents.
#[derive(Clone, Debug, Default)]
pub struct BinaryTree {
    /// Nodes; the root is the first.
    pub nodes: Vec<BinaryNode>,
    /// What lies in the leaves, in their order: each subtree is one run.
    pub order: Vec<Item>,
}

/// A node of a [`BinaryTree`].
#[derive(Clone, Copy, Debug)]
pub struct BinaryNode {
    /// The box.
    pub bounds: Bounds,
    /// Children, or `None` for a leaf.
    pub children: Option<[u32; 2]>,
    /// First item below, in the order.
    pub first: u32,
    /// Items below.
    pub n_items: u32,
}

/// What obvhs is to spend.
struct Effort {
    /// How far it looks for a partner.
    search: PlocSearchDistance,
    /// Passes that look at direct neighbours only; there are the most nodes then, and the most pairs agree.
    n_quick_passes: usize,
    /// Share of nodes that reinsertion tries to place better, in the first of its passes.
    reinsertion: f32,
}

impl Effort {
    fn of(preset: Preset) -> Effort {
        match preset {
            Preset::Fast => Effort { search: PlocSearchDistance::Low, n_quick_passes: 3, reinsertion: 0.0 },
            Preset::Medium => Effort { search: PlocSearchDistance::Medium, n_quick_passes: 3, reinsertion: 0.05 },
            Preset::High => Effort { search: PlocSearchDistance::High, n_quick_passes: 1, reinsertion: 1.0 },
        }
    }
}

/// Builds the tree over boxes.
pub fn build(groups: &Groups, preset: Preset) -> BinaryTree {
    if groups.boxes.is_empty() {
        return BinaryTree::default();
    }
    let bvh = build_bvh2(&groups.boxes, Effort::of(preset));

    // Walk the tree depth first: children behind parents, items in the order of leaves.
    let mut tree =
        BinaryTree { nodes: Vec::with_capacity(bvh.nodes.len()), order: Vec::with_capacity(groups.items.len()) };
    let mut stack = vec![(0u32, None::<(u32, usize)>)];
    while let Some((source, parent)) = stack.pop() {
        let node = &bvh.nodes[source as usize];
        let index = tree.nodes.len() as u32;
        if let Some((parent, side)) = parent
            && let Some(children) = &mut tree.nodes[parent as usize].children
        {
            children[side] = index;
        }
        let first = tree.order.len() as u32;
        let mut bounds = groups.boxes[0];
        let children = if node.is_leaf() {
            let leaf = node.first_index as usize..(node.first_index + node.prim_count) as usize;
            let members = &bvh.primitive_indices[leaf];
            tree.order.extend(members.iter().map(|&index| groups.items[index as usize]));
            let boxes = members.iter().map(|&index| groups.boxes[index as usize]);
            bounds = boxes.reduce(Bounds::union).unwrap_or(bounds);
            None
        } else {
            stack.push((node.first_index + 1, Some((index, 1))));
            stack.push((node.first_index, Some((index, 0))));
            Some([0, 0])
        };
        tree.nodes.push(BinaryNode { bounds, children, first, n_items: tree.order.len() as u32 - first });
    }
    tree.sum_up();
    tree
}

fn build_bvh2(boxes: &[Bounds], effort: Effort) -> Bvh2 {
    let scale = scale_of(boxes);
    let scaled = |b: &Bounds| Aabb { min: scale * Vec3A::from(b.lo), max: scale * Vec3A::from(b.hi) };
    let aabbs: Vec<Aabb> = boxes.par_iter().map(scaled).collect();
    let indices = (0..boxes.len() as u32).collect();
    let mut bvh = PlocBuilder::with_capacity(boxes.len()).build(
        effort.search,
        &aabbs,
        indices,
        SortPrecision::U64,
        effort.n_quick_passes,
    );
    ReinsertionOptimizer::default().run(&mut bvh, effort.reinsertion, None);
    bvh
}

/// A power of two that brings the largest coordinate near 1. obvhs compares products of f32, which overflow in large
/// scenes and vanish in small ones, and boxes that it cannot tell apart make a chain. It says only which boxes belong
/// together: those of the tree are our own, unscaled.
fn scale_of(boxes: &[Bounds]) -> f32 {
    let largest = boxes.par_iter().map(|b| b.lo.abs().max(b.hi.abs()).max_element()).reduce(|| 0.0, f32::max);
    let exponent = (largest.to_bits() >> 23) as i32 - 127;
    f32::from_bits(((127 - exponent.clamp(-126, 126)) as u32) << 23)
}

impl BinaryTree {
    /// Boxes and items of inner nodes, from the leaves up. Depth-first order makes a node's run begin where it stands.
    fn sum_up(&mut self) {
        for index in (0..self.nodes.len()).rev() {
            if let Some([left, right]) = self.nodes[index].children {
                let (left, right) = (self.nodes[left as usize], self.nodes[right as usize]);
                let node = &mut self.nodes[index];
                node.bounds = left.bounds.union(right.bounds);
                node.n_items = left.n_items + right.n_items;
            }
        }
    }
}
