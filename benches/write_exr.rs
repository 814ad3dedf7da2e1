//! EXR files with many layers: the writer, on a frame of twelve layers beside the picture, into a file.
//!
//! Before anything is timed, the file is read back: every sample must be what was written. `cargo bench --bench write_exr`
//! prints the rate and leaves target/twelve_layers.exr, which `write_exr_peer.py` writes with the OpenEXR library;
//! with `-- --test` the frame is small and written once.

// The rate, for the eye.
#![allow(clippy::print_stdout)]

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::time::Instant;

use flatray::accel::{Accel, AccelKind};
use flatray::film::cryptomatte::id_of;
use flatray::film::output::Format;
use flatray::film::{Content, Display, EncodeOptions, Encoder, Film, Picture, Samples, exr};
use flatray::render::{Aov, Aovs, Control, Sampler, Settings, render};
use flatray::scene::{self, Overrides};

/// Six lobes and as many others.
fn layers() -> Vec<Aov> {
    let others = [Aov::Albedo, Aov::Z, Aov::P, Aov::N, Aov::CryptoObject, Aov::CryptoMaterial];
    [Aov::LOBES, others].concat()
}

fn rendered(width_px: u32, height_px: u32) -> Film {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/light_groups.toml");
    let overrides = Overrides { width_px: Some(width_px), height_px: Some(height_px), ..Overrides::default() };
    let scene = scene::load(&path, &overrides).unwrap();
    let ids = |names: &[String]| names.iter().map(|name| id_of(name)).collect();
    let settings = Settings {
        samples: 4,
        sampler: Sampler::Jitter,
        max_depth: 4,
        threads: std::thread::available_parallelism().map_or(1, usize::from),
        aovs: Aovs {
            object_mattes: ids(&scene.names.objects),
            material_mattes: ids(&scene.names.materials),
            ..Aovs::of(&layers())
        },
        ..Settings::new(&scene.camera)
    };
    let accel = Accel::build(&scene.world, AccelKind::Bvh);
    render(&scene.world, &accel, &scene.camera, &settings, &Control::default()).unwrap().film
}

fn write(film: &Film, path: &Path) {
    let options = EncodeOptions::of_display(Display::Picture(Picture::default()));
    let encoder = Encoder::new(Format::Exr, film, &options).unwrap();
    let mut file = BufWriter::new(File::create(path).unwrap());
    encoder.write(film, &mut file).unwrap();
    file.flush().unwrap();
}

/// Data bit for bit, colour to half a unit of 16-bit floats.
fn check(film: &Film, path: &Path) {
    let back = exr::read(path).unwrap();
    assert_eq!(back.planes.len(), film.planes.len());
    for plane in &film.planes {
        let found = &back.plane(&plane.name).unwrap().samples;
        for pixel in 0..film.n_pixels() {
            let (a, b) = (plane.samples.get(pixel), found.get(pixel));
            let is_right = match (plane.content, &plane.samples) {
                (Content::Color, Samples::F32(_)) => (a - b).abs() <= a.abs() / 2048.0 + 3e-8,
                _ => a.to_bits() == b.to_bits(),
            };
            assert!(is_right, "{} at {pixel}: {b} for {a}", plane.name);
        }
    }
}

fn main() {
    let is_quick = std::env::args().any(|argument| argument == "--test");
    let (width_px, height_px, n_runs) = if is_quick { (160, 90, 1) } else { (3840, 2160, 9) };
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("target/twelve_layers.exr");
    let film = rendered(width_px, height_px);
    write(&film, &path);
    check(&film, &path);
    let mut seconds: Vec<f64> = Vec::new();
    for _ in 0..n_runs {
        let started = Instant::now();
        write(&film, &path);
        seconds.push(started.elapsed().as_secs_f64());
    }
    seconds.sort_unstable_by(f64::total_cmp);
    let bytes = std::fs::metadata(&path).unwrap().len() as f64 * 1e-6;
    println!(
        "{width_px}x{height_px}, {} channels: {:.3} s ({:.3} to {:.3}), {bytes:.1} MB",
        film.planes.len(),
        seconds[n_runs / 2],
        seconds[0],
        seconds[n_runs - 1]
    );
}
