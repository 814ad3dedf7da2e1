//! Wavefront OBJ: positions and faces. (Wavefront, "Advanced Visualizer" manual, appendix B1.)
//!
//! Read are `v` (extra values, a weight or a colour, are ignored) and `f` with indices from 1, or negative from the end
//! of what stands above. A face may name vertices that only follow later. Everything else is ignored: textures, normals,
//! groups and materials silently, lines, points and unknown statements with a warning. Bytes need not be UTF-8; a
//! backslash at the end of a line continues it, but not within a comment, where Windows paths end so.

use glam::Vec3;

use super::MAX_VERTICES;
use super::Soup;
use super::faces::Faces;
use super::finding::{At, Finding, Outcome, Tally, counted, quoted};
use super::number::{is_blank, is_line_end, parse_f64, parse_i64, token};

/// Reads a whole file.
///
/// # Errors
/// When a coordinate is no number, an index is no whole number or names no vertex, or the text is no OBJ at all.
pub(super) fn parse(bytes: &[u8]) -> Outcome<Soup> {
    let mut reader = Reader { bytes, ..Reader::default() };
    while reader.at < bytes.len() {
        reader.statement()?;
    }
    reader.finish()
}

#[derive(Default)]
struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
    positions: Vec<Vec3>,
    faces: Faces,
    /// Corners of the face being read.
    corners: Vec<u32>,
    /// The largest vertex that a face names before it was there, and where.
    furthest: Option<(u32, usize)>,
    n_known_statements: usize,
    lines_and_points: Tally,
    unknown: Tally,
}

