//! Exact numbers m·2ᵉ with an integer m of any size: every finite f64 is one, and sums and products of them are too.
//!
//! This is the tier that is always right. It allocates and takes microseconds; only input within a few roundings of a
//! tie reaches it.

use std::cmp::Ordering;

use num_bigint::{BigInt, BigUint, Sign};

use super::ratio::Parameter;

/// `mantissa * 2^exponent`.
#[derive(Clone, Debug)]
pub struct Dyadic {
    mantissa: BigInt,
    exponent: i64,
}

/// Bits kept of a quotient or root before it is rounded to f64, so that the rounding of the last step dominates.
const GUARDED_BITS: i64 = 120;

impl Dyadic {
    /// The exact value of a finite f64.
    ///
    /// # Panics
    /// In debug builds, when `x` is not finite.
    pub fn new(x: f64) -> Dyadic {
        debug_assert!(x.is_finite());
        let bits = x.to_bits();
        let biased = (bits >> 52 & 0x7ff) as i64;
        let fraction = bits & ((1 << 52) - 1);
        let (magnitude, exponent) = if biased == 0 { (fraction, -1074) } else { (fraction | 1 << 52, biased - 1075) };
        let mantissa = BigInt::from(magnitude);
        Dyadic { mantissa: if x < 0.0 { -mantissa } else { mantissa }, exponent }
    }

    /// −1, 0 or 1.
    pub fn sign(&self) -> i32 {
        match self.mantissa.sign() {
            Sign::Minus => -1,
            Sign::NoSign => 0,
            Sign::Plus => 1,
        }
    }

    /// The sum.
    pub fn add(&self, other: &Dyadic) -> Dyadic {
        let exponent = self.exponent.min(other.exponent);
        let at = |x: &Dyadic| &x.mantissa << (x.exponent - exponent) as u64;
        Dyadic { mantissa: at(self) + at(other), exponent }
    }

    /// The negative.
    pub fn neg(&self) -> Dyadic {
        Dyadic { mantissa: -&self.mantissa, exponent: self.exponent }
    }

    /// The difference.
    pub fn sub(&self, other: &Dyadic) -> Dyadic {
        self.add(&other.neg())
    }

    /// The product.
    pub fn mul(&self, other: &Dyadic) -> Dyadic {
        Dyadic { mantissa: &self.mantissa * &other.mantissa, exponent: self.exponent + other.exponent }
    }

    /// The product with 2^exponent.
    pub fn times_power_of_two(self, exponent: i64) -> Dyadic {
        Dyadic { exponent: self.exponent + exponent, ..self }
    }

    /// The e with 2^e ≤ |x| < 2^(e + 1); of zero it means nothing.
    pub fn magnitude_exponent(&self) -> i64 {
        self.exponent + self.mantissa.bits() as i64 - 1
    }

    /// The dot product of two vectors.
    pub fn dot(a: &[Dyadic; 3], b: &[Dyadic; 3]) -> Dyadic {
        a[0].mul(&b[0]).add(&a[1].mul(&b[1])).add(&a[2].mul(&b[2]))
    }

    /// The cross product of two vectors.
    pub fn cross(a: &[Dyadic; 3], b: &[Dyadic; 3]) -> [Dyadic; 3] {
        let component = |i: usize, j: usize| a[i].mul(&b[j]).sub(&a[j].mul(&b[i]));
        [component(1, 2), component(2, 0), component(0, 1)]
    }

    /// A vector of finite components.
    pub fn vector(v: glam::DVec3) -> [Dyadic; 3] {
        v.to_array().map(Dyadic::new)
    }

    /// `a - b` of vectors.
    pub fn difference(a: &[Dyadic; 3], b: &[Dyadic; 3]) -> [Dyadic; 3] {
        [a[0].sub(&b[0]), a[1].sub(&b[1]), a[2].sub(&b[2])]
    }

    /// The quotient with at least 120 correct bits; `None` when the divisor is zero.
    pub fn guarded_quotient(&self, divisor: &Dyadic) -> Option<Dyadic> {
        if divisor.sign() == 0 {
            return None;
        }
        let excess = self.mantissa.bits() as i64 - divisor.mantissa.bits() as i64;
        let shift = (GUARDED_BITS - excess).max(0);
        let mantissa = (&self.mantissa << shift as u64) / &divisor.mantissa;
        Some(Dyadic { mantissa, exponent: self.exponent - divisor.exponent - shift })
    }

    /// The square root of a non-negative number with at least 120 correct bits; exact for squares of
    /// numbers shorter than that.
    pub fn guarded_sqrt(&self) -> Dyadic {
        debug_assert!(self.sign() >= 0);
        let wanted = (2 * GUARDED_BITS - self.mantissa.bits() as i64).max(0);
        let shift = wanted + ((self.exponent - wanted) & 1);
        let root: BigUint = (self.mantissa.magnitude() << shift as u64).sqrt();
        Dyadic { mantissa: root.into(), exponent: (self.exponent - shift) / 2 }
    }

