//! A bare mesh as input: a camera, lights and a material are put around it.

use std::path::Path;

use glam::{DMat4, DVec3};
use rayon::prelude::*;

use super::mesh::MeshFile;
use super::normals::{FaceNormals, Weight};
use super::source::Source;
use super::{
    Compiled, Names, NormalsKey, Overrides, RenderKeys, UNGROUPED, UpAxis, compile, geometry, mesh, smoothing, validate,
};
use crate::error::{Error, Place, Problem};
use crate::world::{Bounds, Camera, Dropped, Material, ObjectId, World};

const DEFAULT_WIDTH_PX: u32 = 1280;
const DEFAULT_HEIGHT_PX: u32 = 720;
const DEFAULT_FOV_Y_DEGREES: f64 = 40.0;
/// The camera stands this far above the horizontal through the object, and this far to the right of its front: enough
/// to see the top and a side, and still the face.
const ELEVATION_DEGREES: f64 = 20.0;
const AZIMUTH_DEGREES: f64 = 15.0;
/// Share of the field of view, on either side, that the object leaves free.
const MARGIN: f64 = 0.08;
/// The eye keeps this share of the object's diagonal from its nearest point: a needle that points at the camera would
/// otherwise fit into the frustum with its tip in the eye.
const LEAST_CLEARANCE: f64 = 0.25;
/// A mesh is shaded smooth when this share of its face corners is gentle: within this angle of the vertex normal.
/// Corners of a cube (55°), of an icosahedron (37°) and along the rims of machine parts (45°) are not. Of 90 meshes
/// looked at (2026-11), machine parts reach a share of at most 0.85, scanned and modelled shapes at least 0.89.
const GENTLE_SHARE: f64 = 0.87;
const GENTLE_ANGLE_DEGREES: f64 = 35.0;
/// Linear RGB of a soft grey-blue.
const BACKGROUND: DVec3 = DVec3::new(0.20, 0.24, 0.30);

/// The axes of a view of an object: to the right, up, and from the object towards the viewer.
#[derive(Clone, Copy, Debug)]
struct ViewAxes {
    right: DVec3,
    up: DVec3,
    back: DVec3,
}

/// Reads a mesh file and puts it in the picture: the whole object, as large as a margin allows, in its own
/// proportions, lit by a key light from the upper left and a fill light from the right.
///
/// # Errors
/// As [`mesh::load`], and when no triangle with an area is left.
pub fn load_mesh(path: &Path, overrides: &Overrides) -> Result<Compiled, Error> {
    compile::check_overrides(overrides)?;
    let width_px = overrides.width_px.unwrap_or(DEFAULT_WIDTH_PX);
    let height_px = overrides.height_px.unwrap_or(DEFAULT_HEIGHT_PX);
    validate::image_size(width_px, height_px).map_err(|problem| *problem)?;
    let mut file = mesh::load_with(path, mesh::Attributes { normals: true, materials: true })?;
    let duplicates = match overrides.find_duplicates || overrides.strict {
        true => geometry::duplicate_faces(&file.positions, &file.triangles, path),
        false => None,
    };
    choose_normals(&mut file);
    let mut warnings = std::mem::take(&mut file.warnings);
    warnings.extend(duplicates);
    for warning in &mut warnings {
        warning.place.file.get_or_insert_with(|| path.to_path_buf());
    }
    let (mut world, material_names, dropped) = world_of(file).map_err(|mut error| {
        error.problems.iter_mut().for_each(|problem| problem.place.file = Some(path.to_path_buf()));
        error
    })?;
    warnings.extend(geometry::warnings_about(dropped, path));
    let axes = view_axes(overrides.up.unwrap_or_default());
    let fov_y_radians = overrides.fov_y_degrees.unwrap_or(DEFAULT_FOV_Y_DEGREES).to_radians();
    let bounds = world.bounds();
    let fit = |bounds: &Bounds| fit_camera(&world, bounds, &axes, fov_y_radians, width_px, height_px);
    let (Some(bounds), Some(world_from_camera)) = (bounds, bounds.as_ref().and_then(fit)) else {
        let end = Source::open(path).map_or_else(|_| Place::file(path), |source| source.end());
        return Err(Problem::new(end, "nothing to show: the mesh has no triangle with an area").into());
    };
    add_lights(&mut world, &bounds, &axes);
    let camera = Camera { world_from_camera, fov_y_radians, width_px, height_px };
    let object = path.file_stem().map_or_else(|| "mesh".to_owned(), |stem| stem.to_string_lossy().into_owned());
    let materials = std::iter::once(format!("material of {object}")).chain(material_names).collect();
    let names = Names { materials, objects: vec![object], light_groups: vec![UNGROUPED.to_owned()] };
    Ok(Compiled { world, camera, render: RenderKeys::default(), names, warnings })
}

/// The world of a mesh, the names of the materials that it brought, and what was left out of it.
fn world_of(file: MeshFile) -> Result<(World, Vec<String>, Dropped), Error> {
    let mut world = World { background: BACKGROUND, two_sided: true, ..World::default() };
    let material = world.materials.add(&Material {
        ambient: DVec3::new(0.80, 0.80, 0.78),
        diffuse: DVec3::new(0.80, 0.80, 0.78),
        specular: DVec3::ONE,
        k_a: 0.15,
        k_d: 0.85,
        k_s: 0.0,
        reflectance: None,
        shininess: 1.0,
        ..Material::default()
    });
    let (material_names, dropped) = geometry::add_mesh_file(file, material, ObjectId(0), &mut world)?;
    Ok((world, material_names, dropped))
}

