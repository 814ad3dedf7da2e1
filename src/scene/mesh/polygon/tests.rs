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

// An independent oracle: exact integers, and nothing of the cutter.

type Point = (i64, i64);

/// Twice the signed area of a triangle; coordinates below 2³⁰ cannot overflow it.
fn turn(a: Point, b: Point, c: Point) -> i64 {
    (b.0 - a.0) * (c.1 - a.1) - (b.1 - a.1) * (c.0 - a.0)
}

fn is_on(p: Point, a: Point, b: Point) -> bool {
    let between = |x: i64, from: i64, to: i64| x >= from.min(to) && x <= from.max(to);
    turn(a, b, p) == 0 && between(p.0, a.0, b.0) && between(p.1, a.1, b.1)
}

/// Whether two segments have a point in common.
fn meet(a: Point, b: Point, c: Point, d: Point) -> bool {
    let crosses =
        turn(a, b, c).signum() * turn(a, b, d).signum() < 0 && turn(c, d, a).signum() * turn(c, d, b).signum() < 0;
    crosses || is_on(a, c, d) || is_on(b, c, d) || is_on(c, a, b) || is_on(d, a, b)
}

/// Whether the insides of two counter-clockwise triangles have no point in common: an edge of one has the other behind it.
fn are_apart(a: [Point; 3], b: [Point; 3]) -> bool {
    let separates =
        |a: [Point; 3], b: [Point; 3]| (0..3).any(|edge| b.iter().all(|&p| turn(a[edge], a[(edge + 1) % 3], p) <= 0));
    separates(a, b) || separates(b, a)
}

/// A ring that neither touches nor crosses itself, grown corner by corner on a grid; small grids give many corners on
/// straight edges.
fn random_ring(n_corners: usize, grid: usize, random: &mut impl FnMut(usize) -> usize) -> Vec<Point> {
    let mut ring: Vec<Point> = Vec::new();
    while ring.len() < 3 || turn(ring[0], ring[1], ring[2]) == 0 {
        ring = (0..3).map(|_| (random(grid) as i64, random(grid) as i64)).collect();
    }
    for _ in 0..50 * n_corners {
        let n = ring.len();
        if n == n_corners {
            break;
        }
        let edge = random(n);
        let (a, b, p) = (ring[edge], ring[(edge + 1) % n], (random(grid) as i64, random(grid) as i64));
        let is_free = (0..n).filter(|&other| other != edge).all(|other| {
            let (c, d) = (ring[other], ring[(other + 1) % n]);
            // Neighbours share a corner, and may not have more in common.
            let before = !meet(a, p, c, d) || (d == a && !is_on(p, c, d) && !is_on(c, a, p));
            let after = !meet(p, b, c, d) || (c == b && !is_on(p, c, d) && !is_on(d, p, b));
            before && after
        });
        let folds_back = p == a || p == b || is_on(a, p, b) || is_on(b, a, p);
        if is_free && !folds_back {
            ring.insert(edge + 1, p);
        }
    }
    ring
}

/// Checks a cut of a ring without self-contact, some corners of which may be written more than once in a row.
fn check_cut(ring: &[Point], place: impl Fn(Point) -> Vec3) {
    let positions: Vec<Vec3> = ring.iter().map(|&point| place(point)).collect();
    let triangles = cut(&positions);
    let mut corners = ring.to_vec();
    corners.dedup();
    while corners.len() > 1 && corners[0] == corners[corners.len() - 1] {
        corners.pop();
    }
    assert_eq!(triangles.len(), corners.len() - 2, "{ring:?}");
    let n = corners.len();
    let whole: i64 = (0..n).map(|i| turn((0, 0), corners[i], corners[(i + 1) % n])).sum();
    let parts: Vec<[Point; 3]> = triangles
        .iter()
        .map(|triangle| {
            let [a, b, c] = triangle.map(|corner| ring[corner as usize]);
            assert!(turn(a, b, c) * whole.signum() > 0, "{triangle:?} is turned or has no area: {ring:?}");
            if whole > 0 { [a, b, c] } else { [c, b, a] }
        })
        .collect();
    assert_eq!(parts.iter().map(|&[a, b, c]| turn(a, b, c)).sum::<i64>(), whole.abs(), "{ring:?}");
    for (i, &a) in parts.iter().enumerate() {
        assert!(parts[i + 1..].iter().all(|&b| are_apart(a, b)), "triangles overlap: {ring:?}");
    }
}

#[test]
fn random_rings_with_straight_and_repeated_corners_are_cut_as_exact_integers_say() {
    let mut state = 5_u64;
    let mut random = |below: usize| {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 33) as usize % below
    };
    let mut n_most = 0;
    for round in 0..3000 {
        let grid = [4, 6, 10, 1 << 20][round % 4];
        let n_corners = 3 + random(40);
        let mut ring = random_ring(n_corners, grid, &mut random);
        n_most = n_most.max(ring.len());
        if round % 3 == 0 {
            for _ in 0..=random(4) {
                let corner = random(ring.len());
                ring.insert(corner, ring[corner]);
            }
        }
        if round % 2 == 0 {
            ring.reverse();
        }
        let turn = random(ring.len());
        ring.rotate_left(turn);
        // Flat in space, in the three planes and tilted: exact in f32 on small grids.
        let scale = if round % 5 == 0 { 2_f32.powi(-100) } else { 1.0 };
        check_cut(&ring, |(x, y)| scale * Vec3::new(x as f32, y as f32, 0.0));
        check_cut(&ring, |(x, y)| scale * Vec3::new(1.0, x as f32, y as f32));
        if grid <= 10 {
            check_cut(&ring, |(x, y)| scale * Vec3::new(y as f32, (2 * x - y) as f32, (x + 3 * y) as f32));
        }
    }
    assert!(n_most > 35, "{n_most}");
}

#[test]
fn gears_of_144_corners_are_cut_as_exact_integers_say() {
    for teeth in [36_usize, 18, 12] {
        let per_tooth = 144 / teeth;
        let mut gear: Vec<Point> = (0..144)
            .map(|i| {
                // Straight flanks, with corners on their middle where a tooth has more than four.
                let radius = if i % per_tooth < per_tooth / 2 { 1_000_000.0 } else { 780_000.0 };
                let angle = std::f64::consts::TAU * i as f64 / 144.0;
                ((radius * angle.cos()).round() as i64, (radius * angle.sin()).round() as i64)
            })
            .collect();
        for _ in 0..2 {
            check_cut(&gear, |(x, y)| Vec3::new(x as f32, y as f32, 0.0));
            check_cut(&gear, |(x, y)| Vec3::new(y as f32, 5.0, x as f32));
            check_cut(&gear, |(x, y)| Vec3::new(-7.0, x as f32, y as f32));
            gear.reverse();
            gear.rotate_left(7);
        }
    }
}
