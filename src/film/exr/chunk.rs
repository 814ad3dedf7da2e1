//! Where the blocks of a file in memory are. Nothing is taken at its word: a file is never believed to hold more than its
//! length allows, and a block only to be what the table says it is.

use std::io::Cursor;
use std::path::Path;

use ::exr::block::UncompressedBlock;
use ::exr::block::chunk::{Chunk, CompressedBlock, CompressedScanLineBlock, CompressedTileBlock, TileCoordinates};
use ::exr::math::Vec2;
use ::exr::meta::attribute::Compression;
use ::exr::meta::header::Header;
use ::exr::meta::{BlockDescription, MetaData};

use super::encoder::place;
use super::part::Grid;
use crate::error::{Error, Place, Problem};

/// A file whose headers have been read and found plausible.
#[derive(Debug)]
pub(super) struct Contents<'a> {
    meta: MetaData,
    bytes: &'a [u8],
    path: &'a Path,
    /// For each part where its table of blocks begins.
    tables: Vec<usize>,
}

impl<'a> Contents<'a> {
    /// Reads the headers; `strict` refuses what a reader of pixels may overlook, such as attributes that cannot be read.
    ///
    /// # Errors
    /// A file that is cut short, damaged, holds deep or subsampled data, is compressed by B44, DWA or HTJ2K, or claims images
    /// too large for its length.
    pub fn open(bytes: &'a [u8], path: &'a Path, strict: bool) -> Result<Contents<'a>, Error> {
        let mut cursor = Cursor::new(bytes);
        let meta = MetaData::read_from_buffered(&mut cursor, strict).map_err(|error| unreadable(path, &error))?;
        MetaData::validate(&meta.headers, strict).map_err(|error| unreadable(path, &error))?;
        let mut n_bytes_claimed = 0;
        let mut table = cursor.position() as usize;
        let mut tables = Vec::new();
        for header in &meta.headers {
            check_plausible(header, &mut n_bytes_claimed, bytes.len(), path)?;
            tables.push(table);
            table =
                header.chunk_count.checked_mul(8).and_then(|length| table.checked_add(length)).unwrap_or(usize::MAX);
        }
        if table > bytes.len() {
            return Err(Error::new(Place::file(path), "unreadable EXR file: it ends before its first pixel"));
        }
        Ok(Contents { meta, bytes, path, tables })
    }

    /// The headers, one for each part.
    pub fn headers(&self) -> &[Header] {
        &self.meta.headers
    }

    /// The blocks of a part in full resolution, in increasing y.
    pub fn blocks(&self, part: usize) -> impl Iterator<Item = Result<UncompressedBlock, Error>> + '_ {
        // The levels of a part follow each other in the table, and the full resolution is the first.
        let grid = Grid::of(&self.headers()[part]);
        (0..grid.n_columns() * grid.n_rows()).map(move |block| {
            let chunk = self.chunk(part, block).ok_or_else(|| {
                let problem = Problem::new(Place::file(self.path), "the EXR file lacks part of its image");
                let pixels = grid.pixels(block);
                Error::from(problem.found(format!("no block for the pixels from {},{} on", pixels.x0, pixels.y0)))
            })?;
            // On this thread on purpose: a panic on one of the crate's own threads would end the process.
            let decompressed = UncompressedBlock::decompress_chunk(chunk, &self.meta, false);
            decompressed.map_err(|error| unreadable(self.path, &error))
        })
    }

    /// A block as it stands in the file, if it is where and what the table says.
    fn chunk(&self, part: usize, block: usize) -> Option<Chunk> {
        let header = &self.headers()[part];
        let number = |at: usize| self.bytes.get(at..at.checked_add(8)?)?.try_into().map(u64::from_le_bytes).ok();
        let start = usize::try_from(number(self.tables[part] + 8 * block)?).ok()?;
        let place = place(header, part, block, self.meta.requirements.has_multiple_layers);
        let behind = self.bytes.get(start..)?.strip_prefix(place.as_slice())?;
        let (length, behind) = behind.split_first_chunk::<4>()?;
        let compressed_pixels_le = behind.get(..usize::try_from(i32::from_le_bytes(*length)).ok()?)?.to_vec();
        let grid = Grid::of(header);
        let compressed_block = match header.blocks {
            BlockDescription::ScanLines => CompressedBlock::ScanLine(CompressedScanLineBlock {
                y_coordinate: header.own_attributes.layer_position.1 + grid.pixels(block).y0 as i32,
                compressed_pixels_le,
            }),
            BlockDescription::Tiles(_) => {
                let (column, row) = grid.place(block);
                let coordinates = TileCoordinates { tile_index: Vec2(column, row), level_index: Vec2(0, 0) };
                CompressedBlock::Tile(CompressedTileBlock { coordinates, compressed_pixels_le })
            }
        };
        Some(Chunk { layer_index: part, compressed_block })
    }
}

