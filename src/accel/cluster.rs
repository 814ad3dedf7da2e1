//! Clusters of neighbours, so that the builder sees fewer boxes.
//!
//! Its first passes pair direct neighbours along a Morton curve, and what they pair ends up in one leaf. Here the same
//! is done without nodes: a cluster is a run of items.

use super::area::Scale;
use super::duplicate::{Cluster, Groups, Item};
use super::wide::MAX_LEAF;
use crate::world::{Bounds, PrimKind};

/// Passes over a piece; half of the clusters find a partner in the first, and hardly any after the sixth.
const MAX_PASSES: usize = 16;

/// Boxes that differ by less are alike: a ray that meets one meets the other. The builder would make chains of them.
const ALIKE: f32 = 1.02;

impl Groups {
    /// Joins neighbours of one kind to clusters that fit into a leaf and are at most `max_growth` times as large as their
    /// parts, and neighbours whose boxes are nearly the same to clusters of any size.
    pub fn join_neighbours(&mut self, max_growth: f32) {
        let Groups { items, scale, clusters, .. } = self;
        let mut joiner = Joiner { items, scale, max_growth, costs: Vec::new() };
        for _ in 0..MAX_PASSES {
            let before = clusters.len();
            joiner.join_pairs(clusters);
            if clusters.len() == before {
                break;
            }
        }
    }
}

struct Joiner<'a> {
    items: &'a [Item],
    scale: &'a Scale,
    max_growth: f32,
    /// Area of each cluster joined with the one behind it; ∞ where they must not be.
    costs: Vec<f32>,
}

impl Joiner<'_> {
    /// Joins the pairs of neighbours that each prefer the other.
    fn join_pairs(&mut self, clusters: &mut Vec<Cluster>) {
        self.costs.clear();
        self.costs.extend(clusters.windows(2).map(|pair| join_cost(self.items, self.scale, self.max_growth, pair)));
        let mut n_joined = 0;
        let mut index = 0;
        while index < clusters.len() {
            let mut cluster = clusters[index];
            if self.prefers_next(index) && !self.prefers_next(index + 1) {
                let next = clusters[index + 1];
                cluster.bounds = cluster.bounds.union(next.bounds);
                cluster.n_items += next.n_items;
                index += 1;
            }
            index += 1;
            clusters[n_joined] = cluster;
            n_joined += 1;
        }
        clusters.truncate(n_joined);
    }

    /// Whether a cluster prefers the one behind it to the one before it.
    fn prefers_next(&self, index: usize) -> bool {
        let next = self.costs.get(index).copied().unwrap_or(f32::INFINITY);
        let last = index.checked_sub(1).map_or(f32::INFINITY, |last| self.costs[last]);
        // Among boxes that are all alike every other prefers the next, so that half of them find a partner.
        next < last || (next == last && next.is_finite() && index.is_multiple_of(2))
    }
}

/// The half area of two neighbours joined; ∞ when they must not be.
fn join_cost(items: &[Item], scale: &Scale, max_growth: f32, pair: &[Cluster]) -> f32 {
    let (a, b) = (&pair[0], &pair[1]);
    let joined = scale.half_area(&Bounds::union(a.bounds, b.bounds));
    let (area_a, area_b) = (scale.half_area(&a.bounds), scale.half_area(&b.bounds));
    let kind = |cluster: &Cluster| kind_of(items[cluster.first as usize]);
    let fits = (a.n_items + b.n_items) as usize <= MAX_LEAF && kind(a).is_some() && kind(a) == kind(b);
    let may = (fits && joined <= max_growth * (area_a + area_b)) || joined <= ALIKE * area_a.min(area_b);
    if may { joined } else { f32::INFINITY }
}

/// What may share a leaf with others of its kind.
pub fn kind_of(item: Item) -> Option<PrimKind> {
    match item {
        Item::Prim(prim) if prim.kind() != PrimKind::Instance => Some(prim.kind()),
        // A placement is a tree: a box of its own is worth more than room in a leaf.
        Item::Prim(_) | Item::List(_) => None,
    }
}
