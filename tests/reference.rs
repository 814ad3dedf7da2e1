//! References against pixels whose integral is known otherwise, and against the floor that they state.

/// Building worlds and rendering them.
mod world_kit {
    pub mod material;
    pub mod pinhole;
    pub mod pixel;
    pub mod quadric;
}

use flatray::accel::{Accel, AccelKind};
use flatray::film::{Film, Plane, Samples};
use flatray::measure::error::frame::Frame;
use flatray::measure::error::reference::{Reference, make};
use flatray::render::camera_ray::CameraRays;
use flatray::render::{Control, Settings};
use flatray::world::{Camera, Material, MeshInput, ObjectId, World};
use glam::{DVec2, DVec3, Vec3};
use world_kit::material::world_of;
use world_kit::pinhole::camera;
use world_kit::pixel::rgb;
use world_kit::quadric::quadric;

const OBJECT: ObjectId = ObjectId(0);

/// White light of its own, nothing else.
fn glow() -> Material {
    Material { ambient: DVec3::ONE, k_a: 1.0, k_d: 0.0, k_s: 0.0, ..Material::default() }
}

fn reference(world: &World, camera: &Camera, kind: AccelKind, samples: u32) -> Reference {
    let settings = Settings { threads: 2, ..Settings::new(camera) };
    let frame = Frame { world, camera, settings: &settings };
    make(&frame, &Accel::build(world, kind), samples, &Control::default()).unwrap()
}

/// Compares all pixels with their integrals, and the error of the whole with the floor.
fn check(reference: &Reference, integral: impl Fn(u32, u32) -> f64, largest: f64) {
    let Film { width_px, height_px, data_window, .. } = reference.film;
    let pixels = (0..height_px).flat_map(|y| (0..width_px).map(move |x| (x, y)));
    let truth: Vec<f32> = pixels.map(|(x, y)| integral(x, y) as f32).collect();
    assert!(truth.iter().any(|&value| value > 0.01 && value < 0.99), "the test has an edge");
    let planes = ["R", "G", "B"].map(|name| Plane::color(name, Samples::F32(truth.clone()))).into();
    let rmse = reference.rmse_of(&Film { width_px, height_px, data_window, planes }).unwrap();
    assert!(reference.floor > 0.0 && rmse <= 3.0 * reference.floor, "{rmse:e}, floor {:e}", reference.floor);
    assert!(rmse >= reference.floor / 3.0, "{rmse:e} is far below the floor {:e}", reference.floor);
    assert!(rmse <= largest, "{rmse:e}");
}

/// Area of the part of a disc of radius 1 around the origin that lies left of and below a point.
fn quadrant_of_disc(x: f64, y: f64) -> f64 {
    // ∫ of the chord below y, from -1 to x: of √(1 − t²) the antiderivative is (t·√(1 − t²) + asin t)/2.
    let primitive = |t: f64| 0.5 * (t * (1.0 - t * t).max(0.0).sqrt() + t.clamp(-1.0, 1.0).asin());
    let (x, y) = (x.clamp(-1.0, 1.0), y.clamp(-1.0, 1.0));
    let reach = (1.0 - y * y).sqrt();
    // Where |t| < reach the chord ends at y; elsewhere it is whole for y > 0, and empty for y < 0.
    let between = |from: f64, to: f64| primitive(to) - primitive(from);
    let inner = |from: f64, to: f64| if to > from { between(from, to) + y * (to - from) } else { 0.0 };
    let outer = |from: f64, to: f64| if to > from && y > 0.0 { 2.0 * between(from, to) } else { 0.0 };
    outer(-1.0, x.min(-reach)) + inner(-reach, x.clamp(-reach, reach)) + outer(reach, x)
}

#[test]
fn quarters_of_a_disc_have_their_areas() {
    let quarter = std::f64::consts::FRAC_PI_4;
    for (x, y, quarters) in [(0.0, 0.0, 1.0), (1.0, 0.0, 2.0), (0.0, 2.0, 2.0), (3.0, 1.0, 4.0), (-1.0, 1.0, 0.0)] {
        assert!((quadrant_of_disc(x, y) - quarters * quarter).abs() < 1e-14, "{x} {y}");
    }
    // Symmetric in its axes.
    assert!((quadrant_of_disc(0.3, -0.6) - quadrant_of_disc(-0.6, 0.3)).abs() < 1e-14);
}

#[test]
fn the_coverage_of_a_disc_is_its_area_in_each_pixel() {
    let (mut world, material) = world_of(&glow());
    // On the axis, so that its outline is a circle: of radius tan(asin(r/d)) at distance 1.
    world.spheres.add(DVec3::ZERO, 1.0, material, OBJECT);
    let camera = camera(DVec3::new(0.0, 0.0, 4.0), DVec3::ZERO, 36.0, 25, 19);
    let radius = 0.25f64.asin().tan() / (0.5 * camera.fov_y_radians).tan() * 0.5 * f64::from(camera.height_px);
    let place = |x: u32, y: u32| ((f64::from(x) - 12.5) / radius, (f64::from(y) - 9.5) / radius);
    let integral = |x: u32, y: u32| {
        let ((x0, y0), (x1, y1)) = (place(x, y), place(x + 1, y + 1));
        let area =
            quadrant_of_disc(x1, y1) - quadrant_of_disc(x0, y1) - quadrant_of_disc(x1, y0) + quadrant_of_disc(x0, y0);
        area * radius * radius
    };
    let by_tree = reference(&world, &camera, AccelKind::Bvh, 256);
    check(&by_tree, integral, 1e-4);
    assert_eq!(by_tree, reference(&world, &camera, AccelKind::Linear, 256), "the full scan makes the same reference");
}

