//! The formulas of textbooks in f32, to show what exactness buys. Everything is rounded to f32 first, as a renderer
//! in f32 has it.

use glam::{DVec3, Mat3, Vec3};

use super::primitive::Primitive;
use crate::world::Ray;

/// Whether the naive formula finds a hit: plane and three edge tests for a triangle, the quadratic formula
/// −b ± √(b² − ac) for spheres and quadrics.
pub fn naive(ray: &Ray, primitive: &Primitive) -> bool {
    let (o, d) = (ray.origin.as_vec3(), ray.direction.as_vec3());
    let inside = |t: f32| f64::from(t) > ray.t_min && f64::from(t) < ray.t_max;
    match primitive {
        Primitive::Triangle(corners) => plane_test(o, d, *corners).is_some_and(inside),
        Primitive::Sphere { center, radius } => {
            let h = o - center.as_vec3();
            let r = *radius as f32;
            quadratic(d.dot(d), h.dot(d), h.dot(h) - r * r).into_iter().flatten().any(inside)
        }
        Primitive::Quadric(row) | Primitive::Clipped(row, _) => {
            // As a renderer stores it: one f32 matrix in world space.
            let (q, c) = (row.diagonal, row.center);
            let o3 = row.off_diagonal;
            let f64_rows = [DVec3::new(q.x, o3.z, o3.y), DVec3::new(o3.z, q.y, o3.x), DVec3::new(o3.y, o3.x, q.z)];
            let q_c = DVec3::new(f64_rows[0].dot(c), f64_rows[1].dot(c), f64_rows[2].dot(c));
            let linear = (row.linear - q_c).as_vec3();
            let constant = (row.constant - 2.0 * row.linear.dot(c) + c.dot(q_c)) as f32;
            let matrix = Mat3::from_cols(f64_rows[0].as_vec3(), f64_rows[1].as_vec3(), f64_rows[2].as_vec3());
            let bent = matrix * o + linear;
            let value = o.dot(bent + linear) + constant;
            let mut roots = quadratic(d.dot(matrix * d), d.dot(bent), value).into_iter().flatten();
            roots.any(|t| inside(t) && clip_contains(primitive, o + t * d))
        }
    }
}

/// Whether a point lies in the clip of a primitive that has one.
fn clip_contains(primitive: &Primitive, p: Vec3) -> bool {
    let Primitive::Clipped(_, clip) = primitive else { return true };
    let (from, lo, hi) = (p - clip.center.as_vec3(), clip.lo.as_vec3(), clip.hi.as_vec3());
    (0..3).all(|i| (lo[i]..=hi[i]).contains(&clip.rows[i].as_vec3().dot(from)))
}

fn quadratic(a: f32, b: f32, c: f32) -> [Option<f32>; 2] {
    if a == 0.0 {
        return [Some(-0.5 * c / b), None];
    }
    let discriminant = b * b - a * c;
    if discriminant < 0.0 {
        return [None; 2];
    }
    let root = discriminant.sqrt();
    [Some((-b - root) / a), Some((-b + root) / a)]
}

/// The t at which a ray meets the plane of a triangle, if that point is on the inner side of all edges.
pub fn plane_test(o: Vec3, d: Vec3, [a, b, c]: [Vec3; 3]) -> Option<f32> {
    let n = (b - a).cross(c - a);
    let t = n.dot(a - o) / n.dot(d);
    let p = o + t * d;
    let inner = |from: Vec3, to: Vec3| (to - from).cross(p - from).dot(n) >= 0.0;
    (t.is_finite() && inner(a, b) && inner(b, c) && inner(c, a)).then_some(t)
}

/// The t of Möller and Trumbore, "Fast, Minimum Storage Ray/Triangle Intersection" (1997), without culling and
/// without their epsilon.
pub fn moller_trumbore(o: Vec3, d: Vec3, [a, b, c]: [Vec3; 3]) -> Option<f32> {
    let (e1, e2) = (b - a, c - a);
    let p = d.cross(e2);
    let inverse = 1.0 / e1.dot(p);
    let s = o - a;
    let u = s.dot(p) * inverse;
    let q = s.cross(e1);
    let v = d.dot(q) * inverse;
    let t = e2.dot(q) * inverse;
    (inverse.is_finite() && u >= 0.0 && v >= 0.0 && u + v <= 1.0).then_some(t)
}

/// Whether Möller and Trumbore find a hit; `None` for what is no triangle.
pub fn moller_trumbore_hits(ray: &Ray, primitive: &Primitive) -> Option<bool> {
    let Primitive::Triangle(corners) = primitive else { return None };
    let t = moller_trumbore(ray.origin.as_vec3(), ray.direction.as_vec3(), *corners);
    Some(t.is_some_and(|t| f64::from(t) > ray.t_min && f64::from(t) < ray.t_max))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{dvec3, vec3};

    #[test]
    fn textbooks_are_right_about_easy_cases() {
        let triangle = Primitive::Triangle([Vec3::ZERO, Vec3::X, Vec3::Y]);
        let sphere = Primitive::Sphere { center: DVec3::ZERO, radius: 1.0 };
        let down = |x: f64| Ray::new(dvec3(x, 0.25, 3.0), -DVec3::Z);
        for (x, on_triangle) in [(0.25, true), (2.0, false)] {
            assert_eq!(naive(&down(x), &triangle), on_triangle);
            assert_eq!(moller_trumbore_hits(&down(x), &triangle), Some(on_triangle));
            assert_eq!(naive(&down(x), &sphere), on_triangle);
        }
        assert_eq!(
            moller_trumbore(vec3(0.25, 0.25, 3.0), vec3(0.0, 0.0, -2.0), [Vec3::ZERO, Vec3::X, Vec3::Y]),
            Some(1.5)
        );
    }
}
