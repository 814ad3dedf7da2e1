//! The binary tree, built by obvhs (this is its only importer): PLOC (Meister and Bittner 2018) with reinsertion
//! (Meister and Bittner 2018, "Parallel Reinsertion for Bounding Volume Hierarchy Optimization").
//!
//! obvhs sees clusters of neighbours instead of primitives ([`super::cluster`]), which takes a fraction of the time and
//! of the memory. It pairs neighbours, and among boxes that are all the same a pairing pass finds one pair: a thousand
//! copies give a chain a thousand deep, and a hundred thousand do not finish. So each distinct box is handed over once
//! ([`super::duplicate`]). It says only which boxes belong together: those of the tree are our own.
//!
//! What it builds it finds from below, and cannot cut. A tree that was built from the top ([`super::spatial`]) it makes better by
//! reinsertion.

use glam::Vec3A;
use obvhs::aabb::Aabb;
use obvhs::bvh2::node::Bvh2Node;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::bvh2::{Bvh2, DEFAULT_MAX_STACK_DEPTH};
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};
use rayon::prelude::*;

use super::Preset;
use super::area::Scale;
use super::binary::{BinaryTree, Source, piece_roots};
use super::duplicate::{Cluster, Groups};
use super::spatial::{Branch, Node, Piece};
use crate::world::Bounds;

/// Shares of nodes that reinsertion tries to place better, the largest nodes first, pass by pass.
fn reinsertion(preset: Preset) -> &'static [f32] {
    match preset {
        Preset::Fast => &[],
        Preset::Medium => &[0.1, 0.05, 0.03],
        // A tree from the top is hardly made better by more, but for its largest boxes.
        Preset::High => &[0.1],
    }
}

/// How much larger a cluster may be than its two parts together. A flat patch is as large as its parts, a diagonal one
/// larger; a large triangle and a small one far from it stay apart. At less than 1 only those come together that
/// overlap, like the two triangles of a quad.
pub fn max_growth(preset: Preset) -> f32 {
    match preset {
        Preset::Fast => 1.25,
        Preset::Medium => 1.0,
        Preset::High => 0.8,
    }
}

/// Boxes more than primitives that large triangles may be cut into, in shares of the primitives.
pub fn cut_share(preset: Preset) -> f64 {
    match preset {
        Preset::Fast => 0.0,
        Preset::Medium => 0.2,
        Preset::High => 0.3,
    }
}

/// Builds the tree, or makes one better that was built from the top; the groups are left without their clusters and items.
pub fn build(groups: &mut Groups, from_top: Option<Branch>, preset: Preset) -> BinaryTree {
    let clusters = std::mem::take(&mut groups.clusters);
    if clusters.is_empty() {
        return BinaryTree::default();
    }
    let (mut bvh, clusters) = match from_top {
        Some(root) => bvh2_of(&root, &groups.scale),
        None => (build_bvh2(&clusters, &groups.scale, preset), clusters),
    };
    if !is_tangled(&Built { bvh: &bvh, clusters: &clusters }) {
        reinsert(&mut bvh, reinsertion(preset));
    }
    let tree = BinaryTree::flatten(&Built { bvh: &bvh, clusters: &clusters }, &groups.items);
    groups.items = Vec::new();
    tree
}

fn build_bvh2(clusters: &[Cluster], scale: &Scale, preset: Preset) -> Bvh2 {
    // How far a pairing pass looks for a partner.
    let search = if preset == Preset::Fast { PlocSearchDistance::VeryLow } else { PlocSearchDistance::Low };
    let aabbs: Vec<Aabb> = clusters.par_iter().map(|cluster| aabb(cluster, scale)).collect();
    let indices = (0..aabbs.len() as u32).collect();
    let mut builder = PlocBuilder::with_capacity(aabbs.len());
    builder.build(search, &aabbs, indices, SortPrecision::U64, 0)
}

fn aabb(cluster: &Cluster, scale: &Scale) -> Aabb {
    let Bounds { lo, hi } = scale.scaled(&cluster.bounds);
    Aabb { min: Vec3A::from(lo), max: Vec3A::from(hi) }
}

