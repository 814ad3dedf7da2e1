//! Pixels whose radiance has a closed form, worked out here from geometry and the formula of the model alone.
//!
//! Tolerances. The f32 film rounds once, by at most 2⁻²⁴ of the value; the limit is twice that. The f64 film of the course
//! mode shows the arithmetic itself: some hundred roundings of 2⁻⁵³, enlarged by the exponent of a highlight (up to 40)
//! and by the inverse cosine of the angle of incidence (up to 10, flatter pixels are left out): below 2⁻⁵³·2⁷·2⁶·2⁴ = 2⁻³⁶.

/// Building worlds and rendering them.
mod world_kit {
    pub mod coverage;
    pub mod eye;
    pub mod material;
    pub mod pinhole;
    pub mod pixel;
    pub mod quadric;
    pub mod rendering;
    pub mod settings;
}

use flatray::numeric::clip::Clip;
use flatray::render::Settings;
use flatray::world::{Camera, Material, MaterialId, MeshInput, ObjectId, World};
use glam::{DMat4, DVec3, Vec3};
use world_kit::coverage::coverage;
use world_kit::eye::{eye, pixel_direction};
use world_kit::material::world_of;
use world_kit::pinhole::camera;
use world_kit::pixel::rgb;
use world_kit::quadric::quadric;
use world_kit::rendering::render_world;
use world_kit::settings::center_settings;

const F32_FILM: f64 = 1.0 / (1u64 << 23) as f64;
const F64_FILM: f64 = 1.0 / (1u64 << 36) as f64;

/// Flatter angles of incidence than this cosine are not compared.
const FLATTEST: f64 = 0.1;

const OBJECT: ObjectId = ObjectId(0);

/// A material with a different number in every place.
fn paint() -> Material {
    Material {
        ambient: DVec3::new(0.9, 0.5, 0.3),
        diffuse: DVec3::new(0.3, 0.6, 0.7),
        specular: DVec3::new(0.8, 0.7, 0.6),
        k_a: 0.15,
        k_d: 0.55,
        k_s: 0.2,
        reflectance: None,
        shininess: 40.0,
        ..Material::default()
    }
}

/// The background, which mirrors show.
const SKY: DVec3 = DVec3::new(0.125, 0.25, 0.5);

/// The model for one light of white intensity, without the mirrored part: `n`, `l`, `v` unit vectors, `visible` whether
/// the light is.
fn phong(m: &Material, n: DVec3, l: DVec3, v: DVec3, intensity: f64, visible: bool) -> DVec3 {
    let ambient = m.k_a * m.ambient;
    if n.dot(l) <= 0.0 || !visible {
        return ambient;
    }
    let r = l.reject_from_normalized(n) * -1.0 + l.project_onto_normalized(n);
    let highlight = r.dot(v).max(0.0).powf(m.shininess);
    ambient + intensity * (m.k_d * n.dot(l) * m.diffuse + m.k_s * highlight * m.specular)
}

/// What a pixel must show: nothing but the background, a radiance, or something that this test does not say.
enum Expected {
    Sky,
    Radiance(DVec3),
    Unsaid,
}

/// Compares all pixels, in the f32 film and in the f64 film, and wants at least `least` of them to show an object.
fn check(world: &World, camera: &Camera, max_depth: u32, least: usize, expected: impl Fn(DVec3) -> Expected) {
    for (course, tolerance) in [(false, F32_FILM), (true, F64_FILM)] {
        let settings = Settings { course, max_depth, ..center_settings(camera) };
        let film = render_world(world, camera, &settings).film;
        let mut n_compared = 0;
        for (x, y) in (0..camera.height_px).flat_map(|y| (0..camera.width_px).map(move |x| (x, y))) {
            let (radiance, covered) = match expected(pixel_direction(camera, x, y)) {
                Expected::Sky => (SKY, 0.0),
                Expected::Radiance(radiance) => (radiance, 1.0),
                Expected::Unsaid => continue,
            };
            assert!(radiance.max_element() <= 1.0, "the test must stay below the clamp of the course mode: {radiance}");
            let found = rgb(&film, x, y);
            let error = ((found - radiance) / radiance).abs().max_element();
            assert!(error <= tolerance, "{x},{y}, course {course}: {found} for {radiance}, relative error {error:e}");
            assert_eq!(coverage(&film, x, y), covered, "{x},{y}");
            n_compared += usize::from(covered == 1.0);
        }
        assert!(n_compared >= least, "only {n_compared} pixels compared");
    }
}

