//! Needles seen from the side and from far away.

use super::primitive::Primitive;
use super::{Block, Tally, probe, shapes};
use glam::DVec3;

/// A suite.
pub fn run(block: &Block, tally: &mut Tally) {
    for (case, mut random) in block.each() {
        let size = random.power_of_two(-20, 20);
        let at =
            if random.chance(0.5) { DVec3::ZERO } else { size * random.log_uniform(0.1, 1e3) * random.direction() };
        let corners = if random.chance(0.7) {
            let aspect = random.log_uniform(1e-6, 1.0);
            shapes::needle(&mut random, at, size, aspect)
        } else {
            shapes::triangle(&mut random, at, size)
        };
        let target = shapes::point_of(&mut random, corners);

        // A direction at an angle of down to 1e-6 to the plane.
        let [a, b, c] = corners.map(|corner| corner.as_dvec3());
        let normal = (b - a).cross(c - a).try_normalize().unwrap_or(DVec3::Z);
        let sine = if random.chance(0.2) { 1.0 } else { random.log_uniform(1e-6, 1.0) };
        let within = if random.chance(0.5) { (b - a).normalize_or(DVec3::X) } else { random.perpendicular(normal) };
        let towards = within + random.sign() * sine * normal;
        let from = target - size * random.log_uniform(0.1, 1e4) * towards.normalize();
        let ray = shapes::ray_towards(&mut random, target, from);
        probe::check(tally, &case, &ray, &Primitive::Triangle(corners));
    }
}
