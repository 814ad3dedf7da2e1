//! Bytes as PLY.

#![no_main]

mod mesh;

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| mesh::check("fuzzed.ply", bytes));
