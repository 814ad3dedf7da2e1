//! What a ray hits: a BVH over all bounded primitives, built by obvhs and traversed here, and the full scan that
//! every answer is compared with.

use crate::world::{Hit, Ray, World};

/// How to find hits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AccelKind {
    /// Bounding volume hierarchy.
    #[default]
    Bvh,
    /// Every ray against every primitive: the oracle.
    Linear,
}

/// An acceleration structure over a world; it must be asked with the world it was built from.
#[derive(Clone, Debug)]
pub struct Accel {
    kind: AccelKind,
}

/// Figures of a built structure.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AccelStats {
    /// Inner nodes.
    pub n_nodes: usize,
    /// Leaves.
    pub n_leaves: usize,
    /// Levels on the longest path, the root being 1.
    pub depth: usize,
    /// Expected cost of a random ray through the root box: node visits plus primitive tests, each counted 1.
    pub sah_cost: f64,
    /// Bytes held.
    pub memory_bytes: usize,
}

impl Accel {
    /// Builds the structure on the current rayon pool.
    pub fn build(world: &World, kind: AccelKind) -> Accel {
        let _ = world;
        Accel { kind }
    }

    /// Answers each ray with its closest hit: the smallest `t`, at equal `t` the lowest id.
    ///
    /// # Panics
    /// When the slices differ in length.
    pub fn closest_hit(&self, world: &World, rays: &[Ray], hits: &mut [Hit]) {
        assert_eq!(rays.len(), hits.len());
        let _ = (world, self.kind);
    }

    /// Answers each ray with whether anything lies in its interval.
    ///
    /// # Panics
    /// When the slices differ in length.
    pub fn occluded(&self, world: &World, rays: &[Ray], occluded: &mut [bool]) {
        assert_eq!(rays.len(), occluded.len());
        let _ = world;
    }

    /// Figures of the structure.
    pub fn stats(&self) -> AccelStats {
        AccelStats::default()
    }
}
