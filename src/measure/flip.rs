//! FLIP: how different two images look when one takes the other's place on a screen.
//!
//! P. Andersson, J. Nilsson, T. Akenine-Möller, M. Oskarsson, K. Åström, M. D. Fairchild, "FLIP: A Difference Evaluator for
//! Alternating Images", HPG 2020; for scene-referred images P. Andersson, J. Nilsson, P. Shirley, T. Akenine-Möller,
//! "Visualizing Errors in Rendered High Dynamic Range Images", Eurographics 2021 (short papers). The figures are those of the
//! authors' `flip-evaluator`, which compares them in the tests, at its default viewing conditions.
//!
//! | room | does |
//! |---|---|
//! | [`color`] | opponent colours, CIELAB with Hunt's adjustment, the colour error |
//! | [`kernel`] | the filters, separated into rows and columns |
//! | [`tile`] | all exposures of a tile of the image, with the margin that its filters need |

pub mod color;
pub mod kernel;
pub mod tile;

use rayon::prelude::*;

use color::{ColorError, aces_inverse, luminance};
use kernel::Kernels;
use tile::{HEIGHT_PX, Scratch, WIDTH_PX};

use super::pixels::{Pixels, Referred};

/// Pixels that one degree of the eye sees: 3840 pixels on 0.7 metres, seen from 0.7 metres.
pub const PIXELS_PER_DEGREE: f64 = 3840.0 * std::f64::consts::PI / 180.0;

/// Errors of pixels, row after row, each from 0, no difference to be seen, to 1, as black and white or blue and green are.
#[derive(Clone, Debug, PartialEq)]
pub struct FlipMap {
    /// The error of each pixel.
    pub errors: Vec<f32>,
    /// Their mean, the figure by which images are compared.
    pub mean: f64,
}

/// How much the first image of a pair seems different from the second, its reference.
///
/// Display-referred pixels are shown as they are, clipped to 0 … 1. Scene-referred ones are shown at exposures one stop apart, from
/// one that shows the reference's brightest pixel just below white to one that does so with its median; a pixel has the
/// largest of its errors. Only the reference decides the exposures. A pixel where one image alone is not finite has error 1.
///
/// It is the same for any number of threads.
pub fn flip(pixels: &Pixels) -> FlipMap {
    let exposures = match pixels.referred {
        Referred::Display => Exposures::AsIs,
        Referred::Scene => Exposures::Factors(exposure_factors(pixels)),
    };
    let kernels = Kernels::new(PIXELS_PER_DEGREE);
    let color_error = ColorError::new();
    let n_columns = pixels.width_px.div_ceil(WIDTH_PX);
    let n_tiles = n_columns * pixels.height_px.div_ceil(HEIGHT_PX);
    let corner_of = |tile: usize| [tile % n_columns * WIDTH_PX, tile / n_columns * HEIGHT_PX];

    let tiles: Vec<Vec<f32>> = (0..n_tiles)
        .into_par_iter()
        .map_init(
            || Scratch::new(&kernels),
            |scratch, tile| scratch.errors(pixels, &exposures, &kernels, &color_error, corner_of(tile)),
        )
        .collect();

    let mut errors = vec![0.0; pixels.n_pixels()];
    for (tile, tile_errors) in tiles.iter().enumerate() {
        let [x0, y0] = corner_of(tile);
        let width = WIDTH_PX.min(pixels.width_px - x0);
        for (row, y) in tile_errors.chunks_exact(WIDTH_PX).zip(y0..pixels.height_px) {
            let start = y * pixels.width_px + x0;
            errors[start..start + width].copy_from_slice(&row[..width]);
        }
    }
    for &index in &pixels.unlike {
        errors[index] = 1.0;
    }
    let mean = errors.iter().map(|&error| f64::from(error)).sum::<f64>() / errors.len() as f64;
    FlipMap { errors, mean }
}

/// How linear values become display values.
#[derive(Clone, Debug, PartialEq)]
pub enum Exposures {
    /// They are, in 0 … 1.
    AsIs,
    /// By these factors, then the tone curve.
    Factors(Vec<f32>),
}

/// The factors of HDR-FLIP's exposures, darkest first; section 3 of the paper.
fn exposure_factors(pixels: &Pixels) -> Vec<f32> {
    /// A median of zero would be exposed by infinity: `flip-evaluator` takes the machine epsilon of its numbers.
    const LEAST_LUMINANCE: f64 = f32::EPSILON as f64;
    /// The display value, short of white, that the brightest and the median luminance get.
    const SHOWN: f64 = 0.85;

    let [r, g, b] = &pixels.b;
    let mut luminances: Vec<f64> =
        (0..pixels.n_pixels()).map(|at| luminance([r, g, b].map(|channel| channel[at].max(0.0)))).collect();
    luminances.sort_unstable_by(f64::total_cmp);
    let n = luminances.len();
    let brightest = luminances[n - 1].max(LEAST_LUMINANCE);
    let median = (0.5 * (luminances[(n - 1) / 2] + luminances[n / 2])).max(LEAST_LUMINANCE);
    let shown = aces_inverse(SHOWN);
    let (start, stop) = (libm::log2(shown / brightest), libm::log2(shown / median));
    let n_exposures = (stop - start).ceil().max(2.0) as usize;
    let step = (stop - start) / (n_exposures - 1) as f64;
    (0..n_exposures).map(|index| libm::exp2(start + index as f64 * step) as f32).collect()
}

#[cfg(test)]
mod tests;