fn unreadable(path: &Path, error: &::exr::error::Error) -> Error {
    Error::new(Place::file(path), format!("unreadable EXR file: {error}"))
}

/// Refuses an image that its file is too short to hold, before any memory is taken for it. `n_bytes_claimed` is what the
/// parts before it hold, and becomes what they hold with it.
///
/// Deflate packs at most 258 bytes into 2 bits, 1032 to 1 (RFC 1951, 3.2.5), and PXR24 drops a quarter of a float first:
/// 1376 to 1; RLE and PIZ pack less tightly. The allowance spares small files the argument. Tile edges are bounded
/// because the crate multiplies them.
///
/// The lossy methods B44, B44A, DWAA and DWAB are refused too: on damaged files the decoders of `exr` 1.74.2 panic (B44) or
/// end the process by taking memory on the word of the file (DWA).
fn check_plausible(header: &Header, n_bytes_claimed: &mut usize, file_length: usize, path: &Path) -> Result<(), Error> {
    const LARGEST_RATIO: usize = 1376;
    const ALLOWANCE_BYTES: usize = 16 << 20;
    const LARGEST_TILE_EDGE_PX: usize = 1 << 16;
    if !matches!(
        header.compression,
        Compression::Uncompressed
            | Compression::RLE
            | Compression::ZIP1
            | Compression::ZIP16
            | Compression::PIZ
            | Compression::PXR24
    ) {
        return Err(Problem::new(Place::file(path), "the EXR file is compressed by a method that is not read")
            .found(header.compression)
            .expected("no compression, or RLE, ZIPS, ZIP, PIZ or PXR24")
            .into());
    }
    if header.channels.list.iter().any(|channel| channel.sampling != Vec2(1, 1)) {
        return Err(Error::new(Place::file(path), "the EXR file has channels of lower resolution, which are not read"));
    }
    let Vec2(width, height) = header.layer_size;
    let n_bytes = width.checked_mul(height).and_then(|area| area.checked_mul(header.channels.bytes_per_pixel));
    let n_bytes = n_bytes.and_then(|n_bytes| n_bytes.checked_add(*n_bytes_claimed));
    let limit = file_length.saturating_mul(LARGEST_RATIO).saturating_add(ALLOWANCE_BYTES);
    *n_bytes_claimed = n_bytes.filter(|&n_bytes| n_bytes <= limit).ok_or_else(|| {
        Error::from(
            Problem::new(Place::file(path), "the EXR header claims more pixels than the file can hold")
                .found(format!("{width}×{height} pixels in {file_length} bytes")),
        )
    })?;
    match header.blocks {
        BlockDescription::Tiles(tiles)
            if tiles.tile_size.0 > LARGEST_TILE_EDGE_PX || tiles.tile_size.1 > LARGEST_TILE_EDGE_PX =>
        {
            Err(Problem::new(Place::file(path), "the EXR header claims huge tiles")
                .found(format!("{}×{} pixels", tiles.tile_size.0, tiles.tile_size.1))
                .into())
        }
        _ => Ok(()),
    }
}
