//! Exact facts about triangles with f32 corners.

use glam::{DVec3, Vec3};

/// Whether the corners lie on one line or point, so that no ray can hit the triangle. Corners must be finite.
pub fn is_degenerate(corners: [Vec3; 3]) -> bool {
    let _ = corners;
    false
}

/// The unit normal by the winding, of a triangle that is not degenerate.
pub fn unit_normal(corners: [Vec3; 3]) -> DVec3 {
    let [a, b, c] = corners.map(|corner| corner.as_dvec3());
    (b - a).cross(c - a).normalize_or_zero()
}
