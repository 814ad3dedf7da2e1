//! One answer, whatever the mode, the instruction set, the preset or the number of rays in a batch.

/// Building worlds.
mod world_kit {
    pub mod quadric;
}

use flatray::accel::{Accel, AccelKind, Mode, Preset};
use flatray::measure::generate::terrain;
use flatray::measure::stress::mesh::{Mesh, bumpy_block, lat_long};
use flatray::measure::stress::random::Random;
use flatray::simd::Isa;
use flatray::world::{Hit, MaterialId, ObjectId, Ray, World};
use glam::{DAffine3, DMat3, DQuat, DVec3, Vec3};
use world_kit::quadric::quadric;

/// How many times as many rays are asked for.
fn factor() -> u64 {
    std::env::var("FLATRAY_TEST_FACTOR").ok().and_then(|text| text.parse().ok()).unwrap_or(1)
}

/// A world of one mesh.
fn of_mesh(mesh: &Mesh) -> World {
    let mut world = World::default();
    world.add_mesh(mesh.input()).unwrap();
    world
}

/// What so many rays at a time are answered. Packets are tried more seldom where the ones before them in a batch had better not
/// been: each by itself, all are.
fn answers(accel: &Accel, world: &World, rays: &[Ray], at_a_time: usize) -> (Vec<Hit>, Vec<bool>) {
    let (mut hits, mut occluded) = (vec![Hit::MISS; rays.len()], vec![false; rays.len()]);
    for (i, rays) in rays.chunks(at_a_time).enumerate() {
        let range = i * at_a_time..i * at_a_time + rays.len();
        accel.closest_hit(world, rays, &mut hits[range.clone()]);
        accel.occluded(world, rays, &mut occluded[range]);
    }
    (hits, occluded)
}

/// Compares every way of asking with the full scan.
fn all_agree(name: &str, world: &World, rays: &[Ray]) {
    let (scanned, occluded) = answers(&Accel::build(world, AccelKind::Linear), world, rays, usize::MAX);
    assert!(occluded.iter().zip(&scanned).all(|(&occluded, hit)| occluded == hit.is_some()), "{name}");
    for preset in Preset::ALL {
        let accel = Accel::build_with(world, AccelKind::Bvh, preset);
        for mode in Mode::ALL {
            for isa in Isa::ALL.into_iter().filter(|isa| isa.is_available()) {
                let accel = accel.clone().with_mode(mode).with_isa(isa);
                let at_a_time = if mode == Mode::Packet { &[16, usize::MAX][..] } else { &[usize::MAX] };
                for &at_a_time in at_a_time {
                    let (hits, any) = answers(&accel, world, rays, at_a_time);
                    for (i, (hit, expected)) in hits.iter().zip(&scanned).enumerate() {
                        let what = format!("{name}, {preset:?}, {mode:?}, {isa:?}: ray {i}, {:?}", rays[i]);
                        assert!(hit.same_bits(expected), "{what}: {hit:?}, full scan {expected:?}");
                        assert_eq!(hit.t_rest.to_bits(), expected.t_rest.to_bits(), "{what}");
                        assert_eq!(any[i], occluded[i], "{what}");
                    }
                }
            }
        }
    }
}

