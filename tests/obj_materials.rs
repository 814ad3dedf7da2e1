//! Materials and normals that come with OBJ files, from the file to the tables of the world.

mod nasty;
mod shared_data;

use std::fs;

use flatray::scene::mesh::{self, Attributes, MaterialRange};
use flatray::scene::{Compiled, Overrides, load, load_text};
use flatray::world::MaterialId;
use glam::{DVec3, Vec3};
use nasty::nasty_files;
use shared_data::shared;
use tempfile::TempDir;

const EVERYTHING: Attributes = Attributes { normals: true, materials: true };

/// Two triangles of one square with a material each, and one without.
const SQUARE: &str = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nusemtl red\nf 1 2 3\nusemtl mirror\nf 1 3 4\n";

const LIBRARY: &str =
    "newmtl red\nKd 1 0 0\nKs 0.5 0.5 0.5\nillum 2\nnewmtl mirror\nKd 0 0 0\nKs 0.5 0.5 0.5\nillum 3\n";

fn folder(files: &[(&str, &str)]) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in files {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }
    folder
}

/// A scene with one mesh, and further keys of it.
fn scene(folder: &TempDir, keys: &str) -> Compiled {
    let text = format!("[[hittable]]\ntype = \"mesh\"\nfile_path = \"a.obj\"\n{keys}");
    load_text(&text, "s.toml", Some(folder.path()), &Overrides::default()).unwrap_or_else(|error| panic!("{error}"))
}

fn refused(folder: &TempDir, keys: &str) -> String {
    let text = format!("[[hittable]]\ntype = \"mesh\"\nfile_path = \"a.obj\"\n{keys}");
    load_text(&text, "s.toml", Some(folder.path()), &Overrides::default()).unwrap_err().to_string()
}

/// Warnings of a bare mesh, with the names of files alone.
fn warnings(folder: &TempDir) -> Vec<String> {
    let loaded = mesh::load_with(&folder.path().join("a.obj"), EVERYTHING).unwrap_or_else(|error| panic!("{error}"));
    let path = format!("{}/", folder.path().display());
    loaded.warnings.iter().map(|warning| warning.to_string().replace(&path, "")).collect()
}

