//! The wavefront of one batch of camera rays: no recursion, each stage over all rays of a chunk.
//!
//! closest hits → shading → shadow rays → mirror and refracted rays → the next depth; radiance is folded deepest first,
//! so that the original's clamp per bounce and sums of a fixed order are possible.
//!
//! A hit that mirrors and refracts sends two rays, so that trees of rays may grow. The rays that a level sends wait in its
//! [`Bounces`] and are taken down in chunks, depth first: a chunk's whole tree is summed up before the next is begun. Each
//! depth then holds a chunk and at most twice as many rays that wait. Rays that wait are taken in their order, which is that
//! of their parents, mirrored before refracted: every parent's sum is its own light, then what it mirrors, then what it
//! refracts, whatever the chunks. A level that sends no more rays than a chunk holds is taken down whole, without a copy.

use std::sync::atomic::{AtomicBool, Ordering};

use glam::DVec3;

use super::cutoff::Cutoff;
use super::occlusion::Occlusion;
use super::parts::{Parts, PartsAsked};
use super::shade::{Lighting, Shading};
use super::signature;
use super::{RayCounts, Stopped};
use crate::accel::Accel;
use crate::world::{Hit, Ray, World};

/// Camera rays in a batch, and rays in a chunk of a deeper level, at most: a batch and what it sends fit into the second
/// level cache.
pub const BATCH_RAYS: usize = 2048;

/// Rays of one depth that are traced together, and what became of them; one entry per ray in every column.
#[derive(Debug, Default)]
pub struct Level {
    /// Rays.
    pub rays: Vec<Ray>,
    /// Their closest hits.
    pub hits: Vec<Hit>,
    /// Index in the level above of the ray that each came from; empty for camera rays.
    parents: Vec<u32>,
    /// Share of the radiance that reaches the parent; empty for camera rays.
    weights: Vec<f64>,
    /// What each may lose ([`Cutoff`]); empty unless something may be.
    pub limits: Vec<f64>,
    /// What each met and which lights reached it, in a number; empty unless asked for.
    pub signatures: Vec<u32>,
    /// Radiance towards the ray's origin, without what deeper levels have yet to add.
    pub radiance: Vec<DVec3>,
    /// What it is made of, if that is asked for.
    pub parts: Parts,
}

/// Rays that a level sends, which wait to be traced; one entry per ray in every column.
#[derive(Debug, Default)]
pub struct Bounces {
    rays: Vec<Ray>,
    parents: Vec<u32>,
    weights: Vec<f64>,
    /// What each may lose; empty unless something may be.
    limits: Vec<f64>,
    /// Whether each was refracted, not mirrored; empty unless parts are asked for.
    refracted: Vec<bool>,
    /// Rays from the front that have been taken.
    n_taken: usize,
}

impl Bounces {
    fn clear(&mut self) {
        self.rays.clear();
        self.parents.clear();
        self.weights.clear();
        self.limits.clear();
        self.refracted.clear();
        self.n_taken = 0;
    }

    /// Adds a ray that carries `weight` of its radiance to its parent.
    #[inline]
    pub fn push(&mut self, ray: Ray, parent: u32, weight: f64) {
        self.rays.push(ray);
        self.parents.push(parent);
        self.weights.push(weight);
    }

    /// Says of the ray that was added last what it may lose.
    #[inline]
    pub fn note_limit(&mut self, limit: f64) {
        self.limits.push(limit);
    }

    /// Says of the ray that was added last how it came about.
    #[inline]
    pub fn note_refracted(&mut self, refracted: bool) {
        self.refracted.push(refracted);
    }

    fn n_left(&self) -> usize {
        self.rays.len() - self.n_taken
    }

    /// Moves the next rays to a level, at most `chunk_rays`; as many each time as makes the fewest chunks, all about equal.
    fn take_chunk(&mut self, chunk_rays: usize, level: &mut Level) {
        let n_left = self.n_left();
        if n_left == self.rays.len() && n_left <= chunk_rays {
            std::mem::swap(&mut self.rays, &mut level.rays);
            std::mem::swap(&mut self.parents, &mut level.parents);
            std::mem::swap(&mut self.weights, &mut level.weights);
            std::mem::swap(&mut self.limits, &mut level.limits);
            std::mem::swap(&mut self.refracted, &mut level.parts.refracted);
            self.clear();
            return;
        }
        let next = self.n_taken..self.n_taken + n_left.div_ceil(n_left.div_ceil(chunk_rays).max(1));
        self.n_taken = next.end;
        refill(&mut level.rays, &self.rays[next.clone()]);
        refill(&mut level.parents, &self.parents[next.clone()]);
        refill(&mut level.weights, &self.weights[next.clone()]);
        refill(&mut level.limits, self.limits.get(next.clone()).unwrap_or_default());
        refill(&mut level.parts.refracted, self.refracted.get(next).unwrap_or_default());
    }
}

fn refill<T: Copy>(column: &mut Vec<T>, rows: &[T]) {
    column.clear();
    column.extend_from_slice(rows);
}

/// Memory of a worker, reused from batch to batch.
#[derive(Debug, Default)]
pub struct Wavefront {
    levels: Vec<Level>,
    /// What each level sends.
    bounces: Vec<Bounces>,
    lighting: Lighting,
    occlusion: Occlusion,
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
    /// What to keep of the radiance's parts; the shading stage must have been made for it.
    pub parts: PartsAsked,
    /// What may be left out.
    pub cutoff: Cutoff,
    /// Whether to keep what samples met.
    pub signatures: bool,
    /// Rays in a chunk at most; at least 1, and the same image whatever it is.
    pub chunk_rays: usize,
}

