//! What lies on either side of a plane: boxes that the tree is made of, so that nothing of a triangle may lie outside.

use glam::Vec3;

use super::Space;
use crate::accel::piece::{Piece, clip_error};

/// Boxes, inside of the one given, around what of a triangle lies in it on either side of a plane; empty where nothing does.
///
/// Whatever the box, the triangle is cut as it was: errors do not add up (`docs/NUMERICS.md`, "Boxes of pieces").
pub fn cut(corners: [Vec3; 3], within: Space, axis: usize, at: f32) -> [Space; 2] {
    let corners = corners.map(|corner| corner.as_dvec3());
    let plane = f64::from(at);
    let error = clip_error(&corners);
    let (mut low, mut high) = (Piece::EMPTY, Piece::EMPTY);
    for i in 0..3 {
        let (a, b) = (corners[i], corners[(i + 1) % 3]);
        let (at_a, at_b) = (a[axis] - plane, b[axis] - plane);
        if at_a <= 0.0 {
            low.include(a, error);
        }
        if at_a >= 0.0 {
            high.include(a, error);
        }
        if at_a * at_b < 0.0 {
            let crossing = a + (b - a) * (at_a / (at_a - at_b));
            low.include(crossing, error);
            high.include(crossing, error);
        }
    }
    let whole = within.bounds();
    let inside = |piece: &Piece| piece.bounds(whole).map_or(Space::NONE, |b| Space::of(&b).common(within));
    // The plane is a number of f32, so that it bounds both sides as it is.
    [inside(&low).between(axis, f32::NEG_INFINITY, at), inside(&high).between(axis, at, f32::INFINITY)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::generate::hash_unit;
    use glam::DVec3;

    fn around(corners: [Vec3; 3]) -> Space {
        corners.iter().fold(Space::NONE, |space, &corner| space.union(Space::point(corner.into())))
    }

    fn holds(space: &Space, p: DVec3) -> bool {
        let (lo, hi) = (Vec3::from(space.lo).as_dvec3(), Vec3::from(space.hi).as_dvec3());
        p.cmpge(lo).all() && p.cmple(hi).all()
    }

    #[test]
    fn all_of_a_triangle_lies_on_either_side_however_often_it_is_cut() {
        let mut n_apart = 0;
        for i in 0..2000_u64 {
            let unit = |k: u64| hash_unit(i * 64 + k) as f32 - 0.5;
            // Of all sizes, near and far, some of them thin.
            let size = 2.0_f32.powi((i % 60) as i32 - 30);
            let far = if i % 3 == 0 { Vec3::new(unit(20), unit(21), unit(22)) * 1e3 } else { Vec3::ZERO };
            let corner = |k: u64| size * (far + Vec3::new(unit(k), unit(k + 1), unit(k + 2)));
            let (a, b) = (corner(0), corner(3));
            let c = if i % 5 == 0 { 0.5 * (a + b) } else { corner(6) };
            let corners = [a, b, c];
            let mut spaces = vec![around(corners)];
            for k in 0..4 {
                let axis = (i + k) as usize % 3;
                let cut_all = spaces.iter().flat_map(|space| {
                    let share = hash_unit(i * 64 + 32 + k) as f32;
                    let at = space.lo[axis] + share * (space.hi[axis] - space.lo[axis]);
                    cut(corners, *space, axis, at)
                });
                spaces = cut_all.filter(|space| !space.is_empty()).collect();
            }
            n_apart += usize::from(spaces.len() > 1);
            let [a, b, c] = corners.map(|corner| corner.as_dvec3());
            for u in 0..=10 {
                for v in 0..=10 - u {
                    let p = a + (b - a) * (f64::from(u) / 10.0) + (c - a) * (f64::from(v) / 10.0);
                    assert!(spaces.iter().any(|space| holds(space, p)), "{i}: {p} of {corners:?}");
                }
            }
        }
        assert!(n_apart > 1800, "{n_apart} triangles were cut");
    }

    #[test]
    fn boxes_are_tight_and_end_at_the_plane() {
        let corners = [Vec3::ZERO, Vec3::new(4.0, 4.0, 0.0), Vec3::new(4.0, 4.0, 1.0)];
        let [low, high] = cut(corners, around(corners), 0, 1.0);
        assert_eq!((low.lo.x, low.hi.x, high.lo.x, high.hi.x), (0.0, 1.0, 1.0, 4.0));
        // The error of clipping is far below the rounding to f32, outwards by a unit in the last place.
        assert_eq!((low.hi.y, low.hi.z), (1.0_f32.next_up(), 0.25_f32.next_up()), "{low:?}");
        assert_eq!((high.lo.y, high.hi.z), (1.0_f32.next_down(), 1.0), "{high:?}");
    }

    #[test]
    fn a_triangle_beside_or_in_the_plane_and_one_that_f32_just_holds() {
        let corners = [Vec3::ZERO, Vec3::Y, Vec3::Z];
        let [low, high] = cut(corners, around(corners), 0, -1.0);
        assert!(low.is_empty() && !high.is_empty());
        let [low, high] = cut(corners, around(corners), 0, 0.0);
        assert!(!low.is_empty() && !high.is_empty());
        let corners = [Vec3::splat(f32::MIN), Vec3::splat(f32::MAX), Vec3::new(f32::MAX, 0.0, 0.0)];
        let sides = cut(corners, around(corners), 1, 1.0);
        assert!(sides.iter().all(|side| !side.is_empty() && side.lo.is_finite() && side.hi.is_finite()));
    }
}
