//! EXR files against independent libraries, the modules `OpenEXR` and `OpenImageIO` of PyPI, and programs that come with them;
//! see `readers.py`.
//!
//! Needs `python3` with the packages OpenEXR, OpenImageIO and numpy, `oiiotool` of the second, and Debian's `exrinfo`; each test is
//! skipped, saying so, where what it needs is absent.

mod film_kit;

/// What a test says that cannot run.
mod skip;

use std::ffi::OsStr;
use std::fs;
use std::path::Path;
use std::process::Command;

use film_kit::{all_options, layered_film};

use flatray::film::exr::{self, ExrAttributes, ExrOptions};
use flatray::film::{Content, Film, Plane, Region, Samples, output};
use half::f16;
use skip::skip;

/// Runs `readers.py`; `false` when the modules that it needs are missing.
fn run_readers(arguments: &[&OsStr]) -> bool {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/readers.py");
    let Ok(output) = Command::new("python3").arg(script).args(arguments).output() else {
        skip("this test needs python3");
        return false;
    };
    let text = String::from_utf8_lossy(&output.stderr);
    match output.status.code() {
        Some(0) => true,
        Some(77) => {
            skip(&format!("this test needs PyPI packages: {}", String::from_utf8_lossy(&output.stdout).trim()));
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

/// Files of every kind in a folder, and what is in them: `half/R.raw`, `float/R.raw` and so on.
fn write_layouts(folder: &Path) {
    let film = layered_film(Region { x0: 7, y0: 5, x1: 140, y1: 96 });
    for plane in &film.planes {
        let floats = match &plane.samples {
            Samples::F32(values) => values.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<_>>(),
            Samples::U32(values) => values.iter().flat_map(|value| value.to_le_bytes()).collect(),
            Samples::F64(_) => unreachable!(),
        };
        let halves = match &plane.samples {
            Samples::F32(values) if plane.content == Content::Color => {
                let in_range = values.iter().map(|v| if v.is_finite() { v.clamp(-65504.0, 65504.0) } else { *v });
                in_range.flat_map(|value| f16::from_f32(value).to_le_bytes()).collect()
            }
            _ => floats.clone(),
        };
        for (color, bytes) in [("float", floats), ("half", halves)] {
            fs::create_dir_all(folder.join(color)).unwrap();
            fs::write(folder.join(color).join(format!("{}.raw", plane.name)), bytes).unwrap();
        }
    }
    let attributes = ExrAttributes {
        world_to_ndc: Some(std::array::from_fn(|at| at as f32)),
        numbers: vec![("flatray/number".to_string(), 7)],
        texts: vec![("a text of more than thirty-one bytes".to_string(), "равнина".to_string())],
        ..ExrAttributes::default()
    };
    for (name, options) in all_options() {
        let path = folder.join(format!("{name}.exr"));
        output::write_file(&path, |out| exr::write(&film, &options, &attributes, out)).unwrap();
    }
}

#[test]
fn openexr_finds_every_bit_of_every_kind_of_file() {
    let directory = tempfile::tempdir().unwrap();
    write_layouts(directory.path());
    run_readers(&["layouts".as_ref(), directory.path().as_ref()]);
}

#[test]
fn openimageio_finds_every_bit_of_every_kind_of_file() {
    let directory = tempfile::tempdir().unwrap();
    write_layouts(directory.path());
    run_readers(&["layouts_oiio".as_ref(), directory.path().as_ref()]);
}

#[test]
fn exrinfo_finds_nothing_wrong_with_any_kind_of_file() {
    if Command::new("exrinfo").arg("--version").output().is_err() {
        skip("this test needs exrinfo, of Debian's package openexr");
        return;
    }
    let directory = tempfile::tempdir().unwrap();
    write_layouts(directory.path());
    for (name, _) in all_options() {
        let path = directory.path().join(format!("{name}.exr"));
        let output = Command::new("exrinfo").arg("-s").arg(&path).output().unwrap();
        let text = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success() && text.is_empty(), "{name}: {text}");
    }
}

#[test]
fn oiiotool_joins_crops_to_the_pixels_that_we_join_them_to() {
    if Command::new("oiiotool").arg("--version").output().is_err() {
        skip("this test needs oiiotool, of the PyPI package OpenImageIO");
        return;
    }
    let directory = tempfile::tempdir().unwrap();
    let folder = directory.path();
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/glass.toml");
    let flatray = |arguments: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_flatray"));
        assert!(command.args(arguments.split(' ')).current_dir(folder).status().unwrap().success(), "{arguments}");
    };
    for (index, crop) in ["0,0,53,40", "53,0,90,41", "0,40,53,41", "0,41,90,70"].into_iter().enumerate() {
        let render = format!("render {} --width 90 --height 70 --samples 4 -q", scene.display());
        flatray(&format!("{render} --crop {crop} -o {index}.exr"));
    }
    flatray("merge -q ours.exr 0.exr 1.exr 2.exr 3.exr");
    let join = "0.exr 1.exr 2.exr 3.exr --paste:all=1:mergeroi=1 - -o theirs.exr";
    assert!(Command::new("oiiotool").args(join.split(' ')).current_dir(folder).status().unwrap().success());
    run_readers(&["same_oiio".as_ref(), folder.join("ours.exr").as_ref(), folder.join("theirs.exr").as_ref()]);
}
