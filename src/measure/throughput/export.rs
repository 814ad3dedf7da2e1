//! Triangles, rays and hits as plain numbers, so that anyone can run another tracer on the same work.
//!
//! All numbers are little-endian f32 without any header: `triangles.f32` has nine per triangle (three corners),
//! `rays-NAME.f32` eight per ray (origin, t_min, direction, t_max), `hits-NAME.f32` one per ray (t, ∞ for a miss).

use std::io;

use super::pass::{self, Answers};
use super::work::{Pair, Work};
use crate::accel::Accel;
use crate::measure::rays::RayKind;
use crate::world::World;

/// A file and what is in it.
pub type Content = (String, Vec<f32>);

/// All files: names and numbers. The rays are those whose numbers are f32; the hits of shadow rays are their closest.
pub fn contents(world: &World, work: &Work) -> Vec<Content> {
    let triangles = world.own_triangles().flat_map(|row| world.triangles.corners(row));
    let triangles: Vec<f32> = triangles.flat_map(|corner| corner.to_array()).collect();
    let mut files = vec![("triangles.f32".to_owned(), triangles)];
    let Some(tree) = work.trees.first() else { return files };
    for pair in &work.pairs {
        let name = pair.kind.name();
        files.push((format!("rays-{name}.f32"), rays(pair)));
        files.push((format!("hits-{name}.f32"), hits(world, &tree.accel, pair)));
    }
    files
}

/// Writes numbers in the format above.
///
/// # Errors
/// Whatever `out` answers.
pub fn write(values: &[f32], out: &mut dyn io::Write) -> io::Result<()> {
    for values in values.chunks(1 << 14) {
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        out.write_all(&bytes)?;
    }
    Ok(())
}

fn rays(pair: &Pair) -> Vec<f32> {
    let numbers = pair.f32.rays.iter().flat_map(|ray| {
        let (o, d) = (ray.origin, ray.direction);
        [o.x, o.y, o.z, ray.t_min, d.x, d.y, d.z, ray.t_max].map(|value| value as f32)
    });
    numbers.collect()
}

fn hits(world: &World, accel: &Accel, pair: &Pair) -> Vec<f32> {
    match &pair.f32.answers {
        Answers::Hits(hits) => hits.iter().map(|hit| hit.t as f32).collect(),
        Answers::Occluded(_) => {
            let mut closest = Answers::room(RayKind::Primary, pair.f32.rays.len());
            pass::trace(accel, world, &pair.f32.rays, &mut closest, 1);
            match closest {
                Answers::Hits(hits) => hits.iter().map(|hit| hit.t as f32).collect(),
                Answers::Occluded(_) => Vec::new(),
            }
        }
    }
}
