//! Objects of a description into the tables of a world.

use std::path::{Path, PathBuf};

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::compile::Base;
use super::desc::{HittableDesc, MeshDesc, MeshSource, QuadricDesc, ShapeDesc, Spanned, SphereDesc, TriangleDesc};
use super::mesh::{Attributes, MaterialRange, MeshFile};
use super::named_quadric::Local;
use super::report::Report;
use super::transform::Transform;
use super::{NormalsKey, mesh, named_quadric, smoothing, validate};
use crate::error::{Error, Place, Problem};
use crate::world::{Dropped, MaterialId, MeshInput, MeshPart, ObjectId, Spheres, World};

/// The `type` of a shape, for the names of objects that have none.
pub fn kind_name(shape: &ShapeDesc) -> &'static str {
    match shape {
        ShapeDesc::Sphere(_) => "sphere",
        ShapeDesc::Quadric(_) => "quadric",
        ShapeDesc::Named(desc) => named_quadric::kind_name(desc),
        ShapeDesc::Triangle(_) => "triangle",
        ShapeDesc::Mesh(_) => "mesh",
        ShapeDesc::Instance(_) => "instance",
    }
}

/// Adds an object to the tables, or says why it cannot be. Returns the names of the materials that it brought with it.
pub fn add_shape(
    shape: &ShapeDesc,
    hittable: &HittableDesc,
    material: MaterialId,
    object: ObjectId,
    base: &Base,
    world: &mut World,
    report: &Report,
) -> Vec<String> {
    match shape {
        ShapeDesc::Sphere(sphere) => add_sphere(sphere, hittable, material, object, world, report),
        ShapeDesc::Quadric(quadric) => add_quadric(quadric, hittable, material, object, world, report),
        ShapeDesc::Named(desc) => {
            let local = named_quadric::local(desc);
            add_surface(&local, hittable, material, object, world, report);
        }
        ShapeDesc::Triangle(triangle) => add_triangle(triangle, hittable, material, object, world, report),
        ShapeDesc::Mesh(mesh) => return add_mesh(mesh, hittable, material, object, base, world, report),
        // Placed by `placement`, which knows the prototypes.
        ShapeDesc::Instance(_) => {}
    }
    Vec::new()
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
    let Some(factor) = hittable.transform.similarity else {
        let ball = named_quadric::ball(*position, DVec3::splat(radius.value), None);
        return add_surface(&ball, hittable, material, object, world, report);
    };
    let (center, scaled) = match hittable.transform.is_identity() {
        true => (*position, radius.value),
        false => (hittable.transform.point(*position), radius.value * factor),
    };
    // Scales can shrink a radius to nothing.
    if Spheres::box_of(center, scaled).is_none() || scaled == 0.0 {
        let problem = Problem::new(Place::default(), "the sphere reaches beyond the range of 32-bit floats")
            .found(report.excerpt(&radius.span))
            .expected("position ± radius within ±3.4e38");
        report.mistake(&radius.span, &format!("{}.radius", hittable.key), problem);
        return;
    }
    world.spheres.add(center, scaled, material, object);
}

/// Adds a quadric, clipped or not, in coordinates of its own.
fn add_surface(
    local: &Local,
    hittable: &HittableDesc,
    material: MaterialId,
    object: ObjectId,
    world: &mut World,
    report: &Report,
) {
    let in_world = || {
        let world_from_local = hittable.transform.of(&local.object_from_local?)?;
        let clip = match &local.clip {
            Some(clip) => Some(hittable.transform.clip(clip)?),
            None => None,
        };
        // Rounding to nothing is beyond the range of f64 too.
        let surface = world_from_local.quadric(local.a)?;
        let vectors = [surface.diagonal, surface.off_diagonal, surface.linear];
        (vectors != [DVec3::ZERO; 3]).then_some((surface, clip))
    };
    match in_world() {
        Some((surface, clip)) => world.quadrics.add_surface(surface, clip, material, object),
        None => {
            let problem = Problem::new(Place::default(), "the surface is beyond the range of 64-bit floats here");
            report.mistake(&hittable.span, &hittable.key, problem.help("scale the scene"));
        }
    }
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
    let clip = quadric.clip.map(named_quadric::object_box);
    let local = Local { a, clip, object_from_local: Some(Transform::IDENTITY) };
    add_surface(&local, hittable, material, object, world, report);
}

fn add_triangle(
    triangle: &TriangleDesc,
    hittable: &HittableDesc,
    material: MaterialId,
    object: ObjectId,
    world: &mut World,
    report: &Report,
) {
    let transform = &hittable.transform;
    let TriangleDesc { corners, normals } = triangle;
    let normals = normals.map(|normals| normals.map(|normal| transform.normal(normal)));
    // The original interpolates the normals as they are given: only a common factor may be taken out.
    let normals = normals.map(|normals| {
        let longest = normals.iter().map(|normal| normal.length()).fold(0.0, f64::max);
        normals.map(|normal| (normal / longest).as_vec3()).to_vec()
    });
    let positions = corners.map(|corner| transform.point(corner).as_vec3()).to_vec();
    if !positions.iter().all(|position| position.is_finite()) {
        let problem = Problem::new(Place::default(), "the triangle reaches beyond the range of 32-bit floats");
        return report.mistake(&hittable.span, &hittable.key, problem);
    }
    let triangles = vec![wound([0, 1, 2], transform)];
    let input = MeshInput { positions, triangles, normals, material, parts: Vec::new(), object };
    match world.add_mesh(input) {
        Ok((_, dropped)) if dropped == Dropped::default() => {}
        Ok(_) => {
            let problem = Problem::new(Place::default(), "the triangle has no area and was left out");
            report.warning(&hittable.span, &hittable.key, problem.defect());
        }
        Err(error) => report.mistakes_elsewhere(&hittable.span, placed(error, report.file(), hittable)),
    }
}

