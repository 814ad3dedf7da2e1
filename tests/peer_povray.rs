//! One scene against POV-Ray 3.7 (16-bit linear PNG) and an independent double-precision renderer (PFM).
//!
//! The scene: a mirroring sphere, an ellipsoid, a plane (two quadrics) and 6598 smooth triangles under two lights. It
//! stands in `../shared/data/peers`, as POV-Ray has it (`seed1.pov`) and as a plain listing (`seed1.sc`):
//!
//! | line | numbers |
//! |---|---|
//! | `cam` | width, height, vertical field of view in degrees, `depth` and the longest chain of rays |
//! | `light` | position, intensity |
//! | `mat` | O_a, O_d, O_s (RGB each), k_a, k_d, k_s, shininess; for all objects that follow |
//! | `sphere` | centre, radius |
//! | `quadric` | entries of the symmetric matrix: xx yy zz xy yz xz x y z 1 |
//! | `tri` | 1 for smooth, three corners, three normals |

mod shared_data;
/// Building worlds and rendering them.
mod world_kit {
    pub mod rendering;
    pub mod settings;
}

use std::fs;
use std::path::Path;

use flatray::film::{Film, read_image};
use flatray::measure::difference::{Difference, compare};
use flatray::render::Settings;
use flatray::world::{Camera, Material, MaterialId, MeshInput, ObjectId, World};
use glam::{DMat4, DVec3, Vec3};
use shared_data::shared;
use world_kit::rendering::render_world;
use world_kit::settings::center_settings;

struct Peer {
    world: World,
    camera: Camera,
    max_depth: u32,
}

fn vectors(numbers: &[f64]) -> Vec<DVec3> {
    numbers.chunks_exact(3).map(DVec3::from_slice).collect()
}

/// Reads the listing into a world through the library's own tables.
fn parse_listing(text: &str) -> Peer {
    let mut world = World::default();
    let mut camera = None;
    let mut material = MaterialId::default();
    let (mut corners, mut normals): (Vec<Vec3>, Vec<Vec3>) = (Vec::new(), Vec::new());
    for (object, line) in text.lines().enumerate() {
        let object = ObjectId(object as u32);
        let (kind, rest) = line.split_once(' ').unwrap();
        let n: Vec<f64> = rest.split(' ').filter(|word| *word != "depth").map(|word| word.parse().unwrap()).collect();
        match kind {
            "cam" => camera = Some((n[0] as u32, n[1] as u32, n[2], n[3] as u32)),
            "light" => world.lights.add(DVec3::from_slice(&n), DVec3::splat(n[3])),
            "mat" => {
                let colors = vectors(&n[..9]);
                material = world.materials.add(&Material {
                    ambient: colors[0],
                    diffuse: colors[1],
                    specular: colors[2],
                    k_a: n[9],
                    k_d: n[10],
                    k_s: n[11],
                    reflectance: None,
                    shininess: n[12],
                    ..Material::default()
                });
            }
            "sphere" => world.spheres.add(DVec3::from_slice(&n), n[3], material, object),
            "quadric" => {
                let [a, b, c, d, e, f, g, h, i, j] = n[..] else { panic!("{line}") };
                let rows = [[a, d, f, g], [d, b, e, h], [f, e, c, i], [g, h, i, j]];
                world.quadrics.add(DMat4::from_cols_array_2d(&rows), material, object);
            }
            "tri" => {
                assert_eq!(n[0], 1.0, "a smooth triangle");
                let points = vectors(&n[1..]);
                corners.extend(points[..3].iter().map(|p| p.as_vec3()));
                normals.extend(points[3..].iter().map(|p| p.as_vec3()));
            }
            _ => panic!("{line}"),
        }
    }
    // All triangles come last and have one material.
    let triangles = (0..corners.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    let mesh = MeshInput { positions: corners, triangles, normals: Some(normals), material, ..MeshInput::default() };
    let (_, dropped) = world.add_mesh(mesh).unwrap();
    assert_eq!((dropped.non_finite, dropped.zero_area, world.triangles.len()), (0, 0, 6598));

    let (width_px, height_px, fov_y_degrees, max_depth) = camera.unwrap();
    let fov_y_radians = fov_y_degrees.to_radians();
    let camera = Camera { world_from_camera: DMat4::IDENTITY, fov_y_radians, width_px, height_px };
    Peer { world, camera, max_depth }
}

/// Our image of the scene.
fn render_peer(listing: &Path) -> Film {
    let Peer { world, camera, max_depth } = parse_listing(&fs::read_to_string(listing).unwrap());
    assert_eq!((camera.width_px, camera.height_px, max_depth), (640, 480, 5));
    render_world(&world, &camera, &Settings { max_depth, ..center_settings(&camera) }).film
}

/// The limits: 2e-5 on 99.9 % of pixels, and no more than 0.01 % of them beyond 1e-3.
fn assert_agrees(ours: &Film, theirs: &Film, peer: &str) {
    let difference: Difference = compare(ours, theirs).unwrap();
    let (a, b) = (ours.color_planes().unwrap(), theirs.color_planes().unwrap());
    let is_far = |index: &usize| (0..3).any(|c| (a[c].samples.get(*index) - b[c].samples.get(*index)).abs() > 1e-3);
    let n_far = (0..ours.n_pixels()).filter(is_far).count();
    let n_lit = (0..ours.n_pixels()).filter(|&index| b[1].samples.get(index) > 0.0).count();
    assert!(n_lit > ours.n_pixels() / 2, "{peer}: only {n_lit} pixels of the reference show anything");
    assert!(difference.p999 <= 2e-5, "{peer}: {difference:?}");
    assert!(n_far * 10_000 <= ours.n_pixels(), "{peer}: {n_far} pixels differ by more than 1e-3; {difference:?}");
}

#[test]
fn the_image_agrees_with_pov_rays_and_with_an_independent_renderers() {
    let Some(listing) = shared("peers/seed1.sc") else { return };
    let ours = render_peer(&listing);
    // The file says that it is linear (gAMA 1.0); a 16-bit file ends at 1, and so does this picture.
    let pov = read_image(listing.with_file_name("pov1.png"), None).unwrap();
    assert_agrees(&ours, &pov.film, "POV-Ray");
    let reference = read_image(listing.with_file_name("ref1.pfm"), None).unwrap();
    assert_agrees(&ours, &reference.film, "reference");
}
