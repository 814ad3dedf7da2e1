//! Quadrics of all classes, near the limits between classes and near tangents.

use glam::DVec3;

use super::primitive::Primitive;
use super::random::Random;
use super::shapes::Canonical;
use super::{Block, Tally, probe, shapes};
use crate::numeric::quadric::Quadric;
use crate::world::Ray;

/// Cases that share a surface, since putting one into its frame costs more than a test.
const RAYS_PER_SURFACE: u64 = 8;

/// A suite.
pub fn run(block: &Block, tally: &mut Tally) {
    let mut surface = None;
    for (case, mut random) in block.each() {
        let (canonical, row) = match surface.filter(|_| case.number % RAYS_PER_SURFACE != 0) {
            Some(kept) => kept,
            None => {
                let first = case.number - case.number % RAYS_PER_SURFACE;
                *surface.insert(make(&mut Random::new(case.seed, "quadric surface", first)))
            }
        };
        let ray = aim(&mut random, &canonical, &row);
        probe::check(tally, &case, &ray, &Primitive::Quadric(row));
    }
}

fn make(random: &mut Random) -> (Canonical, Quadric) {
    let class = random.below(shapes::N_CLASSES);
    let mut canonical = shapes::canonical(random, class);
    if random.chance(0.3) {
        // Nearly of another class.
        let axis = random.below(3) as usize;
        let tiny = random.log_uniform(1e-20, 1.0);
        canonical.diagonal[axis] = if canonical.diagonal[axis] == 0.0 { tiny } else { canonical.diagonal[axis] * tiny };
    }
    let factor = random.sign() * if random.chance(0.5) { 1.0 } else { random.power_of_two(-60, 60) };
    (canonical, Quadric::from_matrix(canonical.matrix(factor)))
}

/// A ray that meets a surface where it is hard.
pub(super) fn aim(random: &mut Random, canonical: &Canonical, row: &Quadric) -> Ray {
    let center = canonical.center;
    let near = center + 2.0 * random.in_cube();
    let from = center + random.log_uniform(0.1, 1e3) * random.direction();
    match random.below(7) {
        0 => shapes::ray_towards(random, near, from),
        // Along an axis of the surface or the world.
        1 => {
            let axis = [DVec3::X, DVec3::Y, DVec3::Z][random.below(3) as usize];
            let axis = if random.chance(0.5) { canonical.rotation * axis } else { axis };
            Ray::new(near, random.sign() * axis)
        }
        2 => Ray::new(if random.chance(0.5) { near } else { from }, canonical.asymptote(random)),
        // Through the centre, which is the apex of a cone and the edge of two planes.
        3 => shapes::ray_towards(random, center, from),
        4 => {
            let direction = random.grid(3);
            let direction = if direction == DVec3::ZERO { DVec3::X } else { direction };
            Ray::new(center - random.power_of_two(-2, 6) * direction, direction)
        }
        _ => near_tangent(random, canonical, row).unwrap_or_else(|| shapes::ray_towards(random, near, from)),
    }
}

/// A ray that touches the surface, or passes it at 1e-16 to 1e-2 of its distance; sometimes it starts there.
fn near_tangent(random: &mut Random, canonical: &Canonical, row: &Quadric) -> Option<Ray> {
    let start = canonical.center + 2.0 * random.in_cube();
    let touch = shapes::surface_point(row, start, random.direction())?;
    let normal = row.half_gradient(touch - row.center).try_normalize()?;
    let along = random.perpendicular(normal);
    let off = if random.chance(0.2) { 0.0 } else { random.sign() * random.log_uniform(1e-16, 1e-2) };
    let distance = if random.chance(0.2) { 0.0 } else { random.log_uniform(0.1, 1e3) };
    let ray = Ray::new(touch + off * normal - distance * along, along + off * random.unit() * normal);
    (ray.origin.is_finite() && ray.direction.is_finite()).then_some(ray)
}
