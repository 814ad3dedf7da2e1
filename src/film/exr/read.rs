//! A film from a file.

use std::path::Path;

use ::exr::block::UncompressedBlock;
use ::exr::math::Vec2;
use ::exr::meta::attribute::{AttributeValue, SampleType};
use ::exr::meta::header::Header;
use ::exr::prelude::f16;

use super::ExrAttributes;
use super::chunk::Contents;
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
    let contents = Contents::open(bytes, path, false)?;
    let part = choose_part(contents.headers(), path)?;
    let header = &contents.headers()[part];
    let (mut film, crop) = empty_film(header, path)?;
    for block in contents.blocks(part) {
        copy_block(&block?, header, &crop, &mut film);
    }
    Ok(film)
}

/// What the header of a file says of its colour image in texts and whole numbers of its own; the rest is left at its defaults.
/// In the order of their names.
///
/// # Errors
/// As [`read`], as far as headers go.
pub fn read_attributes(path: impl AsRef<Path>) -> Result<ExrAttributes, Error> {
    let path = path.as_ref();
    let bytes = read_bytes(path)?;
    let contents = Contents::open(&bytes, path, false)?;
    let header = &contents.headers()[choose_part(contents.headers(), path)?];
    let mut attributes = ExrAttributes::default();
    for (name, value) in &header.own_attributes.other {
        let name = String::from_utf8_lossy(name.as_slice()).into_owned();
        match value {
            AttributeValue::Text(text) => {
                attributes.texts.push((name, String::from_utf8_lossy(text.as_slice()).into_owned()));
            }
            AttributeValue::I32(number) => attributes.numbers.push((name, *number)),
            _ => {}
        }
    }
    attributes.texts.sort();
    attributes.numbers.sort();
    Ok(attributes)
}

fn choose_part(headers: &[Header], path: &Path) -> Result<usize, Error> {
    let has = |header: &Header, name: &str| header.channels.list.iter().any(|channel| channel.name.eq(name));
    let chosen = headers.iter().position(|header| {
        ["R", "G", "B"].iter().all(|name| has(header, name)) || (has(header, "Y") && !has(header, "RY"))
    });
    chosen.ok_or_else(|| {
        let channels = headers.iter().flat_map(|header| &header.channels.list);
        let names: Vec<_> = channels.map(|channel| String::from_utf8_lossy(channel.name.as_slice())).collect();
        Problem::new(Place::file(path), "the EXR file has no colour image")
            .found(format!("channels {}", names.join(", ")))
            .expected("R, G and B, or Y")
            .into()
    })
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
        planes.push(Plane { name: String::from_utf8_lossy(channel.name.as_slice()).into_owned(), content, samples });
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
