//! Embree as a peer: its library is loaded at run time, if it is there.
//!
//! Embree 3 and 4 are spoken to through their C interfaces (Embree API reference, versions 3.13 and 4.4). Nothing of
//! flatray depends on them.

pub mod library;
pub mod packet;
mod search;

use std::path::{Path, PathBuf};

use crate::error::{Error, Place, Problem};
use crate::world::World;
use library::Library;

/// What to do when there is no library.
const HOW_TO_GET_IT: &str =
    "`pip install embreex` brings Embree 4, Debian's libembree3-3 or libembree4-4 too; or name one: --peer embree=FILE";

/// Finds and loads Embree: the library at `path`, else the first that loads of those `search` knows.
///
/// # Errors
/// When there is none, it is too old or it lacks a function; with how to get one.
pub fn open(path: Option<&Path>) -> Result<Library, Error> {
    let candidates = match path {
        Some(path) => vec![path.to_path_buf()],
        None => search::candidates(),
    };
    let mut last = None;
    for candidate in candidates {
        match Library::load(&candidate) {
            Ok(library) => return Ok(library),
            Err(why) => last = Some((candidate, why)),
        }
    }
    let (place, found) = last.unwrap_or_else(|| (PathBuf::from("embree"), "no library".to_owned()));
    Err(Problem::new(Place::file(place), "Embree cannot be used").found(found).help(HOW_TO_GET_IT).into())
}

/// Triangles and spheres in the layout that Embree shares.
#[derive(Clone, Debug, Default)]
pub struct Geometry {
    /// x, y, z of all vertices, and one number more: Embree reads a vertex as four.
    positions: Vec<f32>,
    triangles: Vec<[u32; 3]>,
    /// Centre and radius.
    spheres: Vec<[f32; 4]>,
}

impl Geometry {
    /// The triangles and spheres of a world, without placements; spheres are rounded to f32.
    pub fn of(world: &World) -> Geometry {
        let mut positions: Vec<f32> =
            world.triangles.positions.iter().flat_map(|position| position.to_array()).collect();
        positions.push(0.0);
        let spheres = world.spheres.centers.iter().zip(&world.spheres.radii);
        Geometry {
            positions,
            triangles: world.own_triangles().map(|row| world.triangles.vertices[row]).collect(),
            spheres: spheres.map(|(center, &radius)| center.as_vec3().extend(radius as f32).to_array()).collect(),
        }
    }

    /// Whether a sphere of the world is not exactly the one that Embree gets.
    pub fn has_rounded_spheres(&self, world: &World) -> bool {
        let exact = |row: usize| {
            let [x, y, z, radius] = self.spheres[row].map(f64::from);
            world.spheres.centers[row] == glam::DVec3::new(x, y, z) && world.spheres.radii[row] == radius
        };
        !(0..self.spheres.len()).all(exact)
    }

    /// Number of triangles and spheres.
    pub fn n_prims(&self) -> usize {
        self.triangles.len() + self.spheres.len()
    }
}

/// Embree's instruction sets that are measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PeerIsa {
    /// AVX2.
    Avx2,
    /// AVX-512 as on Skylake-X.
    Avx512,
}

impl PeerIsa {
    /// The sets that this processor has.
    pub fn available() -> Vec<PeerIsa> {
        #[cfg(target_arch = "x86_64")]
        {
            let avx512 = is_x86_feature_detected!("avx512f")
                && is_x86_feature_detected!("avx512bw")
                && is_x86_feature_detected!("avx512dq")
                && is_x86_feature_detected!("avx512vl")
                && is_x86_feature_detected!("avx512cd");
            let sets = [(PeerIsa::Avx2, is_x86_feature_detected!("avx2")), (PeerIsa::Avx512, avx512)];
            sets.into_iter().filter(|(_, has)| *has).map(|(isa, _)| isa).collect()
        }
        #[cfg(not(target_arch = "x86_64"))]
        Vec::new()
    }

    /// The name that Embree's device configuration has for it.
    pub fn name(self) -> &'static str {
        match self {
            PeerIsa::Avx2 => "avx2",
            PeerIsa::Avx512 => "avx512",
        }
    }
}

/// How a scene is built.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quality {
    /// Embree's default.
    Medium,
    /// With spatial splits.
    High,
}

impl Quality {
    /// The name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Quality::Medium => "medium",
            Quality::High => "high",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_library_that_is_not_there_is_reported_with_how_to_get_it() {
        let message = open(Some(Path::new("/nonexistent.so"))).unwrap_err().to_string();
        assert!(message.contains("/nonexistent.so") && message.contains("pip install embreex"), "{message}");
    }
}
