//! Affine maps in exact arithmetic: inverses rounded once, and quadratic forms carried along without rounding.

use glam::{DMat3, DMat4, DVec3};

use super::dyadic::Dyadic;

/// A square matrix by rows.
pub type ExactForm = [[Dyadic; 4]; 4];

fn exact_rows(m: DMat3) -> [[Dyadic; 3]; 3] {
    [m.row(0), m.row(1), m.row(2)].map(Dyadic::vector)
}

/// The adjugate, by columns, and the determinant.
fn adjugate(m: DMat3) -> ([[Dyadic; 3]; 3], Dyadic) {
    let [a, b, c] = exact_rows(m);
    let columns = [Dyadic::cross(&b, &c), Dyadic::cross(&c, &a), Dyadic::cross(&a, &b)];
    let determinant = Dyadic::dot(&a, &columns[0]);
    (columns, determinant)
}

/// The sign of the determinant of a finite matrix.
pub fn orientation(m: DMat3) -> i32 {
    adjugate(m).1.sign()
}

/// The inverse of a finite matrix, each entry rounded once; `None` for a singular one.
pub fn inverse(m: DMat3) -> Option<DMat3> {
    let (columns, determinant) = adjugate(m);
    let entry = |x: &Dyadic| x.guarded_quotient(&determinant).map(|x| x.to_f64());
    let column = |i: usize| Some(DVec3::new(entry(&columns[i][0])?, entry(&columns[i][1])?, entry(&columns[i][2])?));
    Some(DMat3::from_cols(column(0)?, column(1)?, column(2)?))
}

/// The symmetric form B with XᵀBX = k·YᵀAY, where X = (x, 1) is the image of Y = (y, 1) under x = L·y + t: the surface
/// YᵀAY = 0, carried along. k is a number from 1 to below 4, and 1 where the determinant of L is a power of two. All finite;
/// L regular.
///
/// With N = (adj L, −adj L·t; 0, det L), which is M⁻¹ times det L, B is NᵀAN times a power of four: no division, no rounding.
pub fn carried(a: DMat4, linear: DMat3, translation: DVec3) -> ExactForm {
    let (columns, determinant) = adjugate(linear);
    let t = Dyadic::vector(translation);
    let zero = || Dyadic::new(0.0);

    // Columns of N.
    let image = |i: usize| Dyadic::dot(&[0, 1, 2].map(|j| columns[j][i].clone()), &t).neg();
    let unit = |j: usize| [columns[j][0].clone(), columns[j][1].clone(), columns[j][2].clone(), zero()];
    let last = [image(0), image(1), image(2), determinant.clone()];
    let n = [unit(0), unit(1), unit(2), last];

    let a = [a.x_axis, a.y_axis, a.z_axis, a.w_axis].map(|column| column.to_array().map(Dyadic::new));
    let dot = |p: &[Dyadic; 4], q: &[Dyadic; 4]| (0..4).fold(zero(), |sum, i| sum.add(&p[i].mul(&q[i])));
    let bent = n.each_ref().map(|column| a.each_ref().map(|row| dot(row, column)));
    let shift = -2 * determinant.magnitude_exponent();
    n.each_ref().map(|column| bent.each_ref().map(|other| dot(column, other).times_power_of_two(shift)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::dvec3;

    #[test]
    fn inverses_of_turns_and_powers_of_two_are_exact_and_others_rounded_once() {
        let turn = DMat3::from_cols(DVec3::Y * 4.0, DVec3::NEG_X * 0.5, DVec3::Z);
        assert_eq!(inverse(turn).unwrap() * turn, DMat3::IDENTITY);
        let third = inverse(DMat3::from_diagonal(dvec3(3.0, 0.1, -7.0))).unwrap();
        assert_eq!(third, DMat3::from_diagonal(dvec3(1.0 / 3.0, 1.0 / 0.1, -1.0 / 7.0)));
        assert!(inverse(DMat3::from_diagonal(dvec3(1.0, 0.0, 1.0))).is_none());
        assert_eq!(orientation(DMat3::from_diagonal(dvec3(1e-200, -1e-200, 1.0))), -1);
    }

    #[test]
    fn a_ball_is_carried_to_an_ellipsoid() {
        let ball = DMat4::from_diagonal(glam::DVec4::new(1.0, 1.0, 1.0, -1.0));
        let form = carried(ball, DMat3::from_diagonal(dvec3(2.0, 4.0, -1.0)), dvec3(8.0, 0.0, 0.0));
        let rows = form.map(|row| row.map(|entry| entry.to_f64()));
        // (x − 8)²/4 + y²/16 + z² = 1.
        let expected = [[0.25, 0.0, 0.0, -2.0], [0.0, 0.0625, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [-2.0, 0.0, 0.0, 15.0]];
        assert_eq!(rows, expected);
    }
}
