//! The pinhole camera.

use glam::{DMat4, DVec3};

/// A camera that looks along its own −z, x to the right, y up, with square pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Camera space to world space; invertible and affine.
    pub world_from_camera: DMat4,
    /// Vertical field of view, between 0 and π exclusive.
    pub fov_y_radians: f64,
    /// Width of the whole image.
    pub width_px: u32,
    /// Height of the whole image.
    pub height_px: u32,
}

impl Camera {
    /// A camera at `position` that looks at `target`. `None` when the direction is zero or parallel to `up`, or
    /// anything is not finite.
    pub fn look_at_frame(position: DVec3, target: DVec3, up: DVec3) -> Option<DMat4> {
        let back = (position - target).try_normalize()?;
        let right = up.try_normalize()?.cross(back).try_normalize()?;
        let true_up = back.cross(right);
        let frame = DMat4::from_cols(right.extend(0.0), true_up.extend(0.0), back.extend(0.0), position.extend(1.0));
        frame.is_finite().then_some(frame)
    }
}
