//! What is written comes back: bit for bit where the format allows it, with the same bytes every time, and damaged files
//! are refused without a panic.

mod shared_data;

use std::io::Cursor;
use std::path::Path;
use std::process::Command;

use flatray::film::exr::{self, ExrAttributes, ExrOptions};
use flatray::film::png_chunk::{Transfer, write_chunk};
use flatray::film::tone_map::{ToneMap, exposure_factor, quantize16, srgb_from_linear};
use flatray::film::{BitDepth, Display, Film, Picture, Plane, Region, Samples, output, pfm, png, read_image};
use flatray::measure::difference::{compare, compare_files};
use shared_data::shared;

const NAME: &str = "in memory";

/// Numbers of a fixed sequence (xorshift64), so that every run is the same.
struct Sequence(u64);

impl Sequence {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    fn below(&mut self, end: usize) -> usize {
        (self.next() % end as u64) as usize
    }
}

/// A crop of 61×35 pixels with floats of every kind but NaN, doubles and ids.
fn crop_film() -> Film {
    let data_window = Region { x0: 7, y0: 5, x1: 68, y1: 40 };
    let n_pixels = data_window.n_pixels();
    let mut sequence = Sequence(2026);
    let special = [f32::INFINITY, f32::NEG_INFINITY, -0.0, 0.0, f32::MIN_POSITIVE, 1e-45, f32::MAX, -1.5];
    let mut any_float = || match sequence.below(20) {
        at if at < special.len() => special[at],
        _ => loop {
            let value = f32::from_bits(sequence.next() as u32);
            if !value.is_nan() {
                break value;
            }
        },
    };
    let mut plane = |name: &str| Plane::data(name, Samples::F32((0..n_pixels).map(|_| any_float()).collect()));
    let mut planes = vec![plane("R"), plane("G"), plane("A")];
    let doubles = (0..n_pixels).map(|index| index as f64 / 3.0);
    planes.push(Plane::data("B", Samples::F64(doubles.collect())));
    let ids = (0..n_pixels as u32).map(|index| index.wrapping_mul(0x9e37_79b9));
    planes.push(Plane::data("id", Samples::U32(ids.collect())));
    Film { width_px: 100, height_px: 50, data_window, planes }
}

/// A whole image of floats in 0 … 1.25.
fn ramp_film(width_px: u32, height_px: u32) -> Film {
    let n_pixels = (width_px * height_px) as usize;
    let plane = |name: &str, shift: usize| {
        let values = (0..n_pixels).map(|at| ((at + shift) % n_pixels) as f64 * 1.25 / n_pixels as f64);
        Plane::color(name, Samples::F64(values.collect()))
    };
    Film {
        width_px,
        height_px,
        data_window: Region::whole(width_px, height_px),
        planes: vec![plane("R", 0), plane("G", n_pixels / 3), plane("B", n_pixels / 2)],
    }
}

fn exr_bytes(film: &Film) -> Vec<u8> {
    let mut out = Cursor::new(Vec::new());
    exr::write(film, &ExrOptions::FLOAT, &ExrAttributes::default(), &mut out).unwrap();
    out.into_inner()
}

fn png_bytes(film: &Film, display: Display) -> Vec<u8> {
    let mut out = Vec::new();
    png::write(film, &display, &mut out).unwrap();
    out
}

fn pfm_bytes(film: &Film) -> Vec<u8> {
    let mut out = Vec::new();
    pfm::write(film, &mut out).unwrap();
    out
}

/// Bits of a plane as a file keeps it: doubles rounded to floats.
fn bits(film: &Film, name: &str) -> Vec<u32> {
    match &film.plane(name).unwrap().samples {
        Samples::F32(values) => values.iter().map(|value| value.to_bits()).collect(),
        Samples::F64(values) => values.iter().map(|&value| (value as f32).to_bits()).collect(),
        Samples::U32(values) => values.clone(),
    }
}

#[test]
fn an_exr_crop_comes_back_bit_for_bit_with_its_windows() {
    let film = crop_film();
    let back = exr::decode(&exr_bytes(&film), Path::new(NAME)).unwrap();
    assert_eq!((back.width_px, back.height_px, back.data_window), (100, 50, film.data_window));
    let names: Vec<&str> = back.planes.iter().map(|plane| plane.name.as_str()).collect();
    assert_eq!(names, ["A", "B", "G", "R", "id"]);
    for name in names {
        assert_eq!(bits(&back, name), bits(&film, name), "plane {name}");
    }
    assert!(matches!(back.plane("id").unwrap().samples, Samples::U32(_)));
}

