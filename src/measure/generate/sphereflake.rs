//! The sphereflake of the Standard Procedural Databases (Haines 1987), their "balls".
//!
//! A sphere carries nine spheres of a third of its radius that touch it: six around its equator and three above. "Above"
//! is the direction in which the sphere itself sits on its parent.

use glam::{DMat3, DVec3};

use crate::world::{Camera, Material, MeshInput, ObjectId, World};

/// Levels below the first sphere at the benchmark's usual size: 7381 spheres.
pub const DEPTH: u32 = 4;
const ROOT_RADIUS: f64 = 0.5;
const FLOOR_EXTENT: f32 = 12.0;
const FLOOR_HEIGHT: f32 = -0.5;

/// Spheres, floor, lights and materials of the sphereflake. Centres and radii are rounded to f32, so that tracers that
/// know nothing else get the same spheres.
pub fn world(depth: u32) -> World {
    let mut world = World { background: DVec3::new(0.078, 0.361, 0.753), ..World::default() };
    let color = DVec3::new(1.0, 0.9, 0.7);
    let ball = world.materials.add(&Material { diffuse: color, k_d: 0.5, k_s: 0.5, ..Material::default() });
    let sand = DVec3::new(1.0, 0.75, 0.33);
    let floor = world.materials.add(&Material { diffuse: sand, ..Material::default() });
    for (center, radius) in spheres(depth) {
        world.spheres.add(center.as_vec3().as_dvec3(), f64::from(radius as f32), ball, ObjectId(0));
    }
    let corner = |x: f32, y: f32| glam::Vec3::new(x * FLOOR_EXTENT, y * FLOOR_EXTENT, FLOOR_HEIGHT);
    let square = MeshInput {
        positions: vec![corner(1.0, 1.0), corner(-1.0, 1.0), corner(-1.0, -1.0), corner(1.0, -1.0)],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        material: floor,
        object: ObjectId(1),
        ..MeshInput::default()
    };
    // Indices are in range and four vertices always fit.
    let _ = world.add_mesh(square);
    for position in [DVec3::new(4.0, 3.0, 2.0), DVec3::new(1.0, -4.0, 4.0), DVec3::new(-3.0, 1.0, 5.0)] {
        world.lights.add(position, DVec3::splat(0.5));
    }
    world
}

/// The camera of the benchmark.
pub fn camera(width_px: u32, height_px: u32) -> Camera {
    let frame = Camera::look_at_frame(DVec3::new(2.1, 1.3, 1.7), DVec3::ZERO, DVec3::Z);
    Camera { world_from_camera: frame.unwrap_or_default(), fov_y_radians: 45f64.to_radians(), width_px, height_px }
}

/// Centres and radii, each sphere before those it carries.
pub fn spheres(depth: u32) -> Vec<(DVec3, f64)> {
    let mut all = Vec::new();
    carry(depth, DVec3::ZERO, ROOT_RADIUS, DVec3::Z, &directions(), &mut all);
    all
}

fn carry(depth: u32, center: DVec3, radius: f64, up: DVec3, around: &[DVec3; 9], all: &mut Vec<(DVec3, f64)>) {
    all.push((center, radius));
    if depth == 0 {
        return;
    }
    let turn = turn_from_z(up);
    for direction in around.map(|direction| turn * direction) {
        carry(depth - 1, center + 4.0 / 3.0 * radius * direction, radius / 3.0, direction, around, all);
    }
}

/// Where the nine sit on a sphere whose "above" is z: in three groups of one above and two on the equator beside it. As
/// the twelve neighbours of a sphere in a close packing, without the three below: those above are at the height √(2/3).
fn directions() -> [DVec3; 9] {
    let at = |degrees: f64, z: f64| {
        let (sin, cos) = libm::sincos(degrees.to_radians());
        let radius = (1.0 - z * z).sqrt();
        DVec3::new(radius * cos, radius * sin, z)
    };
    let height = (2.0f64 / 3.0).sqrt();
    let group = |turn: f64| [at(45.0 + turn, height), at(15.0 + turn, 0.0), at(75.0 + turn, 0.0)];
    let [[a, b, c], [d, e, f], [g, h, i]] = [group(0.0), group(120.0), group(240.0)];
    [a, b, c, d, e, f, g, h, i]
}

/// The shortest turn that takes z to a direction; to −z about y, as the original has it.
fn turn_from_z(to: DVec3) -> DMat3 {
    let axis = DVec3::Z.cross(to);
    let Some(unit) = (axis.length() > 1e-6).then(|| axis.normalize()) else {
        return if to.z > 0.0 { DMat3::IDENTITY } else { DMat3::from_diagonal(DVec3::new(-1.0, 1.0, -1.0)) };
    };
    // The turned frame: the axis stays, the direction at right angles to it in the plane turns with z.
    let (z, side) = (to, unit.cross(to));
    let from = DMat3::from_cols(unit, unit.cross(DVec3::Z), DVec3::Z);
    DMat3::from_cols(unit, side, z) * from.transpose()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_are_nine_times_as_many_spheres_on_each_level_and_each_touches_its_parent() {
        let all = spheres(2);
        assert_eq!(all.len(), 1 + 9 + 81);
        assert_eq!(spheres(DEPTH).len(), 7381);
        for (center, radius) in &all[1..] {
            let touches = |other: &(DVec3, f64)| ((other.0 - *center).length() - other.1 - radius).abs() < 1e-12;
            assert!(all.iter().any(|other| other.1 > 2.0 * radius && touches(other)));
        }
    }
}
