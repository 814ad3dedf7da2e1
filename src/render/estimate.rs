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
    /// Of squared differences of the sixteenths from the mean of their quarter.
    sixteenths: u128,
}

/// Fractions of 1 that a sum counts in: its resolution is 2⁻⁶⁴, that of an RMSE 2⁻³².
const UNIT: f64 = (1u128 << 64) as f64;

/// What is too large to count, or no number, counts as much as there is room for (or nothing).
fn fixed(squared: f64) -> u128 {
    (squared * UNIT) as u128
}

impl Sums {
    /// Notes a pixel by the sums of its samples up to the end of each of four or sixteen equal blocks of `block` samples.
    #[inline]
    pub fn note_blocks(&mut self, prefix: &[DVec3], block: usize) {
        let n_in_quarter = prefix.len() / 4;
        let [q1, half, q3, whole] = [1, 2, 3, 4].map(|quarter| prefix[quarter * n_in_quarter - 1]);
        let share = 1.0 / (block * n_in_quarter) as f64;
        let squared = |difference: DVec3| (difference * share).length_squared();
        self.quarters =
            self.quarters.saturating_add(fixed(squared(q1 - (half - q1)) + squared(q3 - half - (whole - q3))));
        self.halves = self.halves.saturating_add(fixed(0.25 * squared(half - (whole - half))));
        if n_in_quarter == 4 {
            let (mut before, mut squares) = (DVec3::ZERO, 0.0);
            for quarter in prefix.chunks_exact(4) {
                let mean = 0.25 * (quarter[3] - before);
                for &end in quarter {
                    // A block is as long as a quarter of a quarter.
                    squares += squared(4.0 * (end - before - mean));
                    before = end;
                }
            }
            self.sixteenths = self.sixteenths.saturating_add(fixed(squares));
        }
    }

    /// Notes the difference of two independent values of a part of a pixel, which is the mean of both.
    #[inline]
    pub fn note_pair(&mut self, difference: DVec3) {
        self.halves = self.halves.saturating_add(fixed(difference.length_squared()));
    }

    /// Adds the sums of other pixels.
    pub fn add(&mut self, other: &Sums) {
        self.halves = self.halves.saturating_add(other.halves);
        self.quarters = self.quarters.saturating_add(other.quarters);
        self.sixteenths = self.sixteenths.saturating_add(other.sixteenths);
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
    /// With V(n) the variance of the mean of n samples in a row, E(a − b)² = 4(V(n) − V(2n)) for neighbouring blocks of n, and blocks differ from the
    /// mean of four by V(n) − V(4n). Steps of four tell the unknowns of a [`Law`]; steps of two would not, since nets of an odd power
    /// of two are worse on some edges, and better on others, than those of even powers beside them. Samples that are no power of two are several whole blocks, whose
    /// errors are taken to be independent.
    pub fn rmse_of_sequence(&self, n_pixels: usize, n_samples: usize) -> f64 {
        let halves = 0.25 * mean(self.halves, n_pixels);
        let quarters = 0.25 * 0.5 * mean(self.quarters, n_pixels);
        let (n_blocks, block) = block_length(n_samples);
        let law = if n_blocks == 16 {
            let sixteenths = mean(self.sixteenths, n_pixels) / 16.0;
            Law::of(block as f64, sixteenths, quarters + halves)
        } else {
            Law::of_few(block as f64, quarters, halves)
        };
        let blocks = (0..usize::BITS).filter(|bit| n_samples >> bit & 1 != 0).map(|bit| libm::ldexp(1.0, bit as i32));
        let squared: f64 = blocks.map(|n| n * n * law.variance(n)).sum();
        squared.sqrt() / n_samples as f64
    }
}

/// How the variance of a mean falls with the samples.
#[derive(Clone, Copy, Debug)]
enum Law {
    /// As scale·n^−exponent: random samples and nets that are little better.
    Power { scale: f64, exponent: f64 },
    /// As edges·n^−1.5 + smooth·n⁻³: what scrambled nets make of the parts of an image that have edges and of those that are smooth (Owen,
    /// *Scrambled Net Variance for Integrals of Smooth Functions*, 1997).
    Nets { edges: f64, smooth: f64 },
}

const EDGES: f64 = 1.5;
const SMOOTH: f64 = 3.0;

impl Law {
    /// The law by V(n) − V(4n) and V(4n) − V(16n).
    fn of(n: f64, first: f64, second: f64) -> Law {
        let ratio = first / second;
        // Powers of two by libm, so that bits are the same everywhere.
        let (of_edges, of_smooth) = (libm::exp2(2.0 * EDGES), libm::exp2(2.0 * SMOOTH));
        if ratio < of_edges {
            let exponent = (0.5 * libm::log2(ratio)).clamp(1.0, EDGES);
            return Law::Power { scale: second / step(4.0 * n, exponent), exponent };
        }
        if ratio >= of_smooth || second <= 0.0 {
            return Law::Nets { edges: 0.0, smooth: second.max(0.0) / step(4.0 * n, SMOOTH) };
        }
        // What edges have of the second step: the first is 2³ of that and 2⁶ of the rest.
        let share = (of_smooth * second - first) / (of_smooth - of_edges);
        Law::Nets { edges: share / step(4.0 * n, EDGES), smooth: (second - share) / step(4.0 * n, SMOOTH) }
    }

