//! The bytes of an input file: mapped or read, and decompressed within limits.
//!
//! Whoever reads a format gets a byte slice, and says what it finds by an offset into it; [`Source`] knows the path, and
//! what line an offset is on.

mod map;
mod unpack;

use std::fs::{self, File};
use std::path::{Path, PathBuf};

use map::Mapped;
use unpack::Packing;

use crate::error::{Error, Place, Problem};

/// A plain file of at least this size is mapped, any other is read. Reading this much takes some 10 ms; below it mapping
/// gains nothing that anybody would notice.
const LEAST_MAPPED_BYTES: u64 = 16 << 20;

/// The bytes of a file, decompressed.
#[derive(Debug)]
pub struct Source {
    path: PathBuf,
    bytes: Bytes,
    packing: Option<Packing>,
    /// Bytes in front that are passed over.
    n_skipped: usize,
}

#[derive(Debug)]
enum Bytes {
    Read(Vec<u8>),
    Mapped(Mapped),
}

impl Bytes {
    fn as_slice(&self) -> &[u8] {
        match self {
            Bytes::Read(bytes) => bytes,
            Bytes::Mapped(mapped) => mapped.bytes(),
        }
    }
}

/// Endings of names that tell of compression; they stand behind the extension of the format.
const PACKED_EXTENSIONS: [&str; 2] = [".gz", ".zst"];

/// The file's name in lower case, without the ending of its compression if it has one: `Dragon.PLY.gz` is `dragon.ply`.
/// Empty for a path without a name.
pub fn unpacked_name(path: &Path) -> String {
    let name = path.file_name().map(|name| name.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    let plain = PACKED_EXTENSIONS.iter().find_map(|extension| name.strip_suffix(extension)).unwrap_or(&name);
    plain.to_owned()
}

impl Source {
    /// Takes the bytes of a regular file; only what is really there is ever allocated.
    ///
    /// # Errors
    /// When the file cannot be read or is none, and as [`Source::from_bytes`].
    pub fn open(path: &Path) -> Result<Source, Error> {
        let cannot = |error: std::io::Error| Error::io(path, "read the file", &error);
        let metadata = fs::metadata(path).map_err(cannot)?;
        if !metadata.is_file() {
            // A device or pipe may never end.
            let found = if metadata.is_dir() { "a directory" } else { "a device, pipe or socket" };
            return Err(Problem::new(Place::file(path), "cannot read the file")
                .found(found)
                .expected("a regular file")
                .into());
        }
        let bytes = if metadata.len() >= LEAST_MAPPED_BYTES {
            Bytes::Mapped(Mapped::new(File::open(path).map_err(cannot)?).map_err(cannot)?)
        } else {
            Bytes::Read(fs::read(path).map_err(cannot)?)
        };
        Source::unpacked(path, bytes)
    }

    /// Takes bytes that are already in memory; decompresses them when they begin as gzip or zstd data do. A name that
    /// ends in `.gz` or `.zst` on data that is neither is let pass: downloads are often decompressed and keep their name.
    ///
    /// # Errors
    /// When the compressed data is damaged, ends early, is compressed twice or expands beyond the limits.
    pub fn from_bytes(path: &Path, bytes: Vec<u8>) -> Result<Source, Error> {
        Source::unpacked(path, Bytes::Read(bytes))
    }

    fn unpacked(path: &Path, bytes: Bytes) -> Result<Source, Error> {
        let packing = Packing::of(bytes.as_slice());
        let bytes = match packing {
            Some(packing) => Bytes::Read(unpack::unpack(path, packing, bytes.as_slice())?),
            None => bytes,
        };
        Ok(Source { path: path.to_path_buf(), bytes, packing, n_skipped: 0 })
    }

    /// The path, as it was given.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The decompressed bytes.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes.as_slice()[self.n_skipped..]
    }

    /// Passes over the mark that some editors put before UTF-8 text.
    pub fn skip_byte_order_mark(&mut self) {
        self.n_skipped = if self.bytes.as_slice().starts_with(b"\xef\xbb\xbf") { 3 } else { 0 };
    }

    /// The place of the line that an offset is on. Lines are counted here, so that readers need not.
    pub fn line(&self, offset: usize) -> Place {
        Place::line(&self.path, line_number(self.bytes(), offset))
    }

    /// The place of a byte.
    pub fn byte(&self, offset: usize) -> Place {
        Place::byte(&self.path, (self.n_skipped + offset) as u64)
    }

    /// The place where the file ends: a line of text, or a byte of anything else.
    pub fn end(&self) -> Place {
        let bytes = self.bytes();
        let is_text = !bytes[..bytes.len().min(64 << 10)].contains(&0);
        if is_text { self.line(bytes.len()) } else { self.byte(bytes.len()) }
    }

    /// Whether offsets count decompressed bytes, and not those of the file.
    pub fn was_packed(&self) -> bool {
        self.packing.is_some()
    }

    /// To be asked when reading is done: whether what was read is still what the file holds.
    ///
    /// # Errors
    /// When a mapped file was changed meanwhile.
    pub fn check_unchanged(&self) -> Result<(), Error> {
        match &self.bytes {
            Bytes::Mapped(mapped) if !mapped.is_unchanged() => {
                let problem = Problem::new(Place::file(&self.path), "the file was changed while it was read");
                Err(problem.help("wait until it is written, or read a copy").into())
            }
            Bytes::Mapped(_) | Bytes::Read(_) => Ok(()),
        }
    }
}

