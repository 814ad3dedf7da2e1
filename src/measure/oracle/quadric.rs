//! Ray against quadric: one 4×4 matrix about the world's origin, into which the ray is substituted.

use num_bigint::BigInt;

use super::integer::{self, dot, finest_exponent, scaled, scaled_vector, sum, times};
use super::{Polynomial, Vector};

/// The points x with (x−c)ᵀQ(x−c) + 2 g·(x−c) + s = 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QuadricRow {
    /// c.
    pub center: Vector,
    /// Coefficients of x², y², z².
    pub diagonal: Vector,
    /// Halves of the coefficients of yz, xz, xy.
    pub off_diagonal: Vector,
    /// g.
    pub linear: Vector,
    /// s.
    pub constant: f64,
}

/// Exact powers of two by which a case is scaled to integers.
#[derive(Clone, Copy, Debug)]
struct Scales {
    /// Of coordinates.
    point: i64,
    /// Of the directions.
    direction: i64,
    /// Of the entries of Q.
    entry: i64,
}

/// A quadric in integers: Q, l = g − Qc and the constant m = s − 2 g·c + cᵀQc of the form xᵀQx + 2 l·x + m.
struct Form {
    rows: [integer::Vector; 3],
    linear: integer::Vector,
    constant: BigInt,
}

impl QuadricRow {
    /// The sphere |x − c| = r, without rounding: its s is −r², which f64 may not hold.
    pub fn sphere_roots(origin: Vector, direction: Vector, center: Vector, radius: f64) -> Option<Polynomial> {
        let points = origin.into_iter().chain(center).chain([radius]);
        let point = finest_exponent(points).unwrap_or(0);
        let scales = Scales { point, direction: finest_exponent(direction)?, entry: 0 };
        let one = |i: usize, j: usize| BigInt::from(i32::from(i == j));
        let rows = [0, 1, 2].map(|i| [one(i, 0), one(i, 1), one(i, 2)]);
        let (c, r) = (scaled_vector(center, point), scaled(radius, point));
        let form = Form { rows, constant: dot(&c, &c) - &r * &r, linear: c.map(|x| -x) };
        form.substitute(origin, direction, scales)
    }

    /// The roots at which a line meets the surface; `None` when it does not, or lies in it.
    pub fn roots(&self, origin: Vector, direction: Vector) -> Option<Polynomial> {
        let point = finest_exponent(origin.into_iter().chain(self.center)).unwrap_or(0);
        // Linear terms count once per coordinate, the constant not at all: in units of coordinates they are 2^point
        // and 2^(2 point) finer than the entries.
        let entries = finest_exponent(self.diagonal.into_iter().chain(self.off_diagonal));
        let linear = finest_exponent(self.linear).map(|e| e - point);
        let constant = finest_exponent([self.constant]).map(|e| e - 2 * point);
        let entry = [entries, linear, constant].into_iter().flatten().min()?;
        let scales = Scales { point, direction: finest_exponent(direction)?, entry };
        self.form(scales).substitute(origin, direction, scales)
    }

    fn rows(&self, exponent: i64) -> [integer::Vector; 3] {
        let [xx, yy, zz] = self.diagonal;
        let [yz, xz, xy] = self.off_diagonal;
        [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]].map(|row| scaled_vector(row, exponent))
    }

    fn form(&self, Scales { point, entry, .. }: Scales) -> Form {
        let rows = self.rows(entry);
        let c = scaled_vector(self.center, point);
        let g = scaled_vector(self.linear, entry + point);
        let s = scaled(self.constant, entry + 2 * point);
        let moved = rows.each_ref().map(|row| dot(row, &c));
        let linear = integer::difference(&g, &moved);
        // m = s − c·(g + l).
        let constant = s - dot(&c, &sum(&g, &linear));
        Form { rows, linear, constant }
    }

    /// Half of the gradient at a point of integers times 2^scale, as integers of a common scale: Q(x−c) + g.
    pub fn half_gradient(&self, point: &integer::Vector, scale: i64) -> integer::Vector {
        let finest = finest_exponent(self.center).map_or(scale, |e| e.min(scale));
        let entries = finest_exponent(self.diagonal.into_iter().chain(self.off_diagonal));
        let linear = finest_exponent(self.linear).map(|e| e - finest);
        let Some(entry) = [entries, linear].into_iter().flatten().min() else { return Default::default() };
        let shift = BigInt::from(1) << (scale - finest) as u64;
        let from_center = integer::difference(&times(&shift, point), &scaled_vector(self.center, finest));
        let rows = self.rows(entry);
        sum(&rows.each_ref().map(|row| dot(row, &from_center)), &scaled_vector(self.linear, entry + finest))
    }

    /// −1, 0 or 1: the sign of the form at a point.
    pub fn sign_at(&self, at: Vector) -> i32 {
        let point = finest_exponent(at.into_iter().chain(self.center)).unwrap_or(0);
        let entries = finest_exponent(self.diagonal.into_iter().chain(self.off_diagonal));
        let linear = finest_exponent(self.linear).map(|e| e - point);
        let constant = finest_exponent([self.constant]).map(|e| e - 2 * point);
        let Some(entry) = [entries, linear, constant].into_iter().flatten().min() else { return 0 };
        let form = self.form(Scales { point, direction: 0, entry });
        let value = form.value(&scaled_vector(at, point));
        match value.sign() {
            num_bigint::Sign::Minus => -1,
            num_bigint::Sign::NoSign => 0,
            num_bigint::Sign::Plus => 1,
        }
    }
}

