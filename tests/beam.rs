//! Beams: what lies in a pyramid is found whatever rays miss, by the tree as by the scan.

/// Building worlds.
mod world_kit {
    pub mod pinhole;
    pub mod quadric;
}

use flatray::accel::{Accel, AccelKind, Beam};
use flatray::measure::stress::mesh::bumpy_block;
use flatray::measure::stress::random::Random;
use flatray::measure::stress::shapes::{needle, triangle};
use flatray::numeric::clip::Clip;
use flatray::render::camera_ray::CameraRays;
use flatray::world::{Bounds, Camera, Hit, MaterialId, MeshInput, ObjectId, Ray, World};
use glam::{DAffine3, DMat3, DQuat, DVec3, Vec3, dvec3};
use world_kit::pinhole::camera;
use world_kit::quadric::quadric;

const NO_MATERIAL: MaterialId = MaterialId(0);

/// Spheres, quadrics of all manners, triangles, needles and placements, small ones in a space of some size.
fn mixed_world(seed: u64, n_each: u64, n_unbounded: u64) -> World {
    let mut world = World::default();
    let block = bumpy_block(2);
    world.add_mesh(block.input()).unwrap();
    let prototype = world.add_prototype(0);
    for i in 0..n_each {
        let mut random = Random::new(seed, "mixed", i);
        let mut at = || 10.0 * random.in_cube();
        let places: [DVec3; 6] = [0; 6].map(|_| at());
        let size = random.log_uniform(1e-4, 1.0);
        world.spheres.add(places[0], size, NO_MATERIAL, ObjectId(0));
        let squares = [0; 3].map(|_| random.log_uniform(0.1, 10.0) / (size * size));
        let shift = |squares: [f64; 3], at: DVec3, constant: f64| {
            let linear = [0, 1, 2].map(|axis| -2.0 * squares[axis] * at[axis]);
            let square = (0..3).map(|axis| squares[axis] * at[axis] * at[axis]).sum::<f64>();
            quadric(squares, linear, square + constant)
        };
        world.quadrics.add(shift(squares, places[1], -1.0), NO_MATERIAL, ObjectId(0));
        // A cylinder about an axis, cut at both ends.
        let squares = [squares[0], 0.0, squares[0]];
        let (lo, hi) = (places[2] - DVec3::Y * 0.5, places[2] + DVec3::Y * 0.5);
        let infinite = |v: DVec3, x: f64| dvec3(x, v.y, x);
        let clip = Clip::world_box(infinite(lo, f64::NEG_INFINITY), infinite(hi, f64::INFINITY));
        world.quadrics.add_clipped(shift(squares, places[2], -1.0), clip, NO_MATERIAL, ObjectId(0));
        if i < n_unbounded {
            // Without ends, or with two sheets.
            let squares = if i == 0 { squares } else { [squares[0], -squares[0], squares[2]] };
            let constant = if i == 2 { 1.0 } else { -1.0 };
            world.quadrics.add(shift(squares, places[3], constant), NO_MATERIAL, ObjectId(0));
        }
        let corners =
            if i % 2 == 0 { triangle(&mut random, places[4], size) } else { needle(&mut random, places[4], 5.0, 1e-3) };
        let mesh = MeshInput { positions: corners.to_vec(), triangles: vec![[0, 1, 2]], ..MeshInput::default() };
        world.add_mesh(mesh).unwrap();
        let turn = DMat3::from_quat(DQuat::from_axis_angle(random.direction(), random.uniform(0.0, 6.0)));
        let scale = DMat3::from_diagonal(size * dvec3(1.0, random.log_uniform(0.1, 1.0), 1.0));
        let transform = DAffine3 { matrix3: turn * scale, translation: places[5] };
        world.add_instance(prototype, transform, None, ObjectId(0)).unwrap();
    }
    world
}

/// A pyramid from a point, in the direction of another: four corners of a parallelogram or, now and then, of none.
fn random_corners(random: &mut Random, forwards: DVec3) -> ([DVec3; 4], DVec3) {
    let forwards = forwards.normalize();
    let size = random.log_uniform(1e-5, 0.5);
    let right = random.perpendicular(forwards);
    let up = forwards.cross(right);
    let tilt = if random.chance(0.3) { 0.5 * random.direction() } else { DVec3::ZERO };
    let mut corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
        .map(|(x, y): (f64, f64)| forwards + size * (x * right + y * random.uniform(0.9, 1.0) * up));
    if random.chance(0.5) {
        corners.reverse();
    }
    if random.chance(0.2) {
        corners[2] = 0.5 * (corners[1] + corners[3]) + 0.3 * (corners[2] - corners[0]);
    }
    (corners, forwards + tilt)
}

