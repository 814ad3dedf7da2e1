//! `flatray bench error`: what to compare, on what, and where the figures go.

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::error::ErrorKind;
use clap::value_parser;
use serde_json::{Value, json};

use super::failure::Failure;
use super::files::{self, Writing};
use super::frame_args::FrameArgs;
use super::interrupt::Interrupt;
use super::progress::Progress;
use super::reference::{DEFAULT_SAMPLES, Loaded};
use super::watch::watched;
use super::{diagnostic, error_text, terminal, throughput_text};
use crate::error::{Error, Place, Problem};
use crate::measure::error::engine::{Engines, Program};
use crate::measure::error::page::{Section, page};
use crate::measure::error::partial::Partial;
use crate::measure::error::peer::{self, Peer};
use crate::measure::error::reference::{MAX_SAMPLES, Reference};
use crate::measure::error::setting::Way;
use crate::measure::error::settings_file::{self, Asked};
use crate::measure::error::{cache, grid, measure, pictures};
use crate::measure::povray::program;
use crate::measure::process::Ended;
use crate::render::Control;

const EXAMPLES: &str = "\
Examples:
  flatray bench error scene.toml
  flatray bench error scene.toml room.toml --json error.json --html error.html
  flatray bench error scene.toml --peer povray --repeats 5 --width 400 --height 300
  flatray bench error scene.toml --settings grid.toml --reference scene.ref.exr

Renders every setting several times in random order, each time with another seed, and compares with a reference: one that
`flatray reference` has made of this very frame, or one that is made now and kept in the cache.

--settings FILE (TOML) replaces what is compared. Each [[grid]] stands for all combinations of its lists: samples with sampler
(center, grid, jitter, random, sobol), error (adaptive samples), max_depth, cutoff, accel (bvh, linear), bvh (fast, medium,
high), isa. Each [[povray]]: grid (samples along an edge, method 1), threshold with depth (method 2).

Beside POV-Ray all times are those of whole processes, from start to end; what it cannot express is said. Without it they are
those of building the tree and rendering.

With --json, finished runs are kept in FILE.partial; the same command goes on from there after an interrupt.

Keys of --json: input, seconds, runs [{engine, setting, family, seconds, seconds_min, seconds_max, rays, samples_per_pixel,
rmse, rmse_min, rmse_max, below_floor, rmse_estimate, mae, relmse, max, p999, flip, ssim, wrong_ids, on_front}], floor,
least_rmse, reference_samples, hash, width, height, threads, repeats, whole_processes, judged_ids, time_to_rmse [{rmse, by,
seconds, setting}], rmse_at_time [{seconds, by, rmse}], slopes [{family, slope, n_points}], notes [text]. No rmse is below
least_rmse, three floors. Of several inputs: scenes [the same of each].

Exit codes: 0 success, 1 failure or a wrong id, 2 wrong usage, 130 interrupted.";

const DEFAULT_REPEATS: u32 = 3;

/// Arguments of `flatray bench error`.
#[derive(clap::Args, Clone, Debug)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Scenes or meshes as `flatray render` takes them; the built-in scene unless given
    pub inputs: Vec<PathBuf>,
    /// What to compare
    #[arg(long, value_name = "FILE.toml")]
    pub settings: Option<PathBuf>,
    /// What to compare with: a file of `flatray reference`, or auto [default: auto]
    #[arg(long, value_name = "FILE|auto")]
    pub reference: Option<PathBuf>,
    /// Samples per pixel of a reference that is made, at least [default: 4096]
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..=i64::from(MAX_SAMPLES)), conflicts_with = "reference")]
    pub reference_samples: Option<u32>,
    /// Where references are kept [default: flatray/references in the user's cache]
    #[arg(long, value_name = "DIR")]
    pub cache: Option<PathBuf>,
    /// How often each setting is rendered [default: 3]
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..=1000))]
    pub repeats: Option<u32>,
    /// Measure another renderer on the same frame: povray, or povray=PROGRAM
    #[arg(long, value_name = "PEER", value_parser = peer_of)]
    pub peer: Option<PeerArg>,
    /// Write the figures as JSON
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Write a page with plots and images
    #[arg(long, value_name = "FILE")]
    pub html: Option<PathBuf>,
    #[command(flatten)]
    pub frame: FrameArgs,
}

