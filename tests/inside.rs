//! Surfaces from every side: from inside, from outside, from on them; and what lies behind a light.

/// Building worlds and rendering them.
mod world_kit {
    pub mod coverage;
    pub mod eye;
    pub mod hit;
    pub mod material;
    pub mod pinhole;
    pub mod pixel;
    pub mod quadric;
    pub mod rendering;
    pub mod settings;
}

use std::f64::consts::FRAC_PI_2;

use flatray::film::Film;
use flatray::render::Settings;
use flatray::world::{Camera, Material, MaterialId, MeshInput, ObjectId, Ray, World};
use glam::{DMat4, DVec3, Vec3};
use world_kit::coverage::coverage;
use world_kit::eye::{eye, pixel_direction};
use world_kit::hit::closest_hit;
use world_kit::material::world_of;
use world_kit::pinhole::camera;
use world_kit::pixel::rgb;
use world_kit::quadric::quadric;
use world_kit::rendering::render_world;
use world_kit::settings::center_settings;

const OBJECT: ObjectId = ObjectId(0);

/// The f32 film rounds by 2⁻²⁴; some hundred roundings of f64 are far below the rest.
const F32_FILM: f64 = 1.0 / (1u64 << 23) as f64;

/// Grey, so that one channel says all: ambient 0.25, diffuse 0.5.
fn chalk() -> Material {
    Material { k_a: 0.25, k_d: 0.5, k_s: 0.0, ..Material::default() }
}

const AXES: [DVec3; 6] = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];

/// Six views of 90° see everything around a point. The size is even, so that no ray runs along an axis.
fn views(eye: DVec3) -> [Camera; 6] {
    AXES.map(|axis| Camera { fov_y_radians: FRAC_PI_2, ..camera(eye, eye + axis, 90.0, 24, 24) })
}

fn pixels(camera: &Camera) -> impl Iterator<Item = (u32, u32)> + use<> {
    let (width, height) = (camera.width_px, camera.height_px);
    (0..height).flat_map(move |y| (0..width).map(move |x| (x, y)))
}

fn shoot(world: &World, camera: &Camera) -> Film {
    render_world(world, camera, &center_settings(camera)).film
}

fn assert_near(found: DVec3, expected: f64, what: &str) {
    assert!((found - expected).abs().max_element() <= F32_FILM * expected, "{what}: {found} for {expected}");
}

/// What a camera inside of a convex surface sees: `exit` gives the distance to the wall and its normal, outwards, or
/// nothing to leave a pixel out. Nothing can hide the light, which is inside too.
fn check_inside(world: &mut World, eye_at: DVec3, light: DVec3, exit: impl Fn(DVec3) -> Option<(f64, DVec3)>) {
    world.lights.add(light, DVec3::ONE);
    for two_sided in [false, true] {
        world.two_sided = two_sided;
        let mut n_compared = 0;
        for camera in views(eye_at) {
            let film = shoot(world, &camera);
            for (x, y) in pixels(&camera) {
                assert_eq!(coverage(&film, x, y), 1.0, "the surface is missing at {x},{y} from {eye_at}");
                let d = pixel_direction(&camera, x, y);
                let Some((distance, outwards)) = exit(d) else { continue };
                let l = (light - (eye_at + distance * d)).normalize();
                // As given, normals point away from camera and light, and only the ambient part is left.
                let cosine = if two_sided { l.dot(-outwards) } else { 0.0 };
                assert!(l.dot(-outwards) > 0.0, "the light is inside");
                assert_near(rgb(&film, x, y), 0.25 + 0.5 * cosine, &format!("{x},{y}, two-sided {two_sided}"));
                n_compared += 1;
            }
        }
        assert!(n_compared > 3000, "{n_compared} pixels compared");
    }
}

