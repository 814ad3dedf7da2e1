use super::*;

fn plane(points: &[(f32, f32)]) -> Vec<Vec3> {
    points.iter().map(|&(x, y)| Vec3::new(x, y, 0.0)).collect()
}

fn cut(positions: &[Vec3]) -> Vec<[u32; 3]> {
    let corners: Vec<u32> = (0..positions.len() as u32).collect();
    Cutter::new(corners.len()).cut(&corners, positions).unwrap().to_vec()
}

/// Twice the signed area; exact for small integers.
fn twice_area(positions: &[Vec3], corners: &[u32]) -> f64 {
    let at = |i: usize| positions[corners[i % corners.len()] as usize].as_dvec3();
    (0..corners.len()).map(|i| at(i).cross(at(i + 1)).z).sum()
}

/// The triangles all turn the way of the ring and cover its area once: for a simple ring of exact area, a proof.
fn assert_covers(positions: &[Vec3]) -> Vec<[u32; 3]> {
    let triangles = cut(positions);
    let corners: Vec<u32> = (0..positions.len() as u32).collect();
    let whole = twice_area(positions, &corners);
    let parts: Vec<f64> = triangles.iter().map(|corners| twice_area(positions, corners)).collect();
    assert!(parts.iter().all(|part| part * whole.signum() > 0.0), "{triangles:?} {parts:?}");
    assert_eq!(parts.iter().sum::<f64>(), whole, "{triangles:?}");
    triangles
}

#[test]
fn convex_polygons_become_a_fan() {
    let hexagon = plane(&[(2.0, 0.0), (4.0, 0.0), (6.0, 2.0), (4.0, 4.0), (2.0, 4.0), (0.0, 2.0)]);
    assert_eq!(assert_covers(&hexagon), [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]]);
}

#[test]
fn a_concave_quad_is_cut_at_its_notch_wherever_it_is_and_however_wound() {
    let mut dart = plane(&[(0.0, 0.0), (4.0, 0.0), (1.0, 1.0), (0.0, 4.0)]);
    for _ in 0..4 {
        assert_eq!(assert_covers(&dart).len(), 2);
        dart.rotate_left(1);
    }
    dart.reverse();
    assert_eq!(assert_covers(&dart).len(), 2);
}

