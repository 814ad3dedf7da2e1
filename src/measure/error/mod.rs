//! Run time against error.

pub mod cache;
pub mod frame;
pub mod front;
pub mod grid;
pub mod reference;
pub mod setting;