#[test]
fn a_camera_inside_a_sphere_sees_its_inside_everywhere() {
    let (center, radius) = (DVec3::new(1.0, 2.0, 3.0), 2.5);
    let (mut world, material) = world_of(&chalk());
    world.spheres.add(center, radius, material, OBJECT);
    let stand = center + DVec3::new(-1.0, 0.5, 0.75);
    check_inside(&mut world, stand, center + DVec3::new(0.5, 1.0, -1.5), |d| {
        let middle = (center - stand).dot(d);
        let miss2 = (stand + middle * d - center).length_squared();
        let distance = middle + (radius * radius - miss2).sqrt();
        Some((distance, (stand + distance * d - center) / radius))
    });
}

#[test]
fn a_camera_inside_a_cylinder_sees_its_inside_everywhere_but_along_the_axis() {
    // An ellipse of half axes 1 and 2 in every section along z.
    let (mut world, material) = world_of(&chalk());
    world.quadrics.add(quadric([1.0, 0.25, 0.0], [0.0; 3], -1.0), material, OBJECT);
    let stand = DVec3::new(0.25, -0.5, 4.0);
    check_inside(&mut world, stand, DVec3::new(-0.5, 0.75, 3.5), |d| {
        // Scaled by 1/2 along y the section is a circle.
        let flatten = |v: DVec3| DVec3::new(v.x, 0.5 * v.y, 0.0);
        let (o, d2) = (flatten(stand), flatten(d));
        let (a, b, c) = (d2.length_squared(), o.dot(d2), o.length_squared() - 1.0);
        let distance = (-b + (b * b - a * c).sqrt()) / a;
        let p = stand + distance * d;
        // Far down the tube the angle is flat and the section a small difference of large numbers.
        (distance < 20.0).then(|| (distance, DVec3::new(p.x, 0.25 * p.y, 0.0).normalize()))
    });

    // A ray along the axis never meets the wall.
    let along = Camera { width_px: 5, height_px: 5, ..camera(stand, stand - DVec3::Z, 90.0, 5, 5) };
    let film = shoot(&world, &along);
    let n_covered = pixels(&along).filter(|&(x, y)| coverage(&film, x, y) == 1.0).count();
    assert_eq!((n_covered, coverage(&film, 2, 2)), (24, 0.0));
}

fn add_mesh(world: &mut World, positions: Vec<Vec3>, triangles: Vec<[u32; 3]>, material: MaterialId) {
    world.add_mesh(MeshInput { positions, triangles, material, ..MeshInput::default() }).unwrap();
}

/// A box as twelve triangles, wound to the outside.
fn box_mesh(half: Vec3) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let corner = |i: u32| half * Vec3::from([0, 1, 2].map(|axis| if i >> axis & 1 == 1 { 1.0 } else { -1.0 }));
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    ((0..8).map(corner).collect(), quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect())
}

#[test]
fn a_camera_inside_a_closed_mesh_sees_its_inside_everywhere() {
    let half = DVec3::new(2.0, 1.5, 3.0);
    let (mut world, material) = world_of(&chalk());
    let (positions, triangles) = box_mesh(half.as_vec3());
    add_mesh(&mut world, positions, triangles, material);
    let stand = DVec3::new(-0.5, 0.25, 1.0);
    check_inside(&mut world, stand, DVec3::new(1.0, -0.5, -1.25), |d| {
        let wall = |axis: usize| (half[axis] * d[axis].signum() - stand[axis]) / d[axis];
        let axis = (0..3).min_by(|&a, &b| wall(a).total_cmp(&wall(b))).unwrap();
        let normal = DVec3::AXES[axis] * d[axis].signum();
        // On an edge two walls are right.
        let on_edge = (0..3).filter(|&other| (wall(other) - wall(axis)).abs() < 1e-9).count() > 1;
        (!on_edge).then(|| (wall(axis), normal))
    });
}

