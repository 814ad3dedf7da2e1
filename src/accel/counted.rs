//! The same answers ray by ray, with a count of what each ray visited: for benchmarks and pictures of what rendering costs.
//!
//! A walk of its own, so that counting costs nothing where it is not asked for. What a ray visits is what it visits alone;
//! packets share their nodes, and rays in flight visit the same ones.

use super::describe::Rest;
use super::leaf;
use super::order::Item;
use super::query::{Any, Closest, Query};
use super::single::{Mailboxes, Stack};
use super::walk::Walk;
use super::wide::WideTree;
use super::{Accel, AccelKind};
use crate::numeric::prepared::PreparedRay;
use crate::simd::{Batch, Simd};
use crate::world::{Hit, InstanceId, PrimKind, PrimRef, Ray, World, prim};

/// What one ray or several visited.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Visits {
    /// Nodes whose children's boxes were tested, of the trees of prototypes too.
    pub nodes: u64,
    /// Leaves whose primitives were tested, and primitives outside of leaves that were. A placement counts by the leaves of
    /// its prototype.
    pub leaves: u64,
}

impl Visits {
    /// Adds those of another.
    #[inline]
    pub fn add(&mut self, other: Visits) {
        self.nodes += other.nodes;
        self.leaves += other.leaves;
    }
}

impl Accel {
    /// [`Accel::closest_hit`] with what each ray visited. Hits have the same bits.
    ///
    /// # Panics
    /// When the slices differ in length.
    pub fn closest_hit_counted(&self, world: &World, rays: &[Ray], hits: &mut [Hit], visits: &mut [Visits]) {
        assert!(rays.len() == hits.len() && rays.len() == visits.len(), "one hit and one count per ray");
        self.isa.dispatch(Counted::<Closest> { accel: self, world, rays, answers: hits, visits });
    }

    /// [`Accel::occluded`] with what each ray visited until it was answered.
    ///
    /// # Panics
    /// When the slices differ in length.
    pub fn occluded_counted(&self, world: &World, rays: &[Ray], occluded: &mut [bool], visits: &mut [Visits]) {
        assert!(rays.len() == occluded.len() && rays.len() == visits.len(), "one answer and one count per ray");
        self.isa.dispatch(Counted::<Any> { accel: self, world, rays, answers: occluded, visits });
    }

    /// What [`Accel::closest_hit`] visits, ray by ray.
    pub fn visits_of_closest_hit(&self, world: &World, rays: &[Ray]) -> Visits {
        let (mut hits, mut visits) = (vec![Hit::MISS; rays.len()], vec![Visits::default(); rays.len()]);
        self.closest_hit_counted(world, rays, &mut hits, &mut visits);
        sum(&visits)
    }

    /// What [`Accel::occluded`] visits, ray by ray.
    pub fn visits_of_occluded(&self, world: &World, rays: &[Ray]) -> Visits {
        let (mut occluded, mut visits) = (vec![false; rays.len()], vec![Visits::default(); rays.len()]);
        self.occluded_counted(world, rays, &mut occluded, &mut visits);
        sum(&visits)
    }
}

fn sum(visits: &[Visits]) -> Visits {
    visits.iter().fold(Visits::default(), |mut sum, &visits| {
        sum.add(visits);
        sum
    })
}

/// A query whose walk can be counted.
trait Countable: Query {
    /// Tests a placement of a leaf; whether the walk is over.
    fn placed<S: Simd>(
        simd: S,
        tree: &WideTree,
        world: &World,
        walk: &mut Walk,
        row: usize,
        visits: &mut Visits,
    ) -> bool;

    /// Primitives that a ray is tested against one after another, of those that stand in this order.
    fn n_tests(world: &World, prims: impl Iterator<Item = PrimRef>, ray: &PreparedRay) -> u64;
}

/// Tests of a primitive by itself: a placement is as many as its triangles.
fn n_tests_of(world: &World, prim: PrimRef) -> u64 {
    match prim.kind() {
        PrimKind::Instance => world.prototypes.rows(world.instances.prototypes[prim.row()]).len() as u64,
        PrimKind::Sphere | PrimKind::Quadric | PrimKind::Triangle => 1,
    }
}

impl Countable for Closest {
    #[inline(always)]
    fn placed<S: Simd>(
        simd: S,
        tree: &WideTree,
        world: &World,
        walk: &mut Walk,
        row: usize,
        visits: &mut Visits,
    ) -> bool {
        leaf::settle(tree, walk);
        let Some((_, mut below, prototype)) = walk_below::<S, Closest>(simd, tree, world, walk, row, visits) else {
            return false;
        };
        leaf::settle(prototype, &mut below);
        let hit = Hit { instance: InstanceId::new(row), ..below.best.hit };
        if hit.is_some() && hit.is_before(&walk.best.hit) {
            walk.keep(hit);
        }
        false
    }

    fn n_tests(world: &World, prims: impl Iterator<Item = PrimRef>, _ray: &PreparedRay) -> u64 {
        prims.map(|prim| n_tests_of(world, prim)).sum()
    }
}

impl Countable for Any {
    #[inline(always)]
    fn placed<S: Simd>(
        simd: S,
        tree: &WideTree,
        world: &World,
        walk: &mut Walk,
        row: usize,
        visits: &mut Visits,
    ) -> bool {
        walk_below::<S, Any>(simd, tree, world, walk, row, visits).is_some_and(|(is_over, ..)| is_over)
    }

