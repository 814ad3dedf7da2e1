//! What error and how many samples a threshold will come to, by what one sample in every few pixels showed.
//!
//! A pixel of contrast c that is divided until cells contribute no more than the threshold T has about 1.27·(c/x)^½ cells along its edge, each of which
//! contributes x, anything from T/4 to T, and has the variance x²/24 if its samples are one pair, ¾ of that if every other cell has
//! two (`docs/ERROR.md`). Over all x, and over the thresholds of pixels, which are spread by a factor of two both ways, that makes
//! 0.02·c^½·T^1.5. A pixel that is not divided has 0.031·c².

use super::divide::FirstLook;
use crate::render::MAX_SPLITS;

/// Bins of contrasts in each octave, the exponent of the lowest, and octaves.
const PER_OCTAVE: f64 = 4.0;
const LOWEST: f64 = -24.0;
const N_BINS: usize = 4 * 40;

/// Variance of a pixel that is not divided, as a share of c², and of one that is, of c^½·T^1.5.
const UNDIVIDED: f64 = 0.031;
const DIVIDED: f64 = 0.02;

/// Variance of a pixel of n uniform samples, as a share of c²·n^−1.5: 0.335² (`docs/ERROR.md`).
const UNIFORM: f64 = 0.11;

/// Samples of a pixel: one that decides and, if it is more than background, three that count, on average. And those that its division adds, as a share
/// of 1.44·(c/T)^½ − 1: at each level three of 1.27·2^level cells more, and three samples in each leaf, one in each cell that is divided again.
const DECIDING: f64 = 1.0;
const COUNTING: f64 = 3.0;
const PER_DIVISION: f64 = 16.5;

/// The largest threshold: black and white are told apart.
const LARGEST_THRESHOLD: f64 = 0.5;

/// Halvings of the range, in octaves, in which a threshold is looked for: to 2⁻¹⁰ of one.
const HALVINGS: usize = 15;

/// Pixels by the contrast that they showed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Foresight {
    bins: [u64; N_BINS],
    n_pixels: u64,
    /// Pixels of the background alone, and of no contrast.
    n_empty: u64,
}

impl Default for Foresight {
    fn default() -> Foresight {
        Foresight { bins: [0; N_BINS], n_pixels: 0, n_empty: 0 }
    }
}

impl Foresight {
    /// The smallest threshold that makes sense: cells of contrast 1 are not divided for less.
    pub const SMALLEST_THRESHOLD: f64 = 1.0 / (1_u64 << (2 * MAX_SPLITS)) as f64;

    /// Notes the square of pixels that a sample stands for, by its edge. An edge crosses it along its length, which is as many pixels; what bends by c over its distance bends by
    /// a square less from pixel to pixel, in all of them.
    pub fn note(&mut self, look: &FirstLook, spacing_px: u32) {
        let (length, area) = (u64::from(spacing_px), u64::from(spacing_px * spacing_px));
        self.n_pixels += area;
        self.n_empty += if look.is_background && look.edge == 0.0 { area } else { 0 };
        let (contrast, n) =
            if look.edge > 0.0 { (look.edge.into(), length) } else { (f64::from(look.bend) / area as f64, area) };
        if contrast > 0.0 {
            let bin = (PER_OCTAVE * (libm::log2(contrast) - LOWEST)).clamp(0.0, (N_BINS - 1) as f64);
            self.bins[bin as usize] += n;
        }
    }

    /// Adds other pixels.
    pub fn add(&mut self, other: &Foresight) {
        self.bins.iter_mut().zip(&other.bins).for_each(|(sum, n)| *sum += n);
        self.n_pixels += other.n_pixels;
        self.n_empty += other.n_empty;
    }

    /// The mean over all pixels of what comes of a contrast.
    fn mean(&self, of: impl Fn(f64) -> f64) -> f64 {
        let middle = |bin: usize| libm::exp2((bin as f64 + 0.5) / PER_OCTAVE + LOWEST);
        let sum: f64 = self.bins.iter().enumerate().map(|(bin, &n)| n as f64 * of(middle(bin))).sum();
        sum / self.n_pixels.max(1) as f64
    }

    /// The root mean square error to expect of adaptive samples by a threshold.
    pub fn rmse(&self, threshold: f64) -> f64 {
        let divided = DIVIDED * threshold * threshold.sqrt();
        self.mean(|contrast| (UNDIVIDED * contrast * contrast).min(divided * contrast.sqrt())).sqrt()
    }

