//! The bytes of headers: the `exr` crate writes the attributes, here they are sorted by name.

use std::io;

use ::exr::math::{RoundingMode, Vec2};
use ::exr::meta::BlockDescription;
use ::exr::meta::attribute::{
    AttributeValue, ChannelDescription, Chromaticities, Compression, IntegerBounds, LevelMode, LineOrder, SampleType,
    Text, TileDescription,
};
use ::exr::meta::header::{Header, ImageAttributes, LayerAttributes};
use ::exr::prelude::SmallVec;

use super::attributes::RENDER_SECONDS;
use super::part::PartPlanes;
use super::{ColorType, ExrAttributes, ExrCompression, ExrLayout, ExrOptions, MAGIC, invalid_input, io_error};
use crate::film::{Content, Film, Samples};

/// Edge of a tile: what compositors choose.
const TILE_EDGE_PX: usize = 64;

/// Names of attributes and channels have 255 bytes at most, and without a flag in the first bytes of the file 31.
const LONGEST_NAME_BYTES: usize = 255;
const LONGEST_SHORT_NAME_BYTES: usize = 31;

/// `colorInteropID`, as the Color Interop Forum of the Academy Software Foundation names linear Rec. 709 in front of the camera,
/// and what is no colour.
const COLOR_INTEROP_ID: &str = "colorInteropID";
const SCENE_LINEAR_REC709: &str = "lin_rec709_scene";
const NOT_A_COLOR: &str = "data";

/// The headers of a film's parts.
///
/// # Errors
/// `InvalidInput` when a file cannot hold the planes or attributes: none, two of one name, a name that is empty or longer than
/// 255 bytes, zero bytes in a text, an attribute of a name that the format has already.
pub(super) fn headers_of(
    film: &Film,
    parts: &[PartPlanes],
    options: &ExrOptions,
    attributes: &ExrAttributes,
) -> io::Result<Vec<Header>> {
    let n_parts = parts.len();
    let header = |(index, part)| {
        let header = header_of(film, part, index == 0, options, attributes)?;
        match n_parts {
            1 => Ok(header),
            _ => Ok(named(header, text(&part.name)?)),
        }
    };
    let headers: Vec<Header> = parts.iter().enumerate().map(header).collect::<io::Result<_>>()?;
    headers.iter().try_for_each(|header| header.validate(n_parts > 1, &mut false, true).map_err(io_error))?;
    Ok(headers)
}

fn named(mut header: Header, name: Text) -> Header {
    header.own_attributes.layer_name = Some(name);
    header
}

fn header_of(
    film: &Film,
    part: &PartPlanes,
    is_first: bool,
    options: &ExrOptions,
    attributes: &ExrAttributes,
) -> io::Result<Header> {
    let too_large = |_| invalid_input("the image is larger than an EXR file can say");
    let mut channels = SmallVec::new();
    for &plane in &part.planes {
        let plane = &film.planes[plane];
        let sample_type = match (&plane.samples, plane.content, options.color) {
            (Samples::U32(_), ..) => SampleType::U32,
            (_, Content::Color, ColorType::Half) => SampleType::F16,
            _ => SampleType::F32,
        };
        channels.push(ChannelDescription::new(name_text(&plane.name)?, sample_type, false));
    }
    let window = film.data_window;
    let data_size = Vec2(window.width_px() as usize, window.height_px() as usize);
    let position = Vec2(i32::try_from(window.x0).map_err(too_large)?, i32::try_from(window.y0).map_err(too_large)?);
    let display = IntegerBounds::from_dimensions(Vec2(film.width_px as usize, film.height_px as usize));
    let shared = ImageAttributes { chromaticities: Some(rec709()), pixel_aspect: 1.0, ..ImageAttributes::new(display) };
    let mut own = LayerAttributes {
        layer_position: position,
        software_name: Some(text(&attributes.software)?),
        world_to_camera: attributes.world_to_camera,
        world_to_normalized_device: attributes.world_to_ndc,
        ..LayerAttributes::default()
    };
    let is_color = part.planes.iter().any(|&plane| film.planes[plane].content == Content::Color);
    let interop_id = if is_color { SCENE_LINEAR_REC709 } else { NOT_A_COLOR };
    let mut add = |name: &str, value: AttributeValue| match own.other.insert(name_text(name)?, value) {
        None => Ok(()),
        Some(_) => Err(invalid_input(format!("there are two attributes {name:?}"))),
    };
    add(COLOR_INTEROP_ID, AttributeValue::Text(text(interop_id)?))?;
    for (name, value) in attributes.texts_of(&part.name, is_first) {
        add(name, AttributeValue::Text(text(value)?))?;
    }
    for &(ref name, value) in &attributes.numbers {
        add(name, AttributeValue::I32(value))?;
    }
    let (compression, blocks) = encoding_of(options);
    let mut header = Header::new(Text::default(), data_size, channels)
        .with_encoding(compression, blocks, LineOrder::Increasing)
        .with_attributes(own)
        .with_shared_attributes(shared);
    if let Some(seconds) = attributes.render_seconds {
        set_render_seconds(&mut header, seconds);
    }
    Ok(header)
}

