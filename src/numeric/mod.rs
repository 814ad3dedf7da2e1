//! Bounds and exactness: directed rounding, error-free transformations, certified signs.

pub mod rounding;
pub mod triangle;
