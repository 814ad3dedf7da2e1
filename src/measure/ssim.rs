//! SSIM: how alike the structure of two images is.
//!
//! Z. Wang, A. C. Bovik, H. R. Sheikh, E. P. Simoncelli, "Image Quality Assessment: From Error Visibility to Structural
//! Similarity", IEEE Transactions on Image Processing 13 (2004), equation 13, with a Gaussian window of 11 × 11 pixels and
//! standard deviation 1.5, of each channel by itself. That is scikit-image's `structural_similarity` with `gaussian_weights=True`,
//! `sigma=1.5`, `use_sample_covariance=False`, `data_range=1`, `channel_axis=2`, which the tests compare it with.

use rayon::prelude::*;

use super::pixels::{Pixels, Referred};
use crate::film::tone_map::srgb_from_linear;

/// Standard deviation of the window in pixels.
const DEVIATION_PX: f64 = 1.5;
/// Pixels of the window to each side of its middle.
const RADIUS: usize = 5;
const WIDTH: usize = 2 * RADIUS + 1;
/// (0.01 L)² and (0.03 L)² of the paper for a range L of 1: what keeps dark and plain windows from dividing by nothing.
const MEAN_FLOOR: f64 = 0.01 * 0.01;
const VARIANCE_FLOOR: f64 = 0.03 * 0.03;
/// Rows that are filtered together.
const BAND_ROWS: usize = 32;

/// What is averaged over windows: a, b, a², b², ab.
const N_MOMENTS: usize = 5;

/// The mean similarity, 1 for equal images and −1 at worst.
///
/// Scene-referred values are taken as they are, display-referred ones by their sRGB levels in 0 … 1, as the files hold them.
/// Windows that reach beyond the image do not count, unless it is less than 11 pixels wide or high, where they see it
/// mirrored. A pixel where one image alone is not finite has similarity 0.
///
/// It is the same for any number of threads.
pub fn ssim(pixels: &Pixels) -> f64 {
    let levels = |channel: &[f32]| -> Vec<f64> {
        let level = |value: &f32| match pixels.referred {
            Referred::Scene => f64::from(*value),
            Referred::Display => srgb_from_linear(f64::from(*value)),
        };
        channel.par_iter().map(level).collect()
    };
    let channels = pixels.a.iter().zip(&pixels.b);
    let sum: f64 = channels.map(|(a, b)| channel_mean(pixels, &levels(a), &levels(b))).sum();
    sum / 3.0
}

fn channel_mean(pixels: &Pixels, a: &[f64], b: &[f64]) -> f64 {
    let weights = window();
    let margin = |length: usize| if length < WIDTH { 0 } else { RADIUS };
    let columns = margin(pixels.width_px)..pixels.width_px - margin(pixels.width_px);
    let rows = margin(pixels.height_px)..pixels.height_px - margin(pixels.height_px);
    let bands: Vec<usize> = rows.clone().step_by(BAND_ROWS).collect();
    let of_rows: Vec<f64> = bands
        .into_par_iter()
        .flat_map_iter(|first| {
            let band = first..(first + BAND_ROWS).min(rows.end);
            let moments = along_rows(pixels, a, b, &weights, band.clone());
            let (columns, weights) = (columns.clone(), &weights);
            band.map(move |y| {
                let similarity = |x: usize| match pixels.unlike.binary_search(&(y * pixels.width_px + x)) {
                    Ok(_) => 0.0,
                    Err(_) => similarity(moments.each_ref().map(|moment| {
                        let place = |offset: usize| (y - first + offset) * pixels.width_px + x;
                        (0..WIDTH).map(|offset| weights[offset] * moment[place(offset)]).sum()
                    })),
                };
                columns.clone().map(similarity).sum::<f64>()
            })
        })
        .collect();
    of_rows.iter().sum::<f64>() / (columns.len() * rows.len()) as f64
}

/// Each moment averaged along the rows of a band and those that its windows reach above and below, whole rows one after
/// another.
fn along_rows(
    pixels: &Pixels,
    a: &[f64],
    b: &[f64],
    weights: &[f64; WIDTH],
    band: std::ops::Range<usize>,
) -> [Vec<f64>; N_MOMENTS] {
    let width = pixels.width_px;
    let n_rows = band.len() + 2 * RADIUS;
    let mut moments: [Vec<f64>; N_MOMENTS] = std::array::from_fn(|_| vec![0.0; n_rows * width]);
    let columns: Vec<usize> = (0..width + 2 * RADIUS).map(|x| mirrored(x, width)).collect();
    let mut products: [Vec<f64>; N_MOMENTS] = std::array::from_fn(|_| vec![0.0; columns.len()]);
    for row in 0..n_rows {
        let start = mirrored(band.start + row, pixels.height_px) * width;
        for (at, &x) in columns.iter().enumerate() {
            let (a, b) = (a[start + x], b[start + x]);
            for (products, product) in products.iter_mut().zip([a, b, a * a, b * b, a * b]) {
                products[at] = product;
            }
        }
        for (products, moment) in products.iter().zip(&mut moments) {
            let out = &mut moment[row * width..(row + 1) * width];
            for (offset, &weight) in weights.iter().enumerate() {
                for (out, product) in out.iter_mut().zip(&products[offset..]) {
                    *out += weight * product;
                }
            }
        }
    }
    moments
}

