//! The documented format, the example scenes and the original's scenes are what the code accepts.

mod shared_data;

use std::path::{Path, PathBuf};

use flatray::scene::{Compiled, FilterKey, Overrides, SamplerKey, ToneMapKey, load, load_text};
use flatray::world::{MaterialId, ObjectId};
use glam::{DVec3, DVec4, Vec3};
use shared_data::shared;

const ROOT: &str = env!("CARGO_MANIFEST_DIR");

fn compile(text: &str) -> Compiled {
    let scenes = Path::new(ROOT).join("scenes");
    load_text(text, "test.toml", Some(&scenes), &Overrides::default()).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

fn document() -> String {
    std::fs::read_to_string(Path::new(ROOT).join("docs/SCENE_FORMAT.md")).unwrap()
}

fn scene_files(directory: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(directory).unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<PathBuf> = entries.filter(|path| path.extension().is_some_and(|e| e == "toml")).collect();
    files.sort();
    files
}

#[test]
fn every_toml_example_of_the_document_compiles() {
    let document = document();
    let examples: Vec<&str> =
        document.split("```toml\n").skip(1).map(|rest| rest.split("```").next().unwrap()).collect();
    assert!(examples.len() >= 9, "found only {}", examples.len());
    for example in examples {
        compile(example);
    }
}

#[test]
fn every_key_that_the_reader_knows_stands_in_the_document() {
    let text = "zzz = 1\n[camera]\nzzz = 1\n[render]\nzzz = 1\n[[material]]\nname = \"m\"\nzzz = 1\n[[light_source]]\nposition = [0, 0, 0]\nzzz = 1\n\
        [[hittable]]\ntype = \"sphere\"\nposition = [0, 0, 0]\nradius = 1\nzzz = 1\n\
        [[hittable]]\ntype = \"quadric\"\nA = [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,-1]]\nzzz = 1\n\
        [[hittable]]\ntype = \"triangle\"\na = [0,0,0]\nb = [1,0,0]\nc = [0,1,0]\nzzz = 1\n\
        [[light_source]]\ntype = \"directional\"\ndirection = [0, -1, 0]\nzzz = 1\n\
        [[hittable]]\ntype = \"ellipsoid\"\nposition = [0, 0, 0]\nradii = [1, 1, 1]\nzzz = 1\n\
        [[hittable]]\ntype = \"plane\"\nposition = [0, 0, 0]\nnormal = [0, 1, 0]\nzzz = 1\n\
        [[hittable]]\ntype = \"cylinder\"\nbase = [0, 0, 0]\ntop = [0, 1, 0]\nradius = 1\nzzz = 1\n\
        [[hittable]]\ntype = \"cone\"\nbase = [0, 0, 0]\ntop = [0, 1, 0]\nradius = 1\nzzz = 1\n\
        [[hittable]]\ntype = \"paraboloid\"\nbase = [0, 0, 0]\ntop = [0, 1, 0]\nradius = 1\nzzz = 1\n\
        [[hittable]]\ntype = \"hyperboloid\"\nbase = [0, 0, 0]\ntop = [0, 1, 0]\nradius = 1\nwaist = 1\nzzz = 1\n\
        [[hittable]]\ntype = \"mesh\"\nvertices = [[0,0,0],[1,0,0],[0,1,0]]\nfaces = [[0,1,2]]\nzzz = 1\n";
    let error = load_text(text, "test.toml", None, &Overrides::default()).unwrap_err();
    assert_eq!(error.problems.len(), 16, "{error}");
    let document = document();
    let mut n_keys = 0;
    for problem in &error.problems {
        let known = problem.help.as_deref().unwrap().strip_prefix("known here: ").unwrap();
        for key in known.split(", ") {
            let told = [format!("`{key}`"), format!("[{key}]")].iter().any(|form| document.contains(form));
            // `ambient` … `sh` stand once, under Materials.
            assert!(told, "{key} is not documented");
            n_keys += 1;
        }
    }
    assert!(n_keys > 150, "{n_keys}");
}

#[test]
fn every_example_scene_compiles_without_a_warning() {
    let files = scene_files(&Path::new(ROOT).join("scenes"));
    assert!(files.len() >= 12);
    for file in files {
        let compiled = load(&file, &Overrides::default()).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(compiled.warnings, [], "{}", file.display());
        assert!(compiled.world.n_prims() > 0 && !compiled.world.lights.is_empty(), "{}", file.display());
        let first_line = std::fs::read_to_string(&file).unwrap().lines().next().unwrap().to_owned();
        assert!(first_line.starts_with("# "), "{} says what it shows", file.display());
    }
}

#[test]
fn the_scenes_of_the_original_load_unchanged() {
    let Some(directory) = shared("seed/scenes") else { return };
    let expected =
        [("quadric", [0, 1, 0], 1), ("sphere", [1, 0, 0], 1), ("spheres", [7, 0, 1], 2), ("triangle", [0, 0, 1], 1)];
    for (name, counts, n_lights) in expected {
        let compiled = load(&directory.join(name).with_extension("toml"), &Overrides::default()).unwrap();
        let world = &compiled.world;
        assert_eq!([world.spheres.len(), world.quadrics.len(), world.triangles.len()], counts, "{name}");
        assert_eq!(world.lights.len(), n_lights, "{name}");
        assert_eq!(compiled.warnings, [], "{name}");
        assert_eq!((compiled.camera.width_px, compiled.camera.height_px), (800, 800));
        assert_eq!(compiled.camera.world_from_camera, glam::DMat4::IDENTITY);
        assert_eq!(compiled.camera.fov_y_radians, std::f64::consts::FRAC_PI_2);
    }
}

#[test]
fn an_empty_scene_has_the_documented_defaults_and_two_warnings() {
    let compiled = compile("");
    assert_eq!((compiled.camera.width_px, compiled.camera.height_px), (800, 800));
    assert_eq!(compiled.camera.fov_y_radians, std::f64::consts::FRAC_PI_2);
    assert_eq!(compiled.render, flatray::scene::RenderKeys::default());
    assert_eq!((compiled.world.background, compiled.world.two_sided), (DVec3::ZERO, false));
    let warnings: Vec<&str> = compiled.warnings.iter().map(|warning| warning.what.as_str()).collect();
    assert_eq!(warnings, ["the scene has no object ([[hittable]])", "the scene has no light ([[light_source]])"]);
}

#[test]
fn render_keys_background_and_light_colour_arrive() {
    let compiled = compile(
        "[render]\nsamples = 4\nsampler = \"grid\"\nseed = 0xffff_ffff\nmax_depth = 9\nexposure = -1\n\
         filter = \"blackman-harris\"\ntonemap = \"hable\"\nwhite_point = 7.5\n\
         background = [0.5, 1, 2]\ntwo_sided = true\nterminator = true\n[[light_source]]\nposition = [1, 2, 3]\nintensity = 2\ncolor = [1, 0.5, 0]",
    );
    let render = &compiled.render;
    assert_eq!((render.samples, render.sampler, render.seed), (Some(4), Some(SamplerKey::Grid), Some(0xffff_ffff)));
    assert_eq!((render.max_depth, render.exposure_ev), (Some(9), Some(-1.0)));
    assert_eq!(render.terminator, Some(true));
    assert_eq!(render.filter, Some(FilterKey::BlackmanHarris));
    assert_eq!((render.tone_map, render.white_point), (Some(ToneMapKey::Hable), Some(7.5)));
    assert_eq!((compiled.world.background, compiled.world.two_sided), (DVec3::new(0.5, 1.0, 2.0), true));
    assert_eq!(compiled.world.lights.intensities, [DVec3::new(2.0, 1.0, 0.0)]);
    assert_eq!(compiled.world.lights.positions, [DVec3::new(1.0, 2.0, 3.0)]);
}

#[test]
fn named_materials_and_objects_keep_their_names_and_ids() {
    let compiled = compile(
        "[[material]]\nname = \"red\"\ndiffuse = [1, 0, 0]\nk_d = 0.5\n\
         [[hittable]]\ntype = \"sphere\"\nposition = [0, 0, 0]\nradius = 1\nk_s = 0.25\n\
         [[hittable]]\nname = \"ball\"\ntype = \"sphere\"\nposition = [0, 0, 0]\nradius = 2\nmaterial = \"red\"",
    );
    assert_eq!(compiled.names.objects, ["sphere 0", "ball"]);
    assert_eq!(compiled.names.materials, ["red", "material of sphere 0"]);
    let spheres = &compiled.world.spheres;
    assert_eq!(spheres.materials, [MaterialId(1), MaterialId(0)]);
    assert_eq!(spheres.objects, [ObjectId(0), ObjectId(1)]);
    assert_eq!(compiled.world.materials.diffuse, [DVec3::new(0.5, 0.0, 0.0), DVec3::splat(0.8)]);
    assert_eq!(compiled.world.materials.reflectance, [0.0, 0.25]);
}

#[test]
fn transmittance_and_index_of_refraction_arrive_and_glass_is_a_feature() {
    let sphere = "[[hittable]]\ntype = \"sphere\"\nposition = [0, 0, 0]\nradius = 1\n";
    let compiled = compile(&format!("{sphere}k_t = 0.75\nior = 1.25\n{sphere}k_t = 0.5\n{sphere}"));
    assert_eq!(compiled.world.materials.transmittance, [0.75, 0.5, 0.0]);
    assert_eq!(compiled.world.materials.ior, [1.25, 1.5, 1.5]);
    assert!(compiled.world.features().refraction && !compile(sphere).world.features().refraction);
    let error = load_text(&format!("{sphere}k_t = -1\nior = 0"), "t.toml", None, &Overrides::default()).unwrap_err();
    assert_eq!(error.problems.len(), 2, "{error}");
}

#[test]
fn look_at_and_the_matching_extrinsic_are_the_same_camera() {
    let looking = compile("[camera]\nposition = [5, 0, 0]\nlook_at = [0, 0, 0]").camera.world_from_camera;
    // World→camera: +x comes to lie on +z, +z on −x; then 5 back. File rows are the images of x, y, z, and the shift.
    let rows = "[[0, 0, 1, 0], [0, 1, 0, 0], [-1, 0, 0, 0], [0, 0, -5, 1]]";
    let extrinsic = compile(&format!("[camera]\nextrinsic = {rows}")).camera.world_from_camera;
    assert!(looking.abs_diff_eq(extrinsic, 1e-15), "{looking}\n{extrinsic}");
    assert_eq!(looking * DVec4::W, DVec4::new(5.0, 0.0, 0.0, 1.0));
    assert!((looking * DVec4::NEG_Z).abs_diff_eq(DVec4::NEG_X, 1e-15), "looks along -x");
}

#[test]
fn overrides_replace_the_size_and_the_field_of_view() {
    let overrides =
        Overrides { width_px: Some(64), height_px: Some(32), fov_y_degrees: Some(60.0), ..Overrides::default() };
    let camera = load_text("[camera]\nwidth = 7\nheight = 8\nfov = 9", "t", None, &overrides).unwrap().camera;
    assert_eq!((camera.width_px, camera.height_px), (64, 32));
    assert!((camera.fov_y_radians - std::f64::consts::FRAC_PI_3).abs() < 1e-15);
}

#[test]
fn a_triangle_with_normals_is_smooth_unless_told_otherwise() {
    let triangle = "[[hittable]]\ntype = \"triangle\"\na = [0, 0, 0]\nb = [1, 0, 0]\nc = [0, 1, 0]\n";
    let normals = "n_a = [0, 0, 2]\nn_b = [0, 1, 0]\nn_c = [1, 0, 0]\n";
    assert_eq!(compile(triangle).world.meshes.first_normal, [None]);
    let smooth = compile(&format!("{triangle}{normals}")).world;
    assert_eq!(smooth.meshes.first_normal, [Some(0)]);
    assert_eq!(smooth.triangles.normals, [Vec3::Z, Vec3::Y * 0.5, Vec3::X * 0.5], "a common factor is taken out");
    let flat = compile(&format!("{triangle}{normals}phong_interpolation = false")).world;
    assert_eq!(flat.meshes.first_normal, [None]);
}

#[test]
fn a_skewed_quadric_is_symmetrised_with_a_warning_that_shows_the_entries() {
    let compiled = compile(
        "[[light_source]]\nposition = [0, 0, 0]\n[[hittable]]\ntype = \"quadric\"\n\
         A = [[1, 0.5, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, -1]]",
    );
    let warnings: Vec<String> = compiled.warnings.iter().map(ToString::to_string).collect();
    assert_eq!(
        warnings,
        ["test.toml:5:5: hittable[0].A: the matrix is not symmetric: the mean of both entries is used: \
          found A[0][1] = 0.5 and A[1][0] = 0"]
    );
}

#[test]
fn a_quadric_without_a_real_point_draws_a_warning() {
    let compiled = compile(
        "[[light_source]]\nposition = [0, 0, 0]\n[[hittable]]\ntype = \"quadric\"\n\
         A = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]",
    );
    assert_eq!(compiled.warnings.len(), 1);
    assert!(compiled.warnings[0].what.starts_with("no real point lies on this quadric"), "{}", compiled.warnings[0]);
}

#[test]
fn a_mesh_written_in_the_scene_gets_the_originals_smooth_normals() {
    let mesh = "[[hittable]]\ntype = \"mesh\"\nvertices = [[0, 0, 0], [0, 1, 0], [100, 0, 0], [0, 0, 1]]\n\
                faces = [[0, 2, 1], [0, 1, 3]]\n";
    let world = compile(mesh).world;
    let half = Vec3::new(1.0, 0.0, 1.0).normalize();
    assert!(world.triangles.normals[0].abs_diff_eq(half, 1e-6), "{}", world.triangles.normals[0]);
    assert_eq!(world.triangles.normals[2], Vec3::Z);
    assert_eq!(compile(&format!("{mesh}phong_interpolation = false")).world.triangles.normals, []);
}

#[test]
fn faces_that_no_ray_can_hit_are_left_out_with_a_count() {
    let compiled = compile(
        "[[light_source]]\nposition = [0, 0, 0]\n[[hittable]]\ntype = \"mesh\"\n\
         vertices = [[0, 0, 0], [1, 1, 1], [2, 2, 2], [0, 1, 0]]\nfaces = [[0, 1, 2], [0, 1, 3], [0, 0, 3]]",
    );
    assert_eq!(compiled.world.triangles.len(), 1);
    let warnings: Vec<String> = compiled.warnings.iter().map(ToString::to_string).collect();
    assert_eq!(warnings, ["test.toml: 2 faces without area left out (for hittable[0])"]);
}

#[test]
fn a_mesh_is_found_beside_its_scene_file() {
    let compiled = load(&Path::new(ROOT).join("scenes/mesh.toml"), &Overrides::default()).unwrap();
    assert_eq!(compiled.names.objects, ["icosahedron", "goblet", "floor"]);
    assert_eq!(compiled.world.meshes.first_normal, [None, Some(0)]);
    assert_eq!(compiled.world.meshes.first_triangle, [0, 20]);
}

#[test]
fn a_bare_mesh_is_framed_whole_with_its_margin_touched_from_both_axes_and_any_image_shape() {
    let path = Path::new(ROOT).join("scenes/icosahedron.ply");
    for (width_px, height_px) in [(1280, 720), (300, 900), (64, 64)] {
        for up in [flatray::scene::UpAxis::Y, flatray::scene::UpAxis::Z] {
            let overrides = Overrides {
                width_px: Some(width_px),
                height_px: Some(height_px),
                up: Some(up),
                ..Overrides::default()
            };
            let compiled = load(&path, &overrides).unwrap();
            let camera = compiled.camera;
            let camera_from_world = camera.world_from_camera.inverse();
            let tan_y = (0.5 * camera.fov_y_radians).tan();
            let tan_x = tan_y * f64::from(width_px) / f64::from(height_px);
            let (mut extent_x, mut extent_y) = (0.0_f64, 0.0_f64);
            for position in &compiled.world.triangles.positions {
                let p = camera_from_world.transform_point3(position.as_dvec3());
                assert!(p.z < 0.0, "in front of the camera");
                extent_x = extent_x.max((p.x / -p.z / tan_x).abs());
                extent_y = extent_y.max((p.y / -p.z / tan_y).abs());
            }
            let tightest = extent_x.max(extent_y);
            assert!((tightest - 0.92).abs() < 1e-6, "{width_px}x{height_px}: {extent_x} {extent_y}");
            let view_up = camera.world_from_camera * DVec4::Y;
            assert!(view_up.truncate().dot(up.direction()) > 0.9, "{up:?} is up");
            assert_eq!(compiled.world.lights.len(), 2);
            assert!(compiled.world.two_sided);
            assert_eq!(compiled.world.meshes.first_normal, [None], "hard edges stay hard");
        }
    }
}

#[test]
fn a_curved_bare_mesh_is_smooth_and_carries_its_files_name() {
    let compiled = load(&Path::new(ROOT).join("scenes/goblet.obj"), &Overrides::default()).unwrap();
    assert_eq!(compiled.world.meshes.first_normal, [Some(0)]);
    assert_eq!(compiled.names.objects, ["goblet"]);
    assert_eq!((compiled.camera.width_px, compiled.camera.height_px), (1280, 720));
}
