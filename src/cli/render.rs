//! `flatray render`: load, build, trace, write; what is shown meanwhile and at the end.

use std::io;
use std::path::Path;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use super::args::RenderArgs;
use super::budget::{self, Budget, Frame};
use super::failure::Failure;
use super::files::{self, Writing};
use super::heatmap::{self, Heatmap};
use super::interrupt::Interrupt;
use super::memory::{self, Need};
use super::output::{self, Image};
use super::plan;
use super::progress::Progress;
use super::stats::{MemoryBytes, Seconds, Stats};
use super::{aov_args, diagnostic, exr_attributes, terminal};
use crate::accel::{Accel, AccelKind};
use crate::error::{Error, Place, Problem};
use crate::film::{Film, Rows};
use crate::render::{self, Control, Counts};
use crate::scene::machine;

/// How often progress is shown and an interrupt noticed.
const POLL_INTERVAL: Duration = Duration::from_millis(50);

/// Runs the command.
///
/// # Errors
/// Wrong usage, bad input, too little memory, an unwritable place, an interrupt.
pub fn run(args: &RenderArgs) -> Result<(), Failure> {
    let started = Instant::now();
    plan::check(args)?;
    let outputs = output::resolve(args)?;
    let interrupt = Interrupt::listen()?;
    let mut seconds = Seconds::default();

    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(plan::threads(args))
        .build()
        .map_err(|error| Error::new(Place::default(), format!("cannot start the worker threads: {error}")))?;
    let overrides = plan::overrides(args);
    let loaded = timed(&mut seconds.load, || pool.install(|| files::load(args.input.as_deref(), &overrides)));
    interrupt.check()?;
    let scene = loaded?;
    warn(args, &scene.warnings);
    let plan = plan::settle(args, &scene)?;
    warn(args, &aov_args::warnings(&plan.settings.aovs, &scene.names));
    let need = Need::of(&scene.world, &scene.camera, &plan, &outputs);
    need.check(machine::available_bytes())?;

    let accel = timed(&mut seconds.build, || pool.install(|| Accel::build_with(&scene.world, plan.accel, plan.preset)));
    let accel = accel.with_isa(plan.isa);
    drop(pool);
    interrupt.check()?;
    let mut film = render::new_film(&scene.camera, &plan.settings);
    let attributes = exr_attributes::attributes_of(args, &scene, &plan);
    let mut images = output::early_encoders(&outputs, &film, &plan, &attributes)?;
    let encode = |rows: &Rows| images.iter().for_each(|image| image.encoder.encode(rows));
    let counts = timed(&mut seconds.trace, || {
        let frame = Frame { scene: &scene, accel: &accel, settings: &plan.settings, budget: plan.budget };
        trace(&frame, &mut film, &encode, args.quiet, &interrupt)
    })?;
    output::complete(&outputs, &mut film, &plan, &attributes, &mut images, seconds.trace)?;

    let write_started = Instant::now();
    let stats = || Stats {
        seconds: Seconds {
            write: write_started.elapsed().as_secs_f64(),
            total: started.elapsed().as_secs_f64(),
            ..seconds
        },
        rays: counts.rays.into(),
        exact_tests: counts.exact_tests,
        memory_bytes: MemoryBytes {
            tables: memory::table_bytes(&scene.world),
            accel: accel.stats().memory_bytes as u64,
            estimate: need.total(),
            peak: memory::peak_bytes(),
        },
        width: scene.camera.width_px,
        height: scene.camera.height_px,
        samples: (plan.budget == Budget::Samples).then_some(plan.settings.samples),
        rmse_estimate: counts.rmse_estimate,
        threads: plan.settings.threads,
        bvh: (plan.accel == AccelKind::Bvh).then(|| plan.preset.name()),
    };
    let heatmap = Heatmap::new(&film, heatmap::path_of(args.aov.heatmap, &outputs));
    let files = writings(&film, &images, heatmap.as_ref(), args.stats.as_deref(), &stats, &interrupt);
    files::write_together(&files).map_err(|error| match interrupt.check() {
        Ok(()) => Failure::Error(error),
        Err(interrupted) => interrupted,
    })?;
    if !args.quiet {
        let written: Vec<&Path> = files.iter().map(|(path, _)| *path).collect();
        let legend = heatmap.as_ref().map(Heatmap::summary).unwrap_or_default();
        terminal::print(&(stats().summary(&written) + &legend))?;
    }
    Ok(())
}

fn warn(args: &RenderArgs, warnings: &[Problem]) {
    if !args.quiet && !warnings.is_empty() {
        terminal::print_error(&diagnostic::warnings(warnings, terminal::stderr_is_coloured()));
    }
}

/// Runs a step and notes how long it took.
fn timed<T>(seconds: &mut f64, step: impl FnOnce() -> T) -> T {
    let started = Instant::now();
    let result = step();
    *seconds = started.elapsed().as_secs_f64();
    result
}

/// Renders on another thread while this one shows progress and passes on an interrupt. The workers encode the rows that
/// are finished.
fn trace(
    frame: &Frame,
    film: &mut Film,
    encode: &(dyn Fn(&Rows) + Sync),
    quiet: bool,
    interrupt: &Interrupt,
) -> Result<Counts, Failure> {
    let control = Control::default();
    let mut progress = Progress::start(budget::n_tiles(frame), quiet);
    let result = std::thread::scope(|scope| {
        let (sender, receiver) = channel();
        let control = &control;
        let worker = scope.spawn(move || {
            let counts = budget::spend(frame, control, film, encode);
            // The receiver waits until it has this message or the sender is gone, so that sending cannot fail.
            let _ = sender.send(counts);
        });
        let result = loop {
            match receiver.recv_timeout(POLL_INTERVAL) {
                Ok(counts) => break Some(counts),
                Err(RecvTimeoutError::Disconnected) => break None,
                Err(RecvTimeoutError::Timeout) => {}
            }
            if interrupt.is_requested() {
                control.request_stop();
            }
            progress.update(control.tiles_done.load(Ordering::Relaxed), control.rays_traced.load(Ordering::Relaxed));
        };
        // A worker that panicked has sent nothing; joining it here keeps the panic from spreading.
        let _ = worker.join();
        result
    });
    progress.finish();
    match result {
        Some(Ok(counts)) => Ok(counts),
        Some(Err(render::Stopped)) => Err(Failure::Interrupted),
        None => Err(Error::new(Place::default(), "the renderer failed: this is a bug in flatray").into()),
    }
}

/// The files to write: the images, and last the stats, which tell how long the images took. Each asks first whether an
/// interrupt has come.
fn writings<'a>(
    film: &'a Film,
    images: &'a [Image],
    heatmap: Option<&'a Heatmap>,
    stats_path: Option<&'a Path>,
    stats: &'a dyn Fn() -> Stats,
    interrupt: &'a Interrupt,
) -> Vec<Writing<'a>> {
    let go_on = || if interrupt.is_requested() { Err(io::Error::other("interrupted")) } else { Ok(()) };
    let mut files: Vec<Writing<'a>> = Vec::new();
    for Image { encoder, path } in images {
        files.push((path, Box::new(move |out| go_on().and_then(|()| encoder.write(film, out)))));
    }
    if let Some(Heatmap { map, path }) = heatmap {
        files.push((path, Box::new(move |out| go_on().and_then(|()| heatmap::write(map, out)))));
    }
    if let Some(path) = stats_path {
        files.push((path, Box::new(move |out| go_on().and_then(|()| out.write_all(stats().to_json().as_bytes())))));
    }
    files
}
