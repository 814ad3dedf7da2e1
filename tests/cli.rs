//! The command line as a user meets it: exit codes, messages, and which files are there afterwards.

/// What a test says that cannot run.
mod skip;

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use serde_json::Value;
use skip::skip;
use tempfile::TempDir;

const SCENE: &str = r#"
[camera]
extrinsic = [[1.0,0.0,0.0,0.0],[0.0,1.0,0.0,0.0],[0.0,0.0,1.0,0.0],[0.0,0.0,0.0,1.0]]
fov = 90.0
width = 32
height = 24

[[hittable]]
type = "sphere"
position = [0.0, 0.0, -1.5]
radius = 0.6
ambient = [1.0, 0.5, 0.25]
diffuse = [1.0, 1.0, 1.0]
specular = [1.0, 1.0, 1.0]
k_a = 0.1
k_d = 0.8
k_s = 0.1
sh = 1.0

[[light_source]]
position = [2.0, 2.0, 0.0]
intensity = 1.0
"#;

/// A directory of its own with a scene in it.
struct Room(TempDir);

impl Room {
    fn new() -> Room {
        let room = Room(tempfile::tempdir().unwrap());
        room.write("scene.toml", SCENE);
        room
    }

    fn path(&self) -> &Path {
        self.0.path()
    }

    fn write(&self, name: &str, text: &str) {
        fs::write(self.path().join(name), text).unwrap();
    }

    fn command(&self, arguments: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_flatray"));
        command.args(arguments.split_whitespace()).current_dir(self.path()).env_remove("RUST_BACKTRACE");
        command
    }

    fn run(&self, arguments: &str) -> Output {
        self.command(arguments).output().unwrap()
    }

    /// Runs what must succeed.
    fn succeeds(&self, arguments: &str) -> Output {
        let output = self.run(arguments);
        assert_eq!(output.status.code(), Some(0), "flatray {arguments}\n{}{}", out(&output), err(&output));
        output
    }

    /// Runs what must fail with an exit code, say so on standard error, and leave no new file behind.
    fn fails(&self, arguments: &str, code: i32, messages: &[&str]) {
        let before = self.names();
        let output = self.run(arguments);
        let text = err(&output);
        assert_eq!(output.status.code(), Some(code), "flatray {arguments}\n{}{text}", out(&output));
        for message in messages {
            assert!(text.contains(message), "flatray {arguments}\nno {message:?} in:\n{text}");
        }
        assert!(!text.contains("panicked"), "{text}");
        assert_eq!(self.names(), before, "flatray {arguments} left files behind");
    }