impl Form {
    fn times(&self, v: &integer::Vector) -> integer::Vector {
        self.rows.each_ref().map(|row| dot(row, v))
    }

    fn value(&self, x: &integer::Vector) -> BigInt {
        let gradient = sum(&self.times(x), &self.linear);
        dot(x, &sum(&gradient, &self.linear)) + &self.constant
    }

    fn substitute(&self, origin: Vector, direction: Vector, scales: Scales) -> Option<Polynomial> {
        let o = scaled_vector(origin, scales.point);
        let d = scaled_vector(direction, scales.direction);
        let bent = self.times(&d);
        let b = dot(&bent, &o) + dot(&d, &self.linear);
        Polynomial::new(dot(&bent, &d), b, self.value(&o), scales.point - scales.direction)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ELLIPSOID: QuadricRow = QuadricRow {
        center: [1.0, 2.0, 3.0],
        diagonal: [1.0, 4.0, 1.0],
        off_diagonal: [0.0; 3],
        linear: [0.0; 3],
        constant: -4.0,
    };

    #[test]
    fn an_ellipsoid_is_met_twice_touched_once_and_missed() {
        let roots = ELLIPSOID.roots([-4.0, 2.0, 3.0], [2.0, 0.0, 0.0]).unwrap();
        assert_eq!((roots.approximate_root(false), roots.approximate_root(true)), (1.5, 3.5));
        let touching = ELLIPSOID.roots([-4.0, 3.0, 3.0], [2.0, 0.0, 0.0]).unwrap();
        assert_eq!(touching.standing(2.5).at, 2);
        assert!(ELLIPSOID.roots([-4.0, 3.0f64.next_up(), 3.0], [2.0, 0.0, 0.0]).is_none());
        assert_eq!((ELLIPSOID.sign_at([1.0, 2.0, 3.0]), ELLIPSOID.sign_at([3.0, 2.0, 3.0])), (-1, 0));
        let gradient = ELLIPSOID.half_gradient(&scaled_vector([3.0, 2.5, 3.0], -1), -1);
        assert_eq!(gradient, [4.into(), 4.into(), 0.into()]);
    }

    #[test]
    fn a_sphere_is_its_quadric() {
        let by_sphere = QuadricRow::sphere_roots([0.5, 0.25, -7.0], [0.0, 0.125, 1.0], [0.0; 3], 3.0).unwrap();
        let row = QuadricRow { center: [0.0; 3], diagonal: [1.0; 3], constant: -9.0, ..ELLIPSOID };
        let by_quadric = row.roots([0.5, 0.25, -7.0], [0.0, 0.125, 1.0]).unwrap();
        assert_eq!(by_sphere.approximate_root(true), by_quadric.approximate_root(true));
        assert_eq!(by_sphere.approximate_root(false), by_quadric.approximate_root(false));
    }

    #[test]
    fn a_line_in_the_surface_and_a_ray_beside_it_have_no_root() {
        // x² + y² = z².
        let cone = QuadricRow { center: [0.0; 3], diagonal: [1.0, 1.0, -1.0], constant: 0.0, ..ELLIPSOID };
        assert!(cone.roots([-2.0, 0.0, 2.0], [1.0, 0.0, -1.0]).is_none());
        assert_eq!(cone.roots([-2.0, 0.0, 0.0], [1.0, 0.0, 0.0]).unwrap().standing(2.0).at, 2);
    }
}
