//! Crops of one frame joined to the file that a render of the whole frame writes, byte for byte.
//!
//! Samples are copied as they are stored, and compared by their bits.

use std::io::{self, Write};
use std::path::Path;

use ::exr::meta::BlockDescription;
use ::exr::meta::attribute::{Compression, IntegerBounds, LevelMode, LineOrder, Text};
use ::exr::meta::header::Header;
use rayon::prelude::*;

use super::attributes::RENDER_SECONDS;
use super::chunk::Contents;
use super::encoder::write_file;
use super::stored::{StoredPart, bounds_inside};
use super::{MAGIC, block, header};
use crate::error::{Error, Place, Problem};
use crate::film::read::read_bytes;
use crate::film::{Region, png};

/// Attributes in which crops of one frame differ.
const OF_THE_CROP: [&str; 3] = ["dataWindow", "chunkCount", RENDER_SECONDS];

/// A frame that was joined from crops.
#[derive(Debug)]
pub struct Merged {
    parts: Vec<StoredPart>,
}

/// Joins EXR files of one frame. The attribute that tells how long a render took is left out.
///
/// # Errors
/// With the names of the files: one that cannot be read, is no EXR file or is damaged; two that are of different renders, which is
/// to say that any attribute but those of a crop differs; two that have different samples in one pixel; pixels of the display
/// window that no file has; a file that reaches out of its display window; no file at all.
pub fn merge(paths: &[&Path]) -> Result<Merged, Error> {
    let files: Vec<Vec<u8>> = paths.iter().map(|path| read_exr(path)).collect::<Result<_, _>>()?;
    let opened = files.iter().zip(paths).map(|(bytes, path)| Contents::open(bytes, path, true));
    let contents: Vec<Contents> = opened.collect::<Result<_, _>>()?;
    let (Some(first), Some(first_path)) = (contents.first(), paths.first()) else {
        return Err(Error::new(Place::default(), "there is nothing to merge"));
    };
    // Are they what one render writes?
    check_writable(first.headers(), first_path)?;
    let mut windows = Vec::new();
    for (file, path) in contents.iter().zip(paths) {
        check_same_render((first.headers(), first_path), (file.headers(), path))?;
        windows.push(window_of(file.headers(), path)?);
    }
    let display = first.headers()[0].shared_attributes.display_window;
    let whole = Region::whole(display.size.0 as u32, display.size.1 as u32);
    check_covered(whole, &windows, paths)?;
    // No gap: the files hold at least as many pixels as the frame, and each was plausible.
    let mut parts = Vec::new();
    for (index, header) in first.headers().iter().enumerate() {
        let mut part = StoredPart::new(whole_header(header, display), first_path)?;
        for (file, (contents, path)) in contents.iter().zip(paths).enumerate() {
            let conflict = part.fill(contents.blocks(index), windows[file], &windows[..file])?;
            if let Some(conflict) = conflict {
                let what = format!(
                    "the pixel {},{} is not what {} has",
                    conflict.x,
                    conflict.y,
                    paths[conflict.file].display()
                );
                return Err(Error::new(Place::file(path), format!("{what}: its channel {} differs", conflict.channel)));
            }
        }
        parts.push(part);
    }
    Ok(Merged { parts })
}

impl Merged {
    /// Width and height in pixels.
    pub fn size_px(&self) -> [usize; 2] {
        self.parts.first().map_or([0, 0], |part| [part.header.layer_size.0, part.header.layer_size.1])
    }

    /// Writes the file.
    ///
    /// # Errors
    /// What `out` answers.
    pub fn write(&self, out: &mut (impl Write + ?Sized)) -> io::Result<()> {
        let compressed: Vec<Vec<Vec<u8>>> = self.parts.iter().map(compressed_blocks).collect();
        let headers: Vec<&Header> = self.parts.iter().map(|part| &part.header).collect();
        write_file(&headers, |part, block| &compressed[part][block], out)
    }
}

fn compressed_blocks(part: &StoredPart) -> Vec<Vec<u8>> {
    let compress = |block| block::compress(&part.header, block, part.samples_of(block));
    (0..part.header.chunk_count).into_par_iter().map(compress).collect()
}

