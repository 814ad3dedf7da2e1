//! The Phong model with mirror reflection and refraction, as `docs/SCENE_FORMAT.md` states it:
//!
//! I = k_a·O_a + Σᵢ Sᵢ·Iᵢ·[k_d·O_d·(N·Lᵢ) + k_s·O_s·max(0, R·V)^sh] + k_s·I_r + k_t·I_t
//!
//! Each feature that a scene may lack is a constant of the stage, so that the code of a lacking one is not there.

use glam::DVec3;

use super::cutoff::Cutoff;
use super::describe::{DescribedHit, Describing, Hits};
use super::parts::LightParts;
use super::refract::refracted;
use super::surface::{JUST_BEFORE_LIGHT, Surface, shading_normal};
use super::terminator;
use super::trace::{Bounces, Level};
use crate::BARE;
use crate::simd::Isa;
use crate::world::{Features, Hit, MaterialId, Ray, World};

/// A shadow ray's consequence: what reaches the viewer if it is not occluded.
#[derive(Clone, Copy, Debug)]
pub struct ShadowRay {
    /// The ray of the level whose hit is lit.
    pub ray_idx: u32,
    /// The light: the row of a point light, or past all of them that of a directional one.
    pub light: u32,
    /// Radiance that the light adds there.
    pub radiance: DVec3,
}

/// What shading a level makes, in memory that is used again for every batch.
#[derive(Debug, Default)]
pub struct Lighting {
    /// Hits that light, mirrors or refraction add to.
    points: Vec<DescribedHit>,
    /// What each of `rays` is sent for.
    pub shadow: Vec<ShadowRay>,
    /// Rays to the lights, in the order of hits and lights.
    pub rays: Vec<Ray>,
    /// What each is sent for, in parts; empty unless they are asked for.
    pub parts: Vec<LightParts>,
    /// Hits that let light through, total internal reflection among them.
    pub n_refractions: u64,
    /// Those of them that sent a refracted ray.
    pub n_refracted: u64,
}

type Stage = fn(&World, &Cutoff, &Level, &mut Bounces, &mut Lighting);

/// The shading stage of a scene, chosen once by its features.
#[derive(Clone, Debug)]
pub struct Shading {
    describing: Describing,
    /// For levels that may send further rays, and for the last level, which may not.
    inner: LevelStage,
    last: LevelStage,
}

/// How a level is shaded.
#[derive(Clone, Debug)]
struct LevelStage {
    stage: Stage,
    /// By material: whether anything is added to its ambient part, for which the surface must be known.
    is_shaded: Vec<bool>,
}

impl Shading {
    /// The stage that has the features of the world and no others, with or without the correction of [`terminator`], and with
    /// or without what light is made of.
    pub fn new(world: &World, terminator: bool, in_parts: bool, isa: Isa) -> Shading {
        let features = world.features();
        let level = |bounce: bool| {
            let (reflection, refraction) = (features.reflection && bounce, features.refraction && bounce);
            let features = Features { reflection, refraction, ..features };
            let needs = Needs { features, in_parts: in_parts && !BARE };
            let stage = match (features.smooth_normals && !BARE, terminator) {
                (false, _) => stage_of_sides::<false, false>(&needs),
                (true, false) => stage_of_sides::<true, false>(&needs),
                (true, true) => stage_of_sides::<true, true>(&needs),
            };
            let is_lit = |id| features.direct_light && world.materials.is_lit(id);
            let is_mirror = |id: MaterialId| features.reflection && world.materials.reflectance[id.idx()] > 0.0;
            let is_glass = |id: MaterialId| features.refraction && world.materials.transmittance[id.idx()] > 0.0;
            let is_shaded = |id| is_lit(id) || is_mirror(id) || is_glass(id);
            let ids = (0..world.materials.len() as u32).map(MaterialId);
            LevelStage { stage, is_shaded: ids.map(is_shaded).collect() }
        };
        Shading { describing: Describing::new(&features, isa), inner: level(true), last: level(false) }
    }

