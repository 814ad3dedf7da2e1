//! `flatray tonemap`: the PNG of a scene-linear image, as a render would have written it.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use clap::Args;
use clap::error::ErrorKind;

use super::failure::Failure;
use super::picture_args::{self, PictureArgs};
use super::{files, output, terminal};
use crate::error::{Error, Place, Problem};
use crate::film::output::{Format, write_file};
use crate::film::{Display, png, read_image};
use crate::scene::RenderKeys;

const EXAMPLES: &str = "\
Examples:
  flatray tonemap render.exr picture.png
  flatray tonemap render.exr picture.png --tonemap agx-approx --exposure 1.5
  flatray tonemap render.exr graded.png --tonemap reinhard --white-point 8 --png-bits 16

The PNG is the one that a render with these options writes beside its float EXR, byte for byte.

Exit codes: 0 success, 1 failure, 2 wrong usage.";

/// Arguments of `flatray tonemap`.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub struct TonemapArgs {
    /// A scene-linear image, .exr or .pfm
    pub input: PathBuf,
    /// The picture to write
    #[arg(value_name = "OUT.png")]
    pub output: PathBuf,
    #[command(flatten)]
    pub picture: PictureArgs,
}

/// Runs the command.
///
/// # Errors
/// Wrong usage, an image that cannot be read or is no radiance, an unwritable place.
pub fn run(args: &TonemapArgs) -> Result<(), Failure> {
    let TonemapArgs { input, output, picture } = args;
    let usage = |message: String| Failure::usage("tonemap", ErrorKind::ValueValidation, message);
    if Format::of_path(output) != Ok(Format::Png) {
        let shown = terminal::shown(output);
        return Err(usage(format!("unknown kind of output '{shown}': expected a name that ends in .png")));
    }
    if output::is_same_file(input, output) {
        let shown = terminal::shown(output);
        return Err(usage(format!("'{shown}' is the input: writing it would destroy it")));
    }
    let picture = picture_args::settle(picture, &RenderKeys::default(), "tonemap")?;
    files::check_writable(output)?;
    refuse_png(input)?;
    let film = read_image(input, None)?.film;
    write_file(output, |out| png::write(&film, &Display::Picture(picture), out))?;
    Ok(())
}

/// A PNG has been through a tone curve already.
fn refuse_png(path: &Path) -> Result<(), Error> {
    let mut start = Vec::new();
    let opened = File::open(path).map_err(|error| Error::io(path, "read the image", &error))?;
    // What is no regular file is refused by the reader; a pipe must not be read here.
    if opened.metadata().is_ok_and(|metadata| metadata.is_file()) {
        let n_bytes = png::SIGNATURE.len() as u64;
        opened.take(n_bytes).read_to_end(&mut start).map_err(|error| Error::io(path, "read the image", &error))?;
    }
    if start == png::SIGNATURE {
        let problem = Problem::new(Place::file(path), "not a scene-linear image");
        return Err(problem.found("a PNG").expected("an EXR or PFM file").into());
    }
    Ok(())
}
