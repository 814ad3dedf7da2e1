//! Crops of one frame, joined: the file that a whole render writes, byte for byte, or an error that says why not.

mod film_kit;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use film_kit::{all_options, layered_film};
use flatray::film::exr::merge::merge;
use flatray::film::exr::{self, ExrAttributes, ExrOptions};
use flatray::film::{Film, Region, Samples, output, png};
use tempfile::TempDir;

fn write(path: &Path, film: &Film, options: &ExrOptions, attributes: &ExrAttributes) {
    output::write_file(path, |out| exr::write(film, options, attributes, out)).unwrap();
}

fn whole_film() -> Film {
    layered_film(Region::whole(150, 100))
}

/// Uneven crops of 150×100 pixels; one is a single row, two overlap.
const CROPS: [Region; 5] = [
    Region { x0: 0, y0: 0, x1: 97, y1: 33 },
    Region { x0: 97, y0: 0, x1: 150, y1: 34 },
    Region { x0: 0, y0: 33, x1: 150, y1: 34 },
    Region { x0: 0, y0: 34, x1: 150, y1: 99 },
    Region { x0: 0, y0: 97, x1: 150, y1: 100 },
];

fn attributes() -> ExrAttributes {
    let texts =
        [("flatray/seed", "7"), ("cryptomatte/1234567/name", "CryptoObject"), ("cryptomatte/1234567/manifest", "{}")];
    ExrAttributes {
        numbers: vec![("flatray/samples".to_string(), 16)],
        texts: texts.map(|(name, value)| (name.to_string(), value.to_string())).into(),
        ..ExrAttributes::default()
    }
}

/// Files of the crops in a folder.
fn write_crops(folder: &Path, options: &ExrOptions) -> Vec<PathBuf> {
    let path = |index: usize| folder.join(format!("crop{index}.exr"));
    for (index, region) in CROPS.into_iter().enumerate() {
        write(&path(index), &layered_film(region), options, &attributes());
    }
    (0..CROPS.len()).map(path).collect()
}

fn merged(paths: &[PathBuf]) -> Result<Vec<u8>, String> {
    let paths: Vec<&Path> = paths.iter().map(PathBuf::as_path).collect();
    let mut bytes = Vec::new();
    merge(&paths).map_err(|error| error.to_string())?.write(&mut bytes).unwrap();
    Ok(bytes)
}

#[test]
fn crops_are_joined_to_the_bytes_of_the_whole_whatever_the_file_is() {
    let folder = tempfile::tempdir().unwrap();
    for (name, options) in all_options() {
        let whole = folder.path().join("whole.exr");
        write(&whole, &whole_film(), &options, &attributes());
        let mut paths = write_crops(folder.path(), &options);
        assert!(merged(&paths).unwrap() == fs::read(&whole).unwrap(), "{name}");
        paths.reverse();
        assert!(merged(&paths).unwrap() == fs::read(&whole).unwrap(), "{name}, from the last to the first");
        assert!(merged(std::slice::from_ref(&whole)).unwrap() == fs::read(&whole).unwrap(), "{name}, the whole alone");
    }
}

#[test]
fn the_time_that_a_render_took_may_differ_and_is_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let options = ExrOptions::default();
    let mut paths = write_crops(folder.path(), &options);
    let whole = folder.path().join("whole.exr");
    write(&whole, &whole_film(), &options, &attributes());
    for (path, seconds) in [(&paths[1], 1.5), (&paths[3], 2.5)] {
        let film = exr::read(path).unwrap();
        let film = layered_film(film.data_window);
        write(path, &film, &options, &ExrAttributes { render_seconds: Some(seconds), ..attributes() });
    }
    assert!(merged(&paths).unwrap() == fs::read(&whole).unwrap());
    paths.swap(0, 1);
    assert!(merged(&paths).unwrap() == fs::read(&whole).unwrap());
}

#[test]
fn overlaps_that_differ_in_a_bit_are_refused_with_the_pixel() {
    let folder = tempfile::tempdir().unwrap();
    let paths = write_crops(folder.path(), &ExrOptions::FLOAT);
    for (plane, name) in [(0, "R"), (8, "object.I")] {
        let mut film = layered_film(CROPS[4]);
        // The pixel 20,98 lies in the last crop and in the one before.
        match &mut film.planes[plane].samples {
            Samples::F32(values) => values[150 + 20] = f32::from_bits(values[150 + 20].to_bits() ^ 1),
            Samples::U32(values) => values[150 + 20] ^= 1,
            Samples::F64(_) => unreachable!(),
        }
        write(&paths[4], &film, &ExrOptions::FLOAT, &attributes());
        let error = merged(&paths).unwrap_err();
        for part in ["crop4.exr", "crop3.exr", "the pixel 20,98", &format!("channel {name} differs")] {
            assert!(error.contains(part), "{part:?} is not in {error}");
        }
    }
}