    /// The largest threshold by which an error is to be expected; the smallest of all if none is small enough.
    pub fn threshold(&self, rmse: f64) -> f64 {
        let (mut low, mut high) = (libm::log2(Foresight::SMALLEST_THRESHOLD), libm::log2(LARGEST_THRESHOLD));
        if self.rmse(LARGEST_THRESHOLD) <= rmse {
            return LARGEST_THRESHOLD;
        }
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            let is_enough = self.rmse(libm::exp2(middle)) <= rmse;
            (low, high) = if is_enough { (middle, high) } else { (low, middle) };
        }
        libm::exp2(low)
    }

    /// The samples of a pixel to expect, on average.
    pub fn samples(&self, threshold: f64) -> f64 {
        let more = |contrast: f64| PER_DIVISION * (1.44 * (contrast / threshold).sqrt() - 1.0).max(0.0);
        let share = 1.0 - self.n_empty as f64 / self.n_pixels.max(1) as f64;
        DECIDING + COUNTING * share + self.mean(more)
    }

    /// The root mean square error to expect of so many uniform samples.
    pub fn uniform_rmse(&self, samples: f64) -> f64 {
        (UNIFORM * self.mean(|contrast| contrast * contrast) / (samples * samples.sqrt())).sqrt()
    }

    /// The uniform samples by which an error is to be expected.
    pub fn uniform_samples(&self, rmse: f64) -> f64 {
        libm::pow(self.uniform_rmse(1.0) / rmse, 4.0 / 3.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn edges() -> Foresight {
        let mut foresight = Foresight::default();
        for i in 0..1000 {
            let edge = if i % 10 == 0 { 0.5 } else { 0.0 };
            foresight.note(&FirstLook { edge, bend: 0.0, is_background: i % 10 == 1 }, 1);
        }
        foresight
    }

    #[test]
    fn thresholds_and_samples_bring_the_error_that_they_are_for() {
        let foresight = edges();
        for rmse in [1e-2, 1e-3, 1e-4] {
            let threshold = foresight.threshold(rmse);
            assert!(foresight.rmse(threshold) <= rmse && foresight.rmse(1.01 * threshold) > rmse, "{rmse}");
            let samples = foresight.uniform_samples(rmse);
            // Powers and roots, within 2⁻⁴⁰.
            assert!((foresight.uniform_rmse(samples) / rmse - 1.0).abs() < 1e-12, "{rmse}");
        }
        assert_eq!(foresight.threshold(1.0), 0.5);
        assert_eq!(foresight.threshold(0.0), Foresight::SMALLEST_THRESHOLD);
    }

    #[test]
    fn edges_alone_cost_more_by_lower_thresholds() {
        let foresight = edges();
        // A tenth of the pixels is empty, a tenth has an edge.
        assert_eq!(foresight.samples(0.5 * 4.0), 1.0 + 3.0 * 0.9);
        assert!(foresight.samples(1e-3) > 4.0 * foresight.samples(1e-1));
        let blank = Foresight::default();
        assert_eq!((blank.rmse(0.5), blank.threshold(1e-3), blank.uniform_samples(1e-3)), (0.0, 0.5, 0.0));
    }

    #[test]
    fn what_is_noted_apart_adds_up() {
        let (mut all, mut other) = (edges(), Foresight::default());
        let bent = FirstLook { edge: 0.0, bend: 1e-9, is_background: true };
        (0..50).for_each(|_| other.note(&bent, 2));
        all.add(&other);
        let mut at_once = edges();
        (0..50).for_each(|_| at_once.note(&bent, 2));
        assert_eq!(all, at_once);
    }

    #[test]
    fn a_sample_stands_for_its_square_of_pixels() {
        let (mut near, mut far) = (Foresight::default(), Foresight::default());
        // Along an edge, every other sample of a row in two; and a parabola, which bends four times as much at twice the distance.
        for (edge, bend, n) in [(0.5, 0.0, 8), (0.0, 0.25, 32)] {
            (0..n).for_each(|_| near.note(&FirstLook { edge, bend, is_background: false }, 1));
            let n = if edge > 0.0 { n / 2 } else { n / 4 };
            (0..n).for_each(|_| far.note(&FirstLook { edge, bend: 4.0 * bend, is_background: false }, 2));
        }
        assert_eq!(near.bins, far.bins);
    }
}
