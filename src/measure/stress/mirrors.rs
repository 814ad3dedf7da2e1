//! A thousand bounces in a closed mirror: a ray that gets out has crossed a wall.

use glam::{DMat3, DMat4, DVec3, Vec3};

use super::mesh::{Mesh, cube};
use super::random::Random;
use super::scene::Scene;
use super::{Block, Tally, shapes};
use crate::render::surface::describe;
use crate::world::{MaterialId, ObjectId, Ray, World};

/// A suite: each block is one path, each case a bounce.
pub fn run(block: &Block, tally: &mut Tally) {
    let mut random = block.shared();
    let size = random.power_of_two(-20, 20);
    let at = if random.chance(0.2) { DVec3::ZERO } else { size * random.log_uniform(1.0, 1e7) * random.direction() };
    let (world, corners) = cavity(&mut random, size, at);
    let scene = Scene::new(world);
    let origin = at_center(&corners, at);
    let mut ray = Ray::new(origin + 0.3 * size * random.in_cube(), first_direction(&mut random, &corners, origin));

    let mut escaped = false;
    for (case, _) in block.each() {
        let hit = tally.watch(|| scene.closest(&ray));
        let right = hit.is_some() && scene.judge(tally, &case, &ray, &hit);
        // A path that is out stays out: what follows it is not counted again.
        tally.count(right || escaped, || case.text(&ray, None));
        if !hit.is_some() {
            escaped = true;
            ray = Ray::new(origin, random.direction());
            continue;
        }
        let surface = describe(&scene.world, &ray, &hit);
        let mirrored = ray.direction - 2.0 * ray.direction.dot(surface.ng) * surface.ng;
        let mirrored = mirrored.normalize_or(DVec3::X);
        ray = Ray::new(surface.leave(mirrored), mirrored);
    }
}

/// A cube, a tilted cube, a sphere or an ellipsoid; corners for those that have them.
fn cavity(random: &mut Random, size: f64, at: DVec3) -> (World, Vec<Vec3>) {
    let mut world = World::default();
    match random.below(4) {
        // Whole multiples of the size keep the corners exact, to 2^24 sizes.
        0 => add(&mut world, cube().placed(size, (at / size).round() * size)),
        1 => {
            let turn = shapes::rotation(random);
            let turned = |mesh: Mesh, turn: DMat3| Mesh {
                positions: mesh.positions.iter().map(|p| (turn * (p.as_dvec3() * size) + at).as_vec3()).collect(),
                ..mesh
            };
            // Rounding to f32 must leave a box of some thickness.
            let far = at.abs().max_element() > 1e5 * size;
            if far {
                add(&mut world, cube().placed(size, (at / size).round() * size))
            } else {
                add(&mut world, turned(cube(), turn))
            }
        }
        2 => {
            world.spheres.add(at, size, MaterialId(0), ObjectId(0));
            (world, Vec::new())
        }
        _ => {
            let turn = shapes::rotation(random);
            let axes = DVec3::new(random.uniform(0.5, 2.0), random.uniform(0.5, 2.0), random.uniform(0.5, 2.0));
            let canonical = shapes::Canonical {
                diagonal: axes / (size * size),
                linear: DVec3::ZERO,
                constant: -1.0,
                rotation: turn,
                center: at,
            };
            let matrix: DMat4 = canonical.matrix(1.0);
            world.quadrics.add(matrix, MaterialId(0), ObjectId(0));
            (world, Vec::new())
        }
    }
}

fn add(world: &mut World, mesh: Mesh) -> (World, Vec<Vec3>) {
    let mut world = std::mem::take(world);
    let _ = world.add_mesh(mesh.input());
    (world, mesh.positions)
}

fn at_center(corners: &[Vec3], at: DVec3) -> DVec3 {
    if corners.is_empty() {
        return at;
    }
    corners.iter().map(|corner| corner.as_dvec3()).sum::<DVec3>() / corners.len() as f64
}

/// Anywhere, into a corner, or onto an edge.
fn first_direction(random: &mut Random, corners: &[Vec3], origin: DVec3) -> DVec3 {
    let corner = |random: &mut Random| random.pick(corners).map(|corner| corner.as_dvec3() - origin);
    let towards = match random.below(4) {
        0 => corner(random),
        1 => corner(random).zip(corner(random)).map(|(a, b)| 0.5 * (a + b)),
        _ => None,
    };
    towards.and_then(|v| v.try_normalize()).unwrap_or_else(|| random.direction())
}
