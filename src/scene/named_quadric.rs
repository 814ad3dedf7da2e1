//! Quadrics that have names: their keys, and the matrix, frame and clip that each compiles to.
//!
//! Each is stated about a point of its own, so that it keeps its digits far from the origin; all gradients point outwards.

use glam::{DMat3, DMat4, DVec3, DVec4};

use super::desc::{BoxDesc, NamedQuadricDesc, ShapeDesc};
use super::keys::read_direction;
use super::toml::Table;
use super::transform::Transform;
use super::validate::{COORDINATE, NON_NEGATIVE, POSITIVE};
use crate::error::{Place, Problem};
use crate::numeric::clip::Clip;

/// The points of an object with XᵀAX = 0, in coordinates of their own, that lie in a clip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Local {
    /// A, symmetric.
    pub a: DMat4,
    /// From those coordinates to the object's; `None` beyond the range of f64.
    pub object_from_local: Option<Transform>,
    /// The clip, if any, in coordinates of the object, so that its ends are what the scene says.
    pub clip: Option<Clip>,
}

/// The `type` of a named quadric.
pub fn kind_name(desc: &NamedQuadricDesc) -> &'static str {
    match desc {
        NamedQuadricDesc::Ellipsoid { .. } => "ellipsoid",
        NamedQuadricDesc::Plane { .. } => "plane",
        NamedQuadricDesc::Cylinder { .. } => "cylinder",
        NamedQuadricDesc::Cone { .. } => "cone",
        NamedQuadricDesc::Paraboloid { .. } => "paraboloid",
        NamedQuadricDesc::Hyperboloid { .. } => "hyperboloid",
    }
}

/// The surface of a named quadric.
pub fn local(desc: &NamedQuadricDesc) -> Local {
    match *desc {
        NamedQuadricDesc::Ellipsoid { position, radii, clip } => ball(position, radii, clip),
        NamedQuadricDesc::Plane { position, normal, clip } => {
            // A length near 1, exactly.
            let n = normal / power_of_two_below(normal.abs().max_element());
            about(position, form(DMat3::ZERO, 0.5 * n, 0.0), clip.map(object_box))
        }
        NamedQuadricDesc::Cylinder { base, top, radius } => of_revolution(base, top, base, radius, 0.0, 0.0),
        NamedQuadricDesc::Cone { base, top, radius, top_radius } => {
            // At a height h the radius is r + m·h.
            let m = (top_radius - radius) / (top - base).length();
            of_revolution(base, top, base, radius, radius * m, m * m)
        }
        NamedQuadricDesc::Paraboloid { base, top, radius } => {
            // ρ² = h·r²/H.
            let half = 0.5 * radius * (radius / (top - base).length());
            of_revolution(base, top, base, 0.0, half, 0.0)
        }
        NamedQuadricDesc::Hyperboloid { base, top, radius, waist } => {
            // ρ² = w² + (r² − w²)·(h/(H/2))², from the middle.
            let half = 0.5 * (top - base).length();
            let m_squared = ((radius - waist) / half) * ((radius + waist) / half);
            of_revolution(base, top, 0.5 * base + 0.5 * top, waist, 0.0, m_squared)
        }
    }
}

/// The unit ball, stretched and moved.
pub fn ball(position: DVec3, radii: DVec3, clip: Option<BoxDesc>) -> Local {
    let unit = DMat4::from_diagonal(DVec4::new(1.0, 1.0, 1.0, -1.0));
    let object_from_local = Transform::new(DMat3::from_diagonal(radii), position);
    Local { a: unit, object_from_local, clip: clip.map(object_box) }
}

/// The box of a clip in the axes of the object.
pub fn object_box(clip: BoxDesc) -> Clip {
    Clip::world_box(clip.lo, clip.hi)
}

/// ρ² = r² + 2g·h + q·h² between base and top, ρ being the distance from the axis and h the height above `center` along it.
fn of_revolution(base: DVec3, top: DVec3, center: DVec3, r: f64, g: f64, q: f64) -> Local {
    let axis = top - base;
    let n = axis.normalize();
    // I − nnᵀ by the squares of the other components: an axis of the world is exact.
    let (xx, yy, zz) = (n.x * n.x, n.y * n.y, n.z * n.z);
    let column = |across: f64, at: usize| {
        let mut column = n * (-n[at]) - n * (q * n[at]);
        column[at] = across - q * n[at] * n[at];
        column
    };
    let rows = DMat3::from_cols(column(yy + zz, 0), column(xx + zz, 1), column(xx + yy, 2));
    about(center, form(symmetric(rows), -g * n, -r * r), Some(Clip::along(base, axis)))
}