    /// Shades all hits of a level: fills its radiance, and the rays that are still to be traced. `bounce` says whether
    /// the next level may have rays.
    pub fn shade(
        &self,
        world: &World,
        cutoff: &Cutoff,
        level: &mut Level,
        bounce: bool,
        next: &mut Bounces,
        lighting: &mut Lighting,
    ) {
        let LevelStage { stage, is_shaded } = if bounce { &self.inner } else { &self.last };
        level.radiance.clear();
        lighting.points.clear();
        lighting.shadow.clear();
        lighting.rays.clear();
        lighting.parts.clear();
        (lighting.n_refractions, lighting.n_refracted) = (0, 0);
        let Level { rays, hits, radiance, .. } = &mut *level;
        let points = &mut lighting.points;
        self.describing.run(Hits { world, is_shaded, rays, hits, radiance, points });
        stage(world, cutoff, level, next, lighting);
    }
}

/// What a stage is made for.
struct Needs {
    features: Features,
    /// Whether it tells what light is made of.
    in_parts: bool,
}

// From needs to constants, one after another.

fn stage_of_sides<const SMOOTH: bool, const TERMINATOR: bool>(needs: &Needs) -> Stage {
    match needs.features.two_sided {
        false => stage_of_bounces::<SMOOTH, TERMINATOR, false>(needs),
        true => stage_of_bounces::<SMOOTH, TERMINATOR, true>(needs),
    }
}

// What rays a hit may send on. Refraction reflects too, where it is total.
const NO_BOUNCE: u8 = 0;
const MIRROR: u8 = 1;
const GLASS: u8 = 2;

fn stage_of_bounces<const SMOOTH: bool, const TERMINATOR: bool, const TWO_SIDED: bool>(needs: &Needs) -> Stage {
    if BARE {
        return stage_of_lights::<SMOOTH, TERMINATOR, TWO_SIDED, NO_BOUNCE>(needs);
    }
    match (needs.features.reflection, needs.features.refraction) {
        (false, false) => stage_of_lights::<SMOOTH, TERMINATOR, TWO_SIDED, NO_BOUNCE>(needs),
        (true, false) => stage_of_lights::<SMOOTH, TERMINATOR, TWO_SIDED, MIRROR>(needs),
        (_, true) => stage_of_lights::<SMOOTH, TERMINATOR, TWO_SIDED, GLASS>(needs),
    }
}

// Which lights there may be: none, point lights, directional ones too; or any, and what their light is made of is told.
const UNLIT: u8 = 0;
const NEAR: u8 = 1;
const FAR: u8 = 2;
const IN_PARTS: u8 = 3;

fn stage_of_lights<const SMOOTH: bool, const TERMINATOR: bool, const TWO_SIDED: bool, const BOUNCE: u8>(
    needs: &Needs,
) -> Stage {
    let Needs { features, in_parts } = needs;
    if *in_parts {
        return shade::<SMOOTH, TERMINATOR, TWO_SIDED, BOUNCE, IN_PARTS>;
    }
    match (features.direct_light, features.directional_light && !BARE) {
        (false, _) => shade::<SMOOTH, TERMINATOR, TWO_SIDED, BOUNCE, UNLIT>,
        (true, false) => shade::<SMOOTH, TERMINATOR, TWO_SIDED, BOUNCE, NEAR>,
        (true, true) => shade::<SMOOTH, TERMINATOR, TWO_SIDED, BOUNCE, FAR>,
    }
}

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