    fn names(&self) -> Vec<String> {
        let entries = fs::read_dir(self.path()).unwrap();
        let mut names: Vec<String> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    fn json(&self, arguments: &str) -> Value {
        serde_json::from_slice(&self.succeeds(arguments).stdout).unwrap()
    }
}

fn out(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn err(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Width and height that a PNG's header says.
fn png_size(path: &Path) -> (u32, u32) {
    let bytes = fs::read(path).unwrap();
    let number = |at: usize| u32::from_be_bytes(bytes[at..at + 4].try_into().unwrap());
    (number(16), number(20))
}

#[test]
fn without_a_command_the_built_in_scene_is_rendered_to_flatray_exr_and_png() {
    let room = Room(tempfile::tempdir().unwrap());
    let output = room.succeeds("render --width 16 --height 12 --samples 1");
    assert_eq!(room.names(), ["flatray.exr", "flatray.png"]);
    assert_eq!(png_size(&room.path().join("flatray.png")), (16, 12));
    for name in ["flatray.exr", "flatray.png"] {
        assert!(out(&output).contains(name), "{}", out(&output));
    }
}

#[test]
fn the_default_outputs_are_named_after_the_input() {
    let room = Room::new();
    room.succeeds("render scene.toml --samples 1");
    assert_eq!(room.names(), ["scene.exr", "scene.png", "scene.toml"]);
    assert_eq!(png_size(&room.path().join("scene.png")), (32, 24));
}

#[test]
fn only_the_named_outputs_are_written() {
    let room = Room::new();
    fs::create_dir(room.path().join("into")).unwrap();
    room.succeeds("render scene.toml --samples 1 -o a.PNG --output into/b.exr");
    assert_eq!(room.names(), ["a.PNG", "into", "scene.toml"]);
    assert!(fs::read(room.path().join("into/b.exr")).unwrap().starts_with(&[0x76, 0x2f, 0x31, 0x01]));
}

#[test]
fn a_mesh_is_framed_and_rendered() {
    let room = Room::new();
    room.write("tetra.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
    room.succeeds("render tetra.obj --width 20 --height 20 --samples 1 --stats s.json --up z");
    let stats: Value = serde_json::from_str(&fs::read_to_string(room.path().join("s.json")).unwrap()).unwrap();
    assert!(stats["rays"]["camera_hit"].as_u64().unwrap() > 20, "{stats}");
}

#[test]
fn an_nff_scene_is_rendered_and_described_and_known_by_its_name_and_by_its_text() {
    let room = Room::new();
    let text = "v from 0 0 5 at 0 0 0 up 0 1 0 angle 45 resolution 24 18\nl 5 5 5\nf 1 1 1 0.5 0.1 9 0.8 1.5\ns 0 0 0 1\n\
                c -1 -1 0 0.5 -1 1 0 0.25\np 4 -9 -9 -2 9 -9 -2 9 9 -2 -9 9 -2\n";
    room.write("glass.nff", text);
    room.write("glass.txt", text);
    room.succeeds("render glass.nff --samples 1 --stats s.json -o a.png");
    let stats: Value = serde_json::from_str(&fs::read_to_string(room.path().join("s.json")).unwrap()).unwrap();
    assert_eq!(stats["rays"]["camera_hit"], 24 * 18);
    assert!(stats["rays"]["refraction"].as_u64().unwrap() > 24 * 18, "{stats}");
    assert_eq!(png_size(&room.path().join("a.png")), (24, 18));
    for name in ["glass.nff", "glass.txt"] {
        let info = room.json(&format!("info {name} --json"));
        let counts =
            ["spheres", "quadrics", "unbounded_quadrics", "triangles"].map(|kind| info["primitives"][kind].as_u64());
        assert_eq!(counts, [Some(1), Some(1), Some(0), Some(2)]);
        assert_eq!(
            (info["materials"][0]["transmittance"].as_f64(), info["materials"][0]["ior"].as_f64()),
            (Some(0.8), Some(1.5))
        );
    }
    room.write("glass.nff", "v from 0 0 5 at 0 0 0 up 0 1 0 angle 45\n");
    room.fails("render glass.nff", 1, &["glass.nff:1: the view has no `resolution`"]);
}

#[test]
fn the_summary_tells_times_rays_memory_and_files() {
    let room = Room::new();
    let output = room.succeeds("render scene.toml --samples 1");
    for part in ["load", "build", "trace", "write", "camera 768", "Mray/s", "peak", "scene.exr", "scene.png"] {
        assert!(out(&output).contains(part), "no {part:?} in:\n{}", out(&output));
    }
}

#[test]
fn quiet_prints_nothing_but_errors() {
    let room = Room::new();
    let output = room.succeeds("render scene.toml --samples 1 --quiet");
    assert_eq!((out(&output), err(&output)), (String::new(), String::new()));
    room.fails("render none.toml --quiet", 1, &["none.toml"]);
}

#[test]
fn the_stats_file_has_the_agreed_keys_and_consistent_figures() {
    let room = Room::new();
    room.succeeds("render scene.toml --samples 4 --sampler grid --threads 2 --stats stats.json -o a.png");
    let stats: Value = serde_json::from_str(&fs::read_to_string(room.path().join("stats.json")).unwrap()).unwrap();
    for key in ["load", "build", "trace", "write", "total"] {
        assert!(stats["seconds"][key].as_f64().unwrap() >= 0.0, "{key}");
    }
    let of = |key: &str| stats["rays"][key].as_u64().unwrap();
    assert_eq!(of("camera"), 32 * 24 * 4);
    assert!(0 < of("camera_hit") && of("camera_hit") < of("camera"));
    assert!(of("shadow") > 0);
    assert_eq!(of("refraction"), 0);
    assert_eq!(stats["exact_tests"], 0, "nothing here is close to undecidable");
    assert!(of("reflection") <= 4 * of("camera_hit"));
    assert!(stats["memory_bytes"]["tables"].as_u64().unwrap() > 0);
    assert!(stats["memory_bytes"]["accel"].is_u64());
    if cfg!(target_os = "linux") {
        assert!(stats["memory_bytes"]["peak"].as_u64().unwrap() > 1 << 20);
    }
    let sizes = ["width", "height", "samples", "threads"].map(|key| stats[key].as_u64().unwrap());
    assert_eq!(sizes, [32, 24, 4, 2]);
}

#[test]
fn tests_that_needed_exact_arithmetic_are_told_when_there_are_any() {
    let room = Room::new();
    let plain = out(&room.succeeds("render scene.toml --samples 1"));
    assert!(!plain.contains("exact arithmetic"), "{plain}");
    // The ray of the middle pixel goes through an edge.
    room.write("edge.toml", "[[hittable]]\ntype = \"triangle\"\na = [0, -3, -7]\nb = [0, 5, -7]\nc = [-4, 1, -7]\n");
    let told = out(&room.succeeds("render edge.toml --width 3 --height 3 --samples 1 --stats s.json"));
    let stats: Value = serde_json::from_str(&fs::read_to_string(room.path().join("s.json")).unwrap()).unwrap();
    let n_tests = stats["exact_tests"].as_u64().unwrap();
    assert!(n_tests > 0 && told.contains(&format!("exact   {n_tests} primitive test")), "{n_tests}: {told}");
}

#[test]
fn the_terminator_correction_is_an_option_that_the_compatible_mode_refuses() {
    let room = Room::new();
    room.succeeds("render scene.toml --samples 1 --terminator -o on.png");
    room.succeeds("render scene.toml --samples 1 --terminator=false -o off.png");
    let bytes = |name: &str| fs::read(room.path().join(name)).unwrap();
    assert_eq!(bytes("on.png"), bytes("off.png"), "a scene without a smooth mesh is not changed");
    room.fails("render scene.toml --compat course --terminator", 2, &["--terminator"]);
    room.fails("render scene.toml --terminator=perhaps", 2, &["perhaps"]);
}

#[test]
fn a_crop_is_rendered_alone_and_must_lie_inside() {
    let room = Room::new();
    room.succeeds("render scene.toml --samples 1 --crop 4,6,20,15 -o crop.png -o crop.exr --stats s.json");
    assert_eq!(png_size(&room.path().join("crop.png")), (16, 9));
    let stats: Value = serde_json::from_str(&fs::read_to_string(room.path().join("s.json")).unwrap()).unwrap();
    assert_eq!(stats["rays"]["camera"], 16 * 9);
    room.fails("render scene.toml --crop 0,0,33,24", 2, &["--crop", "32x24"]);
    room.fails("render scene.toml --crop 5,5,5,9", 2, &["--crop", "empty"]);
    room.fails("render scene.toml --crop 1,2,3", 2, &["four whole numbers"]);
}

#[test]
fn wrong_values_are_wrong_usage() {
    let room = Room::new();
    let wrong = [
        "--threads 0",
        "--samples 0",
        "--width 0",
        "--height -5",
        "--max-depth 0",
        "--tile-size 0",
        "--fov 180",
        "--fov nan",
        "--sampler halton",
        "--up x",
        "--accel octree",
        "--compat course2",
        "--exposure inf",
        "--exr flaot",
        "--exr half,float",
        "--crop-output all",
        "--seed -1",
        "--unknown",
    ];
    for option in wrong {
        let name = option.split(' ').next().unwrap();
        room.fails(&format!("render scene.toml {option}"), 2, &[name, "--help"]);
    }
    room.fails("paint", 2, &["paint"]);
    room.fails("info", 2, &["INPUT"]);
    room.fails("diff a.png", 2, &["<B>"]);
}

#[test]
fn options_that_contradict_each_other_are_wrong_usage() {
    let room = Room::new();
    room.fails("render scene.toml --sampler center --samples 4", 2, &["center", "--samples"]);
    room.fails("render scene.toml --compat course --samples 16", 2, &["course", "--samples"]);
    room.fails("render scene.toml --compat course --sampler jitter", 2, &["course", "--sampler"]);
    room.fails("render scene.toml --compat course --max-depth 3", 2, &["course", "--max-depth"]);
    room.fails("render scene.toml --compat course --exposure 1", 2, &["--compat", "--exposure"]);
    room.succeeds("render scene.toml --sampler center --samples 1 -q");
    room.succeeds("render scene.toml --sampler center -q");
    room.succeeds("render scene.toml --compat course --samples 4 --sampler grid --max-depth 5 -q");
}

#[test]
fn the_center_sampler_takes_one_sample() {
    let room = Room::new();
    room.succeeds("render scene.toml --sampler center --stats s.json -q");
    let stats: Value = serde_json::from_str(&fs::read_to_string(room.path().join("s.json")).unwrap()).unwrap();
    assert_eq!((stats["samples"].as_u64(), stats["rays"]["camera"].as_u64()), (Some(1), Some(768)));
}

#[test]
fn outputs_are_checked_before_the_render() {
    let room = Room::new();
    // A render that would take days: whatever is wrong must be said before it starts.
    let long = "--width 4000 --height 4000 --samples 10000";
    let fails = |options: &str, code: i32, messages: &[&str]| {
        room.fails(&format!("render scene.toml {long} {options}"), code, messages);
    };
    fails("-o a.jpg", 2, &["a.jpg", ".exr"]);
    fails("-o a", 2, &[".png"]);
    fails("-o a.png -o ./a.png", 2, &["a.png", "twice"]);
    fails("-o a.png --stats a.png", 2, &["twice"]);
    fails("--stats scene.toml", 2, &["input"]);
    fails("-o none/a.png", 1, &["none"]);
    fails("-o a.png --stats none/s.json", 1, &["none"]);
    fs::create_dir(room.path().join("taken.png")).unwrap();
    fails("-o taken.png", 1, &["taken.png", "directory"]);
}

#[cfg(unix)]
#[test]
fn a_directory_without_permission_is_refused() {
    use std::os::unix::fs::PermissionsExt;
    let room = Room::new();
    let locked = room.path().join("locked");
    fs::create_dir(&locked).unwrap();
    fs::set_permissions(&locked, fs::Permissions::from_mode(0o555)).unwrap();
    if fs::write(locked.join("probe"), "").is_ok() {
        skip("permissions do not bind this user");
        return;
    }
    room.fails("render scene.toml -o locked/a.png", 1, &["locked"]);
}

#[test]
fn a_bad_scene_shows_each_mistake_with_its_line_and_writes_nothing() {
    let room = Room::new();
    room.write("bad.toml", &SCENE.replace("radius = 0.6", "radius = -0.6").replace("fov = 90.0", "fov = \"wide\""));
    let expected =
        ["bad.toml:4:7", "fov = \"wide\"", "bad.toml:11:10", "radius = -0.6", "^^^^", "expected", "2 errors"];
    room.fails("render bad.toml", 1, &expected);
    room.fails("info bad.toml", 1, &expected);

    room.write("unknown.toml", &SCENE.replace("radius", "radios"));
    room.fails("render unknown.toml", 1, &["radios", "radius"]);
}

#[test]
fn missing_and_broken_inputs_are_refused() {
    let room = Room::new();
    room.fails("render none.toml", 1, &["none.toml"]);
    room.fails("render .", 1, &[]);
    room.write("cut.ply", "ply\nformat ascii 1.0\nelement vertex 3\n");
    room.fails("render cut.ply", 1, &["cut.ply"]);
    room.write("picture.bmp", "BM");
    room.fails("render picture.bmp", 1, &["picture.bmp", ".toml"]);
}

#[test]
fn messages_are_plain_off_a_terminal() {
    let room = Room::new();
    room.write("bad.toml", &SCENE.replace("radius = 0.6", "radius = -0.6"));
    let output = room.run("render bad.toml");
    assert!(!err(&output).contains('\u{1b}'), "{}", err(&output));
    let output = room.succeeds("render scene.toml --samples 1");
    assert!(!err(&output).contains('\u{1b}') && !err(&output).contains('\r'), "{}", err(&output));
}

#[cfg(target_os = "linux")]
#[test]
fn an_image_larger_than_memory_is_refused() {
    let room = Room::new();
    // 32 bytes for each of 46000² pixels: 63 GiB.
    let available = fs::read_to_string("/proc/meminfo").unwrap();
    let available = available.lines().find_map(|line| line.strip_prefix("MemAvailable:")).unwrap();
    if available.trim().trim_end_matches(" kB").parse::<u64>().unwrap() >> 20 > 60 {
        skip("this machine has memory for the largest image");
        return;
    }
    room.fails("render scene.toml --width 46000 --height 46000 --compat course", 1, &["memory", "--crop"]);
}

#[test]
fn info_tells_what_a_scene_holds() {
    let room = Room::new();
    let info = room.json("info scene.toml --json");
    assert_eq!(info["primitives"]["spheres"], 1);
    assert_eq!(info["primitives"]["triangles"], 0);
    assert_eq!(info["lights"].as_array().unwrap().len(), 1);
    assert_eq!(info["materials"].as_array().unwrap().len(), 1);
    assert_eq!((info["camera"]["width"].as_u64(), info["camera"]["height"].as_u64()), (Some(32), Some(24)));
    let names = |key: &str| info["features"][key].as_array().unwrap().len();
    assert!(names("found") >= 2 && names("skipped") >= 2);
    assert!(info["memory_bytes"]["spheres"].as_u64().unwrap() > 0);
    for key in ["nodes", "leaves", "depth", "sah_cost", "build_seconds", "memory_bytes"] {
        assert!(info["bvh"][key].is_number(), "{key}");
    }
    assert!((info["bounds"]["hi"][2].as_f64().unwrap() + 0.9).abs() < 1e-6);

    let text = out(&room.succeeds("info scene.toml"));
    for part in ["spheres", "bounds", "found", "skipped", "SAH cost", "depth"] {
        assert!(text.contains(part), "no {part:?} in:\n{text}");
    }
    assert_eq!(room.names(), ["scene.toml"]);
}

#[test]
fn diff_compares_images_and_keeps_to_limits() {
    let room = Room::new();
    room.succeeds("render scene.toml --samples 1 -o a.exr -o a.png -q");
    room.succeeds("render scene.toml --samples 1 --fov 80 -o b.exr -o b.png -q");

    let equal = room.json("diff a.exr a.exr --json --max-abs 0 --max-differing 0 --min-psnr 200");
    for key in ["differing", "max", "mae", "rmse", "relmse", "p999", "flip"] {
        assert_eq!(equal[key].as_f64(), Some(0.0), "{key}");
    }
    assert_eq!(equal["ssim"].as_f64(), Some(1.0));
    assert_eq!(equal["psnr"], Value::Null);

    let unequal = room.json("diff a.exr b.exr --json");
    let rmse = unequal["rmse"].as_f64().unwrap();
    assert!(rmse > 0.0 && unequal["max"].as_f64().unwrap() > rmse && unequal["psnr"].as_f64().unwrap() > 0.0);

    for limit in ["--max-abs 1e-6", "--max-rmse 1e-9", "--max-mae 0", "--max-differing 0.1", "--min-psnr 150"] {
        room.fails(&format!("diff a.exr b.exr {limit}"), 1, &["over the limit"]);
    }
    for limit in ["--max-relmse 1e-6", "--max-flip 1e-6", "--min-ssim 0.999999"] {
        room.fails(&format!("diff a.exr b.exr {limit}"), 1, &["over the limit"]);
    }
    room.succeeds("diff a.exr b.exr --max-relmse 1e6 --max-flip 1 --min-ssim -1");
    room.succeeds("diff a.exr b.exr --max-abs 100 --max-differing 100");
    room.succeeds("diff a.png b.exr");
    room.succeeds("diff a.png b.png --linear --out d.png");
    assert_eq!(png_size(&room.path().join("d.png")), (32, 24));
    for map in ["abs", "signed", "flip"] {
        room.succeeds(&format!("diff a.exr b.exr --out {map}.png --map {map}"));
        assert_eq!(png_size(&room.path().join(format!("{map}.png"))), (32, 24));
    }
    // Where nothing differs, the maps are black, white and black.
    room.succeeds("diff a.exr a.exr --out none.png --map signed");
    room.succeeds("diff a.png a.png --out black.png --map flip");
    room.fails("diff none.png black.png --max-differing 99.9", 1, &["differing is 100"]);
}

#[test]
fn diff_refuses_what_it_cannot_compare() {
    let room = Room::new();
    room.succeeds("render scene.toml --samples 1 -o a.png -q");
    room.succeeds("render scene.toml --samples 1 --width 31 -o b.png -q");
    room.fails("diff a.png b.png", 1, &["32", "31"]);
    room.fails("diff a.png none.png", 1, &["none.png"]);
    room.fails("diff a.png scene.toml", 1, &["scene.toml"]);
    room.fails("diff a.png a.png --out d.jpg", 2, &["d.jpg", ".png"]);
    room.fails("diff a.png a.png --max-abs -1", 2, &["--max-abs"]);
    room.fails("diff a.png a.png --map flip", 2, &["--out"]);
    room.fails("diff a.png a.png --out d.png --map heat", 2, &["heat", "signed"]);
}

#[test]
fn help_and_version_are_no_errors() {
    let room = Room::new();
    for arguments in ["--help", "render --help", "info --help", "diff --help"] {
        let output = room.succeeds(arguments);
        assert!(out(&output).contains("Examples:") && err(&output).is_empty(), "{arguments}");
    }
    assert!(out(&room.succeeds("--version")).starts_with("flatray "));
}

#[test]
fn a_reader_that_goes_away_is_no_failure() {
    let room = Room::new();
    let mut child = room.command("info scene.toml").stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!((output.status.code(), err(&output)), (Some(0), String::new()));
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_behind_standard_output_is_a_failure() {
    let room = Room::new();
    let full = fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let output = room.command("info scene.toml --json").stdout(full).output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(err(&output).contains("standard output"), "{}", err(&output));
}

#[cfg(target_os = "linux")]
#[test]
fn an_interrupt_ends_with_130_and_leaves_no_file() {
    for signal in ["INT", "TERM"] {
        let room = Room::new();
        let arguments = "render scene.toml --width 4000 --height 4000 --samples 64 --stats s.json";
        let child = start_and_wait_for_handler(&room, arguments);
        send(signal, child.id());
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(130), "{signal}: {}", err(&output));
        assert!(err(&output).contains("interrupted"), "{}", err(&output));
        assert_eq!(room.names(), ["scene.toml"]);
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_second_interrupt_ends_at_once() {
    let room = Room::new();
    // One tile that takes hours, so that an end between tiles would never come.
    let arguments = "render scene.toml --width 1024 --height 1024 --tile-size 1024 --samples 65536";
    let child = start_and_wait_for_handler(&room, arguments);
    send("INT", child.id());
    send("INT", child.id());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130), "{}", err(&output));
    assert_eq!(room.names(), ["scene.toml"]);
}

#[cfg(target_os = "linux")]
fn start_and_wait_for_handler(room: &Room, arguments: &str) -> std::process::Child {
    use std::time::{Duration, Instant};
    let child = room.command(arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let started = Instant::now();
    while !catches_interrupts(child.id()) {
        assert!(started.elapsed() < Duration::from_secs(60), "no handler after a minute");
        std::thread::sleep(Duration::from_millis(5));
    }
    std::thread::sleep(Duration::from_millis(300));
    child
}

#[cfg(target_os = "linux")]
fn send(signal: &str, process: u32) {
    let sent = Command::new("kill").args([format!("-{signal}"), process.to_string()]).status().unwrap();
    assert!(sent.success());
    std::thread::sleep(std::time::Duration::from_millis(100));
}

/// Whether a process has a handler for SIGINT and SIGTERM: bits 1 and 14 of `SigCgt` in /proc/PID/status, proc(5).
#[cfg(target_os = "linux")]
fn catches_interrupts(process: u32) -> bool {
    let status = fs::read_to_string(format!("/proc/{process}/status")).unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigCgt:")).unwrap_or("0");
    let mask = u64::from_str_radix(mask.trim(), 16).unwrap();
    mask & (1 << 1) != 0 && mask & (1 << 14) != 0
}

#[test]
fn the_image_does_not_depend_on_threads_tile_size_acceleration_or_instruction_set() {
    let room = Room::new();
    room.succeeds("render scene.toml -o a.exr -q --threads 1");
    for (index, options) in
        ["--threads 3", "--tile-size 7", "--accel linear", "--isa baseline", "--bvh high"].into_iter().enumerate()
    {
        let name = format!("b{index}.exr");
        room.succeeds(&format!("render scene.toml -o {name} -q {options}"));
        assert!(fs::read(room.path().join("a.exr")).unwrap() == fs::read(room.path().join(name)).unwrap(), "{options}");
    }
}
