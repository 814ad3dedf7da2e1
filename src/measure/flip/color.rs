//! Colours as FLIP sees them.

use glam::DMat3;

/// X, Y and Z of linear Rec. 709 primaries, each in shares of white's: rows sum to 1.
///
/// The sRGB matrix in whole numbers (IEC 61966-2-1's chromaticities solved exactly), each row divided by its sum, so that
/// the illuminant D65 is 1, 1, 1.
const XYZ_FROM_RGB: [[f64; 3]; 3] = [
    [10_135_552.0 / 23_359_437.0, 8_788_810.0 / 23_359_437.0, 4_435_075.0 / 23_359_437.0],
    [2_613_072.0 / 12_288_897.0, 8_788_810.0 / 12_288_897.0, 887_015.0 / 12_288_897.0],
    [1_425_312.0 / 80_288_307.0, 8_788_810.0 / 80_288_307.0, 70_074_185.0 / 80_288_307.0],
];

/// The exponent of the colour difference (q_c in the paper).
const COLOR_EXPONENT: f32 = 0.7;
/// The share of the largest colour difference (p_c) that is mapped to the share [`KNEE_ERROR`] of the error.
const KNEE_DIFFERENCE: f32 = 0.4;
/// That share (p_t).
const KNEE_ERROR: f32 = 0.95;

/// A colour by its luminance and what tells it from grey, in linear light: Y, X − Y and Y − Z, in shares of white's.
///
/// These are the paper's Y C_x C_z (116·Y − 16, 500·(X − Y), 200·(Y − Z)) without factors, which filters of sum 1 leave alone.
pub type Opponent = [f32; 3];

/// Luminance of linear Rec. 709.
pub fn luminance([r, g, b]: [f32; 3]) -> f64 {
    0.2126 * f64::from(r) + 0.7152 * f64::from(g) + 0.0722 * f64::from(b)
}

/// The opponent colour of linear Rec. 709.
#[inline]
pub fn opponent_from_rgb(rgb: [f32; 3]) -> Opponent {
    let [x, y, z] = times(&XYZ_FROM_RGB.map(|row| row.map(|c| c as f32)), rgb);
    [y, x - y, y - z]
}

#[inline]
fn times(matrix: &[[f32; 3]; 3], [a, b, c]: [f32; 3]) -> [f32; 3] {
    matrix.map(|row| row[0] * a + row[1] * b + row[2] * c)
}

/// Coefficients of the tone curve (2.51x² + 0.03x)/(2.43x² + 0.59x + 0.14) of K. Narkowicz ("ACES Filmic Tone Mapping
/// Curve", 2015) with x = 0.6 × radiance, as HDR-FLIP uses it: of radiance squared and radiance, above and below.
const ACES: [f32; 5] = [0.36 * 2.51, 0.6 * 0.03, 0.36 * 2.43, 0.6 * 0.59, 0.14];

/// Beyond this radiance the curve is above 1, where it is clipped: it reaches 1 at 12.1. Larger values are taken as this one,
/// so that no square overflows.
const ACES_WHITE: f32 = 16.0;

/// The display value in 0 … 1 of a radiance that is not negative.
#[inline]
pub fn aces(radiance: f32) -> f32 {
    let [above2, above1, below2, below1, below0] = ACES;
    // Not `min`, which compiles to more than this does.
    let x = if radiance < ACES_WHITE { radiance } else { ACES_WHITE };
    let shown = (above2 * x + above1) * x / ((below2 * x + below1) * x + below0);
    if shown < 1.0 { shown } else { 1.0 }
}

/// The radiance that the curve shows as `shown`, in 0 … 1: the positive root of a quadratic.
pub fn aces_inverse(shown: f64) -> f64 {
    let [above2, above1, below2, below1, below0] = ACES.map(f64::from);
    let (a, b, c) = (above2 - shown * below2, above1 - shown * below1, -shown * below0);
    (-b + (b * b - 4.0 * a * c).sqrt()) / (2.0 * a)
}

/// What the colour error of a pixel needs that is the same for all.
#[derive(Clone, Debug)]
pub struct ColorError {
    rgb_from_xyz: [[f32; 3]; 3],
    /// The largest difference, that of green and blue.
    largest: f32,
}

