//! Eight boxes against one ray, conservatively: a box that holds a point of the ray is never missed.
//!
//! Boxes are f32, rays f64. The slab test (Kay and Kajiya 1986) takes one multiply-add per plane: t = plane·i + c, where
//! c = −origin·i is found in f64 and rounded. All roundings are turned outwards before the loop: the inverse direction
//! i is taken by [`INVERSE_MARGIN`] smaller for near planes and larger for far ones, the ray is made thicker by
//! [`ORIGIN_MARGIN`] of its origin. The bound is derived in `docs/NUMERICS.md`.

use crate::numeric::four::{FourRays, SMALLEST_SHARE};
use crate::simd::{F32Lanes, F64Lanes, MaskLanes, Simd, WIDTH64, bytes_of_bits};
use crate::world::Bounds;

/// Children of a node.
pub const WIDTH: usize = crate::simd::WIDTH;

/// Boxes of up to eight children, one array per plane; unused slots have lo = ∞, hi = −∞ and are never hit.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct Slabs {
    /// By axis the lower planes and the upper ones.
    pub planes: [[[f32; WIDTH]; 2]; 3],
}

/// Relative margin of the inverse direction. Three roundings of 2⁻²⁴ are to be covered: of the inverse, of the product
/// where it is not fused, and of the sum.
const INVERSE_MARGIN: f64 = 1.0 / (1 << 21) as f64;

/// What the origin is taken to be wrong by, as a share of itself: the same roundings of plane·i and c, of which only the
/// origin is left where they cancel, are below 3·2⁻²⁴ of it.
const ORIGIN_MARGIN: f64 = 1.0 / (1 << 22) as f64;

/// A ray as the box test wants it: three numbers by axis, in fours as they are written.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct SlabRay {
    /// Inverse directions for near planes; and the lower end of the interval, rounded down.
    near_inverse: [f32; WIDTH64],
    /// The same for far planes; the last is not used, here and below.
    far_inverse: [f32; WIDTH64],
    near_offset: [f32; WIDTH64],
    far_offset: [f32; WIDTH64],
    /// Bit k is set where the ray runs down axis k.
    pub octant: u8,
}

/// What boxes rays are for.
#[derive(Clone, Copy, Debug)]
pub struct Surroundings {
    /// The box around all boxes.
    pub bounds: Bounds,
    /// Its largest coordinate.
    reach: f64,
    /// How much thicker rays are taken to be than they are, as a share of the largest coordinate of their origin.
    thickness: f64,
    /// Whether nothing lies outside of it.
    pub is_all: bool,
}

impl Surroundings {
    /// Boxes within these bounds, for rays that are so much thicker.
    #[inline(always)]
    pub fn new(bounds: Bounds, thickness: f64, is_all: bool) -> Surroundings {
        let reach = bounds.lo.abs().max_element().max(bounds.hi.abs().max_element());
        Surroundings { bounds, reach: reach.into(), thickness, is_all }
    }
}

impl Slabs {
    /// Eight unused slots.
    pub const EMPTY: Slabs = {
        let (lo, hi) = ([f32::INFINITY; WIDTH], [f32::NEG_INFINITY; WIDTH]);
        Slabs { planes: [[lo, hi]; 3] }
    };
}

/// Where rays start: near a point, by axis in lanes, which each is off by so much along any axis at most.
#[derive(Clone, Copy, Debug)]
pub struct Apex<F> {
    /// The point.
    pub origin: F,
    /// How far any is off it.
    pub off: f64,
}

/// One axis of some rays.
struct Axis<F> {
    near_inverse: F,
    far_inverse: F,
    near_offset: F,
    far_offset: F,
}

/// What the axes of a ray share.
struct Common<F> {
    /// A component of the direction is taken to be at least this.
    least: F,
    /// No box of the tree is met behind this.
    beyond: F,
    thickness: F,
}

