//! Tiles: workers take one after another, and each writes its own part of the film.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

use glam::DVec3;

use super::camera_ray::CameraRays;
use super::sampler::Pattern;
use super::trace::{Scene, Wavefront};
use super::{Control, RayCounts, Settings, Stopped, n_tiles};
use crate::film::{Film, Plane, Region, Samples};
use crate::numeric::tally::take_exact_tests;

/// Camera rays in a batch at most, but for a pixel of more samples: a batch and what it sends fit into the second
/// level cache.
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
    if job.control.stop.load(Ordering::Relaxed) && next_tile.into_inner() < n_tiles(job.settings) {
        return Err(Stopped);
    }
    Ok(tally)
}

/// One worker: tiles until there are none left or a stop is asked for.
fn work(job: &Job, next_tile: &AtomicU64, shared: &Mutex<(&mut Film, Tally)>) {
    let mut wavefront = Wavefront::default();
    let mut pixels = Vec::new();
    take_exact_tests();
    let mut rays_before = 0;
    while !job.control.stop.load(Ordering::Relaxed) {
        let tile = next_tile.fetch_add(1, Ordering::Relaxed);
        if tile >= n_tiles(job.settings) {
            break;
        }
        let region = tile_region(job.settings, tile);
        render_tile(job, &region, &mut wavefront, &mut pixels);
        copy_into(shared.lock().unwrap_or_else(PoisonError::into_inner).0, &region, &pixels);
        let rays = wavefront.counts.total();
        job.control.rays_traced.fetch_add(rays - rays_before, Ordering::Relaxed);
        job.control.tiles_done.fetch_add(1, Ordering::Relaxed);
        rays_before = rays;
    }
    let mut guard = shared.lock().unwrap_or_else(PoisonError::into_inner);
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

/// Renders the pixels of a tile, row after row: R, G, B and coverage.
fn render_tile(job: &Job, region: &Region, wavefront: &mut Wavefront, pixels: &mut Vec<[f64; 4]>) {
    pixels.clear();
    let n_samples = job.pattern.n_samples();
    let pixels_per_batch = (BATCH_RAYS / n_samples).max(1);
    let width = region.width_px() as usize;
    let n_pixels = region.n_pixels();
    for first in (0..n_pixels).step_by(pixels_per_batch) {
        let batch = first..n_pixels.min(first + pixels_per_batch);
        let level = wavefront.begin();
        for index in batch.clone() {
            let (x, y) = (region.x0 + (index % width) as u32, region.y0 + (index / width) as u32);
            for sample in 0..n_samples {
                let (dx, dy) = job.pattern.position(x, y, sample);
                level.push(job.camera.ray(f64::from(x) + dx, f64::from(y) + dy), 0, 1.0);
            }
        }
        let level = wavefront.trace(&job.scene);
        let samples = level.radiance.chunks_exact(n_samples).zip(level.hits.chunks_exact(n_samples));
        pixels.extend(samples.map(|(radiance, hits)| {
            let mean = radiance.iter().sum::<DVec3>() / n_samples as f64;
            let n_hits = hits.iter().filter(|hit| hit.is_some()).count();
            [mean.x, mean.y, mean.z, n_hits as f64 / n_samples as f64]
        }));
    }
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
