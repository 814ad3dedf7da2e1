//! `flatray info`: what a scene holds and what it costs.

use std::time::Instant;

use glam::DVec3;
use serde::Serialize;

use super::args::InfoArgs;
use super::failure::Failure;
use super::info_text;
use super::memory::Need;
use super::{diagnostic, files, memory, terminal};
use crate::accel::{Accel, AccelKind, AccelStats, Preset};
use crate::scene::{Compiled, Overrides, machine};
use crate::world::{Features, Lights, World};

/// Everything that is told of a scene; the keys of the JSON object are stable.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Info {
    /// The file as the user named it.
    pub input: String,
    /// Rows by kind.
    pub primitives: Primitives,
    /// The box around all bounded primitives.
    pub bounds: Option<Box3>,
    /// Materials by id.
    pub materials: Vec<MaterialInfo>,
    /// Point lights, then directional ones, each in the order of the file.
    pub lights: Vec<LightInfo>,
    /// The camera.
    pub camera: CameraInfo,
    /// Radiance of rays that hit nothing.
    pub background: [f64; 3],
    /// What rendering this scene takes.
    pub features: FeatureNames,
    /// Bytes by table, and their `total`.
    pub memory_bytes: serde_json::Map<String, serde_json::Value>,
    /// The acceleration structure.
    pub bvh: BvhInfo,
    /// Seconds it took to read and compile the file.
    pub load_seconds: f64,
    /// Warnings as one line each.
    pub warnings: Vec<String>,
}

/// Rows by kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[allow(missing_docs)]
pub struct Primitives {
    pub spheres: usize,
    pub quadrics: usize,
    /// Quadrics without a box, which stand outside the BVH; counted in `quadrics` too.
    pub unbounded_quadrics: usize,
    /// Triangles in the tables; those of prototypes once.
    pub triangles: usize,
    pub meshes: usize,
    pub vertices: usize,
    /// Placements of prototypes.
    pub instances: usize,
    /// Triangles that can be seen: those of a prototype as often as it is placed.
    pub placed_triangles: u64,
}

/// An axis-aligned box.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[allow(missing_docs)]
pub struct Box3 {
    pub lo: [f32; 3],
    pub hi: [f32; 3],
}

/// A material; the colours are already multiplied by `k_a`, `k_d` and `k_s`.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[allow(missing_docs)]
pub struct MaterialInfo {
    pub name: String,
    pub ambient: [f64; 3],
    pub diffuse: [f64; 3],
    pub specular: [f64; 3],
    pub reflectance: f64,
    pub shininess: f64,
    pub transmittance: f64,
    pub ior: f64,
}

/// A point light.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[allow(missing_docs)]
pub struct LightInfo {
    /// Of a point light.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position: Option<[f64; 3]>,
    /// Of a directional light: the way it travels.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub direction: Option<[f64; 3]>,
    pub intensity: [f64; 3],
}

/// The camera.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[allow(missing_docs)]
pub struct CameraInfo {
    pub position: [f64; 3],
    pub fov_y_degrees: f64,
    pub width: u32,
    pub height: u32,
}

/// Features by name.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct FeatureNames {
    /// Needed by the scene.
    pub found: Vec<&'static str>,
    /// Not needed, and therefore no part of the code that renders it.
    pub skipped: Vec<&'static str>,
}

/// Figures of the BVH.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[allow(missing_docs)]
pub struct BvhInfo {
    pub preset: &'static str,
    pub nodes: usize,
    pub leaves: usize,
    pub depth: usize,
    pub sah_cost: f64,
    pub build_seconds: f64,
    pub memory_bytes: usize,
}

