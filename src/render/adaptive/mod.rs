//! Samples where the image needs them: blocks of pixels, taken by workers one after another.
//!
//! | room | does |
//! |---|---|
//! | `tree` | the cells of a block |
//! | `contrast` | what neighbouring samples tell |
//! | `block` | divides cells, and takes the samples that count |

mod block;
mod contrast;
mod tree;

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use super::layers::Layers;
use super::parts::PartsAsked;
use super::shade::Shading;
use super::tile::{Job, Tally};
use super::trace::{Scene, Wavefront};
use super::{Adaptive, Stopped};
use crate::film::rows::RowsMut;
use crate::film::{Film, Region};
use crate::numeric::tally::take_exact_tests;
use block::{Block, blocks};
use tree::BLOCK_PX;

/// Blocks that a part of an image touches.
pub fn n_blocks(part: &Region) -> u64 {
    let count = |from: u32, to: u32| u64::from(to.div_ceil(BLOCK_PX) - from / BLOCK_PX);
    count(part.x0, part.x1) * count(part.y0, part.y1)
}

/// Renders the part of the image that the settings name into the film.
pub fn render_blocks(job: &Job, adaptive: &Adaptive, film: &mut Film) -> Result<Tally, Stopped> {
    let scene = &job.scene;
    let settings = job.settings;
    let decide = Scene {
        shading: Shading::new(scene.world, settings.terminator, false, scene.accel.isa()),
        parts: PartsAsked::default(),
        signatures: true,
        ..scene.clone()
    };
    let blocks = blocks(film.width_px, film.height_px, &settings.region);
    let mut rows = film.split_rows_mut(settings.region.height_px() as usize);
    let film = Mutex::new(rows.remove(0));
    let next = AtomicUsize::new(0);
    let tally = Mutex::new(Tally::default());
    let work = || {
        let mine = work(job, &decide, adaptive, &|| blocks.get(next.fetch_add(1, Ordering::Relaxed)), &film);
        let mut all = tally.lock().unwrap_or_else(PoisonError::into_inner);
        all.n_tiles += mine.n_tiles;
        all.exact_tests += mine.exact_tests;
        all.rays.add(&mine.rays);
        all.error.add(&mine.error);
    };
    std::thread::scope(|scope| {
        (1..settings.threads.min(blocks.len())).for_each(|_| drop(scope.spawn(work)));
        work();
    });
    let tally = tally.into_inner().unwrap_or_else(PoisonError::into_inner);
    if tally.n_tiles < blocks.len() as u64 { Err(Stopped) } else { Ok(tally) }
}

/// One worker: blocks until there are none left or a stop is asked for.
fn work<'a>(
    job: &Job,
    decide: &Scene,
    adaptive: &Adaptive,
    take: &dyn Fn() -> Option<&'a Region>,
    film: &Mutex<RowsMut<'_>>,
) -> Tally {
    let part = job.settings.region;
    let mut tally = Tally::default();
    let (mut block, mut wavefront) = (Block::default(), Wavefront::default());
    let mut layers = job.settings.aovs.any().then(|| Layers::new(&job.settings.aovs, job.scene.world, &job.camera));
    take_exact_tests();
    while let Some(region) = take() {
        let before = wavefront.counts.total();
        if block.render(job, decide, adaptive, region, &mut wavefront, layers.as_mut()).is_err() {
            break;
        }
        tally.error.add(&block.error(region, &part));
        let mut film = film.lock().unwrap_or_else(PoisonError::into_inner);
        let planes = layers.as_mut().map(|layers| layers.finish(1.0));
        put(&mut film, &part, region, &block.pixels, planes);
        drop(film);
        tally.n_tiles += 1;
        job.control.rays_traced.fetch_add(wavefront.counts.total() - before, Ordering::Relaxed);
        job.control.tiles_done.fetch_add(1, Ordering::Relaxed);
    }
    tally.rays = wavefront.counts;
    tally.exact_tests = take_exact_tests();
    tally
}

/// Writes the pixels of a block that are of the part asked for.
fn put(film: &mut RowsMut<'_>, part: &Region, block: &Region, pixels: &[[f64; 4]], planes: Option<&[f64]>) {
    let width = block.width_px() as usize;
    let (x0, x1) = (block.x0.max(part.x0), block.x1.min(part.x1));
    let n_planes = planes.map_or(0, |planes| planes.len() / pixels.len());
    for y in block.y0.max(part.y0)..block.y1.min(part.y1) {
        let from = (y - block.y0) as usize * width + (x0 - block.x0) as usize;
        let range = from..from + (x1 - x0) as usize;
        let (column, row) = ((x0 - part.x0) as usize, (y - part.y0) as usize);
        film.put(column, row, range.len(), &pixels[range.clone()]);
        if let Some(planes) = planes {
            film.put_planes(4, column, row, range.len(), &planes[range.start * n_planes..range.end * n_planes]);
        }
    }
}
