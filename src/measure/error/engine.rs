//! What renders a frame in one way, and says how long it took.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use serde_json::Value;
use tempfile::TempDir;

use super::frame::Frame;
use super::peer::Peer;
use super::setting::{Amount, Setting, Way};
use crate::accel::{Accel, AccelKind, Mode, Preset};
use crate::error::{Error, Place};
use crate::film::{Film, read_image};
use crate::measure::process::{Ended, run};
use crate::measure::throughput::report::Spread;
use crate::render::{self, Control, Counts};
use crate::simd::Isa;

/// An image and what it took.
#[derive(Clone, Debug)]
pub struct Shot {
    /// `R`, `G`, `B`.
    pub film: Film,
    /// Seconds of the render, or of the whole process.
    pub seconds: f64,
    /// Rays of all kinds, where the engine tells.
    pub rays: Option<u64>,
    /// Camera rays.
    pub camera_rays: Option<u64>,
    /// What the engine estimates.
    pub rmse_estimate: Option<f64>,
}

/// A tree, and how long it takes to build.
struct Tree {
    kind: AccelKind,
    preset: Preset,
    accel: Accel,
    build_seconds: f64,
}

/// How flatray is run as a whole process.
#[derive(Clone, Debug)]
pub struct Program {
    /// Its file.
    pub path: PathBuf,
    /// What every render is told: the input, the size and the like.
    pub arguments: Vec<OsString>,
}

/// Everything that renders one frame.
pub struct Engines<'a> {
    /// What is rendered.
    pub frame: Frame<'a>,
    trees: Vec<Tree>,
    pool: rayon::ThreadPool,
    whole: Option<(Program, TempDir)>,
    peer: Option<Peer>,
}

/// How often a tree is built for its time.
const BUILDS: usize = 3;

