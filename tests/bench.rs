//! `flatray bench throughput` as a user meets it: small scenes, every output, and what is wrong usage.

#![allow(clippy::print_stderr)]

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;
use tempfile::TempDir;

const HEAD: &str = "[camera]\nposition = [0.2, 0.4, 3.0]\nlook_at = [0.0, 0.0, 0.0]\n";
const LIGHT: &str = "[[light_source]]\nposition = [2.0, 3.0, 2.0]\n";
const SPHERE: &str = "[[hittable]]\ntype = \"sphere\"\nposition = [0.0, 0.0, 0.0]\nradius = 0.5\n";
const TRIANGLE: &str =
    "[[hittable]]\ntype = \"triangle\"\na = [-9.0, -1.0, -9.0]\nb = [9.0, -1.0, -9.0]\nc = [0.0, -1.0, 9.0]\n";

struct Room(TempDir);

impl Room {
    fn with(scene: &str) -> Room {
        let room = Room(tempfile::tempdir().unwrap());
        fs::write(room.path().join("scene.toml"), scene).unwrap();
        room
    }

    fn path(&self) -> &Path {
        self.0.path()
    }

    fn bench(&self, arguments: &str) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_flatray"));
        command.args(["bench", "throughput"]).args(arguments.split_whitespace()).current_dir(self.path());
        command.output().unwrap()
    }

    /// Runs what must succeed and returns its JSON and what it printed to both streams.
    fn succeeds(&self, arguments: &str) -> (Value, String) {
        let output = self.bench(&format!("{arguments} --quick --json out.json"));
        let text = text(&output);
        assert_eq!(output.status.code(), Some(0), "{arguments}\n{text}");
        (serde_json::from_slice(&fs::read(self.path().join("out.json")).unwrap()).unwrap(), text)
    }

    /// The numbers of an exported file.
    fn numbers(&self, name: &str) -> Vec<f32> {
        let bytes = fs::read(self.path().join("work").join(name)).unwrap();
        assert!(bytes.len().is_multiple_of(4), "{name}");
        bytes.chunks_exact(4).map(|bytes| f32::from_le_bytes(bytes.try_into().unwrap())).collect()
    }
}

fn text(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr)
}

fn rows<'a>(json: &'a Value, engine: &str) -> Vec<&'a Value> {
    let engine = |row: &&Value| row["engine"].as_str().unwrap().starts_with(engine);
    json["rows"].as_array().unwrap().iter().filter(engine).collect()
}

#[test]
fn a_small_scene_gives_rows_builds_a_page_and_files_for_others() {
    let room = Room::with(&[HEAD, LIGHT, SPHERE, TRIANGLE].concat());
    let (json, text) = room.succeeds("scene.toml --threads 1,2 --bvh fast,high --html out.html --export work");
    let all = rows(&json, "flatray");
    for kind in ["primary", "shadow", "reflection", "diffuse"] {
        assert!(text.contains(&format!("{kind} rays")), "{text}");
        for mode in ["single", "batch", "packet"] {
            for threads in [1, 2] {
                let fits = |row: &&&Value| row["rays"] == kind && row["mode"] == mode && row["threads"] == threads;
                let row = all.iter().find(fits).unwrap();
                assert!(row["mrays_per_s"].as_f64().unwrap() > 0.0 && row["isa"].is_string(), "{row}");
                assert!(row["min"].as_f64() <= row["max"].as_f64() && row["wrong"] == 0, "{row}");
            }
        }
    }
    let builds = json["build"].as_array().unwrap();
    assert_eq!(builds.len(), 4);
    for build in builds {
        assert!(build["engine"] == "flatray" && build["seconds"].is_f64() && build["bytes_per_primitive"].is_f64());
    }
    let page = fs::read_to_string(room.path().join("out.html")).unwrap();
    assert!(page.contains("<svg") && page.contains("scene.toml"));

    assert_eq!(room.numbers("triangles.f32"), [-9.0, -1.0, -9.0, 9.0, -1.0, -9.0, 0.0, -1.0, 9.0]);
    let rays = room.numbers("rays-primary.f32");
    assert_eq!(rays.len(), 8 * 160 * 120);
    assert_eq!((&rays[..4], rays[7]), (&[0.2f32, 0.4, 3.0, 0.0][..], f32::INFINITY));
    let hits = room.numbers("hits-primary.f32");
    assert_eq!(hits.len(), 160 * 120);
    assert!(hits.contains(&f32::INFINITY) && hits.iter().any(|t| (2.0..4.0).contains(t)));
    assert_eq!(room.numbers("rays-shadow.f32").len(), 8 * room.numbers("hits-shadow.f32").len());
}

