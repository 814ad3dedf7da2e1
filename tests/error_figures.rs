//! FLIP and SSIM beside the programs that define them: `flip-evaluator` of FLIP's authors and scikit-image, of PyPI.
//!
//! Needs `python3` with both; skipped, saying so, where they are absent. What they say of one small pair of images is
//! also written down here.

/// What a test says that cannot run.
mod skip;

use std::fs;
use std::path::Path;
use std::process::Command;

use flatray::film::output::{self, Format};
use flatray::film::{Display, EncodeOptions, Encoder, Film, Picture, Plane, Region, Samples, ToneMap};
use flatray::film::{exr, read_image};
use flatray::measure::difference::{compare, compare_files, pixels_of, referred_of};
use flatray::measure::flip::flip;
use skip::skip;

/// A film whose channels are functions of column, row and channel.
fn film(width_px: u32, height_px: u32, value: impl Fn(u32, u32, u32) -> f32) -> Film {
    let places = || (0..height_px).flat_map(|y| (0..width_px).map(move |x| (x, y)));
    let channel = |index: u32| places().map(|(x, y)| value(x, y, index)).collect();
    Film {
        width_px,
        height_px,
        data_window: Region::whole(width_px, height_px),
        planes: (0..3).zip(["R", "G", "B"]).map(|(at, name)| Plane::color(name, Samples::F32(channel(at)))).collect(),
    }
}

/// A number in 0 … 1 that looks random.
fn noise(x: u32, y: u32, channel: u32) -> f32 {
    let mixed = (x.wrapping_mul(0x9e37_79b1) ^ y.wrapping_mul(0x85eb_ca77) ^ channel.wrapping_mul(0xc2b2_ae3d))
        .wrapping_mul(0x27d4_eb2f);
    ((mixed ^ (mixed >> 15)).wrapping_mul(0x2c1b_3c6d) >> 8) as f32 / (1 << 24) as f32
}

/// A disc on black with a bright spot, as renders have them, sampled with some noise: most of it exactly black.
fn disc(spot: f32, amount: f32) -> impl Fn(u32, u32, u32) -> f32 {
    move |x, y, channel| {
        let (dx, dy) = (x as f32 - 60.0, y as f32 - 40.0);
        let distance = (dx * dx + dy * dy).sqrt();
        let coverage = (26.0 - distance).clamp(0.0, 1.0);
        let highlight = spot * (-distance * distance / 30.0).exp();
        let shade = 0.2 + 0.3 * (channel + 1) as f32 / 3.0 + highlight;
        coverage * shade * (1.0 + amount * (noise(x, y, channel) - 0.5))
    }
}

/// Pairs of images, the first to be judged by the second.
fn pairs() -> Vec<(&'static str, [Film; 2])> {
    let blocks = |x: u32, y: u32, channel: u32| ((x / 4 * 5 + y / 6 * 11 + channel * 17) % 64) as f32 / 64.0;
    let changed = move |x: u32, y: u32, channel: u32| match (x * x + 3 * y) % 41 {
        0..3 => ((x / 4 * 5 + y / 6 * 11 + channel * 17 + 9 * (channel + 1)) % 64) as f32 / 64.0,
        _ => blocks(x, y, channel),
    };
    let wide =
        |amount: f32| move |x, y, channel| 1e-3 * (x as f32 / 20.0).exp() * (1.0 + amount * noise(x, y, channel));
    vec![
        ("blocks", [film(90, 70, changed), film(90, 70, blocks)]),
        ("disc", [film(130, 90, disc(0.0, 0.2)), film(130, 90, disc(0.0, 0.0))]),
        ("spot", [film(130, 90, disc(400.0, 0.01)), film(130, 90, disc(400.0, 0.0))]),
        ("wide range", [film(300, 11, wide(0.1)), film(300, 11, wide(0.0))]),
        ("noise", [film(11, 65, noise), film(11, 65, |x, y, channel| noise(x + 7, y, channel))]),
    ]
}

