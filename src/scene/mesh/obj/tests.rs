use super::*;

type Mesh = (Vec<Vec3>, Vec<[u32; 3]>, Vec<String>);

fn read(text: &[u8]) -> Mesh {
    let obj = parse(text, Attributes::default()).unwrap();
    let mut findings = obj.findings;
    let triangles = obj.faces.cut(&obj.positions, &mut findings).unwrap();
    (obj.positions, triangles, findings.into_iter().map(|finding| finding.what).collect())
}

/// What, the offset of the line, found and expected of the error.
fn refused(text: &str) -> (String, usize, String) {
    let finding = parse(text.as_bytes(), Attributes::default()).unwrap_err();
    let At::Line(at) = finding.at else { panic!("{finding:?}") };
    let line = text[..at].matches('\n').count() + 1;
    (finding.what, line, format!("{} / {}", finding.found.unwrap_or_default(), finding.expected.unwrap_or_default()))
}

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

fn square(faces: &str) -> Vec<[u32; 3]> {
    read(format!("{SQUARE}{faces}").as_bytes()).1
}

#[test]
fn corners_are_read_in_all_their_forms() {
    for face in ["f 1 2 3", "f 1/7 2/7 3/7", "f 1//9 2//9 3//9", "f 1/7/9 2/7/9 3/7/9", "f 1/ 2// 3/7/", "f\t1\t2\t3  "]
    {
        assert_eq!(square(face), [[0, 1, 2]], "{face}");
    }
}

#[test]
fn negative_indices_count_from_the_end_of_what_stands_above() {
    assert_eq!(square("f -4 -3 -2\nv 9 9 9\nf -1 1 2"), [[0, 1, 2], [4, 0, 1]]);
    assert_eq!(square("f -4/-1/-1 -3/-1/-1 -2/-1/-1"), [[0, 1, 2]]);
}

#[test]
fn a_face_may_name_vertices_that_follow_later() {
    assert_eq!(read(b"f 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0").1, [[0, 1, 2]]);
}

#[test]
fn polygons_are_cut() {
    assert_eq!(square("f 1 2 3 4"), [[0, 1, 2], [0, 2, 3]]);
}

#[test]
fn weights_colours_comments_and_blank_lines_are_ignored() {
    let text = b"# caf\xe9 \\\n\n   \nv 1 2 3 1.0\r\nv 4 5 6 0.1 nan x # red\n\tv .5 -1e1 +7. \n";
    let (positions, _, warnings) = read(text);
    assert_eq!(positions, [Vec3::new(1., 2., 3.), Vec3::new(4., 5., 6.), Vec3::new(0.5, -10., 7.)]);
    assert!(warnings.is_empty(), "{warnings:?}");
}

#[test]
fn a_backslash_continues_a_line_in_any_line_end_and_statement() {
    assert_eq!(square("f 1 \\\n 2\\\r\n 3"), [[0, 1, 2]]);
    assert_eq!(read(b"v 1 \\\n2 3\ng a \\\n f b c\n").0, [Vec3::new(1., 2., 3.)]);
    assert_eq!(square("# C:\\models\\\nf 1 2 3\nusemtl a # b\\\nf 1 2 3").len(), 2);
}

#[test]
fn lone_returns_end_lines_too() {
    assert_eq!(read(b"v 0 0 0\rv 1 0 0\rv 0 1 0\rf 1 2 3\r").1, [[0, 1, 2]]);
}

#[test]
fn zero_and_out_of_range_indices_are_refused_with_their_line() {
    let what = "a face names a vertex that does not exist".to_string();
    let at = |face: &str| refused(&format!("{SQUARE}{face}"));
    assert_eq!(at("f 1 2 3\nf 0 1 2"), (what.clone(), 6, "0 / 1 to 4, or -4 to -1".into()));
    assert_eq!(at("f 1 2 5\nf 1 2 9\nf 1 2 7"), (what.clone(), 5, "5 / 1 to 4, or -4 to -1".into()));
    assert_eq!(at("f -5 1 2"), (what.clone(), 5, "-5 / 1 to 4, or -4 to -1".into()));
    assert_eq!(at("f 1 2 99999999999"), (what.clone(), 5, "99999999999 / 1 to 4, or -4 to -1".into()));
    assert_eq!(refused("f -4 -3 -2"), (what, 1, "-4 / no index: there is no vertex".into()));
}

#[test]
fn malformed_numbers_are_refused_with_their_line() {
    assert_eq!(refused("v 0 0 0\nv 1 2,5 3").0, "a coordinate is not a number");
    assert_eq!(refused("v 0 0 0\nv 1 2").1, 2);
    assert_eq!(refused("v 1 2 \\\n x"), ("a coordinate is not a number".into(), 2, "`x` / a number".into()));
    for face in ["f 1 2 x", "f 1 2 3.5", "f 1/2/3/4 2 3", "f 1/a 2 3", "f /1 2 3", "f 1 2 3-4"] {
        let (what, line, _) = refused(&format!("{SQUARE}{face}"));
        assert_eq!((what.as_str(), line), ("a face has a malformed corner", 5), "{face}");
    }
}

