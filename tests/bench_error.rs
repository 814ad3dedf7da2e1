//! `flatray reference` and `flatray bench error` as a user meets them.

/// How a test says that it cannot run.
mod skip;

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use serde_json::Value;
use skip::skip;
use tempfile::TempDir;

const SCENE: &str = r#"
[camera]
position = [0.0, 0.5, 4.0]
look_at = [0.0, 0.0, 0.0]
fov = 40.0
width = 24
height = 18

[[hittable]]
type = "sphere"
position = [0.0, 0.0, 0.0]
radius = 0.9
k_a = 0.1
k_d = 0.7
k_s = 0.2
sh = 20.0

[[light_source]]
position = [3.0, 4.0, 5.0]
intensity = 0.8
"#;

const GRID: &str = "[[grid]]\nsamples = [1, 4, 16, 64]\nsampler = [\"sobol\", \"random\"]\n[[grid]]\nerror = 0.01\n\
                    [[povray]]\ngrid = [1, 3]\nthreshold = 0.1\ndepth = 3\n";

struct Room(TempDir);

impl Room {
    fn new() -> Room {
        let room = Room(tempfile::tempdir().unwrap());
        fs::write(room.path().join("scene.toml"), SCENE).unwrap();
        fs::write(room.path().join("grid.toml"), GRID).unwrap();
        room
    }

    fn path(&self) -> &Path {
        self.0.path()
    }

    fn command(&self, arguments: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_flatray"));
        command.args(arguments.split_whitespace()).current_dir(self.path());
        command
    }

    fn run(&self, arguments: &str, code: i32) -> String {
        let output = self.command(arguments).output().unwrap();
        let text = text(&output);
        assert_eq!(output.status.code(), Some(code), "{arguments}\n{text}");
        assert!(!text.contains("panicked"), "{arguments}\n{text}");
        text
    }

    /// Runs a benchmark with a cache in this room; its JSON, and what it printed.
    fn bench(&self, arguments: &str) -> (Value, String) {
        let line = format!("bench error --reference-samples 64 --cache cache --json e.json {arguments}");
        let text = self.run(&line, 0);
        (serde_json::from_slice(&fs::read(self.path().join("e.json")).unwrap()).unwrap(), text)
    }
}

fn text(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr)
}

fn runs<'a>(json: &'a Value, engine: &str) -> Vec<&'a Value> {
    json["runs"].as_array().unwrap().iter().filter(|run| run["engine"] == engine).collect()
}

#[test]
fn a_small_scene_gives_figures_a_front_slopes_and_a_page() {
    let room = Room::new();
    let (json, text) = room.bench("scene.toml --settings grid.toml --repeats 2 --html e.html");
    let all = runs(&json, "flatray");
    let names: Vec<&str> = all.iter().map(|run| run["setting"].as_str().unwrap()).collect();
    assert_eq!(
        names,
        ["center 1", "sobol 4", "random 4", "sobol 16", "random 16", "sobol 64", "random 64", "adaptive 1e-2"]
    );
    let (floor, least) = (json["floor"].as_f64().unwrap(), json["least_rmse"].as_f64().unwrap());
    // The reader of JSON rounds each to a few ulps.
    assert!(floor > 0.0 && (least / floor - 3.0).abs() <= 30.0 * f64::EPSILON, "{least:e} for {floor:e}");
    for run in &all {
        for key in ["seconds", "rays", "rmse", "relmse", "max", "flip", "ssim", "mae", "p999", "samples_per_pixel"] {
            assert!(run[key].is_number(), "{key} of {run}");
        }
        assert!(
            run["rmse"].as_f64().unwrap() >= least && run["on_front"].is_boolean() && run["wrong_ids"] == 0,
            "{run}"
        );
        assert!(run["seconds_min"].as_f64() <= run["seconds"].as_f64(), "{run}");
    }
    let rmse = |name: &str| all.iter().find(|run| run["setting"] == name).unwrap()["rmse"].as_f64().unwrap();
    assert!(rmse("sobol 64") < rmse("sobol 4") && rmse("sobol 64") < rmse("random 64"));
    assert!(all.iter().any(|run| run["on_front"] == true) && json["judged_ids"] == 24 * 18);
    let slopes = json["slopes"].as_array().unwrap();
    assert!(
        slopes.iter().any(|slope| slope["family"] == "random" && slope["slope"].as_f64().unwrap() < 0.0),
        "{slopes:?}"
    );
    assert!(json["time_to_rmse"].as_array().unwrap().iter().any(|reach| reach["by"] == "flatray"));
    assert!(text.contains("slope of sobol") && text.contains("* on the front"), "{text}");

    let page = fs::read_to_string(room.path().join("e.html")).unwrap();
    assert!(page.contains("<svg") && page.contains("src=\"data:image/png;base64,") && page.contains("three floors"));
    assert!(
        !page.contains("http")
            && !page.contains("<script")
            && page.matches("src=").count() == page.matches("src=\"data:").count()
    );
    assert!(!room.path().join("e.json.partial").exists());

    // The reference is found in the cache, and several scenes share a file.
    let (json, text) = room.bench("scene.toml scene.toml --settings grid.toml --repeats 1");
    assert!(!text.contains("making a reference"), "{text}");
    assert_eq!(json["scenes"].as_array().unwrap().len(), 2);
}

