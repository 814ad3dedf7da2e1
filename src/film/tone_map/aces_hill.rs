//! Stephen Hill's fit of the ACES reference rendering and output transforms.
//!
//! Source: `BakingLab/ACES.hlsl` in the repository `TheRealMJP/BakingLab` (S. Hill, 2016): a matrix from linear sRGB to
//! saturated AP1, a ratio of two quadratics for RRT and ODT, a matrix back, and a cut to 0 … 1. As it stands there: some
//! users divide radiance by 0.6 first, which is an exposure of 0.74 stops.

use super::times;

/// sRGB → XYZ → D65 to D60 → AP1 → RRT_SAT.
const INPUT: [[f64; 3]; 3] =
    [[0.597_19, 0.354_58, 0.048_23], [0.076_00, 0.908_34, 0.015_66], [0.028_40, 0.133_83, 0.837_77]];
/// ODT_SAT → XYZ → D60 to D65 → sRGB.
const OUTPUT: [[f64; 3]; 3] =
    [[1.604_75, -0.531_08, -0.073_67], [-0.102_08, 1.108_13, -0.006_05], [-0.003_27, -0.072_76, 1.076_02]];

/// The display values of a colour.
#[inline]
pub fn map(color: [f64; 3]) -> [f64; 3] {
    times(&OUTPUT, times(&INPUT, color).map(rrt_and_odt)).map(|c| c.clamp(0.0, 1.0))
}

#[inline]
fn rrt_and_odt(x: f64) -> f64 {
    (x * (x + 0.024_578_6) - 0.000_090_537) / (x * (0.983_729 * x + 0.432_951_0) + 0.238_081)
}
