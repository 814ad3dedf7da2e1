//! What a scene file says, typed and checked value by value, each value with its place in the text.
//!
//! A description holds names and paths; whether they fit together, and whether a matrix is regular, is found when it
//! is compiled. Keys that the file leaves out are `None`: defaults are given by `compile`.

use std::ops::Range;

use glam::DVec3;

use super::transform::Transform;
use super::{AovKey, FilterKey, NormalsKey, SamplerKey, ToneMapKey};

/// A value and the bytes of the text that state it.
#[derive(Clone, Debug, PartialEq)]
pub struct Spanned<T> {
    /// The value.
    pub value: T,
    /// Its bytes in the text.
    pub span: Range<usize>,
}

/// Four rows of four numbers, as the file has them.
pub type Rows4 = [[f64; 4]; 4];

/// A whole scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SceneDesc {
    /// `[camera]`.
    pub camera: CameraDesc,
    /// `[render]`.
    pub render: RenderDesc,
    /// `[[material]]`, in the order of the file.
    pub materials: Vec<NamedMaterialDesc>,
    /// `[[prototype]]`, in the order of the file: objects that are seen only where they are placed.
    pub prototypes: Vec<HittableDesc>,
    /// `[[hittable]]`, in the order of the file. Those that could not be read in full are missing.
    pub hittables: Vec<HittableDesc>,
    /// `[[light_source]]`, in the order of the file.
    pub lights: Vec<LightDesc>,
}

/// `[camera]`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CameraDesc {
    /// Where it stands; `None` is the origin, looking along −z.
    pub pose: Option<PoseDesc>,
    /// `fov`: vertical, in degrees.
    pub fov_y_degrees: Option<f64>,
    /// `width`.
    pub width_px: Option<u32>,
    /// `height`.
    pub height_px: Option<u32>,
    /// The table.
    pub span: Range<usize>,
}

/// Where the camera stands and looks.
#[derive(Clone, Debug, PartialEq)]
pub enum PoseDesc {
    /// `extrinsic`, as the file has it: row i of the file is column i of world→camera.
    Extrinsic(Spanned<Rows4>),
    /// `position`, `look_at`, `up`.
    LookAt {
        /// The eye.
        position: Spanned<DVec3>,
        /// The point in the middle of the image.
        look_at: Spanned<DVec3>,
        /// The direction that is up in the image; +y when absent.
        up: Option<Spanned<DVec3>>,
    },
}

/// `[render]`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RenderDesc {
    /// `samples`.
    pub samples: Option<u32>,
    /// `sampler`.
    pub sampler: Option<SamplerKey>,
    /// `filter`.
    pub filter: Option<FilterKey>,
    /// `seed`.
    pub seed: Option<u64>,
    /// `max_depth`.
    pub max_depth: Option<u32>,
    /// `exposure`, in stops.
    pub exposure_ev: Option<f64>,
    /// `tonemap`.
    pub tone_map: Option<ToneMapKey>,
    /// `white_point`; only beside an operator that has one.
    pub white_point: Option<f64>,
    /// `background`, scene-linear RGB.
    pub background: Option<DVec3>,
    /// `terminator`.
    pub terminator: Option<bool>,
    /// `two_sided`.
    pub two_sided: Option<bool>,
    /// `aov`.
    pub aovs: Vec<AovKey>,
}

/// The keys of a material, in a `[[material]]` or in an object.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MaterialDesc {
    /// `ambient`.
    pub ambient: Option<DVec3>,
    /// `diffuse`.
    pub diffuse: Option<DVec3>,
    /// `specular`.
    pub specular: Option<DVec3>,
    /// `k_a`.
    pub k_a: Option<f64>,
    /// `k_d`.
    pub k_d: Option<f64>,
    /// `k_s`.
    pub k_s: Option<f64>,
    /// `sh`.
    pub shininess: Option<f64>,
    /// `k_t`.
    pub k_t: Option<f64>,
    /// `ior`.
    pub ior: Option<f64>,
}

/// `[[material]]`.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedMaterialDesc {
    /// `name`.
    pub name: Spanned<String>,
    /// Its keys.
    pub material: MaterialDesc,
    /// The dotted key of the table, for messages.
    pub key: String,
}

impl MaterialRef {
    /// Whether the scene says nothing about the material.
    pub fn is_unstated(&self) -> bool {
        matches!(self, MaterialRef::Inline(keys) if *keys == MaterialDesc::default())
    }
}

/// The material of an object.
#[derive(Clone, Debug, PartialEq)]
pub enum MaterialRef {
    /// `material = "name"`.
    Named(Spanned<String>),
    /// Keys in the object itself, or none.
    Inline(MaterialDesc),
}

/// `[[hittable]]`.
#[derive(Clone, Debug, PartialEq)]
pub struct HittableDesc {
    /// `name`.
    pub name: Option<String>,
    /// Its material.
    pub material: MaterialRef,
    /// What it is; `None` when that could not be read, so that the material is checked all the same.
    pub shape: Option<ShapeDesc>,
    /// Where it stands.
    pub transform: Transform,
    /// Row in the file's list of hittables, from 0.
    pub index: usize,
    /// The dotted key of the table, for messages.
    pub key: String,
    /// The table.
    pub span: Range<usize>,
}