impl<'a> Engines<'a> {
    /// Engines in this process; with a program and a peer, as whole processes.
    ///
    /// # Errors
    /// When there are no threads or no place for files.
    pub fn new(frame: Frame<'a>, whole: Option<Program>, peer: Option<Peer>) -> Result<Engines<'a>, Error> {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(frame.settings.threads)
            .build()
            .map_err(|error| Error::new(Place::default(), format!("cannot start the worker threads: {error}")))?;
        let whole = whole.map(|program| folder().map(|folder| (program, folder))).transpose()?;
        Ok(Engines { frame, trees: Vec::new(), pool, whole, peer })
    }

    /// Whether times are those of whole processes.
    pub fn are_processes(&self) -> bool {
        self.whole.is_some()
    }

    /// The other tracer.
    pub fn peer(&self) -> Option<&Peer> {
        self.peer.as_ref()
    }

    /// Renders the frame in one way.
    ///
    /// # Errors
    /// A stop, or a process that fails.
    pub fn render(&mut self, way: &Way, seed: u64, control: &Control) -> Result<Shot, Ended> {
        match (way, &self.whole, &self.peer) {
            (Way::Flatray(setting), None, _) => self.render_here(setting, seed, control),
            (Way::Flatray(setting), Some((program, folder)), _) => {
                program.render(folder.path(), setting, seed, control)
            }
            (Way::Povray(antialiasing), _, Some(peer)) => {
                let (film, seconds) = peer.render(antialiasing, control)?;
                Ok(Shot { film, seconds, rays: None, camera_rays: None, rmse_estimate: None })
            }
            (Way::Povray(_), _, None) => Err(Error::new(Place::default(), "there is no POV-Ray to render with").into()),
        }
    }

    fn render_here(&mut self, setting: &Setting, seed: u64, control: &Control) -> Result<Shot, Ended> {
        let isa = setting.isa.unwrap_or_else(Isa::detect);
        let tree = self.tree(setting.accel, setting.preset);
        let Tree { accel, build_seconds, .. } = &mut self.trees[tree];
        accel.choose(isa, Mode::default());
        let Frame { world, camera, settings } = self.frame;
        let settings = setting.applied(settings, seed);
        let mut film = render::new_film(camera, &settings);
        let started = Instant::now();
        let counts: Counts = match setting.amount {
            Amount::Samples { .. } => {
                render::render_into(world, accel, camera, &settings, control, &mut film, &|_| {})?
            }
            Amount::Error(target) => render::refine(world, accel, camera, &settings, target, control, &mut film)?,
        };
        Ok(Shot {
            film,
            seconds: *build_seconds + started.elapsed().as_secs_f64(),
            rays: Some(counts.rays.total()),
            camera_rays: Some(counts.rays.camera),
            rmse_estimate: counts.rmse_estimate,
        })
    }

    /// The row of a tree, built the first time that it is asked for; its time is the median of several builds.
    fn tree(&mut self, kind: AccelKind, preset: Preset) -> usize {
        let is_same = |tree: &Tree| (tree.kind, tree.preset) == (kind, preset);
        if let Some(row) = self.trees.iter().position(is_same) {
            return row;
        }
        let build = || {
            let started = Instant::now();
            let accel = self.pool.install(|| Accel::build_with(self.frame.world, kind, preset));
            (accel, started.elapsed().as_secs_f64())
        };
        let (mut accel, seconds) = build();
        let mut all = vec![seconds];
        for _ in 1..BUILDS {
            let seconds;
            (accel, seconds) = build();
            all.push(seconds);
        }
        self.trees.push(Tree { kind, preset, accel, build_seconds: Spread::of(all).median });
        self.trees.len() - 1
    }

    /// A structure over the frame's world.
    pub fn accel(&mut self, kind: AccelKind, preset: Preset, isa: Isa) -> &Accel {
        let row = self.tree(kind, preset);
        let accel = &mut self.trees[row].accel;
        accel.choose(isa, Mode::default());
        accel
    }
}

/// A folder for files that are read back at once.
fn folder() -> Result<TempDir, Error> {
    tempfile::tempdir()
        .map_err(|error| Error::new(Place::default(), format!("cannot make a temporary folder: {error}")))
}

impl Program {
    fn render(&self, folder: &Path, setting: &Setting, seed: u64, control: &Control) -> Result<Shot, Ended> {
        let (image, stats) = (folder.join("run.exr"), folder.join("run.json"));
        let mut command = Command::new(&self.path);
        command.arg("render").args(&self.arguments).args(options(setting)).args(["--seed", &seed.to_string()]);
        command.args(["--exr", "float", "--quiet", "--output"]).arg(&image).arg("--stats").arg(&stats);
        let seconds = run(&mut command, control)?;
        let film = read_image(&image, None)?.film;
        let text = std::fs::read(&stats).map_err(|error| Error::io(&stats, "read the statistics", &error))?;
        let stats: Value = serde_json::from_slice(&text)
            .map_err(|error| Error::new(Place::file(&stats), format!("the statistics cannot be read: {error}")))?;
        let count = |kind: &str| stats["rays"][kind].as_u64();
        let kinds = ["camera", "reflection", "refraction", "shadow"];
        Ok(Shot {
            film,
            seconds,
            rays: kinds.into_iter().map(count).sum(),
            camera_rays: count("camera"),
            rmse_estimate: stats["rmse_estimate"].as_f64(),
        })
    }
}

/// A setting as options of `flatray render`.
fn options(setting: &Setting) -> Vec<String> {
    let mut options = Vec::new();
    let mut say = |name: &str, value: String| options.extend([format!("--{name}"), value]);
    match setting.amount {
        Amount::Samples { sampler, samples } => {
            say("samples", samples.to_string());
            say("sampler", sampler.name().to_owned());
        }
        Amount::Error(target) => say("error", format!("{target:e}")),
    }
    if let Some(max_depth) = setting.max_depth {
        say("max-depth", max_depth.to_string());
    }
    if let Some(cutoff) = setting.cutoff {
        say("cutoff", format!("{cutoff:e}"));
    }
    match setting.accel {
        AccelKind::Linear => say("accel", "linear".to_owned()),
        AccelKind::Bvh => say("bvh", setting.preset.name().to_owned()),
    }
    if let Some(isa) = setting.isa {
        say("isa", isa.name().to_owned());
    }
    options
}
