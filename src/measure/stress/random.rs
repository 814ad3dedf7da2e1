//! Random numbers of a case: the same on every machine, whatever ran before it.

use glam::{DVec3, dvec3};

/// SplitMix64 (Steele, Lea and Flood 2014): one multiplication chain per number, any seed is good.
#[derive(Clone, Debug)]
pub struct Random {
    state: u64,
}

fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

impl Random {
    /// The numbers of case `index` of a stream of a seed.
    pub fn new(seed: u64, stream: &str, index: u64) -> Random {
        let name = stream.bytes().fold(0xcbf2_9ce4_8422_2325, |hash, byte| mix(hash ^ u64::from(byte)));
        Random { state: mix(mix(seed ^ name).wrapping_add(index.wrapping_mul(0x9e37_79b9_7f4a_7c15))) }
    }

    /// 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        mix(self.state)
    }

    /// A number in [0, 1), a multiple of 2⁻⁵³.
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 * (f64::EPSILON / 2.0)
    }

    /// A number between two bounds.
    pub fn uniform(&mut self, lo: f64, hi: f64) -> f64 {
        lo + (hi - lo) * self.unit()
    }

    /// A number between two positive bounds, every factor as likely as every other.
    pub fn log_uniform(&mut self, lo: f64, hi: f64) -> f64 {
        lo * libm::exp(self.unit() * libm::log(hi / lo))
    }

    /// A power of two with an exponent between two bounds, both included.
    pub fn power_of_two(&mut self, lo: i32, hi: i32) -> f64 {
        libm::ldexp(1.0, self.integer(i64::from(lo), i64::from(hi)) as i32)
    }

    /// A whole number between two bounds, both included.
    pub fn integer(&mut self, lo: i64, hi: i64) -> i64 {
        lo + self.below((hi - lo) as u64 + 1) as i64
    }

    /// A whole number below `n`.
    pub fn below(&mut self, n: u64) -> u64 {
        ((u128::from(self.bits()) * u128::from(n)) >> 64) as u64
    }

    /// Whether something of a probability happens.
    pub fn chance(&mut self, probability: f64) -> bool {
        self.unit() < probability
    }

    /// −1 or 1.
    pub fn sign(&mut self) -> f64 {
        if self.chance(0.5) { -1.0 } else { 1.0 }
    }

    /// A point of the cube [−1, 1]³.
    pub fn in_cube(&mut self) -> DVec3 {
        dvec3(self.uniform(-1.0, 1.0), self.uniform(-1.0, 1.0), self.uniform(-1.0, 1.0))
    }

    /// A unit vector, all directions equally likely.
    pub fn direction(&mut self) -> DVec3 {
        loop {
            let v = self.in_cube();
            if (0.01..1.0).contains(&v.length_squared()) {
                return v.normalize();
            }
        }
    }

    /// A unit vector at a right angle to another.
    pub fn perpendicular(&mut self, to: DVec3) -> DVec3 {
        loop {
            if let Some(v) = self.direction().cross(to).try_normalize() {
                return v;
            }
        }
    }

    /// A point of a small integer grid.
    pub fn grid(&mut self, reach: i64) -> DVec3 {
        dvec3(
            self.integer(-reach, reach) as f64,
            self.integer(-reach, reach) as f64,
            self.integer(-reach, reach) as f64,
        )
    }

    /// One of several.
    pub fn pick<T: Copy>(&mut self, from: &[T]) -> Option<T> {
        from.get(self.below(from.len().max(1) as u64) as usize).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_case_has_its_own_numbers_whatever_ran_before() {
        let first = |seed, stream, index| Random::new(seed, stream, index).bits();
        assert_eq!(first(1, "sphere", 7), first(1, "sphere", 7));
        let all = [first(1, "sphere", 7), first(2, "sphere", 7), first(1, "quadric", 7), first(1, "sphere", 8)];
        assert!((0..4).all(|i| (0..i).all(|j| all[i] != all[j])));
    }

    #[test]
    fn numbers_keep_to_their_bounds() {
        let mut random = Random::new(3, "bounds", 0);
        for _ in 0..1000 {
            assert!((2.0..=1e7).contains(&random.log_uniform(2.0, 1e7)));
            assert!((-3..=3).contains(&random.integer(-3, 3)));
            assert!((random.direction().length() - 1.0).abs() < 1e-15);
        }
    }
}
