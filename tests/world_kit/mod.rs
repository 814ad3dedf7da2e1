//! Building worlds and rendering them in a test.

// Every test file takes what it needs of it.
#![allow(dead_code)]

use std::path::Path;

use flatray::accel::{Accel, AccelKind};
use flatray::film::{Film, Region};
use flatray::render::{Control, Rendered, Sampler, Settings, render};
use flatray::scene::{self, Compiled, Overrides};
use flatray::world::{Camera, Hit, Material, MaterialId, Ray, World};
use glam::{DMat4, DVec3};

/// The names of all scenes in `scenes/`, without `.toml`, sorted.
pub fn scene_names() -> Vec<String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut names: Vec<String> = files
        .filter(|path| path.extension().is_some_and(|extension| extension == "toml"))
        .map(|path| path.file_stem().unwrap().to_str().unwrap().to_string())
        .collect();
    names.sort();
    assert!(names.len() >= 12, "only {} scenes found", names.len());
    names
}

/// A scene of `scenes/` at another size.
pub fn load_scene(name: &str, width_px: u32, height_px: u32) -> Compiled {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name).with_extension("toml");
    let overrides = Overrides { width_px: Some(width_px), height_px: Some(height_px), ..Overrides::default() };
    scene::load(&path, &overrides).unwrap_or_else(|error| panic!("{error}"))
}

/// One centre sample over the whole image, depth 5, two threads.
pub fn center_settings(camera: &Camera) -> Settings {
    Settings {
        samples: 1,
        sampler: Sampler::Center,
        seed: 0,
        max_depth: 5,
        tile_size_px: 32,
        threads: 2,
        region: Region::whole(camera.width_px, camera.height_px),
        terminator: false,
        course: false,
    }
}

/// The original's mode: four samples on a grid, depth 5, clamped, f64 planes.
pub fn course_settings(camera: &Camera) -> Settings {
    Settings { samples: 4, sampler: Sampler::Grid, course: true, ..center_settings(camera) }
}

/// Renders with a BVH.
pub fn render_world(world: &World, camera: &Camera, settings: &Settings) -> Rendered {
    let accel = Accel::build(world, AccelKind::Bvh);
    render(world, &accel, camera, settings, &Control::default()).unwrap()
}

/// Red, green and blue of a pixel of the whole image.
pub fn rgb(film: &Film, x: u32, y: u32) -> DVec3 {
    let index = film.data_window.index_of(x, y);
    DVec3::from_array(film.color_planes().unwrap().map(|plane| plane.samples.get(index)))
}

/// How much of a pixel is covered by objects.
pub fn coverage(film: &Film, x: u32, y: u32) -> f64 {
    film.plane("A").unwrap().samples.get(film.data_window.index_of(x, y))
}

/// A camera at `position` that looks at `target`, y up unless it looks along y.
pub fn camera(position: DVec3, target: DVec3, fov_y_degrees: f64, width_px: u32, height_px: u32) -> Camera {
    let along_y = (target - position).cross(DVec3::Y).length() < 1e-9 * (target - position).length();
    let up = if along_y { DVec3::Z } else { DVec3::Y };
    let world_from_camera = Camera::look_at_frame(position, target, up).unwrap();
    Camera { world_from_camera, fov_y_radians: fov_y_degrees.to_radians(), width_px, height_px }
}

/// The unit direction through the centre of a pixel, from the definition of a pinhole camera.
pub fn pixel_direction(camera: &Camera, x: u32, y: u32) -> DVec3 {
    let half_height = (0.5 * camera.fov_y_radians).tan();
    let pixel = 2.0 * half_height / f64::from(camera.height_px);
    let right = (f64::from(x) + 0.5 - 0.5 * f64::from(camera.width_px)) * pixel;
    let up = (0.5 * f64::from(camera.height_px) - f64::from(y) - 0.5) * pixel;
    camera.world_from_camera.transform_vector3(DVec3::new(right, up, -1.0)).normalize()
}

/// Where a camera stands.
pub fn eye(camera: &Camera) -> DVec3 {
    camera.world_from_camera.w_axis.truncate()
}

/// The symmetric matrix with XᵀAX = xx·x² + yy·y² + zz·z² + x·X + y·Y + z·Z + constant, without mixed terms.
pub fn quadric(squares: [f64; 3], linear: [f64; 3], constant: f64) -> DMat4 {
    let ([a, b, c], [g, h, i]) = (squares, linear.map(|term| 0.5 * term));
    DMat4::from_cols_array_2d(&[[a, 0.0, 0.0, g], [0.0, b, 0.0, h], [0.0, 0.0, c, i], [g, h, i, constant]])
}

/// A world with one material.
pub fn world_of(material: &Material) -> (World, MaterialId) {
    let mut world = World::default();
    let id = world.materials.add(material);
    (world, id)
}

/// The closest hit of one ray, by the BVH and by the full scan, which must agree.
pub fn closest_hit(world: &World, ray: Ray) -> Hit {
    let [bvh, linear] = [AccelKind::Bvh, AccelKind::Linear].map(|kind| {
        let mut hits = [Hit::MISS];
        Accel::build(world, kind).closest_hit(world, &[ray], &mut hits);
        hits[0]
    });
    assert_eq!(bvh, linear, "{ray:?}");
    bvh
}
