//! What a ray hits: a BVH over all bounded primitives, built by obvhs and walked here, and the full scan that every
//! answer is compared with.
//!
//! Both answer the same, bit for bit: the closest hit is the smallest `t`, at equal `t` the lowest id.

mod area;
mod asked;
pub mod beam;
mod binary;
mod build;
mod cluster;
mod coherence;
mod collapse;
mod cost;
mod counted;
mod describe;
mod duplicate;
mod join;
mod leaf;
mod linear;
mod list;
mod morton;
mod order;
mod packet;
mod piece;
mod query;
mod ready;
mod single;
mod slab;
mod sliver;
mod slot;
mod spatial;
mod stream;
mod unbounded;
mod walk;
mod wide;

use std::ops::Range;

use rayon::prelude::*;

use crate::BARE;
use crate::simd::{Batch, Isa, Simd};
use crate::world::instance::RAY_SPREAD;
use crate::world::{Bounds, Hit, PrimKind, PrimRef, Ray, World, prim};
use area::Scale;
use asked::{Asked, Todo};
use packet::PacketQuery;
use query::{Any, Closest};
use slab::Surroundings;
use wide::WideTree;

pub use beam::Beam;
pub use counted::Visits;

/// How to find hits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AccelKind {
    /// Bounding volume hierarchy.
    #[default]
    Bvh,
    /// Every ray against every primitive: the oracle.
    Linear,
}

/// How much a build spends on the quality of the tree. Answers are the same for every preset.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Preset {
    /// Built quickest.
    Fast,
    /// A good tree in reasonable time.
    #[default]
    Medium,
    /// The best tree.
    High,
}

impl Preset {
    /// All of them, the quickest build first.
    pub const ALL: [Preset; 3] = [Preset::Fast, Preset::Medium, Preset::High];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Preset::Fast => "fast",
            Preset::Medium => "medium",
            Preset::High => "high",
        }
    }
}

/// How a batch of rays walks the tree. Answers are the same for every mode.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mode {
    /// One ray after another.
    Single,
    /// Several rays in flight at once, so that one is tested while the nodes of others come from memory.
    Batch,
    /// Sixteen neighbours together where they are coherent, the others in flight.
    #[default]
    Packet,
}

impl Mode {
    /// All of them.
    pub const ALL: [Mode; 3] = [Mode::Single, Mode::Batch, Mode::Packet];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Mode::Single => "single",
            Mode::Batch => "batch",
            Mode::Packet => "packet",
        }
    }
}

/// An acceleration structure over a world; it must be asked with the world it was built from.
#[derive(Clone, Debug)]
pub struct Accel {
    kind: AccelKind,
    isa: Isa,
    mode: Mode,
    tree: WideTree,
    /// Quadrics without a box; every ray is tested against each.
    unbounded: Vec<PrimRef>,
}

/// Figures of a built structure.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AccelStats {
    /// Inner nodes.
    pub n_nodes: usize,
    /// Leaves.
    pub n_leaves: usize,
    /// Levels on the longest path, the root being 1.
    pub depth: usize,
    /// Expected cost of a random ray through the root box that nothing stops: nodes and leaves visited, each counted 1.
    pub sah_cost: f64,
    /// Primitives outside of the tree, tested against every ray.
    pub n_unbounded: usize,
    /// Bytes held.
    pub memory_bytes: usize,
}

impl Accel {
    /// Builds the structure on the current rayon pool. The same world gives the same structure on any number of
    /// threads.
    pub fn build(world: &World, kind: AccelKind) -> Accel {
        Accel::build_with(world, kind, Preset::default())
    }

    /// Builds the structure with a preset; the full scan has nothing to build.
    pub fn build_with(world: &World, kind: AccelKind, preset: Preset) -> Accel {
        if kind == AccelKind::Linear {
            return Accel {
                kind,
                isa: Isa::detect(),
                mode: Mode::default(),
                tree: WideTree::default(),
                unbounded: Vec::new(),
            };
        }
        let (mut prims, mut boxes, mut unbounded) = (Vec::new(), Vec::new(), Vec::new());
        let n_prims = world.spheres.len() + world.quadrics.len() + world.n_own_triangles() + world.instances.len();
        prims.reserve_exact(n_prims);
        boxes.reserve_exact(n_prims);
        for row in 0..world.spheres.len() {
            prims.push(PrimRef::new(PrimKind::Sphere, row));
            boxes.push(world.spheres.bounds(row));
        }
        for (row, bounds) in world.quadrics.bounds.iter().enumerate() {
            let prim = PrimRef::new(PrimKind::Quadric, row);
            match bounds {
                Some(bounds) => {
                    prims.push(prim);
                    boxes.push(*bounds);
                }
                None => unbounded.push(prim),
            }
        }
        let n_tabled = prims.len();
        prims.extend(prim::all(world).skip(world.spheres.len() + world.quadrics.len()));
        boxes.par_extend(prims[n_tabled..].par_iter().map(|prim| bounds_of(*prim, world)));
        let mut tree = build_tree(world, prims, boxes, preset);
        tree.prototypes = world.prototypes.triangles.iter().map(|rows| build_prototype(world, rows, preset)).collect();
        Accel { kind, isa: Isa::detect(), mode: Mode::default(), tree, unbounded }
    }

