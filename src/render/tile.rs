//! Tiles: workers take one after another, and each writes its own part of the film. Rows that are finished are handed
//! over while others are still rendered.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

use glam::DVec3;

use super::block::block_order;
use super::camera_ray::CameraRays;
use super::estimate::{Sums, blocks_of};
use super::layers::Layers;
use super::sampler::Pattern;
use super::trace::{BATCH_RAYS, Scene, Wavefront};
use super::{Control, RayCounts, Settings, Stopped, n_tiles};
use crate::BARE;
use crate::film::rows::{BAND_ROWS, Rows, RowsMut};
use crate::film::{Film, Region};
use crate::numeric::tally::take_exact_tests;
use crate::world::Ray;

/// What all workers share.
pub struct Job<'a> {
    /// World, structure and shading.
    pub scene: Scene<'a>,
    /// Camera.
    pub camera: CameraRays,
    /// Samples.
    pub pattern: Pattern,
    /// The settings.
    pub settings: &'a Settings,
    /// The owner's view.
    pub control: &'a Control,
}

/// Counts of a finished job.
#[derive(Clone, Copy, Debug, Default)]
pub struct Tally {
    /// Rays by kind.
    pub rays: RayCounts,
    /// Primitive tests that needed exact arithmetic.
    pub exact_tests: u64,
    /// What tells the error.
    pub error: Sums,
    /// Tiles finished.
    pub n_tiles: u64,
}

/// Rows of tiles that are finished together and then handed over: the fewest that are a whole number of the bands that
/// files are encoded by.
struct Strip<'a> {
    rows: RowsMut<'a>,
    n_tiles_left: u64,
}

/// Rows of tiles in a strip.
fn tile_rows_per_strip(tile_size_px: u32) -> u64 {
    // Both numbers divided by their greatest common divisor; the band's is a power of two.
    let band = BAND_ROWS as u64;
    band >> u64::from(tile_size_px).trailing_zeros().min(band.trailing_zeros())
}

/// Renders all tiles into the film. `finished` is called by the workers with rows that will not change any more, from top
/// to bottom more or less.
pub fn render_tiles(job: &Job, film: &mut Film, finished: &(dyn Fn(&Rows) + Sync)) -> Result<Tally, Stopped> {
    let next_tile = AtomicU64::new(0);
    let tally = Mutex::new(Tally::default());
    let settings = job.settings;
    let tiles_per_row = u64::from(settings.region.width_px().div_ceil(settings.tile_size_px));
    let tiles_per_strip = tiles_per_row * tile_rows_per_strip(settings.tile_size_px);
    let strip_rows = tile_rows_per_strip(settings.tile_size_px) as usize * settings.tile_size_px as usize;
    let strips: Vec<Mutex<Strip>> = film
        .split_rows_mut(strip_rows)
        .into_iter()
        .zip((0..n_tiles(settings)).step_by(tiles_per_strip as usize))
        .map(|(rows, first)| Strip { rows, n_tiles_left: tiles_per_strip.min(n_tiles(settings) - first) })
        .map(Mutex::new)
        .collect();
    let take = || {
        let tile = next_tile.fetch_add(1, Ordering::Relaxed);
        (tile < n_tiles(settings)).then(|| (tile, &strips[(tile / tiles_per_strip) as usize]))
    };
    let n_workers = settings.threads.min(n_tiles(settings) as usize);
    std::thread::scope(|scope| {
        for _ in 1..n_workers {
            scope.spawn(|| work(job, &take, finished, &tally));
        }
        work(job, &take, finished, &tally);
    });
    let tally = tally.into_inner().unwrap_or_else(PoisonError::into_inner);
    // A stop that came after the last batch came too late to matter.
    if tally.n_tiles < n_tiles(settings) { Err(Stopped) } else { Ok(tally) }
}

