//! Frames: every phase from the bytes of a mesh file to those of the images, and the whole of tracing and encoding.
//!
//! Before anything is timed, answers are checked: the mesh that is read is the one that was written, the frame with the
//! tree is that of the full scan bit for bit, and files that were encoded while the frame was rendered are those that are
//! encoded at once. `cargo bench --bench frame -- --test` runs each phase once.

use std::fmt::Write as _;
use std::io::{Cursor, Write as _};
use std::path::Path;

use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use flate2::Compression;
use flate2::write::GzEncoder;
use flatray::accel::{Accel, AccelKind};
use flatray::film::output::Format;
use flatray::film::{BitDepth, Display, EncodeOptions, Encoder, Film, Picture, Region, Rows, ToneMap};
use flatray::measure::generate::terrain;
use flatray::render::{Control, Counts, Rendered, Settings, new_film, render, render_into};
use flatray::scene::mesh;
use flatray::world::{Camera, World};
use glam::{DVec3, Vec3};

const WIDTH_PX: u32 = 1920;
const HEIGHT_PX: u32 = 1080;
const DISPLAY: Display =
    Display::Picture(Picture { tone_map: ToneMap::KhronosNeutral, exposure_stops: 0.0, bit_depth: BitDepth::Eight });

/// What a frame is rendered from.
struct Scene {
    world: World,
    camera: Camera,
    accel: Accel,
}

fn settings(camera: &Camera, region: Region) -> Settings {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    Settings { threads, region, ..Settings::new(camera) }
}

/// Ascii PLY, gzipped, as scans come.
fn ply_gz(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<u8> {
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\nelement face \
         {}\nproperty list uchar int vertex_indices\nend_header\n",
        positions.len(),
        triangles.len()
    );
    for p in positions {
        writeln!(text, "{} {} {}", p.x, p.y, p.z).unwrap();
    }
    for [a, b, c] in triangles {
        writeln!(text, "3 {a} {b} {c}").unwrap();
    }
    let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(text.as_bytes()).unwrap();
    encoder.finish().unwrap()
}

fn scene(positions: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Scene {
    let mut world = World::from_triangles(positions, triangles).unwrap();
    world.lights.add(DVec3::new(2.0, 3.0, 1.0), DVec3::ONE);
    let frame = Camera::look_at_frame(DVec3::new(0.2, 1.2, 1.8), DVec3::ZERO, DVec3::Y).unwrap();
    let camera = Camera { world_from_camera: frame, fov_y_radians: 0.8, width_px: WIDTH_PX, height_px: HEIGHT_PX };
    let accel = Accel::build(&world, AccelKind::Bvh);
    Scene { world, camera, accel }
}

fn trace(Scene { world, camera, accel }: &Scene, region: Region) -> Rendered {
    render(world, accel, camera, &settings(camera, region), &Control::default()).unwrap()
}

/// The bytes of a file whose film is finished.
fn encode(format: Format, film: &Film) -> Vec<u8> {
    let mut out = Cursor::new(Vec::new());
    Encoder::new(format, film, &EncodeOptions::of_display(DISPLAY)).unwrap().write(film, &mut out).unwrap();
    out.into_inner()
}

/// The bytes of both files, encoded while the frame is rendered.
fn trace_and_encode(Scene { world, camera, accel }: &Scene) -> ([Vec<u8>; 2], Counts) {
    let settings = settings(camera, Region::whole(WIDTH_PX, HEIGHT_PX));
    let mut film = new_film(camera, &settings);
    let encoders = [Format::Exr, Format::Png]
        .map(|format| Encoder::new(format, &film, &EncodeOptions::of_display(DISPLAY)).unwrap());
    let finished = |rows: &Rows| encoders.iter().for_each(|encoder| encoder.encode(rows));
    let counts = render_into(world, accel, camera, &settings, &Control::default(), &mut film, &finished).unwrap();
    let files = encoders.each_ref().map(|encoder| {
        let mut out = Cursor::new(Vec::new());
        encoder.write(&film, &mut out).unwrap();
        out.into_inner()
    });
    (files, counts)
}

fn frame(criterion: &mut Criterion) {
    let (positions, triangles) = terrain(256);
    let file = ply_gz(&positions, &triangles);
    let load = |bytes: Vec<u8>| mesh::from_bytes(Path::new("terrain.ply.gz"), bytes).unwrap();
    let loaded = load(file.clone());
    assert!(loaded.positions == positions && loaded.triangles == triangles, "the mesh was read wrongly");

    let scene = scene(positions, triangles);
    let oracle = Scene {
        world: scene.world.clone(),
        accel: Accel::build(&scene.world, AccelKind::Linear),
        camera: scene.camera,
    };
    let part = Region { x0: 956, y0: 600, x1: 964, y1: 604 };
    let (fast, slow) = (trace(&scene, part), trace(&oracle, part));
    assert!(fast.film == slow.film && fast.rays == slow.rays, "the tree and the full scan differ");

    let whole = Region::whole(WIDTH_PX, HEIGHT_PX);
    let rendered = trace(&scene, whole);
    assert!(rendered.rays.camera_hit * 4 > rendered.rays.camera, "most camera rays miss");
    let (files, counts) = trace_and_encode(&scene);
    assert_eq!(counts.rays, rendered.rays);
    for (file, format) in files.iter().zip([Format::Exr, Format::Png]) {
        assert!(*file == encode(format, &rendered.film), "{format:?}: encoding in parts and at once differ");
    }

    let mut group = criterion.benchmark_group("frame 1920x1080, terrain of 131,072 triangles");
    group.throughput(Throughput::Bytes(file.len() as u64));
    group.bench_function("load", |bencher| bencher.iter_batched(|| file.clone(), load, BatchSize::LargeInput));
    group.throughput(Throughput::Elements(scene.world.n_prims() as u64));
    group.bench_function("build", |bencher| bencher.iter(|| Accel::build(&scene.world, AccelKind::Bvh)));
    group.throughput(Throughput::Elements(rendered.rays.total()));
    group.bench_function("trace", |bencher| bencher.iter(|| trace(&scene, whole)));
    group.throughput(Throughput::Elements(whole.n_pixels() as u64));
    group.bench_function("encode EXR", |bencher| bencher.iter(|| encode(Format::Exr, &rendered.film)));
    group.bench_function("encode PNG", |bencher| bencher.iter(|| encode(Format::Png, &rendered.film)));
    group.bench_function("trace and encode", |bencher| bencher.iter(|| trace_and_encode(&scene)));
    group.finish();
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(10);
    targets = frame
}
criterion_main!(benches);
