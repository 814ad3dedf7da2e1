//! Random primitives, and rays that meet them where it is hard.

use glam::{DMat3, DMat4, DVec3, Vec3, dvec3};

use super::random::Random;
use crate::numeric::quadric::Quadric;
use crate::world::Ray;

/// A triangle in the unit cube around a point, times a size; corners are rounded to f32.
pub fn triangle(random: &mut Random, at: DVec3, size: f64) -> [Vec3; 3] {
    [0; 3].map(|_| (at + size * random.in_cube()).as_vec3())
}

/// A triangle of length `size` and a width of `aspect` times that.
pub fn needle(random: &mut Random, at: DVec3, size: f64, aspect: f64) -> [Vec3; 3] {
    let along = random.direction();
    let across = random.perpendicular(along);
    let corner = |l: f64, w: f64| (at + size * (l * along + aspect * w * across)).as_vec3();
    let top = random.uniform(-0.5, 1.0);
    let mut corners = [corner(-0.5, 0.0), corner(0.5, 0.0), corner(top, 1.0)];
    corners.rotate_left(random.below(3) as usize);
    corners
}

/// A point of a triangle, in f64: inside, on an edge, in a corner, or a little outside.
pub fn point_of(random: &mut Random, corners: [Vec3; 3]) -> DVec3 {
    let [a, b, c] = corners.map(|corner| corner.as_dvec3());
    let (mut u, mut v) = (random.unit(), random.unit());
    if u + v > 1.0 {
        (u, v) = (1.0 - u, 1.0 - v);
    }
    match random.below(6) {
        0 => a,
        1 => a + u * (b - a),
        2 => b + u * (c - b),
        3 => a + u * (b - a) + random.sign() * random.log_uniform(1e-17, 1e-3) * (c - a),
        4 => b + u * (c - b) + random.sign() * random.log_uniform(1e-17, 1e-3) * (a - b),
        _ => a + u * (b - a) + v * (c - a),
    }
}

/// A ray from a distance away towards a point; its direction is of any length.
pub fn ray_towards(random: &mut Random, target: DVec3, from: DVec3) -> Ray {
    let mut direction = target - from;
    if random.chance(0.5) {
        direction *= random.log_uniform(1e-3, 1e3);
    }
    if direction == DVec3::ZERO { Ray::new(from, DVec3::X) } else { Ray::new(from, direction) }
}

/// A rotation, every one as likely; now and then none, so that entries stay exact.
pub fn rotation(random: &mut Random) -> DMat3 {
    if random.chance(0.4) {
        return DMat3::IDENTITY;
    }
    let x = random.direction();
    let y = random.perpendicular(x);
    DMat3::from_cols(x, y, x.cross(y))
}

/// Number of quadric classes.
pub const N_CLASSES: u64 = 10;

/// A quadric of a class, by its canonical form λ·x² + 2 g·x + s = 0 and where it stands.
#[derive(Clone, Copy, Debug)]
pub struct Canonical {
    /// λ.
    pub diagonal: DVec3,
    /// g.
    pub linear: DVec3,
    /// s.
    pub constant: f64,
    /// World from canonical axes.
    pub rotation: DMat3,
    /// Where the canonical origin lies.
    pub center: DVec3,
}

/// Ellipsoid, hyperboloids of one and two sheets, cone, elliptic and hyperbolic paraboloid, elliptic, hyperbolic and
/// parabolic cylinder, two planes.
pub fn canonical(random: &mut Random, class: u64) -> Canonical {
    let mut size = || random.log_uniform(0.1, 10.0);
    let (p, q, r) = (size(), size(), size());
    let (diagonal, linear, constant) = match class {
        0 => (dvec3(p, q, r), DVec3::ZERO, -1.0),
        1 => (dvec3(p, q, -r), DVec3::ZERO, -1.0),
        2 => (dvec3(p, q, -r), DVec3::ZERO, 1.0),
        3 => (dvec3(p, q, -r), DVec3::ZERO, 0.0),
        4 => (dvec3(p, q, 0.0), dvec3(0.0, 0.0, -0.5 * r), 0.0),
        5 => (dvec3(p, -q, 0.0), dvec3(0.0, 0.0, -0.5 * r), 0.0),
        6 => (dvec3(p, q, 0.0), DVec3::ZERO, -1.0),
        7 => (dvec3(p, -q, 0.0), DVec3::ZERO, -1.0),
        8 => (dvec3(p, 0.0, 0.0), dvec3(0.0, 0.0, -0.5 * r), 0.0),
        _ => (dvec3(p, -q, 0.0), DVec3::ZERO, 0.0),
    };
    let center = match random.below(3) {
        0 => DVec3::ZERO,
        1 => random.grid(8),
        _ => random.log_uniform(0.1, 1e4) * random.direction(),
    };
    Canonical { diagonal, linear, constant, rotation: rotation(random), center }
}

impl Canonical {
    /// The symmetric 4×4 matrix of the surface, times a factor.
    pub fn matrix(&self, factor: f64) -> DMat4 {
        let Canonical { diagonal, linear, constant, rotation, center } = *self;
        let q = factor * (rotation * DMat3::from_diagonal(diagonal) * rotation.transpose());
        // Rounding must not make it asymmetric.
        let (xy, xz, yz) = (q.y_axis.x, q.z_axis.x, q.z_axis.y);
        let q = DMat3::from_cols(dvec3(q.x_axis.x, xy, xz), dvec3(xy, q.y_axis.y, yz), dvec3(xz, yz, q.z_axis.z));
        let g = factor * (rotation * linear);
        let l = g - q * center;
        let m = factor * constant - (g + l).dot(center);
        DMat4::from_cols(q.x_axis.extend(l.x), q.y_axis.extend(l.y), q.z_axis.extend(l.z), l.extend(m))
    }

    /// A direction in which the surface runs to infinity, if it has one.
    pub fn asymptote(&self, random: &mut Random) -> DVec3 {
        let d = self.diagonal;
        let (x, y) = (random.sign() / d.x.abs().sqrt().max(1e-20), random.sign() / d.y.abs().sqrt().max(1e-20));
        let local = if d.z < 0.0 {
            let cos = random.uniform(-1.0, 1.0);
            let sin = (1.0 - cos * cos).sqrt();
            dvec3(cos * x, sin * y, random.sign() / d.z.abs().sqrt())
        } else if d.y < 0.0 {
            dvec3(x, y, random.uniform(-1.0, 1.0))
        } else {
            DVec3::Z
        };
        (self.rotation * local).normalize_or(DVec3::Z)
    }
}

/// A point of the surface near a line, as f64 finds it.
pub fn surface_point(row: &Quadric, origin: DVec3, direction: DVec3) -> Option<DVec3> {
    let h = origin - row.center;
    let gradient = row.half_gradient(h);
    let a = direction.dot(row.times(direction));
    let b = direction.dot(gradient);
    let c = h.dot(gradient + row.linear) + row.constant;
    let root = (b * b - a * c).sqrt();
    let q = -(b + root.copysign(b));
    [c / q, q / a].into_iter().find(|t| t.is_finite()).map(|t| origin + t * direction)
}
