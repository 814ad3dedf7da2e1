//! The tree that rays walk: nodes of eight children, leaves of one kind.

use glam::{DVec3, Vec3};

use super::slab::{Slabs, Surroundings, WIDTH};
use crate::numeric::sphere_lanes::N_COLUMNS;
use crate::world::{Bounds, PrimKind, PrimRef};

/// Primitives in a leaf at most.
pub const MAX_LEAF: usize = 8;

/// Numbers behind the last column of leaves: eight lanes are read of any column, and what the largest leaf would have of any
/// primitive.
pub const N_BEHIND: usize = MAX_LEAF * MAX_LEAF;

/// Coordinates of a triangle.
pub const N_COORDINATES: usize = 9;

/// A node: eight boxes and what lies in them.
///
/// Slots are places in space: bit k of a slot's number is set when the child lies more to the positive side of axis k than
/// its siblings do. A ray whose octant has bit k set where it runs down axis k meets the children about in the order of
/// slot XOR octant.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct WideNode {
    /// Boxes of the children.
    pub slabs: Slabs,
    /// Index of a child node, or of the first row of a leaf.
    pub child: [u32; WIDTH],
    /// What the children are: bits of their [`Tag`]s.
    tag_bits: [u8; WIDTH],
}

const _: () = assert!(size_of::<WideNode>() == 256);

/// Kind and size of a child: a node, or a leaf of up to eight primitives of one kind.
///
/// From the lowest bit on: primitives of a leaf less one (3 bits), whether it is shared, their kind (2 bits), and whether it is a node,
/// a leaf, or the end of a walk (2 bits).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(transparent)]
pub struct Tag(u8);

const SHARED: u8 = 1 << 3;
const KIND_SHIFT: u32 = 4;
const STATION_SHIFT: u32 = 6;

/// Where a ray stands: before a node, before a leaf, or at its end.
pub const N_STATIONS: usize = 3;

impl Tag {
    /// A node, or an unused slot.
    pub const NODE: Tag = Tag(0);

    /// Not a child: what lies at the bottom of a walk.
    pub const END: Tag = Tag(Tag::AT_END << STATION_SHIFT);

    /// The station before nodes.
    pub const AT_NODE: u8 = 0;

    /// The station before leaves.
    pub const AT_LEAF: u8 = 1;

    /// The station at the end.
    pub const AT_END: u8 = 2;

    /// A leaf of 1 to [`MAX_LEAF`] primitives.
    #[inline]
    pub fn leaf(kind: PrimKind, n_prims: usize) -> Tag {
        debug_assert!((1..=MAX_LEAF).contains(&n_prims));
        Tag(Tag::AT_LEAF << STATION_SHIFT | (kind as u8) << KIND_SHIFT | (n_prims - 1) as u8)
    }

    /// The tag of its bits.
    #[inline]
    pub fn from_bits(bits: u8) -> Tag {
        Tag(bits)
    }

    /// The bits of a tag.
    #[inline]
    pub const fn bits(self) -> u8 {
        self.0
    }

    /// Where a ray stands that has come to it: a number below 4.
    #[inline]
    pub fn station(self) -> usize {
        usize::from(self.0 >> STATION_SHIFT)
    }

    /// Whether it is a leaf.
    #[inline]
    pub fn is_leaf(self) -> bool {
        self.station() == usize::from(Tag::AT_LEAF)
    }

    /// The same leaf, known to stand in several nodes.
    #[inline]
    pub fn shared(self) -> Tag {
        Tag(self.0 | SHARED)
    }

    /// Whether the leaf stands in several nodes.
    #[inline]
    pub fn is_shared(self) -> bool {
        self.0 & SHARED != 0
    }

    /// Primitives of a leaf.
    #[inline]
    pub fn n_prims(self) -> usize {
        usize::from(self.0 & 0b111) + 1
    }

    /// Whether it is a leaf of triangles.
    #[inline]
    pub fn is_triangles(self) -> bool {
        self.0 & 0b11 << KIND_SHIFT == (PrimKind::Triangle as u8) << KIND_SHIFT
    }

    /// Kind of a leaf.
    #[inline]
    pub fn kind(self) -> PrimKind {
        match self.0 >> KIND_SHIFT & 0b11 {
            0 => PrimKind::Sphere,
            1 => PrimKind::Quadric,
            2 => PrimKind::Triangle,
            _ => PrimKind::Instance,
        }
    }
}

/// Bytes of nodes up to which a tree is taken to lie in the caches.
const SMALL_TREE: usize = 4 << 20;

/// What a slot of a node holds.
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    /// The box.
    pub bounds: Bounds,
    /// Index of a node, or of the first row of a leaf.
    pub child: u32,
    /// Which of them.
    pub tag: Tag,
}

/// A finished tree. A leaf of triangles is a run of `corners` and `triangle_rows`, one of spheres a run of `spheres` and
/// `sphere_rows`, any other leaf a run of `prims`.
///
/// Corners and spheres are copied into leaf order, so that a leaf reads one run of memory. A leaf of n triangles, the first being
/// number f, is nine columns of n coordinates, from 9·f on: ax ay az bx by bz cx cy cz; one of spheres four: x y z of centres, and
/// radii. Columns are not padded: all lanes are read at once, and those beyond n are other numbers, which no answer looks at.
#[derive(Clone, Debug, Default)]
pub struct WideTree {
    /// Nodes; the root is the first. Empty when there is nothing bounded.
    pub nodes: Vec<WideNode>,
    /// Corners of triangles, in columns leaf by leaf; [`N_BEHIND`] zeros stand behind the last.
    pub corners: Vec<f32>,
    /// Their rows.
    pub triangle_rows: Vec<u32>,
    /// Spheres, in columns leaf by leaf; [`N_BEHIND`] zeros stand behind the last.
    pub spheres: Vec<f64>,
    /// Their rows.
    pub sphere_rows: Vec<u32>,
    /// Quadrics and placements in leaf order.
    pub prims: Vec<PrimRef>,
    /// The box around all boxes.
    pub bounds: Option<Bounds>,
    /// Levels on the longest path, the root being 1.
    pub depth: usize,
    /// Whether any leaf stands in several nodes.
    pub has_shared_leaves: bool,
    /// Trees of what is placed, by [`PrototypeId`](crate::world::PrototypeId), in object space.
    pub prototypes: Vec<WideTree>,
}

