//! a·t² + 2b·t + c with integer coefficients: where an f64 stands against its roots.

use num_bigint::{BigInt, Sign};

use super::integer::decode;
use super::wide::Wide;

/// A polynomial with at least one real root, in τ = t·2^−scale; a ≥ 0, and b > 0 where a = 0.
#[derive(Clone, Debug)]
pub struct Polynomial {
    a: BigInt,
    b: BigInt,
    c: BigInt,
    discriminant: BigInt,
    scale: i64,
    /// Whether the smaller and the larger root count; a single one is the smaller.
    kept: [bool; 2],
}

/// How many roots lie below a value, and how many at it; a double root counts twice.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Standing {
    /// Roots below.
    pub below: u32,
    /// Roots that are the value.
    pub at: u32,
}

impl Polynomial {
    /// The polynomial whose roots are the hits; `None` when it has no real root, or is zero everywhere.
    pub fn new(a: BigInt, b: BigInt, c: BigInt, scale: i64) -> Option<Polynomial> {
        let leading = if a.sign() == Sign::NoSign { b.sign() } else { a.sign() };
        let [a, b, c] = match leading {
            Sign::NoSign => return None,
            Sign::Minus => [-a, -b, -c],
            Sign::Plus => [a, b, c],
        };
        let discriminant = &b * &b - &a * &c;
        (discriminant.sign() != Sign::Minus).then_some(Polynomial { a, b, c, discriminant, scale, kept: [true; 2] })
    }

    /// The polynomial of the single root n/d·2^scale, for a d that is not zero.
    pub fn linear(n: BigInt, d: BigInt, scale: i64) -> Option<Polynomial> {
        Polynomial::new(BigInt::ZERO, d, -(n << 1u32), scale)
    }

    /// Number of roots, a double one counted twice.
    pub fn n_roots(&self) -> u32 {
        if self.a.sign() == Sign::NoSign { 1 } else { 2 }
    }

    /// f(x)·2^(2p) and (f′(x)/2)·2^p for the p ≥ 0 that makes both integers.
    fn at(&self, x: f64) -> (BigInt, BigInt, i64) {
        let (m, e) = decode(x);
        if m == 0 {
            return (self.c.clone(), self.b.clone(), 0);
        }
        let exponent = e - self.scale;
        let p = (-exponent).max(0);
        let m = BigInt::from(m) << exponent.max(0) as u64;
        let (a_m, b) = (&self.a * &m, &self.b << p as u64);
        let slope = &a_m + &b;
        let value = (&slope + &b) * &m + (&self.c << (2 * p) as u64);
        (value, slope, p)
    }

    /// Where a finite value stands.
    pub fn standing(&self, x: f64) -> Standing {
        let (value, slope, _) = self.at(x);
        self.standing_of(value.sign(), slope.sign())
    }

    /// Where p/q stands, in units of 2^scale, for a positive q.
    fn standing_of_ratio(&self, p: &BigInt, q: &BigInt) -> Standing {
        let (a_p, b_q) = (&self.a * p, &self.b * q);
        let slope = &a_p + &b_q;
        let value = (&slope + &b_q) * p + &self.c * q * q;
        self.standing_of(value.sign(), slope.sign())
    }

    fn standing_of(&self, value: Sign, slope: Sign) -> Standing {
        let (below, at) = match (self.n_roots(), value, slope) {
            (1, Sign::Minus, _) => (0, 0),
            (1, Sign::NoSign, _) => (0, 1),
            (1, Sign::Plus, _) => (1, 0),
            (_, Sign::Minus, _) => (1, 0),
            (_, Sign::NoSign, Sign::Minus) => (0, 1),
            (_, Sign::NoSign, Sign::NoSign) => (0, 2),
            (_, Sign::NoSign, Sign::Plus) => (1, 1),
            (_, Sign::Plus, Sign::Minus) => (0, 0),
            (_, Sign::Plus, _) => (2, 0),
        };
        Standing { below, at }
    }

    /// The same polynomial, of whose roots only those count at which α·2^e + β·t ≥ 0. Roots that did not count do not count
    /// again; `None` when none is left.
    pub fn keep_where(mut self, alpha: &BigInt, beta: &BigInt, e: i64) -> Option<Polynomial> {
        // In units of 2^scale the value is zero at −α·2^(e − scale)/β.
        let shift = e - self.scale;
        let p = -(alpha << shift.max(0) as u64);
        let q = beta << (-shift).max(0) as u64;
        let roots = |from: u32, to: u32| [0, 1].map(|i| from <= i && i < to);
        let is_kept = match beta.sign() {
            Sign::NoSign => [alpha.sign() != Sign::Minus; 2],
            Sign::Plus => roots(self.standing_of_ratio(&p, &q).below, 2),
            Sign::Minus => {
                let Standing { below, at } = self.standing_of_ratio(&-p, &-q);
                roots(0, below + at)
            }
        };
        self.kept = [0, 1].map(|i| self.kept[i] && is_kept[i]);
        let any = self.kept[..self.n_roots() as usize].contains(&true);
        any.then_some(self)
    }

