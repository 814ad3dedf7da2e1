//! Leaves, and small balanced trees over lists that the builder does not see.

use glam::Vec3;

use super::slab::WIDTH;
use super::sliver::BUNDLE;
use super::slot;
use super::wide::{Entry, MAX_LEAF, Tag, WideNode, WideTree};
use crate::world::{Bounds, PrimKind, PrimRef, World};

/// The box of what has none; only unbounded primitives lack one, and they never come here.
const EVERYTHING: Bounds = Bounds { lo: Vec3::MIN, hi: Vec3::MAX };

impl WideTree {
    /// Appends a leaf: 1 to [`MAX_LEAF`] primitives of one kind. Corners and spheres come when all leaves are there.
    pub fn push_leaf(&mut self, world: &World, run: &[PrimRef]) -> Entry {
        let kind = run[0].kind();
        let first = match kind {
            PrimKind::Triangle => {
                let first = self.triangle_rows.len();
                self.triangle_rows.extend(run.iter().map(|prim| prim.row() as u32));
                first
            }
            PrimKind::Sphere => {
                let first = self.sphere_rows.len();
                self.sphere_rows.extend(run.iter().map(|prim| prim.row() as u32));
                first
            }
            PrimKind::Quadric | PrimKind::Instance => {
                let first = self.prims.len();
                self.prims.extend_from_slice(run);
                first
            }
        };
        let bounds = run.iter().filter_map(|prim| prim.bounds(world)).reduce(Bounds::union).unwrap_or(EVERYTHING);
        Entry { bounds, child: first as u32, tag: Tag::leaf(kind, run.len()) }
    }

    /// Appends primitives that share one box, in order of ids: cut by kind, then by index or, where they are many
    /// triangles, in space.
    pub fn push_list(&mut self, world: &World, list: &[PrimRef]) -> Entry {
        let mut entries = Vec::new();
        for part in list.chunk_by(|a, b| a.kind() == b.kind()) {
            if part.len() >= BUNDLE && part[0].kind() == PrimKind::Triangle {
                entries.push(self.push_bundle(world, part));
            } else {
                entries.extend(part.chunks(MAX_LEAF).map(|leaf| self.push_leaf(world, leaf)));
            }
        }
        let first = entries[0];
        self.push_balanced(entries).unwrap_or(first)
    }

    /// Appends nodes over entries in their order until one is left: log₈ n levels. `None` when there are none.
    pub fn push_balanced(&mut self, mut entries: Vec<Entry>) -> Option<Entry> {
        while entries.len() > 1 {
            entries = entries.chunks(WIDTH).map(|children| self.push_node(children)).collect();
        }
        entries.pop()
    }

    fn push_node(&mut self, children: &[Entry]) -> Entry {
        let mut node = WideNode::EMPTY;
        let boxes: Vec<Bounds> = children.iter().map(|child| child.bounds).collect();
        for (child, slot) in children.iter().zip(slot::assign(&boxes)) {
            node.set(slot, child);
        }
        let bounds = boxes.into_iter().reduce(Bounds::union).unwrap_or(EVERYTHING);
        self.nodes.push(node);
        Entry { bounds, child: self.nodes.len() as u32 - 1, tag: Tag::NODE }
    }

    /// Finds the levels on the longest path.
    pub fn measure_depth(&mut self) {
        let mut stack = vec![(0u32, 1usize)];
        while let Some((index, depth)) = stack.pop() {
            self.depth = self.depth.max(depth);
            let node = &self.nodes[index as usize];
            let inner = node.slots().filter(|&slot| node.tag(slot) == Tag::NODE);
            stack.extend(inner.map(|slot| (node.child[slot], depth + 1)));
        }
    }
}
