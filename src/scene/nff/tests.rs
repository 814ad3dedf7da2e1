//! NFF texts and what becomes of them.

use std::path::Path;

use glam::{DVec3, Vec3};

use super::*;
use crate::world::{MaterialId, ObjectId};

const VIEW: &str = "v\nfrom 0 0 5\nat 0 0 0\nup 0 1 0\nangle 45\nhither 0.01\nresolution 512 512\n";

fn compiled(text: &str) -> Compiled {
    from_bytes(Path::new("t.nff"), text.as_bytes().to_vec(), &Overrides::default()).unwrap_or_else(|e| panic!("{e}"))
}

/// A view in front of the text, which then begins on line 8.
fn viewed(text: &str) -> Compiled {
    compiled(&format!("{VIEW}{text}"))
}

fn error(text: &str) -> String {
    from_bytes(Path::new("t.nff"), text.as_bytes().to_vec(), &Overrides::default()).unwrap_err().to_string()
}

fn warnings(scene: &Compiled) -> Vec<String> {
    scene.warnings.iter().map(ToString::to_string).collect()
}

#[test]
fn the_view_spans_the_centres_of_the_outer_rows_and_the_background_and_lights_arrive() {
    let scene = compiled(
        "b 0.1 0.2 0.3\nl 1 2 3\nl 4 5 6 0.5 0.25 1\nv from 1 2 8 at 1 2 3 up 0 3 0 angle 90 resolution 300 101\n",
    );
    let camera = &scene.camera;
    assert_eq!((camera.width_px, camera.height_px), (300, 101));
    // Slope 1 to the centre of the outer row, which lies 50 spacings from the middle; the image reaches 50.5.
    assert!(((0.5 * camera.fov_y_radians).tan() - 50.5 / 50.0).abs() < 1e-14);
    assert_eq!(camera.world_from_camera.transform_point3(-5.0 * DVec3::Z), DVec3::new(1.0, 2.0, 3.0));
    assert_eq!(scene.world.background, DVec3::new(0.1, 0.2, 0.3));
    assert_eq!(scene.world.lights.positions[1], DVec3::new(4.0, 5.0, 6.0));
    // √2/4 of two lights, and a colour as it is.
    assert!((scene.world.lights.intensities[0] - 0.5 * f64::sqrt(0.5)).abs().max_element() < 1e-15);
    assert_eq!(scene.world.lights.intensities[1], DVec3::new(0.5, 0.25, 1.0));
    assert!(scene.world.two_sided);
    assert_eq!(warnings(&scene), ["t.nff: the scene has no object (`s`, `c`, `p`, `pp`)"]);
}

#[test]
fn the_command_line_overrules_resolution_and_angle() {
    let overrides = Overrides { width_px: Some(40), height_px: Some(1), ..Overrides::default() };
    let load = |overrides| from_bytes(Path::new("t.nff"), VIEW.as_bytes().to_vec(), &overrides).unwrap().camera;
    let camera = load(overrides);
    assert_eq!((camera.width_px, camera.height_px), (40, 1));
    assert!((camera.fov_y_radians - 45f64.to_radians()).abs() < 1e-15, "one row gets the whole angle");
    assert_eq!(load(Overrides { fov_y_degrees: Some(60.0), ..overrides }).fov_y_radians, 60f64.to_radians());
    let wrong = Overrides { fov_y_degrees: Some(180.0), ..overrides };
    assert!(from_bytes(Path::new("t.nff"), VIEW.as_bytes().to_vec(), &wrong).is_err());
}

#[test]
fn a_fill_is_phong_without_ambient_and_equal_fills_are_one() {
    let scene = viewed(
        "l 0 9 0\nf 1 0.5 0.25 0.5 0.25 30 0.75 1.3\ns 0 0 0 1\nf 1 1 1 1 0 1 0 0\ns 1 0 0 1\nf 1 .5 .25 .5 .25 30 .75 1.3\ns 2 0 0 -2\n",
    );
    let (materials, spheres) = (&scene.world.materials, &scene.world.spheres);
    assert_eq!(materials.len(), 2);
    assert_eq!((materials.ambient[0], materials.diffuse[0]), (DVec3::ZERO, DVec3::new(0.5, 0.25, 0.125)));
    assert_eq!((materials.specular[0], materials.shininess[0]), (DVec3::splat(0.25), 30.0));
    assert_eq!((materials.reflectance[0], materials.transmittance[0], materials.ior[0]), (0.25, 0.75, 1.3));
    assert_eq!((materials.transmittance[1], materials.ior[1]), (0.0, 1.5), "an index that means nothing is not kept");
    assert_eq!(spheres.materials, [0, 1, 0].map(MaterialId));
    assert_eq!(spheres.objects, [0, 1, 0].map(ObjectId));
    assert_eq!(spheres.radii, [1.0, 1.0, 2.0], "both sides of a sphere with a negative radius are seen");
    assert_eq!(scene.names.materials, ["fill 0", "fill 1"]);
    assert_eq!(scene.names.objects.len(), 2);
    assert_eq!(warnings(&scene), [""; 0]);
}

