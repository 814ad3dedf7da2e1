//! The f64 tier of quadrics: what it is certain of.

use glam::DVec3;

use super::Quadric;
use crate::numeric::U;
use crate::numeric::prepared::PreparedRay;
use crate::numeric::ratio::SECOND_ORDER;

/// a, b and c of the equation: themselves, or what their errors are shares of.
pub(super) struct Coefficients {
    pub(super) a: f64,
    pub(super) b: f64,
    pub(super) c: f64,
}

impl Coefficients {
    /// In f64.
    #[inline(always)]
    pub(super) fn rounded(ray: &PreparedRay, quadric: &Quadric) -> Coefficients {
        Coefficients::of(ray.direction, ray.origin - quadric.center, quadric)
    }

    /// Sums of the magnitudes of all their terms.
    #[inline(always)]
    pub(super) fn sizes(ray: &PreparedRay, quadric: &Quadric) -> Coefficients {
        Coefficients::of(ray.direction.abs(), (ray.origin - quadric.center).abs(), &quadric.magnitudes())
    }

    #[inline(always)]
    fn of(d: DVec3, h: DVec3, quadric: &Quadric) -> Coefficients {
        let gradient = quadric.half_gradient(h);
        Coefficients {
            a: d.dot(quadric.times(d)),
            b: d.dot(gradient),
            c: h.dot(gradient + quadric.linear) + quadric.constant,
        }
    }
}

/// What f64 knows of the roots.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Known {
    /// None is within the interval.
    Miss,
    /// One is.
    Hit,
    /// The next tier has to say.
    Open,
}

/// The f64 tier. First-order errors in units of u: 6 for dᵀQd, 8 for d·(Qh+g), 11 for the constant, each of the summed magnitudes; 20 of
/// S_b² + S_a·S_c for the discriminant.
///
/// With s the sign of b, the roots are −s·|q|/a and −s·c/|q|, |q| = |b| + √(b² − ac). They are compared with the ends of the interval as
/// products, each factor as far to one side as its error allows.
#[inline(always)]
pub(super) fn known(ray: &PreparedRay, quadric: &Quadric, sizes: &Coefficients) -> Known {
    let rounded = Coefficients::rounded(ray, quadric);
    let (discriminant, error) = discriminant(&rounded, sizes);
    if discriminant < -error {
        return Known::Miss;
    }
    let units = |n: f64, size: f64| SECOND_ORDER * n * U * size;
    let (a_error, b_error, c_error) = (units(6.0, sizes.a), units(8.0, sizes.b), units(11.0, sizes.c));
    let Coefficients { a, b, c } = rounded;
    let b_size = b.abs();
    if !(discriminant > error && b_size > b_error) {
        return Known::Open;
    }
    let (less, more) = (1.0 - ROUNDINGS * U, 1.0 + ROUNDINGS * U);
    let q_low = (b_size - b_error + (discriminant - error).sqrt()) * less;
    let q_high = (b_size + b_error + (discriminant + error).sqrt()) * more;
    let (a, c) = if b < 0.0 { (a, c) } else { (-a, -c) };
    let (a_low, a_high, c_low, c_high) = (a - a_error, a + a_error, c - c_error, c + c_error);

    // c/|q|, and |q|/a, which there is none of where a is zero.
    let (low, high) = (ray.t_min * less, ray.t_max * more);
    let is_second_outside = c_high <= low * q_low || c_low >= high * q_high;
    let is_first_outside = a_high <= 0.0 || q_high <= low * a_low || q_low >= high * a_high;
    if is_first_outside && is_second_outside {
        return Known::Miss;
    }
    let (low, high) = (ray.t_min * more, ray.t_max * less);
    let is_second_inside = c_low > low * q_high && c_high < high * q_low;
    let is_first_inside = a_low > 0.0 && q_low > low * a_high && q_high < high * a_low;
    if is_first_inside || is_second_inside { Known::Hit } else { Known::Open }
}

/// More than what sums, roots and products of the f64 tier round by after its coefficients, in units of u.
const ROUNDINGS: f64 = 16.0;

/// b² − ac in f64, and what it may be wrong by.
#[inline(always)]
pub(super) fn discriminant(of: &Coefficients, sizes: &Coefficients) -> (f64, f64) {
    (of.b * of.b - of.a * of.c, 21.0 * U * (sizes.b * sizes.b + sizes.a * sizes.c))
}
