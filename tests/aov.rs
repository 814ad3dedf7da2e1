//! Layers beside the beauty: parts that add up, data of the nearest hit, mattes; and a beauty that does not know of them.

/// Building worlds and rendering them.
mod world_kit {
    pub mod layers;
    pub mod rendering;
    pub mod scenes;
    pub mod settings;
}

use flatray::accel::{Accel, AccelKind};
use flatray::film::cryptomatte::id_of;
use flatray::film::{Film, Region, Samples};
use flatray::render::camera_ray::CameraRays;
use flatray::render::surface::{describe, shading_normal};
use flatray::render::{Aov, Aovs, Filter, Sampler, Settings};
use flatray::scene::{Compiled, Overrides, load_text};
use flatray::world::{Camera, Hit, LightGroupId, Lights, Ray, World};
use glam::DVec3;
use world_kit::layers::{all_layers, layers};
use world_kit::rendering::render_world;
use world_kit::scenes::{load_scene, scene_names};
use world_kit::settings::center_settings;

const LOBES: [&str; 6] = ["ambient", "diffuse", "specular", "reflection", "refraction", "background"];

/// Mirrors, glass and three groups of lights of both kinds, one of them of lights that name none.
const GROUPS: &str = r#"
    [render]
    max_depth = 9
    background = [0.1, 0.2, 0.4]
    [camera]
    fov = 50
    width = 48
    height = 36
    [[light_source]]
    position = [4, 5, 1]
    group = "key"
    color = [1, 0.9, 0.7]
    [[light_source]]
    position = [-6, 1, 2]
    intensity = 0.3
    [[light_source]]
    type = "directional"
    direction = [1, -1, -0.5]
    group = "rim-2"
    intensity = 0.4
    [[light_source]]
    position = [5, 4, 1]
    group = "key"
    intensity = 0.2
    [[hittable]]
    name = "glass"
    type = "sphere"
    position = [-1, 0, -4]
    radius = 1
    k_d = 0.2
    k_s = 0.3
    k_t = 0.6
    sh = 40
    [[hittable]]
    name = "ball"
    type = "sphere"
    position = [1.1, 0, -5]
    radius = 1
    diffuse = [0.9, 0.3, 0.2]
    k_s = 0.4
    sh = 12
    [[hittable]]
    name = "floor"
    type = "plane"
    position = [0, -1, 0]
    normal = [0, 1, 0]
    k_s = 0.2
"#;

fn groups_scene() -> Compiled {
    load_text(GROUPS, "groups.toml", None, &Overrides::default()).unwrap()
}

fn shoot(scene: &Compiled, samples: u32, aovs: Aovs) -> Film {
    let max_depth = scene.render.max_depth.unwrap_or(5);
    let settings = Settings { samples, sampler: Sampler::Jitter, max_depth, aovs, ..center_settings(&scene.camera) };
    render_world(&scene.world, &scene.camera, &settings).film
}

/// A value of a plane.
fn at(film: &Film, name: &str, pixel: usize) -> f64 {
    film.plane(name).unwrap_or_else(|| panic!("no plane {name}")).samples.get(pixel)
}

fn vector(film: &Film, layer: &str, pixel: usize) -> DVec3 {
    DVec3::from_array(["X", "Y", "Z"].map(|axis| at(film, &format!("{layer}.{axis}"), pixel)))
}

/// The bits of some planes.
fn bits(film: &Film, names: &[String]) -> Vec<u64> {
    let values = |name: &String| {
        let samples = &film.plane(name).unwrap().samples;
        (0..samples.len()).map(|pixel| samples.get(pixel).to_bits()).collect::<Vec<u64>>()
    };
    names.iter().flat_map(values).collect()
}

fn rgb_names(layer: &str) -> Vec<String> {
    ["R", "G", "B"].map(|channel| format!("{layer}.{channel}")).into()
}

fn beauty_names() -> Vec<String> {
    ["R", "G", "B", "A"].map(str::to_owned).into()
}

/// The spacing of f32 at a value.
fn ulp(value: f64) -> f64 {
    let value = value as f32;
    f64::from(value.next_up()) - f64::from(value)
}

