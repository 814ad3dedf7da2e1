//! Meshes placed many times: as if they were written out, leaving rays, what is refused.

use flatray::accel::{Accel, AccelKind};
use flatray::measure::stress::mesh::{bumpy_block, lat_long};
use flatray::measure::stress::random::Random;
use flatray::render::surface::describe;
use flatray::world::{Hit, InstanceId, MaterialId, MeshInput, ObjectId, Ray, World};
use glam::{DAffine3, DMat3, DQuat, DVec3, Vec3};

fn closest(world: &World, rays: &[Ray]) -> Vec<Hit> {
    let mut hits = vec![Hit::MISS; rays.len()];
    Accel::build(world, AccelKind::Bvh).closest_hit(world, rays, &mut hits);
    hits
}

/// Signed permutations, powers of two and representable translations.
fn exact_transform(random: &mut Random) -> DAffine3 {
    let axes = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]][random.below(6) as usize];
    let mut columns = [DVec3::ZERO; 3];
    for (column, axis) in columns.iter_mut().zip(axes) {
        column[axis] = random.sign() * random.power_of_two(-2, 2);
    }
    DAffine3 { matrix3: DMat3::from_cols_array_2d(&columns.map(|c| c.to_array())), translation: random.grid(64) / 4.0 }
}

#[test]
fn placements_are_hit_as_if_they_were_written_out_where_transforms_are_exact() {
    // Coordinates on a grid, so that every transform of them is exact.
    let mut mesh = bumpy_block(4);
    mesh.positions.iter_mut().for_each(|p| *p = (*p * 256.0).round() / 256.0);
    let mut placed = World::default();
    placed.add_mesh(mesh.input()).unwrap();
    let prototype = placed.add_prototype(0);
    let mut written = World::default();
    let mut random = Random::new(1, "written out", 0);
    for i in 0..60 {
        let transform = exact_transform(&mut random);
        placed.add_instance(prototype, transform, None, ObjectId(i)).unwrap();
        let positions = mesh.positions.iter().map(|p| transform.transform_point3(p.as_dvec3()));
        let positions: Vec<Vec3> = positions
            .map(|p| {
                assert_eq!(p.as_vec3().as_dvec3(), p);
                p.as_vec3()
            })
            .collect();
        // The same triangle whatever its winding: the order of corners only swaps weights.
        written.add_mesh(MeshInput { positions, triangles: mesh.triangles.clone(), ..MeshInput::default() }).unwrap();
    }
    let n_each = mesh.triangles.len();
    let rays: Vec<Ray> = (0..20_000)
        .map(|i| {
            let mut random = Random::new(2, "written out", i);
            let corners = written.triangles.corners(random.below(written.triangles.len() as u64) as usize);
            let [a, b, c] = corners.map(|corner| corner.as_dvec3());
            let target = match random.below(3) {
                0 => a,
                1 => 0.5 * (a + b),
                _ => 0.5 * a + 0.25 * (b + c),
            };
            let origin = random.grid(4000) / 64.0;
            Ray::new(origin, target - origin)
        })
        .collect();
    let (of_placed, of_written) = (closest(&placed, &rays), closest(&written, &rays));
    let mut n_hits = 0;
    for ((placed, written), ray) in of_placed.iter().zip(&of_written).zip(&rays) {
        assert_eq!(placed.is_some(), written.is_some(), "{ray:?}");
        if placed.is_some() {
            n_hits += 1;
            let row = placed.instance.row().unwrap();
            assert_eq!(placed.t.to_bits(), written.t.to_bits(), "{ray:?}");
            assert_eq!(row * n_each + placed.prim.row(), written.prim.row(), "{ray:?}");
        }
    }
    assert!(n_hits > 19_000, "{n_hits}");
}

