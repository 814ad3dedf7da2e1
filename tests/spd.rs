//! The Standard Procedural Databases: rays of every kind are as many as published.
//!
//! The published tracer (E. Haines, "A Proposal for Standard Graphics Environments", 1987, and the tables in the package)
//! sends rays through the corners of 512 pixels, 513 by 513, to depth 5 without a cut-off, and shadow rays to the lights that
//! a surface faces. 2·atan(tan 22.5°·513/511) makes the centres of 513 pixels those corners.

mod shared_data;
/// Building worlds and rendering them.
mod world_kit {
    pub mod rendering;
    pub mod settings;
}

use flatray::render::RayCounts;
use flatray::scene::{Compiled, Overrides, load};
use shared_data::shared;
use world_kit::rendering::render_world;
use world_kit::settings::center_settings;

const FOV_DEGREES: f64 = 45.158477494738854;

/// Camera rays that hit, mirror rays, refracted rays, shadow rays.
type Counts = [u64; 4];

/// A database at a size; `None`, said aloud, where the file is absent.
fn database(name: &str, side_px: u32) -> Option<Compiled> {
    let path = shared(&format!("spd/{name}.nff.zst"))?;
    let side = Some(side_px);
    let overrides =
        Overrides { width_px: side, height_px: side, fov_y_degrees: Some(FOV_DEGREES), ..Overrides::default() };
    Some(load(&path, &overrides).unwrap_or_else(|error| panic!("{error}")))
}

fn rays(scene: &Compiled) -> RayCounts {
    render_world(&scene.world, &scene.camera, &center_settings(&scene.camera)).rays
}

fn check_published(name: &str, published: Counts) {
    let Some(scene) = database(name, 513) else { return };
    assert_eq!(scene.warnings, [], "{name}");
    let RayCounts { camera, camera_hit, reflection, refraction, shadow } = rays(&scene);
    assert_eq!(camera, 513 * 513);
    let found = [camera_hit, reflection, refraction, shadow];
    for (found, published) in found.into_iter().zip(published) {
        // 0.3 %, and nothing where nothing was published.
        assert!(found.abs_diff(published) * 1000 <= published * 3, "{name}: {found} for {published}");
    }
}

#[test]
fn balls_has_the_published_counts() {
    check_published("balls", [263_169, 175_095, 0, 954_368]);
}

#[test]
fn rings_has_the_published_counts() {
    check_published("rings", [263_169, 315_236, 0, 1_085_002]);
}

#[test]
fn teapot_has_the_published_counts() {
    check_published("teapot", [161_120, 225_248, 0, 407_656]);
}

#[test]
fn tetra_has_the_published_counts() {
    check_published("tetra", [49_788, 0, 0, 46_112]);
}

#[test]
fn tree_has_the_published_counts() {
    check_published("tree", [169_836, 0, 0, 1_097_419]);
}

#[test]
fn mount_has_the_published_counts() {
    check_published("mount", [173_125, 354_769, 354_769, 412_922]);
}

#[test]
fn gears_has_the_counts_of_an_independent_tracer_in_double_precision() {
    let Some(mut scene) = database("gears", 513) else { return };
    // That tracer mirrors at glass too, with a weight of 0 here: rays of no weight are not sent.
    let materials = &mut scene.world.materials;
    for (reflectance, &transmittance) in materials.reflectance.iter_mut().zip(&materials.transmittance) {
        *reflectance += if transmittance > 0.0 { 1e-12 } else { 0.0 };
    }
    let expected = RayCounts {
        camera: 513 * 513,
        camera_hit: 245_090,
        reflection: 304_624,
        // 7605 reflections are total.
        refraction: 199_933 + 7605,
        shadow: 2_246_795,
    };
    assert_eq!(rays(&scene), expected);
}

#[test]
fn the_other_databases_load_without_a_warning_and_show_something() {
    let spheres_cones_triangles = [
        ("jacks", [6, 3, 0]),
        ("lattice", [2197, 6084, 0]),
        ("nurbtst", [0, 0, 1500]),
        ("sample", [0, 1, 880]),
        ("shells", [5761, 0, 0]),
        ("sombrero", [0, 0, 1922]),
    ];
    for (name, expected) in spheres_cones_triangles {
        let Some(scene) = database(name, 64) else { return };
        let world = &scene.world;
        assert_eq!([world.spheres.len(), world.quadrics.len(), world.triangles.len()], expected, "{name}");
        // nurbtst winds its patches against their normals.
        assert_eq!(scene.warnings.len(), usize::from(name == "nurbtst"), "{name}: {:?}", scene.warnings);
        let rays = rays(&scene);
        assert!(rays.camera_hit > 50 && rays.shadow > 50, "{name}: {rays:?}");
    }
}
