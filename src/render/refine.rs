//! Rounds of ever more samples until the image's estimated error meets a target.
//!
//! First a few blocks of the image are rendered: with a few samples for every pixel, which tells how many of them would meet the
//! target, and with adaptive samples, more from round to round, until these meet it or cost as much. What is cheaper then renders the image. If
//! that misses the target, another round, with samples of its own, brings what is missing.
//!
//! Where edges make the error, that of adaptive samples falls as threshold^¾: the number of leaves along an edge of contrast c is
//! (c/threshold)^½, and each brings a variance of threshold²/6 or less. That of uniform ones falls as n^−¾ there.

use std::sync::atomic::Ordering;

use super::adaptive::{n_blocks, one_block_in, render_blocks};
use super::join::Told;
use super::{Adaptive, Control, Counts, MAX_SPLITS, Sampler, Settings, Spread, Stopped, job, new_film, render_into};
use crate::accel::Accel;
use crate::film::Film;
use crate::world::{Camera, World};

/// An image refined to a target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Refined {
    /// What all rounds took, and the error of the last.
    pub counts: Counts,
    /// How the samples of the image are spread.
    pub spread: Spread,
    /// Samples per pixel, where all have the same number.
    pub samples: Option<u32>,
    /// Rounds, those of a few blocks included.
    pub n_rounds: u64,
}

/// The exponent with which error falls with the threshold along edges, and the range that what is measured is held to.
const EDGE_EXPONENT: f64 = 0.75;
const EXPONENTS: (f64, f64) = (0.35, 1.2);

/// Share of an error that a round aims at, so that few are followed by another for a little.
const AIM: f64 = 0.95;

/// The error falls by no more than this from one round to the next: a round then costs at most nine times as much, and what is
/// told by the last is not stretched too far.
const MAX_GAIN: f64 = 24.0;

/// Rounds at most. Ten gains of two are a thousand; where the last divisions allowed do not meet the target, more rounds do not.
const MAX_ROUNDS: usize = 16;

/// Cells of contrast 1 are not divided for less.
const SMALLEST_THRESHOLD: f64 = 1.0 / (1_u64 << (2 * MAX_SPLITS)) as f64;

/// One block in so many is rendered first, or more of them, so that there are some.
const MAX_ONE_IN: u32 = 8;
const MIN_FIRST_BLOCKS: u64 = 8;

/// The first blocks are not rendered once more if they have missed the target by no more than this.
const NEAR: f64 = 1.3;

/// Samples of every pixel that tell what uniform samples would cost, and the exponent of the law by which the error falls.
const PROBE_SAMPLES: u32 = 8;
const UNIFORM_EXPONENT: f64 = 0.75;

/// If no more uniform samples than this meet the target, nothing else is tried: adaptive ones are four of every pixel before one is divided.
const FEW_SAMPLES: u32 = 16;

/// More samples than scene files may ask for are not taken.
const MAX_SAMPLES: f64 = 65_536.0;

/// The largest threshold: black and white are told apart.
const MAX_THRESHOLD: f64 = 0.5;

/// The threshold of the first round: that which would meet the target, were one pixel in two hundred crossed by an edge of
/// contrast 1 (of 4/π·2ᵏ leaves at k divisions, with a variance of a sixth, halved by two samples), but no more than half.
fn first_threshold(target_rmse: f64) -> f64 {
    let crossed = 1.0 / 200.0;
    let per_edge = crossed * 4.0 / std::f64::consts::PI / 12.0;
    libm::pow(target_rmse * target_rmse / per_edge, 1.0 / (2.0 * EDGE_EXPONENT)).min(MAX_THRESHOLD)
}

/// The exponent with which error falls with the threshold, by the last two rounds if they tell.
fn exponent(rounds: &[(f64, f64)]) -> f64 {
    match *rounds {
        [.., (before, rmse_before), (threshold, rmse)] if rmse > 0.0 && threshold < before => {
            (libm::log(rmse_before / rmse) / libm::log(before / threshold)).clamp(EXPONENTS.0, EXPONENTS.1)
        }
        _ => EDGE_EXPONENT,
    }
}

/// The threshold of the round after some, of thresholds and errors, that have not met the target.
pub fn next_threshold(target_rmse: f64, rounds: &[(f64, f64)]) -> f64 {
    let Some(&(threshold, rmse)) = rounds.last() else { return first_threshold(target_rmse) };
    let gain = (rmse / (AIM * target_rmse)).clamp(1.0 / AIM, MAX_GAIN);
    threshold * libm::pow(gain, -1.0 / exponent(rounds))
}