#[test]
fn asking_for_layers_changes_no_bit_of_the_beauty() {
    for name in scene_names() {
        let scene = load_scene(&name, 61, 39);
        for samples in [1, 5] {
            let plain = shoot(&scene, samples, Aovs::default());
            let layered = shoot(&scene, samples, all_layers(&scene));
            assert_eq!(plain.planes.len(), 4);
            assert!(bits(&plain, &beauty_names()) == bits(&layered, &beauty_names()), "{name}, {samples} samples");
        }
    }
}

#[test]
fn lobes_and_light_groups_each_add_up_to_the_beauty_in_every_pixel_of_every_scene() {
    let scenes = scene_names().into_iter().map(|name| (load_scene(&name, 61, 39), name));
    for (scene, name) in scenes.chain([(groups_scene(), "groups".to_owned())]) {
        let film = shoot(&scene, 4, layers(&scene, &[&Aov::LOBES[..], &[Aov::Lights]].concat()));
        let lights: Vec<String> = scene.names.light_groups.iter().map(|group| format!("light_{group}")).collect();
        let lights = [&["light_ambient".to_owned()][..], &lights].concat();
        let mut largest = 0.0_f64;
        for channel in ["R", "G", "B"] {
            for pixel in 0..film.n_pixels() {
                let beauty = at(&film, channel, pixel);
                largest = largest.max(beauty);
                for parts in [&LOBES.map(str::to_owned)[..], &lights] {
                    let sum: f64 = parts.iter().map(|part| at(&film, &format!("{part}.{channel}"), pixel)).sum();
                    assert!((sum - beauty).abs() <= 2.0 * ulp(beauty), "{name} {pixel} {parts:?}: {sum} for {beauty}");
                }
            }
        }
        assert!(largest > 0.0, "{name} is black");
    }
}

#[test]
fn what_is_not_covered_is_background_and_colour_is_premultiplied() {
    for name in scene_names() {
        let scene = load_scene(&name, 61, 39);
        let film = shoot(&scene, 4, layers(&scene, &[&Aov::LOBES[..], &[Aov::Albedo]].concat()));
        for (channel, background) in ["R", "G", "B"].into_iter().zip(scene.world.background.to_array()) {
            for pixel in 0..film.n_pixels() {
                let coverage = at(&film, "A", pixel);
                let uncovered = at(&film, &format!("background.{channel}"), pixel);
                // Coverage is a number of quarters: all of this is exact but for one rounding.
                assert_eq!(uncovered, f64::from(((1.0 - coverage) * background) as f32), "{name} {pixel}");
                if coverage == 0.0 {
                    let parts = LOBES[..5].iter().chain(&["albedo"]);
                    assert!(parts.clone().all(|part| at(&film, &format!("{part}.{channel}"), pixel) == 0.0), "{name}");
                    assert_eq!(at(&film, channel, pixel), f64::from(background as f32));
                }
            }
        }
    }
}

/// The world without what does not come from a group of lights.
fn lit_by_group_alone(world: &World, group: LightGroupId) -> World {
    let mut alone = World { background: DVec3::ZERO, lights: Lights::default(), ..world.clone() };
    alone.materials.ambient.fill(DVec3::ZERO);
    let all = &world.lights;
    let points = all.groups.iter().zip(all.positions.iter().zip(&all.intensities));
    for (_, (&position, &intensity)) in points.filter(|(of, _)| **of == group) {
        alone.lights.add(position, intensity);
    }
    let distant = all.directional_groups.iter().zip(all.directions.iter().zip(&all.directional_intensities));
    for (_, (&direction, &intensity)) in distant.filter(|(of, _)| **of == group) {
        alone.lights.add_directional(direction, intensity);
    }
    alone
}

#[test]
fn the_layer_of_a_group_is_the_image_of_its_lights_alone_bit_for_bit() {
    let scene = groups_scene();
    assert_eq!(scene.names.light_groups, ["key", "default", "rim-2"]);
    let film = shoot(&scene, 4, layers(&scene, &[Aov::Lights]));
    for (row, name) in scene.names.light_groups.iter().enumerate() {
        let world = lit_by_group_alone(&scene.world, LightGroupId(row as u32));
        let alone = shoot(&Compiled { world, ..scene.clone() }, 4, Aovs::default());
        let found = bits(&film, &rgb_names(&format!("light_{name}")));
        assert!(found == bits(&alone, &beauty_names()[..3]), "{name}");
        assert!(found.iter().any(|&bits| bits != 0), "{name} is black");
    }
    let world = World { lights: Lights::default(), ..scene.world.clone() };
    let unlit = shoot(&Compiled { world, ..scene.clone() }, 4, Aovs::default());
    assert!(bits(&film, &rgb_names("light_ambient")) == bits(&unlit, &beauty_names()[..3]));
}

