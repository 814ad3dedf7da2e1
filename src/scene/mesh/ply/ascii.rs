//! The ascii encoding: values apart by blanks, a row to a line.
//!
//! A row may also run over several lines, as some writers break long lists; but each row begins on a line of its own,
//! so that a missing value is found where it is missing.
//!
//! OFF files are the same but for two customs, [`Custom`].

use glam::Vec3;
use rayon::prelude::*;

use super::super::faces::Faces;
use super::super::finding::{At, Finding, Outcome, Tally, counted, quoted};
use super::super::number::{is_blank, is_line_end, parse_f64, parse_i64, token};
use super::body::{Columns, FaceRow, Step, Values, Vertices};
use super::header::{Element, Kind};

/// In what a format departs from PLY.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Custom {
    Ply,
    /// `#` begins a comment, and values behind those of a row, such as colours, are passed over without a word.
    Off,
}

#[derive(Debug)]
pub(super) struct Ascii<'a> {
    bytes: &'a [u8],
    at: usize,
    custom: Custom,
    /// Where the row and the latest value began, for messages.
    row_start: usize,
    value_start: usize,
    surplus: Tally,
}

impl<'a> Ascii<'a> {
    pub fn new(bytes: &'a [u8], body_start: usize, custom: Custom) -> Ascii<'a> {
        let (row_start, value_start) = (body_start, body_start);
        Ascii { bytes, at: body_start, custom, row_start, value_start, surplus: Tally::default() }
    }

    /// Moves to the next value, over line ends too.
    #[inline]
    fn seek_value(&mut self) {
        while let Some(&byte) = self.bytes.get(self.at) {
            if byte == b'#' && self.custom == Custom::Off {
                self.at = line_end(self.bytes, self.at);
            } else if is_blank(byte) {
                self.at += 1;
            } else {
                break;
            }
        }
    }

    #[cold]
    fn no_number(&self) -> Box<Finding> {
        if self.at >= self.bytes.len() {
            return Finding::line(self.at, "the file ends inside a row").expected("a number").into();
        }
        let found = quoted(token(self.bytes, self.at));
        Finding::line(self.at, "this is not a number").found(found).expected("a number").into()
    }

    /// A row with values left over on its line. When the row stands on that line alone, the header declares too little
    /// (MeshLab writes colours so), and the values that it declares are right: the rest is passed over and counted. A
    /// row that began on an earlier line has taken values of the next.
    #[cold]
    fn surplus_values(&mut self) -> Outcome<()> {
        let end = line_end(self.bytes, self.at);
        if self.custom == Custom::Off && self.bytes[self.at] == b'#' {
            self.at = end;
            return Ok(());
        }
        if self.bytes[self.row_start..self.at].iter().any(|&b| is_line_end(b)) {
            let found = quoted(self.bytes[self.at..end].trim_ascii());
            return Err(Finding::line(self.row_start, "the row has fewer values than the header declares")
                .found(format!("{found} left over on the line where it ends"))
                .expected("each row on a line of its own")
                .into());
        }
        if self.custom == Custom::Ply {
            self.surplus.add(At::Line(self.row_start));
        }
        self.at = end;
        Ok(())
    }
}

// Many rows at once.
//
// Nearly all rows of nearly all files are plain: a line each, with as many values as the header says. Lines can be told
// apart without reading them, so pieces of the file are read by all threads. A row that is not plain ends the run and is
// read value by value: it may be right all the same, and if not, its message is made there.

/// A piece that one thread reads, in bytes.
const PIECE_BYTES: usize = 64 << 10;

/// Pieces that are read together at most.
const MOST_PIECES: usize = 64;

/// The values of one line.
struct Line<'a> {
    bytes: &'a [u8],
    at: usize,
    custom: Custom,
}

/// The offset of the line end at or behind an offset, or of the end of the file.
fn line_end(bytes: &[u8], at: usize) -> usize {
    bytes[at..].iter().position(|&b| is_line_end(b)).map_or(bytes.len(), |n| at + n)
}

/// What one thread has read: rows, and the offset behind the last of them.
struct Run<T> {
    rows: Vec<T>,
    end: usize,
}

