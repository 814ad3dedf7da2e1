//! Samplers, adaptive samples and what they say of their error; the cut-off of contributions.

/// Building worlds and rendering them.
mod world_kit {
    pub mod layers;
    pub mod rendering;
    pub mod scenes;
    pub mod settings;
}

use flatray::accel::{Accel, AccelKind};
use flatray::film::{Film, Region};
use flatray::measure::difference::compare;
use flatray::render::{Adaptive, Aov, Aovs, Control, Sampler, Settings, Spread, new_film, refine, render};
use flatray::scene::Compiled;
use flatray::world::{Camera, World};
use glam::{DMat4, Vec3};
use world_kit::layers::all_layers;
use world_kit::rendering::render_world;
use world_kit::scenes::{load_scene, scene_names};
use world_kit::settings::center_settings;

/// A camera that sees the square from −1 to 1 in the plane z = −1.
fn square_camera(edge_px: u32) -> Camera {
    let fov_y_radians = std::f64::consts::FRAC_PI_2;
    Camera { world_from_camera: DMat4::IDENTITY, fov_y_radians, width_px: edge_px, height_px: edge_px }
}

/// The radiance of the default material without a light.
const GLOW: f64 = 0.1;

/// How much of a pixel a triangle in the plane z = −1 covers: the area of what is left of it, cut by the four sides.
fn coverage(triangle: &[Vec3; 3], edge_px: u32, x: u32, y: u32) -> f64 {
    let to_px = |p: &Vec3| {
        [(f64::from(p.x) + 1.0) * f64::from(edge_px) / 2.0, (1.0 - f64::from(p.y)) * f64::from(edge_px) / 2.0]
    };
    let mut polygon: Vec<[f64; 2]> = triangle.iter().map(to_px).collect();
    for (axis, limit, sign) in
        [(0, x, 1.0), (0, x + 1, -1.0), (1, y, 1.0), (1, y + 1, -1.0)].map(|(a, l, s)| (a, f64::from(l), s))
    {
        let inside = |p: &[f64; 2]| sign * (p[axis] - limit);
        let mut cut = Vec::new();
        for (at, to) in polygon.iter().enumerate() {
            let from = &polygon[(at + polygon.len() - 1) % polygon.len()];
            let (a, b) = (inside(from), inside(to));
            if (a < 0.0) != (b < 0.0) {
                let t = a / (a - b);
                cut.push([from[0] + t * (to[0] - from[0]), from[1] + t * (to[1] - from[1])]);
            }
            if b >= 0.0 {
                cut.push(*to);
            }
        }
        polygon = cut;
    }
    let cross = |i: usize| {
        let (a, b) = (polygon[i], polygon[(i + 1) % polygon.len()]);
        a[0] * b[1] - a[1] * b[0]
    };
    0.5 * (0..polygon.len()).map(cross).sum::<f64>().abs()
}

const SLANTED: [Vec3; 3] =
    [Vec3::new(-0.8125, -0.71875, -1.0), Vec3::new(0.84375, -0.28125, -1.0), Vec3::new(-0.15625, 0.78125, -1.0)];

fn green(film: &Film) -> Vec<f64> {
    let plane = film.plane("G").unwrap();
    (0..film.n_pixels()).map(|index| plane.samples.get(index)).collect()
}