impl Wavefront {
    /// Starts a batch: the camera rays go into the vector.
    pub fn begin(&mut self) -> &mut Vec<Ray> {
        self.reach(0);
        self.levels[0].rays.clear();
        &mut self.levels[0].rays
    }

    /// Makes room for levels down to a depth, counted from 0.
    fn reach(&mut self, depth: usize) {
        while self.levels.len() <= depth {
            self.levels.push(Level::default());
            self.bounces.push(Bounces::default());
        }
    }

    /// Traces the batch; the first level then holds the finished radiance and the hits of camera rays.
    ///
    /// # Errors
    /// [`Stopped`] when `stop` was set before the batch was finished.
    pub fn trace(&mut self, scene: &Scene, stop: &AtomicBool) -> Result<&Level, Stopped> {
        let mut depth = 0;
        loop {
            self.shade(scene, depth);

            // Up, as far as nothing waits any more.
            while self.bounces[depth].n_left() == 0 {
                self.fold(depth, scene);
                if depth == 0 {
                    return Ok(&self.levels[0]);
                }
                depth -= 1;
            }

            // Down, with the next chunk of what waits. A tree may have any number of them.
            if stop.load(Ordering::Relaxed) {
                return Err(Stopped);
            }
            self.reach(depth + 1);
            self.bounces[depth].take_chunk(scene.chunk_rays, &mut self.levels[depth + 1]);
            depth += 1;
        }
    }

    /// Finds what the rays of a level hit and the light they bring by themselves, and the rays that the level sends.
    fn shade(&mut self, scene: &Scene, depth: usize) {
        let (level, next) = (&mut self.levels[depth], &mut self.bounces[depth]);
        next.clear();

        // Closest hits.
        level.hits.clear();
        level.hits.resize(level.rays.len(), Hit::MISS);
        if scene.parts.cost {
            level.parts.costs.closest_hit(scene.accel, scene.world, &level.rays, &mut level.hits);
        } else {
            scene.accel.closest_hit(scene.world, &level.rays, &mut level.hits);
        }

        // Shading: local radiance, shadow rays, mirror and refracted rays.
        if depth == 0 {
            level.limits.clear();
            if scene.cutoff.is_on() {
                level.limits.resize(level.rays.len(), scene.cutoff.camera_limit);
            }
        }
        let bounce = depth as u32 + 1 < scene.max_depth;
        scene.shading.shade(scene.world, &scene.cutoff, level, bounce, next, &mut self.lighting);
        if scene.parts.any() {
            level.parts.begin(&scene.parts, depth == 0, &level.hits, &level.radiance);
        }

        // Shadow rays, in the order of hits and lights.
        let Lighting { rays: shadow_rays, shadow, .. } = &self.lighting;
        if scene.parts.cost {
            self.occlusion.reset(shadow_rays.len());
            let owners = shadow.iter().map(|shadow| shadow.ray_idx);
            let occluded = &mut self.occlusion.occluded;
            level.parts.costs.occluded(scene.accel, scene.world, shadow_rays, occluded, owners);
        } else {
            self.occlusion.ask(scene.accel, scene.world, shadow_rays, shadow);
        }
        let occluded = &self.occlusion.occluded;
        for (shadow, &occluded) in shadow.iter().zip(occluded) {
            if !occluded {
                level.radiance[shadow.ray_idx as usize] += shadow.radiance;
            }
        }

        if scene.parts.any() {
            for ((shadow, parts), &occluded) in shadow.iter().zip(&self.lighting.parts).zip(occluded) {
                if !occluded {
                    level.parts.add_light(shadow.ray_idx as usize, shadow.radiance, parts);
                }
            }
        }

        level.signatures.clear();
        if scene.signatures {
            level.signatures.extend(level.hits.iter().map(|hit| signature::of_hit(scene.world, hit)));
            for (shadow, _) in shadow.iter().zip(occluded).filter(|(_, occluded)| !**occluded) {
                signature::add_light(&mut level.signatures[shadow.ray_idx as usize], shadow.light);
            }
        }

        self.counts.shadow += shadow_rays.len() as u64;
        self.counts.reflection += next.rays.len() as u64 - self.lighting.n_refracted;
        self.counts.refraction += self.lighting.n_refractions;
        if depth == 0 {
            self.counts.camera += level.rays.len() as u64;
            self.counts.camera_hit += level.hits.iter().filter(|hit| hit.is_some()).count() as u64;
        }
    }

    /// Carries the finished radiance of a level up to the level above.
    fn fold(&mut self, depth: usize, scene: &Scene) {
        let (above, below) = self.levels.split_at_mut(depth);
        let level = &mut below[0];
        if scene.clamp {
            level.radiance.iter_mut().for_each(|radiance| *radiance = radiance.min(DVec3::ONE));
        }
        if let Some(parents) = above.last_mut() {
            for ((&parent, &weight), &radiance) in level.parents.iter().zip(&level.weights).zip(&level.radiance) {
                parents.radiance[parent as usize] += weight * radiance;
            }
            if scene.signatures {
                for (&parent, &below) in level.parents.iter().zip(&level.signatures) {
                    signature::add_bounce(&mut parents.signatures[parent as usize], below);
                }
            }
            if scene.parts.cost {
                parents.parts.costs.add_bounces(&level.parents, &level.parts.costs);
            }
            if scene.parts.any() {
                for (ray, (&parent, &weight)) in level.parents.iter().zip(&level.weights).enumerate() {
                    parents.parts.add_bounce(parent as usize, weight, &level.parts, ray, level.radiance[ray]);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests;
