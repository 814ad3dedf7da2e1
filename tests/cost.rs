//! Costs of pixels: the same hits, counts that do not depend on how the work is cut, and the picture of them.

/// Building worlds and rendering them.
mod world_kit {
    pub mod layers;
    pub mod rendering;
    pub mod scenes;
    pub mod settings;
}

use std::process::Command;

use flatray::accel::{Accel, AccelKind, Mode, Visits};
use flatray::film::{Film, Region, png, read_image};
use flatray::measure::cost_map::CostMap;
use flatray::measure::stress::mesh::bumpy_block;
use flatray::measure::stress::random::Random;
use flatray::render::{Aov, Aovs, RayCounts, Sampler, Settings};
use flatray::scene::Compiled;
use flatray::simd::Isa;
use flatray::world::{Hit, ObjectId, Ray, World};
use glam::{DAffine3, DVec3};
use world_kit::layers::{all_layers, layers};
use world_kit::rendering::render_world;
use world_kit::scenes::{load_scene, scene_names};
use world_kit::settings::center_settings;

const COUNTS: [&str; 3] = ["cost.nodes", "cost.leaf_tests", "cost.rays"];

fn sampled(scene: &Compiled, aovs: Aovs) -> Settings {
    Settings { samples: 3, sampler: Sampler::Jitter, aovs, ..center_settings(&scene.camera) }
}

fn counts(film: &Film) -> Vec<[f64; 3]> {
    let planes = COUNTS.map(|name| film.plane(name).unwrap());
    (0..film.n_pixels()).map(|pixel| planes.map(|plane| plane.samples.get(pixel))).collect()
}

/// A block placed at random, and some that overlap.
fn placed_world() -> World {
    let mut world = World::default();
    world.add_mesh(bumpy_block(4).input()).unwrap();
    let prototype = world.add_prototype(0);
    for i in 0..40 {
        let mut random = Random::new(1, "placed", i);
        let transform = DAffine3::from_scale_rotation_translation(
            DVec3::splat(random.uniform(0.3, 1.0)),
            glam::DQuat::from_axis_angle(random.direction(), random.unit()),
            4.0 * random.in_cube(),
        );
        world.add_instance(prototype, transform, None, ObjectId(0)).unwrap();
        world.spheres.add(4.0 * random.in_cube(), 0.3, flatray::world::MaterialId(0), ObjectId(0));
    }
    world.add_mesh(bumpy_block(2).placed(0.5, DVec3::X).input()).unwrap();
    world
}

#[test]
fn what_is_counted_has_the_hits_of_what_is_not() {
    let mut worlds: Vec<World> = scene_names().iter().map(|name| load_scene(name, 16, 16).world).collect();
    worlds.push(placed_world());
    let mut n_hits = 0;
    for world in &worlds {
        let center = world.bounds().map_or(DVec3::ZERO, |bounds| bounds.center());
        let reach = world.bounds().map_or(1.0, |bounds| bounds.extent().max_element()).min(100.0);
        let ray = |i: u64| {
            let mut random = Random::new(2, "counted", i);
            let (from, to) = (center + reach * random.in_cube(), center + 0.5 * reach * random.in_cube());
            let ray = Ray::new(from, to - from);
            if i.is_multiple_of(3) { ray.until(1.0) } else { ray }
        };
        let rays: Vec<Ray> = (0..3000).map(ray).collect();
        for kind in [AccelKind::Bvh, AccelKind::Linear] {
            let rays = if kind == AccelKind::Bvh { &rays[..] } else { &rays[..100] };
            let accel = Accel::build(world, kind).with_mode(Mode::Packet);
            let (mut plain, mut hits) = (vec![Hit::MISS; rays.len()], vec![Hit::MISS; rays.len()]);
            let (mut plain_any, mut any) = (vec![false; rays.len()], vec![false; rays.len()]);
            let mut visits = vec![Visits::default(); rays.len()];
            accel.closest_hit(world, rays, &mut plain);
            accel.closest_hit_counted(world, rays, &mut hits, &mut visits);
            assert!(plain.iter().zip(&hits).all(|(a, b)| a.same_bits(b)));
            n_hits += hits.iter().filter(|hit| hit.is_some()).count();
            accel.occluded(world, rays, &mut plain_any);
            accel.occluded_counted(world, rays, &mut any, &mut visits);
            assert_eq!(plain_any, any);
        }
    }
    assert!(n_hits > 5000, "{n_hits}");
}

