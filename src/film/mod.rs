//! The image: planes of samples, and what writes and reads them.
//!
//! | room | does |
//! |---|---|
//! | [`region`] | a rectangle of pixels |
//! | [`tone_map`], [`display`] | from scene-linear radiance to display bytes, pure functions |
//! | [`color_map`] | colours for numbers: errors, costs |
//! | [`rows`] | whole rows of a film, lent out: what is rendered and encoded independently |
//! | [`exr`], [`png`], [`pfm`] | one file format each: write a [`Film`], read one back |
//! | [`cryptomatte`] | ids of names, and what a header says of them |
//! | [`encode`] | any of them, fed band by band while the rest is rendered |
//! | [`read`] | any image file, chosen by its first bytes |
//! | [`output`] | files written beside and renamed |
//!
//! Colour is scene-linear with Rec. 709 primaries. A colour image has the planes `R`, `G`, `B` and perhaps `A`; an image
//! of one channel has `Y`.

pub mod color_map;
pub mod cryptomatte;
mod deflate;
pub mod display;
pub mod encode;
pub mod exr;
pub mod output;
pub mod pfm;
pub mod png;
pub mod png_chunk;
mod png_filter;
pub mod read;
pub mod region;
pub mod rows;
pub mod tone_map;
mod zip;

pub use display::{BitDepth, Display, Picture};
pub use encode::{EncodeOptions, Encoder};
pub use read::{ImageFile, read_image};
pub use region::Region;
pub use rows::Rows;
pub use tone_map::ToneMap;

/// One plane of an image, row after row from the top, as wide and high as the film's data window.
#[derive(Clone, Debug, PartialEq)]
pub struct Plane {
    /// Channel name as EXR has it, for example `R` or `Z`.
    pub name: String,
    /// What the values are.
    pub content: Content,
    /// The values.
    pub samples: Samples,
}

/// What the values of a plane are, which says what a file may do with them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Content {
    /// Scene-linear radiance, or coverage: an EXR keeps it in 16 bits unless told otherwise.
    Color,
    /// Positions, distances, ids: every bit counts.
    Data,
}

/// Values of a plane in the type they are kept in.
#[derive(Clone, Debug, PartialEq)]
pub enum Samples {
    /// 32-bit float.
    F32(Vec<f32>),
    /// 64-bit float: kept for the compatible mode, whose bytes are the floor of the original's doubles.
    F64(Vec<f64>),
    /// 32-bit unsigned integer: ids and counts.
    U32(Vec<u32>),
}

/// An image: planes over a data window inside a display window.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    /// Width of the display window in pixels.
    pub width_px: u32,
    /// Height of the display window in pixels.
    pub height_px: u32,
    /// The part of the display window that the planes hold.
    pub data_window: Region,
    /// Planes; a beauty image has `R`, `G`, `B`, `A`, scene-linear and premultiplied.
    pub planes: Vec<Plane>,
}

impl Plane {
    /// A plane of radiance or coverage.
    pub fn color(name: impl Into<String>, samples: Samples) -> Plane {
        Plane { name: name.into(), content: Content::Color, samples }
    }

    /// A plane of anything else.
    pub fn data(name: impl Into<String>, samples: Samples) -> Plane {
        Plane { name: name.into(), content: Content::Data, samples }
    }
}

impl Film {
    /// The plane of a name.
    pub fn plane(&self, name: &str) -> Option<&Plane> {
        self.planes.iter().find(|plane| plane.name == name)
    }

    /// The planes that a picture shows as red, green and blue: `R`, `G`, `B`, or `Y` three times.
    pub fn color_planes(&self) -> Option<[&Plane; 3]> {
        match (self.plane("R"), self.plane("G"), self.plane("B")) {
            (Some(r), Some(g), Some(b)) => Some([r, g, b]),
            _ => self.plane("Y").map(|y| [y, y, y]),
        }
    }

    /// Whether the film keeps its own promises: a data window that is not empty and lies inside the display window, and
    /// planes as long as the data window has pixels.
    ///
    /// # Errors
    /// A sentence that says which promise is broken.
    pub fn check(&self) -> Result<(), String> {
        let Region { x0, y0, x1, y1 } = self.data_window;
        if x0 >= x1 || y0 >= y1 || x1 > self.width_px || y1 > self.height_px {
            return Err(format!(
                "the data window {x0},{y0} to {x1},{y1} is not inside the {}×{} image",
                self.width_px, self.height_px
            ));
        }
        match self.planes.iter().find(|plane| plane.samples.len() != self.n_pixels()) {
            Some(plane) => {
                Err(format!("plane {} has {} samples for {} pixels", plane.name, plane.samples.len(), self.n_pixels()))
            }
            None => Ok(()),
        }
    }

    /// The film with a data window that is its whole display window, zeros around what it held.
    pub fn padded(&self) -> Film {
        let whole = Region::whole(self.width_px, self.height_px);
        let planes = self.planes.iter().map(|Plane { name, content, samples }| {
            let samples = match samples {
                Samples::F32(values) => Samples::F32(self.padded_values(values)),
                Samples::F64(values) => Samples::F64(self.padded_values(values)),
                Samples::U32(values) => Samples::U32(self.padded_values(values)),
            };
            Plane { name: name.clone(), content: *content, samples }
        });
        Film { width_px: self.width_px, height_px: self.height_px, data_window: whole, planes: planes.collect() }
    }

    fn padded_values<T: Copy + Default>(&self, values: &[T]) -> Vec<T> {
        let whole = Region::whole(self.width_px, self.height_px);
        let mut padded = vec![T::default(); whole.n_pixels()];
        let width = self.data_window.width_px() as usize;
        for (row, y) in values.chunks_exact(width).zip(self.data_window.y0..) {
            let start = whole.index_of(self.data_window.x0, y);
            padded[start..start + width].copy_from_slice(row);
        }
        padded
    }

    /// Pixels in the data window.
    pub fn n_pixels(&self) -> usize {
        self.data_window.n_pixels()
    }
}

impl Samples {
    /// The value at an index, widened; u32 and f32 are exact in f64.
    #[inline]
    pub fn get(&self, index: usize) -> f64 {
        match self {
            Samples::F32(values) => f64::from(values[index]),
            Samples::F64(values) => values[index],
            Samples::U32(values) => f64::from(values[index]),
        }
    }

    /// Number of values.
    pub fn len(&self) -> usize {
        match self {
            Samples::F32(values) => values.len(),
            Samples::F64(values) => values.len(),
            Samples::U32(values) => values.len(),
        }
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}
