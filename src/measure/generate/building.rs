//! A building as CAD programs export it: large walls and slabs of two triangles a side, round columns, pipes and railings
//! of long thin triangles, everything overlapping. Seen and lit from inside.

use glam::{DVec3, Vec3};

use crate::error::Error;
use crate::world::{Camera, World};

// Metres.
const LENGTH: f32 = 60.0;
const WIDTH: f32 = 36.0;
const STOREY: f32 = 3.2;
const SLAB: f32 = 0.3;
const N_STOREYS: u32 = 10;
/// Between columns, and between walls.
const BAY: f32 = 6.0;
/// Where stairs go through the slabs: x from, x to, z from, z to.
const STAIRWELL: [f32; 4] = [24.5, 29.5, 15.0, 18.0];

/// The building with three lamps on the storey that the camera stands on: about 455,000 triangles.
///
/// # Errors
/// None: the indices are in range.
pub fn world() -> Result<World, Error> {
    let mut mesh = Mesh::default();
    for storey in 0..N_STOREYS {
        let floor = storey as f32 * STOREY;
        slab(&mut mesh, floor);
        columns(&mut mesh, floor);
        walls(&mut mesh, floor);
        stairs(&mut mesh, floor);
        railings(&mut mesh, floor);
        pipes(&mut mesh, floor);
        desks(&mut mesh, floor);
    }
    slab(&mut mesh, N_STOREYS as f32 * STOREY);
    facade(&mut mesh);
    let mut world = World::from_triangles(mesh.positions, mesh.triangles)?;
    world.two_sided = true;
    for [x, z] in [[8.3, 7.6], [28.1, 9.4], [44.6, 19.7]] {
        world.lights.add(DVec3::new(x, eye_height() + 0.6, z), DVec3::splat(0.4));
    }
    Ok(world)
}

/// Along the fifth storey, from a corner.
pub fn camera(width_px: u32, height_px: u32) -> Camera {
    let eye = DVec3::new(1.3, eye_height(), 1.7);
    let frame = Camera::look_at_frame(eye, DVec3::new(40.0, eye_height() - 1.0, 24.0), DVec3::Y);
    Camera { world_from_camera: frame.unwrap_or_default(), fov_y_radians: 65f64.to_radians(), width_px, height_px }
}

fn eye_height() -> f64 {
    f64::from(4.0 * STOREY) + 1.7
}

/// Triangles under construction; every part has its own vertices.
#[derive(Default)]
struct Mesh {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
}

impl Mesh {
    fn quad(&mut self, corners: [Vec3; 4]) {
        let first = self.positions.len() as u32;
        self.positions.extend(corners);
        self.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    }

    /// A box of twelve triangles.
    fn cuboid(&mut self, lo: Vec3, hi: Vec3) {
        let at = |x: u8, y: u8, z: u8| {
            let pick = |bit: u8, lo: f32, hi: f32| if bit == 0 { lo } else { hi };
            Vec3::new(pick(x, lo.x, hi.x), pick(y, lo.y, hi.y), pick(z, lo.z, hi.z))
        };
        self.quad([at(0, 0, 0), at(0, 0, 1), at(0, 1, 1), at(0, 1, 0)]);
        self.quad([at(1, 0, 0), at(1, 1, 0), at(1, 1, 1), at(1, 0, 1)]);
        self.quad([at(0, 0, 0), at(1, 0, 0), at(1, 0, 1), at(0, 0, 1)]);
        self.quad([at(0, 1, 0), at(0, 1, 1), at(1, 1, 1), at(1, 1, 0)]);
        self.quad([at(0, 0, 0), at(0, 1, 0), at(1, 1, 0), at(1, 0, 0)]);
        self.quad([at(0, 0, 1), at(1, 0, 1), at(1, 1, 1), at(0, 1, 1)]);
    }

    /// A cylinder without caps: two triangles per side, as long as it is.
    fn tube(&mut self, from: Vec3, to: Vec3, radius: f32, n_sides: u32) {
        let (right, up) = (to - from).normalize().any_orthonormal_pair();
        let ring = |side: u32| {
            let (sin, cos) = libm::sincosf(std::f32::consts::TAU * (side % n_sides) as f32 / n_sides as f32);
            radius * (cos * right + sin * up)
        };
        for side in 0..n_sides {
            let (a, b) = (ring(side), ring(side + 1));
            self.quad([from + a, from + b, to + b, to + a]);
        }
    }
}

