//! Bytes as an EXR file: read, or refused.

#![no_main]

use std::path::Path;

use flatray::film::exr;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(film) = exr::decode(bytes, Path::new("fuzzed.exr")) {
        assert!(film.check().is_ok());
    }
});
