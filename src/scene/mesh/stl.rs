//! STL (3D Systems, "StereoLithography Interface Specification", 1989), binary and ascii.
//!
//! Corners that are equal number for number become one vertex, so that neighbours share it. Normals and attributes
//! are ignored: a facet's normal says what its corners say.

use glam::Vec3;
use rayon::prelude::*;

use super::MAX_VERTICES;
use super::Soup;
use super::faces::Faces;
use super::finding::{At, Finding, Outcome, counted, quoted};
use super::number::{is_blank, is_line_end, parse_f64, token};
use super::weld::{self, Numbered, position_key};

const HEADER_BYTES: usize = 84;
const FACET_BYTES: usize = 50;

/// Reads a whole file.
///
/// # Errors
/// When a binary file ends before its count of facets, or an ascii file is not of the form of the specification.
pub(super) fn parse(bytes: &[u8]) -> Outcome<Soup> {
    if is_ascii(bytes) { AsciiReader::new(bytes).solids() } else { parse_binary(bytes) }
}

/// A file whose size is that of its binary count is binary, whatever its header says: many begin with `solid`. Any
/// other that begins with `solid` is ascii when one of the keywords that may follow stands in its first kilobyte.
fn is_ascii(bytes: &[u8]) -> bool {
    if has_binary_size(bytes) {
        return false;
    }
    let head = head(bytes);
    head.starts_with(b"solid") && (has_word(&head, b"facet") || has_word(&head, b"endsolid") || !head.contains(&0))
}

/// Whether the bytes can be nothing but STL: of a binary file's size, or text that begins as an ascii file with facets.
pub(super) fn is_certain(bytes: &[u8]) -> bool {
    let head = head(bytes);
    has_binary_size(bytes) || head.starts_with(b"solid") && has_word(&head, b"facet")
}

/// Whether the size is that of a binary file with as many facets as it says, and at least one.
pub(super) fn has_binary_size(bytes: &[u8]) -> bool {
    binary_count(bytes).is_some_and(|count| count > 0 && bytes.len() == HEADER_BYTES + FACET_BYTES * count)
}

/// The beginning, in lower case.
fn head(bytes: &[u8]) -> Vec<u8> {
    bytes[..bytes.len().min(1024)].trim_ascii_start().to_ascii_lowercase()
}

fn has_word(head: &[u8], word: &[u8]) -> bool {
    head.split(|&b| is_blank(b)).any(|found| found == word)
}

fn binary_count(bytes: &[u8]) -> Option<usize> {
    let count = bytes.get(HEADER_BYTES - 4..)?.first_chunk::<4>()?;
    Some(u32::from_le_bytes(*count) as usize)
}

fn parse_binary(bytes: &[u8]) -> Outcome<Soup> {
    let Some(n_facets) = binary_count(bytes) else {
        return Err(Finding::byte(bytes.len(), "the file is too short for an STL file")
            .found(counted(bytes.len(), "byte", "bytes"))
            .expected("text that begins with `solid`, or a header of 84 bytes")
            .into());
    };
    let facets = &bytes[HEADER_BYTES..];
    let n_whole = facets.len() / FACET_BYTES;
    if n_whole < n_facets {
        let n_needed = HEADER_BYTES + FACET_BYTES * n_facets;
        return Err(Finding::byte(bytes.len(), format!("the file ends inside facet {n_whole} of {n_facets}"))
            .found(format!("{} bytes", bytes.len()))
            .expected(format!("{n_needed} bytes, by the count at byte 80"))
            .help("the file is cut short, its count is wrong, or it is no STL file")
            .into());
    }
    check_corners(3 * n_facets, At::Byte(HEADER_BYTES - 4))?;
    let Numbered { rows, keys } = weld::number(n_facets, |row| {
        let facet = &facets[FACET_BYTES * row..][..FACET_BYTES];
        [12, 24, 36].map(|corner| position_key(position(&facet[corner..])))
    });
    let end = HEADER_BYTES + FACET_BYTES * n_facets;
    let mut findings = Vec::new();
    if !bytes[end..].trim_ascii().is_empty() {
        let rest = counted(bytes.len() - end, "byte is", "bytes are");
        findings.push(Finding::byte(end, format!("{rest} left behind the last of {n_facets} facets, and ignored")));
    }
    Ok(Soup { positions: positions_of(keys), faces: Faces::of_triangles(rows), findings, ..Soup::default() })
}

fn positions_of(keys: Vec<weld::Key>) -> Vec<Vec3> {
    keys.into_par_iter().map(|bits| Vec3::from_array(bits.map(f32::from_bits))).collect()
}

fn position(bytes: &[u8]) -> Vec3 {
    Vec3::from_array([0, 4, 8].map(|axis| {
        let value = bytes.get(axis..).and_then(|bytes| bytes.first_chunk::<4>());
        value.map_or(f32::NAN, |value| f32::from_le_bytes(*value))
    }))
}

