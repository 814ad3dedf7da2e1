//! Curves between scene-linear radiance and display values: pure functions of numbers.
//!
//! Powers come from `libm`, not from the platform's C library, so that the same value gives the same bits everywhere.

/// Largest radiance that the tone curve works with, that of a 32-bit float; anything above, infinity included, is as
/// white. It keeps every product inside the curve finite.
const MAX_RADIANCE: f64 = f32::MAX as f64;

/// What radiance is multiplied by for an exposure: 2^`exposure_stops`.
pub fn exposure_factor(exposure_stops: f64) -> f64 {
    libm::exp2(exposure_stops)
}

/// Radiance of one channel made fit for the tone curve: multiplied by the [`exposure_factor`], then NaN and negative
/// values become 0 and values above the largest 32-bit float become that.
#[inline]
pub fn expose_by(radiance: f64, factor: f64) -> f64 {
    let exposed = radiance * factor;
    if exposed > 0.0 { exposed.min(MAX_RADIANCE) } else { 0.0 }
}

/// The Khronos PBR Neutral tone curve: linear Rec. 709 radiance to linear display values in 0 … 1.
///
/// Source: Khronos Group, *PBR Neutral Tone Mapper* specification (repository `ToneMapping`, folder `PBR_Neutral`), with
/// its constants F₉₀ = 0.04, start of compression 0.8 − F₉₀, desaturation 0.15. Colours whose largest channel is below
/// 0.8 only lose the offset, the 4 % that a dielectric reflects at normal incidence (less where the smallest channel is
/// below 0.08); brighter ones are compressed and drawn towards white. Inputs are finite and not negative (see
/// [`expose_by`]).
pub fn pbr_neutral(color: [f64; 3]) -> [f64; 3] {
    const F90: f64 = 0.04;
    const START_COMPRESSION: f64 = 0.8 - F90;
    const DESATURATION: f64 = 0.15;

    let smallest = color[0].min(color[1]).min(color[2]);
    let offset = if smallest < 2.0 * F90 { smallest - smallest * smallest / (4.0 * F90) } else { F90 };
    let color = color.map(|c| c - offset);

    let peak = color[0].max(color[1]).max(color[2]);
    if peak < START_COMPRESSION {
        return color;
    }
    let room = 1.0 - START_COMPRESSION;
    let new_peak = 1.0 - room * room / (peak + room - START_COMPRESSION);
    let whiteness = 1.0 - 1.0 / (DESATURATION * (peak - new_peak) + 1.0);
    color.map(|c| {
        let scaled = c * (new_peak / peak);
        scaled * (1.0 - whiteness) + new_peak * whiteness
    })
}

/// The sRGB transfer: a linear display value to an encoded one (IEC 61966-2-1:1999, 5.2). Values outside 0 … 1 are
/// clamped and NaN gives 0.
pub fn srgb_from_linear(linear: f64) -> f64 {
    if linear >= 1.0 {
        1.0
    } else if linear > 0.003_130_8 {
        1.055 * libm::pow(linear, 1.0 / 2.4) - 0.055
    } else if linear > 0.0 {
        12.92 * linear
    } else {
        0.0
    }
}

/// The inverse sRGB transfer: an encoded value in 0 … 1 to a linear one (IEC 61966-2-1:1999, 5.3). 0 and 1 are exact.
pub fn linear_from_srgb(encoded: f64) -> f64 {
    if encoded > 0.040_45 { libm::pow((encoded + 0.055) / 1.055, 2.4) } else { encoded / 12.92 }
}

/// An encoded value in 0 … 1 to the nearest of 256 levels.
pub fn quantize8(encoded: f64) -> u8 {
    // `as` saturates and takes NaN to 0.
    (encoded * 255.0 + 0.5) as u8
}

/// The nearest of 256 sRGB levels to linear values, without a power for each: where every level begins is worked out once.
#[derive(Clone, Debug)]
pub struct SrgbLevels {
    /// The least linear value that is nearest to a level or above it; level 0 begins at −∞, and none begins at 256.
    begins: [f64; 257],
    /// The level at the beginning of each of [`SrgbLevels::N_CELLS`] equal cells of 0 … 1, and at 1.
    of_cell: Vec<u8>,
}

impl SrgbLevels {
    /// So many that no cell holds two beginnings: the curve is steepest at black, 255·12.92 = 3295 levels a unit.
    const N_CELLS: usize = 4096;

    /// Finds each beginning by bisection of the curve itself, [`srgb_from_linear`] and [`quantize8`].
    pub fn new() -> SrgbLevels {
        let level_of = |linear: f64| quantize8(srgb_from_linear(linear));
        let mut begins = [f64::INFINITY; 257];
        begins[0] = f64::NEG_INFINITY;
        for (level, begin) in begins.iter_mut().enumerate().take(256).skip(1) {
            // Between the middles of two levels; positive numbers are in the order of their bits.
            let middle_of = |level: usize| linear_from_srgb(level as f64 / 255.0).to_bits();
            let (mut below, mut at) = (middle_of(level - 1), middle_of(level));
            while at - below > 1 {
                let middle = below + (at - below) / 2;
                if usize::from(level_of(f64::from_bits(middle))) < level { below = middle } else { at = middle }
            }
            *begin = f64::from_bits(at);
        }
        let of_cell = (0..=Self::N_CELLS).map(|cell| level_of(cell as f64 / Self::N_CELLS as f64)).collect();
        SrgbLevels { begins, of_cell }
    }