#[test]
fn faces_of_one_or_two_corners_lines_points_and_unknown_statements_are_counted() {
    let (_, triangles, warnings) = read(format!("{SQUARE}f 1\nf 1 2\nl 1 2\np 1\nfoo 1\nf 1 2 3\n").as_bytes());
    assert_eq!(triangles.len(), 1);
    assert_eq!(
        warnings,
        [
            "1 unknown statement is ignored",
            "2 line and point elements are ignored",
            "2 faces have fewer than three corners and are left out"
        ]
    );
}

#[test]
fn text_that_is_no_obj_is_refused() {
    assert_eq!(refused("hello world\nthis is prose").0, "this is not an OBJ file");
    assert_eq!(read(b"# only a comment").2, Vec::<String>::new());
}

#[test]
fn nan_and_infinite_coordinates_pass_through() {
    let (positions, ..) = read(b"v nan -nan inf\nv 1.#IND -1.#INF 1e39\n");
    assert!(positions[0].x.is_nan() && positions[0].z == f32::INFINITY);
    assert!(positions[1].x.is_nan() && positions[1].y == f32::NEG_INFINITY && positions[1].z == f32::INFINITY);
}

const EVERYTHING: Attributes = Attributes { normals: true, materials: true };

/// All that a file gives, as text, read in pieces of a size.
fn described(text: &[u8], piece_bytes: usize) -> String {
    match parse_in_pieces(text, EVERYTHING, piece_bytes) {
        Err(finding) => format!("{finding:?}"),
        Ok(obj) => {
            let Obj { positions, faces, normals, split_from, materials, mut findings } = obj;
            let n_faces = faces.len();
            let cut = faces.cut_with_marks(&positions, &mut findings);
            format!("{positions:?} {n_faces} {cut:?} {normals:?} {split_from:?} {materials:?} {findings:?}")
        }
    }
}

#[test]
fn pieces_of_any_size_give_what_the_whole_text_gives() {
    let valid = format!(
        "mtllib a b.mtl \\\n c.mtl\n{SQUARE}vn 0 0 1\nvn 0 1 0\r\nf 1//1 2//1 3//2\n# c:\\\nusemtl a b # c\nf -4//-1 \\\r\n \
         -3//-2 -2//9 -1\rv 5 5 \\\n 5\nf 1 2\nl 1 2\nusemtl c\nfoo\\\nv\nf 1 2 3 4 5\nf -1//-1 -2//-2 1//1\n\n\\\n\\\nf 1 2 4"
    );
    let broken = [
        "f 1 2 9",
        "f 0 1 2",
        "v 1 2",
        "v 1 x 2",
        "f -5 1 2\nf 1 2 x",
        "f 1 2 x\nf -5 1 2",
        "v\nv\nv\nv",
        "vn 1 2",
        "bar \\\n",
    ];
    let texts =
        std::iter::once(valid.clone()).chain(broken.map(|end| format!("{valid}\n{end}\n{SQUARE}f 1 7 1/2/3/4\n")));
    for text in texts {
        let whole = described(text.as_bytes(), usize::MAX);
        for piece_bytes in 1..text.len() {
            assert_eq!(described(text.as_bytes(), piece_bytes), whole, "{piece_bytes}: {text}");
        }
    }
}

#[test]
fn mutated_texts_give_the_same_in_pieces_and_whole() {
    let valid =
        format!("{SQUARE}vn 0 0 1\nf 1//1 2//1 3//1\nf -4 \\\n -3 -2 -1\nusemtl a\nf 1 3 4\nv 1 2 3\nf 1 2 5 # x\n");
    let telling = b"\\\n\r #/-9vfn";
    let mut state = 11_u64;
    let mut random = |below: usize| {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 33) as usize % below
    };
    let mut n_accepted = 0;
    for _ in 0..4000 {
        let mut text = valid.clone().into_bytes();
        for _ in 0..=random(3) {
            let at = random(text.len());
            match random(3) {
                0 => text[at] = telling[random(telling.len())],
                1 => text.insert(at, telling[random(telling.len())]),
                _ => drop(text.remove(at)),
            }
        }
        let whole = described(&text, usize::MAX);
        n_accepted += usize::from(whole.starts_with('['));
        for piece_bytes in [1, 7, 1 + random(text.len())] {
            assert_eq!(described(&text, piece_bytes), whole, "{piece_bytes}: {}", text.escape_ascii());
        }
    }
    assert!((500..3500).contains(&n_accepted), "{n_accepted}");
}

