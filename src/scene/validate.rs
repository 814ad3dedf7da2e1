//! What values must be: ranges of single numbers, and the checks of matrices and sizes.

use glam::{DMat3, DMat4, DVec3};

use super::desc::Rows4;
use crate::error::{Place, Problem};
use crate::numeric::U;

/// What a number must be, besides finite.
#[derive(Clone, Copy, Debug)]
pub struct NumberRule {
    /// The rule in words, for messages.
    pub expected: &'static str,
    /// The rule.
    pub holds: fn(f64) -> bool,
}

/// Images are stored as 32-bit floats, and boxes of the acceleration structure too: nothing may be beyond their range.
const F32_MAX: f64 = f32::MAX as f64;

/// A coordinate of a point or direction.
pub const COORDINATE: NumberRule =
    NumberRule { expected: "a number within ±3.4e38 (32-bit range)", holds: |x| x.abs() <= F32_MAX };
/// An entry of a matrix.
pub const ENTRY: NumberRule = COORDINATE;
/// A factor that an inverse exists for.
pub const NON_ZERO: NumberRule =
    NumberRule { expected: "a number other than 0, within ±3.4e38", holds: |x| x != 0.0 && x.abs() <= F32_MAX };
/// A length.
pub const POSITIVE: NumberRule =
    NumberRule { expected: "a number above 0, at most 3.4e38", holds: |x| x > 0.0 && x <= F32_MAX };
/// A colour component, a weight, an intensity, an exponent.
pub const NON_NEGATIVE: NumberRule =
    NumberRule { expected: "a number from 0 to 3.4e38", holds: |x| (0.0..=F32_MAX).contains(&x) };
/// A field of view in degrees.
pub const FOV: NumberRule = NumberRule { expected: "degrees above 0 and below 180", holds: |x| x > 0.0 && x < 180.0 };
/// The largest angle between the normals of two faces that is shaded smooth, in degrees.
pub const CREASE_ANGLE: NumberRule =
    NumberRule { expected: "degrees from 0 to 180", holds: |x| (0.0..=180.0).contains(&x) };
/// An exposure in stops.
pub const EXPOSURE: NumberRule = NumberRule { expected: "stops from -64 to 64", holds: |x| x.abs() <= 64.0 };

/// A radiance that becomes white.
pub const WHITE_POINT: NumberRule =
    NumberRule { expected: "a radiance from 1e-6 to 1e6", holds: |x| (1e-6..=1e6).contains(&x) };

/// Width and height of an image in pixels, and how messages put it.
pub const SIDE_PX: (std::ops::RangeInclusive<u64>, &str) = (1..=65_535, "a whole number of pixels from 1 to 65535");
/// Most pixels of an image.
pub const MAX_PIXELS: u64 = 1 << 31;

/// A problem that does not know its place yet.
fn problem(what: impl Into<String>) -> Problem {
    Problem::new(Place::default(), what)
}

/// Checks the number of pixels.
///
/// # Errors
/// Above [`MAX_PIXELS`].
pub fn image_size(width_px: u32, height_px: u32) -> Result<(), Box<Problem>> {
    let n_pixels = u64::from(width_px) * u64::from(height_px);
    if n_pixels > MAX_PIXELS {
        return Err(problem("the image is too large")
            .found(format!("{width_px} x {height_px} = {n_pixels} pixels"))
            .expected(format!("at most {MAX_PIXELS} pixels"))
            .into());
    }
    Ok(())
}

/// Camera→world from the `extrinsic` of a file, whose row i is column i of world→camera.
///
/// # Errors
/// When the matrix is not affine or not invertible.
pub fn world_from_camera(file_rows: &Rows4) -> Result<DMat4, Box<Problem>> {
    let last_column = file_rows.map(|row| row[3]);
    if last_column != [0.0, 0.0, 0.0, 1.0] {
        return Err(problem("not an affine transform: the last numbers of the 4 rows are wrong")
            .found(format!("{}, {}, {}, {}", last_column[0], last_column[1], last_column[2], last_column[3]))
            .expected("0, 0, 0, 1")
            .help("row i of the file is column i of the matrix, so the translation is the last row")
            .into());
    }
    let columns = file_rows.map(|[x, y, z, _]| DVec3::new(x, y, z));
    let singular =
        || problem("not invertible").found("a singular matrix").expected("a matrix with three independent axes");
    let linear = DMat3::from_cols(columns[0], columns[1], columns[2]);
    if !is_certainly_regular(linear) {
        return Err(singular().into());
    }
    let inverse = linear.inverse();
    let position = -(inverse * columns[3]);
    let frame = DMat4::from_cols(
        inverse.x_axis.extend(0.0),
        inverse.y_axis.extend(0.0),
        inverse.z_axis.extend(0.0),
        position.extend(1.0),
    );
    if frame.is_finite() { Ok(frame) } else { Err(singular().into()) }
}

/// Whether the rounding of the determinant cannot hide that it is zero.
///
/// Each of the six products of three entries is rounded at most five times on its way into the sum, so that the
/// computed determinant is off by at most γ₅ times the sum of their magnitudes (Higham 2002, section 3.1; γ₅ is
/// below 6u). The matrix is scaled by its largest entry first, so that nothing overflows.
pub(super) fn is_certainly_regular(m: DMat3) -> bool {
    let largest = m.to_cols_array().into_iter().fold(0.0, |largest: f64, entry| largest.max(entry.abs()));
    if largest == 0.0 {
        return false;
    }
    let [[a, b, c], [d, e, f], [g, h, i]] =
        DMat3::to_cols_array_2d(&m).map(|column| column.map(|entry| entry / largest));
    let det = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g);
    let magnitudes = [a * e * i, a * f * h, b * d * i, b * f * g, c * d * h, c * e * g];
    let sum: f64 = magnitudes.into_iter().map(f64::abs).sum();
    // One more rounding of each entry comes from the scaling: 3u per product.
    const BOUND: f64 = 9.0 * U;
    det.abs() > BOUND * sum
}

