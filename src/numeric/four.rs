//! Four rays at a time, one per lane: what every ray needs before it walks costs a quarter so.

use glam::DVec3;

use super::prepared::{PreparedRay, not_tiny};
use crate::simd::{F64Lanes, MaskLanes, Simd, WIDTH64, bytes_of_bits};

/// A ray as numbers: x, y, z of its origin and of its direction, and the ends of its interval.
pub type RayNumbers = [[f64; WIDTH64]; 2];

/// The numbers of a ray.
#[inline(always)]
pub fn ray_numbers(o: DVec3, d: DVec3, t_min: f64, t_max: f64) -> RayNumbers {
    [[o.x, o.y, o.z, d.x], [d.y, d.z, t_min, t_max]]
}

/// Four rays in lanes.
#[derive(Clone, Copy, Debug)]
pub struct FourRays<F: F64Lanes> {
    /// Origins, by axis.
    pub origin: [F; 3],
    /// Directions, by axis.
    pub direction: [F; 3],
    /// Lower ends of the intervals.
    pub t_min: F,
    /// Upper ends.
    pub t_max: F,
    /// Magnitudes of the directions' components.
    pub sizes: [F; 3],
    /// The largest of them.
    pub longest: F,
    /// Which directions are longest along y, and along z.
    is_longest: [F::Mask; 2],
}

/// Components of a direction below this share of the longest are taken to be as large, so that no inverse leaves f32.
pub const SMALLEST_SHARE: f64 = 1.0 / (1u64 << 60) as f64;

/// Of an ordinary ray the direction's longest component lies between 2⁻⁶⁰ and 2⁸⁰, and the origin within 2¹⁰⁰ and 2¹²⁰
/// times that component: then f32 holds what boxes are tested with along the longest axis.
const LONGEST: [f64; 2] = [1.0 / (1u64 << 60) as f64, (1u128 << 80) as f64];
/// See [`LONGEST`].
const FARTHEST: f64 = (1u128 << 100) as f64;
/// See [`LONGEST`].
const FARTHEST_PER_LENGTH: f64 = (1u128 << 120) as f64;

impl<F: F64Lanes> FourRays<F> {
    /// The rays of these numbers.
    #[inline(always)]
    pub fn new<S: Simd<F64 = F>>(simd: S, rays: [&RayNumbers; WIDTH64]) -> FourRays<F> {
        let [a, b, c, d] = rays;
        let [ox, oy, oz, dx] = simd.columns64([&a[0], &b[0], &c[0], &d[0]]);
        let [dy, dz, t_min, t_max] = simd.columns64([&a[1], &b[1], &c[1], &d[1]]);
        let sizes = [dx.abs(), dy.abs(), dz.abs()];
        let is_y = sizes[0].lt(sizes[1]);
        let longest = sizes[1].select(is_y, sizes[0]);
        let is_z = longest.lt(sizes[2]);
        let longest = sizes[2].select(is_z, longest);
        FourRays {
            origin: [ox, oy, oz],
            direction: [dx, dy, dz],
            t_min,
            t_max,
            sizes,
            longest,
            is_longest: [is_y, is_z],
        }
    }

    /// One ray in all lanes.
    #[inline(always)]
    pub fn same<S: Simd<F64 = F>>(simd: S, ray: &PreparedRay) -> FourRays<F> {
        FourRays::new(simd, [&ray.numbers(); WIDTH64])
    }

    /// Makes them others along the same axes, in either direction.
    #[inline(always)]
    pub fn turn(&mut self, origin: [F; 3], direction: [F; 3], t_min: F, t_max: F) {
        (self.origin, self.direction, self.t_min, self.t_max) = (origin, direction, t_min, t_max);
    }

    /// The components of vectors in each ray's cyclic order of axes, the last being that along which its direction is longest.
    #[inline(always)]
    pub fn in_axes(&self, [x, y, z]: [F; 3]) -> [F; 3] {
        let [is_y, is_z] = self.is_longest;
        [x.select(is_z, z.select(is_y, y)), y.select(is_z, x.select(is_y, z)), z.select(is_z, y.select(is_y, x))]
    }

    /// The inverse magnitudes of the directions' components, each taken to be at least [`SMALLEST_SHARE`] of the longest.
    #[inline(always)]
    pub fn inverse_sizes<S: Simd<F64 = F>>(&self, simd: S) -> [F; 3] {
        let (one, least) = (simd.splat64(1.0), self.longest * simd.splat64(SMALLEST_SHARE));
        let [x, y, z] = self.sizes;
        [one / x.max(least), one / y.max(least), one / z.max(least)]
    }

    /// Axes along which directions are longest; of equal ones the first.
    #[inline(always)]
    pub fn axes(&self) -> [u8; WIDTH64] {
        let [is_y, is_z] = [self.is_longest[0].bits(), self.is_longest[1].bits()];
        (bytes_of_bits(is_y & !is_z) | bytes_of_bits(is_z) << 1).to_le_bytes()
    }

    /// The largest magnitude of the origins' components.
    #[inline(always)]
    pub fn farthest(&self) -> F {
        let [x, y, z] = self.origin;
        x.abs().max(y.abs()).max(z.abs())
    }