    fn n_tests(world: &World, prims: impl Iterator<Item = PrimRef>, ray: &PreparedRay) -> u64 {
        let mut n_tests = 0;
        for prim in prims {
            n_tests += n_tests_of(world, prim);
            if prim.intersect(world, ray).is_some() {
                break;
            }
        }
        n_tests
    }
}

/// Walks the tree of a placement; whether the query was over before its end, the walk, and the tree.
#[inline(always)]
fn walk_below<'a, S: Simd, Q: Countable>(
    simd: S,
    tree: &'a WideTree,
    world: &World,
    walk: &Walk,
    row: usize,
    visits: &mut Visits,
) -> Option<(bool, Walk, &'a WideTree)> {
    let ray = world.instances.object_ray(row, &walk.prepared())?;
    let prototype = &tree.prototypes[world.instances.prototypes[row].idx()];
    let mut below = Walk::nowhere();
    below.begin_one(simd, &ray, &prototype.surroundings(0.0, true));
    let mut items = vec![0; 2 * prototype.stack_size()];
    let mut stack = Stack::new(&mut items, Mailboxes::default());
    let is_over = traverse_below::<S, Q>(simd, prototype, world, &mut below, &mut stack);
    visits.add(stack.visits);
    Some((is_over, below, prototype))
}

/// Walks a tree that holds no placements.
#[inline(always)]
fn traverse_below<S: Simd, Q: Countable>(
    simd: S,
    tree: &WideTree,
    world: &World,
    walk: &mut Walk,
    stack: &mut Stack<'_>,
) -> bool {
    walk_tree(simd, tree, walk, stack, |walk, stack, item| {
        stack.visits.leaves += 1;
        Q::leaf(simd, tree, world, walk, item.child(), item.tag())
    })
}

/// Walks the tree of the world.
#[inline(always)]
fn traverse<S: Simd, Q: Countable>(
    simd: S,
    tree: &WideTree,
    world: &World,
    walk: &mut Walk,
    stack: &mut Stack<'_>,
) -> bool {
    walk_tree(simd, tree, walk, stack, |walk, stack, item| {
        let (first, tag) = (item.child(), item.tag());
        if tag.kind() != PrimKind::Instance {
            stack.visits.leaves += 1;
            return Q::leaf(simd, tree, world, walk, first, tag);
        }
        let placed = &tree.prims[first as usize..][..tag.n_prims()];
        placed.iter().any(|prim| Q::placed(simd, tree, world, walk, prim.row(), &mut stack.visits))
    })
}

/// Walks a tree from its root until a leaf says that the query is over or nothing is left; whether it is over.
#[inline(always)]
fn walk_tree<S: Simd>(
    simd: S,
    tree: &WideTree,
    walk: &mut Walk,
    stack: &mut Stack<'_>,
    mut leaf: impl FnMut(&mut Walk, &mut Stack<'_>, Item) -> bool,
) -> bool {
    if tree.nodes.is_empty() {
        return false;
    }
    stack.begin();
    let (slab, octant) = (walk.slab.lanes(simd), walk.slab.octant);
    let mut item = Item::ROOT;
    loop {
        if !item.tag().is_leaf() {
            stack.visits.nodes += 1;
            if let Some(nearest) = stack.open(simd, &tree.nodes, &slab, octant, walk.t_max, item.child()) {
                item = nearest;
                continue;
            }
        } else if !stack.tested.has(item, stack.ray) && leaf(walk, stack, item) {
            return true;
        }
        let Some(next) = stack.pop(walk.limit) else { return false };
        item = next;
    }
}

/// A batch that is walked ray by ray to see what each visits.
struct Counted<'a, Q: Query> {
    accel: &'a Accel,
    world: &'a World,
    rays: &'a [Ray],
    answers: &'a mut [Q::Answer],
    visits: &'a mut [Visits],
}

impl<Q: Countable> Batch for Counted<'_, Q> {
    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Counted { accel, world, rays, answers, visits } = self;
        let tree = &accel.tree;
        let mut items = vec![0; 2 * tree.stack_size()];
        let mut stack = Stack::new(&mut items, Mailboxes::new(tree));
        let mut walk = Walk::nowhere();
        let around = accel.surroundings();
        let mut rest = Rest::new(rays.len());
        for (ray_idx, ray) in rays.iter().enumerate() {
            visits[ray_idx] = Visits::default();
            answers[ray_idx] = Q::NOTHING;
            let Some(ray) = ray.prepare_with(simd) else { continue };
            if accel.kind == AccelKind::Linear {
                answers[ray_idx] = Q::scan(world, &ray);
                visits[ray_idx].leaves = Q::n_tests(world, prim::all(world), &ray);
                continue;
            }
            visits[ray_idx].leaves = Q::n_tests(world, accel.unbounded.iter().copied(), &ray);
            walk.begin_one(simd, &ray, &around);
            match Q::begin(simd, accel, world, &walk) {
                Ok(hit) if hit.is_some() => walk.keep(hit),
                Ok(_) => {}
                Err(answer) => {
                    answers[ray_idx] = answer;
                    continue;
                }
            }
            stack.visits = Visits::default();
            let is_over = traverse::<S, Q>(simd, tree, world, &mut walk, &mut stack);
            visits[ray_idx].add(stack.visits);
            Q::end(&walk, is_over, ray_idx, &mut answers[ray_idx], &mut rest);
        }
        Q::describe(simd, tree, rays, &mut rest, answers);
    }
}
