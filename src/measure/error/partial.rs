//! What a benchmark has measured so far, kept in a file so that an interrupted one can go on.
//!
//! A line is a JSON object: the key of a run, and the run. The last may be cut short. Runs of other benchmarks stay where they
//! are, and do no harm.

use std::collections::HashMap;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::figures::Figures;
use crate::error::Error;

/// One render and what it came to.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// Seconds of the render, or of the whole process.
    pub seconds: f64,
    /// Rays of all kinds, where they are known.
    pub rays: Option<u64>,
    /// Camera rays.
    pub camera_rays: Option<u64>,
    /// The error that the render estimates.
    pub rmse_estimate: Option<f64>,
    /// The error that it has.
    pub figures: Figures,
}

#[derive(Serialize, Deserialize)]
struct Line {
    key: String,
    run: Run,
}

/// Runs by key, and the file that they are added to.
#[derive(Debug, Default)]
pub struct Partial {
    file: Option<(PathBuf, File)>,
    known: HashMap<String, Run>,
    n_used: usize,
    n_added: usize,
}

impl Partial {
    /// Nothing is known, and nothing kept.
    pub fn none() -> Partial {
        Partial::default()
    }

    /// Opens a file, or begins one.
    ///
    /// # Errors
    /// When it can neither be read nor written.
    pub fn open(path: &Path) -> Result<Partial, Error> {
        let cannot = |error: &io::Error| Error::io(path, "keep runs in the file", error);
        let text = match fs::read(path) {
            Ok(bytes) => String::from_utf8_lossy(&bytes).into_owned(),
            Err(error) if error.kind() == io::ErrorKind::NotFound => String::new(),
            Err(error) => return Err(cannot(&error)),
        };
        let lines = text.lines().filter_map(|line| serde_json::from_str::<Line>(line).ok());
        let known = lines.map(|Line { key, run }| (key, run)).collect();
        let mut file = File::options().create(true).append(true).open(path).map_err(|error| cannot(&error))?;
        if !text.is_empty() && !text.ends_with('\n') {
            // Of a line that was cut short nothing more is to come.
            file.write_all(b"\n").map_err(|error| cannot(&error))?;
        }
        Ok(Partial { file: Some((path.to_owned(), file)), known, n_used: 0, n_added: 0 })
    }

    /// A run that is known already.
    pub fn take(&mut self, key: &str) -> Option<Run> {
        let run = self.known.get(key).copied();
        self.n_used += usize::from(run.is_some());
        run
    }

    /// Runs that were taken.
    pub fn n_used(&self) -> usize {
        self.n_used
    }

    /// Runs that were added.
    pub fn n_added(&self) -> usize {
        self.n_added
    }

    /// Keeps a run, at once.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn add(&mut self, key: String, run: Run) -> Result<(), Error> {
        self.n_added += 1;
        let Some((path, file)) = &mut self.file else { return Ok(()) };
        // Strings and numbers always serialise.
        let line = serde_json::to_string(&Line { key, run }).unwrap_or_default() + "\n";
        file.write_all(line.as_bytes()).map_err(|error| Error::io(path, "keep runs in the file", &error))
    }

    /// Removes the file once the report is written, unless it holds runs that were of no use here.
    pub fn remove(self) {
        if let Some((path, file)) = self.file
            && self.n_used >= self.known.len()
        {
            drop(file);
            // A file that stays does no harm.
            let _ = fs::remove_file(path);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(seconds: f64) -> Run {
        let figures = Figures { rmse: 0.375, ..Figures::default() };
        Run { seconds, rays: Some(7), camera_rays: None, rmse_estimate: None, figures }
    }

    #[test]
    fn runs_survive_and_a_line_that_was_cut_is_as_none() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.json.partial");
        let mut partial = Partial::open(&path).unwrap();
        partial.add("a".into(), run(0.125)).unwrap();
        partial.add("b".into(), run(0.75)).unwrap();
        let text = fs::read_to_string(&path).unwrap();
        fs::write(&path, &text[..text.len() - 9]).unwrap();

        let mut partial = Partial::open(&path).unwrap();
        assert_eq!((partial.take("a"), partial.take("b")), (Some(run(0.125)), None));
        partial.add("b".into(), run(0.5)).unwrap();
        let mut again = Partial::open(&path).unwrap();
        assert_eq!((again.take("a"), again.take("b"), again.n_used()), (Some(run(0.125)), Some(run(0.5)), 2));
        again.remove();
        assert!(!path.exists());
    }

    #[test]
    fn a_file_with_runs_of_other_benchmarks_stays() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a");
        Partial::open(&path).unwrap().add("other".into(), run(1.0)).unwrap();
        Partial::open(&path).unwrap().remove();
        assert!(path.exists());
    }
}
