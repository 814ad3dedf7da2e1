//! Clips of quadrics: whether the point of a ray at a root lies in a box, decided exactly.

use glam::DVec3;

use super::U;
use super::double::{is_tame, is_tame3};
use super::dyadic::Dyadic;
use super::prepared::PreparedRay;
use super::quadratic::{ExactCoefficients, sign_at_root};
use super::ratio::{Parameter, Ratio};

/// The points x with loᵢ ≤ nᵢ·(x − c) ≤ hiᵢ for each of three rows nᵢ: a closed box in a frame of its own.
///
/// Rows are of any length and need not be at right angles, so that a box in the axes of an object is still one after any
/// affine transform. A row that does not clip has the ends −∞ and ∞, and may be zero. Ends are in units of the row's length
/// times the world's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clip {
    /// c, in world space; finite. Near the object, so that a box far from the origin keeps its digits.
    pub center: DVec3,
    /// n; finite.
    pub rows: [DVec3; 3],
    /// Lower ends; finite or −∞.
    pub lo: DVec3,
    /// Upper ends; finite or ∞.
    pub hi: DVec3,
    /// Whether centre and rows are tame in the sense of [`is_tame`].
    pub tame: bool,
}

impl Clip {
    /// A box in a frame.
    pub fn new(center: DVec3, rows: [DVec3; 3], lo: DVec3, hi: DVec3) -> Clip {
        debug_assert!(center.is_finite() && rows.iter().all(|row| row.is_finite()));
        let tame = is_tame3(center) && rows.into_iter().all(is_tame3);
        Clip { center, rows, lo, hi, tame }
    }

    /// A box in the axes of the world; ends may be infinite.
    pub fn world_box(lo: DVec3, hi: DVec3) -> Clip {
        Clip::new(DVec3::ZERO, [DVec3::X, DVec3::Y, DVec3::Z], lo, hi)
    }

    /// What lies between the plane through `base` and the plane through `base + axis`, both at right angles to the axis:
    /// 0 ≤ axis·(x − base) ≤ |axis|², the last rounded once per term.
    pub fn along(base: DVec3, axis: DVec3) -> Clip {
        let (lo, hi) = (f64::NEG_INFINITY, f64::INFINITY);
        let length_squared = axis.dot(axis);
        Clip::new(base, [axis, DVec3::ZERO, DVec3::ZERO], DVec3::new(0.0, lo, lo), DVec3::new(length_squared, hi, hi))
    }

    /// The smaller root whose point lies inside; both are certain to lie in the ray's interval or not.
    #[inline(always)]
    pub(super) fn first_inside(
        &self,
        ray: &PreparedRay,
        roots: [Ratio; 2],
        exact: impl Fn() -> ExactCoefficients,
    ) -> Option<Parameter> {
        let order = match roots {
            [Ratio::Inside(first), Ratio::Inside(second)] if second.t < first.t => [1, 0],
            _ => [0, 1],
        };
        for root in order {
            let Ratio::Inside(at) = roots[root] else { continue };
            let inside = match self.certainly_contains(ray, at.t) {
                Some(inside) => inside,
                None => self.contains(ray, root, &exact()),
            };
            if inside {
                return Some(at);
            }
        }
        None
    }

    /// The f64 tier, for a t within 1 ulp of the root. First-order errors in units of u: 2 for t, 1 for each difference
    /// o − c, 2 for product and sum that make a point, 3 for the dot product: 7 of the summed magnitudes; 1 for the
    /// comparison.
    #[inline(always)]
    fn certainly_contains(&self, ray: &PreparedRay, t: f64) -> Option<bool> {
        if !(self.tame & ray.tame & is_tame(t)) {
            return None;
        }
        let (from, along) = (ray.origin - self.center, t * ray.direction);
        let (point, size) = (from + along, from.abs() + along.abs());
        let mut contains = Some(true);
        for (i, row) in self.rows.iter().enumerate() {
            let value = row.dot(point);
            let error = 8.5 * U * row.abs().dot(size);
            if value + error < self.lo[i] || value - error > self.hi[i] {
                return Some(false);
            }
            if !(value - error >= self.lo[i] && value + error <= self.hi[i]) {
                contains = None;
            }
        }
        contains
    }

