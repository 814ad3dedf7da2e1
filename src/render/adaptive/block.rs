//! A block of pixels: first where the image needs samples, then the samples.
//!
//! Cells are divided where what they contribute, contrast with a neighbour times area, is above a threshold. What decides is a
//! sample near the middle of each cell, which does not enter the image. The values are others, uniformly random in each
//! leaf: two independent ones, so that a pixel is the mean of two unbiased estimates, and the difference tells its
//! error. Whatever the division, the expected value is the integral over the pixel.
//!
//! A sample in the middle of each cell and a comparison with the four neighbours find every cell that a straight edge crosses: if
//! the edge cuts a corner off, one of the neighbours at that corner lies beyond it. Where edges bend, cells that are divided
//! late compare with larger neighbours, and divide those too: an edge that is found somewhere is followed.

use std::sync::atomic::Ordering;

use glam::DVec3;

use super::contrast::Sight;
use super::tree::{BLOCK_PX, Square, Tree};
use super::Adaptive;
use crate::film::Region;
use crate::render::Stopped;
use crate::render::block::block_order;
use crate::render::estimate::Sums;
use crate::render::layers::Layers;
use crate::render::sampler::{mix, pixel_hash, unit_square};
use crate::render::tile::Job;
use crate::render::trace::{BATCH_RAYS, Scene, Wavefront};

/// Share of a cell's width and height, around its middle, that the sample that decides is taken from: enough to be out of step with
/// whatever repeats at the distance of pixels.
const DECIDING_SHARE: f64 = 0.5;

/// Numbers that the seed is mixed with, so that what decides is independent of what counts.
const DECIDING: u64 = 0x6465_6369;
const COUNTING: u64 = 0x636f_756e;

/// Memory for a block, used again for the next.
#[derive(Debug, Default)]
pub struct Block {
    tree: Tree,
    sights: Vec<Sight>,
    /// By pixel, ring included: the contribution above which cells are divided.
    thresholds: Vec<f32>,
    /// Cells that are new, cells that are to be divided, and by cell whether it is one of them.
    new: Vec<usize>,
    marked: Vec<usize>,
    is_marked: Vec<bool>,
    leaves: Vec<u32>,
    /// What the rays of a batch are for.
    shares: Vec<Share>,
    /// By pixel of the block: the two sums of radiance, and the coverage.
    halves: Vec<[DVec3; 2]>,
    coverage: Vec<f64>,
    /// R, G, B and coverage of each pixel of the block.
    pub pixels: Vec<[f64; 4]>,
}

/// What a ray is a sample of.
#[derive(Clone, Copy, Debug)]
struct Share {
    pixel: u32,
    half: u32,
    /// Its weight in its half.
    weight: f64,
}

impl Block {
    /// Renders the pixels of a block of the image; `decide` is the scene that tells samples apart.
    pub fn render(
        &mut self,
        job: &Job,
        decide: &Scene,
        adaptive: &Adaptive,
        region: &Region,
        wavefront: &mut Wavefront,
        layers: Option<&mut Layers>,
    ) -> Result<(), Stopped> {
        self.tree.begin(region.width_px() as usize, region.height_px() as usize);
        self.divide(job, decide, adaptive, region, wavefront)?;
        self.sample(job, adaptive, region, wavefront, layers)
    }

    /// Divides cells until none contributes more than the threshold.
    fn divide(
        &mut self,
        job: &Job,
        decide: &Scene,
        adaptive: &Adaptive,
        region: &Region,
        wavefront: &mut Wavefront,
    ) -> Result<(), Stopped> {
        let seed = job.settings.seed ^ DECIDING;
        self.sights.clear();
        self.is_marked.clear();
        self.thresholds.clear();
        for root in 0..self.tree.len() {
            let (x, y) = image_pixel(region, self.tree.cell(root).pixel());
            // Spread over a factor of four, so that the number of samples does not leap where all cells of a size are divided.
            let (u, _) = unit_square(mix(pixel_hash(seed, x as u32, y as u32)));
            self.thresholds.push((adaptive.threshold * libm::exp2(2.0 * u - 1.0)) as f32);
        }
        self.new.clear();
        self.new.extend(0..self.tree.len());
        while !self.new.is_empty() {
            self.see(job, decide, region, seed, wavefront)?;
            self.mark(adaptive);
            self.new.clear();
            for &index in &self.marked {
                let first = self.tree.len();
                self.tree.split(index);
                self.new.extend(first..first + 4);
            }
        }
        Ok(())
    }