/// A direction between four.
fn inside(random: &mut Random, corners: &[DVec3; 4]) -> DVec3 {
    let (u, v) = (random.unit(), random.unit());
    let [top, bottom] = [corners[0].lerp(corners[1], u), corners[3].lerp(corners[2], u)];
    top.lerp(bottom, v)
}

fn farthest(bounds: &Bounds, beam: &Beam) -> f64 {
    let corner = |i: usize| {
        let side = |axis: usize| if i >> axis & 1 == 0 { bounds.lo[axis] } else { bounds.hi[axis] };
        beam.axis.dot(dvec3(side(0).into(), side(1).into(), side(2).into()) - beam.origin)
    };
    (0..8).map(corner).fold(f64::NEG_INFINITY, f64::max)
}

/// The box of what was hit, in the world.
fn bounds_of(world: &World, hit: &Hit) -> Option<Bounds> {
    match hit.instance.row() {
        Some(row) => Some(world.instances.bounds[row]),
        None => hit.prim.bounds(world),
    }
}

#[test]
fn no_is_never_said_where_a_ray_of_the_pyramid_hits() {
    no_is_right(&mixed_world(1, 60, 0), 500);
}

#[test]
fn no_is_never_said_of_surfaces_without_end_that_a_ray_hits() {
    no_is_right(&mixed_world(2, 10, 1), 500);
    no_is_right(&mixed_world(3, 10, 3), 0);
}

/// Compares the beams of a world with rays in them; at least some must be empty.
fn no_is_right(world: &World, n_empty_at_least: usize) {
    let [bvh, linear] = [AccelKind::Bvh, AccelKind::Linear].map(|kind| Accel::build(world, kind));
    let (mut n_hit, mut n_nearer, mut n_empty) = (0, 0, 0);
    for i in 0..4000 {
        let mut random = Random::new(2, "beams", i);
        let origin = if random.chance(0.8) { 20.0 * random.direction() } else { 8.0 * random.in_cube() };
        let aside = if random.chance(0.3) { 3.0 * random.in_cube() } else { DVec3::ZERO };
        let target = target_of(world, random.bits()) + aside;
        let (corners, axis) = random_corners(&mut random, target - origin);
        let beam = Beam::new(origin, corners, axis);
        let rays: Vec<Ray> = (0..64).map(|_| Ray::new(origin, inside(&mut random, &corners))).collect();
        let mut hits = vec![Hit::MISS; rays.len()];
        bvh.closest_hit(world, &rays, &mut hits);
        let found = bvh.anything_nearer(world, &beam, f64::INFINITY);
        assert_eq!(found, linear.anything_nearer(world, &beam, f64::INFINITY), "beam {i}");
        n_empty += usize::from(!found);
        for hit in hits.iter().filter(|hit| hit.is_some()) {
            n_hit += 1;
            assert!(found, "beam {i}: {hit:?}");
            let Some(bounds) = bounds_of(world, hit) else { continue };
            let depth = farthest(&bounds, &beam).next_up();
            for depth in [depth, depth * 1.5] {
                n_nearer += 1;
                assert!(bvh.anything_nearer(world, &beam, depth), "beam {i}: {hit:?} before {depth}");
                assert!(linear.anything_nearer(world, &beam, depth), "beam {i}: {hit:?} before {depth}");
            }
        }
    }
    assert!(n_hit > 10_000 && n_nearer > 10_000 && n_empty >= n_empty_at_least, "{n_hit} {n_nearer} {n_empty}");
}

/// The middle of something bounded.
fn target_of(world: &World, bits: u64) -> DVec3 {
    let row = bits as usize >> 3;
    let bounds = match bits % 4 {
        0 => world.spheres.bounds(row % world.spheres.len()),
        1 => world.quadrics.bounds[row % world.quadrics.len()].unwrap_or(world.spheres.bounds(0)),
        2 => world.triangles.bounds(world.own_triangles().nth(row % world.n_own_triangles()).unwrap()),
        _ => world.instances.bounds[row % world.instances.len()],
    };
    bounds.center()
}

