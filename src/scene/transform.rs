//! Where an object stands: `scale`, `rotate` and `translate`, or `world_from_object`.

use glam::{DMat3, DMat4, DVec3};

use super::desc::{Rows4, Spanned};
use super::toml::Table;
use super::validate::{COORDINATE, ENTRY, is_certainly_regular};
use crate::error::{Place, Problem};
use crate::numeric::clip::Clip;
use crate::numeric::quadric::Quadric;
use crate::numeric::{U, affine};

/// An affine map from an object's coordinates to the world's: x ↦ L·x + t, L regular.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transform {
    /// L.
    pub linear: DMat3,
    /// t, in world units.
    pub translation: DVec3,
    /// L⁻¹, each entry rounded once; exact for turns by right angles, reflections, and scales by powers of two.
    pub inverse: DMat3,
    /// By how much lengths grow, where they grow alike in all directions.
    pub similarity: Option<f64>,
    /// Whether it mirrors: the determinant is negative.
    pub mirrors: bool,
}

impl Default for Transform {
    fn default() -> Transform {
        Transform::IDENTITY
    }
}

impl Transform {
    /// Leaves everything where it is.
    pub const IDENTITY: Transform = Transform {
        linear: DMat3::IDENTITY,
        translation: DVec3::ZERO,
        inverse: DMat3::IDENTITY,
        similarity: Some(1.0),
        mirrors: false,
    };

    /// An affine map; `None` when `linear` is not certainly regular, or its inverse is beyond the range of f64.
    pub fn new(linear: DMat3, translation: DVec3) -> Option<Transform> {
        if !(linear.is_finite() && translation.is_finite() && is_certainly_regular(linear)) {
            return None;
        }
        let inverse = affine::inverse(linear).filter(|inverse| inverse.is_finite())?;
        let mirrors = affine::orientation(linear) < 0;
        Some(Transform { linear, translation, inverse, similarity: similarity(linear), mirrors })
    }

    /// Scale, then rotation about x, y and z in this order, then translation. No component of `scale` is zero.
    pub fn from_parts(scale: DVec3, rotate_degrees: DVec3, translate: DVec3) -> Option<Transform> {
        let turn = rotation(rotate_degrees);
        let linear = DMat3::from_cols(turn.x_axis * scale.x, turn.y_axis * scale.y, turn.z_axis * scale.z);
        let alike = scale.x.abs() == scale.y.abs() && scale.y.abs() == scale.z.abs();
        let similarity = alike.then_some(scale.x.abs());
        Transform::new(linear, translate).map(|transform| Transform { similarity, ..transform })
    }

    /// The map whose matrix has these rows, as mathematics writes them: the translation is the last column.
    ///
    /// # Errors
    /// When the last row is not 0, 0, 0, 1, or the matrix is not invertible.
    pub fn from_rows(rows: &Rows4) -> Result<Transform, Box<Problem>> {
        let [x, y, z, last] = *rows;
        if last != [0.0, 0.0, 0.0, 1.0] {
            return Err(Problem::new(Place::default(), "not an affine transform: the last row is wrong")
                .found(format!("{}, {}, {}, {}", last[0], last[1], last[2], last[3]))
                .expected("0, 0, 0, 1")
                .help("rows are those of the matrix, so the translation is the last number of the first three rows")
                .into());
        }
        let column = |i: usize| DVec3::new(x[i], y[i], z[i]);
        let linear = DMat3::from_cols(column(0), column(1), column(2));
        Transform::new(linear, column(3)).ok_or_else(|| {
            Problem::new(Place::default(), "not invertible")
                .found("a singular matrix")
                .expected("a matrix with three independent columns")
                .into()
        })
    }

    /// Whether it leaves everything where it is.
    pub fn is_identity(&self) -> bool {
        self.linear == DMat3::IDENTITY && self.translation == DVec3::ZERO
    }

    /// Where a point comes to lie, in f64: within 4u of the magnitudes of what is summed.
    #[inline]
    pub fn point(&self, p: DVec3) -> DVec3 {
        self.linear * p + self.translation
    }

    /// What becomes of the normal of a surface, of any length: the inverse transpose, so that outward stays outward.
    #[inline]
    pub fn normal(&self, n: DVec3) -> DVec3 {
        self.inverse.transpose() * n
    }

    /// First `inner`, then this one; `None` when that is beyond the range of f64.
    pub fn of(&self, inner: &Transform) -> Option<Transform> {
        let both = self.similarity.zip(inner.similarity).map(|(a, b)| a * b);
        let transform = Transform::new(self.linear * inner.linear, self.point(inner.translation))?;
        Some(Transform { similarity: both.or(transform.similarity), ..transform })
    }

    /// The map as a matrix.
    pub fn matrix(&self) -> DMat4 {
        let DMat3 { x_axis, y_axis, z_axis } = self.linear;
        DMat4::from_cols(x_axis.extend(0.0), y_axis.extend(0.0), z_axis.extend(0.0), self.translation.extend(1.0))
    }

