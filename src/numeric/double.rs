//! Double-double numbers: an unevaluated sum of two f64, about 106 bits.
//!
//! Error bounds are those of Joldes, Muller and Popescu, "Tight and rigorous error bounds for basic building blocks of
//! double-word arithmetic" (ACM TOMS 44, 2017): with u = 2⁻⁵³, addition 3u² (Algorithm 6), multiplication 5u²
//! (Algorithm 11), each relative to the result, for all inputs, as long as nothing over- or underflows. Callers see to
//! that with [`is_tame`].

use std::ops::{Add, Mul, Neg, Sub};

use glam::DVec3;

use crate::simd::F64Lanes;

/// `hi + lo` with |lo| at most half an ulp of `hi`; of one number, or of several in lanes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Double<F = f64> {
    /// The value rounded to f64.
    pub hi: F,
    /// What rounding lost.
    pub lo: F,
}

/// u², the unit in which errors of this arithmetic are stated.
pub const U2: f64 = super::U * super::U;

/// Relative error of [`Double::quotient`]: 20u², and the rest for the third order.
pub const QUOTIENT_ERROR: f64 = 24.0 * U2;

/// Whether `x` is zero or of a magnitude between 2⁻¹⁵⁰ and 2¹⁵⁰. A tame number is a multiple of 2⁻²⁰², so products of
/// up to four tame numbers, and of their sums, neither overflow nor lose a bit to underflow.
#[inline(always)]
pub fn is_tame(x: f64) -> bool {
    const LOWEST: u64 = 1023 - 150;
    const SPAN: u64 = 300;
    let exponent = (x.to_bits() >> 52) & 0x7ff;
    exponent.wrapping_sub(LOWEST) <= SPAN || x == 0.0
}

/// Whether all components are tame.
#[inline(always)]
pub fn is_tame3(v: DVec3) -> bool {
    is_tame(v.x) & is_tame(v.y) & is_tame(v.z)
}

/// a + b without error (Knuth, TAOCP 2, 4.2.2, Theorem B).
#[inline(always)]
pub fn two_sum<F: F64Lanes>(a: F, b: F) -> Double<F> {
    let hi = a + b;
    let b_part = hi - a;
    let a_part = hi - b_part;
    Double { hi, lo: (a - a_part) + (b - b_part) }
}

/// a + b without error when |a| ≥ |b| or a = 0 (Dekker 1971).
#[inline(always)]
pub fn fast_two_sum<F: F64Lanes>(a: F, b: F) -> Double<F> {
    let hi = a + b;
    Double { hi, lo: b - (hi - a) }
}

/// a · b without error.
#[inline(always)]
pub fn two_product<F: F64Lanes>(a: F, b: F) -> Double<F> {
    let hi = a * b;
    Double { hi, lo: a.mul_add(b, -hi) }
}

impl<F: F64Lanes> Double<F> {
    /// The quotient; error below [`QUOTIENT_ERROR`] of the result. Long division with two digits, both by one reciprocal.
    /// The first digit is within 2u. What it leaves, 4u of the dividend at most, costs 8u² to compute; multiplying it by the
    /// reciprocal 8u², and leaving out the divisor's `lo` there 4u².
    #[inline(always)]
    pub fn quotient(self, divisor: Double<F>) -> Double<F> {
        let reciprocal = self.hi.same(1.0) / divisor.hi;
        let first = self.hi * reciprocal;
        let rest = (-first).mul_add(divisor.hi, self.hi) + (-first).mul_add(divisor.lo, self.lo);
        fast_two_sum(first, rest * reciprocal)
    }
}

impl Double {
    /// Zero.
    pub const ZERO: Double = Double { hi: 0.0, lo: 0.0 };

    /// An f64 as it is.
    #[inline(always)]
    pub fn new(x: f64) -> Double {
        Double { hi: x, lo: 0.0 }
    }
}

impl<F: F64Lanes> Double<F> {
    /// The product with an f64; error at most 2u² of the result (Algorithm 9).
    #[inline(always)]
    pub fn scale(self, factor: F) -> Double<F> {
        let p = two_product(self.hi, factor);
        fast_two_sum(p.hi, self.lo.mul_add(factor, p.lo))
    }

