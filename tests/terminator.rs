//! The terminator correction in the renderer: what it lights, and what it leaves as it was.

/// Building worlds and rendering them.
mod world_kit {
    pub mod eye;
    pub mod hit;
    pub mod pinhole;
    pub mod pixel;
    pub mod rendering;
    pub mod scenes;
    pub mod settings;
}

use flatray::film::Film;
use flatray::measure::stress::mesh::lat_long;
use flatray::render::Settings;
use flatray::render::surface::shading_normal;
use flatray::world::{Camera, Material, MeshInput, Ray, World};
use glam::{DVec3, dvec3};
use world_kit::eye::{eye, pixel_direction};
use world_kit::hit::closest_hit;
use world_kit::pinhole::camera;
use world_kit::pixel::rgb;
use world_kit::rendering::render_world;
use world_kit::scenes::{load_scene, scene_names};
use world_kit::settings::center_settings;

const SIZE_PX: u32 = 96;
const LIGHT: DVec3 = dvec3(4e3, 1e3, 0.0);

fn view() -> Camera {
    camera(dvec3(0.0, 1.0, 3.0), DVec3::ZERO, 45.0, SIZE_PX, SIZE_PX)
}

/// A white sphere of 8 segments and 4 rings under a light from the side.
fn coarse_sphere(two_sided: bool) -> World {
    let mut world = World { two_sided, ..World::default() };
    let white = Material { ambient: DVec3::ZERO, diffuse: DVec3::ONE, k_d: 1.0, k_s: 0.0, ..Material::default() };
    let material = world.materials.add(&white);
    let mesh = lat_long(8, 4);
    let normals = Some(mesh.positions.clone());
    world.add_mesh(MeshInput { normals, material, ..mesh.input() }).unwrap();
    world.lights.add(LIGHT, DVec3::ONE);
    world
}

/// The cosine to the light at each pixel, by the interpolated normal; `None` beside the sphere.
fn cosines(world: &World) -> Vec<Option<f64>> {
    let view = view();
    let at = |index: u32| {
        let ray = Ray::new(eye(&view), pixel_direction(&view, index % SIZE_PX, index / SIZE_PX));
        let hit = closest_hit(world, ray);
        let point = ray.at(hit.t);
        hit.is_some().then(|| shading_normal(world, &hit, DVec3::Y).dot((LIGHT - point).normalize()))
    };
    (0..SIZE_PX * SIZE_PX).map(at).collect()
}

fn film(world: &World, terminator: bool) -> Film {
    let view = view();
    render_world(world, &view, &Settings { terminator, ..center_settings(&view) }).film
}

#[test]
fn the_correction_lights_every_point_that_faces_the_light_and_no_other() {
    let cosines = cosines(&coarse_sphere(false));
    for two_sided in [false, true] {
        let world = coarse_sphere(two_sided);
        let [plain, corrected] = [false, true].map(|terminator| film(&world, terminator));
        let (mut n_lit, mut n_teeth) = (0, 0);
        for (index, cosine) in cosines.iter().enumerate() {
            let (x, y) = (index as u32 % SIZE_PX, index as u32 / SIZE_PX);
            let expected = cosine.unwrap_or(0.0).max(0.0);
            let got = rgb(&corrected, x, y).x;
            assert!((got - expected).abs() < 1e-5, "{x},{y}: {got}, not {expected}");
            n_lit += u32::from(expected > 1e-4);
            n_teeth += u32::from(expected > 1e-4 && rgb(&plain, x, y).x == 0.0);
        }
        assert!(n_lit > 1000 && n_teeth > 50, "{n_teeth} of {n_lit} are black without the correction");
    }
}

#[test]
fn what_is_not_a_smooth_mesh_does_not_change_by_a_bit() {
    let mut n_flat = 0;
    for name in scene_names() {
        let scene = load_scene(&name, 48, 36);
        if scene.world.features().smooth_normals {
            continue;
        }
        let [off, on] = [false, true].map(|terminator| {
            let settings = Settings { terminator, ..center_settings(&scene.camera) };
            render_world(&scene.world, &scene.camera, &settings).film
        });
        assert_eq!(off, on, "{name}");
        n_flat += 1;
    }
    assert!(n_flat >= 4, "{n_flat}");
}
