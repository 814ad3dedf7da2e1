//! Coverage of pixels.

use flatray::film::Film;

/// How much of a pixel is covered by objects.
pub fn coverage(film: &Film, x: u32, y: u32) -> f64 {
    film.plane("A").unwrap().samples.get(film.data_window.index_of(x, y))
}
