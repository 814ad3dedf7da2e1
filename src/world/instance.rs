//! Meshes placed many times: a prototype's triangles are in the tables once, a placement is a transform.
//!
//! A ray meets an instance where the *object ray* meets the prototype: origin and direction carried into object space by
//! the table's own `object_from_world`, each coordinate as f64 rounds it. Its direction is never made unit length, so
//! that t means the same in both spaces. On that ray every decision is exact.

use std::ops::Range;

use glam::{DAffine3, DMat3, DVec3};

use super::{Bounds, Hit, MaterialId, ObjectId, PrimRef, World, prim};
use crate::error::{Error, Place, Problem};
use crate::numeric::U;
use crate::numeric::prepared::PreparedRay;

/// Which placement a hit belongs to. The order is that of ties: what is in the world itself comes before what is placed
/// in it, and placements come in their order.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(transparent)]
pub struct InstanceId(u32);

impl InstanceId {
    /// Not placed: a row of the world's own tables.
    pub const WORLD: InstanceId = InstanceId(0);

    /// A row of [`Instances`].
    #[inline]
    pub fn new(row: usize) -> InstanceId {
        InstanceId(row as u32 + 1)
    }

    /// The row; `None` for the world itself.
    #[inline]
    pub fn row(self) -> Option<usize> {
        (self.0 as usize).checked_sub(1)
    }
}

/// A row of [`Prototypes`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(transparent)]
pub struct PrototypeId(pub u32);

impl PrototypeId {
    /// The row as an index into a column.
    #[inline]
    pub fn idx(self) -> usize {
        self.0 as usize
    }
}

/// Runs of triangles that are seen only where they are placed, in the order of the table.
#[derive(Clone, Debug, Default)]
pub struct Prototypes {
    /// Rows of [`Triangles`](super::Triangles).
    pub triangles: Vec<Range<u32>>,
    /// Boxes in object space; `None` for a run without triangles.
    pub bounds: Vec<Option<Bounds>>,
}

impl Prototypes {
    /// Number of prototypes.
    pub fn len(&self) -> usize {
        self.triangles.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// The rows of a prototype.
    #[inline]
    pub fn rows(&self, id: PrototypeId) -> Range<usize> {
        let Range { start, end } = self.triangles[id.idx()];
        start as usize..end as usize
    }
}

/// Placements as columns.
#[derive(Clone, Debug, Default)]
pub struct Instances {
    /// What is placed.
    pub prototypes: Vec<PrototypeId>,
    /// World space to object space: what rays are carried by. This transform *is* the placement.
    pub object_from_world: Vec<DAffine3>,
    /// Object space to world space: the other's inverse, rounded.
    pub world_from_object: Vec<DAffine3>,
    /// Boxes in world space, around all that a ray can meet of the placement.
    pub bounds: Vec<Bounds>,
    /// A length that the error of a point of the placement is a few roundings of.
    pub extents: Vec<f64>,
    /// Materials; `None` keeps those of the prototype's meshes.
    pub materials: Vec<Option<MaterialId>>,
    /// Objects of the scene file.
    pub objects: Vec<ObjectId>,
}

/// The most that a placement may stretch one direction against another, as the product of the Frobenius norms of the
/// two transforms: [`RAY_SPREAD`] is enough up to here.
pub const MAX_CONDITION: f64 = 8192.0;

/// What a world ray and an object ray differ by, as a share of the largest coordinate of the world ray's origin. Boxes of
/// placements are tested against rays this much thicker: 8.1·√3·u·[`MAX_CONDITION`] < 2⁻³⁶ (`docs/NUMERICS.md`).
pub const RAY_SPREAD: f64 = 1.0 / (1u64 << 36) as f64;

/// How far a transform times its inverse may be from the identity: the bounds below want it small against 1.
const LARGEST_RESIDUAL: f64 = 1e-3;

const _: () = assert!(8.1 * 1.7321 * U * MAX_CONDITION < RAY_SPREAD);

impl Instances {
    /// Number of placements.
    pub fn len(&self) -> usize {
        self.prototypes.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.prototypes.is_empty()
    }

