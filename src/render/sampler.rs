//! Where the samples of a pixel lie. Positions depend on the seed, the pixel and the sample number alone, so that
//! they are the same for any order of work and for any crop.

use super::filter::{Filter, Warp};
use super::{Sampler, Settings};

/// Sample positions for all pixels of a render.
#[derive(Clone, Debug)]
pub struct Pattern {
    cells: Vec<Cell>,
    jitter: Option<u64>,
    warp: Option<Warp>,
}

/// A part of the pixel, in pixel units; all cells of a pattern have the same area.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Cell {
    x: f64,
    y: f64,
    width: f64,
    height: f64,
}

impl Pattern {
    /// The pattern of the settings.
    pub fn new(settings: &Settings) -> Pattern {
        let centered = settings.sampler == Sampler::Center || settings.samples == 1;
        let n_samples = if centered { 1 } else { settings.samples };
        let jitter = (settings.sampler == Sampler::Jitter && !centered).then_some(settings.seed);
        let filter = if centered { Filter::Box } else { settings.filter };
        Pattern { cells: cells(n_samples), jitter, warp: filter.warp() }
    }

    /// Samples per pixel.
    pub fn n_samples(&self) -> usize {
        self.cells.len()
    }

    /// Position of a sample from the top left corner of its pixel: in [0, 1)² with the box filter, else as far around the
    /// centre as the filter reaches. A pixel's value is the plain mean of its samples.
    #[inline]
    pub fn position(&self, x_px: u32, y_px: u32, sample: usize) -> (f64, f64) {
        let cell = self.cells[sample];
        let (u, v) = match self.jitter {
            None => (0.5, 0.5),
            Some(seed) => {
                let pixel = u64::from(y_px) << 32 | u64::from(x_px);
                let bits = mix(mix(seed ^ mix(pixel)) ^ sample as u64);
                // The upper and the lower half of the hash, as fractions of 2³².
                ((bits >> 32) as f64 * SCALE, (bits & 0xffff_ffff) as f64 * SCALE)
            }
        };
        let position = (cell.x + u * cell.width, cell.y + v * cell.height);
        match self.warp {
            None => position,
            Some(warp) => warp.position(position),
        }
    }
}

const SCALE: f64 = 1.0 / (1u64 << 32) as f64;

/// `n` cells of equal area, as square as `n` allows: rows from top to bottom, the last ones with fewer and wider cells.
fn cells(n: u32) -> Vec<Cell> {
    let n_rows = (1..=n).find(|rows| u64::from(*rows) * u64::from(*rows) >= u64::from(n)).unwrap_or(1);
    let n_rows = if n.is_multiple_of(n_rows) { n_rows } else { n.div_ceil(n_rows) };
    let (base, longer) = (n / n_rows, n % n_rows);
    let mut cells = Vec::with_capacity(n as usize);
    let mut above = 0;
    for row in 0..n_rows {
        let n_columns = base + u32::from(row < longer);
        let (y, height) = (f64::from(above) / f64::from(n), f64::from(n_columns) / f64::from(n));
        let width = 1.0 / f64::from(n_columns);
        cells.extend((0..n_columns).map(|column| Cell { x: f64::from(column) * width, y, width, height }));
        above += n_columns;
    }
    cells
}

/// The output function of SplitMix64 (Steele, Lea and Flood, OOPSLA 2014): every input bit changes every output bit.
#[inline]
fn mix(x: u64) -> u64 {
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
    fn four_grid_samples_are_the_originals() {
        let cells = cells(4);
        let centers: Vec<_> = cells.iter().map(|c| (c.x + 0.5 * c.width, c.y + 0.5 * c.height)).collect();
        assert_eq!(centers, [(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)]);
    }

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

    #[test]
    fn cells_of_any_number_tile_the_pixel_with_equal_areas() {
        for n in 1..200 {
            let cells = cells(n);
            assert_eq!(cells.len(), n as usize);
            let share = 1.0 / f64::from(n);
            for cell in &cells {
                assert!((cell.width * cell.height - share).abs() < 1e-15, "{n}: {cell:?}");
                assert!(cell.x + cell.width <= 1.0 + 1e-15 && cell.y + cell.height <= 1.0 + 1e-15);
            }
            let aspect = cells[0].width / cells[0].height;
            assert!(n < 3 || (0.3..3.5).contains(&aspect), "{n}: {aspect}");
        }
    }
}