#[test]
fn corners_on_a_straight_edge_are_used_in_triangles_with_area() {
    let positions = plane(&[(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (3.0, 0.0), (3.0, 3.0), (0.0, 3.0), (0.0, 1.0)]);
    assert_eq!(assert_covers(&positions).len(), 5);
    let thin = plane(&[(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (1.0, 1.0)]);
    assert_eq!(assert_covers(&thin).len(), 2);
}

#[test]
fn repeated_corners_are_skipped_also_across_the_ends() {
    let positions = plane(&[(0.0, 0.0), (0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (2.0, 2.0), (0.0, 2.0), (0.0, 0.0)]);
    assert_eq!(assert_covers(&positions).len(), 2);
}

#[test]
fn gears_and_combs_of_many_teeth_are_covered_once_in_any_axis_and_order() {
    let mut comb = Vec::new();
    for tooth in 0..100 {
        let x = 2.0 * tooth as f32;
        comb.extend([(x, 0.0), (x + 1.0, 50.0 + tooth as f32)]);
    }
    comb.extend([(200.0, 0.0), (200.0, -1.0), (0.0, -1.0)]);
    assert_eq!(assert_covers(&plane(&comb)).len(), comb.len() - 2);
    let sideways: Vec<(f32, f32)> = comb.iter().rev().map(|&(x, y)| (y, x)).collect();
    assert_eq!(assert_covers(&plane(&sideways)).len(), comb.len() - 2);
    // The same comb standing on the x-z and y-z planes gives the same cut.
    let flat = cut(&plane(&comb));
    let turned = |turn: fn(Vec3) -> Vec3| cut(&plane(&comb).into_iter().map(turn).collect::<Vec<_>>());
    assert_eq!(turned(|p| Vec3::new(p.z, p.x, p.y)), flat);
    assert_eq!(turned(|p| Vec3::new(p.y, p.z, p.x)), flat);
}

#[test]
fn long_combs_of_thousands_of_teeth_are_cut_in_either_direction() {
    let mut comb: Vec<(f32, f32)> =
        (0..5_000).flat_map(|tooth| [(2.0 * tooth as f32, 0.0), (2.0 * tooth as f32 + 1.0, 20_000.0)]).collect();
    comb.extend([(10_000.0, 0.0), (10_000.0, -1.0), (0.0, -1.0)]);
    let sideways: Vec<(f32, f32)> = comb.iter().rev().map(|&(x, y)| (y, x)).collect();
    for ring in [comb, sideways] {
        assert_eq!(assert_covers(&plane(&ring)).len(), ring.len() - 2);
    }
}

#[test]
fn random_star_shaped_polygons_are_covered_once() {
    let mut state = 1_u64;
    let mut random = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 40) as f32 / (1 << 24) as f32
    };
    for n in 3..120 {
        let ring: Vec<(f32, f32)> = (0..n)
            .map(|i| {
                let angle = std::f32::consts::TAU * i as f32 / n as f32;
                let radius = 100.0 + 9900.0 * random();
                // Whole numbers, so that areas are exact.
                ((radius * angle.cos()).round(), (radius * angle.sin()).round())
            })
            .collect();
        assert_covers(&plane(&ring));
    }
}

#[test]
fn a_ring_with_a_hole_cut_in_by_a_bridge_is_covered_once() {
    let positions = plane(&[
        (0.0, 0.0),
        (9.0, 0.0),
        (9.0, 9.0),
        (0.0, 9.0),
        (0.0, 0.0),
        (3.0, 3.0),
        (3.0, 6.0),
        (6.0, 6.0),
        (6.0, 3.0),
        (3.0, 3.0),
    ]);
    assert_eq!(assert_covers(&positions).len(), 8);
}

#[test]
fn a_ring_that_touches_itself_at_a_corner_is_covered_once() {
    // The notch from the top comes down to the corner of the bottom edge.
    let touching = [(0.0, 0.0), (4.0, 1.0), (8.0, 0.0), (8.0, 8.0), (5.0, 8.0), (4.0, 1.0), (3.0, 8.0), (0.0, 8.0)];
    assert_covers(&plane(&touching));
}

#[test]
fn tiny_and_far_away_notches_are_seen_exactly() {
    // One unit in the last place decides between convex and concave.
    let up = f32::from_bits(1.0_f32.to_bits() + 1);
    let notch = |y: f32| plane(&[(1.0, 1.0), (2.0, y), (3.0, 1.0), (3.0, 2.0), (1.0, 2.0)]);
    assert_eq!(cut(&notch(up)).len(), 3);
    assert!(cut(&notch(up)).iter().all(|corners| twice_area(&notch(up), corners) > 0.0));
    assert_eq!(cut(&notch(1.0)).len(), 3);
}

#[test]
fn polygons_without_area_or_with_crossings_end_and_stay_in_range() {
    let rings: [&[(f32, f32)]; 6] = [
        &[(1.0, 1.0); 7],
        &[(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (3.0, 0.0), (1.5, 0.0)],
        &[(0.0, 0.0), (2.0, 2.0), (2.0, 0.0), (0.0, 2.0)],
        &[(0.0, 3.0), (2.0, -3.0), (-3.0, 1.0), (3.0, 1.0), (-2.0, -3.0)],
        &[(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (2.0, 2.0), (6.0, 6.0), (0.0, 4.0)],
        &[(0.0, 0.0), (1.0, 0.0), (0.0, 0.0), (1.0, 0.0), (0.0, 1.0)],
    ];
    for ring in rings {
        let triangles = cut(&plane(ring));
        assert!(triangles.len() <= ring.len() - 2, "{triangles:?}");
        assert!(triangles.iter().flatten().all(|&corner| (corner as usize) < ring.len()));
    }
}

#[test]
fn a_polygon_with_a_non_finite_corner_becomes_a_fan() {
    let mut positions = plane(&[(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (-1.0, 0.5)]);
    positions[2].y = f32::NAN;
    assert_eq!(cut(&positions).len(), 3);
    positions[2].y = f32::INFINITY;
    assert_eq!(cut(&positions).len(), 3);
}

#[test]
fn a_polygon_of_a_hundred_thousand_corners_is_cut_without_a_hang() {
    let n = 100_000;
    let circle: Vec<(f32, f32)> = (0..n)
        .map(|i| {
            let angle = std::f64::consts::TAU * i as f64 / n as f64;
            let radius = if i % 2 == 0 { 1.0 } else { 0.9 };
            ((radius * angle.cos()) as f32, (radius * angle.sin()) as f32)
        })
        .collect();
    assert_eq!(cut(&plane(&circle)).len(), n - 2);
}

#[test]
fn a_hopeless_tangle_of_many_corners_is_given_up() {
    let n = 200_000_u64;
    let tangle: Vec<(f32, f32)> = (0..n)
        .map(|i| {
            let hash = i.wrapping_mul(0x9e37_79b9_7f4a_7c15);
            ((hash >> 40) as f32, (hash.wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 40) as f32)
        })
        .collect();
    let corners: Vec<u32> = (0..n as u32).collect();
    assert!(Cutter::new(corners.len()).cut(&corners, &plane(&tangle)).is_none());
}
