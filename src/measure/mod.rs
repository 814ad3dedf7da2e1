//! Measuring: error of an image against another.
