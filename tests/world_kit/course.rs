//! Settings of the original.

use flatray::render::{Sampler, Settings};
use flatray::world::Camera;

use super::settings::center_settings;

/// The original's mode: four samples on a grid, depth 5, clamped, f64 planes.
pub fn course_settings(camera: &Camera) -> Settings {
    Settings { samples: 4, sampler: Sampler::Grid, course: true, ..center_settings(camera) }
}