    /// The number as a ray parameter: the nearest f64, and what that leaves.
    pub fn to_parameter(&self) -> Parameter {
        let t = self.to_f64();
        let rest = if t.is_finite() { self.sub(&Dyadic::new(t)).to_f64() } else { 0.0 };
        Parameter::new(t, rest)
    }

    /// The nearest f64, ties to even; ±∞ beyond its range.
    pub fn to_f64(&self) -> f64 {
        let magnitude = self.mantissa.magnitude();
        let bits = magnitude.bits() as i64;
        if bits == 0 {
            return 0.0;
        }
        // Keep as many bits as f64 has at this magnitude (fewer when denormal), round once to nearest even.
        let top_exponent = self.exponent + bits - 1;
        if top_exponent > 1023 {
            return f64::INFINITY.copysign(f64::from(self.sign()));
        }
        let lowest = (top_exponent - 52).max(-1074);
        let drop = lowest - self.exponent;
        let kept = if drop <= 0 { magnitude << (-drop) as u64 } else { round_to_even(magnitude, drop as u64) };
        let kept = u64::try_from(&kept).unwrap_or(u64::MAX);
        // `kept` has at most 54 bits and is exact in f64; two steps keep the power of two in range.
        let half = lowest / 2;
        let value = kept as f64 * power_of_two(half) * power_of_two(lowest - half);
        value.copysign(f64::from(self.sign()))
    }
}

fn round_to_even(magnitude: &BigUint, drop: u64) -> BigUint {
    let kept = magnitude >> drop;
    let rest = magnitude - (&kept << drop);
    let half = BigUint::from(1u32) << (drop - 1);
    let up = match rest.cmp(&half) {
        Ordering::Greater => true,
        Ordering::Equal => kept.bit(0),
        Ordering::Less => false,
    };
    if up { kept + 1u32 } else { kept }
}

/// 2ᵉ for exponents of normal numbers.
fn power_of_two(exponent: i64) -> f64 {
    debug_assert!((-1022..=1023).contains(&exponent));
    f64::from_bits(((exponent + 1023) as u64) << 52)
}

impl PartialEq for Dyadic {
    fn eq(&self, other: &Dyadic) -> bool {
        self.sub(other).sign() == 0
    }
}

impl PartialOrd for Dyadic {
    fn partial_cmp(&self, other: &Dyadic) -> Option<Ordering> {
        Some(self.sub(other).sign().cmp(&0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_f64_survives_the_round_trip() {
        let mut x = 5e-324;
        while x < f64::MAX {
            assert_eq!(Dyadic::new(x).to_f64().to_bits(), x.to_bits(), "{x:e}");
            assert_eq!(Dyadic::new(-x).to_f64().to_bits(), (-x).to_bits(), "{x:e}");
            x *= 7.3;
        }
        assert_eq!(Dyadic::new(f64::MAX).to_f64(), f64::MAX);
        assert_eq!(Dyadic::new(f64::MAX).mul(&Dyadic::new(2.0)).to_f64(), f64::INFINITY);
    }

    #[test]
    fn rounding_is_to_nearest_even() {
        let half_ulp = Dyadic::new(f64::EPSILON / 2.0);
        assert_eq!(Dyadic::new(1.0).add(&half_ulp).to_f64(), 1.0);
        assert_eq!(Dyadic::new(1.0 + f64::EPSILON).add(&half_ulp).to_f64(), 1.0 + 2.0 * f64::EPSILON);
        let more = half_ulp.add(&Dyadic::new(5e-324));
        assert_eq!(Dyadic::new(1.0).add(&more).to_f64(), 1.0 + f64::EPSILON);
        // 2^-1075 is half of the smallest denormal: ties to even, which is zero.
        assert_eq!(Dyadic::new(5e-324).mul(&Dyadic::new(0.5)).to_f64(), 0.0);
        assert_eq!(Dyadic::new(5e-324).mul(&Dyadic::new(0.75)).to_f64(), 5e-324);
    }

    #[test]
    fn quotients_and_roots_agree_with_correctly_rounded_f64() {
        for (a, b) in [(1.0, 3.0), (-2.0, 7.0), (1e300, 1e-5), (1e-300, 3e7), (6.0, 3.0)] {
            let quotient = Dyadic::new(a).guarded_quotient(&Dyadic::new(b));
            assert_eq!(quotient.map(|q| q.to_f64()), Some(a / b));
        }
        assert!(Dyadic::new(1.0).guarded_quotient(&Dyadic::new(0.0)).is_none());
        for x in [0.0, 2.0, 9.0, 1e-301, 1e301, 0.1] {
            assert_eq!(Dyadic::new(x).guarded_sqrt().to_f64(), f64::sqrt(x));
        }
    }
}
