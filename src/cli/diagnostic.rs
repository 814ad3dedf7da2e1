//! Problems as a user sees them: file, line and column, the line itself with a mark under the place, what was found,
//! what was expected, and advice. The only importer of annotate-snippets.

use std::ops::Range;

use annotate_snippets::{AnnotationKind, Group, Level, Padding, Renderer, Snippet};

use super::terminal;
use crate::error::{Error, Problem};

/// The widest message; of a longer source line the renderer shows the part around the mark.
const WIDTH_CHARS: usize = 120;
/// A line longer than this is no text anybody wrote: the problem is told without it.
const MAX_LINE_BYTES: usize = 64 << 10;
/// Problems shown of one error; a file that is wrong throughout must not flood the terminal.
const MAX_SHOWN: usize = 20;

/// The problems of an error one after another, with a count when there is more than one.
pub fn errors(error: &Error, outcome: &str, coloured: bool) -> String {
    let mut text = list(&error.problems, Level::ERROR, coloured);
    if error.problems.len() > 1 {
        text.push_str(&format!("{} errors: {outcome}\n", error.problems.len()));
    }
    text
}

/// Warnings one after another.
pub fn warnings(problems: &[Problem], coloured: bool) -> String {
    list(problems, Level::WARNING, coloured)
}

fn list(problems: &[Problem], level: Level<'static>, coloured: bool) -> String {
    let renderer = if coloured { Renderer::styled() } else { Renderer::plain() }.term_width(WIDTH_CHARS);
    let mut text = String::new();
    for problem in problems.iter().take(MAX_SHOWN) {
        text.push_str(&one(problem, level.clone(), &renderer));
        text.push('\n');
    }
    if problems.len() > MAX_SHOWN {
        text.push_str(&format!("… and {} more\n", problems.len() - MAX_SHOWN));
    }
    text
}

fn one(problem: &Problem, level: Level<'static>, renderer: &Renderer) -> String {
    let Some(excerpt) = Excerpt::of(problem) else {
        return renderer.render(&[Group::with_title(level.primary_title(problem.to_string()))]);
    };
    let title = match &problem.place.key {
        Some(key) => format!("{key}: {}", problem.what),
        None => problem.what.clone(),
    };
    let path = problem.place.file.as_deref().map_or_else(|| "built-in scene".to_owned(), terminal::shown);
    let snippet = Snippet::source(excerpt.line)
        .path(path)
        .line_start(excerpt.line_number)
        .fold(false)
        .annotation(AnnotationKind::Primary.span(excerpt.mark));
    let notes = [("found", &problem.found), ("expected", &problem.expected), ("help", &problem.help)]
        .into_iter()
        .filter_map(|(name, text)| text.as_ref().map(|text| (name, text.as_str())))
        .map(|(name, text)| Level::NOTE.with_name(name).message(annotate_snippets::normalize_untrusted_str(text)));
    let mut group = level.primary_title(title).element(snippet);
    if [&problem.found, &problem.expected, &problem.help].iter().any(|note| note.is_some()) {
        group = group.element(Padding).elements(notes);
    }
    renderer.render(&[group])
}

/// The line that a problem is about.
#[derive(Debug, PartialEq, Eq)]
struct Excerpt<'a> {
    line_number: usize,
    line: &'a str,
    /// Bytes of `line`.
    mark: Range<usize>,
}

impl Excerpt<'_> {
    /// `None` when the problem has no text, or none that can be shown.
    fn of(problem: &Problem) -> Option<Excerpt<'_>> {
        let place = &problem.place;
        let (text, range) = (place.text.as_deref()?, place.byte_range.clone()?);
        let start = floor_char_boundary(text, range.start);
        let line_start = text[..start].rfind('\n').map_or(0, |at| at + 1);
        let line = text[line_start..].split('\n').next().unwrap_or_default();
        let line = line.strip_suffix('\r').unwrap_or(line);

        // A span over several lines is marked to the end of its first.
        let mark_start = (start - line_start).min(line.len());
        let mark_end = floor_char_boundary(line, range.end.saturating_sub(line_start)).max(mark_start);
        let line_number = place.line.map_or(1, |line| line as usize);
        (line.len() <= MAX_LINE_BYTES).then_some(Excerpt { line_number, line, mark: mark_start..mark_end })
    }
}

/// The last boundary between characters at or before `index`.
fn floor_char_boundary(text: &str, index: usize) -> usize {
    (0..=index.min(text.len())).rev().find(|&at| text.is_char_boundary(at)).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use std::path::Path;
    use std::sync::Arc;

    use super::*;
    use crate::error::Place;

    fn problem_at(text: &str, range: Range<usize>) -> Problem {
        let text: Arc<str> = text.into();
        Problem::new(
            Place::span(Some(Path::new("scene.toml")), &text, range).with_key("hittable[0].radius"),
            "too small",
        )
        .found("-0.6")
        .expected("a number above 0")
        .help("leave it out for 1")
    }

    #[test]
    fn a_problem_shows_its_line_mark_found_expected_and_help() {
        let error = Error::from(problem_at("[a]\nradius = -0.6 # r\nb = 1\n", 13..17));
        assert_eq!(
            errors(&error, "nothing was rendered", false),
            "error: hittable[0].radius: too small\n \
             --> scene.toml:2:10\n  \
             |\n\
             2 | radius = -0.6 # r\n  \
             |          ^^^^\n  \
             |\n  \
             = found: -0.6\n  \
             = expected: a number above 0\n  \
             = help: leave it out for 1\n"
        );
    }

    #[test]
    fn several_problems_are_counted() {
        let text = "radius = -0.6\n";
        let error = Error { problems: vec![problem_at(text, 9..13), problem_at(text, 0..6)] };
        let shown = errors(&error, "nothing was rendered", false);
        assert_eq!(shown.matches("error: hittable[0].radius").count(), 2, "{shown}");
        assert!(shown.ends_with("2 errors: nothing was rendered\n"), "{shown}");
    }

    #[test]
    fn a_problem_without_text_is_one_line() {
        let problem = Problem::new(Place::byte("a.ply", 17), "the file ends early").found("3 bytes").expected("12");
        let shown = errors(&Error::from(problem), "", false);
        assert_eq!(shown, "error: a.ply: byte 17: the file ends early: found 3 bytes, expected 12\n");
    }

    #[test]
    fn a_long_line_is_shortened_around_its_mark() {
        let line = format!("{}é = -1 {}", "x".repeat(5000), "y".repeat(5000));
        let at = line.find("-1").unwrap();
        let shown = errors(&Error::from(problem_at(&line, at..at + 2)), "", false);
        assert!(shown.contains("scene.toml:1:5005") && shown.contains("^^") && shown.contains("-1"), "{shown}");
        assert!(shown.lines().all(|line| line.chars().count() <= 200), "{shown}");

        let endless = "x".repeat(MAX_LINE_BYTES + 1);
        let shown = errors(&Error::from(problem_at(&endless, 7..8)), "", false);
        assert!(shown.contains("scene.toml:1:8: hittable[0].radius: too small: found -0.6") && shown.len() < 300);
    }

    #[test]
    fn any_span_of_any_text_can_be_shown() {
        let texts = ["", "é", "a\r\nb", "\n\n", "x = 'ü\u{1b}[31m'\n", &"é".repeat(300)];
        for text in texts {
            for start in 0..text.len() + 2 {
                for end in start..text.len() + 3 {
                    let shown = errors(&Error::from(problem_at(text, start..end)), "", false);
                    assert!(!shown.contains('\u{1b}'), "{shown:?}");
                }
            }
        }
    }
}
