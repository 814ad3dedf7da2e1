//! Worlds of one material.

use flatray::world::{Material, MaterialId, World};

/// A world with one material.
pub fn world_of(material: &Material) -> (World, MaterialId) {
    let mut world = World::default();
    let id = world.materials.add(material);
    (world, id)
}
