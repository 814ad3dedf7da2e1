//! A frame as a scene of POV-Ray 3.7.
//!
//! What the two have in common: spheres, quadrics with their clips, triangles with and without normals, placements; point and
//! directional lights without attenuation, Phong's model with white highlights, mirrors. POV-Ray turns every normal to the viewer:
//! a scene that is not two-sided looks the same only where its surfaces are closed and seen from outside.

use std::collections::HashMap;
use std::fmt::Write;
use std::ops::Range;

use glam::DVec3;

use super::material::{self, vector};
use crate::numeric::clip::Clip;
use crate::render::{Filter, Settings};
use crate::world::{Camera, MaterialId, World};

/// Something that cannot be said in POV-Ray's language, in words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Inexpressible(pub &'static str);

/// Placements and triangles of placements that are written at most: POV-Ray reads some hundred thousand lines a second.
const MAX_PLACEMENTS: usize = 1_000_000;

/// The frame as a scene. All radiance is divided by `white`, so that what is brighter than 1 fits into a PNG.
///
/// # Errors
/// Everything in the frame that POV-Ray cannot express.
pub fn scene(world: &World, camera: &Camera, settings: &Settings, white: f64) -> Result<String, Vec<Inexpressible>> {
    check(world, settings)?;
    let mut text = format!(
        "#version 3.7;\nglobal_settings {{ assumed_gamma 1.0 ambient_light rgb 1 max_trace_level {} adc_bailout 0 }}\n\
         default {{ finish {{ ambient 0 diffuse 0 }} }}\nbackground {{ rgb {} }}\n{}",
        settings.max_depth,
        vector(world.background / white),
        material::camera(camera),
    );
    material::lights(world, white, &mut text);
    for row in 0..world.materials.len() {
        let texture = material::texture(&world.materials, MaterialId(row as u32), white);
        let _ = writeln!(text, "#declare {} = {texture}", name_of(MaterialId(row as u32)));
    }
    spheres(world, &mut text);
    quadrics(world, &mut text);
    meshes(world, &mut text);
    Ok(text)
}

fn check(world: &World, settings: &Settings) -> Result<(), Vec<Inexpressible>> {
    let mut refused = Vec::new();
    material::check_materials(&world.materials, &mut refused);
    let filter = settings.filter != Filter::Box;
    let limits = [
        (filter, "a pixel filter other than the box"),
        (settings.terminator, "the correction of the shadow terminator"),
        (settings.course, "the course's clamped bounces"),
        (settings.max_depth > 256, "chains of more than 256 rays"),
        (world.instances.len() > MAX_PLACEMENTS, "more than a million placements"),
    ];
    refused.extend(limits.into_iter().filter(|(holds, _)| *holds).map(|(_, what)| Inexpressible(what)));
    if refused.is_empty() { Ok(()) } else { Err(refused) }
}

fn name_of(material: MaterialId) -> String {
    format!("Material{}", material.0)
}

fn texture_of(material: MaterialId) -> String {
    format!("texture {{ {} }}", name_of(material))
}

fn spheres(world: &World, text: &mut String) {
    let spheres = &world.spheres;
    for row in 0..spheres.len() {
        let (center, radius) = (vector(spheres.centers[row]), spheres.radii[row]);
        // Writing to a string cannot fail, here and below.
        let _ = writeln!(text, "sphere {{ {center}, {radius:?} {} }}", texture_of(spheres.materials[row]));
    }
}