impl Line<'_> {
    #[inline]
    fn skip_blanks(&mut self) {
        while self.bytes.get(self.at).is_some_and(|&b| is_blank(b) && !is_line_end(b)) {
            self.at += 1;
        }
    }

    /// The next number on the line.
    #[inline]
    fn number(&mut self) -> Option<f64> {
        self.skip_blanks();
        let (value, end) = parse_f64(self.bytes, self.at)?;
        self.at = end;
        Some(value)
    }

    /// As many numbers, of which those at `wanted` are kept.
    #[inline]
    fn scalars<const N: usize>(&mut self, n_values: usize, wanted: [usize; N]) -> Option<[f32; N]> {
        let mut kept = [0.0; N];
        for place in 0..n_values {
            let value = self.number()?;
            if let Some(row) = wanted.iter().position(|&wanted| wanted == place) {
                kept[row] = value as f32;
            }
        }
        Some(kept)
    }

    /// The next number, if it is written as a whole number that is not negative.
    #[inline]
    fn whole(&mut self) -> Option<u64> {
        self.skip_blanks();
        let (value, end) = parse_i64(self.bytes, self.at)?;
        self.at = end;
        self.bytes.get(end).is_none_or(|&b| is_blank(b)).then_some(value.try_into().ok()?)
    }

    /// The offset behind the line, if nothing is left on it.
    #[inline]
    fn end(&mut self) -> Option<usize> {
        self.skip_blanks();
        if self.custom == Custom::Off {
            self.at = line_end(self.bytes, self.at);
        }
        match self.bytes.get(self.at..)? {
            [] => Some(self.at),
            [b'\n', ..] => Some(self.at + 1),
            [b'\r', b'\n', ..] => Some(self.at + 2),
            _ => None,
        }
    }
}

/// Reads plain rows from `start` on, until `end`, which is the start of a line or the end of the file, or until a row is
/// not plain.
fn read_run<T>(
    bytes: &[u8],
    start: usize,
    end: usize,
    custom: Custom,
    parse: impl Fn(&mut Line) -> Option<T>,
) -> Run<T> {
    let bytes = &bytes[..end];
    let mut run = Run { rows: Vec::new(), end: start };
    while run.end < end {
        let mut line = Line { bytes, at: run.end, custom };
        let Some(row) = parse(&mut line) else { break };
        let Some(end) = line.end() else { break };
        run.rows.push(row);
        run.end = end;
    }
    run
}

impl Ascii<'_> {
    /// Reads plain rows, at most `n_rows`, hands them over in order and returns how many there were.
    fn bulk<T: Send>(
        &mut self,
        n_rows: usize,
        parse: impl Fn(&mut Line) -> Option<T> + Sync,
        mut take: impl FnMut(&[T]),
    ) -> usize {
        // Where most rows are not plain, as in a mesh of quads, finding that out must cost nothing.
        let mut line = Line { bytes: self.bytes, at: self.at, custom: self.custom };
        if n_rows == 0 || parse(&mut line).and_then(|_| line.end()).is_none() {
            return 0;
        }
        let mut n_done = 0;
        // Twice as much each time, so that what is read in vain, behind a row that is not plain, is less than what was
        // of use.
        let mut n_pieces = 1;
        while n_done < n_rows {
            let places: Vec<usize> =
                (0..=n_pieces).map(|piece| self.line_start(self.at + piece * PIECE_BYTES)).collect();
            let read = |place: &[usize]| read_run(self.bytes, place[0], place[1], self.custom, &parse);
            let runs: Vec<Run<T>> = match n_pieces {
                1 => places.windows(2).map(read).collect(),
                _ => places.par_windows(2).map(read).collect(),
            };
            for (run, place) in runs.iter().zip(places.windows(2)) {
                let rows = &run.rows[..run.rows.len().min(n_rows - n_done)];
                take(rows);
                n_done += rows.len();
                if rows.len() < run.rows.len() {
                    // The rows of the next element were plain too: each row was a line.
                    self.at = line_ends(self.bytes, place[0]).nth(rows.len() - 1).unwrap_or(self.bytes.len());
                    return n_done;
                }
                self.at = run.end;
                if run.end < place[1] || n_done == n_rows {
                    return n_done;
                }
            }
            if self.at >= self.bytes.len() {
                break;
            }
            n_pieces = (2 * n_pieces).min(MOST_PIECES);
        }
        n_done
    }

    /// The first start of a line at or behind an offset: where reading goes on, or behind a line feed; else the end of the
    /// file.
    fn line_start(&self, at: usize) -> usize {
        if at <= self.at {
            return self.at;
        }
        line_ends(self.bytes, at - 1).next().unwrap_or(self.bytes.len())
    }
}

/// The offsets behind all line feeds from an offset on.
fn line_ends(bytes: &[u8], from: usize) -> impl Iterator<Item = usize> {
    let from = from.min(bytes.len());
    bytes[from..].iter().enumerate().filter(|&(_, &b)| b == b'\n').map(move |(index, _)| from + index + 1)
}

