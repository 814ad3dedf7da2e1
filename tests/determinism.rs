//! The same bits whatever the number of threads, the size of tiles, the crop or the way hits are found.

/// Building worlds and rendering them.
mod world_kit {
    pub mod course;
    pub mod layers;
    pub mod scenes;
    pub mod settings;
}

use std::io::Cursor;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use flatray::accel::{Accel, AccelKind, Mode, Preset};
use flatray::film::output::Format;
use flatray::film::{Display, EncodeOptions, Encoder, Film, Picture, Region, Rows};
use flatray::render::{Aov, Control, Rendered, Sampler, Settings, Stopped, n_tiles, new_film, render, render_into};
use flatray::scene::{Compiled, Overrides, load_text};
use flatray::simd::Isa;
use world_kit::course::course_settings;
use world_kit::layers::{all_layers, layers};
use world_kit::scenes::{load_scene, scene_names};
use world_kit::settings::center_settings;

/// Five jittered samples: odd counts put batch borders inside of pixels.
fn jittered(scene: &Compiled) -> Settings {
    let max_depth = scene.render.max_depth.unwrap_or(5);
    Settings { samples: 5, sampler: Sampler::Jitter, seed: 7, max_depth, ..center_settings(&scene.camera) }
}

fn shoot(scene: &Compiled, accel: &Accel, settings: &Settings) -> Rendered {
    render(&scene.world, accel, &scene.camera, settings, &Control::default()).unwrap()
}

/// All bits of all planes: `==` would take −0 for 0, and NaN for another NaN.
fn bits(film: &Film) -> Vec<u64> {
    let planes = film.planes.iter();
    planes.flat_map(|plane| (0..plane.samples.len()).map(|index| plane.samples.get(index).to_bits())).collect()
}

fn assert_same(a: &Rendered, b: &Rendered, what: &str) {
    let differing = bits(&a.film).iter().zip(&bits(&b.film)).filter(|(a, b)| a != b).count();
    assert_eq!((differing, a.film.n_pixels()), (0, b.film.n_pixels()), "values that differ: {what}");
    assert_eq!(a.rays, b.rays, "{what}");
}

#[test]
fn threads_and_tiles_do_not_show_in_the_bits_of_any_scene() {
    for name in scene_names() {
        let scene = load_scene(&name, 75, 41);
        let accel = Accel::build(&scene.world, AccelKind::Bvh);
        let settings = Settings { threads: 1, aovs: all_layers(&scene), ..jittered(&scene) };
        let reference = shoot(&scene, &accel, &settings);
        assert!(bits(&reference.film).iter().any(|&bits| bits != 0), "{name} is black");
        for (threads, tile_size_px) in [(1, 7), (1, 1000), (2, 8), (2, 32), (5, 64), (5, 1)] {
            let other = shoot(&scene, &accel, &Settings { threads, tile_size_px, ..settings.clone() });
            assert_same(&other, &reference, &format!("{name}, {threads} threads, tiles of {tile_size_px}"));
        }
    }
}

#[test]
fn instruction_sets_modes_and_presets_do_not_show_in_the_bits_of_any_scene() {
    for name in scene_names() {
        let scene = load_scene(&name, 37, 23);
        let settings = jittered(&scene);
        let reference = shoot(&scene, &Accel::build(&scene.world, AccelKind::Linear), &settings);
        for preset in Preset::ALL {
            let accel = Accel::build_with(&scene.world, AccelKind::Bvh, preset);
            for isa in Isa::ALL.into_iter().filter(|isa| isa.is_available()) {
                for mode in Mode::ALL {
                    let other = shoot(&scene, &accel.clone().with_isa(isa).with_mode(mode), &settings);
                    assert_same(&other, &reference, &format!("{name}, {preset:?}, {isa:?}, {mode:?}"));
                }
            }
        }
    }
}

fn all_but_cost() -> Vec<Aov> {
    Aov::ALL.into_iter().filter(|&aov| aov != Aov::Cost).collect()
}

