//! Pixel filters against what the analytic convolution says, and their independence of crops, threads and tiles.

/// Building worlds and rendering them.
mod world_kit {
    pub mod rendering;
    pub mod scenes;
    pub mod settings;
}

use flatray::film::{Film, Region};
use flatray::render::{Filter, Sampler, Settings};
use flatray::scene::{Compiled, Overrides, load_text};
use world_kit::rendering::render_world;
use world_kit::scenes::{load_scene, scene_names};
use world_kit::settings::center_settings;

const FILTERS: [Filter; 4] = [Filter::Box, Filter::Triangle, Filter::Gaussian, Filter::BlackmanHarris];

/// The density of a filter along one axis, up to a factor.
fn density(filter: Filter, x: f64) -> f64 {
    let angle = std::f64::consts::PI * x / 1.5;
    let cosines = [1.0, 2.0, 3.0].map(|k| (k * angle).cos());
    match filter {
        Filter::Box => 1.0,
        Filter::Triangle => 1.0 - x.abs(),
        Filter::Gaussian => (-2.0 * x * x).exp(),
        Filter::BlackmanHarris => 0.35875 + 0.48829 * cosines[0] + 0.14128 * cosines[1] + 0.01168 * cosines[2],
    }
}

/// The share of a filter that lies below an offset from the centre, by the midpoint rule: right to 1e-6.
fn share_below(filter: Filter, offset: f64) -> f64 {
    let radius = [0.5, 1.0, 1.5, 1.5][filter as usize];
    let integral = |to: f64| {
        let width = (to + radius) / 20_000.0;
        (0..20_000).map(|step| width * density(filter, -radius + (f64::from(step) + 0.5) * width)).sum::<f64>()
    };
    integral(offset.clamp(-radius, radius)) / integral(radius)
}

const SIZE_PX: u32 = 16;
const EDGE_PX: f64 = 8.3125;

/// A triangle of radiance 1 that covers all that lies left of (or above) [`EDGE_PX`].
fn half_plane(above: bool) -> Compiled {
    // The image plane at distance 1 spans −1 … 1; y points up. These numbers are exact in 32 bits.
    let edge = 2.0 * EDGE_PX / f64::from(SIZE_PX) - 1.0;
    let [a, b, c] = match above {
        false => [[edge, -100.0], [edge, 100.0], [-1000.0, 0.0]],
        true => [[-100.0, -edge], [100.0, -edge], [0.0, 1000.0]],
    };
    let corner = |name: &str, [x, y]: [f64; 2]| format!("{name} = [{x:?}, {y:?}, -1.0]\n");
    let scene = format!(
        "[camera]\nfov = 90\nwidth = {SIZE_PX}\nheight = {SIZE_PX}\n[[hittable]]\ntype = \"triangle\"\nk_a = 1\nk_d = 0\n{}{}{}",
        corner("a", a),
        corner("b", b),
        corner("c", c)
    );
    load_text(&scene, "half plane", None, &Overrides::default()).unwrap_or_else(|error| panic!("{error}"))
}

fn red(film: &Film, x: u32, y: u32) -> f64 {
    film.plane("R").unwrap().samples.get(film.data_window.index_of(x, y))
}

#[test]
fn the_image_of_an_edge_is_the_filters_distribution() {
    const N_STRATA: u32 = 32;
    for above in [false, true] {
        let scene = half_plane(above);
        for filter in FILTERS {
            let settings = Settings {
                samples: N_STRATA * N_STRATA,
                sampler: Sampler::Jitter,
                filter,
                seed: 11,
                ..center_settings(&scene.camera)
            };
            let film = render_world(&scene.world, &scene.camera, &settings).film;
            for along in 0..SIZE_PX {
                let expected = share_below(filter, EDGE_PX - (f64::from(along) + 0.5));
                let mut sum = 0.0;
                for across in 0..SIZE_PX {
                    let value = if above { red(&film, across, along) } else { red(&film, along, across) };
                    // Only the cells that the edge runs through are in doubt: one of each row of strata.
                    assert!(
                        (value - expected).abs() <= 1.0 / f64::from(N_STRATA),
                        "{filter:?}: {value} for {expected}"
                    );
                    let coverage = film.plane("A").unwrap().samples.get(film.data_window.index_of(along, across));
                    assert_eq!(coverage, red(&film, along, across), "{filter:?}: coverage is filtered alike");
                    sum += value;
                }
                // Those are right or wrong by chance, each with a deviation of at most half of 1/N²; the mean of 16 pixels
                // deviates by √32/2/1024/4 at most, and six times that is as good as never.
                let deviation = f64::from(N_STRATA).sqrt() / 2.0 / f64::from(N_STRATA * N_STRATA) / 4.0;
                let mean = sum / f64::from(SIZE_PX);
                assert!(
                    (mean - expected).abs() < 6.0 * deviation + 1e-5,
                    "{filter:?} at {along}: {mean} for {expected}"
                );
            }
        }
    }
}

/// All bits of all planes.
fn bits(film: &Film, region: Region) -> Vec<u64> {
    let places = (region.y0..region.y1).flat_map(|y| (region.x0..region.x1).map(move |x| (x, y)));
    let indices: Vec<usize> = places.map(|(x, y)| film.data_window.index_of(x, y)).collect();
    film.planes.iter().flat_map(|plane| indices.iter().map(|&at| plane.samples.get(at).to_bits())).collect()
}

#[test]
fn crops_threads_and_tiles_do_not_show_in_a_filtered_image() {
    for name in scene_names() {
        let scene = load_scene(&name, 60, 44);
        for filter in FILTERS {
            let jittered = Settings { samples: 5, sampler: Sampler::Jitter, filter, ..center_settings(&scene.camera) };
            let whole = render_world(&scene.world, &scene.camera, &jittered).film;
            // To the border and through the middle.
            for (x0, y0, x1, y1) in [(0, 0, 60, 1), (17, 9, 50, 31), (59, 43, 60, 44)] {
                let region = Region { x0, y0, x1, y1 };
                let settings = Settings { region, threads: 3, tile_size_px: 7, ..jittered.clone() };
                let part = render_world(&scene.world, &scene.camera, &settings).film;
                assert!(bits(&part, region) == bits(&whole, region), "{name}, {filter:?}, {region:?}");
            }
        }
    }
}

#[test]
fn filters_differ_from_each_other_but_not_in_a_single_sample() {
    let scene = load_scene("room", 40, 30);
    let whole = Region::whole(40, 30);
    let image = |samples, filter| {
        let settings = Settings { samples, sampler: Sampler::Jitter, filter, ..center_settings(&scene.camera) };
        bits(&render_world(&scene.world, &scene.camera, &settings).film, whole)
    };
    for (index, &filter) in FILTERS.iter().enumerate() {
        assert!(image(1, filter) == image(1, Filter::Box), "{filter:?}");
        for &other in &FILTERS[..index] {
            assert!(image(4, filter) != image(4, other), "{filter:?} and {other:?}");
        }
    }
}
