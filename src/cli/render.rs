//! `flatray render`: load, build, trace, write; what is shown meanwhile and at the end.

use std::sync::atomic::Ordering;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use super::args::RenderArgs;
use super::failure::Failure;
use super::files::{self, PngLook};
use super::interrupt::Interrupt;
use super::memory::{self, Need};
use super::output::{self, Output};
use super::plan::{self, Plan};
use super::progress::Progress;
use super::stats::{MemoryBytes, Seconds, Stats};
use super::{diagnostic, terminal};
use crate::accel::Accel;
use crate::error::{Error, Place};
use crate::render::{self, Control, Rendered};
use crate::scene::Compiled;

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
    if !args.quiet && !scene.warnings.is_empty() {
        terminal::print_error(&diagnostic::warnings(&scene.warnings, terminal::stderr_is_coloured()));
    }
    let plan = plan::settle(args, &scene)?;
    Need::of(&scene.world, &plan.settings, plan.accel).check(memory::available_bytes())?;

    let accel = timed(&mut seconds.build, || pool.install(|| Accel::build(&scene.world, plan.accel)));
    drop(pool);
    interrupt.check()?;
    let rendered = timed(&mut seconds.trace, || trace(&scene, &accel, &plan, args.quiet, &interrupt))?;
    timed(&mut seconds.write, || write(&rendered, &plan, &outputs, &interrupt))?;
    seconds.total = started.elapsed().as_secs_f64();

    let stats = Stats {
        seconds,
        rays: rendered.rays.into(),
        memory_bytes: MemoryBytes {
            tables: memory::table_bytes(&scene.world),
            accel: accel.stats().memory_bytes as u64,
            peak: memory::peak_bytes(),
        },
        width: scene.camera.width_px,
        height: scene.camera.height_px,
        samples: plan.settings.samples,
        threads: plan.settings.threads,
    };
    if let Some(path) = &args.stats {
        files::write_text(&stats.to_json(), path)?;
    }
    if !args.quiet {
        let images = outputs.iter().map(|output| output.path.as_path());
        let written: Vec<_> = images.chain(args.stats.as_deref()).collect();
        terminal::print(&stats.summary(&written))?;
    }
    Ok(())
}

/// Runs a step and notes how long it took.
fn timed<T>(seconds: &mut f64, step: impl FnOnce() -> T) -> T {
    let started = Instant::now();
    let result = step();
    *seconds = started.elapsed().as_secs_f64();
    result
}

/// Renders on another thread while this one shows progress and passes on an interrupt.
fn trace(
    scene: &Compiled,
    accel: &Accel,
    plan: &Plan,
    quiet: bool,
    interrupt: &Interrupt,
) -> Result<Rendered, Failure> {
    let control = Control::default();
    let mut progress = Progress::start(render::n_tiles(&plan.settings), quiet);
    let result = std::thread::scope(|scope| {
        let (sender, receiver) = channel();
        let (control, settings) = (&control, &plan.settings);
        let worker = scope.spawn(move || {
            let rendered = render::render(&scene.world, accel, &scene.camera, settings, control);
            // The receiver waits until it has this message or the sender is gone, so that sending cannot fail.
            let _ = sender.send(rendered);
        });
        let result = loop {
            match receiver.recv_timeout(POLL_INTERVAL) {
                Ok(rendered) => break Some(rendered),
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
        Some(Ok(rendered)) => Ok(rendered),
        Some(Err(render::Stopped)) => Err(Failure::Interrupted),
        None => Err(Error::new(Place::default(), "the renderer failed: this is a bug in flatray").into()),
    }
}

/// Writes all images beside their places, then renames them.
fn write(rendered: &Rendered, plan: &Plan, outputs: &[Output], interrupt: &Interrupt) -> Result<(), Failure> {
    let look = PngLook { exposure_ev: plan.exposure_ev, course: plan.settings.course };
    for Output { kind, path } in outputs {
        interrupt.check()?;
        files::write_image(&rendered.film, *kind, &look, path)?;
    }
    Ok(())
}
