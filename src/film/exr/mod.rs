//! OpenEXR: the scene-linear image, written and read. The only room that uses the `exr` crate.
//!
//! | room | does |
//! |---|---|
//! | `options` | what a file may be: sample type of colour, compression, layout, parts |
//! | `attributes` | what a header says beside windows and channels |
//! | `part` | which planes go into which part of a file, and where its blocks lie |
//! | `sample` | values as they stand in a file |
//! | `header` | the bytes of headers, attributes in a fixed order |
//! | `block` | pixels cut into blocks and compressed |
//! | `encoder` | a film on its way into a file |
//! | `chunk` | where the blocks of a file in memory are |
//! | `read` | a film from a file |
//! | `stored` | everything that a file holds, as it is stored |
//! | `merge` | crops of one frame joined to what a whole render writes |
//!
//! The `exr` crate knows the values of headers and the methods of compression. Where blocks and attributes stand in the
//! file is our own: the crate keeps attributes of its own in a `HashMap` and writes them in another order in every process.

mod attributes;
mod block;
mod chunk;
mod encoder;
mod header;
pub mod merge;
mod options;
mod part;
mod read;
mod sample;
mod stored;

use std::io;

pub use attributes::ExrAttributes;
pub use encoder::{Encoder, write};
pub use options::{ColorType, ExrCompression, ExrLayout, ExrOptions, ExrParts};
pub use read::{decode, read, read_attributes};

/// The first bytes of every EXR file.
pub const MAGIC: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];

fn io_error(error: ::exr::error::Error) -> io::Error {
    match error {
        ::exr::error::Error::Io(error) => error,
        other => invalid_input(other.to_string()),
    }
}

fn invalid_input(what: impl Into<String>) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidInput, what.into())
}