/// xᵀQx + 2 g·x + s.
fn form(q: DMat3, g: DVec3, s: f64) -> DMat4 {
    DMat4::from_cols(q.x_axis.extend(g.x), q.y_axis.extend(g.y), q.z_axis.extend(g.z), g.extend(s))
}

/// Rounding must not make it asymmetric.
fn symmetric(q: DMat3) -> DMat3 {
    let (xy, xz, yz) = (q.y_axis.x, q.z_axis.x, q.z_axis.y);
    DMat3::from_cols(DVec3::new(q.x_axis.x, xy, xz), DVec3::new(xy, q.y_axis.y, yz), DVec3::new(xz, yz, q.z_axis.z))
}

fn about(center: DVec3, a: DMat4, clip: Option<Clip>) -> Local {
    Local { a, object_from_local: Transform::new(DMat3::IDENTITY, center), clip }
}

/// The largest power of two that is at most a positive number of the range of f32.
fn power_of_two_below(x: f64) -> f64 {
    f64::from_bits(x.to_bits() & (0x7ff << 52))
}

/// `clip_min` and `clip_max`.
pub fn read_box(table: &mut Table<'_>) -> Option<BoxDesc> {
    let (lo, hi) = (table.vec3("clip_min", &COORDINATE), table.vec3("clip_max", &COORDINATE));
    if let (Some(lo), Some(hi)) = (&lo, &hi)
        && !lo.value.cmple(hi.value).all()
    {
        let problem = Problem::new(Place::default(), "the clip box is empty");
        table.mistake("clip_max", problem.expected("no component below that of `clip_min`"));
    }
    if !table.has("clip_min") && !table.has("clip_max") {
        return None;
    }
    let or = |end: Option<super::desc::Spanned<DVec3>>, all: DVec3| end.map_or(all, |end| end.value);
    Some(BoxDesc { lo: or(lo, DVec3::NEG_INFINITY), hi: or(hi, DVec3::INFINITY) })
}

/// `type = "ellipsoid"`.
pub fn read_ellipsoid(table: &mut Table<'_>) -> Option<ShapeDesc> {
    table.require("position", "3 numbers, the centre");
    table.require("radii", "3 numbers above 0, along x, y and z");
    let (position, radii) = (table.vec3("position", &COORDINATE), table.vec3("radii", &POSITIVE));
    let clip = read_box(table);
    let (position, radii) = (position?.value, radii?.value);
    Some(ShapeDesc::Named(NamedQuadricDesc::Ellipsoid { position, radii, clip }))
}

/// `type = "plane"`.
pub fn read_plane(table: &mut Table<'_>) -> Option<ShapeDesc> {
    table.require("position", "3 numbers, a point of it");
    table.require("normal", "3 numbers, not all 0");
    let (position, normal) = (table.vec3("position", &COORDINATE), read_direction(table, "normal"));
    let clip = read_box(table);
    let (position, normal) = (position?.value, normal?);
    Some(ShapeDesc::Named(NamedQuadricDesc::Plane { position, normal, clip }))
}

/// The ends of an axis: two points that differ.
fn read_axis(table: &mut Table<'_>) -> Option<(DVec3, DVec3)> {
    table.require("base", "3 numbers, one end of the axis");
    table.require("top", "3 numbers, the other end of the axis");
    let (base, top) = (table.vec3("base", &COORDINATE), table.vec3("top", &COORDINATE));
    let (base, top) = (base?.value, top?.value);
    if (top - base).try_normalize().is_none() {
        table.mistake("top", Problem::new(Place::default(), "the axis has no length").expected("a point off `base`"));
        return None;
    }
    Some((base, top))
}

fn read_radius(table: &mut Table<'_>) -> Option<f64> {
    table.require("radius", POSITIVE.expected);
    table.number("radius", &POSITIVE).map(|radius| radius.value)
}

/// `type = "cylinder"`.
pub fn read_cylinder(table: &mut Table<'_>) -> Option<ShapeDesc> {
    let (axis, radius) = (read_axis(table), read_radius(table));
    let ((base, top), radius) = (axis?, radius?);
    Some(ShapeDesc::Named(NamedQuadricDesc::Cylinder { base, top, radius }))
}

/// `type = "cone"`.
pub fn read_cone(table: &mut Table<'_>) -> Option<ShapeDesc> {
    let (axis, radius) = (read_axis(table), read_radius(table));
    let top_radius = table.number("top_radius", &NON_NEGATIVE).map_or(0.0, |radius| radius.value);
    let ((base, top), radius) = (axis?, radius?);
    Some(ShapeDesc::Named(NamedQuadricDesc::Cone { base, top, radius, top_radius }))
}

