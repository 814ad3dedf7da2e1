//! The lanes that a mask names, one after another.

use std::num::NonZeroU32;

/// The numbers of the bits that are set, from the lowest on.
#[inline(always)]
pub fn set_bits(mask: u32) -> SetBits {
    SetBits(mask)
}

/// See [`set_bits`].
#[derive(Clone, Copy, Debug)]
pub struct SetBits(u32);

impl Iterator for SetBits {
    type Item = usize;

    #[inline(always)]
    fn next(&mut self) -> Option<usize> {
        // Non-zero, so that the number is known to be below 32.
        let mask = NonZeroU32::new(self.0)?;
        self.0 &= self.0 - 1;
        Some(mask.trailing_zeros() as usize)
    }
}

/// The lowest four bits of a mask, one per byte.
#[inline(always)]
pub fn bytes_of_bits(mask: u32) -> u32 {
    // Bit i is copied to bit 8i by the i-th summand of the factor, 1 + 2⁷ + 2¹⁴ + 2²¹.
    (mask & 0b1111).wrapping_mul(0x0020_4081) & 0x0101_0101
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_bit_that_is_set_comes_once_in_order() {
        for mask in 0..16 {
            let bytes = std::array::from_fn(|i| (mask >> i & 1) as u8);
            assert_eq!(bytes_of_bits(mask).to_le_bytes(), bytes);
            assert_eq!(bytes_of_bits(mask | 0x70), bytes_of_bits(mask));
        }
        for mask in [0, 1, 1 << 31, u32::MAX, 0b1011_0110] {
            assert!(set_bits(mask).eq((0..32).filter(|i| mask >> i & 1 == 1)));
        }
    }
}
