//! Boxes around parts of triangles, as clipping finds them: larger than the parts, never smaller (`docs/NUMERICS.md`, "Boxes of
//! pieces").

use glam::DVec3;

use crate::numeric::U;
use crate::world::Bounds;

/// Rounding of a point where an edge meets a plane, in shares of the largest coordinate.
const CLIP_ERROR: f64 = 20.0 * U;

/// What points where the edges of a triangle meet planes may be wrong by.
pub fn clip_error(corners: &[DVec3; 3]) -> f64 {
    CLIP_ERROR * corners.iter().fold(0.0, |largest: f64, corner| largest.max(corner.abs().max_element()))
}

/// A box around points, none at first.
#[derive(Clone, Copy, Debug)]
pub struct Piece {
    lo: DVec3,
    hi: DVec3,
}

impl Piece {
    /// Around nothing.
    pub const EMPTY: Piece = Piece { lo: DVec3::INFINITY, hi: DVec3::NEG_INFINITY };

    /// Makes it hold a point that is wrong by `error`.
    pub fn include(&mut self, p: DVec3, error: f64) {
        self.lo = self.lo.min(p - error);
        self.hi = self.hi.max(p + error);
    }

    /// The box in f32; `whole` for one at the edge of the range of f32, `None` around nothing.
    pub fn bounds(&self, whole: Bounds) -> Option<Bounds> {
        (self.lo.x <= self.hi.x).then(|| Bounds::around(self.lo, self.hi).unwrap_or(whole))
    }
}
