//! flatray: a data-oriented Whitted ray tracer.

pub mod accel;
pub mod cli;
pub mod error;
pub mod film;
pub mod measure;
pub mod numeric;
pub mod render;
pub mod scene;
pub mod simd;
pub mod world;

pub use error::Error;