#[test]
fn every_estimator_has_the_pixel_integral_as_its_mean() {
    const EDGE_PX: u32 = 16;
    const N_SEEDS: u64 = 300;
    let camera = square_camera(EDGE_PX);
    let world = World::from_triangles(SLANTED.to_vec(), vec![[0, 1, 2]]).unwrap();
    let accel = Accel::build(&world, AccelKind::Bvh);
    let uniform = |sampler| Settings { samples: 4, sampler, ..center_settings(&camera) };
    let adaptive =
        |threshold| Settings { spread: Spread::Adaptive(Adaptive::new(threshold)), ..center_settings(&camera) };
    let estimators = [
        ("random", uniform(Sampler::Random)),
        ("jitter", uniform(Sampler::Jitter)),
        ("sobol", uniform(Sampler::Sobol)),
        ("undivided", adaptive(1.0)),
        ("divided", adaptive(0.02)),
        ("finely divided", adaptive(0.002)),
    ];
    let exact: Vec<f64> =
        (0..EDGE_PX * EDGE_PX).map(|i| GLOW * coverage(&SLANTED, EDGE_PX, i % EDGE_PX, i / EDGE_PX)).collect();
    for (name, settings) in estimators {
        let (mut sums, mut squares) = (vec![0.0; exact.len()], vec![0.0; exact.len()]);
        for seed in 0..N_SEEDS {
            let settings = Settings { seed, ..settings.clone() };
            let film = render(&world, &accel, &camera, &settings, &Control::default()).unwrap().film;
            for (pixel, value) in green(&film).into_iter().enumerate() {
                sums[pixel] += value - exact[pixel];
                squares[pixel] += (value - exact[pixel]).powi(2);
            }
        }
        // By pixel, the mean's distance from the integral in standard deviations of it. Their squares have the mean 1 and the
        // variance 2: all together, and each alone, are held to five standard deviations (6e-7, and 6e-7 a pixel).
        let n = N_SEEDS as f64;
        let scores: Vec<f64> = (0..exact.len())
            // What is hardly ever hit, or hardly ever missed, is far from normally distributed.
            .filter(|&pixel| (0.03..0.97).contains(&(exact[pixel] / GLOW)))
            .map(|pixel| sums[pixel] / (squares[pixel] - sums[pixel] * sums[pixel] / n).sqrt() * ((n - 1.0) / n).sqrt())
            .collect();
        assert!(scores.len() >= 35, "{name}: only {} pixels have an edge", scores.len());
        let all: f64 = scores.iter().map(|score| score * score).sum();
        let expected = scores.len() as f64;
        assert!((all - expected).abs() < 5.0 * (2.0 * expected).sqrt(), "{name}: {all} for {expected}");
        assert!(scores.iter().all(|score| score.abs() < 5.0), "{name}: {scores:?}");
    }
}

/// RMSE of the pixels that the sides of the triangle cross, for a contrast of 1, and camera rays for each of them.
fn edge_error(settings: &Settings, camera: &Camera) -> (f64, f64) {
    let edge_px = camera.width_px;
    let world = World::from_triangles(SLANTED.to_vec(), vec![[0, 1, 2]]).unwrap();
    let accel = Accel::build(&world, AccelKind::Bvh);
    let rendered = render(&world, &accel, camera, settings, &Control::default()).unwrap();
    let (mut squares, mut n_edge) = (0.0, 0);
    for (index, value) in green(&rendered.film).into_iter().enumerate() {
        let covered = coverage(&SLANTED, edge_px, index as u32 % edge_px, index as u32 / edge_px);
        // Sums of products of coordinates up to 64 round by 64²·10u at most.
        if covered > 0.0 && covered < 1.0 - 1e-9 {
            squares += (value / GLOW - covered).powi(2);
            n_edge += 1;
        }
    }
    ((squares / f64::from(n_edge)).sqrt(), rendered.rays.camera as f64 / f64::from(n_edge))
}

/// The exponent of error over samples between two measurements.
fn slope((error_a, samples_a): (f64, f64), (error_b, samples_b): (f64, f64)) -> f64 {
    (error_b / error_a).ln() / (samples_b / samples_a).ln()
}

#[test]
fn on_edges_the_default_takes_fifty_times_fewer_samples_than_chance_and_adaptive_ones_fewer_still() {
    let camera = square_camera(64);
    let uniform = |sampler, samples| {
        let settings = Settings { samples, sampler, ..center_settings(&camera) };
        (edge_error(&settings, &camera).0, f64::from(samples))
    };
    let (few, many) = (uniform(Sampler::default(), 64), uniform(Sampler::default(), 4096));
    let default_slope = slope(few, many);
    assert!(default_slope <= -0.72, "{default_slope}");
    // Along the line between the two, and along the law of chance.
    let default_samples = few.1 * (1e-3 / few.0).powf(1.0 / default_slope);
    let random = uniform(Sampler::Random, 1024);
    let random_samples = random.1 * (random.0 / 1e-3).powi(2);
    let gain = random_samples / default_samples;
    println!(
        "slope {default_slope:.3}, {default_samples:.0} instead of {random_samples:.0} samples, {gain:.1} times fewer"
    );
    assert!(gain >= 50.0, "{gain}");

    let adaptive = |threshold| {
        let spread = Spread::Adaptive(Adaptive::new(threshold));
        edge_error(&Settings { spread, ..center_settings(&camera) }, &camera)
    };
    let adaptive_slope = slope(adaptive(1e-2), adaptive(1e-5));
    println!("adaptive slope {adaptive_slope:.3}");
    assert!(adaptive_slope <= -0.9, "{adaptive_slope}");
}

