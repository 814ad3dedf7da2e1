//! Measuring: error of an image against another.

pub mod difference;
pub mod generate;
pub mod oracle;
pub mod stress;