    /// The surface XᵀAX = 0 of the object, in a frame of the world. It is carried and moved to its frame exactly, and rounded
    /// once per term; `None` when that is beyond the range of f64.
    pub fn quadric(&self, a: DMat4) -> Option<Quadric> {
        let surface = match self.is_identity() {
            true => Quadric::from_matrix(a),
            false => Quadric::from_form(&affine::carried(a, self.linear, self.translation)),
        };
        let Quadric { center, diagonal, off_diagonal, linear, constant, tame: _ } = surface;
        let vectors = [center, diagonal, off_diagonal, linear];
        (vectors.iter().all(|v| v.is_finite()) && constant.is_finite()).then_some(surface)
    }

    /// A clip of the object as one of the world: its rows are carried by the inverse, its ends stay; `None` when that is
    /// beyond the range of f64.
    pub fn clip(&self, clip: &Clip) -> Option<Clip> {
        let (center, rows) = (self.point(clip.center), clip.rows.map(|row| self.normal(row)));
        let finite = center.is_finite() && rows.iter().all(|row| row.is_finite());
        finite.then(|| Clip::new(center, rows, clip.lo, clip.hi))
    }
}

/// The factor of a matrix that is a turn or a reflection times a number, as well as its entries can say.
///
/// With entries within u of such a matrix, an entry of LᵀL is off by 2u of each of three products, which sum to at most s²,
/// and by 3u for its own rounding; twice that decides. What is declined is carried as an ellipsoid, which is right as well.
fn similarity(linear: DMat3) -> Option<f64> {
    let squares = linear.transpose() * linear;
    let mean = (squares.x_axis.x + squares.y_axis.y + squares.z_axis.z) / 3.0;
    let off = (squares - DMat3::from_diagonal(DVec3::splat(mean))).to_cols_array();
    let is_similar = mean > 0.0 && off.into_iter().all(|entry| entry.abs() <= 10.0 * U * mean);
    is_similar.then(|| mean.sqrt())
}

/// The turn about x, then y, then z, in degrees, counter-clockwise seen from the axis' tip. Exact for right angles.
fn rotation(degrees: DVec3) -> DMat3 {
    let about = |axis: DVec3, degrees: f64| {
        let quarters = degrees / 90.0;
        let [s, c] = if quarters == quarters.round() && quarters.abs() < 1e15 {
            [[0.0, 1.0], [1.0, 0.0], [0.0, -1.0], [-1.0, 0.0]][(quarters as i64).rem_euclid(4) as usize]
        } else {
            let (s, c) = libm::sincos((degrees % 360.0).to_radians());
            [s, c]
        };
        match (axis.x, axis.y) {
            (1.0, _) => DMat3::from_cols(DVec3::X, DVec3::new(0.0, c, s), DVec3::new(0.0, -s, c)),
            (_, 1.0) => DMat3::from_cols(DVec3::new(c, 0.0, -s), DVec3::Y, DVec3::new(s, 0.0, c)),
            _ => DMat3::from_cols(DVec3::new(c, s, 0.0), DVec3::new(-s, c, 0.0), DVec3::Z),
        }
    };
    about(DVec3::Z, degrees.z) * about(DVec3::Y, degrees.y) * about(DVec3::X, degrees.x)
}

