//! Plain settings.

use flatray::film::Region;
use flatray::render::{Aovs, Filter, Sampler, Settings};
use flatray::world::Camera;

/// One centre sample over the whole image, depth 5, two threads.
pub fn center_settings(camera: &Camera) -> Settings {
    Settings {
        samples: 1,
        sampler: Sampler::Center,
        filter: Filter::Box,
        seed: 0,
        max_depth: 5,
        tile_size_px: 32,
        threads: 2,
        region: Region::whole(camera.width_px, camera.height_px),
        terminator: false,
        course: false,
        aovs: Aovs::default(),
    }
}
