//! Plain settings.

use flatray::render::Settings;
use flatray::world::Camera;

/// One centre sample over the whole image, depth 5, two threads.
pub fn center_settings(camera: &Camera) -> Settings {
    Settings { threads: 2, ..Settings::new(camera) }
}
