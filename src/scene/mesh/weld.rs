//! Equal rows made one: vertices of a triangle soup that have the same position, faces that have the same vertices.

use std::collections::HashMap;
use std::hash::{BuildHasher, Hasher, RandomState};
use std::sync::atomic::{AtomicU32, Ordering};

use glam::Vec3;
use rayon::prelude::*;

/// Three words that rows are compared by.
pub(super) type Key = [u32; 3];

/// The bits of a position as a key: −0 equals +0, a NaN equals a NaN of the same bits.
#[inline]
pub(super) fn position_key(position: Vec3) -> Key {
    (position + Vec3::ZERO).to_array().map(f32::to_bits)
}

/// What numbering finds: for each row the numbers of its keys, and the distinct keys by number.
pub(super) struct Numbered<const N: usize> {
    pub rows: Vec<[u32; N]>,
    pub keys: Vec<Key>,
}

/// Keys that one thread numbers by itself: the table of so many stays in its cache.
const BLOCK_KEYS: usize = 48 << 10;

/// Parts that keys are dealt out to by their hash. The table of a part stays in a thread's cache up to some ten million
/// distinct keys.
const N_PARTS: usize = 256;

/// The distinct keys of a block in the order of their first appearance; and the same dealt out to the parts, each with
/// its place in that order.
struct Block {
    distinct: Vec<Key>,
    dealt: Vec<(Key, u32)>,
    /// Where each part ends in `dealt`.
    part_ends: [u32; N_PARTS],
}

impl Block {
    fn new(distinct: Vec<Key>, seed: Seed) -> Block {
        let part_of = |key: &Key| (seed.hash_one(key) >> 32) as usize % N_PARTS;
        let mut part_ends = [0; N_PARTS];
        distinct.iter().for_each(|key| part_ends[part_of(key)] += 1);
        let mut end = 0;
        let mut places = part_ends.map(|n_keys| {
            end += n_keys;
            end - n_keys
        });
        let mut dealt = vec![([0; 3], 0); distinct.len()];
        for (row, &key) in distinct.iter().enumerate() {
            let place = &mut places[part_of(&key)];
            dealt[*place as usize] = (key, row as u32);
            *place += 1;
        }
        Block { distinct, dealt, part_ends: places }
    }

    fn part(&self, part: usize) -> &[(Key, u32)] {
        let start = part.checked_sub(1).map_or(0, |before| self.part_ends[before]);
        &self.dealt[start as usize..self.part_ends[part] as usize]
    }
}

/// Numbers the distinct keys of `n_rows` rows with `N` keys each in the order of their first appearance, whatever the
/// number of threads. The caller sees to it that there are fewer than 2³² keys.
///
/// Rows near each other share most of their keys: each block numbers its own first, and only what is distinct in a block
/// meets the keys of all others.
pub(super) fn number<const N: usize>(n_rows: usize, keys_of: impl Fn(usize) -> [Key; N] + Sync) -> Numbered<N> {
    let seed = Seed::random();
    let n_rows_each = (BLOCK_KEYS / N).max(1);

    // Number each block by itself.
    let mut rows = vec![[0; N]; n_rows];
    let new_table = || HashMap::<Key, u32, Seed>::with_hasher(seed);
    let blocks = rows.par_chunks_mut(n_rows_each).enumerate().map_init(new_table, |table, (block, rows)| {
        table.clear();
        let mut distinct = Vec::new();
        for (row, numbers) in rows.iter_mut().enumerate() {
            let keys = keys_of(block * n_rows_each + row);
            *numbers = keys.map(|key| {
                *table.entry(key).or_insert_with(|| {
                    distinct.push(key);
                    distinct.len() as u32 - 1
                })
            });
        }
        Block::new(distinct, seed)
    });
    let blocks: Vec<Block> = blocks.collect();

    // Of the distinct keys of all blocks find for each the first that equals it, and number those that are the first.
    let (starts, firsts) = first_equals(&blocks, seed);
    let mut numbers: Vec<u32> = Vec::with_capacity(firsts.len());
    let mut keys = Vec::new();
    for (row, &key) in blocks.iter().flat_map(|block| &block.distinct).enumerate() {
        let first = firsts[row].load(Ordering::Relaxed) as usize;
        numbers.push(if first == row { keys.len() as u32 } else { numbers[first] });
        if first == row {
            keys.push(key);
        }
    }

    // Replace the numbers of the blocks by those of all.
    rows.par_chunks_mut(n_rows_each).zip(&starts).for_each(|(rows, &start)| {
        rows.as_flattened_mut().iter_mut().for_each(|number| *number = numbers[start as usize + *number as usize]);
    });
    Numbered { rows, keys }
}

/// Where the distinct keys of each block begin among those of all; and for each of all the place of the first that
/// equals it.
fn first_equals(blocks: &[Block], seed: Seed) -> (Vec<u32>, Vec<AtomicU32>) {
    let mut n_keys = 0;
    let mut starts = Vec::with_capacity(blocks.len());
    for block in blocks {
        starts.push(n_keys);
        n_keys += block.distinct.len() as u32;
    }
    let firsts: Vec<AtomicU32> = (0..n_keys).map(|_| AtomicU32::new(0)).collect();
    let new_table = || HashMap::<Key, u32, Seed>::with_hasher(seed);
    (0..N_PARTS).into_par_iter().for_each_init(new_table, |table, part| {
        table.clear();
        for (block, &start) in blocks.iter().zip(&starts) {
            for &(key, row) in block.part(part) {
                let first = *table.entry(key).or_insert(start + row);
                firsts[(start + row) as usize].store(first, Ordering::Relaxed);
            }
        }
    });
    (starts, firsts)
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
    #[inline]
    fn write(&mut self, bytes: &[u8]) {
        for chunk in bytes.chunks(8) {
            let mut word = [0; 8];
            word[..chunk.len()].copy_from_slice(chunk);
            self.mix(u64::from_ne_bytes(word));
        }
    }

    /// The length of an array is the same for all keys.
    #[inline]
    fn write_usize(&mut self, _: usize) {}

    #[inline]
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
        let nan = Vec3::new(f32::NAN, 0.0, 0.0);
        let corners = [Vec3::X, Vec3::ZERO, -Vec3::ZERO, Vec3::X, nan, nan, Vec3::Y];
        let Numbered { rows, keys } = number(corners.len(), |row| [position_key(corners[row])]);
        assert_eq!(rows.concat(), [0, 1, 1, 0, 2, 2, 3]);
        assert_eq!((keys.len(), keys[1]), (4, [0; 3]));
    }

    #[test]
    fn blocks_and_threads_do_not_show_in_the_numbers() {
        let n = 3 * BLOCK_KEYS + 11;
        let key = |at: usize| [(at * 7919 % 50_021) as u32, (at % 3) as u32, 0];
        let mut known = HashMap::new();
        let expected: Vec<u32> = (0..n)
            .map(|at| {
                let next = known.len() as u32;
                *known.entry(key(at)).or_insert(next)
            })
            .collect();
        for n_threads in [1, 3] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().unwrap();
            let Numbered { rows, keys } = pool.install(|| number(n, |at| [key(at)]));
            assert_eq!(rows.as_flattened(), expected, "{n_threads} threads");
            assert!(rows.iter().enumerate().all(|(at, &[row])| keys[row as usize] == key(at)));
        }
        let Numbered { rows, .. } = number(n / 2, |at| [key(2 * at), key(2 * at + 1)]);
        assert_eq!(rows.as_flattened(), &expected[..n / 2 * 2]);
    }
}
