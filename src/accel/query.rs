//! What is asked of a batch of rays.

use super::describe::packet::Together;
use super::describe::{Rest, Undescribed};
use super::leaf::{self, Seen};
use super::walk::{Best, Walk};
use super::wide::{Tag, WideTree};
use super::{Accel, linear};
use crate::numeric::prepared::PreparedRay;
use crate::simd::{F32Lanes, Simd, WIDTH};
use crate::world::{Hit, Ray, World};

/// What a batch asks.
pub trait Query {
    /// The answer to one ray.
    type Answer: Copy;
    /// The answer to a ray that can hit nothing.
    const NOTHING: Self::Answer;
    /// Whether any hit is as good as the closest; none is then described.
    const IS_ANY: bool;

    /// The answer of the full scan.
    fn scan(world: &World, ray: &PreparedRay) -> Self::Answer;

    /// Asks the primitives outside of the tree: a hit to begin the walk with, or the answer where none is needed.
    fn begin<S: Simd>(simd: S, accel: &Accel, world: &World, walk: &Walk) -> Result<Hit, Self::Answer>;

    /// What is to be known of the triangles of a leaf.
    type Seen: Copy + Default;

    /// What is kept of what a leaf was seen to be.
    fn kept<F: F32Lanes>(seen: Seen<F>) -> Self::Seen;

    /// Sees the triangles of a leaf, without a branch.
    #[inline(always)]
    fn see<S: Simd>(simd: S, tree: &WideTree, walk: &Walk, first: u32, tag: Tag) -> Self::Seen {
        Self::kept(leaf::see(simd, tree, walk, first, tag))
    }

    /// Takes what was seen of the triangles of a leaf; whether the walk is over.
    fn take<S: Simd>(simd: S, tree: &WideTree, walk: &mut Walk, first: u32, tag: Tag, seen: &Self::Seen) -> bool;

    /// Tests a leaf of another kind; whether the walk is over.
    fn other_leaf<S: Simd>(simd: S, tree: &WideTree, world: &World, walk: &mut Walk, first: u32, tag: Tag) -> bool;

    /// Tests a leaf; whether the walk is over.
    #[inline(always)]
    fn leaf<S: Simd>(simd: S, tree: &WideTree, world: &World, walk: &mut Walk, first: u32, tag: Tag) -> bool {
        if tag.is_triangles() {
            return match leaf::see_unless_missed(simd, tree, walk, first, tag) {
                Some(seen) => Self::take(simd, tree, walk, first, tag, &Self::kept(seen)),
                None => false,
            };
        }
        Self::other_leaf(simd, tree, world, walk, first, tag)
    }

    /// Writes the answer of a finished walk, and notes what is still to be described.
    fn end(walk: &Walk, is_over: bool, ray_idx: usize, answer: &mut Self::Answer, rest: &mut Rest);

    /// Describes what rays of a packet have hit in common, if it can be done together; whether it could.
    fn describe_packet<S: Simd>(simd: S, together: Together<'_, Self::Answer>) -> bool;

    /// Describes what is still to be described.
    fn describe<S: Simd>(simd: S, tree: &WideTree, rays: &[Ray], rest: &mut Rest, answers: &mut [Self::Answer]);
}

/// The closest hit.
#[derive(Clone, Copy, Debug)]
pub struct Closest;

/// Whether anything is hit.
#[derive(Clone, Copy, Debug)]
pub struct Any;

impl Query for Closest {
    type Answer = Hit;
    const NOTHING: Hit = Hit::MISS;
    const IS_ANY: bool = false;

    #[inline(always)]
    fn scan(world: &World, ray: &PreparedRay) -> Hit {
        linear::closest_hit(world, ray)
    }

    #[inline(always)]
    fn begin<S: Simd>(simd: S, accel: &Accel, world: &World, walk: &Walk) -> Result<Hit, Hit> {
        Ok(accel.closest_unbounded(simd, world, walk))
    }

    type Seen = Seen<[f32; WIDTH]>;

    #[inline(always)]
    fn kept<F: F32Lanes>(seen: Seen<F>) -> Self::Seen {
        let Seen { open, certain, t_low, t_high } = seen;
        Seen { open, certain, t_low: t_low.to_array(), t_high: t_high.to_array() }
    }

    #[inline(always)]
    fn take<S: Simd>(simd: S, tree: &WideTree, walk: &mut Walk, first: u32, tag: Tag, seen: &Self::Seen) -> bool {
        leaf::take_closest(simd, tree, walk, first, tag, seen);
        false
    }

    #[inline(always)]
    fn other_leaf<S: Simd>(simd: S, tree: &WideTree, world: &World, walk: &mut Walk, first: u32, tag: Tag) -> bool {
        leaf::closest(simd, tree, world, walk, first, tag);
        false
    }

    #[inline(always)]
    fn end(walk: &Walk, _is_over: bool, ray_idx: usize, answer: &mut Hit, rest: &mut Rest) {
        // Without a branch, which would go wrong where some rays hit and others do not.
        *answer = walk.best.hit;
        let Best { pending, is_pending, .. } = walk.best;
        rest.push_if(is_pending, Undescribed { ray_idx: ray_idx as u32, pending, tame: walk.tame });
    }

    #[inline(always)]
    fn describe_packet<S: Simd>(simd: S, together: Together<'_, Hit>) -> bool {
        together.describe(simd)
    }

    #[inline(always)]
    fn describe<S: Simd>(simd: S, tree: &WideTree, rays: &[Ray], rest: &mut Rest, answers: &mut [Hit]) {
        rest.describe(simd, tree, rays, answers);
    }
}

impl Query for Any {
    type Answer = bool;
    const NOTHING: bool = false;
    const IS_ANY: bool = true;

    #[inline(always)]
    fn scan(world: &World, ray: &PreparedRay) -> bool {
        linear::occluded(world, ray)
    }

    #[inline(always)]
    fn begin<S: Simd>(simd: S, accel: &Accel, world: &World, walk: &Walk) -> Result<Hit, bool> {
        if accel.is_any_unbounded(simd, world, walk) { Err(true) } else { Ok(Hit::MISS) }
    }

    type Seen = Seen<()>;

    #[inline(always)]
    fn kept<F: F32Lanes>(seen: Seen<F>) -> Self::Seen {
        let Seen { open, certain, .. } = seen;
        Seen { open, certain, t_low: (), t_high: () }
    }

    #[inline(always)]
    fn take<S: Simd>(simd: S, tree: &WideTree, walk: &mut Walk, first: u32, tag: Tag, seen: &Self::Seen) -> bool {
        leaf::take_any(simd, tree, walk, first, tag, seen)
    }

    #[inline(always)]
    fn other_leaf<S: Simd>(simd: S, tree: &WideTree, world: &World, walk: &mut Walk, first: u32, tag: Tag) -> bool {
        leaf::any(simd, tree, world, walk, first, tag)
    }

    #[inline(always)]
    fn end(_walk: &Walk, is_over: bool, _ray_idx: usize, answer: &mut bool, _rest: &mut Rest) {
        *answer = is_over;
    }

    #[inline(always)]
    fn describe_packet<S: Simd>(_simd: S, _together: Together<'_, bool>) -> bool {
        false
    }

    #[inline(always)]
    fn describe<S: Simd>(_simd: S, _tree: &WideTree, _rays: &[Ray], _rest: &mut Rest, _answers: &mut [bool]) {}
}
