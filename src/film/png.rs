//! PNG: the picture to look at, and the original's bytes. The only file that uses the `image` crate, which reads; it
//! writes on one thread and all at once, while a frame is to be written as it is rendered.

use std::io::{self, Cursor, Write};
use std::path::Path;
use std::sync::OnceLock;

use image::codecs::png::PngDecoder;
use image::{ImageDecoder, Limits};
use rayon::prelude::*;

use crate::error::{Error, Place, Problem};
use crate::film::deflate::{self, Adler32};
use crate::film::display::{BitDepth, Mapping};
use crate::film::png_chunk::{Transfer, parse_header, parse_transfer, write_chunk};
use crate::film::read::{filled, read_bytes};
use crate::film::rows::{BAND_ROWS, Rows};
use crate::film::{Display, Film, ImageFile, Plane, Region, Samples, png_filter};

pub use crate::film::png_chunk::SIGNATURE;

/// How hard the compressor tries. `docs/BENCHMARKS.md` has the table this was chosen from.
const LEVEL: u32 = 3;

/// A film on its way into a file: its bands are mapped and compressed as they come, in any order, by any thread.
#[derive(Debug)]
pub struct Encoder {
    mapping: Mapping,
    bit_depth: BitDepth,
    is_srgb: bool,
    size_px: [u32; 2],
    /// The planes shown as red, green and blue.
    planes: [usize; 3],
    bands: Vec<OnceLock<io::Result<Band>>>,
}

/// A piece of the image data, of rows that are filtered without knowledge of those above.
#[derive(Debug)]
struct Band {
    deflated: Vec<u8>,
    checksum: Adler32,
    length: usize,
}

impl Encoder {
    /// An encoder for films of this one's outline; its samples are not looked at.
    ///
    /// # Errors
    /// `InvalidInput` when the film breaks its own promises ([`Film::check`]), has no colour or is wider or higher than PNG
    /// can say.
    pub fn new(film: &Film, display: &Display) -> io::Result<Encoder> {
        film.check().map_err(invalid_input)?;
        let place = |name: &str| film.planes.iter().position(|plane| plane.name == name);
        let planes = match (place("R"), place("G"), place("B"), place("Y")) {
            (Some(r), Some(g), Some(b), _) => [r, g, b],
            (_, _, _, Some(y)) => [y; 3],
            _ => return Err(invalid_input("a PNG needs planes R, G and B, or Y".to_string())),
        };
        let size_px = [film.data_window.width_px(), film.data_window.height_px()];
        if size_px.iter().any(|&length| length > i32::MAX as u32) {
            return Err(invalid_input("the image is larger than a PNG file can say".to_string()));
        }
        let n_bands = (size_px[1] as usize).div_ceil(BAND_ROWS);
        Ok(Encoder {
            mapping: display.mapping(),
            bit_depth: display.bit_depth(),
            is_srgb: display.is_srgb(),
            size_px,
            planes,
            bands: (0..n_bands).map(|_| OnceLock::new()).collect(),
        })
    }

    /// Maps and compresses rows that are finished. They begin where a band does and end where one does, or with the film.
    pub fn encode(&self, rows: &Rows) {
        for (index, rows) in rows.bands() {
            self.band(index, &rows);
        }
    }

    fn band(&self, index: usize, rows: &Rows) -> &io::Result<Band> {
        self.bands[index].get_or_init(|| {
            let filtered = png_filter::filter(&self.rgba(rows), rows.width_px, self.pixel_bytes());
            let deflated = deflate::piece(&filtered, LEVEL, index + 1 == self.bands.len())?;
            Ok(Band { deflated, checksum: Adler32::of(&filtered), length: filtered.len() })
        })
    }

    /// Bytes of a pixel's four samples.
    fn pixel_bytes(&self) -> usize {
        4 * self.bit_depth.bytes()
    }

    fn rgba(&self, rows: &Rows) -> Vec<u8> {
        let [r, g, b] = self.planes.map(|plane| rows.planes[plane]);
        let n_pixels = rows.n_rows() * rows.width_px;
        let mut rgba = vec![0; n_pixels * self.pixel_bytes()];
        self.mapping.fill_rgba((0..n_pixels).map(|index| [r, g, b].map(|plane| plane.get(index))), &mut rgba);
        rgba
    }

