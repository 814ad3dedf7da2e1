//! Where a block of the image needs samples: its pixels, divided into cells.
//!
//! Cells are divided where what they contribute, contrast with a neighbour times area, is above a threshold. What decides is a
//! sample near the middle of each cell, which does not enter the image.
//!
//! A sample in the middle of each cell and a comparison with the four neighbours find every cell that a straight edge crosses: if
//! the edge cuts a corner off, one of the neighbours at that corner lies beyond it. Where edges bend, cells that are divided
//! late compare with larger neighbours, and divide those too: an edge that is found somewhere is followed.

use std::sync::atomic::Ordering;

use glam::Vec2;

use super::contrast::Sight;
use super::tree::{Square, Tree};
use crate::film::Region;
use crate::render::sampler::{mix, pixel_hash, unit_square};
use crate::render::tile::Job;
use crate::render::trace::{BATCH_RAYS, Scene, Wavefront};
use crate::render::{Adaptive, Stopped};

/// Share of a cell's width and height, around its middle, that the sample that decides is taken from: enough to be out of step with
/// whatever repeats at the distance of pixels.
const DECIDING_SHARE: f64 = 0.5;

/// What the seed is mixed with, so that what decides is independent of what counts.
const DECIDING: u64 = 0x6465_6369;

/// Who divides, and what for.
pub struct Divider<'a> {
    /// The render.
    pub job: &'a Job<'a>,
    /// Its scene, such that samples are told apart.
    pub scene: &'a Scene<'a>,
    /// When to divide.
    pub adaptive: &'a Adaptive,
    /// How many pixels of the image are between the samples of two pixels of a block: 1, but where the image is only looked at.
    pub spacing_px: u32,
}

/// A cell that is to be divided.
#[derive(Clone, Copy, Debug)]
struct Mark {
    index: usize,
    /// Whether its parts may have to be divided again.
    again: bool,
}

/// How often pixels are halved at most to find what a beam says is there: a wire of 1/50 pixel then takes a sixth of each cell that it
/// crosses, and of eight or more samples one most likely meets it.
const SEEKING_SPLITS: u32 = 3;

/// Share of a depth by which something must be nearer to be looked for: far above what depths and beams are rounded by, so that a surface that all
/// samples meet at one depth does not hide itself.
const COINCIDENT: f64 = 1.0 / (1 << 20) as f64;

/// What the first sample of a pixel showed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FirstLook {
    /// The largest contrast with a neighbour beyond an edge; 0 without one.
    pub edge: f32,
    /// If there is none, how far from linear it is with its neighbours, in units of an edge's contrast.
    pub bend: f32,
    /// Whether it is the background.
    pub is_background: bool,
}

/// The cells of a block, in memory that is used again for the next.
#[derive(Debug, Default)]
pub struct Division {
    /// The cells.
    pub tree: Tree,
    /// By cell: what its sample saw; of a cell that has none, that of the cell it is a part of.
    sights: Vec<Sight>,
    /// By pixel, ring included: the contribution above which cells are divided.
    thresholds: Vec<f32>,
    /// By cell: whether it is to be divided.
    is_marked: Vec<bool>,
    marked: Vec<Mark>,
    /// By cell: the depth that something in it is nearer than which no sample around has met.
    hidden: Vec<Option<f64>>,
    /// By pixel, ring included: what its first sample showed.
    first_looks: Vec<FirstLook>,
    /// By pixel, ring included: whether nothing is in it but the background.
    is_empty: Vec<bool>,
    /// Cells whose samples are to be taken, and the places of those of a batch, in cells of their size.
    new: Vec<usize>,
    places: Vec<Vec2>,
}

impl Division {
    /// Divides the pixels of a block until no cell contributes more than the threshold.
    pub fn divide(&mut self, by: &Divider, block: &Region, wavefront: &mut Wavefront) -> Result<(), Stopped> {
        let seed = self.begin(by, block);
        while !self.new.is_empty() {
            self.see(by, block, seed, wavefront)?;
            self.mark(by.adaptive);
            if self.hidden.is_empty() {
                self.hidden.resize(self.tree.len(), None);
                self.look_for_hidden(by, block);
            }
            self.split(by, block);
        }
        Ok(())
    }

