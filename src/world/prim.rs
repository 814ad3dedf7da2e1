//! The enum over all kinds of primitives, and the only `match`es over it.

use super::{Bounds, Hit, World};
use crate::BARE;
use crate::numeric::prepared::PreparedRay;

/// The kinds of primitives. The order is the order of ties: at equal `t` a sphere is hit before a quadric before a
/// triangle before a placement, and within a kind
/// the lower row.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u8)]
pub enum PrimKind {
    /// A row of [`Spheres`](super::Spheres).
    Sphere = 0,
    /// A row of [`Quadrics`](super::Quadrics).
    Quadric = 1,
    /// A row of [`Triangles`](super::Triangles).
    Triangle = 2,
    /// A row of [`Instances`](super::Instances): a mesh that is placed.
    Instance = 3,
}

/// A row of one of the primitive tables: kind in the upper two bits, row in the lower thirty.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(transparent)]
pub struct PrimRef(u32);

const _: () = assert!(size_of::<PrimRef>() == 4);

const ROW_BITS: u32 = 30;

impl PrimRef {
    /// Names no primitive; greater than every other.
    pub const NONE: PrimRef = PrimRef(u32::MAX);

    /// Rows that a table can have at most.
    pub const MAX_ROWS: usize = 1 << ROW_BITS;

    /// The row of a table; `row` must be below [`PrimRef::MAX_ROWS`].
    #[inline]
    pub fn new(kind: PrimKind, row: usize) -> PrimRef {
        debug_assert!(row < PrimRef::MAX_ROWS);
        PrimRef((kind as u32) << ROW_BITS | row as u32)
    }

    /// The kind. Must not be asked of [`PrimRef::NONE`].
    #[inline]
    pub fn kind(self) -> PrimKind {
        debug_assert!(self != PrimRef::NONE);
        match self.0 >> ROW_BITS {
            _ if BARE => PrimKind::Triangle,
            0 => PrimKind::Sphere,
            1 => PrimKind::Quadric,
            2 => PrimKind::Triangle,
            _ => PrimKind::Instance,
        }
    }

    /// Whether it is a triangle: a comparison, where a `match` over all kinds would be a jump.
    #[inline]
    pub fn is_triangle(self) -> bool {
        BARE || self.0 >> ROW_BITS == PrimKind::Triangle as u32
    }

    /// The row in the table of its kind.
    #[inline]
    pub fn row(self) -> usize {
        (self.0 & ((1 << ROW_BITS) - 1)) as usize
    }

    /// The box around the primitive, rounded outwards; `None` when it has no finite one.
    pub fn bounds(self, world: &World) -> Option<Bounds> {
        match self.kind() {
            PrimKind::Sphere => Some(world.spheres.bounds(self.row())),
            PrimKind::Quadric => world.quadrics.bounds[self.row()],
            PrimKind::Triangle => Some(world.triangles.bounds(self.row())),
            PrimKind::Instance => Some(world.instances.bounds[self.row()]),
        }
    }

    /// The hit of this primitive by the ray that comes first within the ray's interval.
    #[inline(always)]
    pub fn intersect(self, world: &World, ray: &PreparedRay) -> Option<Hit> {
        match self.kind() {
            PrimKind::Sphere => world.spheres.intersect(self.row(), ray),
            PrimKind::Quadric => world.quadrics.intersect(self.row(), ray),
            PrimKind::Triangle => world.triangles.intersect(self.row(), ray),
            PrimKind::Instance => world.intersect_instance(self.row(), ray),
        }
    }
}

/// All primitives of a world that are seen where they are, and all placements, in the order of ids.
pub fn all(world: &World) -> impl Iterator<Item = PrimRef> + use<'_> {
    let rows = |kind, n| (0..n).map(move |row| PrimRef::new(kind, row));
    rows(PrimKind::Sphere, world.spheres.len())
        .chain(rows(PrimKind::Quadric, world.quadrics.len()))
        .chain(world.own_triangles().map(|row| PrimRef::new(PrimKind::Triangle, row)))
        .chain(world.instance_refs())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_prim_ref_returns_what_it_was_made_of() {
        for kind in [PrimKind::Sphere, PrimKind::Quadric, PrimKind::Triangle, PrimKind::Instance] {
            for row in [0, 1, PrimRef::MAX_ROWS - 2] {
                let prim = PrimRef::new(kind, row);
                assert_eq!((prim.kind(), prim.row()), (kind, row));
                assert!(prim < PrimRef::NONE);
            }
        }
    }
}
