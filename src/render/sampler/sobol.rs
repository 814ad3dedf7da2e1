//! The first two dimensions of Sobol's sequence, scrambled as Owen does, by a hash.
//!
//! The two dimensions are van der Corput's sequence and the one whose matrix is Pascal's triangle modulo 2; together they are
//! a (0, 2)-sequence: any 2ᵐ points in a row from a multiple of 2ᵐ have one in each of the 2ᵐ boxes of any one shape 2⁻ᵏ × 2ᵏ⁻ᵐ (Sobol'
//! 1967; Niederreiter 1987). Owen's nested uniform scrambling (Owen, *Randomly Permuted (t, m, s)-Nets and (t, s)-Sequences*, 1995) keeps
//! that and makes every point uniform, so that means are unbiased. A hash in which a bit depends on the bits below it alone is such a
//! scramble of numbers whose bits stand in reversed order (Laine and Karras, *Stratified Sampling for Stochastic Transparency*, 2011; Burley,
//! *Practical Hash-based Owen Scrambling*, JCGT 9 (4), 2020). Its constants are those that Vegdahl searched (*Building a Better LK
//! Hash*, 2021).

/// The second dimension of a point, its bits in reversed order; the first is the index itself.
pub fn second(index: u32) -> u32 {
    // Pascal's triangle modulo 2 is the fifth Kronecker power of its first two rows: five steps, each of which adds every
    // upper half of 2·s bits to its lower half.
    let steps = [(1, 0x5555_5555), (2, 0x3333_3333), (4, 0x0f0f_0f0f), (8, 0x00ff_00ff), (16, 0x0000_ffff)];
    steps.iter().fold(index, |bits, (shift, lower)| bits ^ (bits >> shift) & lower)
}

/// A coordinate in [0, 1) as a fraction of 2³², from bits in reversed order.
#[inline]
pub fn scrambled(reversed: u32, seed: u32) -> u32 {
    let mut x = reversed;
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul(seed >> 16 | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^= x.wrapping_mul(0x53a2_2864);
    x.reverse_bits()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_points_are_sobols() {
        let point = |index: u32| [index, second(index)].map(|bits| f64::from(bits.reverse_bits()) / 4_294_967_296.0);
        let expected = [[0.0, 0.0], [0.5, 0.5], [0.25, 0.75], [0.75, 0.25], [0.125, 0.625], [0.625, 0.125]];
        assert!((0..6).all(|index| point(index) == expected[index as usize]));
    }

    #[test]
    fn every_block_of_points_is_a_net_however_it_is_scrambled() {
        for seed in [0, 1, 0x9e37_79b9, u32::MAX] {
            for m in [1, 4, 7] {
                for first in [0, 1 << m, 5 << m] {
                    let points: Vec<[u32; 2]> = (first..first + (1 << m))
                        .map(|i| [scrambled(i, seed), scrambled(second(i), seed.rotate_left(7) ^ 0x55)])
                        .collect();
                    for k in 0..=m {
                        let cell = |[x, y]: [u32; 2]| {
                            let (x, y) = (u64::from(x) << k >> 32, u64::from(y) << (m - k) >> 32);
                            (x << (m - k) | y) as usize
                        };
                        let mut taken = vec![false; 1 << m];
                        points.iter().for_each(|&point| taken[cell(point)] = true);
                        assert!(
                            taken.iter().all(|&taken| taken),
                            "seed {seed:x}, {first}, 2^{k} columns of 2^{m} cells"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn scrambled_points_are_uniform_and_their_dimensions_apart() {
        // The means of x, y, x·y and x² over many seeds of one point, each within five of its standard deviations.
        let n = 1 << 16;
        let mut sums = [0.0; 4];
        for seed in 0..n {
            let hash = crate::render::sampler::mix(seed);
            let [x, y] = [scrambled(5, hash as u32), scrambled(second(5), (hash >> 32) as u32)]
                .map(|bits| f64::from(bits) / 4_294_967_296.0);
            sums.iter_mut().zip([x, y, x * y, x * x]).for_each(|(sum, value)| *sum += value);
        }
        let deviations = [1.0_f64 / 12.0, 1.0 / 12.0, 7.0 / 144.0, 4.0 / 45.0];
        for ((sum, expected), variance) in sums.into_iter().zip([0.5, 0.5, 0.25, 1.0 / 3.0]).zip(deviations) {
            let error = (sum / n as f64 - expected).abs();
            assert!(error < 5.0 * (variance / n as f64).sqrt(), "{error} of {expected}");
        }
    }
}
