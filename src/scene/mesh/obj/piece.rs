//! One piece of an OBJ file: counted first, then read, each by one thread.

use glam::Vec3;

use super::super::Attributes;
use super::super::faces::Faces;
use super::super::finding::{At, Finding, Outcome, Tally, quoted};
use super::super::number::{is_blank, parse_f32, parse_i64, token};
use super::cursor::Cursor;

/// The normal of a corner that has none.
pub(super) const NO_NORMAL: u32 = u32::MAX;

/// Statements that indices count.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Counts {
    /// `v`.
    pub vertices: usize,
    /// `vn`.
    pub normals: usize,
}

impl Counts {
    pub fn plus(self, other: Counts) -> Counts {
        Counts { vertices: self.vertices + other.vertices, normals: self.normals + other.normals }
    }
}

/// Counts the statements of a piece, which ends with `bytes`.
pub(super) fn count(bytes: &[u8], start: usize) -> Counts {
    let mut cursor = Cursor { bytes, at: start };
    let mut counts = Counts::default();
    while cursor.at < bytes.len() {
        if cursor.seek_value() && cursor.peek() == Some(b'v') {
            let keyword = cursor.token();
            counts.vertices += usize::from(keyword == b"v");
            counts.normals += usize::from(keyword == b"vn");
            cursor.at += keyword.len();
        }
        cursor.skip_statement();
    }
    counts
}

/// Where a piece lies and what it fills.
#[derive(Debug)]
pub(super) struct Piece<'a> {
    /// The text up to the end of the piece.
    pub bytes: &'a [u8],
    pub start: usize,
    /// What stands before the piece, and in the whole file.
    pub before: Counts,
    pub total: Counts,
    /// Its rows of the table of positions, and of normals if they are wanted.
    pub positions: &'a mut [Vec3],
    pub normals: &'a mut [Vec3],
}

/// What else a piece holds.
#[derive(Debug, Default)]
pub(super) struct Contents {
    pub faces: Faces,
    /// If normals are wanted: one for each corner of `faces`.
    pub corner_normals: Vec<u32>,
    /// If materials are wanted: where `usemtl` stands, one for each mark of `faces`.
    pub materials: Vec<usize>,
    /// If materials are wanted: where `mtllib` stands.
    pub libraries: Vec<usize>,
    pub n_known_statements: usize,
    pub lines_and_points: Tally,
    pub unknown: Tally,
    /// Corners that name a normal which does not exist.
    pub lost_normals: Tally,
}

/// Reads a piece.
///
/// # Errors
/// At the first line of the piece where a coordinate is no number, or an index is no whole number or names no vertex.
pub(super) fn read(piece: Piece, wanted: Attributes) -> Outcome<Contents> {
    let Piece { bytes, start, before, total, positions, normals } = piece;
    let mut reader = Reader {
        cursor: Cursor { bytes, at: start },
        wanted,
        so_far: before,
        total,
        positions: positions.iter_mut(),
        normals: normals.iter_mut(),
        corners: Vec::new(),
        normals_of_corners: Vec::new(),
        contents: Contents::default(),
    };
    while reader.cursor.at < bytes.len() {
        reader.statement()?;
    }
    Ok(reader.contents)
}

struct Reader<'a> {
    cursor: Cursor<'a>,
    wanted: Attributes,
    so_far: Counts,
    total: Counts,
    positions: std::slice::IterMut<'a, Vec3>,
    normals: std::slice::IterMut<'a, Vec3>,
    /// Corners of the face being read.
    corners: Vec<u32>,
    normals_of_corners: Vec<u32>,
    contents: Contents,
}

