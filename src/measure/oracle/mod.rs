//! What exact arithmetic says of a ray and a primitive: the judge of the kernels, sharing no code with them.
//!
//! Every f64 is an integer times a power of two. A case is scaled, coordinates and directions each by one power, so
//! that everything in it is an integer of any length, and then decided by signs of integer polynomials: no rounding
//! and no division. A ray parameter is a root of a·t² + 2b·t + c with integer coefficients; where an f64 stands
//! against that root is again a question of signs. Only the *size* of an error, once it is known to be small, is
//! turned into f64 ([`wide::Wide`]), to about 15 digits.
//!
//! Conventions are those of the kernels' contract: edges, corners and tangents count as hits; a ray in a triangle's
//! plane and a ray inside a quadric surface miss; the interval is open, and is applied to the f64 that stands for the
//! root. So a root within one ulp of an end of the interval may be answered either way, and no other may.
//!
//! The formulas are not those of the kernels: a triangle is its plane and three half-planes in it, instead of three
//! sheared edge functions; a sphere and a quadric are a 4×4 matrix about the world's origin, instead of a local frame;
//! a clip is where the zero of a linear function stands among the roots, instead of its sign at them.

pub mod clip;
pub mod integer;
pub mod judge;
pub mod polynomial;
pub mod quadric;
pub mod surface;
pub mod triangle;
pub mod wide;

pub use clip::ClipRows;
pub use judge::{Judgement, judge};
pub use polynomial::Polynomial;
pub use quadric::QuadricRow;

/// A point or direction.
pub type Vector = [f64; 3];