#[test]
fn a_text_that_never_ends_a_statement_is_one_piece_found_in_one_pass() {
    let text = b"v\\\n".repeat(1 << 20);
    assert_eq!(piece_bounds(&text, 16), [0, text.len()]);
    assert!(parse_in_pieces(&text, EVERYTHING, 16).is_err());
}

#[test]
fn vertices_without_coordinates_get_no_table_that_they_could_not_fill() {
    let finding = parse(&b"v\n".repeat(1 << 20), Attributes::default()).unwrap_err();
    assert_eq!((finding.what.as_str(), finding.at), ("a vertex has too few coordinates", At::Line(0)));
}

/// Positions, triangles, normals, what was split from where, and findings.
type Smooth = (Vec<Vec3>, Vec<[u32; 3]>, Option<Vec<Vec3>>, Vec<u32>, Vec<String>);

fn normals_of(text: &str) -> Smooth {
    let Obj { positions, faces, normals, split_from, mut findings, .. } = parse(text.as_bytes(), EVERYTHING).unwrap();
    let triangles = faces.cut(&positions, &mut findings).unwrap();
    (positions, triangles, normals, split_from, findings.into_iter().map(|finding| finding.what).collect())
}

#[test]
fn a_vertex_is_split_for_each_normal_that_its_corners_have_and_equal_ones_are_one() {
    // The second normal is written twice; the third face names both.
    let text =
        format!("{SQUARE}vn 0 0 2\nvn 0 1 0\nvn 0 1 0\nf 1//1 2//1 3//1\nf 1//2 3//1 4//1\nf 4//3 2/7/-2 1/1/3\n");
    let (positions, triangles, normals, split_from, findings) = normals_of(&text);
    assert_eq!(triangles, [[0, 1, 2], [4, 2, 3], [5, 6, 4]]);
    assert_eq!(split_from, [0, 3, 1]);
    assert_eq!(positions[4..], [positions[0], positions[3], positions[1]]);
    let z = Vec3::new(0.0, 0.0, 2.0);
    assert_eq!(normals.unwrap(), [z, z, z, z, Vec3::Y, Vec3::Y, Vec3::Y]);
    assert!(findings.is_empty(), "{findings:?}");
}

#[test]
fn normals_of_polygons_are_split_before_they_are_cut() {
    let text = format!("{SQUARE}vn 0 0 1\nvn 1 0 0\nf 1//1 2//1 3//1 4//1\nf 4//2 3//2 2//2 1//2\n");
    let (_, triangles, normals, split_from, _) = normals_of(&text);
    assert_eq!(triangles, [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]]);
    assert_eq!((split_from, normals.unwrap()[7]), (vec![3, 2, 1, 0], Vec3::X));
}

#[test]
fn corners_without_a_normal_get_zero_and_lost_ones_are_counted() {
    let (_, _, normals, split_from, findings) = normals_of(&format!("{SQUARE}vn 0 0 1\nf 1//1 2//8 3\nf 1 2 4//-2\n"));
    assert_eq!(normals.unwrap(), [Vec3::Z, Vec3::ZERO, Vec3::ZERO, Vec3::ZERO, Vec3::ZERO]);
    assert_eq!(split_from, [0]);
    assert_eq!(findings, ["2 corners name a normal that does not exist, and will be shaded by the faces around"]);
    // Without any that exists there are none.
    assert_eq!(normals_of(&format!("{SQUARE}f 1//1 2//1 3//1\nf 1 2 3\n")).2, None);
    // Where they are not asked for nothing is said.
    assert!(read(format!("{SQUARE}f 1//1 2//8 3\n").as_bytes()).2.is_empty());
}

#[test]
fn malformed_normals_are_refused_where_they_are_asked_for() {
    let refused = |text: &str| parse(text.as_bytes(), EVERYTHING).unwrap_err();
    assert_eq!(refused("vn 1 2").what, "a normal has too few components");
    assert_eq!(refused("vn 1 2 x").what, "a component of a normal is not a number");
    assert!(parse(b"vn 1 2 x", Attributes::default()).is_ok());
}

#[test]
fn materials_begin_at_their_faces_whatever_polygons_lose_when_they_are_cut() {
    let text = format!(
        "{SQUARE}f 1 2 3\nusemtl a\nf 1 2 3 3\nf 1 2 3 4\nusemtl b c # d\nusemtl a\nf 1 1 1 1\nusemtl b c # d\nf 1 2 3\n"
    );
    let Obj { positions, faces, materials, mut findings, .. } = parse(text.as_bytes(), EVERYTHING).unwrap();
    let (triangles, marks) = faces.cut_with_marks(&positions, &mut findings).unwrap();
    assert_eq!((triangles.len(), marks), (5, vec![1, 4, 4, 4]));
    let names: Vec<&[u8]> = materials.names.iter().map(|(_, name)| name.as_slice()).collect();
    assert_eq!((names, materials.uses), (vec![&b"a"[..], b"b c # d"], vec![0, 1, 0, 1]));
}
