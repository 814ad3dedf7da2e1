//! A ray on its way through the tree, and what it has found so far.

use glam::{DVec3, Vec3};

use super::order::Limit;
use super::ready::{self, Four};
use super::slab::{SlabRay, Surroundings};
use super::wide::{MAX_LEAF, Tag, WideTree};
use crate::numeric::lane::LaneRay;
use crate::numeric::prepared::PreparedRay;
use crate::numeric::rounding::{f32_at_least, f32_at_most};
use crate::numeric::{sphere, triangle};
use crate::simd::Simd;
use crate::world::{Hit, InstanceId, PrimKind, PrimRef, Ray};

/// A ray on its way.
#[derive(Clone, Copy, Debug)]
pub struct Walk {
    /// The ray as it was asked.
    pub ray: Ray,
    /// Whether its numbers are tame.
    pub tame: bool,
    /// The same for boxes.
    pub slab: SlabRay,
    /// The same for triangles.
    pub lane: LaneRay,
    /// The closest so far.
    pub best: Best,
    /// `t_max` of the ray, rounded up.
    pub t_max: f32,
    /// What is still worth a visit. A box at exactly the best t may hold a hit of a lower id.
    pub limit: Limit,
}

/// The closest hit so far. A triangle or sphere that its lane is certain of is only described once the walk is over.
#[derive(Clone, Copy, Debug)]
pub struct Best {
    /// The hit, when nothing is pending.
    pub hit: Hit,
    /// What is certainly hit, and closer than `hit`, if anything is pending.
    pub pending: Pending,
    /// Whether it is.
    pub is_pending: bool,
    /// Its parameter lies between these.
    pub t_low: f32,
    /// See `t_low`.
    pub t_high: f32,
}

/// A triangle or a sphere in a leaf, as one number: its leaf's first row, the leaf's tag, and which of its primitives it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pending(u64);

/// Bits below the tag of a [`Pending`], and below the place in the leaf.
const TAG_SHIFT: u32 = 32;
/// See [`TAG_SHIFT`].
const LANE_SHIFT: u32 = 40;

impl Pending {
    /// Of no consequence.
    pub const NOTHING: Pending = Pending((Tag::NODE.bits() as u64) << TAG_SHIFT);

    /// One primitive of a leaf.
    #[inline(always)]
    pub fn new(first: u32, tag: Tag, lane: usize) -> Pending {
        Pending(u64::from(first) | u64::from(tag.bits()) << TAG_SHIFT | (lane as u64) << LANE_SHIFT)
    }

    /// First row of the leaf.
    #[inline(always)]
    fn first(self) -> usize {
        self.0 as u32 as usize
    }

    /// Kind and size of the leaf.
    #[inline(always)]
    fn tag(self) -> Tag {
        Tag::from_bits((self.0 >> TAG_SHIFT) as u8)
    }

    /// Which of its primitives.
    #[inline(always)]
    fn lane(self) -> usize {
        (self.0 >> LANE_SHIFT) as usize % MAX_LEAF
    }

    /// Whether it is a triangle.
    #[inline(always)]
    pub fn is_triangle(self) -> bool {
        self.tag().is_triangles()
    }

    /// The corners of a triangle.
    #[inline(always)]
    pub fn corners(self, tree: &WideTree) -> [Vec3; 3] {
        tree.corners_of(self.first(), self.tag().n_prims(), self.lane())
    }

    /// The centre and the radius of a sphere.
    #[inline(always)]
    pub fn sphere(self, tree: &WideTree) -> (DVec3, f64) {
        tree.sphere_of(self.first(), self.tag().n_prims(), self.lane())
    }

    /// Its row in the table of its kind.
    #[inline(always)]
    fn row(self, tree: &WideTree) -> usize {
        let rows = if self.is_triangle() { &tree.triangle_rows } else { &tree.sphere_rows };
        rows[self.first() + self.lane()] as usize
    }

    /// What it is.
    #[inline(always)]
    pub fn prim(self, tree: &WideTree) -> PrimRef {
        PrimRef::new(self.tag().kind(), self.row(tree))
    }

