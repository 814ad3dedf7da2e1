//! Cells of a pixel: one sample in each is stratified sampling.

/// A part of the pixel, in pixel units; all cells of a pattern have the same area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// Left edge.
    pub x: f64,
    /// Upper edge.
    pub y: f64,
    /// Width.
    pub width: f64,
    /// Height.
    pub height: f64,
}

impl Cell {
    /// A point of the cell by where it is in the unit square.
    #[inline]
    pub fn at(&self, (u, v): (f64, f64)) -> (f64, f64) {
        (self.x + u * self.width, self.y + v * self.height)
    }
}

/// `n` cells of equal area, as square as `n` allows: rows from top to bottom, the last ones with fewer and wider cells.
pub fn cells(n: u32) -> Vec<Cell> {
    let n_rows = (1..=n).find(|rows| u64::from(*rows) * u64::from(*rows) >= u64::from(n)).unwrap_or(1);
    let n_rows = if n.is_multiple_of(n_rows) { n_rows } else { n.div_ceil(n_rows) };
    let (base, longer) = (n / n_rows, n % n_rows);
    let mut cells = Vec::with_capacity(n as usize);
    let mut above = 0;
    for row in 0..n_rows {
        let n_columns = base + u32::from(row < longer);
        let (y, height) = (f64::from(above) / f64::from(n), f64::from(n_columns) / f64::from(n));
        let width = 1.0 / f64::from(n_columns);
        cells.extend((0..n_columns).map(|column| Cell { x: f64::from(column) * width, y, width, height }));
        above += n_columns;
    }
    cells
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn four_grid_samples_are_the_originals() {
        let cells = cells(4);
        let centers: Vec<_> = cells.iter().map(|c| (c.x + 0.5 * c.width, c.y + 0.5 * c.height)).collect();
        assert_eq!(centers, [(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)]);
    }

    #[test]
    fn cells_of_any_number_tile_the_pixel_with_equal_areas() {
        for n in 1..200 {
            let cells = cells(n);
            assert_eq!(cells.len(), n as usize);
            let share = 1.0 / f64::from(n);
            for cell in &cells {
                assert!((cell.width * cell.height - share).abs() < 1e-15, "{n}: {cell:?}");
                assert!(cell.x + cell.width <= 1.0 + 1e-15 && cell.y + cell.height <= 1.0 + 1e-15);
            }
            let aspect = cells[0].width / cells[0].height;
            assert!(n < 3 || (0.3..3.5).contains(&aspect), "{n}: {aspect}");
        }
    }
}
