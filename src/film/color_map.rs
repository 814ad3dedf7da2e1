//! Colours for numbers: a sequential map and a diverging one, both perceptually uniform.
//!
//! Equal steps of the number are equal steps of colour in OKLab (B. Ottosson, "A perceptual color space for image
//! processing", 2020) with its lightness estimate L_r ("Okhsv and Okhsl", 2021), which tells dark colours apart as the
//! eye does. The maps are curves in that space walked at even speed.

use std::sync::LazyLock;

use crate::film::tone_map::{quantize8, srgb_from_linear};

/// Colours of a table. Neighbours differ by about one level of a byte.
const N_COLORS: usize = 256;

/// Lightness L_r and the two opponent axes a (green to red) and b (blue to yellow).
type OkLab = [f64; 3];

/// From black over dark red and rose to cream, lightness rising throughout: the control points of a cubic Bézier curve.
/// They were searched for the most even steps in another uniform space, CAM02-UCS, where the largest of 63 is 1.25 times the
/// smallest.
const SEQUENTIAL: [OkLab; 4] = [[0.0, 0.0, 0.0], [0.42, -0.003, 0.01], [0.30, 0.348, 0.093], [0.97, -0.016, 0.058]];

/// Straight lines from blue to white to red; both ends are equally light and equally colourful (0.18 at 262° and 27°).
const DIVERGING: [OkLab; 3] = [[0.40, -0.025, -0.178], [1.0, 0.0, 0.0], [0.40, 0.160, 0.082]];

static SEQUENTIAL_COLORS: LazyLock<Vec<[u8; 3]>> = LazyLock::new(|| {
    let points = even_points(|t| bezier(&SEQUENTIAL, t), N_COLORS);
    points.into_iter().map(srgb8).collect()
});

static DIVERGING_COLORS: LazyLock<Vec<[u8; 3]>> = LazyLock::new(|| {
    let [negative, zero, positive] = DIVERGING;
    // The middle has a colour of its own.
    let half = N_COLORS / 2;
    let step = |index: usize| index as f64 / half as f64;
    let below = (0..half).map(|index| mix(negative, zero, step(index)));
    let above = (0..=half).map(|index| mix(zero, positive, step(index)));
    below.chain(above).map(srgb8).collect()
});

/// The sRGB bytes of a number in 0 … 1, dark to light. Numbers outside are clamped; NaN is as bright as 1.
pub fn sequential(x: f64) -> [u8; 3] {
    nearest(&SEQUENTIAL_COLORS, x)
}

/// The sRGB bytes of a number in −1 … 1: blue below zero, white at zero, red above. Numbers outside are clamped; NaN is as
/// red as 1.
pub fn diverging(x: f64) -> [u8; 3] {
    nearest(&DIVERGING_COLORS, 0.5 * x + 0.5)
}

/// The colour of a table nearest to a place in 0 … 1.
fn nearest(colors: &[[u8; 3]], x: f64) -> [u8; 3] {
    let last = colors.len() - 1;
    // `as` saturates below zero.
    let index = if x < 1.0 { (x * last as f64 + 0.5) as usize } else { last };
    colors[index]
}

/// A cubic Bézier curve at t in 0 … 1, by de Casteljau's steps.
fn bezier(points: &[OkLab; 4], t: f64) -> OkLab {
    let [a, b, c] = [0, 1, 2].map(|at| mix(points[at], points[at + 1], t));
    mix(mix(a, b, t), mix(b, c, t), t)
}

fn mix(a: OkLab, b: OkLab, t: f64) -> OkLab {
    [0, 1, 2].map(|axis| a[axis] + (b[axis] - a[axis]) * t)
}

fn distance(a: OkLab, b: OkLab) -> f64 {
    let [l, a, b] = [0, 1, 2].map(|axis| a[axis] - b[axis]);
    (l * l + a * a + b * b).sqrt()
}

/// Points at equal distances along a curve over 0 … 1, both ends among them.
fn even_points(curve: impl Fn(f64) -> OkLab, n_points: usize) -> Vec<OkLab> {
    /// Chords that stand for the curve: the error of a length by chords falls with their square.
    const N_CHORDS: usize = 4096;
    let fine: Vec<OkLab> = (0..=N_CHORDS).map(|index| curve(index as f64 / N_CHORDS as f64)).collect();
    let mut lengths = vec![0.0];
    for ends in fine.windows(2) {
        lengths.push(lengths[lengths.len() - 1] + distance(ends[0], ends[1]));
    }
    let total = lengths[N_CHORDS];
    let at = |index: usize| {
        let wanted = total * index as f64 / (n_points - 1) as f64;
        let chord = lengths.partition_point(|&length| length < wanted).clamp(1, N_CHORDS);
        let (begin, end) = (lengths[chord - 1], lengths[chord]);
        mix(fine[chord - 1], fine[chord], ((wanted - begin) / (end - begin)).clamp(0.0, 1.0))
    };
    (0..n_points).map(at).collect()
}

