//! Rounds of ever more samples until the image's estimated error meets a target.
//!
//! First every pixel has a few uniform samples. Where few more of them meet the target, they are taken; otherwise samples are adaptive, as long as these
//! promise what is missing for fewer rays. Every round is an image of its own, independent of all others, and the film is the mean of all, weighted
//! by what their errors are: nothing is thrown away.
//!
//! Where edges make the error, that of adaptive samples falls as threshold^¾: the number of leaves along an edge of contrast c is
//! (c/threshold)^½, and each brings a variance of threshold²/6 or less. That of uniform ones falls as n^−¾ there.

use std::sync::atomic::Ordering;

use super::join::Told;
use super::{Adaptive, Control, Counts, MAX_SPLITS, Sampler, Settings, Spread, Stopped, render_into};
use crate::accel::Accel;
use crate::film::Film;
use crate::world::{Camera, World};

/// Samples of every pixel in the first round: the fewest that tell an error.
const FIRST_SAMPLES: u32 = 4;

/// If no more uniform samples than this are missing, nothing else is tried: adaptive ones are four of every pixel before one is divided.
const FEW_SAMPLES: u32 = 16;

/// The exponents by which the error of uniform samples falls with their number, and that of adaptive ones with the threshold. With the number of samples it
/// falls about as 1/n: as n^−3/2 along edges, slower until these are most of the image's samples.
const UNIFORM_EXPONENT: f64 = 0.75;
const EDGE_EXPONENT: f64 = 0.75;

/// Share of an error that a round aims at, so that few are followed by another for a little.
const AIM: f64 = 0.95;

/// The error falls by no more than this from one adaptive round to the next, so that what is told by the last is not stretched too far.
const MAX_GAIN: f64 = 8.0;

/// Rounds at most. Ten gains of two are a thousand; where the last divisions allowed do not meet the target, more rounds do not.
const MAX_ROUNDS: usize = 16;

/// More samples than scene files may ask for are not taken.
const MAX_SAMPLES: f64 = 65_536.0;

/// The largest threshold: black and white are told apart. The smallest: cells of contrast 1 are not divided for less.
const MAX_THRESHOLD: f64 = 0.5;
const SMALLEST_THRESHOLD: f64 = 1.0 / (1_u64 << (2 * MAX_SPLITS)) as f64;

/// What a round was, and what it came to.
#[derive(Clone, Copy, Debug)]
struct Round {
    way: Way,
    rmse: f64,
    rays: f64,
}

/// How a round takes its samples.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Way {
    /// So many in every pixel.
    Uniform(u32),
    /// By a threshold.
    Adaptive(f64),
}

/// The uniform samples to an error, if `samples` have another.
fn samples_for(rmse: f64, (samples, rmse_of_samples): (u32, f64)) -> u32 {
    let factor = libm::pow(rmse_of_samples / rmse, 1.0 / UNIFORM_EXPONENT);
    // What is no number is the fewest.
    (f64::from(samples) * factor).ceil().max(f64::from(FIRST_SAMPLES)).min(MAX_SAMPLES) as u32
}

/// The threshold to an error before there was an adaptive round, by that of uniform samples: an edge of contrast 1 brings n of them a variance of 0.11·n^−1.5 in each pixel
/// that it crosses (`docs/ERROR.md`), and a twelfth of threshold^1.5·4/π if that is divided (two samples a leaf).
fn first_threshold(rmse: f64, (samples, rmse_of_samples): (u32, f64)) -> f64 {
    let crossed = rmse_of_samples * rmse_of_samples / 0.11 * libm::pow(f64::from(samples), 2.0 * UNIFORM_EXPONENT);
    let per_threshold = crossed * 4.0 / std::f64::consts::PI / 12.0;
    libm::pow(rmse * rmse / per_threshold, 1.0 / (2.0 * EDGE_EXPONENT)).min(MAX_THRESHOLD)
}

/// The threshold to an error, by that of another. How error was seen to fall from round to round is no better guide: one pixel with a small thing that no
/// sample of the others met can double the error of a small image.
fn next_threshold(rmse: f64, (threshold, rmse_of_last): (f64, f64)) -> f64 {
    let gain = (rmse_of_last / rmse).min(MAX_GAIN);
    (threshold * libm::pow(gain, -1.0 / EDGE_EXPONENT)).min(MAX_THRESHOLD)
}

/// The error that an image has to have to bring one of the error `rmse`, above the target, down to it: inverse squares add up.
fn missing_rmse(target_rmse: f64, rmse: f64) -> f64 {
    let share = target_rmse / rmse;
    target_rmse / (1.0 - share * share).sqrt()
}

