//! Whole rows of a film: lent out for writing while a frame is rendered, and for encoding once they are finished.

use std::ops::Range;

use super::{Film, Plane, Samples};

/// Rows that files are encoded by: a ZIP block of OpenEXR has 16 lines, and PNG is cut alike. What one such band is
/// encoded to depends on its own pixels alone, so that bands can be encoded in any order, by any thread.
pub const BAND_ROWS: usize = 16;

/// Rows of a film, one slice per plane in the order of the film's planes.
#[derive(Clone, Debug)]
pub struct Rows<'a> {
    /// The first of them, counted from the top of the data window.
    pub first_row: usize,
    /// Width of the data window in pixels.
    pub width_px: usize,
    /// Samples, row after row.
    pub planes: Vec<RowSamples<'a>>,
}

/// Samples of one plane.
#[derive(Clone, Copy, Debug)]
pub enum RowSamples<'a> {
    /// 32-bit float.
    F32(&'a [f32]),
    /// 64-bit float.
    F64(&'a [f64]),
    /// 32-bit unsigned integer.
    U32(&'a [u32]),
}

/// Rows of a film that are still being written.
#[derive(Debug)]
pub struct RowsMut<'a> {
    first_row: usize,
    width_px: usize,
    planes: Vec<RowSamplesMut<'a>>,
}

/// Samples of one plane, to be written.
#[derive(Debug)]
enum RowSamplesMut<'a> {
    F32(&'a mut [f32]),
    F64(&'a mut [f64]),
    U32(&'a mut [u32]),
}

impl Film {
    /// Rows of the data window, at most `n_rows` from `first_row` on.
    pub fn rows(&self, first_row: usize, n_rows: usize) -> Rows<'_> {
        let width_px = self.data_window.width_px() as usize;
        let end = (first_row + n_rows).min(self.data_window.height_px() as usize);
        let range = first_row * width_px..end * width_px;
        let planes = self.planes.iter().map(|Plane { samples, .. }| match samples {
            Samples::F32(values) => RowSamples::F32(values).slice(range.clone()),
            Samples::F64(values) => RowSamples::F64(values).slice(range.clone()),
            Samples::U32(values) => RowSamples::U32(values).slice(range.clone()),
        });
        Rows { first_row, width_px, planes: planes.collect() }
    }

    /// Cuts the film into pieces of `n_rows` rows, the last perhaps shorter, that can be written independently.
    pub fn split_rows_mut(&mut self, n_rows: usize) -> Vec<RowsMut<'_>> {
        let width_px = self.data_window.width_px() as usize;
        let n_pieces = (self.data_window.height_px() as usize).div_ceil(n_rows);
        let piece = |index: usize| RowsMut { first_row: index * n_rows, width_px, planes: Vec::new() };
        let mut pieces: Vec<RowsMut> = (0..n_pieces).map(piece).collect();
        let length = n_rows * width_px;
        for Plane { samples, .. } in &mut self.planes {
            let slices: Vec<RowSamplesMut> = match samples {
                Samples::F32(values) => values.chunks_mut(length).map(RowSamplesMut::F32).collect(),
                Samples::F64(values) => values.chunks_mut(length).map(RowSamplesMut::F64).collect(),
                Samples::U32(values) => values.chunks_mut(length).map(RowSamplesMut::U32).collect(),
            };
            pieces.iter_mut().zip(slices).for_each(|(piece, slice)| piece.planes.push(slice));
        }
        pieces
    }
}

impl<'a> Rows<'a> {
    /// Number of rows.
    pub fn n_rows(&self) -> usize {
        self.planes.first().map_or(0, |plane| plane.len() / self.width_px)
    }

    /// The bands of [`BAND_ROWS`] that these rows consist of, each with its number in the film. The rows begin where a
    /// band does.
    pub fn bands(&self) -> impl Iterator<Item = (usize, Rows<'a>)> {
        debug_assert!(self.first_row.is_multiple_of(BAND_ROWS));
        (0..self.n_rows()).step_by(BAND_ROWS).map(|start| {
            let range = start * self.width_px..(start + BAND_ROWS).min(self.n_rows()) * self.width_px;
            let planes = self.planes.iter().map(|plane| plane.slice(range.clone()));
            let first_row = self.first_row + start;
            (first_row / BAND_ROWS, Rows { first_row, width_px: self.width_px, planes: planes.collect() })
        })
    }
}

impl<'a> RowSamples<'a> {
    /// A part of the values, by index.
    pub fn slice(self, range: Range<usize>) -> RowSamples<'a> {
        match self {
            RowSamples::F32(values) => RowSamples::F32(&values[range]),
            RowSamples::F64(values) => RowSamples::F64(&values[range]),
            RowSamples::U32(values) => RowSamples::U32(&values[range]),
        }
    }

    /// Number of values.
    pub fn len(&self) -> usize {
        match self {
            RowSamples::F32(values) => values.len(),
            RowSamples::F64(values) => values.len(),
            RowSamples::U32(values) => values.len(),
        }
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The value at an index, widened; u32 and f32 are exact in f64.
    #[inline]
    pub fn get(&self, index: usize) -> f64 {
        match self {
            RowSamples::F32(values) => f64::from(values[index]),
            RowSamples::F64(values) => values[index],
            RowSamples::U32(values) => f64::from(values[index]),
        }
    }
}

impl RowsMut<'_> {
    /// The first of the rows, counted from the top of the data window.
    pub fn first_row(&self) -> usize {
        self.first_row
    }

    /// Writes a rectangle of pixels, row after row from the top, one value for each plane: `row` is counted from the
    /// first of these rows, `column` from the left of the data window. F32 planes round, U32 planes are left alone.
    pub fn put<const N: usize>(&mut self, column: usize, row: usize, width_px: usize, pixels: &[[f64; N]]) {
        for (channel, plane) in self.planes.iter_mut().enumerate().take(N) {
            for (index, pixels) in pixels.chunks_exact(width_px).enumerate() {
                let start = (row + index) * self.width_px + column;
                match plane {
                    RowSamplesMut::F32(values) => {
                        for (value, pixel) in values[start..start + width_px].iter_mut().zip(pixels) {
                            *value = pixel[channel] as f32;
                        }
                    }
                    RowSamplesMut::F64(values) => {
                        for (value, pixel) in values[start..start + width_px].iter_mut().zip(pixels) {
                            *value = pixel[channel];
                        }
                    }
                    RowSamplesMut::U32(_) => {}
                }
            }
        }
    }

    /// Writes a rectangle of pixels into all planes from `first_plane` on: pixel after pixel a value for each of them. F32
    /// planes round, U32 planes hold whole numbers.
    pub fn put_planes(&mut self, first_plane: usize, column: usize, row: usize, width_px: usize, values: &[f64]) {
        let planes = &mut self.planes[first_plane..];
        let n_planes = planes.len();
        for (index, plane) in planes.iter_mut().enumerate() {
            for (line, pixels) in values.chunks_exact(width_px * n_planes).enumerate() {
                let start = (row + line) * self.width_px + column;
                let values = pixels.iter().skip(index).step_by(n_planes);
                match plane {
                    RowSamplesMut::F32(row) => row[start..].iter_mut().zip(values).for_each(|(to, &v)| *to = v as f32),
                    RowSamplesMut::F64(row) => row[start..].iter_mut().zip(values).for_each(|(to, &v)| *to = v),
                    RowSamplesMut::U32(row) => row[start..].iter_mut().zip(values).for_each(|(to, &v)| *to = v as u32),
                }
            }
        }
    }

    /// The rows as they are now.
    pub fn as_rows(&self) -> Rows<'_> {
        let planes = self.planes.iter().map(|plane| match plane {
            RowSamplesMut::F32(values) => RowSamples::F32(values),
            RowSamplesMut::F64(values) => RowSamples::F64(values),
            RowSamplesMut::U32(values) => RowSamples::U32(values),
        });
        Rows { first_row: self.first_row, width_px: self.width_px, planes: planes.collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::Region;

    fn film(height_px: u32) -> Film {
        let region = Region::whole(3, height_px);
        let values = (0..region.n_pixels()).map(|index| index as f32).collect();
        let planes = vec![Plane::color("Y", Samples::F32(values))];
        Film { width_px: 3, height_px, data_window: region, planes }
    }

    #[test]
    fn pieces_and_bands_cover_every_row_once_and_in_order() {
        for height_px in [1, 15, 16, 17, 40] {
            let mut film = film(height_px);
            let copy = film.clone();
            let mut next = 0;
            for piece in film.split_rows_mut(32) {
                for (band, rows) in piece.as_rows().bands() {
                    assert_eq!((band, rows.first_row), (next, next * BAND_ROWS));
                    let same = copy.rows(rows.first_row, BAND_ROWS);
                    assert_eq!(rows.n_rows(), same.n_rows());
                    assert!((0..rows.planes[0].len()).all(|i| rows.planes[0].get(i) == same.planes[0].get(i)));
                    next += 1;
                }
            }
            assert_eq!(next, (height_px as usize).div_ceil(BAND_ROWS));
        }
    }

    #[test]
    fn a_rectangle_lands_where_it_belongs() {
        let mut film = film(40);
        film.split_rows_mut(16)[1].put(1, 2, 2, &[[-1.0], [-2.0], [-3.0], [-4.0]]);
        let Samples::F32(values) = &film.planes[0].samples else { unreachable!() };
        let at = |x: usize, y: usize| values[y * 3 + x];
        assert_eq!([at(1, 18), at(2, 18), at(1, 19), at(2, 19)], [-1.0, -2.0, -3.0, -4.0]);
        assert_eq!((at(0, 18), at(0, 19), at(1, 20)), (54.0, 57.0, 61.0));
    }
}
