//! The last step of closest hits: parameter and weights of what was certainly hit, four rays at a time.

mod sphere;

use super::walk::Pending;
use super::wide::WideTree;
use crate::numeric::edge::{Sheared, shear};
use crate::numeric::plane::{Pair, plane_quotient};
use crate::numeric::prepared::AXES;
use crate::numeric::ratio::{ACCEPTED_RELATIVE_ERROR, Parameter};
use crate::numeric::triangle::TriangleHit;
use crate::simd::{Batch, F64Lanes, MaskLanes, Simd, WIDTH64};
use crate::world::{Hit, Ray};

/// A hit that is still to be described.
#[derive(Clone, Copy, Debug)]
pub struct Undescribed {
    /// The ray's place in the batch.
    pub ray_idx: u32,
    /// What it hit.
    pub pending: Pending,
    /// The axis along which its direction is longest.
    pub axis: u8,
    /// Whether its numbers are tame.
    pub tame: bool,
}

/// Hits of a batch that are still to be described.
#[derive(Clone, Debug, Default)]
pub struct Rest {
    triangles: Vec<Undescribed>,
    spheres: Vec<Undescribed>,
}

impl Rest {
    /// Adds a triangle.
    #[inline(always)]
    pub fn push_triangle(&mut self, undescribed: Undescribed) {
        self.triangles.push(undescribed);
    }

    /// Adds one.
    #[inline(always)]
    pub fn push(&mut self, undescribed: Undescribed) {
        if undescribed.pending.tag.is_triangles() {
            self.triangles.push(undescribed);
        } else {
            self.spheres.push(undescribed);
        }
    }

    /// Describes all of them.
    #[inline(always)]
    pub fn describe<S: Simd>(&self, simd: S, tree: &WideTree, rays: &[Ray], hits: &mut [Hit]) {
        for four in self.triangles.chunks(WIDTH64) {
            describe_four(simd, tree, rays, four, hits);
        }
        for four in self.spheres.chunks(WIDTH64) {
            sphere::describe_four(simd, tree, rays, four, hits);
        }
    }
}

/// Coordinates of rays and corners, one array per lane-wide number.
struct Columns {
    origin: [[f64; WIDTH64]; 3],
    direction: [[f64; WIDTH64]; 3],
    corners: [[[f64; WIDTH64]; 3]; 3],
}

#[inline(always)]
fn load_vector<S: Simd>(simd: S, columns: &[[f64; WIDTH64]; 3]) -> [S::F64; 3] {
    [simd.load64(&columns[0]), simd.load64(&columns[1]), simd.load64(&columns[2])]
}

#[inline(always)]
fn gather(tree: &WideTree, rays: &[Ray], four: &[Undescribed]) -> Columns {
    let mut columns =
        Columns { origin: [[0.0; WIDTH64]; 3], direction: [[0.0; WIDTH64]; 3], corners: [[[0.0; WIDTH64]; 3]; 3] };
    for lane in 0..WIDTH64 {
        // Lanes without a ray repeat the last one.
        let of = &four[lane.min(four.len() - 1)];
        let axes = AXES[of.axis as usize % 3];
        let ray = &rays[of.ray_idx as usize];
        let corners = of.pending.corners(tree);
        for (i, axis) in axes.into_iter().enumerate() {
            columns.origin[i][lane] = ray.origin[axis];
            columns.direction[i][lane] = ray.direction[axis];
            for (j, corner) in corners.iter().enumerate() {
                columns.corners[j][i][lane] = f64::from(corner[axis]);
            }
        }
    }
    columns
}

/// The same arithmetic as [`triangle::intersect`], for which the lanes are that are not certain.
#[inline(always)]
fn describe_four<S: Simd>(simd: S, tree: &WideTree, rays: &[Ray], four: &[Undescribed], hits: &mut [Hit]) {
    let columns = gather(tree, rays, four);
    let [a, b, c] = columns.corners;
    let pair = Pair {
        origin: load_vector(simd, &columns.origin),
        direction: load_vector(simd, &columns.direction),
        corners: [load_vector(simd, &a), load_vector(simd, &b), load_vector(simd, &c)],
    };

    // Weights.
    let Sheared { weights: [weight_a, weight_b, weight_c], error, .. } = shear(&pair);
    let reciprocal = simd.splat64(1.0) / (weight_a + weight_b + weight_c);
    let (u, v) = ((weight_b * reciprocal).to_array(), (weight_c * reciprocal).to_array());
    let certain = error.lt(weight_a.abs()) & error.lt(weight_b.abs()) & error.lt(weight_c.abs());

    // Parameter.
    let [n, d] = plane_quotient(&pair);
    let (at, relative_error) = n.quotient(d);
    let accepted = n.error.lt(n.value.hi.abs())
        & d.error.lt(d.value.hi.abs())
        & relative_error.le(simd.splat64(ACCEPTED_RELATIVE_ERROR));
    let (t, rest) = (at.hi.to_array(), (at.lo / at.hi).to_array());
    let right = (certain & accepted).bits();

    for (lane, of) in four.iter().enumerate() {
        let hit = &mut hits[of.ray_idx as usize];
        if of.tame && right >> lane & 1 == 1 {
            let at = Parameter { t: t[lane], t_rest: rest[lane] as f32 };
            *hit = Hit::of_triangle(&TriangleHit { at, u: u[lane], v: v[lane] }, of.pending.row(tree));
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
