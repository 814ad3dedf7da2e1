//! Position and normal at an exact hit, and how far an answer is from them.

use num_bigint::BigInt;

use super::integer::{self, difference, dot, finest_exponent, scaled_vector, sum, times};
use super::wide::Wide;
use super::{QuadricRow, Vector};

/// The point o + (t + delta)·d without rounding: integers times 2^scale.
#[derive(Clone, Debug)]
pub struct ExactPoint {
    /// Integers.
    pub xyz: integer::Vector,
    /// Exponent of their unit.
    pub scale: i64,
}

impl ExactPoint {
    /// The point of a ray at the sum of two doubles; with the delta of a
    /// [`Judgement`](super::Judgement) it is the exact hit to about 30 digits.
    pub fn new(origin: Vector, direction: Vector, t: f64, delta: f64) -> ExactPoint {
        let t_scale = finest_exponent([t, delta]).unwrap_or(0);
        let d_scale = finest_exponent(direction).unwrap_or(0);
        let scale = finest_exponent(origin).map_or(t_scale + d_scale, |o| o.min(t_scale + d_scale));
        let parameter = integer::scaled(t, t_scale) + integer::scaled(delta, t_scale);
        let along = times(&parameter, &scaled_vector(direction, d_scale));
        let unit = BigInt::from(1) << (t_scale + d_scale - scale) as u64;
        ExactPoint { xyz: sum(&scaled_vector(origin, scale), &times(&unit, &along)), scale }
    }

    /// The largest component of |self − p|, to about 15 digits.
    pub fn distance_to(&self, p: Vector) -> f64 {
        let scale = finest_exponent(p).map_or(self.scale, |e| e.min(self.scale));
        let unit = BigInt::from(1) << (self.scale - scale) as u64;
        let off = difference(&times(&unit, &self.xyz), &scaled_vector(p, scale));
        off.iter().map(|x| Wide::integer(x, scale).to_f64().abs()).fold(0.0, f64::max)
    }

    /// The vector from a centre, of any length.
    pub fn from_center(&self, center: Vector) -> integer::Vector {
        let scale = finest_exponent(center).map_or(self.scale, |e| e.min(self.scale));
        let unit = BigInt::from(1) << (self.scale - scale) as u64;
        difference(&times(&unit, &self.xyz), &scaled_vector(center, scale))
    }

    /// The gradient of a quadric, of any length.
    pub fn gradient(&self, row: &QuadricRow) -> integer::Vector {
        row.half_gradient(&self.xyz, self.scale)
    }
}

/// The largest component of |n/|n| − unit|, to about 3e-16; `None` where the normal is zero.
pub fn normal_error(normal: &integer::Vector, unit: Vector) -> Option<f64> {
    let length = Wide::integer(&dot(normal, normal), 0).sqrt();
    if length == Wide::ZERO {
        return None;
    }
    let off = |i: usize| (Wide::integer(&normal[i], 0).over(length).to_f64() - unit[i]).abs();
    Some(off(0).max(off(1)).max(off(2)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_is_exact_and_its_distances_are_small_numbers() {
        let point = ExactPoint::new([1e10, 0.0, -3.0], [1.0, 1e-10, 0.5], 0.1, 0.0);
        assert_eq!(point.distance_to([1e10 + 0.1, 1e-11, -2.95]), {
            let exact_x = (1e10 + 0.1) - 1e10;
            (exact_x - 0.1f64).abs()
        });
        assert_eq!(point.from_center([1e10, 0.0, -3.0]).len(), 3);
    }

    #[test]
    fn normals_are_compared_as_unit_vectors() {
        let n = [3.into(), 0.into(), 4.into()];
        assert!(normal_error(&n, [0.6, 0.0, 0.8]).unwrap() < 1e-15);
        assert!((normal_error(&n, [-0.6, 0.0, -0.8]).unwrap() - 1.6).abs() < 1e-15);
        assert_eq!(normal_error(&Default::default(), [1.0, 0.0, 0.0]), None);
    }
}
