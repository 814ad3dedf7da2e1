//! How likely a box is met.

use glam::{Vec3, Vec3A};
use rayon::prelude::*;

use crate::world::Bounds;

/// Measures boxes of one scene in f32 whatever the scene's size.
///
/// Lengths are multiplied by a power of two that brings the largest coordinate near 1: areas then neither overflow nor
/// vanish, and boxes keep all their bits.
#[derive(Clone, Copy, Debug)]
pub struct Scale {
    /// The box around the scene, unscaled.
    pub whole: Bounds,
    factor: f32,
    lo: Vec3,
    inverse_extent: f32,
}

/// What is added to every edge, in the scaled scene. A point and a line have no area and are met all the same by rays
/// aimed at them; and of two lines the longer is met more often.
const EDGE: f32 = 1.0 / (1 << 26) as f32;

impl Scale {
    /// The scale of a scene of these boxes.
    pub fn of(boxes: &[Bounds]) -> Scale {
        let Some(whole) = boxes.par_iter().copied().reduce_with(Bounds::union) else {
            let whole = Bounds { lo: Vec3::ZERO, hi: Vec3::ZERO };
            return Scale { whole, factor: 1.0, lo: Vec3::ZERO, inverse_extent: 0.0 };
        };
        let largest = whole.lo.abs().max(whole.hi.abs()).max_element();
        let exponent = (largest.to_bits() >> 23) as i32 - 127;
        let factor = f32::from_bits(((127 - exponent.clamp(-126, 126)) as u32) << 23);
        let extent = (factor * whole.hi - factor * whole.lo).max_element();
        let inverse_extent = if extent > 0.0 { (1.0 / extent).min(f32::MAX) } else { 0.0 };
        Scale { whole, factor, lo: factor * whole.lo, inverse_extent }
    }

    /// A point in the scaled scene.
    #[inline(always)]
    pub fn point(&self, p: Vec3A) -> Vec3A {
        self.factor * p
    }

    /// A box in the scaled scene.
    #[inline]
    pub fn scaled(&self, bounds: &Bounds) -> Bounds {
        Bounds { lo: self.factor * bounds.lo, hi: self.factor * bounds.hi }
    }

    /// The centre of a box, in the cube around the scene as the unit cube.
    #[inline]
    pub fn center(&self, bounds: &Bounds) -> Vec3 {
        let Bounds { lo, hi } = self.scaled(bounds);
        (0.5 * lo + 0.5 * hi - self.lo) * self.inverse_extent
    }

    /// Half the area of a box, of which its chance to be met by a random ray is a multiple.
    #[inline]
    pub fn half_area(&self, bounds: &Bounds) -> f32 {
        self.half_area_between(bounds.lo.into(), bounds.hi.into())
    }

    /// The same of the box between two corners.
    #[inline(always)]
    pub fn half_area_between(&self, lo: Vec3A, hi: Vec3A) -> f32 {
        let e = self.point(hi) - self.point(lo) + EDGE;
        e.x * (e.y + e.z) + e.y * e.z
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_longer_line_is_met_more_often_at_every_scale() {
        for scale in [1e-38f32, 1e-30, 1e-6, 1.0, 1e20, 1e38] {
            let line = |length: f32| Bounds { lo: Vec3::ZERO, hi: Vec3::new(length * scale, 0.0, 0.0) };
            let measure = Scale::of(&[line(1.0), line(2.0)]);
            assert!(measure.half_area(&line(1.0)) > 0.0, "{scale:e}");
            assert!(measure.half_area(&line(2.0)) > 1.5 * measure.half_area(&line(1.0)), "{scale:e}");
            assert!(measure.half_area(&line(2.0)).is_finite());
        }
    }

    #[test]
    fn centers_lie_in_the_unit_cube() {
        let all = Bounds { lo: Vec3::splat(-3e38), hi: Vec3::splat(3e38) };
        assert!((Scale::of(&[all]).center(&all) - 0.5).abs().max_element() <= 4.0 * f32::EPSILON);
    }
}