#[test]
fn trees_of_mirrored_and_refracted_rays_have_the_same_bits_on_any_threads_and_tiles() {
    let text = "[render]\nmax_depth = 12\nbackground = [0.3, 0.5, 0.9]\ntwo_sided = true\n\
        [camera]\nfov = 40\nwidth = 33\nheight = 21\n\
        [[light_source]]\nposition = [2, 5, 1]\n\
        [[material]]\nname = \"glass\"\nk_d = 0.1\nk_s = 0.2\nk_t = 0.7\nsh = 50\n\
        [[hittable]]\ntype = \"sphere\"\nposition = [-1, 0, -4]\nradius = 1\nmaterial = \"glass\"\n\
        [[hittable]]\ntype = \"sphere\"\nposition = [1, 0, -4]\nradius = 1\nmaterial = \"glass\"\n\
        [[hittable]]\ntype = \"sphere\"\nposition = [1, 0.1, -4]\nradius = 0.5\nmaterial = \"glass\"\n\
        [[hittable]]\ntype = \"sphere\"\nposition = [0, -101, -4]\nradius = 100\nk_s = 0.3\n";
    let scene = load_text(text, "glass.toml", None, &Overrides::default()).unwrap();
    let accel = Accel::build(&scene.world, AccelKind::Bvh);
    let settings = Settings { threads: 1, aovs: all_layers(&scene), ..jittered(&scene) };
    let reference = shoot(&scene, &accel, &settings);
    let counts = reference.rays;
    assert!(counts.refraction > 30_000 && counts.reflection > 30_000, "{counts:?}");
    for (threads, tile_size_px) in [(1, 7), (1, 1000), (2, 8), (2, 32), (5, 64), (5, 1)] {
        let other = shoot(&scene, &accel, &Settings { threads, tile_size_px, ..settings.clone() });
        assert_same(&other, &reference, &format!("{threads} threads, tiles of {tile_size_px}"));
    }
    for mode in Mode::ALL {
        assert_same(&shoot(&scene, &accel.clone().with_mode(mode), &settings), &reference, &format!("{mode:?}"));
    }
    // The full scan costs something else.
    let settings = Settings { aovs: layers(&scene, &all_but_cost()), ..settings };
    let linear = Accel::build(&scene.world, AccelKind::Linear);
    assert_same(&shoot(&scene, &linear, &settings), &shoot(&scene, &accel, &settings), "the full scan");
}

#[test]
fn files_encoded_while_the_frame_is_rendered_are_those_that_are_encoded_at_once() {
    let bytes = |encoder: &Encoder, film: &Film| {
        let mut out = Cursor::new(Vec::new());
        encoder.write(film, &mut out).unwrap();
        out.into_inner()
    };
    let scene = load_scene("mesh", 75, 83);
    let accel = Accel::build(&scene.world, AccelKind::Bvh);
    let region = Region { x0: 3, y0: 5, x1: 74, y1: 82 };
    let settings = Settings { samples: 1, region, ..jittered(&scene) };
    let display = Display::Picture(Picture { exposure_stops: 0.5, ..Picture::default() });
    let options = EncodeOptions::of_display(display);
    let finished = shoot(&scene, &accel, &settings).film;
    for format in [Format::Exr, Format::Png, Format::Pfm] {
        let expected = bytes(&Encoder::new(format, &finished, &options).unwrap(), &finished);
        for (threads, tile_size_px) in [(1, 7), (2, 8), (2, 32), (5, 48), (1, 1000)] {
            let settings = Settings { threads, tile_size_px, ..settings.clone() };
            let mut film = new_film(&scene.camera, &settings);
            let encoder = Encoder::new(format, &film, &options).unwrap();
            let n_rows = AtomicUsize::new(0);
            let encode = |rows: &Rows| {
                n_rows.fetch_add(rows.n_rows(), Ordering::Relaxed);
                encoder.encode(rows);
            };
            let control = Control::default();
            render_into(&scene.world, &accel, &scene.camera, &settings, &control, &mut film, &encode).unwrap();
            assert_eq!(n_rows.into_inner(), 77, "every row is handed over once");
            assert!(bytes(&encoder, &film) == expected, "{format:?}, {threads} threads, tiles of {tile_size_px}");
        }
    }
}

#[test]
fn the_bvh_and_the_full_scan_give_the_same_bits_on_every_scene() {
    for name in scene_names() {
        let scene = load_scene(&name, 64, 48);
        let settings = Settings { samples: 2, ..jittered(&scene) };
        let [bvh, linear] =
            [AccelKind::Bvh, AccelKind::Linear].map(|kind| shoot(&scene, &Accel::build(&scene.world, kind), &settings));
        assert_same(&bvh, &linear, &name);
    }
}

#[test]
fn a_crop_holds_the_pixels_of_the_whole_image() {
    for name in scene_names() {
        let scene = load_scene(&name, 60, 40);
        let accel = Accel::build(&scene.world, AccelKind::Bvh);
        let whole = shoot(&scene, &accel, &jittered(&scene)).film;
        let right_and_below = Region { x0: 33, y0: 17, x1: 60, y1: 40 };
        let one_pixel = Region { x0: 30, y0: 20, x1: 31, y1: 21 };
        for region in [right_and_below, one_pixel] {
            let part = shoot(&scene, &accel, &Settings { region, tile_size_px: 16, ..jittered(&scene) }).film;
            assert_eq!((part.width_px, part.height_px, part.data_window), (60, 40, region), "{name}");
            for (whole, part) in whole.planes.iter().zip(&part.planes) {
                for y in region.y0..region.y1 {
                    for x in region.x0..region.x1 {
                        let expected = whole.samples.get(Region::whole(60, 40).index_of(x, y));
                        let found = part.samples.get(region.index_of(x, y));
                        assert_eq!(found.to_bits(), expected.to_bits(), "{name} at {x},{y}");
                    }
                }
            }
        }
    }
}

