//! What lies between evenly spaced planes, and between which of them parts are best divided (binning, Wald 2007).

use glam::{Vec3, Vec3A};

use super::Space;
use crate::accel::area::Scale;
use crate::accel::wide::MAX_LEAF;

/// One side of a division.
#[derive(Clone, Copy, Debug)]
pub struct Side {
    /// The box around it.
    pub space: Space,
    /// Items in it.
    pub n_items: u32,
}

/// What lies between two planes, or begins or ends there.
#[derive(Clone, Copy, Debug)]
pub struct Bin {
    pub space: Space,
    pub n_begin: u32,
    pub n_end: u32,
}

/// A division at the lower plane of a bin.
#[derive(Clone, Copy, Debug)]
pub struct Choice {
    pub cost: f32,
    pub axis: usize,
    pub bin: usize,
    pub sides: [Side; 2],
}

impl Side {
    /// Nothing.
    pub const NONE: Side = Side { space: Space::NONE, n_items: 0 };

    /// It with more in it.
    #[inline(always)]
    pub fn and(self, space: Space, n_items: u32) -> Side {
        Side { space: self.space.union(space), n_items: self.n_items + n_items }
    }
}

impl Bin {
    /// Nothing.
    pub const NONE: Bin = Bin { space: Space::NONE, n_begin: 0, n_end: 0 };

    /// Puts something into it that begins and ends there.
    #[inline(always)]
    pub fn add(&mut self, space: Space, n_items: u32) {
        self.space = self.space.union(space);
        self.n_begin += n_items;
        self.n_end += n_items;
    }
}

/// What two sides cost a ray: as many leaves as they fill, if it meets their boxes.
#[inline(always)]
pub fn cost(scale: &Scale, [low, high]: &[Side; 2]) -> f32 {
    let cost = |side: &Side| {
        scale.half_area_between(side.space.lo, side.space.hi) * side.n_items.div_ceil(MAX_LEAF as u32) as f32
    };
    cost(low) + cost(high)
}

/// The number of a bin, of a place that is counted in bins; NaN counts as 0.
#[inline(always)]
pub fn bin(place: f32, n_bins: usize) -> usize {
    (place as usize).min(n_bins - 1)
}

/// Looks for a division that costs less than the best so far.
pub fn sweep<const N: usize>(scale: &Scale, bins: &[Bin; N], axis: usize, best: &mut Option<Choice>) {
    let mut above = [Side::NONE; N];
    let mut high = Side::NONE;
    for bin in (1..N).rev() {
        high = high.and(bins[bin].space, bins[bin].n_end);
        above[bin] = high;
    }
    let mut low = Side::NONE;
    for bin in 1..N {
        low = low.and(bins[bin - 1].space, bins[bin - 1].n_begin);
        let sides = [low, above[bin]];
        if low.n_items == 0 || above[bin].n_items == 0 {
            continue;
        }
        let cost = cost(scale, &sides);
        if best.is_none_or(|best| cost < best.cost) {
            *best = Some(Choice { cost, axis, bin, sides });
        }
    }
}

/// Evenly spaced planes across an axis.
#[derive(Clone, Copy, Debug)]
pub struct Planes<const N: usize> {
    axis: usize,
    lo: f32,
    width: f32,
    bins_per_unit: f32,
}

impl<const N: usize> Planes<N> {
    /// Those that cut a box into `N` bins; `None` where f32 cannot tell them apart.
    pub fn across(space: Space, axis: usize) -> Option<Planes<N>> {
        let (lo, hi) = (space.lo[axis], space.hi[axis]);
        let width = hi - lo;
        let bins_per_unit = N as f32 / width;
        (width.is_finite() && bins_per_unit.is_finite()).then_some(Planes { axis, lo, width, bins_per_unit })
    }

    /// The plane below a bin.
    #[inline(always)]
    pub fn below(&self, bin: usize) -> f32 {
        self.lo + self.width * (bin as f32 / N as f32)
    }

    /// The bins that a box begins and ends in.
    #[inline(always)]
    pub fn span(&self, space: Space) -> [usize; 2] {
        [space.lo, space.hi].map(|corner| bin((corner[self.axis] - self.lo) * self.bins_per_unit, N))
    }

    /// Whether a box is no wider than a bin across the other axes: then it is about as small as a box around what it holds.
    #[inline(always)]
    pub fn is_thin(&self, space: Space) -> bool {
        let extent = space.hi - space.lo;
        let widest = extent[(self.axis + 1) % 3].max(extent[(self.axis + 2) % 3]);
        widest * self.bins_per_unit < 1.0
    }

    /// Puts a box into all bins from one to another, cut at the planes.
    #[inline(always)]
    pub fn add_box(&self, bins: &mut [Bin; N], [first, last]: [usize; 2], space: Space) {
        for (i, bin) in bins.iter_mut().enumerate().take(last + 1).skip(first) {
            bin.space = bin.space.union(space.between(self.axis, self.below(i), self.below(i + 1)));
        }
    }

    /// Puts what of a triangle lies in a box into all bins from one to another; about so, since this only weighs.
    #[inline(always)]
    pub fn add_triangle(&self, bins: &mut [Bin; N], [first, last]: [usize; 2], corners: [Vec3; 3], within: Space) {
        let axis = self.axis;
        let mut corners = corners.map(Vec3A::from);
        corners.sort_unstable_by(|a, b| a[axis].total_cmp(&b[axis]));
        let [a, b, c] = corners;
        let (along, below, above) =
            ((c - a) / (c[axis] - a[axis]), (b - a) / (b[axis] - a[axis]), (c - b) / (c[axis] - b[axis]));
        // Where a plane meets the triangle.
        let section = |at: f32| {
            if at <= a[axis] {
                return Space::point(a);
            }
            if at >= c[axis] {
                return Space::point(c);
            }
            let (p, rest) = (a + along * (at - a[axis]), at - b[axis]);
            let q = if rest < 0.0 { a + below * (at - a[axis]) } else { b + above * rest };
            Space::point(p).union(Space::point(if q.is_nan() { b } else { q }))
        };
        let mut from = section(self.below(first));
        for (i, bin) in bins.iter_mut().enumerate().take(last + 1).skip(first) {
            let to = section(self.below(i + 1));
            let mut piece = from.union(to);
            if (self.below(i)..=self.below(i + 1)).contains(&b[axis]) {
                piece = piece.union(Space::point(b));
            }
            let piece = piece.common(within);
            if !piece.is_empty() {
                bin.space = bin.space.union(piece);
            }
            from = to;
        }
    }
}
