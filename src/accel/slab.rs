//! Eight boxes against one ray, conservatively: a box that holds a point of the ray is never missed.
//!
//! Boxes are f32, rays f64. Every rounding is turned outwards before the loop, so that the loop itself is the plain
//! slab test (Kay and Kajiya 1986): the origin is rounded up for one plane and down for the other, the inverse
//! direction towards zero for the near planes and away from it for the far ones, each with a margin of
//! [`INVERSE_MARGIN`] for the subtraction and the product. The bound is derived in `docs/NUMERICS.md`.

use crate::simd::{F32Lanes, F64Lanes, MaskLanes, Simd, WIDTH64};

/// Children of a node.
pub const WIDTH: usize = crate::simd::WIDTH;

/// Boxes of up to eight children, one array per plane; unused slots have lo = ∞, hi = −∞ and are never hit.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct Slabs {
    /// By axis the lower planes and the upper ones.
    pub planes: [[[f32; WIDTH]; 2]; 3],
}

/// Relative margin of the inverse direction: 2⁻²¹ covers three roundings of 2⁻²⁴ each: of the inverse itself, of the
/// subtraction and of the product.
const INVERSE_MARGIN: f64 = 1.0 / (1 << 21) as f64;

/// A ray as the box test wants it; the last number of each array is not used.
#[derive(Clone, Copy, Debug)]
pub struct SlabRay {
    near_origin: [f32; WIDTH64],
    far_origin: [f32; WIDTH64],
    near_inverse: [f32; WIDTH64],
    far_inverse: [f32; WIDTH64],
    t_min: f32,
    /// Whether the ray runs down an axis.
    runs_down: [bool; 3],
    /// Bit k is set where the ray runs down axis k.
    pub octant: u8,
}

impl Slabs {
    /// Eight unused slots.
    pub const EMPTY: Slabs = {
        let (lo, hi) = ([f32::INFINITY; WIDTH], [f32::NEG_INFINITY; WIDTH]);
        Slabs { planes: [[lo, hi]; 3] }
    };
}

impl SlabRay {
    /// Rays of one octant, their origins lying between two points and their inverse directions between two in
    /// magnitude, where −0.0 counts as 0.0: a parallel ray is treated as running upwards on every axis. `t_min` must be
    /// rounded downwards.
    #[inline(always)]
    pub fn new<S: Simd>(origin: &[[f32; WIDTH64]; 2], sizes: [S::F64; 2], octant: u8, t_min: f32) -> SlabRay {
        // Away from zero may overflow to ∞: 0·∞ = NaN is then ignored by the comparisons. Towards zero stays finite,
        // since ∞ would be no lower bound.
        let [near, _] = (sizes[0] * sizes[0].same(1.0 - INVERSE_MARGIN)).outwards();
        let [_, far] = (sizes[1] * sizes[1].same(1.0 + INVERSE_MARGIN)).outwards();
        let mut slab_ray = SlabRay {
            near_origin: [0.0; WIDTH64],
            far_origin: [0.0; WIDTH64],
            near_inverse: [0.0; WIDTH64],
            far_inverse: [0.0; WIDTH64],
            // −0.0 would make a key that is greater than all others.
            t_min: t_min + 0.0,
            runs_down: [octant & 1 != 0, octant & 2 != 0, octant & 4 != 0],
            octant: octant & 0b111,
        };
        // Four at a time and without branches, the last for nothing.
        for axis in 0..WIDTH64 {
            let runs_down = octant >> axis & 1 == 1;
            let sign = u32::from(octant >> axis & 1) << 31;
            let [down, up] = [origin[0][axis], origin[1][axis]];
            slab_ray.near_origin[axis] = if runs_down { down } else { up };
            slab_ray.far_origin[axis] = if runs_down { up } else { down };
            let near = if near[axis] < f32::MAX { near[axis] } else { f32::MAX };
            slab_ray.near_inverse[axis] = f32::from_bits(near.to_bits() ^ sign);
            slab_ray.far_inverse[axis] = f32::from_bits(far[axis].to_bits() ^ sign);
        }
        slab_ray
    }

    /// Tests eight boxes against the part of the ray up to `t_max`, which must be rounded upwards. The answer is, for each
    /// box, a lower bound of the parameter at which the ray enters it, and a bit that is set when it may hold a point of
    /// the ray.
    #[inline(always)]
    pub fn hits<S: Simd>(&self, simd: S, slabs: &Slabs, t_max: f32) -> (S::F32, u32) {
        // The smallest normal number covers products that underflow.
        let underflow = simd.splat(f32::MIN_POSITIVE);
        let mut t_near = simd.splat(self.t_min);
        let mut t_far = simd.splat(t_max);
        for axis in 0..3 {
            // A bool is an index that needs no check.
            let (planes, runs_down) = (&slabs.planes[axis], self.runs_down[axis]);
            let (near, far) = (simd.load(&planes[usize::from(runs_down)]), simd.load(&planes[usize::from(!runs_down)]));
            let enter = (near - simd.splat(self.near_origin[axis])) * simd.splat(self.near_inverse[axis]);
            let leave =
                (far - simd.splat(self.far_origin[axis])).mul_add(simd.splat(self.far_inverse[axis]), underflow);
            // A NaN leaves the bound as it is.
            t_near = enter.max(t_near);
            t_far = leave.min(t_far);
        }
        (t_near, t_near.le(t_far).bits())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::walk::Walk;
    use crate::numeric::prepared::PreparedRay;
    use crate::simd::Portable;
    use crate::world::Hit;
    use glam::{DVec3, dvec3};

    fn slabs(lo: [f32; 3], hi: [f32; 3]) -> Slabs {
        let mut slabs = Slabs::EMPTY;
        for axis in 0..3 {
            slabs.planes[axis][0][3] = lo[axis];
            slabs.planes[axis][1][3] = hi[axis];
        }
        slabs
    }

    fn mask(origin: DVec3, direction: DVec3, slabs: &Slabs) -> u32 {
        let ray = PreparedRay::new(origin, direction, 0.0, f64::INFINITY).unwrap();
        let mut walk = Walk::nowhere(Portable);
        walk.begin(Portable, ray, Hit::MISS);
        walk.slab.hits(Portable, slabs, f32::INFINITY).1
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
