//! Primitives that share one box, and triangles that are one and the same.
//!
//! The builder pairs neighbouring boxes and cannot tell identical ones apart, so each distinct box is handed over once.
//! What shares it becomes a list, with a small tree of its own.

use std::hash::{BuildHasher, BuildHasherDefault, DefaultHasher};

use glam::Vec3;
use rayon::prelude::*;

use crate::world::{Bounds, PrimKind, PrimRef, World};

/// What lies in one box that is handed to the builder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Item {
    /// One primitive.
    Prim(PrimRef),
    /// A row of [`Groups::lists`].
    List(u32),
}

/// Boxes to build over; no two are alike.
#[derive(Debug, Default)]
pub struct Groups {
    /// Boxes.
    pub boxes: Vec<Bounds>,
    /// What lies in each.
    pub items: Vec<Item>,
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

/// Groups primitives by box. Of triangles with the same corners in the same order only the first stays: the others
/// are hit at the same t by every ray and lose the tie.
pub fn group_by_box(world: &World, prims: Vec<PrimRef>, boxes: Vec<Bounds>) -> Groups {
    // Sort hashes, not boxes: most scenes have no two boxes alike, and this finds that out quickly.
    let hasher = BuildHasherDefault::<DefaultHasher>::default();
    let mut hashes: Vec<(u64, u32)> =
        boxes.par_iter().enumerate().map(|(i, b)| (hasher.hash_one(bits(b)), i as u32)).collect();
    hashes.par_sort_unstable();
    if hashes.windows(2).all(|pair| pair[0].0 != pair[1].0) {
        return Groups { boxes, items: prims.into_iter().map(Item::Prim).collect(), lists: Vec::new() };
    }

    let mut groups = Groups::default();
    let mut run = Vec::new();
    for same_hash in hashes.chunk_by(|a, b| a.0 == b.0) {
        // Two boxes may share a hash by chance; the sort is stable by id, so members stay in order.
        run.clear();
        run.extend(same_hash.iter().map(|&(_, index)| index));
        run.sort_by_key(|&index| bits(&boxes[index as usize]));
        for members in run.chunk_by(|&a, &b| bits(&boxes[a as usize]) == bits(&boxes[b as usize])) {
            let bounds = boxes[members[0] as usize];
            let members = members.iter().map(|&index| prims[index as usize]).collect();
            groups.boxes.push(bounds);
            match without_copies(world, members) {
                only if only.len() == 1 => groups.items.push(Item::Prim(only[0])),
                list => {
                    groups.items.push(Item::List(groups.lists.len() as u32));
                    groups.lists.push(list);
                }
            }
        }
    }
    groups
}

/// Drops triangles whose corners repeat those of one with a lower id. Members come and leave in order of ids.
fn without_copies(world: &World, mut members: Vec<PrimRef>) -> Vec<PrimRef> {
    if members.len() < 2 {
        return members;
    }
    let bits = |corner: Vec3| (corner + Vec3::ZERO).to_array().map(f32::to_bits);
    // Kinds other than triangles have no corners and are all kept.
    let corners =
        |prim: PrimRef| (prim.kind() == PrimKind::Triangle).then(|| world.triangles.corners(prim.row()).map(bits));
    members.sort_by_cached_key(|&prim| (corners(prim), prim));
    members.dedup_by(|b, a| corners(*b).is_some_and(|corners_b| Some(corners_b) == corners(*a)));
    members.sort_unstable();
    members
}
