//! The ZIP compression of OpenEXR, one block of lines at a time.
//!
//! Source: *Technical Introduction to OpenEXR*, "Data Compression", and `ImfZip.cpp` of the OpenEXR library: the bytes of a
//! block are sorted into even and odd ones, so that the exponents of neighbouring floats stand side by side; each is
//! replaced by its difference from the one before, plus 128; the result is a zlib stream. A block that this makes no
//! smaller stands in the file as it is, which readers know by its length.
//!
//! The `exr` crate does the same with `miniz_oxide`; here zlib-rs does the last step, in less than half of the time.

use super::deflate;

/// How hard the compressor tries. `docs/BENCHMARKS.md` has the table this was chosen from.
const LEVEL: u32 = 1;

/// Compresses the samples of a block.
pub(super) fn compress(samples: &[u8]) -> Vec<u8> {
    match deflate::zlib(&differences(&sorted(samples)), LEVEL) {
        Ok(compressed) if compressed.len() < samples.len() => compressed,
        // What cannot be compressed is right as it is.
        _ => samples.to_vec(),
    }
}

/// The bytes at even places, then those at odd ones.
fn sorted(bytes: &[u8]) -> Vec<u8> {
    let mut sorted = vec![0; bytes.len()];
    let (even, odd) = sorted.split_at_mut(bytes.len().div_ceil(2));
    let pairs = bytes.chunks_exact(2);
    if let (Some(last), [byte]) = (even.last_mut(), pairs.remainder()) {
        *last = *byte;
    }
    for ((pair, even), odd) in pairs.zip(even).zip(odd) {
        (*even, *odd) = (pair[0], pair[1]);
    }
    sorted
}

/// Each byte less the one before, plus 128, modulo 256; the first as it is.
fn differences(bytes: &[u8]) -> Vec<u8> {
    let mut differences = Vec::with_capacity(bytes.len());
    differences.extend(bytes.first());
    differences.extend(bytes.windows(2).map(|pair| pair[1].wrapping_sub(pair[0]).wrapping_add(128)));
    differences
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_sorted_and_differenced_as_the_format_says() {
        assert_eq!(sorted(&[1, 2, 3, 4, 5]), [1, 3, 5, 2, 4]);
        assert_eq!(sorted(&[1, 2, 3, 4]), [1, 3, 2, 4]);
        assert_eq!(differences(&[10, 12, 9, 255]), [10, 130, 125, 118]);
        assert!(differences(&[]).is_empty());
    }

    #[test]
    fn what_does_not_shrink_is_kept() {
        assert_eq!(compress(&[7]), [7]);
        assert!(compress(&[7; 1000]).len() < 100);
    }
}
