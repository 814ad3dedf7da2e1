use glam::DVec3;

use super::*;
use crate::scene::normals::smooth_normals;

fn cube() -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let positions = (0..8).map(|i| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32)).collect();
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    (positions, quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect())
}

fn split(mesh: &(Vec<Vec3>, Vec<[u32; 3]>), weight: Weight, degrees: f64) -> Creased {
    split_at_creases(mesh.0.clone(), mesh.1.clone(), weight, degrees)
}

fn face_normal(positions: &[Vec3], face: [u32; 3]) -> DVec3 {
    let [a, b, c] = face.map(|vertex| positions[vertex as usize].as_dvec3());
    (b - a).cross(c - a).normalize()
}

/// Random heights over a grid.
fn crumpled() -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let n = 40;
    let height = |i: u32| (i.wrapping_mul(2_654_435_769) >> 24) as f32 / 256.0;
    let positions = (0..n * n).map(|i| Vec3::new((i % n) as f32, (i / n) as f32, height(i))).collect();
    let squares = (0..(n - 1) * (n - 1)).map(|i| i % (n - 1) + n * (i / (n - 1)));
    (positions, squares.flat_map(|a| [[a, a + 1, a + n], [a + 1, a + n + 1, a + n]]).collect())
}

#[test]
fn a_cube_is_sharp_below_90_degrees_and_round_from_there_on() {
    let sharp = split(&cube(), Weight::Angle, 89.9);
    assert_eq!(sharp.positions.len(), 24);
    for &face in &sharp.triangles {
        let expected = face_normal(&sharp.positions, face).as_vec3();
        assert!(face.iter().all(|&vertex| sharp.normals[vertex as usize] == expected), "{face:?}");
    }
    let round = split(&cube(), Weight::Angle, 90.0);
    assert_eq!((round.positions.len(), &round.triangles), (8, &cube().1));
    // By angle, each of the three sides counts the same however it is cut.
    for (position, normal) in round.positions.iter().zip(&round.normals) {
        assert!(normal.abs_diff_eq((position - Vec3::splat(0.5)).normalize(), f32::EPSILON), "{position} {normal}");
    }
}

#[test]
fn without_creases_the_normals_are_those_of_plain_smoothing() {
    let mesh = crumpled();
    for weight in [Weight::Uniform, Weight::Area, Weight::Angle] {
        let creased = split(&mesh, weight, 180.0);
        assert_eq!((&creased.positions, &creased.triangles), (&mesh.0, &mesh.1));
        assert_eq!(creased.normals, FaceNormals::new(&mesh.0, &mesh.1).smooth_normals(weight));
    }
    assert_eq!(split(&mesh, Weight::Uniform, 180.0).normals, smooth_normals(&mesh.0, &mesh.1));
}

#[test]
fn corners_share_a_row_exactly_when_a_chain_of_gentle_edges_around_their_vertex_joins_their_faces() {
    let (positions, triangles) = crumpled();
    let degrees = 25.0_f64;
    let creased = split(&(positions.clone(), triangles.clone()), Weight::Area, degrees);
    let is_gentle = |a: usize, b: usize| {
        let [a, b] = [a, b].map(|face| face_normal(&positions, triangles[face]));
        a.dot(b).clamp(-1.0, 1.0).acos().to_degrees() <= degrees
    };
    let mut n_split = 0;
    for vertex in 0..positions.len() as u32 {
        let faces: Vec<usize> = (0..triangles.len()).filter(|&face| triangles[face].contains(&vertex)).collect();
        // Everything that can be reached, by repeated search.
        let mut fan: Vec<usize> = (0..faces.len()).collect();
        for _ in 0..faces.len() {
            for a in 0..faces.len() {
                for b in 0..faces.len() {
                    let shared = triangles[faces[a]].iter().filter(|v| triangles[faces[b]].contains(v)).count();
                    if shared == 2 && is_gentle(faces[a], faces[b]) {
                        fan[a] = fan[a].min(fan[b]);
                        fan[b] = fan[a];
                    }
                }
            }
        }
        let row = |face: usize| {
            let corner = triangles[face].iter().position(|&v| v == vertex).unwrap();
            creased.triangles[face][corner]
        };
        for a in 0..faces.len() {
            for b in 0..faces.len() {
                assert_eq!(row(faces[a]) == row(faces[b]), fan[a] == fan[b], "vertex {vertex}");
            }
            assert_eq!(creased.positions[row(faces[a]) as usize], positions[vertex as usize]);
        }
        n_split += usize::from(fan.iter().any(|&f| f != fan[0]));
    }
    assert!((100..1500).contains(&n_split), "{n_split}");
    assert!(creased.normals.iter().all(|normal| (normal.length() - 1.0).abs() <= 2.0 * f32::EPSILON));
}

#[test]
fn faces_that_meet_at_a_vertex_alone_are_fans_of_their_own_and_those_without_area_join_nothing() {
    let positions = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::NEG_X, Vec3::NEG_Y, Vec3::splat(f32::NAN)];
    let triangles = vec![[0, 1, 0], [0, 1, 2], [0, 3, 4], [0, 2, 5], [1, 1, 1]];
    let creased = split_at_creases(positions, triangles, Weight::Uniform, 180.0);
    assert_eq!(creased.triangles, [[0, 1, 0], [0, 1, 2], [6, 3, 4], [0, 2, 5], [1, 1, 1]]);
    assert_eq!(creased.positions[6], Vec3::ZERO);
    assert!(creased.normals.iter().all(|&normal| normal == Vec3::Z), "{:?}", creased.normals);
}

#[test]
fn an_edge_of_very_many_faces_joins_none_and_takes_no_time() {
    let n = 100_000;
    let positions = (0..n + 2).map(|i| Vec3::new(i as f32, (i % 997) as f32, 1.0)).collect();
    let triangles = (0..n).map(|i| [0, 1, i + 2]).collect();
    let creased = split_at_creases(positions, triangles, Weight::Uniform, 180.0);
    assert!(creased.positions.len() > 2 * n as usize);
}

#[test]
fn threads_do_not_show() {
    let with = |n_threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().unwrap();
        let creased = pool.install(|| split(&crumpled(), Weight::Angle, 20.0));
        (creased.positions, creased.triangles, creased.normals)
    };
    assert_eq!(with(1), with(5));
}
