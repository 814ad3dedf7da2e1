//! Leaving out rays that cannot change a pixel by more than is allowed.
//!
//! A world's radiance has a bound R: no ray of the depth allowed brings more in any channel. A camera ray may lose the cut-off in
//! all. What a ray may lose is kept in units of what it can bring, R times its share of the pixel: its *limit*. A child of weight w is
//! not sent where w ≤ limit, since it brings at most w·R; what is sent has the limit divided by w. Where a hit sends two rays, each has half of
//! the limit; where a world has bounces at all, lights have one half and bounces the other, and each of n lights has an n-th of it. So what is lost adds up to
//! no more than the cut-off, in every sample and so in every mean of samples (`docs/ERROR.md`).

use glam::DVec3;

use super::Settings;
use crate::BARE;
use crate::world::{MaterialId, World};

/// What rays may lose; nothing by default.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cutoff {
    /// Limit of a camera ray.
    pub camera_limit: f64,
    /// Share of the limit that bounces have.
    bounce_share: f64,
    /// What a light may bring at a hit without being asked for, for each unit of the ray's limit.
    faint: f64,
}

impl Cutoff {
    /// The cut-off of the settings.
    pub fn new(world: &World, settings: &Settings) -> Cutoff {
        let bound = radiance_bound(world, settings.max_depth);
        // The limit is rounded down by far more than all divisions on a path round it, 1000 of them at most.
        let camera_limit = settings.cutoff / bound * (1.0 - f64::from(f32::EPSILON));
        if BARE || !(camera_limit > 0.0 && camera_limit.is_finite()) {
            return Cutoff::default();
        }
        let features = world.features();
        let has_bounces = settings.max_depth > 1 && (features.reflection || features.refraction);
        let (bounce_share, light_share) = if has_bounces { (0.5, 0.5) } else { (0.0, 1.0) };
        Cutoff { camera_limit, bounce_share, faint: bound * light_share / world.lights.len().max(1) as f64 }
    }

    /// Whether anything may be left out.
    #[inline]
    pub fn is_on(&self) -> bool {
        self.camera_limit > 0.0
    }

    /// The radiance up to which a light is not asked for, at the hit of a ray of a limit.
    #[inline]
    pub fn faint(&self, limit: f64) -> f64 {
        limit * self.faint
    }

    /// The weight up to which one of `n` rays is not sent.
    #[inline]
    pub fn smallest_weight(&self, limit: f64, n: usize) -> f64 {
        limit * self.bounce_share / n as f64
    }
}

/// No ray brings more in any channel, along chains of at most `max_depth` rays.
fn radiance_bound(world: &World, max_depth: u32) -> f64 {
    let (materials, lights) = (&world.materials, &world.lights);
    let sum = |intensities: &[DVec3]| intensities.iter().map(|intensity| intensity.abs()).sum::<DVec3>();
    let intensity = sum(&lights.intensities) + sum(&lights.directional_intensities);
    let local_of = |id: MaterialId| {
        let row = id.idx();
        (materials.ambient[row].abs() + intensity * (materials.diffuse[row].abs() + materials.specular[row].abs()))
            .max_element()
    };
    let rows: Vec<(f64, f64)> = (0..materials.len() as u32)
        .map(MaterialId)
        .map(|id| (local_of(id), materials.reflectance[id.idx()] + materials.transmittance[id.idx()]))
        .collect();
    let background = world.background.abs().max_element();
    let mut bound = 0.0;
    for _ in 0..max_depth {
        let deeper = rows.iter().map(|(local, weight)| local + weight * bound).fold(background, f64::max);
        if deeper == bound {
            break;
        }
        bound = deeper;
    }
    bound
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::Material;

    fn world(k_s: f64) -> World {
        let mut world = World { background: DVec3::new(0.25, 0.5, 0.0), ..World::default() };
        world.lights.add(DVec3::Y, DVec3::splat(2.0));
        world.materials.add(&Material { k_s, ..Material::default() });
        world
    }

    #[test]
    fn the_bound_is_the_sum_of_what_a_chain_can_bring() {
        // Ambient 0.1, two lights' worth of 0.8 diffuse and k_s specular.
        assert!((radiance_bound(&world(0.0), 5) - 1.7).abs() < 1e-12);
        let local = 0.1 + 2.0 * (0.8 + 0.5);
        assert!((radiance_bound(&world(0.5), 1) - local).abs() < 1e-12);
        assert!((radiance_bound(&world(0.5), 3) - local * 1.75).abs() < 1e-12);
        assert_eq!(radiance_bound(&World { background: DVec3::new(0.25, -0.5, 0.0), ..World::default() }, 9), 0.5);
    }

    #[test]
    fn nothing_is_cut_off_by_default_nor_where_there_is_no_bound() {
        let camera = crate::world::Camera {
            world_from_camera: glam::DMat4::IDENTITY,
            fov_y_radians: 1.0,
            width_px: 1,
            height_px: 1,
        };
        let settings = Settings::new(&camera);
        assert!(!Cutoff::new(&world(0.5), &settings).is_on());
        let cut = Settings { cutoff: 1e-3, ..settings };
        assert!(Cutoff::new(&world(0.5), &cut).is_on());
        assert!(!Cutoff::new(&World::default(), &cut).is_on());
        let blinding = World { background: DVec3::splat(f64::INFINITY), ..World::default() };
        assert!(!Cutoff::new(&blinding, &cut).is_on());
    }
}
