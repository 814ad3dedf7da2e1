//! Eight boxes against one ray, conservatively: a box that holds a point of the ray is never missed.
//!
//! Boxes are f32, rays f64. Every rounding is turned outwards before the loop, so that the loop itself is the plain
//! slab test (Kay and Kajiya 1986): the origin is rounded up for one plane and down for the other, the inverse
//! direction towards zero for the near planes and away from it for the far ones, each with a margin of
//! [`INVERSE_MARGIN`] for the subtraction and the product. The bound is derived in `docs/NUMERICS.md`.

use glam::DVec3;

use crate::numeric::prepared::PreparedRay;
use crate::numeric::rounding::{f32_at_least, f32_at_most};

/// Children of a node.
pub const WIDTH: usize = 8;

/// Boxes of up to eight children, one array per plane; unused slots have lo = ∞, hi = −∞ and are never hit.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct Slabs {
    /// Lower planes, by axis.
    pub lo: [[f32; WIDTH]; 3],
    /// Upper planes, by axis.
    pub hi: [[f32; WIDTH]; 3],
}

/// Relative margin of the inverse direction: 2⁻²¹ covers two roundings of 2⁻²⁴ each and that of the inverse itself.
const INVERSE_MARGIN: f64 = 1.0 / (1 << 21) as f64;

/// A ray as the box test wants it.
#[derive(Clone, Copy, Debug)]
pub struct SlabRay {
    near_origin: [f32; 3],
    far_origin: [f32; 3],
    near_inverse: [f32; 3],
    far_inverse: [f32; 3],
    negative: [bool; 3],
    t_min: f32,
}

/// Which boxes are hit, and from where on.
#[derive(Clone, Copy, Debug)]
pub struct SlabHits {
    /// Lower bounds of the parameters at which the ray enters.
    pub t_near: [f32; WIDTH],
    /// Bit i is set when box i may hold a point of the ray.
    pub mask: u32,
}

impl Slabs {
    /// Eight unused slots.
    pub const EMPTY: Slabs = Slabs { lo: [[f32::INFINITY; WIDTH]; 3], hi: [[f32::NEG_INFINITY; WIDTH]; 3] };
}

impl SlabRay {
    /// Rounds a ray outwards.
    #[inline(always)]
    pub fn new(ray: &PreparedRay) -> SlabRay {
        // −0.0 becomes 0.0, so that a parallel ray is treated as running upwards on every axis.
        let direction = (ray.direction + DVec3::ZERO).to_array();
        let origin = ray.origin.to_array();
        let negative = direction.map(|d| d < 0.0);
        let up = origin.map(f32_at_least);
        let down = origin.map(f32_at_most);
        let pick = |i: usize, a: &[f32; 3], b: &[f32; 3]| if negative[i] { a[i] } else { b[i] };
        // Away from zero may overflow to ∞: 0·∞ = NaN is then ignored by the comparisons. Towards zero stays finite,
        // since ∞ would be no lower bound.
        let size = direction.map(|d| (1.0 / d).abs());
        let near = |i: usize| f32_at_most(size[i] * (1.0 - INVERSE_MARGIN)).min(f32::MAX);
        let far = |i: usize| f32_at_least(size[i] * (1.0 + INVERSE_MARGIN));
        let signed = |i: usize, x: f32| if negative[i] { -x } else { x };
        SlabRay {
            near_origin: [0, 1, 2].map(|i| pick(i, &down, &up)),
            far_origin: [0, 1, 2].map(|i| pick(i, &up, &down)),
            near_inverse: [0, 1, 2].map(|i| signed(i, near(i))),
            far_inverse: [0, 1, 2].map(|i| signed(i, far(i))),
            negative,
            t_min: f32_at_most(ray.t_min),
        }
    }