/// The place in a row that stands [`RADIUS`] before `at`; beyond the ends the row goes on as its mirror image.
fn mirrored(at: usize, length: usize) -> usize {
    let turn = 2 * length;
    let place = (at + turn * RADIUS - RADIUS) % turn;
    if place < length { place } else { turn - 1 - place }
}

fn window() -> [f64; WIDTH] {
    let weights: [f64; WIDTH] = std::array::from_fn(|index| {
        let distance = (index as f64 - RADIUS as f64) / DEVIATION_PX;
        libm::exp(-0.5 * distance * distance)
    });
    let sum: f64 = weights.iter().sum();
    weights.map(|weight| weight / sum)
}

/// The similarity of two windows by their averages.
fn similarity([a, b, aa, bb, ab]: [f64; N_MOMENTS]) -> f64 {
    // Rounding can break what holds of all numbers: no variance is below zero, no covariance above their mean.
    let (variance_a, variance_b) = ((aa - a * a).max(0.0), (bb - b * b).max(0.0));
    let largest = (variance_a * variance_b).sqrt();
    let covariance = (ab - a * b).clamp(-largest, largest);
    let means = (2.0 * a * b + MEAN_FLOOR) / (a * a + b * b + MEAN_FLOOR);
    let structures = (2.0 * covariance + VARIANCE_FLOOR) / (variance_a + variance_b + VARIANCE_FLOOR);
    means * structures
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::{Plane, Samples};

    fn ssim_of(width: u32, referred: Referred, a: &[f32], b: &[f32]) -> f64 {
        let [a, b] = [a, b].map(|values| Plane::color("Y", Samples::F32(values.to_vec())));
        ssim(&Pixels::new(width, referred, &[&a; 3], &[&b; 3]))
    }

    #[test]
    fn equal_images_have_similarity_one_even_huge_ones() {
        for scale in [1.0, 1e-20, 1e12, 1e38] {
            let values: Vec<f32> = (0..400).map(|at| (at * 7919 % 97) as f32 * scale / 97.0).collect();
            assert_eq!(ssim_of(20, Referred::Scene, &values, &values), 1.0, "{scale}");
        }
    }

    #[test]
    fn plain_images_differ_by_their_means_alone() {
        // No variance: (2ab + C)/(a² + b² + C) with C = 1e-4.
        let expected = (2.0 * 0.25 * 0.75 + 1e-4) / (0.25 * 0.25 + 0.75 * 0.75 + 1e-4);
        for (width, n) in [(16, 256), (3, 6), (1, 1)] {
            let found = ssim_of(width, Referred::Scene, &vec![0.25; n], &vec![0.75; n]);
            assert!((found - expected).abs() < 1e-12, "{found} {expected}");
        }
        // The sRGB levels of the same: 0.5370987 and 0.8808250.
        let (a, b) = (0.537_098_7, 0.880_825_0);
        let expected = (2.0 * a * b + 1e-4) / (a * a + b * b + 1e-4);
        let found = ssim_of(16, Referred::Display, &[0.25; 256], &[0.75; 256]);
        assert!((found - expected).abs() < 1e-6, "{found} {expected}");
    }

    #[test]
    fn a_checkerboard_and_its_negative_are_as_unlike_as_can_be() {
        let checker =
            |phase: usize| -> Vec<f32> { (0..24 * 24).map(|at| ((at / 24 + at + phase) % 2) as f32).collect() };
        let found = ssim_of(24, Referred::Scene, &checker(0), &checker(1));
        // Means near ½, variances near ¼, covariance near −¼: (−½ + 9e-4)/(½ + 9e-4). The window is not exactly even.
        assert!((found + 0.9964).abs() < 1e-3, "{found}");
    }

    #[test]
    fn a_pixel_that_is_no_number_on_one_side_counts_as_unlike() {
        let mut broken = vec![0.5; 400];
        broken[210] = f32::NAN;
        let found = ssim_of(20, Referred::Scene, &broken, &[0.5; 400]);
        // 100 windows count, in one of them the pixel is the middle; both images have a hole there, the others are equal.
        assert!((found - 0.99).abs() < 1e-12, "{found}");
    }

    #[test]
    fn rows_go_on_as_their_mirror_images() {
        let places: Vec<usize> = (0..13).map(|at| mirrored(at, 3)).collect();
        assert_eq!(places, [1, 2, 2, 1, 0, 0, 1, 2, 2, 1, 0, 0, 1]);
        assert!((0..11).all(|at| mirrored(at, 1) == 0));
    }
}
