//! Roots of a·t² + 2b·t + c = 0, certified.
//!
//! With q = −(b + sign(b)·√(b² − ac)) the roots are c/q and q/a: neither cancels, and as a → 0 the root c/q stays
//! right, so that planes and rays along a cylinder's axis need no threshold (Press et al., Numerical Recipes, 5.6).

use super::double::{Double, U2};
use super::dyadic::Dyadic;
use super::ratio::{Bounded, Parameter, Ratio, SECOND_ORDER, ratio_inside};
use crate::simd::F64Lanes;

/// Coefficients in exact arithmetic: a, b, c.
pub type ExactCoefficients = [Dyadic; 3];

/// The smallest root in the open interval from `t_min >= 0` to `t_max`, within 1 ulp; `None` when there is none. A
/// double root counts. A quadratic that is zero everywhere has no root: a ray inside a surface misses it.
#[inline(always)]
pub fn first_root(
    coefficients: [Bounded; 3],
    t_min: f64,
    t_max: f64,
    exact: impl FnOnce() -> ExactCoefficients,
) -> Option<Parameter> {
    first(roots_inside(coefficients, t_min, t_max, exact))
}

/// The roots q/a and c/q against the open interval, neither of them uncertain.
///
/// `exact` is asked only for what cannot be certified, root by root, so that a root has the same value whatever the
/// interval.
#[inline(always)]
pub fn roots_inside(
    [a, b, c]: [Bounded; 3],
    t_min: f64,
    t_max: f64,
    exact: impl FnOnce() -> ExactCoefficients,
) -> [Ratio; 2] {
    let roots = certified_roots(a, b, c, t_min, t_max);
    if roots.contains(&Ratio::Uncertain) { mend(roots, &exact(), t_min, t_max) } else { roots }
}

/// The smaller of the roots that lie inside.
#[inline(always)]
pub fn first(roots: [Ratio; 2]) -> Option<Parameter> {
    match roots {
        [Ratio::Inside(first), Ratio::Inside(second)] => Some(if second.t < first.t { second } else { first }),
        [Ratio::Inside(only), _] | [_, Ratio::Inside(only)] => Some(only),
        _ => None,
    }
}

/// The roots q/a and c/q, as far as double-double can tell.
#[inline(always)]
fn certified_roots(a: Bounded, b: Bounded, c: Bounded, t_min: f64, t_max: f64) -> [Ratio; 2] {
    let discriminant = discriminant(a, b, c);
    // Which root is which hangs on the sign of b.
    let b_certain = b.value.hi.abs() > b.error || b.error == 0.0;
    if !(discriminant.value.hi.abs() > discriminant.error && b_certain) {
        return [Ratio::Uncertain; 2];
    }
    if discriminant.value.hi < 0.0 {
        return [Ratio::Outside; 2];
    }
    let q = stable_sum(b, discriminant);
    [ratio_inside(q, a, t_min, t_max), ratio_inside(c, q, t_min, t_max)]
}

/// b² − ac. Its error is that of the coefficients, of two products and of a difference.
#[inline(always)]
pub fn discriminant<F: F64Lanes>(a: Bounded<F>, b: Bounded<F>, c: Bounded<F>) -> Bounded<F> {
    let b_squared = b.value * b.value;
    let ac = a.value * c.value;
    let b_size = b.value.hi.abs();
    let error = b_size.same(SECOND_ORDER)
        * (b_size.same(2.0) * b_size * b.error
            + b.error * b.error
            + a.value.hi.abs() * c.error
            + c.value.hi.abs() * a.error
            + a.error * c.error
            + b_size.same(9.0 * U2) * (b_squared.hi + ac.hi.abs()));
    Bounded { value: b_squared - ac, error }
}

