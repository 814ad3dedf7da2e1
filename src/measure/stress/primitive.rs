//! One primitive: as a table's row for the kernels, as plain numbers for the oracle, as text for a replay.

use glam::{DVec3, Vec3};

use super::hexadecimal::{Reader, hex, hex_list};
use crate::measure::oracle::{ClipRows, Polynomial, QuadricRow, quadric, triangle};
use crate::numeric::clip::Clip;
use crate::numeric::double::{is_tame, is_tame3};
use crate::numeric::quadric::Quadric;
use crate::world::{MaterialId, ObjectId, PrimKind, PrimRef, World};

/// A row of one of the tables.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Primitive {
    /// Corners.
    Triangle([Vec3; 3]),
    /// A sphere.
    Sphere {
        /// Centre.
        center: DVec3,
        /// Radius.
        radius: f64,
    },
    /// A quadric in its local frame.
    Quadric(Quadric),
    /// The part of a quadric that lies in a box.
    Clipped(Quadric, Clip),
}

impl Primitive {
    /// A world of nothing else.
    pub fn world(&self) -> (World, PrimRef) {
        let mut world = World::default();
        let kind = match *self {
            Primitive::Triangle(corners) => {
                world.triangles.positions = corners.to_vec();
                world.triangles.vertices = vec![[0, 1, 2]];
                PrimKind::Triangle
            }
            Primitive::Sphere { center, radius } => {
                world.spheres.centers.push(center);
                world.spheres.radii.push(radius);
                PrimKind::Sphere
            }
            Primitive::Quadric(row) | Primitive::Clipped(row, _) => {
                if let Primitive::Clipped(_, clip) = *self {
                    world.quadrics.clips.push(Some(clip));
                }
                world.quadrics.surfaces.push(row);
                world.quadrics.bounds.push(None);
                world.quadrics.materials.push(MaterialId::default());
                world.quadrics.objects.push(ObjectId::default());
                PrimKind::Quadric
            }
        };
        (world, PrimRef::new(kind, 0))
    }

    /// The row of a world.
    pub fn of(world: &World, prim: PrimRef) -> Primitive {
        let row = prim.row();
        match prim.kind() {
            PrimKind::Triangle => Primitive::Triangle(world.triangles.corners(row)),
            PrimKind::Sphere => {
                Primitive::Sphere { center: world.spheres.centers[row], radius: world.spheres.radii[row] }
            }
            PrimKind::Quadric => match world.quadrics.clips.get(row) {
                Some(Some(clip)) => Primitive::Clipped(world.quadrics.surfaces[row], *clip),
                _ => Primitive::Quadric(world.quadrics.surfaces[row]),
            },
        }
    }

    /// Where the line meets it, by the oracle.
    pub fn truth(&self, origin: DVec3, direction: DVec3) -> Option<Polynomial> {
        let (o, d) = (origin.to_array(), direction.to_array());
        match self {
            Primitive::Triangle(corners) => triangle::roots(o, d, corners.map(|c| c.as_dvec3().to_array())),
            Primitive::Sphere { center, radius } => QuadricRow::sphere_roots(o, d, center.to_array(), *radius),
            Primitive::Quadric(row) => oracle_row(row).roots(o, d),
            Primitive::Clipped(row, clip) => {
                oracle_row(row).roots(o, d).and_then(|roots| oracle_clip(clip).keep(roots, o, d))
            }
        }
    }

    /// As text that [`Primitive::parse`] reads.
    pub fn text(&self) -> String {
        match self {
            Primitive::Triangle(corners) => {
                format!("triangle({})", hex_list(corners.iter().flat_map(|c| c.as_dvec3().to_array())))
            }
            Primitive::Sphere { center, radius } => format!("sphere({},{})", hex_list(center.to_array()), hex(*radius)),
            Primitive::Quadric(row) => format!("quadric({})", hex_list(numbers_of(row))),
            Primitive::Clipped(row, clip) => {
                let [x, y, z] = clip.rows;
                let vectors = [clip.center, x, y, z, clip.lo, clip.hi];
                let numbers = vectors.iter().flat_map(|v| v.to_array());
                format!("clipped({},{})", hex_list(numbers_of(row)), hex_list(numbers))
            }
        }
    }