/// Packets from one origin at vertices, edges and faces that lie beside each other.
fn aimed(world: &World, n_packets: u64, seed: u64) -> Vec<Ray> {
    let tables = &world.triangles;
    let bounds = world.bounds().unwrap();
    let size = bounds.extent().max_element();
    let mut rays = Vec::new();
    for packet in 0..n_packets {
        let mut random = Random::new(seed, "modes", packet);
        let origin = bounds.center() + size * random.uniform(0.2, 3.0) * random.direction();
        let first = random.below(tables.len() as u64 - 8) as usize;
        // The fewer they are, the narrower is the packet.
        let n_beside = [1, 2, 8][packet as usize % 3];
        for i in 0..16 {
            let corners = tables.corners(first + i % n_beside).map(|corner| corner.as_dvec3());
            let corner = random.below(3) as usize;
            let along = [0.0, 0.5, random.unit()][random.below(3) as usize];
            let target = corners[corner] + along * (corners[(corner + 1) % 3] - corners[corner]);
            let inwards = [0.0, 1e-9, 0.2][random.below(3) as usize];
            let target = target + inwards * (corners[(corner + 2) % 3] - target);
            let t_max = [f64::INFINITY, 1.0, 0.999][random.below(3) as usize];
            let t_min = [0.0, 0.0, 0.5, 1.0][random.below(4) as usize];
            let ray = Ray { origin, direction: target - origin, t_min, t_max };
            rays.push(if ray.t_min < ray.t_max { ray } else { Ray::new(origin, target - origin) });
        }
    }
    rays
}

/// The same rays turned around: packets that start at vertices, edges and faces and end in one point, or near it.
fn turned(rays: &[Ray], precision: fn(DVec3) -> DVec3) -> Vec<Ray> {
    let turn = |(i, ray): (usize, &Ray)| {
        let origin = precision(ray.origin + ray.direction);
        let t_max = [1.0, 1.0 - 1.0 / 65536.0, 0.3, 0.05, f64::INFINITY][i / 16 % 5];
        let t_min = [0.0, 0.0, 1e-30, 0.25][i / 3 % 4];
        Ray { origin, direction: precision(ray.origin - origin), t_min, t_max }
    };
    rays.iter().enumerate().map(turn).collect()
}

/// Long beams through a crowd of small triangles: what the tree cuts.
fn beams() -> World {
    let mut random = Random::new(11, "beams", 0);
    let mut point = |size: f64| (size * DVec3::from_array([0; 3].map(|_| random.uniform(-1.0, 1.0)))).as_vec3();
    let mut positions = Vec::new();
    for i in 0..2000 {
        let at = point(10.0);
        let (along, across) = if i % 4 == 0 { (point(12.0), point(0.05)) } else { (point(0.1), point(0.1)) };
        // Every other beam runs along an axis.
        let along = if i % 8 == 0 { Vec3::new(along.x, 0.0, 0.0) } else { along };
        positions.extend([at, at + along, at + across]);
    }
    let triangles = (0..2000).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    World::from_triangles(positions, triangles).unwrap()
}

#[test]
fn triangles_that_the_tree_cuts_are_hit_as_if_they_were_whole() {
    let world = beams();
    let bytes = |preset| Accel::build_with(&world, AccelKind::Bvh, preset).stats().memory_bytes;
    assert!(bytes(Preset::High) > bytes(Preset::Fast) * 11 / 10, "nothing was cut");
    let factor = factor();
    all_agree("beams", &world, &aimed(&world, 60 * factor, 3));
    // The same beams twice: the first of two is hit.
    let twice = |column: &[Vec3]| [column, column].concat();
    let n = world.triangles.positions.len() as u32;
    let rows = world.triangles.vertices.iter();
    let copies = rows.clone().copied().chain(rows.map(|corners| corners.map(|corner| corner + n)));
    let doubled = World::from_triangles(twice(&world.triangles.positions), copies.collect()).unwrap();
    all_agree("beams twice", &doubled, &aimed(&doubled, 20 * factor, 4));
}

#[test]
fn aimed_packets_are_answered_like_the_full_scan() {
    let factor = factor();
    for (name, world) in [
        ("sphere", of_mesh(&lat_long(24, 12))),
        ("block", of_mesh(&bumpy_block(6))),
        ("block far off", of_mesh(&bumpy_block(6).placed(1.0, DVec3::new(148_376.0, 1234.0, -223_423.0)))),
        ("tiny sphere", of_mesh(&lat_long(24, 12).placed(1e-12, DVec3::ZERO))),
        ("huge sphere", of_mesh(&lat_long(24, 12).placed(1e18, DVec3::ZERO))),
    ] {
        all_agree(name, &world, &aimed(&world, 40 * factor, 7));
    }
}

