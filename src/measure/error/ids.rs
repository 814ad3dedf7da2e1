//! Pixels that show another thing than the full scan finds in their centre.

use crate::accel::Accel;
use crate::render::camera_ray::CameraRays;
use crate::world::{Camera, Hit, Ray, World};

/// Primitive tests that the full scan may spend.
const MAX_TESTS: usize = 100_000_000;

/// Rays through the centres of pixels, as many as the full scan can judge, spread evenly; and what it says.
#[derive(Clone, Debug)]
pub struct Centers {
    rays: Vec<Ray>,
    truth: Vec<Hit>,
}

impl Centers {
    /// Asks the full scan.
    pub fn judge(world: &World, camera: &Camera, scan: &Accel) -> Centers {
        let tests_per_ray = world.n_prims() + world.n_placed_triangles() as usize;
        let n_pixels = camera.width_px as usize * camera.height_px as usize;
        let n_rays = (MAX_TESTS / tests_per_ray.max(1)).clamp(1, n_pixels);
        let rays = CameraRays::new(camera);
        let ray = |index: usize| {
            let pixel = (index as u128 * n_pixels as u128 / n_rays as u128) as usize;
            let (x, y) = (pixel % camera.width_px as usize, pixel / camera.width_px as usize);
            rays.ray(x as f64 + 0.5, y as f64 + 0.5)
        };
        let rays: Vec<Ray> = (0..n_rays).map(ray).collect();
        let mut truth = vec![Hit::MISS; n_rays];
        scan.closest_hit(world, &rays, &mut truth);
        Centers { rays, truth }
    }

    /// Pixels judged.
    pub fn len(&self) -> usize {
        self.rays.len()
    }

    /// Whether none is.
    pub fn is_empty(&self) -> bool {
        self.rays.is_empty()
    }

    /// Pixels where a structure finds another primitive or placement.
    pub fn wrong(&self, world: &World, accel: &Accel) -> u64 {
        let mut hits = vec![Hit::MISS; self.rays.len()];
        accel.closest_hit(world, &self.rays, &mut hits);
        let is_wrong = |(own, truth): &(&Hit, &Hit)| (own.prim, own.instance) != (truth.prim, truth.instance);
        hits.iter().zip(&self.truth).filter(is_wrong).count() as u64
    }
}