/// `--peer`
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PeerArg {
    /// The program.
    pub program: PathBuf,
}

fn peer_of(text: &str) -> Result<PeerArg, String> {
    match text.split_once('=') {
        None if text == "povray" => Ok(PeerArg { program: text.into() }),
        Some(("povray", path)) if !path.is_empty() => Ok(PeerArg { program: path.into() }),
        _ => Err("expected povray or povray=PROGRAM".to_owned()),
    }
}

/// What holds for all inputs.
struct Bench<'a> {
    args: &'a Args,
    asked: Option<Asked>,
    interrupt: Interrupt,
    program: Option<program::Program>,
    /// Why there is no peer, where one was asked for.
    absent: Option<Error>,
}

/// Runs the command.
///
/// # Errors
/// Wrong usage, bad input, an unwritable place, an interrupt, and above all a wrong id.
pub fn run(args: &Args) -> Result<(), Failure> {
    let usage = |message: &str| Err(Failure::usage("bench", ErrorKind::ArgumentConflict, message));
    let given = args.reference.as_deref().filter(|path| *path != Path::new("auto"));
    if given.is_some() && args.inputs.len() > 1 {
        return usage("a reference is of one scene: with several inputs leave out '--reference'");
    }
    args.json.iter().chain(&args.html).try_for_each(files::check_writable)?;
    let asked = args.settings.as_deref().map(settings_file::read).transpose()?;
    if args.peer.is_none() && asked.as_ref().is_some_and(|asked| asked.grids.is_empty()) {
        return usage("the settings are all POV-Ray's: '--peer povray' is needed");
    }
    let interrupt = Interrupt::listen()?;
    let (program, absent) = match args.peer.as_ref().map(|peer| program::Program::at(&peer.program)) {
        Some(Ok(program)) => (Some(program), None),
        Some(Err(error)) => (None, Some(error)),
        None => (None, None),
    };
    if let Some(error) = &absent {
        warn(error);
    }
    let bench = Bench { args, asked, interrupt, program, absent };
    let path = args.json.as_deref().map(partial_path);
    let mut partial = path.as_deref().map_or_else(|| Ok(Partial::none()), Partial::open)?;
    let inputs: Vec<Option<&Path>> = match args.inputs.as_slice() {
        [] => vec![None],
        inputs => inputs.iter().map(|input| Some(input.as_path())).collect(),
    };
    let (mut sections, mut scenes) = (Vec::new(), Vec::new());
    for input in inputs {
        match bench.one(input, &mut partial) {
            Ok((section, scene)) => {
                sections.push(section);
                scenes.push(scene);
            }
            Err(failure) => {
                if let Some(path) = path.filter(|_| partial.n_added() + partial.n_used() > 0) {
                    let n_runs = partial.n_added() + partial.n_used();
                    let shown = terminal::shown(&path);
                    terminal::print_error(&format!(
                        "{n_runs} runs are kept in {shown}: the same command goes on from there\n"
                    ));
                }
                return Err(failure);
            }
        }
    }
    write(args, &sections, scenes)?;
    partial.remove();
    let has_wrong = |section: &Section| section.report.rows.iter().any(|row| row.wrong_ids.is_some_and(|n| n > 0));
    match sections.iter().find(|section| has_wrong(section)) {
        None => Ok(()),
        Some(section) => {
            Err(Error::new(Place::default(), format!("{}: pixels show wrong primitives", section.title)).into())
        }
    }
}

/// Where finished runs are kept.
fn partial_path(json: &Path) -> PathBuf {
    let mut name = json.as_os_str().to_owned();
    name.push(".partial");
    name.into()
}