    /// Takes the deciding samples of the new cells.
    fn see(
        &mut self,
        job: &Job,
        decide: &Scene,
        region: &Region,
        seed: u64,
        wavefront: &mut Wavefront,
    ) -> Result<(), Stopped> {
        for batch in self.new.chunks(BATCH_RAYS) {
            if job.control.stop.load(Ordering::Relaxed) {
                return Err(Stopped);
            }
            let rays = wavefront.begin();
            for &index in batch {
                let cell = self.tree.cell(index);
                let (x, y) = image_pixel(region, cell.pixel());
                let (u, v) = unit_square(mix(pixel_hash(seed, x as u32, y as u32) ^ cell.number()));
                let around = |u: f64| 0.5 + DECIDING_SHARE * (u - 0.5);
                let (dx, dy) = job.pattern.warped(at(&cell.square(), (around(u), around(v))));
                rays.push(job.camera.ray(x as f64 + dx, y as f64 + dy));
            }
            let level = wavefront.trace(decide, &job.control.stop)?;
            for ray in 0..batch.len() {
                let depth = |t: f64| job.camera.depth(&level.rays[ray], t);
                self.sights.push(Sight::of(decide.world, level, ray, depth));
            }
        }
        self.is_marked.resize(self.tree.len(), false);
        Ok(())
    }

    /// Finds the cells that are to be divided, by what is new.
    fn mark(&mut self, adaptive: &Adaptive) {
        let Block { tree, sights, thresholds, new, marked, is_marked, .. } = self;
        marked.clear();
        let mut consider = |index: usize, contrast: f32| {
            let cell = tree.cell(index);
            let is_due = cell.level < adaptive.min_splits || contrast * cell.area() > thresholds[tree.root_of(index)];
            if is_due && !is_marked[index] && cell.is_leaf() && cell.level < adaptive.max_splits && tree.is_inside(index) {
                is_marked[index] = true;
                marked.push(index);
            }
        };
        for &index in new.iter() {
            consider(index, 0.0);
            for neighbor in tree.neighbors(index) {
                let contrast = sights[index].contrast(&sights[neighbor]);
                consider(index, contrast);
                consider(neighbor, contrast);
            }
        }
    }

    /// Takes the samples that count.
    fn sample(
        &mut self,
        job: &Job,
        adaptive: &Adaptive,
        region: &Region,
        wavefront: &mut Wavefront,
        mut layers: Option<&mut Layers>,
    ) -> Result<(), Stopped> {
        let (width, height) = (region.width_px() as usize, region.height_px() as usize);
        self.halves.clear();
        self.halves.resize(width * height, [DVec3::ZERO; 2]);
        self.coverage.clear();
        self.coverage.resize(width * height, 0.0);
        let seed = job.settings.seed ^ COUNTING;
        let half_samples = adaptive.half_samples as usize;
        self.shares.clear();
        if let Some(layers) = layers.as_deref_mut() {
            layers.begin(width * height);
            layers.begin_batch();
        }
        let mut rays = std::mem::take(wavefront.begin());
        for pixel in block_order(width, height, 2 * half_samples) {
            let (column, row) = (pixel as usize % width, pixel as usize / width);
            let (x, y) = (region.x0 + column as u32, region.y0 + row as u32);
            let hash = pixel_hash(seed, x, y);
            self.leaves.clear();
            self.tree.leaves(self.tree.root(column, row), &mut self.leaves);
            let mut number = 0;
            for at_leaf in 0..self.leaves.len() {
                let cell = self.tree.cell(self.leaves[at_leaf] as usize);
                let weight = f64::from(cell.area()) / half_samples as f64;
                let square = cell.square();
                for sample in 0..2 * half_samples {
                    let (dx, dy) = job.pattern.warped(at(&square, unit_square(mix(hash ^ number))));
                    number += 1;
                    rays.push(job.camera.ray(f64::from(x) + dx, f64::from(y) + dy));
                    self.shares.push(Share { pixel, half: (sample % 2) as u32, weight });
                    if let Some(layers) = layers.as_deref_mut() {
                        layers.note_place(dx, dy);
                    }
                    if rays.len() == BATCH_RAYS {
                        rays = self.trace(job, rays, wavefront, layers.as_deref_mut())?;
                    }
                }
            }
        }
        self.trace(job, rays, wavefront, layers)?;
        let mean = |(halves, coverage): (&[DVec3; 2], &f64)| {
            let value = 0.5 * (halves[0] + halves[1]);
            [value.x, value.y, value.z, *coverage]
        };
        self.pixels.clear();
        self.pixels.extend(self.halves.iter().zip(&self.coverage).map(mean));
        Ok(())
    }

