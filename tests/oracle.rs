//! Property tests: kernels against the oracle on log-uniform exponents, ulp neighbours and integer grids, and the BVH
//! against the full scan on mixed scenes.

use flatray::measure::oracle::judge;
use flatray::measure::stress::primitive::Primitive;
use flatray::measure::stress::probe::truth;
use flatray::measure::stress::scene::Scene;
use flatray::numeric::quadric::Quadric;
use flatray::world::{MaterialId, MeshInput, ObjectId, Ray, World};
use glam::{DMat4, DVec3, Vec3};
use proptest::prelude::*;

/// A coordinate: of a grid, a neighbour of one, or of any size between 2⁻⁴⁰ and 2⁴⁰.
fn coordinate() -> impl Strategy<Value = f64> {
    let grid = (-4i32..=4).prop_map(f64::from);
    let neighbour = (-4i32..=4, any::<bool>()).prop_map(|(x, up)| {
        let x = f64::from(x);
        if up { x.next_up() } else { x.next_down() }
    });
    let log_uniform = (-40i32..40, 1.0..2.0f64, any::<bool>())
        .prop_map(|(e, m, negative)| m * 2f64.powi(e) * if negative { -1.0 } else { 1.0 });
    prop_oneof![4 => grid, 2 => neighbour, 2 => log_uniform, 1 => -2.0..2.0f64]
}

fn vector() -> impl Strategy<Value = DVec3> {
    [coordinate(), coordinate(), coordinate()].prop_map(DVec3::from_array)
}

fn ray() -> impl Strategy<Value = Ray> {
    let end = prop_oneof![Just(f64::INFINITY), (0i32..8).prop_map(f64::from), 0.0..8.0f64];
    let start = prop_oneof![Just(0.0), (0i32..4).prop_map(f64::from)];
    (vector(), vector(), start, end).prop_map(|(origin, direction, t_min, t_max)| Ray {
        origin,
        direction,
        t_min,
        t_max,
    })
}

fn right(ray: &Ray, primitive: &Primitive) -> Result<(), TestCaseError> {
    let (world, prim) = primitive.world();
    let hit = ray.prepare().and_then(|ray| prim.intersect(&world, &ray));
    let judged = judge(truth(ray, primitive).as_ref(), hit.map(|hit| hit.t), ray.t_min, ray.t_max);
    prop_assert!(judged.right, "{hit:?} {judged:?} of {primitive:?}");
    prop_assert!(judged.ulps <= 1.0, "{judged:?}");
    Ok(())
}

fn quadric() -> impl Strategy<Value = Quadric> {
    (vector(), vector(), vector(), vector(), coordinate()).prop_map(
        |(center, diagonal, off_diagonal, linear, constant)| Quadric {
            center,
            diagonal,
            off_diagonal,
            linear,
            constant,
            tame: true,
        },
    )
}

fn mixed_world() -> impl Strategy<Value = World> {
    let spheres = prop::collection::vec((vector(), 0.1..3.0f64), 0..6);
    let quadrics = prop::collection::vec((vector(), vector(), vector(), coordinate()), 0..4);
    let odd = prop_oneof![30 => coordinate(), 1 => Just(f64::NAN), 1 => Just(f64::INFINITY)];
    let corner = [odd.clone(), odd.clone(), odd].prop_map(|c| DVec3::from_array(c).as_vec3());
    let triangles = prop::collection::vec([corner.clone(), corner.clone(), corner], 0..40);
    (spheres, quadrics, triangles, any::<bool>()).prop_map(|(spheres, quadrics, triangles, twice)| {
        let mut world = World::default();
        for (center, radius) in spheres {
            world.spheres.add(center, radius, MaterialId(0), ObjectId(0));
        }
        for (diagonal, off, linear, constant) in quadrics {
            let column = |x: f64, y: f64, z: f64, w: f64| glam::DVec4::new(x, y, z, w);
            let matrix = DMat4::from_cols(
                column(diagonal.x, off.z, off.y, linear.x),
                column(off.z, diagonal.y, off.x, linear.y),
                column(off.y, off.x, diagonal.z, linear.z),
                column(linear.x, linear.y, linear.z, constant),
            );
            world.quadrics.add(matrix, MaterialId(0), ObjectId(0));
        }
        let positions: Vec<Vec3> = triangles.iter().flatten().copied().collect();
        let faces: Vec<[u32; 3]> = (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        for _ in 0..1 + usize::from(twice) {
            let input = MeshInput { positions: positions.clone(), triangles: faces.clone(), ..MeshInput::default() };
            world.add_mesh(input).unwrap();
        }
        world
    })
}

fn any_ray() -> impl Strategy<Value = Ray> {
    let spoilt = (ray(), 0usize..3, prop_oneof![Just(f64::NAN), Just(f64::INFINITY), Just(-0.0), Just(5e-324)])
        .prop_map(|(mut ray, axis, value)| {
            ray.direction[axis] = value;
            ray
        });
    prop_oneof![6 => ray(), 1 => spoilt]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn triangles_are_decided_as_exact_arithmetic_decides(ray in ray(), corners in [vector(), vector(), vector()]) {
        right(&ray, &Primitive::Triangle(corners.map(|corner| corner.as_vec3())))?;
    }

    #[test]
    fn triangles_are_hit_where_the_ray_aims(corners in [vector(), vector(), vector()], from in vector(), u in 0.0..=1.0f64, edge in 0..3usize) {
        let corners = corners.map(|corner| corner.as_vec3());
        let (a, b) = (corners[edge].as_dvec3(), corners[(edge + 1) % 3].as_dvec3());
        right(&Ray::new(from, a + u * (b - a) - from), &Primitive::Triangle(corners))?;
        right(&Ray::new(from, a - from), &Primitive::Triangle(corners))?;
    }

    #[test]
    fn spheres_are_decided_as_exact_arithmetic_decides(ray in ray(), center in vector(), radius in coordinate()) {
        prop_assume!(radius != 0.0);
        right(&ray, &Primitive::Sphere { center, radius: radius.abs() })?;
    }

    #[test]
    fn tangents_of_spheres_and_their_neighbours_are_decided(center in vector(), axis in 0..3usize, steps in -3i32..=3, radius in 1i32..9, far in coordinate()) {
        let radius = f64::from(radius);
        let mut origin = center;
        let mut beside = origin[axis] + radius;
        for _ in 0..steps.abs() {
            beside = if steps > 0 { beside.next_up() } else { beside.next_down() };
        }
        origin[axis] = beside;
        origin[(axis + 1) % 3] += far;
        let mut direction = DVec3::ZERO;
        direction[(axis + 1) % 3] = -far;
        prop_assume!(direction != DVec3::ZERO);
        right(&Ray::new(origin, direction), &Primitive::Sphere { center, radius })?;
    }

    #[test]
    fn quadrics_are_decided_as_exact_arithmetic_decides(ray in ray(), quadric in quadric()) {
        right(&ray, &Primitive::Quadric(quadric))?;
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 150, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn the_bvh_answers_what_the_full_scan_answers(world in mixed_world(), rays in prop::collection::vec(any_ray(), 64)) {
        let scene = Scene::new(world);
        for ray in &rays {
            let (hit, scanned) = (scene.closest(ray), scene.scan(ray));
            prop_assert!(hit.same_bits(&scanned), "{ray:?}: {hit:?}, full scan {scanned:?}");
            prop_assert_eq!(scene.occluded(ray), [hit.is_some(); 2], "{:?}", ray);
        }
    }
}
