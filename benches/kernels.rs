//! One primitive test at a time: the exact kernels beside the f32 textbook formulas, on the same rays.
//!
//! Before anything is timed, the exact kernels' decisions are compared with exact arithmetic on a part of the rays, and
//! the number of rays that the textbook formula decides differently is printed.

// What is decided otherwise is said out loud.
#![allow(clippy::print_stderr)]

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use flatray::measure::generate::hash_unit;
use flatray::numeric::prepared::PreparedRay;
use flatray::numeric::quadric::Quadric;
use flatray::numeric::{quadric, sphere, tally, triangle};
use flatray::simd::{Batch, Isa, Simd};
use glam::{DMat4, DVec3, DVec4, Vec3};

const N_RAYS: usize = 4096;

/// Rays from a shell of radius 3 to points near the unit ball; f32-exact, so that both formulas see the same ray.
fn rays() -> Vec<PreparedRay> {
    (0..N_RAYS as u64)
        .filter_map(|i| {
            let unit = |k: u64| (hash_unit(i * 8 + k) * 2.0 - 1.0) as f32;
            let origin = Vec3::new(unit(0), unit(1), unit(2)).normalize_or(Vec3::X) * 3.0;
            let target = Vec3::new(unit(3), unit(4), unit(5)) * 0.9;
            let direction = target - origin;
            PreparedRay::new(origin.as_dvec3(), direction.as_dvec3(), 0.0, f64::INFINITY)
        })
        .collect()
}

const CORNERS: [Vec3; 3] = [Vec3::new(-1.0, -0.8, 0.1), Vec3::new(1.1, -0.7, -0.2), Vec3::new(0.1, 1.2, 0.3)];

fn ellipsoid() -> Quadric {
    Quadric::from_matrix(DMat4::from_cols(
        DVec4::new(1.2, 0.1, 0.0, 0.05),
        DVec4::new(0.1, 2.0, 0.2, 0.0),
        DVec4::new(0.0, 0.2, 1.5, -0.1),
        DVec4::new(0.05, 0.0, -0.1, -0.9),
    ))
}

/// Möller and Trumbore 1997, in f32, without tolerance.
fn moller_trumbore(ray: &PreparedRay) -> Option<f32> {
    let (o, d) = (ray.origin.as_vec3(), ray.direction.as_vec3());
    let [a, b, c] = CORNERS;
    let (e1, e2) = (b - a, c - a);
    let p = d.cross(e2);
    let det = e1.dot(p);
    if det == 0.0 {
        return None;
    }
    let s = o - a;
    let u = s.dot(p) / det;
    let q = s.cross(e1);
    let v = d.dot(q) / det;
    let t = e2.dot(q) / det;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0).then_some(t)
}

/// The quadratic formula in f32.
fn smaller_positive_root(a: f32, b: f32, c: f32) -> Option<f32> {
    let discriminant = b * b - a * c;
    if discriminant < 0.0 {
        return None;
    }
    let root = discriminant.sqrt();
    let (near, far) = ((-b - root) / a, (-b + root) / a);
    if near > 0.0 { Some(near) } else { (far > 0.0).then_some(far) }
}

fn naive_sphere(ray: &PreparedRay) -> Option<f32> {
    let (o, d) = (ray.origin.as_vec3(), ray.direction.as_vec3());
    smaller_positive_root(d.dot(d), o.dot(d), o.dot(o) - 1.0)
}

fn naive_quadric(ray: &PreparedRay, q: &Quadric) -> Option<f32> {
    let (o, d) = (ray.origin.as_vec3() - q.center.as_vec3(), ray.direction.as_vec3());
    let times = |v: Vec3| q.times(v.as_dvec3()).as_vec3();
    let g = q.linear.as_vec3();
    let gradient = times(o) + g;
    smaller_positive_root(d.dot(times(d)), d.dot(gradient), o.dot(gradient + g) + q.constant as f32)
}

/// A test that never gets to be certain, so that exact arithmetic decides.
fn untame(ray: &PreparedRay) -> PreparedRay {
    PreparedRay { tame: false, ..*ray }
}

