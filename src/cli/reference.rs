//! `flatray reference`: an image that others are judged by.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::error::ErrorKind;
use clap::value_parser;

use super::args::{AccelArg, BvhArg};
use super::failure::Failure;
use super::files;
use super::frame_args::FrameArgs;
use super::interrupt::Interrupt;
use super::memory::Need;
use super::plan::{self, Plan};
use super::progress::Progress;
use super::watch::watched;
use super::{diagnostic, quantity, terminal};
use crate::accel::Accel;
use crate::error::{Error, Place};
use crate::film::output::Format;
use crate::measure::error::frame::Frame;
use crate::measure::error::reference::{self, MAX_SAMPLES, Reference};
use crate::render::{self, Adaptive, Control, Settings, Spread};
use crate::scene::{Compiled, machine};

const EXAMPLES: &str = "\
Examples:
  flatray reference scene.toml -o scene.ref.exr
  flatray reference dragon.ply.gz -o dragon.ref.exr --width 400 --height 300 --samples 1024

Two independent renders with half of the samples each: the file holds their mean as R, G, B, and them as layers a and b, in
32-bit floats. Samples are stratified; pixels that edges, shadows or their mirror images cross get more, along these. Every hit
decision is exact, and rays are left out only when they change a sample by less than 1e-9.

The floor, half of the root mean square difference of the two, estimates the error of the mean. The header has it as
flatray/referenceFloor, and as flatray/referenceHash a hash of all that decides the image: world, camera, depth, filter.
`flatray bench error --reference` wants a file whose hash is that of its scene.

Exit codes: 0 success, 1 failure, 2 wrong usage, 130 interrupted.";

/// Samples unless said.
pub const DEFAULT_SAMPLES: u32 = 4096;

/// Arguments of `flatray reference`.
#[derive(clap::Args, Clone, Debug)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// A scene or a mesh as `flatray render` takes it; the built-in scene unless given
    pub input: Option<PathBuf>,
    /// The file to write
    #[arg(short, long, value_name = "FILE.exr")]
    pub output: PathBuf,
    /// Samples per pixel, at least [default: 4096]
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..=i64::from(MAX_SAMPLES)))]
    pub samples: Option<u32>,
    /// How hits are found; both give the same bits [default: bvh]
    #[arg(long, value_name = "KIND")]
    pub accel: Option<AccelArg>,
    /// What to spend on the tree [default: medium]
    #[arg(long, value_name = "PRESET")]
    pub bvh: Option<BvhArg>,
    /// Print nothing but errors
    #[arg(short, long)]
    pub quiet: bool,
    #[command(flatten)]
    pub frame: FrameArgs,
}

/// A scene, and how it is to be rendered.
pub struct Loaded {
    /// The scene.
    pub scene: Compiled,
    /// What all renders have in common.
    pub plan: Plan,
}

impl Loaded {
    /// Loads a scene and settles the frame.
    ///
    /// # Errors
    /// Wrong usage, bad input, too little memory.
    pub fn new(
        input: Option<&Path>,
        frame: &FrameArgs,
        accel: Option<AccelArg>,
        bvh: Option<BvhArg>,
    ) -> Result<Loaded, Failure> {
        let args = super::args::RenderArgs { accel, bvh, ..frame.render_args(input) };
        plan::check(&args)?;
        let scene = files::load(input, &plan::overrides(&args))?;
        if !scene.warnings.is_empty() {
            terminal::print_error(&diagnostic::warnings(&scene.warnings, terminal::stderr_is_coloured()));
        }
        let mut plan = plan::settle(&args, &scene)?;
        // What a scene asks for beside the picture has no part in this.
        plan.settings.aovs = Default::default();
        Need::of(&scene.world, &scene.camera, &plan, &[]).check(machine::available_bytes())?;
        Ok(Loaded { scene, plan })
    }

    /// The frame.
    pub fn frame(&self) -> Frame<'_> {
        Frame { world: &self.scene.world, camera: &self.scene.camera, settings: &self.plan.settings }
    }

    /// Builds, and renders a reference.
    ///
    /// # Errors
    /// An interrupt, no threads.
    pub fn reference(&self, samples: u32, quiet: bool, interrupt: &Interrupt) -> Result<Reference, Failure> {
        let frame = self.frame();
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(frame.settings.threads)
            .build()
            .map_err(|error| Error::new(Place::default(), format!("cannot start the worker threads: {error}")))?;
        let accel = pool.install(|| Accel::build_with(frame.world, self.plan.accel, self.plan.preset));
        drop(pool);
        let control = Control::default();
        let spread = Spread::Adaptive(Adaptive::new(1.0));
        let n_tiles = 2 * render::n_tiles(&Settings { spread, ..frame.settings.clone() });
        let made = watched(interrupt, &control, Progress::start(n_tiles, quiet), || {
            reference::make(&frame, &accel, samples, &control)
        });
        made.map_err(|render::Stopped| Failure::Interrupted)
    }
}

/// Runs the command.
///
/// # Errors
/// Wrong usage, bad input, an unwritable place, an interrupt.
pub fn run(args: &Args) -> Result<(), Failure> {
    let started = Instant::now();
    if Format::of_path(&args.output) != Ok(Format::Exr) {
        let shown = terminal::shown(&args.output);
        let message = format!("a reference is an EXR file: '{shown}' does not end in .exr");
        return Err(Failure::usage("reference", ErrorKind::ValueValidation, message));
    }
    if args.input.as_deref().is_some_and(|input| super::output::is_same_file(input, &args.output)) {
        let message = format!("'{}' is the input: writing it would destroy it", terminal::shown(&args.output));
        return Err(Failure::usage("reference", ErrorKind::ValueValidation, message));
    }
    files::check_writable(&args.output)?;
    let interrupt = Interrupt::listen()?;
    let loaded = Loaded::new(args.input.as_deref(), &args.frame, args.accel, args.bvh)?;
    let samples = args.samples.unwrap_or(DEFAULT_SAMPLES);
    let reference = loaded.reference(samples, args.quiet, &interrupt)?;
    files::write_together(&[(&args.output, Box::new(|out| reference.write(out)))])?;
    if !args.quiet {
        let text = format!(
            "{}\nsamples {} per pixel and more\nfloor   {:.2e} root mean square; no error below {:.2e} is told\nhash    {}\ntime    {}\n",
            terminal::shown(args.output.file_name().map_or(args.output.as_path(), |name: &OsStr| Path::new(name))),
            reference.samples,
            reference.floor,
            reference.least(),
            reference.hash,
            quantity::seconds(started.elapsed().as_secs_f64()),
        );
        terminal::print(&text)?;
    }
    Ok(())
}
