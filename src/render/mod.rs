//! From a compiled world to a film: samples, camera rays, tiles, shading. Reads no file and no clock, prints nothing.

mod adaptive;
pub mod aov;
pub mod block;
pub mod camera_ray;
mod cost;
mod cutoff;
mod describe;
mod estimate;
pub mod filter;
mod join;
mod layers;
mod occlusion;
mod parts;
mod refine;
mod refract;
mod sampler;
mod shade;
mod signature;
pub mod surface;
pub mod terminator;
mod tile;
mod trace;

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

pub use aov::{Aov, Aovs};

use crate::accel::Accel;
use crate::film::{Film, Plane, Region, Rows, Samples};
use crate::world::{Camera, World};

pub use filter::Filter;
pub use join::Told;
pub use refine::refine;

/// How the samples of a pixel are placed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sampler {
    /// One sample in the pixel's centre.
    Center,
    /// Centres of equal cells; four samples are the original's 2×2 at .25 and .75.
    Grid,
    /// One random point in each of equal cells.
    Jitter,
    /// Random points.
    Random,
    /// Sobol's sequence, scrambled by pixel as Owen does: the least error a sample (`docs/ERROR.md`).
    #[default]
    Sobol,
}

/// How to render. All counts are at least 1: whoever fills this in has checked them.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Samples per pixel. A single sample is the pixel's centre with every sampler.
    pub samples: u32,
    /// Where they lie.
    pub sampler: Sampler,
    /// How they are weighted.
    pub filter: Filter,
    /// Seed of all that is random.
    pub seed: u64,
    /// Longest chain of rays, the camera ray being 1.
    pub max_depth: u32,
    /// What may be left out of a sample's radiance: mirrored, refracted and shadow rays that together cannot change it by more,
    /// in any channel, are not sent. 0 leaves out nothing.
    pub cutoff: f64,
    /// Edge of the square tiles in pixels.
    pub tile_size_px: u32,
    /// Worker threads.
    pub threads: usize,
    /// The part of the image to render; it must lie inside.
    pub region: Region,
    /// Start the rays that leave a coarse smooth mesh where the smooth surface would be ([`terminator`]).
    pub terminator: bool,
    /// Clamp the radiance of every bounce to 1 and keep f64 planes, as the original does. What is clamped is no longer the
    /// sum of its parts: lobes and light groups are not asked for beside it.
    pub course: bool,
    /// What to put into the film beside the beauty.
    pub aovs: Aovs,
    /// Whether all pixels get the samples above, or as many as each needs.
    pub spread: Spread,
}

/// How samples are spread over the pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Spread {
    /// [`Settings::samples`] in each, where [`Settings::sampler`] says.
    #[default]
    Uniform,
    /// As many as each needs; samples and sampler of the settings have no meaning then.
    Adaptive(Adaptive),
}

/// Where samples are wanted: pixels are divided into cells, and these again, as long as neighbours differ. Samples
/// that decide where to divide are not those that count.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Adaptive {
    /// Cells are divided where the contrast with a neighbour, in radiance, times their area in pixels is above this, give or
    /// take a factor of two from pixel to pixel.
    pub threshold: f64,
    /// How often every pixel is halved at least.
    pub min_splits: u32,
    /// How often it is at most; at most [`MAX_SPLITS`].
    pub max_splits: u32,
}

/// Pixels cannot be halved more often.
pub const MAX_SPLITS: u32 = 12;

impl Adaptive {
    /// Pixels are divided by the threshold alone.
    pub fn new(threshold: f64) -> Adaptive {
        Adaptive { threshold, min_splits: 0, max_splits: MAX_SPLITS }
    }
}

impl Settings {
    /// One sample in the centre of each pixel of the whole image, depth 5, one thread, the picture alone.
    pub fn new(camera: &Camera) -> Settings {
        Settings {
            samples: 1,
            sampler: Sampler::Center,
            filter: Filter::Box,
            seed: 0,
            max_depth: 5,
            cutoff: 0.0,
            tile_size_px: 32,
            threads: 1,
            region: Region::whole(camera.width_px, camera.height_px),
            terminator: false,
            course: false,
            aovs: Aovs::default(),
            spread: Spread::Uniform,
        }
    }
}

impl Settings {
    /// Whether each pixel has the one sample in its centre.
    pub fn is_centered(&self) -> bool {
        self.spread == Spread::Uniform && (self.sampler == Sampler::Center || self.samples == 1)
    }
}

/// What the owner of a render can watch and say while it runs.
#[derive(Debug, Default)]
pub struct Control {
    /// Set to stop; the render then returns [`Stopped`] soon.
    pub stop: AtomicBool,
    /// Tiles finished so far.
    pub tiles_done: AtomicU64,
    /// Rays of all kinds traced so far; grows tile by tile.
    pub rays_traced: AtomicU64,
}

impl Control {
    /// Asks the render to stop.
    pub fn request_stop(&self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}

/// Rays by kind; each is counted once, when it is sent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RayCounts {
    /// Camera rays.
    pub camera: u64,
    /// Camera rays that hit something.
    pub camera_hit: u64,
    /// Mirror rays.
    pub reflection: u64,
    /// Refractions tried: total internal reflections, whose rays count as mirror rays too, are among them.
    pub refraction: u64,
    /// Shadow rays.
    pub shadow: u64,
}

