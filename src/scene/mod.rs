//! The front end: from files to a [`World`]. Everything that can be wrong with input is found here.

mod aov;
pub mod compile;
pub mod desc;
pub mod frame;
pub mod keys;
pub mod machine;
pub mod mesh;
pub mod nearest;
pub mod nff;
pub mod normals;
pub mod source;

mod crease;
mod geometry;
mod named_quadric;
mod object;
mod placement;
pub(crate) mod report;
mod smoothing;
pub(crate) mod toml;
pub mod transform;
pub(crate) mod validate;

use std::fs::File;
use std::io::Read;
use std::path::Path;

use glam::DVec3;

pub use aov::AovKey;
pub use compile::load_text;

use crate::error::{Error, Place, Problem};
use crate::world::{Camera, LightGroupId, World};

/// Longest scene text that is read, in bytes. Scenes of this size are generated ones, and a mesh file holds the same
/// triangles in a tenth of it.
const MAX_TEXT_BYTES: u64 = 256 << 20;

/// What is read of a file to tell its kind, in bytes.
const SNIFFED_BYTES: usize = 4096;

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
    /// `center`, `grid`, `jitter`, `random` or `sobol`.
    pub sampler: Option<SamplerKey>,
    /// Pixel filter.
    pub filter: Option<FilterKey>,
    /// Seed of all that is random.
    pub seed: Option<u64>,
    /// Longest chain of rays, the camera ray being 1.
    pub max_depth: Option<u32>,
    /// Exposure of the PNG in stops.
    pub exposure_ev: Option<f64>,
    /// Tone curve of the PNG.
    pub tone_map: Option<ToneMapKey>,
    /// Radiance that becomes white, after exposure.
    pub white_point: Option<f64>,
    /// Start the rays that leave a coarse smooth mesh where the smooth surface would be.
    pub terminator: Option<bool>,
    /// What to write beside the beauty.
    pub aovs: Vec<AovKey>,
}

/// The samplers by the names that scenes use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum SamplerKey {
    Center,
    Grid,
    Jitter,
    Random,
    Sobol,
}

/// The pixel filters by the names that scenes use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum FilterKey {
    Box,
    Triangle,
    Gaussian,
    BlackmanHarris,
}

/// The tone curves by the names that scenes use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum ToneMapKey {
    Clip,
    Reinhard,
    Hable,
    AcesHill,
    KhronosNeutral,
    AgxApprox,
}

/// What the normals of a mesh are made of, by the names that scenes use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NormalsKey {
    /// Those of the mesh file.
    File,
    /// The mean of the faces around a vertex, unweighted.
    Uniform,
    /// The same, weighted by the areas of the faces.
    Area,
    /// The same, weighted by the angles of the faces at the vertex.
    Angle,
    /// Each face is shaded by its own.
    Flat,
}

/// Names beside the tables; rows that a scene does not name are given one (`sphere 3`).
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Names {
    /// By [`ObjectId`](crate::world::ObjectId).
    pub objects: Vec<String>,
    /// By [`MaterialId`](crate::world::MaterialId).
    pub materials: Vec<String>,
    /// By [`LightGroupId`]; [`UNGROUPED`] for lights that are in none.
    pub light_groups: Vec<String>,
}

/// The group of lights that name none.
pub const UNGROUPED: &str = "default";

impl Names {
    /// The group of a name, which is made if there is none yet.
    fn light_group(&mut self, name: &str) -> LightGroupId {
        let row = self.light_groups.iter().position(|group| group == name).unwrap_or_else(|| {
            self.light_groups.push(name.to_owned());
            self.light_groups.len() - 1
        });
        LightGroupId(row as u32)
    }
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
    /// Whether defects in the geometry of a scene's files are errors ([`Problem::is_defect`]); else they are mended or
    /// left out, and warned of.
    pub strict: bool,
    /// Whether faces that are there twice are looked for and counted too. They do no harm, and finding them takes as
    /// long as reading a binary file; `strict` looks for them in any case.
    pub find_duplicates: bool,
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

/// Reads and compiles a scene file or a bare mesh, told apart by extension; a mesh and an NFF scene also by their content.
///
/// # Errors
/// Everything that is wrong with the file, as many mistakes at once as can be told apart.
pub fn load(path: &Path, overrides: &Overrides) -> Result<Compiled, Error> {
    let compiled = match input_kind(path) {
        Some(InputKind::Scene) => {
            let base_dir = path.parent().unwrap_or(Path::new(""));
            load_text(&read_text(path)?, &path.to_string_lossy(), Some(base_dir), overrides)?
        }
        Some(InputKind::Mesh) => frame::load_mesh(path, overrides)?,
        Some(InputKind::Nff) => nff::load(path, overrides)?,
        None => {
            return Err(Problem::new(Place::file(path), "not a kind of file that can be rendered")
                .expected(
                    "a scene .toml or .nff, or a mesh .ply, .obj, .stl or .off; all but .toml also with .gz or .zst",
                )
                .into());
        }
    };
    if overrides.strict { refuse_defects(compiled) } else { Ok(compiled) }
}

/// Turns warnings of defects into errors.
fn refuse_defects(compiled: Compiled) -> Result<Compiled, Error> {
    let problems: Vec<Problem> = compiled.warnings.iter().filter(|warning| warning.is_defect).cloned().collect();
    if problems.is_empty() { Ok(compiled) } else { Err(Error { problems }) }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum InputKind {
    Scene,
    Mesh,
    Nff,
}

/// What a file is by its extension, in upper or lower case; under a name that tells nothing, by its content.
fn input_kind(path: &Path) -> Option<InputKind> {
    let name = path.file_name()?.to_string_lossy().to_lowercase();
    if name.ends_with(".toml") {
        return Some(InputKind::Scene);
    }
    if source::unpacked_name(path).ends_with(".nff") {
        return Some(InputKind::Nff);
    }
    if mesh::is_mesh_path(path) {
        return Some(InputKind::Mesh);
    }
    let mut source = source::Source::open(path).ok()?;
    if nff::is_nff(&source.bytes()[..source.bytes().len().min(SNIFFED_BYTES)]) {
        return Some(InputKind::Nff);
    }
    mesh::is_mesh(&mut source).then_some(InputKind::Mesh)
}

/// The text of a scene file.
fn read_text(path: &Path) -> Result<String, Error> {
    let cannot = |source: std::io::Error| Error::io(path, "read the scene", &source);
    let mut bytes = Vec::new();
    // Read what is there, up to the limit, whatever length the file claims.
    File::open(path).map_err(cannot)?.take(MAX_TEXT_BYTES + 1).read_to_end(&mut bytes).map_err(cannot)?;
    if bytes.len() as u64 > MAX_TEXT_BYTES {
        return Err(Problem::new(Place::file(path), "the scene text is too long")
            .expected(format!("at most {MAX_TEXT_BYTES} bytes"))
            .help("put triangles into a mesh file")
            .into());
    }
    String::from_utf8(bytes).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        let found = error.as_bytes().get(at).copied().unwrap_or_default();
        Problem::new(Place::byte(path, at as u64), "not UTF-8 text").found(format!("byte 0x{found:02x}")).into()
    })
}
