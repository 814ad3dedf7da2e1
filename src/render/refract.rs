//! Refraction by Snell's law: sin θₜ = η·sin θᵢ, with η the index of the side the ray comes from over that of the side it
//! goes to.
//!
//! With the unit normal n on the viewer's side, c = cos θᵢ = n·wo and the part of wo across the normal, p = wo − c·n, whose
//! length is s = sin θᵢ, the refracted direction is −η·p − cos θₜ·n. Two forms keep their digits where the usual ones,
//! s² = 1 − c² and cos²θₜ = 1 − η²·s², lose them:
//! - s² is |p|². Near normal incidence 1 − c² is the difference of two numbers near 1.
//! - cos²θₜ is c² + s²·(1 − η)·(1 + η), from c² + s² = 1. For η ≤ 1 it is a sum of positive terms, right to some u even where
//!   the ray grazes; in particular a surface of index 1 bends nothing. For η > 1 digits cancel towards the critical angle, as
//!   they must: there cos θₜ changes by any amount for the last digit of c.

use glam::DVec3;

/// The direction behind a surface, of unit length as `wo` is; `None` for total internal reflection, also at the critical
/// angle itself, where the refracted ray would run along the surface.
///
/// `wo` is the unit direction to the viewer; `ng` and `ns` are the unit geometric and shading normal, `ns` turned to either
/// side. The viewer is outside when `ng` points to his side. `ior` is the index of the inside over that of the outside.
///
/// Where the shading normal, turned to the viewer's side of the surface, still faces away from him (at the rim of a coarse
/// smooth mesh), the geometric normal stands in for it.
pub fn refracted(wo: DVec3, ng: DVec3, ns: DVec3, ior: f64) -> Option<DVec3> {
    let outside = ng.dot(wo) > 0.0;
    let eta = if outside { 1.0 / ior } else { ior };
    let ng = if outside { ng } else { -ng };
    let ns = if ns.dot(ng) < 0.0 { -ns } else { ns };
    let n = if ns.dot(wo) > 0.0 { ns } else { ng };
    let c = n.dot(wo);
    let p = wo - c * n;
    let cos2_t = c * c + p.length_squared() * ((1.0 - eta) * (1.0 + eta));
    // A NaN, of an index beyond the range of squares, is none either.
    (cos2_t > 0.0).then(|| -eta * p - cos2_t.sqrt() * n)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::U;

    /// A unit direction at an angle to +y, whose sine and cosine the test gives.
    fn towards(sine: f64, cosine: f64) -> DVec3 {
        DVec3::new(0.6 * sine, cosine, 0.8 * sine)
    }

    fn through(wo: DVec3, ior: f64) -> Option<DVec3> {
        refracted(wo, DVec3::Y, DVec3::Y, ior)
    }

    #[test]
    fn the_sines_are_in_the_ratio_of_the_indices_and_the_rays_in_one_plane() {
        for ior in [1.0, 1.1, 1.5, 2.4, 0.7] {
            for degrees in [1e-9, 0.01, 1.0, 20.0, 40.0] {
                let (sine, cosine) = libm::sincos(f64::to_radians(degrees));
                // Into the body from above and out of it from below.
                for (side, eta) in [(1.0, 1.0 / ior), (-1.0, ior)] {
                    let wo = towards(sine, side * cosine);
                    let Some(wt) = through(wo, ior) else {
                        assert!(eta * sine > 1.0, "{ior} {degrees} {eta}");
                        continue;
                    };
                    let sine_t = wt.x.hypot(wt.z);
                    assert!((sine_t - eta * sine).abs() <= 8.0 * U * eta * (sine + U), "{ior} {degrees}: {sine_t:e}");
                    assert!((wt.length() - 1.0).abs() < 1e-14 && wt.y * wo.y < 0.0, "{wt}");
                    assert!(wt.cross(wo).dot(DVec3::Y).abs() < 1e-15, "in the plane of incidence");
                }
            }
        }
    }

    #[test]
    fn an_index_of_one_bends_nothing_however_the_ray_grazes() {
        for cosine in [1.0, 0.5, 1e-3, 1e-9, 1e-17, 1e-150] {
            let wo = towards(f64::sqrt(1.0 - cosine * cosine), cosine);
            let wt = through(wo, 1.0).unwrap();
            assert!((wt + wo).abs().max_element() <= 4.0 * U, "{cosine:e}: {wt}");
            assert!((wt.y + cosine).abs() <= 4.0 * U * cosine, "the way off the surface keeps its digits: {:e}", wt.y);
        }
    }

    #[test]
    fn beyond_the_critical_angle_there_is_nothing_and_just_before_it_a_grazing_ray() {
        let ior = 1.5;
        for (sine, refracts) in [(0.6, true), (1.0 / 1.5 - 1e-12, true), (1.0 / 1.5 + 1e-12, false), (0.9, false)] {
            let wo = towards(sine, -f64::sqrt((1.0 - sine) * (1.0 + sine)));
            assert_eq!(through(wo, ior).is_some(), refracts, "{sine}");
        }
        // 1/1.5 − 1e-12 leaves cos θₜ = √(2·1.5e-12) but for its square.
        let sine = 1.0 / 1.5 - 1e-12;
        let wt = through(towards(sine, -f64::sqrt((1.0 - sine) * (1.0 + sine))), ior).unwrap();
        assert!((wt.y / f64::sqrt(3e-12) - 1.0).abs() < 1e-3, "{wt}");
    }

    #[test]
    fn odd_directions_and_indices_give_unit_vectors_or_nothing() {
        let diagonal = DVec3::splat(1.0).normalize();
        let directions = [DVec3::Y, -DVec3::Y, DVec3::X, -DVec3::X, diagonal, -diagonal, towards(1.0, 5e-324)];
        for wo in directions {
            for ior in [1e-300, 1e-30, 0.5, 1.0, 1.5, 1e8, 1e30, 3.4e38] {
                for ns in [DVec3::Y, -DVec3::Y, DVec3::X, diagonal] {
                    if let Some(wt) = refracted(wo, DVec3::Y, ns, ior) {
                        assert!((wt.length() - 1.0).abs() < 1e-6, "{wo} {ior:e} {ns}: {wt}");
                    }
                }
            }
        }
        // Along the surface from inside of something denser: nothing gets out.
        assert_eq!(through(DVec3::X, 1.5), None);
    }

    #[test]
    fn a_shading_normal_may_point_to_either_side_and_one_that_faces_away_is_not_used() {
        let wo = towards(0.6, 0.8);
        let tilted = DVec3::new(0.1, 1.0, -0.2).normalize();
        assert_eq!(refracted(wo, DVec3::Y, tilted, 1.5), refracted(wo, DVec3::Y, -tilted, 1.5));
        assert_ne!(refracted(wo, DVec3::Y, tilted, 1.5), through(wo, 1.5));
        // On the viewer's side of the surface, but 101° from him.
        let away = DVec3::new(-0.6, 0.2, -0.8).normalize();
        assert!(away.dot(wo) < 0.0);
        assert_eq!(refracted(wo, DVec3::Y, away, 1.5), through(wo, 1.5));
    }
}
