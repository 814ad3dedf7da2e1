//! Boxes along a Morton curve: neighbours on the curve are neighbours in space (Morton 1966).

use glam::{UVec3, Vec3};
use rayon::prelude::*;

use super::area::Scale;
use crate::world::Bounds;

/// Boxes in the order of their centres along the curve. Each is one number, the place on the curve above the index, so
/// that sorting numbers sorts boxes, and the order of equal places is that of indices.
#[derive(Debug)]
pub struct Curve {
    keys: Vec<u64>,
    index_bits: u32,
}

impl Curve {
    /// Sorts boxes.
    pub fn through(boxes: &[Bounds], scale: &Scale) -> Curve {
        let index_bits = usize::BITS - boxes.len().leading_zeros();
        let axis_bits = ((u64::BITS - index_bits) / 3).min(21);
        let key =
            |(index, bounds): (usize, &Bounds)| place(scale.center(bounds), axis_bits) << index_bits | index as u64;
        let mut keys: Vec<u64> = boxes.par_iter().enumerate().map(key).collect();
        keys.par_sort_unstable();
        Curve { keys, index_bits }
    }

    /// Cuts the curve into pieces of about `size` boxes, between places.
    pub fn pieces(&self, size: usize) -> Vec<&[u64]> {
        let mut pieces = Vec::with_capacity(self.keys.len() / size + 1);
        let mut rest = self.keys.as_slice();
        while !rest.is_empty() {
            let at = size.min(rest.len());
            let cut = at + rest[at..].partition_point(|&key| self.place(key) == self.place(rest[at - 1]));
            let (piece, behind) = rest.split_at(cut);
            pieces.push(piece);
            rest = behind;
        }
        pieces
    }

    /// Runs of boxes with one place on the curve, each the indices of its boxes.
    pub fn places(&self, piece: &[u64]) -> impl Iterator<Item = impl Iterator<Item = usize>> {
        let index = |&key: &u64| (key & ((1 << self.index_bits) - 1)) as usize;
        piece.chunk_by(|&a, &b| self.place(a) == self.place(b)).map(move |place| place.iter().map(index))
    }

    fn place(&self, key: u64) -> u64 {
        key >> self.index_bits
    }
}

/// The place on a curve through a grid of 2^`axis_bits` cells along each axis, at most 21 bits, of a point of the unit
/// cube. NaN counts as 0.
pub fn place(p: Vec3, axis_bits: u32) -> u64 {
    interleave(cell(p, axis_bits))
}

/// The cell of a grid of 2^`bits` cells along each axis that a point of the unit cube lies in.
fn cell(p: Vec3, bits: u32) -> UVec3 {
    let n_cells = (1u32 << bits) as f32;
    // The conversion saturates below, and takes NaN for 0.
    (p * n_cells).as_uvec3().min(UVec3::splat((1 << bits) - 1))
}

/// Interleaves the bits of three numbers of at most 21 bits.
fn interleave(p: UVec3) -> u64 {
    let spread = |x: u32| {
        let x = u64::from(x);
        let x = (x | x << 32) & 0x001f_0000_0000_ffff;
        let x = (x | x << 16) & 0x001f_0000_ff00_00ff;
        let x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
        let x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
        (x | x << 2) & 0x1249_2492_4924_9249
    };
    spread(p.x) | spread(p.y) << 1 | spread(p.z) << 2
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_bit_has_its_place() {
        for bit in 0..21 {
            for axis in 0..3 {
                let mut p = UVec3::ZERO;
                p[axis] = 1 << bit;
                assert_eq!(interleave(p), 1 << (3 * bit + axis));
            }
        }
    }

    #[test]
    fn boxes_come_in_the_order_of_the_curve_and_equal_ones_in_that_of_indices() {
        let at = |x: f32, y: f32, z: f32| Bounds { lo: Vec3::new(x, y, z), hi: Vec3::new(x, y, z) };
        let boxes = [at(1.0, 1.0, 1.0), at(0.0, 0.0, 0.0), at(0.0, 1.0, 0.0), at(0.0, 0.0, 0.0), at(1.0, 0.0, 0.0)];
        let curve = Curve::through(&boxes, &Scale::of(&boxes));
        let pieces = curve.pieces(1);
        assert_eq!(pieces.iter().map(|piece| piece.len()).collect::<Vec<_>>(), [2, 1, 1, 1]);
        let indices = pieces.iter().flat_map(|piece| curve.places(piece)).flatten();
        assert_eq!(indices.collect::<Vec<_>>(), [1, 3, 4, 2, 0]);
        assert_eq!(curve.pieces(4).len(), 2);
    }
}
