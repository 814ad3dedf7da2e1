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
