//! How much two images differ.
//!
//! The difference of two samples is the size of a − b in f64. Two equal values differ by 0, infinities of one sign and −0
//! and 0 included; NaN differs from NaN by 0 and from anything else by infinity, so that a NaN never hides an error and
//! never raises one where both images agree.

use serde::Serialize;

use super::flip::flip;
use super::pixels::{Pixels, Referred};
use super::ssim::ssim;
use crate::error::{Error, Place, Problem};
use crate::film::{Film, ImageFile, Plane, Samples};

/// The levels that the original's proof allows a byte to be off.
pub const SMALL_LEVELS: u8 = 8;

/// What is added to the squared reference that a squared error is divided by, so that black can be divided by: what is darker than a
/// tenth of white is judged by its error itself. The value of F. Rousselle, C. Knaus, M. Zwicker, "Adaptive Sampling and
/// Reconstruction using Greedy Error Minimization", SIGGRAPH Asia 2011.
pub const RELMSE_FLOOR: f64 = 0.01;

/// How much image `a` differs from image `b` in red, green and blue, scene-linear.
///
/// As JSON, a number that is infinite becomes `null`, since JSON has no infinity.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Difference {
    /// Width of the compared pixels.
    pub width: u32,
    /// Height of the compared pixels.
    pub height: u32,
    /// Pixels with any channel that differs at all.
    pub differing: u64,
    /// The same in percent of all pixels.
    pub differing_percent: f64,
    /// Pixels that differ by infinity: NaN or an infinity on one side only.
    pub infinite: u64,
    /// Largest difference of a channel.
    pub max: f64,
    /// Mean difference over all channels of all pixels.
    pub mae: f64,
    /// Root of the mean squared difference over all channels of all pixels.
    pub rmse: f64,
    /// Mean over all channels of all pixels of (a − b)²/(b² + [`RELMSE_FLOOR`]); infinite where a difference is.
    pub relmse: f64,
    /// Peak signal to noise ratio in decibels, 20·log₁₀(1 / rmse), the peak being 1; infinite for equal images.
    pub psnr: f64,
    /// 99.9 % of pixels have no channel that differs by more (nearest rank: the smallest such value).
    pub p999: f64,
    /// Mean FLIP error, 0 for equal images, 1 at worst: [`flip`].
    pub flip: f64,
    /// Mean structural similarity, 1 for equal images, −1 at worst: [`ssim`].
    pub ssim: f64,
    /// The same images byte by byte, when both were 8-bit files.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub levels: Option<LevelDifference>,
}

/// How much two 8-bit files differ in the bytes they store. A pixel's difference is that of its worst channel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct LevelDifference {
    /// Pixels with any byte that differs.
    pub differing: u64,
    /// Pixels that differ by more than [`SMALL_LEVELS`].
    pub more_than_8: u64,
    /// Largest difference.
    pub max: u8,
}

/// Compares red, green and blue of two films of radiance; an image of `Y` alone counts as grey. Planes of other names are
/// ignored.
///
/// # Errors
/// Films without colour, of different sizes, or of one size showing different parts of an image.
pub fn compare(a: &Film, b: &Film) -> Result<Difference, Error> {
    compare_as(a, b, Referred::Scene)
}

