//! Which keys a scene has and what each must be: from tables to a description.
//!
//! `docs/SCENE_FORMAT.md` documents every key read here.

use glam::DVec3;

use crate::error::{Error, Place, Problem};

use super::desc::{
    CameraDesc, HittableDesc, LightDesc, LightFrom, MaterialDesc, MaterialRef, MeshDesc, MeshSource, NamedMaterialDesc,
    PoseDesc, QuadricDesc, RenderDesc, SceneDesc, ShapeDesc, Spanned, SphereDesc, TriangleDesc,
};
use super::report::Report;
use super::toml::{Table, walk};
use super::validate::{COORDINATE, CREASE_ANGLE, ENTRY, EXPOSURE, FOV, NON_NEGATIVE, POSITIVE, SIDE_PX, WHITE_POINT};
use super::{AovKey, FilterKey, NormalsKey, SamplerKey, ToneMapKey, named_quadric, placement, transform};

const THREE_NUMBERS: &str = "3 numbers";
const MATERIAL_KEYS: [&str; 9] = ["ambient", "diffuse", "specular", "k_a", "k_d", "k_s", "sh", "k_t", "ior"];

/// Reads a text; what is wrong goes to the report, and what could be read is returned all the same.
pub fn read_scene(text: &str, report: &Report) -> SceneDesc {
    walk(text, report, |mut root| {
        let scene = SceneDesc {
            camera: root.table("camera").map(read_camera).unwrap_or_default(),
            render: root.table("render").map(read_render).unwrap_or_default(),
            materials: root.tables("material").into_iter().filter_map(read_named_material).collect(),
            prototypes: root.tables("prototype").into_iter().enumerate().map(read_hittable).collect(),
            hittables: root.tables("hittable").into_iter().enumerate().map(read_hittable).collect(),
            lights: root.tables("light_source").into_iter().filter_map(read_light).collect(),
        };
        root.finish();
        scene
    })
}

/// Parses a text without compiling it.
///
/// # Errors
/// Everything that is wrong with single keys of the file.
pub fn parse(text: &str, name: &str) -> Result<SceneDesc, Error> {
    let report = Report::new(name, text);
    let scene = read_scene(text, &report);
    report.finish().map(|_| scene)
}

fn read_camera(mut table: Table<'_>) -> CameraDesc {
    let extrinsic = table.rows4("extrinsic", &ENTRY);
    let position = table.vec3("position", &COORDINATE);
    let look_at = table.vec3("look_at", &COORDINATE);
    let up = table.vec3("up", &COORDINATE);
    let other = ["position", "look_at", "up"].into_iter().find(|key| table.has(key));
    let pose = match (table.has("extrinsic"), other) {
        (true, Some(other)) => {
            table.mistake(
                other,
                Problem::new(
                    Place::default(),
                    "a camera has either `extrinsic` or `position`, `look_at` and `up`, not both",
                ),
            );
            None
        }
        (true, None) => extrinsic.map(PoseDesc::Extrinsic),
        (false, Some(_)) => {
            table.require("position", "3 numbers, the eye, beside the other keys of the pose");
            table.require("look_at", "3 numbers, the point to look at, beside the other keys of the pose");
            position.zip(look_at).map(|(position, look_at)| PoseDesc::LookAt { position, look_at, up })
        }
        (false, None) => None,
    };
    let fov_y_degrees = table.number("fov", &FOV).map(|fov| fov.value);
    let mut side = |key| table.integer(key, SIDE_PX.0, SIDE_PX.1).map(|n| n as u32);
    let (width_px, height_px) = (side("width"), side("height"));
    table.ignore("super_sampling");
    let camera = CameraDesc { pose, fov_y_degrees, width_px, height_px, span: table.span.clone() };
    table.finish();
    camera
}