    /// The law by V(n) − V(2n) and V(2n) − V(4n), of which the ratio tells less: below 2 it is less than that of random samples, which only nets that are
    /// unlike each other have; above 2^1.5 too few samples are taken to be smooth.
    fn of_few(n: f64, first: f64, second: f64) -> Law {
        if first + second == 0.0 {
            return Law::Power { scale: 0.0, exponent: EDGES };
        }
        let octaves = libm::log2(first / second);
        let exponent = if octaves < 1.0 { 2.0 - octaves } else { octaves };
        let exponent = exponent.clamp(1.0, EDGES);
        // One sample is worse than the law that more of them follow: across a straight edge by 3/2 (0.41² to 0.335², `docs/ERROR.md`), at random not at all, and
        // in between, for want of more, by as much as the exponent.
        let before = if n == 1.0 { exponent } else { libm::pow(n, -exponent) };
        Law::Power { scale: (first + second) / (before - libm::pow(4.0 * n, -exponent)), exponent }
    }

    fn variance(&self, n: f64) -> f64 {
        match *self {
            Law::Power { scale, exponent } => scale * libm::pow(n, -exponent),
            Law::Nets { edges, smooth } => edges * libm::pow(n, -EDGES) + smooth * libm::pow(n, -SMOOTH),
        }
    }
}

/// n^−exponent − (4n)^−exponent.
fn step(n: f64, exponent: f64) -> f64 {
    libm::pow(n, -exponent) - libm::pow(4.0 * n, -exponent)
}

/// The mean over pixels and channels.
fn mean(sum: u128, n_pixels: usize) -> f64 {
    sum as f64 / UNIT / (3.0 * n_pixels as f64)
}

/// How many blocks of a pixel's samples are compared, and samples of each, if they tell an error: a sequence of which every block is as
/// good as the next, of at least four samples.
pub fn blocks_of(sampler: Sampler, n_samples: usize) -> Option<(usize, usize)> {
    let is_sequence = matches!(sampler, Sampler::Random | Sampler::Sobol);
    (is_sequence && n_samples >= 4).then(|| block_length(n_samples))
}

/// Sixteen, if there are as many samples, or four; and the largest power of two of which there are so many: blocks of other lengths are no nets.
fn block_length(n_samples: usize) -> (usize, usize) {
    let n_blocks = if n_samples < 16 { 4 } else { 16 };
    (n_blocks, 1 << (n_samples / n_blocks).max(1).ilog2())
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

    /// The sums of a pixel of 4ᵏ·`block` samples, in one channel, whose means of neighbouring blocks differ by what V(n) makes them at every
    /// length.
    fn sums_of(n_blocks: usize, block: usize, variance: impl Fn(f64) -> f64) -> Sums {
        let mut means = vec![0.0];
        let mut length = (n_blocks * block) as f64;
        while means.len() < n_blocks {
            length *= 0.5;
            // Halves of a mean lie on both sides of it.
            let off = (variance(length) - variance(2.0 * length)).sqrt();
            means = means.iter().flat_map(|mean| [mean + off, mean - off]).collect();
        }
        let mut sum = DVec3::ZERO;
        let prefix: Vec<DVec3> = means
            .iter()
            .map(|mean| {
                sum.x += block as f64 * mean;
                sum
            })
            .collect();
        let mut sums = Sums::default();
        sums.note_blocks(&prefix, block);
        sums
    }

    #[test]
    fn blocks_tell_the_law_that_they_follow() {
        let powers = [1.0_f64, 1.25, 1.5, 3.0].map(|exponent| (1.0, exponent, 0.0));
        for (a, k, b) in powers.into_iter().chain([(1.0, 1.5, 0.5), (0.1, 1.5, 4.0), (1.0, 1.5, 100.0)]) {
            let variance = |n: f64| a * n.powf(-k) + b * n.powi(-3);
            let expected = (variance(32.0) / 3.0).sqrt();
            let found = sums_of(16, 2, variance).rmse_of_sequence(1, 32);
            assert!((found / expected - 1.0).abs() < 1e-12, "{a}·n^−{k} + {b}·n⁻³: {found} for {expected}");
        }
        for k in [1.0_f64, 1.25, 1.5] {
            let variance = |n: f64| n.powf(-k);
            let expected = (variance(8.0) / 3.0).sqrt();
            let found = sums_of(4, 2, variance).rmse_of_sequence(1, 8);
            assert!((found / expected - 1.0).abs() < 1e-12, "{k}: {found} for {expected}");
        }
        assert_eq!([8, 64].map(|n| Sums::default().rmse_of_sequence(1, n)), [0.0; 2]);
    }

    #[test]
    fn odd_powers_of_two_that_are_unlike_even_ones_do_not_mislead() {
        // As scrambled nets see edges of slope 2: steps of 2 and of 4.
        let even = |n: f64| if (n.log2() as i32) % 2 == 0 { n.powf(-1.5) } else { 1.4 * n.powf(-1.5) };
        let odd = |n: f64| if (n.log2() as i32) % 2 == 0 { 1.4 * n.powf(-1.5) } else { n.powf(-1.5) };
        for variance in [even, odd] {
            for (n_blocks, block) in [(4, 2), (16, 1), (16, 2), (16, 4)] {
                let n = n_blocks * block;
                let ratio =
                    sums_of(n_blocks, block, variance).rmse_of_sequence(1, n) / (variance(n as f64) / 3.0).sqrt();
                assert!((0.8..1.25).contains(&ratio), "{ratio} at {n}");
            }
        }
    }

    #[test]
    fn only_sequences_of_four_and_more_are_compared() {
        assert_eq!(blocks_of(Sampler::Sobol, 4), Some((4, 1)));
        assert_eq!(blocks_of(Sampler::Random, 11), Some((4, 2)));
        assert_eq!(blocks_of(Sampler::Sobol, 31), Some((16, 1)));
        assert_eq!(blocks_of(Sampler::Sobol, 3), None);
        assert!([Sampler::Center, Sampler::Grid, Sampler::Jitter].iter().all(|&it| blocks_of(it, 64).is_none()));
    }
}
