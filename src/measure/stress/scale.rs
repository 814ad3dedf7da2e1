//! Everything times a power of two: decisions are the same, and t is the same times that power.

use glam::{DMat4, DVec3};

use super::primitive::Primitive;
use super::random::Random;
use super::{Block, Tally, probe, shapes};
use crate::numeric::quadric::Quadric;
use crate::world::Ray;

/// A suite.
pub fn run(block: &Block, tally: &mut Tally) {
    for (case, mut random) in block.each() {
        let exponent = random.integer(-40, 40) as i32;
        let stretch = random.integer(-20, 20) as i32;
        let (ray, pair) = base(&mut random, libm::ldexp(1.0, exponent));
        let (one, other) = pair;
        let scaled = Ray::new(times(ray.origin, exponent), times(ray.direction, stretch));

        let (world, prim) = one.world();
        let first = tally.watch(|| ray.prepare().and_then(|ray| prim.intersect(&world, &ray)));
        let second = probe::check(tally, &case, &scaled, &other);
        let expected = first.map(|hit| (libm::ldexp(hit.t, exponent - stretch), hit.u, hit.v));
        if expected != second.map(|hit| (hit.t, hit.u, hit.v)) {
            tally.fail(format!("{} (differs from its scaled self)", case.text(&scaled, Some(&other))));
        }
    }
}

fn times(v: DVec3, exponent: i32) -> DVec3 {
    v * libm::ldexp(1.0, exponent)
}

/// A ray, a primitive, and the same primitive times a power of two.
fn base(random: &mut Random, factor: f64) -> (Ray, (Primitive, Primitive)) {
    match random.below(3) {
        0 => {
            let corners = shapes::triangle(random, DVec3::ZERO, 1.0);
            let target = shapes::point_of(random, corners);
            let from = random.log_uniform(0.1, 100.0) * random.direction();
            let scaled = corners.map(|corner| corner * factor as f32);
            let pair = (Primitive::Triangle(corners), Primitive::Triangle(scaled));
            (shapes::ray_towards(random, target, from), pair)
        }
        1 => {
            let (center, radius) = (random.in_cube(), random.log_uniform(0.01, 1.0));
            let target = center + 1.05 * radius * random.in_cube();
            let from = random.log_uniform(0.1, 100.0) * random.direction();
            let pair = (
                Primitive::Sphere { center, radius },
                Primitive::Sphere { center: factor * center, radius: factor * radius },
            );
            (shapes::ray_towards(random, target, from), pair)
        }
        _ => {
            let class = random.below(shapes::N_CLASSES);
            let canonical = shapes::canonical(random, class);
            let matrix = canonical.matrix(1.0);
            let target = canonical.center + random.in_cube();
            let from = canonical.center + random.log_uniform(0.1, 100.0) * random.direction();
            let pair = (row(matrix), row(scaled_matrix(matrix, factor)));
            (shapes::ray_towards(random, target, from), pair)
        }
    }
}

fn row(matrix: DMat4) -> Primitive {
    Primitive::Quadric(Quadric::from_matrix(matrix))
}

/// The matrix of the surface that is larger by a factor: x becomes x/factor.
fn scaled_matrix(m: DMat4, factor: f64) -> DMat4 {
    let linear = m.w_axis.truncate() * factor;
    let column = |c: glam::DVec4, w: f64| c.truncate().extend(w);
    DMat4::from_cols(
        column(m.x_axis, linear.x),
        column(m.y_axis, linear.y),
        column(m.z_axis, linear.z),
        linear.extend(m.w_axis.w * factor * factor),
    )
}