fn bare(folder: &TempDir) -> Compiled {
    load(&folder.path().join("a.obj"), &Overrides::default()).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn ranges_of_usemtl_are_meshes_with_their_own_material_over_shared_vertices() {
    let folder = folder(&[("a.obj", SQUARE), ("m.mtl", LIBRARY)]);
    let Compiled { world, names, warnings, .. } = scene(&folder, "");
    assert_eq!(names.materials, ["material of mesh 0", "red", "mirror"]);
    assert_eq!((world.triangles.positions.len(), world.triangles.len()), (4, 2));
    assert_eq!((&*world.meshes.first_triangle, &*world.meshes.first_vertex), (&[0, 1][..], &[0, 0][..]));
    assert_eq!(world.meshes.materials, [MaterialId(1), MaterialId(2)]);
    assert_eq!(world.meshes.first_normal, [Some(0), Some(0)]);
    assert_eq!(world.materials.diffuse[1], DVec3::X);
    assert!(warnings.iter().all(|warning| warning.what.contains("no light")), "{warnings:?}");
    // A highlight without a mirror, and one with.
    assert_eq!(world.materials.specular[1..], [DVec3::splat(0.5); 2]);
    assert_eq!(world.materials.reflectance[1..], [0.0, 0.5]);
    assert!(world.features().reflection);
}

#[test]
fn material_keys_of_the_scene_overrule_the_file_whichever_they_are() {
    let folder = folder(&[("a.obj", SQUARE), ("m.mtl", LIBRARY)]);
    for keys in ["diffuse = [0, 1, 0]", "k_s = 0", "material = \"m\"\n[[material]]\nname = \"m\"\n"] {
        let Compiled { world, names, .. } = scene(&folder, keys);
        assert_eq!((world.meshes.len(), names.materials.len()), (1, 1), "{keys}");
        assert!(!world.features().reflection);
    }
    // Nor is a library opened then.
    fs::remove_file(folder.path().join("m.mtl")).unwrap();
    assert!(scene(&folder, "k_s = 0").warnings.iter().all(|warning| !warning.what.contains("library")));
}

#[test]
fn a_bare_mesh_has_the_materials_of_its_file() {
    let folder = folder(&[("a.obj", SQUARE), ("m.mtl", LIBRARY)]);
    let Compiled { world, names, warnings, .. } = bare(&folder);
    assert_eq!(names.materials, ["material of a", "red", "mirror"]);
    assert_eq!(world.meshes.materials, [MaterialId(1), MaterialId(2)]);
    assert!(warnings.is_empty(), "{warnings:?}");
}

#[test]
fn faces_that_are_left_out_do_not_shift_materials() {
    let text = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv nan 1 0\nf 1 1 2\nf 1 2 3\nusemtl red\nf 1 2 2\nf 1 2 4\nusemtl mirror\n\
                f 1 3 3\nf 1 2 3\nf 1 2 4\nusemtl red\nf 3 2 1\nusemtl mirror\nf 1 1 1\n";
    let folder = folder(&[("a.obj", text), ("m.mtl", LIBRARY)]);
    let Compiled { world, .. } = scene(&folder, "");
    let materials: Vec<u32> =
        (0..world.triangles.len()).map(|row| world.meshes.materials[world.meshes.of_triangle(row).idx()].0).collect();
    assert_eq!(materials, [0, 2, 1]);
    assert!(world.meshes.first_triangle.is_sorted());
}

#[test]
fn neighbouring_ranges_of_one_material_are_one_and_empty_ones_are_none() {
    let text = format!("{SQUARE}usemtl red\nusemtl mirror\nf 1 2 4\nusemtl red\nf 2 3 4\nusemtl red\nf 2 3 4\n");
    let folder = folder(&[("a.obj", &text), ("m.mtl", LIBRARY)]);
    let loaded = mesh::load_with(&folder.path().join("a.obj"), EVERYTHING).unwrap();
    let range = |first_triangle, material| MaterialRange { first_triangle, material: Some(material) };
    assert_eq!(loaded.material_ranges, [range(0, 0), range(1, 1), range(3, 0)]);
    // Without being asked for there are none, and bytes in memory open no file.
    assert!(mesh::load(&folder.path().join("a.obj")).unwrap().material_ranges.is_empty());
    let in_memory = mesh::from_bytes_with(&folder.path().join("a.obj"), text.into_bytes(), EVERYTHING).unwrap();
    assert!(in_memory.materials.is_empty() && in_memory.material_ranges.is_empty() && in_memory.warnings.is_empty());
}

#[test]
fn libraries_are_found_by_names_with_blanks_quotes_folders_and_several_in_a_line() {
    let names = [
        "my own materials.mtl",
        "\"my own materials.mtl\"",
        "sub/m.mtl",
        "sub\\m.mtl",
        "x.mtl  my own materials.mtl",
        "x.mtl \"my own materials.mtl\" # and a comment",
        "x.mtl \\\n sub/m.mtl",
    ];
    for name in names {
        let text = SQUARE.replace("m.mtl", name);
        let folder =
            folder(&[("a.obj", &text), ("my own materials.mtl", LIBRARY), ("sub/m.mtl", LIBRARY), ("x.mtl", "")]);
        assert_eq!(warnings(&folder), Vec::<String>::new(), "{name}");
    }
}

#[test]
fn missing_libraries_and_materials_are_warnings_with_file_and_line() {
    let folder = folder(&[("a.obj", SQUARE)]);
    let told = warnings(&folder);
    assert_eq!(told.len(), 2, "{told:?}");
    assert!(told[0].starts_with("a.obj:1: the material library is not there: "), "{told:?}");
    assert!(told[0].contains("found `m.mtl`"), "{told:?}");
    assert!(told[1].starts_with("a.obj:6: 2 materials are in no library: "), "{told:?}");
    let Compiled { world, .. } = bare(&folder);
    assert_eq!((world.meshes.len(), world.triangles.len()), (1, 2));
}

#[test]
fn broken_libraries_are_warnings_with_their_line_and_devices_and_folders_are_not_read() {
    let broken = folder(&[("a.obj", SQUARE), ("m.mtl", "newmtl red\nKd x\nmap_Kd a.png\nnewmtl mirror\nd 0.5\n")]);
    let told = warnings(&broken);
    assert_eq!(told.len(), 2, "{told:?}");
    assert!(told[0].starts_with("m.mtl:2: 1 value is ignored: found `Kd x`"), "{told:?}");
    assert!(told[1].starts_with("m.mtl:3: 1 texture is ignored"), "{told:?}");
    let strange = folder(&[("a.obj", &SQUARE.replace("m.mtl", "/dev/zero sub")), ("sub/x", "")]);
    let told = warnings(&strange);
    assert!(told[0].contains("`/dev/zero`") && told[1].contains("`sub`") && told.len() == 3, "{told:?}");
}

#[test]
fn a_library_of_absurd_size_is_not_read() {
    let folder = folder(&[("a.obj", SQUARE), ("m.mtl", LIBRARY)]);
    // Sparse: takes no room on the disk.
    fs::File::options().write(true).open(folder.path().join("m.mtl")).unwrap().set_len(1 << 40).unwrap();
    let told = warnings(&folder);
    assert!(told[0].starts_with("a.obj:1: the material library is too large and is not read: "), "{told:?}");
}

/// A roof of two squares, its ridge at 90°: vertices 2 and 3.
const ROOF: &str = "v -1 0 0\nv -1 0 1\nv 0 1 0\nv 0 1 1\nv 1 0 0\nv 1 0 1\nf 1 2 4 3\nf 3 4 6 5\n";

#[test]
fn normals_of_the_faces_are_weighted_flat_or_kept_sharp_along_creases_as_the_scene_says() {
    let folder = folder(&[("a.obj", ROOF)]);
    let n_normals = |keys: &str| {
        let Compiled { world, .. } = scene(&folder, keys);
        (world.triangles.positions.len(), world.triangles.normals.len())
    };
    for keys in ["", "phong_interpolation = true", "normals = \"uniform\"", "normals = \"area\"", "normals = \"angle\""]
    {
        assert_eq!(n_normals(keys), (6, 6), "{keys}");
    }
    for keys in ["phong_interpolation = false", "normals = \"flat\""] {
        assert_eq!(n_normals(keys), (6, 0), "{keys}");
    }
    for keys in
        ["crease_angle = 89", "normals = \"area\"\ncrease_angle = 60", "phong_interpolation = true\ncrease_angle = 0"]
    {
        assert_eq!(n_normals(keys), (8, 8), "{keys}");
    }
    assert_eq!(n_normals("crease_angle = 91"), (6, 6));
    let ridge = scene(&folder, "normals = \"angle\"").world.triangles.normals[2];
    assert!(ridge.abs_diff_eq(Vec3::Y, 1e-6), "{ridge}");
}

#[test]
fn keys_that_contradict_each_other_are_refused() {
    let folder = folder(&[("a.obj", ROOF)]);
    let both = refused(&folder, "normals = \"flat\"\nphong_interpolation = false");
    assert!(both.contains("s.toml:5:23: hittable[0].phong_interpolation: a mesh has either `normals` or"), "{both}");
    for keys in ["normals = \"flat\"\n", "normals = \"file\"\n", "phong_interpolation = false\n"] {
        let crease = refused(&folder, &format!("{keys}crease_angle = 30"));
        assert!(crease.contains("hittable[0].crease_angle: `crease_angle` is for normals that are made"), "{crease}");
    }
    let range = refused(&folder, "crease_angle = 181");
    assert!(range.contains("expected degrees from 0 to 180"), "{range}");
    let word = refused(&folder, "normals = \"smooth\"");
    assert!(word.contains("hittable[0].normals"), "{word}");
    let text =
        "[[hittable]]\ntype = \"mesh\"\nvertices = [[0,0,0],[1,0,0],[0,1,0]]\nfaces = [[0,1,2]]\nnormals = \"file\"";
    let error = load_text(text, "s.toml", None, &Overrides::default()).unwrap_err().to_string();
    assert!(error.contains("only a mesh with a `file_path` has normals in a file"), "{error}");
}

#[test]
fn normals_of_the_file_are_used_where_asked_for_and_mended_where_they_are_none() {
    let with = |normals: &str, faces: &str| {
        let text = format!("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n{normals}{faces}");
        folder(&[("a.obj", &text)])
    };
    let tilted = with("vn 1 0 1\nvn 0 0 0\nvn 0 nan 1\n", "f 1//1 2//1 3//2\nf 1//1 3//3 4\n");
    let Compiled { world, warnings, .. } = scene(&tilted, "normals = \"file\"");
    let slant = Vec3::new(1.0, 0.0, 1.0).normalize();
    assert_eq!(world.triangles.normals, [slant, slant, Vec3::Z, Vec3::Z, Vec3::Z]);
    let told = warnings.iter().map(ToString::to_string).find(|told| told.contains("usable")).unwrap();
    assert!(told.contains("a.obj: 3 vertices have no usable normal in the file"), "{told}");
    let none = with("", "f 1 2 3\n");
    let Compiled { world, warnings, .. } = scene(&none, "normals = \"file\"");
    assert_eq!(world.triangles.normals, [Vec3::Z; 4]);
    assert!(warnings.iter().any(|warning| warning.what.starts_with("the file has no normals")), "{warnings:?}");
}

/// A fan of eight triangles about the top of a low pyramid, its rim at a height.
fn pyramid(height: f32, normals: impl Fn(Vec3) -> Vec3) -> String {
    let rim = (0..8).map(|i| {
        let angle = std::f32::consts::TAU * i as f32 / 8.0;
        Vec3::new(angle.cos(), 0.0, -angle.sin())
    });
    let mut text = String::new();
    for p in std::iter::once(Vec3::Y * height).chain(rim) {
        let n = normals(p);
        text += &format!("v {} {} {}\nvn {} {} {}\n", p.x, p.y, p.z, n.x, n.y, n.z);
    }
    for i in 0..8 {
        let (a, b) = (i + 2, (i + 1) % 8 + 2);
        text += &format!("f 1//1 {a}//{a} {b}//{b}\n");
    }
    text
}

#[test]
fn a_bare_mesh_is_smooth_by_its_files_normals_where_they_say_something() {
    // Steep: by the faces alone it would be flat.
    let smooth = folder(&[("a.obj", &pyramid(3.0, |p| p + Vec3::Y))]);
    let Compiled { world, warnings, .. } = bare(&smooth);
    assert_eq!(world.meshes.first_normal, [Some(0)]);
    assert_eq!(world.triangles.normals[1], (Vec3::X + Vec3::Y).normalize());
    assert!(warnings.is_empty(), "{warnings:?}");
    // Turned inside: they cannot be meant.
    let inside = folder(&[("a.obj", &pyramid(3.0, |p| -p - Vec3::Y))]);
    let Compiled { world, warnings, .. } = bare(&inside);
    assert_eq!(world.meshes.first_normal, [None]);
    assert!(
        warnings[0].to_string().contains("a.obj: most normals of the file point behind their faces"),
        "{warnings:?}"
    );
}

#[test]
fn a_bare_mesh_whose_file_repeats_the_normals_of_its_faces_is_judged_by_its_shape() {
    let Some(path) = shared("meshes/spot.obj") else { return };
    let plain = mesh::load(&path).unwrap();
    let split = mesh::load_with(&path, EVERYTHING).unwrap();
    assert!(split.positions.len() > 60_000, "each face has a normal of its own: {}", split.positions.len());
    let Compiled { world, .. } = load(&path, &Overrides::default()).unwrap();
    assert_eq!(world.triangles.positions.len(), plain.positions.len());
    assert_eq!(world.triangles.vertices, plain.triangles);
    assert_eq!(world.meshes.first_normal, [Some(0)]);
}

#[test]
fn threads_show_neither_in_normals_nor_in_materials() {
    let mut text = String::from("mtllib m.mtl\n");
    for i in 0..60_000_u32 {
        let (x, y) = (i % 300, i / 300);
        text += &format!("v {x} {y} {}\nvn {} 1 1\n", i.wrapping_mul(2_654_435_769) >> 28, i % 7);
        if x > 0 && y > 0 {
            let material = if i % 1000 == 0 {
                "usemtl mirror\n"
            } else if i % 500 == 0 {
                "usemtl red\n"
            } else {
                ""
            };
            text += &format!("{material}f -1//-1 -2//{} -302//-301 -301//-1\n", i % 5 + 1);
        }
    }
    assert!(text.len() > 3 << 20, "several pieces: {}", text.len());
    let folder = folder(&[("a.obj", &text), ("m.mtl", LIBRARY)]);
    let with = |n_threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().unwrap();
        let mesh = pool.install(|| mesh::load_with(&folder.path().join("a.obj"), EVERYTHING)).unwrap();
        (mesh.positions, mesh.triangles, mesh.normals, mesh.split_from, mesh.material_ranges)
    };
    let one = with(1);
    assert!(one.4.len() > 30 && !one.3.is_empty(), "{} {}", one.4.len(), one.3.len());
    assert!(with(3) == one && with(8) == one);
}

