//! Mesh files, from the first byte read to validated tables, in MB/s, beside other readers on the same files.
//!
//! Files are written before, so that all readers find them in memory. Every reader's triangles are counted before a time
//! is told, and ours are compared with what was written. Ours include what others leave out: indices in range, corners
//! finite, areas not zero, vertices of STL welded. `cargo bench --bench load -- --test` reads small files once.
//! `benches/load_trimesh.py FILE…` times trimesh of PyPI on the files, which `--keep FOLDER` leaves behind.

// What a benchmark finds is printed.
#![allow(clippy::print_stdout)]

use std::fs::{self, File};
use std::io::{BufReader, Write as _};
use std::path::{Path, PathBuf};
use std::time::Instant;

use flatray::measure::generate::terrain;
use flatray::scene::mesh;
use flatray::world::World;
use glam::Vec3;
use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{PropertyAccess, PropertyAccessResult};

const PLY_HEADER: &str = "property float x\nproperty float y\nproperty float z\nelement face";

fn ply_header(encoding: &str, n_vertices: usize, n_faces: usize) -> Vec<u8> {
    format!(
        "ply\nformat {encoding} 1.0\nelement vertex {n_vertices}\n{PLY_HEADER} {n_faces}\nproperty list uchar int \
         vertex_indices\nend_header\n"
    )
    .into_bytes()
}

