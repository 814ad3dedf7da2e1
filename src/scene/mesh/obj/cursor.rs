//! A place in the text of an OBJ file, moved by values and statements.
//!
//! A backslash at the end of a line continues it, but not within a comment, where Windows paths end so.

use memchr::{memchr, memchr2};

use super::super::number::{is_blank, token};

#[derive(Clone, Copy, Debug)]
pub(super) struct Cursor<'a> {
    pub bytes: &'a [u8],
    pub at: usize,
}

impl<'a> Cursor<'a> {
    #[inline]
    pub fn peek(&self) -> Option<u8> {
        self.bytes.get(self.at).copied()
    }

    /// Moves to the next value of the statement, over continued lines; false at its end.
    #[inline]
    pub fn seek_value(&mut self) -> bool {
        loop {
            match self.peek() {
                None | Some(b'#' | b'\n' | b'\r') => return false,
                Some(b'\\') => match continuation(self.bytes, self.at) {
                    Some(next_line) => self.at = next_line,
                    None => return true,
                },
                Some(byte) if is_blank(byte) => self.at += 1,
                Some(_) => return true,
            }
        }
    }

    /// The value that begins here.
    #[inline]
    pub fn token(&self) -> &'a [u8] {
        token(self.bytes, self.at)
    }

    /// Moves behind the end of the statement.
    #[inline]
    pub fn skip_statement(&mut self) {
        if self.peek() == Some(b'\n') {
            self.at += 1;
            return;
        }
        let mut is_comment = false;
        loop {
            let rest = &self.bytes[self.at..];
            let Some(length) = memchr2(b'\n', b'\r', rest) else {
                self.at = self.bytes.len();
                return;
            };
            let end = self.at + length;
            self.at = end + 1;
            if !rest[..length].ends_with(b"\\") {
                return;
            }
            is_comment |= memchr(b'#', &rest[..length]).is_some();
            if is_comment {
                return;
            }
            self.at = continuation(self.bytes, end - 1).unwrap_or(self.at);
        }
    }

    /// What stands in the statement from here on, without blanks around it, and as one line.
    pub fn rest_of_statement(&self) -> Vec<u8> {
        let mut end = *self;
        end.skip_statement();
        let text = &self.bytes[self.at..end.at];
        let mut rest = Vec::with_capacity(text.len());
        let mut at = 0;
        while let Some(&byte) = text.get(at) {
            let next_line = if byte == b'\\' { continuation(text, at) } else { None };
            rest.push(if next_line.is_some() { b' ' } else { byte });
            at = next_line.unwrap_or(at + 1);
        }
        rest.trim_ascii().to_vec()
    }
}

/// The start of the next line when a backslash at `at` ends this one.
#[cold]
fn continuation(bytes: &[u8], at: usize) -> Option<usize> {
    match bytes.get(at + 1..)? {
        [b'\r', b'\n', ..] => Some(at + 3),
        [b'\n' | b'\r', ..] => Some(at + 2),
        _ => None,
    }
}

/// Cuts a text into pieces of about `piece_bytes`, each of whole statements: the offsets where they begin, and the end.
pub(super) fn piece_bounds(bytes: &[u8], piece_bytes: usize) -> Vec<usize> {
    let mut bounds = vec![0];
    let mut last = 0;
    for nominal in (piece_bytes..bytes.len()).step_by(piece_bytes) {
        if nominal > last {
            last = statement_start(bytes, nominal);
            bounds.push(last);
        }
    }
    if last < bytes.len() || bounds.len() == 1 {
        bounds.push(bytes.len());
    }
    bounds
}

/// The first offset behind `from` that certainly begins a statement: the line before it ends without a backslash.
fn statement_start(bytes: &[u8], from: usize) -> usize {
    let mut at = from;
    while let Some(length) = memchr2(b'\n', b'\r', &bytes[at..]) {
        let end = at + length;
        at = end + 1;
        let line = match &bytes[..end] {
            [line @ .., b'\r'] if bytes[end] == b'\n' => line,
            line => line,
        };
        if !line.ends_with(b"\\") {
            return at;
        }
    }
    bytes.len()
}