#[test]
fn trees_of_placements_are_counted_and_a_scan_tests_every_triangle() {
    let world = placed_world();
    let rays: Vec<Ray> =
        (0..200).map(|i| Ray::new(DVec3::X * 20.0, Random::new(3, "aim", i).in_cube() - DVec3::X * 3.0)).collect();
    let mut hits = vec![Hit::MISS; rays.len()];
    let mut visits = vec![Visits::default(); rays.len()];
    let accel = Accel::build(&world, AccelKind::Bvh);
    accel.closest_hit_counted(&world, &rays, &mut hits, &mut visits);
    for (hit, visits) in hits.iter().zip(&visits) {
        // The root, and of what is placed at least a root and a leaf more.
        let at_least = if hit.instance.row().is_some() { (2, 1) } else { (1, u64::from(hit.is_some())) };
        assert!(visits.nodes >= at_least.0 && visits.leaves >= at_least.1, "{hit:?} {visits:?}");
    }
    assert!(hits.iter().filter(|hit| hit.instance.row().is_some()).count() > 20);
    // A ray is the same alone.
    let mut alone = [Visits::default()];
    for i in [3, 77, 150] {
        accel.closest_hit_counted(&world, &rays[i..=i], &mut [Hit::MISS], &mut alone);
        assert_eq!(alone[0], visits[i]);
    }

    let accel = Accel::build(&world, AccelKind::Linear);
    accel.closest_hit_counted(&world, &rays, &mut hits, &mut visits);
    let n_tests = world.n_placed_triangles() + world.spheres.len() as u64;
    assert!(visits.iter().all(|&visits| visits == Visits { nodes: 0, leaves: n_tests }));
}

#[test]
fn counting_changes_no_bit_of_the_picture_and_counts_do_not_depend_on_threads_and_tiles() {
    for name in ["mirror_pair", "light_groups", "instances", "glass"] {
        check_scene(&load_scene(name, 40, 30));
    }
}

fn check_scene(scene: &Compiled) {
    let plain = render_world(&scene.world, &scene.camera, &sampled(scene, Aovs::default())).film;
    let settings = sampled(scene, layers(scene, &[Aov::Cost]));
    let mut first = None;
    for (threads, tile_size_px) in [(1, 32), (2, 7), (8, 5), (2, 64)] {
        let film =
            render_world(&scene.world, &scene.camera, &Settings { threads, tile_size_px, ..settings.clone() }).film;
        assert_eq!(film.planes[..4], plain.planes[..4]);
        let counts = counts(&film);
        assert_eq!(*first.get_or_insert(counts.clone()), counts);
    }
    // Other layers change nothing of them.
    let all = render_world(&scene.world, &scene.camera, &sampled(scene, all_layers(scene))).film;
    assert_eq!(counts(&all), first.unwrap());
}

#[test]
fn rays_of_all_pixels_are_those_that_were_sent() {
    for name in scene_names() {
        let scene = load_scene(&name, 24, 18);
        let rendered = render_world(&scene.world, &scene.camera, &sampled(&scene, layers(&scene, &[Aov::Cost])));
        let n_rays: f64 = counts(&rendered.film).iter().map(|[_, _, rays]| rays).sum();
        let RayCounts { camera, reflection, refraction, shadow, .. } = rendered.rays;
        // A total reflection is counted as tried refraction and as mirrored ray.
        assert!((camera + reflection + shadow) as f64 <= n_rays, "{name}");
        assert!(n_rays <= (camera + reflection + refraction + shadow) as f64, "{name}");
        if refraction == 0 {
            assert_eq!(n_rays, rendered.rays.total() as f64, "{name}");
        }
    }
}

