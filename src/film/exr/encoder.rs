//! A film on its way into a file.

use std::io::{self, Write};
use std::sync::OnceLock;

use ::exr::meta::header::Header;
use rayon::prelude::*;

use super::attributes::ExrAttributes;
use super::block;
use super::header;
use super::part::{Grid, PartPlanes, part_per_layer, single_part};
use super::{ExrOptions, ExrParts, invalid_input};
use crate::film::{Film, Rows};

/// A film on its way into a file: its blocks are compressed as they come, in any order, by any thread.
#[derive(Debug)]
pub struct Encoder {
    parts: Vec<Part>,
}

/// A part in the making.
#[derive(Debug)]
struct Part {
    header: Header,
    /// For each channel of the file its plane of the film.
    planes: Vec<usize>,
    blocks: Vec<OnceLock<Vec<u8>>>,
}

impl Part {
    fn new(header: Header, PartPlanes { planes, .. }: PartPlanes) -> Part {
        let blocks = (0..header.chunk_count).map(|_| OnceLock::new()).collect();
        Part { header, planes, blocks }
    }

    fn encode(&self, block: usize, rows: &Rows) {
        let samples = || block::samples(&self.header, &self.planes, block, rows);
        self.blocks[block].get_or_init(|| block::compress(&self.header, block, samples()));
    }
}

impl Encoder {
    /// An encoder for films of this one's outline; its samples are not looked at.
    ///
    /// # Errors
    /// `InvalidInput` when the film breaks its own promises ([`Film::check`]) or has planes or attributes that a file cannot
    /// hold (none, two of one name, a name that is empty or longer than 255 bytes, a text with a zero byte).
    pub fn new(film: &Film, options: &ExrOptions, attributes: &ExrAttributes) -> io::Result<Encoder> {
        film.check().map_err(invalid_input)?;
        let layers = match options.parts {
            ExrParts::Single => single_part(film),
            ExrParts::Multi => part_per_layer(film),
        };
        let headers = header::headers_of(film, &layers, options, attributes)?;
        Ok(Encoder {
            parts: headers.into_iter().zip(layers).map(|(header, planes)| Part::new(header, planes)).collect(),
        })
    }

    /// Sets what only the end of a render tells.
    pub fn set_render_seconds(&mut self, seconds: f32) {
        self.parts.iter_mut().for_each(|part| header::set_render_seconds(&mut part.header, seconds));
    }

    /// Compresses rows that are finished, as far as they hold whole blocks. They begin where a band does and end where one
    /// does, or with the film.
    pub fn encode(&self, rows: &Rows) {
        let range = rows.first_row..rows.first_row + rows.n_rows();
        for part in &self.parts {
            Grid::of(&part.header).blocks_inside(range.clone()).for_each(|block| part.encode(block, rows));
        }
    }

    /// Writes the file; blocks that [`Encoder::encode`] has not seen whole are compressed now. F64 planes are rounded to the
    /// nearest 32-bit float (beyond its range: to infinity) where they are not kept in 16 bits, for which see
    /// [`ColorType`](super::ColorType); everything else is kept bit for bit, infinities, NaN and −0 included. The same film
    /// gives the same bytes.
    ///
    /// # Errors
    /// What `out` answers.
    pub fn write(&self, film: &Film, out: &mut (impl Write + ?Sized)) -> io::Result<()> {
        let rows = film.rows(0, film.data_window.height_px() as usize);
        for part in &self.parts {
            (0..part.blocks.len()).into_par_iter().for_each(|block| part.encode(block, &rows));
        }
        let headers: Vec<&Header> = self.parts.iter().map(|part| &part.header).collect();
        let blocks = |part: usize, block: usize| self.parts[part].blocks[block].get().map_or(&[][..], Vec::as_slice);
        write_file(&headers, blocks, out)
    }
}

/// Writes a film, as [`Encoder::write`].
///
/// # Errors
/// As [`Encoder::new`], and what `out` answers.
pub fn write(
    film: &Film,
    options: &ExrOptions,
    attributes: &ExrAttributes,
    out: &mut (impl Write + ?Sized),
) -> io::Result<()> {
    Encoder::new(film, options, attributes)?.write(film, out)
}

/// Writes headers, the tables of where the blocks stand, and the blocks: part after part, in increasing y.
pub(super) fn write_file<'a>(
    headers: &[&Header],
    block: impl Fn(usize, usize) -> &'a [u8],
    out: &mut (impl Write + ?Sized),
) -> io::Result<()> {
    let bytes = header::bytes(headers)?;
    let is_multi_part = headers.len() > 1;
    let n_blocks: usize = headers.iter().map(|header| header.chunk_count).sum();
    let mut offset = (bytes.len() + 8 * n_blocks) as u64;
    out.write_all(&bytes)?;
    let all = || {
        let parts = headers.iter().enumerate();
        parts.flat_map(|(part, header)| (0..header.chunk_count).map(move |block| (part, header, block)))
    };
    for (part, header, index) in all() {
        out.write_all(&offset.to_le_bytes())?;
        offset += (place(header, part, index, is_multi_part).len() + 4 + block(part, index).len()) as u64;
    }
    for (part, header, index) in all() {
        let samples = block(part, index);
        if samples.is_empty() {
            return Err(io::Error::other("a block could not be compressed"));
        }
        let length = i32::try_from(samples.len()).map_err(|_| invalid_input("a block is longer than 2 GiB"))?;
        out.write_all(&place(header, part, index, is_multi_part))?;
        out.write_all(&length.to_le_bytes())?;
        out.write_all(samples)?;
    }
    Ok(())
}

/// What a block says of its place: the part if there are several; the first line, or the column and row of the tile and
/// the level of its resolution.
pub(super) fn place(header: &Header, part: usize, block: usize, is_multi_part: bool) -> Vec<u8> {
    let grid = Grid::of(header);
    let mut numbers = Vec::with_capacity(5);
    // All fit: the header has been checked.
    if is_multi_part {
        numbers.push(part as i32);
    }
    match header.blocks.has_tiles() {
        true => {
            let (column, row) = grid.place(block);
            numbers.extend([column as i32, row as i32, 0, 0]);
        }
        false => numbers.push(header.own_attributes.layer_position.1 + grid.pixels(block).y0 as i32),
    }
    numbers.iter().flat_map(|number| number.to_le_bytes()).collect()
}
