//! The sRGB transfer between linear display values and encoded ones, and levels of 8 and 16 bits.

/// Up to here the transfer is a straight line.
const LINEAR_END: f64 = 0.003_130_8;

/// The sRGB transfer: a linear display value to an encoded one (IEC 61966-2-1:1999, 5.2). Values outside 0 … 1 are
/// clamped and NaN gives 0.
pub fn srgb_from_linear(linear: f64) -> f64 {
    if linear >= 1.0 {
        1.0
    } else if linear > LINEAR_END {
        curved(linear)
    } else if linear > 0.0 {
        12.92 * linear
    } else {
        0.0
    }
}

/// The transfer above [`LINEAR_END`].
fn curved(linear: f64) -> f64 {
    1.055 * libm::pow(linear, 1.0 / 2.4) - 0.055
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

/// An encoded value in 0 … 1 to the nearest of 65536 levels.
pub fn quantize16(encoded: f64) -> u16 {
    (encoded * 65_535.0 + 0.5) as u16
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

/// The nearest of 65536 sRGB levels to linear values, without a power for most: chords of the curve decide unless a value
/// lies so near to the middle of two levels that they might be wrong.
#[derive(Clone, Debug)]
pub struct SrgbLevels16 {
    /// The curve in levels where cells meet, up to 1. Cells are 512 equal parts of each octave.
    nodes: Vec<f64>,
}

impl SrgbLevels16 {
    /// The last octave that reaches below [`LINEAR_END`] begins here: 2⁻⁹.
    const LEAST: f64 = 1.0 / 512.0;
    /// Bits of a number's fraction that name its cell.
    const CELL_BITS: u32 = 9;
    const FRACTION_BITS: u32 = 52 - Self::CELL_BITS;
    /// How far a chord may be from the curve, in levels. The curve's second derivative is at most 65535·1.055·(1/2.4)·(1 −
    /// 1/2.4)·b^(1/2.4 − 2) in the octave from b on, where a cell is b/512 long: an eighth of their product with the length
    /// squared is at most 0.0061, for b = 1/2. The rest is far more than rounding needs.
    const MARGIN: f64 = 1.0 / 128.0;

    /// Works out the nodes.
    pub fn new() -> SrgbLevels16 {
        let n_octaves = (1.0_f64.to_bits() - Self::LEAST.to_bits()) >> 52;
        let n_nodes = (n_octaves << Self::CELL_BITS) + 1;
        let node = |index: u64| f64::from_bits(Self::LEAST.to_bits() + (index << Self::FRACTION_BITS));
        SrgbLevels16 { nodes: (0..n_nodes).map(|index| 65_535.0 * curved(node(index))).collect() }
    }

    /// The level nearest to the encoded value: [`quantize16`] of [`srgb_from_linear`]. Values outside 0 … 1 are clamped and
    /// NaN gives 0.
    #[inline]
    pub fn quantize16(&self, linear: f64) -> u16 {
        if linear >= 1.0 {
            return u16::MAX;
        }
        // NaN is not above it either.
        if linear > LINEAR_END {
            let offset = linear.to_bits() - Self::LEAST.to_bits();
            let cell = (offset >> Self::FRACTION_BITS) as usize;
            let fraction = (offset & ((1 << Self::FRACTION_BITS) - 1)) as f64 / (1_u64 << Self::FRACTION_BITS) as f64;
            let (low, high) = (self.nodes[cell], self.nodes[cell + 1]);
            let above_middle = low + (high - low) * fraction + 0.5;
            let level = above_middle as u16;
            let rest = above_middle - f64::from(level);
            if (Self::MARGIN..1.0 - Self::MARGIN).contains(&rest) {
                return level;
            }
        }
        quantize16(srgb_from_linear(linear))
    }
}

impl Default for SrgbLevels16 {
    fn default() -> SrgbLevels16 {
        SrgbLevels16::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ODD: [f64; 7] = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -0.0, 1e-300, f64::MAX, LINEAR_END];

    #[test]
    fn levels_are_those_of_the_curve_everywhere() {
        let levels = SrgbLevels::new();
        let agree = |linear: f64| assert_eq!(levels.quantize8(linear), quantize8(srgb_from_linear(linear)), "{linear}");
        (0..=400_000).for_each(|step| agree(f64::from(step) / 300_000.0 - 0.1));
        for &begin in &levels.begins[1..256] {
            [begin.next_down(), begin, begin.next_up()].into_iter().for_each(agree);
        }
        ODD.into_iter().for_each(agree);
    }

    /// Where to look around the middle of two levels, as shares of it; results have to be equal, so that these are no
    /// tolerances.
    const PLACES_BESIDE: [f64; 5] = [1e-14, 1e-9, 1e-8, 1e-7, 1e-6];

    #[test]
    fn sixteen_bit_levels_are_those_of_the_curve_everywhere() {
        let levels = SrgbLevels16::new();
        let agree =
            |linear: f64| assert_eq!(levels.quantize16(linear), quantize16(srgb_from_linear(linear)), "{linear:e}");
        (0..=2_000_000).for_each(|step| agree(f64::from(step) / 1_900_000.0 - 0.01));
        // Around the middle of each two neighbours, to the last place and by shares of a level.
        for level in 0..65_535 {
            let middle = linear_from_srgb((f64::from(level) + 0.5) / 65_535.0);
            [middle.next_down(), middle, middle.next_up()].into_iter().for_each(agree);
            PLACES_BESIDE.into_iter().for_each(|off| {
                agree(middle * (1.0 - off));
                agree(middle * (1.0 + off));
            });
        }
        ODD.into_iter().chain([LINEAR_END.next_up(), 1.0_f64.next_down(), 1.0]).for_each(agree);
    }

    #[test]
    fn chords_stay_within_their_margin() {
        let levels = SrgbLevels16::new();
        let widest = levels.nodes.windows(2).enumerate().map(|(cell, ends)| {
            let bits = SrgbLevels16::LEAST.to_bits() + ((cell as u64) << SrgbLevels16::FRACTION_BITS);
            let middle = f64::from_bits(bits + (1 << (SrgbLevels16::FRACTION_BITS - 1)));
            65_535.0 * curved(middle) - 0.5 * (ends[0] + ends[1])
        });
        let widest = widest.fold(0.0, f64::max);
        assert!((0.005..0.0062).contains(&widest), "{widest}");
    }

    #[test]
    fn every_level_survives_decoding_and_encoding() {
        for byte in 0..=255_u8 {
            assert_eq!(quantize8(srgb_from_linear(linear_from_srgb(f64::from(byte) / 255.0))), byte);
        }
        for level in 0..=u16::MAX {
            assert_eq!(quantize16(srgb_from_linear(linear_from_srgb(f64::from(level) / 65_535.0))), level);
        }
        assert_eq!(linear_from_srgb(1.0), 1.0);
        // IEC 61966-2-1: byte 188 is half the light to within half a level.
        assert!((linear_from_srgb(188.0 / 255.0) - 0.5).abs() < 0.005);
    }
}
