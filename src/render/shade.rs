//! The Phong model with mirror reflection, as `docs/SCENE_FORMAT.md` states it:
//!
//! I = k_a·O_a + Σᵢ Sᵢ·Iᵢ·[k_d·O_d·(N·Lᵢ) + k_s·O_s·max(0, R·V)^sh] + k_s·I_r
//!
//! Each feature that a scene may lack is a constant of the stage, so that the code of a lacking one is not there.

use glam::DVec3;

use super::surface::{Surface, describe, shading_normal};
use super::terminator;
use super::trace::Level;
use crate::numeric::U;
use crate::world::{Features, Hit, MaterialId, Ray, World};

/// A shadow ray's consequence: what reaches the viewer if it is not occluded.
#[derive(Clone, Copy, Debug)]
pub struct ShadowRay {
    /// The ray of the level whose hit is lit.
    pub ray_idx: u32,
    /// Radiance that the light adds there.
    pub radiance: DVec3,
}

type Stage = fn(&World, &mut Level, bool, &mut Level, &mut Vec<ShadowRay>, &mut Vec<Ray>);

/// The shading stage of a scene, chosen once by its features.
#[derive(Clone, Copy, Debug)]
pub struct Shading {
    stage: Stage,
}

impl Shading {
    /// The stage that has these features and no others, with or without the correction of [`terminator`].
    pub fn new(features: &Features, terminator: bool) -> Shading {
        let stage = match (features.smooth_normals, terminator) {
            (false, _) => stage_of_sides::<false, false>(features),
            (true, false) => stage_of_sides::<true, false>(features),
            (true, true) => stage_of_sides::<true, true>(features),
        };
        Shading { stage }
    }

    /// Shades all hits of a level: fills its radiance, and the rays that are still to be traced. `bounce` says whether
    /// the next level may have rays.
    pub fn shade(
        &self,
        world: &World,
        level: &mut Level,
        bounce: bool,
        next: &mut Level,
        shadow: &mut Vec<ShadowRay>,
        shadow_rays: &mut Vec<Ray>,
    ) {
        (self.stage)(world, level, bounce, next, shadow, shadow_rays);
    }
}

// From features to constants, one after another.

fn stage_of_sides<const SMOOTH: bool, const TERMINATOR: bool>(features: &Features) -> Stage {
    match features.two_sided {
        false => stage_of_mirrors::<SMOOTH, TERMINATOR, false>(features),
        true => stage_of_mirrors::<SMOOTH, TERMINATOR, true>(features),
    }
}

fn stage_of_mirrors<const SMOOTH: bool, const TERMINATOR: bool, const TWO_SIDED: bool>(features: &Features) -> Stage {
    match (features.reflection, features.direct_light) {
        (false, false) => shade::<SMOOTH, TERMINATOR, TWO_SIDED, false, false>,
        (false, true) => shade::<SMOOTH, TERMINATOR, TWO_SIDED, false, true>,
        (true, false) => shade::<SMOOTH, TERMINATOR, TWO_SIDED, true, false>,
        (true, true) => shade::<SMOOTH, TERMINATOR, TWO_SIDED, true, true>,
    }
}

/// Where a shadow ray ends, the light being at 1. The direction is rounded by u per component, so that a surface which the
/// light lies on exactly is met up to 2u/cos θ too early, θ being the angle of incidence there: 2⁻⁴⁷ = 64u keeps such a
/// surface from blocking its own light up to 88°.
const JUST_BEFORE_LIGHT: f64 = 1.0 - 64.0 * U;

/// A hit ready to be lit.
struct Point {
    surface: Surface,
    material: MaterialId,
    /// Unit shading normal.
    ns: DVec3,
    /// Unit direction to the viewer.
    wo: DVec3,
    /// Where rays to the side of `ns` start, if not at the surface.
    raised: Option<DVec3>,
}

