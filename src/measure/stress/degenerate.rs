//! Triangles that no ray can hit among good ones, and rays that can hit nothing.

use glam::{DVec3, Vec3, vec3};

use super::mesh::Mesh;
use super::random::Random;
use super::scene::Scene;
use super::{Block, Tally, shapes};
use crate::world::{Hit, Ray};

/// A suite: nothing panics, and every ray sees the good triangles as if there were no others.
pub fn run(block: &Block, tally: &mut Tally) {
    let mut random = block.shared();
    let (good, mixed) = meshes(&mut random);
    let (alone, among) = (Scene::of_meshes([&good]), Scene::of_meshes([&mixed]));
    for (case, mut random) in block.each() {
        let triangle = random.below(good.triangles.len() as u64) as usize;
        let target = shapes::point_of(&mut random, good.corners(triangle));
        let from = random.log_uniform(0.1, 100.0) * random.direction();
        let mut ray = shapes::ray_towards(&mut random, target, from);
        let spoilt = random.chance(0.2);
        if spoilt {
            spoil(&mut random, &mut ray);
        }
        let (agrees, hit) = among.agrees(tally, &ray);
        let (_, expected) = alone.agrees(&mut Tally::default(), &ray);
        let what = |hit: &Hit| [hit.t, hit.u, hit.v].map(f64::to_bits);
        let mut right = agrees && what(&hit) == what(&expected) && among.judge(tally, &case, &ray, &hit);
        if hit.is_some() && right {
            let corners = |scene: &Scene, hit: &Hit| scene.world.triangles.corners(hit.prim.row());
            right = corners(&among, &hit) == corners(&alone, &expected);
        }
        if !spoilt && right && case.number.is_multiple_of(16) {
            right = among.judge_all(tally, &ray, &hit);
        }
        tally.count(right, || case.text(&ray, None));
    }
}

/// Good triangles, and the same with bad ones in between.
fn meshes(random: &mut Random) -> (Mesh, Mesh) {
    let (mut good, mut mixed) = (Mesh::default(), Mesh::default());
    let n_good = random.integer(1, 30);
    let add = |mesh: &mut Mesh, corners: [Vec3; 3]| {
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(corners);
        mesh.triangles.push([first, first + 1, first + 2]);
    };
    for _ in 0..n_good {
        for _ in 0..random.below(3) {
            let corners = bad(random);
            add(&mut mixed, corners);
        }
        let size = random.log_uniform(1e-3, 1.0);
        let at = random.in_cube();
        let corners = shapes::triangle(random, at, size);
        // Coordinates of few bits may by chance lie on a line; random ones do not.
        add(&mut good, corners);
        add(&mut mixed, corners);
    }
    (good, mixed)
}

/// A triangle without area or with a coordinate that is no number.
fn bad(random: &mut Random) -> [Vec3; 3] {
    let a = random.in_cube().as_vec3();
    let odd = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY];
    match random.below(6) {
        0 => [a; 3],
        1 => [a, a, random.in_cube().as_vec3()],
        2 => {
            // Collinear in exact arithmetic: whole multiples of a direction of few bits.
            let step = random.grid(100).as_vec3();
            [step * random.integer(-9, 9) as f32, step * random.integer(-9, 9) as f32, step]
        }
        3 => {
            let mut corners = [a, random.in_cube().as_vec3(), random.in_cube().as_vec3()];
            let value = random.pick(&odd).unwrap_or(f32::NAN);
            corners[random.below(3) as usize][random.below(3) as usize] = value;
            corners
        }
        4 => [vec3(f32::from_bits(1), 0.0, 0.0), Vec3::ZERO, vec3(f32::from_bits(3), 0.0, 0.0)],
        _ => [Vec3::splat(f32::NAN), Vec3::splat(f32::INFINITY), a],
    }
}

/// Makes a ray one that can hit nothing, or nearly so.
fn spoil(random: &mut Random, ray: &mut Ray) {
    let odd = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX, f64::MIN_POSITIVE, 5e-324, -0.0];
    let value = random.pick(&odd).unwrap_or(f64::NAN);
    let axis = random.below(3) as usize;
    match random.below(5) {
        0 => ray.origin[axis] = value,
        1 => ray.direction[axis] = value,
        2 => ray.t_min = value,
        3 => ray.t_max = value,
        _ => ray.direction = DVec3::ZERO * value,
    }
}
