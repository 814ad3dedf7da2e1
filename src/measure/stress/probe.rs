//! One ray against one primitive: the kernels, the textbooks, and the oracle's judgement of each.

use glam::DVec3;

use super::case::Case;
use super::primitive::{Primitive, oracle_row};
use super::tally::Tally;
use super::textbook;
use crate::measure::oracle::judge::{Judgement, judge, ulp};
use crate::measure::oracle::surface::{ExactPoint, normal_error};
use crate::measure::oracle::{Polynomial, triangle};
use crate::render::surface::{Surface, describe};
use crate::world::{Hit, PrimRef, Ray, World};

/// Promised: a component of the position is within this many ulps of the largest coordinate involved.
pub const ALLOWED_ULPS_P: f64 = 2.0;

/// Promised: a component of a unit normal is within this, where the surface determines it.
pub const ALLOWED_ERROR_N: f64 = 2e-7;

/// Asks the kernel, judges its answer and counts it as a case. Textbooks are asked too.
pub fn check(tally: &mut Tally, case: &Case, ray: &Ray, primitive: &Primitive) -> Option<Hit> {
    let (world, prim) = primitive.world();
    let hit = tally.watch(|| ray.prepare().and_then(|prepared| prim.intersect(&world, &prepared)));
    let truth = truth(ray, primitive);
    let right = judge_hit(tally, case, ray, (&world, prim), truth.as_ref(), hit);
    tally.count(right, || case.text(ray, Some(primitive)));
    ask_textbooks(tally, ray, primitive, truth.as_ref());
    hit
}

/// Where the line of a ray meets a primitive; nowhere for a ray that can hit nothing.
pub fn truth(ray: &Ray, primitive: &Primitive) -> Option<Polynomial> {
    let sound = ray.origin.is_finite() && ray.direction.is_finite() && ray.t_min >= 0.0 && ray.t_min < ray.t_max;
    if sound { primitive.truth(ray.origin, ray.direction) } else { None }
}

/// Whether an answer is right; notes its errors. Position and normal out of bounds count as inaccurate.
pub fn judge_hit(
    tally: &mut Tally,
    case: &Case,
    ray: &Ray,
    (world, prim): (&World, PrimRef),
    truth: Option<&Polynomial>,
    hit: Option<Hit>,
) -> bool {
    let judged = judge(truth, hit.map(|hit| hit.t), ray.t_min, ray.t_max);
    tally.judged += 1;
    let Some(hit) = hit.filter(|_| judged.right) else { return judged.right };
    tally.max_ulp_t = tally.max_ulp_t.max(judged.ulps);
    tally.max_ulp_t_f32 = tally.max_ulp_t_f32.max(f32_error(hit.t, judged.delta));
    let surface = describe(world, ray, &hit);
    let primitive = Primitive::of(world, prim);
    if !note_errors(tally, ray, &primitive, &hit, &judged, &surface) {
        tally.inaccurate += 1;
        tally.keep(format!("{} (position or normal)", case.text(ray, Some(&primitive))));
    }
    true
}

/// The error of t rounded to f32, in ulps of f32: half of one for the rounding, and what f64 adds.
fn f32_error(t: f64, delta: f64) -> f64 {
    let rounded = t as f32;
    if !rounded.is_finite() {
        return 0.0;
    }
    let size = rounded.abs();
    let ulp = f64::from(size.next_up()) - f64::from(size);
    if ulp.is_finite() { ((f64::from(rounded) - t) - delta).abs() / ulp } else { 0.0 }
}

/// Notes the errors of position and normal; whether they are as promised.
fn note_errors(
    tally: &mut Tally,
    ray: &Ray,
    primitive: &Primitive,
    hit: &Hit,
    judged: &Judgement,
    surface: &Surface,
) -> bool {
    // A t that underflows has lost digits that no position can have back.
    if hit.t < f64::MIN_POSITIVE {
        return true;
    }
    let (origin, direction) = (ray.origin.to_array(), ray.direction.to_array());
    let exact = ExactPoint::new(origin, direction, hit.t, judged.delta);
    let size = |v: DVec3| v.abs().max_element();
    let (center, normal, curvature) = match primitive {
        Primitive::Triangle(corners) => (DVec3::ZERO, triangle::normal(corners.map(|c| c.as_dvec3().to_array())), 0.0),
        Primitive::Sphere { center, radius } => (*center, exact.from_center(center.to_array()), 1.0 / radius),
        Primitive::Quadric(row) | Primitive::Clipped(row, _) => {
            let entries = row.diagonal.abs().max(row.off_diagonal.abs()).element_sum();
            let steepness = row.half_gradient(surface.p - row.center).length();
            (row.center, exact.gradient(&oracle_row(row)), 2.0 * entries / steepness)
        }
    };
    // The way from origin to hit is a coordinate too: o + t·d cannot be better than t·d.
    let way = size(surface.p - ray.origin);
    let largest = size(surface.p).max(size(ray.origin)).max(way).max(surface.extent).max(size(center));
    let off = exact.distance_to(surface.p.to_array());
    let ulps_p = off / ulp(largest);
    tally.max_ulp_p = tally.max_ulp_p.max(ulps_p);

    // Where the surface turns within the error of a position (at an apex, on a tiny sphere far away), no f64 point
    // determines the normal: what two ulps of position turn it by is not held against the answer.
    let turned = curvature * 4.0 * ulp(largest);
    let error_n = normal_error(&normal, surface.ng.to_array()).filter(|_| turned.is_finite());
    let determined = error_n.map_or(0.0, |error| (error - turned).max(0.0));
    tally.max_err_n = tally.max_err_n.max(determined);
    ulps_p <= ALLOWED_ULPS_P && determined <= ALLOWED_ERROR_N
}

/// Asks the textbook formulas for hit or miss.
fn ask_textbooks(tally: &mut Tally, ray: &Ray, primitive: &Primitive, truth: Option<&Polynomial>) {
    let over_everything = ray.t_min == 0.0 && ray.t_max == f64::INFINITY;
    if !over_everything {
        return;
    }
    let hits = truth.is_some_and(Polynomial::has_positive_root);
    tally.naive_f32.count(textbook::naive(ray, primitive) == hits);
    if let Some(answer) = textbook::moller_trumbore_hits(ray, primitive) {
        tally.moller_trumbore_f32.count(answer == hits);
    }
}