impl WideNode {
    /// A node of unused slots.
    pub const EMPTY: WideNode = WideNode { slabs: Slabs::EMPTY, child: [0; WIDTH], tag_bits: [0; WIDTH] };

    /// Fills a slot.
    pub fn set(&mut self, slot: usize, entry: &Entry) {
        for axis in 0..3 {
            self.slabs.planes[axis][0][slot] = entry.bounds.lo[axis];
            self.slabs.planes[axis][1][slot] = entry.bounds.hi[axis];
        }
        self.child[slot] = entry.child;
        self.tag_bits[slot] = entry.tag.0;
    }

    /// Slots in use.
    pub fn slots(&self) -> impl Iterator<Item = usize> + '_ {
        (0..WIDTH).filter(|&slot| self.slabs.planes[0][0][slot] <= self.slabs.planes[0][1][slot])
    }

    /// What a slot holds.
    pub fn tag(&self, slot: usize) -> Tag {
        Tag(self.tag_bits[slot])
    }

    /// The bits of all tags.
    #[inline(always)]
    pub fn tag_bits(&self) -> &[u8; WIDTH] {
        &self.tag_bits
    }

    /// The box of a slot in use.
    pub fn bounds(&self, slot: usize) -> Bounds {
        let corner = |side: usize| Vec3::from_array(self.slabs.planes.map(|planes| planes[side][slot]));
        Bounds { lo: corner(0), hi: corner(1) }
    }
}

impl WideTree {
    /// The corners of triangle `i` of a leaf.
    #[inline(always)]
    pub fn corners_of(&self, first: usize, n_prims: usize, i: usize) -> [Vec3; 3] {
        let of = &self.corners[N_COORDINATES * first + i..][..(N_COORDINATES - 1) * MAX_LEAF + 1];
        // Said again so that no number needs a look at the end.
        let stride = (n_prims - 1) % MAX_LEAF + 1;
        let mut corners = [Vec3::ZERO; 3];
        for c in 0..N_COORDINATES {
            corners[c / 3][c % 3] = of[c * stride];
        }
        corners
    }

    /// The centre and the radius of sphere `i` of a leaf.
    #[inline(always)]
    pub fn sphere_of(&self, first: usize, n_prims: usize, i: usize) -> (DVec3, f64) {
        let of = &self.spheres[N_COLUMNS * first + i..][..(N_COLUMNS - 1) * MAX_LEAF + 1];
        let stride = (n_prims - 1) % MAX_LEAF + 1;
        (DVec3::new(of[0], of[stride], of[2 * stride]), of[3 * stride])
    }

    /// Whether its nodes take more than the caches hold.
    pub fn is_large(&self) -> bool {
        size_of_val(self.nodes.as_slice()) > SMALL_TREE
    }

    /// Items that a walk can have before it, and room for the eight that are written at a time: each level leaves at
    /// most seven siblings behind.
    pub fn stack_size(&self) -> usize {
        (WIDTH - 1) * self.depth + 2 * WIDTH
    }

    /// What rays meet that are taken to be thicker by a share of their origin; `is_all` where there is nothing else to meet.
    pub fn surroundings(&self, thickness: f64, is_all: bool) -> Surroundings {
        Surroundings::new(self.bounds.unwrap_or(Bounds { lo: Vec3::ZERO, hi: Vec3::ZERO }), thickness, is_all)
    }

    /// Finds the box around all boxes.
    pub fn measure_bounds(&mut self) {
        self.bounds =
            self.nodes.first().and_then(|root| root.slots().map(|slot| root.bounds(slot)).reduce(Bounds::union));
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        self.nodes.len() * size_of::<WideNode>()
            + self.corners.len() * size_of::<f32>()
            + (self.triangle_rows.len() + self.sphere_rows.len()) * size_of::<u32>()
            + self.spheres.len() * size_of::<f64>()
            + self.prims.len() * size_of::<PrimRef>()
            + self.prototypes.iter().map(WideTree::memory_bytes).sum::<usize>()
    }

    /// Leaves, and the expected cost of a random ray through the root box: one for each node and one for each leaf
    /// visited, weighted by the chance to meet its box (Goldsmith and Salmon 1987). A leaf is tested at once, so that
    /// it costs about the same whatever it holds.
    pub fn leaves_and_sah_cost(&self) -> (usize, f64) {
        let area = |b: Bounds| {
            let e = b.extent();
            e.x * e.y + e.y * e.z + e.z * e.x
        };
        let Some(bounds) = self.bounds else { return (0, 0.0) };
        let root_area = area(bounds);
        let mut n_leaves = 0;
        let mut cost = root_area;
        for (node, slot) in self.nodes.iter().flat_map(|node| node.slots().map(move |slot| (node, slot))) {
            n_leaves += usize::from(node.tag(slot) != Tag::NODE);
            cost += area(node.bounds(slot));
        }
        (n_leaves, if root_area > 0.0 { cost / root_area } else { 0.0 })
    }
}
