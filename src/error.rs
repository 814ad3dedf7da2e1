//! One error type with a place.
//!
//! Everything that can go wrong with input or output is an [`Error`]: a list of [`Problem`]s, so that several mistakes
//! of a file are reported together. A [`Problem`] says where it is, what is wrong, what was found and what was
//! expected. Warnings are [`Problem`]s too; they are returned beside a result instead of in place of it.

use std::fmt;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Where a problem lies. Every field is optional: an output file has no line, a command line no file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Place {
    /// The file as the user named it.
    pub file: Option<PathBuf>,
    /// Line, counted from 1.
    pub line: Option<u32>,
    /// Column in characters, counted from 1.
    pub column: Option<u32>,
    /// Offset into a binary file, in bytes from its start.
    pub byte_offset: Option<u64>,
    /// The key in the dotted form a user would search for, for example `hittable[2].radius`.
    pub key: Option<String>,
    /// Bytes of `text` that the problem is about.
    pub byte_range: Option<Range<usize>>,
    /// The text of the file, kept so that a snippet can be shown.
    pub text: Option<Arc<str>>,
}

impl Place {
    /// A place that is a whole file.
    pub fn file(path: impl AsRef<Path>) -> Place {
        Place { file: Some(path.as_ref().to_path_buf()), ..Place::default() }
    }

    /// A line of a text file, counted from 1.
    pub fn line(path: impl AsRef<Path>, line: u32) -> Place {
        Place { line: Some(line), ..Place::file(path) }
    }

    /// A byte of a binary file, counted from 0.
    pub fn byte(path: impl AsRef<Path>, byte_offset: u64) -> Place {
        Place { byte_offset: Some(byte_offset), ..Place::file(path) }
    }

    /// A byte range of a text; line and column are derived from it.
    pub fn span(path: Option<&Path>, text: &Arc<str>, byte_range: Range<usize>) -> Place {
        let start = byte_range.start.min(text.len());
        let before = &text.as_bytes()[..start];
        let line = before.iter().filter(|&&b| b == b'\n').count() as u32 + 1;
        let line_start = before.iter().rposition(|&b| b == b'\n').map_or(0, |at| at + 1);
        let column = String::from_utf8_lossy(&before[line_start..]).chars().count() as u32 + 1;
        Place {
            file: path.map(Path::to_path_buf),
            line: Some(line),
            column: Some(column),
            byte_range: Some(byte_range),
            text: Some(Arc::clone(text)),
            ..Place::default()
        }
    }

    /// The same place, naming a key.
    pub fn with_key(mut self, key: impl Into<String>) -> Place {
        self.key = Some(key.into());
        self
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.file {
            Some(file) => write!(f, "{}", file.display())?,
            None if self.text.is_some() => write!(f, "scene")?,
            None => {}
        }
        if let Some(line) = self.line {
            write!(f, ":{line}")?;
        }
        if let Some(column) = self.column {
            write!(f, ":{column}")?;
        }
        if let Some(byte) = self.byte_offset {
            write!(f, ": byte {byte}")?;
        }
        Ok(())
    }
}

/// One thing that is wrong, or, as a warning, one thing that was mended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// Where it is.
    pub place: Place,
    /// What is wrong, as a short sentence without a full stop.
    pub what: String,
    /// The value found, if there is one.
    pub found: Option<String>,
    /// What was expected instead.
    pub expected: Option<String>,
    /// What the user could do about it.
    pub help: Option<String>,
    /// As a warning: whether something was wrong with the geometry that the input holds, and was left out or mended.
    /// Such warnings are errors under `--strict`.
    pub is_defect: bool,
}

impl Problem {
    /// A problem at a place.
    pub fn new(place: Place, what: impl Into<String>) -> Problem {
        Problem { place, what: what.into(), found: None, expected: None, help: None, is_defect: false }
    }

    /// The same problem, naming the value that was found.
    pub fn found(mut self, found: impl fmt::Display) -> Problem {
        self.found = Some(found.to_string());
        self
    }

    /// The same problem, naming what was expected.
    pub fn expected(mut self, expected: impl fmt::Display) -> Problem {
        self.expected = Some(expected.to_string());
        self
    }

    /// The same problem, as a warning of wrong geometry that was left out or mended.
    pub fn defect(mut self) -> Problem {
        self.is_defect = true;
        self
    }

    /// The same problem with advice.
    pub fn help(mut self, help: impl fmt::Display) -> Problem {
        self.help = Some(help.to_string());
        self
    }
}

impl fmt::Display for Problem {
    /// One line: `file:line:column: key: what: found X, expected Y (help)`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let place = self.place.to_string();
        if !place.is_empty() {
            write!(f, "{place}: ")?;
        }
        if let Some(key) = &self.place.key {
            write!(f, "{key}: ")?;
        }
        write!(f, "{}", self.what)?;
        match (&self.found, &self.expected) {
            (Some(found), Some(expected)) => write!(f, ": found {found}, expected {expected}")?,
            (Some(found), None) => write!(f, ": found {found}")?,
            (None, Some(expected)) => write!(f, ": expected {expected}")?,
            (None, None) => {}
        }
        if let Some(help) = &self.help {
            write!(f, " ({help})")?;
        }
        Ok(())
    }
}

/// Why something could not be done: one problem or more.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Error {
    /// At least one problem, in the order in which they stand in the file.
    pub problems: Vec<Problem>,
}

impl Error {
    /// An error of one problem.
    pub fn new(place: Place, what: impl Into<String>) -> Error {
        Error::from(Problem::new(place, what))
    }

    /// An error of the operating system with the file it concerns.
    pub fn io(path: impl AsRef<Path>, doing: &str, source: &std::io::Error) -> Error {
        Error::new(Place::file(path), format!("cannot {doing}: {source}"))
    }
}

impl From<Problem> for Error {
    fn from(problem: Problem) -> Error {
        Error { problems: vec![problem] }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, problem) in self.problems.iter().enumerate() {
            if index > 0 {
                writeln!(f)?;
            }
            write!(f, "{problem}")?;
        }
        Ok(())
    }
}

impl std::error::Error for Error {}