#[test]
fn gaps_are_refused_with_their_size_and_first_pixel() {
    let folder = tempfile::tempdir().unwrap();
    let paths = write_crops(folder.path(), &ExrOptions::default());
    let without = |index: usize| {
        let mut paths = paths.clone();
        paths.remove(index);
        merged(&paths).unwrap_err()
    };
    let error = without(1);
    assert!(error.contains("1749 pixels are in none of the files, the first at 97,0"), "{error}");
    let error = without(4);
    assert!(error.contains("150 pixels are in none of the files, the first at 0,99"), "{error}");
}

#[test]
fn files_of_other_renders_are_refused_with_both_names_and_the_attribute() {
    let folder = tempfile::tempdir().unwrap();
    let options = ExrOptions::default();
    let paths = write_crops(folder.path(), &options);
    let film = layered_film(CROPS[3]);
    let refused = |film: &Film, options: ExrOptions, attributes: &ExrAttributes, expected: &str| {
        write(&paths[3], film, &options, attributes);
        let error = merged(&paths).unwrap_err();
        for part in ["crop3.exr", "crop0.exr", "not of the same render", expected] {
            assert!(error.contains(part), "{part:?} is not in {error}");
        }
    };
    for (name, other) in all_options().into_iter().filter(|&(_, other)| other != options) {
        let attribute = match other {
            _ if other.parts != options.parts => "the number of parts differs",
            _ if other.color != options.color => "the attribute channels differs",
            _ if other.compression != options.compression => "the attribute compression differs",
            _ => "the attribute tiles differs: found",
        };
        refused(&film, other, &attributes(), attribute);
        assert!(merged(&paths[..1]).is_err(), "{name}");
    }
    let mut seed = attributes();
    seed.texts[0].1 = "8".to_string();
    refused(&film, options, &seed, "the attribute flatray/seed differs: found \"8\", expected \"7\"");
    let mut samples = attributes();
    samples.numbers[0].1 = 17;
    refused(&film, options, &samples, "the attribute flatray/samples differs: found 17, expected 16");
    let more = ExrAttributes { world_to_ndc: Some([1.0; 16]), ..attributes() };
    refused(&film, options, &more, "the attribute worldToNDC differs");
    let less = ExrAttributes { numbers: Vec::new(), ..attributes() };
    refused(&film, options, &less, "the attribute flatray/samples differs: found none");
    let other = ExrAttributes { software: "flatray 0".to_string(), ..attributes() };
    refused(&film, options, &other, "the attribute software differs");
    let mut planes = film.clone();
    planes.planes.pop();
    refused(&planes, options, &attributes(), "the attribute channels differs");
    let display = Film { width_px: 151, ..film.clone() };
    refused(&display, options, &attributes(), "the attribute displayWindow differs: found 151×100 pixels");
}

/// A folder with a scene in it.
struct Room(TempDir);

impl Room {
    fn run(&self, arguments: &str) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_flatray"));
        command.args(arguments.split_whitespace()).current_dir(self.0.path()).output().unwrap()
    }

    fn succeeds(&self, arguments: &str) -> String {
        let output = self.run(arguments);
        assert_eq!(output.status.code(), Some(0), "flatray {arguments}\n{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8_lossy(&output.stdout).into_owned()
    }

    fn fails(&self, arguments: &str, code: i32, messages: &[&str]) {
        let output = self.run(arguments);
        let text = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "flatray {arguments}\n{text}");
        for message in messages {
            assert!(text.contains(message), "flatray {arguments}\nno {message:?} in:\n{text}");
        }
        assert!(!self.0.path().join("out.exr").exists(), "nothing is written on failure");
    }

    fn bytes(&self, name: &str) -> Vec<u8> {
        fs::read(self.0.path().join(name)).unwrap()
    }
}

