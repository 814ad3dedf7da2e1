//! Tests of whole leaves: one `match` over the kind, then lanes.

pub mod sphere;

use super::single;
use super::walk::{Pending, Walk};
use super::wide::{N_COORDINATES, Tag, WideTree};
use crate::numeric::lane::LaneEdges;
use crate::numeric::triangle;
use crate::simd::{Batch, F32Lanes, MaskLanes, Simd, WIDTH, set_bits};
use crate::world::{Hit, InstanceId, PrimKind, PrimRef, World};

/// Tests a leaf for the closest hit; those of triangles are seen and taken.
#[inline(always)]
pub fn closest<S: Simd>(simd: S, tree: &WideTree, world: &World, walk: &mut Walk, first: u32, tag: Tag) {
    match tag.kind() {
        PrimKind::Triangle => {}
        PrimKind::Sphere => sphere::closest(simd, tree, walk, first, tag),
        PrimKind::Quadric => {
            let quadrics = &tree.prims[first as usize..][..tag.n_prims()];
            simd.apart(ClosestQuadric { tree, world, walk, quadrics });
        }
        PrimKind::Instance => {
            let placed = &tree.prims[first as usize..][..tag.n_prims()];
            simd.apart(ClosestPlaced { tree, world, walk, placed });
        }
    }
}

/// Tests a leaf for any hit; those of triangles are seen and taken.
#[inline(always)]
pub fn any<S: Simd>(simd: S, tree: &WideTree, world: &World, walk: &Walk, first: u32, tag: Tag) -> bool {
    // Loops rather than `any`: its closures are not always inlined, and must be, to be compiled for the batch's ISA.
    match tag.kind() {
        PrimKind::Triangle => {}
        PrimKind::Sphere => return sphere::any(simd, tree, walk, first, tag),
        PrimKind::Quadric => {
            let quadrics = &tree.prims[first as usize..][..tag.n_prims()];
            let mut is_hit = false;
            simd.apart(AnyQuadric { world, walk, quadrics, is_hit: &mut is_hit });
            return is_hit;
        }
        PrimKind::Instance => {
            let placed = &tree.prims[first as usize..][..tag.n_prims()];
            let mut is_hit = false;
            simd.apart(AnyPlaced { tree, world, walk, placed, is_hit: &mut is_hit });
            return is_hit;
        }
    }
    false
}

/// Quadrics in a leaf.
struct ClosestQuadric<'a> {
    tree: &'a WideTree,
    world: &'a World,
    walk: &'a mut Walk,
    quadrics: &'a [PrimRef],
}

impl Batch for ClosestQuadric<'_> {
    #[inline(always)]
    fn run<S: Simd>(self, _simd: S) {
        let ClosestQuadric { tree, world, walk, quadrics } = self;
        for prim in quadrics {
            offer(tree, walk, world.quadrics.intersect(prim.row(), &walk.prepared()));
        }
    }
}

/// See [`ClosestQuadric`].
struct AnyQuadric<'a> {
    world: &'a World,
    walk: &'a Walk,
    quadrics: &'a [PrimRef],
    is_hit: &'a mut bool,
}

impl Batch for AnyQuadric<'_> {
    #[inline(always)]
    fn run<S: Simd>(self, _simd: S) {
        let AnyQuadric { world, walk, quadrics, is_hit } = self;
        let ray = walk.prepared();
        for prim in quadrics {
            if world.quadrics.occludes(prim.row(), &ray) {
                *is_hit = true;
                return;
            }
        }
    }
}

/// Placements in a leaf: each is walked in its own tree by the object ray.
struct ClosestPlaced<'a> {
    tree: &'a WideTree,
    world: &'a World,
    walk: &'a mut Walk,
    placed: &'a [PrimRef],
}

impl Batch for ClosestPlaced<'_> {
    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let ClosestPlaced { tree, world, walk, placed } = self;
        settle(tree, walk);
        for prim in placed {
            let row = prim.row();
            let Some(ray) = world.instances.object_ray(row, &walk.prepared()) else { continue };
            let below = &tree.prototypes[world.instances.prototypes[row].idx()];
            if let Some(hit) = single::closest_below(simd, below, world, ray) {
                let hit = Hit { instance: InstanceId::new(row), ..hit };
                if hit.is_before(&walk.best.hit) {
                    walk.keep(hit);
                }
            }
        }
    }
}

/// See [`ClosestPlaced`].
struct AnyPlaced<'a> {
    tree: &'a WideTree,
    world: &'a World,
    walk: &'a Walk,
    placed: &'a [PrimRef],
    is_hit: &'a mut bool,
}

impl Batch for AnyPlaced<'_> {
    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let AnyPlaced { tree, world, walk, placed, is_hit } = self;
        for prim in placed {
            let row = prim.row();
            let Some(ray) = world.instances.object_ray(row, &walk.prepared()) else { continue };
            let below = &tree.prototypes[world.instances.prototypes[row].idx()];
            if single::any_below(simd, below, world, ray) {
                *is_hit = true;
                return;
            }
        }
    }
}

/// Takes a hit if it is closer than the best.
#[inline(always)]
fn offer(tree: &WideTree, walk: &mut Walk, hit: Option<Hit>) {
    let Some(hit) = hit else { return };
    settle(tree, walk);
    if hit.is_before(&walk.best.hit) {
        walk.keep(hit);
    }
}

/// Describes the best hit if it is pending.
#[inline(always)]
pub fn settle(tree: &WideTree, walk: &mut Walk) {
    if walk.best.is_pending
        && let Some(hit) = walk.best.pending.intersect(tree, &walk.prepared())
    {
        walk.keep(hit);
    }
}