fn read_exr(path: &Path) -> Result<Vec<u8>, Error> {
    let bytes = read_bytes(path)?;
    if bytes.starts_with(&MAGIC) {
        return Ok(bytes);
    }
    let found =
        if bytes.starts_with(&png::SIGNATURE) { "a PNG file, which has no place in a frame" } else { "something else" };
    Err(Problem::new(Place::file(path), "only EXR files can be merged").found(found).expected("an EXR file").into())
}

/// Refuses what is not written by [`write_file`], so that nothing is lost unsaid.
fn check_writable(headers: &[Header], path: &Path) -> Result<(), Error> {
    for header in headers {
        let refused = |found: String| {
            Err(Problem::new(Place::file(path), "files of this kind are not merged").found(found).into())
        };
        if header.compression == Compression::PXR24 {
            return refused(header.compression.to_string());
        }
        match header.blocks {
            BlockDescription::Tiles(tiles) if tiles.level_mode != LevelMode::Singular => {
                return refused("several resolutions".to_owned());
            }
            BlockDescription::ScanLines if header.line_order != LineOrder::Increasing => {
                return refused("lines that do not run from the top".to_owned());
            }
            _ => {}
        }
    }
    Ok(())
}

/// Finds the first attribute that differs but those of a crop.
fn check_same_render(first: (&[Header], &Path), other: (&[Header], &Path)) -> Result<(), Error> {
    let ((first, first_path), (other, path)) = (first, other);
    let strangers = |what: String| {
        Problem::new(Place::file(path), format!("not of the same render as {}: {what}", first_path.display()))
    };
    if first.len() != other.len() {
        let problem = strangers("the number of parts differs".to_owned());
        return Err(problem.found(other.len()).expected(first.len()).into());
    }
    let invalid = |error: io::Error| Error::io(path, "read the image", &error);
    for (first, other) in first.iter().zip(other) {
        let attributes = |header: &Header| -> Result<Vec<header::Record>, Error> {
            let mut records = header::records(header).map_err(invalid)?;
            records.retain(|record| !OF_THE_CROP.iter().any(|name| name.as_bytes() == record.name));
            Ok(records)
        };
        let (a, b) = (attributes(first)?, attributes(other)?);
        // Both are sorted: the least of what only one has.
        let only_in = |a: &[header::Record], b: &[header::Record]| {
            a.iter().find(|record| !b.contains(record)).map(|record| record.name.clone())
        };
        if let Some(name) = only_in(&a, &b).into_iter().chain(only_in(&b, &a)).min() {
            let problem = strangers(format!("the attribute {} differs", String::from_utf8_lossy(&name)));
            return Err(problem.found(shown(other, &name)).expected(shown(first, &name)).into());
        }
    }
    Ok(())
}

/// An attribute's value, shortened.
fn shown(header: &Header, name: &[u8]) -> String {
    use ::exr::meta::attribute::AttributeValue::{ChannelList, Compression, F32, I32, IntegerBounds, Text};
    const LONGEST: usize = 60;
    let value = header.all_named_attributes().find(|(known, _)| *known == name).map(|(_, value)| value);
    let text = match value {
        None => return "none".to_owned(),
        Some(Text(text)) => format!("\"{}\"", String::from_utf8_lossy(text.as_slice())),
        Some(I32(value)) => value.to_string(),
        Some(F32(value)) => value.to_string(),
        Some(Compression(value)) => value.to_string(),
        Some(IntegerBounds(value)) => {
            format!("{}×{} pixels at {},{}", value.size.0, value.size.1, value.position.0, value.position.1)
        }
        Some(ChannelList(list)) => {
            let channels = list.list.iter().map(|channel| format!("{} {:?}", channel.name, channel.sample_type));
            channels.collect::<Vec<_>>().join(", ")
        }
        Some(other) => format!("{other:?}"),
    };
    match text.chars().count() > LONGEST {
        true => text.chars().take(LONGEST).chain(['…']).collect(),
        false => text,
    }
}