/// The file's normals where they say something; else smooth ones for a tessellated curved surface, and none for a mesh with
/// hard edges.
fn choose_normals(file: &mut MeshFile) {
    if smoothing::says_something(file) {
        return smoothing::smooth(file, NormalsKey::File, None);
    }
    file.drop_normals();
    file.normals = smooth_normals_if_gentle(&file.positions, &file.triangles);
}

/// The smooth normals of a mesh that is a tessellated curved surface; `None` for one with hard edges, and for one
/// whose faces share no vertex.
fn smooth_normals_if_gentle(positions: &[glam::Vec3], triangles: &[[u32; 3]]) -> Option<Vec<glam::Vec3>> {
    if positions.len() >= 3 * triangles.len() {
        return None;
    }
    let faces = FaceNormals::new(positions, triangles);
    let normals = faces.smooth_normals(Weight::Uniform);
    let angle_cos = libm::cos(GENTLE_ANGLE_DEGREES.to_radians());
    let share = faces.share_of_gentle_corners(&normals, angle_cos);
    (share >= GENTLE_SHARE).then_some(normals)
}

/// The view from the front. With y up the front is +z, as in most scans and games; with z up it is −y, as in CAD.
fn view_axes(up_axis: UpAxis) -> ViewAxes {
    let up = up_axis.direction();
    let front = match up_axis {
        UpAxis::Y => DVec3::Z,
        UpAxis::Z => DVec3::NEG_Y,
    };
    let side = up.cross(front);
    let (sin_e, cos_e) = libm::sincos(ELEVATION_DEGREES.to_radians());
    let (sin_a, cos_a) = libm::sincos(AZIMUTH_DEGREES.to_radians());
    let back = (cos_e * (cos_a * front + sin_a * side) + sin_e * up).normalize();
    let right = up.cross(back).normalize();
    ViewAxes { right, up: back.cross(right), back }
}

/// Moves the camera along its axes until the planes of its frustum, drawn in by the margin, touch the object.
///
/// In the axes of the view, with slopes tₓ and t_y of the frustum's sides, a camera at (x₀, y₀, z₀) sees the point
/// (x, y, z) when |x − x₀| ≤ tₓ(z₀ − z) and |y − y₀| ≤ t_y(z₀ − z). With R = max(x + tₓz) and L = max(tₓz − x) both
/// sides hold for z₀ ≥ (R + L)/2tₓ, and the middle is x₀ = (R − L)/2; the same for y.
fn fit_camera(
    world: &World,
    bounds: &Bounds,
    axes: &ViewAxes,
    fov_y_radians: f64,
    width_px: u32,
    height_px: u32,
) -> Option<DMat4> {
    let center = bounds.center();
    let slope_y = libm::tan(0.5 * fov_y_radians) * (1.0 - MARGIN);
    let slope_x = slope_y * f64::from(width_px) / f64::from(height_px);
    // Largest values are the same in whatever order they are found.
    const NOTHING: [f64; 5] = [f64::NEG_INFINITY; 5];
    let larger = |a: [f64; 5], b: [f64; 5]| std::array::from_fn(|i| a[i].max(b[i]));
    let reach = |vertex: u32| {
        let p = world.triangles.positions[vertex as usize].as_dvec3() - center;
        let (x, y, z) = (p.dot(axes.right), p.dot(axes.up), p.dot(axes.back));
        [x + slope_x * z, slope_x * z - x, y + slope_y * z, slope_y * z - y, z]
    };
    let triangles = world.triangles.vertices.par_iter().with_min_len(1 << 12);
    let reaches = triangles.fold(|| NOTHING, |most, &[a, b, c]| [a, b, c].map(reach).into_iter().fold(most, larger));
    // But for the sign of zero, which the sum takes away.
    let [right, left, top, bottom, nearest] = reaches.reduce(|| NOTHING, larger).map(|most| most + 0.0);
    let distance = ((right + left) / (2.0 * slope_x))
        .max((top + bottom) / (2.0 * slope_y))
        .max(nearest + LEAST_CLEARANCE * bounds.extent().length());
    let eye = center + 0.5 * (right - left) * axes.right + 0.5 * (top - bottom) * axes.up + distance * axes.back;
    let frame = DMat4::from_cols(axes.right.extend(0.0), axes.up.extend(0.0), axes.back.extend(0.0), eye.extend(1.0));
    frame.is_finite().then_some(frame)
}

/// A bright key light from the upper left of the viewer and a weak fill light from the right, some object sizes away,
/// so that their directions vary little over the object.
fn add_lights(world: &mut World, bounds: &Bounds, axes: &ViewAxes) {
    let size = bounds.extent().length();
    let mut add = |direction: DVec3, distance: f64, intensity: DVec3| {
        world.lights.add(bounds.center() + distance * size * direction.normalize(), intensity);
    };
    add(axes.back + 1.1 * axes.up - 0.8 * axes.right, 4.0, DVec3::new(0.80, 0.79, 0.76));
    add(axes.back + 0.3 * axes.up + 1.3 * axes.right, 5.0, DVec3::new(0.23, 0.25, 0.28));
}
