//! Spheres.

use glam::DVec3;

use super::{Bounds, Hit, MaterialId, ObjectId, PrimKind};
use crate::numeric::prepared::PreparedRay;
use crate::numeric::sphere::intersect;

/// Spheres as columns.
#[derive(Clone, Debug, Default)]
pub struct Spheres {
    /// Centres in world space; finite.
    pub centers: Vec<DVec3>,
    /// Radii in world units; finite and positive.
    pub radii: Vec<f64>,
    /// Materials.
    pub materials: Vec<MaterialId>,
    /// Objects of the scene file.
    pub objects: Vec<ObjectId>,
}

impl Spheres {
    /// Appends a sphere. `center` must be finite, `radius` finite and positive, and the sphere within the range of
    /// f32: `compile` has checked all of it.
    pub fn add(&mut self, center: DVec3, radius: f64, material: MaterialId, object: ObjectId) {
        debug_assert!(Spheres::box_of(center, radius).is_some());
        self.centers.push(center);
        self.radii.push(radius);
        self.materials.push(material);
        self.objects.push(object);
    }

    /// Number of spheres.
    pub fn len(&self) -> usize {
        self.radii.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.radii.is_empty()
    }

    /// The box around a sphere; `None` when the sphere does not fit into the range of f32.
    pub fn box_of(center: DVec3, radius: f64) -> Option<Bounds> {
        // One ulp outwards covers the rounding of each difference and sum.
        let lo = (center - radius).to_array().map(f64::next_down);
        let hi = (center + radius).to_array().map(f64::next_up);
        Bounds::around(lo.into(), hi.into())
    }

    /// The box around a row.
    pub fn bounds(&self, row: usize) -> Bounds {
        let everything = Bounds { lo: glam::Vec3::MIN, hi: glam::Vec3::MAX };
        Spheres::box_of(self.centers[row], self.radii[row]).unwrap_or(everything)
    }

    /// The first hit of a row within the ray's interval.
    #[inline(always)]
    pub fn intersect(&self, row: usize, ray: &PreparedRay) -> Option<Hit> {
        let at = intersect(ray, self.centers[row], self.radii[row])?;
        Some(Hit::of_surface(at, PrimKind::Sphere, row))
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        self.len() * (size_of::<DVec3>() + size_of::<f64>() + size_of::<MaterialId>() + size_of::<ObjectId>())
    }
}