/// Compares two films whose values are radiance or what a screen shows, which matters to [`flip`] and [`ssim`] alone.
///
/// # Errors
/// As [`compare`].
pub fn compare_as(a: &Film, b: &Film, referred: Referred) -> Result<Difference, Error> {
    let (planes_a, planes_b) = comparable(a, b)?;
    let n_pixels = a.n_pixels();
    let (mut sum, mut sum_of_squares, mut sum_of_relative_squares) = (0.0, 0.0, 0.0);
    let mut per_pixel = Vec::with_capacity(n_pixels);
    for index in 0..n_pixels {
        let mut worst = 0.0_f64;
        for (a, b) in planes_a.iter().zip(&planes_b) {
            let reference = b.samples.get(index);
            let difference = difference_of(a.samples.get(index), reference);
            sum += difference;
            sum_of_squares += difference * difference;
            sum_of_relative_squares += relative_square(difference, reference);
            worst = worst.max(difference);
        }
        per_pixel.push(worst);
    }
    let n_samples = n_pixels as f64 * 3.0;
    let rmse = (sum_of_squares / n_samples).sqrt();
    let count = |is_counted: fn(&f64) -> bool| per_pixel.iter().filter(|&value| is_counted(value)).count() as u64;
    let differing = count(|&difference| difference > 0.0);
    let infinite = count(|difference| difference.is_infinite());
    let max = per_pixel.iter().copied().fold(0.0, f64::max);
    // Nearest rank: the ⌈0.999 n⌉-th of n sorted values, in integers.
    let rank = (n_pixels * 999).div_ceil(1000).max(1);
    let (_, &mut p999, _) = per_pixel.select_nth_unstable_by(rank - 1, f64::total_cmp);
    let pixels = Pixels::new(a.data_window.width_px(), referred, &planes_a, &planes_b);
    Ok(Difference {
        width: a.data_window.width_px(),
        height: a.data_window.height_px(),
        differing,
        differing_percent: 100.0 * differing as f64 / n_pixels as f64,
        infinite,
        max,
        mae: sum / n_samples,
        rmse,
        relmse: sum_of_relative_squares / n_samples,
        psnr: -20.0 * libm::log10(rmse),
        p999,
        flip: flip(&pixels).mean,
        ssim: ssim(&pixels),
        levels: None,
    })
}

/// Compares two image files: their films, and their bytes too when both are 8-bit. A picture among them makes both be seen as
/// pictures ([`referred_of`]).
///
/// # Errors
/// As [`compare`].
pub fn compare_files(a: &ImageFile, b: &ImageFile) -> Result<Difference, Error> {
    let difference = compare_as(&a.film, &b.film, referred_of(a, b))?;
    let levels = match (&a.rgb8, &b.rgb8) {
        (Some(a), Some(b)) => Some(compare_levels(a, b)),
        _ => None,
    };
    Ok(Difference { levels, ..difference })
}

/// What the values of two files say: those of a PNG what a screen shows, and then the other's are clipped as a screen would.
pub fn referred_of(a: &ImageFile, b: &ImageFile) -> Referred {
    if a.is_picture || b.is_picture { Referred::Display } else { Referred::Scene }
}

/// Compares pixels byte by byte; both slices have the same length.
pub fn compare_levels(a: &[[u8; 3]], b: &[[u8; 3]]) -> LevelDifference {
    assert_eq!(a.len(), b.len(), "images of one size");
    a.iter().zip(b).fold(LevelDifference::default(), |total, (a, b)| {
        let worst = a.iter().zip(b).map(|(&a, &b)| a.abs_diff(b)).max().unwrap_or(0);
        LevelDifference {
            differing: total.differing + u64::from(worst > 0),
            more_than_8: total.more_than_8 + u64::from(worst > SMALL_LEVELS),
            max: total.max.max(worst),
        }
    })
}

/// The difference of two films as a film of `R`, `G`, `B`, over the same windows as `a`; never negative.
///
/// # Errors
/// As [`compare`].
pub fn difference_image(a: &Film, b: &Film) -> Result<Film, Error> {
    let (planes_a, planes_b) = comparable(a, b)?;
    let plane_of = |name: &str, a: &Plane, b: &Plane| {
        let differences = (0..a.samples.len()).map(|at| difference_of(a.samples.get(at), b.samples.get(at)) as f32);
        Plane::color(name, Samples::F32(differences.collect()))
    };
    let planes = (0..3).map(|channel| plane_of(["R", "G", "B"][channel], planes_a[channel], planes_b[channel]));
    Ok(Film { width_px: a.width_px, height_px: a.height_px, data_window: a.data_window, planes: planes.collect() })
}

/// A squared difference in shares of the reference's square.
fn relative_square(difference: f64, reference: f64) -> f64 {
    if difference == 0.0 || difference.is_infinite() {
        difference
    } else {
        // Not a sum of squares, which could overflow.
        let share = difference / libm::hypot(reference, RELMSE_FLOOR.sqrt());
        share * share
    }
}

