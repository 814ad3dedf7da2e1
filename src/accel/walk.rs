//! A ray on its way through the tree, and what it has found so far.

use glam::{DVec3, Vec3};

use super::order::Item;
use super::slab::SlabRay;
use super::wide::{Tag, WideTree};
use crate::numeric::lane::{LaneRay, RoundedRay};
use crate::numeric::prepared::{PreparedRay, lanes};
use crate::numeric::rounding::{f32_at_least, f32_at_most};
use crate::numeric::{sphere, triangle};
use crate::simd::{F64Lanes, MaskLanes, Portable, Simd, WIDTH64};
use crate::world::{Hit, InstanceId, PrimKind, PrimRef};

/// A ray on its way.
#[derive(Clone, Copy, Debug)]
pub struct Walk {
    /// The ray; its `t_max` is cut behind what was found.
    pub ray: PreparedRay,
    /// The same for boxes.
    pub slab: SlabRay,
    /// The same for triangles.
    pub lane: LaneRay,
    /// The closest so far.
    pub best: Best,
    /// `t_max` of the ray, rounded up.
    pub t_max: f32,
    /// The largest item that is still worth a visit. A box at exactly the best t may hold a hit of a lower id.
    pub limit: Item,
}

/// The closest hit so far. A triangle or sphere that its lane is certain of is only described once the walk is over.
#[derive(Clone, Copy, Debug)]
pub struct Best {
    /// The hit, when nothing is pending.
    pub hit: Hit,
    /// What is certainly hit, and closer than `hit`.
    pub pending: Option<Pending>,
    /// Its parameter lies between these.
    pub t_low: f32,
    /// See `t_low`.
    pub t_high: f32,
}

/// A triangle or a sphere in a leaf.
#[derive(Clone, Copy, Debug)]
pub struct Pending {
    /// First row of the leaf.
    pub first: u32,
    /// Kind and size of the leaf.
    pub tag: Tag,
    /// Which of its primitives.
    pub lane: u8,
}

impl Pending {
    /// The corners of a triangle.
    #[inline(always)]
    pub fn corners(self, tree: &WideTree) -> [Vec3; 3] {
        tree.corners_of(self.first as usize, self.tag.n_prims(), self.lane.into())
    }

    /// The centre and the radius of a sphere.
    #[inline(always)]
    pub fn sphere(self, tree: &WideTree) -> (DVec3, f64) {
        tree.sphere_of(self.first as usize, self.tag.n_prims(), self.lane.into())
    }

    /// Its row in the table of its kind.
    #[inline(always)]
    pub fn row(self, tree: &WideTree) -> usize {
        let rows = if self.tag.is_triangles() { &tree.triangle_rows } else { &tree.sphere_rows };
        rows[self.first as usize + usize::from(self.lane)] as usize
    }

    /// What it is.
    #[inline(always)]
    pub fn prim(self, tree: &WideTree) -> PrimRef {
        PrimRef::new(self.tag.kind(), self.row(tree))
    }

    /// Where a ray hits it, by itself.
    #[inline(always)]
    pub fn intersect(self, tree: &WideTree, ray: &PreparedRay) -> Option<Hit> {
        if self.tag.is_triangles() {
            let hit = triangle::intersect(ray, self.corners(tree))?;
            return Some(Hit::of_triangle(&hit, self.row(tree)));
        }
        let (center, radius) = self.sphere(tree);
        let at = sphere::intersect(ray, center, radius)?;
        Some(Hit::of_surface(at, PrimKind::Sphere, self.row(tree)))
    }
}

impl Walk {
    /// Starts a ray with a hit that it is known to have, if any.
    #[inline(always)]
    pub fn begin<S: Simd>(&mut self, simd: S, mut ray: PreparedRay, hit: Hit) {
        self.best = Best::NOTHING;
        if hit.is_some() {
            self.best = Best::exact(hit);
            ray.t_max = ray.t_max.min(hit.t.next_up());
        }

        let rounded = RoundedRay::new(simd, &ray);
        let size = rounded.inverse.abs();
        let octant = rounded.inverse.lt(simd.splat64(0.0)).bits() as u8;
        // Part by part: a whole walk would be built elsewhere and copied.
        self.slab = SlabRay::new::<S>(&rounded.origin, [size, size], octant, rounded.t_min[0]);
        self.lane = LaneRay::new(&ray, &rounded);
        self.t_max = rounded.t_max[1];
        self.limit = Item::limit(self.t_max);
        self.ray = ray;
    }

    /// A walk along a ray of no consequence, as a place for others.
    #[inline(always)]
    pub fn nowhere<S: Simd>(simd: S) -> Walk {
        let (origin, direction) = (DVec3::ZERO, DVec3::X);
        let ray = PreparedRay { origin, direction, t_min: 0.0, t_max: 1.0, axis: 0, tame: true };
        let slab = SlabRay::new::<S>(&[[0.0; WIDTH64]; 2], [simd.splat64(1.0); 2], 0, 0.0);
        let limit = Item::limit(1.0);
        Walk { slab, lane: LaneRay::NOWHERE, best: Best::NOTHING, t_max: 1.0, limit, ray }
    }

    /// Takes a hit as the best and cuts the ray behind it; the hit itself stays inside, since a tie goes by id.
    #[inline(always)]
    pub fn keep(&mut self, hit: Hit) {
        self.best = Best::exact(hit);
        self.ray.t_max = self.ray.t_max.min(hit.t.next_up());
        self.t_max = f32_at_least(self.ray.t_max);
        self.limit = Item::limit(self.t_max);
    }

    /// Takes as the best what is certainly hit, at a parameter that is only known to lie in an interval.
    #[inline(always)]
    pub fn keep_pending(&mut self, pending: Pending, t_low: f32, t_high: f32) {
        self.best.pending = Some(pending);
        (self.best.t_low, self.best.t_high) = (t_low, t_high);
        self.t_max = t_high;
        self.limit = Item::limit(t_high);
        self.ray.t_max = f64::from(t_high).next_up();
    }
}

/// A ray for boxes, thicker by a share of the largest coordinate of its origin: for scenes where something is placed. It
/// takes and returns values, so that rays of other scenes need not have an address.
#[cold]
#[inline(never)]
pub fn thick_slab(ray: PreparedRay, share: f64) -> SlabRay {
    let spread = share * ray.origin.abs().max_element();
    let [down, _] = lanes(Portable, ray.origin - spread).outwards();
    let [_, up] = lanes(Portable, ray.origin + spread).outwards();
    let inverse = RoundedRay::new(Portable, &ray).inverse;
    let octant = inverse.lt(Portable.splat64(0.0)).bits() as u8;
    SlabRay::new::<Portable>(&[down, up], [inverse.abs(), inverse.abs()], octant, f32_at_most(ray.t_min))
}

impl Best {
    /// No hit yet.
    const NOTHING: Best = Best { hit: Hit::MISS, pending: None, t_low: f32::INFINITY, t_high: f32::INFINITY };

    /// Whether the best is this primitive, in this tree.
    #[inline(always)]
    pub fn is_of(&self, prim: PrimRef, tree: &WideTree) -> bool {
        match self.pending {
            Some(pending) => pending.prim(tree) == prim,
            None => self.hit.prim == prim && self.hit.instance == InstanceId::WORLD,
        }
    }

    #[inline(always)]
    fn exact(hit: Hit) -> Best {
        Best { hit, pending: None, t_low: f32_at_most(hit.t), t_high: f32_at_least(hit.t) }
    }
}
