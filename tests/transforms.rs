//! Transforms of objects: exact where they can be, outward normals stay outward, spheres become what they must.

/// Building worlds and rendering them.
mod world_kit {
    pub mod hit;
}

use flatray::scene::{Compiled, Overrides, load_text};
use flatray::world::{PrimKind, Ray, World};
use glam::{DVec3, Vec3, dvec3};
use world_kit::hit::closest_hit;

fn compile(text: &str) -> Compiled {
    load_text(text, "test.toml", None, &Overrides::default()).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

/// The world of one object, given by its keys.
fn object(keys: &str) -> World {
    compile(&format!("[[hittable]]\n{keys}\n")).world
}

fn normal_at(world: &World, ray: Ray) -> DVec3 {
    let hit = closest_hit(world, ray);
    assert!(hit.is_some(), "{ray:?}");
    flatray::render::surface::describe(world, &ray, &hit).ng
}

/// The same hits, bit for bit, on a grid of rays from several sides.
fn assert_same_hits(a: &World, b: &World) {
    let mut n_hits = 0;
    for i in 0..400 {
        let from = 20.0 * dvec3(f64::from(i).sin(), f64::from(3 * i).cos(), f64::from(7 * i).sin());
        let to = dvec3(f64::from(i % 7) - 3.0, f64::from(i % 5) - 2.0, f64::from(i % 3) - 1.0);
        let ray = Ray::new(from, to - from);
        let (one, other) = (closest_hit(a, ray), closest_hit(b, ray));
        assert!(one.same_bits(&other), "{ray:?}: {one:?} {other:?}");
        n_hits += usize::from(one.is_some());
    }
    assert!(n_hits > 20, "{n_hits}");
}

#[test]
fn exact_transforms_give_the_rows_that_were_written_out() {
    let pairs = [
        (
            "type = \"sphere\"\nposition = [1, 0, 0.5]\nradius = 0.75\nscale = 2\nrotate = [0, 0, 90]\ntranslate = [1, -2, 0]",
            "type = \"sphere\"\nposition = [1, 0, 1]\nradius = 1.5",
        ),
        (
            "type = \"triangle\"\na = [0, 0, 0]\nb = [2, 0, 0]\nc = [0, 2, 1]\nrotate = [90, 0, 0]\ntranslate = [0.5, 0, 0]",
            "type = \"triangle\"\na = [0.5, 0, 0]\nb = [2.5, 0, 0]\nc = [0.5, -1, 2]",
        ),
        (
            "type = \"triangle\"\na = [0, 0, 0]\nb = [2, 0, 0]\nc = [0, 2, 1]\nscale = [-1, 1, 1]",
            "type = \"triangle\"\na = [0, 0, 0]\nb = [0, 2, 1]\nc = [-2, 0, 0]",
        ),
        (
            "type = \"mesh\"\nvertices = [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]\n\
             faces = [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]\n\
             world_from_object = [[0, -2, 0, 1], [4, 0, 0, 0], [0, 0, 0.5, -0.25]]",
            "type = \"mesh\"\nvertices = [[-1, 4, 0.25], [3, 4, -0.75], [-1, -4, -0.75], [3, -4, 0.25]]\n\
             faces = [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]",
        ),
        // x² + y² = 1 between z = 0 and 2, laid along x and moved.
        (
            "type = \"quadric\"\nA = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 0], [0, 0, 0, -1]]\n\
             clip_min = [-2, -2, 0]\nclip_max = [2, 2, 2]\nrotate = [0, 90, 0]\ntranslate = [-1, 0.5, 0]",
            "type = \"quadric\"\nA = [[0, 0, 0, 0], [0, 1, 0, -0.5], [0, 0, 1, 0], [0, -0.5, 0, -0.75]]\n\
             clip_min = [-1, -1.5, -2]\nclip_max = [1, 2.5, 2]",
        ),
        (
            "type = \"cylinder\"\nbase = [0, 0, 0]\ntop = [0, 0, 2]\nradius = 1\nrotate = [0, 90, 0]\ntranslate = [-1, 0.5, 0]",
            "type = \"cylinder\"\nbase = [-1, 0.5, 0]\ntop = [1, 0.5, 0]\nradius = 1",
        ),
        (
            "type = \"sphere\"\nposition = [0, 0, 0]\nradius = 0.5\nscale = [2, 4, 1]\ntranslate = [1, 0, 0]",
            "type = \"ellipsoid\"\nposition = [1, 0, 0]\nradii = [1, 2, 0.5]",
        ),
        (
            "type = \"plane\"\nposition = [0, 0.5, 0]\nnormal = [0, 2, 0]\nclip_min = [-1, 0, -2]\nclip_max = [1, 1, 2]",
            "type = \"quadric\"\nA = [[0, 0, 0, 0], [0, 0, 0, 0.5], [0, 0, 0, 0], [0, 0.5, 0, -0.5]]\n\
             clip_min = [-1, 0, -2]\nclip_max = [1, 1, 2]",
        ),
    ];
    for (transformed, written_out) in pairs {
        assert_same_hits(&object(transformed), &object(written_out));
    }
}

#[test]
fn a_sphere_stays_one_under_a_similarity_and_becomes_an_ellipsoid_otherwise() {
    let sphere = "type = \"sphere\"\nposition = [1, 2, 3]\nradius = 0.5\n";
    let turned = object(&format!("{sphere}scale = [2, -2, 2]\nrotate = [10, 20, 30]"));
    assert_eq!((turned.spheres.radii.as_slice(), turned.quadrics.len()), ([1.0].as_slice(), 0));
    let stretched = object(&format!("{sphere}scale = [2, 2, 2.5]"));
    assert_eq!((stretched.spheres.len(), stretched.quadrics.len()), (0, 1));
    assert!(stretched.quadrics.bounds[0].is_some());
    let hit = closest_hit(&stretched, Ray::new(dvec3(2.0, 4.0, 0.0), DVec3::Z));
    assert!((hit.t - 6.25).abs() < 1e-14, "{hit:?}");
}

#[test]
fn outward_stays_outward_when_a_transform_mirrors() {
    let tetrahedron = "type = \"mesh\"\nvertices = [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]\n\
                       faces = [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]\n";
    let ball = "type = \"ellipsoid\"\nposition = [0, 0, 0]\nradii = [1, 2, 1]\n";
    let cone = "type = \"cone\"\nbase = [0, -1, 0]\ntop = [0, 1, 0]\nradius = 1\n";
    for shape in [tetrahedron, ball, cone] {
        for scale in ["[1, 1, 1]", "[-1, 1, 1]", "[1, -3, 1]", "[-1, -1, -2]"] {
            let world = object(&format!("{shape}scale = {scale}\nrotate = [25, 50, 75]"));
            for i in 0..50 {
                let from = 9.0 * dvec3(f64::from(i).sin(), f64::from(i).cos(), f64::from(2 * i).sin());
                let ray = Ray::new(from, -from);
                if closest_hit(&world, ray).is_some() && shape != cone {
                    assert!(normal_at(&world, ray).dot(from) > 0.0, "{shape}{scale} from {from}");
                }
            }
        }
    }
}

#[test]
fn vertex_normals_follow_by_the_inverse_transpose() {
    let smooth = "type = \"triangle\"\na = [0, 0, 0]\nb = [1, 0, 0]\nc = [0, 1, 0]\n\
                  n_a = [0, 0, 1]\nn_b = [1, 0, 1]\nn_c = [0, 1, 1]\n";
    let world = object(&format!("{smooth}scale = [2, 1, -1]"));
    // Mirrored, the corners b and c change places; n_b = (1/2, 0, -1).
    assert_eq!(world.triangles.positions, [Vec3::ZERO, Vec3::X * 2.0, Vec3::Y]);
    assert_eq!(world.triangles.vertices, [[0, 2, 1]]);
    let n = |i: usize| world.triangles.normals[i].normalize();
    assert!(n(0).abs_diff_eq(Vec3::NEG_Z, 1e-7) && n(1).abs_diff_eq(Vec3::new(0.5, 0.0, -1.0).normalize(), 1e-7));
}

#[test]
fn shapes_far_from_the_origin_keep_their_radius() {
    let far = "base = [1e7, 0, 0]\ntop = [1e7, 3, 0]\nradius = 0.1";
    let world = object(&format!("type = \"cylinder\"\n{far}"));
    let ray = Ray::new(dvec3(1e7, 1.0, 5.0), DVec3::NEG_Z);
    assert!((closest_hit(&world, ray).t - 4.9).abs() < 1e-14);
    assert!(!closest_hit(&world, Ray::new(dvec3(1e7, 3.0f64.next_up(), 5.0), DVec3::NEG_Z)).is_some());
    assert_eq!(closest_hit(&world, ray).prim.kind(), PrimKind::Quadric);
    let moved = object("type = \"cylinder\"\nbase = [0, 0, 0]\ntop = [0, 3, 0]\nradius = 0.1\ntranslate = [1e7, 0, 0]");
    assert!(closest_hit(&moved, ray).same_bits(&closest_hit(&world, ray)));
}

#[test]
fn named_quadrics_are_bounded_and_so_is_a_plane_in_a_box() {
    let shapes = [
        "type = \"cylinder\"\nbase = [0, 0, 0]\ntop = [1, 2, 3]\nradius = 1",
        "type = \"cone\"\nbase = [0, 0, 0]\ntop = [1, 2, 3]\nradius = 1",
        "type = \"paraboloid\"\nbase = [0, 0, 0]\ntop = [1, 2, 3]\nradius = 1",
        "type = \"hyperboloid\"\nbase = [0, 0, 0]\ntop = [1, 2, 3]\nradius = 1\nwaist = 0.5",
        "type = \"ellipsoid\"\nposition = [0, 0, 0]\nradii = [1, 2, 3]",
        "type = \"plane\"\nposition = [0, 0, 0]\nnormal = [1, 2, 3]\nclip_min = [-1, -1, -1]\nclip_max = [1, 1, 1]",
    ];
    for shape in shapes {
        let bounds = object(&format!("{shape}\nrotate = [10, 20, 30]")).bounds().unwrap_or_else(|| panic!("{shape}"));
        assert!(bounds.extent().max_element() < 7.0, "{shape}: {bounds:?}");
    }
}
