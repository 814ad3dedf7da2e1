//! Axis-aligned boxes in f32, rounded outwards.

use glam::{DVec3, Vec3};

use crate::numeric::rounding::{f32_at_least, f32_at_most};

/// A box with finite corners, `lo <= hi` on every axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Smallest corner.
    pub lo: Vec3,
    /// Largest corner.
    pub hi: Vec3,
}

impl Bounds {
    /// The smallest f32 box around the f64 box; `None` when a corner is beyond the range of f32 or NaN.
    pub fn around(lo: DVec3, hi: DVec3) -> Option<Bounds> {
        let round = |v: DVec3, to: fn(f64) -> f32| Vec3::new(to(v.x), to(v.y), to(v.z));
        let bounds = Bounds { lo: round(lo, f32_at_most), hi: round(hi, f32_at_least) };
        (bounds.lo.is_finite() && bounds.hi.is_finite() && bounds.lo.cmple(bounds.hi).all()).then_some(bounds)
    }

    /// The box around both.
    pub fn union(self, other: Bounds) -> Bounds {
        Bounds { lo: self.lo.min(other.lo), hi: self.hi.max(other.hi) }
    }

    /// Centre, in f64 so that it cannot overflow.
    pub fn center(&self) -> DVec3 {
        0.5 * (self.lo.as_dvec3() + self.hi.as_dvec3())
    }

    /// Edge lengths.
    pub fn extent(&self) -> DVec3 {
        self.hi.as_dvec3() - self.lo.as_dvec3()
    }
}
