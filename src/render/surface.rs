//! What lies at a hit, computed once for the hit that won.

use glam::DVec3;

use crate::BARE;
use crate::numeric::U;
use crate::numeric::sphere::to_surface;
use crate::numeric::triangle::to_plane;
use crate::world::{Hit, PrimKind, Ray, World};

/// A point on a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// The point, moved from the ray onto the surface along the normal.
    pub p: DVec3,
    /// Unit geometric normal, as the primitive gives it.
    pub ng: DVec3,
    /// A length that the error of `p` off the surface is a few roundings of.
    pub extent: f64,
}

/// Roundings of |p| + extent that a ray starts off its surface: more than `p` can be off it (`docs/NUMERICS.md`).
const LEAVE_ROUNDINGS: f64 = 8.0;

/// Where a shadow ray ends, the light being at 1. The direction is rounded by u per component, so that a surface which the
/// light lies on exactly is met up to 2u/cos θ too early, θ being the angle of incidence there: 2⁻⁴⁷ = 64u keeps such a
/// surface from blocking its own light up to 88°.
pub const JUST_BEFORE_LIGHT: f64 = 1.0 - 64.0 * U;

impl Surface {
    /// Where a ray of a direction starts, so that it cannot meet the surface again in the point it leaves: off the
    /// surface on the side that it leaves by.
    #[inline]
    pub fn leave(&self, direction: DVec3) -> DVec3 {
        let distance = self.clearance(0.0);
        let side = if self.ng.dot(direction) < 0.0 { -distance } else { distance };
        self.p + side * self.ng
    }

    /// How far off the surface a ray starts, at least, that starts within `reach` of the point.
    #[inline]
    pub fn clearance(&self, reach: f64) -> f64 {
        LEAVE_ROUNDINGS * U * (self.p.abs().max_element() + self.extent + reach)
    }
}

/// The surface at a hit. The ray's own point o + t·d is as far off the surface as t is rounded, which grows with the
/// distance; one step along the normal leaves only the rounding of the point itself.
#[inline(always)]
pub fn describe(world: &World, ray: &Ray, hit: &Hit) -> Surface {
    describe_in::<true, true>(world, ray, hit)
}

/// [`describe`] in a world of which it is known whether it has spheres or quadrics, and whether anything is placed.
#[inline(always)]
pub fn describe_in<const CURVED: bool, const PLACED: bool>(world: &World, ray: &Ray, hit: &Hit) -> Surface {
    if PLACED && let Some(placement) = hit.instance.row() {
        return describe_placed(world, placement, ray, hit);
    }
    let along = point_along(ray.origin, ray.direction, hit);
    let row = hit.prim.row();
    if !CURVED || hit.prim.is_triangle() {
        return describe_triangle(world, row, along);
    }
    // A hit never names a placement itself.
    if hit.prim.kind() != PrimKind::Sphere {
        return describe_quadric(world, row, ray, along);
    }
    let (center, radius) = (world.spheres.centers[row], world.spheres.radii[row]);
    let off = along - center;
    let length = off.length();
    let ng = if length > 0.0 && length < f64::INFINITY { off / length } else { facing(ray) };
    let p = along + to_surface(center, radius, along, ng);
    // Squares of radii beyond 1e154 overflow.
    let p = if p.is_finite() { p } else { step_along(center, radius, ng) };
    Surface { p, ng, extent: radius }
}

#[inline(always)]
fn describe_triangle(world: &World, row: usize, along: DVec3) -> Surface {
    let corners = world.triangles.corners(row);
    let extent = (along - corners[0].as_dvec3()).abs().max_element();
    Surface { p: along + to_plane(corners, along), ng: world.triangles.ng(row), extent }
}

/// A triangle of a placement: described in its own space, where it was hit, and carried into the world.
#[inline(always)]
fn describe_placed(world: &World, placement: usize, ray: &Ray, hit: &Hit) -> Surface {
    let instances = &world.instances;
    let to_object = &instances.object_from_world[placement];
    let (origin, direction) = (to_object.transform_point3(ray.origin), to_object.transform_vector3(ray.direction));
    let Surface { p, ng, extent: _ } = describe_triangle(world, hit.prim.row(), point_along(origin, direction, hit));
    Surface {
        p: instances.world_from_object[placement].transform_point3(p),
        ng: instances.normal(placement, ng).unwrap_or_else(|| facing(ray)),
        extent: instances.extents[placement],
    }
}

