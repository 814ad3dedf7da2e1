//! Where the samples of a pixel lie. Positions depend on the seed, the pixel and the sample number alone, so that
//! they are the same for any order of work and for any crop.

mod cells;
mod sobol;

use super::filter::{Filter, Warp};
use super::{Sampler, Settings};
use cells::{Cell, cells};

impl Sampler {
    /// All of them.
    pub const ALL: [Sampler; 5] = [Sampler::Center, Sampler::Grid, Sampler::Jitter, Sampler::Random, Sampler::Sobol];

    /// The word for it in scenes, on command lines and in headers.
    pub fn name(self) -> &'static str {
        match self {
            Sampler::Center => "center",
            Sampler::Grid => "grid",
            Sampler::Jitter => "jitter",
            Sampler::Random => "random",
            Sampler::Sobol => "sobol",
        }
    }
}

/// Sample positions for all pixels of a render.
#[derive(Clone, Debug)]
pub struct Pattern {
    places: Places,
    n_samples: usize,
    seed: u64,
    warp: Option<Warp>,
}

#[derive(Clone, Debug)]
enum Places {
    /// Centres of cells.
    Grid(Vec<Cell>),
    /// A random point in each.
    Jitter(Vec<Cell>),
    /// Random points.
    Random,
    /// By sample, the second dimension of Sobol's sequence, bits reversed.
    Sobol(Vec<u32>),
}

impl Pattern {
    /// The pattern of the settings.
    pub fn new(settings: &Settings) -> Pattern {
        let centered = settings.is_centered();
        let n_samples = if centered { 1 } else { settings.samples };
        let places = match settings.sampler {
            _ if centered => Places::Grid(cells(1)),
            Sampler::Center | Sampler::Grid => Places::Grid(cells(n_samples)),
            Sampler::Jitter => Places::Jitter(cells(n_samples)),
            Sampler::Random => Places::Random,
            Sampler::Sobol => Places::Sobol((0..n_samples).map(sobol::second).collect()),
        };
        let filter = if centered { Filter::Box } else { settings.filter };
        Pattern { places, n_samples: n_samples as usize, seed: settings.seed, warp: filter.warp() }
    }

    /// Samples per pixel.
    pub fn n_samples(&self) -> usize {
        self.n_samples
    }

    /// Position of a sample from the top left corner of its pixel: in [0, 1)² with the box filter, else as far around the
    /// centre as the filter reaches. A pixel's value is the plain mean of its samples.
    #[inline]
    pub fn position(&self, x_px: u32, y_px: u32, sample: usize) -> (f64, f64) {
        let position = match &self.places {
            Places::Grid(cells) => cells[sample].at((0.5, 0.5)),
            Places::Jitter(cells) => cells[sample].at(self.random(x_px, y_px, sample)),
            Places::Random => self.random(x_px, y_px, sample),
            Places::Sobol(second) => net_point(pixel_hash(self.seed, x_px, y_px), sample as u32, second[sample]),
        };
        self.warped(position)
    }

    /// Where a point of the unit square lies from the top left corner of its pixel.
    #[inline]
    pub fn warped(&self, position: (f64, f64)) -> (f64, f64) {
        match self.warp {
            None => position,
            Some(warp) => warp.position(position),
        }
    }

    /// A point of the unit square for a sample.
    #[inline]
    fn random(&self, x_px: u32, y_px: u32, sample: usize) -> (f64, f64) {
        unit_square(mix(pixel_hash(self.seed, x_px, y_px) ^ sample as u64))
    }
}

/// A number for each pixel of each seed.
#[inline]
pub(super) fn pixel_hash(seed: u64, x_px: u32, y_px: u32) -> u64 {
    mix(seed ^ mix(u64::from(y_px) << 32 | u64::from(x_px)))
}

/// A point of Sobol's sequence, its second dimension as [`sobol::second`] gives it, scrambled by two seeds.
#[inline]
fn net_point(seeds: u64, index: u32, second: u32) -> (f64, f64) {
    let x = sobol::scrambled(index, seeds as u32);
    let y = sobol::scrambled(second, (seeds >> 32) as u32);
    (f64::from(x) * SCALE, f64::from(y) * SCALE)
}

/// The upper and the lower half of a hash, as fractions of 2³².
#[inline]
pub(super) fn unit_square(bits: u64) -> (f64, f64) {
    ((bits >> 32) as f64 * SCALE, (bits & 0xffff_ffff) as f64 * SCALE)
}

const SCALE: f64 = 1.0 / (1u64 << 32) as f64;

/// The output function of SplitMix64 (Steele, Lea and Flood, OOPSLA 2014): every input bit changes every output bit.
#[inline]
pub(super) fn mix(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ x >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ x >> 31
}

#[cfg(test)]
mod tests {
    use glam::DMat4;

    use super::*;
    use crate::world::Camera;

    #[test]
    fn samples_of_a_filter_are_spread_as_it_says_and_a_single_one_stays_the_centre() {
        let camera = Camera { world_from_camera: DMat4::IDENTITY, fov_y_radians: 1.0, width_px: 4, height_px: 4 };
        let settings =
            |samples, sampler, filter| Settings { samples, sampler, filter, seed: 3, ..Settings::new(&camera) };
        // The shares of samples left of −1, −½, 0, ½ and 1 pixel around the centre, by their closed forms.
        let triangle = [0.0, 0.125, 0.5, 0.875, 1.0];
        let gaussian = [0.021_459_9, 0.157_731, 0.5, 0.842_269, 0.978_540_1];
        for (filter, expected) in [(Filter::Triangle, triangle), (Filter::Gaussian, gaussian)] {
            let pattern = Pattern::new(&settings(4096, Sampler::Jitter, filter));
            let places: Vec<(f64, f64)> = (0..4096).map(|sample| pattern.position(2, 1, sample)).collect();
            for (limit, expected) in [-1.0, -0.5, 0.0, 0.5, 1.0].into_iter().zip(expected) {
                let share = |below: &dyn Fn(&(f64, f64)) -> bool| {
                    places.iter().filter(|place| below(place)).count() as f64 / places.len() as f64
                };
                // Of the 64 columns of cells only the one that the limit runs through is in doubt.
                assert!((share(&|place| place.0 < 0.5 + limit) - expected).abs() <= 1.0 / 64.0, "{filter:?} {limit}");
                assert!((share(&|place| place.1 < 0.5 + limit) - expected).abs() <= 1.0 / 64.0, "{filter:?} {limit}");
            }
            for sampler in [Sampler::Center, Sampler::Grid, Sampler::Jitter] {
                let pattern = Pattern::new(&settings(1, sampler, filter));
                assert_eq!((pattern.n_samples(), pattern.position(1, 1, 0)), (1, (0.5, 0.5)));
            }
        }
    }
}
