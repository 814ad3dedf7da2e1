//! The lanes that a mask names, one after another.

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
        let i = self.0.trailing_zeros() as usize;
        (self.0 != 0).then(|| {
            self.0 &= self.0 - 1;
            i
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_bit_that_is_set_comes_once_in_order() {
        for mask in [0, 1, 1 << 31, u32::MAX, 0b1011_0110] {
            assert!(set_bits(mask).eq((0..32).filter(|i| mask >> i & 1 == 1)));
        }
    }
}