impl<F: F64Lanes> Common<F> {
    #[inline(always)]
    fn new<S: Simd<F64 = F>>(simd: S, longest: F, of_longest: F, farthest: F, around: &Surroundings) -> Common<F> {
        let reach = (farthest + simd.splat64(around.reach)) * simd.splat64(2.0);
        Common {
            least: longest * simd.splat64(SMALLEST_SHARE),
            beyond: reach * of_longest,
            thickness: farthest * simd.splat64(around.thickness),
        }
    }

    /// An axis of rays that start at `origin` and run along it by at least `smallest` in magnitude; the inverse is between
    /// two.
    #[inline(always)]
    fn axis<S: Simd<F64 = F>>(&self, simd: S, origin: F, smallest: F, inverse: [F; 2], runs_down: F::Mask) -> Axis<F> {
        let one = simd.splat64(1.0);
        let near = inverse[0] * simd.splat64(1.0 - INVERSE_MARGIN);
        let far = inverse[1] * simd.splat64(1.0 + INVERSE_MARGIN);
        // Seen along the ray: the planes lie ahead where they are larger.
        let sign = (-one).select(runs_down, one);
        let ahead = origin * sign;
        let margin = origin.abs().mul_add(simd.splat64(ORIGIN_MARGIN), self.thickness);
        // Where the inverse is less than it should be, no box is left behind that the ray meets at all.
        let underflow = simd.splat64(f32::MIN_POSITIVE.into());
        let extra = self.beyond.select(smallest.lt(self.least), underflow);
        let largest = simd.splat64(f32::MAX.into());
        Axis {
            near_inverse: near * sign,
            far_inverse: far * sign,
            near_offset: (-near).mul_add(ahead + margin, -underflow).min(largest),
            far_offset: far.mul_add(margin - ahead, extra).max(-largest),
        }
    }
}

impl SlabRay {
    /// A ray of which nothing is known: every box may be met, but no unused slot.
    #[inline(always)]
    pub const fn everywhere(t_min: f32) -> SlabRay {
        // The smallest inverse turns a finite plane into at most 4, and an infinite one into itself.
        let [inverse, offset] = [f32::MIN_POSITIVE, f32::MAX];
        SlabRay {
            near_inverse: [inverse, inverse, inverse, t_min + 0.0],
            far_inverse: [inverse; WIDTH64],
            near_offset: [-offset; WIDTH64],
            far_offset: [offset; WIDTH64],
            octant: 0,
        }
    }

    /// Four ordinary rays; which of them may meet the box around all comes back, one bit each. `t_min` must be rounded downwards
    /// and never be −0.0, which would make a key that is greater than all others.
    #[inline(always)]
    pub fn four<S: Simd>(
        simd: S,
        rays: &FourRays<S::F64>,
        inverse_sizes: [S::F64; 3],
        t_min: [f32; WIDTH64],
        around: &Surroundings,
        to: &mut [SlabRay; WIDTH64],
    ) -> u32 {
        let [_, _, of_longest] = rays.in_axes(inverse_sizes);
        let common = Common::new(simd, rays.longest, of_longest, rays.farthest(), around);
        let zero = simd.splat64(0.0);
        let (mut t_near, mut t_far) = (rays.t_min, rays.t_max);
        let (mut columns, mut octants) = ([[[0.0; WIDTH64]; 4]; 4], 0);
        for axis in 0..3 {
            // −0.0 is not below 0: a parallel ray is taken to run upwards.
            let runs_down = rays.direction[axis].lt(zero);
            let inverse = inverse_sizes[axis];
            let numbers = common.axis(simd, rays.origin[axis], rays.sizes[axis], [inverse, inverse], runs_down);
            let (lo, hi) = (simd.splat64(around.bounds.lo[axis].into()), simd.splat64(around.bounds.hi[axis].into()));
            let (near, far) = (hi.select(runs_down, lo), lo.select(runs_down, hi));
            t_near = near.mul_add(numbers.near_inverse, numbers.near_offset).max(t_near);
            t_far = far.mul_add(numbers.far_inverse, numbers.far_offset).min(t_far);
            columns[0][axis] = numbers.near_inverse.to_f32();
            columns[1][axis] = numbers.far_inverse.to_f32();
            columns[2][axis] = numbers.near_offset.to_f32();
            columns[3][axis] = numbers.far_offset.to_f32();
            octants |= bytes_of_bits(runs_down.bits()) << axis;
        }
        columns[0][3] = t_min;
        let near_inverse = simd.rows32(columns[0]);
        let far_inverse = simd.rows32(columns[1]);
        let near_offset = simd.rows32(columns[2]);
        let far_offset = simd.rows32(columns[3]);
        let octants = octants.to_le_bytes();
        for lane in 0..WIDTH64 {
            to[lane] = SlabRay {
                near_inverse: near_inverse[lane],
                far_inverse: far_inverse[lane],
                near_offset: near_offset[lane],
                far_offset: far_offset[lane],
                octant: octants[lane],
            };
        }
        t_near.le(t_far).bits()
    }