#[test]
fn a_half_plane_covers_what_lies_behind_its_edge() {
    let (mut world, material) = world_of(&glow());
    // In the plane z = 0, seen straight: its edge is y = 0.3·x + 0.1, far longer than the image.
    let edge = |x: f32| Vec3::new(x, 0.3 * x + 0.1, 0.0);
    let positions = vec![edge(-100.0), edge(100.0), Vec3::new(0.0, -300.0, 0.0)];
    let line = |x: f64| {
        let (a, b) = (positions[0].as_dvec3(), positions[1].as_dvec3());
        a.y + (x - a.x) * (b.y - a.y) / (b.x - a.x)
    };
    let mesh = MeshInput { positions: positions.clone(), triangles: vec![[1, 0, 2]], material, ..MeshInput::default() };
    world.add_mesh(mesh).unwrap();
    let camera = camera(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, 40.0, 22, 16);
    let pixel = 2.0 * 3.0 * (0.5 * camera.fov_y_radians).tan() / 16.0;
    let integral = |x: u32, y: u32| {
        // Height of what is below the line in the pixel's column at x, cut to the pixel; its mean by the vertices of the cut.
        let corner = DVec2::new((f64::from(x) - 11.0) * pixel, (8.0 - f64::from(y) - 1.0) * pixel);
        let height = |u: f64| (line(corner.x + u * pixel) - corner.y) / pixel;
        let (h0, h1) = (height(0.0), height(1.0));
        // ∫ clamp(h) over u: h is linear, so that the integral of max(h, 0) is a difference of squares.
        let above_zero = |h0: f64, h1: f64| {
            let square = |h: f64| h.max(0.0) * h.max(0.0);
            (square(h1) - square(h0)) / (2.0 * (h1 - h0))
        };
        above_zero(h0, h1) - above_zero(h0 - 1.0, h1 - 1.0)
    };
    check(&reference(&world, &camera, AccelKind::Bvh, 256), integral, 2e-4);
}

#[test]
fn a_ball_under_a_point_light_has_the_mean_of_its_smooth_shading() {
    let matte = Material { k_a: 0.0, k_d: 1.0, ..glow() };
    let (mut world, material) = world_of(&matte);
    let (radius, light) = (1.0, DVec3::new(3.0, 4.0, 9.0));
    world.spheres.add(DVec3::ZERO, radius, material, OBJECT);
    world.lights.add(light, DVec3::ONE);
    let camera = camera(DVec3::new(0.0, 0.0, 4.0), DVec3::ZERO, 12.0, 10, 8);
    let rays = CameraRays::new(&camera);
    let radiance = |x: f64, y: f64| {
        let ray = rays.ray(x, y);
        let foot = -ray.origin.dot(ray.direction);
        let miss = (ray.origin + foot * ray.direction).length_squared();
        let p = ray.origin + (foot - (radius * radius - miss).sqrt()) * ray.direction;
        p.dot((light - p).normalize()).max(0.0)
    };
    let made = reference(&world, &camera, AccelKind::Bvh, 1024);
    // Gauss and Legendre's rule of three points in each of 8 by 8 parts: exact far beyond what is compared.
    let nodes = [(-(0.6f64.sqrt()), 5.0 / 18.0), (0.0, 8.0 / 18.0), (0.6f64.sqrt(), 5.0 / 18.0)];
    for (x, y) in (0..8).flat_map(|y| (0..10).map(move |x| (x, y))) {
        let mut mean = 0.0;
        for (i, j) in (0..8).flat_map(|j| (0..8).map(move |i| (f64::from(i), f64::from(j)))) {
            for ((u, w), (v, z)) in nodes.iter().flat_map(|&a| nodes.iter().map(move |&b| (a, b))) {
                let at = |whole: u32, part: f64, node: f64| f64::from(whole) + (part + 0.5 + 0.5 * node) / 8.0;
                mean += w * z / 64.0 * radiance(at(x, i, u), at(y, j, v));
            }
        }
        let found = rgb(&made.film, x, y);
        assert!((found - mean).abs().max_element() <= 2e-6, "{x},{y}: {found} for {mean}");
    }
    assert!(made.floor <= 1e-6, "{:e}", made.floor);
}

#[test]
fn two_facing_mirrors_have_no_error_at_all() {
    let mirror = Material { ambient: DVec3::new(0.05, 0.02, 0.03), k_s: 0.75, specular: DVec3::ZERO, ..glow() };
    let (mut world, material) = world_of(&mirror);
    world.quadrics.add(quadric([0.0; 3], [0.0, 0.0, 1.0], 2.0), material, OBJECT);
    world.quadrics.add(quadric([0.0; 3], [0.0, 0.0, -1.0], 3.0), material, OBJECT);
    let camera = camera(DVec3::new(0.3, 0.2, 1.0), DVec3::new(0.5, 0.1, -2.0), 60.0, 12, 9);
    let made = reference(&world, &camera, AccelKind::Bvh, 64);
    // Five rays of a chain: glow·(1 + k + k² + k³ + k⁴).
    let series: f64 = (0..5).map(|bounce| 0.75f64.powi(bounce)).sum();
    let truth = (series * mirror.ambient).as_vec3().as_dvec3();
    assert_eq!(made.floor, 0.0);
    for (x, y) in (0..9).flat_map(|y| (0..12).map(move |x| (x, y))) {
        assert!((rgb(&made.film, x, y) - truth).abs().max_element() <= 1e-7, "{}", rgb(&made.film, x, y));
    }
}
