//! The errors of a tile. Its pixels and those around it that its filters reach fit the nearest caches, and what need not be filtered
//! is known for each tile alone: where both images are equal, or look as they did at the exposure before.

use super::Exposures;
use super::color::{ColorError, Opponent, aces, opponent_from_rgb};
use super::kernel::{Kernel, Kernels};
use crate::measure::pixels::Pixels;

/// Width of a tile.
pub const WIDTH_PX: usize = 64;
/// Height of a tile.
pub const HEIGHT_PX: usize = 64;
/// Values that are summed up at once.
const N_LANES: usize = 16;

/// One channel of a tile.
type Channel = Vec<f32>;

/// Room for the values of a tile.
#[derive(Debug)]
pub struct Scratch {
    /// Display values of both images, red, green and blue, with the margin around the tile.
    shown: [[Channel; 3]; 2],
    opponent: [Channel; 3],
    /// Filtered along rows: luminance, red-green, blue-yellow twice; then features: edge, point, smooth.
    rows: [Channel; 7],
    seen: [Seen; 2],
}

/// What the eye makes of an image.
#[derive(Debug, Default)]
struct Seen {
    colors: [Channel; 3],
    edges: Channel,
    points: Channel,
}

impl Scratch {
    /// Room for tiles with the margin of these filters.
    pub fn new(kernels: &Kernels) -> Scratch {
        let [width, height] = with_margin(kernels);
        let input = || vec![0.0; width * height];
        let inputs = || [input(), input(), input()];
        Scratch {
            shown: [inputs(), inputs()],
            opponent: inputs(),
            rows: std::array::from_fn(|_| vec![0.0; WIDTH_PX * height]),
            seen: std::array::from_fn(|_| Seen::new()),
        }
    }

    /// The largest error of each pixel over all exposures. `corner` is the tile's first pixel; the errors of pixels that
    /// the image does not have mean nothing.
    pub fn errors(
        &mut self,
        pixels: &Pixels,
        exposures: &Exposures,
        kernels: &Kernels,
        color_error: &ColorError,
        corner: [usize; 2],
    ) -> Vec<f32> {
        let mut largest = vec![0.0; WIDTH_PX * HEIGHT_PX];
        let places = places(pixels, kernels, corner);
        // Where both images hold the same, they look the same at every exposure.
        if (0..3).all(|channel| places.iter().all(|&at| pixels.a[channel][at] == pixels.b[channel][at])) {
            return largest;
        }

        match exposures {
            Exposures::AsIs => {
                self.show(pixels, &places, |value| value.clamp(0.0, 1.0));
                self.add_errors(kernels, color_error, &mut largest);
            }
            Exposures::Factors(factors) => {
                for (index, factor) in factors.iter().enumerate() {
                    let is_new = self.show(pixels, &places, |value| aces(value.max(0.0) * factor));
                    if is_new || index == 0 {
                        self.add_errors(kernels, color_error, &mut largest);
                    }
                }
            }
        }
        largest
    }

    /// Fills in what a screen shows; says whether it is anything else than before.
    fn show(&mut self, pixels: &Pixels, places: &[usize], display: impl Fn(f32) -> f32) -> bool {
        let mut is_new = false;
        for (shown, image) in self.shown.iter_mut().zip([&pixels.a, &pixels.b]) {
            for (shown, channel) in shown.iter_mut().zip(image) {
                for (shown, &at) in shown.iter_mut().zip(places) {
                    let value = display(channel[at]);
                    is_new |= value != *shown;
                    *shown = value;
                }
            }
        }
        is_new
    }

    /// Raises errors to those of what is shown.
    fn add_errors(&mut self, kernels: &Kernels, color_error: &ColorError, largest: &mut [f32]) {
        if self.shown[0] == self.shown[1] {
            return;
        }
        for (seen, [r, g, b]) in self.seen.iter_mut().zip(&self.shown) {
            let [y, x_y, y_z] = &mut self.opponent;
            for (at, ((&r, &g), &b)) in r.iter().zip(g).zip(b).enumerate() {
                [y[at], x_y[at], y_z[at]] = opponent_from_rgb([r, g, b]);
            }
            seen.filter(&self.opponent, kernels, &mut self.rows);
        }
        let [a, b] = &self.seen;
        for (at, largest) in largest.iter_mut().enumerate() {
            let color = color_error.of(a.color(at), b.color(at));
            let edge = (a.edges[at] - b.edges[at]).abs();
            let point = (a.points[at] - b.points[at]).abs();
            // Features differ by 1/√2 of a step's answer at most; the exponent is ½. Section 4.2 of the paper.
            let feature = (std::f32::consts::FRAC_1_SQRT_2 * edge.max(point)).sqrt();
            let error = if color > 0.0 { libm::powf(color, 1.0 - feature) } else { 0.0 };
            *largest = largest.max(error);
        }
    }
}