/// Linear Rec. 709 of a colour whose lightness is L_r.
fn linear_rgb([lightness_r, a, b]: OkLab) -> [f64; 3] {
    // The inverse of the toe that makes L_r of L.
    let (k1, k2) = (0.206, 0.03);
    let k3 = (1.0 + k1) / (1.0 + k2);
    let l = lightness_r * (lightness_r + k1) / (k3 * (lightness_r + k2));
    let long = l + 0.396_337_777_4 * a + 0.215_803_757_3 * b;
    let medium = l - 0.105_561_345_8 * a - 0.063_854_172_8 * b;
    let short = l - 0.089_484_177_5 * a - 1.291_485_548_0 * b;
    let [long, medium, short] = [long, medium, short].map(|root| root * root * root);
    [
        4.076_741_662_1 * long - 3.307_711_591_3 * medium + 0.230_969_929_2 * short,
        -1.268_438_004_6 * long + 2.609_757_401_1 * medium - 0.341_319_396_5 * short,
        -0.004_196_086_3 * long - 0.703_418_614_7 * medium + 1.707_614_701_0 * short,
    ]
}

fn srgb8(color: OkLab) -> [u8; 3] {
    linear_rgb(color).map(|c| quantize8(srgb_from_linear(c)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::tone_map::linear_from_srgb;

    /// CIE lightness, from another model of the eye than the one the maps are made with.
    fn cie_lightness(rgb: [u8; 3]) -> f64 {
        let [r, g, b] = rgb.map(|byte| linear_from_srgb(f64::from(byte) / 255.0));
        let y: f64 = 0.2126 * r + 0.7152 * g + 0.0722 * b;
        if y > 216.0 / 24389.0 { 116.0 * y.cbrt() - 16.0 } else { y * 24389.0 / 27.0 }
    }

    #[test]
    fn the_white_of_the_space_is_white_and_its_zero_black() {
        assert_eq!(srgb8([1.0, 0.0, 0.0]), [255; 3]);
        assert_eq!(srgb8([0.0, 0.0, 0.0]), [0; 3]);
        // Ottosson's table: linear sRGB red is L 0.628, a 0.225, b 0.126. Its L_r by the toe's formula.
        let (k1, k2, k3) = (0.206, 0.03, 1.206 / 1.03);
        let shifted: f64 = k3 * 0.627_955 - k1;
        let lightness_r = 0.5 * (shifted + (shifted * shifted + 4.0 * k2 * k3 * 0.627_955).sqrt());
        assert_eq!(srgb8([lightness_r, 0.224_863, 0.125_846]), [255, 0, 0]);
    }

    #[test]
    fn both_maps_take_even_steps_and_stay_among_the_colors_a_screen_has() {
        let line = |from: OkLab, to: OkLab| even_points(|t| mix(from, to, t), N_COLORS);
        let [negative, zero, positive] = DIVERGING;
        let sequential = even_points(|t| bezier(&SEQUENTIAL, t), N_COLORS);
        for points in [sequential, line(negative, zero), line(zero, positive)] {
            let steps: Vec<f64> = points.windows(2).map(|ends| distance(ends[0], ends[1])).collect();
            let (least, most) = steps.iter().fold((f64::MAX, 0.0_f64), |(lo, hi), &step| (lo.min(step), hi.max(step)));
            assert!(most < least * 1.001, "{least} {most}");
            for color in points {
                // A level of a byte at black is 1/255/12.92 = 3.0e-4; at white it is 0.009.
                assert!(linear_rgb(color).iter().all(|c| (-6e-4..1.005).contains(c)), "{:?}", linear_rgb(color));
            }
        }
    }

    #[test]
    fn lightness_rises_all_along_the_sequential_map() {
        let lightness: Vec<f64> = SEQUENTIAL_COLORS.iter().map(|&rgb| cie_lightness(rgb)).collect();
        assert!(lightness.windows(4).all(|some| some[3] > some[0]));
        // A bright pixel is brighter by the same amount wherever it lies: no quarter takes more than 1.4 of its share.
        let quarters = [0, 64, 128, 192].map(|at| lightness[at + 63] - lightness[at]);
        assert!(quarters.iter().all(|quarter| (18.0..33.0).contains(quarter)), "{quarters:?}");
        assert_eq!((sequential(0.0), sequential(0.25)), ([0; 3], sequential(0.2501)));
        assert!(lightness[255] > 95.0);
    }

    #[test]
    fn opposite_numbers_are_equally_light() {
        for index in 0..=128 {
            let x = f64::from(index) / 128.0;
            let (blue, red) = (diverging(-x), diverging(x));
            assert!((cie_lightness(blue) - cie_lightness(red)).abs() < 6.0, "{x}: {blue:?} {red:?}");
            assert!(x < 0.1 || (blue[2] > blue[0] && red[0] > red[2]), "{x}: {blue:?} {red:?}");
        }
        assert_eq!(diverging(0.0), [255; 3]);
    }

    #[test]
    fn numbers_outside_are_clamped_and_nan_stands_out() {
        for x in [1.0, 7.0, f64::INFINITY, f64::NAN] {
            assert_eq!(sequential(x), sequential(1.0));
            assert_eq!(diverging(x), diverging(1.0));
        }
        assert_eq!(sequential(f64::NEG_INFINITY), [0; 3]);
        assert_eq!(diverging(-9.0), diverging(-1.0));
    }
}
