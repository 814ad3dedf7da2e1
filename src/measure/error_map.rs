//! Pictures of where two images differ.

use super::difference::{comparable, difference_image, pixels_of};
use super::flip::flip;
use super::pixels::Referred;
use crate::error::Error;
use crate::film::tone_map::linear_from_srgb;
use crate::film::{Display, Film, Picture, Plane, Samples, ToneMap, color_map};

/// What a map shows of each pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MapKind {
    /// The size of each channel's difference, linear, white where the largest finite one is.
    #[default]
    Abs,
    /// a − b in the channel that differs most: red where a has more, blue where it has less, white where both are equal. Colours are full
    /// from the 99.9th percentile of the differences on, so that a single pixel does not fade all others.
    Signed,
    /// FLIP, from black at 0 to cream at 1.
    Flip,
}

impl MapKind {
    /// How a map becomes the bytes of a PNG.
    pub fn display(self) -> Display {
        match self {
            MapKind::Abs => Display::Course,
            MapKind::Signed | MapKind::Flip => {
                Display::Picture(Picture { tone_map: ToneMap::Clip, ..Picture::default() })
            }
        }
    }
}

/// The map of `a`, judged by `b`: `R`, `G` and `B`, linear, in 0 … 1 but for infinite differences, over the windows of `a`.
///
/// # Errors
/// As [`super::difference::compare`].
pub fn error_map(kind: MapKind, a: &Film, b: &Film, referred: Referred) -> Result<Film, Error> {
    match kind {
        MapKind::Abs => difference_image(a, b).map(scaled_to_white),
        MapKind::Signed => signed_differences(a, b).map(|differences| colored(a, &signed_colors(&differences))),
        MapKind::Flip => {
            let errors = flip(&pixels_of(a, b, referred)?).errors;
            let colors: Vec<[u8; 3]> = errors.iter().map(|&error| color_map::sequential(f64::from(error))).collect();
            Ok(colored(a, &colors))
        }
    }
}

/// Divided by the largest finite value; a picture of zeros stays one.
fn scaled_to_white(picture: Film) -> Film {
    let values = || picture.planes.iter().flat_map(|plane| (0..plane.samples.len()).map(|at| plane.samples.get(at)));
    let largest = values().filter(|value| value.is_finite()).fold(0.0, f64::max);
    let divisor = if largest > 0.0 { largest } else { 1.0 };
    let scaled = |plane: &Plane| {
        let values = (0..plane.samples.len()).map(|at| (plane.samples.get(at) / divisor) as f32);
        Plane::color(plane.name.clone(), Samples::F32(values.collect()))
    };
    Film { planes: picture.planes.iter().map(scaled).collect(), ..picture }
}

/// a − b of the channel that differs most; 0 where the two are equal or both NaN, infinity where one alone is NaN.
fn signed_differences(a: &Film, b: &Film) -> Result<Vec<f64>, Error> {
    let (planes_a, planes_b) = comparable(a, b)?;
    let signed = |at: usize, channel: usize| {
        let (a, b) = (planes_a[channel].samples.get(at), planes_b[channel].samples.get(at));
        match a - b {
            _ if a == b || (a.is_nan() && b.is_nan()) => 0.0,
            difference if difference.is_nan() => f64::INFINITY,
            difference => difference,
        }
    };
    let larger = |x: f64, y: f64| if y.abs() > x.abs() { y } else { x };
    Ok((0..a.n_pixels()).map(|at| (0..3).map(|channel| signed(at, channel)).fold(0.0, larger)).collect())
}

fn signed_colors(differences: &[f64]) -> Vec<[u8; 3]> {
    let mut sizes: Vec<f64> = differences.iter().map(|d| d.abs()).filter(|&d| d.is_finite() && d > 0.0).collect();
    // Nearest rank over the pixels that differ: in an image that is equal nearly everywhere the rest still shows.
    let rank = (sizes.len() * 999).div_ceil(1000);
    let full = match rank.checked_sub(1) {
        Some(index) => *sizes.select_nth_unstable_by(index, f64::total_cmp).1,
        None => 1.0,
    };
    differences.iter().map(|difference| color_map::diverging(difference / full)).collect()
}

