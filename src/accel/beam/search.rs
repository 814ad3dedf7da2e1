//! Beams through the tree, and through all primitives.

use super::super::single::FEW_ITEMS;
use super::super::wide::{Tag, WideTree};
use super::super::{Accel, AccelKind};
use super::{Beam, quadric};
use crate::simd::{Batch, Simd, set_bits};
use crate::world::{PrimKind, PrimRef, World, prim};

impl Accel {
    /// Whether some primitive may have a part in a pyramid, all of which is nearer than a depth; with an infinite depth,
    /// whether there may be anything in it at all. No is certain for every primitive whose box is nearer as a whole; yes
    /// may be wrong. Triangles are cut at the sides, and a sphere or quadric is there where a ray of the pyramid may have a
    /// root; one that is clipped, where a root may lie in the clip. A part that goes on behind the depth
    /// is not what is asked for: the surface that is seen through the pyramid is none that is nearer.
    pub fn anything_nearer(&self, world: &World, beam: &Beam, depth: f64) -> bool {
        let beam = beam.thickened(world);
        let mut is_there = false;
        self.isa.dispatch(Search { accel: self, world, beam: &beam, depth, is_there: &mut is_there });
        is_there
    }
}

struct Search<'a> {
    accel: &'a Accel,
    world: &'a World,
    beam: &'a Beam,
    depth: f64,
    is_there: &'a mut bool,
}

impl Batch for Search<'_> {
    #[inline(always)]
    fn run<S: Simd>(self, _simd: S) {
        let Search { accel, world, beam, depth, is_there } = self;
        *is_there = match accel.kind {
            AccelKind::Linear => prim::all(world).any(|prim| is_held(world, prim, beam, depth)),
            AccelKind::Bvh => {
                accel.unbounded.iter().any(|&prim| is_held(world, prim, beam, depth))
                    || walk(&accel.tree, world, beam, depth)
            }
        };
    }
}

/// Whether a primitive is in the pyramid and nearer, by itself.
fn is_held(world: &World, prim: PrimRef, beam: &Beam, depth: f64) -> bool {
    let bounds = prim.bounds(world);
    if bounds.is_some_and(|bounds| !beam.meets_box(&bounds, depth)) {
        return false;
    }
    let row = prim.row();
    match prim.kind() {
        PrimKind::Sphere => {
            let surface = quadric::ball(world.spheres.centers[row], world.spheres.radii[row]);
            beam.holds_quadric(&surface, None, bounds, depth)
        }
        PrimKind::Quadric => {
            let clip = world.quadrics.clips.get(row).and_then(Option::as_ref);
            beam.holds_quadric(&world.quadrics.surfaces[row], clip, bounds, depth)
        }
        PrimKind::Triangle => beam.holds_triangle(world.triangles.corners(row), depth),
        PrimKind::Instance => {
            let beam = beam.placed(&world.instances, row);
            let mut rows = world.prototypes.rows(world.instances.prototypes[row]);
            rows.any(|row| beam.holds_triangle(world.triangles.corners(row), depth))
        }
    }
}

/// Whether anything of a tree is in the pyramid and nearer.
#[inline(always)]
fn walk(tree: &WideTree, world: &World, beam: &Beam, depth: f64) -> bool {
    if tree.nodes.is_empty() {
        return false;
    }
    let (mut few, mut many) = ([0; FEW_ITEMS], Vec::new());
    let n_items = tree.stack_size();
    let nodes: &mut [u32] = if n_items <= FEW_ITEMS {
        &mut few
    } else {
        many.resize(n_items, 0);
        &mut many
    };
    // The root is node 0.
    let mut n_nodes = 1;
    while n_nodes > 0 {
        n_nodes -= 1;
        let node = &tree.nodes[nodes[n_nodes] as usize];
        let in_use = node.slots().fold(0, |bits, slot| bits | 1 << slot);
        for slot in set_bits(beam.meets_children(&node.slabs, depth) & in_use) {
            let (child, tag) = (node.child[slot], node.tag(slot));
            if tag == Tag::NODE {
                nodes[n_nodes] = child;
                n_nodes += 1;
            } else if is_leaf_held(tree, world, child as usize, tag, beam, depth) {
                return true;
            }
        }
    }
    false
}

#[inline(always)]
fn is_leaf_held(tree: &WideTree, world: &World, first: usize, tag: Tag, beam: &Beam, depth: f64) -> bool {
    let n_prims = tag.n_prims();
    if tag.is_triangles() {
        return (0..n_prims).any(|i| beam.holds_triangle(tree.corners_of(first, n_prims, i), depth));
    }
    let rows = first..first + n_prims;
    if tag.kind() == PrimKind::Sphere {
        let is_sphere_held = |&row: &u32| is_held(world, PrimRef::new(PrimKind::Sphere, row as usize), beam, depth);
        return tree.sphere_rows[rows].iter().any(is_sphere_held);
    }
    tree.prims[rows].iter().any(|&prim| match prim.kind() {
        PrimKind::Instance => is_placed_held(tree, world, prim.row(), beam, depth),
        _ => is_held(world, prim, beam, depth),
    })
}

/// Whether anything of a placement is, by the tree of its prototype.
fn is_placed_held(tree: &WideTree, world: &World, row: usize, beam: &Beam, depth: f64) -> bool {
    if !beam.meets_box(&world.instances.bounds[row], depth) {
        return false;
    }
    let below = &tree.prototypes[world.instances.prototypes[row].idx()];
    walk(below, world, &beam.placed(&world.instances, row), depth)
}
