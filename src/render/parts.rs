//! What the radiance of rays is made of: by the lobe at the first hit, and by the group of lights that it comes from.
//!
//! Kept beside the radiance and never read for it, so that asking for parts changes no bit of the beauty. Each part is a sum
//! in f64 of some of the terms that the radiance is the sum of, in the same order: the layer of a light group is the image of
//! its lights alone, bit for bit. Parts and beauty are each rounded to f32 once, so that where no term is negative (none is, in a
//! scene that is checked) the parts of a pixel add up to the beauty within 2 ulps of f32.

use std::ops::Range;

use glam::DVec3;

use super::aov::{Aov, Aovs};
use super::cost::Costs;
use crate::world::{Hit, LightGroupId};

/// The parts at the first hit; they are the first layers, so that a layer is the number of its part.
const N_LOBES: usize = Aov::LOBES.len();

/// The parts that are asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PartsAsked {
    /// Whether lobes are.
    pub lobes: bool,
    /// Whether light groups are.
    pub groups: bool,
    /// Groups of the scene, and one before them for what comes from no light.
    pub n_groups: usize,
    /// Whether costs are, which are no part of the radiance and kept beside it in the same way.
    pub cost: bool,
}

impl PartsAsked {
    /// Of the layers asked for, in a scene of so many light groups.
    pub fn new(aovs: &Aovs, n_light_groups: usize) -> PartsAsked {
        PartsAsked {
            lobes: aovs.any_of(&Aov::LOBES),
            groups: aovs.has(Aov::Lights),
            n_groups: n_light_groups + 1,
            cost: aovs.has(Aov::Cost),
        }
    }

    /// Whether any part of the radiance is.
    #[inline]
    pub fn any(&self) -> bool {
        self.lobes || self.groups
    }
}

/// What a light adds at a hit if nothing is in between, in parts.
#[derive(Clone, Copy, Debug)]
pub struct LightParts {
    /// By the diffuse term.
    pub diffuse: DVec3,
    /// By the specular term.
    pub specular: DVec3,
    /// Where it comes from.
    pub group: LightGroupId,
}

/// The parts of the rays of a level; columns that are not asked for are empty.
#[derive(Debug, Default)]
pub struct Parts {
    /// By ray, at the first level: one for each of [`Aov::LOBES`].
    pub lobes: Vec<[DVec3; N_LOBES]>,
    /// Row by row, a row for each ray: what comes from no light, then the light groups.
    groups: Vec<DVec3>,
    n_groups: usize,
    /// By ray, at deeper levels: whether it was refracted, not mirrored.
    pub refracted: Vec<bool>,
    /// By ray: what it costs.
    pub costs: Costs,
}

impl Parts {
    /// The groups of a ray.
    #[inline]
    pub fn groups_of(&self, ray: usize) -> &[DVec3] {
        &self.groups[ray * self.n_groups..(ray + 1) * self.n_groups]
    }

    /// Begins with what rays bring that need no further ray.
    pub fn begin(&mut self, asked: &PartsAsked, is_first: bool, hits: &[Hit], radiance: &[DVec3]) {
        self.lobes.clear();
        if asked.lobes && is_first {
            self.lobes.resize(radiance.len(), [DVec3::ZERO; N_LOBES]);
            for ((lobes, hit), &radiance) in self.lobes.iter_mut().zip(hits).zip(radiance) {
                let lobe = if hit.is_some() { Aov::Ambient } else { Aov::Background };
                lobes[lobe as usize] = radiance;
            }
        }
        self.groups.clear();
        self.n_groups = if asked.groups { asked.n_groups } else { 0 };
        if asked.groups {
            self.groups.resize(radiance.len() * asked.n_groups, DVec3::ZERO);
            for (row, &radiance) in self.groups.chunks_exact_mut(asked.n_groups).zip(radiance) {
                row[0] = radiance;
            }
        }
    }

    /// Adds what a light brings to a ray: the radiance as one, and in parts.
    pub fn add_light(&mut self, ray: usize, radiance: DVec3, parts: &LightParts) {
        if let Some(lobes) = self.lobes.get_mut(ray) {
            lobes[Aov::Diffuse as usize] += parts.diffuse;
            lobes[Aov::Specular as usize] += parts.specular;
        }
        if self.n_groups > 0 {
            self.groups[ray * self.n_groups + 1 + parts.group.idx()] += radiance;
        }
    }

    /// Adds the parts of a finished ray of the level below, of which `weight` reaches its parent.
    pub fn add_bounce(&mut self, parent: usize, weight: f64, below: &Parts, ray: usize, radiance: DVec3) {
        if let Some(lobes) = self.lobes.get_mut(parent) {
            let lobe = if below.refracted[ray] { Aov::Refraction } else { Aov::Reflection };
            lobes[lobe as usize] += weight * radiance;
        }
        let row: Range<usize> = parent * self.n_groups..(parent + 1) * self.n_groups;
        for (above, &group) in self.groups[row].iter_mut().zip(below.groups_of(ray)) {
            *above += weight * group;
        }
    }
}
