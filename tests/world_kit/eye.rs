//! Rays of cameras, from the definition of a pinhole camera.

use flatray::world::Camera;
use glam::DVec3;

/// The unit direction through the centre of a pixel, from the definition of a pinhole camera.
pub fn pixel_direction(camera: &Camera, x: u32, y: u32) -> DVec3 {
    let half_height = (0.5 * camera.fov_y_radians).tan();
    let pixel = 2.0 * half_height / f64::from(camera.height_px);
    let right = (f64::from(x) + 0.5 - 0.5 * f64::from(camera.width_px)) * pixel;
    let up = (0.5 * f64::from(camera.height_px) - f64::from(y) - 0.5) * pixel;
    camera.world_from_camera.transform_vector3(DVec3::new(right, up, -1.0)).normalize()
}

/// Where a camera stands.
pub fn eye(camera: &Camera) -> DVec3 {
    camera.world_from_camera.w_axis.truncate()
}
