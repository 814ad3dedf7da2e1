//! What is still to be visited: packed items, and the order in which a node's children are pushed.

use super::slab::{SlabRay, WIDTH};
use super::wide::{Tag, WideNode};
use crate::simd::Simd;

/// Something that the ray may meet: a lower bound of the parameter at which it does (24 bits, rounded down), the tag and
/// the index of a child, from the highest bits to the lowest. So items compare as their parameters do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(transparent)]
pub struct Item(pub u64);

/// Bits below the parameter.
const PARAMETER_SHIFT: u32 = 40;

impl Item {
    /// The root of a tree, met from the beginning.
    pub const ROOT: Item = Item(0);

    /// The largest item that a ray cut at `t_max` may still meet. `t_max` must not be negative.
    #[inline(always)]
    pub fn limit(t_max: f32) -> Item {
        Item(u64::from(t_max.to_bits()) << 32 | ((1 << PARAMETER_SHIFT) - 1))
    }

    /// What it is.
    #[inline(always)]
    pub fn tag(self) -> Tag {
        Tag::from_bits((self.0 >> 32) as u8)
    }

    /// Index of a node, or of the first row of a leaf.
    #[inline(always)]
    pub fn child(self) -> u32 {
        self.0 as u32
    }
}

/// Packs the children of a node that a ray, cut at `t_max`, may meet, the nearest last; how many they are. Room for
/// [`WIDTH`] is needed.
#[inline(always)]
pub fn pack_children<S: Simd>(simd: S, node: &WideNode, slab: &SlabRay, t_max: f32, to: &mut [u64]) -> usize {
    let (t_near, mask) = slab.hits(simd, &node.slabs, t_max);
    let order = &ORDER[slab.octant as usize % WIDTH][mask as usize % 256];
    if let Some(to) = to.first_chunk_mut() {
        simd.pack(t_near, node.tag_bits(), &node.child, order, to);
    }
    mask.count_ones() as usize
}

/// Takes the last of some items that lies within the limit, and drops those behind it.
#[inline(always)]
pub fn pop(items: &[u64], n_items: &mut usize, limit: Item) -> Option<Item> {
    // The count stays in a register.
    let mut n = *n_items;
    while n > 0 {
        n -= 1;
        let item = Item(*items.get(n)?);
        if item <= limit {
            *n_items = n;
            return Some(item);
        }
    }
    *n_items = 0;
    None
}

/// Slots in a mask, in the order in which a ray of an octant pushes them: by falling slot XOR octant, so that the nearest
/// comes last and is visited first.
static ORDER: [[[u8; WIDTH]; 256]; 8] = {
    let mut order = [[[0; WIDTH]; 256]; 8];
    let mut octant = 0;
    while octant < 8 {
        let mut mask = 0;
        while mask < 256 {
            let (mut n, mut place) = (0, WIDTH);
            while place > 0 {
                place -= 1;
                let slot = place ^ octant;
                if mask >> slot & 1 == 1 {
                    order[octant][mask][n] = slot as u8;
                    n += 1;
                }
            }
            mask += 1;
        }
        octant += 1;
    }
    order
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_slot_of_a_mask_is_pushed_once_and_the_nearest_last() {
        for (octant, by_mask) in ORDER.iter().enumerate() {
            for (mask, order) in by_mask.iter().enumerate() {
                let n = mask.count_ones() as usize;
                let set = order[..n].iter().fold(0, |set, slot| set | 1 << slot);
                assert_eq!(set, mask);
                assert!(order[..n].is_sorted_by(|&a, &b| a as usize ^ octant > b as usize ^ octant));
            }
        }
    }

    #[test]
    fn an_item_at_the_limit_is_kept_and_one_beyond_is_not() {
        let item = |t: f32| Item(u64::from(t.to_bits() & !0xff) << 32 | 0xff_ffff_ffff);
        for t in [0.0, 1e-40, 1.0, 3.0e38, f32::INFINITY] {
            assert!(item(t) <= Item::limit(t));
            assert!(item(f32::from_bits(t.to_bits() + 256)) > Item::limit(t));
        }
    }
}