#[test]
fn no_ray_that_leaves_a_placement_meets_the_triangle_it_leaves() {
    let mut n_checked = 0;
    for case in 0..300 {
        let mut random = Random::new(5, "leaving placements", case);
        let mut world = World::default();
        world
            .add_mesh(
                lat_long(24, 12)
                    .placed(random.log_uniform(1e-3, 1e3), random.log_uniform(1e-3, 1e5) * random.direction())
                    .input(),
            )
            .unwrap();
        let prototype = world.add_prototype(0);
        let turn = |random: &mut Random| {
            DMat3::from_quat(DQuat::from_axis_angle(random.direction(), random.uniform(-3.0, 3.0)))
        };
        let stretch = DVec3::new(random.log_uniform(0.03, 30.0), random.sign(), random.log_uniform(0.03, 30.0));
        let matrix3 =
            turn(&mut random) * DMat3::from_diagonal(random.log_uniform(1e-6, 1e6) * stretch) * turn(&mut random);
        let translation = random.log_uniform(1e-3, 1e6) * random.direction();
        world.add_instance(prototype, DAffine3 { matrix3, translation }, None, ObjectId(0)).unwrap();
        let bounds = world.instances.bounds[0];
        for _ in 0..20 {
            let target = bounds.center() + 0.3 * bounds.extent() * random.in_cube();
            let from = bounds.center() + bounds.extent().length() * random.log_uniform(0.6, 1e3) * random.direction();
            let ray = Ray::new(from, target - from);
            let hit = closest(&world, &[ray])[0];
            if !hit.is_some() {
                continue;
            }
            let surface = describe(&world, &ray, &hit);
            assert!((surface.ng.length() - 1.0).abs() <= 2.0 * f64::EPSILON);
            let to_object = world.instances.object_from_world[0];
            for _ in 0..20 {
                let tangent = random.perpendicular(surface.ng);
                let lift = random.sign() * random.log_uniform(1e-7, 10.0);
                let direction = tangent + lift * surface.ng;
                let origin = surface.leave(direction);
                let object_ray = Ray::new(to_object.transform_point3(origin), to_object.transform_vector3(direction));
                let again = world.triangles.intersect(hit.prim.row(), &object_ray.prepare().unwrap());
                assert!(again.is_none(), "case {case}: {again:?} after {hit:?}, lift {lift:e}");
                n_checked += 1;
            }
        }
    }
    assert!(n_checked > 50_000, "{n_checked}");
}

#[test]
fn normals_of_mirrored_and_stretched_placements_point_outwards() {
    let mut world = World::default();
    world.add_mesh(lat_long(24, 12).input()).unwrap();
    let prototype = world.add_prototype(0);
    let matrix3 = DMat3::from_diagonal(DVec3::new(-1.0, 3.0, 0.2));
    world.add_instance(prototype, DAffine3 { matrix3, translation: DVec3::X }, None, ObjectId(0)).unwrap();
    for i in 0..200 {
        let mut random = Random::new(9, "outwards", i);
        let from = DVec3::X + 10.0 * random.direction();
        let ray = Ray::new(from, DVec3::X - from);
        let hit = closest(&world, &[ray])[0];
        assert_eq!(hit.instance, InstanceId::new(0));
        let surface = describe(&world, &ray, &hit);
        assert!(surface.ng.dot(ray.direction) < 0.0);
        assert!(surface.p.distance(ray.at(hit.t)) <= 64.0 * f64::EPSILON);
    }
}

#[test]
fn the_material_of_a_placement_is_its_own_or_that_of_the_mesh() {
    let mut world = World::default();
    world.add_mesh(MeshInput { material: MaterialId(3), object: ObjectId(7), ..lat_long(8, 4).input() }).unwrap();
    let prototype = world.add_prototype(0);
    for (x, material) in [(0.0, None), (5.0, Some(MaterialId(4)))] {
        let transform = DAffine3::from_translation(DVec3::new(x, 0.0, 0.0));
        world.add_instance(prototype, transform, material, ObjectId(x as u32)).unwrap();
    }
    let down = |x: f64| Ray::new(DVec3::new(x, 0.1, 9.0), -DVec3::Z);
    let hits = closest(&world, &[down(0.0), down(5.0), down(2.5)]);
    assert_eq!((hits[0].material(&world), hits[0].object(&world)), (MaterialId(3), ObjectId(0)));
    assert_eq!((hits[1].material(&world), hits[1].object(&world)), (MaterialId(4), ObjectId(5)));
    assert!(!hits[2].is_some());
}

#[test]
fn transforms_that_cannot_place_a_mesh_are_refused() {
    let mut world = World::default();
    world.add_mesh(lat_long(8, 4).input()).unwrap();
    let prototype = world.add_prototype(0);
    let mut refusal = |matrix3: DMat3, translation: DVec3| {
        world.add_instance(prototype, DAffine3 { matrix3, translation }, None, ObjectId(0)).unwrap_err().to_string()
    };
    let scale = |x: f64, y: f64, z: f64| DMat3::from_diagonal(DVec3::new(x, y, z));
    assert!(refusal(scale(1.0, 0.0, 1.0), DVec3::ZERO).contains("finite and invertible"));
    assert!(refusal(scale(1.0, f64::NAN, 1.0), DVec3::ZERO).contains("finite and invertible"));
    assert!(refusal(DMat3::IDENTITY, DVec3::new(0.0, f64::INFINITY, 0.0)).contains("finite and invertible"));
    assert!(refusal(scale(1.0, 1e-4, 1.0), DVec3::ZERO).contains("a condition of 14142, expected at most 8192"));
    assert!(refusal(DMat3::IDENTITY, DVec3::new(0.0, 4e38, 0.0)).contains("beyond the range of 32-bit floats"));
    assert!(world.instances.is_empty());
}
