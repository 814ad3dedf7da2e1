//! Everything that an EXR file may be: read back bit for bit, the same bytes every time, damaged files refused.

mod film_kit;

use std::fs;
use std::path::Path;
use std::process::Command;

use film_kit::{all_options, layered_film};
use flatray::film::exr::merge::merge;
use flatray::film::exr::{self, ColorType, ExrAttributes, ExrOptions, ExrParts};
use flatray::film::rows::BAND_ROWS;
use flatray::film::{Content, Film, Region, Samples};
use half::f16;

const NAME: &str = "in memory";

fn whole_film() -> Film {
    layered_film(Region::whole(150, 100))
}

fn bytes_of(film: &Film, options: &ExrOptions, attributes: &ExrAttributes) -> Vec<u8> {
    let mut bytes = Vec::new();
    exr::write(film, options, attributes, &mut bytes).unwrap();
    bytes
}

fn texts(pairs: &[(&str, &str)]) -> Vec<(String, String)> {
    pairs.iter().map(|&(name, value)| (name.to_string(), value.to_string())).collect()
}

/// Bits of a plane as a file keeps it, widened to 32 bits.
fn stored_bits(film: &Film, name: &str, color: ColorType) -> Vec<u32> {
    let plane = film.plane(name).unwrap();
    let as_half = plane.content == Content::Color && color == ColorType::Half;
    match &plane.samples {
        Samples::F32(values) if as_half => {
            let in_range = values.iter().map(|v| if v.is_finite() { v.clamp(-65504.0, 65504.0) } else { *v });
            in_range.map(|value| f16::from_f32(value).to_f32().to_bits()).collect()
        }
        Samples::F32(values) => values.iter().map(|value| value.to_bits()).collect(),
        Samples::U32(values) => values.clone(),
        Samples::F64(_) => unreachable!(),
    }
}

#[test]
fn every_kind_of_file_comes_back_bit_for_bit() {
    for window in
        [Region::whole(150, 100), Region { x0: 3, y0: 17, x1: 149, y1: 18 }, Region { x0: 70, y0: 1, x1: 71, y1: 99 }]
    {
        let film = layered_film(window);
        for (name, options) in all_options() {
            let bytes = bytes_of(&film, &options, &ExrAttributes::default());
            let back = exr::decode(&bytes, Path::new(NAME)).unwrap();
            assert_eq!((back.width_px, back.height_px, back.data_window), (150, 100, window), "{name}");
            // Of several parts the one with the colour is read.
            let n_planes = if options.parts == ExrParts::Multi { 4 } else { film.planes.len() };
            assert_eq!(back.planes.len(), n_planes, "{name}");
            for plane in &back.planes {
                let expected = stored_bits(&film, &plane.name, options.color);
                let found = stored_bits(&back, &plane.name, ColorType::Float);
                assert!(found == expected, "{name}, plane {}", plane.name);
            }
        }
    }
}

#[test]
fn bands_handed_over_in_any_portions_give_the_same_bytes() {
    let film = layered_film(Region { x0: 5, y0: 3, x1: 140, y1: 90 });
    for (name, options) in all_options() {
        let expected = bytes_of(&film, &options, &ExrAttributes::default());
        for portion in [BAND_ROWS, 3 * BAND_ROWS, 4 * BAND_ROWS, 10 * BAND_ROWS] {
            let encoder = exr::Encoder::new(&film, &options, &ExrAttributes::default()).unwrap();
            (0..87).step_by(portion).for_each(|first_row| encoder.encode(&film.rows(first_row, portion)));
            let mut bytes = Vec::new();
            encoder.write(&film, &mut bytes).unwrap();
            assert!(bytes == expected, "{name}, {portion} rows at a time");
        }
    }
}