#[test]
fn nan_survives_an_exr_file() {
    let mut film = ramp_film(3, 2);
    film.planes[0].samples = Samples::F32(vec![f32::NAN; 6]);
    let back = exr::decode(&exr_bytes(&film), Path::new(NAME)).unwrap();
    assert!((0..6).all(|index| back.plane("R").unwrap().samples.get(index).is_nan()));
}

#[test]
fn single_pixels_and_single_rows_are_images_too() {
    for (width_px, height_px) in [(1, 1), (1, 70), (70, 1)] {
        let film = ramp_film(width_px, height_px);
        let back = exr::decode(&exr_bytes(&film), Path::new(NAME)).unwrap();
        assert_eq!(bits(&back, "G"), bits(&film, "G"));
        let back = png::decode(&png_bytes(&film, Display::Course), None, Path::new(NAME)).unwrap().film;
        assert_eq!((back.width_px, back.height_px), (width_px, height_px));
    }
}

#[test]
fn films_that_break_their_promises_are_refused_and_not_written() {
    let mut outside = ramp_film(4, 4);
    outside.data_window.x1 = 5;
    let mut short = ramp_film(4, 4);
    short.planes[1].samples = Samples::F32(vec![0.0; 3]);
    let mut twice = ramp_film(4, 4);
    twice.planes[1].name = "R".to_string();
    let mut none = ramp_film(4, 4);
    none.planes.clear();
    for film in [outside, short, twice, none] {
        let mut out = Cursor::new(Vec::new());
        assert!(exr::write(&film, &ExrOptions::FLOAT, &ExrAttributes::default(), &mut out).is_err());
        assert!(png::write(&film, &Display::Course, &mut out).is_err());
        assert!(pfm::write(&film, &mut out).is_err());
    }
}

#[test]
fn the_same_film_gives_the_same_bytes_every_time() {
    let film = crop_film();
    let display = Display::Picture(Picture { exposure_stops: 0.5, ..Picture::default() });
    let (first_exr, first_png) = (exr_bytes(&film), png_bytes(&film, display));
    for _ in 0..30 {
        assert!(exr_bytes(&film) == first_exr);
        assert!(png_bytes(&film, display) == first_png);
    }
}

/// Names the file that a child process of the next test writes.
const CHILD_FILE: &str = "FLATRAY_ROUNDTRIP_CHILD_FILE";

#[test]
fn the_same_film_gives_the_same_bytes_in_every_process() {
    if let Some(file) = std::env::var_os(CHILD_FILE) {
        std::fs::write(file, exr_bytes(&crop_film())).unwrap();
        return;
    }
    // Each process seeds its hash tables anew.
    let directory = tempfile::tempdir().unwrap();
    for index in 0..6 {
        let file = directory.path().join(format!("{index}.exr"));
        let name = "the_same_film_gives_the_same_bytes_in_every_process";
        let mut child = Command::new(std::env::current_exe().unwrap());
        let status = child.args([name, "--exact", "-q"]).env(CHILD_FILE, &file).output().unwrap().status;
        assert!(status.success());
        assert!(std::fs::read(&file).unwrap() == exr_bytes(&crop_film()), "process {index} wrote other bytes");
    }
}

#[test]
fn a_tone_mapped_png_holds_the_bytes_of_the_display_and_says_that_it_is_srgb() {
    let display = Display::Picture(Picture { exposure_stops: -1.0, ..Picture::default() });
    let film = ramp_film(31, 17);
    let bytes = png_bytes(&film, display);
    let file = png::decode(&bytes, None, Path::new(NAME)).unwrap();
    let [r, g, b] = film.color_planes().unwrap();
    let expected = (0..film.n_pixels())
        .map(|at| {
            let mut rgba = [0; 4];
            let color = [r.samples.get(at), g.samples.get(at), b.samples.get(at)];
            display.mapping().fill_rgba([color].into_iter(), &mut rgba);
            [rgba[0], rgba[1], rgba[2]]
        })
        .collect::<Vec<_>>();
    assert_eq!(file.rgb8.unwrap(), expected);
    assert!((0..film.n_pixels()).all(|at| file.film.plane("A").unwrap().samples.get(at) == 1.0));
    assert_eq!(&bytes[33..49], b"\0\0\0\x04gAMA\0\0\xb1\x8f\x0b\xfc\x61\x05");
    assert_eq!(&bytes[49..62], b"\0\0\0\x01sRGB\0\xae\xce\x1c\xe9");
}