/// The pixels of two films that show the same ones.
///
/// # Errors
/// As [`compare`].
pub fn pixels_of(a: &Film, b: &Film, referred: Referred) -> Result<Pixels, Error> {
    let (planes_a, planes_b) = comparable(a, b)?;
    Ok(Pixels::new(a.data_window.width_px(), referred, &planes_a, &planes_b))
}

fn difference_of(a: f64, b: f64) -> f64 {
    if a == b || (a.is_nan() && b.is_nan()) {
        0.0
    } else if a.is_nan() || b.is_nan() {
        f64::INFINITY
    } else {
        (a - b).abs()
    }
}

/// The colour planes of two films that show the same pixels.
pub(super) fn comparable<'a>(a: &'a Film, b: &'a Film) -> Result<([&'a Plane; 3], [&'a Plane; 3]), Error> {
    let wrong = |what: String| Error::new(Place::default(), what);
    for (film, which) in [(a, "first"), (b, "second")] {
        film.check().map_err(|broken| wrong(format!("the {which} image cannot be compared: {broken}")))?;
    }
    let size = |film: &Film| (film.data_window.width_px(), film.data_window.height_px());
    // A file without windows (PNG, PFM) is the picture itself; two parts of one image must be the same part.
    let same_display = (a.width_px, a.height_px) == (b.width_px, b.height_px);
    if size(a) != size(b) || (same_display && a.data_window != b.data_window) {
        let problem = Problem::new(Place::default(), "images of different sizes or parts cannot be compared");
        return Err(problem.found(format!("{} and {}", describe_window(a), describe_window(b))).into());
    }
    match (a.color_planes(), b.color_planes()) {
        (Some(a), Some(b)) => Ok((a, b)),
        (None, _) => Err(wrong("the first image has no planes R, G and B, or Y".to_string())),
        (_, None) => Err(wrong("the second image has no planes R, G and B, or Y".to_string())),
    }
}