    /// Writes an RGBA PNG of 8 or 16 bits a sample as large as the film's data window; `Y` alone is written as grey RGB. Bands that
    /// [`Encoder::encode`] has not seen are made now. The same film gives the same bytes.
    ///
    /// Alpha is full everywhere: the film's A is how much of a pixel is covered by objects, while its RGB already holds the
    /// background's radiance where nothing covers it, so the picture is opaque. Coverage is kept in the EXR.
    ///
    /// A tone-mapped file says that it is sRGB (chunks sRGB, perceptual, and gAMA 0.45455 for programs that only know that
    /// one). A course file says nothing about its transfer, like the original's own files, so that both are decoded alike.
    ///
    /// # Errors
    /// What `out` answers.
    pub fn write(&self, film: &Film, out: &mut (impl Write + ?Sized)) -> io::Result<()> {
        (0..self.bands.len()).into_par_iter().for_each(|index| {
            self.band(index, &film.rows(index * BAND_ROWS, BAND_ROWS));
        });
        out.write_all(&SIGNATURE)?;
        let [width_px, height_px] = self.size_px.map(u32::to_be_bytes);
        let sample_bits = 8 * self.bit_depth.bytes() as u8;
        // RGBA; one way each to compress, filter and order the rows.
        write_chunk(out, *b"IHDR", &[&width_px, &height_px, &[sample_bits, 6, 0, 0, 0]])?;
        if self.is_srgb {
            write_chunk(out, *b"gAMA", &[&45_455_u32.to_be_bytes()])?;
            write_chunk(out, *b"sRGB", &[&[0]])?;
        }
        let mut checksum = Adler32::EMPTY;
        for (index, band) in self.bands.iter().enumerate() {
            let band = match band.get() {
                Some(Ok(band)) => band,
                Some(Err(error)) => return Err(io::Error::new(error.kind(), error.to_string())),
                None => return Err(io::Error::other("a band of the image was not made")),
            };
            checksum = checksum.then(band.checksum, band.length);
            // RFC 1950: deflate with a window of 32 KiB, the fastest kind, begins the stream; the checksum ends it.
            let header: &[u8] = if index == 0 { &[0x78, 0x01] } else { &[] };
            let is_last = index + 1 == self.bands.len();
            let trailer = checksum.value().to_be_bytes();
            write_chunk(out, *b"IDAT", &[header, &band.deflated, if is_last { &trailer } else { &[] }])?;
        }
        write_chunk(out, *b"IEND", &[])
    }
}

fn invalid_input(what: String) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidInput, what)
}

/// Writes a film as a PNG, as [`Encoder::write`].
///
/// # Errors
/// As [`Encoder::new`], and what `out` answers.
pub fn write(film: &Film, display: &Display, out: &mut (impl Write + ?Sized)) -> io::Result<()> {
    Encoder::new(film, display)?.write(film, out)
}

/// Reads a PNG file of any kind as a scene-linear film of F32 planes: `Y` or `R`, `G`, `B`, and `A` where the file has
/// alpha, colour then multiplied by it.
///
/// `transfer` overrides what the file says. 16-bit files keep their precision: no two samples give the same value.
///
/// # Errors
/// A file that cannot be read, is cut short or damaged, claims more pixels than it can hold, or states a colour space that
/// is not understood.
pub fn read(path: impl AsRef<Path>, transfer: Option<Transfer>) -> Result<ImageFile, Error> {
    let path = path.as_ref();
    decode(&read_bytes(path)?, transfer, path)
}

/// Reads a PNG file that is in memory; `path` is only named in errors.
///
/// # Errors
/// As [`read`].
pub fn decode(bytes: &[u8], transfer: Option<Transfer>, path: &Path) -> Result<ImageFile, Error> {
    let samples = decode_samples(bytes, path)?;
    let transfer = match transfer {
        Some(transfer) => transfer,
        None => parse_transfer(bytes, path)?,
    };
    let rgb8 = match (&samples.values, samples.n_channels) {
        (Values::Eight(values), n) => Some(values.chunks_exact(n).map(color_bytes).collect()),
        (Values::Sixteen(_), _) => None,
    };
    Ok(ImageFile { film: film_of(&samples, transfer, path)?, rgb8, is_picture: true })
}

/// Samples as they stand in the file, pixel after pixel, palettes and small depths expanded to 8 bits.
struct FileSamples {
    width_px: u32,
    height_px: u32,
    n_channels: usize,
    values: Values,
}

enum Values {
    Eight(Vec<u8>),
    Sixteen(Vec<u16>),
}