    /// What rays meet.
    #[inline(always)]
    fn surroundings(&self) -> Surroundings {
        let thickness = if self.has_placements() { RAY_SPREAD } else { 0.0 };
        self.tree.surroundings(thickness, self.unbounded.is_empty())
    }

    /// Whether anything is placed: rays are then tested against boxes of the world as if they were thicker.
    #[inline]
    fn has_placements(&self) -> bool {
        !BARE && !self.tree.prototypes.is_empty()
    }

    /// Answers each ray with its closest hit: the smallest `t`, at equal `t` the lowest id. A ray that
    /// [can hit nothing](crate::numeric::prepared::PreparedRay::new) is answered with a miss.
    ///
    /// # Panics
    /// When the slices differ in length.
    pub fn closest_hit(&self, world: &World, rays: &[Ray], hits: &mut [Hit]) {
        assert_eq!(rays.len(), hits.len(), "one hit per ray");
        self.isa.dispatch(Asked::<Closest>::new(self, world, rays, hits));
    }

    /// Answers each ray with whether anything lies in its interval.
    ///
    /// # Panics
    /// When the slices differ in length.
    pub fn occluded(&self, world: &World, rays: &[Ray], occluded: &mut [bool]) {
        assert_eq!(rays.len(), occluded.len(), "one answer per ray");
        self.isa.dispatch(Asked::<Any>::new(self, world, rays, occluded));
    }

    /// Whether neighbours among rays that start or end in one point are walked together: then they had better be neighbours.
    /// Packets do not know placements.
    pub fn packs_rays(&self) -> bool {
        self.mode == Mode::Packet && self.kind == AccelKind::Bvh && !self.has_placements()
    }

    /// The same structure, walked with another instruction set; the answers are the same.
    pub fn with_isa(self, isa: Isa) -> Accel {
        Accel { isa, ..self }
    }

    /// The instruction set that it is walked with.
    pub fn isa(&self) -> Isa {
        self.isa
    }

    /// The same structure, walked in another mode; the answers are the same.
    pub fn with_mode(self, mode: Mode) -> Accel {
        Accel { mode, ..self }
    }

    /// Walks the structure with another instruction set in another mode from now on; the answers are the same.
    pub fn choose(&mut self, isa: Isa, mode: Mode) {
        (self.isa, self.mode) = (isa, mode);
    }

    /// Figures of the structure.
    pub fn stats(&self) -> AccelStats {
        let (n_leaves, sah_cost) = self.tree.leaves_and_sah_cost();
        AccelStats {
            n_nodes: self.tree.nodes.len(),
            n_leaves,
            depth: self.tree.depth,
            sah_cost,
            n_unbounded: self.unbounded.len(),
            memory_bytes: self.tree.memory_bytes() + self.unbounded.len() * size_of::<PrimRef>(),
        }
    }
}

/// Builds the tree of what has boxes.
fn build_tree(world: &World, prims: Vec<PrimRef>, boxes: Vec<Bounds>, preset: Preset) -> WideTree {
    let scale = Scale::of(&boxes);
    let share = build::cut_share(preset);
    let is_cut = share > 0.0 && spatial::is_worth_it(&boxes, &scale);
    let mut groups = duplicate::group(world, &prims, &boxes, scale, build::max_growth(preset));
    drop((prims, boxes));
    let from_top = preset == Preset::High || is_cut;
    let root = if from_top { spatial::build(world, &groups, if is_cut { share } else { 0.0 }) } else { None };
    let binary = build::build(&mut groups, root, preset);
    collapse::collapse(world, &groups, binary)
}

/// Builds the tree of a run of triangles, in their own space.
fn build_prototype(world: &World, rows: &Range<u32>, preset: Preset) -> WideTree {
    let prims: Vec<PrimRef> = rows.clone().map(|row| PrimRef::new(PrimKind::Triangle, row as usize)).collect();
    let boxes = prims.par_iter().map(|prim| world.triangles.bounds(prim.row())).collect();
    build_tree(world, prims, boxes, preset)
}

/// The box of a triangle or a placement.
fn bounds_of(prim: PrimRef, world: &World) -> Bounds {
    if prim.kind() == PrimKind::Instance {
        return world.instances.bounds[prim.row()];
    }
    world.triangles.bounds(prim.row())
}

impl<Q: PacketQuery> Batch for Asked<'_, Q> {
    #[inline(always)]
    fn run<S: Simd>(mut self, simd: S) {
        if self.accel.kind == AccelKind::Linear {
            return self.scan();
        }
        let todo = if self.accel.packs_rays() {
            Todo::Some(packet::run(simd, &mut self).into_iter())
        } else {
            Todo::Run(0..self.rays.len())
        };
        self.plan(todo);
        if self.accel.mode == Mode::Single || !stream::can_run(&self.accel.tree) {
            single::run(simd, &mut self);
        } else {
            stream::run(simd, &mut self);
        }
        self.describe(simd);
    }
}