/// The pixels of a file, counted from the corner of the display window.
fn window_of(headers: &[Header], path: &Path) -> Result<Region, Error> {
    let header = &headers[0];
    if headers.iter().any(|other| other.data_window() != header.data_window()) {
        return Err(Error::new(Place::file(path), "the parts of the file have different data windows"));
    }
    bounds_inside(header.data_window(), header.shared_attributes.display_window)
        .ok_or_else(|| Error::new(Place::file(path), "the data window reaches out of the display window"))
}

/// The header of the whole frame.
fn whole_header(header: &Header, display: IntegerBounds) -> Header {
    let mut whole = header.clone();
    whole.layer_size = display.size;
    whole.own_attributes.layer_position = display.position;
    whole.own_attributes.other.remove(&Text::from_slice_unchecked(RENDER_SECONDS.as_bytes()));
    whole.with_encoding(header.compression, header.blocks, header.line_order)
}

/// Refuses gaps. What is missing is counted from the windows alone, so that no memory is taken for a frame that nobody has.
fn check_covered(whole: Region, windows: &[Region], paths: &[&Path]) -> Result<(), Error> {
    let (n_missing, first) = missing_pixels(whole, windows);
    let Some((x, y)) = first else { return Ok(()) };
    let files = paths.iter().map(|path| path.display().to_string()).collect::<Vec<_>>().join(", ");
    let pixels = if n_missing == 1 { "pixel is" } else { "pixels are" };
    let what = format!("{n_missing} {pixels} in none of the files, the first at {x},{y}: {files}");
    Err(Error::new(Place::default(), what))
}

/// How many pixels of the frame lie in no window, and the first of them in the order of reading.
fn missing_pixels(whole: Region, windows: &[Region]) -> (u64, Option<(u32, u32)>) {
    let mut ys: Vec<u32> =
        windows.iter().flat_map(|window| [window.y0, window.y1]).chain([whole.y0, whole.y1]).collect();
    ys.sort_unstable();
    ys.dedup();
    let (mut n_missing, mut first) = (0, None);
    // Between two neighbours of these all rows are alike.
    for rows in ys.windows(2) {
        let mut spans: Vec<(u32, u32)> = windows
            .iter()
            .filter(|window| window.y0 <= rows[0] && rows[1] <= window.y1)
            .map(|window| (window.x0, window.x1))
            .chain([(whole.x1, whole.x1)])
            .collect();
        spans.sort_unstable();
        let mut covered_to = whole.x0;
        for (start, end) in spans {
            if start > covered_to {
                n_missing += u64::from(start - covered_to) * u64::from(rows[1] - rows[0]);
                first.get_or_insert((covered_to, rows[0]));
            }
            covered_to = covered_to.max(end);
        }
    }
    (n_missing, first)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missing_pixels_are_those_that_no_window_has() {
        let region = |x0, y0, x1, y1| Region { x0, y0, x1, y1 };
        let whole = Region::whole(10, 8);
        assert_eq!(missing_pixels(whole, &[whole]), (0, None));
        assert_eq!(missing_pixels(whole, &[]), (80, Some((0, 0))));
        let quarters = [region(0, 0, 4, 3), region(4, 0, 10, 3), region(0, 3, 7, 8), region(7, 3, 10, 8)];
        assert_eq!(missing_pixels(whole, &quarters), (0, None));
        assert_eq!(missing_pixels(whole, &quarters[..3]), (15, Some((7, 3))));
        assert_eq!(missing_pixels(whole, &[region(0, 0, 10, 5), region(2, 4, 10, 8)]), (6, Some((0, 5))));
        // Pixel by pixel.
        let windows = [region(1, 1, 5, 4), region(3, 2, 9, 7), region(0, 6, 2, 8), region(8, 0, 10, 1)];
        let is_missing = |x, y| !windows.iter().any(|w| (w.x0..w.x1).contains(&x) && (w.y0..w.y1).contains(&y));
        let missing: Vec<(u32, u32)> =
            (0..8).flat_map(|y| (0..10).map(move |x| (x, y))).filter(|&(x, y)| is_missing(x, y)).collect();
        assert_eq!(missing_pixels(whole, &windows), (missing.len() as u64, missing.first().copied()));
    }
}