/// Adds or replaces the time that a render took.
pub(super) fn set_render_seconds(header: &mut Header, seconds: f32) {
    let name = Text::from_slice_unchecked(RENDER_SECONDS.as_bytes());
    header.own_attributes.other.insert(name, AttributeValue::F32(seconds));
}

fn encoding_of(options: &ExrOptions) -> (Compression, BlockDescription) {
    let compression = match options.compression {
        ExrCompression::None => Compression::Uncompressed,
        ExrCompression::Rle => Compression::RLE,
        ExrCompression::Zips => Compression::ZIP1,
        ExrCompression::Zip => Compression::ZIP16,
        ExrCompression::Piz => Compression::PIZ,
    };
    let blocks = match options.layout {
        ExrLayout::Scanlines => BlockDescription::ScanLines,
        ExrLayout::Tiles => BlockDescription::Tiles(TileDescription {
            tile_size: Vec2(TILE_EDGE_PX, TILE_EDGE_PX),
            level_mode: LevelMode::Singular,
            rounding_mode: RoundingMode::Down,
        }),
    };
    (compression, blocks)
}

/// Primaries and white point of Rec. ITU-R BT.709-6, table 1, item 1.3 and 1.4 (D65); sRGB has the same.
fn rec709() -> Chromaticities {
    Chromaticities {
        red: Vec2(0.64, 0.33),
        green: Vec2(0.30, 0.60),
        blue: Vec2(0.15, 0.06),
        white: Vec2(0.3127, 0.3290),
    }
}

/// A text in UTF-8. Readers take a zero byte for its end.
fn text(value: &str) -> io::Result<Text> {
    match value.contains('\0') {
        true => Err(invalid_input("a text with a zero byte cannot be written to an EXR file")),
        false => Ok(Text::from_slice_unchecked(value.as_bytes())),
    }
}

fn name_text(name: &str) -> io::Result<Text> {
    if name.is_empty() || name.len() > LONGEST_NAME_BYTES {
        return Err(invalid_input(format!("{name:?} cannot be a name in an EXR file: expected 1 to 255 bytes")));
    }
    text(name)
}

/// An attribute as it stands in a file.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Record {
    /// Its name.
    pub name: Vec<u8>,
    /// The name of its type, a zero byte, the length of the value in 4 bytes, the value.
    pub typed_value: Vec<u8>,
}

/// The attributes of a header, sorted by name.
///
/// # Errors
/// A value that the format has no room for.
pub(super) fn records(header: &Header) -> io::Result<Vec<Record>> {
    let mut records = Vec::new();
    for (name, value) in header.all_named_attributes() {
        let mut typed_value = [value.kind_name(), &[0]].concat();
        let size = i32::try_from(value.byte_size()).map_err(|_| invalid_input("an attribute is longer than 2 GiB"))?;
        typed_value.extend_from_slice(&size.to_le_bytes());
        value.write(&mut typed_value).map_err(io_error)?;
        records.push(Record { name: name.to_vec(), typed_value });
    }
    records.sort();
    Ok(records)
}

/// The first bytes of a file: all that stands in front of the table of blocks.
///
/// # Errors
/// As [`records`].
pub(super) fn bytes(headers: &[&Header]) -> io::Result<Vec<u8>> {
    // Bits of the version field: tiles in a single part, long names, several parts.
    const TILED: u32 = 1 << 9;
    const LONG_NAMES: u32 = 1 << 10;
    const SEVERAL_PARTS: u32 = 1 << 12;
    const VERSION: u32 = 2;
    let parts: Vec<Vec<Record>> = headers.iter().map(|header| records(header)).collect::<io::Result<_>>()?;
    let is_long = |name: &[u8]| name.len() > LONGEST_SHORT_NAME_BYTES;
    let has_long_names = parts.iter().flatten().any(|record| is_long(&record.name))
        || headers.iter().flat_map(|header| &header.channels.list).any(|channel| is_long(channel.name.as_slice()));
    let is_multi_part = headers.len() > 1;
    let is_tiled = headers.iter().any(|header| header.blocks.has_tiles());
    let flags = [(is_tiled && !is_multi_part, TILED), (has_long_names, LONG_NAMES), (is_multi_part, SEVERAL_PARTS)];
    let version = flags.into_iter().filter(|&(is_set, _)| is_set).fold(VERSION, |version, (_, flag)| version | flag);
    let mut bytes = [MAGIC, version.to_le_bytes()].concat();
    for part in &parts {
        for Record { name, typed_value } in part {
            bytes.extend_from_slice(name);
            bytes.push(0);
            bytes.extend_from_slice(typed_value);
        }
        bytes.push(0);
    }
    if is_multi_part {
        bytes.push(0);
    }
    Ok(bytes)
}
