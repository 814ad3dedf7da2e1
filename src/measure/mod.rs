//! Measuring: error of an image against another, exactness, throughput.

pub mod cost_map;
pub mod difference;
pub mod embree;
pub mod error_map;
pub mod flip;
pub mod generate;
pub mod oracle;
pub mod pixels;
pub mod rays;
pub mod ssim;
pub mod stress;
pub mod throughput;
