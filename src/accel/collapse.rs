//! From the binary tree to the wide one: which subtrees become leaves, and which eight boxes share a node.

use glam::Vec3;

use super::build::BinaryTree;
use super::duplicate::{Groups, Item};
use super::slab::WIDTH;
use super::wide::{Entry, MAX_LEAF, Tag, WideNode, WideTree};
use crate::world::{Bounds, PrimKind, PrimRef, World};

/// Cost of one level of the binary tree in units of a primitive test. Times hardly change between 1 and 8, for nodes
/// are fetched from memory and leaves stream; at 3 the tree takes two thirds of the memory that it takes at 1.
const LEVEL_COST: f64 = 3.0;

/// Levels of the wide tree below which a subtree is cut into equal runs instead of followed: eight levels of wide
/// nodes hold 16 million leaves, so a path this long is a chain that the builder could not balance.
const MAX_DEPTH: usize = 40;

/// What becomes a child of a wide node.
#[derive(Clone, Copy, Debug)]
enum Child {
    /// A node of the binary tree.
    Subtree(u32),
    /// A run of items in leaf order that is to be cut by index.
    Run { first: u32, n_items: u32 },
}

/// Builds the wide tree.
pub fn collapse(world: &World, groups: &Groups, binary: &BinaryTree) -> WideTree {
    if binary.nodes.is_empty() {
        return WideTree::default();
    }
    let leaf = choose_leaves(binary);
    let mut tree = WideTree { nodes: vec![WideNode::EMPTY], ..WideTree::default() };
    let opener = Opener { world, groups, binary, leaf };
    let mut stack = vec![(0u32, Child::Subtree(0), 1usize)];
    while let Some((index, child, depth)) = stack.pop() {
        let (children, n_children) = opener.children(child, depth);
        let mut node = WideNode::EMPTY;
        let centers: Vec<glam::DVec3> = children[..n_children].iter().map(|&c| opener.bounds(c).center()).collect();
        let places = places(&centers);
        for (&slot, &child) in places.iter().zip(&children[..n_children]) {
            let bounds = opener.bounds(child);
            let entry = match opener.end(child) {
                Some(End::Leaf(run)) => tree.push_leaf(world, &run),
                Some(End::List(list)) => tree.push_list(world, &groups.lists[list as usize]),
                None => {
                    let next = tree.nodes.len() as u32;
                    tree.nodes.push(WideNode::EMPTY);
                    stack.push((next, child, depth + 1));
                    Entry { bounds, child: next, tag: Tag::NODE }
                }
            };
            node.set(slot, &Entry { bounds, ..entry });
        }
        tree.nodes[index as usize] = node;
    }
    tree.measure_depth();
    tree
}

fn places(centers: &[glam::DVec3]) -> Vec<usize> {
    let mean = centers.iter().sum::<glam::DVec3>() / centers.len() as f64;
    let mut options = Vec::new();
    for (i, c) in centers.iter().enumerate() {
        for slot in 0..8usize {
            let s = |k: usize| if slot >> k & 1 == 1 { 1.0 } else { -1.0 };
            options.push(((*c - mean).dot(glam::DVec3::new(s(0), s(1), s(2))), i, slot));
        }
    }
    options.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut places = vec![8; centers.len()];
    let mut used = [false; 8];
    for (_, i, slot) in options {
        if places[i] == 8 && !used[slot] {
            places[i] = slot;
            used[slot] = true;
        }
    }
    places
}

/// Whether each node of the binary tree becomes a leaf: when testing all its primitives is expected to cost no more
/// than walking on (MacDonald and Booth 1990). A leaf holds one kind, so a mixed subtree is never one.
fn choose_leaves(binary: &BinaryTree) -> Vec<bool> {
    let mut cost = vec![0.0f64; binary.nodes.len()];
    let mut leaf = vec![false; binary.nodes.len()];
    for (index, node) in binary.nodes.iter().enumerate().rev() {
        let run = &binary.order[node.first as usize..][..node.n_items as usize];
        let tests = half_area(&node.bounds) * run.len() as f64;
        let as_leaf = if leaf_kind(run).is_some() { tests } else { f64::INFINITY };
        let as_node = match node.children {
            Some([left, right]) => half_area(&node.bounds) * LEVEL_COST + cost[left as usize] + cost[right as usize],
            None => f64::INFINITY,
        };
        leaf[index] = as_leaf <= as_node && as_leaf.is_finite();
        // A list is no leaf of this tree and is opened later.
        cost[index] = as_leaf.min(as_node).min(tests);
    }
    leaf
}

