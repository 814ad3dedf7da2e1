//! Scenes in the Neutral File Format of the Standard Procedural Databases (E. Haines, "NFF: Neutral File Format",
//! version 3.9, 1996): a view, point lights, Phong fills, spheres, cones, polygons and patches, as words of text.
//!
//! ```text
//! bytes ─▶ words ─▶ read: Statements ─▶ build: World, Camera, Names
//! ```
//! `docs/SCENE_FORMAT.md` says what each statement becomes.

mod build;
mod cone;
mod read;
mod statement;
mod words;

use std::path::Path;

use super::source::Source;
use super::{Compiled, Overrides, compile};
use crate::error::Error;
use words::Words;

/// Reads and compiles an NFF file, plain or compressed.
///
/// # Errors
/// When the file cannot be read or a statement is wrong; the message names the line.
pub fn load(path: &Path, overrides: &Overrides) -> Result<Compiled, Error> {
    compile::check_overrides(overrides)?;
    compile_source(&Source::open(path)?, overrides)
}

/// Compiles an NFF text in memory, plain or compressed; `name` stands in messages.
///
/// # Errors
/// As [`load`].
pub fn from_bytes(name: &Path, bytes: Vec<u8>, overrides: &Overrides) -> Result<Compiled, Error> {
    compile::check_overrides(overrides)?;
    compile_source(&Source::from_bytes(name, bytes)?, overrides)
}

fn compile_source(source: &Source, overrides: &Overrides) -> Result<Compiled, Error> {
    let statements = read::read(source.bytes()).map_err(|finding| finding.into_problem(source));
    source.check_unchanged()?;
    let statements = statements?;
    build::build(statements, source, overrides)
}

/// Whether a text that begins like this is an NFF scene: whether there is a `v` with a line of a view behind it.
pub fn is_nff(head: &[u8]) -> bool {
    let mut words = Words::new(head);
    loop {
        match words.next().0 {
            b"" => return false,
            b"v" => {
                let keys: [&[u8]; 6] = [b"from", b"at", b"up", b"angle", b"hither", b"resolution"];
                return keys.contains(&words.peek());
            }
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests;
