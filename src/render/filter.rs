//! Pixel filters, sampled by their importance: a sample of the unit square is moved to where the filter wants it, so that
//! every sample weighs the same and belongs to one pixel (Ernst, Stamminger and Greiner, *Filter Importance Sampling*, IEEE
//! Symposium on Interactive Ray Tracing 2006).
//!
//! A filter is the product of one density in x and the same in y, around the pixel's centre. Along each axis a number u in
//! 0 … 1 goes through the inverse of the distribution. Both tails are alike, and are looked up by s = √(2·min(u, 1 − u)):
//! the flatter a density ends, the steeper its inverse rises there, and the root takes that out. For the triangle, what
//! is left is a straight line; for the others it is smooth enough for a table.

use std::f64::consts::PI;
use std::sync::LazyLock;

/// How samples around a pixel's centre are weighted, by their density. None has negative lobes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Filter {
    /// The pixel itself.
    #[default]
    Box,
    /// A tent of radius 1.
    Triangle,
    /// A Gaussian of σ = 0.5, cut at 1.5.
    Gaussian,
    /// The four-term Blackman–Harris window of radius 1.5: Harris, *On the Use of Windows for Harmonic Analysis with the
    /// Discrete Fourier Transform*, Proceedings of the IEEE 66 (1), 1978, table 1 (−92 dB).
    BlackmanHarris,
}

const GAUSSIAN_SIGMA_PX: f64 = 0.5;
const GAUSSIAN_RADIUS_PX: f64 = 1.5;
const BLACKMAN_HARRIS_RADIUS_PX: f64 = 1.5;
const BLACKMAN_HARRIS: [f64; 4] = [0.358_75, 0.488_29, 0.141_28, 0.011_68];

/// A filter other than the box, made ready for many samples.
#[derive(Clone, Copy, Debug)]
pub(super) enum Warp {
    Triangle,
    Table(&'static [f64]),
}

static GAUSSIAN: LazyLock<Vec<f64>> = LazyLock::new(|| tabulate(GAUSSIAN_RADIUS_PX, gaussian_tail));
static BLACKMAN_HARRIS_TABLE: LazyLock<Vec<f64>> =
    LazyLock::new(|| tabulate(BLACKMAN_HARRIS_RADIUS_PX, blackman_harris_tail));

impl Filter {
    /// How far from a pixel's centre samples may lie, along each axis.
    pub fn radius_px(self) -> f64 {
        match self {
            Filter::Box => 0.5,
            Filter::Triangle => 1.0,
            Filter::Gaussian => GAUSSIAN_RADIUS_PX,
            Filter::BlackmanHarris => BLACKMAN_HARRIS_RADIUS_PX,
        }
    }

