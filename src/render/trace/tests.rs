//! Trees of rays in chunks.

use std::sync::atomic::AtomicBool;

use super::*;
use crate::accel::AccelKind;
use crate::world::{Material, MaterialId, ObjectId};

/// Three touching glass spheres, one inside of another, over a mirror that is not quite one; a light, a blue sky.
fn glasses() -> World {
    let mut world = World { background: DVec3::new(0.3, 0.5, 0.9), two_sided: true, ..World::default() };
    let glass = Material { k_a: 0.01, k_d: 0.1, k_s: 0.2, k_t: 0.7, shininess: 50.0, ..Material::default() };
    let glass = world.materials.add(&glass);
    let floor = world.materials.add(&Material { diffuse: DVec3::new(0.9, 0.4, 0.2), k_s: 0.3, ..Material::default() });
    let mut add = |center: DVec3, radius: f64, material: MaterialId| {
        world.spheres.add(center, radius, material, ObjectId(0));
    };
    add(DVec3::new(-1.0, 0.0, -4.0), 1.0, glass);
    add(DVec3::new(1.0, 0.0, -4.0), 1.0, glass);
    add(DVec3::new(1.0, 0.1, -4.0), 0.5, glass);
    add(DVec3::new(0.0, -101.0, -4.0), 100.0, floor);
    world.lights.add(DVec3::new(2.0, 5.0, 1.0), DVec3::splat(0.8));
    world
}

fn scene<'a>(world: &'a World, accel: &'a Accel, chunk_rays: usize, max_depth: u32) -> Scene<'a> {
    let shading = Shading::new(world, false, false, accel.isa());
    Scene {
        world,
        accel,
        shading,
        max_depth,
        clamp: false,
        parts: PartsAsked::default(),
        cutoff: Cutoff::default(),
        signatures: false,
        chunk_rays,
    }
}

/// Rays over a window of the three spheres.
fn camera_rays(n: usize) -> impl Iterator<Item = Ray> {
    let at = move |i: usize| (i as f64 + 0.5) / n as f64 - 0.5;
    (0..n * n).map(move |i| Ray::new(DVec3::ZERO, DVec3::new(1.2 * at(i % n), 0.7 * at(i / n), -1.0).normalize()))
}

/// The bits of what the rays see, and the counts.
fn seen(wavefront: &mut Wavefront, scene: &Scene, n: usize) -> (Vec<[u64; 3]>, RayCounts) {
    wavefront.begin().extend(camera_rays(n));
    let level = wavefront.trace(scene, &AtomicBool::new(false)).unwrap();
    let bits = level.radiance.iter().map(|radiance| radiance.to_array().map(f64::to_bits)).collect();
    (bits, std::mem::take(&mut wavefront.counts))
}

#[test]
fn the_size_of_chunks_does_not_show_in_the_bits_of_trees_of_depth_12() {
    let world = glasses();
    let accel = Accel::build(&world, AccelKind::Bvh);
    let mut wavefront = Wavefront::default();
    let (expected, counts) = seen(&mut wavefront, &scene(&world, &accel, usize::MAX, 12), 9);
    assert!(counts.reflection > 3000 && counts.refraction > 3000, "{counts:?}");
    assert!(counts.shadow > 0 && counts.camera == 81 && counts.camera_hit > 20, "{counts:?}");
    // One and the same worker, so that leftovers of other chunks would show.
    for chunk_rays in [1, 2, 7, 64, 1000, BATCH_RAYS] {
        let (found, found_counts) = seen(&mut wavefront, &scene(&world, &accel, chunk_rays, 12), 9);
        assert!(found == expected, "chunks of {chunk_rays}");
        assert_eq!(found_counts, counts, "chunks of {chunk_rays}");
    }
}

#[test]
fn rays_that_wait_are_at_most_twice_a_chunk_at_every_depth() {
    let world = glasses();
    let accel = Accel::build(&world, AccelKind::Bvh);
    let mut wavefront = Wavefront::default();
    seen(&mut wavefront, &scene(&world, &accel, 16, 12), 4);
    assert_eq!(wavefront.levels.len(), 12);
    for (level, bounces) in wavefront.levels.iter().zip(&wavefront.bounces) {
        // Columns change places, and have room for at most twice of what they needed.
        let largest = level.rays.capacity().max(level.hits.capacity()).max(bounces.rays.capacity());
        assert!(largest <= 2 * 2 * 16, "{largest}");
    }
}

#[test]
fn a_tree_that_would_take_for_ever_is_left_when_a_stop_is_asked_for() {
    let world = glasses();
    let accel = Accel::build(&world, AccelKind::Bvh);
    let mut wavefront = Wavefront::default();
    wavefront.begin().extend(camera_rays(9));
    let stopped = wavefront.trace(&scene(&world, &accel, 64, 1000), &AtomicBool::new(true));
    assert_eq!(stopped.map(|_| ()), Err(Stopped));
}
