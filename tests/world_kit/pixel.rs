//! Colours of pixels.

use flatray::film::Film;
use glam::DVec3;

/// Red, green and blue of a pixel of the whole image.
pub fn rgb(film: &Film, x: u32, y: u32) -> DVec3 {
    let index = film.data_window.index_of(x, y);
    DVec3::from_array(film.color_planes().unwrap().map(|plane| plane.samples.get(index)))
}
