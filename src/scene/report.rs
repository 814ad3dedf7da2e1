//! Collects what is wrong with a scene, so that all of it is told at once and in the order of the file.

use std::cell::RefCell;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::error::{Error, Place, Problem};

/// Most problems that are told at once; a broken file of a million lines must not answer with a million messages.
const MAX_TOLD: usize = 50;
/// Most problems that are kept; the rest is only counted.
const MAX_KEPT: usize = 10_000;
/// Most syntax errors that a mistake is compared with; a text with more is hardly TOML, and its keys mean nothing.
const MAX_SYNTAX_ERRORS: usize = 1_000;
/// Longest piece of the file that is repeated as the value found, in characters.
const MAX_FOUND_CHARS: usize = 48;

/// Mistakes and warnings of one scene text.
#[derive(Debug)]
pub struct Report {
    file: PathBuf,
    text: Arc<str>,
    syntax_errors: RefCell<Vec<Range<usize>>>,
    errors: RefCell<Entries>,
    warnings: RefCell<Entries>,
}

/// Problems of one kind, up to [`MAX_KEPT`], and how many there were in all.
#[derive(Debug, Default)]
struct Entries {
    kept: Vec<Entry>,
    n_all: usize,
}

impl Entries {
    fn push(&mut self, byte_range: &Range<usize>, problem: Problem) {
        self.n_all += 1;
        if self.kept.len() < MAX_KEPT {
            self.kept.push(Entry { byte_range: byte_range.clone(), problem });
        }
    }
}

/// A problem and where it sorts in. Line and column are found at the end, and only for those that are told.
#[derive(Debug)]
struct Entry {
    byte_range: Range<usize>,
    problem: Problem,
}

impl Report {
    /// An empty report about a text; `name` is what messages call the file.
    pub fn new(name: impl Into<PathBuf>, text: &str) -> Report {
        Report {
            file: name.into(),
            text: Arc::from(text),
            syntax_errors: RefCell::default(),
            errors: RefCell::default(),
            warnings: RefCell::default(),
        }
    }

    /// What messages call the file.
    pub fn file(&self) -> &Path {
        &self.file
    }

    /// The text of the file between two bytes, on one line and not too long, to be shown as the value found.
    pub fn excerpt(&self, byte_range: &Range<usize>) -> String {
        let text = self.text.get(byte_range.clone()).unwrap_or_default();
        let mut words = String::new();
        for word in text.split_whitespace() {
            if !words.is_empty() {
                words.push(' ');
            }
            words.push_str(word);
            if words.len() > 4 * MAX_FOUND_CHARS {
                break;
            }
        }
        if words.chars().count() > MAX_FOUND_CHARS {
            words = words.chars().take(MAX_FOUND_CHARS - 1).chain(['…']).collect();
        }
        words
    }

    /// Records that the text is not TOML at some bytes; only the first such mistake of a line is told, since the
    /// others usually follow from it.
    pub fn syntax_error(&self, byte_range: Range<usize>, what: &str) {
        let mut known = self.syntax_errors.borrow_mut();
        let same_line = known.last().is_some_and(|last| {
            self.text.as_bytes().get(last.start..byte_range.start).is_some_and(|between| !between.contains(&b'\n'))
        });
        known.push(byte_range.clone());
        if !same_line {
            let excerpt = self.excerpt(&byte_range);
            let nothing_there = excerpt.is_empty() && what.starts_with("string values must be quoted");
            let what = if nothing_there { "a value is missing" } else { what };
            let mut problem = Problem::new(Place::default(), format!("not valid TOML: {what}"));
            if !excerpt.is_empty() {
                problem = problem.found(excerpt);
            }
            self.errors.borrow_mut().push(&byte_range, problem);
        }
    }

    /// Whether the text is not TOML somewhere, so that keys may have been lost.
    pub fn has_syntax_errors(&self) -> bool {
        !self.syntax_errors.borrow().is_empty()
    }

