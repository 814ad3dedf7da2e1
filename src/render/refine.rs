//! Rounds of adaptive samples until the image's estimated error meets a target.
//!
//! Every round renders the image anew, so that nothing is kept for pixels, and costs about as much more than the one before as
//! the threshold is lowered: the last one is most of the work. Where edges make the error, it falls as threshold^¾: the number
//! of leaves along an edge of contrast c is (c/threshold)^½, and each brings a variance of threshold²/6 or less.

use std::sync::atomic::Ordering;

use super::{Adaptive, Control, Counts, MAX_SPLITS, Settings, Spread, Stopped, render_into};
use crate::accel::Accel;
use crate::film::Film;
use crate::world::{Camera, World};

/// An image refined to a target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Refined {
    /// What all rounds took, and the error of the last.
    pub counts: Counts,
    /// The threshold of the last round.
    pub threshold: f64,
    /// Rounds.
    pub n_rounds: u32,
}

/// The exponent with which error falls with the threshold along edges, and the range that what is measured is held to.
const EDGE_EXPONENT: f64 = 0.75;
const EXPONENTS: (f64, f64) = (0.35, 1.2);

/// Share of the target that a round aims at, so that few have to be repeated for a little.
const AIM: f64 = 0.95;

/// The error falls by no more than this from one round to the next: a round then costs at most nine times as much, and what is
/// told by the last is not stretched too far.
const MAX_GAIN: f64 = 24.0;

/// Rounds at most. Ten gains of two are a thousand; where the last divisions allowed do not meet the target, more rounds do not.
const MAX_ROUNDS: u32 = 16;

/// The threshold of the first round: that which would meet the target, were one pixel in two hundred crossed by an edge of
/// contrast 1 (of 4/π·2ᵏ leaves at k divisions, with a variance of a sixth, halved by two samples), but no more than half.
fn first_threshold(target_rmse: f64) -> f64 {
    let crossed = 1.0 / 200.0;
    let per_edge = crossed * 4.0 / std::f64::consts::PI / 12.0;
    libm::pow(target_rmse * target_rmse / per_edge, 1.0 / (2.0 * EDGE_EXPONENT)).min(0.5)
}

/// The threshold of the round after one of a threshold and an error, which may follow one that told how error falls.
pub fn next_threshold(target_rmse: f64, rounds: &[(f64, f64)]) -> f64 {
    let Some(&(threshold, rmse)) = rounds.last() else { return first_threshold(target_rmse) };
    let exponent = match rounds.len().checked_sub(2).map(|before| rounds[before]) {
        Some((threshold_before, rmse_before)) if rmse > 0.0 && threshold < threshold_before => {
            libm::log(rmse_before / rmse) / libm::log(threshold_before / threshold)
        }
        _ => EDGE_EXPONENT,
    };
    let gain = (rmse / (AIM * target_rmse)).clamp(1.0 / AIM, MAX_GAIN);
    threshold * libm::pow(gain, -1.0 / exponent.clamp(EXPONENTS.0, EXPONENTS.1))
}

/// Renders with ever more samples until the estimate of the root mean square error is at most `target_rmse`, which is above
/// 0, or cells cannot be divided further. The spread of the settings has no meaning.
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
    let mut rounds: Vec<(f64, f64)> = Vec::new();
    let mut total = Counts::default();
    let smallest = libm::ldexp(1.0, -2 * MAX_SPLITS as i32);
    loop {
        let threshold = next_threshold(target_rmse, &rounds);
        let round = rounds.len() as u64;
        // Every round has samples of its own.
        let seed = settings.seed.wrapping_add(round << 48);
        let spread = Spread::Adaptive(Adaptive::new(threshold));
        let settings = Settings { spread, seed, ..settings.clone() };
        control.tiles_done.store(0, Ordering::Relaxed);
        let counts = render_into(world, accel, camera, &settings, control, film, &|_| {})?;
        total.add_round(&counts);
        let rmse = counts.rmse_estimate.unwrap_or(0.0);
        rounds.push((threshold, rmse));
        let n_rounds = rounds.len() as u32;
        if rmse <= target_rmse || n_rounds == MAX_ROUNDS || threshold < smallest {
            return Ok(Refined { counts: total, threshold, n_rounds });
        }
    }
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
