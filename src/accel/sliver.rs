//! Bundles of triangles that share one box, cut in space.
//!
//! A sliver fills little of its box, and when a hundred thousand share a box a ray that passes beside them all should
//! test none. So the box is cut into slices along its longest axis, and each slice has a tree over boxes that are as
//! tight as the pieces of the triangles in it (the idea of early split clipping, Ernst and Greiner 2007). The triangles
//! themselves stand in leaves of neighbours that all slices share, and a ray tests each of them once.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::piece::{Piece, clip_error};
use super::wide::{Entry, MAX_LEAF, Tag, WideNode, WideTree};
use super::{join, morton};
use crate::world::{Bounds, PrimRef, World};

/// Triangles in one box from which on they are cut in space. Below, testing all of them costs less than more boxes.
pub const BUNDLE: usize = 64;

/// Slices of a bundle. A slice costs a box per leaf, four bytes per triangle.
const N_SLICES: usize = 32;

impl WideTree {
    /// Appends a bundle of triangles.
    pub fn push_bundle(&mut self, world: &World, bundle: &[PrimRef]) -> Entry {
        let mut members = bundle.to_vec();
        sort_by_place(world, &mut members);
        let leaves: Vec<Entry> = members
            .chunks_mut(MAX_LEAF)
            .map(|leaf| {
                leaf.sort_unstable();
                self.push_leaf(world, leaf)
            })
            .collect();
        let slices: Vec<[Option<Bounds>; N_SLICES]> =
            members.par_chunks(MAX_LEAF).map(|leaf| slices_of(world, leaf)).collect();
        let tree_of = |slice: usize| {
            let in_slice = leaves.iter().zip(&slices).filter_map(|(leaf, boxes)| {
                boxes[slice].map(|bounds| Entry { bounds, tag: leaf.tag.shared(), ..*leaf })
            });
            let mut tree = WideTree::default();
            let root = tree.push_balanced(in_slice.collect());
            (tree.nodes, root)
        };
        let trees: Vec<(Vec<WideNode>, Option<Entry>)> = (0..N_SLICES).into_par_iter().map(tree_of).collect();
        let roots = trees.into_iter().filter_map(|(nodes, root)| Some(self.append_nodes(nodes, root?))).collect();
        self.has_shared_leaves = true;
        self.push_balanced(roots).unwrap_or(leaves[0])
    }

    /// Appends the nodes of a tree whose leaves are here already.
    fn append_nodes(&mut self, mut nodes: Vec<WideNode>, mut root: Entry) -> Entry {
        let by = [self.nodes.len(), 0, 0, 0];
        nodes.iter_mut().for_each(|node| join::shift(node, &by));
        self.nodes.append(&mut nodes);
        if root.tag == Tag::NODE {
            root.child += by[0] as u32;
        }
        root
    }
}

/// Sorts triangles along a Morton curve through their centres.
fn sort_by_place(world: &World, members: &mut [PrimRef]) {
    let center = |prim: &PrimRef| world.triangles.corners(prim.row()).iter().map(|c| c.as_dvec3()).sum::<DVec3>();
    let (lo, hi) =
        members.iter().map(center).fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(lo, hi), c| (lo.min(c), hi.max(c)));
    let place = |prim: &PrimRef| morton::place(((center(prim) - lo) / (hi - lo)).as_vec3(), 10);
    members.par_sort_by_cached_key(|prim| (place(prim), *prim));
}

/// The boxes of a leaf's pieces in each slice of the box that the bundle shares; `None` where it has none.
fn slices_of(world: &World, leaf: &[PrimRef]) -> [Option<Bounds>; N_SLICES] {
    // All triangles of the bundle have the same box.
    let whole = world.triangles.bounds(leaf[0].row());
    let extent = whole.extent();
    let axis = (0..3).max_by(|&i, &j| extent[i].total_cmp(&extent[j])).unwrap_or(0);
    let planes: [f64; N_SLICES + 1] = std::array::from_fn(|i| match i {
        // The outermost planes are those of the box, whatever their rounding.
        0 => f64::from(whole.lo[axis]),
        N_SLICES => f64::from(whole.hi[axis]),
        _ => f64::from(whole.lo[axis]) + extent[axis] * (i as f64 / N_SLICES as f64),
    });
    let mut pieces = [Piece::EMPTY; N_SLICES];
    for prim in leaf {
        clip(&mut pieces, world.triangles.corners(prim.row()), axis, &planes);
    }
    pieces.map(|piece| piece.bounds(whole))
}

/// Adds to each piece the part of a triangle between two planes across an axis, widened by the rounding of the clipping.
fn clip(pieces: &mut [Piece; N_SLICES], corners: [Vec3; 3], axis: usize, planes: &[f64; N_SLICES + 1]) {
    let corners = corners.map(|corner| corner.as_dvec3());
    let error = clip_error(&corners);
    for i in 0..3 {
        let (a, b) = (corners[i], corners[(i + 1) % 3]);
        for (piece, slice) in pieces.iter_mut().zip(planes.windows(2)) {
            if (slice[0]..=slice[1]).contains(&a[axis]) {
                piece.include(a, error);
            }
        }
        let slope = (b - a) / (b[axis] - a[axis]);
        for (i, &plane) in planes.iter().enumerate().filter(|&(_, plane)| (a[axis] < *plane) != (b[axis] < *plane)) {
            // A plane ends one slice and begins the next.
            let p = a + slope * (plane - a[axis]);
            for piece in &mut pieces[i.saturating_sub(1)..N_SLICES.min(i + 1)] {
                piece.include(p, error);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_point_of_a_triangle_lies_in_a_slice() {
        let corners = [Vec3::new(0.1, 0.3, -7.0), Vec3::new(5.0, 4.0, 3.0), Vec3::new(1.0, 1.1, 2.0)];
        let world = World::from_triangles(corners.to_vec(), vec![[0, 1, 2]]).unwrap();
        let slices = slices_of(&world, &[PrimRef::new(crate::world::PrimKind::Triangle, 0)]);
        let slices: Vec<Bounds> = slices.into_iter().flatten().collect();
        assert_eq!(slices.len(), N_SLICES);
        let [a, b, c] = corners.map(|corner| corner.as_dvec3());
        for i in 0..=100 {
            for j in 0..=100 - i {
                let p = a + (b - a) * (f64::from(i) / 100.0) + (c - a) * (f64::from(j) / 100.0);
                let inside = |s: &Bounds| p.cmpge(s.lo.as_dvec3()).all() && p.cmple(s.hi.as_dvec3()).all();
                assert!(slices.iter().any(inside), "{p}");
            }
        }
        let volume = |b: &Bounds| b.extent().element_product();
        let all: f64 = slices.iter().map(volume).sum();
        let whole = world.bounds().map_or(0.0, |b| volume(&b));
        assert!(all < 0.25 * whole, "slices of {all} in a box of {whole}");
    }
}
