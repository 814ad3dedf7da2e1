//! A file mapped into memory: the only `unsafe` of the room.

use std::fs::File;
use std::io;
use std::time::SystemTime;

use memmap2::Mmap;

/// A mapped file, open for as long as it is mapped.
#[derive(Debug)]
pub(super) struct Mapped {
    file: File,
    mapping: Mmap,
    written_at: Option<SystemTime>,
}

impl Mapped {
    /// Maps a whole regular file for reading.
    ///
    /// # Errors
    /// Those of the system.
    #[allow(unsafe_code)]
    pub fn new(file: File) -> io::Result<Mapped> {
        let written_at = file.metadata()?.modified().ok();
        // SAFETY: the mapping is read-only and private to this value, which lends its bytes for no longer than it lives.
        // What the type system cannot see is another process that writes the file meanwhile. Bytes that change are
        // harmless here: they are plain bytes, of which any is valid; readers copy each value out once and check the copy,
        // never the file again; and `is_unchanged` then refuses the result. A file that is cut short while it is read ends
        // the process by a signal, as it would any program that maps; no memory is harmed by it. Both need a file of many
        // megabytes to be rewritten in place in the fraction of a second that reading takes.
        let mapping = unsafe { Mmap::map(&file)? };
        Ok(Mapped { file, mapping, written_at })
    }

    /// The bytes of the file.
    pub fn bytes(&self) -> &[u8] {
        &self.mapping
    }

    /// Whether length and time of change are still those of the beginning.
    pub fn is_unchanged(&self) -> bool {
        self.file
            .metadata()
            .is_ok_and(|now| now.len() == self.mapping.len() as u64 && now.modified().ok() == self.written_at)
    }
}