#[test]
fn structures_built_on_different_numbers_of_threads_are_the_same() {
    for name in ["default", "mesh"] {
        let scene = load_scene(name, 64, 36);
        let build = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| Accel::build(&scene.world, AccelKind::Bvh))
        };
        let (one, three) = (build(1), build(3));
        assert_eq!(format!("{one:?}"), format!("{three:?}"), "{name}");
        assert!(one.stats().n_nodes > 0, "{name}");
        assert_same(&shoot(&scene, &one, &jittered(&scene)), &shoot(&scene, &three, &jittered(&scene)), name);
    }
}

#[test]
fn the_course_mode_is_deterministic_too() {
    let scene = load_scene("default", 70, 40);
    let accel = Accel::build(&scene.world, AccelKind::Bvh);
    let settings = Settings { threads: 1, ..course_settings(&scene.camera) };
    let reference = shoot(&scene, &accel, &settings);
    let other = shoot(&scene, &accel, &Settings { threads: 3, tile_size_px: 9, ..settings });
    assert_same(&other, &reference, "course");
}

#[test]
fn another_seed_gives_another_image_and_the_same_seed_the_same() {
    let scene = load_scene("sphere", 40, 30);
    let accel = Accel::build(&scene.world, AccelKind::Bvh);
    let with_seed = |seed| bits(&shoot(&scene, &accel, &Settings { seed, ..jittered(&scene) }).film);
    assert_eq!(with_seed(1), with_seed(1));
    assert_ne!(with_seed(1), with_seed(2));
}

#[test]
fn a_render_that_is_told_to_stop_before_it_starts_traces_nothing() {
    let scene = load_scene("sphere", 64, 64);
    let accel = Accel::build(&scene.world, AccelKind::Bvh);
    let control = Control::default();
    control.request_stop();
    let stopped = render(&scene.world, &accel, &scene.camera, &jittered(&scene), &control);
    assert_eq!(stopped.map(|_| ()), Err(Stopped));
    assert_eq!(control.tiles_done.load(Ordering::Relaxed), 0);
    assert_eq!(control.rays_traced.load(Ordering::Relaxed), 0);
}

#[test]
fn a_stop_ends_a_render_inside_of_a_pixel_of_a_million_samples() {
    let scene = load_scene("default", 64, 64);
    let accel = Accel::build(&scene.world, AccelKind::Bvh);
    // A second of work for each of the 4096 pixels of the only tile.
    let settings = Settings { samples: 1_000_000, tile_size_px: 64, threads: 1, ..jittered(&scene) };
    let control = Control::default();
    let (stopped, after) = std::thread::scope(|scope| {
        let worker = scope.spawn(|| {
            let result = render(&scene.world, &accel, &scene.camera, &settings, &control).map(|_| ());
            (result, Instant::now())
        });
        std::thread::sleep(Duration::from_millis(500));
        let asked = Instant::now();
        control.request_stop();
        let (result, ended) = worker.join().unwrap();
        (result, ended.saturating_duration_since(asked))
    });
    assert_eq!(stopped, Err(Stopped));
    assert!(after < Duration::from_secs(2), "the render went on for {after:?}");
}

#[test]
fn a_finished_render_has_counted_its_tiles_and_rays() {
    let scene = load_scene("default", 50, 30);
    let accel = Accel::build(&scene.world, AccelKind::Bvh);
    let settings = Settings { tile_size_px: 16, ..jittered(&scene) };
    let control = Control::default();
    let rendered = render(&scene.world, &accel, &scene.camera, &settings, &control).unwrap();
    assert_eq!(n_tiles(&settings), 4 * 2);
    assert_eq!(control.tiles_done.load(Ordering::Relaxed), 8);
    assert_eq!(control.rays_traced.load(Ordering::Relaxed), rendered.rays.total());
    assert_eq!(rendered.rays.camera, 50 * 30 * 5);
    let rays = rendered.rays;
    assert!(rays.camera_hit > 0 && rays.camera_hit < rays.camera && rays.reflection > 0 && rays.shadow > 0, "{rays:?}");
    // A stop that comes after the end is no stop.
    control.request_stop();
    assert_eq!(rendered.film.n_pixels(), 1500);
}
