//! Measuring: error of an image against another, time against error, exactness, throughput.

pub mod cost_map;
pub mod difference;
pub mod embree;
pub mod error;
pub mod error_map;
pub mod flip;
pub mod generate;
pub mod oracle;
pub mod pixels;
pub mod povray;
pub mod process;
pub mod rays;
pub mod ssim;
pub mod stress;
pub mod throughput;
