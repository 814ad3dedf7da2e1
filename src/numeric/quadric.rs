//! Ray against general quadric in its local frame: exact decision, certified parameter.

mod known;

use glam::{DMat4, DVec3};

use super::affine::ExactForm;
use super::clip::Clip;
use super::double::{Double, Double3, is_tame, is_tame3, two_product};
use super::dyadic::Dyadic;
use super::prepared::PreparedRay;
use super::quadratic::{ExactCoefficients, first, roots_inside};
use super::ratio::{Bounded, Parameter};
use super::tally::count_exact_test;
use known::{Coefficients, Known, known};

/// The points x with (x−c)ᵀQ(x−c) + 2 g·(x−c) + s = 0, for a centre c of the surface's own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quadric {
    /// c, the origin of the local frame, in world space.
    pub center: DVec3,
    /// Diagonal of the symmetric Q: coefficients of x², y², z².
    pub diagonal: DVec3,
    /// Off-diagonal of Q as (yz, xz, xy), each half of the coefficient of the product.
    pub off_diagonal: DVec3,
    /// g, half of the linear coefficients, in the local frame.
    pub linear: DVec3,
    /// s, the constant term, in the local frame.
    pub constant: f64,
    /// Whether all of it is tame in the sense of [`is_tame`].
    pub tame: bool,
}

impl Quadric {
    /// The surface XᵀAX = 0 of a finite symmetric matrix, moved to a frame around its centre. The move is made in
    /// exact arithmetic and rounded once per term.
    pub fn from_matrix(a: DMat4) -> Quadric {
        let columns = [a.x_axis, a.y_axis, a.z_axis, a.w_axis];
        Quadric::from_form(&columns.map(|column| column.to_array().map(Dyadic::new)))
    }

    /// [`Quadric::from_matrix`] of a form whose entries need not be f64, but are within its range.
    pub fn from_form(a: &ExactForm) -> Quadric {
        let rounded = |i: usize, j: usize| a[i][j].to_f64();
        let diagonal = DVec3::new(rounded(0, 0), rounded(1, 1), rounded(2, 2));
        let off_diagonal = DVec3::new(rounded(2, 1), rounded(2, 0), rounded(1, 0));
        let linear = DVec3::new(rounded(3, 0), rounded(3, 1), rounded(3, 2));
        let center = frame_center(diagonal, off_diagonal, linear);

        // Q c + g and s + 2 g·c + cᵀQc = s + c·(g + (Qc + g)).
        let c = Dyadic::vector(center);
        let g = &a[3];
        let row = |i: usize| [0, 1, 2].map(|j| a[i][j].mul(&c[j])).iter().fold(g[i].clone(), |sum, x| sum.add(x));
        let moved = [row(0), row(1), row(2)];
        let both = [0, 1, 2].map(|i| g[i].add(&moved[i]));
        let constant = a[3][3].add(&Dyadic::dot(&c, &both)).to_f64();
        let linear = DVec3::from_array(moved.map(|term| term.to_f64()));
        Quadric::around(center, diagonal, off_diagonal, linear, constant)
    }

    /// The surface of these coefficients in the frame around a centre; none may be NaN or infinite.
    pub fn around(center: DVec3, diagonal: DVec3, off_diagonal: DVec3, linear: DVec3, constant: f64) -> Quadric {
        let tame = [center, diagonal, off_diagonal, linear].into_iter().all(is_tame3) && is_tame(constant);
        Quadric { center, diagonal, off_diagonal, linear, constant, tame }
    }

    /// Whether no coefficient is NaN or infinite.
    pub fn is_finite(&self) -> bool {
        [self.center, self.diagonal, self.off_diagonal, self.linear].iter().all(|v| v.is_finite())
            && self.constant.is_finite()
    }

    /// Q·v.
    #[inline(always)]
    pub fn times(&self, v: DVec3) -> DVec3 {
        let (d, o) = (self.diagonal, self.off_diagonal);
        DVec3::new(
            d.x * v.x + o.z * v.y + o.y * v.z,
            o.z * v.x + d.y * v.y + o.x * v.z,
            o.y * v.x + o.x * v.y + d.z * v.z,
        )
    }

    /// The same surface with the magnitudes of all coefficients, for error bounds.
    #[inline(always)]
    fn magnitudes(&self) -> Quadric {
        Quadric {
            diagonal: self.diagonal.abs(),
            off_diagonal: self.off_diagonal.abs(),
            linear: self.linear.abs(),
            constant: self.constant.abs(),
            ..*self
        }
    }

