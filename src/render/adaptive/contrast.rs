//! What two neighbouring samples of the picture tell of what lies between them.

use glam::{DVec3, Vec2, Vec3};

use crate::render::surface::{Surface, describe, shading_normal};
use crate::render::trace::Level;
use crate::world::World;

/// What a sample saw that decides where more are taken. It never enters a pixel.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sight {
    radiance: Vec3,
    /// Where in the picture, in cells of its size.
    place: Vec2,
    /// What it met ([`crate::render::signature`]).
    signature: u32,
    /// Where it met it and the unit shading normal there; zeros where nothing was.
    p: Vec3,
    ns: Vec3,
    /// Distance along the view axis; infinite where nothing was.
    pub z: f64,
}

/// The least contrast that an edge is taken to have that ids, normals or depths show, between pixels and between parts of them:
/// what lies along it may be brighter than either side, but each division takes four looks at it.
const EDGE_CONTRAST: [f32; 2] = [1.0 / 32.0, 1.0 / 512.0];

/// Cosine of the angle between normals from which a crease is an edge: 30°.
const CREASE_COSINE: f32 = 0.866;

/// Sine of the angle by which the way from one point to the other leaves both surfaces from which there is a step between
/// them: 30°.
const STEP_SINE: f32 = 0.5;

impl Sight {
    /// What a ray of a finished level saw at a place, counted in cells of its size.
    pub fn of(world: &World, place: Vec2, level: &Level, ray: usize, depth: impl Fn(f64) -> f64) -> Sight {
        let hit = &level.hits[ray];
        let (radiance, signature) = (level.radiance[ray].as_vec3(), level.signatures[ray]);
        if !hit.is_some() {
            return Sight { radiance, place, signature, p: Vec3::ZERO, ns: Vec3::ZERO, z: f64::INFINITY };
        }
        let Surface { p, ng, .. } = describe(world, &level.rays[ray], hit);
        let ns: DVec3 = shading_normal(world, hit, ng);
        Sight { radiance, place, signature, p: p.as_vec3(), ns: ns.as_vec3(), z: depth(hit.t) }
    }

    /// What stands for the sample of a part of the cell, until there is one.
    pub fn of_a_part(&self) -> Sight {
        Sight { place: 2.0 * self.place, ..*self }
    }

    /// Whether two samples met the same and no light is new.
    pub fn is_alike(&self, other: &Sight) -> bool {
        self.signature == other.signature
    }

    /// Whether there is an edge between two samples, whatever their colours.
    pub fn is_across_an_edge(&self, other: &Sight) -> bool {
        if !self.is_alike(other) {
            return true;
        }
        let between = other.p - self.p;
        let length = between.length();
        let leaves = |normal: Vec3| normal.dot(between).abs() > STEP_SINE * length;
        (self.ns != Vec3::ZERO && self.ns.dot(other.ns).abs() < CREASE_COSINE) || (leaves(self.ns) && leaves(other.ns))
    }

    /// How much radiance two samples differ by that have an edge between them, in the worst channel.
    pub fn edge_contrast(&self, other: &Sight, is_coarse: bool) -> f32 {
        let least = if is_coarse { EDGE_CONTRAST[0] } else { EDGE_CONTRAST[1] };
        (self.radiance - other.radiance).abs().max_element().max(least)
    }

    /// How far the radiance of a sample and its four neighbours of the same size (left, right, above, below) is from
    /// linear, in units of an edge's contrast: pairs of samples that mirror each other in the middle of a cell have no error
    /// from what is linear.
    pub fn bend(&self, neighbors: [&Sight; 4]) -> f32 {
        let [left, right, above, below] = neighbors;
        // The gradient that the differences across the sample in both directions have.
        let (dx, dy) = (right.place - left.place, below.place - above.place);
        let (rx, ry) = (right.radiance - left.radiance, below.radiance - above.radiance);
        let inverse = 1.0 / dx.perp_dot(dy);
        let (gx, gy) = ((rx * dy.y - ry * dx.y) * inverse, (ry * dx.x - rx * dy.x) * inverse);
        let off_linear = |other: &Sight| {
            let way = other.place - self.place;
            (other.radiance - self.radiance - gx * way.x - gy * way.y).abs().max_element()
        };
        neighbors.into_iter().map(off_linear).fold(0.0, f32::max) * BEND_PER_EDGE
    }
}

/// The error that a deviation of 1 from linear brings, beside that of an edge of contrast 1. A pair of samples at ±u has the standard
/// deviation c·√(1/80 − 1/144) = 0.075·c from c·u² over a cell of edge 1, and √(1/24) = 0.20 on average over all straight edges that cross it (p(½ − p)
/// for a covered share p up to a half).
const BEND_PER_EDGE: f32 = 0.37;
