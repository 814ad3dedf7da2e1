//! flatray: a data-oriented Whitted ray tracer with exact hit decisions.
//!
//! Data flows one way: [`scene`] reads and checks, [`world`] holds flat tables, [`accel`] finds hits, [`render`] shades
//! tiles into a [`film`], [`measure`] compares. [`numeric`] decides what is hit; [`cli`] is the command.
//!
//! ```
//! use flatray::accel::{Accel, AccelKind};
//! use flatray::world::{Hit, Ray, World};
//! use glam::{DVec3, Vec3};
//!
//! // One triangle, and a structure over it.
//! let world = World::from_triangles(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]])?;
//! let accel = Accel::build(&world, AccelKind::Bvh);
//!
//! // Rays are answered in batches: the closest hit of each, or only whether there is one.
//! let down = Ray::new(DVec3::new(0.25, 0.25, 1.0), -DVec3::Z);
//! let mut hits = [Hit::MISS];
//! accel.closest_hit(&world, &[down], &mut hits);
//! assert_eq!((hits[0].t, hits[0].u, hits[0].v), (1.0, 0.25, 0.25));
//!
//! let mut occluded = [false; 2];
//! accel.occluded(&world, &[down, down.until(0.5)], &mut occluded);
//! assert_eq!(occluded, [true, false]);
//! # Ok::<(), flatray::Error>(())
//! ```

pub mod accel;
pub mod cli;
pub mod error;
pub mod film;
pub mod measure;
pub mod numeric;
pub mod render;
pub mod scene;
pub mod simd;
pub mod world;

pub use error::Error;

/// Whether this is the build without features that `benches/instructions.sh` compares with. A constant, so that what stands
/// behind it is compiled out of one build and costs nothing in the other.
const BARE: bool = cfg!(feature = "bare");
