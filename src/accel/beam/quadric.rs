//! Beams against spheres and quadrics.
//!
//! A ray o + t·d meets (x−c)ᵀQ(x−c) + 2 g·(x−c) + s = 0 where A·t² + 2B·t + C = 0 with A = dᵀQd, B = d·q, q = Q(o−c) + g, and C the
//! form at o. There is a root where D = B² − A·C is not negative. Of a pyramid, d = m + u·a + v·b + w·k with |u|, |v|, |w| ≤ 1
//! and w = uv, so that D is a polynomial of second degree over a cube: where its upper bound is negative, no ray of the
//! pyramid meets the surface.

use glam::{DMat3, DVec3};

use super::Beam;
use crate::numeric::U;
use crate::numeric::clip::Clip;
use crate::numeric::interval::Interval;
use crate::numeric::quadric::Quadric;
use crate::world::Bounds;

/// What D may be off, in shares of the sum of all magnitudes that it is made of: 18 roundings make a coefficient, and less
/// than 40 more their largest sum.
const DISCRIMINANT_SLACK: f64 = 128.0 * U;

/// The sphere as a quadric.
pub fn ball(center: DVec3, radius: f64) -> Quadric {
    Quadric::around(center, DVec3::ONE, DVec3::ZERO, DVec3::ZERO, -(radius * radius))
}

impl Beam {
    /// Whether a surface may have a part in the pyramid, all of which is nearer than a depth. `bounds` is the box of what is
    /// there of it, if it has one, which is known to meet the pyramid, and `clip` what it is cut to.
    pub(super) fn holds_quadric(
        &self,
        surface: &Quadric,
        clip: Option<&Clip>,
        bounds: Option<Bounds>,
        depth: f64,
    ) -> bool {
        let [e0, e1, e2, e3] = self.edges;
        let directions = [e0 + e1 + e2 + e3, e1 - e0 + (e2 - e3), e3 - e0 + (e2 - e1), e0 - e1 + (e2 - e3)];
        let directions = directions.map(|direction| 0.25 * direction);
        let at_most = discriminant_at_most(surface, self.origin - surface.center, &directions);
        if at_most < 0.0 {
            return false;
        }
        // Where the depth of every d is 1, t is depth.
        let forms = Forms::new(surface, self.origin, &directions);
        let roots = forms.roots(surface, at_most);
        let farthest = roots.map_or(f64::INFINITY, |[first, second]| first.hi.max(second.hi));
        let is_clipped = |clip| roots.is_some_and(|roots| forms.is_clipped(&roots, self.origin, clip));
        if farthest <= 0.0 || clip.is_some_and(is_clipped) {
            return false;
        }
        depth == f64::INFINITY || farthest < depth || bounds.is_some_and(|bounds| self.is_nearer(&bounds, depth))
    }
}

fn matrix(surface: &Quadric) -> DMat3 {
    let (d, o) = (surface.diagonal, surface.off_diagonal);
    DMat3::from_cols(DVec3::new(d.x, o.z, o.y), DVec3::new(o.z, d.y, o.x), DVec3::new(o.y, o.x, d.z))
}

/// An upper bound of D over all directions of the pyramid; `from` is its apex in the frame of the surface.
fn discriminant_at_most(surface: &Quadric, from: DVec3, directions: &[DVec3; 4]) -> f64 {
    let (q, g) = (matrix(surface), surface.linear);
    let bent = q * from;
    let (gradient, constant) = (bent + g, from.dot(bent + 2.0 * g) + surface.constant);
    let coefficient = |i: usize, j: usize| {
        let product = directions[i].dot(gradient) * directions[j].dot(gradient);
        product - constant * directions[i].dot(q * directions[j])
    };

    // Over u and v exactly; each term with w at its largest.
    let square = [coefficient(0, 0), 2.0 * coefficient(0, 1), 2.0 * coefficient(0, 2)];
    let at_most = largest_on_square(square, [coefficient(1, 1), 2.0 * coefficient(1, 2), coefficient(2, 2)]);
    let with_w = largest(2.0 * coefficient(0, 3), coefficient(3, 3));
    let at_most = at_most + with_w + 2.0 * (coefficient(1, 3).abs() + coefficient(2, 3).abs());

    // The same with all signs positive.
    let q = DMat3::from_cols(q.x_axis.abs(), q.y_axis.abs(), q.z_axis.abs());
    let (from, g) = (from.abs(), g.abs());
    let reach = directions.iter().map(|direction| direction.abs()).sum::<DVec3>();
    let bent = q * from;
    let constant = from.dot(bent + 2.0 * g) + surface.constant.abs();
    let magnitude = reach.dot(bent + g) * reach.dot(bent + g) + constant * reach.dot(q * reach);
    at_most + DISCRIMINANT_SLACK * magnitude
}

/// The largest value of p·x + q·x² for |x| ≤ 1.
fn largest(p: f64, q: f64) -> f64 {
    let p = p.abs();
    if q < 0.0 && p < -2.0 * q { p * p / (-4.0 * q) } else { p + q }
}

