//! A search for the input on which an error comes closest to its bound.
//!
//! The bounds of `numeric` are first-order sums of roundings, so no input should reach them. Random input stays far
//! below; hill-climbing (change a case a little, keep the change when the ratio of true error to bound grows) gets
//! closer. A ratio of 1 or more would be a wrong bound, whether or not a decision has yet gone wrong by it.

use glam::{DVec3, Vec3};
use num_bigint::BigInt;
use rayon::prelude::*;

use super::random::Random;
use crate::measure::oracle::integer::{cross, decode, difference, dot, scaled, scaled_vector, sum};
use crate::measure::oracle::wide::Wide;
use crate::numeric::lane::LaneRay;
use crate::numeric::packet::{PacketShear, REACH_PER_RESIDUAL};
use crate::numeric::plane::plane_quotient;
use crate::numeric::prepared::PreparedRay;
use crate::numeric::quadric::{self, Quadric};
use crate::numeric::ratio::Bounded;
use crate::numeric::{sphere, triangle};
use crate::simd::{Portable, Simd, WIDTH};

/// The largest ratio found for one bound.
#[derive(Clone, Debug, PartialEq)]
pub struct WorstCase {
    /// Which bound.
    pub bound: &'static str,
    /// True error over bound.
    pub ratio: f64,
    /// The numbers of the case.
    pub input: Vec<f64>,
}

type Ratio = fn(&[f64]) -> Option<f64>;

/// Bounds with how many numbers make a case.
const BOUNDS: [(&str, usize, Ratio); 12] = [
    ("triangle edge function, f64", 15, |x| edges_ratio(x, triangle::edge_functions)),
    ("triangle edge function, f32 lanes", 15, |x| edges_ratio(x, lane_edges)),
    ("triangle edge function, f32 packet", 17, packet_edges),
    ("triangle n·(a − o), compensated", 15, |x| plane_coefficient(x, 0)),
    ("triangle n·d, compensated", 15, |x| plane_coefficient(x, 1)),
    ("sphere discriminant, f64", 10, sphere_discriminant),
    ("sphere h·d, double-double", 10, |x| sphere_coefficient(x, 1)),
    ("sphere h·h − r², double-double", 10, |x| sphere_coefficient(x, 2)),
    ("quadric discriminant, f64", 19, quadric_discriminant),
    ("quadric dᵀQd, double-double", 19, |x| quadric_coefficient(x, 0)),
    ("quadric d·(Qh+g), double-double", 19, |x| quadric_coefficient(x, 1)),
    ("quadric constant, double-double", 19, |x| quadric_coefficient(x, 2)),
];

/// Climbs from `n_starts` random cases per bound, `n_steps` attempts each; the worst case of each bound.
pub fn search(seed: u64, n_starts: u64, n_steps: u64) -> Vec<WorstCase> {
    let climb_all = |&(bound, n_numbers, ratio): &(&'static str, usize, Ratio)| {
        let climbs = (0..n_starts).into_par_iter().map(|start| {
            let mut random = Random::new(seed, bound, start);
            climb(&mut random, n_numbers, n_steps, ratio)
        });
        let best = climbs.collect::<Vec<_>>().into_iter().max_by(|a, b| a.0.total_cmp(&b.0));
        let (ratio, input) = best.unwrap_or_default();
        WorstCase { bound, ratio, input }
    };
    BOUNDS.iter().map(climb_all).collect()
}

fn climb(random: &mut Random, n_numbers: usize, n_steps: u64, ratio: Ratio) -> (f64, Vec<f64>) {
    let mut case: Vec<f64> = (0..n_numbers).map(|_| start(random)).collect();
    let mut best = ratio(&case).unwrap_or(0.0);
    for _ in 0..n_steps {
        let mut next = case.clone();
        for _ in 0..=random.below(2) {
            let at = random.below(n_numbers as u64) as usize;
            next[at] = change(random, next[at]);
        }
        if let Some(found) = ratio(&next).filter(|&found| found >= best) {
            (best, case) = (found, next);
        }
    }
    (best, case)
}

fn start(random: &mut Random) -> f64 {
    random.sign() * random.log_uniform(0.1, 10.0)
}

fn change(random: &mut Random, x: f64) -> f64 {
    match random.below(5) {
        0 => start(random),
        1 => -x,
        2 => x * (1.0 + 1e-3 * random.uniform(-1.0, 1.0)),
        3 => f64::from_bits(x.to_bits() ^ (1 << random.below(52))),
        _ => x * random.power_of_two(-2, 2),
    }
}

fn vector(x: &[f64], at: usize) -> DVec3 {
    DVec3::new(x[at], x[at + 1], x[at + 2])
}

/// All numbers of the search are multiples of this and small, so that one scale makes them integers.
const SCALE: i64 = -1074;

/// The exact value of f64 sums of products, on a scale fine enough for all.
fn finest(x: impl IntoIterator<Item = f64>) -> i64 {
    x.into_iter().filter(|&x| x != 0.0).map(|x| decode(x).1).min().unwrap_or(0).max(SCALE)
}