    /// Where a ray hits it, by itself.
    #[inline(always)]
    pub fn intersect(self, tree: &WideTree, ray: &PreparedRay) -> Option<Hit> {
        if self.is_triangle() {
            let hit = triangle::intersect(ray, self.corners(tree))?;
            return Some(Hit::of_triangle(&hit, self.row(tree)));
        }
        let (center, radius) = self.sphere(tree);
        let at = sphere::intersect(ray, center, radius)?;
        Some(Hit::of_surface(at, PrimKind::Sphere, self.row(tree)))
    }

    /// Whether a ray hits it, by itself.
    #[inline(always)]
    pub fn occludes(self, tree: &WideTree, ray: &PreparedRay) -> bool {
        if self.is_triangle() {
            return triangle::occludes(ray, self.corners(tree));
        }
        let (center, radius) = self.sphere(tree);
        sphere::intersect(ray, center, radius).is_some()
    }
}

impl Walk {
    /// Starts the ray that was taken from four.
    #[inline(always)]
    pub fn begin(&mut self, four: &Four, lane: usize, ray: &Ray) {
        self.start(&four.slabs[lane], &four.lanes[lane], four.tame[lane] != 0, ray);
    }

    /// Starts a ray by itself.
    #[inline(always)]
    pub fn begin_one<S: Simd>(&mut self, simd: S, ray: &PreparedRay, around: &Surroundings) {
        let &PreparedRay { origin, direction, t_min, t_max, tame, .. } = ray;
        let (slab, lane) = ready::one(simd, ray, around);
        self.start(&slab, &lane, tame, &Ray { origin, direction, t_min, t_max });
    }

    #[inline(always)]
    fn start(&mut self, slab: &SlabRay, lane: &LaneRay, tame: bool, ray: &Ray) {
        // Part by part: a whole walk would be built elsewhere and copied.
        self.slab = *slab;
        self.lane = *lane;
        self.tame = tame;
        self.ray = *ray;
        self.best = Best::NOTHING;
        self.t_max = lane.t_max_above();
        self.limit = Limit::at(self.t_max);
    }

    /// A walk along a ray of no consequence, as a place for others.
    pub fn nowhere() -> Walk {
        let (slab, lane) = (Four::NONE.slabs[0], Four::NONE.lanes[0]);
        let ray = Ray::new(DVec3::ZERO, DVec3::X);
        Walk { slab, lane, best: Best::NOTHING, t_max: 1.0, limit: Limit::at(1.0), ray, tame: true }
    }

    /// The ray for exact tests, cut behind what was found; the hit itself stays inside, since a tie goes by id.
    #[inline(always)]
    pub fn prepared(&self) -> PreparedRay {
        let Ray { origin, direction, t_min, t_max } = self.ray;
        let cut = f64::from(self.best.t_high).next_up();
        let t_max = if cut < t_max { cut } else { t_max };
        PreparedRay { origin, direction, t_min, t_max, axis: self.lane.axis(), tame: self.tame }
    }

    /// Takes a hit as the best and cuts the ray behind it.
    #[inline(always)]
    pub fn keep(&mut self, hit: Hit) {
        self.best = Best::exact(hit);
        self.t_max = self.best.t_high;
        self.limit = Limit::at(self.t_max);
    }

    /// Takes as the best what is certainly hit, at a parameter that is only known to lie in an interval.
    #[inline(always)]
    pub fn keep_pending(&mut self, pending: Pending, t_low: f32, t_high: f32) {
        (self.best.pending, self.best.is_pending) = (pending, true);
        (self.best.t_low, self.best.t_high) = (t_low, t_high);
        self.t_max = t_high;
        self.limit = Limit::at(t_high);
    }
}

impl Best {
    /// No hit yet.
    const NOTHING: Best = Best {
        hit: Hit::MISS,
        pending: Pending::NOTHING,
        is_pending: false,
        t_low: f32::INFINITY,
        t_high: f32::INFINITY,
    };

    /// Whether the best is this primitive, in this tree.
    #[inline(always)]
    pub fn is_of(&self, prim: PrimRef, tree: &WideTree) -> bool {
        if self.is_pending {
            return self.pending.prim(tree) == prim;
        }
        self.hit.prim == prim && self.hit.instance == InstanceId::WORLD
    }

    #[inline(always)]
    fn exact(hit: Hit) -> Best {
        Best { hit, t_low: f32_at_most(hit.t), t_high: f32_at_least(hit.t), ..Best::NOTHING }
    }
}
