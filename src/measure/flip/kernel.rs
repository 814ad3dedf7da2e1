//! The filters of FLIP. Each is a sum of products of a row and a column.

use std::f64::consts::PI;

/// Weights of one filter along a row or a column; as many as [`Kernels::width`], the middle one in the middle.
pub type Kernel = Vec<f32>;

/// The filters for one distance of the eye, all of one width.
#[derive(Clone, Debug)]
pub struct Kernels {
    /// Weights to each side of the middle one.
    pub radius: usize,
    /// The eye's contrast sensitivity to luminance, along rows and along columns.
    pub achromatic: Kernel,
    /// The same for red and green.
    pub red_green: Kernel,
    /// The same for blue and yellow: the sum of two filters.
    pub blue_yellow: [Kernel; 2],
    /// A Gaussian as wide as the features that are looked for.
    pub smooth: Kernel,
    /// Its first derivative: edges.
    pub edge: Kernel,
    /// Its second derivative: points.
    pub point: Kernel,
}

/// Scales a and widths b, in squared degrees, of the Gaussians a·√(π/b)·exp(−π²d²/b) at d degrees; table 1 of the paper.
const ACHROMATIC: [f64; 2] = [1.0, 0.0047];
const RED_GREEN: [f64; 2] = [1.0, 0.0053];
const BLUE_YELLOW: [[f64; 2]; 2] = [[34.1, 0.04], [13.5, 0.025]];
/// The width of features in degrees: twice the standard deviation of their filter.
const FEATURE_WIDTH: f64 = 0.082;
/// Standard deviations at which filters end.
const CUT: f64 = 3.0;

impl Kernels {
    /// The filters at a distance where a degree has this many pixels.
    pub fn new(pixels_per_degree: f64) -> Kernels {
        let feature_deviation = 0.5 * FEATURE_WIDTH * pixels_per_degree;
        let feature_radius = (CUT * feature_deviation).ceil() as isize;
        // All end where the widest does.
        let widest = BLUE_YELLOW[0][1];
        let color_radius = (CUT * (widest / (2.0 * PI * PI)).sqrt() * pixels_per_degree).ceil() as isize;
        let radius = color_radius.max(feature_radius);
        let offsets = || -radius..=radius;

        let gaussian = |[_, b]: [f64; 2]| -> Vec<f64> {
            let degrees = |offset: isize| offset as f64 / pixels_per_degree;
            let value = |offset: isize| match offset.abs() <= color_radius {
                true => libm::exp(-PI * PI * degrees(offset) * degrees(offset) / b),
                false => 0.0,
            };
            offsets().map(value).collect()
        };
        let sum = |values: &[f64]| values.iter().sum::<f64>();
        let of_sum_one = |values: Vec<f64>| rounded(&values, 1.0 / sum(&values));

        // Both filters together have sum 1: each is the product of a row and a column that share its scale.
        let parts = BLUE_YELLOW.map(|part| (gaussian(part), (part[0] * (PI / part[1]).sqrt()).sqrt()));
        let total: f64 = parts.iter().map(|(values, scale)| (scale * sum(values)).powi(2)).sum();
        let blue_yellow = parts.map(|(values, scale)| rounded(&values, scale / total.sqrt()));

        let variance = feature_deviation * feature_deviation;
        let feature = |polynomial: &dyn Fn(f64) -> f64| -> Vec<f64> {
            let value = |offset: isize| match offset.abs() <= feature_radius {
                true => polynomial(offset as f64) * libm::exp(-((offset * offset) as f64) / (2.0 * variance)),
                false => 0.0,
            };
            offsets().map(value).collect()
        };
        Kernels {
            radius: radius as usize,
            achromatic: of_sum_one(gaussian(ACHROMATIC)),
            red_green: of_sum_one(gaussian(RED_GREEN)),
            blue_yellow,
            smooth: of_sum_one(feature(&|_| 1.0)),
            edge: balanced(feature(&|x| -x)),
            point: balanced(feature(&|x| x * x / variance - 1.0)),
        }
    }

    /// Weights of each filter.
    pub fn width(&self) -> usize {
        2 * self.radius + 1
    }
}

fn rounded(values: &[f64], factor: f64) -> Kernel {
    values.iter().map(|value| (value * factor) as f32).collect()
}

/// Positive weights scaled to sum 1, negative ones to sum −1.
fn balanced(values: Vec<f64>) -> Kernel {
    let sum = |sign: f64| values.iter().map(|value| (sign * value).max(0.0)).sum::<f64>();
    let (positive, negative) = (sum(1.0), sum(-1.0));
    values.iter().map(|&value| (value / if value > 0.0 { positive } else { negative }) as f32).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::flip::PIXELS_PER_DEGREE;

    fn sum(kernel: &Kernel) -> f64 {
        kernel.iter().map(|&weight| f64::from(weight)).sum()
    }

    #[test]
    fn filters_are_symmetric_of_sum_one_and_as_wide_as_their_widest() {
        let kernels = Kernels::new(PIXELS_PER_DEGREE);
        // 3·√(0.04/2π²)·67.02 = 9.05 for colours, 3·0.041·67.02 = 8.24 for features.
        assert_eq!((kernels.radius, kernels.width()), (10, 21));
        for kernel in [&kernels.achromatic, &kernels.red_green, &kernels.smooth] {
            assert!((sum(kernel) - 1.0).abs() < 1e-6);
            assert!(kernel.iter().eq(kernel.iter().rev()));
        }
        let [a, b] = &kernels.blue_yellow;
        assert!((sum(a).powi(2) + sum(b).powi(2) - 1.0).abs() < 1e-6);
        assert_eq!(kernels.smooth.iter().filter(|&&weight| weight > 0.0).count(), 19);
    }

    #[test]
    fn derivatives_see_nothing_in_a_plain_area_and_one_in_a_step() {
        let kernels = Kernels::new(PIXELS_PER_DEGREE);
        for kernel in [&kernels.edge, &kernels.point] {
            assert!(sum(kernel).abs() < 1e-6);
            let positive: f64 = kernel.iter().map(|&weight| f64::from(weight.max(0.0))).sum();
            assert!((positive - 1.0).abs() < 1e-6);
        }
        assert!(kernels.edge[9] > 0.0 && kernels.edge[11] < 0.0 && kernels.point[10] < 0.0);
    }
}
