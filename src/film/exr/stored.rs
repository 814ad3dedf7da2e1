//! The pixels of a part as they are stored: bytes of samples, line by line and in each line channel by channel.

use std::path::Path;

use ::exr::block::UncompressedBlock;
use ::exr::meta::attribute::IntegerBounds;
use ::exr::meta::header::Header;

use super::part::Grid;
use crate::error::Error;
use crate::film::Region;
use crate::film::read::filled;

/// A part with all its pixels, in the byte order of the machine.
#[derive(Debug)]
pub(super) struct StoredPart {
    /// Its header; the data window is what the part holds.
    pub header: Header,
    /// For each channel what stands before it in a line, in bytes of one pixel, and its own bytes.
    channels: Vec<(usize, usize)>,
    lines: Vec<u8>,
}

/// Two files that have different samples in one pixel, counted from the corner of the display window.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Conflict {
    /// Row.
    pub y: u32,
    /// Column.
    pub x: u32,
    /// Which of the earlier files.
    pub file: usize,
    /// Name of the channel.
    pub channel: String,
}

impl StoredPart {
    /// A part of zeros.
    ///
    /// # Errors
    /// Not enough memory.
    pub fn new(header: Header, path: &Path) -> Result<StoredPart, Error> {
        let channels = header.channels.channels_with_byte_offset();
        let channels = channels.map(|(before, channel)| (before, channel.sample_type.bytes_per_sample())).collect();
        let n_bytes = header.layer_size.area().saturating_mul(header.channels.bytes_per_pixel);
        Ok(StoredPart { channels, lines: filled(n_bytes, 0, path)?, header })
    }

    fn width_px(&self) -> usize {
        self.header.layer_size.0
    }

    /// Where the samples of some columns of a line and channel are.
    fn place(&self, channel: usize, row: usize, columns: std::ops::Range<usize>) -> std::ops::Range<usize> {
        let (before, size) = self.channels[channel];
        let start = (row * self.header.channels.bytes_per_pixel + before) * self.width_px();
        start + columns.start * size..start + columns.end * size
    }

    /// Copies the blocks of a file whose pixels are `window`. Where `earlier` files have been copied, the samples must be the
    /// same: the first pixel that differs is returned.
    ///
    /// # Errors
    /// Blocks that cannot be read.
    pub fn fill(
        &mut self,
        blocks: impl Iterator<Item = Result<UncompressedBlock, Error>>,
        window: Region,
        earlier: &[Region],
    ) -> Result<Option<Conflict>, Error> {
        let mut first: Option<Conflict> = None;
        for block in blocks {
            let block = block?;
            for line in block.lines(&self.header.channels) {
                let channel = line.location.channel;
                let y = window.y0 + line.location.position.1 as u32;
                let x = window.x0 + line.location.position.0 as u32;
                let columns = x..x + line.location.sample_count as u32;
                for (file, other) in earlier.iter().enumerate().filter(|(_, other)| (other.y0..other.y1).contains(&y)) {
                    let shared = columns.start.max(other.x0)..columns.end.min(other.x1);
                    let different = shared.into_iter().find(|&column| {
                        let size = self.channels[channel].1;
                        let at = (column - columns.start) as usize * size;
                        let place = self.place(channel, y as usize, column as usize..column as usize + 1);
                        self.lines[place] != line.value[at..at + size]
                    });
                    if let Some(x) =
                        different.filter(|&x| first.as_ref().is_none_or(|first| (y, x) < (first.y, first.x)))
                    {
                        let channel =
                            String::from_utf8_lossy(self.header.channels.list[channel].name.as_slice()).into_owned();
                        first = Some(Conflict { y, x, file, channel });
                    }
                }
                let place = self.place(channel, y as usize, columns.start as usize..columns.end as usize);
                self.lines[place].copy_from_slice(line.value);
            }
        }
        Ok(first)
    }

    /// The samples of a block, in the order of the file.
    pub fn samples_of(&self, block: usize) -> Vec<u8> {
        let pixels = Grid::of(&self.header).pixels(block);
        let mut bytes = Vec::with_capacity(pixels.n_pixels() * self.header.channels.bytes_per_pixel);
        for row in pixels.y0..pixels.y1 {
            for channel in 0..self.channels.len() {
                let place = self.place(channel, row as usize, pixels.x0 as usize..pixels.x1 as usize);
                bytes.extend_from_slice(&self.lines[place]);
            }
        }
        bytes
    }
}

/// A data window that lies in the display window, counted from the corner of that.
pub(super) fn bounds_inside(data: IntegerBounds, display: IntegerBounds) -> Option<Region> {
    let span = |start: i32, size: usize, display_start: i32, display_size: usize| {
        let offset = i64::from(start) - i64::from(display_start);
        let end = offset + size as i64;
        (offset >= 0 && offset < end && end <= display_size as i64).then_some((offset as u32, end as u32))
    };
    let (x0, x1) = span(data.position.0, data.size.0, display.position.0, display.size.0)?;
    let (y0, y1) = span(data.position.1, data.size.1, display.position.1, display.size.1)?;
    Some(Region { x0, y0, x1, y1 })
}