    /// Takes the first sample of each pixel of a block, for [`Division::first_look`], and divides nothing.
    pub fn look(&mut self, by: &Divider, block: &Region, wavefront: &mut Wavefront) -> Result<(), Stopped> {
        let seed = self.begin(by, block);
        self.see(by, block, seed, wavefront)?;
        self.mark(by.adaptive);
        Ok(())
    }

    /// Begins a block with its pixels; the seed of what decides.
    fn begin(&mut self, by: &Divider, block: &Region) -> u64 {
        self.tree.begin(block.width_px() as usize, block.height_px() as usize);
        let n_pixels = self.tree.len();
        self.sights.clear();
        self.sights.resize(n_pixels, Sight::default());
        self.is_marked.clear();
        self.is_marked.resize(n_pixels, false);
        self.first_looks.clear();
        self.first_looks.resize(n_pixels, FirstLook::default());
        self.is_empty.clear();
        self.is_empty.resize(n_pixels, false);
        self.hidden.clear();
        let seed = by.job.settings.seed ^ DECIDING;
        self.thresholds.clear();
        for root in 0..n_pixels {
            let (x, y) = image_pixel(block, self.tree.cell(root).pixel());
            // Spread over a factor of four, so that the number of samples does not leap where all cells of a size are divided.
            let (u, _) = unit_square(mix(pixel_hash(seed, x as u32, y as u32)));
            self.thresholds.push((by.adaptive.threshold * libm::exp2(2.0 * u - 1.0)) as f32);
        }
        self.new.clear();
        self.new.extend(0..n_pixels);
        seed
    }

    /// What the first sample of a pixel showed, by its place in the block.
    pub fn first_look(&self, column: usize, row: usize) -> FirstLook {
        let root = self.tree.root(column, row);
        FirstLook { is_background: self.sights[root].z == f64::INFINITY, ..self.first_looks[root] }
    }

    /// Whether nothing is in a pixel but the background, by its place in the block.
    pub fn is_empty(&self, column: usize, row: usize) -> bool {
        self.is_empty[self.tree.root(column, row)]
    }

    /// Takes the samples of the new cells.
    fn see(&mut self, by: &Divider, block: &Region, seed: u64, wavefront: &mut Wavefront) -> Result<(), Stopped> {
        let Job { camera, pattern, control, .. } = by.job;
        for batch in self.new.chunks(BATCH_RAYS) {
            if control.stop.load(Ordering::Relaxed) {
                return Err(Stopped);
            }
            let rays = wavefront.begin();
            for &index in batch {
                let cell = self.tree.cell(index);
                let (x, y) = image_pixel(block, cell.pixel());
                let (u, v) = unit_square(mix(pixel_hash(seed, x as u32, y as u32) ^ cell.number()));
                let around = |u: f64| 0.5 + DECIDING_SHARE * (u - 0.5);
                let within = (around(u), around(v));
                self.places.push(Vec2::new(cell.x as f32 + within.0 as f32, cell.y as f32 + within.1 as f32));
                let (dx, dy) = pattern.warped(cell.square().at(within));
                let spacing = f64::from(by.spacing_px);
                rays.push(camera.ray(spacing * (x as f64 + dx), spacing * (y as f64 + dy)));
            }
            let level = wavefront.trace(by.scene, &control.stop)?;
            for (ray, (place, &index)) in self.places.drain(..).zip(batch).enumerate() {
                let depth = |t: f64| camera.depth(&level.rays[ray], t);
                self.sights[index] = Sight::of(by.scene.world, place, level, ray, depth);
            }
        }
        Ok(())
    }

