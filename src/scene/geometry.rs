//! Objects of a description into the tables of a world.

use std::path::{Path, PathBuf};

use glam::Vec3;

use super::compile::Base;
use super::desc::{HittableDesc, MeshDesc, MeshSource, QuadricDesc, ShapeDesc, Spanned, SphereDesc, TriangleDesc};
use super::mesh::{MeshFile, Wants};
use super::report::Report;
use super::{mesh, normals, validate};
use crate::error::{Error, Place, Problem};
use crate::world::{Dropped, MaterialId, MeshInput, ObjectId, Spheres, World};

/// The `type` of a shape, for the names of objects that have none.
pub fn kind_name(shape: &ShapeDesc) -> &'static str {
    match shape {
        ShapeDesc::Sphere(_) => "sphere",
        ShapeDesc::Quadric(_) => "quadric",
        ShapeDesc::Triangle(_) => "triangle",
        ShapeDesc::Mesh(_) => "mesh",
    }
}

/// Adds an object to the tables, or says why it cannot be.
pub fn add_shape(
    shape: &ShapeDesc,
    hittable: &HittableDesc,
    material: MaterialId,
    object: ObjectId,
    base: &Base,
    world: &mut World,
    report: &Report,
) {
    match shape {
        ShapeDesc::Sphere(sphere) => add_sphere(sphere, hittable, material, object, world, report),
        ShapeDesc::Quadric(quadric) => add_quadric(quadric, hittable, material, object, world, report),
        ShapeDesc::Triangle(triangle) => add_triangle(triangle, hittable, material, object, world, report),
        ShapeDesc::Mesh(mesh) => add_mesh(mesh, hittable, material, object, base, world, report),
    }
}

fn add_sphere(
    sphere: &SphereDesc,
    hittable: &HittableDesc,
    material: MaterialId,
    object: ObjectId,
    world: &mut World,
    report: &Report,
) {
    let SphereDesc { position, radius } = sphere;
    if Spheres::box_of(*position, radius.value).is_none() {
        let problem = Problem::new(Place::default(), "the sphere reaches beyond the range of 32-bit floats")
            .found(report.excerpt(&radius.span))
            .expected("position ± radius within ±3.4e38");
        report.mistake(&radius.span, &format!("{}.radius", hittable.key), problem);
        return;
    }
    world.spheres.add(*position, radius.value, material, object);
}

fn add_quadric(
    quadric: &QuadricDesc,
    hittable: &HittableDesc,
    material: MaterialId,
    object: ObjectId,
    world: &mut World,
    report: &Report,
) {
    let key = format!("{}.A", hittable.key);
    let span = &quadric.a.span;
    let (a, unequal) = match validate::symmetric_quadric(&quadric.a.value) {
        Ok(symmetric) => symmetric,
        Err(problem) => return report.mistake(span, &key, *problem),
    };
    if let Some(unequal) = unequal {
        let problem = Problem::new(Place::default(), "the matrix is not symmetric: the mean of both entries is used");
        report.warning(span, &key, problem.found(unequal));
    }
    if validate::has_no_real_point(&a) {
        let problem = Problem::new(Place::default(), "no real point lies on this quadric: nothing will be seen of it");
        report.warning(span, &key, problem.help("is the sign of A[3][3] right?"));
    }
    world.quadrics.add(a, material, object);
}

fn add_triangle(
    triangle: &TriangleDesc,
    hittable: &HittableDesc,
    material: MaterialId,
    object: ObjectId,
    world: &mut World,
    report: &Report,
) {
    let TriangleDesc { corners, normals } = triangle;
    // The original interpolates the normals as they are given: only a common factor may be taken out.
    let normals = normals.map(|normals| {
        let longest = normals.iter().map(|normal| normal.length()).fold(0.0, f64::max);
        normals.map(|normal| (normal / longest).as_vec3()).to_vec()
    });
    let input = MeshInput {
        positions: corners.map(|corner| corner.as_vec3()).to_vec(),
        triangles: vec![[0, 1, 2]],
        normals,
        material,
        object,
    };
    match world.add_mesh(input) {
        Ok((_, dropped)) if dropped == Dropped::default() => {}
        Ok(_) => {
            let problem = Problem::new(Place::default(), "the triangle has no area and was left out");
            report.warning(&hittable.span, &hittable.key, problem.defect());
        }
        Err(error) => report.mistakes_elsewhere(&hittable.span, placed(error, report.file(), hittable)),
    }
}