#[test]
fn polygons_of_one_fill_in_a_row_are_one_mesh_and_concave_ones_are_cut_rightly() {
    let arrow = "p 4 0 0 0 2 0 0 0.5 0.5 0 0 2 0\n";
    let scene = viewed(&format!(
        "l 0 9 0\nf 1 1 1 1 0 1 0 0\n{arrow}p 3 0 0 1 1 0 1 0 1 1\ns 0 0 0 1\n{arrow}f 1 0 0 1 0 1 0 0\n{arrow}"
    ));
    let world = &scene.world;
    assert_eq!((world.meshes.len(), world.triangles.len(), world.spheres.len()), (2, 2 + 1 + 2 + 2, 1));
    assert_eq!(world.meshes.materials, [MaterialId(0), MaterialId(1)]);
    assert_eq!(world.meshes.first_normal, [None, None]);
    // The area is that of the arrow only if the cut goes through its dent.
    let area = |row: usize| {
        let [a, b, c] = world.triangles.corners(row);
        0.5 * (b - a).cross(c - a).z
    };
    assert_eq!(area(0) + area(1), 1.0);
    assert!(area(0) > 0.0 && area(1) > 0.0);
}

#[test]
fn patches_are_smooth_and_their_normals_say_where_the_front_is() {
    let scene = viewed(
        "l 0 9 0\nf 1 1 1 1 0 1 0 0\np 3 0 0 0 1 0 0 0 1 0\npp 3 0 0 0 0 0 2 1 0 0 0 1 1 0 1 0 0 0 1\n\
         pp 4 0 0 0 0 0 -1 1 0 0 0 0 -1 1 1 0 0 0 -1 0 1 0 0 0 0\n",
    );
    let world = &scene.world;
    assert_eq!((world.meshes.len(), world.triangles.len()), (2, 1 + 1 + 2));
    assert_eq!(world.meshes.first_normal, [None, Some(0)]);
    assert_eq!(world.triangles.normals[..2], [Vec3::Z, Vec3::new(0.0, 0.5f32.sqrt(), 0.5f32.sqrt())]);
    assert_eq!((world.triangles.ng(1), world.triangles.ng(2), world.triangles.ng(3)), (DVec3::Z, -DVec3::Z, -DVec3::Z));
    assert_eq!(
        warnings(&scene),
        [
            "t.nff:12: 1 normal of a patch is zero or not finite, and does not count",
            "t.nff:12: 1 patch runs clockwise about its normals and is turned round",
        ]
    );
}

#[test]
fn comments_end_words_and_lines_may_end_in_any_custom() {
    let text = "# a scene, in Latin-1: \u{e9}\r\nv from 0 0 5 at 0 0 0 # the eye\rup 0 1 0 angle 45 resolution 8 8\n\
                l 0 9 0#light\nf 1 1 1 1 0 1 0 0\ns 0 0 0 1#ball";
    let mut bytes = text.as_bytes().to_vec();
    // The accent as one byte, which is no UTF-8.
    let at = bytes.iter().position(|&b| b == 0xc3).unwrap();
    bytes.splice(at..at + 2, [0xe9]);
    let scene = from_bytes(Path::new("t.nff"), bytes, &Overrides::default()).unwrap();
    assert_eq!((scene.world.spheres.len(), scene.world.lights.len()), (1, 1));
}

