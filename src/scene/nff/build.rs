//! From the statements of an NFF text to the tables.

use glam::DVec3;

use super::super::mesh::finding::{Finding, Outcome};
use super::super::mesh::polygon::Cutter;
use super::super::source::Source;
use super::super::{Compiled, Names, Overrides, RenderKeys, UNGROUPED, compile, geometry, validate};
use super::cone::Cone;
use super::statement::{Light, Run, Sphere, Statements, View};
use crate::error::{Error, Place, Problem};
use crate::numeric::clip::Clip;
use crate::world::{Camera, Dropped, MaterialId, MeshInput, ObjectId, PrimRef, World};

/// Fills the tables. All that has one fill is one object.
pub(super) fn build(statements: Statements, source: &Source, overrides: &Overrides) -> Result<Compiled, Error> {
    let Statements { view, background, lights, fills, spheres, cones, runs, mut findings } = statements;
    let view = view.ok_or_else(|| {
        Problem::new(Place::file(source.path()), "the scene has no view")
            .expected("`v`, and behind it `from`, `at`, `up`, `angle` and `resolution`")
    })?;
    let camera = camera(&view, overrides).map_err(|finding| finding.into_problem(source))?;
    if spheres.len().max(cones.len()) > PrimRef::MAX_ROWS {
        let problem = Problem::new(Place::file(source.path()), "too many spheres or cones");
        return Err(problem.expected(format!("at most {} of each", PrimRef::MAX_ROWS)).into());
    }
    if lights.is_empty() {
        findings.push(Finding::file("the scene has no light (`l`)"));
    }
    if spheres.is_empty() && cones.is_empty() && runs.is_empty() {
        findings.push(Finding::file("the scene has no object (`s`, `c`, `p`, `pp`)"));
    }

    let mut world = World { background, two_sided: true, ..World::default() };
    for fill in &fills {
        world.materials.add(fill);
    }
    add_lights(&lights, &mut world);
    for Sphere { center, radius, fill } in spheres {
        world.spheres.add(center, radius, fill, ObjectId(fill.0));
    }
    for (cone, fill) in cones {
        add_cone(&cone, fill, &mut world);
    }
    let mut dropped = Dropped::default();
    let mut cutter = Cutter::new(runs.iter().map(|run| run.positions.len()).sum());
    for run in runs {
        let (non_finite, zero_area) = add_run(run, &mut cutter, &mut world, source, &mut findings)?;
        dropped.non_finite += non_finite;
        dropped.zero_area += zero_area;
    }

    let mut warnings: Vec<Problem> = findings.into_iter().map(|finding| finding.into_problem(source)).collect();
    warnings.extend(geometry::warnings_about(dropped, source.path()));
    let names: Vec<String> = (0..fills.len()).map(|fill| format!("fill {fill}")).collect();
    let names = Names { objects: names.clone(), materials: names, light_groups: vec![UNGROUPED.to_owned()] };
    Ok(Compiled { world, camera, render: RenderKeys::default(), names, warnings })
}

/// The angle spans the centres of the first and the last row: of n rows, n − 1 pixels.
fn camera(view: &View, overrides: &Overrides) -> Outcome<Camera> {
    let View { from, look_at, up, angle_degrees, size_px, at } = *view;
    let width_px = overrides.width_px.unwrap_or(size_px[0]);
    let height_px = overrides.height_px.unwrap_or(size_px[1]);
    if let Err(problem) = validate::image_size(width_px, height_px) {
        let Problem { what, found, expected, .. } = *problem;
        return Err(Finding { found, expected, ..Finding::new(at, what) }.into());
    }
    let world_from_camera = compile::look_at_frame(from, look_at, up).map_err(|(_, what, _)| Finding::new(at, what))?;
    let slope = libm::tan(0.5 * angle_degrees.to_radians());
    let rows = f64::from(height_px);
    // A single row has no spacing: it gets the whole angle.
    let of_view = 2.0 * libm::atan(slope * rows / (rows - 1.0).max(1.0));
    let fov_y_radians = overrides.fov_y_degrees.map_or(of_view, f64::to_radians);
    Ok(Camera { world_from_camera, fov_y_radians, width_px, height_px })
}

/// Of n lights, those without a colour have the intensity √n/2n, so that more lights make a brighter scene, but not in
/// proportion.
fn add_lights(lights: &[Light], world: &mut World) {
    let n = lights.len() as f64;
    for &Light { position, color } in lights {
        world.lights.add(position, color.unwrap_or(DVec3::splat(n.sqrt() / (2.0 * n))));
    }
}

/// The part between the ends, which are open.
fn add_cone(cone: &Cone, fill: MaterialId, world: &mut World) {
    let Cone { surface, axis, half_length } = *cone;
    let ends = DVec3::new(half_length, f64::INFINITY, f64::INFINITY);
    let clip = Clip::new(surface.center, [axis, DVec3::ZERO, DVec3::ZERO], -ends, ends);
    world.quadrics.add_surface(surface, Some(clip), fill, ObjectId(fill.0));
}

/// Adds the polygons of a run as one mesh, and returns how many faces were not finite and how many had no area.
fn add_run(
    run: Run,
    cutter: &mut Cutter,
    world: &mut World,
    source: &Source,
    findings: &mut Vec<Finding>,
) -> Result<(usize, usize), Error> {
    let Run { fill: material, positions, normals, faces } = run;
    let triangles = faces.cut_with(cutter, &positions, findings).map_err(|finding| finding.into_problem(source))?;
    let object = ObjectId(material.0);
    let mesh = MeshInput { positions, triangles, normals, material, object, ..MeshInput::default() };
    let (_, Dropped { non_finite, zero_area }) = world.add_mesh(mesh).map_err(|mut error| {
        error.problems.iter_mut().for_each(|problem| problem.place.file = Some(source.path().to_path_buf()));
        error
    })?;
    Ok((non_finite, zero_area))
}
