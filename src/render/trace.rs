//! The wavefront of one batch of camera rays: no recursion, each stage over all rays of a depth.
//!
//! closest hits → shading → shadow rays → mirror rays → the next depth; at the end radiance is folded deepest first,
//! so that the original's clamp per bounce and sums of a fixed order are possible.

use glam::DVec3;

use super::RayCounts;
use super::shade::{Lighting, Shading};
use crate::accel::Accel;
use crate::world::{Hit, Ray, World};

/// Rays of one depth and what became of them; one entry per ray in every column.
#[derive(Debug, Default)]
pub struct Level {
    /// Rays.
    pub rays: Vec<Ray>,
    /// Their closest hits.
    pub hits: Vec<Hit>,
    /// Index in the level above of the ray that each came from; empty for camera rays.
    pub parents: Vec<u32>,
    /// Share of the radiance that reaches the parent; empty for camera rays.
    pub weights: Vec<f64>,
    /// Radiance towards the ray's origin, without what deeper levels add.
    pub radiance: Vec<DVec3>,
}

impl Level {
    fn clear(&mut self) {
        self.rays.clear();
        self.parents.clear();
        self.weights.clear();
    }

    /// Adds a ray that carries `weight` of its radiance to its parent.
    pub fn push(&mut self, ray: Ray, parent: u32, weight: f64) {
        self.rays.push(ray);
        self.parents.push(parent);
        self.weights.push(weight);
    }
}

/// Memory of a worker, reused from batch to batch.
#[derive(Debug, Default)]
pub struct Wavefront {
    levels: Vec<Level>,
    lighting: Lighting,
    occluded: Vec<bool>,
    /// Rays sent so far.
    pub counts: RayCounts,
}

/// What stays the same for all batches of a render.
#[derive(Clone, Debug)]
pub struct Scene<'a> {
    /// Tables.
    pub world: &'a World,
    /// Structure over them.
    pub accel: &'a Accel,
    /// The shading stage that this scene needs.
    pub shading: Shading,
    /// Longest chain of rays, the camera ray being 1.
    pub max_depth: u32,
    /// Clamp every bounce to 1, as the original does.
    pub clamp: bool,
}

impl Wavefront {
    /// Starts a batch: the camera rays go into the vector.
    pub fn begin(&mut self) -> &mut Vec<Ray> {
        if self.levels.is_empty() {
            self.levels.push(Level::default());
        }
        self.levels[0].clear();
        &mut self.levels[0].rays
    }

    /// Traces the batch; the first level then holds the finished radiance and the hits of camera rays.
    pub fn trace(&mut self, scene: &Scene) -> &Level {
        let mut depth = 0;
        loop {
            if self.levels.len() == depth + 1 {
                self.levels.push(Level::default());
            }
            let (above, below) = self.levels.split_at_mut(depth + 1);
            let (level, next) = (&mut above[depth], &mut below[0]);
            next.clear();

            // Closest hits.
            level.hits.clear();
            level.hits.resize(level.rays.len(), Hit::MISS);
            scene.accel.closest_hit(scene.world, &level.rays, &mut level.hits);

            // Shading: local radiance, shadow rays, mirror rays.
            let bounce = depth as u32 + 1 < scene.max_depth;
            scene.shading.shade(scene.world, level, bounce, next, &mut self.lighting);

            // Shadow rays, in the order of hits and lights.
            let Lighting { rays: shadow_rays, shadow, .. } = &self.lighting;
            self.occluded.clear();
            self.occluded.resize(shadow_rays.len(), false);
            scene.accel.occluded(scene.world, shadow_rays, &mut self.occluded);
            for (shadow, &occluded) in shadow.iter().zip(&self.occluded) {
                if !occluded {
                    level.radiance[shadow.ray_idx as usize] += shadow.radiance;
                }
            }

            self.counts.shadow += shadow_rays.len() as u64;
            self.counts.reflection += next.rays.len() as u64;
            if depth == 0 {
                self.counts.camera += level.rays.len() as u64;
                self.counts.camera_hit += level.hits.iter().filter(|hit| hit.is_some()).count() as u64;
            }
            if next.rays.is_empty() {
                break;
            }
            depth += 1;
        }
        self.fold(depth, scene.clamp);
        &self.levels[0]
    }

    /// Carries radiance from the deepest level up.
    fn fold(&mut self, deepest: usize, clamp: bool) {
        for depth in (0..=deepest).rev() {
            let (above, below) = self.levels.split_at_mut(depth);
            let level = &mut below[0];
            if clamp {
                level.radiance.iter_mut().for_each(|radiance| *radiance = radiance.min(DVec3::ONE));
            }
            if let Some(parents) = above.last_mut() {
                for ((&parent, &weight), &radiance) in level.parents.iter().zip(&level.weights).zip(&level.radiance) {
                    parents.radiance[parent as usize] += weight * radiance;
                }
            }
        }
    }
}
