//! Rounds of ever more samples until the image's estimated error meets a target.
//!
//! One sample in every few pixels shows what error samples of either kind will have, and how many they will be; the fewer are taken. What they then tell of
//! their error says how far what was foreseen is off, and a next round, if there has to be one, is foreseen by that. Every round is an image of its own,
//! independent of all others, and the film is the mean of all, weighted by what their errors are: nothing is thrown away.

use std::sync::atomic::Ordering;

use super::adaptive::{Foresight, foresee};
use super::join::Told;
use super::{Adaptive, Control, Counts, Sampler, Settings, Spread, Stopped, job, render_into};
use crate::accel::Accel;
use crate::film::Film;
use crate::world::{Camera, World};

/// The fewest uniform samples that tell an error.
const FEWEST_SAMPLES: f64 = 4.0;

/// More samples than scene files may ask for are not taken.
const MAX_SAMPLES: f64 = 65_536.0;

/// What is told over what was foreseen, before anything is told: over the scenes in `scenes/` and the course's, adaptive samples have 0.34 to 1.22 of the error foreseen, few
/// uniform ones 0.4 to 0.75 and more of them up to 0.8. Too low a guess costs another round, too high a one a few samples.
const FIRST_SCALE: f64 = 1.0;
const FIRST_UNIFORM_SCALE: f64 = 0.75;

/// Share of an error that a round after the first aims at, so that few are followed by another for a little.
const AIM: f64 = 0.95;

/// The error falls by no more than this from one round to the next, so that what is told by the last is not stretched too far.
const MAX_GAIN: f64 = 8.0;

/// Rounds at most. Ten gains of two are a thousand; where the last divisions allowed do not meet the target, more rounds do not.
const MAX_ROUNDS: u64 = 16;

/// How a round takes its samples.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Way {
    /// So many in every pixel.
    Uniform(u32),
    /// By a threshold.
    Adaptive(f64),
}

/// What the last rounds came to over what had been foreseen of them.
#[derive(Clone, Copy, Debug)]
struct Scales {
    uniform_rmse: Option<f64>,
    adaptive_rmse: Option<f64>,
    adaptive_samples: f64,
}

impl Scales {
    /// Nothing is known.
    const FIRST: Scales = Scales { uniform_rmse: None, adaptive_rmse: None, adaptive_samples: 1.0 };

    /// Takes what a round told; `samples` are those of a pixel on average.
    fn learn(&mut self, foresight: &Foresight, way: Way, rmse: f64, samples: f64) {
        let (scale, foreseen) = match way {
            Way::Uniform(samples) => (&mut self.uniform_rmse, foresight.uniform_rmse(samples.into())),
            Way::Adaptive(threshold) => {
                self.adaptive_samples = samples / foresight.samples(threshold);
                (&mut self.adaptive_rmse, foresight.rmse(threshold))
            }
        };
        // Where nothing was foreseen, no share of it is what was told.
        if foreseen > 0.0 && rmse.is_finite() && rmse > 0.0 {
            *scale = Some(rmse / foreseen);
        }
    }

    /// How a round brings an error for the fewest samples.
    fn way(&self, foresight: &Foresight, rmse: f64) -> Way {
        let uniform = self.uniform_rmse.unwrap_or(FIRST_UNIFORM_SCALE);
        let uniform = foresight.uniform_samples(rmse / uniform).ceil().clamp(FEWEST_SAMPLES, MAX_SAMPLES);
        // Where uniform samples were worse than foreseen, the contrasts are larger than the first samples showed.
        let adaptive = self.adaptive_rmse.unwrap_or(FIRST_SCALE.max(self.uniform_rmse.unwrap_or(0.0)));
        let threshold = foresight.threshold(rmse / adaptive);
        // Of equals the one whose beams find what hides between samples.
        match uniform < self.adaptive_samples * foresight.samples(threshold) {
            true => Way::Uniform(uniform as u32),
            false => Way::Adaptive(threshold),
        }
    }
}

/// The error that an image has to have to bring one of the error `rmse`, above the target, down to it: inverse squares add up.
fn missing_rmse(target_rmse: f64, rmse: f64) -> f64 {
    let share = target_rmse / rmse;
    target_rmse / (1.0 - share * share).sqrt()
}

impl Way {
    /// Whether there is no more to be had.
    fn is_last(self) -> bool {
        match self {
            Way::Uniform(samples) => f64::from(samples) >= MAX_SAMPLES,
            Way::Adaptive(threshold) => threshold <= Foresight::SMALLEST_THRESHOLD,
        }
    }

    /// The settings of a round by its number: each has samples of its own.
    fn settings(self, settings: &Settings, number: u64) -> Settings {
        let (spread, samples) = match self {
            Way::Uniform(samples) => (Spread::Uniform, samples),
            Way::Adaptive(threshold) => (Spread::Adaptive(Adaptive::new(threshold)), settings.samples),
        };
        let seed = settings.seed.wrapping_add(number << 48);
        Settings { spread, samples, sampler: Sampler::Sobol, seed, ..settings.clone() }
    }
}

