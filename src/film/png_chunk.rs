//! What a PNG file says about itself outside its pixels: size, kind and transfer, chunk by chunk.
//!
//! Source: W3C *Portable Network Graphics (PNG) Specification (Third Edition)*, sections 5.3 (chunk layout), 11.2.1
//! (IHDR), 11.3.2 (colour space information and its precedence).

use std::io::{self, Write};
use std::path::Path;

use crate::error::{Error, Place, Problem};
use crate::film::tone_map::linear_from_srgb;

/// The first bytes of every PNG file.
pub const SIGNATURE: [u8; 8] = [0x89, b'P', b'N', b'G', b'\r', b'\n', 0x1a, b'\n'];

/// How the samples of a file relate to light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Transfer {
    /// Samples are proportional to light.
    Linear,
    /// The sRGB curve.
    Srgb,
    /// sample = light^gamma; the value of a gAMA chunk, above 0.
    Gamma(f64),
}

impl Transfer {
    /// Light of an encoded sample; both in 0 … 1.
    pub fn to_linear(self, encoded: f64) -> f64 {
        match self {
            Transfer::Linear => encoded,
            Transfer::Srgb => linear_from_srgb(encoded),
            Transfer::Gamma(1.0) => encoded,
            Transfer::Gamma(gamma) => libm::pow(encoded, 1.0 / gamma),
        }
    }
}

/// Size and kind of a PNG image, from IHDR.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Header {
    /// Width in pixels.
    pub width_px: u32,
    /// Height in pixels.
    pub height_px: u32,
    /// Bits of one sample in the file: 1, 2, 4, 8 or 16.
    pub bit_depth: u8,
    /// Samples of one pixel in the file; an index into the palette is one.
    pub n_channels: u8,
}

impl Header {
    /// Bytes of the image before compression; `None` when no integer holds them.
    pub fn uncompressed_bytes(&self) -> Option<u64> {
        let bits_per_row = u64::from(self.width_px) * u64::from(self.bit_depth) * u64::from(self.n_channels);
        // One more byte a row names its filter (section 9.2).
        u64::from(self.height_px).checked_mul(bits_per_row.div_ceil(8) + 1)
    }
}

/// A chunk: its type, its data, and where its data start.
type Chunk<'a> = ([u8; 4], &'a [u8], usize);

/// The chunks from the start of the file on, until its end or until one is cut short.
fn chunks(bytes: &[u8]) -> impl Iterator<Item = Chunk<'_>> {
    let mut at = SIGNATURE.len();
    std::iter::from_fn(move || {
        let length = u32::from_be_bytes(bytes.get(at..at + 4)?.try_into().ok()?) as usize;
        let kind: [u8; 4] = bytes.get(at + 4..at + 8)?.try_into().ok()?;
        let start = at + 8;
        let data = bytes.get(start..start.checked_add(length)?)?;
        at = start + length + 4;
        Some((kind, data, start))
    })
}

/// Reads IHDR.
///
/// # Errors
/// A file without a proper IHDR as its first chunk.
pub fn parse_header(bytes: &[u8], path: &Path) -> Result<Header, Error> {
    let wrong = |what: &str| Error::new(Place::byte(path, SIGNATURE.len() as u64), what);
    let Some((kind, data, _)) = chunks(bytes).next() else {
        return Err(wrong("the PNG file ends before its header"));
    };
    let (b"IHDR", &[w0, w1, w2, w3, h0, h1, h2, h3, bit_depth, color_type, ..]) = (&kind, data) else {
        return Err(wrong("the PNG file does not start with an IHDR chunk"));
    };
    let n_channels = match color_type {
        0 | 3 => 1,
        4 => 2,
        2 => 3,
        6 => 4,
        _ => return Err(wrong("the PNG file has an unknown colour type")),
    };
    let width_px = u32::from_be_bytes([w0, w1, w2, w3]);
    let height_px = u32::from_be_bytes([h0, h1, h2, h3]);
    if width_px == 0 || height_px == 0 {
        return Err(wrong("the PNG image has no pixels"));
    }
    Ok(Header { width_px, height_px, bit_depth, n_channels })
}

