//! What is still to be visited: items, and the order in which a node's children are pushed.

use super::slab::{SlabLanes, SlabRay, WIDTH};
use super::wide::{N_COORDINATES, Tag, WideNode, WideTree};
use crate::simd::Simd;

/// Something that the ray may meet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Item {
    /// A lower bound of the parameter at which it is met (24 bits, rounded down), above the bits of the tag of a child. So keys
    /// compare as their parameters do.
    key: u32,
    child: u32,
}

/// The largest key of what a ray may still meet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limit(u32);

/// Bits of a key that are not the parameter's.
const TAG_BITS: u32 = 0xff;

impl Item {
    /// The root of a tree, met from the beginning.
    pub const ROOT: Item = Item { key: 0, child: 0 };

    /// What lies at the bottom of a walk, met whatever its limit.
    pub const END: Item = Item { key: Tag::END.bits() as u32, child: 0 };

    /// The item of a key and a child.
    #[inline(always)]
    pub fn new(key: u32, child: u32) -> Item {
        Item { key, child }
    }

    /// Its key.
    #[inline(always)]
    pub fn key(self) -> u32 {
        self.key
    }

    /// No ray meets it before this parameter.
    #[inline(always)]
    pub fn t_near(self) -> f32 {
        f32::from_bits(self.key & !TAG_BITS)
    }

    /// What it is.
    #[inline(always)]
    pub fn tag(self) -> Tag {
        Tag::from_bits(self.key as u8)
    }

    /// Asks for its memory ahead of time; of a leaf that is not of triangles in vain.
    #[inline(always)]
    pub fn prefetch<S: Simd>(self, simd: S, tree: &WideTree) {
        let (is_leaf, child) = (self.tag().is_leaf(), self.child as usize);
        let row = if is_leaf { N_COORDINATES * child } else { child };
        simd.prefetch_either(&tree.nodes, &tree.corners, is_leaf, row);
    }

    /// Index of a node, or of the first row of a leaf.
    #[inline(always)]
    pub fn child(self) -> u32 {
        self.child
    }
}

impl Limit {
    /// Whether a key is within it.
    #[inline(always)]
    pub fn allows(self, key: u32) -> bool {
        key <= self.0
    }

    /// That of a ray cut at `t_max`, which must not be negative.
    #[inline(always)]
    pub fn at(t_max: f32) -> Limit {
        Limit(t_max.to_bits() | TAG_BITS)
    }
}

/// Writes the keys and the children of what a ray, cut at `t_max`, may meet in a node, the nearest last; how many they are. Room
/// for [`WIDTH`] is needed.
#[inline(always)]
pub fn pack_children<S: Simd>(
    simd: S,
    node: &WideNode,
    slab: &SlabRay,
    t_max: f32,
    keys: &mut [u32],
    children: &mut [u32],
) -> usize {
    let (t_near, mask) = slab.hits(simd, &node.slabs, t_max);
    pack(simd, node, slab.octant, t_near, mask, keys, children);
    mask.count_ones() as usize
}

/// Writes what [`pack_children`] does, and says which is the nearest and how many there are besides: that one is known sooner
/// than it could be read back.
#[inline(always)]
pub fn open_node<S: Simd>(
    simd: S,
    node: &WideNode,
    slab: &SlabLanes<S::F32>,
    octant: u8,
    t_max: f32,
    keys: &mut [u32],
    children: &mut [u32],
) -> Option<(Item, usize)> {
    let (t_near, mask) = slab.hits(simd, &node.slabs, octant, t_max);
    if mask == 0 {
        return None;
    }
    pack(simd, node, octant, t_near, mask, keys, children);
    let n_others = mask.count_ones() as usize - 1;
    let nearest = NEAREST[octant as usize % WIDTH][mask as usize % 256] as usize % WIDTH;
    Some((Item { key: node.tag_bits()[nearest].into(), child: node.child[nearest] }, n_others))
}

/// Writes the keys and the children that a mask names, in their order.
#[inline(always)]
fn pack<S: Simd>(
    simd: S,
    node: &WideNode,
    octant: u8,
    t_near: S::F32,
    mask: u32,
    keys: &mut [u32],
    children: &mut [u32],
) {
    let order = &ORDER[octant as usize % WIDTH][mask as usize % 256];
    if let (Some(keys), Some(children)) = (keys.first_chunk_mut(), children.first_chunk_mut()) {
        simd.pack(t_near, node.tag_bits(), &node.child, order, (keys, children));
    }
}

/// Takes the last of some items that lies within the limit, and drops those behind it.
#[inline(always)]
pub fn pop(keys: &[u32], children: &[u32], n_items: &mut usize, limit: Limit) -> Option<Item> {
    // The count stays in a register.
    let mut n = *n_items;
    while n > 0 {
        n -= 1;
        let key = *keys.get(n)?;
        if limit.allows(key) {
            *n_items = n;
            return Some(Item { key, child: *children.get(n)? });
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

/// The last of a mask's slots in that order: one ray by itself waits for it.
static NEAREST: [[u8; 256]; 8] = {
    let mut nearest = [[0; 256]; 8];
    let mut octant = 0;
    while octant < 8 {
        let mut mask = 1_usize;
        while mask < 256 {
            nearest[octant][mask] = ORDER[octant][mask][mask.count_ones() as usize - 1];
            mask += 1;
        }
        octant += 1;
    }
    nearest
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
        let pops = |t: f32, limit: f32| pop(&[t.to_bits() | TAG_BITS], &[7], &mut 1, Limit::at(limit));
        for t in [0.0, 1e-40, 1.0, 3.0e38, f32::INFINITY] {
            assert_eq!(pops(t, t).map(Item::child), Some(7));
            assert_eq!(pops(f32::from_bits(t.to_bits() + 256), t), None);
        }
    }
}
