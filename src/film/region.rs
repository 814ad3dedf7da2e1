//! A rectangle of pixels.

/// Pixels `x0 <= x < x1`, `y0 <= y < y1`, counted from the top left corner of the display window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Region {
    /// First column.
    pub x0: u32,
    /// First row.
    pub y0: u32,
    /// One past the last column.
    pub x1: u32,
    /// One past the last row.
    pub y1: u32,
}

impl Region {
    /// The region of a whole image.
    pub fn whole(width_px: u32, height_px: u32) -> Region {
        Region { x0: 0, y0: 0, x1: width_px, y1: height_px }
    }

    /// Width in pixels.
    #[inline]
    pub fn width_px(&self) -> u32 {
        self.x1 - self.x0
    }

    /// Height in pixels.
    #[inline]
    pub fn height_px(&self) -> u32 {
        self.y1 - self.y0
    }

    /// Number of pixels.
    #[inline]
    pub fn n_pixels(&self) -> usize {
        self.width_px() as usize * self.height_px() as usize
    }

    /// Row-major index of a pixel of this region.
    #[inline]
    pub fn index_of(&self, x: u32, y: u32) -> usize {
        debug_assert!((self.x0..self.x1).contains(&x) && (self.y0..self.y1).contains(&y));
        (y - self.y0) as usize * self.width_px() as usize + (x - self.x0) as usize
    }
}