#[test]
fn a_reference_is_made_once_checked_and_refused_for_another_frame() {
    let room = Room::new();
    let text = room.run("reference scene.toml -o r.exr --samples 64", 0);
    assert!(text.contains("samples 64") && text.contains("floor") && text.contains("hash"), "{text}");
    room.bench("scene.toml --settings grid.toml --repeats 1");
    let with = "bench error --settings grid.toml --repeats 1 --reference";
    room.run(&format!("{with} r.exr scene.toml"), 0);

    let text = room.run(&format!("{with} r.exr scene.toml --width 30"), 1);
    assert!(text.contains("another size") && text.contains("24×18") && text.contains("30×18"), "{text}");
    for other in ["--max-depth 2", "--filter gaussian", "--fov 41"] {
        let text = room.run(&format!("{with} r.exr scene.toml {other}"), 1);
        assert!(text.contains("another scene") && text.contains("hash"), "{text}");
    }
    fs::write(room.path().join("other.toml"), SCENE.replace("0.9", "0.8")).unwrap();
    assert!(room.run(&format!("{with} r.exr other.toml"), 1).contains("another scene"));
    room.run("render scene.toml -o plain.exr -q", 0);
    assert!(room.run(&format!("{with} plain.exr scene.toml"), 1).contains("flatray reference"));
    assert!(room.run(&format!("{with} none.exr scene.toml"), 1).contains("none.exr"));
}

#[test]
fn wrong_usage_and_wrong_settings_say_where() {
    let room = Room::new();
    fs::write(room.path().join("bad.toml"), "[[grid]]\nsamples = [4]\nmax_deph = [2]\n").unwrap();
    fs::write(room.path().join("pov.toml"), "[[povray]]\ngrid = 2\n").unwrap();
    let cases = [
        ("bench error scene.toml --settings bad.toml", 1, "bad.toml:3:1"),
        ("bench error scene.toml --settings bad.toml", 1, "did you mean `max_depth`?"),
        ("bench error scene.toml --settings none.toml", 1, "none.toml"),
        ("bench error scene.toml --settings pov.toml", 2, "--peer povray"),
        ("bench error scene.toml scene.toml --reference r.exr", 2, "several inputs"),
        ("bench error scene.toml --peer mitsuba", 2, "povray"),
        ("bench error scene.toml --repeats 0", 2, "--repeats"),
        ("bench error missing.toml", 1, "missing.toml"),
        ("bench error scene.toml --json /nonexistent/e.json", 1, "/nonexistent"),
        ("reference scene.toml -o r.png", 2, ".exr"),
        ("reference scene.toml", 2, "--output"),
        ("reference scene.toml -o r.exr --samples 0", 2, "--samples"),
    ];
    for (arguments, code, message) in cases {
        let text = room.run(arguments, code);
        assert!(text.contains(message), "{arguments}\n{text}");
    }
}

