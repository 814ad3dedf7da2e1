//! Bounds and exactness: directed rounding, double-double arithmetic with bounds, exact arithmetic behind it.
//!
//! A decision is made in three tiers: f64 with a certified bound, double-double with a certified bound, exact dyadic
//! numbers. A tier that cannot be certain hands on to the next; the last is always certain. `docs/NUMERICS.md`
//! derives every bound.

pub mod affine;
pub mod clip;
pub mod double;
pub mod dyadic;
pub mod edge;
pub mod four;
pub mod interval;
pub mod lane;
pub mod packet;
pub mod plane;
pub mod prepared;
pub mod quadratic;
pub mod quadric;
pub mod ratio;
pub mod sphere;
pub mod sphere_lanes;
pub mod tally;
pub mod triangle;

pub use crate::simd::rounding;

/// Unit roundoff of f64, 2⁻⁵³: the largest relative error of one rounded operation.
pub const U: f64 = f64::EPSILON / 2.0;
