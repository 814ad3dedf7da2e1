//! The image: planes of samples, and what writes and reads them.

pub mod region;

pub use region::Region;

/// One plane of an image, row after row from the top, as wide and high as the film's data window.
#[derive(Clone, Debug, PartialEq)]
pub struct Plane {
    /// Channel name as EXR has it, for example `R` or `Z`.
    pub name: String,
    /// The values.
    pub samples: Samples,
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

impl Film {
    /// The plane of a name.
    pub fn plane(&self, name: &str) -> Option<&Plane> {
        self.planes.iter().find(|plane| plane.name == name)
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
