//! Triangles against a packet: rays of one origin that run about the same way.
//!
//! The packet is sheared by one slope S for all its rays, and what is left of a ray's own slope is a small δ. For corners
//! b′, c′ sheared by S the edge function of a ray is b′×c′ · (δx, δy, 1): three numbers per edge, computed once for all
//! rays, and two multiply-adds per ray (the normals of edge planes through a common origin, as in Wald, Slusallek, Benthin
//! and Wagner, "Interactive Rendering with Coherent Ray Tracing", 2001, there unsheared and uncertified).
//!
//! With m the largest sheared coordinate, w the largest |δ| and M = m + w·Z, an edge function is wrong by less than
//! 16·u·M·(M + Z) to first order (`docs/NUMERICS.md`): the bound of a single ray, with the packet's width in it.

use super::lane::{EDGE_ERROR, LaneEdges, U32};
use crate::simd::{F32Lanes, MaskLanes, Simd, WIDTH};

/// The shear that the rays of a packet share.
#[derive(Clone, Copy, Debug)]
pub struct PacketShear {
    /// Origin, rounded, in sheared axes.
    pub origin: [f32; 3],
    /// S.
    pub slope: [f32; 2],
    /// The largest |δ| along either axis.
    pub spread: f32,
    /// What the rounding of the origin adds to Z in the bound of an edge function.
    pub reach: f32,
    /// The axis along which all directions are longest.
    pub axis: usize,
}

/// The δ of some rays of a packet: each lies within `reach` of `middle`, by axis.
#[derive(Clone, Copy, Debug)]
pub struct Span {
    /// The middle.
    pub middle: [f32; 2],
    /// The largest distance from it.
    pub reach: [f32; 2],
}

/// Eight triangles as a packet sees them.
#[derive(Clone, Copy, Debug)]
pub struct PacketEdges<F> {
    /// b′×c′, c′×a′, a′×b′, each by component.
    normals: [[F; 3]; 3],
    error: F,
    depths: [F; 3],
    largest_depth: F,
}

/// The same in memory, to be read triangle by triangle.
#[derive(Clone, Copy, Debug)]
pub struct PacketColumns {
    normals: [[[f32; WIDTH]; 3]; 3],
    error: [f32; WIDTH],
    depths: [[f32; WIDTH]; 3],
    largest_depth: [f32; WIDTH],
}

/// What the rounding of the origin by r costs is below 12·r·M: as a share of 16.5·u·M.
pub const REACH_PER_RESIDUAL: f32 = 0.75 / U32;

impl PacketShear {
    /// Eight triangles whose columns begin at `base` and are `stride` apart.
    #[inline(always)]
    pub fn edges<S: Simd>(&self, simd: S, corners: &[f32], base: usize, stride: usize) -> PacketEdges<S::F32> {
        let [[ax, ay, az], [bx, by, bz], [cx, cy, cz]] = simd.load_corners(corners, base, stride, self.axis);
        let (ox, oy, oz) = (simd.splat(self.origin[0]), simd.splat(self.origin[1]), simd.splat(self.origin[2]));
        let (sx, sy) = (simd.splat(-self.slope[0]), simd.splat(-self.slope[1]));
        let (az, bz, cz) = (az - oz, bz - oz, cz - oz);
        let a = [sx.mul_add(az, ax - ox), sy.mul_add(az, ay - oy), az];
        let b = [sx.mul_add(bz, bx - ox), sy.mul_add(bz, by - oy), bz];
        let c = [sx.mul_add(cz, cx - ox), sy.mul_add(cz, cy - oy), cz];
        let m = a[0].abs().max(a[1].abs()).max(b[0].abs().max(b[1].abs())).max(c[0].abs().max(c[1].abs()));
        let largest_depth = az.abs().max(bz.abs()).max(cz.abs());
        let width = largest_depth.mul_add(simd.splat(self.spread), m);
        let reach = largest_depth + simd.splat(self.reach);
        // The product overflows where those of the edge functions may.
        let error = (width * (width + reach)).mul_add(simd.splat(EDGE_ERROR * U32), simd.splat(f32::MIN_POSITIVE));
        PacketEdges { normals: [cross(b, c), cross(c, a), cross(a, b)], error, depths: [az, bz, cz], largest_depth }
    }
}

