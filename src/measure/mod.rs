//! Measuring: error of an image against another.

pub mod difference;
pub mod generate;