    /// The ray in the object space of a row; `None` when it can hit nothing there.
    #[inline]
    pub fn object_ray(&self, row: usize, ray: &PreparedRay) -> Option<PreparedRay> {
        let transform = &self.object_from_world[row];
        let origin = transform.transform_point3(ray.origin);
        let direction = transform.transform_vector3(ray.direction);
        PreparedRay::new(origin, direction, ray.t_min, ray.t_max)
    }

    /// A normal of the object in world space, of unit length; `None` where it has none.
    #[inline]
    pub fn normal(&self, row: usize, normal: DVec3) -> Option<DVec3> {
        (self.object_from_world[row].matrix3.transpose() * normal).try_normalize()
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        let row = 2 * size_of::<DAffine3>()
            + size_of::<Bounds>()
            + size_of::<f64>()
            + size_of::<Option<MaterialId>>()
            + size_of::<PrototypeId>()
            + size_of::<ObjectId>();
        self.len() * row
    }
}

impl World {
    /// Makes the triangles from a row on to the end of the table a prototype: they are no longer seen by themselves.
    /// Prototypes are made one after another, each of all that was added since.
    pub fn add_prototype(&mut self, first_triangle: usize) -> PrototypeId {
        let rows = first_triangle..self.triangles.len();
        let bounds = rows.clone().map(|row| self.triangles.bounds(row)).reduce(Bounds::union);
        let id = PrototypeId(self.prototypes.len() as u32);
        self.prototypes.triangles.push(rows.start as u32..rows.end as u32);
        self.prototypes.bounds.push(bounds);
        id
    }

    /// Places a prototype.
    ///
    /// # Errors
    /// When the transform is singular, stretches one direction beyond [`MAX_CONDITION`] against another, or leaves the
    /// range of f32, and when there are too many placements. A prototype without triangles is not placed.
    pub fn add_instance(
        &mut self,
        prototype: PrototypeId,
        world_from_object: DAffine3,
        material: Option<MaterialId>,
        object: ObjectId,
    ) -> Result<(), Error> {
        let Some(object_bounds) = self.prototypes.bounds[prototype.idx()] else { return Ok(()) };
        if self.instances.len() + 1 >= PrimRef::MAX_ROWS {
            let problem = Problem::new(Place::default(), "too many placements");
            return Err(problem.expected(format!("at most {}", PrimRef::MAX_ROWS - 2)).into());
        }
        let placed = Placed::new(world_from_object, &object_bounds)?;
        let Instances { prototypes, object_from_world, world_from_object, bounds, extents, materials, objects } =
            &mut self.instances;
        prototypes.push(prototype);
        object_from_world.push(placed.object_from_world);
        world_from_object.push(placed.world_from_object);
        bounds.push(placed.bounds);
        extents.push(placed.extent);
        materials.push(material);
        objects.push(object);
        Ok(())
    }

    /// The closest hit of a ray on a placement, all of its triangles tested.
    pub fn intersect_instance(&self, row: usize, ray: &PreparedRay) -> Option<Hit> {
        let object_ray = self.instances.object_ray(row, ray)?;
        let mut best = Hit::MISS;
        for triangle in self.prototypes.rows(self.instances.prototypes[row]) {
            if let Some(hit) = self.triangles.intersect(triangle, &object_ray).filter(|hit| hit.is_before(&best)) {
                best = hit;
            }
        }
        best.is_some().then(|| Hit { instance: InstanceId::new(row), ..best })
    }

    /// Rows of triangles that are seen where they are, in order.
    pub fn own_triangles(&self) -> impl Iterator<Item = usize> + use<'_> {
        let runs = &self.prototypes.triangles;
        let gap = move |i: usize| {
            let start = i.checked_sub(1).map_or(0, |before| runs[before].end as usize);
            start..runs.get(i).map_or(self.triangles.len(), |run| run.start as usize)
        };
        (0..=runs.len()).flat_map(gap)
    }