impl RayCounts {
    /// Adds the counts of another.
    fn add(&mut self, other: &RayCounts) {
        let RayCounts { camera, camera_hit, reflection, refraction, shadow } = other;
        self.camera += camera;
        self.camera_hit += camera_hit;
        self.reflection += reflection;
        self.refraction += refraction;
        self.shadow += shadow;
    }

    /// Rays of all kinds.
    pub fn total(&self) -> u64 {
        self.camera + self.reflection + self.refraction + self.shadow
    }
}

/// A finished image and what it took.
#[derive(Clone, Debug)]
pub struct Rendered {
    /// `R`, `G`, `B`, `A`: scene-linear, A is coverage.
    pub film: Film,
    /// Rays by kind.
    pub rays: RayCounts,
    /// Primitive tests that f64 and double-double could not decide.
    pub exact_tests: u64,
    /// As [`Counts::rmse_estimate`].
    pub rmse_estimate: Option<f64>,
}

/// What a render took, and what it came to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Counts {
    /// Rays by kind.
    pub rays: RayCounts,
    /// Primitive tests that f64 and double-double could not decide.
    pub exact_tests: u64,
    /// The root mean square error of red, green and blue that the samples themselves tell of, beside the mean of ever more
    /// samples; where they do.
    pub rmse_estimate: Option<f64>,
}

impl Counts {
    /// Adds a further round over the same image, whose error is then that of the image.
    pub fn add_round(&mut self, round: &Counts) {
        self.rays.add(&round.rays);
        self.exact_tests += round.exact_tests;
        self.rmse_estimate = round.rmse_estimate;
    }
}

/// The render was asked to stop before it was finished.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the render was stopped before it was finished")]
pub struct Stopped;

/// Number of tiles that a render of these settings works through; one of adaptive samples has tiles of its own.
pub fn n_tiles(settings: &Settings) -> u64 {
    if let Spread::Adaptive(_) = settings.spread {
        return adaptive::n_blocks(&settings.region);
    }
    let tiles = |length_px: u32| u64::from(length_px.div_ceil(settings.tile_size_px));
    tiles(settings.region.width_px()) * tiles(settings.region.height_px())
}

/// A black film for the region of the settings: `R`, `G`, `B` and `A`, then the planes of the layers asked for.
pub fn new_film(camera: &Camera, settings: &Settings) -> Film {
    let n_pixels = settings.region.n_pixels();
    let plane = |name: &str| {
        let samples = match settings.course {
            true => Samples::F64(vec![0.0; n_pixels]),
            false => Samples::F32(vec![0.0; n_pixels]),
        };
        Plane::color(name, samples)
    };
    Film {
        width_px: camera.width_px,
        height_px: camera.height_px,
        data_window: settings.region,
        planes: ["R", "G", "B", "A"].map(plane).into_iter().chain(settings.aovs.planes(n_pixels)).collect(),
    }
}

/// Renders the region of the settings.
///
/// # Errors
/// [`Stopped`] when `control` asked for it; nothing else can go wrong.
pub fn render(
    world: &World,
    accel: &Accel,
    camera: &Camera,
    settings: &Settings,
    control: &Control,
) -> Result<Rendered, Stopped> {
    let mut film = new_film(camera, settings);
    let Counts { rays, exact_tests, rmse_estimate } =
        render_into(world, accel, camera, settings, control, &mut film, &|_| {})?;
    Ok(Rendered { film, rays, exact_tests, rmse_estimate })
}

/// Renders into a film of [`new_film`]. The workers hand over rows that are finished to `finished`, in no fixed order but
/// each once; they begin where a band of the film ([`crate::film::rows::BAND_ROWS`]) does. Adaptive samples hand over none.
///
/// # Errors
/// [`Stopped`] when `control` asked for it; the film then holds a part of the image.
pub fn render_into(
    world: &World,
    accel: &Accel,
    camera: &Camera,
    settings: &Settings,
    control: &Control,
    film: &mut Film,
    finished: &(dyn Fn(&Rows) + Sync),
) -> Result<Counts, Stopped> {
    let job = job(world, accel, camera, settings, control);
    if let Spread::Adaptive(spread) = &settings.spread {
        return Ok(adaptive::render_blocks(&job, spread, film)?.counts());
    }
    let tally = tile::render_tiles(&job, film, finished)?;
    let rmse_estimate = estimate::blocks_of(settings.sampler, job.pattern.n_samples())
        .map(|_| tally.error.rmse_of_sequence(settings.region.n_pixels(), job.pattern.n_samples()));
    Ok(Counts { rays: tally.rays, exact_tests: tally.exact_tests, rmse_estimate })
}

/// What the workers of a render share.
fn job<'a>(
    world: &'a World,
    accel: &'a Accel,
    camera: &Camera,
    settings: &'a Settings,
    control: &'a Control,
) -> tile::Job<'a> {
    let parts = parts::PartsAsked::new(&settings.aovs, settings.aovs.light_groups.len());
    tile::Job {
        scene: trace::Scene {
            world,
            accel,
            shading: shade::Shading::new(world, settings.terminator, parts.any(), accel.isa()),
            max_depth: settings.max_depth,
            clamp: settings.course,
            parts,
            signatures: false,
            cutoff: cutoff::Cutoff::new(world, settings),
            chunk_rays: trace::BATCH_RAYS,
        },
        camera: camera_ray::CameraRays::new(camera),
        pattern: sampler::Pattern::new(settings),
        settings,
        control,
    }
}