#[test]
fn every_nasty_obj_loads_with_normals_and_materials_or_is_refused_as_it_is_without() {
    let Some(mut files) = nasty_files() else { return };
    files.retain(|path| path.extension().is_some_and(|extension| extension == "obj"));
    assert!(files.len() > 50, "{}", files.len());
    let mut n_with_materials = 0;
    for path in &files {
        let name = path.display();
        match (mesh::load(path), mesh::load_with(path, EVERYTHING)) {
            (Ok(plain), Ok(full)) => {
                let corner = |positions: &[Vec3], triangle: &[u32; 3]| {
                    triangle.map(|vertex| positions[vertex as usize].to_array().map(f32::to_bits))
                };
                let corners = |mesh: &mesh::MeshFile| {
                    mesh.triangles.iter().map(|t| corner(&mesh.positions, t)).collect::<Vec<_>>()
                };
                assert_eq!(corners(&plain), corners(&full), "{name}");
                assert!(full.normals.as_ref().is_none_or(|normals| normals.len() == full.positions.len()), "{name}");
                assert!(full.material_ranges.iter().all(|r| (r.first_triangle as usize) <= full.triangles.len()));
                n_with_materials += usize::from(!full.materials.is_empty());
                let mut unsplit = full;
                unsplit.drop_normals();
                assert_eq!(unsplit.triangles, plain.triangles, "{name}");
            }
            (Err(plain), Err(full)) => assert_eq!(plain, full),
            (plain, full) => panic!("{name}: {plain:?} {full:?}"),
        }
    }
    assert!(n_with_materials > 15, "{n_with_materials}");
}