/// The point of a ray at a hit.
#[inline(always)]
fn point_along(origin: DVec3, direction: DVec3, hit: &Hit) -> DVec3 {
    step_along(step_along(origin, hit.t, direction), hit.t * f64::from(hit.t_rest), direction)
}

fn describe_quadric(world: &World, row: usize, ray: &Ray, along: DVec3) -> Surface {
    let quadric = &world.quadrics.surfaces[row];
    let h = along - quadric.center;
    let gradient = quadric.half_gradient(h);
    // At an apex the gradient is zero: the surface is taken to face the ray, and to be as uncertain as it is large.
    let Some(ng) = gradient.try_normalize() else {
        return Surface { p: along, ng: facing(ray), extent: h.abs().max_element() };
    };
    let steepness = 2.0 * gradient.length();
    let value = h.dot(gradient + quadric.linear) + quadric.constant;
    // What `along` can be off the surface by, as roundings of the way it came, and what the step can be wrong by: a
    // step that is not much better than the point it starts from is not made (near an apex, or where terms cancel).
    let way = ray.origin.abs().max_element() + along.abs().max_element();
    let coarseness = quadric.value_size(h) / steepness;
    // The step is wrong by at most 11 roundings of the coarseness, `along` by 2·√3 roundings of the way: the extent
    // covers either, times LEAVE_ROUNDINGS.
    // And a step is only as good as the gradient is constant along it: near the crossing of two planes, where it turns
    // within the rounding of the point, a step leads anywhere.
    let step = value / steepness;
    let is_straight = step.abs() * quadric.bend() <= STRAIGHTNESS * gradient.length();
    let (step, uncertain) =
        if coarseness < STEP_GAIN * way && is_straight { (step, 2.0 * coarseness) } else { (0.0, 0.5 * way) };
    Surface { p: step_along(along, -step, ng), ng, extent: h.abs().max_element() + uncertain }
}

/// A step along the normal is made when the value it is made of has a rounding this much smaller than the way.
const STEP_GAIN: f64 = 1.0 / 16.0;

/// Share of itself that the gradient may turn by along a step: Newton's step is then wrong by half of that share.
const STRAIGHTNESS: f64 = 1.0 / 8.0;

/// from + length·direction, rounded once.
#[inline(always)]
fn step_along(from: DVec3, length: f64, direction: DVec3) -> DVec3 {
    let on = |i: usize| length.mul_add(direction[i], from[i]);
    DVec3::new(on(0), on(1), on(2))
}

fn facing(ray: &Ray) -> DVec3 {
    -ray.direction.normalize_or_zero()
}

/// The unit shading normal at a hit: interpolated over a smooth mesh (Phong 1975), else the geometric one.
#[inline]
pub fn shading_normal(world: &World, hit: &Hit, ng: DVec3) -> DVec3 {
    let Some([a, b, c]) = vertex_normals(world, hit) else { return ng };
    let w = 1.0 - hit.u - hit.v;
    (w * a + hit.u * b + hit.v * c).try_normalize().unwrap_or(ng)
}

/// The normals at the corners of the triangle that was hit, if it belongs to a smooth mesh.
#[inline]
pub(super) fn vertex_normals(world: &World, hit: &Hit) -> Option<[DVec3; 3]> {
    if hit.prim.kind() != PrimKind::Triangle {
        return None;
    }
    let row = hit.prim.row();
    let mesh = world.meshes.of_triangle(row).idx();
    let first_normal = world.meshes.first_normal[mesh]?;
    let first_vertex = world.meshes.first_vertex[mesh];
    let normal = |vertex: u32| world.triangles.normals[(vertex - first_vertex + first_normal) as usize].as_dvec3();
    let normals = world.triangles.vertices[row].map(normal);
    match hit.instance.row() {
        Some(placement) if !BARE => {
            Some(normals.map(|normal| world.instances.normal(placement, normal).unwrap_or(normal)))
        }
        _ => Some(normals),
    }
}

/// The corners of the triangle that was hit, in world space.
#[inline]
pub(super) fn world_corners(world: &World, hit: &Hit) -> [DVec3; 3] {
    let corners = world.triangles.corners(hit.prim.row()).map(|corner| corner.as_dvec3());
    match hit.instance.row() {
        Some(placement) => corners.map(|corner| world.instances.world_from_object[placement].transform_point3(corner)),
        None => corners,
    }
}