    /// Whether all roots count.
    pub fn keeps_all(&self) -> bool {
        self.kept == [true; 2]
    }

    /// Whether a root that counts is one of those from one number, in order, to below another.
    fn keeps_any(&self, from: u32, to: u32) -> bool {
        (from..to).any(|i| self.kept[i as usize])
    }

    /// Whether a root that counts lies in the closed interval between finite ends.
    pub fn has_root_within(&self, lo: f64, hi: f64) -> bool {
        let end = self.standing(hi);
        self.keeps_any(self.standing(lo).below, end.below + end.at)
    }

    /// Whether a root that counts is above 0: what a hit over (0, ∞) comes to, but for under- and overflow of t.
    pub fn has_positive_root(&self) -> bool {
        let zero = self.standing(0.0);
        self.keeps_any(zero.below + zero.at, self.n_roots())
    }

    /// The distance from `x` to the root on its side of the vertex, root − x, to about 15 digits of itself, and
    /// whether that is the smaller of two roots.
    ///
    /// With f the polynomial and B = f′/2 at x, the root is x + δ for aδ² + 2Bδ + f(x) = 0, and the δ nearer to zero
    /// is −f/(B ± √D) with the sign of B: nothing cancels.
    pub fn nearest_root(&self, x: f64) -> (f64, bool) {
        let (value, slope, p) = self.at(x);
        let first = self.n_roots() == 2 && slope.sign() == Sign::Minus;
        let root = Wide::integer(&self.discriminant, 0).sqrt();
        let slope = Wide::integer(&slope, -p);
        let divisor = if slope.is_negative() { slope + -root } else { slope + root };
        let delta = -Wide::integer(&value, -2 * p).over(divisor);
        ((delta * Wide::new(1.0, self.scale)).to_f64(), first)
    }

    /// The larger or the smaller root to about 15 digits, for people to read.
    pub fn approximate_root(&self, larger: bool) -> f64 {
        let (b, root) = (Wide::integer(&self.b, 0), Wide::integer(&self.discriminant, 0).sqrt());
        let b_sign = b.is_negative();
        let q = if b_sign { b + -root } else { b + root };
        // Roots −q/a and −c/q; −q/a is the smaller one when q > 0.
        let use_ratio = self.n_roots() == 2 && (larger == b_sign);
        let root = if use_ratio { (-q).over(Wide::integer(&self.a, 0)) } else { -Wide::integer(&self.c, 0).over(q) };
        (root * Wide::new(1.0, self.scale)).to_f64()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn polynomial(a: i64, b: i64, c: i64, scale: i64) -> Option<Polynomial> {
        Polynomial::new(a.into(), b.into(), c.into(), scale)
    }

    #[test]
    fn values_stand_below_between_at_and_above_the_roots() {
        // (t − 1)(t − 3), and the same negated.
        for sign in [1, -1] {
            let p = polynomial(sign, -2 * sign, 3 * sign, 0).unwrap();
            for (x, below, at) in [(0.0, 0, 0), (1.0, 0, 1), (2.0, 1, 0), (3.0, 1, 1), (3.5, 2, 0), (-1e300, 0, 0)] {
                assert_eq!(p.standing(x), Standing { below, at }, "{x}");
            }
            assert!(p.has_root_within(0.5, 1.0) && !p.has_root_within(1.0f64.next_up(), 3.0f64.next_down()));
            assert!(p.has_positive_root());
        }
        let double = polynomial(1, -3, 9, 0).unwrap();
        assert_eq!(double.standing(3.0), Standing { below: 0, at: 2 });
        assert!(polynomial(1, -3, 10, 0).is_none() && polynomial(0, 0, 0, 0).is_none());
        assert!(polynomial(0, 0, 5, 0).is_none());
    }

    #[test]
    fn the_scale_moves_roots_by_powers_of_two() {
        let p = polynomial(1, -2, 3, -70).unwrap();
        let unit = 2f64.powi(-70);
        assert_eq!(p.standing(3.0 * unit), Standing { below: 1, at: 1 });
        assert_eq!(p.approximate_root(false), unit);
        assert_eq!(p.approximate_root(true), 3.0 * unit);
        let line = Polynomial::linear(3.into(), (-4).into(), 2).unwrap();
        assert_eq!(line.standing(-3.0), Standing { below: 0, at: 1 });
        assert_eq!(line.approximate_root(false), -3.0);
    }

    #[test]
    fn the_distance_to_the_nearest_root_is_right_to_many_digits() {
        // t² − 2: the distance of the rounded root is 9.6672e-17 below √2.
        let p = polynomial(1, 0, -2, 0).unwrap();
        let (delta, first) = p.nearest_root(2f64.sqrt());
        assert!(!first && (delta - -9.667_293_313_452_913e-17).abs() < 1e-30, "{delta:e}");
        let (delta, first) = p.nearest_root(-2f64.sqrt());
        assert!(first && (delta - 9.667_293_313_452_913e-17).abs() < 1e-30, "{delta:e}");
    }
}
