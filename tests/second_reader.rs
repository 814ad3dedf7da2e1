//! Triangle counts and boxes of mesh files beside those that an independent reader finds, trimesh of PyPI.
//!
//! Needs `python3` with the packages trimesh and numpy; skipped, saying so, where they are absent.

mod mesh_kit;
mod shared_data;

use std::fs;
use std::path::Path;
use std::process::Command;

use flatray::scene::mesh;
use glam::Vec3;
use mesh_kit::valid_files;
use shared_data::shared;
use shared_data::skip::skip;

/// Name, triangles, smallest and largest corner, as another reader has them; `None` when it is not there.
fn second_reader(folder: &Path) -> Option<Vec<(String, usize, [f32; 6])>> {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/second_reader.py");
    let Ok(output) = Command::new("python3").arg(script).arg(folder).output() else {
        skip("this test needs python3");
        return None;
    };
    if output.status.code() == Some(77) {
        skip("this test needs the PyPI packages trimesh and numpy");
        return None;
    }
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).unwrap();
    let row = |line: &str| {
        let words: Vec<&str> = line.split_whitespace().collect();
        let numbers: Vec<f32> = words[2..].iter().map(|word| hexadecimal(word)).collect();
        (words[0].to_owned(), words[1].parse().unwrap(), numbers.try_into().unwrap())
    };
    Some(text.lines().map(row).collect())
}

/// A number as Python's `float.hex` writes it, `-0x1.8000000000000p-1`; it is known to be an f32.
fn hexadecimal(text: &str) -> f32 {
    let (negative, text) = text.strip_prefix('-').map_or((false, text), |text| (true, text));
    let (mantissa, exponent) = text.strip_prefix("0x").unwrap().split_once('p').unwrap();
    let (whole, fraction) = mantissa.split_once('.').unwrap_or((mantissa, "0"));
    let bits = u64::from_str_radix(&format!("{whole}{fraction}"), 16).unwrap() as f64;
    let magnitude = bits * 2_f64.powi(exponent.parse::<i32>().unwrap() - 4 * fraction.len() as i32);
    (if negative { -magnitude } else { magnitude }) as f32
}

fn assert_equal_to_ours(folder: &Path, least: usize) {
    let Some(rows) = second_reader(folder) else { return };
    assert!(rows.len() >= least, "{} files", rows.len());
    for (name, n_triangles, bounds) in rows {
        let ours = mesh::load(&folder.join(&name)).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(ours.triangles.len(), n_triangles, "{name}");
        let corners = ours.triangles.iter().flatten().map(|&vertex| ours.positions[vertex as usize]);
        let (lo, hi) = corners.fold((Vec3::MAX, Vec3::MIN), |(lo, hi), p| (lo.min(p), hi.max(p)));
        assert_eq!([lo.to_array(), hi.to_array()].as_flattened(), bounds, "{name}");
    }
}

#[test]
fn counts_and_boxes_of_the_shared_meshes_are_those_of_a_second_reader() {
    if let Some(folder) = shared("meshes") {
        assert_equal_to_ours(&folder, 10);
    }
}

#[test]
fn counts_and_boxes_of_small_files_of_every_format_are_those_of_a_second_reader() {
    let room = tempfile::tempdir().unwrap();
    for (name, bytes) in valid_files() {
        // The other reader knows no zstd, no strips beside faces, no concave polygons.
        if ["mesh.obj", "ascii.stl", "binary.stl", "square.off"].contains(&name) {
            fs::write(room.path().join(name), bytes).unwrap();
        }
    }
    assert_equal_to_ours(room.path(), 4);
}

#[test]
fn hexadecimal_numbers_are_read_exactly() {
    assert_eq!(hexadecimal("0x1.8000000000000p-1"), 0.75);
    assert_eq!(hexadecimal("-0x1.fffffe0000000p+127"), f32::MIN);
    assert_eq!(hexadecimal("0x0.0p+0"), 0.0);
}