/// Multiples of a step between two ends, both included.
fn steps(from: f32, to: f32, step: f32) -> impl Iterator<Item = f32> {
    let n = ((to - from) / step).round() as u32;
    (0..=n).map(move |i| from + step * i as f32)
}

/// A floor around the stairwell.
fn slab(mesh: &mut Mesh, floor: f32) {
    let [x0, x1, z0, z1] = STAIRWELL;
    for [from_x, to_x, from_z, to_z] in
        [[0.0, x0, 0.0, WIDTH], [x1, LENGTH, 0.0, WIDTH], [x0, x1, 0.0, z0], [x0, x1, z1, WIDTH]]
    {
        mesh.cuboid(Vec3::new(from_x, floor - SLAB, from_z), Vec3::new(to_x, floor, to_z));
    }
}

fn columns(mesh: &mut Mesh, floor: f32) {
    for x in steps(0.0, LENGTH, BAY) {
        for z in steps(0.0, WIDTH, BAY) {
            let foot = Vec3::new(x, floor, z);
            mesh.tube(foot, foot + Vec3::Y * (STOREY - SLAB), 0.25, 48);
        }
    }
}

/// Walls along every second line of columns, each bay with a door.
fn walls(mesh: &mut Mesh, floor: f32) {
    let ceiling = floor + STOREY - SLAB;
    for z in [12.0, 24.0] {
        for x in steps(0.0, LENGTH - BAY, BAY) {
            let mut part = |from: f32, to: f32, low: f32| {
                mesh.cuboid(Vec3::new(x + from, low, z - 0.06), Vec3::new(x + to, ceiling, z + 0.06));
            };
            part(0.0, 2.4, floor);
            part(2.4, 3.4, floor + 2.1);
            part(3.4, BAY, floor);
        }
    }
    for x in [12.0, 36.0, 48.0] {
        for z in [0.0, 24.0] {
            mesh.cuboid(Vec3::new(x - 0.06, floor, z), Vec3::new(x + 0.06, ceiling, z + 8.0));
        }
    }
}

/// One flight with two handrails on posts.
fn stairs(mesh: &mut Mesh, floor: f32) {
    const N_STEPS: u32 = 18;
    let [x0, x1, z0, z1] = STAIRWELL;
    let (tread, rise) = ((x1 - x0) / N_STEPS as f32, STOREY / N_STEPS as f32);
    let at = |step: u32, z: f32| Vec3::new(x0 + tread * step as f32, floor + rise * step as f32, z);
    for step in 0..N_STEPS {
        let nose = at(step, z0 + 0.2);
        mesh.cuboid(nose, nose + Vec3::new(tread + 0.02, rise, z1 - z0 - 0.4));
        for z in [z0 + 0.25, z1 - 0.25] {
            let foot = at(step, z) + Vec3::new(0.5 * tread, rise, 0.0);
            mesh.tube(foot, foot + Vec3::Y, 0.012, 12);
        }
    }
    for z in [z0 + 0.25, z1 - 0.25] {
        mesh.tube(at(0, z) + Vec3::Y, at(N_STEPS, z) + Vec3::Y, 0.025, 24);
    }
}

/// Around the storey: a balustrade with a bar every quarter of a metre and rails of its whole length.
fn railings(mesh: &mut Mesh, floor: f32) {
    let corners = [[0.4, 0.4], [LENGTH - 0.4, 0.4], [LENGTH - 0.4, WIDTH - 0.4], [0.4, WIDTH - 0.4]];
    for side in 0..4 {
        let [from, to] = [corners[side], corners[(side + 1) % 4]].map(|[x, z]| Vec3::new(x, floor, z));
        for height in [0.1, 0.4, 0.7, 1.0] {
            mesh.tube(from + Vec3::Y * height, to + Vec3::Y * height, 0.02, 16);
        }
        let along = (to - from).normalize();
        for distance in steps(0.0, (to - from).length(), 0.25) {
            let foot = from + along * distance;
            mesh.tube(foot, foot + Vec3::Y, 0.008, 12);
        }
    }
}

