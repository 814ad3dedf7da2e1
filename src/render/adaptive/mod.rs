//! Samples where the image needs them: blocks of pixels, taken by workers one after another.
//!
//! | room | does |
//! |---|---|
//! | `tree` | the cells of a block |
//! | `contrast` | what neighbouring samples tell |
//! | `divide` | divides the pixels of a block |
//! | `count` | takes the samples that count |
//! | `foresight` | tells, before, what error and how many samples a threshold will come to |

mod contrast;
mod count;
mod divide;
mod foresight;
mod tree;

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use super::estimate::Sums;
use super::layers::Layers;
use super::parts::PartsAsked;
use super::shade::Shading;
use super::tile::{Job, Tally};
use super::trace::{Scene, Wavefront};
use super::{Adaptive, Counts, Stopped};
use crate::film::rows::RowsMut;
use crate::film::{Film, Region};
use crate::numeric::tally::take_exact_tests;
use count::{Counting, ONE_IN};
use divide::{Divider, Division};

#[cfg(test)]
pub use divide::FirstLook;
pub use foresight::Foresight;
use tree::BLOCK_PX;

/// Blocks that a part of an image touches.
pub fn n_blocks(part: &Region) -> u64 {
    let count = |from: u32, to: u32| u64::from(to.div_ceil(BLOCK_PX) - from / BLOCK_PX);
    count(part.x0, part.x1) * count(part.y0, part.y1)
}

/// What rendering blocks took and came to.
#[derive(Clone, Copy, Debug, Default)]
pub struct Outcome {
    /// Rays, exact tests and blocks.
    pub tally: Tally,
    /// What tells the error.
    pub error: Sums,
    /// Pixels of the part asked for that were rendered.
    pub n_pixels: usize,
}

impl Outcome {
    fn add(&mut self, other: &Outcome) {
        self.tally.n_tiles += other.tally.n_tiles;
        self.tally.exact_tests += other.tally.exact_tests;
        self.tally.rays.add(&other.tally.rays);
        self.error.add(&other.error);
        self.n_pixels += other.n_pixels;
    }

    /// The outcome as what a render reports.
    pub fn counts(&self) -> Counts {
        let rmse_estimate = Some(self.error.rmse_of_pairs(self.n_pixels.max(1), ONE_IN));
        Counts { rays: self.tally.rays, exact_tests: self.tally.exact_tests, rmse_estimate }
    }
}

/// The scene as samples see it that decide: such that they are told apart, and no layer is kept.
fn deciding<'a>(job: &Job<'a>) -> Scene<'a> {
    let scene = &job.scene;
    Scene {
        shading: Shading::new(scene.world, job.settings.terminator, false, scene.accel.isa()),
        parts: PartsAsked::default(),
        signatures: true,
        ..scene.clone()
    }
}

/// Renders the part of the image that the settings name into the film.
pub fn render_blocks(job: &Job, adaptive: &Adaptive, film: &mut Film) -> Result<Outcome, Stopped> {
    let settings = job.settings;
    let decide = deciding(job);
    let blocks = blocks(film.width_px, film.height_px, &settings.region);
    let mut rows = film.split_rows_mut(settings.region.height_px() as usize);
    let film = Mutex::new(rows.remove(0));
    let outcome = by_block(settings.threads, &blocks, &|take| {
        work(&Divider { job, scene: &decide, adaptive, spacing_px: 1 }, take, &film)
    });
    if outcome.tally.n_tiles < blocks.len() as u64 { Err(Stopped) } else { Ok(outcome) }
}

/// Distance in pixels of the samples by which an image is looked at.
const LOOKING_PX: u32 = 2;

/// Looks at the part of the image that the settings name, with one sample in every other pixel of every other row, which decides and does not
/// count: what error and how many samples thresholds will come to, and what it took.
pub fn foresee(job: &Job, [width_px, height_px]: [u32; 2]) -> Result<(Foresight, Counts), Stopped> {
    let (settings, decide, adaptive) = (job.settings, deciding(job), Adaptive::new(f64::INFINITY));
    let coarse = |length_px: u32| length_px.div_ceil(LOOKING_PX);
    let Region { x0, y0, x1, y1 } = settings.region;
    let part = Region { x0: x0 / LOOKING_PX, y0: y0 / LOOKING_PX, x1: coarse(x1), y1: coarse(y1) };
    let blocks = blocks(coarse(width_px), coarse(height_px), &part);
    let foreseen = Mutex::new(Foresight::default());
    let outcome = by_block(settings.threads, &blocks, &|take| {
        look(&Divider { job, scene: &decide, adaptive: &adaptive, spacing_px: LOOKING_PX }, take, &foreseen)
    });
    let foreseen = foreseen.into_inner().unwrap_or_else(PoisonError::into_inner);
    let Tally { rays, exact_tests, n_tiles, .. } = outcome.tally;
    let counts = Counts { rays, exact_tests, rmse_estimate: None };
    if n_tiles < blocks.len() as u64 { Err(Stopped) } else { Ok((foreseen, counts)) }
}