fn warn(error: &Error) {
    terminal::print_error(&diagnostic::warnings(&error.problems, terminal::stderr_is_coloured()));
}

/// What a stop or a failure of the library is to the command.
fn failure(ended: Ended) -> Failure {
    match ended {
        Ended::Stopped => Failure::Interrupted,
        Ended::Failed(error) => Failure::Error(error),
    }
}

impl Bench<'_> {
    /// Measures one scene.
    fn one(&self, input: Option<&Path>, partial: &mut Partial) -> Result<(Section, Value), Failure> {
        let started = Instant::now();
        let name = input.and_then(Path::file_name).map(Path::new);
        let title = name.map_or_else(|| "built-in scene".to_owned(), terminal::shown);
        let loaded = Loaded::new(input, &self.args.frame, None, None)?;
        let reference = self.reference(&loaded)?;
        let control = Control::default();
        let watched = |work: &mut dyn FnMut() -> Result<(Section, Value), Ended>| {
            watched(&self.interrupt, &control, Progress::start(0, true), work).map_err(failure)
        };
        watched(&mut || {
            let (mut engines, notes) = self.engines(input, &loaded, &reference, &control)?;
            let ways = self.ways(&loaded, engines.peer().is_some());
            let mut progress = |what: &str| terminal::print_error(&format!("{title}: {what}\n"));
            let repeats = self.args.repeats.unwrap_or(DEFAULT_REPEATS) as usize;
            let mut report = measure(&mut engines, &reference, &ways, repeats, partial, &control, &mut progress)?;
            report.notes.extend(notes);
            let shown = match self.args.html {
                Some(_) => pictures::take(&mut engines, &reference, &report, &control)?,
                None => Vec::new(),
            };
            let about = throughput_text::about(&loaded.scene.world);
            terminal::print(&(error_text::tables(&title, &about, &report) + "\n"))?;
            let mut scene = report.to_json();
            scene["input"] = input.map_or_else(|| title.clone(), terminal::shown).into();
            scene["seconds"] = started.elapsed().as_secs_f64().into();
            Ok((Section { title: title.clone(), about, report, shown }, scene))
        })
    }

    /// The reference that is given, or in the cache, or made.
    fn reference(&self, loaded: &Loaded) -> Result<Reference, Failure> {
        let frame = loaded.frame();
        if let Some(path) = self.args.reference.as_deref().filter(|path| *path != Path::new("auto")) {
            let reference = Reference::read(path)?;
            reference.check(&frame, path)?;
            return Ok(reference);
        }
        let asked = self.args.reference_samples.unwrap_or(DEFAULT_SAMPLES);
        let samples = crate::measure::error::reference::rounded_samples(asked);
        let variable = |name: &str| std::env::var_os(name).map(PathBuf::from);
        let folder = self.args.cache.clone().or_else(|| cache::default_folder(variable));
        let path = folder.map(|folder| cache::file_of(&folder, &frame.hash(), samples));
        if let Some(reference) = path.as_deref().and_then(|path| cache::find(path, &frame.hash())) {
            return Ok(reference);
        }
        terminal::print_error(&format!("making a reference of {samples} samples per pixel and more\n"));
        let reference = loaded.reference(samples, false, &self.interrupt)?;
        match path.map(|path| cache::keep(&path, &reference)) {
            // A folder that was asked for must do; the default one need not.
            Some(Err(error)) if self.args.cache.is_some() => Err(error.into()),
            Some(Err(error)) => {
                warn(&error);
                Ok(reference)
            }
            Some(Ok(())) | None => Ok(reference),
        }
    }

    /// This process, or whole processes beside a peer whose pixels agree; and what is to be said about that.
    fn engines<'s>(
        &self,
        input: Option<&Path>,
        loaded: &'s Loaded,
        reference: &Reference,
        control: &Control,
    ) -> Result<(Engines<'s>, Vec<String>), Ended> {
        let frame = loaded.frame();
        if self.args.peer.is_none() {
            return Ok((Engines::new(frame, None, None)?, Vec::new()));
        }
        let path = std::env::current_exe()
            .map_err(|error| Error::new(Place::default(), format!("cannot find this program's file: {error}")))?;
        let whole = || Program { path: path.clone(), arguments: self.args.frame.words(input, frame.settings.threads) };
        let without = |why: &str| -> Result<(Engines<'s>, Vec<String>), Ended> {
            Ok((Engines::new(frame, Some(whole()), None)?, vec![format!("measured without POV-Ray: {why}")]))
        };
        let Some(program) = &self.program else {
            return without(&self.absent.as_ref().map_or_else(String::new, Error::to_string));
        };
        let peer = match Peer::new(program.clone(), &frame, reference) {
            Ok(peer) => peer,
            Err(error) => {
                warn(&error);
                return without(&error.to_string());
            }
        };
        let mut engines = Engines::new(frame, Some(whole()), Some(peer))?;
        let agreement = peer::agreement(&mut engines, control)?;
        let pixels =
            format!("{} of {} pixels differ by more than a thousandth of white", agreement.far, agreement.n_pixels);
        if !agreement.holds() {
            let problem = Problem::new(Place::default(), "POV-Ray shows another picture, and its times mean nothing");
            let error = Error::from(problem.found(format!("of samples in the centres of pixels {pixels}")));
            warn(&error);
            return without(&error.to_string());
        }
        let mut notes = Vec::new();
        if let Some(peer) = engines.peer() {
            notes.push(format!("POV-Ray {}; of samples in the centres of pixels {pixels}", peer.version()));
            let (start, rounding) = (peer.start_seconds(control)?, peer.rounding());
            notes.push(format!("POV-Ray takes {start:.3} s for one pixel of this scene: to start, to read it, to end"));
            notes.push(format!("POV-Ray's pictures are rounded by {rounding:.1e} at most"));
        }
        Ok((engines, notes))
    }

    fn ways(&self, loaded: &Loaded, has_peer: bool) -> Vec<Way> {
        let settings = &loaded.plan.settings;
        let (grids, antialiasing) = match &self.asked {
            Some(asked) => (asked.grids.clone(), asked.antialiasing.clone()),
            None => {
                (grid::default_grids(loaded.scene.world.n_prims(), settings.max_depth), grid::default_antialiasing())
            }
        };
        grid::ways(&grids, if has_peer { &antialiasing } else { &[] })
    }
}

