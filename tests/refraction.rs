//! Refraction against what a textbook says: where a slab moves an image, where reflection is total, and what becomes of
//! the energy.

/// Building worlds and rendering them.
mod world_kit {
    pub mod eye;
    pub mod material;
    pub mod pinhole;
    pub mod pixel;
    pub mod quadric;
    pub mod rendering;
    pub mod settings;
}

use flatray::render::{Rendered, Sampler, Settings};
use flatray::world::{Camera, Material, MaterialId, MeshInput, ObjectId, World};
use glam::{DVec3, Vec3};
use world_kit::eye::{eye, pixel_direction};
use world_kit::material::world_of;
use world_kit::pinhole::camera;
use world_kit::pixel::rgb;
use world_kit::quadric::quadric;
use world_kit::rendering::render_world;
use world_kit::settings::center_settings;

const OBJECT: ObjectId = ObjectId(0);

/// The f32 film rounds once.
const F32_FILM: f64 = 1.0 / (1u64 << 23) as f64;

/// Glass and nothing else: neither lit nor ambient.
fn glass(k_s: f64, k_t: f64, ior: f64) -> Material {
    Material { k_a: 0.0, k_d: 0.0, specular: DVec3::ZERO, k_s, k_t, ior, ..Material::default() }
}

/// A surface that glows by itself.
fn glow(color: DVec3) -> Material {
    Material { ambient: color, k_a: 1.0, k_d: 0.0, k_s: 0.0, ..Material::default() }
}

fn shoot(world: &World, camera: &Camera, max_depth: u32) -> Rendered {
    render_world(world, camera, &Settings { max_depth, ..center_settings(camera) })
}

/// The half-spaces y ≤ top and y ≥ bottom, their normals outwards.
fn add_slab(world: &mut World, top: f64, bottom: f64, material: MaterialId) {
    world.quadrics.add(quadric([0.0; 3], [0.0, 1.0, 0.0], -top), material, OBJECT);
    world.quadrics.add(quadric([0.0; 3], [0.0, -1.0, 0.0], bottom), material, OBJECT);
}

#[test]
fn a_plane_slab_moves_the_image_behind_it_by_what_the_textbook_says() {
    let (thickness, ior) = (0.7, 1.6);
    let (mut world, body) = world_of(&glass(0.0, 1.0, ior));
    add_slab(&mut world, 0.0, -thickness, body);
    let red = world.materials.add(&glow(DVec3::new(1.0, 0.0, 0.0)));
    let blue = world.materials.add(&glow(DVec3::new(0.0, 0.0, 1.0)));
    // Stripes of width 0.5 on the plane y = -3, red and blue in turn.
    for stripe in -40..40 {
        let (left, right) = (0.5 * stripe as f32, 0.5 * (stripe + 1) as f32);
        let corners = [(left, 50.0), (right, 50.0), (right, -50.0), (left, -50.0)];
        let positions = corners.map(|(x, z)| Vec3::new(x, -3.0, z)).to_vec();
        let material = if stripe % 2 == 0 { red } else { blue };
        let triangles = vec![[0, 1, 2], [0, 2, 3]];
        world.add_mesh(MeshInput { positions, triangles, material, object: OBJECT, ..MeshInput::default() }).unwrap();
    }
    let camera = camera(DVec3::new(-3.0, 2.0, 1.0), DVec3::new(0.0, -1.0, -1.0), 50.0, 160, 120);
    let rendered = shoot(&world, &camera, 3);
    assert_eq!(rendered.rays.refraction, 2 * rendered.rays.camera);
    let mut n_moved = 0;
    for (x, y) in (0..120).flat_map(|y| (0..160).map(move |x| (x, y))) {
        let d = pixel_direction(&camera, x, y);
        // Inside of the slab the sine of the angle to the vertical is 1/ior of that outside.
        let across = (1.0 - d.y * d.y).sqrt();
        let inside = across / ior;
        let run =
            (eye(&camera).y + 3.0 - thickness) * across / -d.y + thickness * inside / (1.0 - inside * inside).sqrt();
        let met = eye(&camera).x + run * d.x / across;
        let unmoved = eye(&camera).x - (eye(&camera).y + 3.0) * d.x / d.y;
        let stripe = |x: f64| (x / 0.5).floor();
        if (met / 0.5 - (met / 0.5).round()).abs() < 1e-9 {
            continue;
        }
        let expected = if stripe(met).rem_euclid(2.0) == 0.0 { DVec3::X } else { DVec3::Z };
        assert_eq!(rgb(&rendered.film, x, y), expected, "{x},{y}");
        n_moved += usize::from(stripe(unmoved) != stripe(met));
    }
    assert!(n_moved > 1000, "the slab must matter: {n_moved}");
}