/// A quadric is written around its own centre and moved there.
fn quadrics(world: &World, text: &mut String) {
    let quadrics = &world.quadrics;
    for (row, surface) in quadrics.surfaces.iter().enumerate() {
        // POV-Ray wants xy, xz, yz; the table has yz, xz, xy.
        let mixed = DVec3::new(surface.off_diagonal.z, surface.off_diagonal.y, surface.off_diagonal.x);
        let clip = quadrics.clips.get(row).and_then(Option::as_ref).map_or_else(String::new, clipped_by);
        let _ = writeln!(
            text,
            "quadric {{ {}, {}, {}, {:?} translate {} {clip} {} }}",
            vector(surface.diagonal),
            vector(2.0 * mixed),
            vector(2.0 * surface.linear),
            surface.constant,
            vector(surface.center),
            texture_of(quadrics.materials[row]),
        );
    }
}

/// The half-spaces of a clip. A plane of POV-Ray has a unit normal, and its inside is behind it.
fn clipped_by(clip: &Clip) -> String {
    let mut planes = String::new();
    let mut n_planes = 0;
    for (axis, row) in clip.rows.iter().enumerate() {
        let (length, offset) = (row.length(), row.dot(clip.center));
        for (sign, end) in [(1.0, clip.hi[axis]), (-1.0, -clip.lo[axis])] {
            if end.is_finite() && length > 0.0 {
                let _ = write!(
                    planes,
                    " plane {{ {}, {:?} }}",
                    vector(sign * *row / length),
                    (end + sign * offset) / length
                );
                n_planes += 1;
            }
        }
    }
    match n_planes {
        0 => String::new(),
        1 => format!("clipped_by {{{planes} }}"),
        _ => format!("clipped_by {{ intersection {{{planes} }} }}"),
    }
}

/// Meshes as they stand in the world, and placements of prototypes, each of whose parts is declared once.
fn meshes(world: &World, text: &mut String) {
    let meshes = &world.meshes;
    let rows = || {
        (0..meshes.len()).filter_map(|row| {
            let start = meshes.first_triangle[row];
            let end = meshes.first_triangle.get(row + 1).map_or(world.triangles.len() as u32, |&first| first);
            (start < end).then_some((row, start..end))
        })
    };
    let is_within = |run: &Range<u32>, triangles: &Range<u32>| run.start <= triangles.start && triangles.end <= run.end;
    let runs = &world.prototypes.triangles;
    for (row, triangles) in rows().filter(|(_, triangles)| !runs.iter().any(|run| is_within(run, triangles))) {
        let _ = write!(text, "mesh2 {{ ");
        mesh(world, row, triangles, text);
        let _ = writeln!(text, "{} }}", texture_of(meshes.materials[row]));
    }
    let mut parts: Vec<Vec<usize>> = Vec::new();
    for run in runs {
        let mut own_parts = Vec::new();
        for (row, triangles) in rows().filter(|(_, triangles)| is_within(run, triangles)) {
            let _ = write!(text, "#declare Mesh{row} = mesh2 {{ ");
            mesh(world, row, triangles, text);
            let _ = writeln!(text, "}}");
            own_parts.push(row);
        }
        parts.push(own_parts);
    }
    let instances = &world.instances;
    for placement in 0..instances.len() {
        let m = instances.world_from_object[placement].to_cols_array().map(|entry| format!("{entry:?}")).join(",");
        for &row in &parts[instances.prototypes[placement].idx()] {
            let material = instances.materials[placement].unwrap_or(meshes.materials[row]);
            let _ = writeln!(text, "object {{ Mesh{row} matrix <{m}> {} }}", texture_of(material));
        }
    }
}