#[test]
fn a_crop_counts_what_the_whole_counts_there() {
    let scene = load_scene("mirror_pair", 24, 18);
    let whole = sampled(&scene, layers(&scene, &[Aov::Cost]));
    let crop = Settings { region: Region { x0: 3, y0: 2, x1: 20, y1: 15 }, ..whole.clone() };
    let [whole, part] = [&whole, &crop].map(|settings| render_world(&scene.world, &scene.camera, settings).film);
    let (of_whole, of_part) = (counts(&whole), counts(&part));
    for y in 2..15 {
        for x in 3..20 {
            assert_eq!(of_part[part.data_window.index_of(x, y)], of_whole[whole.data_window.index_of(x, y)]);
        }
    }
}

#[test]
fn counts_are_the_same_for_every_instruction_set() {
    let world = placed_world();
    let rays: Vec<Ray> =
        (0..500).map(|i| Ray::new(DVec3::Z * 9.0, Random::new(4, "aim", i).in_cube() - DVec3::Z * 2.0)).collect();
    let counted = |isa: Isa| {
        let accel = Accel::build(&world, AccelKind::Bvh).with_isa(isa);
        let (mut hits, mut visits) = (vec![Hit::MISS; rays.len()], vec![Visits::default(); rays.len()]);
        accel.closest_hit_counted(&world, &rays, &mut hits, &mut visits);
        visits
    };
    assert_eq!(counted(Isa::Baseline), counted(Isa::detect()));
}

#[test]
fn the_picture_of_costs_stands_beside_the_outputs_and_the_layer_in_the_exr() {
    let folder = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_flatray"));
        let size = ["render", "--width", "32", "--height", "24", "--samples", "2"];
        let output = command.current_dir(folder.path()).args(size).args(arguments).output().unwrap();
        (output.status.code(), String::from_utf8(output.stdout).unwrap())
    };
    let (code, text) = run(&["--heatmap", "cost", "-o", "a.exr", "-o", "b.png"]);
    assert_eq!(code, Some(0));
    assert!(text.contains("nodes and leaves a pixel") && text.contains("a.cost.png"), "{text}");
    let picture = read_image(folder.path().join("a.cost.png"), None).unwrap();
    assert_eq!((picture.film.width_px, picture.film.height_px), (32, 24));

    // Without an EXR the picture is the same; the images have the bytes that they have without it.
    assert_eq!(run(&["--heatmap", "cost", "-o", "c.png", "--quiet"]), (Some(0), String::new()));
    assert_eq!(run(&["-o", "d.png", "--quiet"]).0, Some(0));
    let bytes = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
    assert_eq!(bytes("c.cost.png"), bytes("a.cost.png"));
    assert_eq!(bytes("c.png"), bytes("d.png"));
    assert_eq!(run(&["--heatmap", "cost", "-o", "a.exr", "-o", "a.cost.png"]).0, Some(2));
    assert_eq!(run(&["--heatmap", "price", "-o", "a.exr"]).0, Some(2));
}

#[test]
fn the_picture_is_that_of_the_layer() {
    let scene = load_scene("mirror_pair", 32, 24);
    let film = render_world(&scene.world, &scene.camera, &sampled(&scene, layers(&scene, &[Aov::Cost]))).film;
    let map = CostMap::new(&film).unwrap();
    let mut bytes = Vec::new();
    png::write(&map.picture, &CostMap::display(), &mut bytes).unwrap();
    let picture = png::decode(&bytes, None, std::path::Path::new("cost.png")).unwrap().rgb8.unwrap();
    let costs: Vec<f64> = counts(&film).iter().map(|[nodes, leaves, _]| nodes + leaves).collect();
    let luminance = |pixel: usize| picture[pixel].map(u32::from).iter().sum::<u32>();
    let dearest = (0..costs.len()).max_by(|&a, &b| costs[a].total_cmp(&costs[b])).unwrap();
    let cheapest = (0..costs.len()).min_by(|&a, &b| costs[a].total_cmp(&costs[b])).unwrap();
    assert!(costs[dearest] > 3.0 * costs[cheapest] && luminance(dearest) > luminance(cheapest));
    assert!(map.brightest <= costs[dearest]);
}
