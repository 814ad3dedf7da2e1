//! One answer, whatever the mode, the instruction set, the preset or the number of rays in a batch.

use flatray::accel::{Accel, AccelKind, Mode, Preset};
use flatray::measure::generate::terrain;
use flatray::measure::stress::mesh::{bumpy_block, lat_long};
use flatray::measure::stress::random::Random;
use flatray::simd::Isa;
use flatray::world::{Hit, MaterialId, ObjectId, Ray, World};
use glam::{DVec3, Vec3};

fn answers(accel: &Accel, world: &World, rays: &[Ray]) -> (Vec<Hit>, Vec<bool>) {
    let (mut hits, mut occluded) = (vec![Hit::MISS; rays.len()], vec![false; rays.len()]);
    accel.closest_hit(world, rays, &mut hits);
    accel.occluded(world, rays, &mut occluded);
    (hits, occluded)
}

/// Compares every way of asking with the full scan.
fn all_agree(name: &str, world: &World, rays: &[Ray]) {
    let (scanned, occluded) = answers(&Accel::build(world, AccelKind::Linear), world, rays);
    assert!(occluded.iter().zip(&scanned).all(|(&occluded, hit)| occluded == hit.is_some()), "{name}");
    for preset in Preset::ALL {
        let accel = Accel::build_with(world, AccelKind::Bvh, preset);
        for mode in Mode::ALL {
            for isa in Isa::ALL.into_iter().filter(|isa| isa.is_available()) {
                let accel = accel.clone().with_mode(mode).with_isa(isa);
                let (hits, any) = answers(&accel, world, rays);
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
        for i in 0..16 {
            let corners = tables.corners(first + i % 8).map(|corner| corner.as_dvec3());
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

#[test]
fn aimed_packets_are_answered_like_the_full_scan() {
    let factor: u64 = std::env::var("FLATRAY_TEST_FACTOR").ok().and_then(|text| text.parse().ok()).unwrap_or(1);
    let mesh = |mesh: flatray::measure::stress::mesh::Mesh| {
        let mut world = World::default();
        world.add_mesh(mesh.input()).unwrap();
        world
    };
    for (name, world) in [
        ("sphere", mesh(lat_long(24, 12))),
        ("block", mesh(bumpy_block(6))),
        ("block far off", mesh(bumpy_block(6).placed(1.0, DVec3::new(148_376.0, 1234.0, -223_423.0)))),
        ("tiny sphere", mesh(lat_long(24, 12).placed(1e-12, DVec3::ZERO))),
        ("huge sphere", mesh(lat_long(24, 12).placed(1e18, DVec3::ZERO))),
    ] {
        all_agree(name, &world, &aimed(&world, 40 * factor, 7));
    }
}

#[test]
fn rays_that_hit_nothing_do_not_disturb_their_packet() {
    let mut world = World::default();
    world.add_mesh(bumpy_block(6).input()).unwrap();
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