#[test]
fn rays_from_inside_a_fine_mesh_through_its_very_vertices_and_edges_do_not_leave() {
    // A sphere of 60×30 quads, each cut into two triangles, pinched at the poles.
    let (n_around, n_down) = (60u32, 30u32);
    let point = |i: u32, j: u32| {
        let (phi, theta) = (f64::from(i % n_around) * 6.0_f64.to_radians(), f64::from(j) * 6.0_f64.to_radians());
        DVec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin()).as_vec3()
    };
    let mut positions = vec![Vec3::Y, -Vec3::Y];
    positions.extend((1..n_down).flat_map(|j| (0..n_around).map(move |i| point(i, j))));
    let vertex = |i: u32, j: u32| match j {
        0 => 0,
        j if j == n_down => 1,
        j => 2 + (j - 1) * n_around + i % n_around,
    };
    let quads = (0..n_down).flat_map(|j| (0..n_around).map(move |i| (i, j)));
    let triangles: Vec<[u32; 3]> = quads
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)];
            [[a, b, c], [a, c, d]]
        })
        .filter(|[a, b, c]| a != b && b != c && c != a)
        .collect();
    let world = World::from_triangles(positions.clone(), triangles.clone()).unwrap();
    let stand = DVec3::new(0.1, -0.3, 0.2);
    let on_edges = triangles.iter().map(|t| 0.5 * (positions[t[0] as usize] + positions[t[1] as usize]).as_dvec3());
    let targets: Vec<DVec3> = positions.iter().map(|p| p.as_dvec3()).chain(on_edges).collect();
    let accel = flatray::accel::Accel::build(&world, flatray::accel::AccelKind::Bvh);
    let rays: Vec<Ray> = targets.iter().map(|&target| Ray::new(stand, target - stand)).collect();
    let mut hits = vec![flatray::world::Hit::MISS; rays.len()];
    accel.closest_hit(&world, &rays, &mut hits);
    let escaped = hits.iter().filter(|hit| !hit.is_some()).count();
    assert_eq!((escaped, rays.len()), (0, positions.len() + triangles.len()));
    let nearest = hits.iter().map(|hit| hit.t).fold(f64::INFINITY, f64::min);
    assert!(nearest > 0.99, "the surface lies where the rays aim: {nearest}");
}

/// The surfaces that have no middle to look at from outside, and others beside them, each turned and moved.
fn surfaces() -> Vec<(&'static str, DMat4)> {
    let plain = [
        ("plane", quadric([0.0, 0.0, 0.0], [0.0, 1.0, 0.0], -0.25)),
        ("paraboloid", quadric([1.0, 0.0, 1.5], [0.0, -1.0, 0.0], -0.5)),
        ("saddle", quadric([1.0, -1.0, 0.0], [0.0, 0.0, 1.0], 0.125)),
        ("hyperboloid of one sheet", quadric([1.0, -0.5, 1.25], [0.0; 3], -0.25)),
        ("hyperboloid of two sheets", quadric([1.0, -0.5, 1.25], [0.0; 3], 0.25)),
        ("cone", quadric([1.0, -0.5, 1.25], [0.0; 3], 0.0)),
        ("cylinder", quadric([1.0, 0.0, 2.0], [0.0; 3], -0.5)),
        ("parabolic cylinder", quadric([1.0, 0.0, 0.0], [0.0, -1.0, 0.0], -0.25)),
        ("hyperbolic cylinder", quadric([1.0, -1.0, 0.0], [0.0; 3], -0.25)),
        ("two crossing planes", quadric([1.0, -2.0, 0.0], [0.0; 3], 0.0)),
        ("ellipsoid", quadric([1.0, 2.0, 3.0], [0.0; 3], -1.0)),
    ];
    let moved = DMat4::from_translation(DVec3::new(0.1, -0.2, 0.15))
        * DMat4::from_rotation_x(0.4)
        * DMat4::from_rotation_z(-0.7);
    plain
        .iter()
        .flat_map(|&(name, a)| {
            let turned = moved.transpose() * a * moved;
            [(name, a), (name, 0.5 * (turned + turned.transpose()))]
        })
        .collect()
}

fn value(a: &DMat4, p: DVec3) -> f64 {
    p.extend(1.0).dot(*a * p.extend(1.0))
}

fn gradient(a: &DMat4, p: DVec3) -> DVec3 {
    2.0 * (*a * p.extend(1.0)).truncate()
}