fn binary_ply(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<u8> {
    let mut bytes = ply_header("binary_little_endian", positions.len(), triangles.len());
    bytes.extend(positions.iter().flat_map(|p| p.to_array()).flat_map(f32::to_le_bytes));
    for triangle in triangles {
        bytes.push(3);
        bytes.extend(triangle.iter().flat_map(|vertex| vertex.to_le_bytes()));
    }
    bytes
}

fn ascii_ply(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<u8> {
    let mut bytes = ply_header("ascii", positions.len(), triangles.len());
    positions.iter().for_each(|p| writeln!(bytes, "{} {} {}", p.x, p.y, p.z).unwrap());
    triangles.iter().for_each(|[a, b, c]| writeln!(bytes, "3 {a} {b} {c}").unwrap());
    bytes
}

fn off(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<u8> {
    let mut bytes = format!("OFF\n{} {} 0\n", positions.len(), triangles.len()).into_bytes();
    positions.iter().for_each(|p| writeln!(bytes, "{} {} {}", p.x, p.y, p.z).unwrap());
    triangles.iter().for_each(|[a, b, c]| writeln!(bytes, "3 {a} {b} {c}").unwrap());
    bytes
}

fn binary_stl(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<u8> {
    let mut bytes = vec![b' '; 80];
    bytes.extend((triangles.len() as u32).to_le_bytes());
    for triangle in triangles {
        bytes.extend([0; 12]);
        let corners = triangle.map(|vertex| positions[vertex as usize].to_array());
        bytes.extend(corners.as_flattened().iter().flat_map(|x| x.to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

fn ascii_stl(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<u8> {
    let mut bytes = b"solid terrain\n".to_vec();
    for triangle in triangles {
        bytes.extend(b" facet normal 0 0 0\n  outer loop\n");
        for vertex in triangle {
            let p = positions[*vertex as usize];
            writeln!(bytes, "   vertex {:e} {:e} {:e}", p.x, p.y, p.z).unwrap();
        }
        bytes.extend(b"  endloop\n endfacet\n");
    }
    bytes.extend(b"endsolid terrain\n");
    bytes
}

/// Ours, up to the tables of a world; gives the number of triangles.
fn flatray(path: &Path) -> usize {
    let mesh = mesh::load(path).unwrap();
    World::from_triangles(mesh.positions, mesh.triangles).unwrap().triangles.len()
}

#[derive(Debug, Default)]
struct Vertex([f32; 3]);

impl PropertyAccess for Vertex {
    fn new() -> Vertex {
        Vertex::default()
    }

    fn set_float(&mut self, name: &str, value: f32) -> PropertyAccessResult {
        let axis = ["x", "y", "z"].iter().position(|axis| *axis == name);
        axis.map_or(PropertyAccessResult::Ignored, |axis| {
            self.0[axis] = value;
            PropertyAccessResult::Set
        })
    }
}

#[derive(Debug, Default)]
struct Face(Vec<i32>);

impl PropertyAccess for Face {
    fn new() -> Face {
        Face::default()
    }

    fn set_list_int(&mut self, _: &str, value: Vec<i32>) -> PropertyAccessResult {
        self.0 = value;
        PropertyAccessResult::Set
    }
}

fn ply_rs_bw(path: &Path) -> usize {
    let mut reader = Reader::new(BufReader::new(File::open(path).unwrap()));
    let vertex_parser = Parser::<Vertex>::new();
    let header = vertex_parser.read_header(&mut reader).unwrap();
    let vertices = vertex_parser.read_payload_for_element(&mut reader, &header.elements["vertex"], &header).unwrap();
    let faces = Parser::<Face>::new().read_payload_for_element(&mut reader, &header.elements["face"], &header).unwrap();
    assert!(!vertices.is_empty());
    faces.len()
}

fn stl_io(path: &Path) -> usize {
    stl_io::read_stl(&mut BufReader::new(File::open(path).unwrap())).unwrap().faces.len()
}

/// Reads a file `n_repeats` times and prints the median, the fastest and the slowest.
fn measure(path: &Path, reader: (&str, fn(&Path) -> usize), n_triangles: usize, n_repeats: usize) {
    let (name, read) = reader;
    assert_eq!(read(path), n_triangles, "{name} on {}", path.display());
    let n_bytes = fs::metadata(path).unwrap().len() as f64;
    let mut rates: Vec<f64> = (0..n_repeats)
        .map(|_| {
            let started = Instant::now();
            std::hint::black_box(read(path));
            n_bytes * 1e-6 / started.elapsed().as_secs_f64()
        })
        .collect();
    rates.sort_by(f64::total_cmp);
    let file = path.file_name().unwrap_or_default().to_string_lossy();
    let (least, median, most) = (rates[0], rates[rates.len() / 2], rates[rates.len() - 1]);
    println!("{file:<14} {n_triangles:>9} triangles  {name:<10} {median:>8.1} MB/s ({least:.1}..{most:.1})");
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let is_test = arguments.iter().any(|argument| argument == "--test");
    let kept = arguments.iter().position(|argument| argument == "--keep").and_then(|at| arguments.get(at + 1));
    let scratch = tempfile::tempdir().unwrap();
    let folder = kept.map_or_else(|| scratch.path().to_path_buf(), PathBuf::from);
    // Half the side of the terrain's square in quads: 8, 2 and 0.5 million triangles.
    let [large, medium, small] = if is_test { [40, 30, 20] } else { [2000, 1000, 500] };
    let n_repeats = if is_test { 1 } else { 7 };

    type Writer = fn(&[Vec3], &[[u32; 3]]) -> Vec<u8>;
    type Readers = &'static [(&'static str, fn(&Path) -> usize)];
    let files: [(&str, u32, Writer, Readers); 5] = [
        ("binary.ply", large, binary_ply, &[("flatray", flatray), ("ply-rs-bw", ply_rs_bw)]),
        ("ascii.ply", medium, ascii_ply, &[("flatray", flatray), ("ply-rs-bw", ply_rs_bw)]),
        ("binary.stl", medium, binary_stl, &[("flatray", flatray), ("stl_io", stl_io)]),
        ("ascii.stl", small, ascii_stl, &[("flatray", flatray), ("stl_io", stl_io)]),
        ("ascii.off", medium, off, &[("flatray", flatray)]),
    ];
    for (name, n, write, readers) in files {
        let (positions, triangles) = terrain(n);
        let path = folder.join(name);
        fs::write(&path, write(&positions, &triangles)).unwrap();
        let read = mesh::load(&path).unwrap();
        if name.ends_with(".stl") {
            // Welded in the order of the corners.
            let corners = |positions: &[Vec3], triangles: &[[u32; 3]]| -> Vec<Vec3> {
                triangles.iter().flatten().map(|&vertex| positions[vertex as usize]).collect()
            };
            assert_eq!(corners(&read.positions, &read.triangles), corners(&positions, &triangles), "{name}");
        } else {
            assert!(read.positions == positions && read.triangles == triangles, "{name}");
        }
        let n_triangles = triangles.len();
        drop((read, positions, triangles));
        readers.iter().for_each(|&reader| measure(&path, reader, n_triangles, n_repeats));
    }
}
