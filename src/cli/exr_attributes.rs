//! What the header of an EXR file says of a render.

use std::path::Path;

use glam::{DMat4, DVec4};

use super::args::RenderArgs;
use super::budget::Budget;
use super::plan::Plan;
use super::{aov_args, output};
use crate::film::exr::ExrAttributes;
use crate::render::{Filter, Settings};
use crate::scene::Compiled;
use crate::world::Camera;

/// The name of the scene that is rendered when none is given.
const BUILT_IN: &str = "built-in scene";

/// The attributes of a render: the camera, what tells it from other renders of the same size, and the names of mattes. None depends on the place
/// of the scene's file, the machine or the crop.
pub fn attributes_of(args: &RenderArgs, scene: &Compiled, plan: &Plan) -> ExrAttributes {
    if !output::writes_exr(args) {
        return ExrAttributes::default();
    }
    let Compiled { camera, names, world, .. } = scene;
    let Settings { samples, sampler, filter, seed, max_depth, terminator, course, cutoff, .. } = plan.settings;
    let file = args.input.as_deref().and_then(Path::file_name).map_or(BUILT_IN.into(), |name| name.to_string_lossy());
    // Seeds have 64 bits, and attributes have no such number.
    let mut texts = vec![("scene", file.into_owned()), ("seed", seed.to_string())];
    // Both are far below 2^31.
    let mut numbers = vec![("maxDepth", max_depth as i32), ("terminator", i32::from(terminator))];
    match plan.budget {
        Budget::Samples => {
            texts.push(("sampler", sampler.name().into()));
            numbers.push(("samples", samples as i32));
        }
        Budget::Error(target) => texts.push(("errorAtMost", format!("{target:e}"))),
        Budget::Seconds(seconds) => texts.push(("secondsAtMost", seconds.to_string())),
    }
    let filter = match filter {
        Filter::Box => "box",
        Filter::Triangle => "triangle",
        Filter::Gaussian => "gaussian",
        Filter::BlackmanHarris => "blackman-harris",
    };
    texts.push(("filter", filter.into()));
    texts.push(("cutoff", format!("{cutoff:e}")));
    texts.push(("world", format!("{:08x}", world.fingerprint())));
    if course {
        texts.push(("compat", "course".into()));
    }
    let own_name = |name: &str| format!("flatray/{name}");
    ExrAttributes {
        world_to_camera: Some(stored(camera_from_world(camera))),
        world_to_ndc: Some(stored(ndc_from_world(camera))),
        numbers: numbers.into_iter().map(|(name, value)| (own_name(name), value)).collect(),
        texts: texts
            .into_iter()
            .map(|(name, value)| (own_name(name), value))
            .chain(aov_args::attributes(&plan.settings.aovs, names))
            .collect(),
        ..ExrAttributes::default()
    }
}

/// World space to OpenEXR's camera space: left-handed, x to the right, y up, z in the direction of view.
fn camera_from_world(camera: &Camera) -> DMat4 {
    let flip_z = DMat4::from_diagonal(DVec4::new(1.0, 1.0, -1.0, 1.0));
    flip_z * camera.world_from_camera.inverse()
}

/// World space to OpenEXR's NDC: after division by w, (0, 0) is the upper left and (1, 1) the lower right corner of the image;
/// z is 0 in the plane at distance 1 and nears 1 far away, so that the matrix has an inverse.
fn ndc_from_world(camera: &Camera) -> DMat4 {
    let half_height = libm::tan(0.5 * camera.fov_y_radians);
    let half_width = half_height * f64::from(camera.width_px) / f64::from(camera.height_px);
    let ndc_from_camera = DMat4::from_cols(
        DVec4::new(0.5 / half_width, 0.0, 0.0, 0.0),
        DVec4::new(0.0, -0.5 / half_height, 0.0, 0.0),
        DVec4::new(0.5, 0.5, 1.0, 1.0),
        DVec4::new(0.0, 0.0, -1.0, 0.0),
    );
    ndc_from_camera * camera_from_world(camera)
}

/// Row after row of the matrix for row vectors, which is column after column of ours for column vectors.
fn stored(matrix: DMat4) -> [f32; 16] {
    matrix.to_cols_array().map(|value| value as f32)
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::render::camera_ray::CameraRays;

    fn camera() -> Camera {
        let frame = Camera::look_at_frame(DVec3::new(3.0, 1.0, -2.0), DVec3::new(-1.0, 0.5, 4.0), DVec3::Y).unwrap();
        Camera { world_from_camera: frame, fov_y_radians: 0.8, width_px: 160, height_px: 90 }
    }

    /// What a reader does: a row vector times the stored matrix.
    fn transformed(point: DVec3, matrix: [f32; 16]) -> [f64; 4] {
        let row = [point.x, point.y, point.z, 1.0];
        std::array::from_fn(|column| (0..4).map(|at| row[at] * f64::from(matrix[4 * at + column])).sum())
    }

    #[test]
    fn a_point_projects_to_the_pixel_whose_ray_meets_it() {
        let camera = camera();
        let rays = CameraRays::new(&camera);
        for (x_px, y_px, t) in [(0.0, 0.0, 1.0), (160.0, 90.0, 2.0), (80.0, 45.0, 7.0), (33.5, 70.25, 100.0)] {
            let ray = rays.ray(x_px, y_px);
            let point = ray.origin + t * ray.direction;
            let [x, y, _, w] = transformed(point, stored(ndc_from_world(&camera)));
            assert!((x / w * 160.0 - x_px).abs() < 1e-3, "{} instead of {x_px}", x / w * 160.0);
            assert!((y / w * 90.0 - y_px).abs() < 1e-3, "{} instead of {y_px}", y / w * 90.0);
        }
    }

    #[test]
    fn what_lies_ahead_right_and_above_has_positive_coordinates() {
        let camera = camera();
        let rays = CameraRays::new(&camera);
        let ahead = rays.ray(80.0, 45.0);
        let [x, y, z, w] = transformed(ahead.origin + 5.0 * ahead.direction, stored(camera_from_world(&camera)));
        assert!(x.abs() < 1e-5 && y.abs() < 1e-5 && (z - 5.0).abs() < 1e-5 && w == 1.0, "{x} {y} {z} {w}");
        let up_right = rays.ray(160.0, 0.0);
        let [x, y, z, _] = transformed(up_right.origin + up_right.direction, stored(camera_from_world(&camera)));
        assert!(x > 0.0 && y > 0.0 && z > 0.0, "{x} {y} {z}");
        assert!(ndc_from_world(&camera).determinant().abs() > 1e-6, "the matrix has an inverse");
    }
}
