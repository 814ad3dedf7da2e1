//! Mattes and parts of an EXR through independent libraries, `cryptomatte-api` and `OpenEXR` of PyPI; see `compositing.py`.
//! What Blender makes of them, `blender_compositor.py` shows.
//!
//! Needs `python3` with these packages and numpy; skipped, saying so, where they are absent.

/// What a test says that cannot run.
mod skip;

use skip::skip;
use std::path::Path;
use std::process::Command;

/// Runs `compositing.py`; `false` when the modules that it needs are missing.
fn run_script(arguments: &[&str]) -> bool {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/compositing.py");
    let Ok(output) = Command::new("python3").arg(script).args(arguments).output() else {
        skip("this test needs python3");
        return false;
    };
    match output.status.code() {
        Some(0) => true,
        Some(77) => {
            skip("this test needs the PyPI packages cryptomatte-api, OpenEXR and numpy");
            false
        }
        _ => panic!("compositing.py {arguments:?} failed:\n{}", String::from_utf8_lossy(&output.stderr)),
    }
}

fn flatray(arguments: &[&str]) {
    let output = Command::new(env!("CARGO_BIN_EXE_flatray")).args(arguments).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// Renders a scene small, with some layers.
fn render(scene: &Path, layers: &str, options: &[&str], out: &Path) {
    let size = ["--width", "96", "--height", "72", "--samples", "4", "--quiet", "--aov", layers];
    let paths = ["render", scene.to_str().unwrap(), "-o", out.to_str().unwrap()];
    flatray(&[&paths[..], &size, options].concat());
}

fn scene(name: &str) -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name)
}

#[test]
fn an_independent_library_finds_the_mattes_of_the_manifest() {
    if !run_script(&["probe"]) {
        return;
    }
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("mattes.exr");
    // The library looks at the first part of a file only.
    for options in [&[][..], &["--exr", "float,zips"], &["--exr", "piz,tiles"]] {
        render(&scene("light_groups.toml"), "cryptomatte", options, &file);
        assert!(run_script(&["mattes", file.to_str().unwrap(), "floor", "clay", "mirror", "glass"]));
    }
    // Names are UTF-8, and may hold what JSON and file formats escape.
    let text = "[camera]\nfov = 40\n[[light_source]]\nposition = [0, 9, 0]\n[[hittable]]\nname = \"равнина\"\n\
                type = \"sphere\"\nposition = [-0.8, 0, -4]\nradius = 0.7\n[[hittable]]\nname = \"a \\\"b\\\" / \\\\c\"\n\
                type = \"sphere\"\nposition = [0.8, 0, -4]\nradius = 0.7\n";
    let named = directory.path().join("named.toml");
    std::fs::write(&named, text).unwrap();
    render(&named, "cryptomatte", &[], &file);
    assert!(run_script(&["mattes", file.to_str().unwrap(), "равнина", "a \"b\" / \\c"]));
}

#[test]
fn lobes_and_lights_of_files_add_up_to_the_picture_in_16_bits() {
    if !run_script(&["probe"]) {
        return;
    }
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("parts.exr");
    let lobes = ["ambient", "diffuse", "specular", "reflection", "refraction", "background"];
    render(&scene("light_groups.toml"), "lobes,lights", &[], &file);
    assert!(run_script(&[&["sums", file.to_str().unwrap()][..], &lobes].concat()));
    let lights = ["light_ambient", "light_key", "light_fill", "light_rim"];
    assert!(run_script(&[&["sums", file.to_str().unwrap()][..], &lights].concat()));
    for name in ["default.toml", "room.toml", "glass.toml"] {
        render(&scene(name), "lobes,lights", &[], &file);
        assert!(run_script(&[&["sums", file.to_str().unwrap()][..], &lobes].concat()));
    }
}
