//! Rays that leave a hit: none meets the surface in the point it leaves, none starts behind what it should meet.

use glam::DVec3;
use num_bigint::Sign;

use super::case::Case;
use super::primitive::{Primitive, oracle_row};
use super::random::Random;
use super::{Block, Tally, probe, shapes};
use crate::measure::oracle::integer::{cross, difference, dot, finest_exponent, scaled, scaled_vector};
use crate::numeric::U;
use crate::numeric::quadric::Quadric;
use crate::render::surface::{Surface, describe};
use crate::world::{Hit, Ray};

struct Start {
    ray: Ray,
    hit: Hit,
    primitive: Primitive,
    surface: Surface,
}

/// A suite: each block leaves one hit in many directions, half of them within 1e-6 to 1 of tangent.
pub fn run(block: &Block, tally: &mut Tally) {
    let mut random = block.shared();
    let start = (0..100).find_map(|_| start(&mut random, tally));
    for (case, mut random) in block.each() {
        match &start {
            Some(start) => leave(tally, &case, &mut random, start),
            None => tally.count(true, String::new),
        }
    }
}

/// A hit on a primitive of any kind, scale and offset.
fn start(random: &mut Random, tally: &mut Tally) -> Option<Start> {
    let size = random.power_of_two(-30, 30) * random.uniform(1.0, 2.0);
    let at = if random.chance(0.2) { DVec3::ZERO } else { size * random.log_uniform(0.1, 1e7) * random.direction() };
    let primitive = match random.below(3) {
        0 => Primitive::Triangle(shapes::triangle(random, at, size)),
        1 => Primitive::Sphere { center: at, radius: size },
        _ => {
            let class = random.below(shapes::N_CLASSES);
            let unit = shapes::canonical(random, class);
            let canonical = shapes::Canonical {
                center: at,
                diagonal: unit.diagonal / (size * size),
                linear: unit.linear / size,
                ..unit
            };
            Primitive::Quadric(Quadric::from_matrix(canonical.matrix(1.0)))
        }
    };
    let target = match &primitive {
        Primitive::Triangle(corners) => shapes::point_of(random, *corners),
        _ => at + size * random.in_cube(),
    };
    let from = at + size * random.log_uniform(0.1, 1e4) * random.direction();
    let ray = shapes::ray_towards(random, target, from);
    let (world, prim) = primitive.world();
    let hit = tally.watch(|| ray.prepare().and_then(|ray| prim.intersect(&world, &ray)))?;
    let surface = describe(&world, &ray, &hit);
    if let Primitive::Quadric(row) = &primitive {
        // Where the surface turns within the offset (an apex, an edge of two planes) it has no two sides there.
        let entries = row.diagonal.abs().max(row.off_diagonal.abs()).element_sum();
        let steepness = row.half_gradient(surface.p - row.center).length();
        let turned = entries * 64.0 * U * (surface.p.abs().max_element() + surface.extent) / steepness;
        if turned.is_nan() || turned > 1e-7 {
            return None;
        }
    }
    Some(Start { ray, hit, primitive, surface })
}

fn leave(tally: &mut Tally, case: &Case, random: &mut Random, start: &Start) {
    let Start { primitive, surface, .. } = start;
    if case.number.is_multiple_of(10) {
        return go_back(tally, case, start);
    }
    let normal = surface.ng;
    let cosine = if random.chance(0.5) { random.log_uniform(1e-6, 1.0) } else { random.unit().max(1e-6) };
    let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
    let side = random.sign();
    let direction = sine * random.perpendicular(normal) + side * cosine * normal;
    let away = Ray::new(surface.leave(direction), direction);

    // The start lies on the side to which the ray leaves, by exact signs.
    let mut right = side_of(primitive, away.origin) == side as i32;
    let (world, prim) = primitive.world();
    let again = tally.watch(|| away.prepare().and_then(|ray| prim.intersect(&world, &ray)));
    let truth = probe::truth(&away, primitive);
    right &= probe::judge_hit(tally, case, &away, (&world, prim), truth.as_ref(), again);
    // What is not bent towards the ray is not met again; a sphere is met from inside at the end of a chord.
    right &= match primitive {
        Primitive::Triangle(_) => again.is_none(),
        Primitive::Sphere { .. } if side > 0.0 => again.is_none(),
        Primitive::Sphere { radius, .. } => again.is_some_and(|hit| hit.t > radius * cosine),
        Primitive::Quadric(_) | Primitive::Clipped(..) => true,
    };
    if let (Primitive::Sphere { center, radius }, true) = (primitive, side > 0.0) {
        // A shell close outside is not skipped.
        let gap = 32.0 * U * (surface.p.abs().max_element() + surface.extent);
        let shell = Primitive::Sphere { center: *center, radius: radius + gap };
        let (world, prim) = shell.world();
        right &= away.prepare().is_some_and(|ray| prim.intersect(&world, &ray).is_some());
    }
    tally.count(right, || case.text(&away, None));
}

/// The way back to where the ray came from is free.
fn go_back(tally: &mut Tally, case: &Case, start: &Start) {
    let Start { ray, primitive, surface, hit } = start;
    let origin = surface.leave(-ray.direction);
    let back = Ray::new(origin, ray.origin - origin).until(1.0);
    // The ray may have started within the offset of the surface; then there is no way back to speak of.
    let travelled = hit.t * ray.direction.abs().max_element();
    let room = travelled > 64.0 * U * (surface.p.abs().max_element() + surface.extent);
    let (world, prim) = primitive.world();
    let blocked = tally.watch(|| back.prepare().and_then(|ray| prim.intersect(&world, &ray)));
    tally.count(blocked.is_none() || !room, || case.text(&back, None));
}

/// On which side of a surface a point is, as the sign of the normal's side: exact.
fn side_of(primitive: &Primitive, point: DVec3) -> i32 {
    let p = point.to_array();
    let sign = |sign| match sign {
        Sign::Minus => -1,
        Sign::NoSign => 0,
        Sign::Plus => 1,
    };
    match primitive {
        Primitive::Triangle(corners) => {
            let corners = corners.map(|corner| corner.as_dvec3().to_array());
            let scale = finest_exponent(corners.into_iter().flatten().chain(p)).unwrap_or(0);
            let [a, b, c] = corners.map(|corner| scaled_vector(corner, scale));
            let n = cross(&difference(&b, &a), &difference(&c, &a));
            sign(dot(&n, &difference(&scaled_vector(p, scale), &a)).sign())
        }
        Primitive::Sphere { center, radius } => {
            let scale = finest_exponent(center.to_array().into_iter().chain(p).chain([*radius])).unwrap_or(0);
            let off = difference(&scaled_vector(p, scale), &scaled_vector(center.to_array(), scale));
            let r = scaled(*radius, scale);
            sign((dot(&off, &off) - &r * &r).sign())
        }
        Primitive::Quadric(row) | Primitive::Clipped(row, _) => oracle_row(row).sign_at(p),
    }
}
