//! Where rays leave a coarse smooth mesh, so that its facets do not darken what its normals light.
//!
//! The normals of a smooth mesh are those of the surface that the mesh stands for; its facets lie below that surface.
//! Near the terminator, where the light grazes, a shadow ray from a facet that the interpolated normal turns to the
//! light runs into the neighbouring facet, and the facets become visible as black teeth. The correction is that of
//! J. Hanika, "Hacking the Shadow Terminator", Ray Tracing Gems II (2021), chapter 4: the ray starts above the facet
//! by what the facet's point p lies below the tangent planes of the vertices pᵢ, nᵢ, dᵢ = min(0, (p − pᵢ)·nᵢ).
//!
//! Departures:
//! - Hanika moves p by −Σ bᵢ·dᵢ·nᵢ, each part along its vertex's normal. Here the whole of it, λ = −Σ bᵢ·dᵢ, goes along
//!   the unit shading normal N. For fine meshes that is the same; for coarse ones the parts across N, which do not help,
//!   leave less along N: of a triangle on a sphere whose edges span more than 90°, points near its vertices stay below
//!   the sphere (of 90,000 cases of the stress suite 15 stay black, a third being black without correction). Along N none
//!   does. On the unit sphere with nᵢ = pᵢ let s = |p|², so that N = p/√s. Then
//!   dᵢ = p·pᵢ − 1, λ = 1 − s, and the start has the height p·N + λ = √s + 1 − s = 1 + √s·(1 − √s) ≥ 1 along N, for any
//!   triangle. All of the mesh has heights of at most 1, and a ray to the side of N only gains height: it meets nothing.
//! - The start is also moved off the surface as other rays' starts are, but along N, to the side on which the light is
//!   lit by N: a facet that faces away from a light which its normal faces is not left through its back.
//! - Where N and the facet's normal disagree by 90° or more, the normals describe no surface near the facet, and nothing
//!   is corrected.

use glam::DVec3;

use super::surface::{Surface, vertex_normals, world_corners};
use crate::world::{Hit, World};

/// Where rays to the side of the unit shading normal `ns` start; `None` for what is not on a smooth mesh. `ns` may have
/// been turned to the viewer: the vertex normals are turned with it.
#[inline]
pub fn start(world: &World, hit: &Hit, surface: &Surface, ns: DVec3) -> Option<DVec3> {
    let normals = vertex_normals(world, hit)?;
    let weights = [1.0 - hit.u - hit.v, hit.u, hit.v];
    // Turned normals are opposite to the interpolated one.
    let interpolated = weights[0] * normals[0] + weights[1] * normals[1] + weights[2] * normals[2];
    let side = if interpolated.dot(ns) < 0.0 { -1.0 } else { 1.0 };
    if side * surface.ng.dot(ns) <= 0.0 {
        return None;
    }
    let corners = world_corners(world, hit);
    let below = |i: usize| (side * (corners[i] - surface.p).dot(normals[i])).max(0.0);
    let lift = weights[0] * below(0) + weights[1] * below(1) + weights[2] * below(2);
    Some(surface.p + (lift + surface.clearance(lift)) * ns)
}
