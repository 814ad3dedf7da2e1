//! A certified quotient inside an interval: the ray parameter of every hit is one.

use super::double::{Double, QUOTIENT_ERROR, U2};
use crate::simd::F64Lanes;

/// A coefficient and a bound of its absolute error.
#[derive(Clone, Copy, Debug)]
pub struct Bounded<F = f64> {
    /// The value, normalised.
    pub value: Double<F>,
    /// |value − exact| is at most this.
    pub error: F,
}

impl<F: F64Lanes> Bounded<F> {
    /// A value that is wrong by at most `units` times u² of the summed magnitudes of its terms, to first order.
    #[inline(always)]
    pub fn new(value: Double<F>, units: f64, size: F) -> Bounded<F> {
        Bounded { value, error: size.same(SECOND_ORDER * units * U2) * size }
    }

    /// The quotient, and a bound of its relative error before it is rounded to f64; where either value may be zero they
    /// mean nothing.
    #[inline(always)]
    pub fn quotient(self, divisor: Bounded<F>) -> (Double<F>, F) {
        let (n, d) = (self.value, divisor.value);
        let relative_error = self.error / n.hi.abs() + divisor.error / d.hi.abs() + n.hi.same(QUOTIENT_ERROR);
        (n.quotient(d), relative_error)
    }

    /// The quotient, and whether it is good enough to be reported.
    #[inline(always)]
    pub fn accepted_quotient(self, divisor: Bounded<F>) -> (Double<F>, F::Mask) {
        let (at, relative_error) = self.quotient(divisor);
        let accepted = self.error.lt(self.value.hi.abs())
            & divisor.error.lt(divisor.value.hi.abs())
            & relative_error.le(relative_error.same(ACCEPTED_RELATIVE_ERROR));
        (at, accepted)
    }
}

impl Bounded {
    /// A value of which nothing is known.
    pub const UNKNOWN: Bounded = Bounded { value: Double::ZERO, error: f64::INFINITY };
}

/// A ray parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameter {
    /// The parameter rounded to f64, within 1 ulp.
    pub t: f64,
    /// What that rounding lost, as a share of t: the parameter is t·(1 + t_rest) within a few u².
    pub t_rest: f32,
}

impl Parameter {
    /// A parameter from its rounded value and what is left. As a share, the rest fits into f32 at every scale.
    #[inline(always)]
    pub fn new(t: f64, rest: f64) -> Parameter {
        Parameter { t, t_rest: if t == 0.0 { 0.0 } else { (rest / t) as f32 } }
    }
}

/// What is known of a quotient.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Ratio {
    /// It certainly lies outside of the interval, or there is none.
    Outside,
    /// It lies inside, and this is it.
    Inside(Parameter),
    /// The next tier has to say.
    Uncertain,
}

/// `n / d` against the open interval from `t_min >= 0` to `t_max`.
///
/// Whether a value is accepted does not depend on the interval, so that a shorter interval never changes a value that
/// stays inside of it.
#[inline(always)]
pub fn ratio_inside(n: Bounded, d: Bounded, t_min: f64, t_max: f64) -> Ratio {
    let (n_hi, d_hi) = (n.value.hi, d.value.hi);
    // Certain zeros: nothing divided by nothing, and the origin itself, which is outside of an open interval.
    if (d_hi == 0.0 && d.error == 0.0) || (n_hi == 0.0 && n.error == 0.0 && d_hi.abs() > d.error) {
        return Ratio::Outside;
    }
    if !(n_hi.abs() > n.error && d_hi.abs() > d.error) {
        return Ratio::Uncertain;
    }
    // The sign is certain now; most rays that leave a surface are done here.
    if (n_hi < 0.0) != (d_hi < 0.0) {
        return Ratio::Outside;
    }
    let (quotient, relative_error) = n.quotient(d);
    let t = quotient.hi;
    if relative_error <= ACCEPTED_RELATIVE_ERROR {
        let inside = t > t_min && t < t_max;
        return if inside { Ratio::Inside(Parameter::new(t, quotient.lo)) } else { Ratio::Outside };
    }
    // Too coarse to report, but perhaps certain to lie outside.
    let slack = 2.0 * relative_error * t;
    let outside = relative_error < 0.25 && (t + slack <= t_min || t - slack >= t_max);
    if outside { Ratio::Outside } else { Ratio::Uncertain }
}

/// An accepted quotient is wrong by less than this share of itself before it is rounded: a quarter of an ulp at most.
pub const ACCEPTED_RELATIVE_ERROR: f64 = super::U / 2.0;

/// Bounds are derived to first order; this covers the products of errors and the rounding of the bound itself, as
/// long as relative errors are below 2⁻¹⁰, which the tests for acceptance imply.
pub const SECOND_ORDER: f64 = 1.01;