    /// Traces a batch and adds it up; gives the memory of the rays back, empty.
    fn trace(
        &mut self,
        job: &Job,
        mut rays: Vec<crate::world::Ray>,
        wavefront: &mut Wavefront,
        mut layers: Option<&mut Layers>,
    ) -> Result<Vec<crate::world::Ray>, Stopped> {
        if job.control.stop.load(Ordering::Relaxed) {
            return Err(Stopped);
        }
        wavefront.begin().append(&mut rays);
        let level = wavefront.trace(&job.scene, &job.control.stop)?;
        for (ray, &Share { pixel, half, weight }) in self.shares.iter().enumerate() {
            self.halves[pixel as usize][half as usize] += weight * level.radiance[ray];
            self.coverage[pixel as usize] += 0.5 * weight * f64::from(u8::from(level.hits[ray].is_some()));
            if let Some(layers) = layers.as_deref_mut() {
                layers.add(pixel as usize, level, ray, 0.5 * weight);
            }
        }
        self.shares.clear();
        if let Some(layers) = layers {
            layers.begin_batch();
        }
        Ok(rays)
    }

    /// What the samples tell of the error of the pixels of a block that lie in a part of the image.
    pub fn error(&self, region: &Region, part: &Region) -> Sums {
        let mut sums = Sums::default();
        let width = region.width_px() as usize;
        for y in region.y0.max(part.y0)..region.y1.min(part.y1) {
            for x in region.x0.max(part.x0)..region.x1.min(part.x1) {
                let [a, b] = self.halves[(y - region.y0) as usize * width + (x - region.x0) as usize];
                sums.note_pair(a, b);
            }
        }
        sums
    }
}

/// The pixel of the image, perhaps outside of it, of a pixel counted from the corner of the ring around a block.
fn image_pixel(region: &Region, (column, row): (usize, usize)) -> (i64, i64) {
    (i64::from(region.x0) + column as i64 - 1, i64::from(region.y0) + row as i64 - 1)
}

/// A point of a square by where it is in the unit square.
fn at(square: &Square, (u, v): (f64, f64)) -> (f64, f64) {
    (square.x + u * square.edge, square.y + v * square.edge)
}

/// The blocks that a part of an image touches, in rows from the top left; those at the right and lower edge of the image
/// may be smaller.
pub fn blocks(width_px: u32, height_px: u32, part: &Region) -> Vec<Region> {
    let starts = |from: u32, to: u32| (from / BLOCK_PX * BLOCK_PX..to).step_by(BLOCK_PX as usize);
    let block = |x0: u32, y0: u32| Region {
        x0,
        y0,
        x1: width_px.min(x0.saturating_add(BLOCK_PX)),
        y1: height_px.min(y0.saturating_add(BLOCK_PX)),
    };
    starts(part.y0, part.y1).flat_map(|y0| starts(part.x0, part.x1).map(move |x0| block(x0, y0))).collect()
}
