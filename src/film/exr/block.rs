//! Pixels cut into blocks and compressed.

use ::exr::meta::attribute::{Compression, SampleType};
use ::exr::meta::header::Header;

use super::part::{Grid, bounds_of};
use super::sample;
use crate::film::rows::Rows;
use crate::film::zip;

/// The samples of a block as they stand in a file before compression, in the byte order of the machine: line by line and
/// in each line channel by channel. `rows` holds its rows; `planes` are those of the header's channels.
pub(super) fn samples(header: &Header, planes: &[usize], block: usize, rows: &Rows) -> Vec<u8> {
    let pixels = Grid::of(header).pixels(block);
    let types: Vec<SampleType> = header.channels.list.iter().map(|channel| channel.sample_type).collect();
    let mut bytes = Vec::with_capacity(pixels.n_pixels() * header.channels.bytes_per_pixel);
    for row in pixels.y0..pixels.y1 {
        let start = (row as usize - rows.first_row) * rows.width_px;
        for (&plane, &sample_type) in planes.iter().zip(&types) {
            let values = rows.planes[plane].slice(start + pixels.x0 as usize..start + pixels.x1 as usize);
            sample::append(&mut bytes, values, sample_type);
        }
    }
    bytes
}

/// Compresses the samples of a block by the header's method. What does not get smaller stands in a file as it is. Nothing,
/// which is no block, is what a codec that failed gives; none is known to.
pub(super) fn compress(header: &Header, block: usize, samples: Vec<u8>) -> Vec<u8> {
    let section = bounds_of(Grid::of(header).pixels(block));
    let by_crate = |method: Compression, samples| method.compress_image_section_to_le(header, samples, section);
    let result = match header.compression {
        // Deflate is our own (`zip`); the crate brings the bytes into the order of the file.
        Compression::ZIP1 | Compression::ZIP16 => {
            by_crate(Compression::Uncompressed, samples).map(|samples| zip::compress(&samples))
        }
        method => by_crate(method, samples),
    };
    result.unwrap_or_default()
}