impl ColorError {
    /// Works the constants out.
    pub fn new() -> ColorError {
        let [x, y, z] = DMat3::from_cols_array_2d(&XYZ_FROM_RGB).inverse().to_cols_array_2d();
        let rgb_from_xyz = [x, y, z].map(|row| row.map(|c| c as f32));
        let hunt_lab_of = |rgb| hunt_lab(times(&XYZ_FROM_RGB.map(|row| row.map(|c| c as f32)), rgb));
        let largest = difference(hunt_lab_of([0.0, 1.0, 0.0]), hunt_lab_of([0.0, 0.0, 1.0]));
        ColorError { rgb_from_xyz, largest }
    }

    /// The error in 0 … 1 between two filtered colours; section 4.1.3 of the paper.
    #[inline]
    pub fn of(&self, a: Opponent, b: Opponent) -> f32 {
        let difference = difference(self.seen(a), self.seen(b));
        let knee = KNEE_DIFFERENCE * self.largest;
        if difference < knee {
            difference * (KNEE_ERROR / knee)
        } else {
            // Rounding alone can lead beyond 1.
            (KNEE_ERROR + (difference - knee) / (self.largest - knee) * (1.0 - KNEE_ERROR)).min(1.0)
        }
    }

    /// Clipped to what a screen can show, then in Hunt's colours.
    #[inline]
    fn seen(&self, [y, x_y, y_z]: Opponent) -> [f32; 3] {
        let rgb = times(&self.rgb_from_xyz, [y + x_y, y, y - y_z]).map(|c| c.clamp(0.0, 1.0));
        hunt_lab(times(&XYZ_FROM_RGB.map(|row| row.map(|c| c as f32)), rgb))
    }
}

impl Default for ColorError {
    fn default() -> ColorError {
        ColorError::new()
    }
}

/// CIELAB of a colour in shares of white, its chroma scaled by lightness (R. W. G. Hunt): what is dark seems less colourful.
#[inline]
fn hunt_lab(xyz: [f32; 3]) -> [f32; 3] {
    let [x, y, z] = xyz.map(|c| {
        const DELTA: f32 = 6.0 / 29.0;
        if c > DELTA * DELTA * DELTA { libm::cbrtf(c) } else { c / (3.0 * DELTA * DELTA) + 4.0 / 29.0 }
    });
    let lightness = 116.0 * y - 16.0;
    let hunt = 0.01 * lightness;
    [lightness, hunt * 500.0 * (x - y), hunt * 200.0 * (y - z)]
}

/// HyAB, the city-block distance of lightness and Euclid's of chroma, compressed.
#[inline]
fn difference([la, aa, ba]: [f32; 3], [lb, ab, bb]: [f32; 3]) -> f32 {
    let hyab = (la - lb).abs() + ((aa - ab) * (aa - ab) + (ba - bb) * (ba - bb)).sqrt();
    if hyab > 0.0 { libm::powf(hyab, COLOR_EXPONENT) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_is_grey_of_lightness_100_and_black_of_none() {
        let [y, x_y, y_z] = opponent_from_rgb([1.0; 3]);
        assert!((y - 1.0).abs() < 1e-6 && x_y.abs() < 1e-6 && y_z.abs() < 1e-6);
        let [lightness, a, b] = ColorError::new().seen([1.0, 0.0, 0.0]);
        assert!((lightness - 100.0).abs() < 1e-4 && a.abs() < 1e-3 && b.abs() < 1e-3);
        assert!(hunt_lab([0.0; 3]).iter().all(|c| c.abs() < 1e-5));
    }

    #[test]
    fn green_and_blue_differ_by_all_there_is_and_equal_colors_by_nothing() {
        let error = ColorError::new();
        let [green, blue] = [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(opponent_from_rgb);
        assert!((error.of(green, blue) - 1.0).abs() < 1e-5);
        assert_eq!(error.of(green, green), 0.0);
        // CIELAB of the sRGB primaries, D65: green 87.74, −86.18, 83.18; blue 32.30, 79.19, −107.86. Hunt's factors 0.8774
        // and 0.3230; HyAB 55.44 + √(101.20² + 107.82²) = 203.31, to the power 0.7: 41.28.
        assert!((error.largest - 41.28).abs() < 0.02, "{}", error.largest);
    }

    #[test]
    fn the_tone_curve_and_its_inverse_agree_and_end_at_white() {
        for shown in [0.01, 0.5, 0.85, 0.99] {
            assert!((f64::from(aces(aces_inverse(shown) as f32)) - shown).abs() < 1e-6);
        }
        assert_eq!((aces(0.0), aces(12.2), aces(f32::MAX), aces(f32::INFINITY)), (0.0, 1.0, 1.0, 1.0));
        assert!(aces(12.0) < 1.0);
    }
}
