//! Closed meshes from inside: no ray gets out.

use std::sync::OnceLock;

use glam::{DVec3, dvec3};

use super::mesh::{self, Mesh};
use super::random::Random;
use super::scene::Scene;
use super::{Block, Tally, textbook};
use crate::world::Ray;

struct Closed {
    mesh: Mesh,
    scene: Scene,
    center: DVec3,
    size: f64,
    /// Whether every face is seen from inside by every ray that starts within [`START`] sizes of the centre: then a
    /// ray crosses the mesh exactly once.
    convex: bool,
}

/// Rays start within this many sizes of the centre.
const START: f64 = 0.2;

/// Where the meshes stand; the second is where Embree's own test of watertightness puts its meshes.
const PLACES: [(f64, DVec3); 2] = [(1.0, DVec3::ZERO), (100.0, dvec3(148_376.0, 1234.0, -223_423.0))];

fn closed_meshes() -> &'static [Closed] {
    static MESHES: OnceLock<Vec<Closed>> = OnceLock::new();
    MESHES.get_or_init(|| {
        let shapes = [mesh::lat_long(24, 12), mesh::bumpy_block(12), mesh::lat_long(3, 1500), mesh::cube()];
        let all =
            shapes.iter().flat_map(|shape| PLACES.map(|(size, at)| Closed::new(shape.placed(size, at), size, at)));
        all.collect()
    })
}

impl Closed {
    fn new(mesh: Mesh, size: f64, center: DVec3) -> Closed {
        let scene = Scene::of_meshes([&mesh]);
        let convex = (0..mesh.triangles.len()).all(|triangle| {
            let [a, b, c] = mesh.corners(triangle).map(|corner| corner.as_dvec3());
            let normal = (b - a).cross(c - a);
            // Without area there is nothing to cross.
            normal.length() == 0.0 || normal.dot(a - center) > 1.2 * START * size * normal.length()
        });
        Closed { mesh, scene, center, size, convex }
    }

    fn target(&self, random: &mut Random, number: u64) -> DVec3 {
        let vertex = |i: u64| self.mesh.positions[(i % self.mesh.positions.len() as u64) as usize].as_dvec3();
        match random.below(8) {
            // Every vertex in turn.
            0..=2 => vertex(number),
            3..=5 => {
                let triangle = self.mesh.triangles[(number % self.mesh.triangles.len() as u64) as usize];
                let first = random.below(3) as usize;
                let (a, b) = (vertex(u64::from(triangle[first])), vertex(u64::from(triangle[(first + 1) % 3])));
                let share = if random.chance(0.3) { 0.5 } else { random.unit() };
                a + share * (b - a)
            }
            _ => self.center + self.size * random.direction(),
        }
    }

    fn ray(&self, random: &mut Random, number: u64) -> Ray {
        let start = if random.chance(0.3) { DVec3::ZERO } else { START * self.size * random.in_cube() / 2.0 };
        if random.chance(0.15) {
            // Along an axis, zeros of both signs.
            let mut direction = [0.0; 3].map(|zero: f64| zero.copysign(random.sign()));
            direction[random.below(3) as usize] = random.sign();
            let start = if random.chance(0.5) { start } else { (start * 8.0).round() / 8.0 };
            return Ray::new(self.center + start, direction.into());
        }
        let origin = self.center + start;
        Ray::new(origin, self.target(random, number) - origin)
    }
}

/// A suite.
pub fn run(block: &Block, tally: &mut Tally) {
    let meshes = closed_meshes();
    for (case, mut random) in block.each() {
        let closed = &meshes[(case.number % meshes.len() as u64) as usize];
        let number = case.number / meshes.len() as u64;
        let ray = closed.ray(&mut random, number);
        let hit = tally.watch(|| closed.scene.closest(&ray));
        let mut right = hit.is_some() && closed.scene.judge(tally, &case, &ray, &hit);
        if closed.convex && right {
            // Faces that share the point are hit there too, at ts within a few ulps: beyond, there is nothing.
            let beyond = (0..8).fold(hit.t, |t, _| t.next_up());
            right = !closed.scene.closest(&Ray { t_min: beyond, ..ray }).is_some();
        }
        let small = closed.mesh.triangles.len() <= 1000;
        if small && number.is_multiple_of(8) {
            right &= closed.scene.agrees(&mut Tally::default(), &ray).0;
            ask_textbooks(tally, &closed.mesh, &ray);
        }
        tally.count(right, || case.text(&ray, None));
    }
}

/// Whether the formulas in f32 let the ray out.
fn ask_textbooks(tally: &mut Tally, mesh: &Mesh, ray: &Ray) {
    let all = || (0..mesh.triangles.len()).map(|triangle| mesh.corners(triangle));
    let (o, d) = (ray.origin.as_vec3(), ray.direction.as_vec3());
    let found = all().any(|corners| textbook::moller_trumbore(o, d, corners).is_some_and(|t| t > 0.0));
    tally.moller_trumbore_f32.count(found);
    let found = all().any(|corners| textbook::plane_test(o, d, corners).is_some_and(|t| t > 0.0));
    tally.naive_f32.count(found);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn most_meshes_are_seen_from_inside_by_every_ray() {
        let convex: Vec<bool> = closed_meshes().iter().map(|closed| closed.convex).collect();
        assert!(convex.iter().filter(|&&convex| convex).count() >= 4, "{convex:?}");
    }
}
