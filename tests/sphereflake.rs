//! The generated sphereflake against the published file of the Standard Procedural Databases.

mod shared_data;

use std::process::Command;

use flatray::measure::generate::sphereflake::{DEPTH, spheres};
use glam::DVec3;
use shared_data::shared;
use shared_data::skip::skip;

/// The file has six digits behind the point: half of the last, and as much again for the rounding of ours.
const LAST_DIGIT: f64 = 1e-6;

#[test]
fn it_is_the_sphereflake_of_the_published_file() {
    let Some(file) = shared("spd/balls.nff.zst") else { return };
    let Some(output) = Command::new("zstd").arg("-dc").arg(file).output().ok().filter(|out| out.status.success())
    else {
        skip("this test needs the program zstd");
        return;
    };
    let text = String::from_utf8(output.stdout).unwrap();
    let published: Vec<Vec<f64>> = text
        .lines()
        .filter_map(|line| line.strip_prefix("s "))
        .map(|line| line.split_whitespace().map(|number| number.parse().unwrap()).collect())
        .collect();
    let ours = spheres(DEPTH);
    assert_eq!(published.len(), ours.len());
    for (line, (center, radius)) in published.iter().zip(ours) {
        let error = (DVec3::new(line[0], line[1], line[2]) - center).abs().max_element();
        assert!(error < LAST_DIGIT && (line[3] - radius).abs() < LAST_DIGIT, "{line:?} {center} {radius}");
    }
}