/// Writes a film as scene-linear EXR of 32 bits, or as it is seen.
fn write(film: &Film, path: &Path) {
    let display = Display::Picture(Picture { tone_map: ToneMap::Clip, ..Picture::default() });
    let options = EncodeOptions { exr: exr::ExrOptions::FLOAT, ..EncodeOptions::of_display(display) };
    let encoder = Encoder::new(Format::of_path(path).unwrap(), film, &options).unwrap();
    output::write_file(path, |out| encoder.write(film, out)).unwrap();
}

/// A number as Python's `float.hex` writes it.
fn hexadecimal(text: &str) -> f64 {
    let (negative, text) = text.strip_prefix('-').map_or((false, text), |text| (true, text));
    let (mantissa, exponent) = text.strip_prefix("0x").unwrap().split_once('p').unwrap();
    let (whole, fraction) = mantissa.split_once('.').unwrap_or((mantissa, "0"));
    let bits = u64::from_str_radix(&format!("{whole}{fraction}"), 16).unwrap() as f64;
    let magnitude = bits * 2_f64.powi(exponent.parse::<i32>().unwrap() - 4 * fraction.len() as i32);
    if negative { -magnitude } else { magnitude }
}

/// What the other programs say of two files: FLIP's mean, the SSIM, FLIP's error of each pixel.
fn other_programs(a: &Path, b: &Path, errors: &Path) -> Option<(f64, f64, Vec<f32>)> {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/error_figures.py");
    let Ok(output) = Command::new("python3").arg(script).args([a, b, errors]).output() else {
        skip("this test needs python3");
        return None;
    };
    if output.status.code() == Some(77) {
        skip("this test needs the PyPI packages flip-evaluator and scikit-image");
        return None;
    }
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).unwrap();
    let (flip, ssim) = text.trim().split_once(' ').unwrap();
    let bytes = fs::read(errors).unwrap();
    let errors = bytes.chunks_exact(4).map(|bytes| f32::from_le_bytes(bytes.try_into().unwrap())).collect();
    Some((hexadecimal(flip), hexadecimal(ssim), errors))
}

#[test]
fn figures_and_errors_of_pixels_are_those_of_the_programs_that_define_them() {
    let directory = tempfile::tempdir().unwrap();
    for (name, films) in pairs() {
        for extension in ["exr", "png"] {
            let paths = ["a", "b"].map(|name| directory.path().join(format!("{name}.{extension}")));
            films.iter().zip(&paths).for_each(|(film, path)| write(film, path));
            let [a, b] = paths.each_ref().map(|path| read_image(path, None).unwrap());
            let ours = compare_files(&a, &b).unwrap();
            let map = flip(&pixels_of(&a.film, &b.film, referred_of(&a, &b)).unwrap());
            let [path_a, path_b] = &paths;
            let Some((flip, ssim, errors)) = other_programs(path_a, path_b, &directory.path().join("errors")) else {
                return;
            };
            let worst = map.errors.iter().zip(&errors).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            println!("{name}.{extension}: flip {} {flip}, worst {worst:e}, ssim {} {ssim}", ours.flip, ours.ssim);
            assert_eq!(map.errors.len(), errors.len());
            assert!((ours.flip - flip).abs() < FLIP_TOLERANCE, "{name}.{extension}: {} {flip}", ours.flip);
            assert!(worst < ERROR_TOLERANCE, "{name}.{extension}: {worst}");
            assert!((ours.ssim - ssim).abs() < SSIM_TOLERANCE, "{name}.{extension}: {} {ssim}", ours.ssim);
        }
    }
}

/// Both compute FLIP in f32: docs/NUMERICS.md.
const FLIP_TOLERANCE: f64 = 1e-5;
const ERROR_TOLERANCE: f32 = 4e-4;
/// Levels of a PNG pass through a linear f32 here, rounded by 6e-8 of themselves.
const SSIM_TOLERANCE: f64 = 1e-7;

#[test]
fn a_small_pair_has_the_figures_that_those_programs_gave() {
    // flip-evaluator 1.7 (HDR) and scikit-image 0.26.
    let (_, [a, b]) = pairs().swap_remove(0);
    let figures = compare(&a, &b).unwrap();
    assert!((figures.flip - 0.170_943_9).abs() < FLIP_TOLERANCE, "{}", figures.flip);
    assert!((figures.ssim - 0.690_719_521_463_813_2).abs() < 1e-12, "{}", figures.ssim);
}