fn difference_of(value: f64, exact: &BigInt, scale: i64) -> f64 {
    let own = finest([value]).min(scale);
    let exact = exact << (scale - own) as u64;
    Wide::integer(&(exact - scaled(value, own)), own).to_f64().abs()
}

type Edges = fn(&PreparedRay, [Vec3; 3]) -> ([f64; 3], f64);

fn triangle_case(x: &[f64]) -> Option<(PreparedRay, [Vec3; 3])> {
    let corners = [0, 3, 6].map(|at| vector(x, at).as_vec3());
    Some((PreparedRay::new(vector(x, 9), vector(x, 12), 0.0, f64::INFINITY)?, corners))
}

/// The columns of one triangle, with room for the lanes behind it.
fn columns(corners: [Vec3; 3]) -> [f32; 9 + WIDTH] {
    let mut columns = [0.0; 9 + WIDTH];
    for (i, coordinate) in corners.iter().flat_map(|corner| corner.to_array()).enumerate() {
        columns[i] = coordinate;
    }
    columns
}

fn lane_edges(ray: &PreparedRay, corners: [Vec3; 3]) -> ([f64; 3], f64) {
    LaneRay::of(ray).edges(Portable, &columns(corners), 0, 1).of_lane(0)
}

/// The edge functions of a packet whose shear is off the ray's own by up to a sixteenth.
fn packet_edges(x: &[f64]) -> Option<f64> {
    let (ray, corners) = triangle_case(x)?;
    let off = [x[15], x[16]].map(|x| (x.fract() / 16.0) as f32);
    let [i, j, k] = ray.axes();
    let (origin, own, residual) = LaneRay::of(&ray).parts();
    let slope = [own[0] + off[0], own[1] + off[1]];
    if slope[0].abs().max(slope[1].abs()) > 1.0 {
        return None;
    }
    let inverse = 1.0 / ray.direction[k];
    let delta = |axis: usize, slope: f32| (ray.direction[axis] * inverse - f64::from(slope)) as f32;
    let delta = [delta(i, slope[0]), delta(j, slope[1])];
    let reach = residual * REACH_PER_RESIDUAL;
    let shear = PacketShear { origin, slope, spread: delta[0].abs().max(delta[1].abs()), reach, axis: k };
    let seen = shear.edges(Portable, &columns(corners), 0, 1).columns();
    let edges = seen.edges(Portable, 0, Portable.splat(delta[0]), Portable.splat(delta[1])).of_lane(0);
    worst_edge(&ray, corners, edges)
}

/// The edge functions of a triangle test against those of the sheared exact corners.
fn edges_ratio(x: &[f64], edges: Edges) -> Option<f64> {
    let (ray, corners) = triangle_case(x)?;
    let edges = edges(&ray, corners);
    worst_edge(&ray, corners, edges)
}

fn worst_edge(ray: &PreparedRay, corners: [Vec3; 3], (weights, error): ([f64; 3], f64)) -> Option<f64> {
    // Exact: an edge function times d_z is d·(p×q) for the corners p, q relative to the origin, up to the order of
    // axes, which is cyclic and changes nothing.
    let points = corners.iter().flat_map(|c| c.as_dvec3().to_array()).chain(ray.origin.to_array());
    let (p_scale, d_scale) = (finest(points), finest(ray.direction.to_array()));
    let o = scaled_vector(ray.origin.to_array(), p_scale);
    let d = scaled_vector(ray.direction.to_array(), d_scale);
    let [a, b, c] = corners.map(|k| difference(&scaled_vector(k.as_dvec3().to_array(), p_scale), &o));
    let dz = &d[ray.axis];
    let worst = [(&b, &c), (&c, &a), (&a, &b)].into_iter().zip(weights).map(|((p, q), weight)| {
        let exact = dot(&d, &cross(p, q));
        // |weight − exact/d_z| = |weight·d_z − exact|/|d_z|.
        let w_scale = finest([weight]).min(2 * p_scale);
        let off = scaled(weight, w_scale) * dz - (exact << (2 * p_scale - w_scale) as u64);
        let off = Wide::integer(&off, w_scale).over(Wide::integer(dz, 0)).to_f64().abs();
        off / error
    });
    worst.reduce(f64::max)
}

/// Numerator and denominator of the quotient by the plane.
fn plane_coefficient(x: &[f64], which: usize) -> Option<f64> {
    let (ray, corners) = triangle_case(x)?;
    let quotient = plane_quotient(&triangle::pair(&ray, corners));
    let points = corners.iter().flat_map(|c| c.as_dvec3().to_array()).chain(ray.origin.to_array());
    let (p_scale, d_scale) = (finest(points), finest(ray.direction.to_array()));
    let o = scaled_vector(ray.origin.to_array(), p_scale);
    let [a, b, c] = corners.map(|k| scaled_vector(k.as_dvec3().to_array(), p_scale));
    let n = cross(&difference(&b, &a), &difference(&c, &a));
    let d = scaled_vector(ray.direction.to_array(), d_scale);
    let exact = [(dot(&n, &difference(&a, &o)), 3 * p_scale), (dot(&n, &d), 2 * p_scale + d_scale)];
    ray.tame.then(|| coefficient_ratio(quotient[which], &exact[which]))
}

