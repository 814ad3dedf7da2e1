//! Primitives that share one box, and triangles that are one and the same.

use std::hash::{BuildHasher, BuildHasherDefault, DefaultHasher};

use glam::Vec3;
use rayon::prelude::*;

use crate::world::{Bounds, PrimKind, PrimRef, World};

/// Distinct boxes, and the primitives in each.
#[derive(Debug, Default)]
pub struct Groups {
    /// One box per group.
    pub boxes: Vec<Bounds>,
    /// Primitives, group after group, in order of ids within a group.
    pub prims: Vec<PrimRef>,
    /// Where each group begins in `prims`; empty when every group has one member.
    starts: Vec<u32>,
}

impl Groups {
    /// The members of a group.
    pub fn members(&self, group: usize) -> &[PrimRef] {
        match self.starts.get(group) {
            None => &self.prims[group..=group],
            Some(&start) => {
                let end = self.starts.get(group + 1).map_or(self.prims.len(), |&end| end as usize);
                &self.prims[start as usize..end]
            }
        }
    }
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
pub fn group_by_box(world: &World, prims: Vec<PrimRef>, boxes: &[Bounds]) -> Groups {
    // Sort hashes, not boxes: most scenes have no two boxes alike, and this finds that out quickly.
    let hasher = BuildHasherDefault::<DefaultHasher>::default();
    let mut hashes: Vec<(u64, u32)> =
        boxes.par_iter().enumerate().map(|(i, b)| (hasher.hash_one(bits(b)), i as u32)).collect();
    hashes.par_sort_unstable();
    if hashes.windows(2).all(|pair| pair[0].0 != pair[1].0) {
        return Groups { boxes: boxes.to_vec(), prims, starts: Vec::new() };
    }

    let mut groups = Groups::default();
    let mut run = Vec::new();
    for same_hash in hashes.chunk_by(|a, b| a.0 == b.0) {
        // Two boxes may share a hash by chance; the sort is stable by id, so members stay in order.
        run.clear();
        run.extend(same_hash.iter().map(|&(_, index)| index));
        run.sort_by_key(|&index| bits(&boxes[index as usize]));
        for members in run.chunk_by(|&a, &b| bits(&boxes[a as usize]) == bits(&boxes[b as usize])) {
            groups.boxes.push(boxes[members[0] as usize]);
            groups.starts.push(groups.prims.len() as u32);
            groups.prims.extend(without_copies(world, members.iter().map(|&index| prims[index as usize]).collect()));
        }
    }
    groups
}

/// Drops triangles whose corners repeat those of one with a lower id. Members come and leave in order of ids.
fn without_copies(world: &World, mut members: Vec<PrimRef>) -> Vec<PrimRef> {
    if members.len() < 2 {
        return members;
    }
    let corners = |prim: PrimRef| {
        (prim.kind() == PrimKind::Triangle).then(|| {
            world.triangles.corners(prim.row()).map(|corner| (corner + Vec3::ZERO).to_array().map(f32::to_bits))
        })
    };
    // Kinds other than triangles have no corners and are all kept.
    members.sort_by_cached_key(|&prim| (corners(prim), prim));
    members.dedup_by(|b, a| corners(*b).is_some_and(|corners_b| Some(corners_b) == corners(*a)));
    members.sort_unstable();
    members
}
