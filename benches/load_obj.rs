//! OBJ files: our reader beside `tobj`, on a height field of two million triangles.
//!
//! Before anything is timed, answers are checked: both readers find the vertices and triangles that were written. `cargo
//! bench --bench load_obj -- --test` runs each once.

use std::fmt::Write as _;
use std::path::Path;

use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use flatray::measure::generate::terrain;
use flatray::scene::mesh::{self, Attributes};
use glam::Vec3;

/// Squares along a side: two triangles each.
const SIDE: u32 = 1000;

fn text_of(positions: &[Vec3], triangles: &[[u32; 3]], with_normals: bool) -> String {
    let mut text = String::new();
    for p in positions {
        writeln!(text, "v {:.6} {:.6} {:.6}", p.x, p.y, p.z).unwrap();
        if with_normals {
            let normal = Vec3::new(p.x.sin(), 1.0, p.z.cos()).normalize();
            writeln!(text, "vn {:.4} {:.4} {:.4}", normal.x, normal.y, normal.z).unwrap();
        }
    }
    for corners in triangles {
        let [a, b, c] = corners.map(|corner| corner + 1);
        match with_normals {
            true => writeln!(text, "f {a}//{a} {b}//{b} {c}//{c}").unwrap(),
            false => writeln!(text, "f {a} {b} {c}").unwrap(),
        }
    }
    text
}

/// The same faces, two and two as quads.
fn quads_of(positions: &[Vec3]) -> String {
    let mut text = String::new();
    for p in positions {
        writeln!(text, "v {:.6} {:.6} {:.6}", p.x, p.y, p.z).unwrap();
    }
    let n = SIDE + 1;
    for row in 0..SIDE {
        for column in 0..SIDE {
            let a = row * n + column + 1;
            writeln!(text, "f {} {} {} {}", a, a + 1, a + n + 1, a + n).unwrap();
        }
    }
    text
}

fn tobj(text: &[u8]) -> (usize, usize) {
    let no_materials = |_: &Path| Err(tobj::LoadError::OpenFileFailed);
    let options = tobj::LoadOptions { triangulate: true, single_index: false, ..tobj::LoadOptions::default() };
    let (models, _) = tobj::load_obj_buf(&mut &*text, &options, no_materials).unwrap();
    let n_triangles = models.iter().map(|model| model.mesh.indices.len() / 3).sum();
    (models.iter().map(|model| model.mesh.positions.len() / 3).sum(), n_triangles)
}

fn ours(text: Vec<u8>, wanted: Attributes) -> (usize, usize) {
    let mesh = mesh::from_bytes_with(Path::new("terrain.obj"), text, wanted).unwrap();
    (mesh.positions.len(), mesh.triangles.len())
}

fn load_obj(criterion: &mut Criterion) {
    let (positions, triangles) = terrain(SIDE);
    let counts = (positions.len(), triangles.len());
    assert_eq!(counts.1, 2_000_000);
    let plain = text_of(&positions, &triangles, false).into_bytes();
    let with_normals = text_of(&positions, &triangles, true).into_bytes();
    let quads = quads_of(&positions).into_bytes();
    let nothing_more = Attributes::default();
    let normals = Attributes { normals: true, materials: false };
    let cases =
        [("plain", &plain, nothing_more), ("with normals", &with_normals, normals), ("quads", &quads, nothing_more)];
    let mut group = criterion.benchmark_group("load_obj");
    group.sample_size(10);
    for (name, text, wanted) in cases {
        assert_eq!(ours(text.clone(), wanted), counts, "{name}");
        assert_eq!(tobj(text), counts, "{name}");
        group.throughput(Throughput::Bytes(text.len() as u64));
        group.bench_function(format!("{name}/flatray"), |bencher| {
            bencher.iter_batched(|| text.clone(), |text| ours(text, wanted), BatchSize::PerIteration);
        });
        group.bench_function(format!("{name}/tobj"), |bencher| bencher.iter(|| tobj(text)));
    }
    group.finish();
}

criterion_group!(benches, load_obj);
criterion_main!(benches);
