//! The front end: from files to a [`World`]. Everything that can be wrong with input is found here.

pub mod mesh;

use std::path::Path;

use glam::DVec3;

use crate::error::{Error, Problem};
use crate::world::{Camera, World};

/// A compiled scene: the tables, and beside them what the tables do not hold.
#[derive(Clone, Debug)]
pub struct Compiled {
    /// The tables.
    pub world: World,
    /// The camera, with the size of the image.
    pub camera: Camera,
    /// What the scene's `[render]` table asks for; the command line may overrule each.
    pub render: RenderKeys,
    /// Names of objects and materials, by id.
    pub names: Names,
    /// What was mended or ignored, in the order of the file.
    pub warnings: Vec<Problem>,
}

/// Keys of the `[render]` table; `None` where the scene does not say.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RenderKeys {
    /// Samples per pixel.
    pub samples: Option<u32>,
    /// `center`, `grid` or `jitter`.
    pub sampler: Option<SamplerKey>,
    /// Seed of the jitter.
    pub seed: Option<u64>,
    /// Longest chain of rays, the camera ray being 1.
    pub max_depth: Option<u32>,
    /// Exposure of the PNG in stops.
    pub exposure_ev: Option<f64>,
}

/// The samplers by the names that scenes use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum SamplerKey {
    Center,
    Grid,
    Jitter,
}

/// Names beside the tables; rows that a scene does not name are given one (`sphere 3`).
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Names {
    /// By [`ObjectId`](crate::world::ObjectId).
    pub objects: Vec<String>,
    /// By [`MaterialId`](crate::world::MaterialId).
    pub materials: Vec<String>,
}

/// Values that the command line sets before a scene is compiled.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Overrides {
    /// Width of the image in pixels.
    pub width_px: Option<u32>,
    /// Height of the image in pixels.
    pub height_px: Option<u32>,
    /// Vertical field of view in degrees.
    pub fov_y_degrees: Option<f64>,
    /// The axis that points up in a mesh file (and for its framing); y unless said.
    pub up: Option<UpAxis>,
}

/// Which axis of a mesh file points up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum UpAxis {
    /// +y.
    #[default]
    Y,
    /// +z.
    Z,
}

impl UpAxis {
    /// The axis as a unit vector.
    pub fn direction(self) -> DVec3 {
        match self {
            UpAxis::Y => DVec3::Y,
            UpAxis::Z => DVec3::Z,
        }
    }
}

/// Reads and compiles a scene file or a bare mesh, told apart by extension.
///
/// # Errors
/// Everything that is wrong with the file, as many mistakes at once as can be told apart.
pub fn load(path: &Path, overrides: &Overrides) -> Result<Compiled, Error> {
    let _ = (path, overrides);
    unimplemented!()
}