fn check(rays: &[PreparedRay], quadric_row: &Quadric) {
    for ray in rays.iter().step_by(16) {
        let exact = triangle::intersect_exact(ray, CORNERS);
        assert_eq!(triangle::intersect(ray, CORNERS).map(|hit| hit.at.t), exact.map(|hit| hit.at.t));
        let of_sphere = |ray| sphere::intersect(ray, DVec3::ZERO, 1.0).map(|hit| hit.t);
        let of_quadric = |ray| quadric::intersect(ray, quadric_row, None).map(|hit| hit.t);
        assert_eq!(of_sphere(ray), of_sphere(&untame(ray)));
        assert_eq!(of_quadric(ray), of_quadric(&untame(ray)));
    }
    tally::take_exact_tests();
    let differing = |exact: &dyn Fn(&PreparedRay) -> bool, naive: &dyn Fn(&PreparedRay) -> bool| {
        let hits = rays.iter().filter(|ray| exact(ray)).count();
        assert!(hits * 10 > rays.len() && hits * 10 < rays.len() * 9, "{hits} hits of {} rays say nothing", rays.len());
        rays.iter().filter(|ray| exact(ray) != naive(ray)).count()
    };
    let of_triangle =
        differing(&|ray| triangle::intersect(ray, CORNERS).is_some(), &|ray| moller_trumbore(ray).is_some());
    let of_sphere =
        differing(&|ray| sphere::intersect(ray, DVec3::ZERO, 1.0).is_some(), &|ray| naive_sphere(ray).is_some());
    let of_quadric = differing(&|ray| quadric::intersect(ray, quadric_row, None).is_some(), &|ray| {
        naive_quadric(ray, quadric_row).is_some()
    });
    assert_eq!(tally::take_exact_tests(), 0, "ordinary rays need no exact arithmetic");
    eprintln!("decided otherwise by f32: triangle {of_triangle}, sphere {of_sphere}, quadric {of_quadric} of {N_RAYS}");
}

/// The same test over a batch, compiled for the best instruction set that the processor has. A type for each test and no
/// closure, since a closure need not be inlined, and what is not inlined is compiled for the baseline.
macro_rules! batch {
    ($name:ident, |$ray:ident, $row:ident| $test:expr) => {
        struct $name<'a> {
            rays: &'a [PreparedRay],
            row: &'a Quadric,
            hits: &'a mut usize,
        }

        impl Batch for $name<'_> {
            #[inline(always)]
            fn run<S: Simd>(self, _simd: S) {
                let $row = black_box(self.row);
                for $ray in self.rays {
                    *self.hits += usize::from($test);
                }
            }
        }
    };
}

batch!(Triangles, |ray, _row| triangle::intersect(ray, black_box(CORNERS)).is_some());
batch!(Occluders, |ray, _row| triangle::occludes(ray, black_box(CORNERS)));
batch!(Spheres, |ray, _row| sphere::intersect(ray, black_box(DVec3::ZERO), 1.0).is_some());
batch!(Quadrics, |ray, row| quadric::intersect(ray, row, None).is_some());

fn kernels(criterion: &mut Criterion) {
    let rays = rays();
    let row = ellipsoid();
    check(&rays, &row);
    let mut bench = |name: &str, test: &dyn Fn(&PreparedRay) -> bool| {
        criterion.bench_function(name, |bencher| {
            bencher.iter(|| rays.iter().filter(|ray| test(black_box(ray))).count());
        });
    };
    bench("triangle/exact", &|ray| triangle::intersect(ray, black_box(CORNERS)).is_some());
    bench("triangle/f32", &|ray| moller_trumbore(ray).is_some());
    bench("sphere/exact", &|ray| sphere::intersect(ray, black_box(DVec3::ZERO), 1.0).is_some());
    bench("sphere/f32", &|ray| naive_sphere(ray).is_some());
    bench("quadric/exact", &|ray| quadric::intersect(ray, black_box(&row), None).is_some());
    bench("quadric/f32", &|ray| naive_quadric(ray, black_box(&row)).is_some());
    macro_rules! bench_batch {
        ($name:expr, $batch:ident) => {
            criterion.bench_function($name, |bencher| {
                bencher.iter(|| {
                    let mut hits = 0;
                    Isa::detect().dispatch($batch { rays: &rays, row: &row, hits: &mut hits });
                    hits
                });
            });
        };
    }
    bench_batch!("triangle/exact, batch", Triangles);
    bench_batch!("triangle/occludes, batch", Occluders);
    bench_batch!("sphere/exact, batch", Spheres);
    bench_batch!("quadric/exact, batch", Quadrics);
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(20);
    targets = kernels
}
criterion_main!(benches);
