//! Curves between scene-linear radiance and display values: pure functions of numbers.
//!
//! | file | operator, and where it is published |
//! |---|---|
//! | [`ToneMap::Clip`] | none: values above 1 are cut |
//! | [`reinhard`] | Reinhard et al. 2002, with and without a white point |
//! | [`hable`] | the filmic curve of *Uncharted 2* |
//! | [`aces_hill`] | Stephen Hill's fit of the ACES output |
//! | [`khronos_neutral`] | Khronos PBR Neutral, the default |
//! | [`agx_approx`] | Benjamin Wrensch's approximation of AgX |
//! | [`srgb`] | the transfer from display values to levels |
//!
//! Every operator takes linear Rec. 709 radiance, finite and not negative ([`expose_by`]), and gives linear Rec. 709 display
//! values in 0 … 1; of two greys the brighter one never comes out darker. None is followed by a gamut mapping: what an
//! operator brings below 0 or above 1 is cut there.
//!
//! Powers come from `libm`, not from the platform's C library, so that the same value gives the same bits everywhere.

pub mod aces_hill;
pub mod agx_approx;
pub mod hable;
pub mod khronos_neutral;
pub mod reinhard;
pub mod srgb;

#[cfg(test)]
mod tests;

pub use srgb::{SrgbLevels, linear_from_srgb, quantize8, quantize16, srgb_from_linear};

use hable::Hable;
use reinhard::Reinhard;

/// Largest radiance that the tone curves work with, that of a 32-bit float; anything above, infinity included, is as
/// white. It keeps every product inside a curve finite.
const MAX_RADIANCE: f64 = f32::MAX as f64;

/// What radiance is multiplied by for an exposure: 2^`exposure_stops`.
pub fn exposure_factor(exposure_stops: f64) -> f64 {
    libm::exp2(exposure_stops)
}

/// Radiance of one channel made fit for a tone curve: multiplied by the [`exposure_factor`], then NaN and negative
/// values become 0 and values above the largest 32-bit float become that.
#[inline]
pub fn expose_by(radiance: f64, factor: f64) -> f64 {
    let exposed = radiance * factor;
    if exposed > 0.0 { exposed.min(MAX_RADIANCE) } else { 0.0 }
}

/// Which operator, with what it can be told.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum ToneMap {
    /// What is above 1 is 1.
    Clip,
    /// [`Reinhard`].
    Reinhard {
        /// The radiance that becomes white, above 0; nothing finite does unless it is given.
        white: Option<f64>,
    },
    /// [`Hable`].
    Hable {
        /// The radiance that becomes white, above 0; [`hable::DEFAULT_WHITE`] as published.
        white: f64,
    },
    /// [`aces_hill`].
    AcesHill,
    /// [`khronos_neutral`].
    #[default]
    KhronosNeutral,
    /// [`agx_approx`].
    AgxApprox,
}

/// A [`ToneMap`] with all that is the same for every colour worked out.
#[derive(Clone, Copy, Debug)]
pub enum Operator {
    /// [`ToneMap::Clip`].
    Clip,
    /// [`ToneMap::Reinhard`].
    Reinhard(Reinhard),
    /// [`ToneMap::Hable`].
    Hable(Hable),
    /// [`ToneMap::AcesHill`].
    AcesHill,
    /// [`ToneMap::KhronosNeutral`].
    KhronosNeutral,
    /// [`ToneMap::AgxApprox`].
    AgxApprox,
}

impl ToneMap {
    /// Prepares to map many colours.
    pub fn operator(self) -> Operator {
        match self {
            ToneMap::Clip => Operator::Clip,
            ToneMap::Reinhard { white } => Operator::Reinhard(Reinhard::new(white)),
            ToneMap::Hable { white } => Operator::Hable(Hable::new(white)),
            ToneMap::AcesHill => Operator::AcesHill,
            ToneMap::KhronosNeutral => Operator::KhronosNeutral,
            ToneMap::AgxApprox => Operator::AgxApprox,
        }
    }
}

impl Operator {
    /// The display values of a colour; both linear.
    #[inline]
    pub fn map(&self, color: [f64; 3]) -> [f64; 3] {
        match self {
            Operator::KhronosNeutral => khronos_neutral::map(color),
            Operator::Clip => color.map(|c| c.min(1.0)),
            Operator::Reinhard(reinhard) => color.map(|c| reinhard.map(c)),
            Operator::Hable(hable) => color.map(|c| hable.map(c)),
            Operator::AcesHill => aces_hill::map(color),
            Operator::AgxApprox => agx_approx::map(color),
        }
    }
}

/// Rows of a matrix times a colour.
#[inline]
fn times(rows: &[[f64; 3]; 3], [r, g, b]: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|row| rows[row][0] * r + rows[row][1] * g + rows[row][2] * b)
}