    /// Reads what [`Primitive::text`] wrote.
    ///
    /// # Errors
    /// With what was expected.
    pub fn parse(text: &str) -> Result<Primitive, String> {
        let (kind, numbers) =
            text.split_once('(').ok_or("expected triangle(…), sphere(…), quadric(…) or clipped(…)")?;
        let numbers = Reader::new(numbers.trim_end_matches(')'))?;
        let vector = |at: usize| numbers.vector(at);
        match kind.trim() {
            "triangle" => {
                let corners = numbers.exactly(9).map(|()| [vector(0), vector(3), vector(6)])?;
                let rounded = corners.map(|corner| corner.as_vec3());
                let kept = rounded.map(|corner| corner.as_dvec3()) == corners && rounded.iter().all(|c| c.is_finite());
                kept.then_some(Primitive::Triangle(rounded)).ok_or("expected finite f32 corners".to_owned())
            }
            "sphere" => {
                numbers.exactly(4)?;
                let radius = numbers.number(3);
                let sound = vector(0).is_finite() && radius.is_finite() && radius > 0.0;
                let sphere = Primitive::Sphere { center: vector(0), radius };
                sound.then_some(sphere).ok_or("expected a finite centre and a positive radius".to_owned())
            }
            "quadric" => {
                numbers.exactly(13)?;
                Ok(Primitive::Quadric(read_row(&numbers)?))
            }
            "clipped" => {
                numbers.exactly(31)?;
                let [center, x, y, z, lo, hi] = [13, 16, 19, 22, 25, 28].map(vector);
                let sound = [center, x, y, z].iter().all(|v| v.is_finite()) && !lo.is_nan() && !hi.is_nan();
                let clip = sound.then(|| Clip::new(center, [x, y, z], lo, hi)).ok_or("expected finite numbers")?;
                Ok(Primitive::Clipped(read_row(&numbers)?, clip))
            }
            other => Err(format!("unknown kind of primitive '{other}': expected triangle, sphere, quadric or clipped")),
        }
    }
}

fn numbers_of(row: &Quadric) -> impl Iterator<Item = f64> + use<> {
    let rows = [row.center, row.diagonal, row.off_diagonal, row.linear];
    rows.into_iter().flat_map(|v| v.to_array()).chain([row.constant])
}

/// A quadric from the first thirteen numbers.
fn read_row(numbers: &Reader) -> Result<Quadric, String> {
    let rows = [0, 3, 6, 9].map(|at| numbers.vector(at));
    let constant = numbers.number(12);
    let tame = rows.into_iter().all(is_tame3) && is_tame(constant);
    let [center, diagonal, off_diagonal, linear] = rows;
    let finite = rows.iter().all(|row| row.is_finite()) && constant.is_finite();
    let row = Quadric { center, diagonal, off_diagonal, linear, constant, tame };
    finite.then_some(row).ok_or("expected finite numbers".to_owned())
}

/// The clip as the oracle reads it.
fn oracle_clip(clip: &Clip) -> ClipRows {
    let Clip { center, rows, lo, hi, tame: _ } = clip;
    ClipRows { center: center.to_array(), rows: rows.map(|row| row.to_array()), lo: lo.to_array(), hi: hi.to_array() }
}

/// The row as the oracle reads it.
pub fn oracle_row(row: &Quadric) -> quadric::QuadricRow {
    QuadricRow {
        center: row.center.to_array(),
        diagonal: row.diagonal.to_array(),
        off_diagonal: row.off_diagonal.to_array(),
        linear: row.linear.to_array(),
        constant: row.constant,
    }
}