    /// The summed magnitudes of all terms of the surface's value at a point relative to the centre: what its rounding
    /// is a share of.
    #[inline]
    pub fn value_size(&self, h: DVec3) -> f64 {
        let (magnitudes, h) = (self.magnitudes(), h.abs());
        h.dot(magnitudes.half_gradient(h) + magnitudes.linear) + magnitudes.constant
    }

    /// An upper bound of the norm of Q: how much half of the gradient changes per length.
    #[inline]
    pub fn bend(&self) -> f64 {
        self.diagonal.abs().max_element() + self.off_diagonal.abs().element_sum()
    }

    /// Half of the gradient at a point relative to the centre.
    #[inline(always)]
    pub fn half_gradient(&self, h: DVec3) -> DVec3 {
        self.times(h) + self.linear
    }
}

/// Entry (i, j) of Q.
fn entry(diagonal: DVec3, off_diagonal: DVec3, i: usize, j: usize) -> f64 {
    if i == j { diagonal[i] } else { off_diagonal[3 - i - j] }
}

/// A point near which the surface is best described: the centre where there is one, else the point of smallest norm
/// that makes the gradient smallest. Any point is right, since the move is exact; a good one keeps the terms small.
fn frame_center(diagonal: DVec3, off_diagonal: DVec3, linear: DVec3) -> DVec3 {
    // Scale Q to 1, then solve (Q² + εI) c = −Q g: the pseudo-inverse, with directions that Q hardly bends left alone.
    let scale = diagonal.abs().max_element().max(off_diagonal.abs().max_element());
    if scale == 0.0 {
        return DVec3::ZERO;
    }
    let column = |j: usize| DVec3::from_array([0, 1, 2].map(|i| entry(diagonal, off_diagonal, i, j) / scale));
    let q = glam::DMat3::from_cols(column(0), column(1), column(2));
    let damping = glam::DMat3::from_diagonal(DVec3::splat(FRAME_DAMPING));
    let center = -((q * q + damping).inverse() * (q * (linear / scale)));
    // f32 precision is plenty, and keeps products with the centre short.
    let center = center.as_vec3().as_dvec3();
    if center.is_finite() { center } else { DVec3::ZERO }
}

/// Squared relative curvature below which a direction counts as straight when the frame is chosen. It decides how
/// well terms are conditioned, never whether a ray hits: 2⁻⁴⁰, so that the inverse keeps a dozen bits.
const FRAME_DAMPING: f64 = 1.0 / (1u64 << 40) as f64;

/// The first parameter in the ray's open interval at which the ray meets the surface, inside the clip if there is one. A
/// tangent meets it; a ray that lies in the surface does not.
#[inline(always)]
pub fn intersect(ray: &PreparedRay, quadric: &Quadric, clip: Option<&Clip>) -> Option<Parameter> {
    let mut coefficients = [Bounded::UNKNOWN; 3];
    if ray.tame && quadric.tame {
        let sizes = Coefficients::sizes(ray, quadric);
        if known(ray, quadric, &sizes) == Known::Miss {
            return None;
        }
        coefficients = double_coefficients(ray, quadric, &sizes);
    }
    let roots = roots_inside(coefficients, ray.t_min, ray.t_max, || exact_coefficients(ray, quadric));
    match clip {
        None => first(roots),
        Some(clip) => clip.first_inside(ray, roots, || exact_coefficients(ray, quadric)),
    }
}

/// Whether [`intersect`] finds a hit.
#[inline(always)]
pub fn occludes(ray: &PreparedRay, quadric: &Quadric, clip: Option<&Clip>) -> bool {
    if clip.is_none() && ray.tame && quadric.tame {
        match known(ray, quadric, &Coefficients::sizes(ray, quadric)) {
            Known::Miss => return false,
            Known::Hit => return true,
            Known::Open => {}
        }
    }
    intersect(ray, quadric, clip).is_some()
}

/// b² − ac as the f64 tier has it, and its bound: for the search for the worst case.
pub(crate) fn discriminant(ray: &PreparedRay, quadric: &Quadric) -> (f64, f64) {
    known::discriminant(&Coefficients::rounded(ray, quadric), &Coefficients::sizes(ray, quadric))
}

/// The coefficients of the double-double tier with their bounds: for the search for the worst case.
pub(crate) fn bounded_coefficients(ray: &PreparedRay, quadric: &Quadric) -> [Bounded; 3] {
    double_coefficients(ray, quadric, &Coefficients::sizes(ray, quadric))
}

