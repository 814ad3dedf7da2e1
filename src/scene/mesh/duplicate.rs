//! Faces that are there twice.

use glam::Vec3;
use rayon::prelude::*;

use super::weld::{self, Numbered, position_key};
use crate::numeric::triangle::is_degenerate;

/// How many faces have the three corners of one before them, position for position and in the same winding, whichever
/// corner comes first. Faces that no ray can hit, without area or with a corner that is not finite, do not count.
///
/// Linear in the number of faces, by all threads; it takes about as long as reading a binary file.
pub fn count_duplicate_faces(positions: &[Vec3], triangles: &[[u32; 3]]) -> usize {
    let Numbered { rows: places, keys: distinct } = weld::number(positions.len(), |row| [position_key(positions[row])]);
    drop(distinct);
    let place = |vertex: u32| places.get(vertex as usize).map_or(u32::MAX, |&[place]| place);
    let can_be_hit = |vertices: &&[u32; 3]| {
        let corners = vertices.map(|vertex| positions.get(vertex as usize).copied().unwrap_or(Vec3::NAN));
        corners.iter().all(|corner| corner.is_finite()) && !is_degenerate(corners)
    };
    let turned = |vertices: &[u32; 3]| {
        let [a, b, c] = vertices.map(place);
        let least = a.min(b).min(c);
        if least == a {
            [a, b, c]
        } else if least == b {
            [b, c, a]
        } else {
            [c, a, b]
        }
    };
    let faces: Vec<[u32; 3]> = triangles.par_iter().filter(can_be_hit).map(turned).collect();
    let Numbered { rows, keys } = weld::number(faces.len(), |row| [faces[row]]);
    rows.len() - keys.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_of_the_same_corners_in_any_rotation_are_duplicates_and_those_turned_over_are_not() {
        let positions = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z, -Vec3::ZERO, Vec3::X, Vec3::splat(f32::NAN)];
        let count = |faces: &[[u32; 3]]| count_duplicate_faces(&positions, faces);
        assert_eq!(count(&[]), 0);
        assert_eq!(count(&[[0, 1, 2], [1, 2, 0], [2, 0, 1], [4, 5, 2]]), 3, "also over vertices that are equal");
        assert_eq!(count(&[[0, 1, 2], [0, 2, 1], [0, 1, 3]]), 0);
        assert_eq!(count(&[[0, 1, 5], [0, 1, 5], [0, 1, 6], [0, 1, 6]]), 0, "what cannot be hit is counted elsewhere");
    }
}