/// A world with the paint, the sky, and one light.
fn lit_world(light: DVec3, intensity: f64) -> (World, MaterialId) {
    let (mut world, paint) = world_of(&paint());
    world.background = SKY;
    world.lights.add(light, DVec3::splat(intensity));
    (world, paint)
}

#[test]
fn a_lit_sphere_mirrors_the_sky() {
    let (center, radius, light) = (DVec3::new(0.5, -0.25, -4.0), 1.25, DVec3::new(3.0, 4.0, 1.0));
    let (mut world, material) = lit_world(light, 0.7);
    world.spheres.add(center, radius, material, OBJECT);
    let camera = camera(DVec3::new(0.2, 0.3, 1.0), center, 40.0, 61, 47);
    check(&world, &camera, 5, 500, |d| {
        // The foot of the perpendicular from the centre, and half the chord.
        let foot = (center - eye(&camera)).dot(d);
        let miss = (eye(&camera) + foot * d - center).length();
        if miss > radius {
            return Expected::Sky;
        }
        let p = eye(&camera) + (foot - (radius * radius - miss * miss).sqrt()) * d;
        let n = (p - center) / radius;
        if n.dot(-d) < FLATTEST {
            return Expected::Unsaid;
        }
        // A ball throws no shadow on the side that faces the light, and reflects every ray into the sky.
        let local = phong(&paint(), n, (light - p).normalize(), -d, 0.7, true);
        Expected::Radiance(local + paint().k_s * SKY)
    });
}

/// The floor y = 0 under a light at `light`, with the shadow of a ball; a mirror image of the ball is not described.
fn check_floor(floor: impl Fn(&mut World, MaterialId), is_on_floor: impl Fn(DVec3) -> bool) {
    let (light, center, radius) = (DVec3::new(1.0, 6.0, 0.5), DVec3::new(0.25, 2.0, 0.0), 0.75);
    let (mut world, material) = lit_world(light, 0.8);
    floor(&mut world, material);
    world.spheres.add(center, radius, material, OBJECT);
    // The camera stands above the ball, so that no ray that leaves the floor for the sky is in doubt.
    let camera = camera(DVec3::new(-3.0, 5.0, 6.0), DVec3::ZERO, 50.0, 64, 48);
    let distance_to_ball = |origin: DVec3, direction: DVec3| {
        let along = (center - origin).dot(direction).max(0.0);
        (origin + along * direction - center).length()
    };
    let n_dark = std::cell::Cell::new(0);
    check(&world, &camera, 5, 1500, |d| {
        if distance_to_ball(eye(&camera), d) < radius * 1.01 {
            return Expected::Unsaid;
        }
        let p = eye(&camera) - eye(&camera).y / d.y * d;
        if d.y >= 0.0 || !is_on_floor(p) {
            return if d.y > 0.0 { Expected::Sky } else { Expected::Unsaid };
        }
        let mirrored = DVec3::new(d.x, -d.y, d.z);
        let l = (light - p).normalize();
        let outline = distance_to_ball(p, l) / radius;
        if d.y.abs() < FLATTEST || distance_to_ball(p, mirrored) < radius * 1.01 || (outline - 1.0).abs() < 1e-9 {
            return Expected::Unsaid;
        }
        n_dark.set(n_dark.get() + usize::from(outline < 1.0));
        Expected::Radiance(phong(&paint(), DVec3::Y, l, -d, 0.8, outline > 1.0) + paint().k_s * SKY)
    });
    assert!(n_dark.get() > 50, "{} pixels in the shadow", n_dark.get());
}