    /// Finds the cells that are to be divided, by what is new.
    fn mark(&mut self, adaptive: &Adaptive) {
        let Division { tree, sights, thresholds, new, marked, is_marked, hidden, first_looks, is_empty, .. } = self;
        marked.clear();
        let mut consider = |index: usize, contrast: f32| {
            let cell = tree.cell(index);
            let (contribution, threshold) = (contrast * cell.area(), thresholds[tree.root_of(index)]);
            let seeks = hidden.get(index).is_some_and(Option::is_some) && cell.level < SEEKING_SPLITS;
            let is_due = cell.level < adaptive.min_splits || seeks || contribution > threshold;
            if is_due
                && !is_marked[index]
                && cell.is_leaf()
                && cell.level < adaptive.max_splits
                // What is at an edge of the background is in its neighbours alone.
                && !is_empty[tree.root_of(index)]
                && tree.is_inside(index)
            {
                is_marked[index] = true;
                // A part has a quarter of the area, and its contrast is no greater but by chance.
                let again = cell.level + 1 < adaptive.min_splits || seeks || 0.25 * contribution > threshold;
                marked.push(Mark { index, again });
            }
        };
        for &index in new.iter() {
            let is_coarse = tree.cell(index).level == 0;
            consider(index, 0.0);
            let mut is_even = true;
            for neighbor in tree.neighbors(index) {
                if sights[index].is_across_an_edge(&sights[neighbor]) {
                    let contrast = sights[index].edge_contrast(&sights[neighbor], is_coarse);
                    consider(index, contrast);
                    consider(neighbor, contrast);
                    is_even = false;
                    // Only the first cells, which are the pixels, have first looks.
                    for index in [index, neighbor] {
                        if let Some(look) = first_looks.get_mut(index) {
                            look.edge = look.edge.max(contrast);
                        }
                    }
                }
            }
            if is_even && let Some(neighbors) = tree.equal_neighbors(index) {
                let bend = sights[index].bend(neighbors.map(|neighbor| &sights[neighbor]));
                consider(index, bend);
                if let Some(look) = first_looks.get_mut(index) {
                    look.bend = bend;
                }
            }
        }
    }

    /// Marks pixels in which no edge is known, but something nearer than what was met there and around: a wire, a hair, a corner of what lies at
    /// the edge of the pixel.
    fn look_for_hidden(&mut self, by: &Divider, block: &Region) {
        for row in 0..block.height_px() as usize {
            for column in 0..block.width_px() as usize {
                let root = self.tree.root(column, row);
                if self.is_marked[root] {
                    continue;
                }
                let own = &self.sights[root];
                let (mut nearest, mut farthest) = (own.z, own.z);
                for sight in self.tree.around(root).map(|index| &self.sights[index]).filter(|sight| sight.is_alike(own))
                {
                    (nearest, farthest) = (nearest.min(sight.z), farthest.max(sight.z));
                }
                // As much nearer as the depths around are apart, a surface may be between the samples.
                let depth =
                    if nearest.is_finite() { nearest - (farthest - nearest) - COINCIDENT * nearest } else { nearest };
                if self.hides(by, block, root, depth) {
                    self.hidden[root] = Some(depth);
                    self.is_marked[root] = true;
                    self.marked.push(Mark { index: root, again: true });
                } else if depth == f64::INFINITY {
                    self.is_empty[root] = true;
                }
            }
        }
    }

    /// Whether there is something in a cell that is nearer than a depth.
    fn hides(&self, by: &Divider, block: &Region, index: usize, depth: f64) -> bool {
        let cell = self.tree.cell(index);
        let (x, y) = image_pixel(block, cell.pixel());
        let corner = |at: (f64, f64)| {
            let (dx, dy) = by.job.pattern.warped(cell.square().at(at));
            [x as f64 + dx, y as f64 + dy]
        };
        let beam = by.job.camera.beam(corner((0.0, 0.0)), corner((1.0, 1.0)));
        by.scene.accel.anything_nearer(by.scene.world, &beam, depth)
    }

    /// Divides what is marked. Parts that will not be divided again need no sample of their own.
    fn split(&mut self, by: &Divider, block: &Region) {
        self.new.clear();
        for &Mark { index, again } in &self.marked {
            let first = self.tree.len();
            self.tree.split(index);
            let sight = self.sights[index].of_a_part();
            self.sights.resize(first + 4, sight);
            self.is_marked.resize(first + 4, false);
            let depth = self.hidden[index];
            for child in first..first + 4 {
                self.hidden.push(depth.filter(|&depth| self.hides(by, block, child, depth)));
            }
            if again {
                self.new.extend(first..first + 4);
            }
        }
    }
}

/// The pixel of the image, perhaps outside of it, of a pixel counted from the corner of the ring around a block.
fn image_pixel(block: &Region, (column, row): (usize, usize)) -> (i64, i64) {
    (i64::from(block.x0) + column as i64 - 1, i64::from(block.y0) + row as i64 - 1)
}

impl Square {
    /// A point by where it is in the unit square.
    pub fn at(&self, (u, v): (f64, f64)) -> (f64, f64) {
        (self.x + u * self.edge, self.y + v * self.edge)
    }
}
