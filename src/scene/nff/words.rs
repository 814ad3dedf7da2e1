//! The words of an NFF text: what stands between blanks, comments left out.

use super::super::mesh::finding::{At, Finding, Outcome, quoted};
use super::super::mesh::number::{is_blank, is_line_end, parse_f64};
use super::super::validate::NumberRule;
use glam::DVec3;

/// A reader of words over a text in any encoding that keeps ASCII.
#[derive(Clone, Debug, Default)]
pub(super) struct Words<'a> {
    bytes: &'a [u8],
    /// Where the next word is looked for.
    at: usize,
    /// The form of the statement that is being read, for messages.
    form: &'static str,
}

impl<'a> Words<'a> {
    pub fn new(bytes: &'a [u8]) -> Words<'a> {
        Words { bytes, at: 0, form: "" }
    }

    /// Says what is read from here on, in the form that messages show.
    pub fn begin(&mut self, form: &'static str) {
        self.form = form;
    }

    /// Moves to the next word and returns it without taking it; empty at the end of the text. A comment begins with `#`,
    /// also inside of a word, and runs to the end of the line.
    pub fn peek(&mut self) -> &'a [u8] {
        while let Some(&byte) = self.bytes.get(self.at) {
            if byte == b'#' {
                let rest = &self.bytes[self.at..];
                self.at += rest.iter().position(|&b| is_line_end(b)).unwrap_or(rest.len());
            } else if is_blank(byte) {
                self.at += 1;
            } else {
                break;
            }
        }
        let rest = &self.bytes[self.at..];
        &rest[..rest.iter().position(|&b| is_blank(b) || b == b'#').unwrap_or(rest.len())]
    }

    /// Takes the next word and says where it stands.
    pub fn next(&mut self) -> (&'a [u8], At) {
        let word = self.peek();
        let at = At::Line(self.at);
        self.at += word.len();
        (word, at)
    }

    /// Whether the next word is a number, `nan` and `inf` among them.
    pub fn number_follows(&mut self) -> bool {
        number(self.peek()).is_some()
    }

    /// The next word as a number, which may be NaN or infinite.
    pub fn number(&mut self) -> Outcome<f64> {
        let (word, at) = self.next();
        number(word).ok_or_else(|| {
            Finding::new(at, "a number is missing")
                .found(shown(word))
                .expected(format!("a number, as in `{}`", self.form))
                .into()
        })
    }

    /// So many numbers, which may be NaN or infinite.
    pub fn numbers<const N: usize>(&mut self) -> Outcome<[f64; N]> {
        let mut numbers = [0.0; N];
        for number in &mut numbers {
            *number = self.number()?;
        }
        Ok(numbers)
    }

    /// Three numbers.
    pub fn vector(&mut self) -> Outcome<DVec3> {
        Ok(DVec3::from_array(self.numbers()?))
    }

    /// The next word as a number that must fulfil a rule; `what` it is, for messages.
    pub fn ruled(&mut self, what: &str, rule: &NumberRule) -> Outcome<f64> {
        let word = self.peek();
        let at = At::Line(self.at);
        let number = self.number()?;
        if number.is_finite() && (rule.holds)(number) {
            return Ok(number);
        }
        let problem = Finding::new(at, format!("{what} is out of range"));
        Err(problem.found(quoted(word)).expected(rule.expected).into())
    }

    /// Three numbers that must fulfil a rule.
    pub fn ruled_vector(&mut self, what: &str, rule: &NumberRule) -> Outcome<DVec3> {
        Ok(DVec3::new(self.ruled(what, rule)?, self.ruled(what, rule)?, self.ruled(what, rule)?))
    }

    /// The next word as a whole number from a range, which `expected` puts into words.
    pub fn whole(&mut self, range: std::ops::RangeInclusive<u64>, expected: &str) -> Outcome<u64> {
        let (word, at) = self.next();
        let number = std::str::from_utf8(word).ok().and_then(|word| word.parse::<u64>().ok());
        number.filter(|number| range.contains(number)).ok_or_else(|| {
            let problem = Finding::new(at, "a whole number is missing or out of range").found(shown(word));
            problem.expected(format!("{expected}, as in `{}`", self.form)).into()
        })
    }
}

fn number(word: &[u8]) -> Option<f64> {
    parse_f64(word, 0).filter(|&(_, end)| end == word.len()).map(|(number, _)| number)
}

/// A word as messages show it.
pub(super) fn shown(word: &[u8]) -> String {
    if word.is_empty() { "the end of the file".to_owned() } else { quoted(word) }
}
