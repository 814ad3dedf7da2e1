use super::*;

fn binary(header: &[u8], count: u32, triangles: &[[[f32; 3]; 3]]) -> Vec<u8> {
    let mut bytes = header.to_vec();
    bytes.resize(80, b' ');
    bytes.extend(count.to_le_bytes());
    for corners in triangles {
        bytes.extend([0; 12]);
        bytes.extend(corners.as_flattened().iter().flat_map(|x| x.to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

const TWO: [[[f32; 3]; 3]; 2] =
    [[[0., 0., 0.], [1., 0., 0.], [0., 1., 0.]], [[1., 0., 0.], [1., 1., 0.], [0., 1., -0.]]];

fn read(bytes: &[u8]) -> (Vec<Vec3>, Vec<[u32; 3]>, Vec<String>) {
    let soup = parse(bytes).unwrap();
    let mut findings = soup.findings;
    let triangles = soup.faces.cut(&soup.positions, &mut findings).unwrap();
    (soup.positions, triangles, findings.into_iter().map(|finding| finding.what).collect())
}

fn ascii(facets: &str) -> String {
    format!("solid a facet name\n{facets}endsolid a facet name\n")
}

const FACET: &str =
    "facet normal 0 0 nan\n outer loop\n  vertex 0 0 0\n  vertex 1 0 0\n  vertex 0 1e0 0\n endloop\nendfacet\n";

#[test]
fn a_binary_file_is_read_and_equal_corners_are_welded() {
    let (positions, triangles, warnings) = read(&binary(b"made by a test", 2, &TWO));
    assert_eq!(positions, [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::new(1., 1., 0.)]);
    assert_eq!(triangles, [[0, 1, 2], [1, 3, 2]]);
    assert!(warnings.is_empty());
}

#[test]
fn a_binary_file_whose_header_begins_with_solid_is_binary() {
    assert_eq!(read(&binary(b"solid facet endsolid", 2, &TWO)).1.len(), 2);
    // Also when its size does not fit its count.
    let mut longer = binary(b"solid part", 2, &TWO);
    longer.push(7);
    let (_, triangles, warnings) = read(&longer);
    assert_eq!((triangles.len(), warnings[0].as_str()), (2, "1 byte is left behind the last of 2 facets, and ignored"));
}

#[test]
fn a_truncated_binary_file_is_refused_with_its_byte() {
    let bytes = binary(b"", 2, &TWO);
    let finding = parse(&bytes[..183]).unwrap_err();
    assert_eq!(finding.at, At::Byte(183));
    assert_eq!(finding.what, "the file ends inside facet 1 of 2");
    assert_eq!(finding.expected.unwrap(), "184 bytes, by the count at byte 80");
    let lying = binary(b"", u32::MAX, &TWO);
    assert_eq!(parse(&lying).unwrap_err().what, "the file ends inside facet 2 of 4294967295");
    let short = parse(b"tiny").unwrap_err();
    assert_eq!((short.at, short.what.as_str()), (At::Byte(4), "the file is too short for an STL file"));
}

#[test]
fn an_ascii_file_may_hold_several_solids_in_any_case_of_letters_and_line_ends() {
    let text = ascii(FACET) + &ascii(FACET).to_uppercase().replace("\n", "\r\n") + "\n\n";
    let (positions, triangles, _) = read(text.as_bytes());
    assert_eq!((positions.len(), triangles.len()), (3, 2));
    assert_eq!(read(ascii(FACET).replace('\n', "\r").as_bytes()).1, [[0, 1, 2]]);
}

#[test]
fn an_empty_solid_is_a_mesh_without_triangles() {
    assert!(read(b"solid Empty\nendsolid Empty").1.is_empty());
    assert!(read(&binary(b"", 0, &[])).1.is_empty());
}

#[test]
fn a_facet_of_four_corners_is_cut() {
    let text = ascii(&FACET.replace("  vertex 1 0 0\n", "  vertex 1 0 0\n  vertex 1 1 0\n"));
    assert_eq!(read(text.as_bytes()).1, [[0, 1, 2], [0, 2, 3]]);
}

#[test]
fn malformed_ascii_is_refused_with_its_line() {
    let cases = [
        (FACET.replace("1e0", "1,0"), 5, "a coordinate is not a number"),
        (FACET.replace("  vertex 1 0 0\n", ""), 5, "unexpected word"),
        (FACET.replace("outer", "inner"), 2, "unexpected word"),
        (FACET.replace("endfacet", ""), 7, "unexpected word"),
        (format!("{FACET}\njunk"), 10, "unexpected word"),
    ];
    for (facet, line, what) in cases {
        let text = ascii(&facet);
        let finding = parse(text.as_bytes()).unwrap_err();
        let At::Line(at) = finding.at else { panic!("{finding:?}") };
        assert_eq!(finding.what, what, "{facet}");
        assert!(text[..at].matches('\n').count().abs_diff(line) <= 1, "{facet} {}", text[..at].matches('\n').count());
    }
    let cut = ascii(FACET);
    let finding = parse(&cut.as_bytes()[..60]).unwrap_err();
    assert_eq!((finding.at, finding.what.as_str()), (At::Line(60), "the file ends inside a solid"));
}
