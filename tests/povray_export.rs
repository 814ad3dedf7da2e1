//! Every scene of `scenes/`, exported to POV-Ray: it renders the same pixels, or the export says what it cannot express.
//!
//! Needs the program `povray` of version 3.7; skipped, saying so, where it is absent.

/// How a test says that it cannot run.
mod skip;
/// Building worlds and rendering them.
mod world_kit {
    pub mod rendering;
    pub mod scenes;
    pub mod settings;
}

use flatray::film::Film;
use flatray::measure::difference::compare;
use flatray::measure::povray::program::{Job, Program, write_scene};
use flatray::measure::povray::{Antialiasing, export};
use flatray::render::{Control, Sampler, Settings};
use flatray::scene::Compiled;
use skip::skip;
use world_kit::rendering::render_world;
use world_kit::scenes::{load_scene, scene_names};
use world_kit::settings::center_settings;

/// Radiance is divided by this, so that nothing of these scenes is cut at the white of a PNG.
const WHITE: f64 = 4.0;

fn program() -> Option<Program> {
    let found = Program::find();
    if let Err(error) = &found {
        skip(&format!("this test needs POV-Ray: {error}"));
    }
    found.ok()
}

/// What POV-Ray makes of a scene, or what of it cannot be said.
fn rendered(program: &Program, scene: &Compiled, settings: &Settings, how: Antialiasing) -> Result<Film, String> {
    let text = export::scene(&scene.world, &scene.camera, settings, WHITE)
        .map_err(|refused| refused.iter().map(|what| what.0).collect::<Vec<_>>().join("; "))?;
    let folder = tempfile::tempdir().unwrap();
    write_scene(folder.path(), &text).unwrap();
    let size_px = [scene.camera.width_px, scene.camera.height_px];
    let job = Job { folder: folder.path().to_owned(), size_px, threads: 2, white: WHITE };
    let (film, seconds) = program.render(&job, &how, &Control::default()).unwrap_or_else(|ended| panic!("{ended:?}"));
    assert!(seconds > 0.0);
    Ok(film)
}

/// Pixels with a channel that differs by more than a limit.
fn n_beyond(limit: f64, a: &Film, b: &Film) -> usize {
    let (planes_a, planes_b) = (a.color_planes().unwrap(), b.color_planes().unwrap());
    let difference = |index: usize, c: usize| planes_a[c].samples.get(index) - planes_b[c].samples.get(index);
    (0..a.n_pixels()).filter(|&index| (0..3).any(|c| difference(index, c).abs() > limit)).count()
}

#[test]
fn every_scene_shows_the_same_or_says_what_cannot_be_expressed() {
    let Some(program) = program() else { return };
    for name in scene_names() {
        let scene = load_scene(&name, 120, 90);
        let settings = center_settings(&scene.camera);
        let theirs = rendered(&program, &scene, &settings, Antialiasing::Uniform { grid: 1 });
        if ["glass", "light_groups"].contains(&name.as_str()) {
            assert!(theirs.unwrap_err().contains("refraction"), "{name}");
            continue;
        }
        let theirs = theirs.unwrap_or_else(|refused| panic!("{name}: {refused}"));
        let ours = render_world(&scene.world, &scene.camera, &settings).film;
        // Half a step of a 16-bit picture and some roundings; a few pixels have an edge through their centre.
        let step = WHITE / 65_535.0;
        if name == "triangles" {
            // The normals of its smooth triangle are up to 90° apart, and POV-Ray interpolates them a little otherwise.
            assert!(n_beyond(4e-3, &ours, &theirs) == 0 && n_beyond(1e-3, &ours, &theirs) <= 60, "{name}");
        } else {
            let n_far = n_beyond(0.51 * step, &ours, &theirs);
            assert!(n_far <= 4, "{name}: {n_far} pixels differ, {:?}", compare(&ours, &theirs).unwrap());
        }
    }
}

#[test]
fn balls_at_many_samples_agree_to_a_thousandth() {
    let Some(program) = program() else { return };
    let scene = load_scene("default", 80, 60);
    let settings = Settings { samples: 1024, sampler: Sampler::Sobol, ..center_settings(&scene.camera) };
    let ours = render_world(&scene.world, &scene.camera, &settings).film;
    let rmse = |how| compare(&ours, &rendered(&program, &scene, &settings, how).unwrap()).unwrap().rmse;
    // 16 and 81 samples; the more, the closer, as jittered samples are.
    let (few, many) = (rmse(Antialiasing::Uniform { grid: 4 }), rmse(Antialiasing::Uniform { grid: 9 }));
    assert!(few <= 1e-2 && many <= 0.5 * few, "{few:e}, then {many:e}");
    // Up to 16,641 samples in a pixel.
    let most = rmse(Antialiasing::Adaptive { threshold: 1e-4, depth: 7 });
    assert!(most <= 1e-3, "{most:e}");
}