/// The largest value of c + p·u + q·v + r·u² + s·uv + t·v² for |u|, |v| ≤ 1: on an edge, or where the gradient is zero. That
/// point may be far off where the form is nearly flat in some direction, but then the value is that of an edge as well.
fn largest_on_square([c, p, q]: [f64; 3], [r, s, t]: [f64; 3]) -> f64 {
    let edge =
        |side: f64| (c + side * p + r + largest(q + side * s, t)).max(c + side * q + t + largest(p + side * s, r));
    let on_edge = edge(-1.0).max(edge(1.0));
    let determinant = 4.0 * r * t - s * s;
    let (u, v) = ((s * q - 2.0 * t * p) / determinant, (s * p - 2.0 * r * q) / determinant);
    if r < 0.0 && determinant > 0.0 && u.abs() <= 1.0 && v.abs() <= 1.0 {
        return on_edge.max(c + (p + r * u + s * v) * u + (q + t * v) * v);
    }
    on_edge
}

/// The coefficients of the equation of t, as they may be over all directions of a pyramid.
struct Forms {
    directions: [Interval; 3],
    /// A.
    square: Interval,
    /// B.
    slope: Interval,
    /// C.
    constant: Interval,
}

impl Forms {
    fn new(surface: &Quadric, origin: DVec3, directions: &[DVec3; 4]) -> Forms {
        let [middle, across @ ..] = directions;
        let reach = across.iter().map(|direction| direction.abs()).sum::<DVec3>();
        // Four sums of rounded numbers each: one step outwards is not enough, a share of what went in is.
        let reach = reach + 4.0 * U * (middle.abs() + reach);
        let d = [0, 1, 2].map(|i| Interval { lo: middle[i] - reach[i], hi: middle[i] + reach[i] });
        let from = [0, 1, 2].map(|i| Interval::new(origin[i]) - Interval::new(surface.center[i]));
        let q = matrix(surface);
        let bent = |v: &[Interval; 3]| [0, 1, 2].map(|i| dot(&q.row(i).to_array().map(Interval::new), v));
        let g = surface.linear.to_array().map(Interval::new);
        let by_form = bent(&from);
        let gradient = [0, 1, 2].map(|i| by_form[i] + g[i]);
        let constant = dot(&from, &[0, 1, 2].map(|i| gradient[i] + g[i])) + Interval::new(surface.constant);
        Forms { directions: d, square: dot(&d, &bent(&d)), slope: dot(&d, &gradient), constant }
    }

    /// The two parameters at which rays may meet the surface, D being at most `discriminant`: (−B ∓ √D)/A, or twice the only one of a plane. `None` where
    /// A may be zero, and the larger of them is anywhere.
    fn roots(&self, surface: &Quadric, discriminant: f64) -> Option<[Interval; 2]> {
        let Forms { square, slope, constant, .. } = *self;
        if matrix(surface) == DMat3::ZERO {
            // 2B·t + C = 0.
            return Some([-(constant * Interval::new(0.5)) * slope.recip(); 2]);
        }
        if square.lo <= 0.0 && square.hi >= 0.0 {
            return None;
        }
        let d = slope * slope - square * constant;
        let root =
            Interval { lo: d.lo.max(0.0).sqrt().next_down(), hi: discriminant.min(d.hi).max(0.0).sqrt().next_up() };
        let reciprocal = square.recip();
        Some([(-slope - root) * reciprocal, (root - slope) * reciprocal])
    }

    /// Whether the points of both parameters are certain to lie outside of a clip.
    fn is_clipped(&self, roots: &[Interval; 2], origin: DVec3, clip: &Clip) -> bool {
        let is_outside = |&t: &Interval| {
            let to_point = |i: usize| Interval::new(origin[i]) + t * self.directions[i] - Interval::new(clip.center[i]);
            let point = [0, 1, 2].map(to_point);
            (0..3).any(|i| {
                let place = dot(&clip.rows[i].to_array().map(Interval::new), &point);
                place.hi < clip.lo[i] || place.lo > clip.hi[i]
            })
        };
        roots.iter().all(is_outside)
    }
}

fn dot(a: &[Interval; 3], b: &[Interval; 3]) -> Interval {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_value_on_the_square_is_that_of_its_best_point() {
        // Coefficients that are quarters, from −2 to 2: flat, bowl, saddle and hill.
        let mut bits = 1u64;
        let mut coefficient = || {
            bits = bits.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((bits >> 40) % 17) as f64 / 4.0 - 2.0
        };
        let mut n_inside = 0;
        for _ in 0..3000 {
            let [c, p, q, r, s, t] = [0; 6].map(|_| coefficient());
            let value = |u: f64, v: f64| c + p * u + q * v + r * u * u + s * u * v + t * v * v;
            let at = |i: i32| f64::from(i) / 64.0;
            let grid = (-64..=64).flat_map(|i| (-64..=64).map(move |j| (at(i), at(j))));
            let (u, v, best) =
                grid.map(|(u, v)| (u, v, value(u, v))).fold((0.0, 0.0, f64::MIN), |a, b| if b.2 > a.2 { b } else { a });
            n_inside += usize::from(u.abs() < 1.0 && v.abs() < 1.0);
            let largest = largest_on_square([c, p, q], [r, s, t]);
            // A best point lies within half a step: 6·(1/128)² of the second derivatives.
            assert!((best..=best + 1e-3).contains(&largest), "{largest} {best} at {u} {v}");
        }
        assert!(n_inside > 100, "{n_inside}");
    }
}
