//! Quadrics against a packet, ray by ray: their tests have no lanes. What the packet shares is the way to them.

use super::super::coherence::N_RAYS;
use super::super::query::{Any, Closest, Query};
use super::super::wide::WideTree;
use super::{DONE, Found};
use crate::numeric::prepared::PreparedRay;
use crate::simd::{Batch, Simd, WIDTH};
use crate::world::{Hit, PrimRef, World};

/// A query that quadrics can answer for a ray of a packet.
pub trait QuadricQuery: Query {
    /// Asks a quadric for a ray.
    fn ask(
        tree: &WideTree,
        world: &World,
        quadric: PrimRef,
        found: &mut Found<Self::Answer>,
        i: usize,
        ray: &PreparedRay,
    );
}

/// Quadrics of a leaf, or those without a box, against the rays of a packet that still want to know.
pub struct Quadrics<'a, 'b, Q: QuadricQuery> {
    /// The tree.
    pub tree: &'a WideTree,
    /// What it was built over.
    pub world: &'a World,
    /// What the rays have found.
    pub found: &'a mut Found<'b, Q::Answer>,
    /// The quadrics.
    pub quadrics: &'a [PrimRef],
    /// No ray meets them before this parameter.
    pub t_near: f32,
}

impl<Q: QuadricQuery> Batch for Quadrics<'_, '_, Q> {
    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Quadrics { tree, world, found, quadrics, t_near } = self;
        for i in 0..N_RAYS {
            if found.t_max[i / WIDTH][i % WIDTH] < t_near {
                continue;
            }
            let Some(ray) = found.rays[i].prepare_with(simd) else { continue };
            for &quadric in quadrics {
                Q::ask(tree, world, quadric, found, i, &ray);
            }
        }
    }
}

impl QuadricQuery for Closest {
    #[inline(always)]
    fn ask(tree: &WideTree, world: &World, quadric: PrimRef, found: &mut Found<Hit>, i: usize, ray: &PreparedRay) {
        // The best hit itself stays inside, since a tie goes by id.
        let cut = f64::from(found.t_max[i / WIDTH][i % WIDTH]).next_up();
        let until = PreparedRay { t_max: if cut < ray.t_max { cut } else { ray.t_max }, ..*ray };
        if let Some(hit) = world.quadrics.intersect(quadric.row(), &until) {
            found.offer(tree, i, ray, hit);
        }
    }
}

impl QuadricQuery for Any {
    #[inline(always)]
    fn ask(_tree: &WideTree, world: &World, quadric: PrimRef, found: &mut Found<bool>, i: usize, ray: &PreparedRay) {
        if found.t_max[i / WIDTH][i % WIDTH] > DONE && world.quadrics.occludes(quadric.row(), ray) {
            found.stop(i);
        }
    }
}
