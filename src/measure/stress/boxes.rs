//! What boxes get wrong: flat ones, rays in their planes, directions with zeros and with tiny components. The answer
//! of the BVH must be that of the full scan, bit for bit.

use glam::{DVec3, Vec3};

use super::mesh::Mesh;
use super::random::Random;
use super::scene::Scene;
use super::{Block, Tally};
use crate::numeric::quadric::Quadric;
use crate::world::{MaterialId, ObjectId, Ray, World};

/// Every so many cases all primitives are judged by the oracle, not only the one that was hit.
const FULL_JUDGEMENT: u64 = 16;

/// A suite.
pub fn run(block: &Block, tally: &mut Tally) {
    let mut random = block.shared();
    let (size, at) = place(&mut random);
    let scene = Scene::new(world(&mut random, size, at));
    for (case, mut random) in block.each() {
        let ray = ray(&mut random, size, at);
        let (agrees, hit) = scene.agrees(tally, &ray);
        let mut right = agrees && scene.judge(tally, &case, &ray, &hit);
        if right && case.number.is_multiple_of(FULL_JUDGEMENT) {
            right = scene.judge_all(tally, &ray, &hit);
        }
        tally.count(right, || case.text(&ray, None));
    }
}

fn place(random: &mut Random) -> (f64, DVec3) {
    let size = random.power_of_two(-20, 20);
    let at = match random.below(3) {
        0 => DVec3::ZERO,
        1 => size * random.grid(1000),
        _ => size * random.log_uniform(1.0, 1e6) * random.direction(),
    };
    (size, at)
}

/// Flat grids across each axis, with a few spheres and ellipsoids between them.
fn world(random: &mut Random, size: f64, at: DVec3) -> World {
    let mut world = World::default();
    let n = random.integer(1, 4) as u32;
    for axis in 0..3 {
        let level = random.integer(-2, 2) as f64;
        let mesh = flat_grid(n, axis, level).placed(size, at);
        let _ = world.add_mesh(mesh.input());
    }
    for _ in 0..random.below(4) {
        let center = at + size * random.grid(2);
        world.spheres.add(center, size * random.power_of_two(-2, 1), MaterialId(0), ObjectId(0));
    }
    for _ in 0..random.below(3) {
        let center = at + size * random.grid(2);
        let class = if random.chance(0.7) { 0 } else { random.below(super::shapes::N_CLASSES) };
        let canonical = super::shapes::Canonical { center, ..super::shapes::canonical(random, class) };
        let canonical = super::shapes::Canonical {
            diagonal: canonical.diagonal / (size * size),
            linear: canonical.linear / size,
            ..canonical
        };
        world.quadrics.add(canonical.matrix(1.0), MaterialId(0), ObjectId(0));
    }
    debug_assert!(world.quadrics.surfaces.iter().all(|row: &Quadric| row.constant.is_finite()));
    world
}

/// A grid over [−2, 2]² at a level of an axis.
fn flat_grid(n: u32, axis: usize, level: f64) -> Mesh {
    let mut mesh = Mesh::default();
    for j in 0..=n {
        for i in 0..=n {
            let mut p = [0.0; 3];
            p[axis] = level as f32;
            p[(axis + 1) % 3] = 4.0 * i as f32 / n as f32 - 2.0;
            p[(axis + 2) % 3] = 4.0 * j as f32 / n as f32 - 2.0;
            mesh.positions.push(Vec3::from_array(p));
        }
    }
    for j in 0..n {
        for i in 0..n {
            let a = j * (n + 1) + i;
            mesh.triangles.push([a, a + 1, a + n + 2]);
            mesh.triangles.push([a, a + n + 2, a + n + 1]);
        }
    }
    mesh
}

fn ray(random: &mut Random, size: f64, at: DVec3) -> Ray {
    let start = if random.chance(0.6) { random.grid(3) } else { 3.0 * random.in_cube() };
    let start = if random.chance(0.3) { start + random.log_uniform(1.0, 1e6) * random.direction() } else { start };
    let mut direction = match random.below(4) {
        0 => random.grid(1),
        1 => random.grid(2) - start,
        2 => random.direction(),
        _ => 3.0 * random.in_cube() - start,
    };
    for axis in 0..3 {
        if random.chance(0.3) {
            direction[axis] = 0.0f64.copysign(random.sign());
        } else if random.chance(0.2) {
            direction[axis] = random.sign() * random.log_uniform(1e-30, 1e-6);
        }
    }
    if direction == DVec3::ZERO {
        direction.x = -1.0;
    }
    let ray = Ray::new(at + size * start, direction * random.power_of_two(-30, 30));
    if random.chance(0.2) { ray.until(random.log_uniform(1e-3, 1e3)) } else { ray }
}