/// What its lane is not certain of, or what may tie with the best hit.
struct ByOne<'a> {
    tree: &'a WideTree,
    walk: &'a mut Walk,
    candidate: Pending,
}

impl Batch for ByOne<'_> {
    #[inline(always)]
    fn run<S: Simd>(self, _simd: S) {
        let ByOne { tree, walk, candidate } = self;
        // A triangle that was cut stands in several leaves.
        if walk.best.is_of(candidate.prim(tree), tree) {
            return;
        }
        // Mostly it is what the ray has just left.
        if is_left(tree, walk, candidate) {
            return;
        }
        offer(tree, walk, candidate.intersect(tree, &walk.prepared()));
    }
}

/// What f32 knows of the triangles of a leaf; intervals concern no one where only any hit is asked for.
#[derive(Clone, Copy, Debug, Default)]
pub struct Seen<F> {
    /// Those that may be hit within the interval and before the best hit, one bit each.
    pub open: u32,
    /// Those that certainly are.
    pub certain: u32,
    /// Where, at least.
    pub t_low: F,
    /// And at most.
    pub t_high: F,
}

/// Sees the triangles of a leaf, without a branch: what is to be done with them can then be decided without waiting.
#[inline(always)]
pub fn see<S: Simd>(simd: S, tree: &WideTree, walk: &Walk, first: u32, tag: Tag) -> Seen<S::F32> {
    let edges = walk.lane.edges(simd, &tree.corners, N_COORDINATES * first as usize, tag.n_prims());
    see_parameters(simd, walk, &edges, tag)
}

/// Sees them when the line does not pass outside of them all, which is known long before their parameters are: one ray by itself
/// waits for nothing else.
#[inline(always)]
pub fn see_unless_missed<S: Simd>(simd: S, tree: &WideTree, walk: &Walk, first: u32, tag: Tag) -> Option<Seen<S::F32>> {
    let edges = walk.lane.edges(simd, &tree.corners, N_COORDINATES * first as usize, tag.n_prims());
    let is_missed = edges.open().bits() & ((1 << tag.n_prims()) - 1) == 0;
    if is_missed { None } else { Some(see_parameters(simd, walk, &edges, tag)) }
}

/// Sees where triangles of known edge functions are met.
#[inline(always)]
fn see_parameters<S: Simd>(simd: S, walk: &Walk, edges: &LaneEdges<S::F32>, tag: Tag) -> Seen<S::F32> {
    // Most of what is open lies behind the best hit.
    let (t_low, t_high) = walk.lane.t_ranges(simd, edges);
    let outside = simd.splat(walk.t_max).lt(t_low) | t_high.lt(simd.splat(walk.lane.t_min_below()));
    let within = simd.splat(walk.lane.t_min_above()).lt(t_low) & t_high.lt(simd.splat(walk.lane.t_max_below()));
    let open = (edges.open() & !outside).bits() & ((1 << tag.n_prims()) - 1);
    Seen { open, certain: open & (edges.certain() & within).bits(), t_low, t_high }
}

/// Takes the closest of the triangles that were seen.
#[inline(always)]
pub fn take_closest<S: Simd>(
    simd: S,
    tree: &WideTree,
    walk: &mut Walk,
    first: u32,
    tag: Tag,
    seen: &Seen<[f32; WIDTH]>,
) {
    for lane in set_bits(seen.open) {
        let lane = lane % WIDTH;
        let candidate = Pending::new(first, tag, lane);
        let t = (seen.certain >> lane & 1 == 1).then_some((seen.t_low[lane], seen.t_high[lane]));
        take(simd, tree, walk, candidate, t);
    }
}

/// Whether any of the triangles that were seen is hit.
#[inline(always)]
pub fn take_any<S: Simd>(simd: S, tree: &WideTree, walk: &Walk, first: u32, tag: Tag, seen: &Seen<()>) -> bool {
    let open = seen.open;
    let mut is_hit = seen.certain != 0;
    if open != 0 && !is_hit {
        simd.apart(AnyByOne { tree, walk, first, tag, open, is_hit: &mut is_hit });
    }
    is_hit
}

/// Takes what is open as the best hit if it is closer; `t` is where it is certainly hit, if it is.
#[inline(always)]
fn take<S: Simd>(simd: S, tree: &WideTree, walk: &mut Walk, candidate: Pending, t: Option<(f32, f32)>) {
    match t {
        Some((low, high)) if high < walk.best.t_low => walk.keep_pending(candidate, low, high),
        Some((low, _)) if low > walk.best.t_high => {}
        _ => simd.apart(ByOne { tree, walk, candidate }),
    }
}

/// Whether f64 is certain that a ray's line meets a triangle's plane behind the origin.
#[inline(always)]
fn is_left(tree: &WideTree, walk: &Walk, candidate: Pending) -> bool {
    candidate.is_triangle()
        && walk.tame
        && triangle::is_behind(walk.ray.origin.to_array(), walk.ray.direction.to_array(), candidate.corners(tree))
}

/// Triangles or spheres of a leaf that their lanes left open.
struct AnyByOne<'a> {
    tree: &'a WideTree,
    walk: &'a Walk,
    first: u32,
    tag: Tag,
    open: u32,
    is_hit: &'a mut bool,
}

impl Batch for AnyByOne<'_> {
    #[inline(always)]
    fn run<S: Simd>(self, _simd: S) {
        let AnyByOne { tree, walk, first, tag, open, is_hit } = self;
        let ray = walk.prepared();
        for lane in set_bits(open) {
            let candidate = Pending::new(first, tag, lane);
            if !is_left(tree, walk, candidate) && candidate.occludes(tree, &ray) {
                *is_hit = true;
                return;
            }
        }
    }
}
