//! OFF (Geomview manual, "OFF Files"), the ascii form in three dimensions.
//!
//! Read are positions, normals of `NOFF` when they are wanted, and faces; colours and texture coordinates are passed over.
//! Departures: each row begins on a line of its own, as all writers do it; the counts may stand behind the keyword or
//! below it, and that of edges may be missing.

use super::MAX_VERTICES;
use super::finding::{Finding, Outcome, quoted};
use super::number::{is_blank, is_line_end, parse_i64};
use super::ply::{OffRows, parse_off_rows};
use super::{Attributes, Soup};

/// What stands in front of the counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Keyword {
    has_normals: bool,
    has_four_coordinates: bool,
    is_of_n_dimensions: bool,
    /// Bytes of the word.
    length: usize,
}

impl Keyword {
    /// `[ST][C][N][4][n]OFF`; a number may follow without a blank, as some writers have it.
    fn of(word: &[u8]) -> Option<Keyword> {
        let mut rest = word;
        let mut takes = |prefix: &[u8]| match rest.strip_prefix(prefix) {
            Some(behind) => {
                rest = behind;
                true
            }
            None => false,
        };
        takes(b"ST");
        takes(b"C");
        let has_normals = takes(b"N");
        let has_four_coordinates = takes(b"4");
        let is_of_n_dimensions = takes(b"n");
        let is_keyword = takes(b"OFF") && rest.iter().all(u8::is_ascii_digit);
        let length = word.len() - rest.len();
        is_keyword.then_some(Keyword { has_normals, has_four_coordinates, is_of_n_dimensions, length })
    }
}

/// Whether the first word, behind comments, is the keyword.
pub(super) fn has_keyword(bytes: &[u8]) -> bool {
    // Binary data and long comments are looked at no further.
    let mut words = Words { bytes: &bytes[..bytes.len().min(64 << 10)], at: 0 };
    Keyword::of(words.next()).is_some()
}

/// Reads a whole file.
///
/// # Errors
/// When the file is binary or of other dimensions, a count is none, a row is cut short or holds no numbers, or an index
/// names no vertex.
pub(super) fn parse(bytes: &[u8], wanted: Attributes) -> Outcome<Soup> {
    let mut words = Words { bytes, at: 0 };
    let word = words.next();
    let start = words.at - word.len();
    // The keyword may be missing, says the manual.
    let keyword = Keyword::of(word).unwrap_or_default();
    if keyword.has_four_coordinates || keyword.is_of_n_dimensions {
        return Err(Finding::line(start, "OFF files with other than three coordinates are not read")
            .found(quoted(word))
            .expected("`OFF`, with `ST`, `C` or `N` in front of it if need be")
            .into());
    }
    words.at = start + keyword.length;
    let before_counts = words.at;
    if words.next() == b"BINARY" {
        return Err(Finding::line(words.at, "binary OFF files are not read")
            .help("write the file as text, or as binary PLY")
            .into());
    }
    words.at = before_counts;
    let (n_vertices, declared_at) = words.count("vertices")?;
    let (n_faces, _) = words.count("faces")?;
    if n_vertices > MAX_VERTICES {
        return Err(Finding::line(declared_at, "too many vertices")
            .found(n_vertices)
            .expected(format!("at most {MAX_VERTICES}"))
            .into());
    }
    let start = words.line_end();
    parse_off_rows(bytes, OffRows { n_vertices, n_faces, has_normals: keyword.has_normals, declared_at, start }, wanted)
}

/// Words of a text with comments.
struct Words<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Words<'a> {
    /// Moves behind the next word and returns it; empty at the end of the file.
    fn next(&mut self) -> &'a [u8] {
        while let Some(&byte) = self.bytes.get(self.at) {
            match byte {
                b'#' => self.at = self.line_end(),
                _ if is_blank(byte) => self.at += 1,
                _ => break,
            }
        }
        let rest = &self.bytes[self.at..];
        let length = rest.iter().position(|&b| is_blank(b) || b == b'#').unwrap_or(rest.len());
        self.at += length;
        &rest[..length]
    }

    fn line_end(&self) -> usize {
        let rest = &self.bytes[self.at..];
        rest.iter().position(|&b| is_line_end(b)).map_or(self.bytes.len(), |n| self.at + n)
    }

    /// The next word as a count, and where it begins.
    fn count(&mut self, of: &str) -> Outcome<(usize, usize)> {
        let word = self.next();
        let start = self.at - word.len();
        let count = parse_i64(word, 0).filter(|&(_, end)| end == word.len());
        count.and_then(|(count, _)| Some((usize::try_from(count).ok()?, start))).ok_or_else(|| {
            let found = if word.is_empty() { "the end of the file".to_owned() } else { quoted(word) };
            let what = format!("the number of {of} is missing or none");
            Finding::line(start, what).found(found).expected("a whole number, 0 or more").into()
        })
    }
}

#[cfg(test)]
mod tests;