#[test]
fn a_sixteen_bit_png_holds_the_levels_of_the_curve_and_states_the_same_transfer() {
    let picture = Picture { exposure_stops: -1.0, bit_depth: BitDepth::Sixteen, ..Picture::default() };
    let film = ramp_film(31, 40);
    let bytes = png_bytes(&film, Display::Picture(picture));
    assert_eq!(&bytes[16..29], b"\0\0\0\x1f\0\0\0\x28\x10\x06\0\0\0");
    assert_eq!(&bytes[33..49], b"\0\0\0\x04gAMA\0\0\xb1\x8f\x0b\xfc\x61\x05");
    let decoder = image::codecs::png::PngDecoder::new(Cursor::new(&bytes)).unwrap();
    let image = image::DynamicImage::from_decoder(decoder).unwrap().into_rgba16();
    let planes = film.color_planes().unwrap();
    let operator = ToneMap::default().operator();
    for (at, pixel) in image.pixels().enumerate() {
        let exposed = planes.map(|plane| plane.samples.get(at).max(0.0) * exposure_factor(-1.0));
        let [r, g, b] = operator.map(exposed).map(|c| quantize16(srgb_from_linear(c)));
        assert_eq!(pixel.0, [r, g, b, u16::MAX], "pixel {at}");
    }
    // Our own reader keeps the levels apart.
    let file = png::decode(&bytes, None, Path::new(NAME)).unwrap();
    assert!(file.rgb8.is_none());
    let red = file.film.plane("R").unwrap();
    for (at, pixel) in image.pixels().enumerate() {
        assert_eq!(quantize16(srgb_from_linear(red.samples.get(at))), pixel.0[0]);
    }
}

#[test]
fn a_course_png_states_no_transfer_and_takes_the_floor_of_256_levels() {
    let film = ramp_film(31, 17);
    let bytes = png_bytes(&film, Display::Course);
    assert_eq!(&bytes[37..41], b"IDAT");
    let file = png::decode(&bytes, Some(Transfer::Linear), Path::new(NAME)).unwrap();
    let green = film.plane("G").unwrap();
    for (at, rgb) in file.rgb8.unwrap().iter().enumerate() {
        let value = green.samples.get(at);
        assert_eq!(rgb[1], (value.min(1.0 - 1e-5) * 256.0).floor() as u8);
        assert_eq!(file.film.plane("G").unwrap().samples.get(at), f64::from(f32::from(rgb[1]) / 255.0));
    }
}

#[test]
fn a_cropped_film_gives_a_png_of_the_crop() {
    let file = png::decode(&png_bytes(&crop_film(), Display::Course), None, Path::new(NAME)).unwrap();
    assert_eq!((file.film.width_px, file.film.height_px), (61, 35));
}

#[test]
fn the_transfer_of_a_png_comes_from_its_chunks_unless_overridden() {
    let plain = png_bytes(&ramp_film(16, 16), Display::Course);
    // Behind the signature and IHDR.
    let mut gamma_half = plain[..33].to_vec();
    write_chunk(&mut gamma_half, *b"gAMA", &[&50_000_u32.to_be_bytes()]).unwrap();
    gamma_half.extend_from_slice(&plain[33..]);
    let red = |bytes: &[u8], transfer| {
        let file = png::decode(bytes, transfer, Path::new(NAME)).unwrap();
        (f64::from(file.rgb8.unwrap()[100][0]) / 255.0, file.film.plane("R").unwrap().samples.get(100))
    };
    let (byte, linear) = red(&gamma_half, None);
    assert!(byte > 0.3 && (linear - byte * byte).abs() < 1e-7);
    let (byte, linear) = red(&gamma_half, Some(Transfer::Linear));
    assert!((linear - byte).abs() < 1e-7);
    let (byte, linear) = red(&plain, None);
    assert!((linear - ((byte + 0.055) / 1.055).powf(2.4)).abs() < 1e-7);
}

#[test]
fn a_pfm_comes_back_bit_for_bit_in_both_byte_orders() {
    let film = Film { planes: crop_film().planes, ..ramp_film(61, 35) };
    let little = pfm_bytes(&film);
    let back = pfm::decode(&little, Path::new(NAME)).unwrap();
    for name in ["R", "G", "B"] {
        assert_eq!(bits(&back, name), bits(&film, name));
    }
    let header = b"PF\n61 35\n-1.0\n";
    assert_eq!(&little[..header.len()], header);
    let mut big = b"PF 61 35\n1.0\n".to_vec();
    big.extend(little[header.len()..].chunks_exact(4).flat_map(|value| value.iter().rev()));
    assert_eq!(pfm::decode(&big, Path::new(NAME)).unwrap(), back);
}