fn read_render(mut table: Table<'_>) -> RenderDesc {
    let words = [
        ("center", SamplerKey::Center),
        ("grid", SamplerKey::Grid),
        ("jitter", SamplerKey::Jitter),
        ("random", SamplerKey::Random),
        ("sobol", SamplerKey::Sobol),
    ];
    let filters = [
        ("box", FilterKey::Box),
        ("triangle", FilterKey::Triangle),
        ("gaussian", FilterKey::Gaussian),
        ("blackman-harris", FilterKey::BlackmanHarris),
    ];
    let operators = [
        ("clip", ToneMapKey::Clip),
        ("reinhard", ToneMapKey::Reinhard),
        ("hable", ToneMapKey::Hable),
        ("aces-hill", ToneMapKey::AcesHill),
        ("khronos-neutral", ToneMapKey::KhronosNeutral),
        ("agx-approx", ToneMapKey::AgxApprox),
    ];
    let render = RenderDesc {
        samples: table.integer("samples", 1..=65_536, "a whole number from 1 to 65536").map(|n| n as u32),
        sampler: table.word("sampler", &words),
        filter: table.word("filter", &filters),
        seed: table.integer("seed", 0..=u64::MAX, "a whole number from 0 to 18446744073709551615"),
        max_depth: table.integer("max_depth", 1..=1000, "a whole number from 1 to 1000").map(|n| n as u32),
        exposure_ev: table.number("exposure", &EXPOSURE).map(|ev| ev.value),
        tone_map: table.word("tonemap", &operators),
        white_point: table.number("white_point", &WHITE_POINT).map(|white| white.value),
        background: table.vec3("background", &NON_NEGATIVE).map(|rgb| rgb.value),
        two_sided: table.flag("two_sided"),
        terminator: table.flag("terminator"),
        aovs: table.words("aov", &AovKey::WORDS).unwrap_or_default(),
    };
    let has_white_point = matches!(render.tone_map, Some(ToneMapKey::Reinhard | ToneMapKey::Hable));
    // A `tonemap` that could not be read may be either.
    if render.white_point.is_some() && !has_white_point && (render.tone_map.is_some() || !table.has("tonemap")) {
        let what = "a `white_point` goes with `tonemap = \"reinhard\"` or `\"hable\"`: other operators have none";
        table.mistake("white_point", Problem::new(Place::default(), what));
    }
    table.finish();
    render
}

fn read_material(table: &mut Table<'_>) -> MaterialDesc {
    MaterialDesc {
        ambient: table.vec3("ambient", &NON_NEGATIVE).map(|rgb| rgb.value),
        diffuse: table.vec3("diffuse", &NON_NEGATIVE).map(|rgb| rgb.value),
        specular: table.vec3("specular", &NON_NEGATIVE).map(|rgb| rgb.value),
        k_a: table.number("k_a", &NON_NEGATIVE).map(|k| k.value),
        k_d: table.number("k_d", &NON_NEGATIVE).map(|k| k.value),
        k_s: table.number("k_s", &NON_NEGATIVE).map(|k| k.value),
        shininess: table.number("sh", &NON_NEGATIVE).map(|sh| sh.value),
        k_t: table.number("k_t", &NON_NEGATIVE).map(|k| k.value),
        ior: table.number("ior", &POSITIVE).map(|ior| ior.value),
    }
}

fn read_named_material(mut table: Table<'_>) -> Option<NamedMaterialDesc> {
    table.require("name", "a string, the name that objects refer to");
    let name = table.string("name", "a name that is not empty");
    let material = read_material(&mut table);
    let key = table.path.clone();
    table.finish();
    Some(NamedMaterialDesc { name: name?, material, key })
}

fn read_material_ref(table: &mut Table<'_>) -> MaterialRef {
    let inline = read_material(table);
    if !table.has("material") {
        let _ = table.string("material", "");
        return MaterialRef::Inline(inline);
    }
    if let Some(key) = MATERIAL_KEYS.into_iter().find(|key| table.has(key)) {
        let what = "an object has either `material` or material keys of its own, not both";
        table.mistake(key, Problem::new(Place::default(), what));
    }
    match table.string("material", "the name of a [[material]]") {
        Some(name) => MaterialRef::Named(name),
        None => MaterialRef::Inline(inline),
    }
}