#[test]
fn packets_that_end_in_one_point_are_answered_like_the_full_scan() {
    let factor = factor();
    for (name, world) in [
        ("beams", beams()),
        ("sphere", of_mesh(&lat_long(24, 12))),
        ("block far off", of_mesh(&bumpy_block(6).placed(1.0, DVec3::new(148_376.0, 1234.0, -223_423.0)))),
        ("tiny sphere", of_mesh(&lat_long(24, 12).placed(1e-12, DVec3::ZERO))),
        ("huge sphere", of_mesh(&lat_long(24, 12).placed(1e18, DVec3::ZERO))),
    ] {
        let rays = aimed(&world, 40 * factor, 13);
        all_agree(name, &world, &turned(&rays, |p| p));
        // Ends that f32 rounds lie farther apart.
        let rounded = turned(&rays, |p| p.as_vec3().as_dvec3());
        all_agree(name, &world, &rounded);
        // And as far apart as a packet may have them: 2⁻¹⁸ of a ray's length.
        let mut apart = turned(&rays, |p| p);
        for (i, ray) in apart.iter_mut().enumerate() {
            let by = ray.direction.abs().max_element() / f64::from(1 << 19);
            ray.direction += by * DVec3::new([1.0, -1.0][i % 2], [1.0, -1.0, 0.0][i % 3], [0.5, -1.0][i / 4 % 2]);
        }
        all_agree(name, &world, &apart);
        // One that does not end there, or nowhere.
        let mut spoilt = rounded;
        for (packet, rays) in spoilt.chunks_mut(16).enumerate() {
            let ray = &mut rays[1 + packet * 7 % 14];
            match packet % 6 {
                0 => ray.origin.y = f64::NAN,
                1 => ray.origin.x = f64::INFINITY,
                2 => ray.direction.z = f64::NAN,
                3 => ray.direction *= 1.0 + 1e-5,
                4 => ray.t_max = 1.5,
                _ => ray.t_min = -0.5,
            }
        }
        all_agree(name, &world, &spoilt);
    }
}

/// Spheres that overlap, touch, are equal, and are of any size, among triangles.
fn spheres(scale: f64, offset: DVec3) -> World {
    let mut world = of_mesh(&bumpy_block(4).placed(scale, offset));
    let mut random = Random::new(19, "spheres", 0);
    let mut add = |at: DVec3, radius: f64| {
        world.spheres.add(offset + scale * at, scale * radius, MaterialId(0), ObjectId(0));
    };
    for i in 0..120 {
        let at = 2.0 * random.direction();
        let radius = [0.3, 0.3, 0.01, 1e-6, random.uniform(0.1, 0.5)][i % 5];
        add(at, radius);
        match i % 10 {
            // The same again, one that touches it, and one about it.
            0 => add(at, radius),
            1 => add(at + 2.0 * radius * DVec3::X, radius),
            2 => add(at, radius * (1.0 + 1e-12)),
            _ => {}
        }
    }
    world
}

