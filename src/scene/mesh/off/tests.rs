use glam::Vec3;

use super::super::finding::At;
use super::*;

const WITH_NORMALS: Attributes = Attributes { normals: true, materials: false };

const VERTICES: &str = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";

type Mesh = (Vec<Vec3>, Option<Vec<Vec3>>, Vec<[u32; 3]>, Vec<String>);

fn read(text: &str) -> Mesh {
    let soup = parse(text.as_bytes(), WITH_NORMALS).unwrap_or_else(|finding| panic!("{finding:?} in {text}"));
    let mut findings = soup.findings;
    let triangles = soup.faces.cut(&soup.positions, &mut findings).unwrap();
    (soup.positions, soup.normals, triangles, findings.into_iter().map(|finding| finding.what).collect())
}

#[test]
fn the_keyword_the_counts_and_comments_may_stand_in_any_of_their_places() {
    let square = vec![Vec3::ZERO, Vec3::X, Vec3::new(1., 1., 0.), Vec3::Y];
    for head in
        ["OFF\n4 1 4\n", "OFF 4 1 4\n", "OFF4 1 4 # c\n", "# c\n\n  OFF # c\n#c\n4 1\n", "4 1 0\n", "OFF\r\n4 1 4\r\n"]
    {
        let (positions, normals, triangles, warnings) = read(&format!("{head}{VERTICES}# c\n4 0 1 2 3 # c\n"));
        assert_eq!((positions, normals), (square.clone(), None), "{head}");
        assert_eq!((triangles, warnings.len()), (vec![[0, 1, 2], [0, 2, 3]], 0), "{head} {warnings:?}");
    }
    assert_eq!(read(&format!("OFF\n4 1 4\n{VERTICES}4 0 1 2 3").replace('\n', "\r")).2.len(), 2);
}

#[test]
fn colours_and_texture_coordinates_are_passed_over_and_normals_are_read() {
    let colours = "COFF\n3 1 0\n0 0 0 255 0 0 255\n1 0 0 0.5 0 0\n0 1 0 # none\n3 0 1 2 0.1 0.2 0.3\n";
    assert_eq!(read(colours).2, [[0, 1, 2]]);
    let normals = "STCNOFF\n3 1 0\n0 0 0 0 0 1 9 9 9 9 .5 .5\n1 0 0 0 1 0\n0 1 0 1 0 0\n3 0 1 2\n";
    let (positions, found, ..) = read(normals);
    assert_eq!((positions[1], found), (Vec3::X, Some(vec![Vec3::Z, Vec3::Y, Vec3::X])));
    let unwanted = parse(normals.as_bytes(), Attributes::default()).unwrap();
    assert_eq!((unwanted.positions[2], unwanted.normals), (Vec3::Y, None));
}

#[test]
fn many_rows_with_comments_and_colours_among_them_are_read_in_order() {
    let n = 20_000_u32;
    let mut text = format!("COFF\n{} {n} 0\n", n + 2);
    for i in 0..n + 2 {
        text += &format!("{} {} 0.5 1 0 0\n", i / 2, i % 2);
        if i % 5000 == 77 {
            text += "# a comment\n";
        }
    }
    for i in 0..n {
        text += &if i % 3 == 0 {
            format!("3 {i} {} {} 7\n", i + 1, i + 2)
        } else {
            format!("3\t{i} {} {}\n", i + 1, i + 2)
        };
        if i % 7000 == 1 {
            text += "  # another\n\n";
        }
    }
    let (positions, _, triangles, warnings) = read(&text);
    assert!(positions.iter().enumerate().all(|(i, p)| *p == Vec3::new((i / 2) as f32, (i % 2) as f32, 0.5)));
    assert!(triangles.iter().zip(0..).all(|(triangle, i)| *triangle == [i, i + 1, i + 2]));
    assert_eq!((positions.len(), triangles.len(), warnings.len()), (n as usize + 2, n as usize, 0));
}

#[test]
fn what_is_not_read_or_not_right_is_refused_with_its_line() {
    let rows = format!("{VERTICES}4 0 1 2 3\n");
    let cases = [
        (format!("OFF BINARY\n4 1 4\n{rows}"), 1, "binary OFF files are not read"),
        (format!("4OFF\n4 1 4\n{rows}"), 1, "OFF files with other than three coordinates are not read"),
        (format!("nOFF 3\n4 1 4\n{rows}"), 1, "OFF files with other than three coordinates are not read"),
        (format!("OFF\n-4 1 4\n{rows}"), 2, "the number of vertices is missing or none"),
        (format!("OFF\n4 x 4\n{rows}"), 2, "the number of faces is missing or none"),
        ("OFF\n4".to_owned(), 2, "the number of faces is missing or none"),
        (format!("OFF\n9223372036854775808 1 4\n{rows}"), 2, "the number of vertices is missing or none"),
        (format!("OFF\n3000000000 1 4\n{rows}"), 2, "too many vertices"),
        (format!("OFF\n5 1 4\n{rows}"), 8, "the file ends inside a row"),
        (format!("OFF\n4 2 4\n{rows}"), 8, "the file ends inside a row"),
        (format!("OFF\n4 1 4\n{VERTICES}4 0 1 2 4\n"), 7, "an index names a vertex that does not exist"),
        (format!("OFF\n4 1 4\n{VERTICES}4 0 1 2\n"), 7, "a list is longer than the rest of the file"),
        (format!("OFF\n4 1 4\n{VERTICES}-1 0 1 2\n"), 7, "a list has no such length"),
        (format!("OFF\n4 1 4\n{VERTICES}4000000000 0 1 2\n"), 7, "a list is longer than the rest of the file"),
        ("OFF\n1 0 0\n0 zero 0\n".to_owned(), 3, "this is not a number"),
    ];
    for (text, line, what) in cases {
        let finding = parse(text.as_bytes(), WITH_NORMALS).unwrap_err();
        let At::Line(at) = finding.at else { panic!("{finding:?}") };
        assert_eq!((text[..at].matches('\n').count() + 1, finding.what.as_str()), (line, what), "{text}");
    }
}