/// Renders with ever more samples until the estimate of the root mean square error is at most `target_rmse`, which is above
/// 0, or neither cells can be divided further nor samples be more. Spread, sampler and samples of the settings have no meaning. Returns what all rounds took,
/// and the error of their mean.
///
/// Which round is the last depends on the samples of all pixels; what bias that brings is in `docs/ERROR.md`.
///
/// # Errors
/// [`Stopped`] when `control` asked for it; the film then holds parts of two images.
pub fn refine(
    world: &World,
    accel: &Accel,
    camera: &Camera,
    settings: &Settings,
    target_rmse: f64,
    control: &Control,
    film: &mut Film,
) -> Result<Counts, Stopped> {
    let whole = [camera.width_px, camera.height_px];
    let (foresight, mut total) = foresee(&job(world, accel, camera, settings, control), whole)?;
    let mut scales = Scales::FIRST;
    let (mut way, mut before): (Way, Option<Told>) = (scales.way(&foresight, target_rmse), None);
    for number in 1.. {
        control.tiles_done.store(0, Ordering::Relaxed);
        let settings = way.settings(settings, number);
        let counts = render_into(world, accel, camera, &settings, control, film, &|_| {})?;
        total.add_round(&counts);
        let rmse = counts.rmse_estimate.unwrap_or(0.0);
        scales.learn(&foresight, way, rmse, counts.rays.camera as f64 / settings.region.n_pixels() as f64);
        let told = before.map_or(rmse, |before| before.join(film, rmse));
        total.rmse_estimate = Some(told);
        if told <= target_rmse || number == MAX_ROUNDS || way.is_last() {
            break;
        }
        way = scales.way(&foresight, (AIM * missing_rmse(target_rmse, told)).max(rmse / MAX_GAIN));
        before = Some(Told { film: film.clone(), rmse: told });
    }
    Ok(total)
}

#[cfg(test)]
mod tests {
    use super::super::adaptive::FirstLook;
    use super::*;

    /// Edges of contrast ½ in a share of the pixels.
    fn edges(share: f64) -> Foresight {
        let mut foresight = Foresight::default();
        for i in 0..1000 {
            let edge = if f64::from(i) < 1000.0 * share { 0.5 } else { 0.0 };
            foresight.note(&FirstLook { edge, bend: 0.0, is_background: false }, 1);
        }
        foresight
    }

    /// Rounds to a target of an image whose errors, by uniform and by adaptive samples, and whose samples are these multiples of what is foreseen.
    fn rounds(foresight: &Foresight, target: f64, [uniform, adaptive, more]: [f64; 3]) -> (Vec<Way>, f64) {
        let (mut ways, mut told, mut scales) = (Vec::new(), f64::INFINITY, Scales::FIRST);
        let mut next = target;
        while told > target && (ways.len() as u64) < MAX_ROUNDS {
            let way = scales.way(foresight, next);
            let (rmse, samples) = match way {
                Way::Uniform(n) => (uniform * foresight.uniform_rmse(n.into()), n.into()),
                Way::Adaptive(threshold) => (adaptive * foresight.rmse(threshold), more * foresight.samples(threshold)),
            };
            scales.learn(foresight, way, rmse, samples);
            told = if told.is_finite() { (1.0 / (told.powi(-2) + rmse.powi(-2))).sqrt() } else { rmse };
            next = (AIM * missing_rmse(target, told)).max(rmse / MAX_GAIN);
            ways.push(way);
        }
        (ways, told)
    }

    #[test]
    fn few_rounds_lead_to_a_target_and_not_far_beyond() {
        for share in [0.01, 0.1, 0.9] {
            for scale in [0.4, 0.8, 1.5, 3.0] {
                for target in [1e-2, 1e-3, 1e-4] {
                    let (ways, told) = rounds(&edges(share), target, [scale, scale, 1.3]);
                    assert!(told <= target && ways.len() <= 3, "{share} {scale} {target}: {ways:?}");
                    // Four samples may be more than it takes.
                    assert!(
                        told > 0.35 * target || ways == [Way::Uniform(4)],
                        "{share} {scale} {target}: {ways:?} {told}"
                    );
                }
            }
        }
    }

    #[test]
    fn what_takes_fewer_samples_is_taken() {
        let is_uniform = |way: &Way| matches!(way, Way::Uniform(_));
        assert!(rounds(&edges(0.01), 1e-2, [0.9, 0.9, 1.0]).0.iter().all(is_uniform), "few samples suffice");
        assert!(!rounds(&edges(0.01), 1e-4, [0.9, 0.9, 1.0]).0.iter().any(is_uniform));
        // Edges that adaptive samples make nothing of.
        assert!(rounds(&edges(0.9), 1e-3, [0.9, 20.0, 1.0]).0.last().is_some_and(is_uniform));
    }

    #[test]
    fn what_is_missing_adds_up_to_the_target() {
        let rmse = missing_rmse(3.0, 5.0);
        // Ten roundings of numbers below 4.
        assert!(((1.0 / 25.0 + 1.0 / (rmse * rmse)).powf(-0.5) - 3.0).abs() <= 20.0 * f64::EPSILON);
    }
}
