//! Geometry made for measuring: the same on every machine.

pub mod building;
pub mod sphereflake;

use glam::{DVec3, Vec3};

use crate::error::Error;
use crate::world::{Camera, World};

/// A terrain of about `n_triangles` with two lights, one of them low.
///
/// # Errors
/// When it has more rows than a table.
pub fn terrain_world(n_triangles: u32) -> Result<World, Error> {
    let n = (0.5 * f64::from(n_triangles)).sqrt().round().max(1.0);
    let (positions, triangles) = terrain(n as u32);
    let mut world = World::from_triangles(positions, triangles)?;
    world.two_sided = true;
    world.lights.add(DVec3::new(2.0, 3.0, 1.0), DVec3::splat(0.6));
    world.lights.add(DVec3::new(-3.0, 1.0, -0.5), DVec3::splat(0.4));
    Ok(world)
}

/// Over the terrain, from a corner to its middle.
pub fn terrain_camera(width_px: u32, height_px: u32) -> Camera {
    let frame = Camera::look_at_frame(DVec3::new(0.7, 0.6, 1.1), DVec3::new(0.0, -0.1, 0.0), DVec3::Y);
    Camera { world_from_camera: frame.unwrap_or_default(), fov_y_radians: 45f64.to_radians(), width_px, height_px }
}

/// A fractal terrain over [−1, 1]² in x and z, y up: `2·n·n` triangles. Value noise in six octaves, heights from an
/// integer hash and rounded once, so that bits do not depend on the machine.
pub fn terrain(n: u32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let coordinate = |i: u32| 2.0 * f64::from(i) / f64::from(n) - 1.0;
    let grid = |n_rows: u32| (0..n_rows).flat_map(move |j| (0..n_rows).map(move |i| (i, j)));
    let positions = grid(n + 1)
        .map(|(i, j)| {
            let (x, z) = (coordinate(i), coordinate(j));
            Vec3::new(x as f32, height(x, z) as f32, z as f32)
        })
        .collect();
    let triangles = grid(n)
        .flat_map(|(i, j)| {
            let at = |i: u32, j: u32| j * (n + 1) + i;
            let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i, j + 1), at(i + 1, j + 1));
            [[a, c, b], [b, c, d]]
        })
        .collect();
    (positions, triangles)
}

fn height(x: f64, z: f64) -> f64 {
    let mut sum = 0.0;
    let (mut frequency, mut amplitude) = (2.0, 0.25);
    for octave in 0..6 {
        sum += amplitude * noise(x * frequency, z * frequency, octave);
        frequency *= 2.0;
        amplitude *= 0.5;
    }
    sum
}

/// Value noise in [−1, 1] with bilinear interpolation.
fn noise(x: f64, z: f64, octave: u64) -> f64 {
    let (x0, z0) = (x.floor(), z.floor());
    let (u, v) = (x - x0, z - z0);
    let value = |dx: i64, dz: i64| {
        let cell = (x0 as i64 + dx) as u64 & 0xffff | ((z0 as i64 + dz) as u64 & 0xffff) << 16 | octave << 32;
        hash_unit(cell) * 2.0 - 1.0
    };
    let near = value(0, 0) * (1.0 - u) + value(1, 0) * u;
    let far = value(0, 1) * (1.0 - u) + value(1, 1) * u;
    near * (1.0 - v) + far * v
}

/// A number in [0, 1) from the output function of SplitMix64 (Steele, Lea and Flood, OOPSLA 2014).
pub fn hash_unit(x: u64) -> f64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ x >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((x ^ x >> 31) >> 11) as f64 / (1u64 << 53) as f64
}
