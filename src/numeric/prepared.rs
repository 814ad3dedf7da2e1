//! A ray as the kernels want it: checked once, with what every test needs.

use glam::DVec3;

use super::four::{RayNumbers, ray_numbers};
use crate::simd::{CYCLIC, F64Lanes, MaskLanes, Portable, Simd, WIDTH64};

/// A finite ray of non-zero direction.
#[derive(Clone, Copy, Debug)]
pub struct PreparedRay {
    /// Origin.
    pub origin: DVec3,
    /// Direction; any length.
    pub direction: DVec3,
    /// Open lower end of the interval.
    pub t_min: f64,
    /// Open upper end of the interval.
    pub t_max: f64,
    /// The axis along which the direction is longest; of equal ones the first.
    pub axis: usize,
    /// Whether origin and direction are tame in the sense of [`is_tame`](super::double::is_tame).
    pub tame: bool,
}

/// The ends of what [`is_tame`](super::double::is_tame) holds for, the upper one exclusive.
const TAME: [f64; 2] = [f64::from_bits((1023 - 150) << 52), f64::from_bits((1023 + 151) << 52)];

/// A vector in lanes; the last one is no part of it.
#[inline(always)]
pub fn lanes<S: Simd>(simd: S, v: DVec3) -> S::F64 {
    simd.load64(&[v.x, v.y, v.z, 1.0])
}

/// Lanes that are tame in the sense of [`is_tame`](super::double::is_tame).
#[inline(always)]
pub fn tame<S: Simd>(simd: S, x: S::F64) -> <S::F64 as F64Lanes>::Mask {
    let size = x.abs();
    not_tiny(simd, size) & size.lt(simd.splat64(TAME[1]))
}

/// The lower half of [`tame`], of magnitudes: zeros are not tiny.
#[inline(always)]
pub fn not_tiny<S: Simd>(simd: S, size: S::F64) -> <S::F64 as F64Lanes>::Mask {
    simd.splat64(TAME[0]).le(size) | size.le(simd.splat64(0.0))
}

const _: () = assert!(WIDTH64 == 4);

impl PreparedRay {
    /// Prepares a ray. `None` for one that hits nothing: a component is NaN or infinite, the direction is zero, or the
    /// interval is empty, begins below 0 or has a NaN end.
    #[inline(always)]
    pub fn new(origin: DVec3, direction: DVec3, t_min: f64, t_max: f64) -> Option<PreparedRay> {
        PreparedRay::with_lanes(Portable, origin, direction, t_min, t_max)
    }

    /// [`PreparedRay::new`] in lanes.
    #[inline(always)]
    pub fn with_lanes<S: Simd>(
        simd: S,
        origin: DVec3,
        direction: DVec3,
        t_min: f64,
        t_max: f64,
    ) -> Option<PreparedRay> {
        let (o, d) = (lanes(simd, origin).abs(), lanes(simd, direction).abs());
        // What is tame is finite: most rays need no other test.
        let tame = (tame(simd, o) & tame(simd, d)).bits() == 0b1111;
        let infinity = simd.splat64(f64::INFINITY);
        let finite = tame || (o.lt(infinity) & d.lt(infinity)).bits() == 0b1111;
        let directed = simd.splat64(0.0).lt(d).bits() & 0b111 != 0;
        if !(finite & directed & (t_min >= 0.0) & (t_min < t_max)) {
            return None;
        }
        Some(PreparedRay { origin, direction, t_min, t_max, axis: longest_axis(direction), tame })
    }

    /// The ray as numbers.
    #[inline(always)]
    pub fn numbers(&self) -> RayNumbers {
        ray_numbers(self.origin, self.direction, self.t_min, self.t_max)
    }

    /// The axes in cyclic order, the last the one along which the direction is longest.
    #[inline(always)]
    pub fn axes(&self) -> [usize; 3] {
        CYCLIC[self.axis % CYCLIC.len()]
    }
}

/// The axis along which a direction is longest; of equal ones the first.
#[inline(always)]
pub fn longest_axis(direction: DVec3) -> usize {
    let size = direction.abs();
    // Two steps without a branch.
    let (axis, longest) = if size.y > size.x { (1, size.y) } else { (0, size.x) };
    if size.z > longest { 2 } else { axis }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::double::is_tame;

    #[test]
    fn tame_is_the_same_in_lanes() {
        let edges = [2f64.powi(-150), 2f64.powi(151)];
        let values = edges.into_iter().flat_map(|x| [x.next_down(), x, x.next_up()]);
        for x in values.chain([0.0, -0.0, 1.0, 5e-324, f64::MAX]).flat_map(|x| [x, -x]) {
            let ray = PreparedRay::new(DVec3::new(1.0, x, 0.0), DVec3::X, 0.0, 1.0).unwrap();
            assert_eq!(ray.tame, is_tame(x), "{x:e}");
        }
    }
}
