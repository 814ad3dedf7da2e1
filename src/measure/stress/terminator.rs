//! The terminator correction: coarse smooth spheres whose facets would shadow what their normals light.
//!
//! A case is a point of a closed convex mesh inscribed in a sphere, with the sphere's normals at its vertices; N is its
//! interpolated normal. The light lies in N's half-space over the mesh: no vertex is higher along N than the light is,
//! as no point of the smooth sphere is higher than a light that lights the sphere at N. (For a light at a distance that
//! is N·L > 0; one close by may be lower than a vertex of the coarse mesh, and be hidden by it as the smooth sphere would
//! hide it.) The shadow ray from the corrected start must then meet nothing: a point that is black all the same is wrong.
//! The naive column counts the points that are black without the correction.
//!
//! Vertices are f32. A mesh is moved only so far that their rounding is a small part of the height of its facets under
//! the sphere: beyond, it is no longer convex, and has shadows of its own.

use glam::{DVec3, Vec3};

use super::mesh::{Mesh, icosphere, lat_long};
use super::random::Random;
use super::scene::Scene;
use super::{Block, Tally, shapes};
use crate::render::surface::{describe, shading_normal};
use crate::render::terminator;
use crate::world::{Hit, MeshInput, Ray, World};

/// A suite: each block is a sphere, each case a point of it with a light.
pub fn run(block: &Block, tally: &mut Tally) {
    let sphere = Sphere::new(&mut block.shared());
    for (case, mut random) in block.each() {
        let light = (0..AIMS).find_map(|_| sphere.lit_point(&mut random));
        let Some(Lit { corrected, naive }) = light else {
            tally.count(false, || format!("{} (nothing is hit)", case.text(&Ray::new(sphere.at, DVec3::X), None)));
            continue;
        };
        let mut free = tally.watch(|| sphere.scene.occluded(&corrected)) == [false; 2];
        if case.number.is_multiple_of(JUDGED_PART) {
            free &= sphere.scene.judge_all(tally, &corrected, &Hit::MISS);
        }
        tally.count(free, || case.text(&corrected, None));
        tally.naive_f32.count(sphere.scene.occluded(&naive) == [false; 2]);
    }
}

/// How often a point is looked for: a ray aimed at a rounded point of a silhouette may rightly pass beside the mesh (one
/// in some million does), but not this many in turn.
const AIMS: u32 = 8;

/// One in so many cases is judged by exact arithmetic, too, facet by facet.
const JUDGED_PART: u64 = 32;

/// The largest rounding of a vertex, in parts of the height of an edge's middle under the sphere.
const ROUNDING_PART: f64 = 1e-3;

struct Sphere {
    scene: Scene,
    mesh: Mesh,
    at: DVec3,
    size: f64,
}

/// Shadow rays of one point to one light.
struct Lit {
    corrected: Ray,
    naive: Ray,
}

impl Sphere {
    fn new(random: &mut Random) -> Sphere {
        let unit = match random.below(4) {
            0 => icosphere(random.below(3) as u32),
            1 => lat_long(8, 4),
            _ => lat_long(random.integer(3, 24) as u32, random.integer(2, 12) as u32),
        };
        let size = random.power_of_two(-20, 20) * random.uniform(1.0, 2.0);
        let turn = shapes::rotation(random);
        let edge = |[a, b, c]: [Vec3; 3]| a.distance(b).min(b.distance(c)).min(c.distance(a));
        let shortest = (0..unit.triangles.len()).map(|row| edge(unit.corners(row))).fold(2.0, f32::min);
        let height = f64::from(shortest * shortest) / 8.0;
        let reach = (ROUNDING_PART * height / f64::from(f32::EPSILON)).max(1.0);
        let far = if random.chance(0.3) { 0.0 } else { random.log_uniform(1.0, reach) };
        let at = size * far * random.direction();
        let normals: Vec<Vec3> = unit.positions.iter().map(|p| (turn * p.as_dvec3()).normalize().as_vec3()).collect();
        let positions = unit.positions.iter().map(|p| (size * (turn * p.as_dvec3().normalize()) + at).as_vec3());
        let mesh = Mesh { positions: positions.collect(), triangles: unit.triangles };
        let mut world = World::default();
        let _ = world.add_mesh(MeshInput { normals: Some(normals), ..mesh.input() });
        Sphere { scene: Scene::new(world), mesh, at, size }
    }

    /// A point that a ray from outside finds, and a light which its normal faces, most often by little.
    fn lit_point(&self, random: &mut Random) -> Option<Lit> {
        let target = self.target(random);
        let outwards = (target - self.at).normalize_or(DVec3::Y);
        let from = target + self.size * random.log_uniform(0.01, 100.0) * (outwards + 0.3 * random.in_cube());
        let ray = Ray::new(from, target - from);
        let hit = Some(self.scene.closest(&ray)).filter(Hit::is_some)?;
        let surface = describe(&self.scene.world, &ray, &hit);
        let normal = shading_normal(&self.scene.world, &hit, surface.ng);

        // The light: at an angle over the highest vertex along the normal.
        let height = |p: &Vec3| (p.as_dvec3() - surface.p).dot(normal);
        let horizon = self.mesh.positions.iter().map(height).fold(0.0, f64::max);
        let cosine = if random.chance(0.8) { random.log_uniform(1e-6, 1.0) } else { random.unit().max(1e-6) };
        let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
        let direction = sine * random.perpendicular(normal) + cosine * normal;
        let distance = self.size * random.log_uniform(0.01, 1e6);
        let light = surface.p + horizon * normal + distance * direction;

        let start = terminator::start(&self.scene.world, &hit, &surface, normal)?;
        let towards = |origin: DVec3| Ray::new(origin, light - origin).until(1.0);
        Some(Lit { corrected: towards(start), naive: towards(surface.leave(light - surface.p)) })
    }

    /// A point in, on an edge of, in a corner of, or close to an edge or corner of a facet.
    fn target(&self, random: &mut Random) -> DVec3 {
        let row = random.below(self.mesh.triangles.len() as u64) as usize;
        let corners = self.mesh.corners(row);
        let point = shapes::point_of(random, corners);
        let corner = corners[random.below(3) as usize].as_dvec3();
        if random.chance(0.3) { corner + random.log_uniform(1e-9, 1.0) * (point - corner) } else { point }
    }
}
