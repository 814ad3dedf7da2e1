//! The same triangles twice, and triangles that overlap in one plane.

use std::sync::OnceLock;

use glam::{DVec3, Vec3};
use rayon::{ThreadPool, ThreadPoolBuilder};

use super::mesh::{Mesh, lat_long};
use super::random::Random;
use super::scene::Scene;
use super::{Block, Tally, shapes};
use crate::accel::{Accel, AccelKind, Preset};
use crate::world::{Hit, Ray, World};

/// A suite: of identical copies the one with the lowest id is hit, always; of overlaps t is the same in every order,
/// and everything is for every preset on every number of threads.
pub fn run(block: &Block, tally: &mut Tally) {
    let mut random = block.shared();
    let mesh = if random.chance(0.5) { lat_long(8, 5) } else { overlaps(&mut random) };
    let n_triangles = mesh.triangles.len();
    let copies = 2 + random.below(3);
    let scene = Scene::of_meshes((0..copies).map(|_| &mesh));
    let alone = Scene::of_meshes([&mesh]);
    let shuffled = Scene::of_meshes([&shuffle(&mut random, &mesh)]);
    let build = |preset| Accel::build_with(&scene.world, AccelKind::Bvh, preset);
    let mut rebuilt: Vec<Accel> = Preset::ALL.map(build).into();
    rebuilt.extend(one_thread().into_iter().flat_map(|pool| pool.install(|| Preset::ALL.map(build))));

    for (case, mut random) in block.each() {
        let triangle = random.below(n_triangles as u64) as usize;
        let target = shapes::point_of(&mut random, mesh.corners(triangle));
        let from = random.log_uniform(0.1, 100.0) * random.direction();
        let ray = shapes::ray_towards(&mut random, target, from);
        let (agrees, hit) = scene.agrees(tally, &ray);
        let mut right = agrees && scene.judge(tally, &case, &ray, &hit);
        right &= hit.same_bits(&alone.closest(&ray));
        right &= hit.t.to_bits() == shuffled.closest(&ray).t.to_bits();
        right &= rebuilt.iter().all(|accel| hit.same_bits(&closest(accel, &scene.world, &ray)));
        tally.count(right, || case.text(&ray, None));
    }
}

/// A pool of a single thread, made once; `None` where the machine has no thread left.
fn one_thread() -> Option<&'static ThreadPool> {
    static POOL: OnceLock<Option<ThreadPool>> = OnceLock::new();
    POOL.get_or_init(|| ThreadPoolBuilder::new().num_threads(1).build().ok()).as_ref()
}

fn closest(accel: &Accel, world: &World, ray: &Ray) -> Hit {
    let mut hit = [Hit::MISS];
    accel.closest_hit(world, std::slice::from_ref(ray), &mut hit);
    hit[0]
}

/// Triangles that overlap in a few planes across the axes: in coordinates of few bits, so that t is exact there.
fn overlaps(random: &mut Random) -> Mesh {
    let mut mesh = Mesh::default();
    for _ in 0..40 {
        let axis = random.below(3) as usize;
        let level = random.integer(-1, 1) as f32;
        let first = mesh.positions.len() as u32;
        for _ in 0..3 {
            let mut corner: DVec3 = random.grid(4);
            corner[axis] = f64::from(level);
            mesh.positions.push(Vec3::new(corner.x as f32, corner.y as f32, corner.z as f32));
        }
        mesh.triangles.push([first, first + 1, first + 2]);
    }
    mesh
}

fn shuffle(random: &mut Random, mesh: &Mesh) -> Mesh {
    let mut shuffled = mesh.clone();
    for last in (1..shuffled.triangles.len()).rev() {
        let other = random.below(last as u64 + 1) as usize;
        shuffled.triangles.swap(last, other);
    }
    shuffled
}
