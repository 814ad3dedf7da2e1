//! Vertices of a triangle soup made one when their positions are equal, number for number.

use std::collections::HashMap;
use std::hash::{BuildHasher, Hasher, RandomState};

use glam::Vec3;

/// Gives equal positions one row, in the order of their first appearance: the result does not depend on the hash.
/// −0 equals +0; a NaN equals a NaN of the same bits.
#[derive(Debug)]
pub(super) struct Welder {
    rows: HashMap<[u32; 3], u32, Seed>,
    positions: Vec<Vec3>,
}

impl Welder {
    pub fn new() -> Welder {
        Welder { rows: HashMap::with_hasher(Seed::random()), positions: Vec::new() }
    }

    /// The row of a position, new or old. The caller sees to it that there are fewer than 2³² corners.
    #[inline]
    pub fn row(&mut self, position: Vec3) -> u32 {
        let position = position + Vec3::ZERO;
        *self.rows.entry(position.to_array().map(f32::to_bits)).or_insert_with(|| {
            self.positions.push(position);
            self.positions.len() as u32 - 1
        })
    }

    pub fn into_positions(self) -> Vec<Vec3> {
        self.positions
    }
}

/// The standard hash takes longer than the rest of reading an STL file. This one multiplies and folds (as wyhash does),
/// from a random seed, so that no file can be made whose vertices all collide.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seed(u64);

impl Seed {
    pub fn random() -> Seed {
        Seed(RandomState::new().hash_one(0_u64))
    }
}

impl BuildHasher for Seed {
    type Hasher = Fold;

    fn build_hasher(&self) -> Fold {
        Fold { seed: self.0, state: self.0 }
    }
}

pub(super) struct Fold {
    seed: u64,
    state: u64,
}

impl Fold {
    #[inline]
    fn mix(&mut self, word: u64) {
        let product = u128::from(self.state ^ word) * u128::from(self.seed | 1);
        self.state = (product as u64) ^ ((product >> 64) as u64);
    }
}

impl Hasher for Fold {
    fn write(&mut self, bytes: &[u8]) {
        for chunk in bytes.chunks(8) {
            let mut word = [0; 8];
            word[..chunk.len()].copy_from_slice(chunk);
            self.mix(u64::from_ne_bytes(word));
        }
    }

    fn finish(&self) -> u64 {
        let product = u128::from(self.state ^ self.seed) * 0x9e37_79b9_7f4a_7c15;
        (product as u64) ^ ((product >> 64) as u64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_positions_are_one_row_in_order_of_appearance_and_minus_zero_is_zero() {
        let mut welder = Welder::new();
        let nan = Vec3::new(f32::NAN, 0.0, 0.0);
        let corners = [Vec3::X, Vec3::ZERO, -Vec3::ZERO, Vec3::X, nan, nan, Vec3::Y];
        assert_eq!(corners.map(|corner| welder.row(corner)), [0, 1, 1, 0, 2, 2, 3]);
        let positions = welder.into_positions();
        assert_eq!(positions.len(), 4);
        assert!(positions[1].to_array().iter().all(|x| x.is_sign_positive()));
    }
}
