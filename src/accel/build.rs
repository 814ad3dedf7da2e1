//! The binary tree, built by obvhs (this is its only importer): PLOC (Meister and Bittner 2018) with reinsertion
//! (Meister and Bittner 2018, "Parallel Reinsertion for Bounding Volume Hierarchy Optimization").
//!
//! obvhs sees clusters of neighbours instead of primitives ([`super::cluster`]), which takes a fraction of the time and
//! of the memory. It pairs neighbours, and among boxes that are all the same a pairing pass finds one pair: a thousand
//! copies give a chain a thousand deep, and a hundred thousand do not finish. So each distinct box is handed over once
//! ([`super::duplicate`]). It says only which boxes belong together: those of the tree are our own.

use glam::Vec3A;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};
use rayon::prelude::*;

use super::Preset;
use super::area::Scale;
use super::binary::{BinaryTree, Source, piece_roots};
use super::duplicate::{Cluster, Groups};

/// What obvhs is to spend.
struct Effort {
    /// How far a pairing pass looks for a partner.
    search: PlocSearchDistance,
    /// Shares of nodes that reinsertion tries to place better, the largest nodes first, pass by pass.
    reinsertion: &'static [f32],
}

impl Effort {
    fn of(preset: Preset) -> Effort {
        match preset {
            Preset::Fast => Effort { search: PlocSearchDistance::VeryLow, reinsertion: &[] },
            Preset::Medium => Effort { search: PlocSearchDistance::Low, reinsertion: &[0.1, 0.05, 0.03] },
            Preset::High => Effort {
                search: PlocSearchDistance::Medium,
                reinsertion: &[0.5, 0.25, 0.17, 0.125, 0.1, 0.08, 0.07, 0.06],
            },
        }
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
pub fn split_share(preset: Preset) -> f64 {
    match preset {
        Preset::Fast => 0.0,
        Preset::Medium => 0.1,
        Preset::High => 0.3,
    }
}

/// Builds the tree; the groups are left without their clusters and items.
pub fn build(groups: &mut Groups, preset: Preset) -> BinaryTree {
    let effort = Effort::of(preset);
    let clusters = std::mem::take(&mut groups.clusters);
    if clusters.is_empty() {
        return BinaryTree::default();
    }
    let mut bvh = build_bvh2(&clusters, &groups.scale, &effort);
    if !is_tangled(&Built { bvh: &bvh, clusters: &clusters }) {
        reinsert(&mut bvh, &effort);
    }
    let tree = BinaryTree::flatten(&Built { bvh: &bvh, clusters: &clusters }, &groups.items);
    groups.items = Vec::new();
    tree
}

fn build_bvh2(clusters: &[Cluster], scale: &Scale, effort: &Effort) -> Bvh2 {
    let aabb = |cluster: &Cluster| {
        let scaled = scale.scaled(&cluster.bounds);
        Aabb { min: Vec3A::from(scaled.lo), max: Vec3A::from(scaled.hi) }
    };
    let aabbs: Vec<Aabb> = clusters.par_iter().map(aabb).collect();
    let indices = (0..aabbs.len() as u32).collect();
    let mut builder = PlocBuilder::with_capacity(aabbs.len());
    builder.build(effort.search, &aabbs, indices, SortPrecision::U64, 0)
}

fn reinsert(bvh: &mut Bvh2, effort: &Effort) {
    let mut optimizer = ReinsertionOptimizer::default();
    for share in effort.reinsertion {
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
