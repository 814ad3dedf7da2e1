//! Files that break readers: those that were collected, and more of our own. Each renders, or is refused with a message
//! that names it.

// Skips are said out loud.
#![allow(clippy::print_stderr)]

mod mesh_kit;
mod nasty;
mod shared_data;

use std::fs;
use std::path::Path;
use std::process::Command;

use flatray::scene::mesh;
use flatray::scene::{self, Overrides};
use mesh_kit::{gzip, valid_files, zstd};
use nasty::nasty_files;

const MAX_PEAK_BYTES: u64 = 1 << 30;

#[test]
fn every_collected_file_is_rendered_in_little_memory_or_refused_by_name() {
    let Some(files) = nasty_files() else { return };
    let room = tempfile::tempdir().unwrap();
    let stats = room.path().join("stats.json");
    let mut n_rendered = 0;
    for path in &files {
        let mut command = Command::new(env!("CARGO_BIN_EXE_flatray"));
        command
            .arg("render")
            .arg(path)
            .args("-o out.png --width 24 --height 16 --samples 1 --quiet --stats".split(' '));
        let output = command.arg(&stats).current_dir(room.path()).output().unwrap();
        let (name, message) = (path.display(), String::from_utf8_lossy(&output.stderr));
        match output.status.code() {
            Some(0) => {
                let stats: serde_json::Value = serde_json::from_slice(&fs::read(&stats).unwrap()).unwrap();
                let peak = stats["memory_bytes"]["peak"].as_u64();
                assert!(peak.is_none_or(|peak| peak < MAX_PEAK_BYTES), "{name}: {peak:?} bytes");
                n_rendered += 1;
            }
            Some(1) => {
                let file_name = path.file_name().unwrap().to_string_lossy();
                // The name, and behind it a line or byte.
                let behind = message.split(&format!("{file_name}:")).nth(1).unwrap_or_default().trim_start();
                let behind = behind.strip_prefix("byte ").unwrap_or(behind);
                assert!(behind.starts_with(|c: char| c.is_ascii_digit()), "{message}");
                eprintln!("{message}");
            }
            code => panic!("{name}: {code:?}: {message}"),
        }
    }
    assert!(n_rendered > 80, "{n_rendered} of {}", files.len());
}