/// An image with an error far below those that are judged by it, and that error.
fn reference(scene: &Compiled, accel: &Accel, max_depth: u32) -> (Film, f64) {
    let spread = Spread::Adaptive(Adaptive { min_splits: 1, ..Adaptive::new(2e-4) });
    let settings = Settings { spread, seed: 1 << 40, max_depth, ..center_settings(&scene.camera) };
    let rendered = render(&scene.world, accel, &scene.camera, &settings, &Control::default()).unwrap();
    (rendered.film, rendered.rmse_estimate.unwrap())
}

#[test]
fn the_error_that_a_render_tells_is_its_error() {
    let mut n_judged = 0;
    for name in scene_names() {
        let scene = load_scene(&name, 120, 80);
        let accel = Accel::build(&scene.world, AccelKind::Bvh);
        let max_depth = scene.render.max_depth.unwrap_or(5);
        let (reference, error_of_reference) = reference(&scene, &accel, max_depth);
        let uniform = |sampler, samples| Settings { samples, sampler, ..center_settings(&scene.camera) };
        let adaptive = |threshold| Settings {
            spread: Spread::Adaptive(Adaptive::new(threshold)),
            ..center_settings(&scene.camera)
        };
        let settings = [
            uniform(Sampler::Random, 8),
            uniform(Sampler::Sobol, 4),
            uniform(Sampler::Sobol, 11),
            uniform(Sampler::Sobol, 32),
            adaptive(0.25),
            adaptive(0.02),
        ];
        for settings in settings {
            let settings = Settings { max_depth, ..settings };
            let rendered = render(&scene.world, &accel, &scene.camera, &settings, &Control::default()).unwrap();
            let told = rendered.rmse_estimate.unwrap();
            if told < 4.0 * error_of_reference {
                continue;
            }
            let distance = compare(&rendered.film, &reference).unwrap().rmse;
            let found = (distance * distance - error_of_reference * error_of_reference).sqrt();
            let what = format!("{name}, {:?} × {:?}, {:?}", settings.samples, settings.sampler, settings.spread);
            assert!((found / 1.5..found * 1.5).contains(&told), "{what}: told {told:e}, found {found:e}");
            n_judged += 1;
        }
    }
    assert!(n_judged > 80, "only {n_judged} errors were large enough");
}

#[test]
fn samplers_that_tell_no_error_say_so() {
    let scene = load_scene("sphere", 12, 8);
    for (sampler, samples, tells) in [
        (Sampler::Center, 1, false),
        (Sampler::Grid, 16, false),
        (Sampler::Jitter, 16, false),
        (Sampler::Sobol, 1, false),
        (Sampler::Sobol, 3, false),
        (Sampler::Sobol, 4, true),
        (Sampler::Random, 5, true),
    ] {
        let settings = Settings { sampler, samples, ..center_settings(&scene.camera) };
        let told = render_world(&scene.world, &scene.camera, &settings).rmse_estimate;
        assert_eq!(told.is_some(), tells, "{sampler:?} × {samples}");
    }
}

/// All bits of all planes.
fn bits(film: &Film) -> Vec<u64> {
    let planes = film.planes.iter();
    planes.flat_map(|plane| (0..plane.samples.len()).map(|index| plane.samples.get(index).to_bits())).collect()
}

