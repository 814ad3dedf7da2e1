//! Ray against triangle: the point in the plane, then three half-planes.

use num_bigint::Sign;

use super::integer::{cross, difference, dot, finest_exponent, scaled_vector, sum, times};
use super::{Polynomial, Vector};

/// The root at which a line meets a triangle of finite corners; `None` when it does not, or lies in the plane.
///
/// With n = (b−a)×(c−a), D = n·d and N = n·(a−o) the line meets the plane at p = o + (N/D)·d. The point lies in the
/// triangle when it is on the inner side of each edge: ((b−a)×(p−a))·n ≥ 0 and so on; times D and its sign, this is
/// about integers.
pub fn roots(origin: Vector, direction: Vector, corners: [Vector; 3]) -> Option<Polynomial> {
    let points = origin.into_iter().chain(corners.into_iter().flatten());
    let point_scale = finest_exponent(points).unwrap_or(0);
    let direction_scale = finest_exponent(direction)?;
    let o = scaled_vector(origin, point_scale);
    let d = scaled_vector(direction, direction_scale);
    let [a, b, c] = corners.map(|corner| scaled_vector(corner, point_scale));
    let edges = [difference(&b, &a), difference(&c, &b), difference(&a, &c)];
    let n = cross(&edges[0], &edges[1]);
    let denominator = dot(&n, &d);
    let sign = denominator.sign();
    if sign == Sign::NoSign {
        return None;
    }
    let numerator = dot(&n, &difference(&a, &o));
    let along = times(&numerator, &d);
    for (edge, corner) in edges.iter().zip([&a, &b, &c]) {
        let to_point = sum(&times(&denominator, &difference(&o, corner)), &along);
        let side = dot(&cross(edge, &to_point), &n).sign();
        if side != Sign::NoSign && side != sign {
            return None;
        }
    }
    Polynomial::linear(numerator, denominator, point_scale - direction_scale)
}

/// The normal by the winding, of any length; zero for a degenerate triangle. Exact: the scale is common.
pub fn normal(corners: [Vector; 3]) -> super::integer::Vector {
    let scale = finest_exponent(corners.into_iter().flatten()).unwrap_or(0);
    let [a, b, c] = corners.map(|corner| scaled_vector(corner, scale));
    cross(&difference(&b, &a), &difference(&c, &a))
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNERS: [Vector; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

    fn root(origin: Vector, direction: Vector) -> Option<f64> {
        roots(origin, direction, CORNERS).map(|p| p.approximate_root(false))
    }

    #[test]
    fn the_inside_the_edges_and_the_corners_are_hit_and_the_plane_is_not() {
        for (x, y) in [(0.25, 0.25), (0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.5, 0.5), (0.0, 0.5), (0.5, 0.0)] {
            assert_eq!(root([x, y, 3.0], [0.0, 0.0, -2.0]), Some(1.5));
            assert_eq!(root([x, y, 3.0], [0.0, 0.0, 2.0]), Some(-1.5));
        }
        assert_eq!(root([0.5, 0.5f64.next_up(), 3.0], [0.0, 0.0, -1.0]), None);
        assert_eq!(root([-1.0, 0.25, 0.0], [1.0, 0.0, 0.0]), None);
        assert_eq!(root([0.25, 0.25, 1.0], [0.0, 0.0, 0.0]), None);
    }
}
