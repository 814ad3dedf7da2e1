//! Which shadow rays are stopped.
//!
//! Rays come in the order of hits and lights, and packets are neighbours that end in one light. Where there are several, rays are
//! asked light by light; the answers come back in the order of the rays.

use super::shade::ShadowRay;
use crate::accel::Accel;
use crate::world::{Ray, World};

/// The answers, in memory that is used again for every batch.
#[derive(Debug, Default)]
pub struct Occlusion {
    /// Whether each ray is stopped.
    pub occluded: Vec<bool>,
    /// Places of the rays, light by light.
    order: Vec<u32>,
    /// The rays in that order, and whether each is stopped.
    by_light: Vec<Ray>,
    answers: Vec<bool>,
}

impl Occlusion {
    /// Room for the answers to so many rays.
    pub fn reset(&mut self, n_rays: usize) {
        self.occluded.clear();
        self.occluded.resize(n_rays, false);
    }

    /// Asks for all rays.
    pub fn ask(&mut self, accel: &Accel, world: &World, rays: &[Ray], sent_for: &[ShadowRay]) {
        self.reset(rays.len());
        let n_lights = world.lights.positions.len() + world.lights.directions.len();
        if n_lights < 2 || !accel.packs_rays() {
            return accel.occluded(world, rays, &mut self.occluded);
        }
        self.order.clear();
        self.order.extend(0..rays.len() as u32);
        // Of one light the rays stay in their order.
        self.order.sort_unstable_by_key(|&place| (sent_for[place as usize].light, place));
        self.by_light.clear();
        self.by_light.extend(self.order.iter().map(|&place| rays[place as usize]));
        self.answers.clear();
        self.answers.resize(rays.len(), false);
        accel.occluded(world, &self.by_light, &mut self.answers);
        for (&place, &answer) in self.order.iter().zip(&self.answers) {
            self.occluded[place as usize] = answer;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::AccelKind;
    use crate::measure::generate::hash_unit;
    use glam::{DVec3, Vec3};

    #[test]
    fn rays_to_several_lights_have_the_answers_that_each_has_alone() {
        let unit = |i: u64| hash_unit(i) as f32 - 0.5;
        let point = |i: u64| Vec3::new(unit(3 * i), unit(3 * i + 1), unit(3 * i + 2));
        let positions =
            (0..60).flat_map(|i| [point(i), point(i) + 0.3 * point(i + 100), point(i) + 0.3 * point(i + 200)]);
        let triangles = (0..60).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let mut world = World::from_triangles(positions.collect(), triangles).unwrap();
        let lights = [DVec3::new(0.0, 3.0, 0.0), DVec3::new(3.0, 0.1, 0.2), DVec3::new(0.1, 0.3, -3.0)];
        for light in lights {
            world.lights.add(light, DVec3::ONE);
        }
        let accel = Accel::build(&world, AccelKind::Bvh);
        assert!(accel.packs_rays());

        let (mut rays, mut sent_for) = (Vec::new(), Vec::new());
        for ray_idx in 0..400_u32 {
            let origin = DVec3::new(f64::from(ray_idx % 20), 0.5, f64::from(ray_idx / 20)) / 20.0 - 0.5;
            for (light, at) in
                lights.into_iter().enumerate().filter(|(light, _)| !(ray_idx as usize + light).is_multiple_of(7))
            {
                rays.push(Ray::new(origin, at - origin).until(1.0));
                sent_for.push(ShadowRay { ray_idx, light: light as u32, radiance: DVec3::ONE });
            }
        }
        let mut occlusion = Occlusion::default();
        occlusion.ask(&accel, &world, &rays, &sent_for);
        let alone = |ray: &Ray| {
            let mut occluded = [false];
            accel.occluded(&world, std::slice::from_ref(ray), &mut occluded);
            occluded[0]
        };
        let alone: Vec<bool> = rays.iter().map(alone).collect();
        assert_eq!(occlusion.occluded, alone);
        assert!(alone.contains(&true) && alone.contains(&false));
    }
}