#[test]
fn a_plane_under_a_light_shows_the_round_shadow_of_a_ball() {
    let plane = quadric([0.0; 3], [0.0, 1.0, 0.0], 0.0);
    check_floor(|world, material| world.quadrics.add(plane, material, OBJECT), |_| true);
}

#[test]
fn a_triangle_under_a_light_shows_the_same_as_a_plane() {
    let corners = [Vec3::new(-100.0, 0.0, 70.0), Vec3::new(100.0, 0.0, 70.0), Vec3::new(0.0, 0.0, -90.0)];
    let add = |world: &mut World, material| {
        let mesh = MeshInput { positions: corners.into(), triangles: vec![[0, 1, 2]], material, ..Default::default() };
        world.add_mesh(mesh).unwrap();
    };
    // Well inside of all three edges.
    check_floor(add, |p| p.z < 69.0 && p.z > -80.0 && p.x.abs() < 0.55 * (p.z + 88.0));
}

#[test]
fn two_facing_mirrors_add_up_a_geometric_series_as_long_as_the_depth() {
    let glow = |color: DVec3, k_s| Material { ambient: color, k_a: 1.0, k_d: 0.0, k_s, ..paint() };
    let (near, far) = (DVec3::new(0.05, 0.02, 0.03), DVec3::new(0.01, 0.04, 0.06));
    let (k_near, k_far) = (0.75, 0.9);
    let (mut world, front) = world_of(&glow(near, k_near));
    let back = world.materials.add(&glow(far, k_far));
    world.background = SKY;
    // z = -2 faces +z, z = 3 faces -z.
    world.quadrics.add(quadric([0.0; 3], [0.0, 0.0, 1.0], 2.0), front, OBJECT);
    world.quadrics.add(quadric([0.0; 3], [0.0, 0.0, -1.0], 3.0), back, OBJECT);
    let camera = camera(DVec3::new(0.3, 0.2, 1.0), DVec3::new(0.5, 0.1, -2.0), 60.0, 20, 15);
    for max_depth in [1, 2, 3, 4, 5, 16, 200] {
        // Pairs of bounces: (near + k·far)·(1 + q + q² + …), and half a pair when the depth is odd.
        let q: f64 = k_near * k_far;
        let pairs = (1.0 - q.powi(max_depth / 2)) / (1.0 - q);
        let half = if max_depth % 2 == 1 { q.powi(max_depth / 2) * near } else { DVec3::ZERO };
        let radiance = (near + k_near * far) * pairs + half;
        check(&world, &camera, max_depth as u32, 300, |_| Expected::Radiance(radiance));
    }
}

/// A quadric of revolution about y, `x² + z² = radius(y)²`, lit by a light that nothing hides.
fn check_revolution(matrix: DMat4, eye_at: DVec3, look_at: DVec3, first_hit: impl Fn(DVec3) -> Option<(f64, DVec3)>) {
    let light = eye_at + DVec3::new(2.0, -0.5, 1.0);
    let (mut world, material) = lit_world(light, 0.6);
    world.quadrics.add(matrix, material, OBJECT);
    let camera = camera(eye_at, look_at, 45.0, 60, 44);
    // One ray only: what a double cone mirrors is not described here.
    check(&world, &camera, 1, 400, |d| {
        let Some((t, n)) = first_hit(d) else { return Expected::Unsaid };
        let p = eye(&camera) + t * d;
        let l = (light - p).normalize();
        if n.dot(-d) < FLATTEST || n.dot(l).abs() < 1e-9 {
            return Expected::Unsaid;
        }
        Expected::Radiance(phong(&paint(), n, l, -d, 0.6, true))
    });
}

