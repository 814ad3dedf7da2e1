//! Quadrics in clip boxes: ends through hits, along rays, of no thickness, far from the origin; one by one and in a tree.

use glam::DVec3;

use super::primitive::Primitive;
use super::random::Random;
use super::scene::Scene;
use super::shapes::Canonical;
use super::{Block, Tally, probe, quadric, shapes};
use crate::numeric::clip::Clip;
use crate::numeric::quadric::Quadric;
use crate::world::{MaterialId, ObjectId, PrimKind, PrimRef, Ray, World};

/// Surfaces of a block.
const N_SURFACES: usize = 6;

/// Every so many cases all surfaces are judged by the oracle, not only the one that was hit.
const FULL_JUDGEMENT: u64 = 4;

/// A suite.
pub fn run(block: &Block, tally: &mut Tally) {
    let mut random = block.shared();
    let (mut world, mut shapes) = (World::default(), Vec::new());
    while shapes.len() < N_SURFACES {
        let canonical = canonical(&mut random);
        let factor = random.sign() * if random.chance(0.5) { 1.0 } else { random.power_of_two(-20, 20) };
        let matrix = canonical.matrix(factor);
        let clip = clip(&mut random, &canonical, &Quadric::from_matrix(matrix));
        world.quadrics.add_clipped(matrix, clip, MaterialId(0), ObjectId(0));
        shapes.push((canonical, clip));
    }
    let scene = Scene::new(world);
    for (case, mut random) in block.each() {
        let row = random.below(N_SURFACES as u64) as usize;
        let (canonical, clip) = &shapes[row];
        let primitive = Primitive::of(&scene.world, PrimRef::new(PrimKind::Quadric, row));
        let ray = aim(&mut random, canonical, clip, &scene.world.quadrics.surfaces[row]);
        let hit = probe::check(tally, &case, &ray, &primitive).map(|hit| hit.t);

        // All of them, by the tree and by the full scan.
        let (agrees, closest) = scene.agrees(tally, &ray);
        let judged = scene.judge(tally, &case, &ray, &closest)
            && (!case.number.is_multiple_of(FULL_JUDGEMENT) || scene.judge_all(tally, &ray, &closest));
        if !(agrees && judged) {
            tally.fail(format!("{} (among others)", case.text(&ray, None)));
        }
        if !is_sum_of_parts(&mut random, &ray, &primitive, hit) {
            tally.fail(format!("{} (is not the sum of its parts)", case.text(&ray, Some(&primitive))));
        }
    }
}

fn canonical(random: &mut Random) -> Canonical {
    let class = random.below(shapes::N_CLASSES);
    let canonical = shapes::canonical(random, class);
    let far = random.log_uniform(1e3, 1e7) * random.direction();
    Canonical { center: if random.chance(0.3) { far } else { canonical.center }, ..canonical }
}

/// A box of any kind that has something to do with the surface.
fn clip(random: &mut Random, canonical: &Canonical, surface: &Quadric) -> Clip {
    let center = match random.below(4) {
        0 => DVec3::ZERO,
        1 => surface.center,
        2 => canonical.center.round(),
        _ => canonical.center + random.in_cube(),
    };
    let turned = [canonical.rotation.x_axis, canonical.rotation.y_axis, canonical.rotation.z_axis];
    let mut rows = match random.below(5) {
        0 => turned,
        1 => turned.map(|row| row * random.log_uniform(1e-3, 1e3)),
        2 => [0; 3].map(|_| random.grid(2)),
        3 => [0; 3].map(|_| random.in_cube()),
        _ => [DVec3::X, DVec3::Y, DVec3::Z],
    };
    let (mut lo, mut hi) = (DVec3::NEG_INFINITY, DVec3::INFINITY);
    for i in 0..3 {
        // Ends through points of the surface, at whole numbers, anywhere.
        let mut end = || {
            let near = canonical.center + 2.0 * random.in_cube();
            let touched = shapes::surface_point(surface, near, random.direction()).filter(|p| p.is_finite());
            let point = if random.chance(0.5) { touched.unwrap_or(near) } else { near };
            let end = rows[i].dot(point - center);
            if random.chance(0.3) { end.round() } else { end }
        };
        let (p, q) = (end(), end());
        (lo[i], hi[i]) = (p.min(q), p.max(q));
        match random.below(12) {
            0..4 => (lo[i], hi[i], rows[i]) = (f64::NEG_INFINITY, f64::INFINITY, DVec3::ZERO),
            4 => lo[i] = f64::NEG_INFINITY,
            5 => hi[i] = f64::INFINITY,
            6 => hi[i] = lo[i],
            7 => hi[i] = lo[i].next_up(),
            _ => {}
        }
    }
    Clip::new(center, rows, lo, hi)
}

fn aim(random: &mut Random, canonical: &Canonical, clip: &Clip, surface: &Quadric) -> Ray {
    let from = canonical.center + random.log_uniform(0.1, 1e3) * random.direction();
    let near = canonical.center + 2.0 * random.in_cube();
    let row = random.below(3) as usize;
    let (n, end) = (clip.rows[row], if random.chance(0.5) { clip.lo[row] } else { clip.hi[row] });
    // A point of an end, as well as f64 can have it: along the row from any point.
    let onto_end = |p: DVec3| p + n * ((end - n.dot(p - clip.center)) / n.length_squared());
    let on_end = onto_end(near);
    if random.chance(0.4) || !on_end.is_finite() {
        return quadric::aim(random, canonical, surface);
    }
    match random.below(4) {
        // Within an end, exactly where its row is an axis.
        0 => Ray::new(on_end, random.grid(2).cross(n)),
        1 => Ray::new(on_end, random.perpendicular(n)),
        // At the rim.
        2 => {
            let along = random.perpendicular(n);
            let rim = shapes::surface_point(surface, on_end, along).filter(|p| p.is_finite()).unwrap_or(on_end);
            let off = if random.chance(0.3) { 0.0 } else { random.sign() * random.log_uniform(1e-17, 1e-3) };
            shapes::ray_towards(random, onto_end(rim) + off * n, from)
        }
        // Into an open end and out of it.
        _ => shapes::ray_towards(random, on_end, from),
    }
}

/// Cut by a plane, the two parts are hit where the whole is: the plane itself belongs to both.
fn is_sum_of_parts(random: &mut Random, ray: &Ray, primitive: &Primitive, hit: Option<f64>) -> bool {
    let Primitive::Clipped(row, clip) = primitive else { return false };
    let i = random.below(3) as usize;
    let at = match hit {
        Some(t) if random.chance(0.7) => clip.rows[i].dot(ray.at(t) - clip.center),
        _ => random.uniform(-2.0, 2.0),
    };
    if !at.is_finite() {
        return true;
    }
    let (mut below, mut above) = (*clip, *clip);
    below.hi[i] = clip.hi[i].min(at);
    above.lo[i] = clip.lo[i].max(at);
    let ask = |clip| {
        let (world, prim) = Primitive::Clipped(*row, clip).world();
        ray.prepare().and_then(|ray| prim.intersect(&world, &ray)).map_or(f64::INFINITY, |hit| hit.t)
    };
    ask(below).min(ask(above)) == hit.unwrap_or(f64::INFINITY)
}
