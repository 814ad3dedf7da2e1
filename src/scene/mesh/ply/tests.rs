use glam::Vec3;

use super::super::finding::{At, Finding};
use super::*;

const WITH_NORMALS: Attributes = Attributes { normals: true, materials: false };

type Mesh = (Vec<Vec3>, Vec<[u32; 3]>, Vec<String>);

fn read(bytes: &[u8]) -> Mesh {
    let soup = parse(bytes, WITH_NORMALS).unwrap_or_else(|finding| panic!("{finding:?}"));
    let mut findings = soup.findings;
    let triangles = soup.faces.cut(&soup.positions, &mut findings).unwrap();
    (soup.positions, triangles, findings.into_iter().map(|finding| finding.what).collect())
}

fn refused(bytes: &[u8]) -> Finding {
    *parse(bytes, WITH_NORMALS).expect_err("the file should be refused")
}

/// The line, what, and found of a refused ascii file.
fn refused_at_line(text: &str) -> (usize, String, String) {
    let finding = refused(text.as_bytes());
    let At::Line(at) = finding.at else { panic!("{finding:?}") };
    (text[..at].matches('\n').count() + 1, finding.what, finding.found.unwrap_or_default())
}

const HEADER: &str = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
                      element face 2\nproperty list uchar int vertex_indices\nend_header\n";
const VERTICES: &str = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";
const FACES: &str = "3 0 1 2\n3 0 2 3\n";

fn square() -> Vec<Vec3> {
    vec![Vec3::ZERO, Vec3::X, Vec3::new(1., 1., 0.), Vec3::Y]
}

/// The square of `HEADER` in binary, one list of each length, with the byte order and the types given.
struct BinaryFile {
    bytes: Vec<u8>,
    little: bool,
}

impl BinaryFile {
    fn new(little: bool, declarations: &str) -> BinaryFile {
        let order = if little { "little" } else { "big" };
        let header = format!("ply\nformat binary_{order}_endian 1.0\n{declarations}end_header\n");
        BinaryFile { bytes: header.into_bytes(), little }
    }

    fn put(&mut self, kind: &str, value: f64) {
        let start = self.bytes.len();
        match kind {
            "char" => self.bytes.extend((value as i8).to_le_bytes()),
            "uchar" => self.bytes.extend((value as u8).to_le_bytes()),
            "short" => self.bytes.extend((value as i16).to_le_bytes()),
            "ushort" => self.bytes.extend((value as u16).to_le_bytes()),
            "int" => self.bytes.extend((value as i32).to_le_bytes()),
            "uint" => self.bytes.extend((value as u32).to_le_bytes()),
            "float" => self.bytes.extend((value as f32).to_le_bytes()),
            _ => self.bytes.extend(value.to_le_bytes()),
        }
        if !self.little {
            self.bytes[start..].reverse();
        }
    }
}

const KINDS: [&str; 8] = ["char", "uchar", "short", "ushort", "int", "uint", "float", "double"];

#[test]
fn an_ascii_file_is_read_also_with_crlf_or_lone_returns_or_blank_lines() {
    let text = format!("{HEADER}{VERTICES}{FACES}");
    for text in [
        text.clone(),
        text.replace('\n', "\r\n"),
        text.replace('\n', "\r"),
        format!("{HEADER}\n{VERTICES}\n\n{FACES}\n"),
    ] {
        let (positions, triangles, warnings) = read(text.as_bytes());
        assert_eq!((positions, triangles), (square(), vec![[0, 1, 2], [0, 2, 3]]), "{text:?}");
        assert!(warnings.is_empty());
    }
}

