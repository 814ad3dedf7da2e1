//! Where the command line meets the rooms that read and write files.

use std::io;
use std::path::Path;

use crate::error::Error;
use crate::film::output::{WriteSeek, write_file};
use crate::film::png_chunk::Transfer;
use crate::film::{ImageFile, png, read_image};
use crate::measure::difference;
use crate::measure::error_map::{MapKind, error_map};
use crate::scene::{self, Compiled, Overrides};

pub use crate::film::output::check_writable;
pub use crate::measure::difference::Difference;

/// The scene that is rendered when none is given.
const BUILT_IN_SCENE: &str = include_str!("../../scenes/default.toml");

/// Loads a scene or mesh file, or the built-in scene.
///
/// # Errors
/// Everything that is wrong with the file.
pub fn load(input: Option<&Path>, overrides: &Overrides) -> Result<Compiled, Error> {
    match input {
        Some(path) => scene::load(path, overrides),
        None => scene::load_text(BUILT_IN_SCENE, "built-in scene", None, overrides),
    }
}

/// A file to be written and what fills it.
pub type Writing<'a> = (&'a Path, Box<dyn Fn(&mut dyn WriteSeek) -> io::Result<()> + 'a>);

/// Writes files so that none takes its name before the last is complete: the first that fails leaves all old files as
/// they were.
///
/// # Errors
/// Of the first file that could not be written.
pub fn write_together(files: &[Writing]) -> Result<(), Error> {
    let Some(((path, write), rest)) = files.split_first() else { return Ok(()) };
    let mut failed = None;
    let written = write_file(path, |out| {
        write(out)?;
        out.flush()?;
        // This file stays beside its name until the closure returns; an error in here removes it.
        write_together(rest).map_err(|error| {
            failed = Some(error);
            io::Error::other("another file could not be written")
        })
    });
    failed.map_or(written, Err)
}

/// Compares two image files; with `linear`, PNGs are taken as linear whatever they say. `map` receives a picture of where they differ.
///
/// # Errors
/// Unreadable images, images of different sizes, an unwritable picture.
pub fn compare(a: &Path, b: &Path, linear: bool, map: Option<(&Path, MapKind)>) -> Result<Difference, Error> {
    let transfer = linear.then_some(Transfer::Linear);
    let read = |path: &Path| -> Result<ImageFile, Error> { read_image(path, transfer) };
    let (a, b) = (read(a)?, read(b)?);
    let figures = difference::compare_files(&a, &b)?;
    if let Some((path, kind)) = map {
        let picture = error_map(kind, &a.film, &b.film, difference::referred_of(&a, &b))?;
        write_file(path, |out| png::write(&picture, &kind.display(), out))?;
    }
    Ok(figures)
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    type Content = Box<dyn Fn(&mut dyn WriteSeek) -> io::Result<()>>;

    fn writes(text: &'static str) -> Content {
        Box::new(move |out| out.write_all(text.as_bytes()))
    }

    #[test]
    fn files_written_together_all_appear_or_none_does() {
        let directory = tempfile::tempdir().unwrap();
        let [a, b, c] = ["a", "b", "c"].map(|name| directory.path().join(name));
        write_together(&[(&a, writes("1")), (&b, writes("2"))]).unwrap();
        assert_eq!((fs::read_to_string(&a).unwrap(), fs::read_to_string(&b).unwrap()), ("1".into(), "2".into()));

        let fails: Content = Box::new(|_| Err(io::Error::other("disk full")));
        let error = write_together(&[(&a, writes("3")), (&c, writes("4")), (&b, fails)]).unwrap_err();
        assert!(error.to_string().contains("disk full"), "{error}");
        assert_eq!(error.problems[0].place.file.as_deref(), Some(b.as_path()));
        assert_eq!((fs::read_to_string(&a).unwrap(), fs::read_to_string(&b).unwrap()), ("1".into(), "2".into()));
        assert_eq!(fs::read_dir(directory.path()).unwrap().count(), 2, "nothing is left beside them");
    }
}
