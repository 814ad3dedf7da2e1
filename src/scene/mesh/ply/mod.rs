//! PLY (Turk 1994, "The PLY Polygon File Format"): any order and type of elements and properties, in ascii and both
//! binary encodings.
//!
//! Read are `x y z` of the element `vertex`, and `nx ny nz` when normals are wanted; the list `vertex_indices` (or `vertex_index`) of `face`, and of `tristrips`;
//! everything else is skipped. Beyond the paper: the type names `int8` to `float64`, and `tristrips` with −1 between
//! strips, as the Stanford scans use them.

mod ascii;
mod binary;
mod body;
mod header;

use super::finding::Outcome;
use super::{Attributes, Soup};
use ascii::{Ascii, Custom};
use binary::Binary;
use header::{Element, Encoding, Header, Kind, Property};

/// Whether the bytes begin as every PLY file does.
pub(super) fn has_magic(bytes: &[u8]) -> bool {
    bytes.starts_with(b"ply\n") || bytes.starts_with(b"ply\r")
}

/// Reads a whole file.
pub(super) fn parse(bytes: &[u8], wanted: Attributes) -> Outcome<Soup> {
    let header = header::parse(bytes)?;
    let start = header.body_start;
    match header.encoding {
        Encoding::Ascii => body::read(&header, Ascii::new(bytes, start, Custom::Ply), wanted),
        Encoding::BinaryLittleEndian => body::read(&header, Binary::<true>::new(bytes, start), wanted),
        Encoding::BinaryBigEndian => body::read(&header, Binary::<false>::new(bytes, start), wanted),
    }
}

/// What an OFF file declares.
#[derive(Clone, Copy, Debug)]
pub(super) struct OffRows {
    pub n_vertices: usize,
    pub n_faces: usize,
    /// Whether a normal stands behind each position.
    pub has_normals: bool,
    /// Offset of the line with the counts, and of the first row.
    pub declared_at: usize,
    pub start: usize,
}

/// Reads the rows of an OFF file, which are those of an ascii PLY file but for two customs.
pub(super) fn parse_off_rows(bytes: &[u8], rows: OffRows, wanted: Attributes) -> Outcome<Soup> {
    let OffRows { n_vertices, n_faces, has_normals, declared_at, start } = rows;
    let property = |name: &str, count_kind| Property { name: name.to_owned(), kind: Kind::F64, count_kind };
    let names = ["x", "y", "z", "nx", "ny", "nz"].into_iter().take(if has_normals { 6 } else { 3 });
    let vertex = names.map(|name| property(name, None)).collect();
    let face = vec![property("vertex_indices", Some(Kind::U32))];
    let element = |name: &str, count, properties| Element { name: name.to_owned(), count, properties, declared_at };
    let elements = vec![element("vertex", n_vertices, vertex), element("face", n_faces, face)];
    let header = Header { encoding: Encoding::Ascii, elements, body_start: start };
    body::read(&header, Ascii::new(bytes, start, Custom::Off), wanted)
}

#[cfg(test)]
mod tests;