/// The inside of a `mesh2`: the vertices that a mesh's triangles use, and the triangles.
fn mesh(world: &World, row: usize, triangles: Range<u32>, text: &mut String) {
    let tables = &world.triangles;
    let triangles = triangles.start as usize..triangles.end as usize;
    let mut places: HashMap<u32, usize> = HashMap::new();
    let mut used: Vec<u32> = Vec::new();
    for &vertex in tables.vertices[triangles.clone()].as_flattened() {
        places.entry(vertex).or_insert_with(|| {
            used.push(vertex);
            used.len() - 1
        });
    }
    let list = |name: &str, of: &dyn Fn(u32) -> DVec3, text: &mut String| {
        let _ = write!(text, "{name} {{ {}", used.len());
        used.iter().for_each(|&vertex| {
            let _ = write!(text, ",\n{}", vector(of(vertex)));
        });
        let _ = writeln!(text, " }}");
    };
    list("vertex_vectors", &|vertex| tables.positions[vertex as usize].as_dvec3(), text);
    if let Some(first_normal) = world.meshes.first_normal[row] {
        let first_vertex = world.meshes.first_vertex[row];
        let normal = |vertex: u32| tables.normals[(first_normal + (vertex - first_vertex)) as usize].as_dvec3();
        list("normal_vectors", &normal, text);
    }
    let _ = write!(text, "face_indices {{ {}", triangles.len());
    for corners in &tables.vertices[triangles] {
        let [a, b, c] = corners.map(|vertex| places[&vertex]);
        let _ = write!(text, ",\n<{a},{b},{c}>");
    }
    let _ = writeln!(text, " }}");
}

#[cfg(test)]
mod tests {
    use glam::{DMat4, Vec3};

    use super::*;
    use crate::world::{Material, MeshInput, ObjectId};

    fn camera() -> Camera {
        Camera { world_from_camera: DMat4::IDENTITY, fov_y_radians: 1.0, width_px: 8, height_px: 4 }
    }

    fn exported(world: &World) -> Result<String, Vec<Inexpressible>> {
        scene(world, &camera(), &Settings::new(&camera()), 2.0)
    }

    #[test]
    fn numbers_are_written_so_that_they_are_read_back_and_radiance_is_divided_by_white() {
        let mut world = World::default();
        let white = Material { k_s: 0.25, diffuse: DVec3::new(0.5, 0.0, 1.0), k_d: 1.0, ..Material::default() };
        let material = world.materials.add(&white);
        world.spheres.add(DVec3::new(0.1, 1e-9, -3.0), 0.3, material, ObjectId(0));
        world.lights.add(DVec3::X, DVec3::splat(0.5));
        world.background = DVec3::new(1.0, 0.5, 0.0);
        let text = exported(&world).unwrap();
        for part in [
            "sphere { <0.1,1e-9,-3.0>, 0.3 texture { Material0 } }",
            "light_source { <1.0,0.0,0.0> rgb <0.25,0.25,0.25> }",
            "background { rgb <0.5,0.25,0.0> }",
            "max_trace_level 5",
            "phong 0.25 phong_size 1.0",
            "pigment { rgb <0.5,1e-9,1.0> }",
        ] {
            assert!(text.contains(part), "{part} in\n{text}");
        }
    }

    #[test]
    fn what_cannot_be_said_is_named() {
        let mut world = World::default();
        world.materials.add(&Material { specular: DVec3::X, k_s: 1.0, k_t: 0.5, ..Material::default() });
        let refused = exported(&world).unwrap_err();
        assert!(refused.len() == 2 && refused[0].0.contains("coloured") && refused[1].0.contains("refraction"));
        let settings = Settings { filter: Filter::Gaussian, terminator: true, ..Settings::new(&camera()) };
        assert_eq!(scene(&World::default(), &camera(), &settings, 1.0).unwrap_err().len(), 2);
    }

    #[test]
    fn a_mesh_holds_the_vertices_that_its_triangles_use() {
        let positions = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z, Vec3::ONE];
        let mut world = World::default();
        let material = world.materials.add(&Material::default());
        let mesh = MeshInput { positions, triangles: vec![[4, 1, 2], [2, 1, 3]], material, ..MeshInput::default() };
        world.add_mesh(mesh).unwrap();
        let text = exported(&world).unwrap();
        assert!(
            text.contains("vertex_vectors { 4,\n<1.0,1.0,1.0>") && text.contains(",\n<0,1,2>,\n<2,1,3> }"),
            "{text}"
        );
    }
}