/// What should become of a file.
enum Fate {
    /// It loads, with so many triangles with area.
    Triangles(usize),
    /// It is refused, with these words and a line or byte.
    Refused(&'static str),
}
use Fate::{Refused, Triangles};

const XYZ: &str = "property float x\nproperty float y\nproperty float z\n";
const POINTS: &str = "0 0 0\n1 0 0\n0 1 0\n";

/// An ascii PLY file of a triangle, with the counts as they are given.
fn ply(n_vertices: &str, n_faces: &str, rows: &str) -> Vec<u8> {
    ply_with(&format!(
        "format ascii 1.0\nelement vertex {n_vertices}\n{XYZ}element face {n_faces}\n\
         property list uchar int vertex_indices\nend_header\n{rows}"
    ))
}

fn ply_with(behind_magic: &str) -> Vec<u8> {
    format!("ply\n{behind_magic}").into_bytes()
}

/// A binary PLY file of three vertices and the faces that are given.
fn binary_ply(n_faces: &str, list: &str, faces: &[u8]) -> Vec<u8> {
    let mut bytes = ply_with(&format!(
        "format binary_little_endian 1.0\nelement vertex 3\n{XYZ}element face {n_faces}\n\
         property list {list} vertex_indices\nend_header\n"
    ));
    bytes.extend([0_f32, 0., 0., 1., 0., 0., 0., 1., 0.].iter().flat_map(|x| x.to_le_bytes()));
    bytes.extend(faces);
    bytes
}

fn triangle_row() -> Vec<u8> {
    [&[3][..], &0_u32.to_le_bytes(), &1_u32.to_le_bytes(), &2_u32.to_le_bytes()].concat()
}

fn nasty_ply() -> Vec<(&'static str, Vec<u8>, Fate)> {
    let whole = format!("{POINTS}3 0 1 2\n");
    let good = ply("3", "1", &whole);
    let text = String::from_utf8(good.clone()).unwrap();
    let utf16: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
    let list_of = |kinds: &str, row: &str| text.replace("uchar int", kinds).replace("3 0 1 2", row).into_bytes();
    let with_element = |element: &str| text.replace("element face", &format!("{element}element face")).into_bytes();
    let huge_row = [&0xffff_ffff_u32.to_le_bytes()[..], &triangle_row()].concat();
    let strips = format!(
        "format ascii 1.0\nelement vertex 3\n{XYZ}element tristrips 1\nproperty list int int vertex_indices\nend_header\n{POINTS}4 -1 -1 -1 -1\n"
    );
    vec![
        ("count_2_31.ply", ply("2147483648", "1", &whole), Refused("too many vertices")),
        ("count_2_63.ply", ply("9223372036854775808", "1", &whole), Refused("too many vertices")),
        ("count_2_64.ply", ply("18446744073709551616", "1", &whole), Refused("is no number of rows")),
        ("count_negative.ply", ply("-3", "1", &whole), Refused("is no number of rows")),
        ("count_float.ply", ply("3.0", "1", &whole), Refused("is no number of rows")),
        ("count_missing.ply", ply("", "1", &whole), Refused("unknown header line")),
        ("faces_2_31.ply", ply("3", "2147483648", &whole), Refused("the file ends inside a row")),
        ("faces_2_63.ply", ply("3", "9223372036854775808", &whole), Refused("the file ends inside a row")),
        ("vertices_too_many.ply", ply("300", "1", &whole), Refused("the file ends inside a row")),
        (
            "binary_faces_2_40.ply",
            binary_ply("1099511627776", "uchar int", &triangle_row()),
            Refused("the file ends before"),
        ),
        ("binary_list_huge.ply", binary_ply("1", "uint int", &huge_row), Refused("a list is longer than the rest")),
        ("binary_list_negative.ply", binary_ply("1", "char int", &[0xff; 13]), Refused("a list has no such length")),
        (
            "binary_index_negative.ply",
            binary_ply("1", "uchar int", &[&[3][..], &[0xff; 12]].concat()),
            Refused("names a vertex that does not exist"),
        ),
        (
            "binary_cut.ply",
            binary_ply("2", "uchar int", &[triangle_row(), triangle_row()[..12].to_vec()].concat()),
            Refused("a list is longer than the rest"),
        ),
        ("binary_triangle.ply", binary_ply("1", "uchar uint", &triangle_row()), Triangles(1)),
        ("list_length_float.ply", list_of("float int", "3 0 1 2"), Refused("unknown property declaration")),
        ("list_type_unknown.ply", list_of("uchar vec3", "3 0 1 2"), Refused("unknown property declaration")),
        ("list_huge.ply", list_of("uchar int", "4294967295 0 1 2"), Refused("a list is longer than the rest")),
        ("list_1e300.ply", list_of("uchar int", "1e300 0 1 2"), Refused("a list")),
        ("list_nan.ply", list_of("uchar int", "nan 0 1 2"), Refused("a list has no such length")),
        ("index_float.ply", list_of("uchar float", "3 0.0 1.0 2.0"), Triangles(1)),
        ("index_half.ply", list_of("uchar float", "3 0 1 1.5"), Refused("names a vertex that does not exist")),
        ("index_inf.ply", list_of("uchar float", "3 0 1 inf"), Refused("names a vertex that does not exist")),
        ("index_repeated.ply", list_of("uchar int", "3 0 0 2"), Refused("no triangle with an area")),
        ("only_magic.ply", b"ply\n".to_vec(), Refused("the file ends inside the header")),
        (
            "no_format.ply",
            ply_with(&format!("element vertex 0\n{XYZ}end_header\n")),
            Refused("the header names no format"),
        ),
        ("version_2.ply", text.replace("1.0", "2.0").into_bytes(), Refused("unknown version")),
        ("x_missing.ply", text.replace("float x", "float u").into_bytes(), Refused("has no scalar property `x`")),
        (
            "x_list.ply",
            text.replace("float x", "list uchar float x").into_bytes(),
            Refused("has no scalar property `x`"),
        ),
        ("x_twice.ply", text.replace("float y", "float x").into_bytes(), Refused("is declared twice")),
        ("vertex_twice.ply", with_element("element vertex 3\n"), Refused("is declared twice")),
        ("rows_of_nothing.ply", with_element("element junk 18446744073709551615\n"), Triangles(1)),
        (
            "rows_of_lies.ply",
            with_element("element junk 1099511627776\nproperty char c\n"),
            Refused("the file ends inside a row"),
        ),
        ("lone_returns.ply", text.replace('\n', "\r").into_bytes(), Triangles(1)),
        ("returns_and_feeds.ply", text.replace('\n', "\r\n").into_bytes(), Triangles(1)),
        ("byte_order_mark.ply", [b"\xef\xbb\xbf", good.as_slice()].concat(), Triangles(1)),
        ("utf16.ply", utf16, Refused("")),
        ("nul_bytes.ply", text.replace("1 0 0", "1\0 0\0\x000").into_bytes(), Triangles(1)),
        ("junk_behind_header.ply", ply("3", "1", "\u{1}\u{7f}\u{80}\u{7ff}\u{fffd}"), Refused("this is not a number")),
        ("beyond_f32.ply", ply("4", "2", &format!("{POINTS}1e39 0 0\n3 0 1 2\n3 0 1 3\n")), Triangles(1)),
        ("beyond_f64.ply", ply("4", "2", &format!("{POINTS}0 1e999 0\n3 0 1 2\n3 0 1 3\n")), Triangles(1)),
        ("all_nan.ply", ply("3", "1", "nan nan nan\nnan 0 0\n0 nan 0\n3 0 1 2\n"), Refused("no triangle with an area")),
        ("strip_of_restarts.ply", ply_with(&strips), Refused("no triangle with an area")),
        ("twice.ply.gz", gzip(&gzip(&good)), Refused("holds compressed data again")),
        ("twice.ply.zst", zstd(&zstd(&good)), Refused("holds compressed data again")),
        ("cut.ply.gz", gzip(&good)[..40].to_vec(), Refused("is damaged or ends early")),
        ("cut.ply.zst", zstd(&good)[..40].to_vec(), Refused("is damaged or ends early")),
        ("not_packed.ply.zst", good.clone(), Triangles(1)),
        ("packed.ply", zstd(&good), Triangles(1)),
        ("nothing.ply", Vec::new(), Refused("the file is empty")),
    ]
}

fn nasty_others() -> Vec<(&'static str, Vec<u8>, Fate)> {
    let facet = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";
    let solid = format!("solid s\n{facet}endsolid s\n");
    let binary_stl = |header: &[u8], count: u32, value: f32| {
        let corners: [f32; 9] = [0., 0., 0., 1., 0., 0., 0., 1., value];
        let mut bytes = header.to_vec();
        bytes.resize(80, 0);
        bytes.extend(count.to_le_bytes().into_iter().chain([0; 12]));
        bytes.extend(corners.iter().flat_map(|x| x.to_le_bytes()).chain([0; 2]));
        bytes
    };
    let off = |head: &str, face: &str| format!("{head}\n{POINTS}{face}\n").into_bytes();
    vec![
        ("solid_in_name.stl", binary_stl(b"solid facet normal", 1, 0.0), Triangles(1)),
        ("count_2_32.stl", binary_stl(b"", u32::MAX, 0.0), Refused("ends inside facet 1 of 4294967295")),
        ("count_2.stl", binary_stl(b"solid", 2, 0.0), Refused("ends inside facet 1 of 2")),
        ("not_finite.stl", binary_stl(b"", 1, f32::INFINITY), Refused("no triangle with an area")),
        ("short.stl", vec![7; 83], Refused("too short")),
        ("cut.stl", solid.as_bytes()[..60].to_vec(), Refused("the file ends inside a solid")),
        ("no_endfacet.stl", solid.replace("endfacet\n", "").into_bytes(), Refused("unexpected word")),
        ("two_numbers.stl", solid.replace("1 0 0", "1 0").into_bytes(), Refused("a coordinate is not a number")),
        ("two_corners.stl", solid.replace("vertex 1 0 0\n", "").into_bytes(), Refused("unexpected word")),
        ("solid_in_solid.stl", format!("solid a\n{solid}").into_bytes(), Refused("unexpected word")),
        ("several.stl", solid.repeat(3).replace("vertex 1", "VERTEX 1").into_bytes(), Triangles(3)),
        ("tail.stl", format!("{solid}\0\0\0tail").into_bytes(), Refused("unexpected word")),
        ("upper.STL", solid.to_uppercase().replace('\n', "\r").into_bytes(), Triangles(1)),
        ("counts_2_31.off", off("OFF\n2147483648 1 0", "3 0 1 2"), Refused("too many vertices")),
        ("counts_2_63.off", off("OFF\n3 9223372036854775808 0", "3 0 1 2"), Refused("is missing or none")),
        ("counts_1e18.off", off("OFF\n3 999999999999999999 0", "3 0 1 2"), Refused("the file ends inside a row")),
        ("counts_negative.off", off("OFF\n3 -1 0", "3 0 1 2"), Refused("is missing or none")),
        ("binary.off", off("OFF BINARY\n3 1 0", "3 0 1 2"), Refused("binary OFF files are not read")),
        ("four.off", off("4OFF\n3 1 0", "3 0 1 2"), Refused("other than three coordinates")),
        ("list_huge.off", off("OFF\n3 1 0", "999999999999 0 1 2"), Refused("a list is longer than the rest")),
        ("index_3.off", off("OFF\n3 1 0", "3 0 1 3"), Refused("names a vertex that does not exist")),
        ("keyword_only.off", b"OFF".to_vec(), Refused("the number of vertices is missing")),
        ("comments_only.off", b"# OFF\n# 3 1 0".to_vec(), Refused("the number of vertices is missing")),
        ("colours.off", off("COFF 3 1 0", "3 0 1 2 # 255 0 0"), Triangles(1)),
        ("under_another_name.obj", off("OFF 3 1 0", "3 0 1 2"), Triangles(1)),
        ("no_extension", solid.clone().into_bytes(), Triangles(1)),
        ("index_0.obj", b"v 0 0 0\nf 0 1 2\n".to_vec(), Refused("")),
        ("index_2_63.obj", b"v 0 0 0\nf 1 1 9223372036854775808\n".to_vec(), Refused("")),
        ("index_minus_9.obj", b"v 0 0 0\nf -9 1 1\n".to_vec(), Refused("")),
        ("byte_order_mark.obj", b"\xef\xbb\xbfv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n".to_vec(), Triangles(1)),
        ("beyond_f32.obj", b"v 0 0 0\nv 1e39 0 0\nv 0 1 0\nv 1 1 1\nf 1 2 3\nf 1 3 4\n".to_vec(), Triangles(1)),
        ("nothing.off", Vec::new(), Refused("the file is empty")),
        ("nothing.stl.gz", gzip(b""), Refused("the file is empty")),
    ]
}

#[test]
fn every_file_of_our_own_loads_as_it_should_or_is_refused_where_it_is_wrong() {
    let room = tempfile::tempdir().unwrap();
    for (name, bytes, fate) in nasty_ply().into_iter().chain(nasty_others()) {
        let path = room.path().join(name);
        fs::write(&path, bytes).unwrap();
        let loaded = scene::load(&path, &Overrides::default());
        match (fate, loaded) {
            (Triangles(n), Ok(scene)) => {
                assert_eq!(scene.world.triangles.len(), n, "{name}: {:?}", scene.warnings);
            }
            (Refused(words), Ok(_)) => panic!("{name} loads, and should be refused: {words}"),
            (Triangles(_), Err(error)) => panic!("{error}"),
            (Refused(words), Err(error)) => {
                let (message, place) = (error.to_string(), &error.problems[0].place);
                assert!(message.contains(name) && message.contains(words), "{name}: {message}");
                assert!(place.line.is_some() || place.byte_offset.is_some(), "{message}");
            }
        }
    }
}

#[test]
fn headers_without_an_end_and_bombs_are_refused_whatever_their_size() {
    let read = |name: &str, bytes: Vec<u8>| mesh::from_bytes(Path::new(name), bytes).unwrap_err().to_string();
    let comment = format!("comment {}\n", "x".repeat(1000));
    let endless = format!("ply\nformat ascii 1.0\n{}", comment.repeat((100 << 20) / comment.len()));
    assert!(read("endless.ply", endless.into_bytes()).contains("the file ends inside the header"));
    let one_line = format!("ply\nformat ascii 1.0\ncomment {}", "x".repeat(100 << 20));
    assert!(read("one_line.ply", one_line.into_bytes()).contains("the file ends inside the header"));
    // Frames of a window of 1 MiB with 70 blocks of 128 KiB of blanks each: 9 MB from 300 bytes, thirty times over.
    let header = [0x28, 0xb5, 0x2f, 0xfd, 0, 10 << 3];
    let block = |is_last: u32| [&((128 << 10) << 3 | 1 << 1 | is_last).to_le_bytes()[..3], b" "].concat();
    let frame = [&header[..], &block(0).repeat(70), &block(1)].concat();
    let error = read("bomb.ply.zst", frame.repeat(30));
    assert!(error.contains("the zstd data expands beyond what a file of this kind can need"), "{error}");
}

#[test]
fn every_beginning_of_every_small_file_is_refused_or_holds_no_more_than_the_whole() {
    for (name, whole) in valid_files() {
        let n_triangles = mesh::from_bytes(Path::new(name), whole.clone()).unwrap().triangles.len();
        let mut n_refused = 0;
        for length in 0..whole.len() {
            match mesh::from_bytes(Path::new(name), whole[..length].to_vec()) {
                Ok(mesh) => assert!(mesh.triangles.len() <= n_triangles, "{name}, {length} bytes"),
                Err(error) => {
                    assert!(error.to_string().starts_with(name), "{error}");
                    n_refused += 1;
                }
            }
        }
        // The end of an OBJ file is wherever it ends, and names that tell nothing are those of plain OBJ files.
        assert!(n_refused * 2 > whole.len() || name.ends_with(".obj"), "{name}: {n_refused} of {}", whole.len());
    }
}

#[test]
fn defects_are_warned_of_and_refused_when_asked_to_be_strict_also_within_a_scene() {
    let room = tempfile::tempdir().unwrap();
    let rows = format!("{POINTS}2 0 0\nnan 0 0\n3 0 1 2\n3 1 2 0\n3 0 1 3\n3 0 1 4\n2 0 1\n");
    let (bad, good) = (room.path().join("bad.ply"), room.path().join("good.ply"));
    fs::write(&bad, ply("5", "5", &rows)).unwrap();
    fs::write(&good, ply("3", "1", &format!("{POINTS}3 0 1 2\n"))).unwrap();
    let strict = Overrides { strict: true, ..Overrides::default() };
    let thorough = Overrides { find_duplicates: true, ..Overrides::default() };
    let expected = [
        "bad.ply:19: 1 face has fewer than three corners and is left out",
        "bad.ply: 1 face is there already, and hidden by the first",
        "bad.ply: 1 face with a NaN or infinite corner left out",
        "bad.ply: 1 face without area left out",
    ];
    let scene = room.path().join("scene.toml");
    fs::write(&scene, "[[hittable]]\ntype = \"mesh\"\nfile_path = \"bad.ply\"\n").unwrap();
    for path in [&bad, &scene] {
        let warnings: String =
            scene::load(path, &thorough).unwrap().warnings.iter().map(|warning| format!("{warning}\n")).collect();
        let refusal = scene::load(path, &strict).unwrap_err();
        assert_eq!(refusal.problems.len(), expected.len(), "{refusal}");
        for words in expected {
            assert!(warnings.contains(words) && refusal.to_string().contains(words), "{words}: {warnings} {refusal}");
        }
        assert!(!scene::load(path, &Overrides::default()).unwrap().warnings.iter().any(|w| w.what.contains("already")));
    }
    assert!(scene::load(&good, &strict).is_ok());
    // A warning of something else, as of a scene without light, is no defect.
    fs::write(&scene, "[[hittable]]\ntype = \"mesh\"\nfile_path = \"good.ply\"\n").unwrap();
    assert!(!scene::load(&scene, &strict).unwrap().warnings.is_empty());
}