    /// Ordinary rays, one bit each: finite, with an interval that is neither empty nor below 0, and with numbers that f32 can
    /// hold once they are multiplied out.
    #[inline(always)]
    pub fn ordinary<S: Simd<F64 = F>>(&self, simd: S) -> u32 {
        // Sums, since NaN goes through them.
        let [x, y, z] = self.origin;
        let far = x.abs() + y.abs() + z.abs();
        let [dx, dy, dz] = self.sizes;
        let length = dx + dy + dz;
        let near = far.le(simd.splat64(FARTHEST)) & far.le(self.longest * simd.splat64(FARTHEST_PER_LENGTH));
        let directed = simd.splat64(LONGEST[0]).le(self.longest) & length.le(simd.splat64(LONGEST[1]));
        let interval = simd.splat64(0.0).le(self.t_min) & self.t_min.lt(self.t_max);
        (near & directed & interval).bits()
    }

    /// Rays whose numbers are tame ([`is_tame`](super::double::is_tame)), one bit each; they must be ordinary, so that only
    /// numbers that are too small are to be found.
    #[inline(always)]
    pub fn tame<S: Simd<F64 = F>>(&self, simd: S) -> u32 {
        let ([ox, oy, oz], [dx, dy, dz]) = (self.origin, self.sizes);
        let mut sound = not_tiny(simd, dx);
        for size in [dy, dz, ox.abs(), oy.abs(), oz.abs()] {
            sound = sound & not_tiny(simd, size);
        }
        sound.bits()
    }

    /// What the ends of the intervals are rounded to: the lower ones down and up, the upper ones down and up; never −0.0.
    #[inline(always)]
    pub fn intervals<S: Simd<F64 = F>>(&self, simd: S) -> [[f32; WIDTH64]; 4] {
        let zero = simd.splat64(0.0);
        let ([min_down, min_up], [max_down, max_up]) = ((self.t_min + zero).outwards(), (self.t_max + zero).outwards());
        [min_down, min_up, max_down, max_up]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::Portable;
    use glam::dvec3;

    fn four(direction: DVec3) -> (PreparedRay, FourRays<<Portable as Simd>::F64>) {
        let ray = PreparedRay::new(dvec3(1.0, 2.0, 3.0), direction, 0.0, 4.0).unwrap();
        (ray, FourRays::same(Portable, &ray))
    }

    #[test]
    fn axes_are_those_of_one_ray() {
        let steps = [-2.0, -1.0, 0.0, 1.0, 2.0];
        for (x, y, z) in steps.iter().flat_map(|&x| steps.iter().flat_map(move |&y| steps.map(|z| (x, y, z)))) {
            if (x, y, z) == (0.0, 0.0, 0.0) {
                continue;
            }
            let (ray, four) = four(dvec3(x, y, z));
            assert_eq!(four.axes().map(usize::from), [ray.axis; WIDTH64], "{x} {y} {z}");
            let in_axes = four.in_axes(four.direction).map(|lanes| lanes.to_array()[2]);
            assert_eq!(in_axes, ray.axes().map(|axis| ray.direction[axis]), "{x} {y} {z}");
        }
    }

    #[test]
    fn what_is_not_ordinary_is_told_lane_by_lane() {
        let ray = |o: f64, d: f64, t_min: f64, t_max: f64| [[o, 0.0, 0.0, d], [0.0, 0.0, t_min, t_max]];
        let good = ray(1.0, -1.0, 0.0, f64::INFINITY);
        let bad = [
            ray(f64::NAN, 1.0, 0.0, 1.0),
            ray(f64::INFINITY, 1.0, 0.0, 1.0),
            ray(2f64.powi(101), 1.0, 0.0, 1.0),
            ray(2f64.powi(70), 2f64.powi(-55), 0.0, 1.0),
            ray(0.0, f64::NAN, 0.0, 1.0),
            ray(0.0, f64::INFINITY, 0.0, 1.0),
            ray(0.0, 0.0, 0.0, 1.0),
            ray(0.0, 1e-30, 0.0, 1.0),
            ray(0.0, 1e30, 0.0, 1.0),
            ray(0.0, 1.0, -1.0, 1.0),
            ray(0.0, 1.0, 1.0, 1.0),
            ray(0.0, 1.0, f64::NAN, 1.0),
            ray(0.0, 1.0, 0.0, f64::NAN),
        ];
        for (lane, bad) in (0..WIDTH64).cycle().zip(bad) {
            let mut rays = [good; WIDTH64];
            rays[lane] = bad;
            let ordinary = FourRays::new(Portable, rays.each_ref()).ordinary(Portable);
            assert_eq!(ordinary, 0b1111 & !(1 << lane), "{bad:?}");
        }
    }

    #[test]
    fn tame_is_that_of_one_ray() {
        for x in [1e-60, -1e-40, 0.0, -0.0, 1.0, 5e-324] {
            let (ray, four) = four(dvec3(1.0, x, 0.5));
            assert_eq!(four.tame(Portable), if ray.tame { 0b1111 } else { 0 }, "{x}");
        }
    }
}