#[test]
fn adaptive_samples_are_the_same_bits_for_any_threads_tiles_and_crop() {
    for name in ["default", "glass", "instances", "light_groups"] {
        let scene = load_scene(name, 75, 41);
        let accel = Accel::build(&scene.world, AccelKind::Bvh);
        let spread = Spread::Adaptive(Adaptive::new(0.02));
        let settings = Settings { spread, threads: 1, aovs: all_layers(&scene), ..center_settings(&scene.camera) };
        let shoot =
            |settings: &Settings| render(&scene.world, &accel, &scene.camera, settings, &Control::default()).unwrap();
        let one = shoot(&settings);
        for (threads, tile_size_px) in [(2, 32), (8, 32), (8, 5)] {
            let other = shoot(&Settings { threads, tile_size_px, ..settings.clone() });
            assert!(bits(&other.film) == bits(&one.film), "{name}, {threads} threads, tiles of {tile_size_px}");
            assert_eq!(other.rmse_estimate, one.rmse_estimate, "{name}");
        }
        let region = Region { x0: 7, y0: 3, x1: 70, y1: 35 };
        let part = shoot(&Settings { region, threads: 2, ..settings.clone() }).film;
        for (whole, part) in one.film.planes.iter().zip(&part.planes) {
            let same = (region.y0..region.y1).all(|y| {
                (region.x0..region.x1).all(|x| {
                    let here = part.samples.get(region.index_of(x, y));
                    here.to_bits() == whole.samples.get((y * 75 + x) as usize).to_bits()
                })
            });
            assert!(same, "{name}: plane {} of a crop", whole.name);
        }
    }
}

#[test]
fn a_target_is_met_with_the_same_bits_for_any_threads() {
    let scene = load_scene("default", 160, 90);
    let accel = Accel::build(&scene.world, AccelKind::Bvh);
    for target in [2e-2, 2e-3] {
        let run = |threads| {
            let settings = Settings { threads, ..center_settings(&scene.camera) };
            let mut film = new_film(&scene.camera, &settings);
            let control = Control::default();
            let refined = refine(&scene.world, &accel, &scene.camera, &settings, target, &control, &mut film).unwrap();
            (film, refined)
        };
        let (film, refined) = run(1);
        let told = refined.rmse_estimate.unwrap();
        assert!(told <= target && told > target / 3.0, "{told:e} for {target:e}");
        for threads in [2, 8] {
            let (other, refined_too) = run(threads);
            assert!(bits(&film) == bits(&other), "{threads} threads, {target:e}");
            assert_eq!(refined, refined_too);
        }
    }
}

#[test]
fn what_is_cut_off_is_never_more_than_the_bound() {
    let (mut n_saved, mut n_kept) = (0, 0);
    for name in scene_names() {
        let scene = load_scene(&name, 64, 48);
        let accel = Accel::build(&scene.world, AccelKind::Bvh);
        let whole = Settings { samples: 4, sampler: Sampler::Sobol, max_depth: 12, ..center_settings(&scene.camera) };
        let shoot =
            |settings: &Settings| render(&scene.world, &accel, &scene.camera, settings, &Control::default()).unwrap();
        let uncut = shoot(&whole);
        let largest = green(&uncut.film).into_iter().fold(1.0, f64::max);
        for cutoff in [1e-5, 1e-4, 3e-3, 0.1] {
            let cut = shoot(&Settings { cutoff, ..whole.clone() });
            let lost = compare(&uncut.film, &cut.film).unwrap().max;
            // Both images are rounded to 32 bits.
            let bound = cutoff + largest * f64::from(f32::EPSILON);
            assert!(lost <= bound, "{name}: {lost:e} is lost with a cut-off of {cutoff:e}");
            assert!(cut.rays.total() <= uncut.rays.total(), "{name}");
            n_saved += uncut.rays.total() - cut.rays.total();
            n_kept += cut.rays.total();
        }
    }
    assert!(n_saved > n_kept / 50, "{n_saved} rays saved, {n_kept} sent");
}

/// A wire in the plane z = −1, as two triangles.
fn wire(from: [f32; 2], to: [f32; 2], width: f32) -> World {
    let along = [to[0] - from[0], to[1] - from[1]];
    let length = along[0].hypot(along[1]);
    let across = [-along[1] / length * width / 2.0, along[0] / length * width / 2.0];
    let at = |end: [f32; 2], side: f32| Vec3::new(end[0] + side * across[0], end[1] + side * across[1], -1.0);
    let corners = vec![at(from, -1.0), at(from, 1.0), at(to, 1.0), at(to, -1.0)];
    World::from_triangles(corners, vec![[0, 1, 2], [0, 2, 3]]).unwrap()
}