/// Reads the keys of one type of object.
type ReadShape = fn(&mut Table<'_>) -> Option<ShapeDesc>;

fn read_hittable((index, mut table): (usize, Table<'_>)) -> HittableDesc {
    let kinds: [(&str, ReadShape); 11] = [
        ("sphere", read_sphere),
        ("quadric", read_quadric),
        ("triangle", read_triangle),
        ("mesh", read_mesh),
        ("instance", placement::read_instance),
        ("ellipsoid", named_quadric::read_ellipsoid),
        ("plane", named_quadric::read_plane),
        ("cylinder", named_quadric::read_cylinder),
        ("cone", named_quadric::read_cone),
        ("paraboloid", named_quadric::read_paraboloid),
        ("hyperboloid", named_quadric::read_hyperboloid),
    ];
    table.require("type", &super::toml::one_of(kinds.iter().map(|&(word, _)| word)));
    let kind = table.word("type", &kinds);
    let name = table.string("name", "a name that is not empty").map(|name| name.value);
    let material = read_material_ref(&mut table);
    let transform = transform::read(&mut table);
    let shape = kind.and_then(|read| read(&mut table));
    let (key, span) = (table.path.clone(), table.span.clone());
    // Which keys an object may have depends on its type: without one, none can be called unknown.
    if kind.is_some() {
        table.finish();
    }
    HittableDesc { name, material, shape, transform, index, key, span }
}

fn read_sphere(table: &mut Table<'_>) -> Option<ShapeDesc> {
    table.require("position", "3 numbers, the centre");
    table.require("radius", POSITIVE.expected);
    let position = table.vec3("position", &COORDINATE);
    let radius = table.number("radius", &POSITIVE);
    Some(ShapeDesc::Sphere(SphereDesc { position: position?.value, radius: radius? }))
}

fn read_quadric(table: &mut Table<'_>) -> Option<ShapeDesc> {
    table.require("A", "4 rows of 4 numbers");
    let (a, clip) = (table.rows4("A", &ENTRY), named_quadric::read_box(table));
    Some(ShapeDesc::Quadric(QuadricDesc { a: a?, clip }))
}

fn read_triangle(table: &mut Table<'_>) -> Option<ShapeDesc> {
    let corners = ["a", "b", "c"].map(|key| {
        table.require(key, THREE_NUMBERS);
        table.vec3(key, &COORDINATE)
    });
    let interpolate = table.flag("phong_interpolation");
    let normal_keys = ["n_a", "n_b", "n_c"];
    let any_normal = normal_keys.iter().any(|key| table.has(key));
    let normals = normal_keys.map(|key| {
        if any_normal || interpolate == Some(true) {
            table.require(key, "3 numbers: `phong_interpolation` needs `n_a`, `n_b` and `n_c`");
        }
        let normal = table.vec3(key, &COORDINATE)?;
        if normal.value == DVec3::ZERO {
            table.mistake(key, Problem::new(Place::default(), "a normal must not be zero"));
            return None;
        }
        Some(normal.value)
    });
    let wants_normals = any_normal && interpolate != Some(false);
    let normals = match normals {
        [Some(a), Some(b), Some(c)] if wants_normals => Some([a, b, c]),
        _ if wants_normals => return None,
        _ => None,
    };
    let [a, b, c] = corners;
    Some(ShapeDesc::Triangle(TriangleDesc { corners: [a?.value, b?.value, c?.value], normals }))
}

fn read_mesh(table: &mut Table<'_>) -> Option<ShapeDesc> {
    let from_text = table.has("vertices") || table.has("faces");
    if from_text && table.has("file_path") {
        let what = "a mesh has either `file_path` or `vertices` and `faces`, not both";
        table.mistake("file_path", Problem::new(Place::default(), what));
    }
    let file_path = table.string("file_path", "the path of a mesh file");
    let vertices = table.points("vertices", &COORDINATE);
    let faces =
        table.index_triples("faces", vertices.as_ref().map_or(u32::MAX as usize, |vertices| vertices.value.len()));
    let (normals, crease_angle_degrees) = read_normals(table, from_text);
    if from_text {
        table.require("vertices", "an array of points, each 3 numbers");
        table.require("faces", "an array of triangles, each 3 rows of `vertices`");
    } else {
        table.require("file_path", "a string, the mesh file");
    }
    let source = match (from_text, file_path) {
        (false, file_path) => MeshSource::File(file_path?),
        (true, Some(_)) => return None,
        (true, None) => MeshSource::Text { positions: vertices?.value, triangles: faces? },
    };
    Some(ShapeDesc::Mesh(MeshDesc { source, normals, crease_angle_degrees }))
}

/// `normals`, or `phong_interpolation` in its stead, and `crease_angle`.
fn read_normals(table: &mut Table<'_>, from_text: bool) -> (Option<NormalsKey>, Option<f64>) {
    let words = [
        ("file", NormalsKey::File),
        ("uniform", NormalsKey::Uniform),
        ("area", NormalsKey::Area),
        ("angle", NormalsKey::Angle),
        ("flat", NormalsKey::Flat),
    ];
    let phong_interpolation = table.flag("phong_interpolation");
    let normals = table.word("normals", &words);
    let crease_angle = table.number("crease_angle", &CREASE_ANGLE).map(|angle| angle.value);
    if table.has("normals") && table.has("phong_interpolation") {
        let what = "a mesh has either `normals` or `phong_interpolation`, not both";
        table.mistake("phong_interpolation", Problem::new(Place::default(), what));
    }
    if from_text && normals == Some(NormalsKey::File) {
        table
            .mistake("normals", Problem::new(Place::default(), "only a mesh with a `file_path` has normals in a file"));
    }
    let of_flag = |smooth| if smooth { NormalsKey::Uniform } else { NormalsKey::Flat };
    let normals = normals.or(phong_interpolation.map(of_flag));
    if crease_angle.is_some() && matches!(normals, Some(NormalsKey::File | NormalsKey::Flat)) {
        let what = "`crease_angle` is for normals that are made from the faces";
        let problem = Problem::new(Place::default(), what).expected("`normals` \"uniform\", \"area\" or \"angle\"");
        table.mistake("crease_angle", problem);
    }
    (normals, crease_angle)
}

/// A direction of any length but zero.
pub(super) fn read_direction(table: &mut Table<'_>, key: &'static str) -> Option<DVec3> {
    let direction = table.vec3(key, &COORDINATE)?.value;
    if direction == DVec3::ZERO {
        table.mistake(key, Problem::new(Place::default(), "a direction must not be zero"));
        return None;
    }
    Some(direction)
}

fn read_light(mut table: Table<'_>) -> Option<LightDesc> {
    let is_directional = table.word("type", &[("point", false), ("directional", true)]);
    let from = match is_directional {
        // A type that could not be read may be either: its keys are not called unknown.
        None if table.has("type") => {
            ["position", "direction"].into_iter().for_each(|key| table.ignore(key));
            None
        }
        None | Some(false) => {
            table.require("position", THREE_NUMBERS);
            table.vec3("position", &COORDINATE).map(|position| LightFrom::Position(position.value))
        }
        Some(true) => {
            table.require("direction", "3 numbers, the way the light travels");
            read_direction(&mut table, "direction").map(LightFrom::Direction)
        }
    };
    let intensity = table.number("intensity", &NON_NEGATIVE).map(|intensity| intensity.value);
    let color = table.vec3("color", &NON_NEGATIVE).map(|rgb| rgb.value);
    let group = read_group(&mut table);
    let (key, span) = (table.path.clone(), table.span.clone());
    table.finish();
    Some(LightDesc { from: from?, intensity, color, group, key, span })
}

/// The group of a light, whose name becomes a part of a layer's.
fn read_group(table: &mut Table<'_>) -> Option<String> {
    /// Names of channels end at 255 bytes.
    const MAX_LENGTH: usize = 100;
    let expected = "letters, digits, `_` and `-`, at most 100, and not \"ambient\", which holds what no light brings";
    let Spanned { value: group, .. } = table.string("group", expected)?;
    let is_fit = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if group == "ambient" || group.len() > MAX_LENGTH || !group.chars().all(is_fit) {
        let problem = Problem::new(Place::default(), "not a name for a group of lights").found(format!("\"{group}\""));
        table.mistake("group", problem.expected(expected));
        return None;
    }
    Some(group)
}
