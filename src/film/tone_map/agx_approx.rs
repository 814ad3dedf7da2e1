//! An approximation of Troy Sobotka's AgX.
//!
//! Source: B. Wrensch, *Minimal AgX Implementation*, iolite-engine.com 2023: an inset matrix for Rec. 709 primaries, log₂ of
//! radiance from −12.47393 to 4.026069 stops brought to 0 … 1, the polynomial of degree 6 for the contrast curve (mean
//! squared error 3.67e-6; there is another of degree 7), the inverse of the inset, and the power 2.2 that makes the result
//! linear. No look. Other programs work in Rec. 2020 with other matrices, or leave out the power: their bytes differ.
//!
//! Departure: the rows of both matrices, which sum to 1 within 1.7e-4, are divided by their sums. Else the channels of a grey
//! reach the end of the logarithm one after another, and it darkens by 2e-6 on the way.

use super::times;

const MIN_EV: f64 = -12.473_93;
const MAX_EV: f64 = 4.026_069;

const INSET: [[f64; 3]; 3] = balanced([
    [0.842_479_062_253_094, 0.078_433_599_999_999_2, 0.079_223_745_147_764_3],
    [0.042_328_242_261_012_3, 0.878_468_636_469_772, 0.079_166_127_460_543_4],
    [0.042_375_654_905_705_1, 0.078_433_6, 0.879_142_973_793_104],
]);
const OUTSET: [[f64; 3]; 3] = balanced([
    [1.196_879_005_120_17, -0.098_020_881_140_136_8, -0.099_029_744_079_720_5],
    [-0.052_896_851_757_456_2, 1.151_903_129_904_17, -0.098_961_176_844_843_3],
    [-0.052_971_635_514_443_8, -0.098_043_450_117_124_1, 1.151_073_672_641_16],
]);

const fn balanced(mut rows: [[f64; 3]; 3]) -> [[f64; 3]; 3] {
    let mut row = 0;
    while row < 3 {
        let [r, g, b] = rows[row];
        let sum = r + g + b;
        rows[row] = [r / sum, g / sum, b / sum];
        row += 1;
    }
    rows
}

/// The display values of a colour.
#[inline]
pub fn map(color: [f64; 3]) -> [f64; 3] {
    // The logarithm of black is −∞, which is below the least.
    let stops = times(&INSET, color).map(|c| libm::log2(c).clamp(MIN_EV, MAX_EV));
    let encoded = stops.map(|ev| contrast((ev - MIN_EV) / (MAX_EV - MIN_EV)));
    times(&OUTSET, encoded).map(|c| libm::pow(c.clamp(0.0, 1.0), 2.2))
}

/// The contrast curve; rises from −0.0023 to 0.9986 over 0 … 1.
#[inline]
fn contrast(x: f64) -> f64 {
    const COEFFICIENTS: [f64; 7] = [15.5, -40.14, 31.96, -6.868, 0.429_8, 0.119_1, -0.002_32];
    COEFFICIENTS.into_iter().fold(0.0, |sum, coefficient| sum * x + coefficient)
}
