//! `--tonemap` and its like on `render`, and `flatray tonemap`: the same bytes, and what is refused.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use flatray::film::exr::{self, ExrAttributes, ExrOptions};
use flatray::film::{Content, output, pfm};
use tempfile::TempDir;

/// Brighter than white in places, so that the curves differ.
const SCENE: &str = "[camera]\nwidth = 40\nheight = 36\n[render]\nsamples = 4\nbackground = [0.1, 0.3, 6]\n\
    [[hittable]]\ntype = \"sphere\"\nposition = [0, 0, -1.5]\nradius = 1\ndiffuse = [1, 0.6, 0.2]\nk_d = 3\nk_s = 0.4\nsh = 20\n\
    [[light_source]]\nposition = [2, 2, 0]\nintensity = 2\n";

struct Room(TempDir);

impl Room {
    fn new() -> Room {
        let room = Room(tempfile::tempdir().unwrap());
        fs::write(room.path("scene.toml"), SCENE).unwrap();
        room
    }

    fn path(&self, name: &str) -> std::path::PathBuf {
        self.0.path().join(name)
    }

    fn run(&self, arguments: &str) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_flatray"));
        command.args(arguments.split_whitespace()).current_dir(self.0.path()).output().unwrap()
    }

    fn succeeds(&self, arguments: &str) {
        let output = self.run(arguments);
        assert_eq!(output.status.code(), Some(0), "{arguments}: {}", String::from_utf8_lossy(&output.stderr));
    }

    /// What must fail says so and changes nothing.
    fn fails(&self, arguments: &str, code: i32, messages: &[&str]) {
        let before = self.contents();
        let output = self.run(arguments);
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(code), "{arguments}: {text}");
        for message in messages {
            assert!(text.contains(message), "{arguments}: no {message:?} in {text}");
        }
        assert!(!text.contains("panicked"), "{text}");
        assert!(self.contents() == before, "{arguments} changed files");
    }

    fn contents(&self) -> Vec<(String, Vec<u8>)> {
        let entries = fs::read_dir(self.0.path()).unwrap().map(|entry| entry.unwrap());
        let mut files: Vec<(String, Vec<u8>)> = entries
            .map(|entry| (entry.file_name().into_string().unwrap(), fs::read(entry.path()).unwrap_or_default()))
            .collect();
        files.sort();
        files
    }

    fn bytes(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap()
    }

    /// The image of `name`.pfm as an EXR that keeps all bits, and some that are no colour.
    fn write_float_exr(&self, name: &str) {
        let mut film = pfm::read(self.path(&format!("{name}.pfm"))).unwrap();
        film.planes.iter_mut().for_each(|plane| plane.content = Content::Data);
        let file = self.path(&format!("{name}.exr"));
        output::write_file(file, |out| exr::write(&film, &ExrOptions::default(), &ExrAttributes::default(), out))
            .unwrap();
    }
}

const OPTIONS: [&str; 10] = [
    "",
    "--tonemap clip",
    "--tonemap reinhard",
    "--tonemap reinhard --white-point 3",
    "--tonemap hable",
    "--tonemap hable --white-point 20 --exposure 1",
    "--tonemap aces-hill --png-bits 16",
    "--tonemap khronos-neutral --exposure -2.5",
    "--tonemap agx-approx --png-bits 8",
    "--png-bits 16 --exposure 0.25",
];

#[test]
fn tonemap_makes_the_png_that_a_render_with_the_same_options_makes() {
    let room = Room::new();
    room.succeeds("render scene.toml -q -o image.pfm");
    room.write_float_exr("image");
    let mut pictures: Vec<Vec<u8>> = Vec::new();
    for options in OPTIONS {
        room.succeeds(&format!("render scene.toml -q -o rendered.png {options}"));
        for input in ["image.pfm", "image.exr"] {
            room.succeeds(&format!("tonemap {input} mapped.png {options}"));
            assert!(room.bytes("mapped.png") == room.bytes("rendered.png"), "{input} {options}");
        }
        assert!(!pictures.contains(&room.bytes("rendered.png")), "{options} changes nothing");
        pictures.push(room.bytes("rendered.png"));
    }
}

#[test]
fn a_crop_is_mapped_as_a_crop() {
    let room = Room::new();
    room.succeeds("render scene.toml -q --crop 3,5,21,30 -o crop.pfm -o crop.png");
    room.write_float_exr("crop");
    room.succeeds("tonemap crop.exr mapped.png");
    assert!(room.bytes("mapped.png") == room.bytes("crop.png"));
}

