//! Whole frames without files: rays, hits, shading, film.
//!
//! Before anything is timed, the frame with the tree is compared with that of the full scan, bit for bit.

use std::path::Path;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use flatray::accel::{Accel, AccelKind};
use flatray::film::Region;
use flatray::measure::generate::terrain;
use flatray::render::{Control, Rendered, Sampler, Settings, render};
use flatray::scene::{Compiled, Overrides, load};
use flatray::world::{Camera, World};
use glam::DVec3;

const WIDTH_PX: u32 = 128;
const HEIGHT_PX: u32 = 72;

fn frame(world: &World, camera: &Camera, accel: &Accel, region: Region) -> Rendered {
    let settings = Settings {
        samples: 4,
        sampler: Sampler::Jitter,
        seed: 0,
        max_depth: 5,
        tile_size_px: 32,
        threads: 1,
        region,
        terminator: false,
        course: false,
    };
    match render(world, accel, camera, &settings, &Control::default()) {
        Ok(rendered) => rendered,
        Err(stopped) => panic!("{stopped}"),
    }
}

fn bench(criterion: &mut Criterion, name: &str, world: &World, camera: &Camera) {
    let accel = Accel::build(world, AccelKind::Bvh);
    let oracle = Accel::build(world, AccelKind::Linear);
    let whole = Region::whole(WIDTH_PX, HEIGHT_PX);
    let part = Region { x0: 60, y0: 40, x1: 68, y1: 44 };
    let (fast, slow) = (frame(world, camera, &accel, part), frame(world, camera, &oracle, part));
    assert_eq!(fast.film, slow.film, "{name}: the tree and the full scan differ");
    assert_eq!(fast.rays, slow.rays, "{name}: the tree and the full scan differ");

    let rendered = frame(world, camera, &accel, whole);
    assert!(rendered.rays.camera_hit * 4 > rendered.rays.camera, "{name}: most camera rays miss");
    let mut group = criterion.benchmark_group("frame");
    group.throughput(Throughput::Elements(rendered.rays.total()));
    group.bench_function(name, |bencher| bencher.iter(|| frame(world, camera, &accel, whole)));
    group.finish();
}

fn frames(criterion: &mut Criterion) {
    let overrides = Overrides { width_px: Some(WIDTH_PX), height_px: Some(HEIGHT_PX), ..Overrides::default() };
    let default = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/default.toml");
    match load(&default, &overrides) {
        Ok(Compiled { world, camera, .. }) => bench(criterion, "default scene", &world, &camera),
        Err(error) => panic!("{error}"),
    }

    let (positions, triangles) = terrain(128);
    match World::from_triangles(positions, triangles) {
        Ok(mut world) => {
            world.lights.add(DVec3::new(2.0, 3.0, 1.0), DVec3::ONE);
            let frame = Camera::look_at_frame(DVec3::new(0.2, 1.2, 1.8), DVec3::ZERO, DVec3::Y).unwrap_or_default();
            let camera =
                Camera { world_from_camera: frame, fov_y_radians: 0.8, width_px: WIDTH_PX, height_px: HEIGHT_PX };
            bench(criterion, "terrain of 32,768 triangles", &world, &camera);
        }
        Err(error) => panic!("{error}"),
    }
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(10);
    targets = frames
}
criterion_main!(benches);