/// Packets from one origin at spheres that lie beside each other: at their silhouettes, through their middles and past them.
fn aimed_at_spheres(world: &World, n_packets: u64, seed: u64) -> Vec<Ray> {
    let (tables, bounds) = (&world.spheres, world.bounds().unwrap());
    let size = bounds.extent().max_element();
    let mut rays = Vec::new();
    for packet in 0..n_packets {
        let mut random = Random::new(seed, "spheres", packet);
        let first = random.below(tables.len() as u64 - 4) as usize;
        let sphere = |i: usize| (tables.centers[first + i], tables.radii[first + i]);
        // From outside, from far, from within one and from its surface.
        let (center, radius) = sphere(0);
        let from = random.below(4) as usize;
        let origin = center + [2.0 * size, 100.0 * size, 0.5 * radius, radius][from] * random.direction();
        let n_beside = [1, 2, 4][packet as usize % 3];
        for i in 0..16 {
            // From far at the same spheres, from near at others.
            let (center, radius) = sphere(if from < 2 { i % n_beside } else { 1 + i % n_beside % 3 });
            let along = (center - origin).normalize_or(DVec3::X);
            let across = along.cross(random.direction()).normalize_or(along.any_orthonormal_vector());
            // From near only what is about their middles is narrow.
            let share = if from < 2 { 1.0 } else { [1.0, 0.1, 0.02][packet as usize / 3 % 3] };
            let at = share * [0.0, 1.0, 1.0 + 1e-12, 0.5, 1.2, -1.0][random.below(6) as usize];
            // A tangent meets the silhouette in front of the centre.
            let d2 = (center - origin).length_squared();
            let on = center - along * (at * at * radius * radius / d2.sqrt());
            let off = at * radius * (1.0 - (radius * radius / d2).min(1.0)).sqrt();
            let direction = on + off * across - origin;
            let t_max = [f64::INFINITY, 1.0, 0.999][random.below(3) as usize];
            let t_min = [0.0, 0.0, 0.5, 0.9][random.below(4) as usize];
            rays.push(Ray { origin, direction, t_min, t_max });
        }
    }
    rays
}

#[test]
fn packets_at_spheres_are_answered_like_the_full_scan() {
    let factor = factor();
    for (name, world) in [
        ("spheres", spheres(1.0, DVec3::ZERO)),
        ("spheres far off", spheres(1.0, DVec3::new(148_376.0, 1234.0, -223_423.0))),
        ("tiny spheres", spheres(1e-12, DVec3::ZERO)),
        ("huge spheres", spheres(1e18, DVec3::ZERO)),
    ] {
        let rays = aimed_at_spheres(&world, 120 * factor, 23);
        all_agree(name, &world, &rays);
        all_agree(name, &world, &turned(&rays, |p| p));
        all_agree(name, &world, &turned(&rays, |p| p.as_vec3().as_dvec3()));
        all_agree(name, &world, &aimed(&world, 20 * factor, 29));
    }
}

/// Packets whose rays mostly hit the same triangle or sphere, of which one row or several in a packet hit something else; about
/// directions of which two components, or all three, are about equally long, and from origins with zeros of both signs.
#[test]
fn packets_that_hit_the_same_are_answered_like_the_full_scan() {
    let corner = |x: f64, y: f64, z: f64| DVec3::new(x, y, z).as_vec3();
    let positions = vec![
        // A triangle across all that is seen, a needle and a small one before it.
        corner(-40.0, 33.0, 7.0),
        corner(41.0, 29.0, -6.0),
        corner(1.0, -37.0, 30.1),
        corner(-3.0, 2.0, 8.0),
        corner(9.0, 1.9, 9.1),
        corner(-3.0, 2.01, 8.1),
        corner(0.1, 0.2, 5.0),
        corner(0.3, 0.2, 5.1),
        corner(0.2, 0.4, 5.2),
    ];
    let mut world = World::from_triangles(positions, vec![[0, 1, 2], [3, 4, 5], [6, 7, 8]]).unwrap();
    world.spheres.add(DVec3::new(6.0, 6.0, 6.1), 2.0, MaterialId(0), ObjectId(0));
    world.spheres.add(DVec3::new(-60.0, 0.0, 0.0), 50.0, MaterialId(0), ObjectId(0));
    let mut rays = Vec::new();
    let ways =
        [[1.0, 1.0, 1.0], [1.0, 0.97, 0.3], [0.2, 1.0, 1.01], [-1.0, 0.1, 0.98], [0.0, 0.01, 1.0], [0.1, 0.1, 1.0]];
    for packet in 0..1200 * factor() {
        let mut random = Random::new(41, "same", packet);
        let way = DVec3::from_array(ways[packet as usize % ways.len()]);
        let off = [DVec3::ZERO, DVec3::new(0.0, -0.5, 1.0), 3.0 * random.direction()][random.below(3) as usize];
        let step = [0.03, 0.004, 1e-6][random.below(3) as usize];
        for i in 0..16 {
            // Both zeros are the same place.
            let origin = if i % 3 == 1 && off.x == 0.0 { DVec3::new(-0.0, off.y, off.z) } else { off };
            let at = step * DVec3::new(f64::from(i % 4) - 1.5, f64::from(i / 4) - 1.5, random.uniform(-1.0, 1.0));
            rays.push(Ray::new(origin, way + at));
        }
    }
    let (hits, _) = answers(&Accel::build(&world, AccelKind::Linear), &world, &rays, usize::MAX);
    let is_same = |hits: &&[Hit]| hits.iter().filter(|hit| hit.is_some() && hit.prim == hits[5].prim).count() > 8;
    let n_same = hits.chunks(16).filter(is_same).count();
    assert!(n_same > hits.len() / 16 / 2, "{n_same} of {}", hits.len() / 16);
    all_agree("same", &world, &rays);
}

