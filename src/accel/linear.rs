//! The full scan: the oracle that every other way of answering is compared with.

use crate::numeric::prepared::PreparedRay;
use crate::world::{Hit, World, prim};

/// The closest hit among all primitives.
pub fn closest_hit(world: &World, ray: &PreparedRay) -> Hit {
    let mut best = Hit::MISS;
    for hit in prim::all(world).filter_map(|prim| prim.intersect(world, ray)) {
        if hit.is_before(&best) {
            best = hit;
        }
    }
    best
}

/// Whether any primitive lies in the ray's interval.
pub fn occluded(world: &World, ray: &PreparedRay) -> bool {
    prim::all(world).any(|prim| prim.intersect(world, ray).is_some())
}
