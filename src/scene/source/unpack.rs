//! Compressed files: gzip (RFC 1952) and zstd (RFC 8878), whole in memory, within limits.

use std::io::Read;
use std::path::Path;

use flate2::bufread::MultiGzDecoder;
use ruzstd::decoding::errors::{FrameDecoderError, ReadFrameHeaderError};
use ruzstd::decoding::{BlockDecodingStrategy, FrameDecoder};

use super::super::machine;
use crate::error::{Error, Place, Problem};

/// Decompressed data may always grow to this size …
const FLOOR_BYTES: usize = machine::NOT_ASKED_BYTES as usize;

/// … and beyond it to this many times the compressed size. Scans as text compress 3 to 5 times, regular grids in
/// binary up to about 30 times, while deflate allows 1032 times and zstd more: a file above the limit is made to fill the
/// memory.
const MAX_RATIO: usize = 64;

/// The largest window of a zstd frame: what zstd itself decodes unless told otherwise. So much may lie in the decoder
/// besides what it has handed over.
const MAX_WINDOW_BYTES: u64 = 128 << 20;

/// Room that may be asked for before there is data.
const MAX_FIRST_RESERVE_BYTES: usize = 256 << 20;

/// How a file is compressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Packing {
    Gzip,
    Zstd,
}

impl Packing {
    /// Known by the first bytes: of gzip with deflate, of a zstd frame, or of a frame that zstd skips.
    pub fn of(bytes: &[u8]) -> Option<Packing> {
        match *bytes {
            [0x1f, 0x8b, 0x08, ..] => Some(Packing::Gzip),
            [0x28, 0xb5, 0x2f, 0xfd, ..] | [0x50..=0x5f, 0x2a, 0x4d, 0x18, ..] => Some(Packing::Zstd),
            _ => None,
        }
    }

    fn name(self) -> &'static str {
        match self {
            Packing::Gzip => "gzip",
            Packing::Zstd => "zstd",
        }
    }
}

/// What stops decompression, without the path.
enum Refusal {
    Damaged(String),
    TooLarge,
    Window(u64),
}

/// Decompresses all members or frames. The buffer grows with the data that is really decoded; sizes that headers and
/// trailers name are never used.
pub(super) fn unpack(path: &Path, packing: Packing, packed: &[u8]) -> Result<Vec<u8>, Error> {
    let by_ratio = FLOOR_BYTES.max(packed.len().saturating_mul(MAX_RATIO));
    let limit = if by_ratio == FLOOR_BYTES { FLOOR_BYTES } else { by_ratio.min(free_bytes()).max(FLOOR_BYTES) };
    let mut bytes = Vec::new();
    // Most files fit, and are not moved while they grow; room that is not used costs nothing. Others, or a system that
    // has no such room, do without.
    let _ = bytes.try_reserve(packed.len().saturating_mul(4).min(MAX_FIRST_RESERVE_BYTES));
    let mut rest = packed;
    let outcome = match packing {
        Packing::Gzip => gunzip(&mut rest, limit, &mut bytes),
        Packing::Zstd => unzstd(&mut rest, limit, &mut bytes),
    };
    let at = (packed.len() - rest.len()) as u64;
    let problem = |what: &str| Problem::new(Place::byte(path, at), format!("the {} data {what}", packing.name()));
    match outcome {
        Ok(()) if Packing::of(&bytes).is_some() => {
            Err(problem("holds compressed data again").expected("data that is compressed once").into())
        }
        Ok(()) => Ok(bytes),
        Err(Refusal::Damaged(error)) => Err(problem(&format!("is damaged or ends early: {error}"))
            .found(format!("{} decompressed bytes before it", bytes.len()))
            .into()),
        Err(Refusal::TooLarge) if limit == by_ratio => Err(problem("expands beyond what a file of this kind can need")
            .found(format!("more than {limit} bytes from {}", packed.len()))
            .expected(format!("at most {MAX_RATIO} times the compressed size, or {} MiB", FLOOR_BYTES >> 20))
            .help("decompress the file first if it is what it should be")
            .into()),
        Err(Refusal::TooLarge) => Err(problem("does not fit into memory")
            .found(format!("more than {limit} bytes from {}", packed.len()))
            .expected("no more than the memory that is free")
            .into()),
        Err(Refusal::Window(window_bytes)) => Err(problem("asks for too large a window")
            .found(format!("{window_bytes} bytes"))
            .expected(format!("at most {MAX_WINDOW_BYTES}"))
            .help("compress the file without --long or --ultra")
            .into()),
    }
}

