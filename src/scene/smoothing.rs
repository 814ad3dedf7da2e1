//! Which normals a mesh is shaded with.

use glam::Vec3;
use rayon::prelude::*;

use super::NormalsKey;
use super::crease::{Creased, split_at_creases};
use super::mesh::MeshFile;
use super::normals::{FaceNormals, Weight};
use crate::error::{Place, Problem};

/// Gives a mesh one unit normal per position, or none for flat shading. Vertices may be split for it: then rows are added
/// to its positions and its triangles name them. The number and order of triangles stay. What was mended is added to its
/// warnings, without a place where it is about no file.
pub fn smooth(mesh: &mut MeshFile, key: NormalsKey, crease_angle_degrees: Option<f64>) {
    let weight = match (key, mesh.normals.take()) {
        (NormalsKey::Flat, _) => return,
        (NormalsKey::File, Some(normals)) => {
            let (normals, n_mended) = unit_normals(&mesh.positions, &mesh.triangles, normals);
            mesh.warnings.extend(warning_about_mended(n_mended));
            mesh.normals = Some(normals);
            return;
        }
        (NormalsKey::File, None) => {
            let what = "the file has no normals for its faces: they are made from the faces";
            mesh.warnings.push(Problem::new(Place::default(), what));
            Weight::Uniform
        }
        (NormalsKey::Uniform, _) => Weight::Uniform,
        (NormalsKey::Area, _) => Weight::Area,
        (NormalsKey::Angle, _) => Weight::Angle,
    };
    let Some(crease_angle_degrees) = crease_angle_degrees else {
        mesh.normals = Some(FaceNormals::new(&mesh.positions, &mesh.triangles).smooth_normals(weight));
        return;
    };
    let (positions, triangles) = (std::mem::take(&mut mesh.positions), std::mem::take(&mut mesh.triangles));
    let Creased { positions, triangles, normals } =
        split_at_creases(positions, triangles, weight, crease_angle_degrees);
    (mesh.positions, mesh.triangles, mesh.normals) = (positions, triangles, Some(normals));
}

/// Normals of a file, made unit length, and how many vertices of faces with an area had none: zero, or not finite. For
/// those the mean of the faces' stands in.
fn unit_normals(positions: &[Vec3], triangles: &[[u32; 3]], mut normals: Vec<Vec3>) -> (Vec<Vec3>, usize) {
    normals.par_iter_mut().for_each(|normal| {
        let unit = normal.as_dvec3().try_normalize().map_or(Vec3::ZERO, |unit| unit.as_vec3());
        *normal = if unit.is_finite() { unit } else { Vec3::ZERO };
    });
    if normals.par_iter().all(|&normal| normal != Vec3::ZERO) {
        return (normals, 0);
    }
    let is_missing: Vec<bool> = normals.iter().map(|&normal| normal == Vec3::ZERO).collect();
    let faces = FaceNormals::new(positions, triangles);
    for (normal, of_faces) in normals.iter_mut().zip(faces.smooth_normals(Weight::Uniform)) {
        if *normal == Vec3::ZERO {
            *normal = of_faces;
        }
    }
    let n_mended = is_missing.iter().zip(faces.has_faces()).filter(|&(&missing, used)| missing && used).count();
    (normals, n_mended)
}

fn warning_about_mended(n_mended: usize) -> Option<Problem> {
    let vertices = if n_mended == 1 { "1 vertex has".to_owned() } else { format!("{n_mended} vertices have") };
    let what = format!("{vertices} no usable normal in the file: the mean of the faces around stands in");
    (n_mended > 0).then(|| Problem::new(Place::default(), what).defect())
}

/// What a bare mesh is shaded with, by the normals of its file: `File` when they say something that the faces do not.
///
/// They say nothing when at least [`FLAT_SHARE`] of the corners have the normal of their face, as exporters write it for
/// models that were never smoothed; and they cannot be meant when most point behind their faces: they are then left out
/// with a warning.
pub fn says_something(mesh: &mut MeshFile) -> bool {
    /// Files write normals with three decimals or more: 1° covers what is lost.
    const FLAT_ANGLE_COSINE: f64 = 0.999_847_695_156_391_2;
    const FLAT_SHARE: f64 = 0.999;
    let Some(normals) = &mesh.normals else { return false };
    let (normals, _) = unit_normals(&mesh.positions, &mesh.triangles, normals.clone());
    let faces = FaceNormals::new(&mesh.positions, &mesh.triangles);
    if faces.share_of_gentle_corners(&normals, 0.0) < 0.5 {
        let what = "most normals of the file point behind their faces: they are made from the faces instead";
        mesh.warnings.push(Problem::new(Place::default(), what));
        return false;
    }
    faces.share_of_gentle_corners(&normals, FLAT_ANGLE_COSINE) < FLAT_SHARE
}
