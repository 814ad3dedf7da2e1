//! Cameras.

use flatray::world::Camera;
use glam::DVec3;

/// A camera at `position` that looks at `target`, y up unless it looks along y.
pub fn camera(position: DVec3, target: DVec3, fov_y_degrees: f64, width_px: u32, height_px: u32) -> Camera {
    let along_y = (target - position).cross(DVec3::Y).length() < 1e-9 * (target - position).length();
    let up = if along_y { DVec3::Z } else { DVec3::Y };
    let world_from_camera = Camera::look_at_frame(position, target, up).unwrap();
    Camera { world_from_camera, fov_y_radians: fov_y_degrees.to_radians(), width_px, height_px }
}
