//! Rays and hits.

use glam::DVec3;

use super::{PrimKind, PrimRef};
use crate::numeric::prepared::PreparedRay;
use crate::numeric::ratio::Parameter;
use crate::numeric::triangle::TriangleHit;
use crate::simd::Simd;

/// A ray: the points `origin + t * direction` with `t_min < t < t_max`.
///
/// The direction need not be of unit length; `t` is in units of the direction's length. A direction of zero or with a
/// NaN hits nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where the ray starts, in world units.
    pub origin: DVec3,
    /// Where it goes; any length but zero.
    pub direction: DVec3,
    /// Open lower end of the interval, at least 0.
    pub t_min: f64,
    /// Open upper end of the interval; may be infinite.
    pub t_max: f64,
}

impl Ray {
    /// A ray over `(0, ∞)`.
    #[inline]
    pub fn new(origin: DVec3, direction: DVec3) -> Ray {
        Ray { origin, direction, t_min: 0.0, t_max: f64::INFINITY }
    }

    /// The same ray ended at `t_max` (exclusive).
    #[inline]
    pub fn until(self, t_max: f64) -> Ray {
        Ray { t_max, ..self }
    }

    /// The ray as the kernels want it; `None` when it can hit nothing (see [`PreparedRay::new`]).
    #[inline(always)]
    pub fn prepare(&self) -> Option<PreparedRay> {
        PreparedRay::new(self.origin, self.direction, self.t_min, self.t_max)
    }

    /// [`Ray::prepare`] in lanes.
    #[inline(always)]
    pub fn prepare_with<S: Simd>(&self, simd: S) -> Option<PreparedRay> {
        PreparedRay::with_lanes(simd, self.origin, self.direction, self.t_min, self.t_max)
    }

    /// The point at `t`.
    #[inline]
    pub fn at(&self, t: f64) -> DVec3 {
        self.origin + t * self.direction
    }
}

/// The answer to a closest-hit query.
///
/// `u` and `v` are the barycentric weights of the second and third vertex of a triangle, and 0 for other kinds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Ray parameter of the hit; infinite for a miss.
    pub t: f64,
    /// Weight of the triangle's second vertex.
    pub u: f64,
    /// Weight of the triangle's third vertex.
    pub v: f64,
    /// What was hit; [`PrimRef::NONE`] for a miss.
    pub prim: PrimRef,
    /// What rounding `t` to f64 lost, as a share of it: it makes the point right to the last bits and never decides
    /// anything.
    pub t_rest: f32,
}

const _: () = assert!(size_of::<Ray>() == 64 && size_of::<Hit>() == 32);

impl Hit {
    /// No hit.
    pub const MISS: Hit = Hit { t: f64::INFINITY, u: 0.0, v: 0.0, prim: PrimRef::NONE, t_rest: 0.0 };

    /// The hit of a row of triangles.
    #[inline(always)]
    pub fn of_triangle(hit: &TriangleHit, row: usize) -> Hit {
        let TriangleHit { at: Parameter { t, t_rest }, u, v } = *hit;
        Hit { t, u, v, prim: PrimRef::new(PrimKind::Triangle, row), t_rest }
    }

    /// Whether something was hit.
    #[inline]
    pub fn is_some(&self) -> bool {
        self.prim != PrimRef::NONE
    }

    /// Whether two hits are the same in every bit: `==` takes −0 for 0.
    pub fn same_bits(&self, other: &Hit) -> bool {
        let bits = |hit: &Hit| ([hit.t, hit.u, hit.v].map(f64::to_bits), hit.t_rest.to_bits(), hit.prim);
        bits(self) == bits(other)
    }

    /// Whether this hit comes before `other`: by `t`, then by id, so that the answer never depends on visiting order.
    #[inline]
    pub fn is_before(&self, other: &Hit) -> bool {
        self.t < other.t || (self.t == other.t && self.prim < other.prim)
    }
}