#[test]
fn targets_below_three_floors_are_told_of() {
    let room = Room::new();
    fs::write(room.path().join("low.toml"), "[[grid]]\nerror = [1e-2, 1e-5]\n").unwrap();
    fs::write(room.path().join("few.toml"), "[[grid]]\nsamples = 4\n").unwrap();
    let line = "scene.toml --repeats 1 --settings";
    // Four samples make a reference that is hardly better than what it judges.
    let text = room.run(&format!("bench error --reference-samples 4 --cache cache {line} low.toml"), 0);
    assert!(text.contains("the target of adaptive 1e-5 is below three floors"), "{text}");
    assert!(text.contains("error of 1e-3 is below three floors"), "{text}");
}

#[test]
fn an_absent_povray_is_a_message_and_the_benchmark_goes_on() {
    let room = Room::new();
    let (json, text) = room.bench("scene.toml --settings grid.toml --repeats 1 --peer povray=/nowhere/povray");
    assert!(text.contains("POV-Ray cannot be started") && text.contains("package `povray`"), "{text}");
    assert!(runs(&json, "povray").is_empty() && runs(&json, "flatray").len() == 8 && json["whole_processes"] == true);
    assert!(json["notes"][0].as_str().unwrap().contains("measured without POV-Ray"), "{}", json["notes"]);
}

#[test]
fn povray_stands_beside_whole_processes_or_it_is_said_why_not() {
    if let Err(error) = flatray::measure::povray::program::Program::find() {
        return skip(&format!("this test needs POV-Ray: {error}"));
    }
    let room = Room::new();
    let (json, text) = room.bench("scene.toml --settings grid.toml --repeats 1 --peer povray --html e.html");
    let names: Vec<&str> = runs(&json, "povray").iter().map(|run| run["setting"].as_str().unwrap()).collect();
    assert_eq!(names, ["povray am1 1", "povray am1 9", "povray am2 0.1 r3"], "{text}");
    let rmse = |engine: &str, name: &str| {
        runs(&json, engine).iter().find(|run| run["setting"] == name).unwrap()["rmse"].as_f64().unwrap()
    };
    // One sample in the centre is the same in both, but for the levels of a PNG.
    assert!((rmse("povray", "povray am1 1") / rmse("flatray", "center 1") - 1.0).abs() < 1e-2, "{text}");
    assert!(rmse("povray", "povray am1 9") < rmse("povray", "povray am1 1"));
    assert!(text.contains("one pixel of this scene"), "{text}");

    fs::write(room.path().join("red.toml"), SCENE.replace("k_s = 0.2", "k_s = 0.2\nspecular = [1.0, 0.0, 0.0]"))
        .unwrap();
    let (json, text) = room.bench("red.toml --settings grid.toml --repeats 1 --peer povray");
    assert!(text.contains("POV-Ray cannot express a coloured highlight") && runs(&json, "povray").is_empty(), "{text}");
}

#[cfg(target_os = "linux")]
#[test]
fn an_interrupted_benchmark_keeps_its_runs_and_goes_on() {
    use std::time::{Duration, Instant};
    let room = Room::new();
    fs::write(room.path().join("long.toml"), "[[grid]]\nsamples = [2, 4, 8, 65536]\n").unwrap();
    let line =
        "bench error scene.toml --reference-samples 64 --cache cache --json e.json --settings long.toml --repeats 40";
    let child = room.command(line).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let partial = room.path().join("e.json.partial");
    let n_kept = || fs::read_to_string(&partial).unwrap_or_default().lines().count();
    let started = Instant::now();
    while n_kept() < 3 {
        assert!(started.elapsed() < Duration::from_secs(120), "no runs are kept");
        std::thread::sleep(Duration::from_millis(5));
    }
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    let output = child.wait_with_output().unwrap();
    let said = text(&output);
    assert_eq!(output.status.code(), Some(130), "{said}");
    assert!(said.contains("e.json.partial: the same command goes on from there"), "{said}");
    assert!(!room.path().join("e.json").exists() && n_kept() >= 3);

    // The same with fewer repeats: what is kept is not rendered again, and what it has too much stays.
    let first = fs::read_to_string(&partial).unwrap();
    let (json, said) = room.bench("scene.toml --settings long.toml --repeats 1");
    let n_first = first.lines().filter(|line| line.contains(" 0\",")).count();
    assert_eq!(said.matches("scene.toml: ").count() - said.matches("judging").count() - 1, 4 - n_first, "{said}");
    assert_eq!(runs(&json, "flatray").len(), 4);
}