    /// The exact tier: the sign of n·(o − c) − end + t·(n·d) at the root.
    #[cold]
    fn contains(&self, ray: &PreparedRay, root: usize, coefficients: &ExactCoefficients) -> bool {
        let from = Dyadic::difference(&Dyadic::vector(ray.origin), &Dyadic::vector(self.center));
        let along = Dyadic::vector(ray.direction);
        (0..3).all(|i| {
            let row = Dyadic::vector(self.rows[i]);
            let (value, slope) = (Dyadic::dot(&row, &from), Dyadic::dot(&row, &along));
            let side = |end: f64| sign_at_root(coefficients, root, &value.sub(&Dyadic::new(end)), &slope);
            let [lo, hi] = [self.lo[i], self.hi[i]];
            (lo == f64::NEG_INFINITY || (lo.is_finite() && side(lo) >= 0))
                && (hi == f64::INFINITY || (hi.is_finite() && side(hi) <= 0))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::quadric::{Quadric, intersect};
    use glam::{DMat4, DVec4, dvec3};

    const EVERYWHERE: f64 = f64::INFINITY;

    fn hit(quadric: &Quadric, clip: &Clip, origin: DVec3, direction: DVec3) -> Option<f64> {
        let ray = PreparedRay::new(origin, direction, 0.0, f64::INFINITY).unwrap();
        intersect(&ray, quadric, Some(clip)).map(|hit| hit.t)
    }

    /// x² + y² = 1.
    fn cylinder() -> Quadric {
        Quadric::from_matrix(DMat4::from_cols(DVec4::X, DVec4::Y, DVec4::ZERO, -DVec4::W))
    }

    #[test]
    fn a_ray_through_the_open_end_of_a_cylinder_hits_it_from_inside() {
        let clip = Clip::along(DVec3::ZERO, 2.0 * DVec3::Z);
        // Enters at x = −1, z = −1 (clipped away), leaves at x = 1, z = 1.
        assert_eq!(hit(&cylinder(), &clip, dvec3(-2.0, 0.0, -2.0), dvec3(1.0, 0.0, 1.0)), Some(3.0));
        // Within both, above both.
        assert_eq!(hit(&cylinder(), &clip, dvec3(-2.0, 0.0, 1.0), DVec3::X), Some(1.0));
        assert_eq!(hit(&cylinder(), &clip, dvec3(-2.0, 0.0, 2.5), DVec3::X), None);
    }

    #[test]
    fn the_rims_are_part_of_the_surface_to_the_last_bit() {
        let clip = Clip::world_box(dvec3(-EVERYWHERE, -EVERYWHERE, 0.0), dvec3(EVERYWHERE, EVERYWHERE, 0.1));
        for (z, expected) in [(0.0, true), (0.1, true), (-5e-324, false), (0.1f64.next_up(), false)] {
            let found = hit(&cylinder(), &clip, dvec3(-2.0, 0.0, z), DVec3::X);
            assert_eq!(found, expected.then_some(1.0), "{z:e}");
        }
    }

    #[test]
    fn a_box_of_no_thickness_keeps_what_lies_in_its_plane() {
        let flat = Clip::world_box(dvec3(-EVERYWHERE, -EVERYWHERE, 0.5), dvec3(EVERYWHERE, EVERYWHERE, 0.5));
        assert_eq!(hit(&cylinder(), &flat, dvec3(-2.0, 0.0, 0.5), DVec3::X), Some(1.0));
        assert_eq!(hit(&cylinder(), &flat, dvec3(-2.0, 0.0, 0.0), dvec3(1.0, 0.0, 0.5)), Some(1.0));
        assert_eq!(hit(&cylinder(), &flat, dvec3(-2.0, 0.0, 0.5f64.next_up()), DVec3::X), None);
        assert_eq!(hit(&cylinder(), &flat, dvec3(-2.0, 0.0, 0.0), dvec3(1.0, 0.0, 0.25)), None);
    }

    #[test]
    fn an_end_that_no_bound_can_tell_is_told_exactly() {
        // The root is √2, between two doubles.
        let clip = |hi: f64| Clip::world_box(DVec3::NEG_INFINITY, dvec3(hi, EVERYWHERE, EVERYWHERE));
        let two = Quadric::from_matrix(DMat4::from_cols(DVec4::X, DVec4::Y, DVec4::ZERO, -2.0 * DVec4::W));
        let end = std::f64::consts::SQRT_2;
        assert!(hit(&two, &clip(end), DVec3::ZERO, DVec3::X).is_some(), "the nearest double is above √2");
        assert!(hit(&two, &clip(end.next_down()), DVec3::ZERO, DVec3::X).is_none());
    }
}