impl Point {
    /// Where a ray of a direction starts.
    #[inline]
    fn leave<const TERMINATOR: bool>(&self, direction: DVec3) -> DVec3 {
        match self.raised {
            Some(start) if TERMINATOR && self.ns.dot(direction) > 0.0 => start,
            _ => self.surface.leave(direction),
        }
    }
}

fn shade<const SMOOTH: bool, const TERMINATOR: bool, const TWO_SIDED: bool, const MIRROR: bool, const LIT: bool>(
    world: &World,
    level: &mut Level,
    bounce: bool,
    next: &mut Level,
    shadow: &mut Vec<ShadowRay>,
    shadow_rays: &mut Vec<Ray>,
) {
    let Level { rays, hits, radiance, .. } = level;
    radiance.clear();
    for (ray_idx, (ray, hit)) in rays.iter().zip(hits.iter()).enumerate() {
        if !hit.is_some() {
            radiance.push(world.background);
            continue;
        }
        let ray_idx = ray_idx as u32;
        let material = hit.prim.material(world);
        radiance.push(world.materials.ambient[material.idx()]);
        let lit = LIT && world.materials.is_lit(material);
        let mirror = MIRROR && bounce && world.materials.reflectance[material.idx()] > 0.0;
        if !lit && !mirror {
            continue;
        }
        let point = point::<SMOOTH, TERMINATOR, TWO_SIDED>(world, ray, hit, material);
        if lit {
            light::<TERMINATOR>(world, &point, ray_idx, shadow, shadow_rays);
        }
        if mirror {
            let direction = 2.0 * point.ns.dot(point.wo) * point.ns - point.wo;
            let origin = point.leave::<TERMINATOR>(direction);
            next.push(Ray::new(origin, direction), ray_idx, world.materials.reflectance[material.idx()]);
        }
    }
}

#[inline]
fn point<const SMOOTH: bool, const TERMINATOR: bool, const TWO_SIDED: bool>(
    world: &World,
    ray: &Ray,
    hit: &Hit,
    material: MaterialId,
) -> Point {
    let surface = describe(world, ray, hit);
    let wo = -ray.direction.normalize();
    let ns = if SMOOTH { shading_normal(world, hit, surface.ng) } else { surface.ng };
    let turned = TWO_SIDED && surface.ng.dot(wo) < 0.0;
    let ns = if turned { -ns } else { ns };
    let raised = if TERMINATOR { terminator::start(world, hit, &surface, ns) } else { None };
    Point { surface, material, ns, wo, raised }
}

/// Sends a shadow ray to each light that the surface faces, with what it would add.
#[inline]
fn light<const TERMINATOR: bool>(
    world: &World,
    point: &Point,
    ray_idx: u32,
    shadow: &mut Vec<ShadowRay>,
    shadow_rays: &mut Vec<Ray>,
) {
    let materials = &world.materials;
    let row = point.material.idx();
    for (&position, &intensity) in world.lights.positions.iter().zip(&world.lights.intensities) {
        let Some(wi) = (position - point.surface.p).try_normalize() else { continue };
        let cosine = point.ns.dot(wi);
        if cosine <= 0.0 {
            continue;
        }
        let mirrored = 2.0 * cosine * point.ns - wi;
        let highlight = highlight(mirrored.dot(point.wo).max(0.0), materials.shininess[row]);
        let radiance = intensity * (materials.diffuse[row] * cosine + materials.specular[row] * highlight);
        if radiance == DVec3::ZERO {
            continue;
        }
        // The segment to the light, open at both ends: what lies behind the light casts no shadow.
        let origin = point.leave::<TERMINATOR>(wi);
        shadow_rays.push(Ray::new(origin, position - origin).until(JUST_BEFORE_LIGHT));
        shadow.push(ShadowRay { ray_idx, radiance });
    }
}

/// cosineˢʰ, with 0⁰ = 1. The exponent 1 needs no power, and is what it gives.
#[inline]
fn highlight(cosine: f64, shininess: f64) -> f64 {
    if shininess == 1.0 { cosine } else { libm::pow(cosine, shininess) }
}