#[test]
fn every_scalar_type_is_read_in_both_byte_orders_as_coordinate_count_and_index() {
    for little in [true, false] {
        for coordinate in KINDS {
            for count in &KINDS[..6] {
                for index in KINDS {
                    let mut file = BinaryFile::new(
                        little,
                        &format!(
                            "element vertex 4\nproperty {coordinate} x\nproperty {coordinate} y\nproperty {coordinate} z\n\
                             element face 2\nproperty list {count} {index} vertex_indices\n"
                        ),
                    );
                    square().iter().flat_map(|p| p.to_array()).for_each(|x| file.put(coordinate, x.into()));
                    for corners in [&[3.0, 2.0, 1.0][..], &[0.0, 1.0, 2.0, 3.0]] {
                        file.put(count, corners.len() as f64);
                        corners.iter().for_each(|&corner| file.put(index, corner));
                    }
                    let (positions, triangles, warnings) = read(&file.bytes);
                    assert_eq!(positions, square(), "{little} {coordinate}");
                    assert_eq!(triangles, [[3, 2, 1], [0, 1, 2], [0, 2, 3]], "{little} {count} {index}");
                    assert!(warnings.is_empty());
                }
            }
        }
    }
}

#[test]
fn other_properties_lists_and_elements_are_skipped_wherever_they_stand() {
    let declarations = "comment before\nelement camera 2\nproperty double view_px\nproperty list ushort short taps\n\
         element face 2\nproperty uchar red\nproperty list uchar int vertex_index\nproperty list uchar float texcoord\n\
         property short flags\nobj_info x\nelement vertex 4\nproperty uchar a\nproperty double z\nproperty list char char l\n\
         property float x\nproperty short y\nelement edge 1\nproperty int v1\n";
    let camera = [(1.5, vec![1.0, 2.0]), (2.5, vec![])];
    let faces = [vec![0.0, 1.0, 2.0], vec![0.0, 2.0, 3.0]];
    let mut ascii = format!("ply\nformat ascii 1.0\n{declarations}end_header\n");
    ascii += "1.5 2 1 2\n2.5 0\n9 3 0 1 2 2 .5 .5 -7\n9 3 0 2 3 0 -7\n";
    ascii += "1 0 2 5 6 0 0\n1 0 0 1 0\n1 0 1 5 1 1\n1 0 0 0 1\n42\n";
    assert_eq!(read(ascii.as_bytes()), (square(), vec![[0, 1, 2], [0, 2, 3]], vec![]));
    for little in [true, false] {
        let mut file = BinaryFile::new(little, declarations);
        for (view, taps) in &camera {
            file.put("double", *view);
            file.put("ushort", taps.len() as f64);
            taps.iter().for_each(|&tap| file.put("short", tap));
        }
        for corners in &faces {
            file.put("uchar", 9.0);
            file.put("uchar", 3.0);
            corners.iter().for_each(|&corner| file.put("int", corner));
            file.put("uchar", 2.0);
            file.put("float", 0.5);
            file.put("float", 0.5);
            file.put("short", -7.0);
        }
        for (row, p) in square().iter().enumerate() {
            file.put("uchar", 1.0);
            file.put("double", p.z.into());
            file.put("char", row as f64);
            (0..row).for_each(|_| file.put("char", 5.0));
            file.put("float", p.x.into());
            file.put("short", p.y.into());
        }
        file.put("int", 42.0);
        assert_eq!(read(&file.bytes), (square(), vec![[0, 1, 2], [0, 2, 3]], vec![]));
    }
}

#[test]
fn fast_and_general_rows_of_faces_mix() {
    // A triangle, a quad, a triangle with colours behind: the quad leaves the fast path, which is then taken up again.
    let mut file = BinaryFile::new(
        true,
        "element vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty uchar c\n\
         element face 3\nproperty short s\nproperty list uchar uint vertex_indices\nproperty uchar c\n",
    );
    for p in square() {
        p.to_array().iter().for_each(|&x| file.put("float", x.into()));
        file.put("uchar", 1.0);
    }
    for corners in [&[0.0, 1.0, 2.0][..], &[0.0, 1.0, 2.0, 3.0], &[1.0, 2.0, 3.0]] {
        file.put("short", 1.0);
        file.put("uchar", corners.len() as f64);
        corners.iter().for_each(|&corner| file.put("uint", corner));
        file.put("uchar", 1.0);
    }
    assert_eq!(read(&file.bytes), (square(), vec![[0, 1, 2], [0, 1, 2], [0, 2, 3], [1, 2, 3]], vec![]));
}