#[test]
fn flat_images_are_compressed_rightly_too() {
    for value in [0.0, 1.0, -65504.0, f32::NAN] {
        for window in [Region::whole(150, 100), Region { x0: 149, y0: 99, x1: 150, y1: 100 }] {
            let mut film = layered_film(window);
            for plane in &mut film.planes {
                match &mut plane.samples {
                    Samples::F32(values) => values.fill(value),
                    Samples::U32(values) => values.fill(value as u32),
                    Samples::F64(_) => unreachable!(),
                }
            }
            for (name, options) in all_options() {
                let bytes = bytes_of(&film, &options, &ExrAttributes::default());
                let back = exr::decode(&bytes, Path::new(NAME)).unwrap();
                for plane in &back.planes {
                    let expected = stored_bits(&film, &plane.name, options.color);
                    assert!(stored_bits(&back, &plane.name, ColorType::Float) == expected, "{name}, {value}");
                }
            }
        }
    }
}

/// Names of the attributes of a file's headers, in their order, and where the headers end.
fn attribute_names(bytes: &[u8]) -> (Vec<Vec<String>>, usize) {
    let is_multi_part = bytes[5] & 0x10 != 0;
    let mut at = 8;
    let text = |at: &mut usize| {
        let end = *at + bytes[*at..].iter().position(|&byte| byte == 0).unwrap();
        let text = String::from_utf8(bytes[*at..end].to_vec()).unwrap();
        *at = end + 1;
        text
    };
    let mut parts = Vec::new();
    loop {
        let mut names = Vec::new();
        while bytes[at] != 0 {
            names.push(text(&mut at));
            let _kind = text(&mut at);
            at += 4 + u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
        }
        at += 1;
        parts.push(names);
        if !is_multi_part || bytes[at] == 0 {
            return (parts, at);
        }
    }
}

#[test]
fn attributes_stand_in_the_order_of_their_names_in_every_part() {
    let names = ["zebra", "flatray/seed", "a", "Z", "равнина", "cryptomatte/1/name", "cryptomatte/1/manifest"];
    let values: Vec<(&str, &str)> = names.iter().map(|&name| (name, "CryptoObject")).collect();
    let attributes = ExrAttributes {
        numbers: vec![("samples".to_string(), 3), ("depth".to_string(), 4)],
        texts: texts(&values),
        render_seconds: Some(1.0),
        world_to_camera: Some([0.5; 16]),
        ..ExrAttributes::default()
    };
    for (name, options) in all_options() {
        let (parts, _) = attribute_names(&bytes_of(&whole_film(), &options, &attributes));
        assert_eq!(parts.len(), if options.parts == ExrParts::Multi { 5 } else { 1 }, "{name}");
        for names in &parts {
            assert!(names.is_sorted_by(|a, b| a.as_bytes() < b.as_bytes()), "{name}: {names:?}");
            for expected in
                ["zebra", "colorInteropID", "chromaticities", "software", "worldToCamera", "type", "chunkCount"]
            {
                assert!(names.iter().any(|name| name == expected), "{name}: {expected} is not in {names:?}");
            }
        }
        let with_manifest = parts.iter().map(|names| names.iter().any(|name| name == "cryptomatte/1/manifest"));
        let expected: &[bool] = if parts.len() == 5 { &[true, false, false, false, true] } else { &[true] };
        assert_eq!(
            with_manifest.collect::<Vec<_>>(),
            expected,
            "{name}: a manifest stands in the first part and its own"
        );
    }
}

#[test]
fn names_of_more_than_31_bytes_set_a_flag_and_more_than_255_are_refused() {
    let long_names = |film: &Film, attributes: &ExrAttributes| {
        let bytes = bytes_of(film, &ExrOptions::default(), attributes);
        assert!(exr::decode(&bytes, Path::new(NAME)).is_ok());
        bytes[5] & 0x04 != 0
    };
    let named =
        |length: usize| ExrAttributes { texts: texts(&[(&"n".repeat(length), "v")]), ..ExrAttributes::default() };
    assert!(!long_names(&whole_film(), &named(31)));
    assert!(long_names(&whole_film(), &named(32)) && long_names(&whole_film(), &named(255)));
    let mut film = whole_film();
    film.planes[4].name = "light_a_lamp_of_a_rather_long_name.R".to_string();
    assert!(long_names(&film, &ExrAttributes::default()));

    let refused = |attributes: &ExrAttributes| exr::Encoder::new(&film, &ExrOptions::default(), attributes).is_err();
    assert!(refused(&named(256)) && refused(&named(0)));
    let bad = [[("a", "1"), ("a", "2")], [("a", "with\0zero"), ("b", "")], [("compression", "zip"), ("b", "")]];
    for pairs in bad {
        assert!(refused(&ExrAttributes { texts: texts(&pairs), ..ExrAttributes::default() }), "{pairs:?}");
    }
    film.planes[4].name = "n".repeat(256);
    assert!(exr::Encoder::new(&film, &ExrOptions::default(), &ExrAttributes::default()).is_err());
}