    /// Number of triangles that are seen where they are.
    pub fn n_own_triangles(&self) -> usize {
        self.triangles.len() - self.prototypes.triangles.iter().map(Range::len).sum::<usize>()
    }

    /// Triangles that can be seen: those of a prototype as often as it is placed.
    pub fn n_placed_triangles(&self) -> u64 {
        let placed = self.instances.prototypes.iter().map(|&id| self.prototypes.rows(id).len() as u64);
        self.n_own_triangles() as u64 + placed.sum::<u64>()
    }

    /// The rows of all placements.
    pub(super) fn instance_refs(&self) -> impl Iterator<Item = PrimRef> + use<> {
        (0..self.instances.len()).map(|row| PrimRef::new(prim::PrimKind::Instance, row))
    }
}

/// A transform and what follows from it.
struct Placed {
    object_from_world: DAffine3,
    world_from_object: DAffine3,
    bounds: Bounds,
    extent: f64,
}

impl Placed {
    /// `docs/NUMERICS.md`, "Placed objects", derives every bound here.
    fn new(world_from_object: DAffine3, object: &Bounds) -> Result<Placed, Error> {
        let wrong = |what: &str| Problem::new(Place::default(), what.to_owned());
        let object_from_world = world_from_object.inverse();
        let (to_world, to_object) = (&world_from_object, &object_from_world);
        let (norm_world, norm_object) = (frobenius(&to_world.matrix3), frobenius(&to_object.matrix3));
        let condition = norm_world * norm_object;
        let product = to_object.matrix3 * to_world.matrix3 - DMat3::IDENTITY;
        let is_finite = world_from_object.is_finite() && object_from_world.is_finite() && condition < f64::INFINITY;
        if !is_finite || frobenius(&product) > LARGEST_RESIDUAL {
            return Err(wrong("the transform of a placement must be finite and invertible").into());
        }
        if condition > MAX_CONDITION {
            return Err(wrong("the transform stretches one direction too much against another to place a mesh by")
                .found(format!("a condition of {condition:.0}"))
                .expected(format!("at most {MAX_CONDITION}"))
                .help("give the transform to a mesh instead of an instance: its corners are then moved themselves")
                .into());
        }

        // How far the two transforms are from being each other's inverse.
        let reach = object.lo.as_dvec3().abs().max(object.hi.as_dvec3().abs()).length();
        let shift = to_object.transform_point3(to_world.translation);
        let moved = norm_object * to_world.translation.length() + to_object.translation.length();
        let residual = (frobenius(&product) + 4.0 * U * condition) * reach + shift.length() + 5.0 * U * moved;

        // What a point of the object can be off in the world.
        let world_reach = norm_world * reach + to_world.translation.length();
        let rounding = 5.0 * U * (condition * world_reach + norm_world * to_object.translation.length());
        let blur = 1.01 * (norm_world * residual + 2.0 * rounding) + f64::MIN_POSITIVE;
        let center = to_world.transform_point3(object.center());
        let half = 0.5 * object.extent();
        let columns = [to_world.matrix3.x_axis, to_world.matrix3.y_axis, to_world.matrix3.z_axis];
        let half = columns[0].abs() * half.x + columns[1].abs() * half.y + columns[2].abs() * half.z;
        let bounds = Bounds::around(center - half - blur, center + half + blur)
            .ok_or_else(|| wrong("a placement reaches beyond the range of 32-bit floats"))?;

        // A point of the prototype is off its triangle by 8u of its coordinates and size, and that is carried along.
        let extent = norm_world * 5.0 * reach + blur / (4.0 * U);
        Ok(Placed { object_from_world, world_from_object, bounds, extent })
    }
}

fn frobenius(m: &DMat3) -> f64 {
    (m.x_axis.length_squared() + m.y_axis.length_squared() + m.z_axis.length_squared()).sqrt()
}
