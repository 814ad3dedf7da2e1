//! Two images as figures of seeing need them: as f32, finite.

use crate::film::Plane;

/// What the values of images say.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Referred {
    /// Radiance of a scene, at no exposure in particular: EXR, PFM.
    Scene,
    /// What a screen shows, 0 to 1: PNG.
    Display,
}

/// Red, green and blue of two images of one size, scene-linear, row after row.
///
/// Values that are not finite are 0 in both images; where they differ the pixel is noted. Finite ones that f32 cannot say are its
/// largest.
#[derive(Clone, Debug, PartialEq)]
pub struct Pixels {
    /// Width of the images.
    pub width_px: usize,
    /// Height of the images.
    pub height_px: usize,
    /// What the values say.
    pub referred: Referred,
    /// Channels of the image that is judged.
    pub a: [Vec<f32>; 3],
    /// Channels of the image it is judged by.
    pub b: [Vec<f32>; 3],
    /// Pixels that differ by infinity in some channel, rising.
    pub unlike: Vec<usize>,
}

impl Pixels {
    /// The pixels of planes of equal lengths that have one row at least.
    pub fn new(width_px: u32, referred: Referred, a: &[&Plane; 3], b: &[&Plane; 3]) -> Pixels {
        let n_pixels = a[0].samples.len();
        let channels = || [(); 3].map(|()| Vec::with_capacity(n_pixels));
        let (mut channels_a, mut channels_b) = (channels(), channels());
        let mut unlike = Vec::new();
        for at in 0..n_pixels {
            let mut is_unlike = false;
            for channel in 0..3 {
                let (a, b) = (a[channel].samples.get(at), b[channel].samples.get(at));
                let are_finite = a.is_finite() && b.is_finite();
                is_unlike |= !are_finite && a != b && !(a.is_nan() && b.is_nan());
                channels_a[channel].push(if are_finite { nearest_f32(a) } else { 0.0 });
                channels_b[channel].push(if are_finite { nearest_f32(b) } else { 0.0 });
            }
            if is_unlike {
                unlike.push(at);
            }
        }
        let width_px = width_px as usize;
        Pixels { width_px, height_px: n_pixels / width_px, referred, a: channels_a, b: channels_b, unlike }
    }

    /// Pixels of an image.
    pub fn n_pixels(&self) -> usize {
        self.width_px * self.height_px
    }
}

fn nearest_f32(finite: f64) -> f32 {
    finite.clamp(f64::from(f32::MIN), f64::from(f32::MAX)) as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::Samples;

    #[test]
    fn what_is_not_finite_is_zero_and_noted_where_the_images_disagree() {
        let plane = |values: [f64; 4]| Plane::color("R", Samples::F64(values.to_vec()));
        let a = plane([f64::NAN, f64::NAN, f64::INFINITY, 1e300]);
        let b = plane([f64::NAN, 0.5, f64::NEG_INFINITY, -1e300]);
        let pixels = Pixels::new(2, Referred::Scene, &[&a; 3], &[&b; 3]);
        assert_eq!((pixels.width_px, pixels.height_px, pixels.n_pixels()), (2, 2, 4));
        assert_eq!(pixels.a[0], [0.0, 0.0, 0.0, f32::MAX]);
        assert_eq!(pixels.b[2], [0.0, 0.0, 0.0, f32::MIN]);
        assert_eq!(pixels.unlike, [1, 2]);
    }
}