#[test]
fn a_manifest_of_megabytes_is_written_once_and_read() {
    let manifest = "x".repeat(3 << 20);
    let pairs = [("cryptomatte/1/name", "CryptoObject"), ("cryptomatte/1/manifest", manifest.as_str())];
    let attributes = ExrAttributes { texts: texts(&pairs), ..ExrAttributes::default() };
    let bytes = bytes_of(&whole_film(), &ExrOptions::default(), &attributes);
    assert!(exr::decode(&bytes, Path::new(NAME)).is_ok() && bytes.len() > 3 << 20 && bytes.len() < 4 << 20);
}

/// Numbers of a fixed sequence (xorshift64).
struct Sequence(u64);

impl Sequence {
    fn below(&mut self, end: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % end as u64) as usize
    }
}

#[test]
fn damaged_files_of_every_kind_are_read_or_refused_without_a_panic() {
    let seed = 20_261_125;
    let factor: usize = std::env::var("FLATRAY_TEST_FACTOR").ok().and_then(|text| text.parse().ok()).unwrap_or(1);
    let mut sequence = Sequence(seed);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("damaged.exr");
    let film = layered_film(Region { x0: 10, y0: 20, x1: 90, y1: 90 });
    let mut n_refused = 0;
    for (_, options) in all_options() {
        let good =
            bytes_of(&film, &options, &ExrAttributes { texts: texts(&[("a", "b")]), ..ExrAttributes::default() });
        let (_, header_end) = attribute_names(&good);
        for _ in 0..40 * factor {
            let mut bytes = good.clone();
            match sequence.below(8) {
                0 => bytes.truncate(sequence.below(good.len())),
                // Tables of blocks, then whatever follows.
                1 => (0..8).for_each(|_| bytes[header_end + sequence.below(400)] = sequence.below(256) as u8),
                _ => {
                    for _ in 0..1 + sequence.below(4) {
                        let end = if sequence.below(2) == 0 { header_end } else { bytes.len() };
                        let at = sequence.below(end);
                        bytes[at] = [0x00, 0x7f, 0x80, 0xff, sequence.below(256) as u8][sequence.below(5)];
                    }
                }
            }
            n_refused += usize::from(exr::decode(&bytes, Path::new(NAME)).is_err());
            fs::write(&path, &bytes).unwrap();
            n_refused += usize::from(merge(&[&path]).is_err());
        }
    }
    // No file covers its display window: merging refuses all of them, in the end.
    assert!(n_refused > 40 * 40 * factor, "seed {seed}: {n_refused}");
}

/// Overwrites the start of the value of an attribute, found by its name, type and size.
fn set_attribute(exr: &mut [u8], name_type_size: &[u8], value: &[u8]) {
    let at =
        exr.windows(name_type_size.len()).position(|window| window == name_type_size).unwrap() + name_type_size.len();
    exr[at..at + value.len()].copy_from_slice(value);
}