#[test]
fn the_first_row_of_a_pfm_is_the_lowest_and_grey_is_one_plane() {
    let bytes = [b"Pf\n1 2\n-1\n".as_slice(), &1.0_f32.to_le_bytes(), &2.0_f32.to_le_bytes()].concat();
    let film = pfm::decode(&bytes, Path::new(NAME)).unwrap();
    assert_eq!(film.plane("Y").unwrap().samples, Samples::F32(vec![2.0, 1.0]));
    let back = pfm::decode(&pfm_bytes(&film), Path::new(NAME)).unwrap();
    assert_eq!(back, film);
}

#[test]
fn damaged_pfm_headers_are_refused_with_their_byte() {
    let refused = |bytes: &[u8]| pfm::decode(bytes, Path::new("a.pfm")).unwrap_err().to_string();
    let damaged = "a.pfm: byte 3: the header of the PFM file is damaged";
    assert_eq!(refused(b"PF\n0 2\n-1\n"), format!("{damaged}: found \"0\", expected a width above 0"));
    assert_eq!(refused(b"PF\n-3 2\n-1\n"), format!("{damaged}: found \"-3\", expected a width above 0"));
    assert!(refused(b"PF\n1 1\nnan\n").contains("byte 7"));
    assert!(refused(b"PF\n4000000000 4000000000\n-1\n\0\0").contains("found 2 bytes of samples"));
    assert!(refused(b"PF").contains("byte 0"));
}

#[test]
fn truncated_files_are_refused_at_every_length() {
    let film = crop_film();
    let (exr, png, pfm) = (exr_bytes(&film), png_bytes(&film, Display::Course), pfm_bytes(&film));
    for (bytes, step) in [(&exr, 37), (&png, 11), (&pfm, 101)] {
        // Some programs leave out what follows the last pixel: a PNG is complete without its last chunk.
        for length in (0..bytes.len() - 20).step_by(step).chain(0..400) {
            let cut = &bytes[..length];
            let path = Path::new(NAME);
            assert!(exr::decode(cut, path).is_err(), "EXR, {length}");
            assert!(png::decode(cut, None, path).is_err(), "PNG, {length}");
            assert!(pfm::decode(cut, path).is_err(), "PFM, {length}");
        }
    }
}

#[test]
fn damaged_files_never_panic() {
    let seed = 20_261_122;
    let factor: usize = std::env::var("FLATRAY_TEST_FACTOR").ok().and_then(|text| text.parse().ok()).unwrap_or(1);
    let mut sequence = Sequence(seed);
    let film = crop_film();
    let files = [exr_bytes(&film), png_bytes(&film, Display::Course), pfm_bytes(&film)];
    let mut n_refused = 0;
    for _ in 0..600 * factor {
        for good in &files {
            let mut bytes = good.clone();
            for _ in 0..1 + sequence.below(4) {
                // Half of the damage goes to the header, where it does most.
                let end = if sequence.below(2) == 0 { 500.min(bytes.len()) } else { bytes.len() };
                let at = sequence.below(end);
                bytes[at] = match sequence.below(3) {
                    0 => sequence.next() as u8,
                    1 => bytes[at] ^ (1 << sequence.below(8)),
                    _ => [0x00, 0x7f, 0x80, 0xff][sequence.below(4)],
                };
            }
            let path = Path::new(NAME);
            n_refused += usize::from(exr::decode(&bytes, path).is_err());
            n_refused += usize::from(png::decode(&bytes, None, path).is_err());
            n_refused += usize::from(pfm::decode(&bytes, path).is_err());
        }
    }
    // Of the three readers two always refuse a file; damage must be noticed by the third as well, at times.
    assert!(n_refused > 600 * factor * 6, "seed {seed}");
}

/// Overwrites the start of the value of an EXR header's attribute, found by its name, type and size.
fn set_attribute(exr: &mut [u8], name_type_size: &[u8], value: &[u8]) {
    let found = exr.windows(name_type_size.len()).position(|window| window == name_type_size);
    let at = found.unwrap() + name_type_size.len();
    exr[at..at + value.len()].copy_from_slice(value);
}

#[test]
fn an_exr_header_is_not_believed_when_it_claims_more_than_the_file_can_hold() {
    let mut bytes = exr_bytes(&ramp_film(20, 20));
    let largest = (1_i32 << 29) - 1;
    let corners = [0, 0, largest, largest].map(i32::to_le_bytes).concat();
    set_attribute(&mut bytes, b"dataWindow\0box2i\0\x10\0\0\0", &corners);
    set_attribute(&mut bytes, b"chunkCount\0int\0\x04\0\0\0", &(1_i32 << 25).to_le_bytes());
    let error = exr::decode(&bytes, Path::new("a.exr")).unwrap_err().to_string();
    assert!(error.contains("claims more pixels") && error.contains("536870912×536870912"), "{error}");
}