#[test]
fn the_scene_says_how_its_picture_looks_and_the_command_line_overrules_it() {
    let room = Room::new();
    let with_keys =
        SCENE.replace("[render]\n", "[render]\ntonemap = \"reinhard\"\nwhite_point = 3\nfilter = \"gaussian\"\n");
    fs::write(room.path("keys.toml"), with_keys).unwrap();
    let same = |keys: &str, plain: &str| {
        room.succeeds(&format!("render keys.toml -q -o keys.png {keys}"));
        room.succeeds(&format!("render scene.toml -q -o plain.png {plain}"));
        assert!(room.bytes("keys.png") == room.bytes("plain.png"), "{keys} and {plain}");
    };
    same("", "--tonemap reinhard --white-point 3 --filter gaussian");
    same("--white-point 5 --filter box", "--tonemap reinhard --white-point 5");
    // The white point of the scene does not fit this one.
    same("--tonemap aces-hill", "--tonemap aces-hill --filter gaussian");
    same("--compat course", "--compat course");
}

#[test]
fn operators_and_options_that_do_not_fit_are_wrong_usage() {
    let room = Room::new();
    room.fails("render scene.toml --tonemap aces", 2, &["--tonemap", "aces-hill"]);
    room.fails("render scene.toml --tonemap agx-aprox", 2, &["'agx-approx'"]);
    room.fails("render scene.toml --filter gausian", 2, &["--filter", "'gaussian'"]);
    room.fails("render scene.toml --white-point 2", 2, &["khronos-neutral", "--white-point"]);
    room.fails("render scene.toml --tonemap clip --white-point 2", 2, &["'clip' has no white point"]);
    room.fails("render scene.toml --tonemap hable --white-point 0", 2, &["--white-point", "1e-6"]);
    room.fails("render scene.toml --png-bits 12", 2, &["--png-bits", "16"]);
    for option in ["--tonemap clip", "--white-point 2", "--png-bits 16", "--exposure 1", "--filter triangle"] {
        let name = option.split(' ').next().unwrap();
        room.fails(&format!("render scene.toml --compat course {option}"), 2, &["--compat", name]);
    }
}

#[test]
fn tonemap_refuses_what_it_cannot_map_and_leaves_what_was_there() {
    let room = Room::new();
    room.succeeds("render scene.toml -q -o image.exr -o image.png -o image.pfm");
    fs::write(room.path("old.png"), "old").unwrap();
    room.fails("tonemap image.exr picture.jpg", 2, &["picture.jpg", ".png"]);
    room.fails("tonemap image.exr", 2, &["<OUT.png>"]);
    room.fails("tonemap image.exr old.png --white-point 3", 2, &["--white-point"]);
    room.fails("tonemap none.exr old.png", 1, &["none.exr", "cannot read the image"]);
    room.fails("tonemap . old.png", 1, &["directory"]);
    room.fails("tonemap image.png old.png", 1, &["image.png", "a PNG", "an EXR or PFM file"]);
    room.fails("tonemap image.exr none/picture.png", 1, &["cannot write into the directory"]);
    room.fails("tonemap scene.toml old.png", 1, &["not an image that can be read"]);
    // The same file under other names: a PFM that calls itself a PNG.
    fs::copy(room.path("image.pfm"), room.path("float.png")).unwrap();
    room.fails("tonemap float.png ./float.png", 2, &["is the input"]);
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink(room.path("float.png"), room.path("link.png")).unwrap();
        room.fails("tonemap float.png link.png", 2, &["is the input"]);
        room.fails("tonemap link.png float.png", 2, &["is the input"]);
    }
    room.succeeds("tonemap float.png old.png");
    assert!(room.bytes("old.png") == room.bytes("image.png"));
}

#[test]
fn tonemap_survives_files_cut_short_and_headers_that_lie() {
    let room = Room::new();
    room.succeeds("render scene.toml -q -o image.exr -o image.pfm");
    fs::write(room.path("old.png"), "old").unwrap();
    let exr = room.bytes("image.exr");
    for length in [0, 3, 4, 8, 20, 100, 300, exr.len() / 2, exr.len() - 1] {
        fs::write(room.path("cut.exr"), &exr[..length]).unwrap();
        room.fails("tonemap cut.exr old.png", 1, &["cut.exr"]);
    }
    // Windows of two thousand million pixels each way, in a file of some kilobytes.
    let mut huge = exr;
    let name = b"dataWindow\0box2i\0";
    let at = huge.windows(name.len()).position(|window| window == name).unwrap() + name.len() + 4;
    huge[at + 8..at + 16].copy_from_slice(&[0xff, 0xff, 0xff, 0x7e, 0xff, 0xff, 0xff, 0x7e]);
    fs::write(room.path("huge.exr"), huge).unwrap();
    room.fails("tonemap huge.exr old.png", 1, &["huge.exr"]);
    fs::write(room.path("huge.pfm"), "PF\n2000000000 2000000000\n-1.0\nabcd").unwrap();
    room.fails("tonemap huge.pfm old.png", 1, &["huge.pfm"]);
    assert!(Path::new(&room.path("old.png")).exists());
}
