//! Measuring: error of an image against another, exactness, throughput.

pub mod cost_map;
pub mod difference;
pub mod embree;
pub mod generate;
pub mod oracle;
pub mod rays;
pub mod stress;
pub mod throughput;
