//! One wide tree from pieces.

use std::ops::Range;

use rayon::prelude::*;

use super::slab::WIDTH;
use super::wide::{MAX_LEAF, N_COORDINATES, Tag, WideNode, WideTree};
use crate::world::{PrimKind, World};

impl WideTree {
    /// Hangs trees into slots of the topmost, which come as node and slot.
    pub fn join(mut top: WideTree, slots: &[(u32, usize)], mut pieces: Vec<WideTree>) -> WideTree {
        let sizes = |tree: &WideTree| [tree.nodes.len(), tree.triangle_rows.len(), tree.prims.len()];
        let mut end = sizes(&top);
        let mut starts = Vec::with_capacity(pieces.len());
        for piece in &pieces {
            starts.push(end);
            let size = sizes(piece);
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
        top.prims.reserve_exact(end[2] - top.prims.len());
        for piece in pieces {
            top.nodes.extend_from_slice(&piece.nodes);
            top.triangle_rows.extend_from_slice(&piece.triangle_rows);
            top.prims.extend_from_slice(&piece.prims);
            top.has_shared_leaves |= piece.has_shared_leaves;
        }
        top
    }

    /// Copies the corners of triangles into the order of leaves.
    pub fn fill_corners(&mut self, world: &World) {
        let mut leaves: Vec<Range<usize>> = self.nodes.par_iter().flat_map_iter(triangle_leaves).collect();
        // A leaf that stands in several nodes is copied once.
        leaves.par_sort_unstable_by_key(|leaf| leaf.start);
        leaves.dedup();
        self.corners = vec![0.0; N_COORDINATES * self.triangle_rows.len() + MAX_LEAF];
        let (mut rest, mut columns) = (self.corners.as_mut_slice(), Vec::new());
        for piece in leaves.chunks(1024) {
            let n_rows: usize = piece.iter().map(Range::len).sum();
            let (corners, behind) = rest.split_at_mut(N_COORDINATES * n_rows);
            columns.push((piece, corners));
            rest = behind;
        }
        let rows = &self.triangle_rows;
        columns.into_par_iter().for_each(|(piece, mut corners)| {
            for leaf in piece {
                let (columns, behind) = corners.split_at_mut(N_COORDINATES * leaf.len());
                for (i, &row) in rows[leaf.clone()].iter().enumerate() {
                    let triangle = world.triangles.corners(row as usize);
                    for (c, value) in triangle.iter().flat_map(|corner| corner.to_array()).enumerate() {
                        columns[c * leaf.len() + i] = value;
                    }
                }
                corners = behind;
            }
        });
    }
}

/// Moves what a node points to behind so many nodes, rows of triangles and other primitives.
pub fn shift(node: &mut WideNode, [nodes, rows, prims]: &[usize; 3]) {
    for slot in 0..WIDTH {
        let by = match (node.tag(slot), node.tag(slot).kind()) {
            (Tag::NODE, _) => nodes,
            (_, PrimKind::Triangle) => rows,
            (_, PrimKind::Sphere | PrimKind::Quadric | PrimKind::Instance) => prims,
        };
        node.child[slot] += *by as u32;
    }
}

/// The rows of each leaf of triangles.
fn triangle_leaves(node: &WideNode) -> impl Iterator<Item = Range<usize>> + '_ {
    let is_triangles = |&slot: &usize| node.tag(slot) != Tag::NODE && node.tag(slot).kind() == PrimKind::Triangle;
    let rows = |slot: usize| node.child[slot] as usize..node.child[slot] as usize + node.tag(slot).n_prims();
    (0..WIDTH).filter(is_triangles).map(rows)
}
