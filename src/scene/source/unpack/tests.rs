use std::io::Write;

use flate2::Compression;
use flate2::write::GzEncoder;
use ruzstd::encoding::{CompressionLevel, compress_to_vec};

use super::super::Source;
use super::*;

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

fn zstd(bytes: &[u8]) -> Vec<u8> {
    compress_to_vec(bytes, CompressionLevel::Fastest)
}

fn source(bytes: Vec<u8>) -> Result<Source, Error> {
    Source::from_bytes(Path::new("m.ply.gz"), bytes)
}

/// A frame with a window of 1 MiB of so many blocks of 128 KiB zeros each: 4 bytes for each block.
fn zstd_bomb(n_blocks: usize) -> Vec<u8> {
    let mut frame = vec![0x28, 0xb5, 0x2f, 0xfd, 0, 10 << 3];
    for block in 0..n_blocks {
        let is_last = u32::from(block + 1 == n_blocks);
        let header = (128 << 10) << 3 | 1 << 1 | is_last;
        frame.extend(&header.to_le_bytes()[..3]);
        frame.push(0);
    }
    frame
}

#[test]
fn members_and_frames_are_joined_and_plain_data_passes() {
    assert_eq!(source([gzip(b"hello "), gzip(b"world")].concat()).unwrap().bytes(), b"hello world");
    let skipped = [0x53, 0x2a, 0x4d, 0x18, 3, 0, 0, 0, 1, 2, 3];
    let frames = [&skipped[..], &zstd(b"hello "), &skipped, &zstd(b"world"), &skipped].concat();
    assert_eq!(source(frames).unwrap().bytes(), b"hello world");
    assert_eq!(source(b"plain".to_vec()).unwrap().bytes(), b"plain");
    assert_eq!(source(zstd_bomb(20)).unwrap().bytes().len(), 20 << 17);
}

#[test]
fn truncated_and_damaged_data_is_refused_and_never_panics() {
    let text: Vec<u8> = (0..20_000_u32).flat_map(|n| (n % 977).to_le_bytes()).collect();
    for (name, whole) in [("gzip", gzip(&text)), ("zstd", zstd(&text))] {
        for length in (4..whole.len()).step_by(whole.len() / 97 + 1) {
            let error = source(whole[..length].to_vec()).unwrap_err().to_string();
            assert!(error.starts_with("m.ply.gz: byte "), "{error}");
            assert!(error.contains(&format!("the {name} data is damaged or ends early")), "{error}");
        }
        let mut damaged = whole.clone();
        let at = damaged.len() - 3;
        damaged[at] ^= 0x10;
        let error = source(damaged).unwrap_err().to_string();
        assert!(error.contains("is damaged or ends early"), "{name}: {error}");
    }
}

#[test]
fn bombs_are_refused_at_the_limit() {
    for bomb in [gzip(&vec![0; FLOOR_BYTES + 1]), zstd_bomb((FLOOR_BYTES >> 17) + 9)] {
        let error = source(bomb).unwrap_err().to_string();
        assert!(
            error.contains("expands beyond what a file of this kind can need: found more than 268435456"),
            "{error}"
        );
    }
}

#[test]
fn a_window_of_gigabytes_is_refused_before_it_is_filled() {
    let mut frame = zstd_bomb(3);
    frame[5] = 21 << 3;
    let error = source(frame).unwrap_err().to_string();
    assert!(error.contains("too large a window: found 2147483648 bytes, expected at most 134217728"), "{error}");
    // A single segment of 2⁴⁰ bytes, by its word.
    let lying = [&[0x28, 0xb5, 0x2f, 0xfd, 0xe0][..], &(1_u64 << 40).to_le_bytes(), &[1, 0, 0]].concat();
    assert!(source(lying).unwrap_err().to_string().contains("too large a window"));
}

#[test]
fn data_that_is_compressed_twice_is_refused() {
    for twice in [gzip(&gzip(b"x")), zstd(&gzip(b"x")), gzip(&zstd(b"x"))] {
        let error = source(twice).unwrap_err().to_string();
        assert!(error.contains("holds compressed data again"), "{error}");
    }
}