/// The first sign change of XᵀAX along a ray, found by walking it and halving; `Err` where the walk cannot tell (a
/// double root, or a root at either end).
fn first_sign_change(a: &DMat4, o: DVec3, d: DVec3, t_end: f64) -> Result<Option<f64>, ()> {
    // The value along the ray is c + b·t + a·t²: its extremum divides the ray in two parts of one sign change at most.
    let (c, plus, minus) = (value(a, o), value(a, o + d), value(a, o - d));
    let (square, linear) = (0.5 * (plus + minus) - c, 0.5 * (plus - minus));
    let size = c.abs() + linear.abs() + square.abs();
    let extremum = -0.5 * linear / square;
    let f = |t: f64| value(a, o + t * d);
    let mut stops = vec![0.0, t_end];
    if extremum > 0.0 && extremum < t_end {
        if f(extremum).abs() < 1e-9 * size {
            return Err(());
        }
        stops.insert(1, extremum);
    }
    if stops.iter().any(|&stop| f(stop).abs() < 1e-9 * size) {
        return Err(());
    }
    for ends in stops.windows(2) {
        let (mut lo, mut hi) = (ends[0], ends[1]);
        if f(lo).signum() != f(hi).signum() {
            for _ in 0..200 {
                let middle = 0.5 * (lo + hi);
                if f(middle).signum() == f(lo).signum() { lo = middle } else { hi = middle }
            }
            return Ok(Some(hi));
        }
    }
    Ok(None)
}

#[test]
fn quadrics_are_hit_from_every_side_exactly_where_their_equation_changes_sign() {
    const FAR: f64 = 1e4;
    let directions = (0..27).map(|i| DVec3::new(f64::from(i % 3 - 1), f64::from(i / 3 % 3 - 1), f64::from(i / 9 - 1)));
    // Around them, near by, and in the middle of most.
    let eyes: Vec<DVec3> =
        directions.flat_map(|d| [6.0 * d, 0.45 * d]).map(|p| p + DVec3::new(0.012, 0.023, 0.034)).collect();
    for (name, a) in surfaces() {
        let (mut n_hits, mut n_misses, mut n_unsure) = (0, 0, 0);
        for &stand in &eyes {
            let (mut world, material) = world_of(&chalk());
            world.quadrics.add(a, material, OBJECT);
            world.two_sided = true;
            // A lamp at the eye: all that is seen is lit, and as bright as it is steep.
            world.lights.add(stand, DVec3::ONE);
            let camera = camera(stand, 0.2 * stand.cross(DVec3::ONE), 70.0, 12, 9);
            let film = shoot(&world, &camera);
            for (x, y) in pixels(&camera) {
                let d = pixel_direction(&camera, x, y);
                let Ok(expected) = first_sign_change(&a, stand, d, FAR) else {
                    n_unsure += 1;
                    continue;
                };
                let place = format!("{name} {a}, {x},{y} from {stand}");
                let hit = closest_hit(&world, Ray::new(stand, d).until(FAR));
                assert_eq!(hit.is_some(), expected.is_some(), "{place}");
                let Some(t) = expected else {
                    n_misses += 1;
                    continue;
                };
                assert!((hit.t - t).abs() <= 1e-7 * (1.0 + t), "{place}: t {} for {t}", hit.t);
                assert_eq!(coverage(&film, x, y), 1.0, "{place}");
                let steep = gradient(&a, stand + t * d).normalize().dot(d).abs();
                let found = rgb(&film, x, y).x;
                assert!((found - (0.25 + 0.5 * steep)).abs() < 1e-5, "{place}: {found}, steepness {steep}");
                n_hits += 1;
            }
        }
        let n_all = eyes.len() * 12 * 9;
        assert!(n_unsure * 100 < n_all, "{name}: {n_unsure} of {n_all} rays could not be judged");
        assert!(n_hits > 300 && n_misses > 100, "{name}: {n_hits} hits, {n_misses} misses");
    }
}

