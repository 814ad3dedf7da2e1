//! EXR files against an independent library, the `OpenEXR` module of PyPI, in both directions; see `readers.py`.
//!
//! Needs `python3` with the packages OpenEXR and numpy; skipped, saying so, where they are absent.

// A skipped test says so.
#![allow(clippy::print_stderr)]

use std::ffi::OsStr;
use std::fs;
use std::path::Path;
use std::process::Command;

use flatray::film::exr::{self, ExrAttributes, ExrOptions};
use flatray::film::{Film, Plane, Region, Samples, output};

/// Runs `readers.py`; `false` when the modules that it needs are missing.
fn run_readers(arguments: &[&OsStr]) -> bool {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/readers.py");
    let Ok(output) = Command::new("python3").arg(script).args(arguments).output() else {
        eprintln!("SKIPPED: this test needs python3");
        return false;
    };
    let text = String::from_utf8_lossy(&output.stderr);
    match output.status.code() {
        Some(0) => true,
        Some(77) => {
            eprintln!("SKIPPED: this test needs the PyPI packages OpenEXR and numpy");
            false
        }
        _ => panic!("readers.py {arguments:?} failed:\n{text}"),
    }
}

#[test]
fn an_independent_reader_finds_the_windows_attributes_and_samples_of_our_files() {
    let directory = tempfile::tempdir().unwrap();
    let data_window = Region { x0: 7, y0: 5, x1: 68, y1: 40 };
    let n_pixels = data_window.n_pixels() as u32;
    let bits = |salt: u32| (0..n_pixels).map(move |at| (at + salt).wrapping_mul(0x9e37_79b9));
    // Any bits but NaN, whose payload a reader may change.
    let floats = |salt: u32| -> Vec<f32> {
        let special = [f32::INFINITY, f32::NEG_INFINITY, -0.0, 1e-45];
        let any =
            bits(salt).map(|b| if (b >> 23) & 0xff == 0xff { special[b as usize % 4] } else { f32::from_bits(b) });
        any.collect()
    };
    let doubles: Vec<f64> = (0..n_pixels).map(|at| f64::from(at) / 7.0).collect();
    let planes = vec![
        Plane::data("id", Samples::U32(bits(1).collect())),
        Plane::data("R", Samples::F32(floats(2))),
        Plane::data("G", Samples::F32(floats(3))),
        Plane::data("B", Samples::F64(doubles)),
        Plane::data("A", Samples::F32(floats(4))),
    ];
    let film = Film { width_px: 100, height_px: 50, data_window, planes };
    for plane in &film.planes {
        let words: Vec<u32> = match &plane.samples {
            Samples::F32(values) => values.iter().map(|value| value.to_bits()).collect(),
            Samples::F64(values) => values.iter().map(|&value| (value as f32).to_bits()).collect(),
            Samples::U32(values) => values.clone(),
        };
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        fs::write(directory.path().join(format!("{}.raw", plane.name)), bytes).unwrap();
    }
    let file = directory.path().join("ours.exr");
    output::write_file(&file, |out| exr::write(&film, &ExrOptions::default(), &ExrAttributes::default(), out)).unwrap();
    run_readers(&["check".as_ref(), file.as_ref(), directory.path().as_ref()]);
}

/// The value that `readers.py make` gives to red.
fn ramp(x: u32, y: u32) -> f64 {
    f64::from((y * 45 + x) % 200) / 64.0
}

fn assert_colors(film: &Film, name: &str, x_offset: u32) {
    let planes = film.color_planes().unwrap();
    let window = film.data_window;
    for y in window.y0..window.y1 {
        for x in window.x0..window.x1 {
            let red = ramp(x - window.x0 + x_offset, y - window.y0);
            let found = planes.map(|plane| plane.samples.get(window.index_of(x, y)));
            let expected = if planes[0].name == "Y" { [red; 3] } else { [red, 2.0 * red, 4.0 * red] };
            assert_eq!(found, expected, "{name} at {x},{y}");
        }
    }
}

#[test]
fn files_of_an_independent_writer_are_read_or_refused_rightly() {
    let directory = tempfile::tempdir().unwrap();
    if !run_readers(&["make".as_ref(), directory.path().as_ref()]) {
        return;
    }
    let mut n_read = 0;
    for entry in fs::read_dir(directory.path()).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_stem().unwrap().to_str().unwrap().to_string();
        let film = exr::read(&path);
        if name.ends_with("_refused") {
            let error = film.unwrap_err().to_string();
            let expected =
                if name == "depth_refused" { "channels Z" } else { "compressed by a method that is not read" };
            assert!(error.contains(expected), "{error}");
            continue;
        }
        let film = film.unwrap();
        n_read += 1;
        if name == "overscan" {
            assert_eq!((film.width_px, film.height_px), (40, 51));
            assert_eq!(film.data_window, Region { x0: 0, y0: 10, x1: 40, y1: 47 });
            assert_colors(&film, &name, 3);
        } else {
            assert_eq!(film.data_window, Region::whole(45, 37), "{name}");
            assert_colors(&film, &name, 0);
        }
        if name == "parts" {
            assert!(matches!(film.plane("id").unwrap().samples, Samples::U32(_)));
        }
    }
    assert_eq!(n_read, 16);
}