/// The double-double tier: 15u² for dᵀQd, 20u² for d·(Qh+g), 29u² for the constant, each of the summed magnitudes.
#[inline(always)]
fn double_coefficients(ray: &PreparedRay, quadric: &Quadric, sizes: &Coefficients) -> [Bounded; 3] {
    let d = ray.direction;
    let h = Double3::difference(ray.origin, quadric.center);
    let linear = Double3::new(quadric.linear);
    let gradient = times_double(quadric, &h).add(&linear);
    let c = gradient.add(&linear).dot(&h) + Double::new(quadric.constant);
    [
        Bounded::new(times_f64(quadric, d).dot_f64(d), 15.0, sizes.a),
        Bounded::new(gradient.dot_f64(d), 20.0, sizes.b),
        Bounded::new(c, 29.0, sizes.c),
    ]
}

/// Q·v in double-double.
#[inline(always)]
fn times_double(quadric: &Quadric, v: &Double3) -> Double3 {
    let [x, y, z] = v.xyz;
    let row = |p: f64, q: f64, r: f64| x.scale(p) + y.scale(q) + z.scale(r);
    let (d, o) = (quadric.diagonal, quadric.off_diagonal);
    Double3 { xyz: [row(d.x, o.z, o.y), row(o.z, d.y, o.x), row(o.y, o.x, d.z)] }
}

/// Q·v of an f64 vector in double-double.
#[inline(always)]
fn times_f64(quadric: &Quadric, v: DVec3) -> Double3 {
    let row = |p: f64, q: f64, r: f64| two_product(p, v.x) + two_product(q, v.y) + two_product(r, v.z);
    let (d, o) = (quadric.diagonal, quadric.off_diagonal);
    Double3 { xyz: [row(d.x, o.z, o.y), row(o.z, d.y, o.x), row(o.y, o.x, d.z)] }
}

