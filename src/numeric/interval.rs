//! Interval arithmetic in f64, rounded outwards: for boxes, where it replaces a derivation of bounds.
//!
//! f64 operations round to nearest, so one step to either side encloses the exact result (Moore 1966).

use std::ops::{Add, Mul, Neg, Sub};

/// The numbers from `lo` to `hi`; empty when `lo > hi`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Lower end; may be −∞.
    pub lo: f64,
    /// Upper end; may be ∞.
    pub hi: f64,
}

impl Interval {
    /// All numbers.
    pub const ALL: Interval = Interval { lo: f64::NEG_INFINITY, hi: f64::INFINITY };

    /// No number.
    pub const EMPTY: Interval = Interval { lo: f64::INFINITY, hi: f64::NEG_INFINITY };

    /// One number.
    pub fn new(x: f64) -> Interval {
        Interval { lo: x, hi: x }
    }

    /// Both ends finite and in order.
    pub fn is_finite(self) -> bool {
        self.lo.is_finite() && self.hi.is_finite() && self.lo <= self.hi
    }

    /// Around what was rounded to nearest; everything where that is not a number.
    fn outwards(lo: f64, hi: f64) -> Interval {
        if lo.is_nan() || hi.is_nan() {
            return Interval::ALL;
        }
        Interval { lo: lo.next_down(), hi: hi.next_up() }
    }

    /// Numbers in both.
    pub fn and(self, other: Interval) -> Interval {
        Interval { lo: self.lo.max(other.lo), hi: self.hi.min(other.hi) }
    }

    /// Numbers in either, and what lies between.
    pub fn or(self, other: Interval) -> Interval {
        Interval { lo: self.lo.min(other.lo), hi: self.hi.max(other.hi) }
    }

    /// 1 over the interval; everything when it holds 0.
    pub fn recip(self) -> Interval {
        if self.lo <= 0.0 && self.hi >= 0.0 {
            return Interval::ALL;
        }
        Interval::outwards(1.0 / self.hi, 1.0 / self.lo)
    }

    /// The largest magnitude.
    pub fn size(self) -> f64 {
        self.lo.abs().max(self.hi.abs())
    }
}

impl From<f64> for Interval {
    fn from(x: f64) -> Interval {
        Interval::new(x)
    }
}

impl Add for Interval {
    type Output = Interval;

    fn add(self, other: Interval) -> Interval {
        Interval::outwards(self.lo + other.lo, self.hi + other.hi)
    }
}

impl Neg for Interval {
    type Output = Interval;

    fn neg(self) -> Interval {
        Interval { lo: -self.hi, hi: -self.lo }
    }
}

impl Sub for Interval {
    type Output = Interval;

    fn sub(self, other: Interval) -> Interval {
        self + -other
    }
}

impl Mul for Interval {
    type Output = Interval;

    fn mul(self, other: Interval) -> Interval {
        // Zero stays zero: coefficients often are, and a box should not grow by what is not there.
        if self == Interval::new(0.0) || other == Interval::new(0.0) {
            return Interval::new(0.0);
        }
        let products = [self.lo * other.lo, self.lo * other.hi, self.hi * other.lo, self.hi * other.hi];
        if products.iter().any(|product| product.is_nan()) {
            return Interval::ALL;
        }
        let [lo, hi] = [f64::min, f64::max].map(|pick| products.into_iter().reduce(pick).unwrap_or(f64::NAN));
        Interval::outwards(lo, hi)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn between(lo: f64, hi: f64) -> Interval {
        Interval { lo, hi }
    }

    #[test]
    fn results_enclose_those_of_every_pair() {
        let (a, b) = (between(-2.0, 3.0), between(0.1, 7.0));
        let holds = |interval: Interval, x: f64| interval.lo <= x && x <= interval.hi;
        for x in [-2.0, 0.0, 0.3, 3.0] {
            for y in [0.1, 1.0, 7.0] {
                assert!(holds(a + b, x + y) && holds(a - b, x - y) && holds(a * b, x * y) && holds(b.recip(), 1.0 / y));
            }
        }
        assert!((a * b).lo < -14.0 && (a * b).hi > 21.0, "one step outwards");
        assert_eq!(a.recip(), Interval::ALL);
        assert_eq!(a.size(), 3.0);
    }

    #[test]
    fn what_overflows_is_everything_and_zero_stays_zero() {
        let all = Interval::ALL;
        assert_eq!(all * between(-1.0, 1.0), all);
        assert_eq!(all + all, all);
        assert_eq!(all - all, all);
        assert_eq!(between(-1.0, 1.0) * Interval::new(0.0), Interval::new(0.0));
        let huge = Interval::new(f64::MAX) * Interval::new(2.0);
        assert!(huge.lo <= f64::MAX && huge.hi == f64::INFINITY);
        assert!(!Interval::EMPTY.is_finite() && Interval::new(1.0).is_finite());
    }
}
