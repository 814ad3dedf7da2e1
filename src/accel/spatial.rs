//! A binary tree from the top down that cuts large triangles in space where that keeps boxes apart: Stich, Friedrich and
//! Dietrich, *Spatial Splits in Bounding Volume Hierarchies*, High Performance Graphics 2009.
//!
//! A long triangle fills little of its box, and a large one reaches into many parts of a scene. Where a plane divides better
//! than any grouping of whole boxes, what lies across it goes to both sides, each with the box of its part. A part is a box and
//! the whole triangle: a ray that meets the triangle meets it inside of one of the boxes, and whichever leaf it finds it in,
//! the hit is the same.
//!
//! Meshes gain nothing from cutting, whose triangles are all about as large as their share of the scene: only where a ray would
//! meet boxes many times as large is anything cut.
//!
//! Departures from the paper: what is divided are clusters, all triangles of one being cut at once; a part may only be cut while
//! its side has boxes to spare, of which each side gets a share by what lies in it; and a subtree costs what its leaves of
//! [`MAX_LEAF`](super::wide::MAX_LEAF) do, not what its triangles do.

mod cut;
mod divide;
mod weigh;

use glam::{BVec3A, Vec3A};
use rayon::prelude::*;

use super::area::Scale;
use super::duplicate::{Cluster, Groups};
use crate::world::{Bounds, World};
use divide::Divider;

/// A subtree.
pub enum Branch {
    /// A small one.
    Piece(Piece),
    /// Two subtrees.
    Inner(Box<[Branch; 2]>),
}

/// A tree in lists: the root is the first node, and children stand side by side behind their parents.
#[derive(Default)]
pub struct Piece {
    /// The nodes.
    pub nodes: Vec<Node>,
    /// Clusters and parts of clusters.
    pub clusters: Vec<Cluster>,
    /// Levels.
    pub depth: usize,
}

/// A node of a piece.
#[derive(Clone, Copy, Debug)]
pub enum Node {
    /// The place of its cluster.
    Leaf(u32),
    /// The place of the first of its two children.
    Inner(u32),
}

/// A box is large when its area is so many times an equal share of the scene's. Those of meshes are mostly below ten.
const LARGE: f64 = 16.0;

/// So many large boxes a random ray through the scene must meet for cutting to be worth it. In meshes it is 0.2 at most, in
/// a building of slabs, columns and pipes 33. Where it is hundreds, nearly everything is large: slivers in all directions, or many in one
/// box ([`super::sliver`]).
const LARGE_MET: std::ops::Range<f64> = 4.0..400.0;

/// Boxes that are summed up at a time.
const CHUNK: usize = 4096;

/// Parts from which on both sides of a division may be worked on at once; fewer are one piece.
const MANY: usize = 2048;

/// Levels below which parts are halved by their place in the list, so that the depth of the recursion is bounded. A level of
/// this depth takes boxes that differ in size by many powers of two.
const MAX_DEPTH: usize = 128;

/// Whether cutting is worth it among these boxes.
pub fn is_worth_it(boxes: &[Bounds], scale: &Scale) -> bool {
    let whole = f64::from(scale.half_area(&scale.whole));
    let large = LARGE * whole / boxes.len() as f64;
    let area = |b: &Bounds| Some(f64::from(scale.half_area(b))).filter(|&area| area > large).unwrap_or(0.0);
    // Runs in their order, so that the sum does not depend on threads.
    let sums: Vec<f64> = boxes.par_chunks(CHUNK).map(|run| run.iter().map(area).sum()).collect();
    LARGE_MET.contains(&(sums.iter().sum::<f64>() / whole))
}

/// The tree over clusters, none over none; it has up to `share` times as many items more than they.
pub fn build(world: &World, groups: &Groups, share: f64) -> Option<Branch> {
    let parts: Vec<Part> = groups.clusters.iter().map(Part::of).collect();
    if parts.is_empty() {
        return None;
    }
    let n_spare = (share * groups.items.len() as f64) as usize;
    Some(grow(&Divider::of(world, groups), Task { parts, n_spare }, 0))
}

/// What is to be divided on, and how many items more it may have in the end.
struct Task {
    parts: Vec<Part>,
    n_spare: usize,
}

fn grow(divider: &Divider, task: Task, level: usize) -> Branch {
    if task.parts.len() < MANY {
        return Branch::Piece(Piece::of(divider, task, level));
    }
    let [left, right] = task.divide(divider, level);
    let (left, right) = rayon::join(|| grow(divider, left, level + 1), || grow(divider, right, level + 1));
    Branch::Inner(Box::new([left, right]))
}