fn decode_samples(bytes: &[u8], path: &Path) -> Result<FileSamples, Error> {
    /// Deflate packs at most 258 bytes into 2 bits (RFC 1951, 3.2.5).
    const LARGEST_RATIO: u64 = 1032;
    /// What text and profile chunks may take while they are decoded.
    const ALLOWANCE_BYTES: u64 = 16 << 20;

    let header = parse_header(bytes, path)?;
    let limit = (bytes.len() as u64).saturating_mul(LARGEST_RATIO);
    if header.uncompressed_bytes().is_none_or(|n_bytes| n_bytes > limit) {
        return Err(Problem::new(Place::file(path), "the PNG header claims more pixels than the file can hold")
            .found(format!("{}×{} pixels in {} bytes", header.width_px, header.height_px, bytes.len()))
            .into());
    }
    let unreadable = |error: image::ImageError| Error::new(Place::file(path), format!("unreadable PNG file: {error}"));
    let mut limits = Limits::no_limits();
    // A row of the decoder is a small part of the image, which is ours.
    limits.max_alloc = Some(limit.saturating_add(ALLOWANCE_BYTES));
    let decoder = PngDecoder::with_limits(Cursor::new(bytes), limits).map_err(unreadable)?;
    let (width_px, height_px) = decoder.dimensions();
    let color_type = decoder.color_type();
    let n_channels = usize::from(color_type.channel_count());
    let length = usize::try_from(decoder.total_bytes())
        .map_err(|_| Error::new(Place::file(path), "the PNG image is larger than memory"))?;
    let mut buffer = filled(length, 0_u8, path)?;
    decoder.read_image(&mut buffer).map_err(unreadable)?;
    let values = if usize::from(color_type.bytes_per_pixel()) == n_channels {
        Values::Eight(buffer)
    } else {
        Values::Sixteen(buffer.chunks_exact(2).map(|pair| u16::from_ne_bytes([pair[0], pair[1]])).collect())
    };
    Ok(FileSamples { width_px, height_px, n_channels, values })
}

/// The colour of a pixel of 1 to 4 bytes.
fn color_bytes(pixel: &[u8]) -> [u8; 3] {
    match *pixel {
        [r, g, b] | [r, g, b, _] => [r, g, b],
        [y] | [y, _] => [y; 3],
        _ => [0; 3],
    }
}

fn film_of(samples: &FileSamples, transfer: Transfer, path: &Path) -> Result<Film, Error> {
    // One table entry for every value a sample can have.
    let table = |n_values: u32| -> Vec<f32> {
        let largest = f64::from(n_values - 1);
        (0..n_values).map(|value| transfer.to_linear(f64::from(value) / largest) as f32).collect()
    };
    let names: &[&str] = match samples.n_channels {
        1 => &["Y"],
        2 => &["Y", "A"],
        3 => &["R", "G", "B"],
        _ => &["R", "G", "B", "A"],
    };
    let n_pixels = samples.width_px as usize * samples.height_px as usize;
    let mut planes = Vec::new();
    for _ in names {
        planes.push(filled(n_pixels, 0.0_f32, path)?);
    }
    match &samples.values {
        Values::Eight(values) => {
            let table = table(1 << 8);
            fill_planes(&mut planes, values, |value| table[usize::from(value)], |a| f32::from(a) / 255.0);
        }
        Values::Sixteen(values) => {
            let table = table(1 << 16);
            fill_planes(&mut planes, values, |value| table[usize::from(value)], |a| f32::from(a) / 65535.0);
        }
    }
    let planes = names.iter().zip(planes);
    Ok(Film {
        width_px: samples.width_px,
        height_px: samples.height_px,
        data_window: Region::whole(samples.width_px, samples.height_px),
        planes: planes.map(|(name, values)| Plane::color(*name, Samples::F32(values))).collect(),
    })
}

/// Takes interleaved samples apart; with two or four planes the last is alpha.
fn fill_planes<T: Copy>(planes: &mut [Vec<f32>], values: &[T], color: impl Fn(T) -> f32, alpha: impl Fn(T) -> f32) {
    let n_channels = planes.len();
    let has_alpha = n_channels.is_multiple_of(2);
    for (index, pixel) in values.chunks_exact(n_channels).enumerate() {
        let opacity = if has_alpha { alpha(pixel[n_channels - 1]) } else { 1.0 };
        for (channel, (plane, &value)) in planes.iter_mut().zip(pixel).enumerate() {
            let is_alpha = has_alpha && channel == n_channels - 1;
            plane[index] = if is_alpha { opacity } else { color(value) * opacity };
        }
    }
}