#[test]
fn diffuse_and_specular_are_what_the_first_hit_has_without_the_other() {
    let scene = groups_scene();
    let film = shoot(&scene, 4, layers(&scene, &Aov::LOBES));
    let alone = |kept: &str| {
        let mut world = World { background: DVec3::ZERO, ..scene.world.clone() };
        world.materials.ambient.fill(DVec3::ZERO);
        let removed = if kept == "diffuse" { &mut world.materials.specular } else { &mut world.materials.diffuse };
        removed.fill(DVec3::ZERO);
        let settings =
            Settings { samples: 4, max_depth: 1, sampler: Sampler::Jitter, ..center_settings(&scene.camera) };
        render_world(&world, &scene.camera, &settings).film
    };
    for lobe in ["diffuse", "specular"] {
        let found = bits(&film, &rgb_names(lobe));
        assert!(found == bits(&alone(lobe), &beauty_names()[..3]), "{lobe}");
        assert!(found.iter().any(|&bits| bits != 0), "{lobe} is black");
    }
}

#[test]
fn what_is_mirrored_and_what_is_refracted_are_told_apart() {
    let is_black = |film: &Film, layer: &str| bits(film, &rgb_names(layer)).iter().all(|&bits| bits == 0);
    let mut scene = groups_scene();
    let lobes = || layers(&groups_scene(), &Aov::LOBES);
    let both = shoot(&scene, 1, lobes());
    assert!(!is_black(&both, "reflection") && !is_black(&both, "refraction"));
    // An index of 1 has no total reflection.
    scene.world.materials.ior.fill(1.0);
    scene.world.materials.reflectance.fill(0.0);
    let through = shoot(&scene, 1, lobes());
    assert!(is_black(&through, "reflection") && !is_black(&through, "refraction"));
    scene.world.materials.reflectance.fill(0.4);
    scene.world.materials.transmittance.fill(0.0);
    let mirrored = shoot(&scene, 1, lobes());
    assert!(!is_black(&mirrored, "reflection") && is_black(&mirrored, "refraction"));
}

/// Rays through some points of a pixel, and what each hits by the full scan.
fn seen(world: &World, camera: &Camera, pixel: usize, offsets: &[(f64, f64)]) -> Vec<(Ray, Hit)> {
    let rays = CameraRays::new(camera);
    let (x, y) = (pixel % camera.width_px as usize, pixel / camera.width_px as usize);
    let accel = Accel::build(world, AccelKind::Linear);
    let of = |&(dx, dy): &(f64, f64)| rays.ray(x as f64 + dx, y as f64 + dy);
    let rays: Vec<Ray> = offsets.iter().map(of).collect();
    let mut hits = vec![Hit::MISS; rays.len()];
    accel.closest_hit(world, &rays, &mut hits);
    rays.into_iter().zip(hits).collect()
}

const DATA: [Aov; 8] = [Aov::Z, Aov::P, Aov::N, Aov::Ng, Aov::Uv, Aov::Object, Aov::Material, Aov::Samples];

fn check_data(film: &Film, pixel: usize, world: &World, camera: &Camera, ray: &Ray, hit: &Hit) {
    let f32_of = |vector: DVec3| vector.as_vec3().as_dvec3();
    let ids = (at(film, "object.I", pixel), at(film, "material.I", pixel));
    if !hit.is_some() {
        assert_eq!((at(film, "Z", pixel), ids), (f64::INFINITY, (0.0, 0.0)));
        assert!(["P", "N", "Ng"].iter().all(|layer| vector(film, layer, pixel) == DVec3::ZERO));
        return;
    }
    let surface = describe(world, ray, hit);
    let ns = shading_normal(world, hit, surface.ng);
    let ns = if world.two_sided && surface.ng.dot(ray.direction) > 0.0 { -ns } else { ns };
    assert_eq!(vector(film, "P", pixel), f32_of(surface.p));
    assert_eq!(vector(film, "N", pixel), f32_of(ns));
    assert_eq!(vector(film, "Ng", pixel), f32_of(surface.ng));
    assert_eq!((at(film, "uv.U", pixel), at(film, "uv.V", pixel)), (f64::from(hit.u as f32), f64::from(hit.v as f32)));
    let expected = (f64::from(hit.object(world).0) + 1.0, f64::from(hit.material(world).0) + 1.0);
    assert_eq!(ids, expected);
    let z = -camera.world_from_camera.inverse().transform_point3(surface.p).z;
    // The point and the matrix are each rounded to f64; Z to f32.
    assert!((at(film, "Z", pixel) - z).abs() <= ulp(z), "{} for {z}", at(film, "Z", pixel));
}

