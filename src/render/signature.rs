//! What a sample met, in a number: objects and materials along its rays, and the lights that reached each of them. Samples of
//! different numbers have an edge between them, whatever their colours; samples of one number look at the same surfaces in the same light.

use super::sampler::mix;
use crate::world::{Hit, World};

/// What a hit is on.
pub fn of_hit(world: &World, hit: &Hit) -> u32 {
    if !hit.is_some() {
        return 0;
    }
    hash(u64::from(hit.object(world).0) << 32 | u64::from(hit.material(world).0) | 1 << 63)
}

/// A light reaches a hit. The order of lights does not matter.
pub fn add_light(signature: &mut u32, light: u32) {
    *signature = signature.wrapping_add(hash(u64::from(light)));
}

/// A finished ray of the level below, mirrored or refracted, adds what it met.
pub fn add_bounce(signature: &mut u32, below: u32) {
    *signature = hash(u64::from(*signature) << 32 | u64::from(below));
}

fn hash(bits: u64) -> u32 {
    (mix(bits) >> 32) as u32
}