    /// Rays of one apex and one octant, by axis in lanes, whose directions lie between two in magnitude, where −0.0 counts as
    /// 0.0: a parallel ray is taken to run upwards on every axis. No direction is shorter than `longest` along the axis that
    /// is longest for all; `t_min` must be rounded downwards.
    #[inline(always)]
    pub fn around<S: Simd>(
        simd: S,
        apex: Apex<S::F64>,
        sizes: [S::F64; 2],
        runs_down: <S::F64 as F64Lanes>::Mask,
        longest: f64,
        t_min: f32,
        around: &Surroundings,
    ) -> SlabRay {
        let Apex { origin, off } = apex;
        let [x, y, z, _] = origin.abs().to_array();
        let farthest = x.max(y).max(z);
        let (longest, one) = (simd.splat64(longest), simd.splat64(1.0));
        let mut common = Common::new(simd, longest, one / longest, simd.splat64(farthest), around);
        common.thickness = common.thickness + simd.splat64(off);
        let inverse = [one / sizes[1].max(common.least), one / sizes[0].max(common.least)];
        let numbers = common.axis(simd, origin, sizes[0], inverse, runs_down);
        let octant = runs_down.bits() & 0b111;
        let mut slab = SlabRay {
            near_inverse: numbers.near_inverse.to_f32(),
            far_inverse: numbers.far_inverse.to_f32(),
            near_offset: numbers.near_offset.to_f32(),
            far_offset: numbers.far_offset.to_f32(),
            octant: octant as u8,
        };
        slab.near_inverse[3] = t_min + 0.0;
        slab
    }

    /// The same in lanes, for a ray that tests many boxes before another one does.
    #[inline(always)]
    pub fn lanes<S: Simd>(&self, simd: S) -> SlabLanes<S::F32> {
        let mut lanes = SlabLanes { t_min: simd.splat(self.near_inverse[3]), axes: [[simd.splat(0.0); 4]; 3] };
        for (axis, numbers) in lanes.axes.iter_mut().enumerate() {
            *numbers = [
                simd.splat(self.near_inverse[axis]),
                simd.splat(self.near_offset[axis]),
                simd.splat(self.far_inverse[axis]),
                simd.splat(self.far_offset[axis]),
            ];
        }
        lanes
    }

    /// Tests eight boxes against the part of the ray up to `t_max`, which must be rounded upwards. The answer is, for each
    /// box, a lower bound of the parameter at which the ray enters it, and a bit that is set when it may hold a point of
    /// the ray.
    #[inline(always)]
    pub fn hits<S: Simd>(&self, simd: S, slabs: &Slabs, t_max: f32) -> (S::F32, u32) {
        self.lanes(simd).hits(simd, slabs, self.octant, t_max)
    }
}

/// A ray as the box test wants it, each number in all lanes.
#[derive(Clone, Copy, Debug)]
pub struct SlabLanes<F> {
    t_min: F,
    /// Inverse direction and offset for near planes, then for far planes, by axis.
    axes: [[F; 4]; 3],
}