/// The second step, over the described hits.
fn shade<const SMOOTH: bool, const TERMINATOR: bool, const TWO_SIDED: bool, const BOUNCE: u8, const LIGHT: u8>(
    world: &World,
    cutoff: &Cutoff,
    level: &Level,
    next: &mut Bounces,
    lighting: &mut Lighting,
) {
    let Lighting { points, shadow, rays: shadow_rays, parts, n_refractions, n_refracted } = lighting;
    for &DescribedHit { ray_idx, material, surface } in points.iter() {
        let (ray, hit) = (&level.rays[ray_idx as usize], &level.hits[ray_idx as usize]);
        let point = point::<SMOOTH, TERMINATOR, TWO_SIDED>(world, ray, hit, material, surface);
        // What this ray may lose, nothing if there is no cut-off.
        let limit = level.limits.get(ray_idx as usize).copied().unwrap_or(0.0);
        if LIGHT != UNLIT && world.materials.is_lit(material) {
            let faint = cutoff.faint(limit);
            let mut to_lights = ToLights { ray_idx, faint, shadow, rays: shadow_rays, parts };
            light::<TERMINATOR, LIGHT>(world, &point, &mut to_lights);
            if LIGHT == FAR || LIGHT == IN_PARTS {
                light_from_afar::<TERMINATOR, LIGHT>(world, &point, &mut to_lights);
            }
        }
        if BOUNCE == NO_BOUNCE {
            continue;
        }
        let mut reflectance = world.materials.reflectance[material.idx()];
        let transmittance = if BOUNCE == GLASS { world.materials.transmittance[material.idx()] } else { 0.0 };
        let mut behind = None;
        if BOUNCE == GLASS && transmittance > 0.0 {
            behind = refracted(point.wo, surface.ng, point.ns, world.materials.ior[material.idx()]);
            *n_refractions += 1;
            // Total internal reflection: what would pass is mirrored.
            reflectance += if behind.is_none() { transmittance } else { 0.0 };
        }
        let n_rays = usize::from(reflectance > 0.0) + usize::from(behind.is_some());
        let smallest = cutoff.smallest_weight(limit, n_rays);
        // The order of the two is that of the sum at their parent.
        if reflectance > smallest {
            let direction = 2.0 * point.ns.dot(point.wo) * point.ns - point.wo;
            let origin = point.leave::<TERMINATOR>(direction);
            next.push(Ray::new(origin, direction), ray_idx, reflectance);
            if cutoff.is_on() {
                next.note_limit(smallest / reflectance);
            }
            if LIGHT == IN_PARTS {
                next.note_refracted(false);
            }
        }
        if let Some(direction) = behind
            && transmittance > smallest
        {
            *n_refracted += 1;
            next.push(Ray::new(surface.leave(direction), direction), ray_idx, transmittance);
            if cutoff.is_on() {
                next.note_limit(smallest / transmittance);
            }
            if LIGHT == IN_PARTS {
                next.note_refracted(true);
            }
        }
    }
}

#[inline]
fn point<const SMOOTH: bool, const TERMINATOR: bool, const TWO_SIDED: bool>(
    world: &World,
    ray: &Ray,
    hit: &Hit,
    material: MaterialId,
    surface: Surface,
) -> Point {
    let wo = -ray.direction.normalize();
    let ns = if SMOOTH { shading_normal(world, hit, surface.ng) } else { surface.ng };
    let turned = TWO_SIDED && surface.ng.dot(wo) < 0.0;
    let ns = if turned { -ns } else { ns };
    let raised = if TERMINATOR { terminator::start(world, hit, &surface, ns) } else { None };
    Point { surface, material, ns, wo, raised }
}

/// The rays that a hit sends to the lights.
struct ToLights<'a> {
    ray_idx: u32,
    /// Radiance up to which no ray is sent.
    faint: f64,
    shadow: &'a mut Vec<ShadowRay>,
    rays: &'a mut Vec<Ray>,
    parts: &'a mut Vec<LightParts>,
}

impl ToLights<'_> {
    /// Sends a ray for what it adds if nothing stops it.
    #[inline]
    fn send(&mut self, ray: Ray, light: usize, radiance: DVec3) {
        self.rays.push(ray);
        self.shadow.push(ShadowRay { ray_idx: self.ray_idx, light: light as u32, radiance });
    }
}

/// Sends a shadow ray to each point light that the surface faces, with what it would add.
#[inline]
fn light<const TERMINATOR: bool, const LIGHT: u8>(world: &World, point: &Point, to_lights: &mut ToLights<'_>) {
    let lights = &world.lights;
    let n_points = if BARE { 1 } else { lights.positions.len() };
    for (row, (&position, &intensity)) in lights.positions[..n_points].iter().zip(&lights.intensities).enumerate() {
        let Some(wi) = (position - point.surface.p).try_normalize() else { continue };
        let Some(Lit { radiance, diffuse, specular }) = lit(world, point, wi, intensity, to_lights.faint) else {
            continue;
        };
        // The segment to the light, open at both ends: what lies behind the light casts no shadow.
        let origin = point.leave::<TERMINATOR>(wi);
        to_lights.send(Ray::new(origin, position - origin).until(JUST_BEFORE_LIGHT), row, radiance);
        if LIGHT == IN_PARTS {
            to_lights.parts.push(LightParts { diffuse, specular, group: lights.groups[row] });
        }
    }
}

