//! What the sampling error of an image is, told by its own samples.
//!
//! Both estimates compare values of a pixel that were found independently, and both are sums over all pixels in fixed point, so that
//! no order of tiles changes a bit of them (`docs/ERROR.md` derives them).

use glam::DVec3;

use super::Sampler;

/// Sums over pixels and channels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sums {
    /// Of squared differences between the means of the first and of the second half of a pixel's samples, or of pairs.
    halves: u128,
    /// The same between the quarters of each half.
    quarters: u128,
}

/// Fractions of 1 that a sum counts in: its resolution is 2⁻⁶⁴, that of an RMSE 2⁻³².
const UNIT: f64 = (1u128 << 64) as f64;

/// What is too large to count, or no number, counts as much as there is room for (or nothing).
fn fixed(squared: f64) -> u128 {
    ((squared * UNIT) as u128).min(u128::MAX >> 32)
}

impl Sums {
    /// Notes a pixel by the sums of its samples up to the end of each of four equal blocks of `block` samples.
    #[inline]
    pub fn note_blocks(&mut self, prefix: &[DVec3; 4], block: usize) {
        let [q1, half, q3, whole] = *prefix;
        let share = 1.0 / block as f64;
        let squared = |difference: DVec3| (difference * share).length_squared();
        self.quarters += fixed(squared(q1 - (half - q1)) + squared(q3 - half - (whole - q3)));
        self.halves += fixed(0.25 * squared(half - (whole - half)));
    }

    /// Notes the difference of two independent values of a part of a pixel, which is the mean of both.
    #[inline]
    pub fn note_pair(&mut self, difference: DVec3) {
        self.halves += fixed(difference.length_squared());
    }

    /// Adds the sums of other pixels.
    pub fn add(&mut self, other: &Sums) {
        self.halves = self.halves.saturating_add(other.halves);
        self.quarters = self.quarters.saturating_add(other.quarters);
    }

    /// The root mean square error over the channels of pixels of whose parts one in `one_in` was noted as a pair.
    pub fn rmse_of_pairs(&self, n_pixels: usize, one_in: u64) -> f64 {
        // The variance of a difference is twice that of a value and four times that of the mean of two. Each pair stands
        // for itself and for one_in − 1 single values.
        let variance_of_pair = 0.25 + 0.5 * (one_in - 1) as f64;
        (variance_of_pair * mean(self.halves, n_pixels)).sqrt()
    }

    /// The root mean square error over the channels of pixels of `n_samples` in a sequence.
    ///
    /// With V(n) the variance of the mean of n samples in a row, E(a − b)² = 4(V(n) − V(2n)) for neighbouring blocks of n. Where
    /// V falls as n^−α, blocks of n and 2n tell α, and so V(4n).
    pub fn rmse_of_sequence(&self, n_pixels: usize, n_samples: usize) -> f64 {
        let halves = mean(self.halves, n_pixels);
        let quarters = 0.5 * mean(self.quarters, n_pixels);
        let alpha = if halves > 0.0 { libm::log2(quarters / halves) } else { ALPHA_OF_RANDOM };
        let alpha = alpha.clamp(ALPHA_OF_RANDOM, ALPHA_OF_SMOOTH);
        let compared = n_samples / 4 * 4;
        let variance = halves / (4.0 * (libm::pow(2.0, alpha) - 1.0));
        (variance * libm::pow(compared as f64 / n_samples as f64, alpha)).sqrt()
    }
}

/// The mean over pixels and channels.
fn mean(sum: u128, n_pixels: usize) -> f64 {
    sum as f64 / UNIT / (3.0 * n_pixels as f64)
}

/// Variance falls as n⁻¹ for random samples, and no faster than n⁻³ for scrambled nets (Owen 1997).
const ALPHA_OF_RANDOM: f64 = 1.0;
const ALPHA_OF_SMOOTH: f64 = 3.0;

/// Samples of a pixel in each of the four blocks that are compared, if they tell an error: a sequence of which every block is as
/// good as the next, of at least four samples.
pub fn block_of(sampler: Sampler, n_samples: usize) -> Option<usize> {
    let is_sequence = matches!(sampler, Sampler::Random | Sampler::Sobol);
    (is_sequence && n_samples >= 4).then_some(n_samples / 4)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_of_pairs_are_what_the_squares_are() {
        let mut sums = Sums::default();
        sums.note_pair(DVec3::new(0.5, 0.0, 0.25));
        sums.note_pair(DVec3::ZERO);
        assert_eq!(sums.rmse_of_pairs(2, 1), (0.25_f64 * (0.25 + 0.0625) / 6.0).sqrt());
        // One part of two values stands for three of one, whose variance is twice as large.
        assert_eq!(sums.rmse_of_pairs(2, 4), ((0.25 + 1.5_f64) * (0.25 + 0.0625) / 6.0).sqrt());
        let mut twice = sums;
        twice.add(&sums);
        assert_eq!(twice.rmse_of_pairs(4, 1), sums.rmse_of_pairs(2, 1));
    }

    #[test]
    fn what_is_no_number_is_not_counted_and_what_is_infinite_is_not_lost() {
        let mut sums = Sums::default();
        sums.note_pair(DVec3::splat(f64::NAN));
        assert_eq!(sums, Sums::default());
        sums.note_pair(DVec3::X * f64::INFINITY);
        sums.note_pair(DVec3::splat(f64::INFINITY));
        sums.add(&sums.clone());
        assert!(sums.rmse_of_pairs(1, 1) > 1e9);
    }

    #[test]
    fn blocks_tell_the_law_that_they_follow() {
        // Blocks as different as V(n) = n^−α makes them: E(a − b)² = 4(V(n) − V(2n)), all in one channel.
        for alpha in [1.0, 1.5, 2.0, 3.0] {
            let variance = |n: f64| n.powf(-alpha);
            let sibling = |n: f64| (4.0 * (variance(n) - variance(2.0 * n))).sqrt();
            let (quarter, half) = (sibling(2.0), sibling(4.0));
            // First half: quarters at ±quarter/2 around half/2; second half around −half/2.
            let means = [half + quarter, half - quarter, quarter - half, -quarter - half].map(|twice| 0.5 * twice);
            let mut sum = DVec3::ZERO;
            let prefix = means.map(|mean| {
                sum.x += 2.0 * mean;
                sum
            });
            let mut sums = Sums::default();
            sums.note_blocks(&prefix, 2);
            let expected = (variance(8.0) / 3.0).sqrt();
            let found = sums.rmse_of_sequence(1, 8);
            assert!((found / expected - 1.0).abs() < 1e-9, "{alpha}: {found} for {expected}");
        }
    }

    #[test]
    fn only_sequences_of_four_and_more_are_compared() {
        assert_eq!(block_of(Sampler::Sobol, 4), Some(1));
        assert_eq!(block_of(Sampler::Random, 11), Some(2));
        assert_eq!(block_of(Sampler::Sobol, 3), None);
        assert!([Sampler::Center, Sampler::Grid, Sampler::Jitter].iter().all(|&it| block_of(it, 64).is_none()));
    }
}