impl<F: F32Lanes> SlabLanes<F> {
    /// See [`SlabRay::hits`].
    #[inline(always)]
    pub fn hits<S: Simd<F32 = F>>(&self, simd: S, slabs: &Slabs, octant: u8, t_max: f32) -> (F, u32) {
        let mut t_near = self.t_min;
        let mut t_far = simd.splat(t_max);
        for (axis, numbers) in self.axes.iter().enumerate() {
            let [near, far] = simd.load_pair(&slabs.planes[axis], usize::from(octant) >> axis);
            let enter = near.mul_add(numbers[0], numbers[1]);
            let leave = far.mul_add(numbers[2], numbers[3]);
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
    use crate::accel::ready;
    use crate::numeric::prepared::PreparedRay;
    use crate::simd::Portable;
    use glam::{DVec3, Vec3, dvec3};

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
        let corner = |side: usize| Vec3::from_array(slabs.planes.map(|planes| planes[side][3]));
        let (lo, hi) = (corner(0), corner(1));
        let bounds = if lo.x <= hi.x { Bounds { lo, hi } } else { Bounds { lo: Vec3::ZERO, hi: Vec3::ONE } };
        let (slab, _) = ready::one(Portable, &ray, &Surroundings::new(bounds, 0.0, true));
        slab.hits(Portable, slabs, f32::INFINITY).1
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
    fn a_ray_is_thicker_by_two_units_of_its_origin_and_no_more_however_large_its_surroundings_are() {
        let boxed = slabs([1.0, -1.0, 1000.0], [2.0, 1.0, 1001.0]);
        let bounds = Bounds { lo: Vec3::splat(-1e6), hi: Vec3::splat(1e6) };
        let is_met = |x: f64, direction: DVec3| {
            let ray = PreparedRay::new(dvec3(x, 0.0, 0.0), direction, 0.0, f64::INFINITY).unwrap();
            let (slab, _) = ready::one(Portable, &ray, &Surroundings::new(bounds, 0.0, true));
            slab.hits(Portable, &boxed, f32::INFINITY).1 != 0
        };
        for direction in [DVec3::Z, dvec3(0.0, 1e-9, 1.0), dvec3(-0.0, 0.0, 1e20)] {
            let unit = f64::from(f32::EPSILON);
            assert!(is_met(1.0, direction) && is_met(2.0, direction), "{direction}");
            assert!(!is_met(1.0 - 4.0 * unit, direction) && !is_met(2.0 + 8.0 * unit, direction), "{direction}");
        }
    }

    #[test]
    fn points_of_boxes_lie_between_where_a_ray_enters_and_leaves() {
        let mut state = 1u64;
        let mut next = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 33) as f64 / (1u64 << 31) as f64 - 0.5
        };
        let mut n_judged = 0;
        for i in 0..40_000 {
            let scale = 2f64.powi(i % 61 - 30);
            let mut vector = |scale: f64| dvec3(next(), next(), next()) * scale;
            // Of few bits, so that f64 holds the way from one to the other.
            let few = |v: DVec3| v.as_vec3().as_dvec3();
            let (origin, point) = (few(vector(scale)), few(vector(1.0)));
            let direction = point - origin;
            if origin + direction != point || direction == DVec3::ZERO {
                continue;
            }
            n_judged += 1;
            // A corner, a point of a face, and one inside.
            let size = [0.0, f64::from(f32::EPSILON), 0.25][i as usize % 3] * vector(1.0).abs();
            let boxed = Bounds::around(point - size, point + size).unwrap();
            let slabs = slabs(boxed.lo.to_array(), boxed.hi.to_array());
            let ray = PreparedRay::new(origin, direction, 0.0, f64::INFINITY).unwrap();
            let (slab, _) = ready::one(Portable, &ray, &Surroundings::new(boxed, 0.0, true));
            let (near, mask) = slab.hits(Portable, &slabs, 1.0);
            assert!(mask == 8 && near.to_array()[3] <= 1.0, "{origin} {point} {size}");
        }
        assert!(n_judged > 10_000);
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