/// The threshold with which the image is rendered, by rounds of a few blocks of which the last is near the target or below.
fn image_threshold(target_rmse: f64, rounds: &[(f64, f64)]) -> f64 {
    let Some(&(threshold, rmse)) = rounds.last() else { return first_threshold(target_rmse) };
    let gain = (rmse / (AIM * target_rmse)).clamp(1.0 / MAX_GAIN, MAX_GAIN);
    (threshold * libm::pow(gain, -1.0 / exponent(rounds))).min(MAX_THRESHOLD)
}

/// The samples that meet the target if `samples` have an error, at least four, since fewer tell none.
fn samples_for(target_rmse: f64, samples: u32, rmse: f64) -> u32 {
    let factor = libm::pow(rmse / (AIM * target_rmse), 1.0 / UNIFORM_EXPONENT);
    (f64::from(samples) * factor).ceil().clamp(4.0, MAX_SAMPLES) as u32
}

/// A refinement under way.
struct Refinement<'a> {
    world: &'a World,
    accel: &'a Accel,
    camera: &'a Camera,
    settings: &'a Settings,
    target_rmse: f64,
    control: &'a Control,
    total: Counts,
    n_rounds: u64,
}

/// What the first blocks tell is cheapest.
#[derive(Clone, Copy, Debug)]
enum Way {
    Uniform(u32),
    Adaptive(f64),
    /// By a threshold with which the image has been rendered: the first blocks are all there are.
    Done(f64),
}

/// Renders with ever more samples until the estimate of the root mean square error is at most `target_rmse`, which is above
/// 0, or neither cells can be divided further nor samples be more. Spread, sampler and samples of the settings have no meaning.
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
) -> Result<Refined, Stopped> {
    let (total, n_rounds) = (Counts::default(), 0);
    let mut work = Refinement { world, accel, camera, settings, target_rmse, control, total, n_rounds };
    let way = work.find_way(film)?;
    let (spread, samples) = work.render_image(way, film)?;
    Ok(Refined { counts: work.total, spread, samples, n_rounds: work.n_rounds })
}

