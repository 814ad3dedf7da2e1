//! Where the command line meets the rooms that read and write files.

use std::path::Path;

use crate::error::{Error, Place};
use crate::film::Film;
use crate::scene::{self, Compiled, Overrides};

use super::diff::Figures;
use super::output::ImageKind;

/// The scene that is rendered when none is given.
const BUILT_IN_SCENE: &str = include_str!("../../scenes/default.toml");

/// How PNGs are made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PngLook {
    /// Exposure in stops.
    pub exposure_ev: f64,
    /// The original's linear bytes instead of tone curve and transfer.
    pub course: bool,
}

/// Loads a scene or mesh file, or the built-in scene.
///
/// # Errors
/// Everything that is wrong with the file.
pub fn load(input: Option<&Path>, overrides: &Overrides) -> Result<Compiled, Error> {
    match input {
        Some(path) => scene::load(path, overrides),
        None => Err(Error::new(Place::default(), format!("not built yet: load_text of {}", BUILT_IN_SCENE.len()))),
    }
}

/// Finds out early whether a file can be made at a path.
///
/// # Errors
/// When it cannot.
pub fn check_writable(path: &Path) -> Result<(), Error> {
    if path.is_dir() {
        return Err(Error::new(Place::file(path), "cannot write a file here: it is a directory"));
    }
    let directory = path.parent().filter(|parent| *parent != Path::new("")).unwrap_or(Path::new("."));
    tempfile::Builder::new()
        .prefix(".flatray-")
        .tempfile_in(directory)
        .map(drop)
        .map_err(|error| Error::io(path, "write here", &error))
}

/// Writes an image beside its path and renames it.
///
/// # Errors
/// When the file cannot be written whole.
pub fn write_image(film: &Film, kind: ImageKind, look: &PngLook, path: &Path) -> Result<(), Error> {
    let _ = (film, kind, look);
    Err(Error::new(Place::file(path), "not built yet"))
}

/// Writes a text file beside its path and renames it.
///
/// # Errors
/// When the file cannot be written whole.
pub fn write_text(text: &str, path: &Path) -> Result<(), Error> {
    let _ = text;
    Err(Error::new(Place::file(path), "not built yet"))
}

/// Compares two images; `out` receives a picture of the differences.
///
/// # Errors
/// Unreadable images, images of different sizes, an unwritable picture.
pub fn compare(a: &Path, b: &Path, linear: bool, out: Option<&Path>) -> Result<Figures, Error> {
    let _ = (b, linear, out);
    Err(Error::new(Place::file(a), "not built yet"))
}
