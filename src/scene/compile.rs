//! From a description to flat tables. Names and paths end here.

use std::path::{Path, PathBuf};

use glam::{DMat4, DVec3};

use super::desc::{CameraDesc, LightDesc, LightFrom, PoseDesc, RenderDesc, SceneDesc};
use super::object::Objects;
use super::report::Report;
use super::validate;
use super::{Compiled, Names, Overrides, RenderKeys, UNGROUPED, keys};
use crate::error::{Error, Place, Problem};
use crate::world::{Camera, World};

/// Image size and field of view of a scene that does not say: those of the original's scenes.
const DEFAULT_SIZE_PX: u32 = 800;
const DEFAULT_FOV_Y_DEGREES: f64 = 90.0;

/// Where a scene is, for the files that it names.
#[derive(Clone, Debug)]
pub struct Base {
    /// Directory of the scene file; `None` for a text that is no file.
    pub directory: Option<PathBuf>,
    /// Whether faces that are there twice are looked for in meshes.
    pub find_duplicates: bool,
}

/// Compiles a text. `name` is what messages call it; mesh paths are relative to `base_dir` first and then to the
/// working directory.
///
/// # Errors
/// Everything that is wrong with the scene and the meshes it names.
pub fn load_text(text: &str, name: &str, base_dir: Option<&Path>, overrides: &Overrides) -> Result<Compiled, Error> {
    check_overrides(overrides)?;
    let report = Report::new(name, text);
    let scene = keys::read_scene(text, &report);
    let base = Base {
        directory: base_dir.map(Path::to_path_buf),
        find_duplicates: overrides.find_duplicates || overrides.strict,
    };
    let (world, camera, names) = compile_scene(&scene, overrides, &base, &report);
    let render = compile_render(&scene.render);
    let warnings = report.finish()?;
    // A scene without a mistake has a camera: `finish` has returned otherwise.
    let camera = camera.ok_or_else(|| Error::new(Place::file(name), "the camera could not be compiled"))?;
    Ok(Compiled { world, camera, render, names, warnings })
}

/// Refuses values of the command line that no scene may have either.
///
/// # Errors
/// For a side of 0 or too many pixels, and a field of view out of range.
pub fn check_overrides(overrides: &Overrides) -> Result<(), Error> {
    let wrong = |option: &str, found: String, expected: &str| {
        Problem::new(Place::default().with_key(option), "value out of range").found(found).expected(expected)
    };
    let (range, expected) = validate::SIDE_PX;
    let sides = [("--width", overrides.width_px), ("--height", overrides.height_px)];
    let mut problems: Vec<Problem> = sides
        .into_iter()
        .filter_map(|(option, side)| Some((option, side?)))
        .filter(|&(_, side)| !range.contains(&u64::from(side)))
        .map(|(option, side)| wrong(option, side.to_string(), expected))
        .collect();
    if let Some(fov) = overrides.fov_y_degrees.filter(|&fov| !(validate::FOV.holds)(fov)) {
        problems.push(wrong("--fov", fov.to_string(), validate::FOV.expected));
    }
    if problems.is_empty() { Ok(()) } else { Err(Error { problems }) }
}

fn compile_scene(
    scene: &SceneDesc,
    overrides: &Overrides,
    base: &Base,
    report: &Report,
) -> (World, Option<Camera>, Names) {
    let SceneDesc { camera, render, materials, prototypes, hittables, lights } = scene;
    let camera = compile_camera(camera, overrides, report);
    let mut world = World {
        background: render.background.unwrap_or(DVec3::ZERO),
        two_sided: render.two_sided.unwrap_or(false),
        ..World::default()
    };
    let mut objects = Objects::new(materials, base, &mut world, report);
    for prototype in prototypes {
        objects.add_prototype(prototype);
    }
    for hittable in hittables {
        objects.add(hittable);
    }
    let mut names = objects.names;
    for light in lights {
        add_light(light, &mut world, &mut names, report);
    }
    if hittables.is_empty() {
        report.warning(&(0..0), "", Problem::new(Place::default(), "the scene has no object ([[hittable]])"));
    }
    if lights.is_empty() {
        report.warning(&(0..0), "", Problem::new(Place::default(), "the scene has no light ([[light_source]])"));
    }
    (world, camera, names)
}

