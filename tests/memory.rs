//! What a render is expected to hold, beside what it held.

use std::fs;
use std::process::Command;

/// A wavy square of 2n² triangles as binary PLY.
fn wavy_square(n: u32) -> Vec<u8> {
    let mut bytes = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        (n + 1) * (n + 1),
        2 * n * n
    )
    .into_bytes();
    for row in 0..=n {
        for column in 0..=n {
            let (x, z) = (column as f32 / 100.0, row as f32 / 100.0);
            bytes.extend([x, (3.0 * x).sin() * (2.0 * z).cos(), z].iter().flat_map(|v| v.to_le_bytes()));
        }
    }
    for row in 0..n {
        for a in (0..n).map(|column| row * (n + 1) + column) {
            for face in [[a, a + n + 1, a + 1], [a + 1, a + n + 1, a + n + 2]] {
                bytes.push(3);
                bytes.extend(face.iter().flat_map(|v| v.to_le_bytes()));
            }
        }
    }
    bytes
}

#[test]
fn the_expected_memory_is_within_a_factor_of_two_of_the_peak() {
    let room = tempfile::tempdir().unwrap();
    fs::write(room.path().join("waves.ply"), wavy_square(700)).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_flatray"));
    command.args("render waves.ply -o a.png --width 64 --height 48 --samples 1 --quiet --stats s.json".split(' '));
    let output = command.current_dir(room.path()).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let stats: serde_json::Value = serde_json::from_slice(&fs::read(room.path().join("s.json")).unwrap()).unwrap();
    let estimate = stats["memory_bytes"]["estimate"].as_u64().unwrap();
    if let Some(peak) = stats["memory_bytes"]["peak"].as_u64() {
        assert!(estimate <= 2 * peak && peak <= 2 * estimate, "expected {estimate} bytes, held {peak}");
    }
}
