//! The ascii encoding: values apart by blanks, a row to a line.
//!
//! A row may also run over several lines, as some writers break long lists; but each row begins on a line of its own,
//! so that a missing value is found where it is missing.

use super::super::finding::{At, Finding, Outcome, Tally, counted, quoted};
use super::super::number::{is_blank, is_line_end, parse_f64, token};
use super::body::Values;
use super::header::{Element, Kind};

#[derive(Debug)]
pub(super) struct Ascii<'a> {
    bytes: &'a [u8],
    at: usize,
    /// Where the row and the latest value began, for messages.
    row_start: usize,
    value_start: usize,
    surplus: Tally,
}

impl<'a> Ascii<'a> {
    pub fn new(bytes: &'a [u8], body_start: usize) -> Ascii<'a> {
        Ascii { bytes, at: body_start, row_start: body_start, value_start: body_start, surplus: Tally::default() }
    }

    /// Moves to the next value, over line ends too.
    #[inline]
    fn seek_value(&mut self) {
        while self.bytes.get(self.at).is_some_and(|&b| is_blank(b)) {
            self.at += 1;
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
        let end = self.bytes[self.at..].iter().position(|&b| is_line_end(b)).map_or(self.bytes.len(), |n| self.at + n);
        if self.bytes[self.row_start..self.at].iter().any(|&b| is_line_end(b)) {
            let found = quoted(self.bytes[self.at..end].trim_ascii());
            return Err(Finding::line(self.row_start, "the row has fewer values than the header declares")
                .found(format!("{found} left over on the line where it ends"))
                .expected("each row on a line of its own")
                .into());
        }
        self.surplus.add(At::Line(self.row_start));
        self.at = end;
        Ok(())
    }
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