/// The same spheres, some of them once more as quadrics, with ellipsoids about others, and with or without a plane beside all.
fn spheres_and_quadrics(has_plane: bool) -> World {
    let mut world = spheres(1.0, DVec3::ZERO);
    for i in (0..world.spheres.len()).step_by(3) {
        let (c, r) = (world.spheres.centers[i], world.spheres.radii[i]);
        let squares = [[1.0, 1.0, 1.0], [1.0, 4.0, 1.0], [0.25, 1.0, 1.0]][i % 9 / 3];
        let s = DVec3::from_array(squares);
        let matrix = quadric(squares, (-2.0 * s * c).to_array(), (s * c * c).element_sum() - r * r);
        world.quadrics.add(matrix, MaterialId(0), ObjectId(0));
    }
    if has_plane {
        world.quadrics.add(quadric([0.0; 3], [0.1, 1.0, 0.2], 1.5), MaterialId(0), ObjectId(0));
    }
    world
}

#[test]
fn packets_at_quadrics_are_answered_like_the_full_scan() {
    let factor = factor();
    for has_plane in [false, true] {
        let world = spheres_and_quadrics(has_plane);
        let stats = Accel::build(&world, AccelKind::Bvh).stats();
        assert_eq!(stats.n_unbounded, usize::from(has_plane));
        let rays = aimed_at_spheres(&world, 60 * factor, 31);
        all_agree("quadrics", &world, &rays);
        all_agree("quadrics", &world, &turned(&rays, |p| p));
        all_agree("quadrics", &world, &aimed(&world, 20 * factor, 37));
    }
}

#[test]
fn rays_that_hit_nothing_do_not_disturb_their_packet() {
    let world = of_mesh(&bumpy_block(6));
    let mut rays = aimed(&world, 40, 11);
    for (packet, rays) in rays.chunks_mut(16).enumerate() {
        let ray = &mut rays[packet * 7 % 16];
        match packet % 5 {
            0 => ray.direction = DVec3::ZERO,
            1 => ray.direction.y = f64::NAN,
            2 => ray.direction.x = f64::INFINITY,
            3 => (ray.t_min, ray.t_max) = (1.0, 0.5),
            _ => ray.t_min = -1.0,
        }
    }
    all_agree("spoilt", &world, &rays);
}

#[test]
fn camera_rays_of_a_terrain_are_answered_like_the_full_scan() {
    let (positions, triangles) = terrain(40);
    let world = World::from_triangles(positions, triangles).unwrap();
    let origin = DVec3::new(0.1, 0.9, 1.7);
    let rays: Vec<Ray> = (0..1040)
        .map(|i| {
            let (block, pixel) = (i / 16, i % 16);
            let (x, y) = (block % 8 * 4 + pixel % 4, block / 8 * 4 + pixel / 4);
            Ray::new(origin, DVec3::new(f64::from(x) * 0.03 - 0.5, f64::from(y) * 0.03 - 1.0, -1.0))
        })
        .collect();
    all_agree("terrain", &world, &rays);
}

