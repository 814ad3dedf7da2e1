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