#[test]
fn a_one_sided_plane_is_lit_on_the_side_of_its_gradient_only() {
    for sign in [1.0, -1.0] {
        let (mut world, material) = world_of(&chalk());
        world.quadrics.add(quadric([0.0; 3], [0.0, sign, 0.0], 0.0), material, OBJECT);
        for side in [1.0, -1.0] {
            world.lights = Default::default();
            world.lights.add(DVec3::new(0.0, 2.0 * side, 0.0), DVec3::ONE);
            for eye_side in [1.0, -1.0] {
                // The middle of the odd image looks straight at the point under the light.
                let camera = camera(DVec3::new(0.0, 3.0 * eye_side, 0.0), DVec3::ZERO, 40.0, 3, 3);
                let film = shoot(&world, &camera);
                // Given normals are never turned: where the eye is does not matter, where the light is does, but a
                // plane that faces the light hides it from nobody on this side of it.
                let lit = side == sign;
                assert_near(rgb(&film, 1, 1), if lit { 0.75 } else { 0.25 }, &format!("{sign} {side} {eye_side}"));
            }
        }
    }
}

#[test]
fn the_apex_of_a_cone_faces_the_eye() {
    let (mut world, material) = world_of(&chalk());
    world.quadrics.add(quadric([1.0, -1.0, 1.0], [0.0; 3], 0.0), material, OBJECT);
    let stand = DVec3::new(0.0, 0.0, 4.0);
    world.lights.add(stand, DVec3::ONE);
    let camera = camera(stand, DVec3::ZERO, 40.0, 5, 5);
    let film = shoot(&world, &camera);
    assert_eq!(coverage(&film, 2, 2), 1.0);
    assert_near(rgb(&film, 2, 2), 0.75, "the normal is the ray's own direction, turned round");
    assert!(film.planes.iter().all(|plane| (0..25).all(|index| plane.samples.get(index).is_finite())));
}

