//! Measuring: error of an image against another, exactness, throughput.

pub mod difference;
pub mod embree;
pub mod error;
pub mod generate;
pub mod oracle;
pub mod povray;
pub mod process;
pub mod rays;
pub mod stress;
pub mod throughput;
