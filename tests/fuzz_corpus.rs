//! The fuzzer's check without the fuzzer: on the corpus that is kept, and on random bytes.

use std::fs;
use std::path::{Path, PathBuf};

use flatray::measure::stress::fuzz::{check, decode};
use flatray::measure::stress::random::Random;

#[test]
fn every_kept_case_is_answered_rightly() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fuzz/corpus_kept");
    let mut files: Vec<PathBuf> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    assert!((10..50).contains(&files.len()), "{} files", files.len());
    for file in files {
        let bytes = fs::read(&file).unwrap();
        assert!(decode(&bytes).is_some(), "{} is no case", file.display());
        check(&bytes).unwrap_or_else(|case| panic!("{}: {case}", file.display()));
    }
}

/// Random bytes in each form; numbers as bits are made of few bytes, so that exponents are not all extreme and some
/// sums cancel.
#[test]
fn random_bytes_are_answered_rightly() {
    let mut random = Random::new(1, "fuzz", 0);
    let mut n_cases = 0;
    for _ in 0..60_000 {
        let kind = random.below(9) as u8;
        let bytes: Vec<u8> = (0..170)
            .map(|at| match (at, kind / 3, random.below(4)) {
                (0, ..) => kind,
                (_, 1, _) => random.integer(-6, 6) as u8,
                (_, _, 0) => random.bits() as u8,
                (_, 0, 1) => 0x3f,
                _ => random.pick(&[0, 0, 1, 0x80, 0xff, 0x40]).unwrap(),
            })
            .collect();
        // With and without an interval.
        let n_bytes = random.pick(&[20, 33, 60, 85, 106, 153, 170]).unwrap();
        n_cases += usize::from(decode(&bytes[..n_bytes]).is_some());
        check(&bytes[..n_bytes]).unwrap_or_else(|case| panic!("{case}"));
    }
    assert!(n_cases > 30_000, "{n_cases}");
}