impl Seen {
    fn new() -> Seen {
        let tile = || vec![0.0; WIDTH_PX * HEIGHT_PX];
        Seen { colors: [tile(), tile(), tile()], edges: tile(), points: tile() }
    }

    fn color(&self, at: usize) -> Opponent {
        [self.colors[0][at], self.colors[1][at], self.colors[2][at]]
    }

    fn filter(&mut self, [y, x_y, y_z]: &[Channel; 3], kernels: &Kernels, rows: &mut [Channel; 7]) {
        let [part_a, part_b] = &kernels.blue_yellow;
        let along_rows = [
            (y, &kernels.achromatic),
            (x_y, &kernels.red_green),
            (y_z, part_a),
            (y_z, part_b),
            (y, &kernels.edge),
            (y, &kernels.point),
            (y, &kernels.smooth),
        ];
        for (out, (input, kernel)) in rows.iter_mut().zip(along_rows) {
            filter_rows(input, kernel, out);
        }
        let [row_y, row_x_y, row_a, row_b, edge, point, smooth] = rows;
        let [out_y, out_x_y, out_y_z] = &mut self.colors;
        filter_columns([(row_y, &kernels.achromatic)], out_y, |[y]| y);
        filter_columns([(row_x_y, &kernels.red_green)], out_x_y, |[x_y]| x_y);
        filter_columns([(row_a, part_a), (row_b, part_b)], out_y_z, |[a, b]| a + b);
        // The length of a gradient whose x is derived along rows and y along columns.
        let length = |[x, y]: [f32; 2]| (x * x + y * y).sqrt();
        filter_columns([(edge, &kernels.smooth), (smooth, &kernels.edge)], &mut self.edges, length);
        filter_columns([(point, &kernels.smooth), (smooth, &kernels.point)], &mut self.points, length);
    }
}

fn with_margin(kernels: &Kernels) -> [usize; 2] {
    [WIDTH_PX + 2 * kernels.radius, HEIGHT_PX + 2 * kernels.radius]
}

/// Where the pixels of a tile and its margin lie in the image; beyond the image's edges its outermost pixels go on.
fn places(pixels: &Pixels, kernels: &Kernels, [x0, y0]: [usize; 2]) -> Vec<usize> {
    let [width, height] = with_margin(kernels);
    let inside = |at: usize, length: usize| at.saturating_sub(kernels.radius).min(length - 1);
    let rows = (y0..y0 + height).map(|y| inside(y, pixels.height_px) * pixels.width_px);
    rows.flat_map(|row| (x0..x0 + width).map(move |x| row + inside(x, pixels.width_px))).collect()
}

/// Filters rows that have a margin on both sides into rows of a tile.
fn filter_rows(input: &[f32], kernel: &Kernel, out: &mut [f32]) {
    let width = WIDTH_PX + kernel.len() - 1;
    for (input, out) in input.chunks_exact(width).zip(out.chunks_exact_mut(WIDTH_PX)) {
        for (x, out) in out.chunks_exact_mut(N_LANES).enumerate() {
            let mut sums = [0.0; N_LANES];
            for (offset, &weight) in kernel.iter().enumerate() {
                add_weighted(&mut sums, weight, &input[x * N_LANES + offset..]);
            }
            out.copy_from_slice(&sums);
        }
    }
}

/// Filters the columns of several channels, which have a margin above and below, and joins their results.
fn filter_columns<const N: usize>(channels: [(&Channel, &Kernel); N], out: &mut [f32], join: impl Fn([f32; N]) -> f32) {
    for (index, out) in out.chunks_exact_mut(N_LANES).enumerate() {
        let sums = channels.map(|(channel, kernel)| {
            let mut sums = [0.0; N_LANES];
            for (offset, &weight) in kernel.iter().enumerate() {
                add_weighted(&mut sums, weight, &channel[index * N_LANES + offset * WIDTH_PX..]);
            }
            sums
        });
        for (lane, out) in out.iter_mut().enumerate() {
            *out = join(sums.map(|sums| sums[lane]));
        }
    }
}

#[inline]
fn add_weighted(sums: &mut [f32; N_LANES], weight: f32, values: &[f32]) {
    for (sum, value) in sums.iter_mut().zip(&values[..N_LANES]) {
        *sum += weight * value;
    }
}
