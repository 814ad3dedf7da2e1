//! The last step of closest hits: parameter and weights of what was certainly hit, four rays at a time.

mod sphere;

use glam::Vec3;

use super::walk::Pending;
use super::wide::WideTree;
use crate::numeric::edge::{Sheared, shear};
use crate::numeric::four::FourRays;
use crate::numeric::plane::{Pair, plane_quotient};
use crate::simd::{Batch, F64Lanes, MaskLanes, Simd, WIDTH64};
use crate::world::{Hit, InstanceId, PrimKind, PrimRef, Ray};

/// A hit that is still to be described.
#[derive(Clone, Copy, Debug)]
pub struct Undescribed {
    /// The ray's place in the batch.
    pub ray_idx: u32,
    /// What it hit.
    pub pending: Pending,
    /// Whether its numbers are tame.
    pub tame: bool,
}

/// Hits of a batch that are still to be described.
#[derive(Clone, Debug)]
pub struct Rest {
    /// They come first, and what stands behind them means nothing.
    all: Vec<Undescribed>,
    n: usize,
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
                if all[i].pending.tag.is_triangles() {
                    all.swap(i, n_triangles);
                    n_triangles += 1;
                }
            }
        }
        let (triangles, spheres) = all.split_at(n_triangles);
        for four in triangles.chunks(WIDTH64) {
            describe_four(simd, tree, rays, four, hits);
        }
        for four in spheres.chunks(WIDTH64) {
            sphere::describe_four(simd, tree, rays, four, hits);
        }
    }
}

/// Rays and the triangles that they hit, each in its ray's axes. (No closures: they are not always inlined.)
#[inline(always)]
fn gather<S: Simd>(simd: S, tree: &WideTree, rays: &[Ray], four: [&Undescribed; WIDTH64]) -> Pair<S::F64> {
    let lanes = rays_of(simd, rays, four);
    let [a, b, c, d] = four;
    let all = [a.pending.corners(tree), b.pending.corners(tree), c.pending.corners(tree), d.pending.corners(tree)];
    let mut corners = lanes_of(simd, &all);
    for corner in &mut corners {
        *corner = lanes.in_axes(*corner);
    }
    Pair { origin: lanes.in_axes(lanes.origin), direction: lanes.in_axes(lanes.direction), corners }
}

/// The rays in lanes.
#[inline(always)]
fn rays_of<S: Simd>(simd: S, rays: &[Ray], [a, b, c, d]: [&Undescribed; WIDTH64]) -> FourRays<S::F64> {
    let (a, b) = (&rays[a.ray_idx as usize], &rays[b.ray_idx as usize]);
    let (c, d) = (&rays[c.ray_idx as usize], &rays[d.ray_idx as usize]);
    Ray::in_lanes(simd, [a, b, c, d])
}

/// The corners of four triangles in lanes.
#[inline(always)]
fn lanes_of<S: Simd>(simd: S, [a, b, c, d]: &[[Vec3; 3]; WIDTH64]) -> [[S::F64; 3]; 3] {
    let mut lanes = [[simd.splat64(0.0); 3]; 3];
    for (i, lanes) in lanes.iter_mut().enumerate() {
        *lanes = [
            simd.widen([a[i].x, b[i].x, c[i].x, d[i].x]),
            simd.widen([a[i].y, b[i].y, c[i].y, d[i].y]),
            simd.widen([a[i].z, b[i].z, c[i].z, d[i].z]),
        ];
    }
    lanes
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

/// The same arithmetic as [`triangle::intersect`], for which the lanes are that are not certain.
#[inline(always)]
fn describe_four<S: Simd>(simd: S, tree: &WideTree, rays: &[Ray], four: &[Undescribed], hits: &mut [Hit]) {
    let pair = gather(simd, tree, rays, filled(four));

    // Weights.
    let Sheared { weights: [weight_a, weight_b, weight_c], error, .. } = shear(&pair);
    let reciprocal = simd.splat64(1.0) / (weight_a + weight_b + weight_c);
    let (u, v) = ((weight_b * reciprocal).to_array(), (weight_c * reciprocal).to_array());
    let certain = error.lt(weight_a.abs()) & error.lt(weight_b.abs()) & error.lt(weight_c.abs());

    // Parameter.
    let [n, d] = plane_quotient(&pair);
    let (at, accepted) = n.accepted_quotient(d);
    let (t, rest) = (at.hi.to_array(), (at.lo / at.hi).to_array());
    let right = (certain & accepted).bits();

    for (lane, of) in four.iter().enumerate() {
        let hit = &mut hits[of.ray_idx as usize];
        if of.tame && right >> lane & 1 == 1 {
            // Field by field: a whole one would be built elsewhere and copied.
            (hit.t, hit.u, hit.v, hit.t_rest) = (t[lane], u[lane], v[lane], rest[lane] as f32);
            hit.prim = PrimRef::new(PrimKind::Triangle, of.pending.row(tree));
            hit.instance = InstanceId::WORLD;
        } else {
            simd.apart(DescribeOne { tree, ray: &rays[of.ray_idx as usize], pending: of.pending, hit });
        }
    }
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