impl Task {
    fn divide(self, divider: &Divider, level: usize) -> [Task; 2] {
        let Task { parts, n_spare } = self;
        let n_items = items_in(&parts);
        let [left, right] = if level < MAX_DEPTH { divider.divide(parts, n_spare) } else { divide::halve(parts) };
        let (n_left, n_right) = (items_in(&left), items_in(&right));
        let n_spare = n_spare - (n_left + n_right - n_items);
        let spare_left = n_spare * n_left / (n_left + n_right);
        [Task { parts: left, n_spare: spare_left }, Task { parts: right, n_spare: n_spare - spare_left }]
    }
}

impl Piece {
    /// The subtree whose root lies so many levels below that of the tree.
    fn of(divider: &Divider, task: Task, level: usize) -> Piece {
        let mut piece = Piece { nodes: vec![Node::Leaf(0)], ..Piece::default() };
        piece.grow(divider, task, 0, level, 1);
        piece
    }

    fn grow(&mut self, divider: &Divider, task: Task, place: usize, level: usize, depth: usize) {
        if let &[part] = task.parts.as_slice() {
            self.nodes[place] = Node::Leaf(self.clusters.len() as u32);
            self.clusters.push(part.cluster());
            self.depth = self.depth.max(depth);
            return;
        }
        let first = self.nodes.len();
        self.nodes[place] = Node::Inner(first as u32);
        self.nodes.extend([Node::Leaf(0); 2]);
        let [left, right] = task.divide(divider, level);
        self.grow(divider, left, first, level + 1, depth + 1);
        self.grow(divider, right, first + 1, level + 1, depth + 1);
    }
}

fn items_in(parts: &[Part]) -> usize {
    parts.iter().map(|part| part.n_items as usize).sum()
}

/// A cluster as it is divided, or what of it lies in a box.
#[derive(Clone, Copy, Debug)]
struct Part {
    space: Space,
    first: u32,
    n_items: u32,
}

impl Part {
    fn of(cluster: &Cluster) -> Part {
        let Cluster { bounds, first, n_items } = *cluster;
        Part { space: Space::of(&bounds), first, n_items }
    }

    fn cluster(&self) -> Cluster {
        let Part { space, first, n_items } = *self;
        Cluster { bounds: space.bounds(), first, n_items }
    }
}

/// Which component is that of an axis.
static ALONG: [BVec3A; 3] =
    [BVec3A::new(true, false, false), BVec3A::new(false, true, false), BVec3A::new(false, false, true)];

/// A box that may be empty: where a corner of `lo` exceeds that of `hi`.
#[derive(Clone, Copy, Debug)]
struct Space {
    lo: Vec3A,
    hi: Vec3A,
}

impl Space {
    /// Empty, and nothing to a union.
    const NONE: Space = Space { lo: Vec3A::INFINITY, hi: Vec3A::NEG_INFINITY };

    fn of(bounds: &Bounds) -> Space {
        Space { lo: bounds.lo.into(), hi: bounds.hi.into() }
    }

    /// It as a box; it must not be empty.
    fn bounds(&self) -> Bounds {
        Bounds { lo: self.lo.into(), hi: self.hi.into() }
    }

    #[inline(always)]
    fn point(p: Vec3A) -> Space {
        Space { lo: p, hi: p }
    }

    #[inline(always)]
    fn union(self, other: Space) -> Space {
        Space { lo: self.lo.min(other.lo), hi: self.hi.max(other.hi) }
    }

    #[inline(always)]
    fn common(self, other: Space) -> Space {
        Space { lo: self.lo.max(other.lo), hi: self.hi.min(other.hi) }
    }

    /// What of it lies between two planes across an axis.
    #[inline(always)]
    fn between(self, axis: usize, from: f32, to: f32) -> Space {
        // A component by itself would be written to memory and waited for.
        let along = ALONG[axis];
        Space {
            lo: self.lo.max(Vec3A::select(along, Vec3A::splat(from), Vec3A::NEG_INFINITY)),
            hi: self.hi.min(Vec3A::select(along, Vec3A::splat(to), Vec3A::INFINITY)),
        }
    }