/// The kinds of objects. A new primitive is a variant here.
#[derive(Clone, Debug, PartialEq)]
pub enum ShapeDesc {
    /// `type = "sphere"`.
    Sphere(SphereDesc),
    /// `type = "quadric"`.
    Quadric(QuadricDesc),
    /// `ellipsoid`, `plane`, `cylinder`, `cone`, `paraboloid`, `hyperboloid`.
    Named(NamedQuadricDesc),
    /// `type = "triangle"`.
    Triangle(TriangleDesc),
    /// `type = "mesh"`.
    Mesh(MeshDesc),
    /// `type = "instance"`.
    Instance(InstanceDesc),
}

/// A sphere.
#[derive(Clone, Debug, PartialEq)]
pub struct SphereDesc {
    /// `position`: the centre.
    pub position: DVec3,
    /// `radius`: positive.
    pub radius: Spanned<f64>,
}

/// A quadric.
#[derive(Clone, Debug, PartialEq)]
pub struct QuadricDesc {
    /// `A`.
    pub a: Spanned<Rows4>,
    /// `clip_min`, `clip_max`.
    pub clip: Option<BoxDesc>,
}

/// A closed box in the axes of an object; ends may be infinite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoxDesc {
    /// Smallest corner.
    pub lo: DVec3,
    /// Largest corner.
    pub hi: DVec3,
}

/// A quadric that has a name. Axes run from `base` to `top`, two points that differ; radii are at right angles to them.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub enum NamedQuadricDesc {
    /// `radii` along x, y and z.
    Ellipsoid { position: DVec3, radii: DVec3, clip: Option<BoxDesc> },
    /// Through `position`; `normal` is of any length but zero.
    Plane { position: DVec3, normal: DVec3, clip: Option<BoxDesc> },
    /// Between its ends, which are open.
    Cylinder { base: DVec3, top: DVec3, radius: f64 },
    /// Between its ends, which are open; `radius` at the base.
    Cone { base: DVec3, top: DVec3, radius: f64, top_radius: f64 },
    /// From its vertex `base` to its rim of `radius` around `top`.
    Paraboloid { base: DVec3, top: DVec3, radius: f64 },
    /// Of one sheet: `radius` at both ends, `waist` in the middle.
    Hyperboloid { base: DVec3, top: DVec3, radius: f64, waist: f64 },
}

/// A triangle.
#[derive(Clone, Debug, PartialEq)]
pub struct TriangleDesc {
    /// `a`, `b`, `c`.
    pub corners: [DVec3; 3],
    /// `n_a`, `n_b`, `n_c`, when they are to be interpolated; none is zero.
    pub normals: Option<[DVec3; 3]>,
}

/// A mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshDesc {
    /// Where its triangles stand.
    pub source: MeshSource,
    /// `normals`, or what `phong_interpolation` means by it.
    pub normals: Option<NormalsKey>,
    /// `crease_angle`; not for [`NormalsKey::File`] and [`NormalsKey::Flat`].
    pub crease_angle_degrees: Option<f64>,
}

/// Where the triangles of a mesh stand.
#[derive(Clone, Debug, PartialEq)]
pub enum MeshSource {
    /// `file_path`: in a file of their own.
    File(Spanned<String>),
    /// `vertices` and `faces`: in the scene itself.
    Text {
        /// Points.
        positions: Vec<DVec3>,
        /// Rows of `positions`, in range.
        triangles: Vec<[u32; 3]>,
    },
}

/// Where light comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightFrom {
    /// `position` of a point light.
    Position(DVec3),
    /// `direction` of a directional light: the way it travels; not zero.
    Direction(DVec3),
}

/// Placements of a prototype.
#[derive(Clone, Debug, PartialEq)]
pub struct InstanceDesc {
    /// `of`: the name of the prototype.
    pub of: Spanned<String>,
    /// `repeat`: rows, of rows, of placements; the first is the innermost.
    pub repeat: Vec<RepeatDesc>,
    /// `placements`: a file of transforms.
    pub file_path: Option<Spanned<String>>,
}

/// A row of placements.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RepeatDesc {
    /// `count`.
    pub count: u64,
    /// `step`: from one to the next, in world units.
    pub step: DVec3,
}

/// `[[light_source]]`.
#[derive(Clone, Debug, PartialEq)]
pub struct LightDesc {
    /// Where its light comes from.
    pub from: LightFrom,
    /// `intensity`.
    pub intensity: Option<f64>,
    /// `color`.
    pub color: Option<DVec3>,
    /// `group`: a name that is fit for a layer.
    pub group: Option<String>,
    /// The dotted key of the table, for messages.
    pub key: String,
    /// The table.
    pub span: Range<usize>,
}
