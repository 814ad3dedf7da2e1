//! PFM, the portable float map: 32-bit floats behind three lines of text.
//!
//! Source: Paul Debevec's description of the format (the page of HDR Shop's PFM): `PF` for colour or `Pf` for grey, width
//! and height, a scale whose sign tells the byte order (negative: little-endian); then rows from the bottom up. The size
//! of the scale is a matter of units and is left alone.

use std::io::{self, Write};
use std::path::Path;

use crate::error::{Error, Place, Problem};
use crate::film::read::{filled, read_bytes};
use crate::film::{Film, Plane, Region, Samples};

/// Writes `R`, `G`, `B` (or `Y` alone as grey) of the film's data window, little-endian. F64 planes are rounded.
///
/// # Errors
/// `InvalidInput` when the film breaks its own promises ([`Film::check`]) or has no colour; otherwise what `out` answered.
pub fn write(film: &Film, out: &mut (impl Write + ?Sized)) -> io::Result<()> {
    let invalid_input = |what: String| io::Error::new(io::ErrorKind::InvalidInput, what);
    film.check().map_err(invalid_input)?;
    let Some(planes) = film.color_planes() else {
        return Err(invalid_input("a PFM needs planes R, G and B, or Y".to_string()));
    };
    let is_grey = planes[0].name == "Y";
    let planes = if is_grey { &planes[..1] } else { &planes[..] };
    let (width_px, height_px) = (film.data_window.width_px() as usize, film.data_window.height_px() as usize);
    write!(out, "{}\n{width_px} {height_px}\n-1.0\n", if is_grey { "Pf" } else { "PF" })?;
    let mut row = Vec::with_capacity(width_px * planes.len() * 4);
    for y in (0..height_px).rev() {
        row.clear();
        for index in y * width_px..(y + 1) * width_px {
            for plane in planes {
                row.extend_from_slice(&(plane.samples.get(index) as f32).to_le_bytes());
            }
        }
        out.write_all(&row)?;
    }
    Ok(())
}

/// Reads a PFM file as a film of `R`, `G`, `B` or of `Y`, in F32 planes.
///
/// # Errors
/// A file that cannot be read, has a damaged header, or is shorter or longer than its header says.
pub fn read(path: impl AsRef<Path>) -> Result<Film, Error> {
    let path = path.as_ref();
    decode(&read_bytes(path)?, path)
}

/// Reads a PFM file that is in memory; `path` is only named in errors.
///
/// # Errors
/// As [`read`].
pub fn decode(bytes: &[u8], path: &Path) -> Result<Film, Error> {
    let mut rest = bytes;
    let names: &[&str] = match word(&mut rest) {
        Some("PF") => &["R", "G", "B"],
        Some("Pf") => &["Y"],
        _ => return Err(Error::new(Place::byte(path, 0), "a PFM file starts with PF or Pf")),
    };
    let width_px: u32 = number(&mut rest, bytes, "a width above 0", |&width| width > 0, path)?;
    let height_px: u32 = number(&mut rest, bytes, "a height above 0", |&height| height > 0, path)?;
    let is_scale = |scale: &f64| scale.is_finite() && *scale != 0.0;
    let scale: f64 = number(&mut rest, bytes, "a scale that is finite and not 0", is_scale, path)?;

    let n_pixels = u64::from(width_px) * u64::from(height_px);
    let expected = n_pixels.checked_mul(names.len() as u64 * 4);
    if expected != Some(rest.len() as u64) {
        return Err(Problem::new(Place::file(path), "the PFM file's length does not fit its header")
            .found(format!("{} bytes of samples", rest.len()))
            .expected(format!("{width_px}×{height_px} pixels of {} samples of 4 bytes", names.len()))
            .into());
    }
    let from_bytes = if scale < 0.0 { f32::from_le_bytes } else { f32::from_be_bytes };
    // The file is that long, so the planes are no larger than what is in memory already.
    let (width, height) = (width_px as usize, height_px as usize);
    let mut planes = Vec::new();
    for (channel, name) in names.iter().enumerate() {
        let mut values = filled(width * height, 0.0_f32, path)?;
        let rows_up = rest.chunks_exact(width * names.len() * 4);
        for (row, row_bytes) in values.chunks_exact_mut(width).rev().zip(rows_up) {
            for (value, b) in row.iter_mut().zip(row_bytes.chunks_exact(4).skip(channel).step_by(names.len())) {
                *value = from_bytes([b[0], b[1], b[2], b[3]]);
            }
        }
        planes.push(Plane::color(*name, Samples::F32(values)));
    }
    Ok(Film { width_px, height_px, data_window: Region::whole(width_px, height_px), planes })
}

/// Takes the next word and the one whitespace character behind it; a word is at most 32 printable characters long.
fn word<'a>(rest: &mut &'a [u8]) -> Option<&'a str> {
    let bytes: &'a [u8] = rest;
    let length = bytes.iter().take(33).position(u8::is_ascii_whitespace)?;
    let (word, behind) = bytes.split_at(length);
    *rest = behind.get(1..)?;
    std::str::from_utf8(word).ok().filter(|word| !word.is_empty())
}

fn number<T: std::str::FromStr>(
    rest: &mut &[u8],
    bytes: &[u8],
    expected: &str,
    is_valid: impl Fn(&T) -> bool,
    path: &Path,
) -> Result<T, Error> {
    let place = Place::byte(path, (bytes.len() - rest.len()) as u64);
    let found = word(rest);
    found.and_then(|word| word.parse().ok()).filter(is_valid).ok_or_else(|| {
        let problem = Problem::new(place, "the header of the PFM file is damaged").expected(expected);
        match found {
            Some(word) => problem.found(format!("{word:?}")).into(),
            None => problem.into(),
        }
    })
}
