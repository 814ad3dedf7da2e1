//! `flatray merge`: crops of one frame to the file of the whole.

use std::path::{Path, PathBuf};

use clap::Args;
use clap::error::ErrorKind;

use super::failure::Failure;
use super::output::is_same_file;
use super::{files, terminal};
use crate::film::exr::merge::merge;
use crate::film::output::Format;

const EXAMPLES: &str = "\
Examples:
  flatray render scene.toml --crop 0,0,960,1080 -o left.exr
  flatray render scene.toml --crop 960,0,1920,1080 -o right.exr
  flatray merge whole.exr left.exr right.exr

The result is what a render of the whole frame writes, byte for byte (without the time that a render took). Files of
different renders, overlaps that differ in any bit, and gaps are refused. Nothing is written on failure.

Exit codes: 0 success, 1 failure, 2 wrong usage.";

/// Arguments of `flatray merge`.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub struct MergeArgs {
    /// The file to write: .exr
    pub out: PathBuf,
    /// The files to join: crops of one frame
    #[arg(required = true)]
    pub inputs: Vec<PathBuf>,
    /// Print nothing but errors
    #[arg(short, long)]
    pub quiet: bool,
}

/// Runs the command.
///
/// # Errors
/// Wrong usage; files that are not crops of one frame, or lack a part of it; an unwritable place.
pub fn run(args: &MergeArgs) -> Result<(), Failure> {
    let usage = |message: String| Failure::usage("merge", ErrorKind::ValueValidation, message);
    let shown = terminal::shown(&args.out);
    if Format::of_path(&args.out) != Ok(Format::Exr) {
        return Err(usage(format!("unknown kind of output '{shown}': expected a name that ends in .exr")));
    }
    if args.inputs.iter().any(|input| is_same_file(input, &args.out)) {
        return Err(usage(format!("'{shown}' is an input: writing it would destroy it")));
    }
    files::check_writable(&args.out)?;
    let inputs: Vec<&Path> = args.inputs.iter().map(PathBuf::as_path).collect();
    let merged = merge(&inputs)?;
    files::write_together(&[(args.out.as_path(), Box::new(|out| merged.write(out)))])?;
    if !args.quiet {
        let [width, height] = merged.size_px();
        let files = if inputs.len() == 1 { "1 file".to_owned() } else { format!("{} files", inputs.len()) };
        terminal::print(&format!("wrote   {shown}: {width}x{height} from {files}\n"))?;
    }
    Ok(())
}
