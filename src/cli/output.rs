//! Which files a render will write, settled and checked before it starts.

use std::path::{Path, PathBuf};

use clap::error::ErrorKind;

use super::args::RenderArgs;
use super::failure::Failure;
use super::plan::Plan;
use super::{files, heatmap, terminal};
use crate::error::Error;
use crate::film::exr::ExrAttributes;
use crate::film::output::Format;
use crate::film::{EncodeOptions, Encoder, Film};

/// The stem of the files of the built-in scene.
const BUILT_IN_STEM: &str = "flatray";

/// An image to be written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Output {
    /// Its format.
    pub format: Format,
    /// Where it goes, as the user named it.
    pub path: PathBuf,
}

/// An image in the making.
#[derive(Debug)]
pub struct Image {
    /// What becomes of the film.
    pub encoder: Encoder,
    /// Where it goes, as the user named it.
    pub path: PathBuf,
}

/// Encoders for the outputs of a film that is still to be rendered, which take its rows as they are finished. None for a crop
/// that is padded in the end: its rows are not those of the files.
///
/// # Errors
/// An image that one of the formats cannot hold.
pub fn early_encoders(
    outputs: &[Output],
    film: &Film,
    plan: &Plan,
    exr_attributes: &ExrAttributes,
) -> Result<Vec<Image>, Error> {
    if plan.pads_crop { Ok(Vec::new()) } else { encoders(outputs, film, plan, exr_attributes) }
}

/// Adds what only the end of a render brings: zeros around a crop that is padded, and the time if it is asked for.
///
/// # Errors
/// As [`early_encoders`].
pub fn complete(
    outputs: &[Output],
    film: &mut Film,
    plan: &Plan,
    exr_attributes: &ExrAttributes,
    images: &mut Vec<Image>,
    trace_seconds: f64,
) -> Result<(), Error> {
    if plan.pads_crop {
        *film = film.padded();
        *images = encoders(outputs, film, plan, exr_attributes)?;
    }
    if plan.exr.time {
        images.iter_mut().for_each(|image| image.encoder.set_render_seconds(trace_seconds as f32));
    }
    Ok(())
}

fn encoders(outputs: &[Output], film: &Film, plan: &Plan, exr_attributes: &ExrAttributes) -> Result<Vec<Image>, Error> {
    let options =
        EncodeOptions { display: plan.display, exr: plan.exr.options, exr_attributes: exr_attributes.clone() };
    let image = |Output { format, path }: &Output| match Encoder::new(*format, film, &options) {
        Ok(encoder) => Ok(Image { encoder, path: path.clone() }),
        Err(error) => Err(Error::io(path, "write the file", &error)),
    };
    outputs.iter().map(image).collect()
}

/// Whether an EXR is among the images that the arguments ask for.
pub fn writes_exr(args: &RenderArgs) -> bool {
    args.outputs.is_empty() || args.outputs.iter().any(|path| Format::of_path(path) == Ok(Format::Exr))
}

/// The images that the arguments ask for.
///
/// # Errors
/// Wrong usage: an unknown extension, two files of one path, the input as an output. Error: a place where no file can
/// be made.
pub fn resolve(args: &RenderArgs) -> Result<Vec<Output>, Failure> {
    let paths = if args.outputs.is_empty() { default_paths(args.input.as_deref()) } else { args.outputs.clone() };
    let outputs: Vec<Output> = paths.into_iter().map(output_of).collect::<Result<_, _>>()?;

    let heatmap = heatmap::path_of(args.aov.heatmap, &outputs);
    let images = outputs.iter().map(|output| output.path.as_path());
    let written: Vec<&Path> = images.chain(args.stats.as_deref()).chain(heatmap.as_deref()).collect();
    for (index, path) in written.iter().enumerate() {
        let same = |other: &Path| is_same_file(other, path);
        if written[..index].iter().any(|other| same(other)) {
            return Err(usage(format!("'{}' is named twice as an output", terminal::shown(path))));
        }
        if args.input.as_deref().is_some_and(same) {
            return Err(usage(format!("'{}' is the input: writing it would destroy it", terminal::shown(path))));
        }
    }
    for path in written {
        files::check_writable(path)?;
    }
    Ok(outputs)
}

fn usage(message: String) -> Failure {
    Failure::usage("render", ErrorKind::ValueValidation, message)
}

fn output_of(path: PathBuf) -> Result<Output, Failure> {
    match Format::of_path(&path) {
        Ok(format) => Ok(Output { format, path }),
        Err(error) => Err(usage(error.to_string())),
    }
}

/// STEM.exr and STEM.png in the current directory.
fn default_paths(input: Option<&Path>) -> Vec<PathBuf> {
    let stem = input.map_or_else(|| BUILT_IN_STEM.into(), stem_of);
    ["exr", "png"].into_iter().map(|extension| PathBuf::from(format!("{stem}.{extension}"))).collect()
}

/// The file name without `.gz` and without the extension before it.
fn stem_of(input: &Path) -> String {
    let is_gz = input.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("gz"));
    let unpacked = if is_gz { input.with_extension("") } else { input.to_path_buf() };
    unpacked.file_stem().map_or_else(|| BUILT_IN_STEM.into(), |stem| stem.to_string_lossy().into_owned())
}

/// Whether two paths name one file, by whatever spelling or link.
pub fn is_same_file(a: &Path, b: &Path) -> bool {
    identity(a) == identity(b)
}

/// What two spellings of one path have in common: the real file; where there is none, the real directory and the name in it.
fn identity(path: &Path) -> PathBuf {
    if let Ok(real) = path.canonicalize() {
        return real;
    }
    let parent = match path.parent() {
        Some(parent) if parent != Path::new("") => parent,
        _ => Path::new("."),
    };
    let directory = parent.canonicalize().unwrap_or_else(|_| parent.to_path_buf());
    directory.join(path.file_name().unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn default_outputs_are_named_after_the_input_and_stand_in_the_current_directory() {
        let cases = [
            (None, "flatray"),
            (Some("scenes/room.toml"), "room"),
            (Some("/data/dragon_vrip.ply.gz"), "dragon_vrip"),
            (Some("a.b.OBJ.GZ"), "a.b"),
            (Some("cube.stl"), "cube"),
        ];
        for (input, stem) in cases {
            let expected = [format!("{stem}.exr"), format!("{stem}.png")].map(PathBuf::from);
            assert_eq!(default_paths(input.map(Path::new)), expected, "{input:?}");
        }
    }

    #[test]
    fn two_spellings_of_a_path_are_one() {
        assert_eq!(identity(Path::new("x.png")), identity(Path::new("./x.png")));
        assert_ne!(identity(Path::new("x.png")), identity(Path::new("src/x.png")));
    }
}