    /// The square root of a positive number; error below 4u² of the result (one Newton step from the f64 root).
    #[inline(always)]
    pub fn sqrt(self) -> Double<F> {
        let root = self.hi.sqrt();
        let rest = self - two_product(root, root);
        fast_two_sum(root, rest.hi / (root + root))
    }
}

impl<F: F64Lanes> Add for Double<F> {
    type Output = Double<F>;

    /// The sum; error at most 3u² of the result.
    #[inline(always)]
    fn add(self, other: Double<F>) -> Double<F> {
        let s = two_sum(self.hi, other.hi);
        let t = two_sum(self.lo, other.lo);
        let v = fast_two_sum(s.hi, s.lo + t.hi);
        fast_two_sum(v.hi, t.lo + v.lo)
    }
}

impl<F: F64Lanes> Neg for Double<F> {
    type Output = Double<F>;

    /// The negative, exactly.
    #[inline(always)]
    fn neg(self) -> Double<F> {
        Double { hi: -self.hi, lo: -self.lo }
    }
}

impl<F: F64Lanes> Sub for Double<F> {
    type Output = Double<F>;

    /// The difference; error at most 3u² of the result.
    #[inline(always)]
    fn sub(self, other: Double<F>) -> Double<F> {
        self + -other
    }
}

impl<F: F64Lanes> Mul for Double<F> {
    type Output = Double<F>;

    /// The product; error at most 5u² of the result.
    #[inline(always)]
    fn mul(self, other: Double<F>) -> Double<F> {
        let p = two_product(self.hi, other.hi);
        let cross = self.hi.mul_add(other.lo, self.lo * other.hi);
        fast_two_sum(p.hi, p.lo + cross)
    }
}

/// A vector of double-doubles.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Double3<F = f64> {
    /// x, y, z.
    pub xyz: [Double<F>; 3],
}

impl Double3 {
    /// `a - b` without error.
    #[inline(always)]
    pub fn difference(a: DVec3, b: DVec3) -> Double3 {
        Double3::between(a.to_array(), b.to_array())
    }

    /// An f64 vector as it is.
    #[inline(always)]
    pub fn new(v: DVec3) -> Double3 {
        Double3 { xyz: [Double::new(v.x), Double::new(v.y), Double::new(v.z)] }
    }

    /// The vector rounded to f64.
    #[inline(always)]
    pub fn hi(&self) -> DVec3 {
        DVec3::new(self.xyz[0].hi, self.xyz[1].hi, self.xyz[2].hi)
    }

    /// The dot product with an f64 vector, see [`Double3::dot_lanes`].
    #[inline(always)]
    pub fn dot_f64(&self, v: DVec3) -> Double {
        self.dot_lanes(v.to_array())
    }
}

impl<F: F64Lanes> Double3<F> {
    /// `a - b` without error.
    #[inline(always)]
    pub fn between(a: [F; 3], b: [F; 3]) -> Double3<F> {
        Double3 { xyz: [two_sum(a[0], -b[0]), two_sum(a[1], -b[1]), two_sum(a[2], -b[2])] }
    }

    /// The dot product. Error at most 12u² of the sum of the magnitudes of its terms: 5u² for each product and
    /// 3u² for each of two additions, and the second order.
    #[inline(always)]
    pub fn dot(&self, other: &Double3<F>) -> Double<F> {
        let [ax, ay, az] = self.xyz;
        let [bx, by, bz] = other.xyz;
        ax * bx + ay * by + az * bz
    }

    /// The dot product with an f64 vector; error at most 9u² of the sum of the magnitudes of its terms.
    #[inline(always)]
    pub fn dot_lanes(&self, v: [F; 3]) -> Double<F> {
        let [ax, ay, az] = self.xyz;
        ax.scale(v[0]) + ay.scale(v[1]) + az.scale(v[2])
    }

    /// The sum, component by component.
    #[inline(always)]
    pub fn add(&self, other: &Double3<F>) -> Double3<F> {
        let ([ax, ay, az], [bx, by, bz]) = (self.xyz, other.xyz);
        Double3 { xyz: [ax + bx, ay + by, az + bz] }
    }
}