/// q = −(b + sign(b)·√discriminant) of a discriminant that is certainly positive. |q| ≥ √discriminant, since the signs agree.
#[inline(always)]
pub fn stable_sum<F: F64Lanes>(b: Bounded<F>, discriminant: Bounded<F>) -> Bounded<F> {
    let root = discriminant.value.sqrt();
    let root_error = discriminant.error / (root.hi + root.hi) + root.hi.same(5.0 * U2) * root.hi;
    let is_negative = b.value.hi.lt(root.hi.same(0.0));
    let (hi, lo) = ((-root.hi).select(is_negative, root.hi), (-root.lo).select(is_negative, root.lo));
    let q = -(b.value + Double { hi, lo });
    Bounded { value: q, error: q.hi.same(SECOND_ORDER) * (b.error + root_error + q.hi.same(4.0 * U2) * q.hi.abs()) }
}

/// Replaces what is uncertain by what exact arithmetic says.
#[cold]
fn mend(roots: [Ratio; 2], [a, b, c]: &ExactCoefficients, t_min: f64, t_max: f64) -> [Ratio; 2] {
    let exact = exact_roots(a, b, c);
    [0, 1].map(|i| match (roots[i], exact[i]) {
        (Ratio::Uncertain, Some(root)) if root.t > t_min && root.t < t_max => Ratio::Inside(root),
        (Ratio::Uncertain, _) => Ratio::Outside,
        (known, _) => known,
    })
}

/// The roots q/a and c/q in exact arithmetic, rounded once.
fn exact_roots(a: &Dyadic, b: &Dyadic, c: &Dyadic) -> [Option<Parameter>; 2] {
    let discriminant = b.mul(b).sub(&a.mul(c));
    if discriminant.sign() < 0 {
        return [None; 2];
    }
    let root = discriminant.guarded_sqrt();
    let q = if b.sign() < 0 { root.sub(b) } else { root.add(b).neg() };
    // q is zero only when b and the discriminant are: then ac = 0, and 0 is a double root unless a is zero too.
    if q.sign() == 0 {
        return [(a.sign() != 0).then_some(Parameter::new(0.0, 0.0)), None];
    }
    [q.guarded_quotient(a).map(|t| t.to_parameter()), c.guarded_quotient(&q).map(|t| t.to_parameter())]
}

/// The sign of α + β·t at a root that exists: q/a for the root 0, c/q for the root 1.
///
/// With s the sign of b and D = b² − ac, the roots are (−b ∓ s√D)/a. For a ≠ 0 the value times a is x + y√D with x = αa − βb
/// and y = ∓sβ, and the sign of such a sum is that of the larger square. For a = 0 the only root is −c/2b.
#[cold]
pub fn sign_at_root([a, b, c]: &ExactCoefficients, root: usize, alpha: &Dyadic, beta: &Dyadic) -> i32 {
    if a.sign() == 0 {
        let twice_b = b.add(b);
        return b.sign() * twice_b.mul(alpha).sub(&beta.mul(c)).sign();
    }
    let discriminant = b.mul(b).sub(&a.mul(c));
    let x = alpha.mul(a).sub(&beta.mul(b));
    let y = if (b.sign() < 0) == (root == 0) { beta.clone() } else { beta.neg() };
    let (x_sign, y_sign) = (x.sign(), y.sign() * discriminant.sign());
    let sign = match x_sign * y_sign {
        -1 => x_sign * x.mul(&x).sub(&y.mul(&y).mul(&discriminant)).sign(),
        _ if x_sign != 0 => x_sign,
        _ => y_sign,
    };
    a.sign() * sign
}

#[cfg(test)]
mod tests {
    use super::*;

    fn certain(x: f64) -> Bounded {
        Bounded { value: Double::new(x), error: 0.0 }
    }

    fn both_tiers(a: f64, b: f64, c: f64, t_min: f64, t_max: f64) -> Option<f64> {
        let exact = || [a, b, c].map(Dyadic::new);
        let root = first_root([a, b, c].map(certain), t_min, t_max, exact).map(|root| root.t);
        let mended = mend([Ratio::Uncertain; 2], &exact(), t_min, t_max);
        let inside = |ratio| if let Ratio::Inside(root) = ratio { root.t } else { f64::INFINITY };
        let exact = mended.map(inside).into_iter().reduce(f64::min).filter(|t| t.is_finite());
        assert_eq!(root, exact, "{a} {b} {c} in ({t_min}, {t_max})");
        root
    }