/// The corners of a face in the order that leaves its outside outside.
fn wound([a, b, c]: [u32; 3], transform: &Transform) -> [u32; 3] {
    if transform.mirrors { [a, c, b] } else { [a, b, c] }
}

/// Puts a mesh where it stands: corners in f64, rounded once.
fn put(transform: &Transform, positions: &mut [Vec3], triangles: &mut [[u32; 3]], normals: Option<&mut Vec<Vec3>>) {
    positions.par_iter_mut().for_each(|position| *position = transform.point(position.as_dvec3()).as_vec3());
    if transform.mirrors {
        triangles.par_iter_mut().for_each(|triangle| *triangle = wound(*triangle, transform));
    }
    if let Some(normals) = normals {
        normals.par_iter_mut().for_each(|normal| {
            *normal = transform.normal(normal.as_dvec3()).normalize_or(normal.as_dvec3()).as_vec3();
        });
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
) -> Vec<String> {
    let MeshDesc { source, normals, crease_angle_degrees } = desc;
    let normals = normals.unwrap_or(NormalsKey::Uniform);
    let (path, mut mesh, span) = match source {
        MeshSource::File(file_path) => {
            // Materials of the scene go before those of the file.
            let wanted =
                Attributes { normals: normals == NormalsKey::File, materials: hittable.material.is_unstated() };
            let Some((path, file)) = load_mesh_file(file_path, wanted, hittable, base, report) else {
                return Vec::new();
            };
            (path, file, &file_path.span)
        }
        MeshSource::Text { positions, triangles } => {
            if triangles.is_empty() {
                let problem = Problem::new(Place::default(), "the mesh has no faces");
                report.warning(&hittable.span, &hittable.key, problem);
            }
            let positions = positions.iter().map(|position| position.as_vec3()).collect();
            let mesh = MeshFile { positions, triangles: triangles.clone(), ..MeshFile::default() };
            (report.file().to_path_buf(), mesh, &hittable.span)
        }
    };
    // A scene that is refused anyway needs no tables.
    let is_refused = report.has_mistakes();
    if !is_refused {
        smoothing::smooth(&mut mesh, normals, *crease_angle_degrees);
    }
    if base.find_duplicates && !is_refused {
        mesh.warnings.extend(duplicate_faces(&mesh.positions, &mesh.triangles, &path));
    }
    let warnings = std::mem::take(&mut mesh.warnings);
    report.warnings_elsewhere(span, placed(Error { problems: warnings }, &path, hittable));
    if is_refused {
        return Vec::new();
    }
    if !hittable.transform.is_identity() {
        put(&hittable.transform, &mut mesh.positions, &mut mesh.triangles, mesh.normals.as_mut());
    }
    match add_mesh_file(mesh, material, object, world) {
        Ok((names, dropped)) => {
            let problems = warnings_about(dropped, &path);
            report.warnings_elsewhere(span, placed(Error { problems }, &path, hittable));
            names
        }
        Err(error) => {
            report.mistakes_elsewhere(span, placed(error, &path, hittable));
            Vec::new()
        }
    }
}

/// Adds a mesh with the materials that it brought, or one where it has none, and returns their names.
///
/// # Errors
/// As [`World::add_mesh`].
pub fn add_mesh_file(
    mesh: MeshFile,
    material: MaterialId,
    object: ObjectId,
    world: &mut World,
) -> Result<(Vec<String>, Dropped), Error> {
    let MeshFile { positions, triangles, normals, materials, material_ranges, .. } = mesh;
    let ids: Vec<MaterialId> = materials.iter().map(|brought| world.materials.add(&brought.material)).collect();
    let of_range = |range: MaterialRange| MeshPart {
        first_triangle: range.first_triangle,
        material: range.material.map_or(material, |row| ids[row as usize]),
    };
    let parts = material_ranges.into_iter().map(of_range).collect();
    let (_, dropped) = world.add_mesh(MeshInput { positions, triangles, normals, material, parts, object })?;
    Ok((materials.into_iter().map(|brought| brought.name).collect(), dropped))
}

fn load_mesh_file(
    file_path: &Spanned<String>,
    wanted: Attributes,
    hittable: &HittableDesc,
    base: &Base,
    report: &Report,
) -> Option<(PathBuf, MeshFile)> {
    let path = match find_file(&file_path.value, "mesh file", base) {
        Ok(path) => path,
        Err(problem) => {
            report.mistake(&file_path.span, &format!("{}.file_path", hittable.key), *problem);
            return None;
        }
    };
    match mesh::load_with(&path, wanted) {
        Ok(file) => Some((path, file)),
        Err(error) => {
            report.mistakes_elsewhere(&file_path.span, placed(error, &path, hittable));
            None
        }
    }
}

/// The file that a scene names, or what to say when there is none.
pub fn find_file(file_path: &str, what: &str, base: &Base) -> Result<PathBuf, Box<Problem>> {
    let candidates = candidates_of(file_path, base);
    candidates.iter().find(|path| path.is_file()).cloned().ok_or_else(|| {
        let tried: Vec<String> = candidates.iter().map(|path| path.display().to_string()).collect();
        let problem = Problem::new(Place::default(), format!("{what} not found")).found(format!("\"{file_path}\""));
        Box::new(problem.help(format!("tried {}", tried.join(" and "))))
    })
}

/// Where a file may lie: beside the scene file, then in the working directory. Each path once.
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
