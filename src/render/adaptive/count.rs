//! The samples that count: in every leaf a pair that mirrors itself in the leaf's middle, at a random place, and in one leaf of two
//! a second, independent of the first. The difference between the two tells what error one has.
//!
//! Each sample is uniform over its leaf, whatever the division, so that the expected value of a pixel is its integral. A pair has
//! no error from what is linear over a leaf, and half the variance of two independent samples where a straight edge crosses it.
//! A pixel in which a beam finds nothing is the background, without a sample, unless there are layers to be sampled.

use std::sync::atomic::Ordering;

use glam::DVec3;

use super::divide::Division;
use crate::film::Region;
use crate::render::Stopped;
use crate::render::block::block_order;
use crate::render::estimate::Sums;
use crate::render::layers::Layers;
use crate::render::sampler::{mix, pixel_hash, unit_square};
use crate::render::tile::Job;
use crate::render::trace::{BATCH_RAYS, Wavefront};
use crate::world::Ray;

/// One in so many leaves has a second pair.
pub const ONE_IN: u64 = 2;

/// What the seed is mixed with, so that what counts is independent of what decides.
const COUNTING: u64 = 0x636f_756e;

/// The samples of a block, in memory that is used again for the next.
#[derive(Debug, Default)]
pub struct Counting {
    /// The leaves of a batch.
    batch: Vec<Leaf>,
    leaves: Vec<u32>,
    rays: Vec<Ray>,
    /// R, G, B and coverage of each pixel of the block.
    pub pixels: Vec<[f64; 4]>,
    /// What tells the error of those pixels that are of the part asked for.
    pub error: Sums,
}

/// A leaf whose samples are in the batch.
#[derive(Clone, Copy, Debug)]
struct Leaf {
    pixel: u32,
    n_pairs: u32,
    area: f64,
    /// Whether its pixel is of the part of the image that is asked for.
    is_asked: bool,
}

impl Counting {
    /// Takes the samples of the leaves of a block.
    pub fn count(
        &mut self,
        job: &Job,
        division: &Division,
        block: &Region,
        wavefront: &mut Wavefront,
        mut layers: Option<&mut Layers>,
    ) -> Result<(), Stopped> {
        let (tree, background) = (&division.tree, job.scene.world.background);
        let (width, height) = (block.width_px() as usize, block.height_px() as usize);
        self.pixels.clear();
        self.pixels.resize(width * height, [0.0; 4]);
        self.error = Sums::default();
        self.batch.clear();
        self.rays.clear();
        if let Some(layers) = layers.as_deref_mut() {
            layers.begin(width * height);
            layers.begin_batch();
        }
        let part = &job.settings.region;
        for pixel in block_order(width, height, 1) {
            let (column, row) = (pixel as usize % width, pixel as usize / width);
            let (x, y) = (block.x0 + column as u32, block.y0 + row as u32);
            let is_asked = (part.x0..part.x1).contains(&x) && (part.y0..part.y1).contains(&y);
            let is_empty = division.is_empty(column, row);
            if is_empty && layers.is_none() && !job.scene.clamp {
                self.pixels[pixel as usize] = [background.x, background.y, background.z, 0.0];
                continue;
            }
            let hash = pixel_hash(job.settings.seed ^ COUNTING, x, y);
            self.leaves.clear();
            tree.leaves(tree.root(column, row), &mut self.leaves);
            for at_leaf in 0..self.leaves.len() {
                let cell = tree.cell(self.leaves[at_leaf] as usize);
                let square = cell.square();
                let random = mix(hash ^ cell.number());
                // The mean of two is the background itself, that of four only nearly.
                let n_pairs = if random.is_multiple_of(ONE_IN) && !is_empty { 2 } else { 1 };
                if self.rays.len() + 2 * n_pairs as usize > BATCH_RAYS {
                    self.trace(job, wavefront, layers.as_deref_mut())?;
                }
                for pair in 0..n_pairs {
                    let (u, v) = unit_square(mix(random ^ u64::from(pair)));
                    for within in [(u, v), (1.0 - u, 1.0 - v)] {
                        let (dx, dy) = job.pattern.warped(square.at(within));
                        self.rays.push(job.camera.ray(f64::from(x) + dx, f64::from(y) + dy));
                        if let Some(layers) = layers.as_deref_mut() {
                            layers.note_place(dx, dy);
                        }
                    }
                }
                self.batch.push(Leaf { pixel, n_pairs, area: f64::from(cell.area()), is_asked });
            }
        }
        self.trace(job, wavefront, layers)
    }

    /// Traces the batch and adds it up.
    fn trace(&mut self, job: &Job, wavefront: &mut Wavefront, mut layers: Option<&mut Layers>) -> Result<(), Stopped> {
        if job.control.stop.load(Ordering::Relaxed) {
            return Err(Stopped);
        }
        wavefront.begin().append(&mut self.rays);
        let level = wavefront.trace(&job.scene, &job.control.stop)?;
        let mut next = 0;
        for &Leaf { pixel, n_pairs, area, is_asked } in &self.batch {
            let weight = area / f64::from(2 * n_pairs);
            let rays = next..next + 2 * n_pairs as usize;
            next = rays.end;
            let sum = |rays: std::ops::Range<usize>| level.radiance[rays].iter().sum::<DVec3>();
            let value = weight * sum(rays.clone());
            let n_hits = level.hits[rays.clone()].iter().filter(|hit| hit.is_some()).count();
            let pixel_sums = &mut self.pixels[pixel as usize];
            let added = [value.x, value.y, value.z, weight * n_hits as f64];
            pixel_sums.iter_mut().zip(added).for_each(|(sum, value)| *sum += value);
            if n_pairs == 2 && is_asked {
                let middle = rays.start + 2;
                self.error.note_pair(2.0 * weight * (sum(rays.start..middle) - sum(middle..rays.end)));
            }
            if let Some(layers) = layers.as_deref_mut() {
                rays.for_each(|ray| layers.add(pixel as usize, level, ray, weight));
            }
        }
        self.batch.clear();
        if let Some(layers) = layers {
            layers.begin_batch();
        }
        Ok(())
    }
}