/// How the next round brings an error, by all rounds before, of which the first was uniform.
fn next_way(rmse: f64, rounds: &[Round]) -> Way {
    let first = &rounds[0];
    let (mut by_uniform, mut by_adaptive) = ((FIRST_SAMPLES, first.rmse), None);
    for round in rounds {
        match round.way {
            Way::Uniform(samples) => by_uniform = (samples, round.rmse),
            Way::Adaptive(threshold) => by_adaptive = Some((threshold, round)),
        }
    }
    let samples = samples_for(rmse, by_uniform);
    let Some((threshold, last)) = by_adaptive else {
        return match samples <= FEW_SAMPLES {
            true => Way::Uniform(samples),
            false => Way::Adaptive(first_threshold(rmse.max(first.rmse / MAX_GAIN), by_uniform)),
        };
    };
    let uniform_rays = first.rays / f64::from(FIRST_SAMPLES) * f64::from(samples);
    let adaptive_rays = last.rays * last.rmse / rmse;
    match uniform_rays < adaptive_rays {
        true => Way::Uniform(samples),
        false => Way::Adaptive(next_threshold(rmse, (threshold, last.rmse))),
    }
}

impl Way {
    /// Whether there is no more to be had.
    fn is_last(self) -> bool {
        match self {
            Way::Uniform(samples) => f64::from(samples) >= MAX_SAMPLES,
            Way::Adaptive(threshold) => threshold < SMALLEST_THRESHOLD,
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
    let mut total = Counts::default();
    let mut rounds: Vec<Round> = Vec::new();
    let (mut way, mut before): (Way, Option<Told>) = (Way::Uniform(FIRST_SAMPLES), None);
    loop {
        control.tiles_done.store(0, Ordering::Relaxed);
        let settings = way.settings(settings, rounds.len() as u64);
        let counts = render_into(world, accel, camera, &settings, control, film, &|_| {})?;
        total.add_round(&counts);
        let rmse = counts.rmse_estimate.unwrap_or(0.0);
        rounds.push(Round { way, rmse, rays: counts.rays.total() as f64 });
        let told = before.map_or(rmse, |before| before.join(film, rmse));
        total.rmse_estimate = Some(told);
        if told <= target_rmse || rounds.len() == MAX_ROUNDS || way.is_last() {
            return Ok(total);
        }
        way = next_way(AIM * missing_rmse(target_rmse, told), &rounds);
        before = Some(Told { film: film.clone(), rmse: told });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rounds to a target of an image whose adaptive error is 0.3·threshold^exponent with rays as 1/√threshold, that of `first` uniform samples
    /// 1e-2.
    fn rounds(exponent: f64, target: f64, dense: f64) -> Vec<Round> {
        let mut rounds: Vec<Round> = Vec::new();
        let (mut way, mut told) = (Way::Uniform(FIRST_SAMPLES), f64::INFINITY);
        while told > target && rounds.len() < MAX_ROUNDS {
            let (rmse, rays) = match way {
                Way::Uniform(samples) => (1e-2 * (f64::from(samples) / 4.0).powf(-0.75), f64::from(samples)),
                Way::Adaptive(threshold) => (0.3 * threshold.powf(exponent), dense / threshold.sqrt()),
            };
            rounds.push(Round { way, rmse, rays });
            told = if told.is_finite() { (told.powi(-2) + rmse.powi(-2)).powf(-0.5) } else { rmse };
            if told > target {
                way = next_way(AIM * missing_rmse(target, told), &rounds);
            }
        }
        rounds
    }

    #[test]
    fn few_rounds_lead_to_a_target_and_not_far_beyond() {
        for exponent in [0.4, 0.75, 1.1] {
            for target in [1e-3, 1e-4, 1e-5] {
                let rounds = rounds(exponent, target, 1.0);
                assert!(rounds.len() <= 10, "{exponent}: {rounds:?}");
                assert!(rounds[rounds.len() - 1].rmse > 0.3 * target, "{exponent}: {rounds:?}");
                assert!(matches!(rounds[1].way, Way::Adaptive(_)), "{rounds:?}");
            }
        }
    }

    #[test]
    fn what_is_cheaper_brings_what_is_missing() {
        let is_uniform = |round: &Round| matches!(round.way, Way::Uniform(_));
        assert!(rounds(0.75, 5e-3, 1.0).iter().all(is_uniform), "few samples suffice");
        assert!(!is_uniform(rounds(0.75, 1e-4, 1.0).last().unwrap()));
        assert!(is_uniform(rounds(0.75, 1e-4, 1e3).last().unwrap()), "edges everywhere");
    }

    #[test]
    fn what_is_missing_adds_up_to_the_target() {
        let rmse = missing_rmse(3.0, 5.0);
        // Ten roundings of numbers below 4.
        assert!(((1.0 / 25.0 + 1.0 / (rmse * rmse)).powf(-0.5) - 3.0).abs() <= 20.0 * f64::EPSILON);
    }
}
