//! Every scene of `scenes/` against a small golden image, bit for bit: images are promised to be the same on every
//! machine. One scene against one for every sampler besides.
//!
//! `FLATRAY_BLESS=1 cargo test --test golden` writes the golden images anew; look at the pictures before you commit them.

/// Building worlds and rendering them.
mod world_kit {
    pub mod rendering;
    pub mod scenes;
    pub mod settings;
}

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use flatray::film::exr::{self, ExrAttributes, ExrOptions};
use flatray::film::output::write_file;
use flatray::film::{Display, Film, Picture, Plane, Samples, png};
use flatray::measure::difference::compare;
use flatray::render::{Adaptive, Sampler, Settings, Spread};
use world_kit::rendering::render_world;
use world_kit::scenes::{load_scene, scene_names};
use world_kit::settings::center_settings;

const WIDTH_PX: u32 = 72;
const HEIGHT_PX: u32 = 48;

/// All golden images together.
const MAX_TOTAL_BYTES: u64 = 600_000;

fn golden_path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden_images").join(name).with_extension("exr")
}

/// Four jittered samples, the scene's depth.
fn render_scene(name: &str) -> Film {
    render_sampled(name, Sampler::Jitter, Spread::Uniform)
}

fn render_sampled(name: &str, sampler: Sampler, spread: Spread) -> Film {
    let scene = load_scene(name, WIDTH_PX, HEIGHT_PX);
    let max_depth = scene.render.max_depth.unwrap_or(5);
    let samples = if sampler == Sampler::Center { 1 } else { 4 };
    let settings = Settings { samples, sampler, spread, seed: 1, max_depth, ..center_settings(&scene.camera) };
    render_world(&scene.world, &scene.camera, &settings).film
}

fn is_blessing() -> bool {
    std::env::var_os("FLATRAY_BLESS").is_some_and(|value| value == "1")
}

fn write_exr(path: &Path, film: &Film) {
    write_file(path, |out| exr::write(film, &ExrOptions::FLOAT, &ExrAttributes::default(), out)).unwrap();
}

/// Planes by name: a file keeps them sorted.
fn sorted(film: &Film) -> Vec<&Plane> {
    let mut planes: Vec<&Plane> = film.planes.iter().collect();
    planes.sort_by(|a, b| a.name.cmp(&b.name));
    planes
}

/// How many values differ by any bit, and the first that does.
fn differing_values(golden: &Film, found: &Film) -> (usize, Option<String>) {
    let (mut n, mut first) = (0, None);
    let (golden_planes, found_planes) = (sorted(golden), sorted(found));
    let names = |planes: &[&Plane]| planes.iter().map(|plane| plane.name.clone()).collect::<Vec<_>>();
    assert_eq!(names(&golden_planes), names(&found_planes));
    for (golden, found) in golden_planes.iter().zip(&found_planes) {
        let (Samples::F32(a), Samples::F32(b)) = (&golden.samples, &found.samples) else {
            panic!("a plane that is not F32");
        };
        assert_eq!(a.len(), b.len());
        for (index, (a, b)) in a.iter().zip(b).enumerate().filter(|(_, (a, b))| a.to_bits() != b.to_bits()) {
            let at = (index as u32 % WIDTH_PX, index as u32 / WIDTH_PX);
            first.get_or_insert_with(|| format!("{} at {},{}: {b} instead of {a}", golden.name, at.0, at.1));
            n += 1;
        }
    }
    (n, first)
}

/// Golden image, image found and their differences side by side, the differences as bright as they can be.
fn write_difference(name: &str, golden: &Film, found: &Film) -> PathBuf {
    let largest = compare(golden, found).map_or(1.0, |difference| difference.max.max(f64::MIN_POSITIVE));
    let (golden, found) = (golden.color_planes().unwrap(), found.color_planes().unwrap());
    let planes = (0..3).map(|channel| {
        let (a, b) = (&golden[channel].samples, &found[channel].samples);
        let mut values = Vec::new();
        for row in (0..WIDTH_PX as usize * HEIGHT_PX as usize).step_by(WIDTH_PX as usize) {
            let pixels = row..row + WIDTH_PX as usize;
            values.extend(pixels.clone().map(|index| a.get(index) as f32));
            values.extend(pixels.clone().map(|index| b.get(index) as f32));
            values.extend(pixels.map(|index| ((a.get(index) - b.get(index)).abs() / largest) as f32));
        }
        Plane::color(["R", "G", "B"][channel], Samples::F32(values))
    });
    let (width_px, height_px) = (3 * WIDTH_PX, HEIGHT_PX);
    let data_window = flatray::film::Region::whole(width_px, height_px);
    let film = Film { width_px, height_px, data_window, planes: planes.collect() };
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("golden");
    fs::create_dir_all(&folder).unwrap();
    let path = folder.join(format!("{}-golden-found-difference.png", name.replace('/', "-")));
    write_file(&path, |out| png::write(&film, &Display::Picture(Picture::default()), out)).unwrap();
    path
}