/// The way to the next block.
type Take<'a, 'b> = &'a dyn Fn() -> Option<&'b Region>;

/// Has threads work, each with a way to take the next block, until there are none left; the sum of their outcomes.
fn by_block<'a>(n_threads: usize, blocks: &'a [Region], work: &(dyn Fn(Take<'_, 'a>) -> Outcome + Sync)) -> Outcome {
    let next = AtomicUsize::new(0);
    let outcome = Mutex::new(Outcome::default());
    let work = || {
        let mine = work(&|| blocks.get(next.fetch_add(1, Ordering::Relaxed)));
        outcome.lock().unwrap_or_else(PoisonError::into_inner).add(&mine);
    };
    std::thread::scope(|scope| {
        (1..n_threads.min(blocks.len())).for_each(|_| drop(scope.spawn(work)));
        work();
    });
    outcome.into_inner().unwrap_or_else(PoisonError::into_inner)
}

/// One worker that looks at blocks.
fn look(divider: &Divider, take: Take, foreseen: &Mutex<Foresight>) -> Outcome {
    let mut outcome = Outcome::default();
    let (mut mine, mut division, mut wavefront) = (Foresight::default(), Division::default(), Wavefront::default());
    take_exact_tests();
    while let Some(block) = take() {
        let before = wavefront.counts.total();
        if division.look(divider, block, &mut wavefront).is_err() {
            break;
        }
        for row in 0..block.height_px() as usize {
            for column in 0..block.width_px() as usize {
                mine.note(&division.first_look(column, row), LOOKING_PX);
            }
        }
        outcome.tally.n_tiles += 1;
        divider.job.control.rays_traced.fetch_add(wavefront.counts.total() - before, Ordering::Relaxed);
    }
    foreseen.lock().unwrap_or_else(PoisonError::into_inner).add(&mine);
    outcome.tally.rays = wavefront.counts;
    outcome.tally.exact_tests = take_exact_tests();
    outcome
}

/// One worker: blocks until there are none left or a stop is asked for.
fn work(divider: &Divider, take: Take, film: &Mutex<RowsMut<'_>>) -> Outcome {
    let job = divider.job;
    let part = job.settings.region;
    let mut outcome = Outcome::default();
    let (mut division, mut counting, mut wavefront) = (Division::default(), Counting::default(), Wavefront::default());
    let mut layers = job.settings.aovs.any().then(|| Layers::new(&job.settings.aovs, job.scene.world, &job.camera));
    take_exact_tests();
    while let Some(block) = take() {
        let before = wavefront.counts.total();
        let is_done = division
            .divide(divider, block, &mut wavefront)
            .and_then(|()| counting.count(job, &division, block, &mut wavefront, layers.as_mut()));
        if is_done.is_err() {
            break;
        }
        outcome.error.add(&counting.error);
        let mut film = film.lock().unwrap_or_else(PoisonError::into_inner);
        let planes = layers.as_mut().map(|layers| layers.finish(1.0));
        outcome.n_pixels += put(&mut film, &part, block, &counting.pixels, planes);
        drop(film);
        outcome.tally.n_tiles += 1;
        job.control.rays_traced.fetch_add(wavefront.counts.total() - before, Ordering::Relaxed);
        job.control.tiles_done.fetch_add(1, Ordering::Relaxed);
    }
    outcome.tally.rays = wavefront.counts;
    outcome.tally.exact_tests = take_exact_tests();
    outcome
}

/// Writes the pixels of a block that are of the part asked for, and says how many.
fn put(film: &mut RowsMut<'_>, part: &Region, block: &Region, pixels: &[[f64; 4]], planes: Option<&[f64]>) -> usize {
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
    (x1 - x0) as usize * (block.y1.min(part.y1) - block.y0.max(part.y0)) as usize
}

/// The blocks that a part of an image touches, in rows from the top left; those at the right and lower edge of the image
/// may be smaller.
fn blocks(width_px: u32, height_px: u32, part: &Region) -> Vec<Region> {
    let starts = |from: u32, to: u32| (from / BLOCK_PX * BLOCK_PX..to).step_by(BLOCK_PX as usize);
    let block = |x0: u32, y0: u32| Region {
        x0,
        y0,
        x1: width_px.min(x0.saturating_add(BLOCK_PX)),
        y1: height_px.min(y0.saturating_add(BLOCK_PX)),
    };
    starts(part.y0, part.y1).flat_map(|y0| starts(part.x0, part.x1).map(move |x0| block(x0, y0))).collect()
}