/// A tree as obvhs has it, and its clusters.
fn bvh2_of(root: &Branch, scale: &Scale) -> (Bvh2, Vec<Cluster>) {
    // Where nodes stand: the children of each behind those of all that come before it, depth first.
    let (mut n_nodes, mut n_clusters) = (1, 0);
    let (mut inner, mut pieces) = (Vec::new(), Vec::new());
    // obvhs makes room for its own search by the depth.
    let mut max_depth = DEFAULT_MAX_STACK_DEPTH;
    let mut stack = vec![(root, 0, 0)];
    while let Some((branch, place, level)) = stack.pop() {
        let start = n_nodes;
        match branch {
            Branch::Piece(piece) => {
                pieces.push(PlacedPiece { piece, place, start, first_cluster: n_clusters });
                n_nodes += piece.nodes.len() - 1;
                n_clusters += piece.clusters.len() as u32;
                max_depth = max_depth.max(level + piece.depth);
            }
            Branch::Inner(children) => {
                inner.push((place, start));
                n_nodes += 2;
                stack.extend([(&children[1], start + 1, level + 1), (&children[0], start, level + 1)]);
            }
        }
    }

    // Pieces, all at once.
    let mut nodes = vec![Bvh2Node::default(); n_nodes];
    let (mut rest, mut n_before, mut own) = (nodes.as_mut_slice(), 0, Vec::with_capacity(pieces.len()));
    for placed in &pieces {
        let (nodes, behind) = rest[placed.start - n_before..].split_at_mut(placed.piece.nodes.len() - 1);
        (rest, n_before) = (behind, placed.start + nodes.len());
        own.push(nodes);
    }
    let copy = |(placed, own): (&PlacedPiece, &mut [Bvh2Node])| placed.copy(own, scale);
    let roots: Vec<Bvh2Node> = pieces.par_iter().zip(own).map(copy).collect();
    for (placed, root) in pieces.iter().zip(roots) {
        nodes[placed.place] = root;
    }

    // What is above them, from below.
    for &(place, first) in inner.iter().rev() {
        let around = nodes[first].aabb().union(nodes[first + 1].aabb());
        nodes[place] = Bvh2Node::new(around, 0, first as u32);
    }
    let clusters: Vec<Cluster> = pieces.iter().flat_map(|placed| &placed.piece.clusters).copied().collect();
    let primitive_indices = (0..clusters.len() as u32).collect();
    (Bvh2 { nodes, primitive_indices, max_depth, ..Bvh2::default() }, clusters)
}

/// A piece, and where its nodes and clusters go.
struct PlacedPiece<'a> {
    piece: &'a Piece,
    /// Of the root.
    place: usize,
    /// Of the first of all other nodes.
    start: usize,
    first_cluster: u32,
}

impl PlacedPiece<'_> {
    /// Makes the nodes but for the root, which comes back.
    fn copy(&self, own: &mut [Bvh2Node], scale: &Scale) -> Bvh2Node {
        let mut root = Bvh2Node::default();
        for (place, node) in self.piece.nodes.iter().enumerate().rev() {
            let copy = match *node {
                Node::Leaf(cluster) => {
                    let bounds = aabb(&self.piece.clusters[cluster as usize], scale);
                    Bvh2Node::new(bounds, 1, self.first_cluster + cluster)
                }
                Node::Inner(first) => {
                    let first = first as usize - 1;
                    let around = own[first].aabb().union(own[first + 1].aabb());
                    Bvh2Node::new(around, 0, (self.start + first) as u32)
                }
            };
            match place {
                0 => root = copy,
                _ => own[place - 1] = copy,
            }
        }
        root
    }
}

fn reinsert(bvh: &mut Bvh2, shares: &[f32]) {
    let mut optimizer = ReinsertionOptimizer::default();
    for share in shares {
        let candidates = largest_nodes(bvh, *share);
        optimizer.run_with_candidates(bvh, &candidates, 1);
    }
}

/// In a tangle a ray that meets one of so many subtrees meets more than this many of its nodes. In meshes it is about 15,
/// whatever their size, and in a heap of beams 30.
const TANGLED: f32 = 80.0;

/// Whether most boxes overlap most others, as those of long slivers in all directions do. Reinsertion looks for a place
/// in all that a node overlaps: there it takes time in the square of the nodes and gains nothing.
fn is_tangled(built: &Built) -> bool {
    let half_area = |node: u32| built.bvh.nodes[node as usize].aabb().half_area();
    let nodes_met = |&root: &u32| {
        let mut area = 0.0;
        let mut stack = vec![root];
        while let Some(node) = stack.pop() {
            area += half_area(node);
            stack.extend(built.children(node).into_iter().flatten());
        }
        if half_area(root) > 0.0 { area / half_area(root) } else { 0.0 }
    };
    // A sample will do. It is summed in order, so that the outcome does not depend on threads.
    let met: Vec<f32> = piece_roots(built).par_iter().step_by(4).map(nodes_met).collect();
    met.iter().sum::<f32>() > TANGLED * met.len() as f32
}

/// The share of nodes with the largest boxes, without the root. obvhs sorts candidates in an order that depends on
/// threads where areas are equal; this one does not.
fn largest_nodes(bvh: &Bvh2, share: f32) -> Vec<u32> {
    let n = (bvh.nodes.len() as f64 * f64::from(share)) as usize;
    // Areas are not negative, so that their bits are in their order; the largest first.
    let key = |id: usize| u64::from(!bvh.nodes[id].aabb().half_area().to_bits()) << 32 | id as u64;
    let mut keys: Vec<u64> = (1..bvh.nodes.len()).into_par_iter().map(key).collect();
    if n < keys.len() {
        keys.select_nth_unstable(n);
        keys.truncate(n);
    }
    keys.par_sort_unstable();
    keys.into_iter().map(|key| key as u32).collect()
}

/// A tree as obvhs made it.
struct Built<'a> {
    bvh: &'a Bvh2,
    clusters: &'a [Cluster],
}

impl Source for Built<'_> {
    fn children(&self, node: u32) -> Option<[u32; 2]> {
        let node = &self.bvh.nodes[node as usize];
        (!node.is_leaf()).then(|| [node.first_index, node.first_index + 1])
    }

    fn cluster(&self, leaf: u32) -> Cluster {
        self.clusters[self.bvh.primitive_indices[self.bvh.nodes[leaf as usize].first_index as usize] as usize]
    }
}