impl Refinement<'_> {
    /// Finds out with a few blocks how the image is rendered best.
    fn find_way(&mut self, film: &mut Film) -> Result<Way, Stopped> {
        let one_in = (n_blocks(&self.settings.region) / MIN_FIRST_BLOCKS).clamp(1, u64::from(MAX_ONE_IN)) as u32;
        // A power of two, for which blocks are spread evenly.
        let one_in = 1 << one_in.ilog2();
        let (uniform_rays, samples) = self.probe(one_in)?;
        if samples <= FEW_SAMPLES {
            return Ok(Way::Uniform(samples));
        }
        let mut rounds: Vec<(f64, f64)> = Vec::new();
        loop {
            let threshold = next_threshold(self.target_rmse, &rounds);
            let rays_before = self.total.rays.total();
            let rmse = self.round(threshold, one_in, film)?;
            rounds.push((threshold, rmse));
            let is_met = rmse <= self.target_rmse || rounds.len() >= MAX_ROUNDS || threshold < SMALLEST_THRESHOLD;
            if is_met && one_in == 1 {
                return Ok(Way::Done(threshold));
            }
            if (self.total.rays.total() - rays_before) as f64 > uniform_rays {
                return Ok(Way::Uniform(samples));
            }
            if is_met || rmse <= NEAR * self.target_rmse {
                return Ok(Way::Adaptive(image_threshold(self.target_rmse, &rounds)));
            }
        }
    }

    /// The rays that the first blocks would take with uniform samples, and the samples.
    fn probe(&mut self, one_in: u32) -> Result<(f64, u32), Stopped> {
        let part = self.settings.region;
        let (mut n_pixels, mut squares, mut rays) = (0, 0.0, 0);
        for region in one_block_in(one_in, self.camera.width_px, self.camera.height_px, &part) {
            let settings =
                Settings { region, tile_size_px: 8, aovs: Default::default(), ..self.uniform(PROBE_SAMPLES) };
            let mut film = new_film(self.camera, &settings);
            let counts = render_into(self.world, self.accel, self.camera, &settings, self.control, &mut film, &|_| {})?;
            self.total.add_round(&counts);
            let rmse = counts.rmse_estimate.unwrap_or(0.0);
            n_pixels += region.n_pixels();
            squares += rmse * rmse * region.n_pixels() as f64;
            rays += counts.rays.total();
        }
        self.n_rounds += 1;
        let rmse = (squares / n_pixels.max(1) as f64).sqrt();
        let samples = samples_for(self.target_rmse, PROBE_SAMPLES, rmse);
        Ok((rays as f64 / f64::from(PROBE_SAMPLES) * f64::from(samples), samples))
    }

    /// Settings of a round of uniform samples.
    fn uniform(&self, samples: u32) -> Settings {
        let seed = self.seed();
        Settings { spread: Spread::Uniform, sampler: Sampler::Sobol, samples, seed, ..self.settings.clone() }
    }

    /// Every round has samples of its own.
    fn seed(&self) -> u64 {
        self.settings.seed.wrapping_add(self.n_rounds << 48)
    }

    /// A round of adaptive samples, of some blocks; its error.
    fn round(&mut self, threshold: f64, one_in: u32, film: &mut Film) -> Result<f64, Stopped> {
        let adaptive = Adaptive::new(threshold);
        let settings = Settings { spread: Spread::Adaptive(adaptive), seed: self.seed(), ..self.settings.clone() };
        self.control.tiles_done.store(0, Ordering::Relaxed);
        let job = job(self.world, self.accel, self.camera, &settings, self.control);
        let counts = render_blocks(&job, &adaptive, film, one_in)?.counts();
        self.n_rounds += 1;
        self.total.add_round(&counts);
        Ok(counts.rmse_estimate.unwrap_or(0.0))
    }

    /// Renders the image until its error meets the target. What misses it is kept: the next round only has to bring what is missing, and
    /// the image is the mean of all.
    fn render_image(&mut self, mut way: Way, film: &mut Film) -> Result<(Spread, Option<u32>), Stopped> {
        if let Way::Done(threshold) = way {
            return Ok((Spread::Adaptive(Adaptive::new(threshold)), None));
        }
        let (mut before, mut samples): (Option<Told>, u32) = (None, 0);
        for n_left in (0..MAX_ROUNDS).rev() {
            let (rmse, is_last) = match way {
                Way::Uniform(more) => {
                    samples = samples.saturating_add(more);
                    (self.uniform_round(more, film)?, f64::from(samples) >= MAX_SAMPLES)
                }
                Way::Adaptive(threshold) | Way::Done(threshold) => {
                    (self.round(threshold, 1, film)?, threshold < SMALLEST_THRESHOLD)
                }
            };
            let told = before.map_or(rmse, |before| before.join(film, rmse));
            self.total.rmse_estimate = self.total.rmse_estimate.map(|_| told);
            if told <= self.target_rmse || is_last || n_left == 0 {
                break;
            }
            way = way.with_error(rmse, AIM * missing_rmse(self.target_rmse, told));
            before = Some(Told { film: film.clone(), rmse: told });
        }
        Ok(match way {
            Way::Uniform(_) => (Spread::Uniform, Some(samples)),
            Way::Adaptive(threshold) | Way::Done(threshold) => (Spread::Adaptive(Adaptive::new(threshold)), None),
        })
    }

    /// A round of uniform samples; its error.
    fn uniform_round(&mut self, samples: u32, film: &mut Film) -> Result<f64, Stopped> {
        let settings = self.uniform(samples);
        self.control.tiles_done.store(0, Ordering::Relaxed);
        let counts = render_into(self.world, self.accel, self.camera, &settings, self.control, film, &|_| {})?;
        self.n_rounds += 1;
        self.total.add_round(&counts);
        Ok(counts.rmse_estimate.unwrap_or(0.0))
    }
}

impl Way {
    /// The way to an error, if this one led to another.
    fn with_error(self, rmse: f64, wanted: f64) -> Way {
        match self {
            Way::Uniform(samples) => Way::Uniform(samples_for(wanted, samples, rmse)),
            Way::Adaptive(threshold) | Way::Done(threshold) => {
                let factor = libm::pow(wanted / rmse, 1.0 / EDGE_EXPONENT).max(1.0 / MAX_GAIN);
                Way::Adaptive((threshold * factor).min(MAX_THRESHOLD))
            }
        }
    }
}

/// The error that an image has to have to bring one of the error `rmse`, above the target, down to it: inverse squares add up.
fn missing_rmse(target_rmse: f64, rmse: f64) -> f64 {
    let share = target_rmse / rmse;
    target_rmse / (1.0 - share * share).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thresholds_fall_to_the_target_as_the_error_is_found_to_fall() {
        for exponent in [0.4, 0.75, 1.1] {
            let (mut rounds, target) = (Vec::new(), 1e-4);
            while rounds.last().is_none_or(|&(_, rmse)| rmse > target) {
                let threshold = next_threshold(target, &rounds);
                assert!(rounds.last().is_none_or(|&(before, _)| threshold < before));
                rounds.push((threshold, 0.3 * threshold.powf(exponent)));
            }
            assert!(rounds.len() <= 6, "{exponent}: {rounds:?}");
            assert!(rounds[rounds.len() - 1].1 > 0.3 * target, "{exponent}: {rounds:?}");
        }
    }
}