#[test]
fn a_png_header_is_not_believed_when_it_claims_more_than_the_file_can_hold() {
    let plain = png_bytes(&ramp_film(20, 20), Display::Course);
    let ihdr = [0x7f, 0xff, 0xff, 0xff, 0x7f, 0xff, 0xff, 0xff, 8, 6, 0, 0, 0];
    let mut lying = plain[..8].to_vec();
    write_chunk(&mut lying, *b"IHDR", &[&ihdr]).unwrap();
    let error = png::decode(&[&lying, &plain[33..]].concat(), None, Path::new("a.png")).unwrap_err().to_string();
    assert!(error.contains("claims more pixels") && error.contains("2147483647×2147483647"), "{error}");
}

#[test]
fn lossy_exr_compression_is_refused_by_name() {
    let mut bytes = exr_bytes(&ramp_film(20, 20));
    // DWAA packs 32 lines into a chunk, ZIP 16.
    set_attribute(&mut bytes, b"compression\0compression\0\x01\0\0\0", &[8]);
    set_attribute(&mut bytes, b"chunkCount\0int\0\x04\0\0\0", &1_i32.to_le_bytes());
    let error = exr::decode(&bytes, Path::new("a.exr")).unwrap_err().to_string();
    assert!(error.contains("not read: found dwaa compression"), "{error}");
}

#[test]
fn files_written_and_read_by_path_agree_whatever_their_format() {
    let directory = tempfile::tempdir().unwrap();
    let film = ramp_film(40, 30);
    let path = |name: &str| directory.path().join(name);
    output::write_file(path("a.exr"), |out| exr::write(&film, &ExrOptions::FLOAT, &ExrAttributes::default(), out))
        .unwrap();
    output::write_file(path("a.pfm"), |out| pfm::write(&film, out)).unwrap();
    output::write_file(path("a.png"), |out| png::write(&film, &Display::Course, out)).unwrap();
    // The content decides, not the name.
    std::fs::rename(path("a.pfm"), path("pfm.png")).unwrap();
    let exr = read_image(path("a.exr"), None).unwrap();
    let pfm = read_image(path("pfm.png"), None).unwrap();
    let png = read_image(path("a.png"), Some(Transfer::Linear)).unwrap();
    assert_eq!(compare(&exr.film, &pfm.film).unwrap().differing, 0);
    assert!(compare(&exr.film, &film).unwrap().max <= f64::from(f32::EPSILON));
    assert!(compare(&exr.film, &png.film).unwrap().max > 0.2, "the bytes are clipped at 1, the film is not");
    assert_eq!(compare_files(&png, &png).unwrap().levels.unwrap().differing, 0);
}

#[test]
fn the_reference_images_survive_being_written_as_course_bytes() {
    for name in ["sphere", "spheres", "triangle", "quadric"] {
        let Some(path) = shared(&format!("seed/reference/{name}.png")) else { return };
        let reference = read_image(path, None).unwrap();
        let bytes = reference.rgb8.clone().unwrap();
        let plane = |name: &str, channel: usize| {
            Plane::color(name, Samples::F64(bytes.iter().map(|rgb| f64::from(rgb[channel]) / 256.0).collect()))
        };
        let planes = vec![plane("R", 0), plane("G", 1), plane("B", 2)];
        let film = Film { planes, ..reference.film.clone() };
        let written = png::decode(&png_bytes(&film, Display::Course), None, Path::new(NAME)).unwrap();
        let difference = compare_files(&reference, &written).unwrap();
        assert_eq!((difference.width, difference.height, difference.differing), (800, 800, 0), "{name}");
        assert_eq!(difference.levels.unwrap().differing, 0, "{name}");
    }
}

#[test]
fn one_scene_by_three_formats_and_two_renderers_agrees() {
    let Some(png) = shared("peers/pov1.png") else { return };
    let png = read_image(png, None).unwrap();
    let exr = read_image(shared("peers/pov1.exr").unwrap(), None).unwrap();
    let pfm = read_image(shared("peers/ref1.pfm").unwrap(), None).unwrap();
    assert_eq!(png.rgb8, None, "16 bits");
    // The halves of the EXR have 11 bits: values below 2 are off by at most 2^-11.
    let halves = compare(&exr.film, &png.film).unwrap();
    assert!(halves.differing > 1000 && halves.p999 <= 1.0 / 2048.0, "{halves:?}");
    let renderers = compare(&png.film, &pfm.film).unwrap();
    assert!(renderers.differing > 1000 && renderers.p999 <= 2e-5, "{renderers:?}");
}