impl Span {
    /// No less than the largest magnitude of any δ in it.
    #[inline(always)]
    pub fn farthest(&self) -> f32 {
        let [x, y] = [self.middle[0].abs() + self.reach[0], self.middle[1].abs() + self.reach[1]];
        // A margin for the sums, which are rounded.
        if x > y { x * SUM_MARGIN } else { y * SUM_MARGIN }
    }

    /// Triangles that some ray of the span does not certainly pass outside of: no two edge functions have certain signs that
    /// differ for all rays. One bit each.
    #[inline(always)]
    pub fn open<S: Simd>(&self, simd: S, edges: &PacketEdges<S::F32>) -> u32 {
        let (cx, cy) = (simd.splat(self.middle[0]), simd.splat(self.middle[1]));
        let (wx, wy) = (simd.splat(self.reach[0]), simd.splat(self.reach[1]));
        let [na, nb, nc] = edges.normals;
        let (a, b, c) = (at(na, cx, cy), at(nb, cx, cy), at(nc, cx, cy));
        let (ra, rb, rc) = (reach(na, wx, wy), reach(nb, wx, wy), reach(nc, wx, wy));
        let highest_low = (a - ra).max(b - rb).max(c - rc);
        let lowest_high = (a + ra).min(b + rb).min(c + rc);
        let error = edges.error * simd.splat(SPAN_ERROR);
        let outside = error.lt(highest_low) & lowest_high.lt(-error);
        (!outside).bits()
    }
}

/// More than what a rounded sum may be too small by.
const SUM_MARGIN: f32 = 1.0 + 2.0 * U32;

/// Evaluating the ends of a span costs 2·m² + 10·m·w·Z roundings more than evaluating one ray.
const SPAN_ERROR: f32 = 1.25;

/// An edge function at a δ.
#[inline(always)]
fn at<F: F32Lanes>(normal: [F; 3], dx: F, dy: F) -> F {
    normal[0].mul_add(dx, normal[1].mul_add(dy, normal[2]))
}

/// What the slopes of a span can add to an edge function, or take from it.
#[inline(always)]
fn reach<F: F32Lanes>(normal: [F; 3], wx: F, wy: F) -> F {
    normal[0].abs().mul_add(wx, normal[1].abs() * wy)
}

#[inline(always)]
fn cross<F: F32Lanes>(p: [F; 3], q: [F; 3]) -> [F; 3] {
    [p[1].mul_add(q[2], -(p[2] * q[1])), p[2].mul_add(q[0], -(p[0] * q[2])), p[0].mul_add(q[1], -(p[1] * q[0]))]
}

impl<F: F32Lanes> PacketEdges<F> {
    /// The triangles in memory.
    #[inline(always)]
    pub fn columns(&self) -> PacketColumns {
        let [na, nb, nc] = self.normals;
        let [a, b, c] = self.depths;
        PacketColumns {
            normals: [stored(na), stored(nb), stored(nc)],
            error: self.error.to_array(),
            depths: stored([a, b, c]),
            largest_depth: self.largest_depth.to_array(),
        }
    }
}

#[inline(always)]
fn stored<F: F32Lanes>([x, y, z]: [F; 3]) -> [[f32; WIDTH]; 3] {
    [x.to_array(), y.to_array(), z.to_array()]
}

impl PacketColumns {
    /// A triangle against eight rays of the packet by their δ: what a single ray has in its lanes, with the lanes being
    /// rays.
    #[inline(always)]
    pub fn edges<S: Simd>(&self, simd: S, triangle: usize, dx: S::F32, dy: S::F32) -> LaneEdges<S::F32> {
        let i = triangle % WIDTH;
        let [na, nb, nc] = &self.normals;
        let [a, b, c] = &self.depths;
        LaneEdges {
            weights: [weight(simd, na, i, dx, dy), weight(simd, nb, i, dx, dy), weight(simd, nc, i, dx, dy)],
            error: simd.splat(self.error[i]),
            depths: [simd.splat(a[i]), simd.splat(b[i]), simd.splat(c[i])],
            largest_depth: simd.splat(self.largest_depth[i]),
        }
    }
}

#[inline(always)]
fn weight<S: Simd>(simd: S, [x, y, z]: &[[f32; WIDTH]; 3], i: usize, dx: S::F32, dy: S::F32) -> S::F32 {
    simd.splat(x[i]).mul_add(dx, simd.splat(y[i]).mul_add(dy, simd.splat(z[i])))
}