#[test]
fn tree_and_scan_agree_at_every_depth_and_from_far_away() {
    for (seed, distance) in [(3, 10.0), (4, 10.0), (6, 1e3), (9, 1e7)] {
        let world = mixed_world(seed, 30, seed % 3);
        let [bvh, linear] = [AccelKind::Bvh, AccelKind::Linear].map(|kind| Accel::build(&world, kind));
        let mut n_found = [0, 0];
        for i in 0..3000 {
            let mut random = Random::new(seed, "depths", i);
            let origin = if i % 2 == 0 { distance * random.direction() } else { distance * random.in_cube() };
            let target = target_of(&world, random.bits());
            let (corners, axis) = random_corners(&mut random, target - origin);
            let corners = if i % 3 == 0 { corners } else { corners.map(|corner| corner.lerp(target - origin, 0.9)) };
            let beam = Beam::new(origin, corners, axis);
            // The depth of a corner of a box, exactly, and others.
            let around = axis.dot(target - origin);
            let depth = match i % 4 {
                0 => f64::INFINITY,
                1 => around,
                _ => around * random.uniform(0.8, 1.2),
            };
            let found = bvh.anything_nearer(&world, &beam, depth);
            assert_eq!(found, linear.anything_nearer(&world, &beam, depth), "seed {seed}, beam {i}");
            n_found[usize::from(found)] += 1;
        }
        assert!(n_found[0] > 300 && n_found[1] > 300, "{n_found:?}");
    }
}

/// Where a camera of 64 by 48 pixels sees a point.
fn project(camera: &Camera, point: DVec3) -> [f64; 2] {
    let p = camera.world_from_camera.inverse().transform_point3(point);
    let px_per_unit = 0.5 * f64::from(camera.height_px) / (0.5 * camera.fov_y_radians).tan();
    let [w, h] = [camera.width_px, camera.height_px].map(|size_px| 0.5 * f64::from(size_px));
    [w - px_per_unit * p.x / p.z, h + px_per_unit * p.y / p.z]
}

/// Whether a line between two points has a point in a square around a pixel's centre.
fn is_met([a, b]: [[f64; 2]; 2], pixel: [u32; 2], half_px: f64) -> bool {
    let (mut from, mut to) = (0.0f64, 1.0f64);
    for axis in 0..2 {
        let (start, step) = (a[axis] - f64::from(pixel[axis]) - 0.5, b[axis] - a[axis]);
        let [enter, leave] = [-half_px, half_px].map(|side| (side - start) / step);
        (from, to) = (from.max(enter.min(leave)), to.min(enter.max(leave)));
    }
    from <= to
}

/// Builds a wire between two points, of a radius.
type Wire = fn(&mut World, DVec3, DVec3, f64);

/// Thin triangles around the wire.
fn prism(world: &mut World, from: DVec3, to: DVec3, radius: f64) {
    let x = (to - from).any_orthonormal_vector();
    let y = (to - from).normalize().cross(x);
    let around = [x, 0.86 * y - 0.5 * x, -0.86 * y - 0.5 * x];
    let ring = |at: DVec3| around.map(|v| (at + radius * v).as_vec3());
    let positions = [ring(from), ring(to)].concat();
    let triangles = vec![[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4], [2, 0, 3], [2, 3, 5]];
    world.add_mesh(MeshInput { positions, triangles, ..MeshInput::default() }).unwrap();
}

/// The prism, placed.
fn placed_prism(world: &mut World, from: DVec3, to: DVec3, radius: f64) {
    let first = world.triangles.len();
    prism(world, 0.1 * from, 0.1 * to, 0.1 * radius);
    let prototype = world.add_prototype(first);
    world.add_instance(prototype, DAffine3::from_scale(DVec3::splat(10.0)), None, ObjectId(0)).unwrap();
}

/// A cylinder without ends, or with them.
fn cylinder(world: &mut World, from: DVec3, to: DVec3, radius: f64, has_ends: bool) {
    let along = (to - from).normalize();
    let x = along.any_orthonormal_vector();
    // |p − from|² − (along·(p − from))² = r², from the two directions across.
    let squares = [x, along.cross(x)].map(|n| n.extend(-n.dot(from)));
    let mut a = glam::DMat4::ZERO;
    for n in squares {
        for i in 0..4 {
            *a.col_mut(i) += n[i] * n;
        }
    }
    a.w_axis.w -= radius * radius;
    if has_ends {
        world.quadrics.add_clipped(a, Clip::along(from, to - from), NO_MATERIAL, ObjectId(0));
    } else {
        world.quadrics.add(a, NO_MATERIAL, ObjectId(0));
    }
}