fn write(args: &Args, sections: &[Section], mut scenes: Vec<Value>) -> Result<(), Failure> {
    let json = match scenes.len() {
        1 => scenes.remove(0),
        _ => json!({ "scenes": scenes }),
    };
    // Keys and numbers always serialise; the fallback is never taken.
    let json = serde_json::to_string_pretty(&json).unwrap_or_default() + "\n";
    let mut writings: Vec<Writing> = Vec::new();
    if let Some(path) = &args.json {
        writings.push((path, Box::new(|out| out.write_all(json.as_bytes()))));
    }
    if let Some(path) = &args.html {
        let page = page(sections);
        writings.push((path, Box::new(move |out| out.write_all(page.as_bytes()))));
    }
    Ok(files::write_together(&writings)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_peer_is_povray_with_or_without_a_program() {
        assert_eq!(peer_of("povray"), Ok(PeerArg { program: "povray".into() }));
        assert_eq!(peer_of("povray=/a/b"), Ok(PeerArg { program: "/a/b".into() }));
        for wrong in ["", "povray=", "mitsuba", "embree=/a"] {
            assert!(peer_of(wrong).unwrap_err().contains("povray"), "{wrong}");
        }
    }

    #[test]
    fn runs_are_kept_beside_the_figures() {
        assert_eq!(partial_path(Path::new("a/b.json")), Path::new("a/b.json.partial"));
    }
}