    /// What moves samples; the box leaves them where they are.
    pub(super) fn warp(self) -> Option<Warp> {
        match self {
            Filter::Box => None,
            Filter::Triangle => Some(Warp::Triangle),
            Filter::Gaussian => Some(Warp::Table(&GAUSSIAN)),
            Filter::BlackmanHarris => Some(Warp::Table(&BLACKMAN_HARRIS_TABLE)),
        }
    }
}

impl Warp {
    /// A position in the unit square to one around its centre. Out of line, so that the box has nothing but a branch in its
    /// loop.
    #[inline(never)]
    pub(super) fn position(&self, (u, v): (f64, f64)) -> (f64, f64) {
        match self {
            Warp::Triangle => (mirrored(u, |s| 1.0 - s), mirrored(v, |s| 1.0 - s)),
            Warp::Table(offsets) => (mirrored(u, |s| between(offsets, s)), mirrored(v, |s| between(offsets, s))),
        }
    }
}

/// The position of u along an axis; `offset` is how far from the centre the place √(2·tail) is.
#[inline]
fn mirrored(u: f64, offset: impl Fn(f64) -> f64) -> f64 {
    // Cells end at 1, but for rounding.
    let s = (2.0 * u.min(1.0 - u).max(0.0)).sqrt();
    0.5 + offset(s).copysign(u - 0.5)
}

/// Cells of a table.
const N_CELLS: usize = 1024;

#[inline]
fn between(offsets: &[f64], s: f64) -> f64 {
    let place = s * N_CELLS as f64;
    let cell = (place as usize).min(N_CELLS - 1);
    let fraction = place - cell as f64;
    offsets[cell] + (offsets[cell + 1] - offsets[cell]) * fraction
}

/// Offsets at equal steps of s from 0, where they are the radius, to 1, where they are 0. `tail` is the share of the
/// density beyond an offset: ½ at 0, falling to 0 at the radius. Between its nodes the table is off by less than 2e-7 of the
/// distribution.
fn tabulate(radius_px: f64, tail: fn(f64) -> f64) -> Vec<f64> {
    let mut offsets: Vec<f64> = (0..=N_CELLS)
        .map(|node| {
            let s = node as f64 / N_CELLS as f64;
            let (mut near, mut far) = (0.0, radius_px);
            // Halved until the ends are neighbours, or nearly so.
            for _ in 0..f64::MANTISSA_DIGITS {
                let middle = 0.5 * (near + far);
                if tail(middle) > 0.5 * s * s { near = middle } else { far = middle }
            }
            far
        })
        .collect();
    offsets[0] = radius_px;
    offsets[N_CELLS] = 0.0;
    offsets
}

fn gaussian_tail(offset_px: f64) -> f64 {
    let scale = GAUSSIAN_SIGMA_PX * std::f64::consts::SQRT_2;
    let whole = libm::erf(GAUSSIAN_RADIUS_PX / scale);
    0.5 * (whole - libm::erf(offset_px / scale)) / whole
}

/// The window is Σ aₖ cos(kπx/r), its integral a sum of sines.
fn blackman_harris_tail(offset_px: f64) -> f64 {
    let x = offset_px / BLACKMAN_HARRIS_RADIUS_PX;
    let [a0, a1, a2, a3] = BLACKMAN_HARRIS;
    let sines = [a1, a2 / 2.0, a3 / 3.0].into_iter().zip([1.0, 2.0, 3.0]);
    let waves: f64 = sines.map(|(a, k)| a * libm::sin(k * PI * x)).sum();
    0.5 * (1.0 - x - waves / (PI * a0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The density itself, up to a factor, so that integrating it is another way to the distribution.
    fn density(filter: Filter, x: f64) -> f64 {
        match filter {
            Filter::Box => 1.0,
            Filter::Triangle => 1.0 - x.abs(),
            Filter::Gaussian => libm::exp(-0.5 * (x / 0.5) * (x / 0.5)),
            Filter::BlackmanHarris => {
                let angle = PI * x / 1.5;
                0.35875
                    + 0.48829 * libm::cos(angle)
                    + 0.14128 * libm::cos(2.0 * angle)
                    + 0.01168 * libm::cos(3.0 * angle)
            }
        }
    }

    const N_PANELS: usize = 60_000;

    /// The distribution at the ends of equal panels from −radius to radius, by Simpson's rule.
    fn distribution(filter: Filter) -> Vec<f64> {
        let radius = filter.radius_px();
        let width = 2.0 * radius / N_PANELS as f64;
        let mut sums = vec![0.0];
        for panel in 0..N_PANELS {
            let x = -radius + panel as f64 * width;
            let panel = density(filter, x) + 4.0 * density(filter, x + 0.5 * width) + density(filter, x + width);
            sums.push(sums[sums.len() - 1] + panel);
        }
        let whole = sums[N_PANELS];
        sums.iter().map(|sum| sum / whole).collect()
    }

    /// The distribution at an offset, by a chord between panels.
    fn at(distribution: &[f64], radius: f64, offset: f64) -> f64 {
        let place = (offset + radius) / (2.0 * radius) * N_PANELS as f64;
        let panel = (place as usize).min(N_PANELS - 1);
        distribution[panel] + (distribution[panel + 1] - distribution[panel]) * (place - panel as f64)
    }

    const WARPED: [Filter; 3] = [Filter::Triangle, Filter::Gaussian, Filter::BlackmanHarris];

    #[test]
    fn warped_numbers_have_the_distribution_of_the_filter() {
        for filter in WARPED {
            let (warp, distribution, radius) = (filter.warp().unwrap(), distribution(filter), filter.radius_px());
            let (mut before, mut worst) = (-radius, 0.0_f64);
            for step in 0..=300_000 {
                let u = f64::from(step) / 300_000.0;
                let offset = warp.position((u, 0.5)).0 - 0.5;
                assert!(offset.abs() <= radius && offset >= before, "{filter:?} at {u}: {offset} after {before}");
                let error = (at(&distribution, radius, offset) - u).abs();
                worst = worst.max(error);
                before = offset;
            }
            assert!(worst < 2e-7, "{filter:?} is off by {worst:e}");
        }
    }

    #[test]
    fn warps_are_even_around_the_centre_and_alike_on_both_axes() {
        for filter in WARPED {
            let warp = filter.warp().unwrap();
            assert_eq!(warp.position((0.5, 0.5)), (0.5, 0.5), "{filter:?}");
            assert_eq!(warp.position((0.0, 1.0)), (0.5 - filter.radius_px(), 0.5 + filter.radius_px()));
            // Rounding may leave a cell a little outside.
            assert_eq!(warp.position((1.0 + 1e-15, 0.5)).0, 0.5 + filter.radius_px());
            for step in 1..64 {
                let u = f64::from(step) / 64.0;
                let (x, y) = warp.position((u, 1.0 - u));
                assert!((x - 0.5 + (y - 0.5)).abs() <= 2.0 * f64::EPSILON, "{filter:?} at {u}: {x} {y}");
            }
        }
    }

    #[test]
    fn the_triangle_is_its_closed_form() {
        // A quarter of the tent lies below −1 + 1/√2.
        let (x, y) = Filter::Triangle.warp().unwrap().position((0.25, 0.875));
        assert!((x - 0.5 - (-1.0 + 0.5_f64.sqrt())).abs() <= 4.0 * f64::EPSILON, "{x}");
        assert!((y - 1.0).abs() <= 4.0 * f64::EPSILON, "{y}");
    }

    #[test]
    fn tails_are_what_tables_of_the_normal_distribution_say() {
        // Φ(1) = 0.841 344 746 and Φ(3) = 0.998 650 102.
        let expected = (0.998_650_102 - 0.841_344_746) / (2.0 * 0.998_650_102 - 1.0);
        assert!((gaussian_tail(0.5) - expected).abs() < 1e-8);
        assert_eq!((gaussian_tail(0.0), gaussian_tail(1.5)), (0.5, 0.0));
        assert!(blackman_harris_tail(1.5).abs() <= 4.0 * f64::EPSILON && blackman_harris_tail(0.0) == 0.5);
    }
}