#[test]
fn four_renders_of_crops_are_merged_to_the_bytes_of_one_render() {
    let room = Room(tempfile::tempdir().unwrap());
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let crops = ["0,0,53,40", "53,0,90,41", "0,40,53,41", "0,41,90,70"];
    for (scene, options) in
        [("glass", ""), ("room", "--exr piz,tiles,multipart"), ("mesh", "--exr float,rle --tile-size 16")]
    {
        let scene = scenes.join(scene).with_extension("toml");
        let render = format!("render {} --width 90 --height 70 --samples 4 --seed 5 -q {options}", scene.display());
        room.succeeds(&format!("{render} -o whole.exr --threads 2"));
        for (index, crop) in crops.into_iter().enumerate() {
            let threads = index + 1;
            room.succeeds(&format!("{render} --crop {crop} --threads {threads} -o {index}.exr"));
        }
        let told = room.succeeds("merge out.exr 0.exr 1.exr 2.exr 3.exr");
        assert!(told.contains("out.exr: 90x70 from 4 files"), "{told}");
        assert!(room.bytes("out.exr") == room.bytes("whole.exr"), "{render}");
        // A merge of what was merged, and of a crop with time in its header.
        room.succeeds(&format!("{render} --crop {} -o 2.exr {}", crops[2], time_beside(options)));
        room.succeeds("merge -q again.exr 2.exr out.exr");
        assert!(room.bytes("again.exr") == room.bytes("whole.exr"), "{render}");
        fs::remove_file(room.0.path().join("out.exr")).unwrap();
    }
}

/// The same options with the time written.
fn time_beside(options: &str) -> String {
    match options.split_once("--exr ") {
        // A repeated option would be wrong usage: this one is left as it is.
        Some(_) => String::new(),
        None => "--exr time".to_string(),
    }
}

#[test]
fn what_cannot_be_merged_is_refused_and_nothing_is_written() {
    let room = Room(tempfile::tempdir().unwrap());
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/sphere.toml");
    let render = format!("render {} --width 40 --height 30 --samples 1 -q", scene.display());
    room.succeeds(&format!("{render} --crop 0,0,40,10 -o a.exr"));
    room.succeeds(&format!("{render} --crop 0,10,40,30 -o b.exr"));
    room.succeeds(&format!("{render} --crop 0,10,40,30 --crop-output full -o full.exr"));
    room.succeeds(&format!("{render} --crop 0,10,40,30 --fov 11 -o stranger.exr"));
    room.succeeds(&format!("{render} -o picture.png"));
    // The same scene by its name, in which a light is a little brighter.
    let edited = fs::read_to_string(&scene).unwrap().replace("intensity = 1\n", "intensity = 1.01\n");
    fs::write(room.0.path().join("sphere.toml"), edited).unwrap();
    room.succeeds("render sphere.toml --width 40 --height 30 --samples 1 -q --crop 0,10,40,30 -o edited.exr");
    fs::write(room.0.path().join("text.exr"), "no image").unwrap();

    room.fails("merge out.exr", 2, &["INPUTS"]);
    room.fails("merge out.png a.exr b.exr", 2, &["out.png", ".exr"]);
    room.fails("merge ./a.exr b.exr a.exr", 2, &["a.exr", "is an input"]);
    room.fails("merge none/out.exr a.exr b.exr", 1, &["none"]);
    room.fails("merge out.exr a.exr missing.exr", 1, &["missing.exr", "cannot read"]);
    room.fails("merge out.exr a.exr picture.png", 1, &["picture.png", "PNG"]);
    room.fails("merge out.exr a.exr text.exr", 1, &["text.exr", "only EXR files"]);
    room.fails("merge out.exr a.exr", 1, &["800 pixels", "0,10", "a.exr"]);
    room.fails("merge out.exr a.exr stranger.exr", 1, &["stranger.exr", "a.exr", "worldToNDC"]);
    room.fails("merge out.exr a.exr edited.exr", 1, &["edited.exr", "a.exr", "flatray/world"]);
    room.fails("merge out.exr a.exr full.exr", 1, &["full.exr", "a.exr", "the pixel 18,4"]);
    let cut = &room.bytes("b.exr")[..1500];
    fs::write(room.0.path().join("cut.exr"), cut).unwrap();
    room.fails("merge out.exr a.exr cut.exr", 1, &["cut.exr"]);
    assert!(room.bytes("a.exr").starts_with(&exr::MAGIC), "the input is untouched");
    room.succeeds("merge -q out.exr a.exr b.exr");
}

#[test]
fn a_png_is_named_as_one() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    output::write_file(&path, |out| png::write(&whole_film(), &flatray::film::Display::Course, out)).unwrap();
    let error = merged(&[path]).unwrap_err();
    assert!(error.contains("a.exr") && error.contains("a PNG file"), "{error}");
    assert!(merged(&[]).is_err());
}