/// Reads the keys of a transform; mistakes go to the report, and the identity stands for what is wrong or absent.
pub fn read(table: &mut Table<'_>) -> Transform {
    let scale = table.number_or_vec3("scale", &super::validate::NON_ZERO);
    let rotate = table.vec3("rotate", &COORDINATE);
    let translate = table.vec3("translate", &COORDINATE);
    let matrix = table.affine_rows("world_from_object", &ENTRY);
    let part = ["scale", "rotate", "translate"].into_iter().find(|key| table.has(key));
    match (table.has("world_from_object"), part) {
        (true, Some(part)) => {
            let what = "an object has either `world_from_object` or `scale`, `rotate` and `translate`, not both";
            table.mistake(part, Problem::new(Place::default(), what));
            Transform::IDENTITY
        }
        (true, None) => matrix.map_or(Transform::IDENTITY, |Spanned { value, .. }| {
            Transform::from_rows(&value).unwrap_or_else(|problem| {
                table.mistake("world_from_object", *problem);
                Transform::IDENTITY
            })
        }),
        (false, None) => Transform::IDENTITY,
        (false, Some(part)) => {
            let or = |value: Option<Spanned<DVec3>>, default| value.map_or(default, |value| value.value);
            let (scale, rotate) = (or(scale, DVec3::ONE), or(rotate, DVec3::ZERO));
            Transform::from_parts(scale, rotate, or(translate, DVec3::ZERO)).unwrap_or_else(|| {
                let problem = Problem::new(Place::default(), "this transform cannot be inverted in 64-bit floats");
                table.mistake(part, problem);
                Transform::IDENTITY
            })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::dvec3;

    #[test]
    fn right_angles_powers_of_two_and_representable_shifts_are_exact_both_ways() {
        for (x, y, z) in [(90.0, 0.0, 0.0), (0.0, -270.0, 180.0), (450.0, 90.0, -90.0)] {
            let scale = dvec3(2.0, -0.25, 8.0);
            let transform = Transform::from_parts(scale, dvec3(x, y, z), dvec3(0.5, -3.0, 7.0)).unwrap();
            assert_eq!(transform.inverse * transform.linear, DMat3::IDENTITY);
            assert_eq!(transform.linear * transform.inverse, DMat3::IDENTITY);
            assert!(transform.mirrors && transform.similarity.is_none());
            let p = dvec3(0.1f32.into(), 1.5, -3.25);
            assert_eq!(transform.inverse * (transform.point(p) - transform.translation), p);
        }
    }

    #[test]
    fn rotation_is_about_x_then_y_then_z() {
        let turn = |degrees: DVec3, p: DVec3| Transform::from_parts(DVec3::ONE, degrees, DVec3::ZERO).unwrap().point(p);
        assert_eq!(turn(dvec3(90.0, 0.0, 0.0), DVec3::Y), DVec3::Z);
        assert_eq!(turn(dvec3(0.0, 90.0, 0.0), DVec3::Z), DVec3::X);
        assert_eq!(turn(dvec3(0.0, 0.0, 90.0), DVec3::X), DVec3::Y);
        assert_eq!(turn(dvec3(90.0, 90.0, 0.0), DVec3::Y), DVec3::X);
        let by_glam = glam::DQuat::from_euler(glam::EulerRot::ZYX, 0.3f64, 0.2, 0.1) * dvec3(1.0, 2.0, 3.0);
        let own = turn(dvec3(0.1, 0.2, 0.3) * (180.0 / std::f64::consts::PI), dvec3(1.0, 2.0, 3.0));
        assert!(own.abs_diff_eq(by_glam, 1e-14), "{own} {by_glam}");
    }

    #[test]
    fn a_turned_matrix_is_a_similarity_and_a_sheared_one_is_not() {
        let turned = Transform::from_parts(DVec3::splat(-3.0), dvec3(20.0, 30.0, 40.0), DVec3::ONE).unwrap();
        assert_eq!((turned.similarity, turned.mirrors), (Some(3.0), true));
        let again = Transform::new(turned.linear, DVec3::ONE).unwrap();
        assert!((again.similarity.unwrap() - 3.0).abs() < 1e-14);
        let sheared = turned.linear + DMat3::from_cols(DVec3::ZERO, DVec3::X * 1e-14, DVec3::ZERO);
        assert_eq!(Transform::new(sheared, DVec3::ONE).unwrap().similarity, None);
    }

    #[test]
    fn matrices_are_read_by_rows_and_refused_when_singular_or_projective() {
        let rows = [[0.0, -1.0, 0.0, 5.0], [1.0, 0.0, 0.0, 6.0], [0.0, 0.0, 1.0, 7.0], [0.0, 0.0, 0.0, 1.0]];
        let transform = Transform::from_rows(&rows).unwrap();
        assert_eq!(transform.point(DVec3::X), dvec3(5.0, 7.0, 7.0));
        assert_eq!(transform.matrix().transform_point3(DVec3::X), dvec3(5.0, 7.0, 7.0));
        let mut wrong = rows;
        wrong[3][0] = 0.5;
        assert!(Transform::from_rows(&wrong).unwrap_err().what.contains("last row"));
        wrong = rows;
        wrong[0] = wrong[2];
        assert_eq!(Transform::from_rows(&wrong).unwrap_err().what, "not invertible");
    }

    #[test]
    fn quadrics_and_clips_are_carried_with_their_digits() {
        let ball = DMat4::from_diagonal(glam::DVec4::new(1.0, 1.0, 1.0, -1.0));
        let far = Transform::from_parts(DVec3::splat(2.0), DVec3::ZERO, DVec3::splat(1048576.5)).unwrap();
        let surface = far.quadric(ball).unwrap();
        assert_eq!(surface.center, DVec3::splat(1048576.5));
        assert_eq!((surface.diagonal, surface.constant, surface.linear), (DVec3::splat(0.25), -1.0, DVec3::ZERO));
        let clip = far.clip(&Clip::world_box(DVec3::NEG_ONE, DVec3::ONE)).unwrap();
        assert_eq!((clip.center, clip.rows[1]), (far.translation, DVec3::Y * 0.5));
        let both = far.of(&far).unwrap();
        assert_eq!(both.point(DVec3::ONE), far.point(far.point(DVec3::ONE)));
        assert_eq!(both.similarity, Some(4.0));
    }
}