#[test]
fn reflection_is_total_beyond_the_critical_angle_and_takes_the_weight_of_both_rays() {
    let (k_s, k_t, ior) = (0.25, 0.5, 1.5);
    let (mut world, water) = world_of(&glass(k_s, k_t, ior));
    world.background = DVec3::new(0.5, 0.75, 1.0);
    // The camera is under water; the ground glows.
    world.quadrics.add(quadric([0.0; 3], [0.0, 1.0, 0.0], 0.0), water, OBJECT);
    let ground = DVec3::new(0.5, 0.25, 0.125);
    let ground_material = world.materials.add(&glow(ground));
    world.quadrics.add(quadric([0.0; 3], [0.0, 1.0, 0.0], 8.0), ground_material, OBJECT);
    for two_sided in [false, true] {
        world.two_sided = two_sided;
        let camera = camera(DVec3::new(0.0, -2.0, 0.0), DVec3::new(0.0, 0.0, -2.0), 80.0, 101, 83);
        let rendered = shoot(&world, &camera, 5);
        let (mut n_total, mut n_partial) = (0, 0);
        for (x, y) in (0..83).flat_map(|y| (0..101).map(move |x| (x, y))) {
            let d = pixel_direction(&camera, x, y);
            let sine_outside = ior * (1.0 - d.y * d.y).sqrt();
            if d.y <= 0.0 || (sine_outside - 1.0).abs() < 1e-9 {
                continue;
            }
            let is_total = sine_outside > 1.0;
            let expected = if is_total { (k_s + k_t) * ground } else { k_s * ground + k_t * world.background };
            assert_eq!(rgb(&rendered.film, x, y), expected, "{x},{y}");
            *(if is_total { &mut n_total } else { &mut n_partial }) += 1;
        }
        assert!(n_total > 1000 && n_partial > 1000, "{n_total} {n_partial}");
        // Every hit on the water is tried and mirrors, whether totally or not.
        assert_eq!((rendered.rays.refraction, rendered.rays.reflection), (n_total + n_partial, n_total + n_partial));
    }
}

/// What a ray carries that meets a slab of which each side mirrors `k_s` and lets `k_t` through, in a sky of radiance 1:
/// `depth` rays are left, this one included.
fn slab_series(k_s: f64, k_t: f64, inside: bool, depth: u32) -> f64 {
    if depth == 1 {
        return 0.0;
    }
    let within = slab_series(k_s, k_t, true, depth - 1);
    if inside { k_s * within + k_t } else { k_s + k_t * within }
}

#[test]
fn what_is_mirrored_and_what_passes_a_slab_sum_up_to_all_but_the_rays_that_were_not_sent() {
    for (k_s, k_t) in [(0.25, 0.75), (0.5, 0.5), (0.125, 0.5)] {
        let (mut world, body) = world_of(&glass(k_s, k_t, 1.5));
        world.background = DVec3::ONE;
        add_slab(&mut world, 0.0, -1.0, body);
        let camera = camera(DVec3::new(0.0, 3.0, 0.0), DVec3::new(0.5, 0.0, -1.0), 40.0, 24, 18);
        let mut before = 0.0;
        for depth in [1, 2, 3, 4, 8, 16, 24] {
            let rendered = shoot(&world, &camera, depth);
            let expected = slab_series(k_s, k_t, false, depth);
            for (x, y) in (0..18).flat_map(|y| (0..24).map(move |x| (x, y))) {
                let found = rgb(&rendered.film, x, y);
                assert!((found - expected).abs().max_element() <= F32_FILM * expected, "{depth}: {found} {expected}");
            }
            assert!(expected >= before && expected <= 1.0, "{expected}");
            before = expected;
        }
        if k_s + k_t == 1.0 {
            assert!(1.0 - before < 1e-5, "nothing is lost: {before}");
        }
    }
}

