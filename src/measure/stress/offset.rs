//! Everything far from the origin: up to 1e7 sizes.

use glam::{DVec3, Vec3};

use super::primitive::Primitive;
use super::random::Random;
use super::{Block, Tally, probe, shapes};
use crate::numeric::quadric::Quadric;
use crate::world::Ray;

/// A suite.
pub fn run(block: &Block, tally: &mut Tally) {
    for (case, mut random) in block.each() {
        let size = random.power_of_two(-10, 10) * random.uniform(1.0, 2.0);
        let sizes_away = if random.chance(0.1) { 0.0 } else { random.log_uniform(1.0, 1e7) };
        let at = size * sizes_away * random.direction();
        let (ray, primitive) = moved(&mut random, at, size);
        probe::check(tally, &case, &ray, &primitive);
    }
}

fn moved(random: &mut Random, at: DVec3, size: f64) -> (Ray, Primitive) {
    let from = at + size * random.log_uniform(0.5, 1e3) * random.direction();
    match random.below(3) {
        0 => {
            let mut corners = shapes::triangle(random, at, size);
            if random.chance(0.3) {
                // Rounding to f32 leaves little of a small triangle far away: one f32 step is all there is.
                corners[1] = Vec3 { x: corners[0].x.next_up(), ..corners[0] };
            }
            let target = shapes::point_of(random, corners);
            (shapes::ray_towards(random, target, from), Primitive::Triangle(corners))
        }
        1 => {
            let radius = size * random.uniform(0.1, 1.0);
            let target = at + 1.02 * radius * random.in_cube();
            (shapes::ray_towards(random, target, from), Primitive::Sphere { center: at, radius })
        }
        _ => {
            let class = random.below(shapes::N_CLASSES);
            let canonical = shapes::Canonical { center: at, ..shapes::canonical(random, class) };
            let row = Quadric::from_matrix(
                shapes::Canonical {
                    diagonal: canonical.diagonal / (size * size),
                    linear: canonical.linear / size,
                    ..canonical
                }
                .matrix(1.0),
            );
            let target = at + size * random.in_cube();
            (shapes::ray_towards(random, target, from), Primitive::Quadric(row))
        }
    }
}