/// Directions of any length and origins at any distance, beyond what f32 holds too, with components that are next to zero
/// or zero, along faces of the tree's boxes and beside them.
#[test]
fn rays_of_any_length_from_anywhere_are_answered_like_the_full_scan() {
    let mut mixed = World::default();
    mixed.add_mesh(bumpy_block(6).input()).unwrap();
    let triangles = mixed.clone();
    for i in 0..20 {
        mixed.spheres.add(DVec3::new(f64::from(i) * 0.2 - 2.0, 0.4, 0.1), 0.15, MaterialId(0), ObjectId(0));
    }
    let far = [0.0, 1e8, 1e20, 1e31, 1e200];
    let lengths = [1e-300, 1e-30, 1e-19, 1e-17, 1e-12, 1.0, 1e12, 1e24, 1e30, 1e300];
    let slants = [0.0, -0.0, 1e-300, -1e-45, 1e-20, -1e-13, 1e-12, 1e-9];
    let mut rays = Vec::new();
    for i in 0..500 {
        let mut random = Random::new(17, "lengths", i);
        let corners = triangles.triangles.corners(random.below(triangles.triangles.len() as u64) as usize);
        let target = corners[random.below(3) as usize].as_dvec3();
        let mut direction = random.direction();
        let axis = random.below(3) as usize;
        for other in [(axis + 1) % 3, (axis + 2) % 3] {
            if random.below(2) == 0 {
                direction[other] = slants[random.below(8) as usize];
            }
        }
        direction[axis] = direction[axis].signum();
        let length = lengths[random.below(10) as usize];
        let distance = [1.0, 3.0, far[random.below(5) as usize]][random.below(3) as usize];
        let ray = Ray::new(target - distance * direction, length * direction);
        rays.push(if i % 3 == 0 { ray.until(distance / length) } else { ray });
    }
    all_agree("triangles", &triangles, &rays);
    all_agree("with spheres", &mixed, &rays);
}

#[test]
fn mixed_scenes_and_small_batches_are_answered_like_the_full_scan() {
    let mut world = World::from_triangles(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]]).unwrap();
    for i in 0..40 {
        let at = DVec3::new(f64::from(i % 7) * 0.3, f64::from(i / 7) * 0.3, -1.0);
        world.spheres.add(at, 0.1 + f64::from(i % 3) * 0.1, MaterialId(0), ObjectId(0));
    }
    let rays: Vec<Ray> = (0..100)
        .map(|i| {
            let mut random = Random::new(3, "mixed", i);
            let target = DVec3::new(random.uniform(0.0, 2.0), random.uniform(0.0, 2.0), -1.0);
            // Tangents of the first sphere among them.
            let target = if i % 4 == 0 { DVec3::new(0.1, 0.0, -1.0) } else { target };
            Ray::new(DVec3::new(0.1, 0.0, 5.0), target - DVec3::new(0.1, 0.0, 5.0))
        })
        .collect();
    for n_rays in [0, 1, 15, 16, 17, 33, 100] {
        all_agree("mixed", &world, &rays[..n_rays]);
    }
    let triangle = World::from_triangles(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]]).unwrap();
    for world in [triangle, World::default()] {
        all_agree("one triangle or nothing", &world, &rays);
    }
}

