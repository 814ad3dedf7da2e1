//! What the rays of a level cost: their own walks, those of their shadow rays, and those of all that they send.

use crate::accel::{Accel, Visits};
use crate::world::{Hit, Ray, World};

/// What a ray and all that comes of it cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cost {
    /// Nodes and leaves visited.
    pub visits: Visits,
    /// Rays sent, itself among them.
    pub rays: u64,
}

impl Cost {
    /// Adds that of another.
    #[inline]
    pub fn add(&mut self, other: &Cost) {
        self.visits.add(other.visits);
        self.rays += other.rays;
    }
}

/// The costs of the rays of a level; empty unless they are asked for.
#[derive(Debug, Default)]
pub struct Costs {
    by_ray: Vec<Cost>,
    /// Of the batch that was traced last.
    visits: Vec<Visits>,
}

impl Costs {
    /// What a ray costs.
    pub fn of(&self, ray: usize) -> &Cost {
        &self.by_ray[ray]
    }

    /// Finds the closest hits of a level's rays and begins to count with them.
    pub fn closest_hit(&mut self, accel: &Accel, world: &World, rays: &[Ray], hits: &mut [Hit]) {
        self.visits.resize(rays.len(), Visits::default());
        accel.closest_hit_counted(world, rays, hits, &mut self.visits);
        self.by_ray.clear();
        self.by_ray.extend(self.visits.iter().map(|&visits| Cost { visits, rays: 1 }));
    }

    /// Traces shadow rays and adds what they cost to the rays they belong to.
    pub fn occluded(
        &mut self,
        accel: &Accel,
        world: &World,
        rays: &[Ray],
        occluded: &mut [bool],
        owners: impl Iterator<Item = u32>,
    ) {
        self.visits.resize(rays.len(), Visits::default());
        accel.occluded_counted(world, rays, occluded, &mut self.visits);
        for (owner, &visits) in owners.zip(&self.visits) {
            self.by_ray[owner as usize].add(&Cost { visits, rays: 1 });
        }
    }

    /// Adds the costs of the rays of the level below to those that sent them.
    pub fn add_bounces(&mut self, parents: &[u32], below: &Costs) {
        for (&parent, cost) in parents.iter().zip(&below.by_ray) {
            self.by_ray[parent as usize].add(cost);
        }
    }
}