#[test]
fn a_ball_in_the_sun_throws_a_shadow_that_does_not_grow() {
    let (center, radius, sun) = (DVec3::new(0.25, 2.0, 0.0), 0.75, DVec3::new(0.5, -2.0, -1.0));
    let (mut world, material) = world_of(&paint());
    world.background = SKY;
    world.lights.add_directional(3.0 * sun, DVec3::splat(0.8));
    world.quadrics.add(quadric([0.0; 3], [0.0, 1.0, 0.0], 0.0), material, OBJECT);
    world.spheres.add(center, radius, material, OBJECT);
    let camera = camera(DVec3::new(-3.0, 5.0, 6.0), DVec3::ZERO, 50.0, 64, 48);
    let l = -sun.normalize();
    let distance_to_line = |p: DVec3, direction: DVec3| (center - p).cross(direction).length();
    let n_dark = std::cell::Cell::new(0);
    // One ray only: the mirror images of ball and floor are not described.
    check(&world, &camera, 1, 1500, |d| {
        let off = distance_to_line(eye(&camera), d);
        if off < radius {
            let foot = eye(&camera) + (center - eye(&camera)).dot(d) * d;
            let p = foot - (radius * radius - off * off).sqrt() * d;
            let n = (p - center) / radius;
            // The floor, under the ball, hides no sun.
            let unsaid = n.dot(-d) < FLATTEST || n.dot(l).abs() < 1e-9;
            return if unsaid { Expected::Unsaid } else { Expected::Radiance(phong(&paint(), n, l, -d, 0.8, true)) };
        }
        if d.y >= 0.0 {
            return if d.y > 0.0 { Expected::Sky } else { Expected::Unsaid };
        }
        let p = eye(&camera) - eye(&camera).y / d.y * d;
        let outline = distance_to_line(p, l) / radius;
        if d.y.abs() < FLATTEST || (off / radius - 1.0).abs() < 1e-9 || (outline - 1.0).abs() < 1e-9 {
            return Expected::Unsaid;
        }
        n_dark.set(n_dark.get() + usize::from(outline < 1.0));
        Expected::Radiance(phong(&paint(), DVec3::Y, l, -d, 0.8, outline > 1.0))
    });
    assert!(n_dark.get() > 50, "{} pixels in the shadow", n_dark.get());
}

#[test]
fn a_tube_shows_its_inside_through_its_open_end() {
    let (radius, stand) = (0.8, DVec3::new(0.0, 3.5, 4.0));
    let light = stand + DVec3::new(0.5, 1.0, 0.0);
    let (mut world, material) = lit_world(light, 0.6);
    let matrix = quadric([1.0, 0.0, 1.0], [0.0; 3], -radius * radius);
    world.quadrics.add_clipped(matrix, Clip::along(-DVec3::Y, 2.0 * DVec3::Y), material, OBJECT);
    let camera = camera(stand, DVec3::ZERO, 40.0, 60, 44);
    let n_inside = std::cell::Cell::new(0);
    check(&world, &camera, 1, 400, |d| {
        let (a, b) = (d.x * d.x + d.z * d.z, d.x * stand.x + d.z * stand.z);
        let discriminant = b * b - a * (stand.x * stand.x + stand.z * stand.z - radius * radius);
        if discriminant < 0.0 {
            return Expected::Sky;
        }
        let roots = [(-b - discriminant.sqrt()) / a, (-b + discriminant.sqrt()) / a];
        let first = roots.map(|t| stand + t * d).into_iter().find(|p| p.y.abs() <= 1.0);
        let Some(p) = first else { return Expected::Sky };
        let n = DVec3::new(p.x, 0.0, p.z) / radius;
        let l = (light - p).normalize();
        if n.dot(-d).abs() < FLATTEST || n.dot(l).abs() < 1e-9 {
            return Expected::Unsaid;
        }
        // Inside, the normal points away from viewer and light.
        n_inside.set(n_inside.get() + usize::from(n.dot(d) > 0.0));
        Expected::Radiance(phong(&paint(), n, l, -d, 0.6, true))
    });
    assert!(n_inside.get() > 50, "{} pixels of the inside", n_inside.get());
}

#[test]
fn a_quadric_cylinder_is_a_circle_in_every_section() {
    let (radius, stand) = (0.8, DVec3::new(0.0, 0.5, 5.0));
    let matrix = quadric([1.0, 0.0, 1.0], [0.0; 3], -radius * radius);
    check_revolution(matrix, stand, DVec3::ZERO, |d| {
        // Seen from above: a circle at distance 5, a ray at an angle whose sine is `sin` to its middle.
        let flat = d.x.hypot(d.z);
        let (sin, cos) = (d.x / flat, -d.z / flat);
        let half_chord = radius * radius - (stand.z * sin).powi(2);
        if half_chord < 0.0 {
            return None;
        }
        let t = (stand.z * cos - half_chord.sqrt()) / flat;
        let p = stand + t * d;
        Some((t, DVec3::new(p.x, 0.0, p.z) / radius))
    });
}