impl Values for Ascii<'_> {
    #[inline]
    fn number(&mut self, _kind: Kind) -> Outcome<f64> {
        self.seek_value();
        let Some((value, end)) = parse_f64(self.bytes, self.at) else { return Err(self.no_number()) };
        self.value_start = self.at;
        self.at = end;
        Ok(value)
    }

    #[inline]
    fn list_length(&mut self, count_kind: Kind, _item_kind: Kind) -> Outcome<usize> {
        let value = self.number(count_kind)?;
        let at = self.value_start;
        let length = value as usize;
        if length as f64 != value {
            return Err(Finding::line(at, "a list has no such length").found(value).expected("0 or more").into());
        }
        // An item takes a blank and a digit.
        if length > self.n_bytes_left() / 2 {
            return Err(Finding::line(at, "a list is longer than the rest of the file")
                .found(counted(length, "item", "items"))
                .expected(format!("at most the {} bytes left can hold", self.n_bytes_left()))
                .into());
        }
        Ok(length)
    }

    #[inline]
    fn skip(&mut self, _kind: Kind, n_values: usize) -> Outcome<()> {
        for _ in 0..n_values {
            self.seek_value();
            if self.at >= self.bytes.len() {
                return Err(self.no_number());
            }
            while self.bytes.get(self.at).is_some_and(|&b| !is_blank(b)) {
                self.at += 1;
            }
        }
        Ok(())
    }

    #[inline]
    fn end_row(&mut self) -> Outcome<()> {
        while let Some(&byte) = self.bytes.get(self.at) {
            if !is_blank(byte) {
                return self.surplus_values();
            }
            self.at += 1;
            if is_line_end(byte) {
                break;
            }
        }
        Ok(())
    }

    #[inline]
    fn begin_row(&mut self) -> At {
        self.seek_value();
        self.row_start = self.at;
        At::Line(self.at)
    }

    fn last_value_at(&self) -> At {
        At::Line(self.value_start)
    }

    fn n_bytes_left(&self) -> usize {
        self.bytes.len() - self.at
    }

    /// A digit and a blank for each value, the last blank left out at the end of the file.
    fn least_row_bytes(element: &Element) -> usize {
        (2 * element.properties.len()).saturating_sub(1)
    }

    /// Rows of scalars alone, three or six of which are kept.
    fn bulk_vertices(&mut self, element: &Element, columns: &Columns, vertices: &mut Vertices) -> Outcome<usize> {
        let n_values = element.properties.len();
        if element.properties.iter().any(|property| property.count_kind.is_some()) {
            return Ok(0);
        }
        let Vertices { positions, normals } = vertices;
        let Some([nx, ny, nz]) = columns.normal else {
            let parse = |line: &mut Line| line.scalars(n_values, columns.xyz).map(Vec3::from_array);
            return Ok(self.bulk(element.count, parse, |rows| positions.extend_from_slice(rows)));
        };
        let [x, y, z] = columns.xyz;
        let parse = |line: &mut Line| line.scalars(n_values, [x, y, z, nx, ny, nz]);
        Ok(self.bulk(element.count, parse, |rows| {
            positions.extend(rows.iter().map(|&[x, y, z, ..]| Vec3::new(x, y, z)));
            normals.extend(rows.iter().map(|&[.., nx, ny, nz]| Vec3::new(nx, ny, nz)));
        }))
    }

    /// The common layout: nothing but the list.
    fn bulk_triangles(&mut self, face: &FaceRow, n_rows: usize, n_vertices: usize, faces: &mut Faces) -> usize {
        if !matches!(face.steps.as_slice(), [Step::Indices { .. }]) {
            return 0;
        }
        let parse = |line: &mut Line| {
            let n_corners = line.whole()?;
            let corners = [line.whole()?, line.whole()?, line.whole()?];
            let fits = n_corners == 3 && corners.iter().all(|&corner| corner < n_vertices as u64);
            // They fit: there are fewer than 2³¹ vertices.
            fits.then(|| corners.map(|corner| corner as u32))
        };
        self.bulk(n_rows, parse, |rows| rows.iter().for_each(|&corners| faces.push_triangle(corners)))
    }

    fn finish(self, findings: &mut Vec<Finding>) {
        findings.extend(self.surplus.finding(|count| {
            let lines = counted(count, "line has", "lines have");
            format!("{lines} more values than the header declares, which are ignored")
        }));
        let rest = &self.bytes[self.at..];
        if let Some(n_blanks) = rest.iter().position(|&b| !is_blank(b)) {
            let at = self.at + n_blanks;
            let found = quoted(token(self.bytes, at));
            findings.push(Finding::line(at, "text behind the last element is ignored").found(found));
        }
    }
}
