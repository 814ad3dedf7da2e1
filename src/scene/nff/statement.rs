//! What an NFF text says, statement by statement.

use glam::{DVec3, Vec3};

use super::super::mesh::faces::Faces;
use super::super::mesh::finding::{At, Finding};
use super::cone::Cone;
use crate::world::{Material, MaterialId};

/// What a text says. Fills are numbered in the order in which they come first; equal ones are one.
#[derive(Debug, Default)]
pub(super) struct Statements {
    pub view: Option<View>,
    pub background: DVec3,
    pub lights: Vec<Light>,
    pub fills: Vec<Material>,
    pub spheres: Vec<Sphere>,
    /// `c`.
    pub cones: Vec<(Cone, MaterialId)>,
    pub runs: Vec<Run>,
    /// Things mended, left out or ignored.
    pub findings: Vec<Finding>,
}

/// `v`.
#[derive(Clone, Copy, Debug)]
pub(super) struct View {
    pub from: DVec3,
    pub look_at: DVec3,
    pub up: DVec3,
    /// Between the centres of the first and the last row of pixels.
    pub angle_degrees: f64,
    pub size_px: [u32; 2],
    pub at: At,
}

/// `l`; the colour is its intensity, where the file gives one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Light {
    pub position: DVec3,
    pub color: Option<DVec3>,
}

/// `s`: the whole of it lies within the range of f32.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sphere {
    pub center: DVec3,
    pub radius: f64,
    pub fill: MaterialId,
}

/// `p` or `pp` statements in a row, of one fill.
#[derive(Debug)]
pub(super) struct Run {
    pub fill: MaterialId,
    pub positions: Vec<Vec3>,
    /// Those of patches, of unit length or zero; none for polygons.
    pub normals: Option<Vec<Vec3>>,
    pub faces: Faces,
}
