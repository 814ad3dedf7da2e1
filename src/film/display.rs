//! How radiance becomes the levels of a picture.

use std::sync::LazyLock;

use crate::film::tone_map::srgb::SrgbLevels16;
use crate::film::tone_map::{Operator, SrgbLevels, ToneMap, expose_by, exposure_factor};

/// How a film is turned into a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Display {
    /// For looking at.
    Picture(Picture),
    /// The original's linear bytes: ⌊min(c, 1 − 1e-5)·256⌋, negative values and NaN becoming 0.
    Course,
}

/// A picture for looking at: exposure, a tone curve, the sRGB transfer.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Picture {
    /// The tone curve.
    pub tone_map: ToneMap,
    /// Radiance is multiplied by 2 to this power first.
    pub exposure_stops: f64,
    /// Levels of a channel.
    pub bit_depth: BitDepth,
}

/// How many levels a channel of a picture has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BitDepth {
    /// 256.
    #[default]
    Eight,
    /// 65536.
    Sixteen,
}

impl BitDepth {
    /// Bytes of a sample.
    pub fn bytes(self) -> usize {
        match self {
            BitDepth::Eight => 1,
            BitDepth::Sixteen => 2,
        }
    }
}

/// A [`Display`] with all that is the same for every pixel worked out.
#[derive(Clone, Copy, Debug)]
pub struct Mapping {
    curve: Curve,
}

#[derive(Clone, Copy, Debug)]
enum Curve {
    Picture { exposure: f64, operator: Operator, levels: Levels },
    Course,
}

/// The levels are the same for all images.
#[derive(Clone, Copy, Debug)]
enum Levels {
    Eight(&'static SrgbLevels),
    Sixteen(&'static SrgbLevels16),
}

static SRGB_LEVELS: LazyLock<SrgbLevels> = LazyLock::new(SrgbLevels::new);
static SRGB_LEVELS_16: LazyLock<SrgbLevels16> = LazyLock::new(SrgbLevels16::new);

impl Display {
    /// Prepares to map many colours.
    pub fn mapping(&self) -> Mapping {
        let curve = match *self {
            Display::Picture(Picture { tone_map, exposure_stops, bit_depth }) => Curve::Picture {
                exposure: exposure_factor(exposure_stops),
                operator: tone_map.operator(),
                levels: match bit_depth {
                    BitDepth::Eight => Levels::Eight(&SRGB_LEVELS),
                    BitDepth::Sixteen => Levels::Sixteen(&SRGB_LEVELS_16),
                },
            },
            Display::Course => Curve::Course,
        };
        Mapping { curve }
    }

    /// Levels of a channel; the original's are bytes.
    pub fn bit_depth(&self) -> BitDepth {
        match self {
            Display::Picture(picture) => picture.bit_depth,
            Display::Course => BitDepth::Eight,
        }
    }

    /// Whether the levels are those of the sRGB transfer.
    pub fn is_srgb(&self) -> bool {
        matches!(self, Display::Picture(_))
    }
}

impl Mapping {
    /// Maps one colour after another into a file's samples, opaque: RGBA, in 16 bits the upper byte first.
    pub fn fill_rgba(&self, colors: impl Iterator<Item = [f64; 3]>, rgba: &mut [u8]) {
        match self.curve {
            Curve::Picture { exposure, operator, levels: Levels::Eight(levels) } => {
                for (pixel, color) in rgba.chunks_exact_mut(4).zip(colors) {
                    let shown = operator.map(color.map(|c| expose_by(c, exposure)));
                    pixel.copy_from_slice(&opaque8(shown.map(|c| levels.quantize8(c))));
                }
            }
            Curve::Picture { exposure, operator, levels: Levels::Sixteen(levels) } => {
                for (pixel, color) in rgba.chunks_exact_mut(8).zip(colors) {
                    let shown = operator.map(color.map(|c| expose_by(c, exposure)));
                    pixel.copy_from_slice(&opaque16(shown.map(|c| levels.quantize16(c))));
                }
            }
            Curve::Course => {
                for (pixel, color) in rgba.chunks_exact_mut(4).zip(colors) {
                    pixel.copy_from_slice(&opaque8(color.map(course_byte)));
                }
            }
        }
    }
}

fn opaque8([r, g, b]: [u8; 3]) -> [u8; 4] {
    [r, g, b, u8::MAX]
}

fn opaque16(rgb: [u16; 3]) -> [u8; 8] {
    let [[r1, r0], [g1, g0], [b1, b0]] = rgb.map(u16::to_be_bytes);
    [r1, r0, g1, g0, b1, b0, u8::MAX, u8::MAX]
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

    fn rgba(display: Display, color: [f64; 3]) -> Vec<u8> {
        let mut rgba = vec![0; 4 * display.bit_depth().bytes()];
        display.mapping().fill_rgba([color].into_iter(), &mut rgba);
        rgba
    }

    #[test]
    fn course_bytes_are_the_floor_of_256_levels() {
        let below_a_quarter = f64::from_bits(0.25_f64.to_bits() - 1);
        assert_eq!(rgba(Display::Course, [0.0, below_a_quarter, 0.25]), [0, 63, 64, 255]);
        assert_eq!(rgba(Display::Course, [1.0, 7.0, f64::INFINITY]), [255; 4]);
        assert_eq!(rgba(Display::Course, [-3.0, f64::NAN, f64::NEG_INFINITY]), [0, 0, 0, 255]);
    }

    #[test]
    fn exposure_is_applied_before_the_curve() {
        let lit = Picture { exposure_stops: 1.0, ..Picture::default() };
        let plain = rgba(Display::Picture(Picture::default()), [0.18; 3]);
        assert_eq!(rgba(Display::Picture(lit), [0.09; 3]), plain);
        assert_eq!(plain, [105, 105, 105, 255]);
    }

    #[test]
    fn sixteen_bits_come_upper_byte_first() {
        let picture = Picture { tone_map: ToneMap::Clip, bit_depth: BitDepth::Sixteen, ..Picture::default() };
        // 12.92 of 1e-3 is 846.7 of 65535 levels, 0x034f.
        let expected = [0x03, 0x4f, 0x00, 0x00, 0xff, 0xff, 0xff, 0xff];
        assert_eq!(rgba(Display::Picture(picture), [1e-3, -1.0, 2.0]), expected);
    }
}