#[test]
fn headers_are_not_believed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let merge_error = |bytes: &[u8]| {
        fs::write(&path, bytes).unwrap();
        merge(&[&path]).unwrap_err().to_string()
    };
    let tiles = all_options().into_iter().find(|(name, _)| name == "none_tiles_half_single").unwrap().1;
    let good = bytes_of(&whole_film(), &tiles, &ExrAttributes::default());
    // A frame that nobody could hold, of which the file has a corner.
    let mut huge = good.clone();
    let corners = [0, 0, (1 << 29) - 1, (1 << 29) - 1].map(i32::to_le_bytes).concat();
    set_attribute(&mut huge, b"displayWindow\0box2i\0\x10\0\0\0", &corners);
    let error = merge_error(&huge);
    assert!(error.contains("288230376151696744 pixels are in none of the files"), "{error}");
    // One tile that is larger than the image, whose block claims two gigabytes.
    let mut one_tile = good.clone();
    set_attribute(&mut one_tile, b"tiles\0tiledesc\0\x09\0\0\0", &[65_536_u32, 65_536].map(u32::to_le_bytes).concat());
    set_attribute(&mut one_tile, b"chunkCount\0int\0\x04\0\0\0", &1_i32.to_le_bytes());
    let (_, end) = attribute_names(&one_tile);
    one_tile[end..end + 8].copy_from_slice(&(end as u64 + 8).to_le_bytes());
    one_tile[end + 8..end + 28].copy_from_slice(&[0, 0, 0, 0, i32::MAX].map(i32::to_le_bytes).concat());
    assert!(merge_error(&one_tile).contains("lacks part of its image"));
    assert!(exr::decode(&one_tile, Path::new(NAME)).unwrap_err().to_string().contains("lacks part"));
    // Parts that are small each and large together.
    let multi = ExrOptions { parts: ExrParts::Multi, ..ExrOptions::default() };
    let mut many = bytes_of(&layered_film(Region::whole(1, 1)), &multi, &ExrAttributes::default());
    let corners = [0, 0, 899, 1999].map(i32::to_le_bytes).concat();
    let n_parts = attribute_names(&many).0.len();
    let found: Vec<usize> =
        (0..many.len() - 22).filter(|&at| many[at..].starts_with(b"dataWindow\0box2i\0\x10\0\0\0")).collect();
    assert_eq!(found.len(), n_parts);
    found.iter().for_each(|at| many[at + 21..at + 37].copy_from_slice(&corners));
    assert!(exr::decode(&many, Path::new(NAME)).unwrap_err().to_string().contains("claims more pixels"));
}

fn flatray(folder: &Path, arguments: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_flatray"));
    command.args(arguments.split_whitespace()).current_dir(folder);
    command
}

#[test]
fn two_renders_of_a_scene_are_the_same_bytes_whatever_the_threads() {
    let folder = tempfile::tempdir().unwrap();
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/glass.toml");
    for options in ["", "--exr float,multipart,piz", "--exr tiles,zips"] {
        let mut first: Option<Vec<u8>> = None;
        for threads in [1, 2, 5, 2] {
            let arguments =
                format!("render {} --width 80 --height 60 --samples 2 -q -o a.exr {options}", scene.display());
            assert!(flatray(folder.path(), &format!("{arguments} --threads {threads}")).status().unwrap().success());
            let bytes = fs::read(folder.path().join("a.exr")).unwrap();
            assert!(*first.get_or_insert_with(|| bytes.clone()) == bytes, "{options}, {threads} threads");
        }
    }
}

#[test]
fn the_header_says_what_was_rendered_and_the_time_only_when_asked() {
    let folder = tempfile::tempdir().unwrap();
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/sphere.toml");
    let render = |options: &str| {
        let arguments = format!("render {} --width 32 --height 20 --samples 3 -q -o a.exr {options}", scene.display());
        assert!(flatray(folder.path(), &arguments).status().unwrap().success(), "{options}");
        fs::read(folder.path().join("a.exr")).unwrap()
    };
    let has = |bytes: &[u8], part: &[u8]| bytes.windows(part.len()).any(|window| window == part);
    let plain = render("--seed 18446744073709551615");
    for part in [
        b"flatray/scene\0string\0\x0b\0\0\0sphere.toml".as_slice(),
        b"flatray/samples\0int\0\x04\0\0\0\x03\0\0\0",
        b"flatray/seed\0string\0\x14\0\0\x0018446744073709551615",
        b"flatray/sampler\0string\0\x05\0\0\0sobol",
        b"colorInteropID\0string\0\x10\0\0\0lin_rec709_scene",
        b"worldToCamera\0m44f\0\x40\0\0\0",
        b"worldToNDC\0m44f\0\x40\0\0\0",
        b"compression\0compression\0\x01\0\0\0\x03",
    ] {
        assert!(has(&plain, part), "{}", part.escape_ascii());
    }
    // A target takes the place of what it decides.
    let aimed = fs::read({
        let arguments = format!("render {} --width 32 --height 20 --error 0.01 -q -o e.exr", scene.display());
        assert!(flatray(folder.path(), &arguments).status().unwrap().success());
        folder.path().join("e.exr")
    })
    .unwrap();
    assert!(has(&aimed, b"flatray/errorAtMost\0string\0\x04\0\0\x001e-2"));
    assert!(!has(&aimed, b"flatray/samples\0") && !has(&aimed, b"flatray/sampler\0"));
    let time = b"flatray/renderSeconds\0float\0\x04\0\0\0";
    assert!(!has(&plain, time) && has(&render("--exr time"), time));
    assert!(has(&render("--exr piz"), b"compression\0compression\0\x01\0\0\0\x04"));
}

