//! From a compiled world to a film: samples, camera rays, tiles, shading. Reads no file and no clock, prints nothing.

pub mod aov;
pub mod block;
pub mod camera_ray;
mod cost;
mod describe;
pub mod filter;
mod layers;
mod parts;
mod refract;
mod sampler;
mod shade;
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

/// How the samples of a pixel are placed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sampler {
    /// One sample in the pixel's centre.
    Center,
    /// Centres of equal cells; four samples are the original's 2×2 at .25 and .75.
    Grid,
    /// One random point in each of equal cells.
    #[default]
    Jitter,
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
    /// Seed of the jitter.
    pub seed: u64,
    /// Longest chain of rays, the camera ray being 1.
    pub max_depth: u32,
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
            tile_size_px: 32,
            threads: 1,
            region: Region::whole(camera.width_px, camera.height_px),
            terminator: false,
            course: false,
            aovs: Aovs::default(),
        }
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
}

/// What a render took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Rays by kind.
    pub rays: RayCounts,
    /// Primitive tests that f64 and double-double could not decide.
    pub exact_tests: u64,
}

/// The render was asked to stop before it was finished.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the render was stopped before it was finished")]
pub struct Stopped;

/// Number of tiles that a render of these settings works through.
pub fn n_tiles(settings: &Settings) -> u64 {
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
    let Counts { rays, exact_tests } = render_into(world, accel, camera, settings, control, &mut film, &|_| {})?;
    Ok(Rendered { film, rays, exact_tests })
}

/// Renders into a film of [`new_film`]. The workers hand over rows that are finished to `finished`, in no fixed order but
/// each once; they begin where a band of the film ([`crate::film::rows::BAND_ROWS`]) does.
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
    let parts = parts::PartsAsked::new(&settings.aovs, settings.aovs.light_groups.len());
    let job = tile::Job {
        scene: trace::Scene {
            world,
            accel,
            shading: shade::Shading::new(world, settings.terminator, parts.any(), accel.isa()),
            max_depth: settings.max_depth,
            clamp: settings.course,
            parts,
            chunk_rays: trace::BATCH_RAYS,
        },
        camera: camera_ray::CameraRays::new(camera),
        pattern: sampler::Pattern::new(settings),
        settings,
        control,
    };
    let tally = tile::render_tiles(&job, film, finished)?;
    Ok(Counts { rays: tally.rays, exact_tests: tally.exact_tests })
}