/// Runs the command.
///
/// # Errors
/// Bad input, or standard output that cannot be written.
pub fn run(args: &InfoArgs) -> Result<(), Failure> {
    let started = Instant::now();
    let overrides = Overrides { strict: args.strict, find_duplicates: true, ..Overrides::default() };
    let scene = files::load(Some(&args.input), &overrides)?;
    let load_seconds = started.elapsed().as_secs_f64();
    if !args.json && !scene.warnings.is_empty() {
        terminal::print_error(&diagnostic::warnings(&scene.warnings, terminal::stderr_is_coloured()));
    }
    Need::of_structure(&scene.world, AccelKind::Bvh).check(machine::available_bytes())?;
    let started = Instant::now();
    let preset = args.bvh.map_or_else(Preset::default, Preset::from);
    let accel = Accel::build_with(&scene.world, AccelKind::Bvh, preset);
    let build_seconds = started.elapsed().as_secs_f64();

    let info =
        gather(terminal::shown(&args.input), &scene, load_seconds, bvh_info(accel.stats(), preset, build_seconds));
    let text = if args.json { to_json(&info) } else { info_text::describe(&info) };
    Ok(terminal::print(&text)?)
}

/// One JSON object; numbers that JSON cannot say become null.
fn to_json(info: &Info) -> String {
    // Fixed keys and finite trees always serialise; the fallback is never taken.
    serde_json::to_string_pretty(info).unwrap_or_default() + "\n"
}

/// The structure's figures, and how many primitives stand outside of it.
fn bvh_info(stats: AccelStats, preset: Preset, build_seconds: f64) -> (BvhInfo, usize) {
    let AccelStats { n_nodes, n_leaves, depth, sah_cost, n_unbounded, memory_bytes } = stats;
    let preset = preset.name();
    (BvhInfo { preset, nodes: n_nodes, leaves: n_leaves, depth, sah_cost, build_seconds, memory_bytes }, n_unbounded)
}

/// Point lights, then directional ones.
fn lights(lights: &Lights) -> Vec<LightInfo> {
    let at = |(position, intensity): (&DVec3, &DVec3)| LightInfo {
        position: Some(position.to_array()),
        direction: None,
        intensity: intensity.to_array(),
    };
    let along = |(direction, intensity): (&DVec3, &DVec3)| LightInfo {
        position: None,
        direction: Some(direction.to_array()),
        intensity: intensity.to_array(),
    };
    let points = lights.positions.iter().zip(&lights.intensities).map(at);
    points.chain(lights.directions.iter().zip(&lights.directional_intensities).map(along)).collect()
}

fn gather(input: String, scene: &Compiled, load_seconds: f64, (bvh, n_unbounded): (BvhInfo, usize)) -> Info {
    let world = &scene.world;
    let camera = &scene.camera;
    let mut tables: serde_json::Map<String, serde_json::Value> =
        world.memory_bytes().iter().map(|&(table, bytes)| (table.to_owned(), bytes.into())).collect();
    tables.insert("total".to_owned(), memory::table_bytes(world).into());
    Info {
        input,
        primitives: Primitives {
            spheres: world.spheres.len(),
            quadrics: world.quadrics.len(),
            unbounded_quadrics: n_unbounded,
            triangles: world.triangles.len(),
            meshes: world.meshes.len(),
            vertices: world.triangles.positions.len(),
            instances: world.instances.len(),
            placed_triangles: world.n_placed_triangles(),
        },
        bounds: world.bounds().map(|bounds| Box3 { lo: bounds.lo.to_array(), hi: bounds.hi.to_array() }),
        materials: materials(scene),
        lights: lights(&world.lights),
        camera: CameraInfo {
            position: camera.world_from_camera.transform_point3(DVec3::ZERO).to_array(),
            fov_y_degrees: camera.fov_y_radians.to_degrees(),
            width: camera.width_px,
            height: camera.height_px,
        },
        background: world.background.to_array(),
        features: feature_names(&world.features()),
        memory_bytes: tables,
        bvh,
        load_seconds,
        warnings: scene.warnings.iter().map(ToString::to_string).collect(),
    }
}

fn materials(scene: &Compiled) -> Vec<MaterialInfo> {
    let World { materials, .. } = &scene.world;
    let columns = materials.ambient.iter().zip(&materials.diffuse).zip(&materials.specular);
    let scalars = materials.reflectance.iter().zip(&materials.shininess);
    let glass = materials.transmittance.iter().zip(&materials.ior);
    let rows = columns.zip(scalars).zip(glass).enumerate();
    rows.map(|(row, ((((ambient, diffuse), specular), (&reflectance, &shininess)), (&transmittance, &ior)))| {
        MaterialInfo {
            name: scene.names.materials.get(row).cloned().unwrap_or_else(|| format!("material {row}")),
            ambient: ambient.to_array(),
            diffuse: diffuse.to_array(),
            specular: specular.to_array(),
            reflectance,
            shininess,
            transmittance,
            ior,
        }
    })
    .collect()
}

