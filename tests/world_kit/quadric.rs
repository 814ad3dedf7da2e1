//! Matrices of quadrics.

use glam::DMat4;

/// The symmetric matrix with XᵀAX = xx·x² + yy·y² + zz·z² + x·X + y·Y + z·Z + constant, without mixed terms.
pub fn quadric(squares: [f64; 3], linear: [f64; 3], constant: f64) -> DMat4 {
    let ([a, b, c], [g, h, i]) = (squares, linear.map(|term| 0.5 * term));
    DMat4::from_cols_array_2d(&[[a, 0.0, 0.0, g], [0.0, b, 0.0, h], [0.0, 0.0, c, i], [g, h, i, constant]])
}