    /// The level nearest to the encoded value. Values outside 0 … 1 are clamped and NaN gives 0.
    #[inline]
    pub fn quantize8(&self, linear: f64) -> u8 {
        // NaN is not above zero either.
        let inside = if linear > 0.0 { linear.min(1.0) } else { return 0 };
        let cell = (inside * Self::N_CELLS as f64) as usize;
        let level = self.of_cell[cell];
        // Not a branch: where in its cell a value lies nobody can foretell.
        level + u8::from(inside >= self.begins[usize::from(level) + 1])
    }
}

impl Default for SrgbLevels {
    fn default() -> SrgbLevels {
        SrgbLevels::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn expose(radiance: f64, exposure_stops: f64) -> f64 {
        expose_by(radiance, exposure_factor(exposure_stops))
    }

    fn neutral_srgb8(color: [f64; 3]) -> [u8; 3] {
        pbr_neutral(color.map(|c| expose(c, 0.0))).map(|c| quantize8(srgb_from_linear(c)))
    }

    #[test]
    fn greys_get_the_published_bytes() {
        for (grey, byte) in [(0.0, 0), (0.18, 105), (1.0, 240), (4.0, 253), (16.0, 255)] {
            assert_eq!(neutral_srgb8([grey; 3]), [byte; 3], "grey {grey}");
        }
    }

    #[test]
    fn below_the_start_of_compression_only_the_offset_is_taken() {
        for color in [[0.08, 0.3, 0.7], [0.1, 0.79, 0.2]] {
            let mapped = pbr_neutral(color);
            for channel in 0..3 {
                assert!((mapped[channel] - (color[channel] - 0.04)).abs() < 1e-15);
            }
        }
        // With no white in the colour nothing is taken at all.
        assert_eq!(pbr_neutral([0.0, 0.5, 0.7]), [0.0, 0.5, 0.7]);
    }

    #[test]
    fn the_curve_is_continuous_where_its_pieces_meet() {
        for joint in [0.08, 0.8] {
            let below = pbr_neutral([joint - 1e-12; 3])[0];
            let above = pbr_neutral([joint + 1e-12; 3])[0];
            assert!((above - below).abs() < 1e-11 && above >= below, "{joint}: {below} {above}");
        }
    }

    #[test]
    fn bright_saturated_colours_go_towards_white() {
        let mild = pbr_neutral([2.0, 0.0, 0.0]);
        let strong = pbr_neutral([200.0, 0.0, 0.0]);
        assert!(mild[1] > 0.0 && strong[1] > mild[1] && strong[1] < strong[0] && strong[0] < 1.0);
    }

    #[test]
    fn nan_and_negative_radiance_is_black_and_infinite_is_white() {
        assert_eq!(neutral_srgb8([f64::NAN; 3]), [0; 3]);
        assert_eq!(neutral_srgb8([-1.0, f64::NEG_INFINITY, -0.0]), [0; 3]);
        assert_eq!(neutral_srgb8([f64::INFINITY; 3]), [255; 3]);
        assert_eq!(neutral_srgb8([f64::INFINITY, 0.0, f64::NAN]), [255; 3]);
        assert_eq!(expose(0.0, 5000.0), 0.0);
        assert_eq!(expose(1.0, -5000.0), 0.0);
    }

    #[test]
    fn levels_are_those_of_the_curve_everywhere() {
        let levels = SrgbLevels::new();
        let agree = |linear: f64| assert_eq!(levels.quantize8(linear), quantize8(srgb_from_linear(linear)), "{linear}");
        (0..=400_000).for_each(|step| agree(f64::from(step) / 300_000.0 - 0.1));
        for &begin in &levels.begins[1..256] {
            [begin.next_down(), begin, begin.next_up()].into_iter().for_each(agree);
        }
        [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -0.0, 1e-300, f64::MAX].into_iter().for_each(agree);
    }

    #[test]
    fn a_stop_of_exposure_doubles() {
        assert_eq!(expose(0.25, 1.0), 0.5);
        assert_eq!(expose(0.25, -2.0), 0.0625);
    }

    #[test]
    fn every_srgb_byte_survives_decoding_and_encoding() {
        for byte in 0..=255_u8 {
            assert_eq!(quantize8(srgb_from_linear(linear_from_srgb(f64::from(byte) / 255.0))), byte);
        }
        assert_eq!(linear_from_srgb(1.0), 1.0);
        // IEC 61966-2-1: byte 188 is half the light to within half a level.
        assert!((linear_from_srgb(188.0 / 255.0) - 0.5).abs() < 0.005);
    }
}
