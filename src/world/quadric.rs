//! General quadrics in local frames.
//!
//! A scene states a symmetric 4×4 matrix A and means the points X = (x, y, z, 1) with XᵀAX = 0. The table holds the
//! same surface as (x−c)ᵀQ(x−c) + 2 g·(x−c) + s = 0 around a centre c of its own, so that a quadric far from the
//! origin keeps its precision (`docs/NUMERICS.md`).

use glam::{DMat3, DMat4, DVec3};

use super::clip_box::clip_box;
use super::{Bounds, Hit, MaterialId, ObjectId, PrimKind};
use crate::numeric::clip::Clip;
use crate::numeric::prepared::PreparedRay;
use crate::numeric::quadric::{Quadric, intersect, occludes};

/// Quadrics as columns.
#[derive(Clone, Debug, Default)]
pub struct Quadrics {
    /// The surfaces.
    pub surfaces: Vec<Quadric>,
    /// Boxes of what is left of them; `None` for an unbounded surface.
    pub bounds: Vec<Option<Bounds>>,
    /// What is left of a surface; rows beyond the end, and `None`, are whole. Empty where nothing is clipped.
    pub clips: Vec<Option<Clip>>,
    /// Materials.
    pub materials: Vec<MaterialId>,
    /// Objects of the scene file.
    pub objects: Vec<ObjectId>,
}

impl Quadrics {
    /// Appends the quadric of a symmetric, finite matrix with a non-zero entry above the constant one.
    pub fn add(&mut self, a: DMat4, material: MaterialId, object: ObjectId) {
        self.add_surface(Quadric::from_matrix(a), None, material, object);
    }

    /// Appends the part of a quadric that lies in a closed box. `a` is as for [`Quadrics::add`].
    pub fn add_clipped(&mut self, a: DMat4, clip: Clip, material: MaterialId, object: ObjectId) {
        self.add_surface(Quadric::from_matrix(a), Some(clip), material, object);
    }

    /// Appends a surface in a frame of its own, finite and with a coefficient above the constant one that is not 0, or the
    /// part of it that lies in a closed box.
    pub fn add_surface(&mut self, surface: Quadric, clip: Option<Clip>, material: MaterialId, object: ObjectId) {
        let mut bounds = box_of(&surface);
        if let Some(clip) = clip {
            bounds = clip_box(&surface, &clip, bounds);
            self.clips.resize(self.len(), None);
            self.clips.push(Some(clip));
        }
        self.bounds.push(bounds);
        self.surfaces.push(surface);
        self.materials.push(material);
        self.objects.push(object);
    }

    /// Number of quadrics.
    pub fn len(&self) -> usize {
        self.surfaces.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.surfaces.is_empty()
    }

    /// The first hit of a row within the ray's interval.
    #[inline(always)]
    pub fn intersect(&self, row: usize, ray: &PreparedRay) -> Option<Hit> {
        let clip = self.clips.get(row).and_then(Option::as_ref);
        let at = intersect(ray, &self.surfaces[row], clip)?;
        Some(Hit::of_surface(at, PrimKind::Quadric, row))
    }

    /// Whether a row is hit within the ray's interval.
    #[inline(always)]
    pub fn occludes(&self, row: usize, ray: &PreparedRay) -> bool {
        occludes(ray, &self.surfaces[row], self.clips.get(row).and_then(Option::as_ref))
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        let row = size_of::<Quadric>() + size_of::<Option<Bounds>>() + size_of::<MaterialId>() + size_of::<ObjectId>();
        self.len() * row + self.clips.len() * size_of::<Option<Clip>>()
    }
}

/// The box around an ellipsoid, rounded outwards; `None` for every other surface and for ellipsoids too flat for
/// their box to be certain.
///
/// With Q positive definite and the centre m = −Q⁻¹g, the surface is (x−m)ᵀQ(x−m) = k with k = gᵀQ⁻¹g − s, and reaches
/// √(k·(Q⁻¹)ᵢᵢ) along axis i.
fn box_of(surface: &Quadric) -> Option<Bounds> {
    let sign = if surface.diagonal.x < 0.0 { -1.0 } else { 1.0 };
    let (d, o, g) = (sign * surface.diagonal, sign * surface.off_diagonal, sign * surface.linear);
    let q = DMat3::from_cols(DVec3::new(d.x, o.z, o.y), DVec3::new(o.z, d.y, o.x), DVec3::new(o.y, o.x, d.z));

    // Scaled to a unit diagonal, Q is well conditioned unless the ellipsoid is a needle across the axes. The inverse
    // of a 3×3 matrix by cofactors is then wrong by a few u over the determinant, which Sylvester's criterion wants
    // positive in any case.
    if d.min_element() <= 0.0 || !q.is_finite() {
        return None;
    }
    let unit = DVec3::new(d.x.sqrt(), d.y.sqrt(), d.z.sqrt()).recip();
    let correlation = o * DVec3::new(unit.y * unit.z, unit.x * unit.z, unit.x * unit.y);
    let determinant = 1.0 - correlation.length_squared() + 2.0 * correlation.element_product();
    if correlation.abs().max_element() >= 1.0 || determinant < SMALLEST_DETERMINANT {
        return None;
    }
    let inverse = DMat3::from_diagonal(unit) * correlation_matrix(correlation).inverse() * DMat3::from_diagonal(unit);
    let middle = -(inverse * g);
    let level = -(g.dot(middle) + sign * surface.constant);
    let variance = DVec3::new(inverse.x_axis.x, inverse.y_axis.y, inverse.z_axis.z);
    let level = level + BOX_SLACK * (g.abs().dot(middle.abs()) + surface.constant.abs());
    let reach = (variance * level.max(0.0)).map(f64::sqrt);

    // A share of everything that went in covers all roundings: those of the inverse, whose entries (i, j) are at most
    // √(vᵢ·vⱼ), and two of the sums below, each of half an ulp.
    let deviation = variance.map(f64::sqrt);
    let slack = BOX_SLACK * (reach + deviation * deviation.dot(g.abs()));
    let slack = slack + f64::EPSILON * (surface.center.abs() + middle.abs() + reach);
    let center = surface.center + middle;
    Bounds::around(center - reach - slack, center + reach + slack)
}

fn correlation_matrix(c: DVec3) -> DMat3 {
    DMat3::from_cols(DVec3::new(1.0, c.z, c.y), DVec3::new(c.z, 1.0, c.x), DVec3::new(c.y, c.x, 1.0))
}

/// Below this determinant of the scaled matrix the box is not trusted and the ellipsoid is tested against every ray.
/// At 2⁻²⁰ an inverse of relative error 2⁻⁵⁰/2⁻²⁰ is still far inside [`BOX_SLACK`].
const SMALLEST_DETERMINANT: f64 = 1.0 / (1u64 << 20) as f64;

/// Relative widening of the box: 2⁻²⁶, a thousand times the rounding of the worst accepted matrix.
const BOX_SLACK: f64 = 1.0 / (1u64 << 26) as f64;