fn half_area(bounds: &Bounds) -> f64 {
    let e = bounds.extent();
    e.x * e.y + e.y * e.z + e.z * e.x
}

/// The kind of a run that fits into a leaf.
fn leaf_kind(run: &[Item]) -> Option<PrimKind> {
    let kind = |item: &Item| match item {
        Item::Prim(prim) => Some(prim.kind()),
        Item::List(_) => None,
    };
    let first = kind(run.first()?)?;
    (run.len() <= MAX_LEAF && run.iter().all(|item| kind(item) == Some(first))).then_some(first)
}

/// What is not opened any further.
enum End {
    Leaf(Vec<PrimRef>),
    List(u32),
}

/// Finds the children of wide nodes.
struct Opener<'a> {
    world: &'a World,
    groups: &'a Groups,
    binary: &'a BinaryTree,
    leaf: Vec<bool>,
}

impl Opener<'_> {
    /// The children of a wide node: the largest is opened until there are eight.
    fn children(&self, root: Child, depth: usize) -> ([Child; WIDTH], usize) {
        let mut children = [root; WIDTH];
        let mut n_children = 1;
        while n_children < WIDTH {
            let openable = (0..n_children).filter(|&i| !self.is_end(children[i]));
            // Of boxes of one size the one with more in it is opened first.
            let key = |i: usize| (half_area(&self.bounds(children[i])), self.run(children[i]).len());
            let largest = openable.max_by(|&i, &j| {
                let ((a, n), (b, m)) = (key(i), key(j));
                a.total_cmp(&b).then(n.cmp(&m))
            });
            let Some(largest) = largest else { break };
            let [left, right] = self.open(children[largest], depth);
            children[largest] = left;
            children[n_children] = right;
            n_children += 1;
        }
        (children, n_children)
    }

    /// The two halves of what is no end.
    fn open(&self, child: Child, depth: usize) -> [Child; 2] {
        if let Child::Subtree(index) = child
            && let Some([left, right]) = self.binary.nodes[index as usize].children
            && depth < MAX_DEPTH
        {
            return [Child::Subtree(left), Child::Subtree(right)];
        }
        let (first, n_items) = self.span(child);
        let cut = n_items / 2;
        [Child::Run { first, n_items: cut }, Child::Run { first: first + cut, n_items: n_items - cut }]
    }

    fn span(&self, child: Child) -> (u32, u32) {
        match child {
            Child::Subtree(index) => {
                let node = &self.binary.nodes[index as usize];
                (node.first, node.n_items)
            }
            Child::Run { first, n_items } => (first, n_items),
        }
    }

    fn run(&self, child: Child) -> &[Item] {
        let (first, n_items) = self.span(child);
        &self.binary.order[first as usize..][..n_items as usize]
    }

    fn is_end(&self, child: Child) -> bool {
        let is_leaf = match child {
            Child::Subtree(index) => self.leaf[index as usize],
            Child::Run { .. } => leaf_kind(self.run(child)).is_some(),
        };
        is_leaf || self.run(child).len() == 1
    }

    fn end(&self, child: Child) -> Option<End> {
        let run = self.run(child);
        if let &[Item::List(list)] = run {
            return Some(End::List(list));
        }
        let prims = |item: &Item| match item {
            Item::Prim(prim) => Some(*prim),
            Item::List(_) => None,
        };
        self.is_end(child).then(|| End::Leaf(run.iter().filter_map(prims).collect()))
    }

    fn bounds(&self, child: Child) -> Bounds {
        let bounds_of = |prim: &PrimRef| prim.bounds(self.world);
        match child {
            Child::Subtree(index) => self.binary.nodes[index as usize].bounds,
            Child::Run { .. } => {
                let boxes = self.run(child).iter().flat_map(|item| match item {
                    Item::Prim(prim) => std::slice::from_ref(prim).iter().filter_map(bounds_of),
                    Item::List(list) => self.groups.lists[*list as usize].iter().filter_map(bounds_of),
                });
                boxes.reduce(Bounds::union).unwrap_or(Bounds { lo: Vec3::MIN, hi: Vec3::MAX })
            }
        }
    }
}
