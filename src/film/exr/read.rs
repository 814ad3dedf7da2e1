//! A film from a file.

use std::collections::HashSet;
use std::io::Cursor;
use std::path::Path;

use ::exr::block::reader::ChunksReader;
use ::exr::block::{BlockIndex, UncompressedBlock};
use ::exr::math::Vec2;
use ::exr::meta::BlockDescription;
use ::exr::meta::attribute::{Compression, SampleType};
use ::exr::meta::header::Header;
use ::exr::prelude::f16;

use crate::error::{Error, Place, Problem};
use crate::film::read::{filled, read_bytes};
use crate::film::{Content, Film, Plane, Region, Samples};

/// Reads an EXR file: the first part that has `R`, `G`, `B` or `Y`, at full resolution, with all its channels.
///
/// 16-bit floats are widened to 32 bits. The display window is moved to the origin; pixels outside it (overscan) are left
/// out.
///
/// # Errors
/// A file that cannot be read, is cut short or damaged, holds deep or subsampled data, is compressed by B44, DWA or HTJ2K,
/// or claims an image too large for its length.
pub fn read(path: impl AsRef<Path>) -> Result<Film, Error> {
    let path = path.as_ref();
    decode(&read_bytes(path)?, path)
}

/// Reads an EXR file that is in memory; `path` is only named in errors. As [`read`].
///
/// # Errors
/// As [`read`].
pub fn decode(bytes: &[u8], path: &Path) -> Result<Film, Error> {
    let unreadable =
        |error: ::exr::error::Error| Error::new(Place::file(path), format!("unreadable EXR file: {error}"));
    let reader = ::exr::block::read(Cursor::new(bytes), false).map_err(unreadable)?;
    let part = choose_part(reader.headers(), path)?;
    for header in reader.headers() {
        check_plausible(header, bytes.len(), path)?;
    }
    let header = reader.headers()[part].clone();
    let (mut film, crop) = empty_film(&header, path)?;

    let full_resolution = Vec2(0, 0);
    let wanted = |index: BlockIndex| index.layer == part && index.level == full_resolution;
    let chunks = reader.filter_chunks(false, |_, _, index| wanted(index)).map_err(unreadable)?;
    // One thread on purpose: a panic on one of the crate's own threads would end the process.
    let mut seen = HashSet::new();
    let mut n_pixels_read = 0;
    for block in chunks.sequential_decompressor(false) {
        let block = block.map_err(unreadable)?;
        // The table of chunks may lie: a chunk can belong elsewhere or come twice.
        if wanted(block.index) && seen.insert((block.index.pixel_position.0, block.index.pixel_position.1)) {
            n_pixels_read += block.index.pixel_size.area();
            copy_block(&block, &header, &crop, &mut film);
        }
    }
    if n_pixels_read != header.layer_size.area() {
        return Err(Problem::new(Place::file(path), "the EXR file lacks part of its image")
            .found(format!("{n_pixels_read} pixels"))
            .expected(format!("{}", header.layer_size.area()))
            .into());
    }
    Ok(film)
}

fn choose_part(headers: &[Header], path: &Path) -> Result<usize, Error> {
    let has = |header: &Header, name: &str| header.channels.list.iter().any(|channel| channel.name.eq(name));
    let chosen = headers.iter().position(|header| {
        ["R", "G", "B"].iter().all(|name| has(header, name)) || (has(header, "Y") && !has(header, "RY"))
    });
    chosen.ok_or_else(|| {
        let names: Vec<String> =
            headers.iter().flat_map(|header| &header.channels.list).map(|channel| channel.name.to_string()).collect();
        Problem::new(Place::file(path), "the EXR file has no colour image")
            .found(format!("channels {}", names.join(", ")))
            .expected("R, G and B, or Y")
            .into()
    })
}

