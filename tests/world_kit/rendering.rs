//! Rendering a world.

use flatray::accel::{Accel, AccelKind};
use flatray::render::{Control, Rendered, Settings, render};
use flatray::world::{Camera, World};

/// Renders with a BVH.
pub fn render_world(world: &World, camera: &Camera, settings: &Settings) -> Rendered {
    let accel = Accel::build(world, AccelKind::Bvh);
    render(world, &accel, camera, settings, &Control::default()).unwrap()
}
