//! The bytes of a mesh file: opened, gunzipped within a limit, and turned from offsets into places.

use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};

use flate2::bufread::MultiGzDecoder;

use super::finding::{At, Finding};
use crate::error::{Error, Place, Problem};

/// Decompressed data may always grow to this size …
const GUNZIP_FLOOR_BYTES: usize = 256 << 20;

/// … and beyond it to this many times the compressed size. Scans as text compress 3 to 5 times, regular grids in
/// binary up to about 30 times, while deflate allows 1032 times: a file above the limit is made to fill the memory.
const GUNZIP_MAX_RATIO: usize = 64;

/// The decompressed bytes of a file, whole in memory.
#[derive(Debug)]
pub(in crate::scene) struct Source {
    path: PathBuf,
    bytes: Vec<u8>,
    was_gzipped: bool,
}

impl Source {
    /// Reads a regular file whole; the size that the file system names is reserved, never more.
    pub fn open(path: &Path) -> Result<Source, Error> {
        let metadata = fs::metadata(path).map_err(|error| Error::io(path, "read the mesh", &error))?;
        if !metadata.is_file() {
            // A device or pipe may never end.
            let found = if metadata.is_dir() { "a directory" } else { "a device, pipe or socket" };
            return Err(Problem::new(Place::file(path), "cannot read the mesh")
                .found(found)
                .expected("a regular file")
                .into());
        }
        let bytes = fs::read(path).map_err(|error| Error::io(path, "read the mesh", &error))?;
        Source::from_bytes(path, bytes)
    }

    /// Takes bytes that are already in memory; gunzips them when they begin with the gzip magic. A name that ends in
    /// `.gz` on data that is not gzip is let pass: downloads are often decompressed and keep their name.
    pub fn from_bytes(path: &Path, bytes: Vec<u8>) -> Result<Source, Error> {
        let was_gzipped = bytes.starts_with(&[0x1f, 0x8b, 0x08]);
        let bytes = if was_gzipped { gunzip(path, &bytes)? } else { bytes };
        Ok(Source { path: path.to_path_buf(), bytes, was_gzipped })
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// A reader's finding with its place in this file. Lines are counted here, so that readers need not.
    pub fn problem(&self, finding: Finding) -> Problem {
        let Finding { at, key, what, found, expected, help } = finding;
        let mut place = match at {
            At::File => Place::file(&self.path),
            At::Line(offset) => Place::line(&self.path, line_number(&self.bytes, offset)),
            At::Byte(offset) => Place::byte(&self.path, offset as u64),
        };
        place.key = key;
        let mut problem = Problem { place, what, found, expected, help };
        if self.was_gzipped && matches!(at, At::Byte(_)) {
            problem.what.push_str(" (byte of the decompressed data)");
        }
        problem
    }
}

/// The line of an offset, counted from 1. A line ends with `\n`, `\r\n` or a lone `\r`.
fn line_number(bytes: &[u8], offset: usize) -> u32 {
    let before = &bytes[..offset.min(bytes.len())];
    let line_feeds = before.iter().filter(|&&b| b == b'\n').count();
    let lone_returns = bytes.windows(2).take(before.len()).filter(|pair| pair[0] == b'\r' && pair[1] != b'\n').count();
    u32::try_from(line_feeds + lone_returns + 1).unwrap_or(u32::MAX)
}

/// Decompresses all members. The buffer grows with the data that was really decoded; the size in the trailer is never
/// used.
fn gunzip(path: &Path, compressed: &[u8]) -> Result<Vec<u8>, Error> {
    let limit = GUNZIP_FLOOR_BYTES.max(compressed.len().saturating_mul(GUNZIP_MAX_RATIO));
    let mut bytes = Vec::new();
    // Most meshes fit, and are not moved while they grow; room that is not used costs nothing. Others, or a system that
    // has no such room, do without.
    let _ = bytes.try_reserve(compressed.len().saturating_mul(4));
    let mut decoder = MultiGzDecoder::new(compressed).take(limit as u64 + 1);
    match decoder.read_to_end(&mut bytes) {
        Err(error) => Err(Problem::new(Place::file(path), format!("the gzip data is damaged or ends early: {error}"))
            .found(format!("{} decompressed bytes before it", bytes.len()))
            .into()),
        Ok(_) if bytes.len() > limit => {
            Err(Problem::new(Place::file(path), "the gzip data expands beyond what a mesh can need")
                .found(format!("more than {limit} bytes from {}", compressed.len()))
                .expected(format!(
                    "at most {GUNZIP_MAX_RATIO} times the compressed size, or {} MiB",
                    GUNZIP_FLOOR_BYTES >> 20
                ))
                .help("decompress the file first if it is what it should be")
                .into())
        }
        Ok(_) => Ok(bytes),
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use flate2::Compression;
    use flate2::write::GzEncoder;

    use super::*;

    fn gzip(bytes: &[u8]) -> Vec<u8> {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
        encoder.write_all(bytes).unwrap();
        encoder.finish().unwrap()
    }

    fn source(bytes: Vec<u8>) -> Result<Source, Error> {
        Source::from_bytes(Path::new("m.ply.gz"), bytes)
    }

    #[test]
    fn members_of_a_gzip_file_are_joined_and_plain_data_passes() {
        let two = [gzip(b"hello "), gzip(b"world")].concat();
        assert_eq!(source(two).unwrap().bytes(), b"hello world");
        assert_eq!(source(b"plain".to_vec()).unwrap().bytes(), b"plain");
    }

    #[test]
    fn a_truncated_gzip_file_is_refused() {
        let mut bytes = gzip(&[7; 100_000]);
        bytes.truncate(bytes.len() / 2);
        let error = source(bytes).unwrap_err().to_string();
        assert!(error.starts_with("m.ply.gz: the gzip data is damaged or ends early"), "{error}");
    }

    #[test]
    fn a_gzip_bomb_is_refused_at_the_limit() {
        let error = source(gzip(&vec![0; GUNZIP_FLOOR_BYTES + 1])).unwrap_err().to_string();
        assert!(error.contains("expands beyond what a mesh can need: found more than 268435456 bytes from"), "{error}");
    }

    #[test]
    fn a_directory_and_a_missing_file_are_refused_by_name() {
        let error = Source::open(Path::new("/")).unwrap_err().to_string();
        assert_eq!(error, "/: cannot read the mesh: found a directory, expected a regular file");
        let error = Source::open(Path::new("no/such.ply")).unwrap_err().to_string();
        assert!(error.starts_with("no/such.ply: cannot read the mesh:"), "{error}");
    }

    #[test]
    fn lines_end_with_any_of_the_three_customs() {
        let text = b"a\nb\r\nc\rd";
        assert_eq!([0, 1, 2, 3, 4, 5, 6, 7].map(|at| line_number(text, at)), [1, 1, 2, 2, 2, 3, 3, 4]);
        assert_eq!(line_number(b"a\n", 99), 2);
    }
}