fn compile_render(render: &RenderDesc) -> RenderKeys {
    let RenderDesc {
        samples,
        sampler,
        filter,
        seed,
        max_depth,
        exposure_ev,
        tone_map,
        white_point,
        background: _,
        two_sided: _,
        terminator,
        ref aovs,
    } = *render;
    let aovs = aovs.clone();
    RenderKeys { samples, sampler, filter, seed, max_depth, exposure_ev, tone_map, white_point, terminator, aovs }
}

fn compile_camera(camera: &CameraDesc, overrides: &Overrides, report: &Report) -> Option<Camera> {
    let CameraDesc { pose, fov_y_degrees, width_px, height_px, span } = camera;
    let width_px = overrides.width_px.or(*width_px).unwrap_or(DEFAULT_SIZE_PX);
    let height_px = overrides.height_px.or(*height_px).unwrap_or(DEFAULT_SIZE_PX);
    if let Err(problem) = validate::image_size(width_px, height_px) {
        report.mistake(span, "camera", *problem);
    }
    let fov_y_degrees = overrides.fov_y_degrees.or(*fov_y_degrees).unwrap_or(DEFAULT_FOV_Y_DEGREES);
    let world_from_camera = match pose {
        None => DMat4::IDENTITY,
        Some(PoseDesc::Extrinsic(rows)) => match validate::world_from_camera(&rows.value) {
            Ok(frame) => frame,
            Err(problem) => {
                report.mistake(&rows.span, "camera.extrinsic", *problem);
                return None;
            }
        },
        Some(PoseDesc::LookAt { position, look_at, up }) => {
            let up_direction = up.as_ref().map_or(DVec3::Y, |up| up.value);
            let frame = look_at_frame(position.value, look_at.value, up_direction);
            if let Err((key, what, help)) = frame {
                let culprit =
                    if key == "up" { up.as_ref().map_or(&look_at.span, |up| &up.span) } else { &look_at.span };
                let problem = Problem::new(Place::default(), what).found(report.excerpt(culprit)).help(help);
                report.mistake(culprit, &format!("camera.{key}"), problem);
            }
            frame.ok()?
        }
    };
    Some(Camera { world_from_camera, fov_y_radians: fov_y_degrees.to_radians(), width_px, height_px })
}

/// The frame, or the key that prevents it, what is wrong, and advice.
pub(super) fn look_at_frame(
    position: DVec3,
    look_at: DVec3,
    up: DVec3,
) -> Result<DMat4, (&'static str, &'static str, &'static str)> {
    // Scaling leaves directions as they are, and squares of the largest coordinates within f64 anyway.
    if position == look_at {
        return Err(("look_at", "the camera looks at its own position", "give another point"));
    }
    if up == DVec3::ZERO {
        return Err(("up", "up must not be zero", "the default is [0, 1, 0]"));
    }
    let parallel = ("up", "the camera looks along its up direction", "give an `up` that is not parallel to the view");
    // The sine of the angle between two rounded directions is uncertain by some u; below 1e-12 the roll of the image
    // would hang on the last digits of the file.
    const LEAST_SINE: f64 = 1e-12;
    let back = (position - look_at).try_normalize().ok_or(parallel)?;
    let sine = up.try_normalize().ok_or(parallel)?.cross(back).length();
    if sine < LEAST_SINE {
        return Err(parallel);
    }
    Camera::look_at_frame(position, look_at, up).ok_or(parallel)
}

fn add_light(light: &LightDesc, world: &mut World, names: &mut Names, report: &Report) {
    let LightDesc { from, intensity, color, group, key, span } = light;
    let intensity = intensity.unwrap_or(1.0) * color.unwrap_or(DVec3::ONE);
    if intensity.max_element() > f64::from(f32::MAX) {
        let problem = Problem::new(Place::default(), "intensity times color is beyond the range of 32-bit floats");
        report.mistake(span, key, problem);
    }
    let group = names.light_group(group.as_deref().unwrap_or(UNGROUPED));
    match *from {
        LightFrom::Position(position) => world.lights.add_to(group, position, intensity),
        LightFrom::Direction(direction) => world.lights.add_directional_to(group, direction, intensity),
    }
}
