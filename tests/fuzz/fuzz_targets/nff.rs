//! Any bytes as an NFF scene: a world or a message, never a panic.

#![no_main]

use std::path::Path;

use flatray::scene::{Overrides, nff};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    match nff::from_bytes(Path::new("fuzz.nff"), bytes.to_vec(), &Overrides::default()) {
        Ok(scene) => assert!(scene.world.triangles.positions.iter().all(|position| position.is_finite())),
        Err(error) => assert!(error.to_string().starts_with("fuzz.nff")),
    }
});
