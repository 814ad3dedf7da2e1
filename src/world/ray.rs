//! Rays and hits.

use bytemuck::{Pod, Zeroable};
use glam::DVec3;

use super::{InstanceId, MaterialId, ObjectId, PrimKind, PrimRef, World};
use crate::numeric::four::{FourRays, RayNumbers};
use crate::numeric::prepared::PreparedRay;
use crate::numeric::ratio::Parameter;
use crate::numeric::triangle::TriangleHit;
use crate::simd::{Simd, WIDTH64};

/// A ray: the points `origin + t * direction` with `t_min < t < t_max`.
///
/// The direction need not be of unit length; `t` is in units of the direction's length. A direction of zero or with a
/// NaN hits nothing.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
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

    /// Four rays in lanes.
    #[inline(always)]
    pub fn in_lanes<S: Simd>(simd: S, [a, b, c, d]: [&Ray; WIDTH64]) -> FourRays<S::F64> {
        FourRays::new(simd, [a.numbers(), b.numbers(), c.numbers(), d.numbers()])
    }

    /// The ray as numbers.
    #[inline(always)]
    fn numbers(&self) -> &RayNumbers {
        // As they lie in memory: copied one by one they would be put into lanes one by one.
        bytemuck::cast_ref(self)
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
    /// The placement that was hit, if it was one: `prim` is then a triangle of its prototype.
    pub instance: InstanceId,
}

const _: () = assert!(size_of::<Ray>() == 64 && size_of::<Hit>() == 40);

impl Hit {
    /// No hit.
    pub const MISS: Hit =
        Hit { t: f64::INFINITY, u: 0.0, v: 0.0, prim: PrimRef::NONE, t_rest: 0.0, instance: InstanceId::WORLD };

    /// The hit of a row of triangles.
    #[inline(always)]
    pub fn of_triangle(hit: &TriangleHit, row: usize) -> Hit {
        let TriangleHit { at: Parameter { t, t_rest }, u, v } = *hit;
        Hit { t, u, v, prim: PrimRef::new(PrimKind::Triangle, row), t_rest, instance: InstanceId::WORLD }
    }

    /// The hit of a row of a table whose surfaces have no coordinates.
    #[inline(always)]
    pub fn of_surface(at: Parameter, kind: PrimKind, row: usize) -> Hit {
        let Parameter { t, t_rest } = at;
        Hit { t, u: 0.0, v: 0.0, prim: PrimRef::new(kind, row), t_rest, instance: InstanceId::WORLD }
    }

    /// Whether something was hit.
    #[inline]
    pub fn is_some(&self) -> bool {
        self.prim != PrimRef::NONE
    }

    /// Whether two hits are the same in every bit: `==` takes −0 for 0.
    pub fn same_bits(&self, other: &Hit) -> bool {
        let bits = |hit: &Hit| ([hit.t, hit.u, hit.v].map(f64::to_bits), hit.t_rest.to_bits(), hit.prim, hit.instance);
        bits(self) == bits(other)
    }

    /// Whether this hit comes before `other`: by `t`, then by placement and id, so that the answer never depends on
    /// visiting order.
    #[inline]
    pub fn is_before(&self, other: &Hit) -> bool {
        self.t < other.t || (self.t == other.t && (self.instance, self.prim) < (other.instance, other.prim))
    }

    /// The material of what was hit. Must not be asked of a miss.
    #[inline]
    pub fn material(&self, world: &World) -> MaterialId {
        let placement = self.instance.row().and_then(|row| world.instances.materials[row]);
        placement.unwrap_or_else(|| self.own_material(world))
    }

    /// The material of the row that was hit, whatever its placement says. Must not be asked of a miss.
    #[inline]
    pub fn own_material(&self, world: &World) -> MaterialId {
        let row = self.prim.row();
        if self.prim.is_triangle() {
            return world.meshes.material_of(row);
        }
        // A hit never names a placement itself.
        if self.prim.kind() == PrimKind::Sphere { world.spheres.materials[row] } else { world.quadrics.materials[row] }
    }

    /// The object of the scene file that was hit. Must not be asked of a miss.
    #[inline]
    pub fn object(&self, world: &World) -> ObjectId {
        if let Some(row) = self.instance.row() {
            return world.instances.objects[row];
        }
        let row = self.prim.row();
        match self.prim.kind() {
            PrimKind::Sphere => world.spheres.objects[row],
            PrimKind::Quadric => world.quadrics.objects[row],
            PrimKind::Triangle | PrimKind::Instance => world.meshes.objects[world.meshes.of_triangle(row).idx()],
        }
    }
}