    #[test]
    fn roots_are_found_in_order_and_only_inside_the_interval() {
        // (t − 1)(t − 3) = t² − 4t + 3.
        assert_eq!(both_tiers(1.0, -2.0, 3.0, 0.0, f64::INFINITY), Some(1.0));
        assert_eq!(both_tiers(1.0, -2.0, 3.0, 1.0, f64::INFINITY), Some(3.0));
        assert_eq!(both_tiers(1.0, -2.0, 3.0, 1.0, 3.0), None);
        assert_eq!(both_tiers(-1.0, 2.0, -3.0, 0.0, f64::INFINITY), Some(1.0));
    }

    #[test]
    fn a_linear_equation_has_its_root_and_a_constant_one_none() {
        assert_eq!(both_tiers(0.0, -1.0, 4.0, 0.0, f64::INFINITY), Some(2.0));
        assert_eq!(both_tiers(0.0, 0.0, 4.0, 0.0, f64::INFINITY), None);
        assert_eq!(both_tiers(0.0, 0.0, 0.0, 0.0, f64::INFINITY), None);
    }

    #[test]
    fn a_tangent_counts_and_a_miss_by_one_bit_does_not() {
        assert_eq!(both_tiers(1.0, -3.0, 9.0, 0.0, f64::INFINITY), Some(3.0));
        assert_eq!(both_tiers(1.0, -3.0, 9.0f64.next_up(), 0.0, f64::INFINITY), None);
        assert!(both_tiers(1.0, -3.0, 9.0f64.next_down(), 0.0, f64::INFINITY).is_some());
    }

    #[test]
    fn leaving_a_surface_finds_the_other_root() {
        // c = 0: the origin is on the surface.
        assert_eq!(both_tiers(1.0, -2.0, 0.0, 0.0, f64::INFINITY), Some(4.0));
        assert_eq!(both_tiers(1.0, 2.0, 0.0, 0.0, f64::INFINITY), None);
    }

    #[test]
    fn a_linear_value_has_its_exact_sign_at_each_root() {
        let sign = |coefficients: [f64; 3], root, alpha: f64, beta: f64| {
            sign_at_root(&coefficients.map(Dyadic::new), root, &Dyadic::new(alpha), &Dyadic::new(beta))
        };
        // (t − 1)(t − 3), also negated: q/a is 3 and c/q is 1.
        for coefficients in [[1.0, -2.0, 3.0], [-1.0, 2.0, -3.0]] {
            for (bound, expected) in [(0.5, [1, 1]), (1.0, [1, 0]), (2.0, [1, -1]), (3.0, [0, -1]), (4.0, [-1, -1])] {
                assert_eq!([0, 1].map(|root| sign(coefficients, root, -bound, 1.0)), expected, "{bound}");
                assert_eq!([0, 1].map(|root| sign(coefficients, root, bound, -1.0)), expected.map(|s: i32| -s));
            }
        }
        // √2 against its neighbours.
        let root = std::f64::consts::SQRT_2;
        for (bound, expected) in [(root.next_down(), 1), (root, -1)] {
            assert_eq!(sign([1.0, 0.0, -2.0], 1, -bound, 1.0), expected);
            assert_eq!(sign([1.0, 0.0, -2.0], 0, bound, 1.0), -expected);
        }
        // −c/2b = 2.
        assert_eq!(sign([0.0, -1.0, 4.0], 1, -2.0, 1.0), 0);
        assert_eq!(sign([0.0, 1.0, -4.0], 1, 2.0f64.next_up(), -1.0), 1);
        assert_eq!(sign([0.0, 1.0, -4.0], 1, -7.0, 0.0), -1);
    }
}