/// One worker: tiles until there are none left or a stop is asked for.
fn work<'a, 'film: 'a>(
    job: &Job,
    take: &impl Fn() -> Option<(u64, &'a Mutex<Strip<'film>>)>,
    finished: &dyn Fn(&Rows),
    tally: &Mutex<Tally>,
) {
    let mut wavefront = Wavefront::default();
    let mut pixels = Vec::new();
    take_exact_tests();
    let (mut rays_before, mut n_finished) = (0, 0);
    // A frame of one sample a pixel does not count them.
    let is_layered = !BARE && job.settings.aovs.any();
    let render = match (BARE || job.pattern.n_samples() == 1, is_layered) {
        (true, false) => render_tile::<true, false>,
        (false, false) => render_tile::<false, false>,
        (_, true) => render_tile::<false, true>,
    };
    let mut layers = Layers::new(&job.settings.aovs, job.scene.world, &job.camera);
    let mut blocks = Blocks::new(job);
    while let Some((tile, strip)) = take() {
        let region = tile_region(job.settings, tile);
        if render(job, &region, &mut wavefront, &mut pixels, &mut layers, &mut blocks).is_err() {
            break;
        }
        // Nobody else wants a strip whose last tile is there: what is done with it holds up no one.
        let mut strip = strip.lock().unwrap_or_else(PoisonError::into_inner);
        let window = job.settings.region;
        let row = (region.y0 - window.y0) as usize - strip.rows.first_row();
        let (column, width) = ((region.x0 - window.x0) as usize, region.width_px() as usize);
        strip.rows.put(column, row, width, &pixels);
        if is_layered {
            strip.rows.put_planes(pixels[0].len(), column, row, width, layers.finish(job.pattern.n_samples() as f64));
        }
        strip.n_tiles_left -= 1;
        if strip.n_tiles_left == 0 {
            finished(&strip.rows.as_rows());
        }
        drop(strip);
        let rays = wavefront.counts.total();
        job.control.rays_traced.fetch_add(rays - rays_before, Ordering::Relaxed);
        job.control.tiles_done.fetch_add(1, Ordering::Relaxed);
        rays_before = rays;
        n_finished += 1;
    }
    let mut tally = tally.lock().unwrap_or_else(PoisonError::into_inner);
    tally.n_tiles += n_finished;
    tally.rays.add(&wavefront.counts);
    tally.exact_tests += take_exact_tests();
    tally.error.add(&blocks.sums);
}

/// Compares blocks of each pixel's samples.
struct Blocks {
    sums: Sums,
    /// Blocks of a pixel: 4 or 16.
    n_blocks: usize,
    /// Samples of a block; more than there are where they tell nothing.
    length: usize,
    /// Sums up to the end of each block.
    prefix: [DVec3; 16],
}

impl Blocks {
    fn new(job: &Job) -> Blocks {
        let (n_blocks, length) =
            blocks_of(job.settings.sampler, job.pattern.n_samples()).unwrap_or((4, usize::MAX / 16));
        Blocks { sums: Sums::default(), n_blocks, length, prefix: [DVec3::ZERO; 16] }
    }

    /// Notes the sum of the first `n_blocks` blocks of a pixel.
    #[inline(never)]
    fn note(&mut self, n_blocks: usize, sum: DVec3) {
        self.prefix[n_blocks - 1] = sum;
        if n_blocks == self.n_blocks {
            self.sums.note_blocks(&self.prefix[..n_blocks], self.length);
        }
    }
}

/// Tiles in rows from the top left; those at the right and lower edge may be smaller.
fn tile_region(settings: &Settings, tile: u64) -> Region {
    let Settings { region, tile_size_px: size, .. } = *settings;
    let n_columns = u64::from(region.width_px().div_ceil(size));
    let (column, row) = ((tile % n_columns) as u32, (tile / n_columns) as u32);
    let (x0, y0) = (region.x0 + column * size, region.y0 + row * size);
    Region { x0, y0, x1: region.x1.min(x0.saturating_add(size)), y1: region.y1.min(y0.saturating_add(size)) }
}