/// Exact a, b, c of a sphere with the scale of each.
fn exact_sphere(x: &[f64]) -> [(BigInt, i64); 3] {
    let (p, s) = (finest(x[0..7].iter().copied()), finest(x[7..10].iter().copied()));
    let h = difference(&scaled_vector(vector(x, 0).into(), p), &scaled_vector(vector(x, 3).into(), p));
    let d = scaled_vector(vector(x, 7).into(), s);
    let r = scaled(x[6], p);
    [(dot(&d, &d), 2 * s), (dot(&h, &d), p + s), (dot(&h, &h) - &r * &r, 2 * p)]
}

fn sphere_ray(x: &[f64]) -> Option<(PreparedRay, DVec3, f64)> {
    let ray = PreparedRay::new(vector(x, 0), vector(x, 7), 0.0, f64::INFINITY)?;
    ray.tame.then_some((ray, vector(x, 3), x[6].abs()))
}

fn sphere_discriminant(x: &[f64]) -> Option<f64> {
    let (ray, center, radius) = sphere_ray(x)?;
    let (discriminant, bound) = sphere::discriminant(&ray, center, radius);
    Some(discriminant_ratio(discriminant, bound, &exact_sphere(x)))
}

fn sphere_coefficient(x: &[f64], which: usize) -> Option<f64> {
    let (ray, center, radius) = sphere_ray(x)?;
    let bounded = sphere::double_coefficients(&ray, center, radius)[which];
    Some(coefficient_ratio(bounded, &exact_sphere(x)[which]))
}

fn discriminant_ratio(discriminant: f64, bound: f64, [(a, ea), (b, eb), (c, ec)]: &[(BigInt, i64); 3]) -> f64 {
    debug_assert_eq!(2 * eb, ea + ec);
    difference_of(discriminant, &(b * b - a * c), 2 * eb) / bound
}

fn coefficient_ratio(bounded: Bounded, (exact, scale): &(BigInt, i64)) -> f64 {
    let (hi, lo) = (bounded.value.hi, bounded.value.lo);
    let own = finest([hi, lo]).min(*scale);
    let off = (exact << (scale - own) as u64) - scaled(hi, own) - scaled(lo, own);
    if bounded.error == 0.0 { 0.0 } else { Wide::integer(&off, own).to_f64().abs() / bounded.error }
}

fn quadric_row(x: &[f64]) -> Option<(PreparedRay, Quadric)> {
    let ray = PreparedRay::new(vector(x, 0), vector(x, 3), 0.0, f64::INFINITY)?;
    let [diagonal, off_diagonal, linear, center] = [6, 9, 12, 16].map(|at| vector(x, at));
    let row = Quadric { center, diagonal, off_diagonal, linear, constant: x[15], tame: true };
    ray.tame.then_some((ray, row))
}

/// Exact a, b, c of a quadric: matrix entries on one scale, coordinates on another.
fn exact_quadric(x: &[f64]) -> [(BigInt, i64); 3] {
    let p = finest(x[0..3].iter().chain(&x[16..19]).copied());
    let s = finest(x[3..6].iter().copied());
    let linear = finest(x[12..15].iter().copied()) - p;
    let q = finest(x[6..12].iter().copied()).min(linear).min(finest([x[15]]) - 2 * p);
    let h = difference(&scaled_vector(vector(x, 0).into(), p), &scaled_vector(vector(x, 16).into(), p));
    let d = scaled_vector(vector(x, 3).into(), s);
    let [xx, yy, zz] = [6, 7, 8].map(|at| x[at]);
    let [yz, xz, xy] = [9, 10, 11].map(|at| x[at]);
    let rows = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]].map(|row| scaled_vector(row, q));
    let times = |v: &[BigInt; 3]| rows.each_ref().map(|row| dot(row, v));
    let g = scaled_vector(vector(x, 12).into(), q + p);
    let gradient = sum(&times(&h), &g);
    let both = sum(&gradient, &g);
    let constant = dot(&h, &both) + scaled(x[15], q + 2 * p);
    [(dot(&d, &times(&d)), q + 2 * s), (dot(&d, &gradient), q + p + s), (constant, q + 2 * p)]
}

fn quadric_discriminant(x: &[f64]) -> Option<f64> {
    let (ray, row) = quadric_row(x)?;
    let (discriminant, bound) = quadric::discriminant(&ray, &row);
    Some(discriminant_ratio(discriminant, bound, &exact_quadric(x)))
}

fn quadric_coefficient(x: &[f64], which: usize) -> Option<f64> {
    let (ray, row) = quadric_row(x)?;
    Some(coefficient_ratio(quadric::bounded_coefficients(&ray, &row)[which], &exact_quadric(x)[which]))
}