/// The same for directional lights.
fn light_from_afar<const TERMINATOR: bool, const LIGHT: u8>(
    world: &World,
    point: &Point,
    to_lights: &mut ToLights<'_>,
) {
    let lights = &world.lights;
    for (row, (&direction, &intensity)) in lights.directions.iter().zip(&lights.directional_intensities).enumerate() {
        let wi = -direction;
        let Some(Lit { radiance, diffuse, specular }) = lit(world, point, wi, intensity, to_lights.faint) else {
            continue;
        };
        to_lights.send(Ray::new(point.leave::<TERMINATOR>(wi), wi), lights.positions.len() + row, radiance);
        if LIGHT == IN_PARTS {
            to_lights.parts.push(LightParts { diffuse, specular, group: lights.directional_groups[row] });
        }
    }
}

/// What a light adds towards the viewer: as one, and in parts, which cost nothing where they are not used.
struct Lit {
    radiance: DVec3,
    diffuse: DVec3,
    specular: DVec3,
}

/// What light from a unit direction adds towards the viewer; `None` when that is nothing, or faint in every channel.
#[inline(always)]
fn lit(world: &World, point: &Point, wi: DVec3, intensity: DVec3, faint: f64) -> Option<Lit> {
    let materials = &world.materials;
    let row = point.material.idx();
    let cosine = point.ns.dot(wi);
    if cosine <= 0.0 {
        return None;
    }
    let mirrored = 2.0 * cosine * point.ns - wi;
    let highlight = highlight(mirrored.dot(point.wo).max(0.0), materials.shininess[row]);
    let (diffuse, specular) = (materials.diffuse[row] * cosine, materials.specular[row] * highlight);
    let radiance = intensity * (diffuse + specular);
    (radiance.abs().max_element() > faint).then_some(Lit {
        radiance,
        diffuse: intensity * diffuse,
        specular: intensity * specular,
    })
}

/// Whole exponents up to this are multiplied out. The result is wrong by no more than so many u: 2⁻⁴³ of itself, where a step of f32
/// is 2⁻²³.
const LARGEST_WHOLE_EXPONENT: u32 = 1 << 10;

/// cosineˢʰ, with 0⁰ = 1. The exponent 1 needs no power, and is what it gives.
#[inline]
fn highlight(cosine: f64, shininess: f64) -> f64 {
    if shininess == 1.0 {
        return cosine;
    }
    // What is no exponent of this kind is another number then.
    let whole = shininess as u32;
    if f64::from(whole) == shininess && whole <= LARGEST_WHOLE_EXPONENT {
        whole_power(cosine, whole)
    } else {
        libm::pow(cosine, shininess)
    }
}

/// A power by squaring: the same products everywhere, which `powi` does not promise.
#[inline]
fn whole_power(base: f64, exponent: u32) -> f64 {
    let (mut power, mut square, mut rest) = (1.0, base, exponent);
    while rest > 0 {
        if rest & 1 == 1 {
            power *= square;
        }
        square *= square;
        rest >>= 1;
    }
    power
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_powers_are_powers_within_their_bound() {
        for exponent in (0..=64).chain([100, 255, 256, 400, 1000, LARGEST_WHOLE_EXPONENT]) {
            for cosine in [0.0, 1e-30, 0.1, 0.5, 0.7, 0.99, 0.999, 1.0_f64.next_down(), 1.0] {
                let (power, exact) = (highlight(cosine, f64::from(exponent)), libm::pow(cosine, f64::from(exponent)));
                let bound = f64::from(exponent) * 0.5 * f64::EPSILON * exact + f64::MIN_POSITIVE;
                assert!((power - exact).abs() <= bound, "{cosine} {exponent}: {power} {exact}");
            }
        }
        assert_eq!(highlight(0.37, 1.0), 0.37);
    }

    #[test]
    fn other_exponents_are_not_multiplied_out() {
        for shininess in [0.5, 2.5, 1025.0, 1e10] {
            assert_eq!(highlight(0.9, shininess), libm::pow(0.9, shininess));
        }
    }
}
