//! Row filters of PNG: bytes replaced by what a neighbour does not foretell.
//!
//! Source: W3C *Portable Network Graphics (PNG) Specification (Third Edition)*, section 9. One filter for all rows instead
//! of the best of five for each: rendered images are smooth, and choosing costs more than it gains
//! (`docs/BENCHMARKS.md`).

/// Filter types of section 9.2.
const SUB: u8 = 1;
const UP: u8 = 2;

/// Filters rows of `width_px` pixels of `pixel_bytes` each: the first by its left neighbours, so that it needs no row above,
/// the others by their upper ones. Every row gets the number of its filter in front.
pub(super) fn filter(rows: &[u8], width_px: usize, pixel_bytes: usize) -> Vec<u8> {
    let row_bytes = width_px * pixel_bytes;
    let mut filtered = Vec::with_capacity(rows.len() + rows.len() / row_bytes);
    let first = &rows[..row_bytes];
    filtered.push(SUB);
    filtered.extend_from_slice(&first[..pixel_bytes]);
    filtered.extend(first[pixel_bytes..].iter().zip(first).map(|(byte, left)| byte.wrapping_sub(*left)));
    for (above, row) in rows.chunks_exact(row_bytes).zip(rows.chunks_exact(row_bytes).skip(1)) {
        filtered.push(UP);
        filtered.extend(row.iter().zip(above).map(|(byte, above)| byte.wrapping_sub(*above)));
    }
    filtered
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_row_is_filtered_by_what_is_left_of_it_and_others_by_what_is_above() {
        let rows = [1, 2, 3, 4, 11, 22, 33, 44, 2, 3, 4, 5, 0, 0, 0, 0];
        let expected = [1, 1, 2, 3, 4, 10, 20, 30, 40, 2, 1, 1, 1, 1, 245, 234, 223, 212];
        assert_eq!(filter(&rows, 2, 4), expected);
        let expected = [1, 1, 2, 3, 4, 11, 22, 33, 44, 2, 1, 1, 1, 1, 245, 234, 223, 212];
        assert_eq!(filter(&rows, 1, 8), expected);
    }
}
