//! PNG files of 8 and 16 bits against an independent library, `pypng` of PyPI; see `png_reader.py`.
//!
//! Needs `python3` with the package pypng; skipped, saying so, where they are absent.

/// What a test says that cannot run.
mod skip;

use std::fs;
use std::path::Path;
use std::process::Command;

use flatray::film::tone_map::{exposure_factor, quantize8, quantize16, srgb_from_linear};
use flatray::film::{BitDepth, Display, Film, Picture, Plane, Region, Samples, ToneMap, output, png};
use skip::skip;

/// A ramp of greens and reds over more than two bands of rows, from black to far above white.
fn film() -> Film {
    let (width_px, height_px) = (53, 41);
    let ramp =
        |scale: f32| (0..width_px * height_px).map(|at| scale * (at as f32 / 700.0).powi(3)).collect::<Vec<f32>>();
    let planes = [("R", 1.0), ("G", 0.3), ("B", 0.01), ("A", 0.0)];
    Film {
        width_px,
        height_px,
        data_window: Region::whole(width_px, height_px),
        planes: planes.map(|(name, scale)| Plane::color(name, Samples::F32(ramp(scale)))).into(),
    }
}

#[test]
fn an_independent_reader_finds_the_levels_and_chunks_of_our_files() {
    let directory = tempfile::tempdir().unwrap();
    let film = film();
    let planes = film.color_planes().unwrap();
    for (bit_depth, bits) in [(BitDepth::Eight, "8"), (BitDepth::Sixteen, "16")] {
        let picture = Picture { tone_map: ToneMap::AcesHill, exposure_stops: -1.0, bit_depth };
        let mut raw = Vec::new();
        for at in 0..film.n_pixels() {
            let exposed = planes.map(|plane| plane.samples.get(at) * exposure_factor(-1.0));
            let encoded = picture.tone_map.operator().map(exposed).map(srgb_from_linear);
            let (levels, opaque) = match bit_depth {
                BitDepth::Eight => (encoded.map(|c| u16::from(quantize8(c))), 255),
                BitDepth::Sixteen => (encoded.map(quantize16), u16::MAX),
            };
            raw.extend(levels.into_iter().chain([opaque]).flat_map(u16::to_le_bytes));
        }
        let [file, raw_file] = ["png", "raw"].map(|extension| directory.path().join(format!("{bits}.{extension}")));
        fs::write(&raw_file, raw).unwrap();
        output::write_file(&file, |out| png::write(&film, &Display::Picture(picture), out)).unwrap();

        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/png_reader.py");
        let Ok(output) = Command::new("python3").arg(script).arg(&file).arg(bits).arg(&raw_file).output() else {
            skip("this test needs python3");
            return;
        };
        match output.status.code() {
            Some(0) => {}
            Some(77) => skip("this test needs the PyPI package pypng"),
            _ => panic!("png_reader.py failed:\n{}", String::from_utf8_lossy(&output.stderr)),
        }
    }
}
