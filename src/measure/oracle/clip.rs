//! Which hits of a quadric lie in its clip: a linear function of the ray parameter against the ends of its range.

use super::integer::{difference, dot, finest_exponent, scaled, scaled_vector};
use super::{Polynomial, Vector};

/// The points x with loᵢ ≤ nᵢ·(x − c) ≤ hiᵢ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClipRows {
    /// c.
    pub center: Vector,
    /// n.
    pub rows: [Vector; 3],
    /// Lower ends; may be −∞.
    pub lo: Vector,
    /// Upper ends; may be ∞.
    pub hi: Vector,
}

impl ClipRows {
    /// What of the roots of a line lies inside.
    pub fn keep(&self, roots: Polynomial, origin: Vector, direction: Vector) -> Option<Polynomial> {
        let mut kept = Some(roots);
        for i in 0..3 {
            for (end, sign) in [(self.lo[i], 1), (self.hi[i], -1)] {
                if !end.is_finite() {
                    // −∞ below and ∞ above cut nothing off, the other way round everything.
                    kept = kept.filter(|_| (end < 0.0) == (sign > 0));
                    continue;
                }
                kept = kept.and_then(|roots| self.cut(roots, self.rows[i], end, sign, origin, direction));
            }
        }
        kept
    }

    /// Roots with sign·(n·(o + t·d − c) − end) ≥ 0.
    fn cut(
        &self,
        roots: Polynomial,
        row: Vector,
        end: f64,
        sign: i32,
        origin: Vector,
        direction: Vector,
    ) -> Option<Polynomial> {
        let point = finest_exponent(origin.into_iter().chain(self.center)).unwrap_or(0);
        let along = finest_exponent(direction).unwrap_or(0);
        let of_row = finest_exponent(row).unwrap_or(0);
        let n = scaled_vector(row, of_row);
        let from = difference(&scaled_vector(origin, point), &scaled_vector(self.center, point));

        // Value at the origin in units of 2^unit, slope in units of 2^(of_row + along).
        let unit = finest_exponent([end]).map_or(of_row + point, |e| e.min(of_row + point));
        let value = (dot(&n, &from) << (of_row + point - unit) as u64) - scaled(end, unit);
        let slope = dot(&n, &scaled_vector(direction, along));
        roots.keep_where(&(value * sign), &(slope * sign), unit - of_row - along)
    }
}

#[cfg(test)]
mod tests {
    use super::super::QuadricRow;
    use super::*;

    #[test]
    fn a_slab_keeps_the_roots_inside_it() {
        let sphere = |d: Vector| QuadricRow::sphere_roots([-4.0, 0.0, 0.5], d, [0.0; 3], 1.25);
        let (none, all) = (f64::NEG_INFINITY, f64::INFINITY);
        let clip = |lo: f64, hi: f64, row: Vector| ClipRows {
            center: [0.25, 0.0, 0.0],
            rows: [[0.0; 3], row, [0.0; 3]],
            lo: [none, lo, none],
            hi: [all, hi, all],
        };
        let roots = |clip: ClipRows| {
            let d = [2.0, 0.0, 0.0];
            clip.keep(sphere(d).unwrap(), [-4.0, 0.0, 0.5], d)
        };
        // x from √(1.5625 − 0.25) = 1.1456 to either side.
        let x = [1.0, 0.0, 0.0];
        let right = roots(clip(0.0, all, x)).unwrap();
        assert!(!right.has_root_within(1.0, 2.0) && right.has_root_within(2.5, 3.0));
        let left = roots(clip(0.0, all, [-8.0, 0.0, 0.0])).unwrap();
        assert!(left.has_root_within(1.0, 2.0) && !left.has_root_within(2.5, 3.0) && left.has_positive_root());
        assert!(roots(clip(-1.0, 0.5, x)).is_none());
        assert!(roots(clip(0.5, 0.5, [0.0, 0.0, 1.0])).unwrap().has_root_within(1.0, 2.0), "a plane along the ray");
        assert!(roots(clip(0.5f64.next_up(), all, [0.0, 0.0, 1.0])).is_none());
        assert!(roots(clip(all, all, x)).is_none() && roots(clip(none, all, x)).is_some());
    }
}