/// The film whose sRGB bytes these are.
fn colored(like: &Film, colors: &[[u8; 3]]) -> Film {
    let linear: Vec<f32> = (0..=u8::MAX).map(|byte| linear_from_srgb(f64::from(byte) / 255.0) as f32).collect();
    let plane = |channel: usize| colors.iter().map(|color| linear[usize::from(color[channel])]).collect();
    let planes = ["R", "G", "B"].into_iter().enumerate();
    Film {
        width_px: like.width_px,
        height_px: like.height_px,
        data_window: like.data_window,
        planes: planes.map(|(channel, name)| Plane::color(name, Samples::F32(plane(channel)))).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::{Region, png};

    fn film(rgb: [&[f64]; 3]) -> Film {
        let width_px = rgb[0].len() as u32;
        let planes = ["R", "G", "B"].into_iter().zip(rgb);
        Film {
            width_px,
            height_px: 1,
            data_window: Region::whole(width_px, 1),
            planes: planes.map(|(name, values)| Plane::color(name, Samples::F64(values.to_vec()))).collect(),
        }
    }

    /// The bytes of the PNG that shows a map.
    fn bytes(kind: MapKind, a: &Film, b: &Film) -> Vec<[u8; 3]> {
        let map = error_map(kind, a, b, Referred::Scene).unwrap();
        let mut file = Vec::new();
        png::write(&map, &kind.display(), &mut file).unwrap();
        png::decode(&file, None, "map.png".as_ref()).unwrap().rgb8.unwrap()
    }

    #[test]
    fn the_signed_map_is_red_where_the_first_image_has_more_and_blue_where_less() {
        let zeros: &[f64] = &[0.0; 5];
        let a = film([&[0.5, 0.0, 0.1, f64::NAN, 0.0], zeros, &[0.0, 0.0, 0.3, 0.0, 0.0]]);
        let b = film([zeros, &[0.0, 0.5, 0.0, 0.0, 0.0], &[0.0, 0.1, 0.55, 0.0, 0.0]]);
        let expected = [1.0, -1.0, -0.5, 1.0, 0.0].map(color_map::diverging);
        assert_eq!(bytes(MapKind::Signed, &a, &b), expected);
    }

    #[test]
    fn the_map_of_sizes_is_white_at_the_largest_finite_difference_and_linear() {
        let zeros: &[f64] = &[0.0; 3];
        let a = film([&[0.5, 0.25, f64::NAN], zeros, zeros]);
        assert_eq!(bytes(MapKind::Abs, &a, &film([zeros; 3])), [[255, 0, 0], [128, 0, 0], [255, 0, 0]]);
    }

    #[test]
    fn the_flip_map_is_black_where_images_are_equal_and_cream_at_an_infinite_difference() {
        let a = film([&[0.5, f64::NAN], &[0.5, 0.5], &[0.5, 0.5]]);
        let b = film([&[0.5, 0.5], &[0.5, 0.5], &[0.5, 0.5]]);
        assert_eq!(bytes(MapKind::Flip, &b, &b), [[0; 3]; 2]);
        assert_eq!(bytes(MapKind::Flip, &a, &b)[1], color_map::sequential(1.0));
    }

    #[test]
    fn maps_of_equal_images_show_nothing_and_those_of_unequal_sizes_are_refused() {
        let image = film([&[0.5, 2.0], &[0.0, 0.1], &[0.3, 0.0]]);
        for (kind, color) in [(MapKind::Abs, [0; 3]), (MapKind::Signed, [255; 3]), (MapKind::Flip, [0; 3])] {
            assert_eq!(bytes(kind, &image, &image), [color; 2]);
            assert!(error_map(kind, &image, &film([&[0.0], &[0.0], &[0.0]]), Referred::Scene).is_err());
        }
    }
}