#[test]
fn a_wire_of_a_fiftieth_of_a_pixel_is_found_in_every_pixel_that_it_crosses() {
    const EDGE_PX: u32 = 64;
    let camera = square_camera(EDGE_PX);
    let pixel = 2.0 / EDGE_PX as f32;
    let world = wire([-0.9, -0.61], [0.93, 0.47], pixel / 50.0);
    let aovs = Aovs::of(&[Aov::Samples]);
    let spread = Spread::Adaptive(Adaptive::new(0.01));
    let settings = Settings { spread, aovs, ..center_settings(&camera) };
    let film = render_world(&world, &camera, &settings).film;
    let samples = film.plane("samples.I").unwrap();
    // Pixels on the way, but for their ends.
    let n_steps = 2000;
    for step in 0..=n_steps {
        let t = f64::from(step) / f64::from(n_steps);
        let (x, y) = (-0.9 + t * 1.83, -0.61 + t * 1.08);
        let column = ((x + 1.0) * 32.0) as usize;
        let row = ((1.0 - y) * 32.0) as usize;
        let n = samples.samples.get(row * EDGE_PX as usize + column);
        assert!(n >= 8.0, "{n} samples in pixel {column}, {row}");
    }
    // The wire's length in pixels times its width; pixels that it leaves alone have no part in it.
    let expected = GLOW * f64::from(1.83_f32.hypot(1.08) / pixel) / 50.0;
    let is_seen = |film: &Film| {
        let n_seen = green(film).iter().filter(|&&value| value > 0.0).count();
        assert!(n_seen > 40, "the wire is seen in {n_seen} pixels");
        let found: f64 = green(film).iter().sum();
        assert!((found / expected - 1.0).abs() < 0.2, "{found} of {expected}");
    };
    is_seen(&film);
    // A target finds it too, though the samples that foretell show nothing.
    let settings = center_settings(&camera);
    let (accel, control) = (Accel::build(&world, AccelKind::Bvh), Control::default());
    let mut film = new_film(&camera, &settings);
    refine(&world, &accel, &camera, &settings, 2e-3, &control, &mut film).unwrap();
    is_seen(&film);
}

#[test]
fn what_hides_nothing_is_not_searched() {
    let camera = square_camera(64);
    let spread = Spread::Adaptive(Adaptive::new(0.5));
    let settings = Settings { spread, ..center_settings(&camera) };
    // Walls that face the camera, lean away from it and back, at several distances.
    for (z, lean) in [(-1.0, 0.0), (-1000.7, 0.0), (-0.013, 0.0), (-3.1, 0.4), (-3.1, -0.7)] {
        let corner = |x: f32, y: f32| Vec3::new(-4.0 * x * z, -4.0 * y * z, z * (1.0 + 0.2 * lean * y));
        let corners = vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        let world = World::from_triangles(corners, vec![[0, 1, 2], [0, 2, 3]]).unwrap();
        let camera_rays = render_world(&world, &camera, &settings).rays.camera;
        // A sample that decides, also in the ring of each block; a pair that counts, or two.
        let per_pixel = camera_rays as f64 / f64::from(64 * 64);
        assert!((4.0..4.3).contains(&per_pixel), "{per_pixel} samples per pixel of a wall at {z}, {lean}");
    }
}

#[test]
fn a_checker_to_the_horizon_is_as_good_there_as_elsewhere() {
    let scene = load_scene("default", 160, 90);
    let accel = Accel::build(&scene.world, AccelKind::Bvh);
    let (exact, _) = reference(&scene, &accel, 5);
    let spread = Spread::Adaptive(Adaptive::new(0.02));
    let settings = Settings { spread, ..center_settings(&scene.camera) };
    let rendered = render_world(&scene.world, &scene.camera, &settings);
    let told = rendered.rmse_estimate.unwrap();
    let (found, exact) = (green(&rendered.film), green(&exact));
    // The horizon is in the 21st row; the rows below are the densest squares.
    let rows = 20 * 160..24 * 160;
    let squares: f64 = rows.clone().map(|index| (found[index] - exact[index]).powi(2)).sum();
    let rmse = (squares / rows.len() as f64).sqrt();
    assert!(rmse < 4.0 * told, "{rmse:e} at the horizon, {told:e} in all");
}