#[test]
fn a_wire_of_a_fiftieth_of_a_pixel_is_found_wherever_it_is_and_nowhere_else() {
    let camera = camera(dvec3(0.5, 0.2, 10.0), DVec3::ZERO, 40.0, 64, 48);
    let rays = CameraRays::new(&camera);
    let pixel_size = 2.0 * 20f64.to_radians().tan() * 10.0 / 48.0;
    let kinds: [(&str, Wire); 4] = [
        ("prism", prism),
        ("placed prism", placed_prism),
        ("cylinder", |world, from, to, radius| cylinder(world, from, to, radius, true)),
        ("cylinder without ends", |world, from, to, radius| cylinder(world, from, to, radius, false)),
    ];
    for (name, wire) in kinds {
        for i in 0..12 {
            let mut random = Random::new(6, "wires", i);
            let [from, to] = [-1.0, 1.0].map(|side| dvec3(3.0 * side, 0.0, 0.0) + 2.0 * random.in_cube());
            let mut world = World::default();
            wire(&mut world, from, to, 0.01 * pixel_size);
            // A wall behind it.
            let corner = |x: f32, y: f32| Vec3::new(50.0 * x, 50.0 * y, -5.0);
            let positions = vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
            let triangles = vec![[0, 1, 2], [0, 2, 3]];
            world.add_mesh(MeshInput { positions, triangles, ..MeshInput::default() }).unwrap();
            let line = [from, to].map(|end| project(&camera, end));
            // A cylinder is taken to go on as far as its box, or its whole plane, does.
            let beyond = if name.contains("prism") { 0.0 } else { 4.0 };
            let along = |end: usize, axis: usize| line[end][axis] + beyond * (line[end][axis] - line[1 - end][axis]);
            let long = [0, 1].map(|end| [0, 1].map(|axis| along(end, axis)));
            for kind in [AccelKind::Bvh, AccelKind::Linear] {
                let accel = Accel::build(&world, kind);
                let mut n_found = 0;
                for y in 0..camera.height_px {
                    for x in 0..camera.width_px {
                        let corner = [f64::from(x), f64::from(y)];
                        let beam = rays.beam(corner, corner.map(|px| px + 1.0));
                        let is_found = accel.anything_nearer(&world, &beam, 14.0);
                        n_found += usize::from(is_found);
                        if is_met(line, [x, y], 0.5) {
                            assert!(is_found, "{name} {i} {kind:?}: missed at {x} {y}");
                        } else if !is_met(long, [x, y], 0.55) {
                            assert!(!is_found, "{name} {i} {kind:?}: found at {x} {y}");
                        }
                    }
                }
                assert!((20..200).contains(&n_found), "{name} {i}: {n_found}");
            }
        }
    }
}

#[test]
fn surfaces_that_are_seen_are_not_nearer_than_themselves_and_what_is_behind_is_not_there() {
    let camera = camera(DVec3::ZERO, dvec3(0.1, 0.2, -1.0), 40.0, 32, 32);
    let rays = CameraRays::new(&camera);
    let mut world = World::default();
    world.spheres.add(dvec3(0.0, 0.0, -5.0), 1.0, NO_MATERIAL, ObjectId(0));
    world.spheres.add(dvec3(0.0, 0.0, 5.0), 1.0, NO_MATERIAL, ObjectId(0));
    world.quadrics.add(quadric([0.0; 3], [0.0, 1.0, 0.0], 1.0), NO_MATERIAL, ObjectId(0));
    let accel = Accel::build(&world, AccelKind::Bvh);
    let mut n_empty = 0;
    for y in 0..32 {
        for x in 0..32 {
            let corner = [f64::from(x), f64::from(y)];
            let beam = rays.beam(corner, corner.map(|px| px + 1.0));
            let corners =
                [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]].map(|at| [corner[0] + at[0], corner[1] + at[1]]);
            let seen = corners.map(|[x, y]| rays.ray(x, y));
            let mut hits = [Hit::MISS; 4];
            accel.closest_hit(&world, &seen, &mut hits);
            let nearest = seen.iter().zip(&hits).map(|(ray, hit)| rays.depth(ray, hit.t)).fold(f64::INFINITY, f64::min);
            let is_sky = hits.iter().all(|hit| !hit.is_some());
            let at_edge = hits.iter().any(|hit| hit.is_some() != hits[0].is_some() || hit.prim != hits[0].prim);
            if !at_edge && !is_sky {
                assert!(!accel.anything_nearer(&world, &beam, nearest), "{x} {y}");
                assert!(accel.anything_nearer(&world, &beam, f64::INFINITY), "{x} {y}");
            }
            n_empty += usize::from(is_sky && !accel.anything_nearer(&world, &beam, f64::INFINITY));
        }
    }
    assert!(n_empty > 100, "{n_empty}");
}
