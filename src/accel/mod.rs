//! What a ray hits: a BVH over all bounded primitives, built by obvhs and walked here, and the full scan that every
//! answer is compared with.
//!
//! Both answer the same, bit for bit: the closest hit is the smallest `t`, at equal `t` the lowest id.

mod area;
mod binary;
mod build;
mod cluster;
mod collapse;
mod cost;
mod duplicate;
mod join;
mod linear;
mod list;
mod morton;
mod single;
mod slab;
mod sliver;
mod slot;
mod wide;

use rayon::prelude::*;

use crate::numeric::prepared::PreparedRay;
use crate::simd::{Batch, Isa};
use crate::world::{Bounds, Hit, PrimKind, PrimRef, Ray, World, prim};
use single::Stack;
use wide::WideTree;

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
    /// Packets where neighbouring rays are coherent, rays in flight elsewhere.
    #[default]
    Auto,
    /// One ray after another.
    Single,
    /// Several rays in flight at once, so that one is tested while the nodes of others come from memory.
    Batch,
    /// Neighbouring rays of the batch together.
    Packet,
}

/// What a batch of rays visited; for benchmarks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Visits {
    /// Nodes whose children's boxes were tested.
    pub nodes: u64,
    /// Leaves whose primitives were tested.
    pub leaves: u64,
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
        prims.reserve_exact(world.n_prims());
        boxes.reserve_exact(world.n_prims());
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
        prims.extend(prim::all(world).skip(world.spheres.len() + world.quadrics.len()));
        boxes.par_extend((0..world.triangles.len()).into_par_iter().map(|row| world.triangles.bounds(row)));
        let mut groups = duplicate::group(world, &prims, &boxes, build::max_growth(preset));
        drop((prims, boxes));
        let binary = build::build(&mut groups, preset);
        let tree = collapse::collapse(world, &groups, binary);
        Accel { kind, isa: Isa::detect(), mode: Mode::default(), tree, unbounded }
    }

    /// Answers each ray with its closest hit: the smallest `t`, at equal `t` the lowest id. A ray that
    /// [can hit nothing](crate::numeric::prepared::PreparedRay::new) is answered with a miss.
    ///
    /// # Panics
    /// When the slices differ in length.
    pub fn closest_hit(&self, world: &World, rays: &[Ray], hits: &mut [Hit]) {
        assert_eq!(rays.len(), hits.len(), "one hit per ray");
        self.isa.dispatch(ClosestHits { accel: self, world, rays, hits });
    }

    /// Answers each ray with whether anything lies in its interval.
    ///
    /// # Panics
    /// When the slices differ in length.
    pub fn occluded(&self, world: &World, rays: &[Ray], occluded: &mut [bool]) {
        assert_eq!(rays.len(), occluded.len(), "one answer per ray");
        self.isa.dispatch(Occlusions { accel: self, world, rays, occluded });
    }

    /// The closest hit outside of the tree; the ray is cut behind it.
    #[inline(always)]
    fn closest_unbounded(&self, world: &World, ray: &mut PreparedRay) -> Hit {
        let mut best = Hit::MISS;
        for prim in &self.unbounded {
            if let Some(found) = prim.intersect(world, ray).filter(|found| found.is_before(&best)) {
                best = found;
                ray.t_max = ray.t_max.min(found.t.next_up());
            }
        }
        best
    }

    /// The same structure, walked with another instruction set; the answers are the same.
    pub fn with_isa(self, isa: Isa) -> Accel {
        Accel { isa, ..self }
    }

    /// The same structure, walked in another mode; the answers are the same.
    pub fn with_mode(self, mode: Mode) -> Accel {
        Accel { mode, ..self }
    }

    /// What [`Accel::closest_hit`] visits, ray by ray.
    pub fn visits_of_closest_hit(&self, world: &World, rays: &[Ray]) -> Visits {
        let _ = (world, rays, self.mode);
        Visits::default()
    }

    /// What [`Accel::occluded`] visits, ray by ray.
    pub fn visits_of_occluded(&self, world: &World, rays: &[Ray]) -> Visits {
        let _ = (world, rays);
        Visits::default()
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

    /// The box around everything in the tree; `None` when the tree is empty.
    pub fn bounds(&self) -> Option<Bounds> {
        let root = self.tree.nodes.first()?;
        root.slots().map(|slot| root.bounds(slot)).reduce(Bounds::union)
    }
}

/// A batch of closest-hit queries.
struct ClosestHits<'a> {
    accel: &'a Accel,
    world: &'a World,
    rays: &'a [Ray],
    hits: &'a mut [Hit],
}

impl Batch for ClosestHits<'_> {
    #[inline(always)]
    fn run(self) {
        let ClosestHits { accel, world, rays, hits } = self;
        let mut stack = Stack::new(&accel.tree);
        for (ray, hit) in rays.iter().zip(hits) {
            *hit = match (ray.prepare(), accel.kind) {
                (None, _) => Hit::MISS,
                (Some(ray), AccelKind::Linear) => linear::closest_hit(world, &ray),
                (Some(mut ray), AccelKind::Bvh) => {
                    let best = accel.closest_unbounded(world, &mut ray);
                    single::closest_hit(&accel.tree, world, &mut ray, &mut stack, best)
                }
            };
        }
    }
}

/// A batch of occlusion queries.
struct Occlusions<'a> {
    accel: &'a Accel,
    world: &'a World,
    rays: &'a [Ray],
    occluded: &'a mut [bool],
}

impl Batch for Occlusions<'_> {
    #[inline(always)]
    fn run(self) {
        let Occlusions { accel, world, rays, occluded } = self;
        let mut stack = Stack::new(&accel.tree);
        for (ray, answer) in rays.iter().zip(occluded) {
            *answer = match (ray.prepare(), accel.kind) {
                (None, _) => false,
                (Some(ray), AccelKind::Linear) => linear::occluded(world, &ray),
                (Some(ray), AccelKind::Bvh) => {
                    accel.unbounded.iter().any(|prim| prim.intersect(world, &ray).is_some())
                        || single::occluded(&accel.tree, world, &ray, &mut stack)
                }
            };
        }
    }
}