#[test]
fn triangle_strips_restart_at_minus_one() {
    let header =
        HEADER.replace("element face 2\nproperty list uchar int", "element tristrips 1\nproperty list int int");
    let text = format!("{header}{VERTICES}9 0 1 2 3 -1 3 2 1 -1\n");
    assert_eq!(read(text.as_bytes()).1, [[0, 1, 2], [2, 1, 3], [3, 2, 1]]);
}

#[test]
fn a_row_may_run_over_lines_but_a_missing_value_is_refused_with_the_line_of_its_row() {
    assert_eq!(read(format!("{HEADER}{VERTICES}3\n0 1 2\n3 0\n2 3\n").as_bytes()).1.len(), 2);
    let short = refused_at_line(&format!("{HEADER}0 0\n1 0 0\n"));
    assert_eq!((short.0, short.1.as_str()), (10, "the row has fewer values than the header declares"));
    assert_eq!(short.2, "`0 0` left over on the line where it ends");
}

#[test]
fn values_that_the_header_does_not_declare_are_passed_over_and_counted() {
    let text = format!("{HEADER}{VERTICES}3 0 1 2 9 1 1\n3 0 2 3 9 x\n");
    let (_, triangles, warnings) = read(text.as_bytes());
    assert_eq!(triangles, [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(warnings, ["2 lines have more values than the header declares, which are ignored"]);
}

#[test]
fn a_malformed_number_is_refused_with_its_line() {
    let bad = format!("{HEADER}0 0 0\n1 zero 0\n");
    assert_eq!(refused_at_line(&bad), (11, "this is not a number".into(), "`zero`".into()));
    assert_eq!(refused(bad.as_bytes()).key.as_deref(), Some("vertex[1]"));
}

#[test]
fn an_index_out_of_range_is_refused_with_its_line_or_byte() {
    for (index, found) in [("4", "4"), ("-1", "-1"), ("1.5", "1.5"), ("nan", "NaN"), ("4294967296", "4294967296")] {
        let bad = format!("{HEADER}{VERTICES}3 0 1 2\n3 0 1 {index}\n");
        let what = "an index names a vertex that does not exist".to_string();
        assert_eq!(refused_at_line(&bad), (15, what, found.into()));
        assert_eq!(refused(bad.as_bytes()).expected.unwrap(), "a whole number from 0 to 3");
    }
    for value in [4.0, -1.0] {
        let mut file = BinaryFile::new(
            false,
            "element vertex 1\nproperty float x\nproperty float y\nproperty float z\n\
             element face 1\nproperty list uchar int vertex_indices\n",
        );
        let start = file.bytes.len();
        (0..3).for_each(|_| file.put("float", 0.0));
        file.put("uchar", 3.0);
        [0.0, 0.0, value].iter().for_each(|&corner| file.put("int", corner));
        let finding = refused(&file.bytes);
        assert_eq!((finding.at, finding.found.unwrap()), (At::Byte(start + 21), value.to_string()));
        assert_eq!(
            (finding.key.as_deref(), finding.expected.as_deref()),
            (Some("face[0]"), Some("a whole number from 0 to 0"))
        );
    }
}

#[test]
fn a_truncated_file_is_refused_with_the_place_of_its_end() {
    let text = format!("{HEADER}{VERTICES}3 0 1 2\n3 0");
    let (line, what, _) = refused_at_line(&text);
    assert_eq!((line, what.as_str()), (15, "a list is longer than the rest of the file"));
    let finding = refused(format!("{HEADER}{VERTICES}3 0 1 2\n").as_bytes());
    assert_eq!((finding.what.as_str(), finding.key.as_deref()), ("the file ends inside a row", Some("face[1]")));
    let mut file = BinaryFile::new(
        true,
        "element vertex 2\nproperty float x\nproperty float y\nproperty float z\n\
         element face 2\nproperty list uchar int vertex_indices\n",
    );
    let start = file.bytes.len();
    (0..6).for_each(|_| file.put("float", 0.0));
    for _ in 0..2 {
        file.put("uchar", 3.0);
        (0..3).for_each(|_| file.put("int", 0.0));
    }
    let whole = file.bytes.len();
    assert_eq!(read(&file.bytes).1.len(), 2);
    let in_vertices = refused(&file.bytes[..start + 23]);
    assert_eq!((in_vertices.at, in_vertices.key.unwrap()), (At::Byte(start + 23), "vertex[1]".into()));
    assert_eq!(in_vertices.expected.unwrap(), "at least 12 bytes a row");
    let in_faces = refused(&file.bytes[..whole - 1]);
    assert_eq!((in_faces.at, in_faces.key.unwrap()), (At::Byte(whole - 13), "face[1]".into()));
    assert_eq!(in_faces.what, "a list is longer than the rest of the file");
    for end in 0..whole {
        assert!(parse(&file.bytes[..end], WITH_NORMALS).is_err(), "{end}");
    }
}

#[test]
fn counts_that_lie_are_refused_before_anything_is_allocated_for_them() {
    for count in ["2147483647", "4000000000", "18446744073709551615", "18446744073709551616", "-1", "1e3"] {
        let text = HEADER.replace("vertex 4", &format!("vertex {count}"));
        assert_eq!(
            refused_at_line(&(text.clone() + VERTICES)).0,
            if count == "2147483647" { 14 } else { 3 },
            "{count}"
        );
        let faces = HEADER.replace("face 2", &format!("face {count}"));
        assert!(parse((faces + VERTICES + FACES).as_bytes(), WITH_NORMALS).is_err());
    }
    // Rows without properties take no bytes; their number costs nothing.
    let text = HEADER.replace("element face", "element nothing 18446744073709551615\nelement face");
    assert_eq!(read((text + VERTICES + FACES).as_bytes()).1.len(), 2);
    let long_list = format!("{HEADER}{VERTICES}1000000000 0 1 2\n3 0 1 2\n");
    assert_eq!(refused_at_line(&long_list).1, "a list is longer than the rest of the file");
    let negative = format!("{HEADER}{VERTICES}-3 0 1 2\n3 0 1 2\n");
    assert_eq!(refused_at_line(&negative), (14, "a list has no such length".into(), "-3".into()));
}

#[test]
fn a_header_that_is_not_one_is_refused_with_its_line() {
    let cases = [
        ("ply\n", "", 1, "this is not a PLY file"),
        ("format ascii 1.0\n", "", 8, "the header names no format"),
        ("ascii 1.0", "ascii 2.0", 2, "unknown version of the format"),
        ("ascii", "text", 2, "unknown format"),
        ("float y", "real y", 5, "unknown property declaration"),
        ("list uchar int", "list float int", 8, "unknown property declaration"),
        ("float y", "float x", 5, "the property `x` of `vertex` is declared twice"),
        ("float y", "float w", 3, "the element `vertex` has no scalar property `y`"),
        ("element face", "element vertex", 7, "the element `vertex` is declared twice"),
        ("element vertex 4", "element", 3, "unknown header line"),
        ("element vertex 4\n", "", 3, "a property stands before any element"),
        ("end_header\n", "", 10, "unknown header line"),
    ];
    for (from, to, line, what) in cases {
        let text = HEADER.replacen(from, to, 1);
        let found = refused_at_line(&(text + if from == "end_header\n" { VERTICES } else { "" }));
        let line = if from == "end_header\n" { 9 } else { line };
        assert_eq!((found.0, found.1.as_str()), (line, what));
    }
    let open = refused_at_line(&HEADER.replace("end_header\n", ""));
    assert_eq!((open.0, open.1.as_str()), (9, "the file ends inside the header"));
    assert_eq!(refused(b"ply\nformat ascii 1.0\nend_header\n").what, "the header declares no element `vertex`");
    let many = HEADER.replace("end_header", &(0..2000).map(|i| format!("property int p{i}\n")).collect::<String>());
    assert_eq!(refused_at_line(&many).1, "too many properties");
}

#[test]
fn faces_without_vertex_indices_and_data_behind_the_end_are_warned_of() {
    let text = format!("{}{VERTICES}{FACES}", HEADER.replace("vertex_indices", "neighbours"));
    let (_, triangles, warnings) = read(text.as_bytes());
    assert!(triangles.is_empty());
    assert_eq!(warnings, ["`face` has no list `vertex_indices` or `vertex_index`: its 2 rows have no effect"]);
    let (.., warnings) = read(format!("{HEADER}{VERTICES}{FACES}3 0 1 2\n").as_bytes());
    assert_eq!(warnings, ["text behind the last element is ignored"]);
    let mut file = BinaryFile::new(true, "element vertex 0\nproperty float x\nproperty float y\nproperty float z\n");
    file.bytes.extend(b"more");
    assert_eq!(read(&file.bytes).2, ["4 bytes are left behind the last element, and ignored"]);
}

#[test]
fn a_first_data_byte_of_ten_behind_lone_returns_is_data() {
    let header = "ply\rformat binary_little_endian 1.0\relement vertex 1\rproperty uchar x\rproperty uchar y\r\
                  property uchar z\rend_header\r";
    let bytes = [header.as_bytes(), &[10, 11, 12]].concat();
    assert_eq!(read(&bytes).0, [Vec3::new(10., 11., 12.)]);
}

#[test]
fn rows_that_are_not_plain_are_read_among_thousands_that_are() {
    const N: usize = 30_000;
    let oddities = ["\n", "  ", "\r\n", "+", "1 2\r\n"];
    let mut expected_triangles = Vec::new();
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {N}\nproperty float x\nproperty uchar red\nproperty float y\nproperty float z\n\
         element face {N}\nproperty list uchar int vertex_indices\nend_header\n"
    );
    let mut surplus = 0;
    for row in 0..N {
        let (x, y) = (row as f32 * 0.25, 1.0 / (row as f32 + 1.0));
        // Now and then an empty line, blanks in front, another line end, a plus, more values than declared.
        let oddity = if row % 3001 == 17 { oddities[row / 3001 % 5] } else { "" };
        let (before, after) = if oddity.ends_with("\r\n") { ("", oddity) } else { (oddity, "\n") };
        surplus += usize::from(oddity == "1 2\r\n");
        text += &format!("{before}{x} 255 {y} -{row}{}{after}", if oddity == "1 2\r\n" { " " } else { "" });
    }
    for row in 0..N {
        let [a, b, c] = [row, (row * 7 + 1) % N, (row * 31 + 2) % N];
        match row % 5003 {
            // A list over two lines, as some writers break it.
            11 => text += &format!("3 {a}\n{b} {c}\n"),
            12 => text += &format!(" 3.0 {a}.0 {b} {c} \n"),
            13 => text += &format!("2 {a} {b}\n"),
            _ => text += &format!("3 {a} {b} {c}\n"),
        }
        if row % 5003 != 13 {
            expected_triangles.push([a, b, c].map(|corner| corner as u32));
        }
    }
    let (positions, triangles, warnings) = read(text.as_bytes());
    assert_eq!(positions.len(), N);
    for (row, position) in positions.iter().enumerate() {
        assert_eq!(*position, Vec3::new(row as f32 * 0.25, 1.0 / (row as f32 + 1.0), -(row as f32)), "{row}");
    }
    assert!(triangles == expected_triangles);
    assert_eq!(warnings.len(), 2, "{warnings:?}");
    assert!(surplus > 0 && warnings[0].starts_with(&format!("{surplus} lines have more values")), "{warnings:?}");

    // A mistake in the midst is found where it is.
    let wrong = text.replacen("\n3 25000 ", "\n3 25000x ", 1);
    let finding = refused(wrong.as_bytes());
    assert_eq!((finding.what.as_str(), finding.key.as_deref()), ("this is not a number", Some("face[25000]")));
}
