//! A frame, and one name for all that decides its true image.

use crc32fast::Hasher;

use crate::render::{Filter, Settings};
use crate::world::{Camera, World};

/// What is rendered in many ways.
#[derive(Clone, Copy, Debug)]
pub struct Frame<'a> {
    /// The tables.
    pub world: &'a World,
    /// The camera.
    pub camera: &'a Camera,
    /// What all ways have in common unless they say otherwise: depth, filter, cut-off, seed, threads. The region is the whole image.
    pub settings: &'a Settings,
}

impl Frame<'_> {
    /// 16 hexadecimal digits: checksums of the world, and of camera and settings as far as they decide the pixel integrals.
    pub fn hash(&self) -> String {
        let Settings { filter, max_depth, terminator, course, .. } = self.settings;
        let Camera { world_from_camera, fov_y_radians, width_px, height_px } = self.camera;
        let mut sum = Hasher::new();
        world_from_camera.to_cols_array().iter().for_each(|entry| sum.update(&entry.to_le_bytes()));
        sum.update(&fov_y_radians.to_le_bytes());
        [*width_px, *height_px, *max_depth].iter().for_each(|number| sum.update(&number.to_le_bytes()));
        let filter = match filter {
            Filter::Box => 0,
            Filter::Triangle => 1,
            Filter::Gaussian => 2,
            Filter::BlackmanHarris => 3,
        };
        sum.update(&[filter, u8::from(*terminator), u8::from(*course)]);
        format!("{:08x}{:08x}", self.world.fingerprint(), sum.finalize())
    }
}

#[cfg(test)]
mod tests {
    use glam::DMat4;

    use super::*;

    #[test]
    fn what_changes_the_true_image_changes_the_name_and_nothing_else_does() {
        let world = World::default();
        let camera = Camera { world_from_camera: DMat4::IDENTITY, fov_y_radians: 1.0, width_px: 8, height_px: 4 };
        let settings = Settings::new(&camera);
        let hash = |world: &World, camera: &Camera, settings: &Settings| Frame { world, camera, settings }.hash();
        let own = hash(&world, &camera, &settings);
        assert_eq!(own.len(), 16);
        assert_eq!(own, hash(&world, &camera, &Settings { samples: 9, seed: 4, threads: 7, ..settings.clone() }));
        let others = [
            hash(&World { two_sided: true, ..World::default() }, &camera, &settings),
            hash(&world, &Camera { width_px: 9, ..camera }, &settings),
            hash(&world, &Camera { fov_y_radians: 1.1, ..camera }, &settings),
            hash(&world, &camera, &Settings { max_depth: 4, ..settings.clone() }),
            hash(&world, &camera, &Settings { filter: Filter::Gaussian, ..settings.clone() }),
        ];
        assert!(others.iter().all(|other| *other != own));
    }
}
