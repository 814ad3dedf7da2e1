//! What a render may cost: samples, an error to reach, or a time to spend.

use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use super::args::{CompatArg, RenderArgs};
use super::failure::Failure;
use super::value;
use crate::accel::Accel;
use crate::film::{Film, Rows};
use crate::render::{self, Adaptive, Control, Counts, Settings, Spread, Stopped, Told};
use crate::scene::Compiled;
use clap::error::ErrorKind;

/// The options.
#[derive(clap::Args, Clone, Copy, Debug, Default, PartialEq)]
pub struct BudgetArgs {
    /// Instead of samples: take them where they are needed until the estimated root mean square error is at most this
    #[arg(long, value_name = "RMSE", value_parser = value::target_rmse, help_heading = "Quality")]
    pub error: Option<f64>,
    /// Instead of samples: as many as this time allows, where they are needed; not the same bits each time
    #[arg(long, value_name = "SECONDS", value_parser = value::seconds, help_heading = "Quality")]
    pub time: Option<f64>,
}

/// What a render may cost.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Budget {
    /// The samples of the settings.
    #[default]
    Samples,
    /// As much as an estimated error takes.
    Error(f64),
    /// A time for tracing.
    Seconds(f64),
}

impl BudgetArgs {
    /// What is asked for.
    pub fn budget(&self) -> Budget {
        match (self.error, self.time) {
            (Some(error), _) => Budget::Error(error),
            (None, Some(seconds)) => Budget::Seconds(seconds),
            (None, None) => Budget::Samples,
        }
    }
}

/// Finds options that contradict a budget, before anything is loaded.
///
/// # Errors
/// Wrong usage.
pub fn check(args: &RenderArgs) -> Result<(), Failure> {
    let option = match args.budget.budget() {
        Budget::Samples => return Ok(()),
        Budget::Error(_) => "--error",
        Budget::Seconds(_) => "--time",
    };
    let others = [
        (args.budget.error.is_some() && args.budget.time.is_some(), "--time"),
        (args.samples.is_some(), "--samples"),
        (args.sampler.is_some(), "--sampler"),
        (args.compat == Some(CompatArg::Course), "--compat course"),
    ];
    match others.iter().find(|(is_given, _)| *is_given) {
        None => Ok(()),
        Some((_, other)) => {
            let message = format!("'{option}' says how many samples to take: it cannot be used with '{other}'");
            Err(Failure::usage("render", ErrorKind::ArgumentConflict, message))
        }
    }
}

/// What a frame is rendered from.
pub struct Frame<'a> {
    /// Tables and camera.
    pub scene: &'a Compiled,
    /// Structure over them.
    pub accel: &'a Accel,
    /// How.
    pub settings: &'a Settings,
    /// For how much.
    pub budget: Budget,
}

/// Tiles that a frame is rendered in; of one round, where there are several.
pub fn n_tiles(frame: &Frame) -> u64 {
    match frame.budget {
        Budget::Samples => render::n_tiles(frame.settings),
        Budget::Error(_) | Budget::Seconds(_) => {
            let spread = Spread::Adaptive(Adaptive::new(FIRST_THRESHOLD));
            render::n_tiles(&Settings { spread, ..frame.settings.clone() })
        }
    }
}

/// Renders a frame within its budget. The workers encode the rows that are finished, where they come as such.
///
/// # Errors
/// [`Stopped`] when `control` asked for it, but for a time that is up.
pub fn spend(
    frame: &Frame,
    control: &Control,
    film: &mut Film,
    encode: &(dyn Fn(&Rows) + Sync),
) -> Result<Counts, Stopped> {
    let Frame { scene, accel, settings, budget } = *frame;
    match budget {
        Budget::Samples => render::render_into(&scene.world, accel, &scene.camera, settings, control, film, encode),
        Budget::Error(target) => render::refine(&scene.world, accel, &scene.camera, settings, target, control, film),
        Budget::Seconds(seconds) => spend_time(frame, Duration::from_secs_f64(seconds), control, film),
    }
}

/// Thresholds of a first round, which is rough and always finished, and of the last that makes sense.
const FIRST_THRESHOLD: f64 = 0.5;
const LAST_THRESHOLD: f64 = 1e-9;

/// Share of the time left that a round is planned to take: it may take longer than what was measured lets expect.
const PLANNED_SHARE: f64 = 0.8;

/// A round that could do no more than this many times the work of the last is not begun.
const MIN_GAIN: f64 = 1.25;

/// Rounds of ever more samples as long as there is time. The film is the mean of all that were finished, by their errors.
fn spend_time(frame: &Frame, time: Duration, control: &Control, film: &mut Film) -> Result<Counts, Stopped> {
    let Frame { scene, accel, settings, .. } = *frame;
    let deadline = Instant::now() + time;
    let mut total = Counts::default();
    let mut told: Option<f64> = None;
    let mut threshold = FIRST_THRESHOLD;
    for round in 0_u64.. {
        let spread = Spread::Adaptive(Adaptive::new(threshold));
        let seed = settings.seed.wrapping_add(round << 48);
        let settings = Settings { spread, seed, ..settings.clone() };
        let mut next = render::new_film(&scene.camera, &settings);
        let started = Instant::now();
        control.tiles_done.store(0, Ordering::Relaxed);
        let counts = if round == 0 {
            render::render_into(&scene.world, accel, &scene.camera, &settings, control, &mut next, &|_| {})?
        } else {
            let stopped = stop_at(deadline, control, || {
                render::render_into(&scene.world, accel, &scene.camera, &settings, control, &mut next, &|_| {})
            });
            match stopped {
                Some(Ok(counts)) => counts,
                Some(Err(Stopped)) => return Err(Stopped),
                None => break,
            }
        };
        let (before, rmse) = (std::mem::replace(film, next), counts.rmse_estimate.unwrap_or(0.0));
        let joined = told.map_or(rmse, |told| Told { film: before, rmse: told }.join(film, rmse));
        told = Some(joined);
        total.add_round(&Counts { rmse_estimate: told, ..counts });
        // Costs grow no faster than as the inverse root of the threshold.
        let left = deadline.saturating_duration_since(Instant::now());
        let gain = PLANNED_SHARE * left.as_secs_f64() / started.elapsed().as_secs_f64().max(1e-6);
        if gain < MIN_GAIN || threshold < LAST_THRESHOLD {
            break;
        }
        threshold /= gain * gain;
    }
    Ok(total)
}

/// Runs a round that ends at a time; `None` if it was the time that ended it.
fn stop_at(
    deadline: Instant,
    control: &Control,
    round: impl FnOnce() -> Result<Counts, Stopped>,
) -> Option<Result<Counts, Stopped>> {
    let (done, wait) = std::sync::mpsc::channel::<()>();
    std::thread::scope(|scope| {
        let clock = scope.spawn(move || {
            let is_up = wait.recv_timeout(deadline.saturating_duration_since(Instant::now())).is_err();
            // A stop that somebody else asked for stays theirs.
            is_up && !control.stop.swap(true, Ordering::Relaxed)
        });
        let result = round();
        // The clock may have gone already.
        let _ = done.send(());
        let was_clock = clock.join().unwrap_or(false);
        match result {
            Err(Stopped) if was_clock => None,
            result => Some(result),
        }
    })
}