    #[inline(always)]
    fn is_empty(&self) -> bool {
        self.lo.cmpgt(self.hi).any()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::duplicate::{self, Item};
    use crate::world::{PrimKind, PrimRef};
    use glam::Vec3;

    /// Long slivers in all directions, and triangles of all shapes and sizes.
    fn soup(n: usize) -> World {
        let mut state = 7_u64;
        let mut random = move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f32 / (1 << 24) as f32 - 0.5
        };
        let mut positions = Vec::new();
        for i in 0..n {
            let scale = [0.01, 0.1, 1.0][i % 3];
            let center = 10.0 * Vec3::new(random(), random(), random());
            let mut near = |size: f32| center + size * Vec3::new(random(), random(), random());
            positions.extend(if i % 2 == 0 {
                [near(0.01), near(0.01), near(20.0)]
            } else {
                [(); 3].map(|()| near(10.0 * scale))
            });
        }
        let triangles = (0..n as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        World::from_triangles(positions, triangles).unwrap()
    }

    fn grouped(world: &World) -> Groups {
        let n = world.triangles.len();
        let prims: Vec<PrimRef> = (0..n).map(|row| PrimRef::new(PrimKind::Triangle, row)).collect();
        let boxes: Vec<Bounds> = (0..n).map(|row| world.triangles.bounds(row)).collect();
        let scale = Scale::of(&boxes);
        duplicate::group(world, &prims, &boxes, scale, 1.0)
    }

    /// Leaves from left to right, and levels.
    fn leaves(root: &Branch) -> (Vec<Cluster>, usize) {
        let (mut leaves, mut depth) = (Vec::new(), 0);
        let mut stack = vec![(root, 1)];
        while let Some((branch, level)) = stack.pop() {
            depth = depth.max(level);
            match branch {
                Branch::Piece(piece) => {
                    depth = depth.max(level + piece.depth - 1);
                    leaves.extend(&piece.clusters);
                }
                Branch::Inner(children) => stack.extend([(&children[1], level + 1), (&children[0], level + 1)]),
            }
        }
        (leaves, depth)
    }

    #[test]
    fn every_point_of_a_triangle_lies_in_one_of_its_boxes_and_the_budget_is_kept() {
        let world = soup(600);
        let groups = grouped(&world);
        let (parts, _) = leaves(&build(&world, &groups, 2.0).unwrap());
        let mut own = vec![Vec::new(); 600];
        for part in &parts {
            for item in &groups.items[part.first as usize..][..part.n_items as usize] {
                let Item::Prim(prim) = item else { panic!("a list") };
                own[prim.row()].push(part.bounds);
            }
        }
        let n_items: usize = own.iter().map(Vec::len).sum();
        assert!((700..=1800).contains(&n_items), "{n_items} boxes");
        for (row, own) in own.iter().enumerate() {
            let [a, b, c] = world.triangles.corners(row).map(|corner| corner.as_dvec3());
            for i in 0..=40 {
                for j in 0..=40 - i {
                    let p = a + (b - a) * (f64::from(i) / 40.0) + (c - a) * (f64::from(j) / 40.0);
                    let inside = |s: &Bounds| p.cmpge(s.lo.as_dvec3()).all() && p.cmple(s.hi.as_dvec3()).all();
                    assert!(own.iter().any(inside), "{row}: {p}");
                }
            }
        }
        let area = |clusters: &[Cluster]| clusters.iter().map(|c| groups.scale.half_area(&c.bounds)).sum::<f32>();
        let (whole, _) = leaves(&build(&world, &groups, 0.0).unwrap());
        assert_eq!(whole.len(), groups.clusters.len(), "nothing to spare, nothing cut");
        assert!(area(&parts) < 0.9 * area(&whole), "{} of {}", area(&parts), area(&whole));
    }

    #[test]
    fn trees_do_not_depend_on_threads() {
        let world = soup(6000);
        let groups = grouped(&world);
        let on = |n_threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().unwrap();
            let (leaves, depth) = leaves(&pool.install(|| build(&world, &groups, 0.5)).unwrap());
            let bits =
                |c: &Cluster| (c.bounds.lo.to_array().map(f32::to_bits), c.bounds.hi.to_array().map(f32::to_bits));
            (leaves.iter().map(|c| (bits(c), c.first, c.n_items)).collect::<Vec<_>>(), depth)
        };
        assert_eq!(on(1), on(3));
    }

    #[test]
    fn boxes_of_all_magnitudes_do_not_make_a_chain() {
        // Each is twice as far away as the one before, many times over.
        let mut positions = Vec::new();
        for i in 0..3000 {
            let at = 2.0_f32.powi(i % 200 - 100);
            positions.extend([
                Vec3::new(at, i as f32, 0.0),
                Vec3::new(1.5 * at, i as f32, at),
                Vec3::new(at, i as f32, 0.5 * at),
            ]);
        }
        let triangles = (0..3000).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let world = World::from_triangles(positions, triangles).unwrap();
        let groups = grouped(&world);
        let (leaves, depth) = leaves(&build(&world, &groups, 0.3).unwrap());
        assert!(leaves.len() >= groups.clusters.len());
        assert!(depth <= MAX_DEPTH + 16, "{depth} levels");
    }
}