/// Renders the pixels of a tile, block after block: R, G, B and coverage. A stop is noticed between batches; a pixel of
/// many samples takes several, and each of its sums still runs over its samples in order.
fn render_tile<const ONE_SAMPLE: bool, const LAYERED: bool>(
    job: &Job,
    region: &Region,
    wavefront: &mut Wavefront,
    pixels: &mut Vec<[f64; 4]>,
    layers: &mut Layers,
    blocks: &mut Blocks,
) -> Result<(), Stopped> {
    let n_samples = if ONE_SAMPLE { 1 } else { job.pattern.n_samples() };
    let width = region.width_px() as usize;
    pixels.clear();
    pixels.resize(region.n_pixels(), [0.0; 4]);
    if LAYERED {
        layers.begin(region.n_pixels());
    }
    let order = block_order(width, region.height_px() as usize, n_samples);
    let mut first = (0, 0);
    // The end of the block that the next sample belongs to.
    let mut block_end = blocks.length;
    while first.0 < order.len() {
        if job.control.stop.load(Ordering::Relaxed) {
            return Err(Stopped);
        }
        let next = gather::<ONE_SAMPLE, LAYERED>(job, region, &order, first, wavefront.begin(), layers);
        let level = wavefront.trace(&job.scene, &job.control.stop)?;
        let (mut place, mut sample) = first;
        for (ray, (radiance, hit)) in level.radiance.iter().zip(&level.hits).enumerate() {
            if LAYERED {
                layers.add(order[place] as usize, level, ray, 1.0);
            }
            let [r, g, b, n_hits] = &mut pixels[order[place] as usize];
            *r += radiance.x;
            *g += radiance.y;
            *b += radiance.z;
            *n_hits += f64::from(u8::from(hit.is_some()));
            sample += 1;
            if !ONE_SAMPLE && sample == block_end {
                blocks.note(sample / blocks.length, DVec3::new(*r, *g, *b));
                // What is left over after the last block is compared with nothing.
                let has_more = sample < blocks.n_blocks * blocks.length;
                block_end = if has_more { sample + blocks.length } else { usize::MAX };
            }
            if sample == n_samples {
                (place, sample) = (place + 1, 0);
                block_end = blocks.length;
            }
        }
        first = next;
    }
    if n_samples > 1 {
        pixels.iter_mut().for_each(|sums| *sums = sums.map(|sum| sum / n_samples as f64));
    }
    Ok(())
}

/// Camera rays of the next batch, from the place in the order of pixels and the sample where the last one ended; where this one ends.
#[inline(always)]
fn gather<const ONE_SAMPLE: bool, const LAYERED: bool>(
    job: &Job,
    region: &Region,
    order: &[u32],
    (mut place, mut sample): (usize, usize),
    rays: &mut Vec<Ray>,
    layers: &mut Layers,
) -> (usize, usize) {
    let n_samples = if ONE_SAMPLE { 1 } else { job.pattern.n_samples() };
    let width = region.width_px() as usize;
    if LAYERED {
        layers.begin_batch();
    }
    while place < order.len() && rays.len() < BATCH_RAYS {
        let index = order[place] as usize;
        let (x, y) = (region.x0 + (index % width) as u32, region.y0 + (index / width) as u32);
        while sample < n_samples && rays.len() < BATCH_RAYS {
            // A single sample is the centre, whatever the pattern.
            let (dx, dy) = if ONE_SAMPLE { (0.5, 0.5) } else { job.pattern.position(x, y, sample) };
            rays.push(job.camera.ray(f64::from(x) + dx, f64::from(y) + dy));
            if LAYERED {
                layers.note_place(dx, dy);
            }
            sample += 1;
        }
        if sample == n_samples {
            (place, sample) = (place + 1, 0);
        }
    }
    (place, sample)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_are_the_fewest_rows_of_tiles_that_bands_divide() {
        for (tile_size_px, expected) in [(1, 16), (8, 2), (16, 1), (20, 4), (32, 1), (33, 16), (48, 1), (1000, 2)] {
            assert_eq!(tile_rows_per_strip(tile_size_px), expected, "{tile_size_px}");
        }
    }
}