type Blocker = (&'static str, fn(&mut World, MaterialId, f64));

/// Things of every kind at a height, all straight above the origin.
const BLOCKERS: [Blocker; 5] = [
    ("sphere", |world, material, height| world.spheres.add(DVec3::Y * height, 0.5, material, OBJECT)),
    ("ellipsoid", |world, material, height| {
        let matrix = quadric([1.0, 4.0, 1.0], [0.0, -8.0 * height, 0.0], 4.0 * height * height - 1.0);
        world.quadrics.add(matrix, material, OBJECT);
    }),
    ("plane", |world, material, height| {
        world.quadrics.add(quadric([0.0; 3], [0.0, -1.0, 0.0], height), material, OBJECT);
    }),
    ("paraboloid", |world, material, height| {
        world.quadrics.add(quadric([1.0, 0.0, 1.0], [0.0, -1.0, 0.0], height), material, OBJECT);
    }),
    ("triangles", |world, material, height| {
        let corner = |x: f32, z: f32| Vec3::new(x, height as f32, z);
        let corners = vec![corner(-2.0, -2.0), corner(2.0, -2.0), corner(2.0, 2.0), corner(-2.0, 2.0)];
        add_mesh(world, corners, vec![[0, 1, 2], [0, 2, 3]], material);
    }),
];

/// A floor seen from below everything else, with a light at (0, 3, 0) and perhaps something above the floor.
fn floor_under(blocker: Option<(Blocker, f64)>) -> Film {
    let (mut world, material) = world_of(&chalk());
    world.quadrics.add(quadric([0.0; 3], [0.0, 1.0, 0.0], 0.0), material, OBJECT);
    world.lights.add(DVec3::new(0.0, 3.0, 0.0), DVec3::ONE);
    if let Some(((_, add), height)) = blocker {
        add(&mut world, material, height);
    }
    // No ray of this camera rises.
    let camera = camera(DVec3::new(0.0, 1.0, 3.0), DVec3::new(0.0, 0.0, 0.9), 40.0, 40, 30);
    shoot(&world, &camera)
}

#[test]
fn an_object_behind_a_light_casts_no_shadow_and_one_before_it_does() {
    let plain = floor_under(None);
    for blocker in BLOCKERS {
        assert_eq!(floor_under(Some((blocker, 4.0))), plain, "{} behind the light", blocker.0);
        // Straight behind the light with no gap that f32 could see.
        if blocker.0 == "plane" || blocker.0 == "triangles" {
            let height = 3.0 + f64::from(f32::EPSILON) * 2.0;
            assert_eq!(floor_under(Some((blocker, height))), plain, "{} just behind the light", blocker.0);
        }
        let shaded = floor_under(Some((blocker, 2.0)));
        assert_ne!(shaded, plain, "{} before the light", blocker.0);
        let at = plain.data_window.index_of(20, 29);
        assert!(shaded.planes[0].samples.get(at) <= plain.planes[0].samples.get(at), "{}", blocker.0);
    }
}

#[test]
fn a_light_exactly_on_a_surface_shines_to_the_side_that_it_is_seen_from() {
    let plain = floor_under(None);
    // The light lies in the plane and in the triangles, and touches the sphere and the ellipsoid from below.
    for (index, height) in [(0, 3.5), (1, 3.5), (2, 3.0), (3, 3.0), (4, 3.0)] {
        let found = floor_under(Some((BLOCKERS[index], height)));
        let differing = (0..found.n_pixels())
            .filter(|&at| found.planes[0].samples.get(at) != plain.planes[0].samples.get(at))
            .count();
        assert_eq!(differing, 0, "pixels of the floor that {} at the light darkens", BLOCKERS[index].0);
    }
}

#[test]
fn a_surface_with_the_light_in_it_is_lit_only_by_its_ambient() {
    let (mut world, material) = world_of(&chalk());
    world.quadrics.add(quadric([0.0; 3], [0.0, 1.0, 0.0], 0.0), material, OBJECT);
    world.lights.add(DVec3::ZERO, DVec3::ONE);
    let camera = camera(DVec3::new(0.5, 2.0, 3.0), DVec3::ZERO, 40.0, 20, 15);
    let film = shoot(&world, &camera);
    for (x, y) in pixels(&camera) {
        // The light is nowhere above the plane; the rounding of the point is all that can lift it.
        assert!((rgb(&film, x, y) - 0.25).abs().max_element() < 1e-12, "{x},{y}: {}", rgb(&film, x, y));
    }
}

#[test]
fn a_camera_on_a_surface_does_not_see_the_point_it_stands_on() {
    let seen = |world: &World, stand: DVec3, axis: DVec3| {
        let camera = camera(stand, stand + axis, 90.0, 24, 24);
        let film = render_world(world, &camera, &Settings { max_depth: 1, ..center_settings(&camera) }).film;
        pixels(&camera).filter(|&(x, y)| coverage(&film, x, y) == 1.0).count()
    };
    let (all, none) = (24 * 24, 0);

    let (mut sphere, material) = world_of(&chalk());
    sphere.spheres.add(DVec3::ZERO, 1.0, material, OBJECT);
    assert_eq!([seen(&sphere, DVec3::Z, DVec3::NEG_Z), seen(&sphere, DVec3::Z, DVec3::Z)], [all, none]);

    let (mut cylinder, material) = world_of(&chalk());
    cylinder.quadrics.add(quadric([1.0, 0.0, 1.0], [0.0; 3], -1.0), material, OBJECT);
    assert_eq!([seen(&cylinder, DVec3::Z, DVec3::NEG_Z), seen(&cylinder, DVec3::Z, DVec3::Z)], [all, none]);

    let (mut plane, material) = world_of(&chalk());
    plane.quadrics.add(quadric([0.0; 3], [0.0, 0.0, 1.0], 0.0), material, OBJECT);
    assert_eq!([seen(&plane, DVec3::ZERO, DVec3::NEG_Z), seen(&plane, DVec3::ZERO, DVec3::Z)], [none, none]);

    // On one wall of a box: the other five are seen inwards, nothing outwards.
    let (mut walls, material) = world_of(&chalk());
    let (positions, triangles) = box_mesh(Vec3::ONE);
    add_mesh(&mut walls, positions, triangles, material);
    let on_wall = DVec3::new(0.25, 0.125, 1.0);
    assert_eq!([seen(&walls, on_wall, DVec3::NEG_Z), seen(&walls, on_wall, DVec3::Z)], [all, none]);
    assert_eq!(eye(&camera(on_wall, DVec3::ZERO, 90.0, 2, 2)), on_wall);
}