/// The symmetric matrix of a quadric, and the entries that were not symmetric in words, if any.
///
/// # Errors
/// When the matrix has no surface: all zero, or only the constant.
pub fn symmetric_quadric(file_rows: &Rows4) -> Result<(DMat4, Option<String>), Box<Problem>> {
    let mut rows = *file_rows;
    let mut unequal = Vec::new();
    for (row, column) in [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)] {
        let (upper, lower) = (file_rows[row][column], file_rows[column][row]);
        if upper != lower {
            let mean = 0.5 * upper + 0.5 * lower;
            (rows[row][column], rows[column][row]) = (mean, mean);
            unequal.push(format!("A[{row}][{column}] = {upper} and A[{column}][{row}] = {lower}"));
        }
    }
    let is_constant = rows.as_flattened().iter().take(15).all(|&entry| entry == 0.0);
    if is_constant {
        let found = if rows[3][3] == 0.0 { "all zero" } else { "only a constant: no point fulfils it" };
        return Err(problem("not a surface")
            .found(found)
            .expected("a coefficient other than A[3][3] that is not 0")
            .into());
    }
    Ok((DMat4::from_cols_array_2d(&rows), (!unequal.is_empty()).then(|| unequal.join(", "))))
}

/// Whether no real point lies on the quadric, found by elimination: XᵀAX keeps one sign when all pivots have it.
/// Rounding can hide it, but a warning is all that depends on it.
pub fn has_no_real_point(a: &DMat4) -> bool {
    let mut m = a.to_cols_array_2d();
    let sign = m[0][0].signum();
    for k in 0..4 {
        let pivot = m[k][k];
        if pivot * sign <= 0.0 || pivot.is_nan() {
            return false;
        }
        let pivot_row = m[k];
        for row in m.iter_mut().skip(k + 1) {
            let factor = row[k] / pivot;
            row.iter_mut().zip(pivot_row).for_each(|(entry, above)| *entry -= factor * above);
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    const IDENTITY: Rows4 = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]];

    #[test]
    fn the_identity_extrinsic_is_the_identity_frame_and_the_last_row_of_the_file_is_its_translation() {
        assert_eq!(world_from_camera(&IDENTITY).unwrap(), DMat4::IDENTITY);
        let mut moved = IDENTITY;
        moved[3] = [1.0, 2.0, 3.0, 1.0];
        let frame = world_from_camera(&moved).unwrap();
        assert_eq!(frame.w_axis, glam::DVec4::new(-1.0, -2.0, -3.0, 1.0));
    }

    #[test]
    fn a_quarter_turn_about_y_is_read_with_file_rows_as_matrix_columns() {
        // World +x comes to lie on camera −z: the first file row is the first column, the image of +x.
        let rows = [[0.0, 0.0, -1.0, 0.0], [0.0, 1.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]];
        let frame = world_from_camera(&rows).unwrap();
        let forward = frame * glam::DVec4::new(0.0, 0.0, -1.0, 0.0);
        assert_eq!(forward, glam::DVec4::X);
    }

    #[test]
    fn a_rank_two_matrix_is_singular_though_its_determinant_rounds_to_something() {
        let rows = |s: f64| {
            let r = |a: f64, b: f64, c: f64| [a * s / 3.0, b * s / 3.0, c * s / 3.0, 0.0];
            [r(1.0, 2.0, 3.0), r(4.0, 5.0, 6.0), r(7.0, 8.0, 9.0), [0.0, 0.0, 0.0, 1.0]]
        };
        for s in [1e-30, 0.1, 0.7, 1.0, 1e30] {
            assert!(world_from_camera(&rows(s)).is_err(), "{s}");
        }
        let small = IDENTITY.map(|row| row.map(|x| x * 1e-30));
        let scaled = [small[0], small[1], small[2], IDENTITY[3]];
        assert!(world_from_camera(&scaled).is_ok());
    }

    #[test]
    fn a_quadric_is_symmetrised_with_the_mean_and_names_the_entries() {
        let mut rows = IDENTITY;
        rows[0][3] = 2.0;
        let (a, unequal) = symmetric_quadric(&rows).unwrap();
        assert_eq!((a.w_axis.x, a.x_axis.w), (1.0, 1.0));
        assert_eq!(unequal.as_deref(), Some("A[0][3] = 2 and A[3][0] = 0"));
        rows[0][3] = 0.0;
        assert_eq!(symmetric_quadric(&rows).unwrap().1, None);
    }

    #[test]
    fn an_imaginary_ellipsoid_has_no_point_and_a_real_one_has() {
        let (imaginary, _) = symmetric_quadric(&IDENTITY).unwrap();
        assert!(has_no_real_point(&imaginary) && has_no_real_point(&-imaginary));
        let mut rows = IDENTITY;
        rows[3][3] = -1.0;
        assert!(!has_no_real_point(&symmetric_quadric(&rows).unwrap().0));
        rows[3][3] = 0.0;
        assert!(!has_no_real_point(&symmetric_quadric(&rows).unwrap().0), "a single point is a point");
    }
}
