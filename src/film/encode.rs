//! Image files on the way: what can be done before the last pixel is known is done while the rest is rendered.

use std::io;

use super::output::{Format, WriteSeek};
use super::rows::Rows;
use super::{Display, Film, exr, pfm, png};

/// An image file in the making. The bytes are the same whether its rows were handed over one band at a time, by many
/// threads, or not at all.
#[derive(Debug)]
pub enum Encoder {
    /// OpenEXR.
    Exr(Box<exr::Encoder>),
    /// PNG.
    Png(png::Encoder),
    /// Portable float map: nothing can be done beforehand.
    Pfm,
}

/// How the files of each format are made.
#[derive(Clone, Debug, PartialEq)]
pub struct EncodeOptions {
    /// What a PNG shows.
    pub display: Display,
    /// What an EXR file is.
    pub exr: exr::ExrOptions,
    /// What its header says.
    pub exr_attributes: exr::ExrAttributes,
}

impl EncodeOptions {
    /// The defaults but for the display.
    pub fn of_display(display: Display) -> EncodeOptions {
        EncodeOptions { display, exr: exr::ExrOptions::default(), exr_attributes: exr::ExrAttributes::default() }
    }
}

impl Encoder {
    /// An encoder for films of this one's outline; its samples are not looked at.
    ///
    /// # Errors
    /// A film that the format cannot hold.
    pub fn new(format: Format, film: &Film, options: &EncodeOptions) -> io::Result<Encoder> {
        let EncodeOptions { display, exr, exr_attributes } = options;
        match format {
            Format::Exr => exr::Encoder::new(film, exr, exr_attributes).map(Box::new).map(Encoder::Exr),
            Format::Png => png::Encoder::new(film, display).map(Encoder::Png),
            Format::Pfm => Ok(Encoder::Pfm),
        }
    }

    /// Sets what only the end of a render tells, where the format has a place for it.
    pub fn set_render_seconds(&mut self, seconds: f32) {
        match self {
            Encoder::Exr(encoder) => encoder.set_render_seconds(seconds),
            Encoder::Png(_) | Encoder::Pfm => {}
        }
    }

    /// Takes rows that are finished. They begin where a band ([`super::rows::BAND_ROWS`]) does and end where one does, or
    /// with the film.
    pub fn encode(&self, rows: &Rows) {
        match self {
            Encoder::Exr(encoder) => encoder.encode(rows),
            Encoder::Png(encoder) => encoder.encode(rows),
            Encoder::Pfm => {}
        }
    }

    /// Writes the file. `film` is the finished film, whose bands may have been handed over before.
    ///
    /// # Errors
    /// Whatever `out` answers, and a film that the format cannot hold.
    pub fn write(&self, film: &Film, mut out: &mut dyn WriteSeek) -> io::Result<()> {
        match self {
            Encoder::Exr(encoder) => encoder.write(film, &mut out),
            Encoder::Png(encoder) => encoder.write(film, out),
            Encoder::Pfm => pfm::write(film, out),
        }
    }
}