#[test]
fn data_layers_hold_what_the_full_scan_finds_at_the_centre_of_a_pixel() {
    for name in scene_names() {
        let scene = load_scene(&name, 23, 17);
        let (world, camera) = (&scene.world, &scene.camera);
        let film = shoot(&scene, 1, layers(&scene, &DATA));
        for pixel in 0..film.n_pixels() {
            let seen = seen(world, camera, pixel, &[(0.5, 0.5)]);
            check_data(&film, pixel, world, camera, &seen[0].0, &seen[0].1);
            assert_eq!(at(&film, "samples.I", pixel), 1.0);
        }
    }
}

/// The original's four samples.
const GRID: [(f64, f64); 4] = [(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)];

#[test]
fn data_of_many_samples_are_those_of_the_nearest_and_mattes_count_them_all() {
    let wanted = [&DATA[..], &[Aov::CryptoObject, Aov::CryptoMaterial]].concat();
    for name in ["default", "instances", "room", "triangles"] {
        let scene = load_scene(name, 23, 17);
        let (world, camera, names) = (&scene.world, &scene.camera, &scene.names);
        let settings = Settings { samples: 4, sampler: Sampler::Grid, ..center_settings(camera) };
        let settings = Settings { aovs: layers(&scene, &wanted), ..settings };
        let film = render_world(world, camera, &settings).film;
        let rays = CameraRays::new(camera);
        for pixel in 0..film.n_pixels() {
            let seen = seen(world, camera, pixel, &GRID);
            let z = |(ray, hit): &&(Ray, Hit)| rays.depth(ray, hit.t);
            let (ray, hit) = seen.iter().min_by(|a, b| z(a).total_cmp(&z(b))).unwrap();
            check_data(&film, pixel, world, camera, ray, hit);
            assert_eq!(at(&film, "samples.I", pixel), 4.0);
            let hits: Vec<&Hit> = seen.iter().map(|(_, hit)| hit).filter(|hit| hit.is_some()).collect();
            let objects = hits.iter().map(|hit| id_of(&names.objects[hit.object(world).idx()]));
            check_matte(&film, "CryptoObject", pixel, objects.collect());
            let materials = hits.iter().map(|hit| id_of(&names.materials[hit.material(world).idx()]));
            check_matte(&film, "CryptoMaterial", pixel, materials.collect());
        }
    }
}

#[test]
fn no_filter_widens_what_data_layers_show() {
    let scene = load_scene("sphere", 61, 41);
    let film = |filter| {
        let settings = Settings { samples: 64, sampler: Sampler::Jitter, ..center_settings(&scene.camera) };
        let settings = Settings { filter, aovs: layers(&scene, &DATA), ..settings };
        render_world(&scene.world, &scene.camera, &settings).film
    };
    let n_hit = |film: &Film| (0..film.n_pixels()).filter(|&pixel| at(film, "Z", pixel) < f64::INFINITY).count();
    let boxed = film(Filter::Box);
    for filter in [Filter::Triangle, Filter::Gaussian, Filter::BlackmanHarris] {
        let wide = film(filter);
        // Of 64 samples dozens are inside, so that a pixel is missed only where the sphere covers a part of it that none meets.
        let (n_wide, n_boxed) = (n_hit(&wide), n_hit(&boxed));
        assert!(n_wide <= n_boxed && n_boxed - n_wide < n_boxed / 20, "{filter:?}: {n_wide} of {n_boxed}");
        let n_covered = (0..wide.n_pixels()).filter(|&pixel| at(&wide, "A", pixel) > 0.0).count();
        assert!(n_covered > n_boxed, "{filter:?} smooths the picture");
    }
}

