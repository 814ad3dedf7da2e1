//! What is traced: trees, ray sets, and their answers judged by the full scan.

use std::time::Instant;

use super::pass::{self, Answers};
use super::report::{Build, SetSummary, Spread};
use super::{Settings, check};
use crate::accel::{Accel, AccelKind, Preset};
use crate::error::{Error, Place};
use crate::measure::rays::{RayKind, RayPrecision, RaySource};
use crate::world::{Camera, Ray, World};

/// A tree and what it was built with.
#[derive(Clone, Debug)]
pub struct Tree {
    /// The preset.
    pub preset: Preset,
    /// The tree.
    pub accel: Accel,
}

/// Rays and their exact answers.
#[derive(Clone, Debug)]
pub struct RaySet {
    /// What their numbers are rounded to.
    pub precision: RayPrecision,
    /// The rays.
    pub rays: Vec<Ray>,
    /// Their answers.
    pub answers: Answers,
    /// How many answers were compared with those of the full scan.
    pub n_judged: usize,
}

impl RaySet {
    /// The set in figures.
    pub fn summary(&self, kind: RayKind) -> SetSummary {
        SetSummary {
            rays: kind.name(),
            ray_precision: self.precision.name(),
            count: self.rays.len(),
            hits: self.answers.n_hits(),
            judged: self.n_judged,
        }
    }
}

/// The rays of a kind in both precisions.
#[derive(Clone, Debug)]
pub struct Pair {
    /// The kind.
    pub kind: RayKind,
    /// Rays whose numbers are f32.
    pub f32: RaySet,
    /// Rays as the renderer traces them.
    pub f64: RaySet,
}

/// Everything that is traced.
#[derive(Clone, Debug)]
pub struct Work {
    /// One tree per preset.
    pub trees: Vec<Tree>,
    /// One pair per kind that has rays.
    pub pairs: Vec<Pair>,
    /// How long the trees took.
    pub builds: Vec<Build>,
    /// What the reader should know.
    pub notes: Vec<String>,
}

/// Builds are repeated until they have taken this long together.
const BUILD_SECONDS: f64 = 2.0;

impl Work {
    /// Builds the trees, makes the rays and judges their answers. `progress` is told what comes next.
    ///
    /// # Errors
    /// When threads cannot be started, or an answer is wrong.
    pub fn prepare(
        world: &World,
        camera: &Camera,
        settings: &Settings,
        progress: &mut dyn FnMut(&str),
    ) -> Result<Work, Error> {
        let mut work = Work { trees: Vec::new(), pairs: Vec::new(), builds: Vec::new(), notes: Vec::new() };
        for &preset in &settings.presets {
            let mut built = None;
            for &threads in &settings.threads {
                progress(&format!("building, preset {}, threads: {threads}", preset.name()));
                let (accel, build) = timed_build(world, preset, threads, settings.repeats)?;
                work.builds.push(build);
                built = Some(accel);
            }
            work.trees.extend(built.map(|accel| Tree { preset, accel }));
        }
        let Some(tree) = work.trees.first_mut() else { return Ok(work) };
        if let (Some(&isa), Some(&mode)) = (settings.isas.first(), settings.modes.first()) {
            tree.accel.choose(isa, mode);
        }
        let source = RaySource::new(world, &tree.accel, camera);
        let threads = settings.threads.iter().copied().max().unwrap_or(1);
        for &kind in &settings.kinds {
            progress(&format!("judging {} rays", kind.name()));
            let set = |precision| {
                let rays = source.rays(kind, precision);
                let mut answers = Answers::room(kind, rays.len());
                pass::trace(&tree.accel, world, &rays, &mut answers, threads);
                let n_judged = check::judge(world, kind, &rays, &answers, settings.oracle_tests, threads)?;
                Ok::<RaySet, Error>(RaySet { precision, rays, answers, n_judged })
            };
            let pair = Pair { kind, f32: set(RayPrecision::F32)?, f64: set(RayPrecision::F64)? };
            match pair.f32.rays.is_empty() {
                true => work.notes.push(format!("no {} rays: nothing for them to start from or go to", kind.name())),
                false => work.pairs.push(pair),
            }
        }
        Ok(work)
    }
}

fn timed_build(world: &World, preset: Preset, threads: usize, repeats: usize) -> Result<(Accel, Build), Error> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|error| Error::new(Place::default(), format!("cannot start the worker threads: {error}")))?;
    let (accel, seconds) = repeat_build(repeats, || {
        Ok::<Accel, Error>(pool.install(|| Accel::build_with(world, AccelKind::Bvh, preset)))
    })?;
    let n_prims = world.n_prims().max(1) as f64;
    let tables: usize = world.memory_bytes().iter().map(|(_, bytes)| bytes).sum();
    let build = Build {
        engine: "flatray".to_owned(),
        quality: preset.name(),
        threads,
        seconds,
        bytes_per_primitive: accel.stats().memory_bytes as f64 / n_prims,
        table_bytes_per_primitive: tables as f64 / n_prims,
    };
    Ok((accel, build))
}

/// Builds again and again, as often as repeats and time allow; returns the last and the times of all.
pub(super) fn repeat_build<T, E>(repeats: usize, mut build: impl FnMut() -> Result<T, E>) -> Result<(T, Spread), E> {
    let mut all = Vec::new();
    loop {
        let started = Instant::now();
        let built = build()?;
        all.push(started.elapsed().as_secs_f64());
        if all.len() >= repeats || all.iter().sum::<f64>() > BUILD_SECONDS {
            return Ok((built, Spread::of(all)));
        }
    }
}
