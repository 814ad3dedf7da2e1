//! How parts are best divided: by their centres, or by a plane that cuts what lies across it.

use glam::{Vec3, Vec3A};

use super::cut::cut;
use super::weigh::{Bin, Choice, Planes, Side, bin, cost, sweep};
use super::{Part, Space};
use crate::accel::area::Scale;
use crate::accel::duplicate::{Groups, Item};
use crate::world::{PrimKind, World};

/// Planes are worth looking for where the boxes of the two best groups have so much of the whole box's area in common, and …
const SHARED: f32 = 0.1;

/// … so much of the scene's (Stich et al., section 4.3, α).
const SHARED_OF_SCENE: f32 = 1e-5;

/// What is known about all that is divided.
pub struct Divider<'a> {
    world: &'a World,
    items: &'a [Item],
    scale: &'a Scale,
    least_shared: f32,
}

/// Halves a list.
pub fn halve(mut parts: Vec<Part>) -> [Vec<Part>; 2] {
    let behind = parts.split_off(parts.len() / 2);
    [parts, behind]
}

/// The boxes around parts and around their centres.
struct Extents {
    parts: Space,
    centers: Space,
}

impl<'a> Divider<'a> {
    /// For the clusters of a scene.
    pub fn of(world: &'a World, groups: &'a Groups) -> Divider<'a> {
        let scale = &groups.scale;
        let least_shared = SHARED_OF_SCENE * scale.half_area(&scale.whole);
        Divider { world, items: &groups.items, scale, least_shared }
    }

    /// Divides at least two parts into two lists of at least one, which hold at most so many more items than they.
    pub fn divide(&self, parts: Vec<Part>, n_spare: usize) -> [Vec<Part>; 2] {
        // Planes are far apart where few parts lie between them, which takes most of the time; more of them find no better
        // trees (docs/BENCHMARKS.md).
        match parts.len() {
            0..=8 => self.divide_among::<8>(parts, n_spare),
            9..=64 => self.divide_among::<16>(parts, n_spare),
            65..=1024 => self.divide_among::<32>(parts, n_spare),
            _ => self.divide_among::<64>(parts, n_spare),
        }
    }

    // Not a part of the recursion, whose frames must be small.
    #[inline(never)]
    fn divide_among<const N: usize>(&self, parts: Vec<Part>, n_spare: usize) -> [Vec<Part>; 2] {
        let mut extents = Extents { parts: Space::NONE, centers: Space::NONE };
        for part in &parts {
            extents.parts = extents.parts.union(part.space);
            extents.centers = extents.centers.union(Space::point(self.center(part)));
        }
        let by_centers = self.by_centers::<N>(&parts, extents.centers);
        if n_spare > 0
            && by_centers.is_none_or(|choice| self.shares_much(&choice.sides, extents.parts))
            && let Some((choice, at)) = self.by_plane::<N>(&parts, extents.parts)
            && by_centers.is_none_or(|other| choice.cost < other.cost)
            && let Some(sides) = self.cut_all(&parts, choice.axis, at, n_spare)
        {
            return sides;
        }
        match by_centers {
            Some(choice) => self.take_apart::<N>(parts, extents.centers, &choice),
            None => halve(parts),
        }
    }

    /// Twice the centre of a part, in the scaled scene.
    #[inline(always)]
    fn center(&self, part: &Part) -> Vec3A {
        self.scale.point(part.space.lo) + self.scale.point(part.space.hi)
    }

    fn shares_much(&self, [low, high]: &[Side; 2], whole: Space) -> bool {
        let area = |space: Space| self.scale.half_area_between(space.lo, space.hi);
        let shared = low.space.common(high.space);
        !shared.is_empty() && area(shared) > self.least_shared && area(shared) > SHARED * area(whole)
    }

    /// The best division between bins of centres; `None` where all have one.
    fn by_centers<const N: usize>(&self, parts: &[Part], centers: Space) -> Option<Choice> {
        let bins_per_unit = N as f32 / (centers.hi - centers.lo);
        let mut bins = [[Bin::NONE; N]; 3];
        for part in parts {
            let place = (self.center(part) - centers.lo) * bins_per_unit;
            for axis in 0..3 {
                bins[axis][bin(place[axis], N)].add(part.space, part.n_items);
            }
        }
        let mut best = None;
        for axis in (0..3).filter(|&axis| bins_per_unit[axis].is_finite()) {
            sweep(self.scale, &bins[axis], axis, &mut best);
        }
        best
    }

    /// The parts on either side of a division between bins of centres.
    fn take_apart<const N: usize>(&self, mut parts: Vec<Part>, centers: Space, choice: &Choice) -> [Vec<Part>; 2] {
        let &Choice { axis, bin: first, .. } = choice;
        let bins_per_unit = N as f32 / (centers.hi - centers.lo);
        let mut high = Vec::with_capacity(parts.len());
        parts.retain(|part| {
            let is_low = bin((self.center(part)[axis] - centers.lo[axis]) * bins_per_unit[axis], N) < first;
            if !is_low {
                high.push(*part);
            }
            is_low
        });
        [parts, high]
    }

    /// The best plane, if parts could be cut as often as they like.
    fn by_plane<const N: usize>(&self, parts: &[Part], whole: Space) -> Option<(Choice, f32)> {
        let mut best = None;
        for axis in 0..3 {
            let Some(planes) = Planes::<N>::across(whole, axis) else { continue };
            let mut bins = [Bin::NONE; N];
            for part in parts {
                let span = planes.span(part.space);
                let [first, last] = span;
                if first == last || !self.is_cuttable(part) {
                    bins[(first + last) / 2].add(part.space, part.n_items);
                    continue;
                }
                bins[first].n_begin += part.n_items;
                bins[last].n_end += part.n_items;
                if planes.is_thin(part.space) {
                    planes.add_box(&mut bins, span, part.space);
                } else {
                    for corners in self.triangles(part) {
                        planes.add_triangle(&mut bins, span, corners, part.space);
                    }
                }
            }
            sweep(self.scale, &bins, axis, &mut best);
        }
        let choice = best?;
        Some((choice, Planes::<N>::across(whole, choice.axis)?.below(choice.bin)))
    }

    /// The parts on either side of a plane, cut there as often as there is something to spare; `None` when one side has none.
    ///
    /// A part goes to one side as a whole where that costs less than both halves (Stich et al., section 4.4).
    fn cut_all(&self, parts: &[Part], axis: usize, at: f32, mut n_spare: usize) -> Option<[Vec<Part>; 2]> {
        // What lies on one side goes there; all others as if all were cut.
        let mut lists = [Vec::with_capacity(parts.len()), Vec::new()];
        let mut sides = [Side::NONE; 2];
        let mut across = Vec::new();
        for part in parts {
            let own = if part.space.hi[axis] <= at { 0 } else { 1 };
            if own == 0 || part.space.lo[axis] >= at {
                lists[own].push(*part);
                sides[own] = sides[own].and(part.space, part.n_items);
                continue;
            }
            let halves = self.halves(part, axis, at);
            for (side, half) in sides.iter_mut().zip(halves) {
                *side = side.and(half, part.n_items);
            }
            across.push((*part, halves));
        }

        // Then one after the other as is best.
        for (part, halves) in across {
            let n_items = part.n_items;
            let [low, high] = sides;
            let without = |side: Side| Side { n_items: side.n_items - n_items, ..side };
            let wholes = [[low.and(part.space, 0), without(high)], [without(low), high.and(part.space, 0)]];
            let costs = wholes.map(|sides| cost(self.scale, &sides));
            let may_cut = n_items as usize <= n_spare && self.is_cuttable(&part) && !halves.iter().any(Space::is_empty);
            let cheapest = if costs[0] <= costs[1] { 0 } else { 1 };
            if may_cut && cost(self.scale, &sides) <= costs[cheapest] {
                n_spare -= n_items as usize;
                for (list, space) in lists.iter_mut().zip(halves) {
                    list.push(Part { space, ..part });
                }
            } else {
                sides = wholes[cheapest];
                lists[cheapest].push(part);
            }
        }
        lists.iter().all(|list| !list.is_empty()).then_some(lists)
    }

    /// Boxes around what of a part lies on either side of a plane.
    fn halves(&self, part: &Part, axis: usize, at: f32) -> [Space; 2] {
        if !self.is_cuttable(part) {
            return [part.space; 2];
        }
        let mut halves = [Space::NONE; 2];
        for corners in self.triangles(part) {
            for (half, of_one) in halves.iter_mut().zip(cut(corners, part.space, axis, at)) {
                if !of_one.is_empty() {
                    *half = half.union(of_one);
                }
            }
        }
        halves
    }

    /// Whether a part has nothing but triangles. Other primitives are tested one by one and had better not be tested twice.
    fn is_cuttable(&self, part: &Part) -> bool {
        self.items_of(part).iter().all(|item| matches!(item, Item::Prim(prim) if prim.kind() == PrimKind::Triangle))
    }

    fn triangles(&self, part: &Part) -> impl Iterator<Item = [Vec3; 3]> {
        self.items_of(part).iter().filter_map(|item| match item {
            Item::Prim(prim) => Some(self.world.triangles.corners(prim.row())),
            Item::List(_) => None,
        })
    }

    fn items_of(&self, part: &Part) -> &[Item] {
        &self.items[part.first as usize..][..part.n_items as usize]
    }
}
