//! Doubles as integers over a common power of two.

use num_bigint::BigInt;

/// A vector of integers.
pub type Vector = [BigInt; 3];

/// A finite `x` as m·2ᵉ with an odd m; zero is 0·2⁰ .
pub fn decode(x: f64) -> (i64, i64) {
    let bits = x.to_bits();
    let biased = ((bits >> 52) & 0x7ff) as i64;
    let fraction = (bits & ((1 << 52) - 1)) as i64;
    let (magnitude, exponent) = if biased == 0 { (fraction, -1074) } else { (fraction | 1 << 52, biased - 1075) };
    if magnitude == 0 {
        return (0, 0);
    }
    let shift = magnitude.trailing_zeros();
    let odd = magnitude >> shift;
    (if x < 0.0 { -odd } else { odd }, exponent + i64::from(shift))
}

/// The largest e such that all values are integers times 2ᵉ; `None` when all are zero.
pub fn finest_exponent(values: impl IntoIterator<Item = f64>) -> Option<i64> {
    values.into_iter().filter(|&x| x != 0.0).map(|x| decode(x).1).min()
}

/// x·2^−exponent, for an exponent that is not above that of `x`.
pub fn scaled(x: f64, exponent: i64) -> BigInt {
    let (mantissa, own) = decode(x);
    if mantissa == 0 {
        return BigInt::ZERO;
    }
    let shift = own - exponent;
    debug_assert!(shift >= 0);
    if shift <= 63 { BigInt::from(i128::from(mantissa) << shift) } else { BigInt::from(mantissa) << shift as u64 }
}

/// Each component of v·2^−exponent.
pub fn scaled_vector(v: [f64; 3], exponent: i64) -> Vector {
    v.map(|x| scaled(x, exponent))
}

/// The dot product.
pub fn dot(a: &Vector, b: &Vector) -> BigInt {
    &a[0] * &b[0] + &a[1] * &b[1] + &a[2] * &b[2]
}

/// The cross product.
pub fn cross(a: &Vector, b: &Vector) -> Vector {
    [&a[1] * &b[2] - &a[2] * &b[1], &a[2] * &b[0] - &a[0] * &b[2], &a[0] * &b[1] - &a[1] * &b[0]]
}

/// a − b.
pub fn difference(a: &Vector, b: &Vector) -> Vector {
    [&a[0] - &b[0], &a[1] - &b[1], &a[2] - &b[2]]
}

/// a + b.
pub fn sum(a: &Vector, b: &Vector) -> Vector {
    [&a[0] + &b[0], &a[1] + &b[1], &a[2] + &b[2]]
}

/// s·a.
pub fn times(s: &BigInt, a: &Vector) -> Vector {
    [s * &a[0], s * &a[1], s * &a[2]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decoding_keeps_the_value() {
        for x in [1.0, -0.75, 5e-324, f64::MAX, 0.1, -1e-310] {
            let (m, e) = decode(x);
            assert!(m % 2 != 0, "{x:e}");
            let half = e / 2;
            assert_eq!(m as f64 * 2f64.powi(half as i32) * 2f64.powi((e - half) as i32), x);
        }
        assert_eq!(decode(-0.0), (0, 0));
        assert_eq!(finest_exponent([0.0, 6.0, 0.5]), Some(-1));
        assert_eq!(finest_exponent([0.0, -0.0]), None);
        assert_eq!(scaled(-6.0, -100), BigInt::from(-6) << 100u32);
    }
}
