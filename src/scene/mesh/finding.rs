//! What a reader found wrong, at an offset; the reader knows no path.

use std::fmt::Display;

use super::super::source::Source;
use crate::error::{Place, Problem};

/// Where in the bytes a finding lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::scene) enum At {
    /// The whole file.
    File,
    /// The line of text that holds this offset.
    Line(usize),
    /// This byte of binary data.
    Byte(usize),
}

/// A problem without its path: an error when returned as one, a warning when collected.
#[derive(Clone, Debug)]
pub(in crate::scene) struct Finding {
    pub at: At,
    /// The thing it is about, for example `vertex[3].y`.
    pub key: Option<String>,
    pub what: String,
    pub found: Option<String>,
    pub expected: Option<String>,
    pub help: Option<String>,
    /// As [`Problem::is_defect`].
    pub is_defect: bool,
}

/// Boxed, so that a reader's hot path returns two words.
pub(in crate::scene) type Outcome<T> = Result<T, Box<Finding>>;

impl Finding {
    #[cold]
    pub fn new(at: At, what: impl Into<String>) -> Finding {
        Finding { at, key: None, what: what.into(), found: None, expected: None, help: None, is_defect: false }
    }

    #[cold]
    pub fn file(what: impl Into<String>) -> Finding {
        Finding::new(At::File, what)
    }

    #[cold]
    pub fn line(offset: usize, what: impl Into<String>) -> Finding {
        Finding::new(At::Line(offset), what)
    }

    #[cold]
    pub fn byte(offset: usize, what: impl Into<String>) -> Finding {
        Finding::new(At::Byte(offset), what)
    }

    pub fn found(mut self, found: impl Display) -> Finding {
        self.found = Some(found.to_string());
        self
    }

    pub fn expected(mut self, expected: impl Display) -> Finding {
        self.expected = Some(expected.to_string());
        self
    }

    pub fn help(mut self, help: impl Display) -> Finding {
        self.help = Some(help.to_string());
        self
    }

    pub fn defect(mut self) -> Finding {
        self.is_defect = true;
        self
    }

    pub fn key(mut self, key: impl Into<String>) -> Finding {
        self.key = Some(key.into());
        self
    }

    /// The finding with its place in the file that was read.
    pub fn into_problem(self, source: &Source) -> Problem {
        let Finding { at, key, mut what, found, expected, help, is_defect } = self;
        let place = match at {
            At::File => Place::file(source.path()),
            At::Line(offset) => source.line(offset),
            At::Byte(offset) => source.byte(offset),
        };
        if source.was_packed() && matches!(at, At::Byte(_)) {
            what.push_str(" (byte of the decompressed data)");
        }
        Problem { place: Place { key, ..place }, what, found, expected, help, is_defect }
    }
}

/// Cases of the same kind, counted, so that a file with a million of them gives one warning with the first place.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::scene) struct Tally {
    count: usize,
    first: Option<At>,
}

impl Tally {
    pub fn add(&mut self, at: At) {
        self.count += 1;
        self.first.get_or_insert(at);
    }

    /// Takes in the cases of what follows in the file.
    pub fn append(&mut self, next: Tally) {
        self.count += next.count;
        self.first = self.first.or(next.first);
    }

    /// A finding at the first case, whose text is made from the count; `None` when there was no case.
    pub fn finding(self, what: impl FnOnce(usize) -> String) -> Option<Finding> {
        self.first.map(|at| Finding::new(at, what(self.count)))
    }
}

/// `1 face`, `2 faces`.
pub(in crate::scene) fn counted(count: usize, one: &str, many: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}

/// Bytes of a file as they may stand in a message: lossy, without control characters, at most 40 characters.
pub(in crate::scene) fn quoted(bytes: &[u8]) -> String {
    const MAX_CHARS: usize = 40;
    let text = String::from_utf8_lossy(&bytes[..bytes.len().min(4 * MAX_CHARS + 4)]);
    let mut shown: String = text.chars().take(MAX_CHARS).flat_map(char::escape_debug).collect();
    if text.chars().count() > MAX_CHARS {
        shown.push('…');
    }
    format!("`{shown}`")
}
