//! The enum over all kinds of primitives, and the only `match`es over it.

use super::{Bounds, Hit, MaterialId, ObjectId, World};
use crate::BARE;
use crate::numeric::prepared::PreparedRay;

/// The kinds of primitives. The order is the order of ties: at equal `t` a sphere is hit before a quadric before a
/// triangle, and within a kind the lower row.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u8)]
pub enum PrimKind {
    /// A row of [`Spheres`](super::Spheres).
    Sphere = 0,
    /// A row of [`Quadrics`](super::Quadrics).
    Quadric = 1,
    /// A row of [`Triangles`](super::Triangles).
    Triangle = 2,
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
            _ => PrimKind::Triangle,
        }
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
        }
    }

    /// The hit of this primitive by the ray that comes first within the ray's interval.
    #[inline(always)]
    pub fn intersect(self, world: &World, ray: &PreparedRay) -> Option<Hit> {
        match self.kind() {
            PrimKind::Sphere => world.spheres.intersect(self.row(), ray),
            PrimKind::Quadric => world.quadrics.intersect(self.row(), ray),
            PrimKind::Triangle => world.triangles.intersect(self.row(), ray),
        }
    }

    /// The material.
    #[inline]
    pub fn material(self, world: &World) -> MaterialId {
        match self.kind() {
            PrimKind::Sphere => world.spheres.materials[self.row()],
            PrimKind::Quadric => world.quadrics.materials[self.row()],
            PrimKind::Triangle => world.meshes.materials[world.meshes.of_triangle(self.row()).idx()],
        }
    }

    /// The object of the scene file.
    pub fn object(self, world: &World) -> ObjectId {
        match self.kind() {
            PrimKind::Sphere => world.spheres.objects[self.row()],
            PrimKind::Quadric => world.quadrics.objects[self.row()],
            PrimKind::Triangle => world.meshes.objects[world.meshes.of_triangle(self.row()).idx()],
        }
    }
}

/// All primitives of a world in the order of ids.
pub fn all(world: &World) -> impl Iterator<Item = PrimRef> + use<> {
    let rows = |kind, n| (0..n).map(move |row| PrimRef::new(kind, row));
    rows(PrimKind::Sphere, world.spheres.len())
        .chain(rows(PrimKind::Quadric, world.quadrics.len()))
        .chain(rows(PrimKind::Triangle, world.triangles.len()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_prim_ref_returns_what_it_was_made_of() {
        for kind in [PrimKind::Sphere, PrimKind::Quadric, PrimKind::Triangle] {
            for row in [0, 1, PrimRef::MAX_ROWS - 1] {
                let prim = PrimRef::new(kind, row);
                assert_eq!((prim.kind(), prim.row()), (kind, row));
                assert!(prim < PrimRef::NONE);
            }
        }
    }
}