/// Ids and coverages of a pixel, rank after rank.
fn matte(film: &Film, layer: &str, pixel: usize) -> Vec<(u32, f64)> {
    let mut ranks = Vec::new();
    for group in 0..3 {
        for [id, coverage] in [["R", "G"], ["B", "A"]] {
            let Samples::F32(ids) = &film.plane(&format!("{layer}{group:02}.{id}")).unwrap().samples else { panic!() };
            ranks.push((ids[pixel].to_bits(), at(film, &format!("{layer}{group:02}.{coverage}"), pixel)));
        }
    }
    ranks
}

fn check_matte(film: &Film, layer: &str, pixel: usize, mut hits: Vec<u32>) {
    let ranks = matte(film, layer, pixel);
    hits.sort_unstable();
    for &(id, coverage) in &ranks {
        let n = hits.iter().filter(|&&hit| hit == id).count();
        assert_eq!(coverage, n as f64 / 4.0, "{layer} {pixel}: {ranks:?}");
    }
    assert!(ranks.windows(2).all(|pair| pair[0].1 >= pair[1].1), "{ranks:?}");
    let sum: f64 = ranks.iter().map(|rank| rank.1).sum();
    assert_eq!(sum, at(film, "A", pixel));
}

#[test]
fn objects_of_one_name_are_one_matte_and_levels_end_it() {
    let ball = |name: &str, x: f64| {
        format!("[[hittable]]\nname = \"{name}\"\ntype = \"sphere\"\nposition = [{x}, 0, -4]\nradius = 0.03\n")
    };
    let text = ["a", "b", "a", "c"].iter().enumerate().map(|(index, name)| ball(name, 0.06 * index as f64 - 0.09));
    let text =
        text.collect::<String>() + "[camera]\nfov = 4\nwidth = 1\nheight = 1\n[[light_source]]\nposition = [0, 9, 0]\n";
    let scene = load_text(&text, "row.toml", None, &Overrides::default()).unwrap();
    let film = shoot(&scene, 4096, all_layers(&scene));
    let ranks = matte(&film, "CryptoObject", 0);
    assert_eq!(ranks[0].0, id_of("a"));
    assert_eq!([ranks[1].0, ranks[2].0].iter().filter(|id| [id_of("b"), id_of("c")].contains(id)).count(), 2);
    assert_eq!(ranks[3..], [(0, 0.0); 3]);
    // Discs of radius 0.03 at distance 4 in a window of 2·4·tan 2°: stratified, so within a few samples on each edge.
    let side = 8.0 * f64::to_radians(2.0).tan();
    let disc = std::f64::consts::PI * 0.03 * 0.03 / (side * side);
    assert!((ranks[0].1 - 2.0 * disc).abs() < 0.01 && (ranks[1].1 - disc).abs() < 0.01, "{ranks:?} {disc}");
    let few = shoot(&scene, 64, Aovs { matte_levels: 1, ..all_layers(&scene) });
    assert!(few.plane("CryptoObject00.R").is_some() && few.plane("CryptoObject01.R").is_none());
    assert_eq!((at(&few, "CryptoObject00.B", 0), at(&few, "CryptoObject00.A", 0)), (0.0, 0.0));
}

#[test]
fn layers_of_a_crop_are_those_of_the_whole() {
    let scene = groups_scene();
    let settings = Settings { samples: 5, sampler: Sampler::Jitter, ..center_settings(&scene.camera) };
    let settings = Settings { aovs: all_layers(&scene), ..settings };
    let whole = render_world(&scene.world, &scene.camera, &settings).film;
    let region = Region { x0: 7, y0: 3, x1: 40, y1: 20 };
    let crop = render_world(&scene.world, &scene.camera, &Settings { region, ..settings }).film;
    assert_eq!(crop.planes.len(), whole.planes.len());
    for (part, plane) in crop.planes.iter().zip(&whole.planes) {
        for (y, x) in (region.y0..region.y1).flat_map(|y| (region.x0..region.x1).map(move |x| (y, x))) {
            let (a, b) = (region.index_of(x, y), whole.data_window.index_of(x, y));
            assert_eq!(part.samples.get(a).to_bits(), plane.samples.get(b).to_bits(), "{} at {x},{y}", part.name);
        }
    }
}
