//! How radiance becomes the bytes of a picture.

use std::sync::LazyLock;

use crate::film::tone_map::{SrgbLevels, expose_by, exposure_factor, pbr_neutral};

/// How a film is turned into 8-bit colour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Display {
    /// For looking at: exposure, the Khronos PBR Neutral curve, the sRGB transfer.
    ToneMapped {
        /// Radiance is multiplied by 2 to this power first.
        exposure_stops: f64,
    },
    /// The original's linear bytes: ⌊min(c, 1 − 1e-5)·256⌋, negative values and NaN becoming 0.
    Course,
}

/// A [`Display`] with all that is the same for every pixel worked out.
#[derive(Clone, Copy, Debug)]
pub struct Mapping {
    curve: Curve,
}

#[derive(Clone, Copy, Debug)]
enum Curve {
    ToneMapped { exposure: f64, levels: &'static SrgbLevels },
    Course,
}

/// The levels are the same for all images.
static SRGB_LEVELS: LazyLock<SrgbLevels> = LazyLock::new(SrgbLevels::new);

impl Display {
    /// Prepares to map many colours.
    pub fn mapping(&self) -> Mapping {
        let curve = match *self {
            Display::ToneMapped { exposure_stops } => {
                Curve::ToneMapped { exposure: exposure_factor(exposure_stops), levels: &SRGB_LEVELS }
            }
            Display::Course => Curve::Course,
        };
        Mapping { curve }
    }

    /// The bytes of one colour.
    pub fn rgb8(&self, color: [f64; 3]) -> [u8; 3] {
        self.mapping().rgb8(color)
    }
}

impl Mapping {
    /// The bytes of one colour.
    #[inline]
    pub fn rgb8(&self, color: [f64; 3]) -> [u8; 3] {
        match self.curve {
            Curve::ToneMapped { exposure, levels } => {
                pbr_neutral(color.map(|c| expose_by(c, exposure))).map(|c| levels.quantize8(c))
            }
            Curve::Course => color.map(course_byte),
        }
    }
}

/// The largest value that the original's formula byte = ⌊min(c, 1 − 1e-5)·256⌋ lets through: part of its definition.
const COURSE_WHITE: f64 = 1.0 - 1e-5;

/// The original's byte of one channel.
fn course_byte(value: f64) -> u8 {
    // `min` would turn NaN into the other operand; a comparison leaves it to the cast, which makes it 0.
    let below_one = if value > COURSE_WHITE { COURSE_WHITE } else { value };
    // Below zero the cast saturates at 0; above, truncation is the floor.
    (below_one * 256.0) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn course_bytes_are_the_floor_of_256_levels() {
        let below_a_quarter = f64::from_bits(0.25_f64.to_bits() - 1);
        assert_eq!(Display::Course.rgb8([0.0, below_a_quarter, 0.25]), [0, 63, 64]);
        assert_eq!(Display::Course.rgb8([1.0, 7.0, f64::INFINITY]), [255; 3]);
        assert_eq!(Display::Course.rgb8([-3.0, f64::NAN, f64::NEG_INFINITY]), [0; 3]);
    }

    #[test]
    fn exposure_is_applied_before_the_curve() {
        let lit = Display::ToneMapped { exposure_stops: 1.0 }.rgb8([0.09; 3]);
        assert_eq!(lit, Display::ToneMapped { exposure_stops: 0.0 }.rgb8([0.18; 3]));
    }
}