#[test]
fn a_quadric_cone_has_the_normals_of_its_slant() {
    // x² + z² = (y/2)²; the camera and the light stay below the apex, so that the upper half hides nothing.
    let (slope, stand) = (0.5, DVec3::new(0.4, -1.5, 5.0));
    let matrix = quadric([1.0, -slope * slope, 1.0], [0.0; 3], 0.0);
    check_revolution(matrix, stand, DVec3::new(0.0, -1.8, 0.0), |d| {
        // With the axis as direction w = -y: (p·w)² = cos²·p·p, cos² = 1/(1 + slope²), for p = stand + t·d.
        let w = -DVec3::Y;
        let cos2 = 1.0 / (1.0 + slope * slope);
        let a = d.dot(w).powi(2) - cos2;
        let b = d.dot(w) * stand.dot(w) - cos2 * d.dot(stand);
        let c = stand.dot(w).powi(2) - cos2 * stand.length_squared();
        let discriminant = b * b - a * c;
        if discriminant < 1e-3 {
            return None;
        }
        let roots = [(-b - discriminant.sqrt()) / a, (-b + discriminant.sqrt()) / a];
        let t = roots.into_iter().filter(|&t| t > 0.0).fold(f64::INFINITY, f64::min);
        let p = stand + t * d;
        // Right angles to the slant: outwards by its cosine, along y by its sine.
        let outwards = DVec3::new(p.x, 0.0, p.z).normalize();
        let n = (outwards + slope * DVec3::Y) / (1.0 + slope * slope).sqrt();
        (t.is_finite() && p.y < -0.01).then_some((t, n))
    });
}

#[test]
fn a_phong_triangle_mixes_its_normals_by_areas() {
    let corners = [Vec3::new(-1.5, -1.0, 0.0), Vec3::new(2.0, -0.5, 0.0), Vec3::new(0.25, 1.75, 0.0)];
    let normals =
        [Vec3::new(-0.5, -0.4, 0.7), Vec3::new(0.6, -0.1, 0.6), Vec3::new(0.0, 0.9, 0.3)].map(|n| n.normalize());
    let light = DVec3::new(-2.0, 1.0, 3.0);
    let (mut world, material) = lit_world(light, 0.65);
    let mesh = MeshInput {
        positions: corners.into(),
        triangles: vec![[0, 1, 2]],
        normals: Some(normals.into()),
        material,
        parts: Vec::new(),
        object: OBJECT,
    };
    world.add_mesh(mesh).unwrap();
    let camera = camera(DVec3::new(0.5, 0.5, 4.0), DVec3::ZERO, 50.0, 60, 44);
    let [a, b, c] = corners.map(|corner| corner.as_dvec3());
    let area = |p: DVec3, q: DVec3, r: DVec3| 0.5 * (q - p).cross(r - p).z;
    check(&world, &camera, 5, 400, |d| {
        let p = eye(&camera) - eye(&camera).z / d.z * d;
        let shares = [area(p, b, c), area(a, p, c), area(a, b, p)].map(|part| part / area(a, b, c));
        let smallest = shares.into_iter().fold(1.0, f64::min);
        if smallest.abs() < 1e-9 {
            return Expected::Unsaid;
        }
        if smallest < 0.0 {
            return Expected::Sky;
        }
        let mixed: DVec3 = shares.iter().zip(normals).map(|(share, n)| *share * n.as_dvec3()).sum();
        let n = mixed.normalize();
        let l = (light - p).normalize();
        // One triangle hides no light from itself, and what it mirrors is the sky.
        Expected::Radiance(phong(&paint(), n, l, -d, 0.65, true) + paint().k_s * SKY)
    });
}