/// The transfer that a file states: by cICP, else sRGB, else gAMA, else sRGB for want of anything better.
///
/// ICC profiles (iCCP) are not evaluated: what stands beside them counts.
///
/// # Errors
/// A cICP chunk that states anything but BT.709 primaries with a linear or sRGB transfer, a gAMA chunk of 0, and either
/// chunk with a wrong length.
pub fn parse_transfer(bytes: &[u8], path: &Path) -> Result<Transfer, Error> {
    let (mut srgb, mut gamma) = (None, None);
    for (kind, data, start) in chunks(bytes).take_while(|(kind, ..)| kind != b"IDAT") {
        let place = || Place::byte(path, start as u64);
        match (&kind, data) {
            // ITU-T H.273: primaries 1 are BT.709, transfer 8 is linear and 13 sRGB, matrix 0 is RGB, 1 is full range.
            (b"cICP", [1, 8, 0, 1]) => return Ok(Transfer::Linear),
            (b"cICP", [1, 13, 0, 1]) => return Ok(Transfer::Srgb),
            (b"cICP", _) => {
                let problem = Problem::new(place(), "the PNG file is in a colour space that is not supported");
                return Err(problem.found(format!("cICP {data:?}")).expected("cICP 1, 8 or 13, 0, 1").into());
            }
            (b"sRGB", _) => srgb = Some(Transfer::Srgb),
            (b"gAMA", &[a, b, c, d]) if [a, b, c, d] != [0; 4] => {
                gamma = Some(Transfer::Gamma(f64::from(u32::from_be_bytes([a, b, c, d])) / 100_000.0));
            }
            (b"gAMA", _) => {
                let problem = Problem::new(place(), "the gAMA chunk of the PNG file is not valid");
                return Err(problem.found(format!("{data:?}")).expected("four bytes, not all 0").into());
            }
            _ => {}
        }
    }
    Ok(srgb.or(gamma).unwrap_or(Transfer::Srgb))
}

/// Writes a chunk whose data come in parts. Its length must fit 31 bits, as the bands of an image do.
///
/// # Errors
/// What `out` answers.
pub fn write_chunk(out: &mut (impl Write + ?Sized), kind: [u8; 4], parts: &[&[u8]]) -> io::Result<()> {
    let length: usize = parts.iter().map(|part| part.len()).sum();
    let length = u32::try_from(length).map_err(|_| io::Error::other("a PNG chunk of more than 4 GiB"))?;
    let mut crc = crc32fast::Hasher::new();
    out.write_all(&length.to_be_bytes())?;
    for part in [&kind as &[u8]].iter().chain(parts) {
        crc.update(part);
        out.write_all(part)?;
    }
    out.write_all(&crc.finalize().to_be_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn png_with(chunks: &[([u8; 4], &[u8])]) -> Vec<u8> {
        let ihdr: ([u8; 4], &[u8]) = (*b"IHDR", &[0, 0, 0, 3, 0, 0, 0, 2, 8, 2, 0, 0, 0]);
        let end: [([u8; 4], &[u8]); 2] = [(*b"IDAT", &[]), (*b"IEND", &[])];
        let mut png = SIGNATURE.to_vec();
        for (kind, data) in [ihdr].iter().chain(chunks).chain(&end) {
            write_chunk(&mut png, *kind, &[data]).unwrap();
        }
        png
    }

    fn transfer_of(chunks: &[([u8; 4], &[u8])]) -> Result<Transfer, Error> {
        parse_transfer(&png_with(chunks), Path::new("a.png"))
    }

    #[test]
    fn the_transfer_follows_the_precedence_of_the_chunks() {
        let gamma: ([u8; 4], &[u8]) = (*b"gAMA", &[0, 1, 0x86, 0xa0]);
        let srgb: ([u8; 4], &[u8]) = (*b"sRGB", &[0]);
        let cicp_linear: ([u8; 4], &[u8]) = (*b"cICP", &[1, 8, 0, 1]);
        assert_eq!(transfer_of(&[]), Ok(Transfer::Srgb));
        assert_eq!(transfer_of(&[gamma]), Ok(Transfer::Gamma(1.0)));
        assert_eq!(transfer_of(&[gamma, srgb]), Ok(Transfer::Srgb));
        assert_eq!(transfer_of(&[srgb, gamma, cicp_linear]), Ok(Transfer::Linear));
        assert_eq!(transfer_of(&[gamma, (*b"cICP", &[1, 13, 0, 1])]), Ok(Transfer::Srgb));
    }

    #[test]
    fn colour_spaces_that_are_not_understood_are_refused() {
        let pq = transfer_of(&[(*b"cICP", &[9, 16, 0, 1])]).unwrap_err().to_string();
        assert!(pq.contains("a.png: byte 41") && pq.contains("[9, 16, 0, 1]"), "{pq}");
        assert!(transfer_of(&[(*b"gAMA", &[0, 0, 0, 0])]).is_err());
        assert!(transfer_of(&[(*b"gAMA", &[1])]).is_err());
    }

    #[test]
    fn gamma_is_undone_by_its_inverse() {
        assert_eq!(Transfer::Gamma(1.0).to_linear(0.3), 0.3);
        assert!((Transfer::Gamma(0.5).to_linear(0.3) - 0.09).abs() < 1e-15);
        assert_eq!(Transfer::Gamma(0.45455).to_linear(1.0), 1.0);
    }

    #[test]
    fn the_header_gives_size_and_kind() {
        let header = parse_header(&png_with(&[]), Path::new("a.png")).unwrap();
        assert_eq!(header, Header { width_px: 3, height_px: 2, bit_depth: 8, n_channels: 3 });
        assert_eq!(header.uncompressed_bytes(), Some(20));
        assert!(parse_header(&SIGNATURE, Path::new("a.png")).is_err());
    }
}
