//! Bad scenes and exactly what is said about them.

use std::path::Path;

use flatray::scene::{Overrides, UpAxis, load, load_text};

struct Case {
    name: &'static str,
    scene: &'static str,
    told: &'static [&'static str],
}

#[test]
fn every_bad_scene_is_refused_with_exactly_these_words() {
    let mut wrong = String::new();
    for Case { name, scene, told } in CASES {
        let said = match load_text(scene, "s.toml", Some(Path::new("scenes")), &Overrides::default()) {
            Ok(_) => vec!["(no mistake found)".to_owned()],
            Err(error) => error.problems.iter().map(ToString::to_string).collect(),
        };
        if said != *told {
            wrong.push_str(&format!("{name}:\n  told     {told:#?}\n  but said {said:#?}\n"));
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
}

#[test]
fn every_problem_points_at_the_bytes_that_it_names() {
    for Case { name, scene, .. } in CASES {
        let error = load_text(scene, "s.toml", None, &Overrides::default()).unwrap_err();
        for problem in &error.problems {
            let range = problem.place.byte_range.clone().unwrap();
            assert!(scene.get(range).is_some(), "{name}: {problem}");
            assert_eq!(problem.place.text.as_deref(), Some(*scene), "{name}");
        }
        let starts: Vec<usize> = error.problems.iter().map(|p| p.place.byte_range.clone().unwrap().start).collect();
        assert!(starts.is_sorted(), "{name}: in the order of the file");
    }
}

#[test]
fn a_broken_mesh_is_told_together_with_the_other_mistakes_of_its_scene() {
    let directory = tempfile::tempdir().unwrap();
    std::fs::write(directory.path().join("broken.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 7\n").unwrap();
    let scene =
        "[camera]\nfov = -1\n[[hittable]]\ntype = \"mesh\"\nfile_path = \"broken.obj\"\n[render]\nsamples = 0\n";
    let file = directory.path().join("scene.toml");
    std::fs::write(&file, scene).unwrap();
    let error = load(&file, &Overrides::default()).unwrap_err();
    assert_eq!(error.problems.len(), 3, "{error}");
    let mesh = &error.problems[1];
    assert_eq!(mesh.place.file.as_deref(), Some(directory.path().join("broken.obj").as_path()));
    assert_eq!(mesh.place.line, Some(4), "{mesh}");
    assert!(mesh.help.as_deref().is_some_and(|help| help.ends_with("for hittable[0]")), "{mesh}");
    assert_eq!((error.problems[0].place.line, error.problems[2].place.line), (Some(2), Some(7)));
}

#[test]
fn files_that_are_no_scene_are_refused_before_anything_else() {
    let directory = tempfile::tempdir().unwrap();
    let refused = |name: &str, bytes: &[u8]| {
        let path = directory.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        load(&path, &Overrides::default()).unwrap_err().problems.remove(0)
    };
    let unknown = refused("scene.json", b"{}");
    assert_eq!(unknown.what, "not a kind of file that can be rendered");
    let binary = refused("scene.toml", b"a = 1\n\xff\n");
    assert_eq!((binary.what.as_str(), binary.place.byte_offset), ("not UTF-8 text", Some(6)));
    assert_eq!(binary.found.as_deref(), Some("byte 0xff"));
    let missing = load(&directory.path().join("none.toml"), &Overrides::default()).unwrap_err();
    assert!(missing.to_string().contains("cannot read the scene"), "{missing}");
    let empty = refused("empty.obj", b"# nothing\n");
    assert_eq!(empty.what, "nothing to show: the mesh has no triangle with an area");
    let flat = refused("flat.obj", b"v 0 0 0\nv 1 1 1\nv 2 2 2\nf 1 2 3\n");
    assert_eq!(flat.what, "nothing to show: the mesh has no triangle with an area");
}

#[test]
fn values_of_the_command_line_are_refused_by_their_option() {
    let overrides = Overrides {
        width_px: Some(0),
        height_px: Some(70_000),
        fov_y_degrees: Some(f64::NAN),
        up: Some(UpAxis::Z),
        ..Overrides::default()
    };
    let error = load_text("", "s.toml", None, &overrides).unwrap_err();
    assert_eq!(
        error.to_string(),
        "--width: value out of range: found 0, expected a whole number of pixels from 1 to 65535\n\
         --height: value out of range: found 70000, expected a whole number of pixels from 1 to 65535\n\
         --fov: value out of range: found NaN, expected degrees above 0 and below 180"
    );
}

#[test]
fn hostile_texts_are_refused_quickly_and_without_a_crash() {
    let deep = format!("a = {}", "[".repeat(1_000_000));
    let noise: String = (0..200_000).map(|i| if i % 3 == 0 { "= [\n" } else { "x = nan]\n" }).collect();
    let unknown: String = (0..100_000).map(|i| format!("key{i} = {i}\n")).collect();
    let long_word = format!("{} = 1", "k".repeat(1_000_000));
    for (text, n_least) in [(&deep, 1), (&noise, 51), (&unknown, 51), (&long_word, 1)] {
        let error = load_text(text, "s.toml", None, &Overrides::default()).unwrap_err();
        assert!((n_least..=51).contains(&error.problems.len()), "{}", error.problems.len());
    }
}

#[rustfmt::skip]
const CASES: &[Case] = &[
    Case { name: "an unknown table",
        scene: "[[hittables]]\ntype = \"sphere\"\n",
        told: &["s.toml:1:3: hittables: unknown key (did you mean `hittable`?)"] },
    Case { name: "an unknown light table",
        scene: "[[lights]]\nposition = [0, 0, 0]\n",
        told: &["s.toml:1:3: lights: unknown key (did you mean `light_source`?)"] },
    Case { name: "an unknown layer",
        scene: "[render]\naov = [\"Z\", \"difuse\"]\n",
        told: &["s.toml:2:13: render.aov: unknown aov: found \"difuse\", expected \"all\", \"lobes\", \"ambient\", \"diffuse\", \"specular\", \"reflection\", \"refraction\", \"background\", \"lights\", \"albedo\", \"Z\", \"P\", \"N\", \"Ng\", \"uv\", \"object\", \"material\", \"samples\", \"cryptomatte\", \"CryptoObject\", \"CryptoMaterial\" or \"cost\" (did you mean \"diffuse\"?)"] },
    Case { name: "layers that are no array",
        scene: "[render]\naov = \"Z\"\n",
        told: &["s.toml:2:7: render.aov: wrong type: found the string \"Z\", expected an array of \"all\", \"lobes\", \"ambient\", \"diffuse\", \"specular\", \"reflection\", \"refraction\", \"background\", \"lights\", \"albedo\", \"Z\", \"P\", \"N\", \"Ng\", \"uv\", \"object\", \"material\", \"samples\", \"cryptomatte\", \"CryptoObject\", \"CryptoMaterial\" or \"cost\""] },
    Case { name: "a group of lights that cannot be a layer",
        scene: "[[light_source]]\nposition = [0, 0, 0]\ngroup = \"key.left\"\n",
        told: &["s.toml:3:9: light_source[0].group: not a name for a group of lights: found \"key.left\", expected letters, digits, `_` and `-`, at most 100, and not \"ambient\", which holds what no light brings"] },
    Case { name: "a group of lights that is one already",
        scene: "[[light_source]]\nposition = [0, 0, 0]\ngroup = \"ambient\"\n",
        told: &["s.toml:3:9: light_source[0].group: not a name for a group of lights: found \"ambient\", expected letters, digits, `_` and `-`, at most 100, and not \"ambient\", which holds what no light brings"] },
    Case { name: "an unknown key at the top",
        scene: "widht = 3\n",
        told: &["s.toml:1:1: widht: unknown key (known here: camera, render, material, prototype, hittable, light_source)"] },
    Case { name: "an unknown key of a sphere",
        scene: "[[hittable]]\ntype = \"sphere\"\nposition = [0, 0, 0]\nraduis = 1\nradius = 1\n",
        told: &["s.toml:4:1: hittable[0].raduis: unknown key (did you mean `radius`?)"] },
    Case { name: "an unknown key of the camera",
        scene: "[camera]\nfvo = 3\n",
        told: &["s.toml:2:1: camera.fvo: unknown key (did you mean `fov`?)"] },
    Case { name: "an unknown key near nothing",
        scene: "[render]\nqqqqqq = 3\n",
        told: &["s.toml:2:1: render.qqqqqq: unknown key (known here: samples, sampler, filter, seed, max_depth, exposure, tonemap, white_point, background, two_sided, terminator, aov)"] },
    Case { name: "an unknown tone curve and an unknown filter",
        scene: "[render]\ntonemap = \"aces\"\nwhite_point = 4\nfilter = \"gauss\"\n",
        told: &["s.toml:2:11: render.tonemap: unknown tonemap: found \"aces\", expected \"clip\", \"reinhard\", \"hable\", \"aces-hill\", \"khronos-neutral\" or \"agx-approx\" (did you mean \"aces-hill\"?)",
            "s.toml:4:10: render.filter: unknown filter: found \"gauss\", expected \"box\", \"triangle\", \"gaussian\" or \"blackman-harris\" (did you mean \"gaussian\"?)"] },
    Case { name: "a white point for an operator that has none",
        scene: "[render]\ntonemap = \"agx-approx\"\nwhite_point = 4\n",
        told: &["s.toml:3:15: render.white_point: a `white_point` goes with `tonemap = \"reinhard\"` or `\"hable\"`: other operators have none"] },
    Case { name: "a white point for the operator that is there when none is named",
        scene: "[render]\nwhite_point = 0\n",
        told: &["s.toml:2:15: render.white_point: value out of range: found 0, expected a radiance from 1e-6 to 1e6"] },
    Case { name: "a key of another type of object",
        scene: "[[hittable]]\ntype = \"sphere\"\nposition = [0, 0, 0]\nradius = 1\nfile_path = \"a.ply\"\n",
        told: &["s.toml:5:1: hittable[0].file_path: unknown key (known here: type, name, ambient, diffuse, specular, k_a, k_d, k_s, sh, k_t, ior, material, scale, rotate, translate, world_from_object, position, radius)"] },
    Case { name: "an unknown type of object",
        scene: "[[hittable]]\ntype = \"shpere\"\n",
        told: &["s.toml:2:8: hittable[0].type: unknown type: found \"shpere\", expected \"sphere\", \"quadric\", \"triangle\", \"mesh\", \"instance\", \"ellipsoid\", \"plane\", \"cylinder\", \"cone\", \"paraboloid\" or \"hyperboloid\" (did you mean \"sphere\"?)"] },
    Case { name: "a type that is no string",
        scene: "[[hittable]]\ntype = 3\n",
        told: &["s.toml:2:8: hittable[0].type: wrong type: found the number 3, expected \"sphere\", \"quadric\", \"triangle\", \"mesh\", \"instance\", \"ellipsoid\", \"plane\", \"cylinder\", \"cone\", \"paraboloid\" or \"hyperboloid\""] },
    Case { name: "a missing type",
        scene: "[[hittable]]\nradius = 1\n",
        told: &["s.toml:1:1: hittable[0].type: missing key: expected \"sphere\", \"quadric\", \"triangle\", \"mesh\", \"instance\", \"ellipsoid\", \"plane\", \"cylinder\", \"cone\", \"paraboloid\" or \"hyperboloid\""] },
    Case { name: "a missing radius",
        scene: "[[hittable]]\ntype = \"sphere\"\nposition = [0, 0, 0]\n",
        told: &["s.toml:1:1: hittable[0].radius: missing key: expected a number above 0, at most 3.4e38"] },
    Case { name: "a missing position",
        scene: "[[hittable]]\ntype = \"sphere\"\nradius = 1\n",
        told: &["s.toml:1:1: hittable[0].position: missing key: expected 3 numbers, the centre"] },
    Case { name: "a missing matrix",
        scene: "[[hittable]]\ntype = \"quadric\"\n",
        told: &["s.toml:1:1: hittable[0].A: missing key: expected 4 rows of 4 numbers"] },
    Case { name: "a missing corner",
        scene: "[[hittable]]\ntype = \"triangle\"\na = [0, 0, 0]\nb = [1, 0, 0]\n",
        told: &["s.toml:1:1: hittable[0].c: missing key: expected 3 numbers"] },
    Case { name: "a missing mesh path",
        scene: "[[hittable]]\ntype = \"mesh\"\n",
        told: &["s.toml:1:1: hittable[0].file_path: missing key: expected a string, the mesh file"] },
    Case { name: "a missing light position",
        scene: "[[light_source]]\nintensity = 1\n",
        told: &["s.toml:1:1: light_source[0].position: missing key: expected 3 numbers"] },
    Case { name: "a word where a number is meant",
        scene: "[[hittable]]\ntype = \"sphere\"\nposition = [0, 0, 0]\nradius = \"big\"\n",
        told: &["s.toml:4:10: hittable[0].radius: wrong type: found the string \"big\", expected a number above 0, at most 3.4e38"] },
    Case { name: "a flag where a number is meant",
        scene: "[[hittable]]\ntype = \"sphere\"\nposition = [0, 0, 0]\nradius = true\n",
        told: &["s.toml:4:10: hittable[0].radius: wrong type: found true, expected a number above 0, at most 3.4e38"] },
    Case { name: "an array where a number is meant",
        scene: "[[hittable]]\ntype = \"sphere\"\nposition = [0, 0, 0]\nradius = [1]\n",
        told: &["s.toml:4:10: hittable[0].radius: wrong type: found the array [1], expected a number above 0, at most 3.4e38"] },
    Case { name: "a date where a number is meant",
        scene: "[[hittable]]\ntype = \"sphere\"\nposition = [0, 0, 0]\nradius = 2026-01-01\n",
        told: &["s.toml:4:10: hittable[0].radius: wrong type: found the date 2026-01-01, expected a number above 0, at most 3.4e38"] },
    Case { name: "a number where an array is meant",
        scene: "[[light_source]]\nposition = 3\n",
        told: &["s.toml:2:12: light_source[0].position: wrong type: found the number 3, expected 3 numbers"] },
    Case { name: "two numbers where three are meant",
        scene: "[[light_source]]\nposition = [1, 2]\n",
        told: &["s.toml:2:12: light_source[0].position: wrong length: found 2, expected 3 numbers"] },
    Case { name: "a word inside a point",
        scene: "[[light_source]]\nposition = [1, \"two\", 3]\n",
        told: &["s.toml:2:16: light_source[0].position[1]: wrong type: found the string \"two\", expected a number within ±3.4e38 (32-bit range)"] },
    Case { name: "a number where a flag is meant",
        scene: "[render]\ntwo_sided = 1\n",
        told: &["s.toml:2:13: render.two_sided: wrong type: found the number 1, expected true or false"] },
    Case { name: "a table where many are meant",
        scene: "[hittable]\ntype = \"sphere\"\n",
        told: &["s.toml:1:1: hittable: wrong type: found a table, expected tables, each under [[hittable]]"] },
    Case { name: "many tables where one is meant",
        scene: "[[camera]]\nfov = 3\n",
        told: &["s.toml:1:1: camera: wrong type: found the array [[camera]], expected a table, [camera]"] },
    Case { name: "a negative radius",
        scene: "[[hittable]]\ntype = \"sphere\"\nposition = [0, 0, 0]\nradius = -1\n",
        told: &["s.toml:4:10: hittable[0].radius: value out of range: found -1, expected a number above 0, at most 3.4e38"] },
    Case { name: "a zero radius",
        scene: "[[hittable]]\ntype = \"sphere\"\nposition = [0, 0, 0]\nradius = 0\n",
        told: &["s.toml:4:10: hittable[0].radius: value out of range: found 0, expected a number above 0, at most 3.4e38"] },
    Case { name: "a nan radius",
        scene: "[[hittable]]\ntype = \"sphere\"\nposition = [0, 0, 0]\nradius = nan\n",
        told: &["s.toml:4:10: hittable[0].radius: not a finite number: found nan, expected a number above 0, at most 3.4e38"] },
    Case { name: "an infinite radius",
        scene: "[[hittable]]\ntype = \"sphere\"\nposition = [0, 0, 0]\nradius = inf\n",
        told: &["s.toml:4:10: hittable[0].radius: not a finite number: found inf, expected a number above 0, at most 3.4e38"] },
    Case { name: "a radius that overflows",
        scene: "[[hittable]]\ntype = \"sphere\"\nposition = [0, 0, 0]\nradius = 1e999\n",
        told: &["s.toml:4:10: hittable[0].radius: not a finite number: found 1e999, expected a number above 0, at most 3.4e38"] },
    Case { name: "a nan coordinate",
        scene: "[[light_source]]\nposition = [0, nan, -inf]\n",
        told: &[
            "s.toml:2:16: light_source[0].position[1]: not a finite number: found nan, expected a number within ±3.4e38 (32-bit range)",
            "s.toml:2:21: light_source[0].position[2]: not a finite number: found -inf, expected a number within ±3.4e38 (32-bit range)",
        ] },
    Case { name: "a coordinate beyond 32 bits",
        scene: "[[light_source]]\nposition = [1e39, 0, 0]\n",
        told: &["s.toml:2:13: light_source[0].position[0]: value out of range: found 1e39, expected a number within ±3.4e38 (32-bit range)"] },
    Case { name: "a sphere that leaves the 32 bit range",
        scene: "[[hittable]]\ntype = \"sphere\"\nposition = [3e38, 0, 0]\nradius = 1e38\n",
        told: &["s.toml:4:10: hittable[0].radius: the sphere reaches beyond the range of 32-bit floats: found 1e38, expected position ± radius within ±3.4e38"] },
    Case { name: "a negative intensity",
        scene: "[[light_source]]\nposition = [0, 0, 0]\nintensity = -0.5\n",
        told: &["s.toml:3:13: light_source[0].intensity: value out of range: found -0.5, expected a number from 0 to 3.4e38"] },
    Case { name: "a negative colour",
        scene: "[[hittable]]\ntype = \"sphere\"\nposition = [0, 0, 0]\nradius = 1\ndiffuse = [0, -1, 0]\n",
        told: &["s.toml:5:15: hittable[0].diffuse[1]: value out of range: found -1, expected a number from 0 to 3.4e38"] },
    Case { name: "a negative exponent",
        scene: "[[hittable]]\ntype = \"sphere\"\nposition = [0, 0, 0]\nradius = 1\nsh = -1\n",
        told: &["s.toml:5:6: hittable[0].sh: value out of range: found -1, expected a number from 0 to 3.4e38"] },
    Case { name: "a colour times weight that overflows",
        scene: "[[hittable]]\ntype = \"sphere\"\nposition = [0, 0, 0]\nradius = 1\ndiffuse = [1e38, 0, 0]\nk_d = 100\n",
        told: &["s.toml:1:1: hittable[0]: a colour times its weight is beyond the range of 32-bit floats"] },
    Case { name: "a light that overflows",
        scene: "[[light_source]]\nposition = [0, 0, 0]\nintensity = 1e30\ncolor = [1e30, 0, 0]\n",
        told: &["s.toml:1:1: light_source[0]: intensity times color is beyond the range of 32-bit floats"] },
    Case { name: "a field of view of 180",
        scene: "[camera]\nfov = 180\n",
        told: &["s.toml:2:7: camera.fov: value out of range: found 180, expected degrees above 0 and below 180"] },
    Case { name: "a field of view of 0",
        scene: "[camera]\nfov = 0\n",
        told: &["s.toml:2:7: camera.fov: value out of range: found 0, expected degrees above 0 and below 180"] },
    Case { name: "a zero width",
        scene: "[camera]\nwidth = 0\n",
        told: &["s.toml:2:9: camera.width: value out of range: found 0, expected a whole number of pixels from 1 to 65535"] },
    Case { name: "a fractional height",
        scene: "[camera]\nheight = 10.5\n",
        told: &["s.toml:2:10: camera.height: wrong type: found the number 10.5, expected a whole number of pixels from 1 to 65535"] },
    Case { name: "a width beyond 65535",
        scene: "[camera]\nwidth = 65536\n",
        told: &["s.toml:2:9: camera.width: value out of range: found 65536, expected a whole number of pixels from 1 to 65535"] },
    Case { name: "an image of too many pixels",
        scene: "[camera]\nwidth = 65535\nheight = 65535\n",
        told: &["s.toml:1:1: camera: the image is too large: found 65535 x 65535 = 4294836225 pixels, expected at most 2147483648 pixels"] },
    Case { name: "a singular extrinsic",
        scene: "[camera]\nextrinsic = [[1, 2, 3, 0], [4, 5, 6, 0], [7, 8, 9, 0], [0, 0, 0, 1]]\n",
        told: &["s.toml:2:13: camera.extrinsic: not invertible: found a singular matrix, expected a matrix with three independent axes"] },
    Case { name: "a transposed extrinsic",
        scene: "[camera]\nextrinsic = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, -5], [0, 0, 0, 1]]\n",
        told: &["s.toml:2:13: camera.extrinsic: not an affine transform: the last numbers of the 4 rows are wrong: found 0, 0, -5, 1, expected 0, 0, 0, 1 (row i of the file is column i of the matrix, so the translation is the last row)"] },
    Case { name: "a short row of the extrinsic",
        scene: "[camera]\nextrinsic = [[1, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n",
        told: &["s.toml:2:14: camera.extrinsic[0]: wrong length: found 3, expected 4 numbers"] },
    Case { name: "three rows of the extrinsic",
        scene: "[camera]\nextrinsic = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]]\n",
        told: &["s.toml:2:13: camera.extrinsic: wrong length: found 3, expected 4 rows of 4 numbers"] },
    Case { name: "both extrinsic and position",
        scene: "[camera]\nposition = [0, 0, 0]\nextrinsic = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n",
        told: &["s.toml:2:12: camera.position: a camera has either `extrinsic` or `position`, `look_at` and `up`, not both"] },
    Case { name: "a position without look at",
        scene: "[camera]\nposition = [0, 0, 1]\n",
        told: &["s.toml:1:1: camera.look_at: missing key: expected 3 numbers, the point to look at, beside the other keys of the pose"] },
    Case { name: "a camera that looks at itself",
        scene: "[camera]\nposition = [1, 2, 3]\nlook_at = [1, 2, 3]\n",
        told: &["s.toml:3:11: camera.look_at: the camera looks at its own position: found [1, 2, 3] (give another point)"] },
    Case { name: "a camera that looks straight up",
        scene: "[camera]\nposition = [0, 0, 0]\nlook_at = [0, 5, 0]\n",
        told: &["s.toml:3:11: camera.up: the camera looks along its up direction: found [0, 5, 0] (give an `up` that is not parallel to the view)"] },
    Case { name: "a zero up",
        scene: "[camera]\nposition = [0, 0, 0]\nlook_at = [0, 0, 5]\nup = [0, 0, 0]\n",
        told: &["s.toml:4:6: camera.up: up must not be zero: found [0, 0, 0] (the default is [0, 1, 0])"] },
    Case { name: "an all zero quadric",
        scene: "[[hittable]]\ntype = \"quadric\"\nA = [[0, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, 0]]\n",
        told: &["s.toml:3:5: hittable[0].A: not a surface: found all zero, expected a coefficient other than A[3][3] that is not 0"] },
    Case { name: "a quadric of only a constant",
        scene: "[[hittable]]\ntype = \"quadric\"\nA = [[0, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, 2]]\n",
        told: &["s.toml:3:5: hittable[0].A: not a surface: found only a constant: no point fulfils it, expected a coefficient other than A[3][3] that is not 0"] },
    Case { name: "a quadric that symmetrises to nothing",
        scene: "[[hittable]]\ntype = \"quadric\"\nA = [[0, 1, 0, 0], [-1, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, 0]]\n",
        told: &["s.toml:3:5: hittable[0].A: not a surface: found all zero, expected a coefficient other than A[3][3] that is not 0"] },
    Case { name: "a nan in a matrix",
        scene: "[[hittable]]\ntype = \"quadric\"\nA = [[1, 0, 0, 0], [0, nan, 0, 0], [0, 0, 1, 0], [0, 0, 0, -1]]\n",
        told: &["s.toml:3:24: hittable[0].A[1][1]: not a finite number: found nan, expected a number within ±3.4e38 (32-bit range)"] },
    Case { name: "one normal of three",
        scene: "[[hittable]]\ntype = \"triangle\"\na = [0, 0, 0]\nb = [1, 0, 0]\nc = [0, 1, 0]\nn_a = [0, 0, 1]\n",
        told: &[
            "s.toml:1:1: hittable[0].n_b: missing key: expected 3 numbers: `phong_interpolation` needs `n_a`, `n_b` and `n_c`",
            "s.toml:1:1: hittable[0].n_c: missing key: expected 3 numbers: `phong_interpolation` needs `n_a`, `n_b` and `n_c`",
        ] },
    Case { name: "interpolation without normals",
        scene: "[[hittable]]\ntype = \"triangle\"\na = [0, 0, 0]\nb = [1, 0, 0]\nc = [0, 1, 0]\nphong_interpolation = true\n",
        told: &[
            "s.toml:1:1: hittable[0].n_a: missing key: expected 3 numbers: `phong_interpolation` needs `n_a`, `n_b` and `n_c`",
            "s.toml:1:1: hittable[0].n_b: missing key: expected 3 numbers: `phong_interpolation` needs `n_a`, `n_b` and `n_c`",
            "s.toml:1:1: hittable[0].n_c: missing key: expected 3 numbers: `phong_interpolation` needs `n_a`, `n_b` and `n_c`",
        ] },
    Case { name: "a zero normal",
        scene: "[[hittable]]\ntype = \"triangle\"\na = [0, 0, 0]\nb = [1, 0, 0]\nc = [0, 1, 0]\nn_a = [0, 0, 1]\nn_b = [0, 0, 0]\nn_c = [0, 0, 1]\n",
        told: &["s.toml:7:7: hittable[0].n_b: a normal must not be zero"] },
    Case { name: "a material that is not there",
        scene: "[[material]]\nname = \"brass\"\n[[hittable]]\ntype = \"sphere\"\nposition = [0, 0, 0]\nradius = 1\nmaterial = \"bras\"\n",
        told: &["s.toml:7:12: hittable[0].material: unknown material: found \"bras\" (did you mean \"brass\"?)"] },
    Case { name: "a material where none is",
        scene: "[[hittable]]\ntype = \"sphere\"\nposition = [0, 0, 0]\nradius = 1\nmaterial = \"brass\"\n",
        told: &["s.toml:5:12: hittable[0].material: unknown material: found \"brass\" (the scene has no [[material]])"] },
    Case { name: "a material beside material keys",
        scene: "[[material]]\nname = \"brass\"\n[[hittable]]\ntype = \"sphere\"\nposition = [0, 0, 0]\nradius = 1\nmaterial = \"brass\"\nk_d = 1\n",
        told: &["s.toml:8:7: hittable[0].k_d: an object has either `material` or material keys of its own, not both"] },
    Case { name: "two materials of one name",
        scene: "[[material]]\nname = \"brass\"\n[[material]]\nname = \"brass\"\n",
        told: &["s.toml:4:8: material[1].name: a material of this name exists already: found \"brass\""] },
    Case { name: "a material without a name",
        scene: "[[material]]\nk_a = 1\n",
        told: &["s.toml:1:1: material[0].name: missing key: expected a string, the name that objects refer to"] },
    Case { name: "an empty name",
        scene: "[[hittable]]\ntype = \"sphere\"\nposition = [0, 0, 0]\nradius = 1\nname = \"\"\n",
        told: &["s.toml:5:8: hittable[0].name: value out of range: found \"\", expected a name that is not empty"] },
    Case { name: "an unknown sampler",
        scene: "[render]\nsampler = \"jiter\"\n",
        told: &["s.toml:2:11: render.sampler: unknown sampler: found \"jiter\", expected \"center\", \"grid\", \"jitter\", \"random\" or \"sobol\" (did you mean \"jitter\"?)"] },
    Case { name: "zero samples",
        scene: "[render]\nsamples = 0\n",
        told: &["s.toml:2:11: render.samples: value out of range: found 0, expected a whole number from 1 to 65536"] },
    Case { name: "a negative seed",
        scene: "[render]\nseed = -1\n",
        told: &["s.toml:2:8: render.seed: value out of range: found -1, expected a whole number from 0 to 18446744073709551615"] },
    Case { name: "a zero depth",
        scene: "[render]\nmax_depth = 0\n",
        told: &["s.toml:2:13: render.max_depth: value out of range: found 0, expected a whole number from 1 to 1000"] },
    Case { name: "a missing mesh",
        scene: "[[hittable]]\ntype = \"mesh\"\nfile_path = \"no_such_file.ply\"\n",
        told: &["s.toml:3:13: hittable[0].file_path: mesh file not found: found \"no_such_file.ply\" (tried scenes/no_such_file.ply and no_such_file.ply)"] },
    Case { name: "a face that names no vertex",
        scene: "[[hittable]]\ntype = \"mesh\"\nvertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]\nfaces = [[0, 1, 3]]\n",
        told: &["s.toml:4:17: hittable[0].faces[0][2]: index out of range: found 3, expected a row of `vertices`, 0 to 2"] },
    Case { name: "a mesh from two places",
        scene: "[[hittable]]\ntype = \"mesh\"\nfile_path = \"a.ply\"\nvertices = [[0, 0, 0]]\nfaces = []\n",
        told: &["s.toml:3:13: hittable[0].file_path: a mesh has either `file_path` or `vertices` and `faces`, not both"] },
    Case { name: "faces without vertices",
        scene: "[[hittable]]\ntype = \"mesh\"\nfaces = [[0, 1, 2]]\n",
        told: &["s.toml:1:1: hittable[0].vertices: missing key: expected an array of points, each 3 numbers"] },
    Case { name: "a scale of 0",
        scene: "[[hittable]]\ntype = \"sphere\"\nposition = [0, 0, 0]\nradius = 1\nscale = [1, 0, 1]\n",
        told: &["s.toml:5:13: hittable[0].scale[1]: value out of range: found 0, expected a number other than 0, within ±3.4e38"] },
    Case { name: "a scale in words",
        scene: "[[hittable]]\ntype = \"sphere\"\nposition = [0, 0, 0]\nradius = 1\nscale = \"double\"\n",
        told: &["s.toml:5:9: hittable[0].scale: wrong type: found the string \"double\", expected a number other than 0, within ±3.4e38"] },
    Case { name: "a matrix beside a translation",
        scene: "[[hittable]]\ntype = \"sphere\"\nposition = [0, 0, 0]\nradius = 1\ntranslate = [1, 2, 3]\nworld_from_object = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]]\n",
        told: &["s.toml:5:13: hittable[0].translate: an object has either `world_from_object` or `scale`, `rotate` and `translate`, not both"] },
    Case { name: "a singular matrix",
        scene: "[[hittable]]\ntype = \"sphere\"\nposition = [0, 0, 0]\nradius = 1\nworld_from_object = [[1, 2, 3, 0], [4, 5, 6, 0], [7, 8, 9, 0]]\n",
        told: &["s.toml:5:21: hittable[0].world_from_object: not invertible: found a singular matrix, expected a matrix with three independent columns"] },
    Case { name: "a transposed matrix",
        scene: "[[hittable]]\ntype = \"sphere\"\nposition = [0, 0, 0]\nradius = 1\nworld_from_object = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [5, 0, 0, 1]]\n",
        told: &["s.toml:5:21: hittable[0].world_from_object: not an affine transform: the last row is wrong: found 5, 0, 0, 1, expected 0, 0, 0, 1 (rows are those of the matrix, so the translation is the last number of the first three rows)"] },
    Case { name: "two rows of a matrix",
        scene: "[[hittable]]\ntype = \"sphere\"\nposition = [0, 0, 0]\nradius = 1\nworld_from_object = [[1, 0, 0, 0], [0, 1, 0, 0]]\n",
        told: &["s.toml:5:21: hittable[0].world_from_object: wrong length: found 2, expected 4 rows of 4 numbers, or the first 3 of them"] },
    Case { name: "a transform that leaves the 32 bit range",
        scene: "[[hittable]]\ntype = \"triangle\"\na = [0, 0, 0]\nb = [1, 0, 0]\nc = [0, 1, 0]\nscale = 3e38\ntranslate = [3e38, 0, 0]\n",
        told: &["s.toml:1:1: hittable[0]: the triangle reaches beyond the range of 32-bit floats"] },
    Case { name: "an empty clip box",
        scene: "[[hittable]]\ntype = \"plane\"\nposition = [0, 0, 0]\nnormal = [0, 1, 0]\nclip_min = [0, 0, 1]\nclip_max = [1, 1, 0]\n",
        told: &["s.toml:6:12: hittable[0].clip_max: the clip box is empty: expected no component below that of `clip_min`"] },
    Case { name: "a plane without a direction",
        scene: "[[hittable]]\ntype = \"plane\"\nposition = [0, 0, 0]\nnormal = [0, 0, 0]\n",
        told: &["s.toml:4:10: hittable[0].normal: a direction must not be zero"] },
    Case { name: "a cylinder without a length",
        scene: "[[hittable]]\ntype = \"cylinder\"\nbase = [1, 2, 3]\ntop = [1, 2, 3]\nradius = 1\n",
        told: &["s.toml:4:7: hittable[0].top: the axis has no length: expected a point off `base`"] },
    Case { name: "a hyperboloid with a wide waist",
        scene: "[[hittable]]\ntype = \"hyperboloid\"\nbase = [0, 0, 0]\ntop = [0, 1, 0]\nradius = 1\nwaist = 2\n",
        told: &["s.toml:6:9: hittable[0].waist: the waist is wider than the ends: found 2, expected at most the radius, 1"] },
    Case { name: "a directional light at a place",
        scene: "[[light_source]]\ntype = \"directional\"\nposition = [0, 1, 0]\n",
        told: &[
            "s.toml:1:1: light_source[0].direction: missing key: expected 3 numbers, the way the light travels",
            "s.toml:3:1: light_source[0].position: unknown key (known here: type, direction, intensity, color, group)",
        ] },
    Case { name: "a directional light that goes nowhere",
        scene: "[[light_source]]\ntype = \"directional\"\ndirection = [0, 0, 0]\n",
        told: &["s.toml:3:13: light_source[0].direction: a direction must not be zero"] },
    Case { name: "an unknown light",
        scene: "[[light_source]]\ntype = \"spot\"\nposition = [0, 1, 0]\n",
        told: &["s.toml:2:8: light_source[0].type: unknown type: found \"spot\", expected \"point\" or \"directional\""] },
    Case { name: "a key given twice",
        scene: "[camera]\nfov = 30\nfov = 40\n",
        told: &["s.toml:3:1: not valid TOML: duplicate key: found fov"] },
    Case { name: "a value left out",
        scene: "[camera]\nfov = \nwidth = 0\n",
        told: &[
            "s.toml:2:7: not valid TOML: a value is missing",
            "s.toml:3:9: camera.width: value out of range: found 0, expected a whole number of pixels from 1 to 65535",
        ] },
    Case { name: "a string without quotes",
        scene: "[[hittable]]\ntype = sphere\nradius = -1\n",
        told: &[
            "s.toml:2:8: not valid TOML: string values must be quoted, expected literal string: found sphere",
            "s.toml:3:10: hittable[0].radius: value out of range: found -1, expected a number above 0, at most 3.4e38",
        ] },
    Case { name: "an unclosed array",
        scene: "[[hittable]]\ntype = \"sphere\"\nposition = [0, 0, 0]\nradius = 1\n[[light_source]]\nposition = [0, 0\nintensity = 1\n",
        told: &["s.toml:7:1: not valid TOML: missing comma between array elements, expected `,`"] },
    Case { name: "an array nested without end",
        scene: "a = [[[[[",
        told: &[
            "s.toml:1:1: a: unknown key (known here: camera, render, material, prototype, hittable, light_source)",
            "s.toml:1:10: not valid TOML: unclosed array, expected `]`",
        ] },
    Case { name: "a prototype that is not there",
        scene: "[[prototype]]\nname = \"p\"\ntype = \"mesh\"\nvertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]\nfaces = [[0, 1, 2]]\n[[hittable]]\ntype = \"instance\"\nof = \"q\"\n[[hittable]]\ntype = \"instance\"\n",
        told: &[
            "s.toml:8:6: hittable[0].of: unknown prototype: found \"q\" (the scene has no [[prototype]] of this name)",
            "s.toml:9:1: hittable[1].of: missing key: expected the name of a [[prototype]]",
        ] },
    Case { name: "prototypes that cannot be placed",
        scene: "[[prototype]]\ntype = \"sphere\"\nposition = [0, 0, 0]\nradius = 1\n[[prototype]]\nname = \"p\"\ntype = \"mesh\"\nvertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]\nfaces = [[0, 1, 2]]\n[[prototype]]\nname = \"p\"\ntype = \"mesh\"\nvertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]\nfaces = [[0, 1, 2]]\n",
        told: &[
            "s.toml:1:1: prototype[0].name: missing key: expected a string, the name to place it by",
            "s.toml:10:1: prototype[2].name: a prototype of this name exists already: found \"p\"",
        ] },
    Case { name: "a prototype that is no mesh",
        scene: "[[prototype]]\nname = \"p\"\ntype = \"sphere\"\nposition = [0, 0, 0]\nradius = 1\n",
        told: &["s.toml:1:1: prototype[0].type: only a mesh can be placed (use type = \"mesh\")"] },
    Case { name: "placements without end",
        scene: "[[prototype]]\nname = \"p\"\ntype = \"mesh\"\nvertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]\nfaces = [[0, 1, 2]]\n[[hittable]]\ntype = \"instance\"\nof = \"p\"\nrepeat = [{ count = 100000, step = [1, 0, 0] }, { count = 100000, step = [0, 1, 0] }]\n",
        told: &["s.toml:6:1: hittable[0]: too many placements of one object: found 10000000000, expected at most 100000000"] },
    Case { name: "a placement that is too flat",
        scene: "[[prototype]]\nname = \"p\"\ntype = \"mesh\"\nvertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]\nfaces = [[0, 1, 2]]\n[[hittable]]\ntype = \"instance\"\nof = \"p\"\nscale = [1, 1e-5, 1]\nrepeat = [{ count = 2, step = [1, 0, 0] }]\n",
        told: &["s.toml:6:1: hittable[0]: placement 0 of 2: the transform stretches one direction too much against another to place a mesh by: found a condition of 141421, expected at most 8192 (give the transform to a mesh instead of an instance: its corners are then moved themselves)"] },
    Case { name: "many mistakes at once",
        scene: "[camera]\nfov = 200\nwidth = \"wide\"\nzoom = 2\n[[hittable]]\ntype = \"sphere\"\nposition = [0, nan]\nradius = -3\nmaterial = \"gold\"\n[[hittable]]\ntype = \"mesh\"\nfile_path = \"lost.ply\"\n[[light_source]]\nintensity = -1\n",
        told: &[
            "s.toml:2:7: camera.fov: value out of range: found 200, expected degrees above 0 and below 180",
            "s.toml:3:9: camera.width: wrong type: found the string \"wide\", expected a whole number of pixels from 1 to 65535",
            "s.toml:4:1: camera.zoom: unknown key (known here: extrinsic, position, look_at, up, fov, width, height, super_sampling)",
            "s.toml:7:12: hittable[0].position: wrong length: found 2, expected 3 numbers",
            "s.toml:8:10: hittable[0].radius: value out of range: found -3, expected a number above 0, at most 3.4e38",
            "s.toml:9:12: hittable[0].material: unknown material: found \"gold\" (the scene has no [[material]])",
            "s.toml:12:13: hittable[1].file_path: mesh file not found: found \"lost.ply\" (tried scenes/lost.ply and lost.ply)",
            "s.toml:13:1: light_source[0].position: missing key: expected 3 numbers",
            "s.toml:14:13: light_source[0].intensity: value out of range: found -1, expected a number from 0 to 3.4e38",
        ] },
];