impl Reader<'_> {
    #[inline]
    fn peek(&self) -> Option<u8> {
        self.bytes.get(self.at).copied()
    }

    /// Moves to the next value of the statement, over continued lines; false at its end.
    #[inline]
    fn seek_value(&mut self) -> bool {
        loop {
            match self.peek() {
                None | Some(b'#' | b'\n' | b'\r') => return false,
                Some(b'\\') => match self.continuation() {
                    Some(next_line) => self.at = next_line,
                    None => return true,
                },
                Some(byte) if is_blank(byte) => self.at += 1,
                Some(_) => return true,
            }
        }
    }

    /// The start of the next line when a backslash at `at` ends this one.
    #[cold]
    fn continuation(&self) -> Option<usize> {
        match self.bytes.get(self.at + 1..)? {
            [b'\r', b'\n', ..] => Some(self.at + 3),
            [b'\n' | b'\r', ..] => Some(self.at + 2),
            _ => None,
        }
    }

    /// Moves behind the end of the statement.
    #[inline]
    fn skip_statement(&mut self, is_comment: bool) {
        let mut is_comment = is_comment;
        while let Some(byte) = self.peek() {
            self.at += 1;
            if is_line_end(byte) {
                break;
            }
            is_comment |= byte == b'#';
            if byte == b'\\' && !is_comment {
                self.at -= 1;
                self.at = self.continuation().unwrap_or(self.at + 1);
            }
        }
    }

    fn statement(&mut self) -> Outcome<()> {
        if !self.seek_value() {
            self.skip_statement(self.peek() == Some(b'#'));
            return Ok(());
        }
        let start = self.at;
        let keyword = token(self.bytes, start);
        self.at += keyword.len();
        match keyword {
            b"v" => {
                self.vertex(start)?;
                self.n_known_statements += 1;
            }
            b"f" | b"fo" => {
                self.face(start)?;
                self.n_known_statements += 1;
            }
            b"vt" | b"vn" | b"vp" | b"g" | b"o" | b"s" | b"usemtl" | b"mtllib" | b"mg" | b"vw" | b"usemap"
            | b"maplib" => {
                self.n_known_statements += 1;
            }
            b"l" | b"p" => {
                self.n_known_statements += 1;
                self.lines_and_points.add(At::Line(start));
            }
            _ => self.unknown.add(At::Line(start)),
        }
        self.skip_statement(false);
        Ok(())
    }

    fn vertex(&mut self, start: usize) -> Outcome<()> {
        let mut position = [0.0; 3];
        for (axis, coordinate) in position.iter_mut().enumerate() {
            if !self.seek_value() {
                return Err(Finding::line(start, "a vertex has too few coordinates").found(axis).expected(3).into());
            }
            let Some((value, end)) = parse_f64(self.bytes, self.at) else {
                return Err(Finding::line(self.at, "a coordinate is not a number")
                    .found(quoted(token(self.bytes, self.at)))
                    .expected("a number")
                    .into());
            };
            *coordinate = value as f32;
            self.at = end;
        }
        if self.positions.len() == MAX_VERTICES {
            let expected = format!("at most {MAX_VERTICES}");
            return Err(Finding::line(start, "too many vertices").expected(expected).into());
        }
        self.positions.push(Vec3::from_array(position));
        Ok(())
    }

    fn face(&mut self, start: usize) -> Outcome<()> {
        self.corners.clear();
        while self.seek_value() {
            let corner = self.corner()?;
            self.corners.push(corner);
        }
        self.faces.push(&self.corners, At::Line(start));
        Ok(())
    }

    /// One corner: `v`, `v/vt`, `v//vn` or `v/vt/vn`. The other two indices must be whole numbers or nothing; whether
    /// they name anything is not asked, since nothing is read from there.
    #[inline]
    fn corner(&mut self) -> Outcome<u32> {
        let start = self.at;
        let Some((index, end)) = parse_i64(self.bytes, start) else { return Err(self.bad_corner(start)) };
        self.at = end;
        for _ in 0..2 {
            if self.peek() == Some(b'/') {
                self.at += 1;
                if matches!(self.peek(), Some(b'0'..=b'9' | b'-' | b'+')) {
                    let Some((_, end)) = parse_i64(self.bytes, self.at) else { return Err(self.bad_corner(start)) };
                    self.at = end;
                }
            }
        }
        if self.peek().is_some_and(|byte| !is_blank(byte) && byte != b'\\' && byte != b'#') {
            return Err(self.bad_corner(start));
        }
        self.row(index, start)
    }

    #[cold]
    fn bad_corner(&self, start: usize) -> Box<Finding> {
        Finding::line(start, "a face has a malformed corner")
            .found(quoted(token(self.bytes, start)))
            .expected("`v`, `v/vt`, `v//vn` or `v/vt/vn` in whole numbers")
            .into()
    }

    /// The row that an index names. One beyond the vertices so far may still come.
    #[inline]
    fn row(&mut self, index: i64, start: usize) -> Outcome<u32> {
        let n_vertices = self.positions.len() as i64;
        let row = if index > 0 { index - 1 } else { n_vertices + index };
        if index == 0 || row < 0 || row >= MAX_VERTICES as i64 {
            return Err(no_such_vertex(start, index, n_vertices as usize).into());
        }
        if row >= n_vertices && self.furthest.is_none_or(|(furthest, _)| row > i64::from(furthest)) {
            self.furthest = Some((row as u32, start));
        }
        Ok(row as u32)
    }

    fn finish(self) -> Outcome<Soup> {
        let n_vertices = self.positions.len();
        if let Some((row, start)) = self.furthest
            && row as usize >= n_vertices
        {
            return Err(no_such_vertex(start, i64::from(row) + 1, n_vertices).into());
        }
        let mut findings: Vec<Finding> = Vec::new();
        if let Some(unknown) = self
            .unknown
            .finding(|count| format!("{} ignored", counted(count, "unknown statement is", "unknown statements are")))
        {
            let At::Line(start) = unknown.at else { return Err(unknown.into()) };
            let found = quoted(token(self.bytes, start));
            if self.n_known_statements == 0 {
                return Err(Finding::line(start, "this is not an OBJ file")
                    .found(found)
                    .expected("statements like `v X Y Z` and `f I J K`")
                    .into());
            }
            findings.push(unknown.found(found));
        }
        findings.extend(self.lines_and_points.finding(|count| {
            format!("{} ignored", counted(count, "line or point element is", "line and point elements are"))
        }));
        Ok(Soup { positions: self.positions, faces: self.faces, findings, ..Soup::default() })
    }
}

#[cold]
fn no_such_vertex(start: usize, index: i64, n_vertices: usize) -> Finding {
    let expected = match n_vertices {
        0 => "no index: there is no vertex".to_string(),
        n => format!("1 to {n}, or -{n} to -1"),
    };
    Finding::line(start, "a face names a vertex that does not exist").found(index).expected(expected)
}

#[cfg(test)]
mod tests;
