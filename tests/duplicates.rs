//! Input that chains naive builders: identical triangles, and different ones that share one box.

use flatray::accel::{Accel, AccelKind, Preset};
use flatray::measure::generate::hash_unit;
use flatray::world::{Hit, MaterialId, ObjectId, PrimKind, PrimRef, Ray, World};
use glam::{DVec3, Vec3};

const N: u32 = 100_000;

fn world(corners: impl Fn(u64) -> [Vec3; 3]) -> World {
    let positions: Vec<Vec3> = (0..u64::from(N)).flat_map(corners).collect();
    let triangles = (0..N).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    World::from_triangles(positions, triangles).unwrap()
}

/// Every other ray is aimed at the diagonal of the unit cube, the others pass around it.
fn rays(n: u64) -> Vec<Ray> {
    (0..n)
        .map(|i| {
            let unit = |k: u64| hash_unit(i * 8 + k);
            let origin = DVec3::new(4.0 * unit(0) - 1.5, 4.0 * unit(1) - 1.5, 4.0);
            let near = DVec3::splat(unit(2)) + 0.01 * DVec3::new(unit(3), unit(4), unit(5));
            let around = DVec3::new(4.0 * unit(2) - 1.5, 4.0 * unit(3) - 1.5, 0.5);
            Ray::new(origin, if i % 2 == 0 { near } else { around } - origin)
        })
        .collect()
}

/// A sliver along the diagonal of the unit cube; all have the cube for their box.
fn sliver(i: u64) -> [Vec3; 3] {
    let along = 0.1 + 0.8 * hash_unit(2 * i) as f32;
    let off = 0.05 * hash_unit(2 * i + 1) as f32;
    [Vec3::ZERO, Vec3::ONE, Vec3::new(along + off, along, along - off)]
}

fn assert_equals_full_scan(world: &World, accel: &Accel, rays: &[Ray]) {
    let linear = Accel::build(world, AccelKind::Linear);
    let (mut fast, mut slow) = (vec![Hit::MISS; rays.len()], vec![Hit::MISS; rays.len()]);
    accel.closest_hit(world, rays, &mut fast);
    linear.closest_hit(world, rays, &mut slow);
    assert_eq!(fast, slow);
    assert!(fast.iter().any(Hit::is_some) && !fast.iter().all(Hit::is_some));
    let (mut fast, mut slow) = (vec![false; rays.len()], vec![false; rays.len()]);
    accel.occluded(world, rays, &mut fast);
    linear.occluded(world, rays, &mut slow);
    assert_eq!(fast, slow);
}

#[test]
fn identical_triangles_cost_what_one_costs_and_the_first_is_hit() {
    let world = world(|_| [Vec3::ZERO, Vec3::X, Vec3::Y]);
    let accel = Accel::build(&world, AccelKind::Bvh);
    let stats = accel.stats();
    assert_eq!((stats.n_nodes, stats.n_leaves, stats.depth), (1, 1, 1));
    let ray = Ray::new(DVec3::new(0.25, 0.25, 1.0), -DVec3::Z);
    let mut hits = [Hit::MISS];
    accel.closest_hit(&world, &[ray], &mut hits);
    assert_eq!(hits[0].prim, PrimRef::new(PrimKind::Triangle, 0));
    assert_equals_full_scan(&world, &accel, &rays(40));
}

#[test]
fn slivers_that_share_a_box_make_a_shallow_tree_and_answer_like_the_full_scan() {
    let world = world(sliver);
    let accel = Accel::build(&world, AccelKind::Bvh);
    let stats = accel.stats();
    // 32 slices over 12,500 leaves of eight: two levels, and five below. The root is one more.
    assert!(stats.depth <= 8, "{stats:?}");
    assert!(stats.memory_bytes < 200 * N as usize, "{stats:?}");
    assert_equals_full_scan(&world, &accel, &rays(40));
}

#[test]
fn trees_are_shallow_at_every_scale() {
    let unit = |k: u64| hash_unit(k) as f32;
    for scale in [1e-36f32, 1e-25, 1e-12, 1.0, 1e12, 1e25, 1e37] {
        let corners = |i: u64| {
            let at = Vec3::new(unit(16 * i), unit(16 * i + 1), unit(16 * i + 2));
            let edge = |k: u64| 0.05 * Vec3::new(unit(16 * i + k), unit(16 * i + k + 1), unit(16 * i + k + 2));
            [scale * at, scale * (at + edge(3)), scale * (at + edge(6))]
        };
        let positions: Vec<Vec3> = (0..3000).flat_map(corners).collect();
        let triangles = (0..3000).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let world = World::from_triangles(positions, triangles).unwrap();
        let stats = Accel::build(&world, AccelKind::Bvh).stats();
        assert!(stats.depth <= 8, "at {scale:e}: {stats:?}");
    }
}

#[test]
fn copies_of_spheres_and_quadrics_stay_and_the_lowest_id_wins() {
    let mut world = World::default();
    let material = world.materials.add(&Default::default());
    for object in 0..20 {
        world.spheres.add(DVec3::ZERO, 1.0, material, ObjectId(object));
    }
    let (positions, triangles) = (vec![Vec3::ONE, -Vec3::ONE, Vec3::new(1.0, -1.0, 0.0)], vec![[0, 1, 2]; 20]);
    let input = flatray::world::MeshInput {
        positions,
        triangles,
        material: MaterialId(0),
        object: ObjectId(99),
        ..Default::default()
    };
    world.add_mesh(input).unwrap();
    let accel = Accel::build(&world, AccelKind::Bvh);
    assert_equals_full_scan(&world, &accel, &rays(500));
}