impl Reader<'_> {
    #[inline]
    fn statement(&mut self) -> Outcome<()> {
        if !self.cursor.seek_value() {
            self.cursor.skip_statement();
            return Ok(());
        }
        let start = self.cursor.at;
        let keyword = self.cursor.token();
        self.cursor.at += keyword.len();
        match keyword {
            b"v" => self.vertex(start)?,
            b"f" | b"fo" if self.wanted.normals => self.face::<true>(start)?,
            b"f" | b"fo" => self.face::<false>(start)?,
            b"vn" if self.wanted.normals => self.normal(start)?,
            _ => self.other(keyword, start),
        }
        self.cursor.skip_statement();
        Ok(())
    }

    #[inline(never)]
    fn other(&mut self, keyword: &[u8], start: usize) {
        let contents = &mut self.contents;
        contents.n_known_statements += 1;
        match keyword {
            b"vt" | b"vn" | b"vp" | b"g" | b"o" | b"s" | b"mg" | b"vw" | b"usemap" | b"maplib" => {}
            b"usemtl" if self.wanted.materials => {
                contents.faces.mark();
                contents.materials.push(start);
            }
            b"mtllib" if self.wanted.materials => contents.libraries.push(start),
            b"usemtl" | b"mtllib" => {}
            b"l" | b"p" => contents.lines_and_points.add(At::Line(start)),
            _ => {
                contents.n_known_statements -= 1;
                contents.unknown.add(At::Line(start));
            }
        }
    }

    #[inline]
    fn vertex(&mut self, start: usize) -> Outcome<()> {
        let position = self.three_numbers(start, "a vertex has too few coordinates", "a coordinate is not a number")?;
        if let Some(row) = self.positions.next() {
            *row = position;
        }
        self.so_far.vertices += 1;
        self.contents.n_known_statements += 1;
        Ok(())
    }

    fn normal(&mut self, start: usize) -> Outcome<()> {
        let what = "a normal has too few components";
        let normal = self.three_numbers(start, what, "a component of a normal is not a number")?;
        if let Some(row) = self.normals.next() {
            *row = normal;
        }
        self.so_far.normals += 1;
        self.contents.n_known_statements += 1;
        Ok(())
    }

    #[inline]
    fn three_numbers(&mut self, start: usize, too_few: &str, no_number: &str) -> Outcome<Vec3> {
        let mut numbers = [0.0; 3];
        for (axis, number) in numbers.iter_mut().enumerate() {
            if !self.cursor.seek_value() {
                return Err(Finding::line(start, too_few).found(axis).expected(3).into());
            }
            let Some((value, end)) = parse_f32(self.cursor.bytes, self.cursor.at) else {
                return Err(Finding::line(self.cursor.at, no_number)
                    .found(quoted(self.cursor.token()))
                    .expected("a number")
                    .into());
            };
            *number = value;
            self.cursor.at = end;
        }
        Ok(Vec3::from_array(numbers))
    }

    #[inline]
    fn face<const NORMALS: bool>(&mut self, start: usize) -> Outcome<()> {
        self.corners.clear();
        self.normals_of_corners.clear();
        while self.cursor.seek_value() {
            let (corner, normal) = self.corner::<NORMALS>()?;
            self.corners.push(corner);
            if NORMALS {
                self.normals_of_corners.push(normal);
            }
        }
        self.contents.faces.push(&self.corners, At::Line(start));
        if NORMALS && self.corners.len() >= 3 {
            self.contents.corner_normals.extend_from_slice(&self.normals_of_corners);
        }
        self.contents.n_known_statements += 1;
        Ok(())
    }

    /// One corner: `v`, `v/vt`, `v//vn` or `v/vt/vn`, as the rows of its position and, if they are wanted, of its normal.
    /// The other indices must be whole numbers or nothing; whether they name anything is not asked.
    #[inline]
    fn corner<const NORMALS: bool>(&mut self) -> Outcome<(u32, u32)> {
        let Cursor { bytes, at: start } = self.cursor;
        let Some((index, mut at)) = parse_i64(bytes, start) else { return Err(self.bad_corner(start)) };
        let mut normal = None;
        for place in 0..2 {
            if bytes.get(at) == Some(&b'/') {
                at += 1;
                if matches!(bytes.get(at), Some(b'0'..=b'9' | b'-' | b'+')) {
                    let Some((index, end)) = parse_i64(bytes, at) else { return Err(self.bad_corner(start)) };
                    at = end;
                    if place == 1 {
                        normal = Some(index);
                    }
                }
            }
        }
        if bytes.get(at).is_some_and(|&byte| !is_blank(byte) && byte != b'\\' && byte != b'#') {
            return Err(self.bad_corner(start));
        }
        self.cursor.at = at;
        let Some(row) = row(index, self.so_far.vertices, self.total.vertices) else {
            return Err(self.no_such_vertex(start, index).into());
        };
        let normal_row =
            if NORMALS { normal.map_or(NO_NORMAL, |index| self.normal_row(index, start)) } else { NO_NORMAL };
        Ok((row, normal_row))
    }

    /// A normal that does not exist leaves the corner without: the shape does not depend on it.
    #[inline]
    fn normal_row(&mut self, index: i64, start: usize) -> u32 {
        row(index, self.so_far.normals, self.total.normals).unwrap_or_else(|| {
            self.contents.lost_normals.add(At::Line(start));
            NO_NORMAL
        })
    }

    #[cold]
    fn bad_corner(&self, start: usize) -> Box<Finding> {
        Finding::line(start, "a face has a malformed corner")
            .found(quoted(token(self.cursor.bytes, start)))
            .expected("`v`, `v/vt`, `v//vn` or `v/vt/vn` in whole numbers")
            .into()
    }

    #[cold]
    fn no_such_vertex(&self, start: usize, index: i64) -> Finding {
        let expected = match (self.total.vertices, self.so_far.vertices) {
            (0, _) => "no index: there is no vertex".to_string(),
            (total, 0) => format!("1 to {total}: no vertex stands above"),
            (total, so_far) => format!("1 to {total}, or -{so_far} to -1"),
        };
        Finding::line(start, "a face names a vertex that does not exist").found(index).expected(expected)
    }
}

/// The row that an index names: from 1 in the whole file, or from −1 backwards in what stands above.
#[inline]
fn row(index: i64, n_so_far: usize, n_total: usize) -> Option<u32> {
    let row = if index > 0 { index - 1 } else { n_so_far as i64 + index };
    // Fewer than 2³¹ rows.
    (index != 0 && (0..n_total as i64).contains(&row)).then_some(row as u32)
}
