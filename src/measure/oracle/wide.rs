//! f64 with an unbounded exponent: sizes of errors, after the exact part is done.

use std::ops::{Add, Mul, Neg};

use num_bigint::{BigInt, Sign};

/// `m · 2^e` with 1 ≤ |m| < 2, or zero. Every operation is right to a few 2⁻⁵³.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wide {
    m: f64,
    e: i64,
}

impl Wide {
    /// Zero.
    pub const ZERO: Wide = Wide { m: 0.0, e: 0 };

    /// m·2ᵉ for a finite m.
    pub fn new(m: f64, e: i64) -> Wide {
        if m == 0.0 {
            return Wide::ZERO;
        }
        // A denormal is first made normal.
        let (m, e) = if m.abs() < f64::MIN_POSITIVE { (m * TWO_64, e - 64) } else { (m, e) };
        let bits = m.to_bits();
        let own = ((bits >> 52) & 0x7ff) as i64 - 1023;
        Wide { m: f64::from_bits(bits & !(0x7ff << 52) | 1023 << 52), e: e + own }
    }

    /// An integer times 2ᵉ, to 53 bits.
    pub fn integer(n: &BigInt, e: i64) -> Wide {
        let magnitude = n.magnitude();
        let drop = magnitude.bits().saturating_sub(64);
        let top = (magnitude >> drop).iter_u64_digits().next().unwrap_or(0);
        let m = if n.sign() == Sign::Minus { -(top as f64) } else { top as f64 };
        Wide::new(m, e + drop as i64)
    }

    /// The quotient; zero when the divisor is zero.
    pub fn over(self, other: Wide) -> Wide {
        if other.m == 0.0 { Wide::ZERO } else { Wide::new(self.m / other.m, self.e - other.e) }
    }

    /// The square root of a number that is not negative.
    pub fn sqrt(self) -> Wide {
        let odd = self.e.rem_euclid(2);
        Wide::new(libm::ldexp(self.m, odd as i32).sqrt(), (self.e - odd) / 2)
    }

    /// Whether it is below zero.
    pub fn is_negative(self) -> bool {
        self.m < 0.0
    }

    /// The f64; ±∞ or a denormal or zero beyond its range.
    pub fn to_f64(self) -> f64 {
        libm::ldexp(self.m, self.e.clamp(-2000, 2000) as i32)
    }
}

impl Add for Wide {
    type Output = Wide;

    fn add(self, other: Wide) -> Wide {
        let (big, small) =
            if self.m == 0.0 || (other.m != 0.0 && other.e > self.e) { (other, self) } else { (self, other) };
        let shift = small.e - big.e;
        if small.m == 0.0 || shift < -200 {
            return big;
        }
        Wide::new(big.m + libm::ldexp(small.m, shift as i32), big.e)
    }
}

impl Mul for Wide {
    type Output = Wide;

    fn mul(self, other: Wide) -> Wide {
        Wide::new(self.m * other.m, self.e + other.e)
    }
}

impl Neg for Wide {
    type Output = Wide;

    fn neg(self) -> Wide {
        Wide { m: -self.m, e: self.e }
    }
}

const TWO_64: f64 = (1u128 << 64) as f64;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arithmetic_agrees_with_f64_and_leaves_its_range() {
        let wide = |x: f64| Wide::new(x, 0);
        for (a, b) in [(3.0, 7.0), (-1e10, 3e-7), (1e300, 1e-300), (0.0, 2.0), (5e-324, 1.5)] {
            assert_eq!((wide(a) + wide(b)).to_f64(), a + b);
            assert_eq!((wide(a) * wide(b)).to_f64(), a * b);
            assert_eq!(wide(a).over(wide(b)).to_f64(), a / b);
        }
        assert_eq!(wide(2.0).sqrt().to_f64(), 2f64.sqrt());
        assert_eq!(wide(8.0).sqrt().to_f64(), 8f64.sqrt());
        let huge = Wide::integer(&(BigInt::from(-5) << 5000u32), 0);
        assert_eq!((huge * Wide::new(1.0, -5000)).to_f64(), -5.0);
        assert!(huge.is_negative() && huge.to_f64() == f64::NEG_INFINITY);
    }
}