#[test]
fn what_is_wrong_is_told_with_its_line() {
    let with_view = |text: &str| error(&format!("{VIEW}{text}"));
    let cases = [
        (
            "t 1 2\n",
            "t.nff:8: an unknown statement: found `t`, expected `v`, `b`, `l`, `f`, `s`, `c`, `p`, `pp` or a comment that begins with `#`",
        ),
        ("\ns 0 0 x 1", "t.nff:9: a number is missing: found `x`, expected a number, as in `s X Y Z RADIUS`"),
        ("s 0 0", "t.nff:8: a number is missing: found the end of the file, expected a number, as in `s X Y Z RADIUS`"),
        ("s 0 0 0 1 2", "t.nff:8: an unknown statement: found `2`"),
        (
            "p 1000000000\n0 0 0\n1 0 0\ns 0 0 0 1",
            "t.nff:11: a number is missing: found `s`, expected a number, as in `p CORNERS X Y Z …`",
        ),
        ("p -3 0 0 0", "t.nff:8: a whole number is missing or out of range: found `-3`"),
        ("p 3.5 0 0 0", "t.nff:8: a whole number is missing or out of range: found `3.5`"),
        ("p 99999999999999999999", "t.nff:8: a whole number is missing or out of range"),
        ("f 1 1 1 -1 0 1 0 0", "t.nff:8: Kd is out of range: found `-1`, expected a number from 0 to 3.4e38"),
        ("f 1 1 nan 1 0 1 0 0", "t.nff:8: a colour is out of range: found `nan`"),
        (
            "f 1 1 1 1 0 1 0.5 0",
            "t.nff:8: the index of refraction of a transparent fill is out of range: found 0, expected a number above 0",
        ),
        ("f 1e30 1 1 1e30 0 1 0 0", "t.nff:8: a colour times its weight is beyond the range of 32-bit floats"),
        ("c 0 0 0 1 0 0 1 -1", "t.nff:8: the radii of a cone have different signs: found 1 and -1"),
        ("l 1 2 inf", "t.nff:8: a coordinate is out of range: found `inf`"),
        (
            "l 1 2 3 0.5",
            "t.nff:8: a number is missing: found the end of the file, expected a number, as in `l X Y Z` or `l X Y Z R G B`",
        ),
        ("b 1 1", "t.nff:8: a number is missing"),
        ("v from 0 0 0 at 0 0 0 up 0 1 0 angle 45 resolution 8 8", "t.nff:8: the camera looks at its own position"),
        ("v from 0 0 0 at 0 0 1 up 0 0 1 angle 45 resolution 8 8", "t.nff:8: the camera looks along its up direction"),
        ("v from 0 0 0 at 0 0 1 up 0 1 0 angle 180 resolution 8 8", "t.nff:8: the angle is out of range: found `180`"),
        (
            "v from 0 0 0 at 0 0 1 up 0 1 0 angle 45 resolution 8 0",
            "t.nff:8: a whole number is missing or out of range: found `0`",
        ),
        ("v from 0 0 0 up 0 1 0 angle 45 resolution 8 8", "t.nff:8: the view has no `at`: expected"),
        (
            "v from 0 0 0 at 0 0 1 up 0 1 0 angle 45 resolution 65535 65535",
            "t.nff:8: the image is too large: found 65535 x 65535",
        ),
    ];
    for (text, expected) in cases {
        let message = with_view(text);
        assert!(message.starts_with(expected), "{text:?}\n{message}\n{expected}");
    }
    assert!(error("s 0 0 0 1").starts_with("t.nff: the scene has no view: expected `v`"));
    assert!(error("").starts_with("t.nff: the scene has no view"));
    assert!(error("\0\0\u{1}PNG").starts_with("t.nff:1: an unknown statement"));
}

#[test]
fn defects_of_the_geometry_are_counted_and_left_out() {
    let scene = viewed(
        "l 0 9 0\ns 0 0 0 1\nf 1 1 1 1 0 1 0 0\ns 0 0 0 0\ns nan 0 0 1\ns 1e39 0 0 1\nc 0 0 0 1 0 0 0 2\nc 0 0 0 0 0 1 0 0\n\
         p 3 0 0 0 1 0 0 2 0 0\np 3 0 0 0 inf 0 0 0 1 0\np 2 0 0 0 1 0 0\np 0\nl 1 1 1\n",
    );
    assert_eq!((scene.world.spheres.len(), scene.world.quadrics.len(), scene.world.triangles.len()), (1, 0, 0));
    assert_eq!(
        warnings(&scene),
        [
            "t.nff:9: objects before the first fill: they are light grey",
            "t.nff:11: 3 spheres without a radius or beyond the range of 32-bit floats left out",
            "t.nff:14: 2 cones without length or radius or beyond the range of 32-bit floats left out",
            "t.nff:18: 2 faces have fewer than three corners and are left out",
            "t.nff: 1 face with a NaN or infinite corner left out",
            "t.nff: 1 face without area left out",
        ]
    );
}

#[test]
fn the_last_of_several_views_is_used_with_a_warning() {
    let scene = viewed("l 0 9 0\ns 0 0 0 1\nv from 0 0 7 at 0 0 0 up 0 1 0 angle 45 resolution 8 9\n");
    assert_eq!((scene.camera.width_px, scene.camera.height_px), (8, 9));
    assert_eq!(warnings(&scene)[0], "t.nff:10: 1 view more than one: the last is used");
}

#[test]
fn an_nff_text_is_known_by_its_view() {
    assert!(is_nff(VIEW.as_bytes()));
    assert!(is_nff(b"# made by hand\nb 0 0 0\nl 1 2 3\nv\nat 0 0 0"));
    for other in ["", "v 0 0 0\nv 1 0 0\nf 1 2 3\n", "[camera]\nfov = 40", "ply\nformat ascii 1.0", "s 0 0 0 1", "v"] {
        assert!(!is_nff(other.as_bytes()), "{other}");
    }
}