/// `type = "paraboloid"`.
pub fn read_paraboloid(table: &mut Table<'_>) -> Option<ShapeDesc> {
    let (axis, radius) = (read_axis(table), read_radius(table));
    let ((base, top), radius) = (axis?, radius?);
    Some(ShapeDesc::Named(NamedQuadricDesc::Paraboloid { base, top, radius }))
}

/// `type = "hyperboloid"`.
pub fn read_hyperboloid(table: &mut Table<'_>) -> Option<ShapeDesc> {
    let (axis, radius) = (read_axis(table), read_radius(table));
    table.require("waist", "a number above 0, at most `radius`");
    let waist = table.number("waist", &POSITIVE);
    let ((base, top), radius, waist) = (axis?, radius?, waist?.value);
    if waist > radius {
        let problem = Problem::new(Place::default(), "the waist is wider than the ends").found(waist);
        table.mistake("waist", problem.expected(format!("at most the radius, {radius}")));
        return None;
    }
    Some(ShapeDesc::Named(NamedQuadricDesc::Hyperboloid { base, top, radius, waist }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::dvec3;

    /// The value of the form at a point of the object, from inside negative to outside positive.
    fn value(desc: NamedQuadricDesc, p: DVec3) -> f64 {
        let Local { a, object_from_local, .. } = local(&desc);
        let x = (p - object_from_local.unwrap().translation).extend(1.0);
        x.dot(a * x)
    }

    #[test]
    fn named_surfaces_go_through_the_points_that_their_keys_name() {
        let (base, top) = (dvec3(1.0, 2.0, 3.0), dvec3(1.0, 6.0, 3.0));
        let at = |x: f64, y: f64| dvec3(1.0 + x, y, 3.0);
        let cylinder = NamedQuadricDesc::Cylinder { base, top, radius: 0.5 };
        assert_eq!([value(cylinder, at(0.5, 2.0)), value(cylinder, at(-0.5, 5.0))], [0.0; 2]);
        let cone = NamedQuadricDesc::Cone { base, top, radius: 2.0, top_radius: 1.0 };
        assert_eq!([value(cone, at(2.0, 2.0)), value(cone, at(1.5, 4.0)), value(cone, at(-1.0, 6.0))], [0.0; 3]);
        let pointed = NamedQuadricDesc::Cone { base, top, radius: 2.0, top_radius: 0.0 };
        assert_eq!([value(pointed, at(2.0, 2.0)), value(pointed, at(0.0, 6.0))], [0.0; 2]);
        let bowl = NamedQuadricDesc::Paraboloid { base, top, radius: 2.0 };
        assert_eq!([value(bowl, at(0.0, 2.0)), value(bowl, at(1.0, 3.0)), value(bowl, at(-2.0, 6.0))], [0.0; 3]);
        let tower = NamedQuadricDesc::Hyperboloid { base, top, radius: 2.0, waist: 1.0 };
        let rim = value(tower, at(2.0, 6.0)).abs() + value(tower, at(-2.0, 2.0)).abs();
        assert!(value(tower, at(1.0, 4.0)) == 0.0 && rim < 1e-14, "{rim:e}");
        let plane = NamedQuadricDesc::Plane { position: base, normal: dvec3(0.0, 8.0, 0.0), clip: None };
        assert_eq!([value(plane, at(9.0, 2.0)), value(plane, at(9.0, 3.0))], [0.0, 1.0]);
        for desc in [cylinder, cone, pointed, tower] {
            assert!(value(desc, at(0.0, 3.0)) < 0.0 && value(desc, at(5.0, 3.0)) > 0.0, "outwards: {desc:?}");
        }
        assert!(value(bowl, at(0.0, 3.0)) < 0.0 && value(bowl, at(5.0, 3.0)) > 0.0);
    }

    #[test]
    fn a_leaning_cylinder_has_its_radius_on_all_sides() {
        let (base, axis) = (dvec3(1.0, 2.0, 3.0), dvec3(3.0, 4.0, 12.0));
        let desc = NamedQuadricDesc::Cylinder { base, top: base + axis, radius: 0.75 };
        let (u, v) = axis.normalize().any_orthonormal_pair();
        for i in 0..8 {
            let (s, c) = f64::from(i).sin_cos();
            let p = base + 0.3 * axis + 0.75 * (c * u + s * v);
            assert!(value(desc, p).abs() < 1e-14, "{i}");
        }
    }

    #[test]
    fn the_clip_of_an_ellipsoid_is_in_the_axes_of_its_object() {
        let clip = BoxDesc { lo: dvec3(1.0, -9.0, -9.0), hi: dvec3(9.0, 2.0, 9.0) };
        let ball = ball(dvec3(0.1, 0.0, 0.0), dvec3(0.3, 4.0, 8.0), Some(clip));
        assert_eq!(ball.clip, Some(Clip::world_box(clip.lo, clip.hi)));
    }
}
