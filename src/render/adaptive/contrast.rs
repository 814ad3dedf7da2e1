//! What two neighbouring samples of the picture tell of what lies between them.

use glam::{DVec3, Vec3};

use crate::render::surface::{Surface, describe, shading_normal};
use crate::render::trace::Level;
use crate::world::World;

/// What a sample saw that decides where more are taken. It never enters a pixel.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sight {
    radiance: Vec3,
    /// What it met ([`crate::render::signature`]).
    signature: u32,
    /// Where it met it and the unit shading normal there; zeros where nothing was.
    p: Vec3,
    ns: Vec3,
    /// Distance along the view axis; infinite where nothing was.
    pub z: f32,
}

/// The least contrast that an edge is taken to have that ids, normals or depths show: what lies along it may be brighter than
/// either side.
const EDGE_CONTRAST: f32 = 1.0 / 32.0;

/// Cosine of the angle between normals from which a crease is an edge: 30°.
const CREASE_COSINE: f32 = 0.866;

/// Sine of the angle by which the way from one point to the other leaves both surfaces from which there is a step between
/// them: 30°.
const STEP_SINE: f32 = 0.5;

impl Sight {
    /// What a ray of a finished level saw.
    pub fn of(world: &World, level: &Level, ray: usize, depth: impl Fn(f64) -> f64) -> Sight {
        let hit = &level.hits[ray];
        let (radiance, signature) = (level.radiance[ray].as_vec3(), level.signatures[ray]);
        if !hit.is_some() {
            return Sight { radiance, signature, p: Vec3::ZERO, ns: Vec3::ZERO, z: f32::INFINITY };
        }
        let Surface { p, ng, .. } = describe(world, &level.rays[ray], hit);
        let ns: DVec3 = shading_normal(world, hit, ng);
        Sight { radiance, signature, p: p.as_vec3(), ns: ns.as_vec3(), z: depth(hit.t) as f32 }
    }

    /// Whether there is an edge between two samples, whatever their colours.
    pub fn is_across_an_edge(&self, other: &Sight) -> bool {
        if self.signature != other.signature {
            return true;
        }
        let between = other.p - self.p;
        let length = between.length();
        let leaves = |normal: Vec3| normal.dot(between).abs() > STEP_SINE * length;
        (self.ns != Vec3::ZERO && self.ns.dot(other.ns).abs() < CREASE_COSINE) || (leaves(self.ns) && leaves(other.ns))
    }

    /// How much radiance two samples differ by, in the worst channel.
    pub fn contrast(&self, other: &Sight) -> f32 {
        let difference = (self.radiance - other.radiance).abs().max_element();
        if difference < EDGE_CONTRAST && self.is_across_an_edge(other) { EDGE_CONTRAST } else { difference }
    }
}
