//! Rays of a pinhole camera.

use glam::{DMat3, DVec3};

use crate::accel::Beam;
use crate::world::{Camera, Ray};

/// A camera as the sampler wants it.
#[derive(Clone, Copy, Debug)]
pub struct CameraRays {
    origin: DVec3,
    world_from_camera: DMat3,
    /// Half the width and height of the image plane at distance 1.
    half_size: [f64; 2],
    size_px: [f64; 2],
    /// What a direction has along the view axis, in camera space: the product with this.
    view_axis: DVec3,
}

impl CameraRays {
    /// Prepares a camera. `tan` comes from libm, so that bits are the same on every machine.
    pub fn new(camera: &Camera) -> CameraRays {
        let (width, height) = (f64::from(camera.width_px), f64::from(camera.height_px));
        let half_height = libm::tan(0.5 * camera.fov_y_radians);
        CameraRays {
            origin: camera.world_from_camera.w_axis.truncate(),
            world_from_camera: DMat3::from_mat4(camera.world_from_camera),
            half_size: [half_height * width / height, half_height],
            size_px: [width, height],
            view_axis: -DMat3::from_mat4(camera.world_from_camera).inverse().row(2),
        }
    }

    /// How far a point of a ray is from the camera along the view axis, in the camera's units.
    #[inline]
    pub fn depth(&self, ray: &Ray, t: f64) -> f64 {
        self.view_axis.dot(ray.direction) * t
    }

    /// The ray through a point of the image, in pixels from its top left corner. The direction is of unit length in
    /// camera space, as in the original: a scaled camera frame scales it.
    #[inline]
    pub fn ray(&self, x_px: f64, y_px: f64) -> Ray {
        let x = (2.0 * x_px / self.size_px[0] - 1.0) * self.half_size[0];
        let y = (1.0 - 2.0 * y_px / self.size_px[1]) * self.half_size[1];
        let direction = DVec3::new(x, y, -1.0);
        let unit = direction / direction.length();
        Ray::new(self.origin, self.world_from_camera * unit)
    }

    /// What is seen through a part of the image, from its top left corner to its lower right one, in pixels. Its depth is
    /// [`CameraRays::depth`].
    pub fn beam(&self, from_px: [f64; 2], to_px: [f64; 2]) -> Beam {
        let ([left, top], [right, bottom]) = (from_px, to_px);
        let corners = [[left, top], [right, top], [right, bottom], [left, bottom]];
        Beam::new(self.origin, corners.map(|[x, y]| self.ray(x, y).direction), self.view_axis)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DMat4;

    #[test]
    fn the_centre_looks_along_minus_z_and_corners_span_the_field_of_view() {
        let camera = Camera {
            world_from_camera: DMat4::from_translation(DVec3::new(1.0, 2.0, 3.0)),
            fov_y_radians: std::f64::consts::FRAC_PI_2,
            width_px: 200,
            height_px: 100,
        };
        let rays = CameraRays::new(&camera);
        assert_eq!(rays.ray(100.0, 50.0).direction, -DVec3::Z);
        assert_eq!(rays.ray(100.0, 50.0).origin, DVec3::new(1.0, 2.0, 3.0));
        assert_eq!(rays.depth(&rays.ray(3.0, 71.0), 2.0), 2.0 / rays.ray(3.0, 71.0).direction.z.abs().recip());
        let corner = rays.ray(0.0, 0.0).direction;
        assert!((corner / -corner.z - DVec3::new(-2.0, 1.0, -1.0)).length() < 1e-15);
    }
}