fn describe_window(film: &Film) -> String {
    let window = film.data_window;
    let (width, height) = (window.width_px(), window.height_px());
    if (width, height) == (film.width_px, film.height_px) {
        format!("{width}×{height}")
    } else {
        format!("{width}×{height} at {},{} of {}×{}", window.x0, window.y0, film.width_px, film.height_px)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::Region;

    fn film(width_px: u32, rgb: [Vec<f64>; 3]) -> Film {
        let height_px = rgb[0].len() as u32 / width_px;
        let planes = ["R", "G", "B"].iter().zip(rgb);
        Film {
            width_px,
            height_px,
            data_window: Region::whole(width_px, height_px),
            planes: planes.map(|(name, v)| Plane::color(*name, Samples::F64(v))).collect(),
        }
    }

    fn grey(values: &[f64]) -> Film {
        film(values.len() as u32, [values.to_vec(), values.to_vec(), values.to_vec()])
    }

    #[test]
    fn equal_images_differ_by_nothing() {
        let image = grey(&[0.0, 1.0, f64::NAN, f64::INFINITY, -2.0]);
        let difference = compare(&image, &image).unwrap();
        assert_eq!((difference.differing, difference.max, difference.mae, difference.rmse), (0, 0.0, 0.0, 0.0));
        assert_eq!((difference.p999, difference.infinite, difference.relmse), (0.0, 0, 0.0));
        assert_eq!((difference.flip, difference.ssim), (0.0, 1.0));
        assert_eq!(difference.psnr, f64::INFINITY);
        assert!(serde_json::to_string(&difference).unwrap().contains(r#""psnr":null"#));
        assert_eq!(compare(&grey(&[-0.0]), &grey(&[0.0])).unwrap().differing, 0);
    }

    #[test]
    fn the_figures_of_a_small_image_are_those_worked_out_by_hand() {
        let a = film(2, [vec![0.5, 0.25], vec![0.0, 0.0], vec![1.0, 1.0]]);
        let b = film(2, [vec![0.0, 0.25], vec![0.25, 0.0], vec![1.0, 1.0]]);
        let difference = compare(&a, &b).unwrap();
        assert_eq!((difference.width, difference.height), (2, 1));
        assert_eq!((difference.differing, difference.differing_percent), (1, 50.0));
        assert_eq!((difference.max, difference.mae), (0.5, 0.125));
        let mean_square: f64 = (0.25 + 0.0625) / 6.0;
        assert_eq!(difference.rmse, mean_square.sqrt());
        assert!((difference.psnr - 10.0 * (1.0 / mean_square).log10()).abs() < 1e-12);
        assert_eq!(difference.p999, 0.5);
        // ½² over a black reference and ¼² over ¼², each with 0.01 added.
        let relative = (0.25 / 0.01 + 0.0625 / (0.0625 + 0.01)) / 6.0;
        assert!((difference.relmse - relative).abs() < 1e-12);
    }

    #[test]
    fn one_pixel_in_a_thousand_is_beyond_the_percentile_and_two_are_not() {
        let black = grey(&[0.0; 1000]);
        let mut values = [0.0; 1000];
        values[7] = 1.0;
        assert_eq!(compare(&black, &grey(&values)).unwrap().p999, 0.0);
        values[8] = 0.5;
        assert_eq!(compare(&black, &grey(&values)).unwrap().p999, 0.5);
    }

    #[test]
    fn a_nan_or_an_infinity_on_one_side_is_an_infinite_difference() {
        for (a, b) in [(f64::NAN, 0.0), (0.0, f64::NAN), (f64::INFINITY, f64::NEG_INFINITY), (f64::INFINITY, 3.0)] {
            let difference = compare(&grey(&[a, 0.0]), &grey(&[b, 0.0])).unwrap();
            assert_eq!((difference.differing, difference.infinite), (1, 1), "{a} {b}");
            assert_eq!((difference.max, difference.rmse), (f64::INFINITY, f64::INFINITY));
            assert_eq!((difference.relmse, difference.flip, difference.ssim), (f64::INFINITY, 0.5, 0.5));
            assert_eq!(difference.psnr, f64::NEG_INFINITY);
        }
    }

    #[test]
    fn different_sizes_are_refused_naming_both() {
        let error = compare(&grey(&[0.0; 3]), &grey(&[0.0; 4])).unwrap_err().to_string();
        assert!(error.contains("3×1 and 4×1"), "{error}");
    }

    #[test]
    fn different_parts_of_one_image_are_refused_and_a_part_equals_its_own_picture() {
        let part = |x0: u32| Film {
            width_px: 9,
            height_px: 9,
            data_window: Region { x0, y0: 2, x1: x0 + 2, y1: 3 },
            ..grey(&[0.5; 2])
        };
        let error = compare(&part(1), &part(2)).unwrap_err().to_string();
        assert!(error.contains("2×1 at 1,2 of 9×9 and 2×1 at 2,2 of 9×9"), "{error}");
        assert_eq!(compare(&part(1), &grey(&[0.5; 2])).unwrap().differing, 0);
    }

    #[test]
    fn a_grey_image_compares_with_a_coloured_one() {
        let mut y = grey(&[0.5; 2]);
        y.planes.truncate(1);
        y.planes[0].name = "Y".to_string();
        assert_eq!(compare(&y, &grey(&[0.5; 2])).unwrap().differing, 0);
        y.planes[0].name = "Z".to_string();
        assert!(compare(&grey(&[0.5; 2]), &y).unwrap_err().to_string().contains("second image"));
    }

    #[test]
    fn bytes_are_counted_by_their_worst_channel() {
        let a = [[0, 0, 0], [10, 10, 10], [255, 0, 9], [1, 2, 3]];
        let b = [[0, 0, 8], [10, 19, 10], [0, 0, 9], [1, 2, 3]];
        assert_eq!(compare_levels(&a, &b), LevelDifference { differing: 3, more_than_8: 2, max: 255 });
    }

    #[test]
    fn the_difference_image_holds_sizes_of_differences() {
        let a = film(1, [vec![0.5], vec![0.0], vec![f64::NAN]]);
        let b = film(1, [vec![1.0], vec![0.0], vec![0.0]]);
        let image = difference_image(&a, &b).unwrap();
        let values: Vec<f64> = image.planes.iter().map(|plane| plane.samples.get(0)).collect();
        assert_eq!(values, [0.5, 0.0, f64::INFINITY]);
    }
}
