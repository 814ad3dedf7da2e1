//! A world with both ways to ask it: the BVH and the full scan.

use super::case::Case;
use super::mesh::Mesh;
use super::primitive::Primitive;
use super::probe;
use super::tally::Tally;
use crate::accel::{Accel, AccelKind, Mode};
use crate::world::{Hit, Ray, World, prim};

/// A world and its structures.
#[derive(Debug)]
pub struct Scene {
    /// The tables.
    pub world: World,
    /// The structure under test.
    pub bvh: Accel,
    /// The same structure, walked ray by ray.
    one_by_one: Accel,
    /// The full scan.
    pub linear: Accel,
}

impl Scene {
    /// Builds both structures.
    pub fn new(world: World) -> Scene {
        let bvh = Accel::build(&world, AccelKind::Bvh);
        let one_by_one = bvh.clone().with_mode(Mode::Single);
        let linear = Accel::build(&world, AccelKind::Linear);
        Scene { world, bvh, one_by_one, linear }
    }

    /// A scene of meshes, one after another. A mesh whose indices are wrong is left out.
    pub fn of_meshes<'a>(meshes: impl IntoIterator<Item = &'a Mesh>) -> Scene {
        let mut world = World::default();
        for mesh in meshes {
            let _ = world.add_mesh(mesh.input());
        }
        Scene::new(world)
    }

    /// The closest hit by the BVH.
    pub fn closest(&self, ray: &Ray) -> Hit {
        let mut hit = [Hit::MISS];
        self.bvh.closest_hit(&self.world, std::slice::from_ref(ray), &mut hit);
        hit[0]
    }

    /// The closest hit by the full scan.
    pub fn scan(&self, ray: &Ray) -> Hit {
        let mut hit = [Hit::MISS];
        self.linear.closest_hit(&self.world, std::slice::from_ref(ray), &mut hit);
        hit[0]
    }

    /// Whether anything is hit, by the BVH and by the full scan.
    pub fn occluded(&self, ray: &Ray) -> [bool; 2] {
        let mut answers = [false; 2];
        let [by_bvh, by_scan] = &mut answers;
        self.bvh.occluded(&self.world, std::slice::from_ref(ray), std::slice::from_mut(by_bvh));
        self.linear.occluded(&self.world, std::slice::from_ref(ray), std::slice::from_mut(by_scan));
        answers
    }

    /// Whether BVH and full scan agree on a ray in all bits, and on whether anything is hit, alone and in a packet; the hit of
    /// the BVH.
    pub fn agrees(&self, tally: &mut Tally, ray: &Ray) -> (bool, Hit) {
        let hit = tally.watch(|| self.closest(ray));
        let agree = hit.same_bits(&self.scan(ray)) && self.occluded(ray) == [hit.is_some(); 2];
        (agree && self.agrees_in_packet(ray, &hit), hit)
    }

    /// Whether a ray has the same answers among fifteen others of its origin that run beside it, and they the same as one by
    /// one.
    fn agrees_in_packet(&self, ray: &Ray, hit: &Hit) -> bool {
        let packet = beside(ray);
        let ask = |accel: &Accel| {
            let (mut hits, mut occluded) = ([Hit::MISS; N_BESIDE], [false; N_BESIDE]);
            accel.closest_hit(&self.world, &packet, &mut hits);
            accel.occluded(&self.world, &packet, &mut occluded);
            (hits, occluded)
        };
        let ((packed, occluded), (single, occluded_single)) = (ask(&self.bvh), ask(&self.one_by_one));
        packed[0].same_bits(hit)
            && packed.iter().zip(&single).all(|(a, b)| a.same_bits(b))
            && occluded == occluded_single
            && occluded[0] == hit.is_some()
            && self.agrees_towards_a_point(&packet)
    }

    /// Whether rays that end where all of some rays start, at places along these, have the same answers together as one by one.
    fn agrees_towards_a_point(&self, from: &[Ray; N_BESIDE]) -> bool {
        let back = from.map(|ray| Ray {
            origin: ray.origin + ray.direction,
            direction: -ray.direction,
            t_min: 0.0,
            t_max: 1.0,
        });
        let ask = |accel: &Accel| {
            let mut occluded = [false; N_BESIDE];
            accel.occluded(&self.world, &back, &mut occluded);
            occluded
        };
        ask(&self.bvh) == ask(&self.one_by_one)
    }

    /// Whether a hit is right about the primitive that it names, by the oracle.
    pub fn judge(&self, tally: &mut Tally, case: &Case, ray: &Ray, hit: &Hit) -> bool {
        if !hit.is_some() {
            return true;
        }
        let primitive = Primitive::of(&self.world, hit.prim);
        let truth = probe::truth(ray, &primitive);
        probe::judge_hit(tally, case, ray, (&self.world, hit.prim), truth.as_ref(), Some(*hit))
    }

    /// Whether no primitive is hit clearly before a hit, by the oracle: for small scenes.
    pub fn judge_all(&self, tally: &mut Tally, ray: &Ray, hit: &Hit) -> bool {
        let sound = ray.t_min >= 0.0 && ray.t_min < ray.t_max;
        let (lowest, mut highest) = (ray.t_min.next_up(), hit.t.min(ray.t_max).min(f64::MAX));
        for _ in 0..6 {
            highest = highest.next_down();
        }
        tally.judged += 1;
        prim::all(&self.world).all(|prim| {
            let truth = probe::truth(ray, &Primitive::of(&self.world, prim));
            !sound || lowest > highest || !truth.is_some_and(|roots| roots.has_root_within(lowest, highest))
        })
    }
}

/// Rays of a packet.
const N_BESIDE: usize = 16;

/// A ray and fifteen that run beside it, each turned along one axis; how far differs from packet to packet.
fn beside(ray: &Ray) -> [Ray; N_BESIDE] {
    let length = ray.direction.abs().max_element();
    // A width that differs from ray to ray and is the same in every run.
    let width = length * WIDTHS[(ray.direction.x.to_bits() ^ ray.direction.y.to_bits()) as usize % WIDTHS.len()];
    std::array::from_fn(|i| {
        let axis = i % 3;
        let mut direction = ray.direction;
        direction[axis] += width * (i as f64 / N_BESIDE as f64);
        Ray { direction, ..*ray }
    })
}

/// From rays that are almost one to the widest that are packed.
const WIDTHS: [f64; 5] = [1e-12, 1e-7, 1e-4, 1e-2, 0.1];