fn check_corners(n_corners: usize, at: At) -> Outcome<()> {
    if n_corners <= MAX_VERTICES {
        return Ok(());
    }
    Err(Finding::new(at, "too many facets").expected(format!("at most {}", MAX_VERTICES / 3)).into())
}

struct AsciiReader<'a> {
    bytes: &'a [u8],
    at: usize,
    /// Corners as they come; faces name them by place.
    corners: Vec<Vec3>,
    faces: Faces,
}

impl<'a> AsciiReader<'a> {
    fn new(bytes: &'a [u8]) -> AsciiReader<'a> {
        AsciiReader { bytes, at: 0, corners: Vec::new(), faces: Faces::default() }
    }

    /// Moves to the next word and returns it; empty at the end of the file.
    #[inline]
    fn word(&mut self) -> &'a [u8] {
        while self.bytes.get(self.at).is_some_and(|&b| is_blank(b)) {
            self.at += 1;
        }
        let start = self.at;
        while self.bytes.get(self.at).is_some_and(|&b| !is_blank(b)) {
            self.at += 1;
        }
        &self.bytes[start..self.at]
    }

    fn skip_line(&mut self) {
        while self.bytes.get(self.at).is_some_and(|&b| !is_line_end(b)) {
            self.at += 1;
        }
    }

    #[cold]
    fn unexpected(&self, word: &[u8], expected: &str) -> Box<Finding> {
        if word.is_empty() {
            return Finding::line(self.bytes.len(), "the file ends inside a solid").expected(expected).into();
        }
        Finding::line(self.at - word.len(), "unexpected word").found(quoted(word)).expected(expected).into()
    }

    fn expect(&mut self, keyword: &str) -> Outcome<()> {
        let word = self.word();
        if word.eq_ignore_ascii_case(keyword.as_bytes()) {
            return Ok(());
        }
        Err(self.unexpected(word, &format!("`{keyword}`")))
    }

    /// Solids one after the other. The name behind `solid` and `endsolid` runs to the end of the line and may be any
    /// text.
    fn solids(mut self) -> Outcome<Soup> {
        let mut is_inside = false;
        loop {
            let word = self.word();
            if word.is_empty() && !is_inside {
                break;
            } else if word.eq_ignore_ascii_case(b"facet") && is_inside {
                self.facet()?;
            } else if word.eq_ignore_ascii_case(b"solid") && !is_inside {
                self.skip_line();
                is_inside = true;
            } else if word.eq_ignore_ascii_case(b"endsolid") && is_inside {
                self.skip_line();
                is_inside = false;
            } else {
                return Err(self.unexpected(word, if is_inside { "`facet` or `endsolid`" } else { "`solid`" }));
            }
        }
        let AsciiReader { corners, mut faces, .. } = self;
        let Numbered { rows, keys } = weld::number(corners.len(), |row| [position_key(corners[row])]);
        drop(corners);
        faces.renumber(rows.as_flattened());
        Ok(Soup { positions: positions_of(keys), faces, ..Soup::default() })
    }

    /// A facet behind its keyword. More than three corners are taken as a polygon.
    fn facet(&mut self) -> Outcome<()> {
        let start = self.at;
        self.expect("normal")?;
        for _ in 0..3 {
            // Often zero, nan or absent digits; nothing is read from it.
            self.word();
        }
        self.expect("outer")?;
        self.expect("loop")?;
        let mut corners = [0; 3];
        let mut polygon = Vec::new();
        let mut n_corners = 0;
        loop {
            let word = self.word();
            if word.eq_ignore_ascii_case(b"vertex") {
                let corner = self.vertex()?;
                match corners.get_mut(n_corners) {
                    Some(place) => *place = corner,
                    None if n_corners == 3 => polygon.extend(corners.into_iter().chain([corner])),
                    None => polygon.push(corner),
                }
                n_corners += 1;
            } else if word.eq_ignore_ascii_case(b"endloop") && n_corners >= 3 {
                break;
            } else {
                let expected = if n_corners < 3 { "`vertex X Y Z`, three times" } else { "`endloop`" };
                return Err(self.unexpected(word, expected));
            }
        }
        self.expect("endfacet")?;
        self.faces.push(if n_corners == 3 { &corners } else { &polygon }, At::Line(start));
        Ok(())
    }

    fn vertex(&mut self) -> Outcome<u32> {
        let mut position = [0.0; 3];
        for coordinate in &mut position {
            let word = self.word();
            let start = self.at - word.len();
            match parse_f64(self.bytes, start) {
                Some((value, end)) if end == self.at => *coordinate = value as f32,
                _ if word.is_empty() => return Err(self.unexpected(word, "a number")),
                _ => {
                    return Err(Finding::line(start, "a coordinate is not a number")
                        .found(quoted(token(self.bytes, start)))
                        .expected("a number")
                        .into());
                }
            }
        }
        self.corners.push(Vec3::from_array(position));
        check_corners(self.corners.len(), At::Line(self.at))?;
        Ok(self.corners.len() as u32 - 1)
    }
}

#[cfg(test)]
mod tests;