/// A transform that turns, stretches, mirrors and moves.
fn transform(random: &mut Random, spread: f64) -> DAffine3 {
    let turn = DMat3::from_quat(DQuat::from_axis_angle(random.direction(), random.uniform(-3.0, 3.0)));
    let stretch = DVec3::new(1.0, random.log_uniform(0.05, 20.0), random.sign() * random.log_uniform(0.3, 3.0));
    let turned = DMat3::from_quat(DQuat::from_axis_angle(random.direction(), random.uniform(-3.0, 3.0)));
    let matrix3 = turn * DMat3::from_diagonal(random.log_uniform(0.01, 2.0) * stretch) * turned;
    DAffine3 { matrix3, translation: spread * random.in_cube() }
}

/// Three meshes placed at random among spheres and triangles of the world's own.
fn placements(n: u64, spread: f64, seed: u64) -> World {
    let mut world = World::default();
    world.add_mesh(bumpy_block(2).placed(0.1 * spread, DVec3::ZERO).input()).unwrap();
    let mut prototypes = Vec::new();
    for mesh in [lat_long(12, 6), bumpy_block(3), lat_long(24, 12).placed(1e-3, DVec3::new(1.0, -3.0, 2.0))] {
        let first = world.triangles.len();
        world.add_mesh(mesh.input()).unwrap();
        prototypes.push(world.add_prototype(first));
        world.add_mesh(bumpy_block(1).placed(0.05 * spread, 0.5 * spread * DVec3::X).input()).unwrap();
        world.spheres.add(
            spread * DVec3::new(0.1, 0.2, 0.3 * first as f64 / 100.0),
            0.1 * spread,
            MaterialId(0),
            ObjectId(0),
        );
    }
    for i in 0..n {
        let mut random = Random::new(seed, "placements", i);
        let prototype = prototypes[random.below(3) as usize];
        world.add_instance(prototype, transform(&mut random, spread), None, ObjectId(i as u32)).unwrap();
        // Twice in one place: ties go to the first.
        if i % 5 == 0 {
            let again = world.instances.world_from_object[world.instances.len() - 1];
            world.add_instance(prototype, again, None, ObjectId(0)).unwrap();
        }
    }
    world
}

/// Rays from near and very far at corners and edges of placed triangles.
fn aimed_at_placements(world: &World, n: u64, seed: u64) -> Vec<Ray> {
    let size = world.bounds().unwrap().extent().max_element();
    let ray = |i: u64| {
        let mut random = Random::new(seed, "aimed at placements", i);
        let row = random.below(world.instances.len() as u64) as usize;
        let rows = world.prototypes.rows(world.instances.prototypes[row]);
        let corners = world.triangles.corners(rows.start + random.below(rows.len() as u64) as usize);
        let to_world = world.instances.world_from_object[row];
        let corners = corners.map(|corner| to_world.transform_point3(corner.as_dvec3()));
        let along = [0.0, 0.5, random.unit()][random.below(3) as usize];
        let target = corners[0] + along * (corners[1] - corners[0]);
        let target = target + [0.0, 0.0, 1e-9, 0.2][random.below(4) as usize] * (corners[2] - target);
        let origin = target + size * random.log_uniform(1e-3, 1e7) * random.direction();
        let origin = if random.chance(0.2) { DVec3::new(origin.x, target.y, target.z) } else { origin };
        let t_max = [f64::INFINITY, 1.0, 1.0_f64.next_up()][random.below(3) as usize];
        Ray::new(origin, target - origin).until(t_max)
    };
    (0..n).map(ray).collect()
}

#[test]
fn placements_are_answered_like_the_full_scan() {
    let factor = factor();
    for (spread, seed) in [(3.0, 1), (1e6, 2), (1e-6, 3)] {
        let world = placements(10, spread, seed);
        let rays = aimed_at_placements(&world, 200 * factor, seed);
        let accel = Accel::build(&world, AccelKind::Bvh);
        let (hits, _) = answers(&accel, &world, &rays, usize::MAX);
        let n_placed = hits.iter().filter(|hit| hit.instance.row().is_some()).count();
        assert!(n_placed > rays.len() / 4, "{n_placed} of {} rays hit a placement", rays.len());
        all_agree("placements", &world, &rays);
    }
}