#[test]
fn a_crop_has_a_true_data_window_or_is_padded_with_zeros() {
    let folder = tempfile::tempdir().unwrap();
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/room.toml");
    let render = |options: &str| {
        let arguments =
            format!("render {} --width 40 --height 30 --samples 1 -q -o a.exr -o a.png {options}", scene.display());
        assert!(flatray(folder.path(), &arguments).status().unwrap().success(), "{options}");
        (
            exr::read(folder.path().join("a.exr")).unwrap(),
            flatray::film::read_image(folder.path().join("a.png"), None).unwrap(),
        )
    };
    let (whole, _) = render("");
    let region = Region { x0: 5, y0: 7, x1: 30, y1: 20 };
    let (window, picture) = render("--crop 5,7,30,20 --crop-output window");
    assert_eq!((window.width_px, window.height_px, window.data_window), (40, 30, region));
    assert_eq!((picture.film.width_px, picture.film.height_px), (25, 13));
    let (full, picture) = render("--crop 5,7,30,20 --crop-output full");
    assert_eq!((full.width_px, full.height_px, full.data_window), (40, 30, Region::whole(40, 30)));
    assert_eq!((picture.film.width_px, picture.film.height_px), (40, 30));
    for (full, whole) in full.planes.iter().zip(&whole.planes) {
        for (x, y) in (0..30).flat_map(|y| (0..40).map(move |x| (x, y))) {
            let at = Region::whole(40, 30).index_of(x, y);
            let is_inside = (region.x0..region.x1).contains(&x) && (region.y0..region.y1).contains(&y);
            let expected = if is_inside { whole.samples.get(at) } else { 0.0 };
            assert_eq!(full.samples.get(at), expected, "{} at {x},{y}", full.name);
        }
    }
    assert_eq!(render("--crop 0,0,40,30 --crop-output full").0, whole);
}

#[cfg(unix)]
#[test]
fn a_full_disk_is_an_error_that_leaves_what_was_there() {
    let folder = tempfile::tempdir().unwrap();
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/sphere.toml");
    fs::write(folder.path().join("a.exr"), "old").unwrap();
    // A file may have 8 blocks of 512 bytes here; the signal that says so is ignored, as on a disk that is full.
    let script = "trap '' XFSZ; ulimit -f 8; exec \"$@\"";
    for options in ["", "--exr none", "--exr piz,tiles,multipart"] {
        let mut command = Command::new("sh");
        command
            .args(["-c", script, "sh", env!("CARGO_BIN_EXE_flatray"), "render"])
            .arg(&scene)
            .current_dir(folder.path());
        command
            .args("--width 300 --height 200 --samples 1 -o a.exr -o b.png".split(' '))
            .args(options.split_whitespace());
        let output = command.output().unwrap();
        let text = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{text}");
        assert!(text.contains("a.exr") && text.contains("cannot write the file"), "{text}");
        assert_eq!(fs::read(folder.path().join("a.exr")).unwrap(), b"old");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "nothing else is left");
    }
}