fn free_bytes() -> usize {
    machine::available_bytes().map_or(usize::MAX, |free| usize::try_from(free).unwrap_or(usize::MAX))
}

fn gunzip(rest: &mut &[u8], limit: usize, bytes: &mut Vec<u8>) -> Result<(), Refusal> {
    let mut decoder = MultiGzDecoder::new(*rest).take((limit as u64).saturating_add(1));
    let read = decoder.read_to_end(bytes);
    *rest = *decoder.get_ref().get_ref();
    read.map_err(|error| Refusal::Damaged(error.to_string()))?;
    if bytes.len() > limit { Err(Refusal::TooLarge) } else { Ok(()) }
}

fn unzstd(rest: &mut &[u8], limit: usize, bytes: &mut Vec<u8>) -> Result<(), Refusal> {
    /// Decoded between two looks at the limit.
    const STEP_BYTES: usize = 1 << 20;
    let damaged = |error: FrameDecoderError| Refusal::Damaged(error.to_string());
    while !rest.is_empty() {
        if let Some(window_bytes) = window_bytes(rest).filter(|&window_bytes| window_bytes > MAX_WINDOW_BYTES) {
            return Err(Refusal::Window(window_bytes));
        }
        let mut decoder = FrameDecoder::new();
        match decoder.init(&mut *rest) {
            Ok(()) => {}
            Err(FrameDecoderError::ReadFrameHeaderError(ReadFrameHeaderError::SkipFrame { length, .. })) => {
                let behind = rest.get(length as usize..);
                *rest = behind.ok_or_else(|| Refusal::Damaged("it ends within a frame to be skipped".to_owned()))?;
                continue;
            }
            Err(error) => return Err(damaged(error)),
        }
        while !decoder.is_finished() {
            decoder.decode_blocks(&mut *rest, BlockDecodingStrategy::UptoBytes(STEP_BYTES)).map_err(damaged)?;
            if bytes.len().saturating_add(decoder.can_collect()) > limit {
                return Err(Refusal::TooLarge);
            }
            decoder.collect_to_writer(&mut *bytes).map_err(|error| Refusal::Damaged(error.to_string()))?;
        }
        let is_right =
            decoder.get_checksum_from_data().is_none_or(|sum| decoder.get_calculated_checksum() == Some(sum));
        if !is_right {
            return Err(Refusal::Damaged("its checksum is wrong".to_owned()));
        }
    }
    Ok(())
}

/// The window that a zstd frame asks for, by its header (RFC 8878, 3.1.1.1); `None` for a frame that is skipped, and
/// for a header that is cut short.
fn window_bytes(frame: &[u8]) -> Option<u64> {
    let (magic, header) = frame.split_first_chunk::<4>()?;
    let (&descriptor, header) = header.split_first()?;
    if *magic != [0x28, 0xb5, 0x2f, 0xfd] {
        return None;
    }
    let is_single_segment = descriptor & 0x20 != 0;
    if !is_single_segment {
        let window = *header.first()?;
        let base = 1_u64 << (10 + (window >> 3));
        return Some(base + base / 8 * u64::from(window & 7));
    }
    // The content is the window: its size stands behind the dictionary's id, in as many bytes as the flag says.
    let header = header.get([0, 1, 2, 4][usize::from(descriptor & 3)]..)?;
    match descriptor >> 6 {
        0 => header.first().map(|&size| u64::from(size)),
        1 => header.first_chunk().map(|&size| u64::from(u16::from_le_bytes(size)) + 256),
        2 => header.first_chunk().map(|&size| u64::from(u32::from_le_bytes(size))),
        _ => header.first_chunk().map(|&size| u64::from_le_bytes(size)),
    }
}

#[cfg(test)]
mod tests;