#[test]
fn an_index_of_one_is_not_seen() {
    let (mut world, air) = world_of(&glass(0.0, 1.0, 1.0));
    let ball = world.materials.add(&Material { diffuse: DVec3::new(0.9, 0.5, 0.1), ..Material::default() });
    world.background = DVec3::new(0.25, 0.5, 0.75);
    world.lights.add(DVec3::new(-20.0, 30.0, 40.0), DVec3::ONE);
    world.spheres.add(DVec3::new(0.5, 0.0, -6.0), 1.0, ball, OBJECT);
    let camera = camera(DVec3::ZERO, DVec3::new(0.0, 0.0, -6.0), 30.0, 48, 40);
    let without = shoot(&world, &camera, 5);
    // Between the camera and the ball; light falls on the ball from the side.
    world.spheres.add(DVec3::new(0.0, 0.0, -3.0), 0.6, air, OBJECT);
    let with = shoot(&world, &camera, 5);
    assert!(with.rays.refraction > 500 && without.rays.refraction == 0);
    for (x, y) in (0..40).flat_map(|y| (0..48).map(move |x| (x, y))) {
        let (a, b) = (rgb(&without.film, x, y), rgb(&with.film, x, y));
        assert!((a - b).abs().max_element() < 1e-6, "{x},{y}: {a} {b}");
    }
}

#[test]
fn a_world_that_lets_no_light_through_has_no_refraction_among_its_features() {
    let (mut world, _) = world_of(&Material { k_s: 0.5, ior: 2.0, ..Material::default() });
    assert!(!world.features().refraction && world.features().reflection);
    world.materials.add(&Material { k_t: 0.5, ..Material::default() });
    assert!(world.features().refraction);
}

#[test]
fn the_inside_of_a_smooth_mesh_is_told_by_its_winding_and_bent_by_its_normals() {
    // A coarse prism with the normals of a cylinder about z, seen along −z from above: front faces are outside.
    let (mut world, glass) = world_of(&glass(0.0, 1.0, 1.5));
    world.background = DVec3::ONE;
    let n = 12;
    let ring: Vec<Vec3> = (0..n)
        .flat_map(|i| {
            let (sine, cosine) = (std::f32::consts::TAU * i as f32 / n as f32).sin_cos();
            [Vec3::new(cosine, sine, 0.0), Vec3::new(cosine, sine, -4.0)]
        })
        .collect();
    let normals = ring.iter().map(|p| Vec3::new(p.x, p.y, 0.0)).collect();
    let triangles = (0..n as u32)
        .flat_map(|i| {
            let (a, b) = (2 * i, 2 * ((i + 1) % n as u32));
            [[a, a + 1, b + 1], [a, b + 1, b]]
        })
        .collect();
    let normals = Some(normals);
    let mesh =
        MeshInput { positions: ring, triangles, normals, material: glass, object: OBJECT, ..MeshInput::default() };
    world.add_mesh(mesh).unwrap();
    let camera = camera(DVec3::new(0.1, 5.0, -2.0), DVec3::new(0.1, 0.0, -2.0), 12.0, 32, 32);
    for (terminator, sampler) in [(false, Sampler::Center), (true, Sampler::Center)] {
        let settings = Settings { terminator, sampler, max_depth: 3, ..center_settings(&camera) };
        let rendered = render_world(&world, &camera, &settings);
        // In through one side, out through the other, and the sky behind: no ray is lost and none is reflected.
        assert_eq!((rendered.rays.refraction, rendered.rays.reflection), (2 * 32 * 32, 0));
        assert!((0..32).all(|x| rgb(&rendered.film, x, 16) == DVec3::ONE));
    }
}
