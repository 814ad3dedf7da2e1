//! Primitives that share one box, and triangles that are one and the same.
//!
//! The builder pairs neighbouring boxes and cannot tell identical ones apart, so each distinct box is handed over once.
//! A few primitives that share it are one cluster; more become a list, with a small tree of its own.

use glam::Vec3;
use rayon::prelude::*;

use super::area::Scale;
use super::morton::Curve;
use super::wide::MAX_LEAF;
use crate::world::{Bounds, PrimKind, PrimRef, World};

/// What lies in the leaves of the binary tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Item {
    /// One primitive.
    Prim(PrimRef),
    /// A row of [`Groups::lists`].
    List(u32),
}

/// A run of items and the box around it.
#[derive(Clone, Copy, Debug)]
pub struct Cluster {
    /// The box.
    pub bounds: Bounds,
    /// First item.
    pub first: u32,
    /// Items in it.
    pub n_items: u32,
}

/// Everything bounded, along a Morton curve.
#[derive(Debug)]
pub struct Groups {
    /// How boxes are measured.
    pub scale: Scale,
    /// Items in order.
    pub items: Vec<Item>,
    /// Runs of items that share a box: at most [`MAX_LEAF`] primitives of one kind, or one list.
    pub clusters: Vec<Cluster>,
    /// Primitives of one and the same box, in order of ids.
    pub lists: Vec<Vec<PrimRef>>,
}

type BoxBits = [u32; 6];

fn bits(b: &Bounds) -> BoxBits {
    // Adding zero makes −0.0 and 0.0 one box.
    let plus_zero = |v: Vec3| (v + Vec3::ZERO).to_array().map(f32::to_bits);
    let ([a, b, c], [d, e, f]) = (plus_zero(b.lo), plus_zero(b.hi));
    [a, b, c, d, e, f]
}

/// Boxes in a piece of the curve, which fits into the second-level cache.
const PIECE: usize = 4096;

/// Sorts primitives along a Morton curve, groups them by box and joins neighbours to clusters that are
/// at most `max_growth` times as large as their parts. Pieces of the curve are worked on each on its own, so that the outcome does not depend on threads; neighbours in two
/// pieces are not joined.
pub fn group(world: &World, prims: &[PrimRef], boxes: &[Bounds], scale: Scale, max_growth: f32) -> Groups {
    let curve = Curve::through(boxes, &scale);
    let pieces: Vec<Groups> = curve
        .pieces(PIECE)
        .into_par_iter()
        .map(|piece| {
            let mut groups = Groups::of_piece(world, prims, boxes, curve.places(piece), scale);
            groups.join_neighbours(max_growth);
            groups
        })
        .collect();
    drop(curve);
    Groups::concat(pieces, scale)
}

impl Groups {
    fn new(scale: Scale) -> Groups {
        Groups { scale, items: Vec::new(), clusters: Vec::new(), lists: Vec::new() }
    }

    /// Groups the primitives of a piece by box. Equal boxes have one place on the curve.
    fn of_piece(
        world: &World,
        prims: &[PrimRef],
        boxes: &[Bounds],
        places: impl Iterator<Item = impl Iterator<Item = usize>>,
        scale: Scale,
    ) -> Groups {
        let mut groups = Groups::new(scale);
        let mut run = Vec::new();
        for place in places {
            run.clear();
            run.extend(place);
            if let &[only] = run.as_slice() {
                groups.push(boxes[only], &[prims[only]]);
                continue;
            }
            sort_by_key(&mut run, |&index| (bits(&boxes[index]), prims[index]));
            for same_box in run.chunk_by(|&a, &b| bits(&boxes[a]) == bits(&boxes[b])) {
                let members = same_box.iter().map(|&index| prims[index]).collect();
                groups.push(boxes[same_box[0]], &without_copies(world, members));
            }
        }
        groups
    }

    fn push(&mut self, bounds: Bounds, members: &[PrimRef]) {
        let first = self.items.len() as u32;
        if members.len() <= MAX_LEAF && members.iter().all(|prim| prim.kind() == members[0].kind()) {
            self.items.extend(members.iter().map(|&prim| Item::Prim(prim)));
        } else {
            self.items.push(Item::List(self.lists.len() as u32));
            self.lists.push(members.to_vec());
        }
        self.clusters.push(Cluster { bounds, first, n_items: self.items.len() as u32 - first });
    }

    fn concat(pieces: Vec<Groups>, scale: Scale) -> Groups {
        let mut all = Groups::new(scale);
        all.items.reserve_exact(pieces.iter().map(|piece| piece.items.len()).sum());
        all.clusters.reserve_exact(pieces.iter().map(|piece| piece.clusters.len()).sum());
        for piece in pieces {
            let (first_item, first_list) = (all.items.len() as u32, all.lists.len() as u32);
            all.items.extend(piece.items.into_iter().map(|item| match item {
                Item::Prim(_) => item,
                Item::List(list) => Item::List(list + first_list),
            }));
            all.clusters.extend(piece.clusters.into_iter().map(|c| Cluster { first: c.first + first_item, ..c }));
            all.lists.extend(piece.lists);
        }
        all
    }
}

/// Sorts on all threads what is worth it.
fn sort_by_key<T: Copy + Send + Sync, K: Ord + Send + Sync>(run: &mut [T], key: impl Fn(&T) -> K + Sync) {
    if run.len() > PIECE {
        run.par_sort_by_cached_key(key);
    } else {
        run.sort_unstable_by_key(key);
    }
}

/// Drops triangles whose corners repeat those of one with a lower id: they are hit at the same t by every ray and lose
/// the tie. Members come and leave in order of ids.
fn without_copies(world: &World, mut members: Vec<PrimRef>) -> Vec<PrimRef> {
    if members.len() < 2 {
        return members;
    }
    let bits = |corner: Vec3| (corner + Vec3::ZERO).to_array().map(f32::to_bits);
    // Kinds other than triangles have no corners and are all kept.
    let corners =
        |prim: PrimRef| (prim.kind() == PrimKind::Triangle).then(|| world.triangles.corners(prim.row()).map(bits));
    sort_by_key(&mut members, |&prim| (corners(prim), prim));
    members.dedup_by(|b, a| corners(*b).is_some_and(|corners_b| Some(corners_b) == corners(*a)));
    members.sort_unstable();
    members
}
