//! Cones and cylinders as quadrics around their own middle.
//!
//! With the unit axis n from base to apex, the length L, the radius r in the middle and its growth m = (apex radius − base
//! radius)/L along the axis, the points at y from the middle with
//!
//! |y|² − (n·y)² = (r + m·(n·y))²
//!
//! are those of the cone, between the planes n·y = ±L/2: yᵀQy + 2 g·y + s = 0 with Q = I − (1 + m²)·nnᵀ, g = −m·r·n, s = −r².
//! The gradient points outwards.
//!
//! **Errors.** n, L, m and r are wrong by at most 4u of themselves, and the middle by u of the coordinates, as the ends are.
//! 1 − nᵢ² on the diagonal of Q is nⱼ² + nₖ², which keeps its digits where the cone runs along an axis of the world. Each
//! entry of Q is then wrong by at most 16u·(1 + m²), g and s by as much of themselves: all of it moves the surface by about
//! 16u·(1 + m²)·((L/2)² + r²)/r, which is 8u of the radius times the square of how many times longer than wide the cone is.
//! Around the origin of the world instead, s would be wrong by u of the squared distance.

use glam::DVec3;

use crate::numeric::quadric::Quadric;

/// A cone between two ends.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cone {
    /// The whole double cone, or cylinder.
    pub surface: Quadric,
    /// Unit vector from the base to the apex.
    pub axis: DVec3,
    /// The ends lie so far from the surface's centre along the axis.
    pub half_length: f64,
}

impl Cone {
    /// The cone of two different ends within the range of f32 and two radii from 0 up, not both 0; `None` where it is so
    /// short that its numbers leave the range of f64.
    pub fn new(base: DVec3, base_radius: f64, apex: DVec3, apex_radius: f64) -> Option<Cone> {
        let between = apex - base;
        // Scaled, so that no square underflows.
        let largest = between.abs().max_element();
        let direction = between / largest;
        let length = largest * direction.length();
        let n = direction.normalize();
        let m = (apex_radius - base_radius) / length;
        let r = 0.5 * (base_radius + apex_radius);

        let squares = n * n;
        let across = DVec3::new(squares.y + squares.z, squares.x + squares.z, squares.x + squares.y);
        let diagonal = across - m * m * squares;
        let off_diagonal = -(1.0 + m * m) * DVec3::new(n.y * n.z, n.x * n.z, n.x * n.y);
        let surface = Quadric::around(base + 0.5 * between, diagonal, off_diagonal, -m * r * n, -r * r);
        surface.is_finite().then_some(Cone { surface, axis: n, half_length: 0.5 * length })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::U;

    /// The value of the surface at a point in the world, and half of its gradient.
    fn value_and_gradient(cone: &Cone, p: DVec3) -> (f64, DVec3) {
        let h = p - cone.surface.center;
        let gradient = cone.surface.half_gradient(h);
        (h.dot(gradient + cone.surface.linear) + cone.surface.constant, gradient)
    }

    #[test]
    fn points_on_the_rims_and_between_lie_on_the_surface_and_its_gradient_points_outwards() {
        let cases = [
            (DVec3::new(1.0, 2.0, 3.0), 0.5, DVec3::new(1.0, 2.0, 7.0), 0.5),
            (DVec3::new(1.0, 2.0, 3.0), 0.5, DVec3::new(-2.0, 2.5, 3.25), 0.25),
            (DVec3::ZERO, 2.0, DVec3::new(0.1, -0.2, 0.3), 0.0),
            (DVec3::ZERO, 0.0, DVec3::new(3.0, 0.0, 0.0), 1.0),
            (DVec3::splat(1e7), 0.01, DVec3::splat(1e7) + DVec3::new(0.5, 0.25, 1.0), 0.02),
            (DVec3::ZERO, 1e-30, DVec3::new(0.0, 1e-30, 1e-31), 2e-30),
        ];
        for (base, base_radius, apex, apex_radius) in cases {
            let cone = Cone::new(base, base_radius, apex, apex_radius).unwrap();
            let across = cone.axis.any_orthonormal_pair();
            let length = (apex - base).length();
            assert!(
                (2.0 * cone.half_length / length - 1.0).abs() < 8.0 * U && (cone.axis.length() - 1.0).abs() < 4.0 * U
            );
            let slope = (apex_radius - base_radius) / length;
            for (along, turn) in [(0.0, 0.3), (0.25, 2.0), (0.5, 4.0), (0.75, 5.0), (1.0, 6.0)] {
                let radius = base_radius + along * (apex_radius - base_radius);
                let (sine, cosine) = libm::sincos(turn);
                let out = cosine * across.0 + sine * across.1;
                let p = base + along * (apex - base) + radius * out;
                let (value, gradient) = value_and_gradient(&cone, p);
                // Off by the rounding of the point too, which the gradient multiplies.
                let size = (1.0 + slope * slope) * (length * length + (base_radius + apex_radius).powi(2));
                let rounding = 2.0 * gradient.length() * p.abs().max_element();
                assert!(value.abs() <= 32.0 * U * (size + rounding), "{base} {apex} {along}: {value:e}");
                // Outwards across the axis, and towards the thin end.
                let normal = (out - slope * cone.axis).normalize();
                let straight = gradient.try_normalize().unwrap_or(normal).dot(normal);
                // What the point is rounded by, seen from the axis, turns the normal; the cosine goes by the square of it.
                let tilt = 4.0 * U * (p.abs().max_element() / radius + 1.0);
                assert!(radius == 0.0 || straight >= 1.0 - tilt * tilt - 4.0 * U, "{gradient} {normal}");
            }
        }
    }

    #[test]
    fn a_cylinder_along_an_axis_of_the_world_is_exact() {
        let cone = Cone::new(DVec3::new(1.0, 2.0, 3.0), 0.5, DVec3::new(1.0, 2.0, 7.0), 0.5).unwrap();
        let Quadric { center, diagonal, off_diagonal, linear, constant, .. } = cone.surface;
        assert_eq!((center, diagonal), (DVec3::new(1.0, 2.0, 5.0), DVec3::new(1.0, 1.0, 0.0)));
        assert_eq!((off_diagonal.abs(), linear.abs(), constant), (DVec3::ZERO, DVec3::ZERO, -0.25));
        assert_eq!((cone.axis, cone.half_length), (DVec3::Z, 2.0));
    }

    #[test]
    fn a_cone_too_short_for_numbers_is_none() {
        assert!(Cone::new(DVec3::ZERO, 1e38, DVec3::new(5e-324, 0.0, 0.0), 0.0).is_none());
        assert!(Cone::new(DVec3::ZERO, 1.0, DVec3::new(1e-300, 0.0, 0.0), 0.0).is_none());
        assert!(Cone::new(DVec3::ZERO, 1.0, DVec3::new(1e-300, 0.0, 0.0), 1.0).is_some());
    }
}
