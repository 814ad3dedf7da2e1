//! The edge functions of Woop, Benthin and Wald (2013) in f64, with a bound; for one ray and for lanes of rays.

use super::U;
use super::plane::Pair;
use crate::simd::F64Lanes;

/// A triangle seen along a ray.
#[derive(Clone, Copy, Debug)]
pub struct Sheared<F> {
    /// The edge functions opposite the first, second and third corner.
    pub weights: [F; 3],
    /// What each may be wrong by.
    pub error: F,
    /// Depths of the corners along the ray's longest axis, from its origin.
    pub depths: [F; 3],
    /// The largest magnitude among them.
    pub largest_depth: F,
}

/// The first-order error of an edge function is below 20·u·m·(m + Z), where m is the largest sheared coordinate and Z
/// the largest depth (`docs/NUMERICS.md`); the rest covers the second order and the rounding of the bound.
pub const EDGE_ERROR: f64 = 20.5;

/// Shears a triangle so that the ray runs along z, and evaluates its edge functions at the ray.
///
/// (Spelled out: closures over arrays are not always inlined, and a call here costs a third.)
#[inline(always)]
pub fn shear<F: F64Lanes>(pair: &Pair<F>) -> Sheared<F> {
    // One division for both slopes; each is within 2u.
    let reciprocal = pair.direction[2].same(1.0) / pair.direction[2];
    let slope = [pair.direction[0] * reciprocal, pair.direction[1] * reciprocal];
    let (a, b, c) =
        (seen(pair, slope, pair.corners[0]), seen(pair, slope, pair.corners[1]), seen(pair, slope, pair.corners[2]));
    let weights = [b[0] * c[1] - b[1] * c[0], c[0] * a[1] - c[1] * a[0], a[0] * b[1] - a[1] * b[0]];
    let m = a[0].abs().max(b[0].abs()).max(c[0].abs()).max(a[1].abs().max(b[1].abs()).max(c[1].abs()));
    let largest_depth = a[2].abs().max(b[2].abs()).max(c[2].abs());
    // The product overflows where those of the edge functions may.
    let error = m * (m + largest_depth) * m.same(EDGE_ERROR * U) + m.same(f64::MIN_POSITIVE);
    Sheared { weights, error, depths: [a[2], b[2], c[2]], largest_depth }
}

/// A corner seen from the origin, sheared so that the ray runs along z.
#[inline(always)]
fn seen<F: F64Lanes>(pair: &Pair<F>, slope: [F; 2], corner: [F; 3]) -> [F; 3] {
    let [x, y, z] = [corner[0] - pair.origin[0], corner[1] - pair.origin[1], corner[2] - pair.origin[2]];
    [x - slope[0] * z, y - slope[1] * z, z]
}