#[test]
fn empty_scenes_and_scenes_of_one_primitive_work_with_and_without_a_peer() {
    let quadric = "[[hittable]]\ntype = \"quadric\"\nA = [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,-0.25]]\n";
    for scene in ["", SPHERE, TRIANGLE, quadric] {
        let room = Room::with(&[HEAD, LIGHT, scene].concat());
        let (json, text) = room.succeeds("scene.toml --peer embree --resolution 16x12");
        assert!(rows(&json, "flatray").iter().any(|row| row["rays"] == "primary"), "{text}");
        if scene.is_empty() {
            assert!(text.contains("no shadow rays"), "{text}");
        }
        let peers = rows(&json, "embree");
        if peers.is_empty() {
            eprintln!("not compared with Embree: {text}");
        } else if scene == quadric {
            assert!(
                text.contains("Embree has no quadrics") && peers.iter().all(|row| row["wrong"].is_null()),
                "{text}"
            );
        } else {
            // Embree's spheres are rounded, and its default mode may miss an edge.
            assert!(peers.iter().all(|row| row["wrong"].as_u64().unwrap() <= 4), "{text}");
        }
    }
}

#[test]
fn a_peer_that_is_not_there_is_a_message_and_the_benchmark_goes_on() {
    let room = Room::with(&[HEAD, LIGHT, SPHERE].concat());
    for (library, what) in [("/nonexistent.so", "/nonexistent.so"), ("scene.toml", "scene.toml")] {
        let (json, text) = room.succeeds(&format!("scene.toml --resolution 8x8 --peer embree={library}"));
        assert!(text.contains("Embree cannot be used") && text.contains("pip install embreex"), "{text}");
        assert!(text.contains(what), "{text}");
        assert!(!rows(&json, "flatray").is_empty() && rows(&json, "embree").is_empty());
    }
}

#[test]
fn generated_scenes_have_names() {
    let room = Room::with("");
    for (name, what) in [("terrain:2e3", "2,048 triangles"), ("sphereflake", "7,381 spheres")] {
        let (json, text) = room.succeeds(&format!("{name} --rays primary --mode single --resolution 32x24"));
        assert!(text.contains(what) && json["input"] == name, "{text}");
    }
}

#[test]
fn wrong_input_and_wrong_usage_say_so() {
    let room = Room::with("[[hittable]]\ntype = \"cube\"\n");
    let cases = [
        ("scene.toml", 1, "cube"),
        ("missing.ply", 1, "missing.ply"),
        ("terrain:0", 2, "whole number"),
        ("building --peer optix", 2, "embree"),
        ("building --rays sideways", 2, "sideways"),
        ("building --threads 0", 2, "--threads"),
        ("building --resolution 640", 2, "WIDTHxHEIGHT"),
        ("building --json /nonexistent/out.json", 1, "/nonexistent"),
        ("", 2, "INPUT"),
    ];
    for (arguments, code, message) in cases {
        let output = room.bench(arguments);
        let text = text(&output);
        assert_eq!(output.status.code(), Some(code), "{arguments}\n{text}");
        assert!(text.contains(message) && !text.contains("panicked"), "{arguments}\n{text}");
    }
}