/// What is wrong with a scene's image; nothing when its bits are the golden ones.
fn judge(name: &str, found: Film) -> Option<String> {
    let path = golden_path(name);
    if is_blessing() {
        write_exr(&path, &found);
        return None;
    }
    if !path.exists() {
        return Some(format!("{name}: no golden image; look at the scene, then run with FLATRAY_BLESS=1 to make one"));
    }
    let golden = exr::read(&path).unwrap();
    assert_eq!((golden.width_px, golden.height_px), (WIDTH_PX, HEIGHT_PX), "{name}");
    let (n, first) = differing_values(&golden, &found);
    first.map(|first| {
        let figures = compare(&golden, &found).unwrap();
        let picture = write_difference(name, &golden, &found);
        format!(
            "{name}: {n} values in {} pixels differ, by {:e} at most; the first is {first}; see {}",
            figures.differing,
            figures.max,
            picture.display()
        )
    })
}

#[test]
fn every_scene_renders_to_the_bits_of_its_golden_image() {
    let wrong: Vec<String> = scene_names().iter().filter_map(|name| judge(name, render_scene(name))).collect();
    assert!(
        wrong.is_empty(),
        "{}\nIf the new images are right, make them golden with FLATRAY_BLESS=1 cargo test --test golden",
        wrong.join("\n")
    );
}

#[test]
fn every_sampler_renders_to_the_bits_of_its_golden_image() {
    let uniform = |sampler| render_sampled("default", sampler, Spread::Uniform);
    let adaptive = render_sampled("default", Sampler::Sobol, Spread::Adaptive(Adaptive::new(0.05)));
    let images = [
        ("samplers/center", uniform(Sampler::Center)),
        ("samplers/grid", uniform(Sampler::Grid)),
        ("samplers/random", uniform(Sampler::Random)),
        ("samplers/sobol", uniform(Sampler::Sobol)),
        ("samplers/adaptive", adaptive),
    ];
    let wrong: Vec<String> = images.into_iter().filter_map(|(name, found)| judge(name, found)).collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn golden_images_belong_to_scenes_and_stay_small() {
    if is_blessing() {
        return;
    }
    let files: Vec<PathBuf> = fs::read_dir(golden_path("any").parent().unwrap())
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.is_file())
        .collect();
    let found: BTreeSet<String> =
        files.iter().map(|path| path.file_stem().unwrap().to_str().unwrap().to_string()).collect();
    assert_eq!(found, scene_names().into_iter().collect(), "golden images and scenes");
    let total: u64 = files.iter().map(|path| fs::metadata(path).unwrap().len()).sum();
    assert!(total <= MAX_TOTAL_BYTES, "{total} bytes");
}

#[test]
fn a_change_of_one_bit_is_seen_and_shown() {
    let golden = render_scene("sphere");
    let mut other = golden.clone();
    let Samples::F32(green) = &mut other.planes[1].samples else { panic!("F32") };
    let at = (HEIGHT_PX / 2 * WIDTH_PX + WIDTH_PX / 2) as usize;
    green[at] = f32::from_bits(green[at].to_bits() ^ 1);
    assert_eq!(differing_values(&golden, &golden), (0, None));
    let (n, first) = differing_values(&golden, &other);
    assert_eq!(n, 1);
    assert!(first.unwrap().starts_with("G at 36,24: "));
    let picture = flatray::film::read_image(write_difference("one-bit", &golden, &other), None).unwrap();
    assert_eq!((picture.film.width_px, picture.film.height_px), (3 * WIDTH_PX, HEIGHT_PX));
    const WIDTH: usize = WIDTH_PX as usize;
    let shown = picture.rgb8.unwrap();
    let [.., difference] = [0, 1, 2].map(|part| shown[at / WIDTH * 3 * WIDTH + part * WIDTH + at % WIDTH]);
    assert!(difference[1] > 200, "the pixel that differs is bright: {difference:?}");
}
