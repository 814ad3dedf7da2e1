//! Deflate (RFC 1951) in pieces that know nothing of each other, so that an image can be compressed by several threads
//! and while it is still being rendered.
//!
//! The bytes depend on the data and the level alone: zlib-rs chooses its hash by level, not by processor.

use std::io;

use flate2::{Compress, Compression, FlushCompress};

/// Compresses a whole zlib stream (RFC 1950).
///
/// # Errors
/// What the compressor answers; none is known.
pub(super) fn zlib(bytes: &[u8], level: u32) -> io::Result<Vec<u8>> {
    compress(Compress::new(Compression::new(level), true), bytes, FlushCompress::Finish)
}

/// Compresses a piece of a raw deflate stream. A piece that is not the last ends on a byte, behind an empty block: pieces
/// written one after another are one stream.
///
/// # Errors
/// What the compressor answers; none is known.
pub(super) fn piece(bytes: &[u8], level: u32, is_last: bool) -> io::Result<Vec<u8>> {
    let flush = if is_last { FlushCompress::Finish } else { FlushCompress::Sync };
    compress(Compress::new(Compression::new(level), false), bytes, flush)
}

fn compress(mut state: Compress, bytes: &[u8], flush: FlushCompress) -> io::Result<Vec<u8>> {
    // What is longer than this is made longer by the loop.
    let mut out = Vec::with_capacity(bytes.len() / 2 + 256);
    loop {
        let rest = bytes.get(state.total_in() as usize..).unwrap_or_default();
        let status = state.compress_vec(rest, &mut out, flush)?;
        // With room left in the output, a flush is complete.
        let is_complete = match flush {
            FlushCompress::Finish => status == flate2::Status::StreamEnd,
            _ => state.total_in() as usize == bytes.len() && out.len() < out.capacity(),
        };
        if is_complete {
            out.shrink_to_fit();
            return Ok(out);
        }
        out.reserve(bytes.len() / 2 + 256);
    }
}

/// The Adler-32 checksum that ends a zlib stream, of pieces that are summed independently (RFC 1950, 8.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Adler32 {
    a: u32,
    b: u32,
}

impl Adler32 {
    const BASE: u32 = 65_521;

    /// The sum of nothing.
    pub const EMPTY: Adler32 = Adler32 { a: 1, b: 0 };

    /// The sum of some bytes.
    pub fn of(bytes: &[u8]) -> Adler32 {
        let mut sum = simd_adler32::Adler32::new();
        sum.write(bytes);
        let value = sum.finish();
        Adler32 { a: value & 0xffff, b: value >> 16 }
    }

    /// The sum of what `self` is the sum of followed by `length` bytes that `next` is the sum of: each of those adds the
    /// first a, less the 1 that it starts from, to b.
    pub fn then(self, next: Adler32, length: usize) -> Adler32 {
        let base = u64::from(Adler32::BASE);
        let before = u64::from(self.a) + base - 1;
        let a = (before + u64::from(next.a)) % base;
        let b = (u64::from(self.b) + u64::from(next.b) + before % base * (length as u64 % base)) % base;
        Adler32 { a: a as u32, b: b as u32 }
    }

    /// The number as it stands in a file.
    pub fn value(self) -> u32 {
        self.b << 16 | self.a
    }
}

#[cfg(test)]
mod tests {
    use std::io::Read;

    use flate2::read::{DeflateDecoder, ZlibDecoder};

    use super::*;

    /// Noise, so that nothing is gained, then zeros.
    fn bytes() -> Vec<u8> {
        let mut state = 1_u32;
        let noise = (0..200_000).map(|_| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 24) as u8
        });
        noise.chain([0; 100_000]).collect()
    }

    #[test]
    fn pieces_one_after_another_are_one_stream() {
        let bytes = bytes();
        for level in 1..=9 {
            let n_pieces = bytes.chunks(70_001).len();
            let pieces = bytes.chunks(70_001).enumerate();
            let stream: Vec<u8> =
                pieces.flat_map(|(index, part)| piece(part, level, index + 1 == n_pieces).unwrap()).collect();
            let mut back = Vec::new();
            DeflateDecoder::new(stream.as_slice()).read_to_end(&mut back).unwrap();
            assert!(back == bytes, "level {level}");
        }
    }

    #[test]
    fn checksums_of_pieces_join_to_that_of_the_whole_which_is_zlibs() {
        let bytes = bytes();
        let joined = bytes.chunks(33_333).fold(Adler32::EMPTY, |sum, part| sum.then(Adler32::of(part), part.len()));
        assert_eq!(joined, Adler32::of(&bytes));
        let stream = zlib(&bytes, 1).unwrap();
        assert_eq!(stream[stream.len() - 4..], joined.value().to_be_bytes());
        let mut back = Vec::new();
        ZlibDecoder::new(stream.as_slice()).read_to_end(&mut back).unwrap();
        assert!(back == bytes);
    }
}