/// Refuses an image that its file is too short to hold, before any memory is taken for it.
///
/// Deflate packs at most 258 bytes into 2 bits, 1032 to 1 (RFC 1951, 3.2.5), and PXR24 drops a quarter of a float first:
/// 1376 to 1; RLE and PIZ pack less tightly. The allowance spares small files the argument. Tile edges are bounded
/// because the crate multiplies them.
///
/// The lossy methods B44, B44A, DWAA and DWAB are refused too: on damaged files the decoders of `exr` 1.74.2 panic (B44) or
/// end the process by taking memory on the word of the file (DWA).
fn check_plausible(header: &Header, file_length: usize, path: &Path) -> Result<(), Error> {
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
    let Vec2(width, height) = header.layer_size;
    let n_bytes = width.checked_mul(height).and_then(|area| area.checked_mul(header.channels.bytes_per_pixel));
    let limit = file_length.saturating_mul(LARGEST_RATIO).saturating_add(ALLOWANCE_BYTES);
    if n_bytes.is_none_or(|n_bytes| n_bytes > limit) {
        return Err(Problem::new(Place::file(path), "the EXR header claims more pixels than the file can hold")
            .found(format!("{width}×{height} pixels in {file_length} bytes"))
            .into());
    }
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

/// The part of a data window that is kept, in its own pixels: half-open columns and rows.
struct Crop {
    x0: usize,
    x1: usize,
    y0: usize,
    y1: usize,
}

/// A film of zeros for the part of the data window that lies in the display window.
fn empty_film(header: &Header, path: &Path) -> Result<(Film, Crop), Error> {
    let display = header.shared_attributes.display_window;
    let data = header.data_window();
    // Everything fits: the crate refuses windows that reach beyond half the range of i32.
    let overlap = |data_start: i32, data_size: usize, display_start: i32, display_size: usize| {
        let offset = i64::from(data_start) - i64::from(display_start);
        let start = offset.max(0);
        let end = (offset + data_size as i64).min(display_size as i64);
        (start < end).then_some((start as u32, end as u32, (start - offset) as usize, (end - offset) as usize))
    };
    let columns = overlap(data.position.0, data.size.0, display.position.0, display.size.0);
    let rows = overlap(data.position.1, data.size.1, display.position.1, display.size.1);
    let (Some((x0, x1, crop_x0, crop_x1)), Some((y0, y1, crop_y0, crop_y1))) = (columns, rows) else {
        return Err(Error::new(Place::file(path), "the EXR file has no pixel inside its display window"));
    };
    let data_window = Region { x0, y0, x1, y1 };
    let mut planes = Vec::new();
    for channel in &header.channels.list {
        let samples = match channel.sample_type {
            SampleType::F16 | SampleType::F32 => Samples::F32(filled(data_window.n_pixels(), 0.0, path)?),
            SampleType::U32 => Samples::U32(filled(data_window.n_pixels(), 0, path)?),
        };
        // What the file keeps in 16 bits loses nothing by being kept in 16 bits again.
        let content = if channel.sample_type == SampleType::F16 { Content::Color } else { Content::Data };
        planes.push(Plane { name: channel.name.to_string(), content, samples });
    }
    let film = Film { width_px: display.size.0 as u32, height_px: display.size.1 as u32, data_window, planes };
    Ok((film, Crop { x0: crop_x0, x1: crop_x1, y0: crop_y0, y1: crop_y1 }))
}

/// Copies what a block and the crop have in common.
fn copy_block(block: &UncompressedBlock, header: &Header, crop: &Crop, film: &mut Film) {
    let row_length = crop.x1 - crop.x0;
    for line in block.lines(&header.channels) {
        let Vec2(x, y) = line.location.position;
        let (start, end) = (x.max(crop.x0), (x + line.location.sample_count).min(crop.x1));
        if !(crop.y0..crop.y1).contains(&y) || start >= end {
            continue;
        }
        let to = (y - crop.y0) * row_length + (start - crop.x0);
        let target = to..to + (end - start);
        let skipped = start - x;
        match (header.channels.list[line.location.channel].sample_type, &mut film.planes[line.location.channel].samples)
        {
            (SampleType::F16, Samples::F32(values)) => {
                let source = line.value.chunks_exact(2).skip(skipped).map(|b| f16::from_ne_bytes([b[0], b[1]]));
                values[target].iter_mut().zip(source).for_each(|(to, from)| *to = from.to_f32());
            }
            (_, Samples::F32(values)) => {
                let source = line.value.chunks_exact(4).skip(skipped);
                let source = source.map(|b| f32::from_ne_bytes([b[0], b[1], b[2], b[3]]));
                values[target].iter_mut().zip(source).for_each(|(to, from)| *to = from);
            }
            (_, Samples::U32(values)) => {
                let source = line.value.chunks_exact(4).skip(skipped);
                let source = source.map(|b| u32::from_ne_bytes([b[0], b[1], b[2], b[3]]));
                values[target].iter_mut().zip(source).for_each(|(to, from)| *to = from);
            }
            (_, Samples::F64(_)) => {}
        }
    }
}