    /// Records a mistake about a key. Mistakes at the place of a syntax error are left out: they follow from it.
    pub fn mistake(&self, byte_range: &Range<usize>, key: &str, problem: Problem) {
        let touches = |at: &Range<usize>| at.start <= byte_range.end + 2 && byte_range.start <= at.end + 2;
        let syntax_errors = self.syntax_errors.borrow();
        if syntax_errors.len() <= MAX_SYNTAX_ERRORS && !syntax_errors.iter().any(touches) {
            self.errors.borrow_mut().push(byte_range, keyed(problem, key));
        }
    }

    /// Records a warning about a key.
    pub fn warning(&self, byte_range: &Range<usize>, key: &str, problem: Problem) {
        self.warnings.borrow_mut().push(byte_range, keyed(problem, key));
    }

    /// Records problems of another file that the bytes of this one refer to; they keep their own places.
    pub fn mistakes_elsewhere(&self, byte_range: &Range<usize>, problems: Vec<Problem>) {
        let mut errors = self.errors.borrow_mut();
        problems.into_iter().for_each(|problem| errors.push(byte_range, problem));
    }

    /// Records warnings about another file that the bytes of this one refer to.
    pub fn warnings_elsewhere(&self, byte_range: &Range<usize>, problems: Vec<Problem>) {
        let mut warnings = self.warnings.borrow_mut();
        problems.into_iter().for_each(|problem| warnings.push(byte_range, problem));
    }

    /// Whether any mistake was recorded.
    pub fn has_mistakes(&self) -> bool {
        self.errors.borrow().n_all > 0
    }

    /// The warnings in the order of the file, or else all mistakes in that order.
    ///
    /// # Errors
    /// When there was any mistake.
    pub fn finish(self) -> Result<Vec<Problem>, Error> {
        let Report { file, text, syntax_errors: _, errors, warnings } = self;
        let errors = located(&file, &text, errors.into_inner());
        if errors.is_empty() {
            Ok(located(&file, &text, warnings.into_inner()))
        } else {
            Err(Error { problems: errors })
        }
    }
}

fn keyed(mut problem: Problem, key: &str) -> Problem {
    problem.place.key = Some(key.to_owned()).filter(|key| !key.is_empty());
    problem
}

/// Sorts by place, keeps the first, and finds line and column.
fn located(file: &Path, text: &Arc<str>, entries: Entries) -> Vec<Problem> {
    let Entries { mut kept, n_all } = entries;
    kept.sort_by_key(|entry| entry.byte_range.start);
    // What is not told may be why a strict reader refuses the scene.
    let hides_defect = n_all > MAX_KEPT || kept.iter().skip(MAX_TOLD).any(|entry| entry.problem.is_defect);
    kept.truncate(MAX_TOLD);
    let n_left_out = n_all - kept.len();
    let mut problems: Vec<Problem> = kept
        .into_iter()
        .map(|Entry { byte_range, mut problem }| {
            if problem.place.file.is_none() {
                let key = problem.place.key.take();
                problem.place = Place { key, ..Place::span(Some(file), text, byte_range) };
            }
            problem
        })
        .collect();
    if n_left_out > 0 {
        let more = Problem::new(Place::file(file), format!("and {n_left_out} more like these"));
        problems.push(Problem { is_defect: hides_defect, ..more });
    }
    problems
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mistakes_come_in_the_order_of_the_file_whatever_order_they_were_found_in() {
        let report = Report::new("a.toml", "one\ntwo\nthree");
        report.mistake(&(8..13), "c", Problem::new(Place::default(), "third"));
        report.mistake(&(0..3), "a", Problem::new(Place::default(), "first"));
        let error = report.finish().unwrap_err();
        assert_eq!(error.to_string(), "a.toml:1:1: a: first\na.toml:3:1: c: third");
    }

    #[test]
    fn a_million_mistakes_are_told_as_fifty_and_a_count() {
        let report = Report::new("a.toml", "x");
        for _ in 0..1_000_000 {
            report.mistake(&(0..1), "a", Problem::new(Place::default(), "wrong"));
        }
        let error = report.finish().unwrap_err();
        assert_eq!(error.problems.len(), 51);
        assert_eq!(error.problems[50].what, "and 999950 more like these");
    }
}
