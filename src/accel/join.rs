//! One wide tree from pieces.

use std::ops::Range;

use rayon::prelude::*;

use super::slab::WIDTH;
use super::wide::{N_BEHIND, Tag, WideNode, WideTree};
use crate::simd::{move_to_large_pages, prefer_large_pages};
use crate::world::{PrimKind, World};

impl WideTree {
    /// Hangs trees into slots of the topmost, which come as node and slot.
    pub fn join(mut top: WideTree, slots: &[(u32, usize)], mut pieces: Vec<WideTree>) -> WideTree {
        let mut end = top.sizes();
        let mut starts = Vec::with_capacity(pieces.len());
        for piece in &pieces {
            starts.push(end);
            let size = piece.sizes();
            end = std::array::from_fn(|i| end[i] + size[i]);
        }
        pieces
            .par_iter_mut()
            .zip(&starts)
            .for_each(|(piece, start)| piece.nodes.par_iter_mut().for_each(|n| shift(n, start)));
        for (&(node, slot), start) in slots.iter().zip(&starts) {
            top.nodes[node as usize].child[slot] = start[0] as u32;
        }
        top.nodes.reserve_exact(end[0] - top.nodes.len());
        top.triangle_rows.reserve_exact(end[1] - top.triangle_rows.len());
        top.sphere_rows.reserve_exact(end[2] - top.sphere_rows.len());
        top.prims.reserve_exact(end[3] - top.prims.len());
        prefer_large_pages(&mut top.nodes);
        prefer_large_pages(&mut top.triangle_rows);
        for piece in pieces {
            top.nodes.extend_from_slice(&piece.nodes);
            top.triangle_rows.extend_from_slice(&piece.triangle_rows);
            top.sphere_rows.extend_from_slice(&piece.sphere_rows);
            top.prims.extend_from_slice(&piece.prims);
            top.has_shared_leaves |= piece.has_shared_leaves;
        }
        top
    }

    /// Nodes, and rows of triangles, of spheres and of other primitives.
    pub fn sizes(&self) -> [usize; 4] {
        [self.nodes.len(), self.triangle_rows.len(), self.sphere_rows.len(), self.prims.len()]
    }

    /// Copies the numbers of triangles and spheres into the order of leaves.
    pub fn fill_columns(&mut self, world: &World) {
        self.corners = columns(&self.leaves_of(PrimKind::Triangle), &self.triangle_rows, |row| {
            let [a, b, c] = world.triangles.corners(row);
            [a.x, a.y, a.z, b.x, b.y, b.z, c.x, c.y, c.z]
        });
        self.spheres = columns(&self.leaves_of(PrimKind::Sphere), &self.sphere_rows, |row| {
            let center = world.spheres.centers[row];
            [center.x, center.y, center.z, world.spheres.radii[row]]
        });
    }

    /// Puts what rays read into large pages.
    pub fn move_to_large_pages(&mut self) {
        move_to_large_pages(&mut self.nodes);
        move_to_large_pages(&mut self.corners);
        move_to_large_pages(&mut self.spheres);
        move_to_large_pages(&mut self.triangle_rows);
    }

    /// The rows of each leaf of a kind, in order. A leaf that stands in several nodes comes once.
    fn leaves_of(&self, kind: PrimKind) -> Vec<Range<usize>> {
        let of_node = |node| leaves_of(node, kind);
        let mut leaves: Vec<Range<usize>> = self.nodes.par_iter().flat_map_iter(of_node).collect();
        leaves.par_sort_unstable_by_key(|leaf| leaf.start);
        leaves.dedup();
        leaves
    }
}

/// Columns of N numbers of each row, leaf by leaf, and [`N_BEHIND`] zeros behind them.
fn columns<T: Copy + Default + Send, const N: usize>(
    leaves: &[Range<usize>],
    rows: &[u32],
    of: impl Fn(usize) -> [T; N] + Sync,
) -> Vec<T> {
    if rows.is_empty() {
        return Vec::new();
    }
    let mut all = vec![T::default(); N * rows.len() + N_BEHIND];
    prefer_large_pages(&mut all);
    let (mut rest, mut pieces) = (all.as_mut_slice(), Vec::new());
    for piece in leaves.chunks(1024) {
        let n_rows: usize = piece.iter().map(Range::len).sum();
        let (numbers, behind) = rest.split_at_mut(N * n_rows);
        pieces.push((piece, numbers));
        rest = behind;
    }
    pieces.into_par_iter().for_each(|(piece, mut numbers)| {
        for leaf in piece {
            let (columns, behind) = numbers.split_at_mut(N * leaf.len());
            for (i, &row) in rows[leaf.clone()].iter().enumerate() {
                for (c, value) in of(row as usize).into_iter().enumerate() {
                    columns[c * leaf.len() + i] = value;
                }
            }
            numbers = behind;
        }
    });
    all
}

/// Moves what a node points to behind so many nodes, rows of triangles and of spheres, and other primitives.
pub fn shift(node: &mut WideNode, [nodes, triangles, spheres, prims]: &[usize; 4]) {
    for slot in 0..WIDTH {
        let by = match (node.tag(slot), node.tag(slot).kind()) {
            (Tag::NODE, _) => nodes,
            (_, PrimKind::Triangle) => triangles,
            (_, PrimKind::Sphere) => spheres,
            (_, PrimKind::Quadric | PrimKind::Instance) => prims,
        };
        node.child[slot] += *by as u32;
    }
}

/// The rows of each leaf of a kind.
fn leaves_of(node: &WideNode, kind: PrimKind) -> impl Iterator<Item = Range<usize>> + '_ {
    let is_one = move |&slot: &usize| node.tag(slot) != Tag::NODE && node.tag(slot).kind() == kind;
    let rows = |slot: usize| node.child[slot] as usize..node.child[slot] as usize + node.tag(slot).n_prims();
    (0..WIDTH).filter(is_one).map(rows)
}
