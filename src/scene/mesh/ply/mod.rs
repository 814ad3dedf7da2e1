//! PLY (Turk 1994, "The PLY Polygon File Format"): any order and type of elements and properties, in ascii and both
//! binary encodings.
//!
//! Read are `x y z` of the element `vertex`, the list `vertex_indices` (or `vertex_index`) of `face`, and of `tristrips`;
//! everything else is skipped. Beyond the paper: the type names `int8` to `float64`, and `tristrips` with −1 between
//! strips, as the Stanford scans use them.

mod ascii;
mod binary;
mod body;
mod header;

use super::Soup;
use super::finding::Outcome;
use header::Encoding;

/// Whether the bytes begin as every PLY file does.
pub(super) fn has_magic(bytes: &[u8]) -> bool {
    bytes.starts_with(b"ply\n") || bytes.starts_with(b"ply\r")
}

/// Reads a whole file.
pub(super) fn parse(bytes: &[u8]) -> Outcome<Soup> {
    let header = header::parse(bytes)?;
    match header.encoding {
        Encoding::Ascii => body::read(&header, ascii::Ascii::new(bytes, header.body_start)),
        Encoding::BinaryLittleEndian => body::read(&header, binary::Binary::<true>::new(bytes, header.body_start)),
        Encoding::BinaryBigEndian => body::read(&header, binary::Binary::<false>::new(bytes, header.body_start)),
    }
}

#[cfg(test)]
mod tests;