#[cold]
fn exact_coefficients(ray: &PreparedRay, quadric: &Quadric) -> ExactCoefficients {
    count_exact_test();
    let d = Dyadic::vector(ray.direction);
    let h = Dyadic::difference(&Dyadic::vector(ray.origin), &Dyadic::vector(quadric.center));
    let g = Dyadic::vector(quadric.linear);
    let row = |i: usize| [0, 1, 2].map(|j| Dyadic::new(entry(quadric.diagonal, quadric.off_diagonal, i, j)));
    let rows = [row(0), row(1), row(2)];
    let times = |v: &[Dyadic; 3]| rows.each_ref().map(|row| Dyadic::dot(row, v));
    let sum = |p: &[Dyadic; 3], q: &[Dyadic; 3]| [0, 1, 2].map(|i| p[i].add(&q[i]));
    let gradient = sum(&times(&h), &g);
    let c = Dyadic::dot(&h, &sum(&gradient, &g)).add(&Dyadic::new(quadric.constant));
    [Dyadic::dot(&d, &times(&d)), Dyadic::dot(&d, &gradient), c]
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DVec4, dvec3};

    fn ray(origin: DVec3, direction: DVec3) -> PreparedRay {
        PreparedRay::new(origin, direction, 0.0, f64::INFINITY).unwrap()
    }

    fn t_of(ray: &PreparedRay, quadric: &Quadric) -> Option<f64> {
        intersect(ray, quadric, None).map(|hit| hit.t)
    }

    /// A diagonal quadric with a constant, moved.
    fn diagonal(q: [f64; 3], constant: f64, to: DVec3) -> Quadric {
        let d = DVec3::from_array(q);
        let g = -d * to;
        let w = g.extend(constant + (d * to * to).element_sum());
        let axis = |i: usize| {
            let mut column = DVec4::ZERO;
            column[i] = d[i];
            column.w = g[i];
            column
        };
        Quadric::from_matrix(DMat4::from_cols(axis(0), axis(1), axis(2), w))
    }

    #[test]
    fn the_local_frame_sits_in_the_centre_and_forgets_the_offset() {
        let near = diagonal([1.0, 4.0, 9.0], -1.0, DVec3::ZERO);
        let far = diagonal([1.0, 4.0, 9.0], -1.0, dvec3(1024.0, -512.0, 2048.0));
        assert_eq!(far.center, dvec3(1024.0, -512.0, 2048.0));
        assert_eq!(Quadric { center: DVec3::ZERO, ..far }, near);
    }

    #[test]
    fn a_plane_a_cylinder_along_its_axis_and_a_paraboloid_need_no_threshold() {
        // z = 0 as a quadric: 2·(1/2)·z.
        let plane = Quadric::from_matrix(DMat4::from_cols(DVec4::ZERO, DVec4::ZERO, DVec4::W * 0.5, DVec4::Z * 0.5));
        assert_eq!(t_of(&ray(dvec3(3.0, 4.0, 5.0), -DVec3::Z), &plane), Some(5.0));
        assert_eq!(t_of(&ray(dvec3(3.0, 4.0, 5.0), DVec3::Z), &plane), None);
        assert_eq!(t_of(&ray(dvec3(3.0, 4.0, 0.0), DVec3::X), &plane), None);

        let cylinder = diagonal([1.0, 1.0, 0.0], -1.0, DVec3::ZERO);
        assert_eq!(t_of(&ray(dvec3(0.5, 0.0, 9.0), -DVec3::Z), &cylinder), None);
        assert_eq!(t_of(&ray(dvec3(-3.0, 0.0, 9.0), DVec3::X), &cylinder), Some(2.0));
        assert_eq!(t_of(&ray(dvec3(0.0, 0.0, 9.0), DVec3::X), &cylinder), Some(1.0));

        // z = x² + y².
        let bowl = Quadric::from_matrix(DMat4::from_cols(DVec4::X, DVec4::Y, DVec4::W * -0.5, DVec4::Z * -0.5));
        assert_eq!(t_of(&ray(dvec3(1.0, 2.0, 9.0), -DVec3::Z), &bowl), Some(4.0));
        assert_eq!(t_of(&ray(dvec3(1.0, 2.0, 1.0), DVec3::Z), &bowl), Some(4.0));
    }

    #[test]
    fn what_the_first_tier_knows_is_what_exact_arithmetic_says() {
        let mut state = 11_u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        };
        let (mut n_missed, mut n_hit, mut n_open) = (0, 0, 0);
        for i in 0..60_000 {
            let q = [[1.0, 4.0, 9.0], [1.0, 1.0, 0.0], [1.0, 1.0, -1.0], [0.0, 0.0, 0.0]][i % 4];
            let mut surface = diagonal(q, [-1.0, 0.0, 0.25][i % 3], dvec3(random(), random(), random()));
            if q == [0.0; 3] {
                surface.linear = dvec3(random(), random(), random());
            }
            let (origin, direction) = (3.0 * dvec3(random(), random(), random()), dvec3(random(), random(), random()));
            let endless = PreparedRay::new(origin, direction, 0.0, f64::INFINITY).unwrap();
            let Some(t) = t_of(&endless, &surface) else { continue };
            // Ends at the root, one step from it, and far from it.
            for (t_min, t_max) in
                [(0.0, t), (0.0, t.next_up()), (t, 2.0 * t), (t.next_down(), 9.0 * t), (0.0, 0.5 * t), (0.0, 2.0 * t)]
            {
                let ray = PreparedRay { t_min, t_max, ..endless };
                let exact = roots_inside([Bounded::UNKNOWN; 3], t_min, t_max, || exact_coefficients(&ray, &surface));
                let is_hit = first(exact).is_some();
                match known(&ray, &surface, &Coefficients::sizes(&ray, &surface)) {
                    Known::Miss => {
                        assert!(!is_hit, "{ray:?} {surface:?}");
                        n_missed += 1;
                    }
                    Known::Hit => {
                        assert!(is_hit, "{ray:?} {surface:?}");
                        n_hit += 1;
                    }
                    Known::Open => n_open += 1,
                }
                assert_eq!(occludes(&ray, &surface, None), is_hit, "{ray:?} {surface:?}");
            }
        }
        // Ends that are roots, four of six, leave the most open.
        assert!(n_missed > 10_000 && n_hit > 10_000 && n_open > 10_000, "{n_missed} {n_hit} {n_open}");
    }

    #[test]
    fn a_cone_is_hit_in_its_apex() {
        let cone = diagonal([1.0, 1.0, -1.0], 0.0, DVec3::ZERO);
        assert_eq!(t_of(&ray(dvec3(0.0, 0.0, 3.0), -DVec3::Z), &cone), Some(3.0));
        assert_eq!(t_of(&ray(dvec3(-2.0, 0.0, 0.0), DVec3::X), &cone), Some(2.0));
        // Along a line of the cone: inside the surface everywhere, a miss by convention.
        assert_eq!(t_of(&ray(dvec3(-2.0, 0.0, 2.0), dvec3(1.0, 0.0, -1.0)), &cone), None);
    }
}
