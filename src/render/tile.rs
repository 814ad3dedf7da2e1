//! Tiles: workers take one after another, and each writes its own part of the film.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

use super::camera_ray::CameraRays;
use super::sampler::Pattern;
use super::trace::{Scene, Wavefront};
use super::{Control, RayCounts, Settings, Stopped, n_tiles};
use crate::film::{Film, Plane, Region, Samples};
use crate::numeric::tally::take_exact_tests;

/// Camera rays in a batch at most: a batch and what it sends fit into the second level cache.
const BATCH_RAYS: usize = 2048;

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
    /// Tiles finished.
    n_tiles: u64,
}

/// Renders all tiles into the film.
pub fn render_tiles(job: &Job, film: &mut Film) -> Result<Tally, Stopped> {
    let next_tile = AtomicU64::new(0);
    let shared = Mutex::new((film, Tally::default()));
    let n_workers = job.settings.threads.min(n_tiles(job.settings) as usize);
    std::thread::scope(|scope| {
        for _ in 1..n_workers {
            scope.spawn(|| work(job, &next_tile, &shared));
        }
        work(job, &next_tile, &shared);
    });
    let (_, tally) = shared.into_inner().unwrap_or_else(PoisonError::into_inner);
    // A stop that came after the last batch came too late to matter.
    if tally.n_tiles < n_tiles(job.settings) { Err(Stopped) } else { Ok(tally) }
}

/// One worker: tiles until there are none left or a stop is asked for.
fn work(job: &Job, next_tile: &AtomicU64, shared: &Mutex<(&mut Film, Tally)>) {
    let mut wavefront = Wavefront::default();
    let mut pixels = Vec::new();
    take_exact_tests();
    let (mut rays_before, mut n_finished) = (0, 0);
    loop {
        let tile = next_tile.fetch_add(1, Ordering::Relaxed);
        if tile >= n_tiles(job.settings) {
            break;
        }
        let region = tile_region(job.settings, tile);
        if render_tile(job, &region, &mut wavefront, &mut pixels).is_err() {
            break;
        }
        copy_into(shared.lock().unwrap_or_else(PoisonError::into_inner).0, &region, &pixels);
        let rays = wavefront.counts.total();
        job.control.rays_traced.fetch_add(rays - rays_before, Ordering::Relaxed);
        job.control.tiles_done.fetch_add(1, Ordering::Relaxed);
        rays_before = rays;
        n_finished += 1;
    }
    let mut guard = shared.lock().unwrap_or_else(PoisonError::into_inner);
    guard.1.n_tiles += n_finished;
    guard.1.rays.add(&wavefront.counts);
    guard.1.exact_tests += take_exact_tests();
}

/// Tiles in rows from the top left; those at the right and lower edge may be smaller.
fn tile_region(settings: &Settings, tile: u64) -> Region {
    let Settings { region, tile_size_px: size, .. } = *settings;
    let n_columns = u64::from(region.width_px().div_ceil(size));
    let (column, row) = ((tile % n_columns) as u32, (tile / n_columns) as u32);
    let (x0, y0) = (region.x0 + column * size, region.y0 + row * size);
    Region { x0, y0, x1: region.x1.min(x0.saturating_add(size)), y1: region.y1.min(y0.saturating_add(size)) }
}

/// Renders the pixels of a tile, row after row: R, G, B and coverage. A stop is noticed between batches; a pixel of many
/// samples takes several, and each of its sums still runs over its samples in order.
fn render_tile(
    job: &Job,
    region: &Region,
    wavefront: &mut Wavefront,
    pixels: &mut Vec<[f64; 4]>,
) -> Result<(), Stopped> {
    let n_samples = job.pattern.n_samples();
    let width = region.width_px() as usize;
    pixels.clear();
    pixels.resize(region.n_pixels(), [0.0; 4]);
    let mut first = (0, 0);
    while first.0 < pixels.len() {
        if job.control.stop.load(Ordering::Relaxed) {
            return Err(Stopped);
        }
        // Each batch goes on where the last one ended.
        let level = wavefront.begin();
        let (mut index, mut sample) = first;
        for _ in 0..BATCH_RAYS {
            if index == pixels.len() {
                break;
            }
            let (x, y) = (region.x0 + (index % width) as u32, region.y0 + (index / width) as u32);
            let (dx, dy) = job.pattern.position(x, y, sample);
            level.push(job.camera.ray(f64::from(x) + dx, f64::from(y) + dy), 0, 1.0);
            (index, sample) = after(index, sample, n_samples);
        }
        let next = (index, sample);
        let level = wavefront.trace(&job.scene);
        (index, sample) = first;
        for (radiance, hit) in level.radiance.iter().zip(&level.hits) {
            let [r, g, b, n_hits] = &mut pixels[index];
            *r += radiance.x;
            *g += radiance.y;
            *b += radiance.z;
            *n_hits += f64::from(u8::from(hit.is_some()));
            (index, sample) = after(index, sample, n_samples);
        }
        first = next;
    }
    pixels.iter_mut().flatten().for_each(|sum| *sum /= n_samples as f64);
    Ok(())
}

/// The pixel and sample that follow.
#[inline]
fn after(index: usize, sample: usize, n_samples: usize) -> (usize, usize) {
    if sample + 1 == n_samples { (index + 1, 0) } else { (index, sample + 1) }
}

/// Copies a tile into the planes of the film.
fn copy_into(film: &mut Film, region: &Region, pixels: &[[f64; 4]]) {
    let data_window = film.data_window;
    let width = region.width_px() as usize;
    for (channel, Plane { samples, .. }) in film.planes.iter_mut().enumerate() {
        for (row, y) in pixels.chunks_exact(width).zip(region.y0..) {
            let start = data_window.index_of(region.x0, y);
            match samples {
                Samples::F32(values) => {
                    for (value, pixel) in values[start..start + width].iter_mut().zip(row) {
                        *value = pixel[channel] as f32;
                    }
                }
                Samples::F64(values) => {
                    for (value, pixel) in values[start..start + width].iter_mut().zip(row) {
                        *value = pixel[channel];
                    }
                }
                Samples::U32(_) => {}
            }
        }
    }
}
