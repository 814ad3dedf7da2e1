//! Vertex normals that a file gives, made fit for use.

use glam::Vec3;
use rayon::prelude::*;

use super::super::normals::smooth_normals;
use super::finding::{Finding, counted};

/// Brings normals to unit length. Those that have no direction, being zero or not finite, are replaced by those that
/// the faces give, and counted.
pub(super) fn mend(normals: &mut [Vec3], positions: &[Vec3], triangles: &[[u32; 3]]) -> Option<Finding> {
    let n_without: usize = normals
        .par_iter_mut()
        .map(|normal| {
            // In f64, where no square of an f32 overflows or vanishes.
            *normal = normal.as_dvec3().try_normalize().map_or(Vec3::ZERO, |unit| unit.as_vec3());
            usize::from(*normal == Vec3::ZERO)
        })
        .sum();
    if n_without == 0 {
        return None;
    }
    let smooth = smooth_normals(positions, triangles);
    normals.par_iter_mut().zip(smooth).filter(|(normal, _)| **normal == Vec3::ZERO).for_each(|(normal, smooth)| {
        *normal = smooth;
    });
    let normals = counted(n_without, "vertex normal is", "vertex normals are");
    Some(Finding::file(format!("{normals} zero or not finite; the faces' are used in place")).defect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_come_out_of_unit_length_and_what_has_no_direction_follows_the_faces() {
        let positions = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let mut normals = vec![Vec3::new(3e38, 0.0, 3e38), Vec3::ZERO, Vec3::new(f32::NAN, 0.0, 1.0)];
        let finding = mend(&mut normals, &positions, &[[0, 1, 2]]).unwrap();
        assert!(normals[0].abs_diff_eq(Vec3::new(1.0, 0.0, 1.0).normalize(), 1e-6), "{normals:?}");
        assert_eq!(normals[1..], [Vec3::Z, Vec3::Z]);
        assert_eq!(finding.what, "2 vertex normals are zero or not finite; the faces' are used in place");
        let mut tiny = vec![Vec3::new(0.0, 1e-45, 0.0); 3];
        assert!(mend(&mut tiny, &positions, &[[0, 1, 2]]).is_none());
        assert_eq!(tiny, [Vec3::Y; 3]);
    }
}