/// Under the ceiling: pipes of the building's whole length, and ducts across.
fn pipes(mesh: &mut Mesh, floor: f32) {
    let height = floor + STOREY - SLAB - 0.25;
    for z in steps(1.5, WIDTH - 1.5, 1.5) {
        mesh.tube(Vec3::new(0.1, height, z), Vec3::new(LENGTH - 0.1, height, z), 0.06, 24);
    }
    for x in steps(3.0, LENGTH - 3.0, BAY) {
        mesh.cuboid(Vec3::new(x - 0.3, height - 0.4, 0.1), Vec3::new(x + 0.3, height - 0.1, WIDTH - 0.1));
    }
}

/// A desk in every other half bay: a top on four tubes.
fn desks(mesh: &mut Mesh, floor: f32) {
    for x in steps(2.0, LENGTH - 4.0, 3.0) {
        for z in steps(2.0, WIDTH - 4.0, 4.0) {
            let top = Vec3::new(x, floor + 0.72, z);
            mesh.cuboid(top, top + Vec3::new(1.6, 0.03, 0.8));
            for [dx, dz] in [[0.05, 0.05], [1.55, 0.05], [1.55, 0.75], [0.05, 0.75]] {
                mesh.tube(Vec3::new(x + dx, floor, z + dz), top + Vec3::new(dx, 0.0, dz), 0.02, 10);
            }
        }
    }
}

/// Mullions over the whole height and transoms around the whole building.
fn facade(mesh: &mut Mesh) {
    let top = N_STOREYS as f32 * STOREY;
    for x in steps(0.0, LENGTH, 1.2) {
        for z in [0.0, WIDTH] {
            mesh.cuboid(Vec3::new(x - 0.03, 0.0, z - 0.06), Vec3::new(x + 0.03, top, z + 0.06));
        }
    }
    for z in steps(0.0, WIDTH, 1.2) {
        for x in [0.0, LENGTH] {
            mesh.cuboid(Vec3::new(x - 0.06, 0.0, z - 0.03), Vec3::new(x + 0.06, top, z + 0.03));
        }
    }
    for y in steps(0.0, top, 0.8) {
        for z in [0.0, WIDTH] {
            mesh.cuboid(Vec3::new(0.0, y - 0.02, z - 0.04), Vec3::new(LENGTH, y + 0.02, z + 0.04));
        }
        for x in [0.0, LENGTH] {
            mesh.cuboid(Vec3::new(x - 0.04, y - 0.02, 0.0), Vec3::new(x + 0.04, y + 0.02, WIDTH));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::{Accel, AccelKind};
    use crate::measure::rays::{RayKind, RayPrecision, RaySource};
    use crate::world::Hit;

    #[test]
    fn it_is_large_closed_in_thin_and_lit_from_inside() {
        let world = world().unwrap();
        let n = world.triangles.len();
        assert!((200_000..600_000).contains(&n), "{n}");
        let thin = (0..n).filter(|&row| {
            let [a, b, c] = world.triangles.corners(row);
            let longest = (b - a).length().max((c - b).length()).max((a - c).length());
            longest * longest > 20.0 * (b - a).cross(c - a).length()
        });
        assert!(2 * thin.count() > n, "most triangles are long and thin");

        let accel = Accel::build(&world, AccelKind::Bvh);
        let source = RaySource::new(&world, &accel, &camera(64, 48));
        let rays = source.rays(RayKind::Primary, RayPrecision::F64);
        let mut hits = vec![Hit::MISS; rays.len()];
        accel.closest_hit(&world, &rays, &mut hits);
        assert!(hits.iter().filter(|hit| hit.is_some()).count() * 10 > rays.len() * 8, "most rays end inside");
        let rays = source.rays(RayKind::Shadow, RayPrecision::F64);
        let mut occluded = vec![false; rays.len()];
        accel.occluded(&world, &rays, &mut occluded);
        let share = occluded.iter().filter(|occluded| **occluded).count() as f64 / rays.len() as f64;
        assert!((0.1..0.9).contains(&share), "{share}");
    }
}