    /// Tests eight boxes against the part of the ray up to `t_max`, which must be rounded upwards.
    #[inline(always)]
    pub fn hits(&self, slabs: &Slabs, t_max: f32) -> SlabHits {
        let mut t_near = [self.t_min; WIDTH];
        let mut t_far = [t_max; WIDTH];
        for axis in 0..3 {
            let (near, far) = match self.negative[axis] {
                true => (&slabs.hi[axis], &slabs.lo[axis]),
                false => (&slabs.lo[axis], &slabs.hi[axis]),
            };
            let (near_origin, near_inverse) = (self.near_origin[axis], self.near_inverse[axis]);
            let (far_origin, far_inverse) = (self.far_origin[axis], self.far_inverse[axis]);
            for i in 0..WIDTH {
                let enter = (near[i] - near_origin) * near_inverse;
                let leave = (far[i] - far_origin) * far_inverse;
                // Ordered so that a NaN leaves the bound as it is.
                t_near[i] = if enter > t_near[i] { enter } else { t_near[i] };
                t_far[i] = if leave < t_far[i] { leave } else { t_far[i] };
            }
        }
        let mut mask = 0;
        for i in 0..WIDTH {
            // The smallest normal number covers products that underflow.
            mask |= u32::from(t_near[i] <= t_far[i] + f32::MIN_POSITIVE) << i;
        }
        SlabHits { t_near, mask }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::dvec3;

    fn slabs(lo: [f32; 3], hi: [f32; 3]) -> Slabs {
        let mut slabs = Slabs::EMPTY;
        for axis in 0..3 {
            slabs.lo[axis][3] = lo[axis];
            slabs.hi[axis][3] = hi[axis];
        }
        slabs
    }

    fn mask(origin: DVec3, direction: DVec3, slabs: &Slabs) -> u32 {
        let ray = PreparedRay::new(origin, direction, 0.0, f64::INFINITY).unwrap();
        SlabRay::new(&ray).hits(slabs, f32::INFINITY).mask
    }

    #[test]
    fn empty_slots_are_never_hit() {
        for direction in [DVec3::X, -DVec3::X, dvec3(1.0, 2.0, 3.0), dvec3(1e-300, 0.0, 0.0), dvec3(1e300, -1.0, 0.0)] {
            assert_eq!(mask(DVec3::ZERO, direction, &Slabs::EMPTY), 0, "{direction}");
            assert_eq!(mask(dvec3(1e300, -1e300, 0.0), direction, &Slabs::EMPTY), 0, "{direction}");
        }
    }

    #[test]
    fn a_ray_in_a_face_of_a_box_and_a_flat_box_are_hit_with_both_zeros() {
        let flat = slabs([-1.0, -1.0, 2.0], [1.0, 1.0, 2.0]);
        for zero in [0.0, -0.0] {
            assert_eq!(mask(dvec3(0.0, 0.0, 0.0), dvec3(zero, zero, 1.0), &flat), 8);
            assert_eq!(mask(dvec3(1.0, -1.0, 0.0), dvec3(zero, zero, 1.0), &flat), 8);
            assert_eq!(mask(dvec3(-5.0, 1.0, 2.0), dvec3(1.0, zero, zero), &flat), 8);
            assert_eq!(mask(dvec3(1.5, 0.0, 0.0), dvec3(zero, zero, 1.0), &flat), 0);
        }
    }

    #[test]
    fn a_corner_that_f64_just_reaches_is_hit_from_far_and_from_near() {
        let unit = slabs([0.0; 3], [1.0; 3]);
        for exponent in -40..=40 {
            let distance = 2f64.powi(exponent);
            for corner in [dvec3(0.0, 0.0, 0.0), dvec3(1.0, 1.0, 1.0), dvec3(1.0, 0.0, 1.0)] {
                for direction in [dvec3(1.0, -1.0, 0.5), dvec3(1.0, 1e-20, -1e-20), dvec3(0.3, 0.7, -0.1)] {
                    let origin = corner - distance * direction;
                    // Only rays that f64 starts exactly on the line are certain to meet the corner.
                    if origin + distance * direction == corner && (corner - origin) / distance == direction {
                        assert_eq!(mask(origin, direction, &unit), 8, "{corner} {direction} {distance}");
                    }
                }
            }
        }
    }

    #[test]
    fn boxes_at_any_scale_are_hit() {
        for exponent in -120..=120 {
            let size = 2f32.powi(exponent);
            let boxed = slabs([-size, -size, size], [size, size, size * 1.5]);
            assert_eq!(mask(DVec3::ZERO, dvec3(0.1, 0.2, 1.0), &boxed), 8, "{exponent}");
            assert_eq!(mask(DVec3::ZERO, dvec3(0.1, 0.2, 1.0) * 1e-30, &boxed), 8, "{exponent}");
            assert_eq!(mask(DVec3::ZERO, dvec3(0.1, 0.2, -1.0), &boxed), 0, "{exponent}");
        }
    }
}
