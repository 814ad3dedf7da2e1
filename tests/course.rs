//! The original's scenes in the original's mode, against what an independent double-precision renderer made of them.

mod shared_data;
/// Building worlds and rendering them.
mod world_kit {
    pub mod course;
    pub mod rendering;
    pub mod settings;
}

use std::io::Cursor;

use flatray::film::png::{decode, write};
use flatray::film::{Display, read_image};
use flatray::measure::difference::{LevelDifference, compare_levels};
use flatray::scene::{self, Overrides};
use shared_data::shared;
use world_kit::course::course_settings;
use world_kit::rendering::render_world;

/// Renders a scene of the original, writes it as the PNG that a user gets, and compares bytes with the reference.
fn difference(name: &str) -> Option<(LevelDifference, usize)> {
    let scene_path = shared(&format!("seed/scenes/{name}.toml"))?;
    let reference_path = shared(&format!("seed/reference/{name}.png"))?;
    let compiled = scene::load(&scene_path, &Overrides::default()).unwrap();
    assert_eq!(compiled.warnings, [], "{name}");
    let film = render_world(&compiled.world, &compiled.camera, &course_settings(&compiled.camera)).film;

    let mut png = Cursor::new(Vec::new());
    write(&film, &Display::Course, &mut png).unwrap();
    let ours = decode(&png.into_inner(), None, &scene_path).unwrap().rgb8.unwrap();
    let reference = read_image(&reference_path, None).unwrap();
    assert_eq!((reference.film.width_px, reference.film.height_px), (film.width_px, film.height_px), "{name}");
    let theirs = reference.rgb8.unwrap();
    // A black picture would agree with another: the reference must show something.
    let n_lit = theirs.iter().filter(|&&pixel| pixel != [0; 3]).count();
    assert!(n_lit > theirs.len() / 50, "{name}: only {n_lit} pixels are lit");
    Some((compare_levels(&ours, &theirs), theirs.len()))
}

fn assert_identical(name: &str) {
    if let Some((difference, _)) = difference(name) {
        assert_eq!(difference, LevelDifference::default(), "{name}");
    }
}

#[test]
fn the_originals_sphere_is_identical() {
    assert_identical("sphere");
}

#[test]
fn the_originals_triangle_is_identical() {
    assert_identical("triangle");
}

#[test]
fn the_originals_quadric_is_identical() {
    assert_identical("quadric");
}

#[test]
fn the_originals_mirroring_spheres_differ_in_at_most_one_pixel_of_a_thousand() {
    let Some((difference, n_pixels)) = difference("spheres") else { return };
    let share = |n: u64| n as f64 / n_pixels as f64;
    assert!(share(difference.differing) <= 1e-3, "{difference:?}");
    assert!(share(difference.more_than_8) <= 1e-4, "{difference:?}");
}