fn feature_names(features: &Features) -> FeatureNames {
    // Destructured whole, so that a new feature cannot be forgotten here.
    let Features {
        spheres,
        quadrics,
        unbounded_quadrics,
        triangles,
        instances,
        smooth_normals,
        reflection,
        refraction,
        direct_light,
        directional_light,
        two_sided,
    } = *features;
    let all = [
        ("spheres", spheres),
        ("quadrics", quadrics),
        ("unbounded quadrics", unbounded_quadrics),
        ("triangles", triangles),
        ("instances", instances),
        ("smooth normals", smooth_normals),
        ("reflection", reflection),
        ("refraction", refraction),
        ("direct light and shadows", direct_light),
        ("directional lights", directional_light),
        ("two-sided normals", two_sided),
    ];
    let names = |wanted: bool| all.iter().filter(|(_, found)| *found == wanted).map(|(name, _)| *name).collect();
    FeatureNames { found: names(true), skipped: names(false) }
}

#[cfg(test)]
mod tests {
    use glam::DMat4;

    use super::*;
    use crate::scene::{Names, RenderKeys};
    use crate::world::{Camera, Material, ObjectId};

    fn scene() -> Compiled {
        let mut world = World::default();
        let material = world.materials.add(&Material { k_s: 0.5, ..Material::default() });
        world.spheres.add(DVec3::new(0.0, 0.0, -3.0), 1.0, material, ObjectId(0));
        world.lights.add(DVec3::Y, DVec3::ONE);
        world.lights.add_directional(-2.0 * DVec3::Z, DVec3::ONE);
        let camera = Camera { world_from_camera: DMat4::IDENTITY, fov_y_radians: 1.0, width_px: 40, height_px: 30 };
        let names = Names { objects: vec!["ball".into()], materials: vec!["chrome".into()], light_groups: Vec::new() };
        Compiled { world, camera, render: RenderKeys::default(), names, warnings: Vec::new() }
    }

    fn info() -> Info {
        let stats =
            AccelStats { n_nodes: 1, n_leaves: 1, depth: 1, sah_cost: f64::NAN, n_unbounded: 0, memory_bytes: 64 };
        gather("a.toml".into(), &scene(), 0.1, bvh_info(stats, Preset::Medium, 0.2))
    }

    #[test]
    fn the_json_object_has_the_documented_keys_and_no_nan() {
        let json: serde_json::Value = serde_json::from_str(&to_json(&info())).unwrap();
        assert_eq!(json["primitives"]["spheres"], 1);
        assert_eq!(json["primitives"]["triangles"], 0);
        assert_eq!(json["materials"][0]["name"], "chrome");
        assert_eq!(json["lights"][0]["position"], serde_json::json!([0.0, 1.0, 0.0]));
        assert_eq!(json["lights"][1], serde_json::json!({"direction": [0.0, 0.0, -1.0], "intensity": [1.0, 1.0, 1.0]}));
        assert_eq!(json["bounds"]["hi"][2].as_f64().map(f64::round), Some(-2.0));
        assert_eq!(json["bvh"]["sah_cost"], serde_json::Value::Null);
        let found = ["spheres", "reflection", "direct light and shadows", "directional lights"];
        assert_eq!(json["features"]["found"], serde_json::json!(found));
        assert_eq!(json["memory_bytes"]["total"], memory::table_bytes(&scene().world));
        assert_eq!(json["camera"]["width"], 40);
    }

    #[test]
    fn the_text_names_what_was_found_and_what_was_skipped() {
        let text = info_text::describe(&info());
        for expected in ["spheres", "1", "chrome", "found", "skipped", "smooth normals", "40x30"] {
            assert!(text.contains(expected), "{expected:?} is not in:\n{text}");
        }
    }
}