/// Triangles that overlap in planes across the axes, each of them three times, in one of several orders.
fn overlaps(order: u64) -> World {
    let n = 600;
    // Strides without a common divisor with 600 visit every triangle once.
    let stride = [1, 7, 599][order as usize];
    let corners = |i: u64| {
        let i = i * stride % n / 3;
        [0, 1, 2].map(|corner| {
            let unit = |k: u64| (16.0 * hash_unit(64 * i + 8 * corner + k)).floor() as f32 / 4.0;
            let mut p = Vec3::new(unit(0), unit(1), unit(2));
            p[(i % 3) as usize] = (i % 4) as f32;
            p
        })
    };
    let positions: Vec<Vec3> = (0..n).flat_map(corners).collect();
    let triangles = (0..n as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    World::from_triangles(positions, triangles).unwrap()
}

#[test]
fn overlaps_have_one_answer_for_every_preset_order_and_number_of_threads() {
    let rays: Vec<Ray> = (0..300)
        .map(|i| {
            let unit = |k: u64| hash_unit(8 * i + k);
            let origin = DVec3::new(12.0 * unit(0) - 4.0, 12.0 * unit(1) - 4.0, 12.0 * unit(2) - 4.0);
            Ray::new(origin, 4.0 * DVec3::new(unit(3), unit(4), unit(5)) - origin)
        })
        .collect();
    let mut t_in_every_order = Vec::new();
    for order in 0..3 {
        let world = overlaps(order);
        let mut hits_of_every_build = Vec::new();
        for preset in Preset::ALL {
            for threads in [1, 3] {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                let accel = pool.install(|| Accel::build_with(&world, AccelKind::Bvh, preset));
                assert_equals_full_scan(&world, &accel, &rays);
                let mut hits = vec![Hit::MISS; rays.len()];
                accel.closest_hit(&world, &rays, &mut hits);
                hits_of_every_build.push(hits);
            }
        }
        assert!(hits_of_every_build.windows(2).all(|pair| pair[0] == pair[1]), "order {order}");
        t_in_every_order.push(hits_of_every_build[0].iter().map(|hit| hit.t.to_bits()).collect::<Vec<_>>());
    }
    assert!(t_in_every_order.windows(2).all(|pair| pair[0] == pair[1]));
}

/// Slivers from corner to corner of a cube whose boxes nearly agree.
fn nearly_one_box(i: u64) -> [Vec3; 3] {
    let off = |k: u64| 0.01 * Vec3::new(unit(16 * i + k), unit(16 * i + k + 1), unit(16 * i + k + 2));
    [off(0), Vec3::ONE + off(3), Vec3::splat(0.1 + 0.8 * unit(16 * i + 6)) + off(7)]
}

/// Slivers in all directions through a cube; most boxes overlap most others.
fn tangle(i: u64) -> [Vec3; 3] {
    let point = |k: u64| Vec3::new(unit(16 * i + k), unit(16 * i + k + 1), unit(16 * i + k + 2));
    [point(0), point(3), 0.5 * (point(0) + point(3)) + 0.001 * point(6)]
}

/// Triangles on a grid so coarse that boxes soon have the same unions.
fn coarse_grid(i: u64) -> [Vec3; 3] {
    let point =
        |k: u64| (11.0 * Vec3::new(unit(16 * i + k), unit(16 * i + k + 1), unit(16 * i + k + 2))).floor() / 11.0;
    [point(0), point(3), point(6)]
}

fn unit(k: u64) -> f32 {
    hash_unit(k) as f32
}

#[test]
fn boxes_that_overlap_make_no_chains_whatever_the_preset() {
    for (name, corners) in
        [("nearly one box", nearly_one_box as fn(u64) -> [Vec3; 3]), ("tangle", tangle), ("coarse grid", coarse_grid)]
    {
        let world = world(corners);
        for preset in Preset::ALL {
            let accel = Accel::build_with(&world, AccelKind::Bvh, preset);
            let stats = accel.stats();
            assert!(stats.depth <= 40, "{name}, {preset:?}: {stats:?}");
            assert!(stats.memory_bytes < 72 * N as usize, "{name}, {preset:?}: {stats:?}");
            assert_equals_full_scan(&world, &accel, &rays(10));
        }
    }
}

#[test]
fn the_tree_is_the_same_for_every_number_of_threads() {
    let (positions, triangles) = flatray::measure::generate::terrain(150);
    for world in [World::from_triangles(positions, triangles).unwrap(), world(tangle), world(coarse_grid)] {
        for preset in Preset::ALL {
            let stats = [1, 2, 5].map(|threads| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                pool.install(|| Accel::build_with(&world, AccelKind::Bvh, preset)).stats()
            });
            assert_eq!(stats[0], stats[1], "{preset:?}");
            assert_eq!(stats[0], stats[2], "{preset:?}");
        }
    }
}

#[test]
fn a_line_of_points_and_a_world_of_one_are_trees_too() {
    let points = |i: u64| [Vec3::new(i as f32, 0.0, 0.0); 3];
    let stats = Accel::build(&world(points), AccelKind::Bvh).stats();
    assert!(stats.depth <= 10, "{stats:?}");
    let one = World::from_triangles(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]]).unwrap();
    for preset in Preset::ALL {
        let stats = Accel::build_with(&one, AccelKind::Bvh, preset).stats();
        assert_eq!((stats.n_nodes, stats.n_leaves, stats.depth), (1, 1, 1));
        let stats = Accel::build_with(&World::default(), AccelKind::Bvh, preset).stats();
        assert_eq!((stats.n_nodes, stats.n_leaves, stats.memory_bytes), (0, 0, 0));
    }
}