fn add_mesh(
    desc: &MeshDesc,
    hittable: &HittableDesc,
    material: MaterialId,
    object: ObjectId,
    base: &Base,
    world: &mut World,
    report: &Report,
) {
    let MeshDesc { source, phong_interpolation } = desc;
    let (path, positions, triangles, span) = match source {
        MeshSource::File(file_path) => {
            let Some((path, file)) = load_mesh_file(file_path, hittable, base, report) else { return };
            let MeshFile { positions, triangles, normals: _, n_faces: _, warnings } = file;
            report.warnings_elsewhere(&file_path.span, placed(Error { problems: warnings }, &path, hittable));
            (path, positions, triangles, &file_path.span)
        }
        MeshSource::Text { positions, triangles } => {
            if triangles.is_empty() {
                let problem = Problem::new(Place::default(), "the mesh has no faces");
                report.warning(&hittable.span, &hittable.key, problem);
            }
            let positions = positions.iter().map(|position| position.as_vec3()).collect();
            (report.file().to_path_buf(), positions, triangles.clone(), &hittable.span)
        }
    };
    // A scene that is refused anyway needs no tables.
    if report.has_mistakes() {
        return;
    }
    if base.find_duplicates {
        let problems = duplicate_faces(&positions, &triangles, &path).into_iter().collect();
        report.warnings_elsewhere(span, placed(Error { problems }, &path, hittable));
    }
    let smooth = phong_interpolation.unwrap_or(true);
    let normals = smooth.then(|| normals::smooth_normals(&positions, &triangles));
    match world.add_mesh(MeshInput { positions, triangles, normals, material, object }) {
        Ok((_, dropped)) => {
            let problems = warnings_about(dropped, &path);
            report.warnings_elsewhere(span, placed(Error { problems }, &path, hittable));
        }
        Err(error) => report.mistakes_elsewhere(span, placed(error, &path, hittable)),
    }
}

fn load_mesh_file(
    file_path: &Spanned<String>,
    hittable: &HittableDesc,
    base: &Base,
    report: &Report,
) -> Option<(PathBuf, MeshFile)> {
    let candidates = candidates_of(&file_path.value, base);
    let Some(path) = candidates.iter().find(|path| path.is_file()) else {
        let tried: Vec<String> = candidates.iter().map(|path| path.display().to_string()).collect();
        let problem = Problem::new(Place::default(), "mesh file not found")
            .found(format!("\"{}\"", file_path.value))
            .help(format!("tried {}", tried.join(" and ")));
        report.mistake(&file_path.span, &format!("{}.file_path", hittable.key), problem);
        return None;
    };
    match mesh::load_wanted(path, Wants { normals: false }) {
        Ok(file) => Some((path.clone(), file)),
        Err(error) => {
            report.mistakes_elsewhere(&file_path.span, placed(error, path, hittable));
            None
        }
    }
}

/// Where a mesh may lie: beside the scene file, then in the working directory. Each path once.
fn candidates_of(file_path: &str, base: &Base) -> Vec<PathBuf> {
    let path = PathBuf::from(file_path);
    let mut candidates: Vec<PathBuf> = base.directory.iter().map(|directory| directory.join(&path)).collect();
    if !candidates.contains(&path) {
        candidates.push(path);
    }
    candidates
}

/// What faces were left out, in words.
pub fn warnings_about(dropped: Dropped, path: &Path) -> Vec<Problem> {
    let Dropped { non_finite, zero_area } = dropped;
    let counted = |n: usize, what: &str| {
        let faces = if n == 1 { "1 face".to_owned() } else { format!("{n} faces") };
        (n > 0).then(|| Problem::new(Place::file(path), format!("{faces} {what} left out")).defect())
    };
    [counted(non_finite, "with a NaN or infinite corner"), counted(zero_area, "without area")]
        .into_iter()
        .flatten()
        .collect()
}

/// A warning of faces that are there more than once, if there are any. They stay: the first of them is what is hit.
pub fn duplicate_faces(positions: &[Vec3], triangles: &[[u32; 3]], path: &Path) -> Option<Problem> {
    let n = mesh::count_duplicate_faces(positions, triangles);
    let faces = if n == 1 { "1 face is".to_owned() } else { format!("{n} faces are") };
    (n > 0).then(|| Problem::new(Place::file(path), format!("{faces} there already, and hidden by the first")).defect())
}

/// Problems of a mesh, each naming the file if it does not yet, and the object that asked for it.
fn placed(error: Error, path: &Path, hittable: &HittableDesc) -> Vec<Problem> {
    let asked = format!("for {}", hittable.key);
    let place = |mut problem: Problem| {
        problem.place.file.get_or_insert_with(|| path.to_path_buf());
        problem.help = Some(match problem.help {
            Some(help) => format!("{help}; {asked}"),
            None => asked.clone(),
        });
        problem
    };
    error.problems.into_iter().map(place).collect()
}
