//! The first step of shading: every ray gets the radiance that needs no further ray, and hits that are shaded are described.
//!
//! One loop over hits that is compiled for the processor: describing is double-double arithmetic, whose fused multiply-adds
//! are calls without the instruction. It is compiled for what a scene may have hits on.

use glam::DVec3;

use super::surface::{Surface, describe_in};
use crate::BARE;
use crate::simd::{Batch, Isa, Simd};
use crate::world::{Features, Hit, MaterialId, Ray, World};

/// A hit that is shaded, described.
#[derive(Clone, Copy, Debug)]
pub struct DescribedHit {
    /// The ray of the level.
    pub ray_idx: u32,
    /// What it is made of.
    pub material: MaterialId,
    /// What lies there.
    pub surface: Surface,
}

/// The hits of a level, and what becomes of them.
pub struct Hits<'a> {
    /// The tables.
    pub world: &'a World,
    /// By material: whether anything is added to its ambient part.
    pub is_shaded: &'a [bool],
    /// The rays.
    pub rays: &'a [Ray],
    /// Their closest hits.
    pub hits: &'a [Hit],
    /// What each ray brings without another: filled.
    pub radiance: &'a mut Vec<DVec3>,
    /// The hits that are shaded: added.
    pub points: &'a mut Vec<DescribedHit>,
}

/// The loop of a scene, chosen once by its features.
#[derive(Clone, Copy, Debug)]
pub struct Describing {
    isa: Isa,
    /// Whether hits may be on spheres or quadrics.
    curved: bool,
    /// Whether they may be on placements.
    placed: bool,
}

impl Describing {
    /// The loop for hits that a world of these features may have.
    pub fn new(features: &Features, isa: Isa) -> Describing {
        let curved = !BARE && (features.spheres || features.quadrics);
        Describing { isa, curved, placed: !BARE && features.instances }
    }

    /// Runs it.
    pub fn run(&self, hits: Hits<'_>) {
        match (self.curved, self.placed) {
            (false, false) => self.isa.dispatch(Describe::<false, false>(hits)),
            (true, false) => self.isa.dispatch(Describe::<true, false>(hits)),
            (false, true) => self.isa.dispatch(Describe::<false, true>(hits)),
            (true, true) => self.isa.dispatch(Describe::<true, true>(hits)),
        }
    }
}

struct Describe<'a, const CURVED: bool, const PLACED: bool>(Hits<'a>);

impl<const CURVED: bool, const PLACED: bool> Batch for Describe<'_, CURVED, PLACED> {
    #[inline(always)]
    fn run<S: Simd>(self, _simd: S) {
        let Describe(Hits { world, is_shaded, rays, hits, radiance, points }) = self;
        for (ray_idx, (ray, hit)) in rays.iter().zip(hits).enumerate() {
            if !hit.is_some() {
                radiance.push(world.background);
                continue;
            }
            let material = match (CURVED, PLACED) {
                (false, false) => world.meshes.material_of(hit.prim.row()),
                (true, false) => hit.own_material(world),
                (_, true) => hit.material(world),
            };
            radiance.push(world.materials.ambient[material.idx()]);
            if is_shaded[material.idx()] {
                points.push(DescribedHit {
                    ray_idx: ray_idx as u32,
                    material,
                    surface: describe_in::<CURVED, PLACED>(world, ray, hit),
                });
            }
        }
    }
}
