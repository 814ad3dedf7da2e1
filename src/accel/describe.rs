//! The last step of closest hits: parameter and weights of what was certainly hit, four rays at a time.

pub mod packet;
mod sphere;
mod triangle;

use super::walk::Pending;
use super::wide::WideTree;
use crate::numeric::four::FourRays;
use crate::simd::{Batch, Simd, WIDTH64};
use crate::world::{Hit, InstanceId, PrimRef, Ray};

/// A hit that is still to be described.
#[derive(Clone, Copy, Debug)]
pub struct Undescribed {
    /// The ray's place in the batch.
    pub ray_idx: u32,
    /// Whether its numbers are tame.
    pub tame: bool,
    /// What it hit.
    pub pending: Pending,
}

/// Hits of a batch that are still to be described.
#[derive(Clone, Debug)]
pub struct Rest {
    /// They come first, and what stands behind them means nothing.
    all: Vec<Undescribed>,
    n: usize,
}

/// Four hits, where f64 in pairs is certain of them.
struct Described {
    t: [f64; WIDTH64],
    t_rest: [f64; WIDTH64],
    u: [f64; WIDTH64],
    v: [f64; WIDTH64],
    /// Where it is, one bit each.
    certain: u32,
}

impl Rest {
    /// None yet, and room for one per ray.
    pub fn new(n_rays: usize) -> Rest {
        Rest { all: vec![Undescribed { ray_idx: 0, pending: Pending::NOTHING, tame: false }; n_rays + 1], n: 0 }
    }

    /// Adds one, if it is one; a ray must not be added twice.
    #[inline(always)]
    pub fn push_if(&mut self, is_one: bool, undescribed: Undescribed) {
        self.all[self.n] = undescribed;
        self.n += usize::from(is_one);
    }

    /// Describes all of them.
    #[inline(always)]
    pub fn describe<S: Simd>(&mut self, simd: S, tree: &WideTree, rays: &[Ray], hits: &mut [Hit]) {
        let all = &mut self.all[..self.n];
        let mut n_triangles = all.len();
        if !tree.sphere_rows.is_empty() {
            // Triangles first.
            n_triangles = 0;
            for i in 0..all.len() {
                if all[i].pending.is_triangle() {
                    all.swap(i, n_triangles);
                    n_triangles += 1;
                }
            }
        }
        let (triangles, spheres) = all.split_at(n_triangles);
        for four in triangles.chunks(WIDTH64) {
            let described = triangle::of_four(simd, tree, rays, filled(four));
            described.write(simd, tree, rays, four, hits);
        }
        for four in spheres.chunks(WIDTH64) {
            let described = sphere::of_four(simd, tree, rays, filled(four));
            described.write(simd, tree, rays, four, hits);
        }
    }
}

impl Described {
    /// Writes the hits where they belong; those that are not certain are found one by one.
    #[inline(always)]
    fn write<S: Simd>(&self, simd: S, tree: &WideTree, rays: &[Ray], four: &[Undescribed], hits: &mut [Hit]) {
        for (lane, of) in four.iter().enumerate() {
            let hit = &mut hits[of.ray_idx as usize];
            if of.tame && self.certain >> lane & 1 == 1 {
                self.write_one(lane, of.pending.prim(tree), hit);
            } else {
                simd.apart(DescribeOne { tree, ray: &rays[of.ray_idx as usize], pending: of.pending, hit });
            }
        }
    }

    /// Writes one of them.
    #[inline(always)]
    fn write_one(&self, lane: usize, prim: PrimRef, hit: &mut Hit) {
        // Field by field: a whole one would be built elsewhere and copied.
        (hit.t, hit.u, hit.v) = (self.t[lane], self.u[lane], self.v[lane]);
        (hit.prim, hit.t_rest, hit.instance) = (prim, self.t_rest[lane] as f32, InstanceId::WORLD);
    }
}

/// The rays in lanes.
#[inline(always)]
fn rays_of<S: Simd>(simd: S, rays: &[Ray], [a, b, c, d]: [&Undescribed; WIDTH64]) -> FourRays<S::F64> {
    let (a, b) = (&rays[a.ray_idx as usize], &rays[b.ray_idx as usize]);
    let (c, d) = (&rays[c.ray_idx as usize], &rays[d.ray_idx as usize]);
    Ray::in_lanes(simd, [a, b, c, d])
}

/// Four of up to four; those that are missing repeat the first.
#[inline(always)]
fn filled(four: &[Undescribed]) -> [&Undescribed; WIDTH64] {
    let mut filled = [&four[0]; WIDTH64];
    for (filled, of) in filled.iter_mut().zip(four) {
        *filled = of;
    }
    filled
}

/// A hit by itself, where the arithmetic of four is not certain.
struct DescribeOne<'a> {
    tree: &'a WideTree,
    ray: &'a Ray,
    pending: Pending,
    hit: &'a mut Hit,
}

impl Batch for DescribeOne<'_> {
    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Some(ray) = self.ray.prepare_with(simd) else { return };
        let hit = self.pending.intersect(self.tree, &ray);
        // Only what is certainly hit is pending.
        debug_assert!(hit.is_some());
        if let Some(hit) = hit {
            *self.hit = hit;
        }
    }
}
