//! The compiled scene: flat tables, one per kind, one column per attribute.
//!
//! A [`World`] holds no string, no path and nothing that can still fail. Rows are named by the typed ids of [`id`],
//! a row of any primitive table by a [`PrimRef`].

pub mod bounds;
pub mod camera;
mod clip_box;
mod fingerprint;
pub mod id;
pub mod instance;
pub mod light;
pub mod material;
pub mod prim;
pub mod quadric;
pub mod ray;
pub mod sphere;
pub mod triangle;

use glam::DVec3;

pub use bounds::Bounds;
pub use camera::Camera;
pub use id::{LightGroupId, MaterialId, MeshId, ObjectId};
pub use instance::{InstanceId, Instances, PrototypeId, Prototypes};
pub use light::Lights;
pub use material::{Material, Materials};
pub use prim::{PrimKind, PrimRef};
pub use quadric::Quadrics;
pub use ray::{Hit, Ray};
pub use sphere::Spheres;
pub use triangle::{Dropped, MeshInput, MeshPart, Meshes, Triangles};

/// All tables of a scene.
#[derive(Clone, Debug, Default)]
pub struct World {
    /// Spheres.
    pub spheres: Spheres,
    /// Quadrics, bounded and unbounded.
    pub quadrics: Quadrics,
    /// Triangles of all meshes, mesh after mesh.
    pub triangles: Triangles,
    /// One row per mesh and material; a lone triangle is a mesh of one.
    pub meshes: Meshes,
    /// Meshes that are seen only where they are placed.
    pub prototypes: Prototypes,
    /// Placements of prototypes.
    pub instances: Instances,
    /// Materials.
    pub materials: Materials,
    /// Point lights and directional lights.
    pub lights: Lights,
    /// Scene-linear radiance of a ray that hits nothing.
    pub background: DVec3,
    /// Whether normals are turned to the viewer before shading.
    pub two_sided: bool,
}

/// What a scene contains, found once; stages that a scene does not need are not run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Features {
    /// Any sphere.
    pub spheres: bool,
    /// Any quadric.
    pub quadrics: bool,
    /// Any quadric without a bounding box; each is tested against every ray.
    pub unbounded_quadrics: bool,
    /// Any triangle.
    pub triangles: bool,
    /// Any placement of a prototype.
    pub instances: bool,
    /// Any mesh with interpolated normals.
    pub smooth_normals: bool,
    /// Any material that mirrors.
    pub reflection: bool,
    /// Any material that lets light through.
    pub refraction: bool,
    /// Any light that can reach a material with a diffuse or specular part.
    pub direct_light: bool,
    /// Any directional light among these.
    pub directional_light: bool,
    /// Normals are turned to the viewer.
    pub two_sided: bool,
}

impl World {
    /// What this world contains.
    pub fn features(&self) -> Features {
        Features {
            spheres: !self.spheres.is_empty(),
            quadrics: !self.quadrics.is_empty(),
            unbounded_quadrics: self.quadrics.bounds.iter().any(Option::is_none),
            triangles: !self.triangles.is_empty(),
            instances: !self.instances.is_empty(),
            smooth_normals: self.meshes.first_normal.iter().any(Option::is_some),
            reflection: self.materials.reflectance.iter().any(|&k| k > 0.0),
            refraction: self.materials.transmittance.iter().any(|&k| k > 0.0),
            direct_light: !self.lights.is_empty() && self.materials.any_lit(),
            directional_light: !self.lights.directions.is_empty() && self.materials.any_lit(),
            two_sided: self.two_sided,
        }
    }

    /// Number of primitives of all kinds in the tables; a prototype's triangles count once.
    pub fn n_prims(&self) -> usize {
        self.spheres.len() + self.quadrics.len() + self.triangles.len() + self.instances.len()
    }

    /// The box around all bounded primitives; `None` when there is none.
    pub fn bounds(&self) -> Option<Bounds> {
        let refs = prim::all(self);
        refs.filter_map(|prim| prim.bounds(self)).reduce(Bounds::union)
    }

    /// Bytes that the tables hold, by table name.
    pub fn memory_bytes(&self) -> [(&'static str, usize); 7] {
        [
            ("spheres", self.spheres.memory_bytes()),
            ("quadrics", self.quadrics.memory_bytes()),
            ("triangles", self.triangles.memory_bytes()),
            ("meshes", self.meshes.memory_bytes()),
            ("instances", self.instances.memory_bytes()),
            ("materials", self.materials.memory_bytes()),
            ("lights", self.lights.memory_bytes()),
        ]
    }
}