/// The line of an offset, counted from 1. A line ends with `\n`, `\r\n` or a lone `\r`.
fn line_number(bytes: &[u8], offset: usize) -> u32 {
    let before = &bytes[..offset.min(bytes.len())];
    let line_feeds = before.iter().filter(|&&b| b == b'\n').count();
    let lone_returns = bytes.windows(2).take(before.len()).filter(|pair| pair[0] == b'\r' && pair[1] != b'\n').count();
    u32::try_from(line_feeds + lone_returns + 1).unwrap_or(u32::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_directory_and_a_missing_file_are_refused_by_name() {
        let error = Source::open(Path::new("/")).unwrap_err().to_string();
        assert_eq!(error, "/: cannot read the file: found a directory, expected a regular file");
        let error = Source::open(Path::new("no/such.ply")).unwrap_err().to_string();
        assert!(error.starts_with("no/such.ply: cannot read the file:"), "{error}");
    }

    #[test]
    fn lines_end_with_any_of_the_three_customs() {
        let text = b"a\nb\r\nc\rd";
        assert_eq!([0, 1, 2, 3, 4, 5, 6, 7].map(|at| line_number(text, at)), [1, 1, 2, 2, 2, 3, 3, 4]);
        assert_eq!(line_number(b"a\n", 99), 2);
    }

    #[test]
    fn the_ending_of_compression_is_taken_off_a_name_once() {
        let names =
            [("a/B.PLY.Gz", "b.ply"), ("c.nff.zst", "c.nff"), ("d.ply", "d.ply"), ("e.gz.gz", "e.gz"), ("/", "")];
        for (path, name) in names {
            assert_eq!(unpacked_name(Path::new(path)), name);
        }
    }

    #[test]
    fn a_large_file_is_mapped_holds_the_same_bytes_and_is_refused_when_it_changes() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("large.bin");
        let bytes: Vec<u8> = (0..LEAST_MAPPED_BYTES as u32).map(|at| (at % 251) as u8).collect();
        fs::write(&path, &bytes).unwrap();
        let source = Source::open(&path).unwrap();
        assert!(matches!(source.bytes, Bytes::Mapped(_)) && source.bytes() == bytes);
        assert!(source.check_unchanged().is_ok());
        // Longer, not shorter: what is mapped is still there.
        fs::write(&path, [bytes, vec![0]].concat()).unwrap();
        let error = source.check_unchanged().unwrap_err().to_string();
        assert!(error.contains("large.bin: the file was changed while it was read"), "{error}");
    }
}
