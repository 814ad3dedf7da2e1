//! Spheres from afar, near their limb, and so large that they look flat.

use glam::DVec3;

use super::primitive::Primitive;
use super::random::Random;
use super::{Block, Tally, probe, shapes};
use crate::world::Ray;

/// A suite.
pub fn run(block: &Block, tally: &mut Tally) {
    for (case, mut random) in block.each() {
        let (ray, primitive) = if random.chance(0.25) { giant(&mut random) } else { distant(&mut random) };
        probe::check(tally, &case, &ray, &primitive);
    }
}

/// A sphere seen from 2 to 1e7 radii away: anywhere, or within 1e-7 to 1e-2 radii of a tangent.
fn distant(random: &mut Random) -> (Ray, Primitive) {
    let radius = random.log_uniform(1e-5, 1e5);
    let center =
        if random.chance(0.3) { DVec3::ZERO } else { radius * random.log_uniform(0.1, 1e4) * random.direction() };
    let distance = radius * random.log_uniform(2.0, 1e7);
    let sphere = Primitive::Sphere { center, radius };
    if random.chance(0.3) {
        let from = center + distance * random.direction();
        let target = center + 1.1 * radius * random.in_cube();
        return (shapes::ray_towards(random, target, from), sphere);
    }
    let out = random.direction();
    let along = random.perpendicular(out);
    let off = match random.below(8) {
        0 => 0.0,
        _ => random.sign() * random.log_uniform(1e-7, 1e-2),
    };
    let limb = center + radius * (1.0 + off) * out;
    (shapes::ray_towards(random, limb, limb - distance * along), sphere)
}

/// A giant sphere from a height of about 1: down, around the horizon, and above.
fn giant(random: &mut Random) -> (Ray, Primitive) {
    let radius = random.log_uniform(1e2, 1e8);
    let up = if random.chance(0.5) { DVec3::Y } else { random.direction() };
    let center = -radius * up;
    let height = random.uniform(0.5, 2.0);
    let from = height * up + if random.chance(0.5) { DVec3::ZERO } else { 10.0 * random.perpendicular(up) };
    let level = random.perpendicular(up);
    // The horizon lies √(2h/R) below the level.
    let dip = (2.0 * height / radius).sqrt();
    let slope = match random.below(3) {
        0 => random.uniform(-1.0, 0.2),
        1 => -dip * (1.0 + random.sign() * random.log_uniform(1e-12, 0.5)),
        _ => -random.log_uniform(1e-9, 1.0),
    };
    (Ray::new(from, level + slope * up), Primitive::Sphere { center, radius })
}
