//! Whether there is anything in a pyramid of rays: what samples may miss, however thin it is.
//!
//! The answer is conservative one way. It may be yes where there is nothing, and is never no where a primitive lies in the
//! pyramid with its whole box nearer than the depth that was asked for (`docs/NUMERICS.md`, "Beams").

mod quadric;
mod search;

use glam::{DVec3, Vec3};

use super::slab::Slabs;
use crate::numeric::U;
use crate::world::instance::RAY_SPREAD;
use crate::world::{Bounds, Instances, World};

/// A pyramid with its apex in a point: what a camera sees through a pixel.
#[derive(Clone, Copy, Debug)]
pub struct Beam {
    /// The apex, in world space.
    pub origin: DVec3,
    /// Normals of the four sides, inwards, in their order around the pyramid; of any length.
    pub planes: [DVec3; 4],
    /// The depth of a point p is axis·(p − origin).
    pub axis: DVec3,
    /// Directions of the four edges, in their order around the pyramid. Edge i lies in sides i − 1 and i.
    edges: [DVec3; 4],
    /// What a side may be off, as a share of how far a point is from the apex.
    slack: f64,
    /// What a side may be off besides, in units of length.
    spread: f64,
    /// What a depth may be off, besides a share [`Beam::slack`] of itself.
    depth_slack: f64,
}

/// What sides are moved outwards by: 128u. Distances from them are wrong by 4u, corners that triangles are cut at by 8u,
/// and there are four cuts.
const SLACK: f64 = 128.0 * U;

/// The same in the space of a placement, whose transform may stretch by [`MAX_CONDITION`](crate::world::instance::MAX_CONDITION):
/// edges are off by 4u of that, which is 2⁻³⁸.
const PLACED_SLACK: f64 = 1.0 / (1u64 << 34) as f64;

impl Beam {
    /// The pyramid between four directions of any length, in their order around it, all of them with axis·direction > 0.
    /// Sides must not be wider than a half-space.
    pub fn new(origin: DVec3, corners: [DVec3; 4], axis: DVec3) -> Beam {
        // Edges end where the depth is 1.
        Beam::between(origin, corners.map(|corner| corner / axis.dot(corner)), axis)
    }

    fn between(origin: DVec3, edges: [DVec3; 4], axis: DVec3) -> Beam {
        let planes = [0, 1, 2, 3].map(|i| {
            // The difference is small and nearly exact, so that narrow pyramids have good normals.
            let normal = edges[i].cross(edges[(i + 1) % 4] - edges[i]);
            let opposite = edges[(i + 2) % 4] - edges[(i + 1) % 4] + (edges[(i + 3) % 4] - edges[i]);
            if normal.dot(opposite) < 0.0 { -normal } else { normal }
        });
        Beam { origin, planes, axis, edges, slack: SLACK, spread: 0.0, depth_slack: 0.0 }
    }

    /// The same beam, thicker where something is placed: its points may be that far off the ray that hits them.
    fn thickened(mut self, world: &World) -> Beam {
        if !world.instances.is_empty() {
            self.spread = RAY_SPREAD * self.origin.abs().max_element();
        }
        self
    }

    /// The beam in the space of a placement, by the transform that carries rays there. Depths stay what they are.
    fn placed(&self, instances: &Instances, row: usize) -> Beam {
        let [to_object, to_world] = [&instances.object_from_world[row], &instances.world_from_object[row]];
        let origin = to_object.transform_point3(self.origin);
        let edges = self.edges.map(|edge| to_object.transform_vector3(edge));
        let axis = to_world.matrix3.transpose() * self.axis;

        // How far the apex is from itself when it has gone there and back, and what a point of the placement can be off.
        let shift = self.axis.dot(to_world.transform_point3(origin) - self.origin).abs();
        let size = instances.extents[row] + self.origin.abs().max_element();
        let depth_slack = shift + 64.0 * U * size * norm_1(self.axis);
        Beam { slack: PLACED_SLACK, depth_slack, ..Beam::between(origin, edges, axis) }
    }

    /// What a side is moved outwards by, for points up to a distance from the apex.
    #[inline(always)]
    fn margin(&self, plane: DVec3, reach: f64) -> f64 {
        norm_1(plane) * (self.slack * reach + self.spread)
    }

    /// What the depth of a point up to a distance from the apex may be off.
    #[inline(always)]
    fn depth_margin(&self, reach: f64) -> f64 {
        self.margin(self.axis, reach) + self.depth_slack
    }

    /// Which boxes may have a part in the pyramid that is nearer than a depth. Boxes in boxes that do not have none either,
    /// in rounded arithmetic too: every step is monotonous.
    #[inline(always)]
    fn meets<const N: usize>(&self, planes: &[[[f32; N]; 2]; 3], depth: f64) -> [bool; N] {
        let mut corners = [[[0.0; N]; 2]; 3];
        let mut reach = [0.0; N];
        for axis in 0..3 {
            for side in 0..2 {
                for i in 0..N {
                    let x = f64::from(planes[axis][side][i]) - self.origin[axis];
                    corners[axis][side][i] = x;
                    reach[i] = if x.abs() > reach[i] { x.abs() } else { reach[i] };
                }
            }
        }
        let mut meets = [true; N];
        for plane in self.planes {
            // The corner that is farthest inside.
            let [x, y, z] = [0, 1, 2].map(|axis| &corners[axis][usize::from(plane[axis] >= 0.0)]);
            for i in 0..N {
                let inside = plane.x * x[i] + plane.y * y[i] + plane.z * z[i];
                let is_outside = inside + self.margin(plane, reach[i]) < 0.0;
                meets[i] &= !is_outside;
            }
        }
        let [x, y, z] = [0, 1, 2].map(|axis| &corners[axis][usize::from(self.axis[axis] < 0.0)]);
        for i in 0..N {
            let nearest = self.axis.x * x[i] + self.axis.y * y[i] + self.axis.z * z[i];
            let is_behind = nearest - self.depth_margin(reach[i]) >= depth;
            meets[i] &= !is_behind;
        }
        meets
    }

    /// [`Beam::meets`] for one box.
    #[inline(always)]
    fn meets_box(&self, bounds: &Bounds, depth: f64) -> bool {
        let planes = [0, 1, 2].map(|axis| [[bounds.lo[axis]], [bounds.hi[axis]]]);
        self.meets(&planes, depth)[0]
    }

    /// [`Beam::meets`] for the children of a node, a bit for each; what unused slots have is of no meaning.
    #[inline(always)]
    fn meets_children(&self, slabs: &Slabs, depth: f64) -> u32 {
        let meets = self.meets(&slabs.planes, depth);
        (0..meets.len()).fold(0, |bits, i| bits | u32::from(meets[i]) << i)
    }

    /// Whether all of a box may be nearer than a depth.
    fn is_nearer(&self, bounds: &Bounds, depth: f64) -> bool {
        let [lo, hi] = [bounds.lo, bounds.hi].map(|corner| corner.as_dvec3() - self.origin);
        let farthest = DVec3::select(self.axis.cmpge(DVec3::ZERO), hi, lo);
        let reach = lo.abs().max(hi.abs()).max_element();
        let goes_on_behind = self.axis.dot(farthest) - self.depth_margin(reach) >= depth;
        !goes_on_behind
    }

    /// Whether a triangle may have a part in the pyramid, all of which is nearer than a depth.
    #[inline(always)]
    fn holds_triangle(&self, corners: [Vec3; 3], depth: f64) -> bool {
        let [a, b, c] = corners;
        if !self.meets_box(&Bounds { lo: a.min(b).min(c), hi: a.max(b).max(c) }, depth) {
            return false;
        }
        let corners = corners.map(|corner| corner.as_dvec3() - self.origin);
        let reach = corners.iter().fold(0.0, |reach: f64, corner| reach.max(corner.abs().max_element()));
        let mut part = Polygon::triangle(corners);
        for plane in self.planes {
            part = part.cut(plane, self.margin(plane, reach));
        }
        let depths = part.corners().iter().map(|&corner| self.axis.dot(corner));
        let Some(farthest) = depths.reduce(f64::max) else { return false };
        let goes_on_behind = farthest - self.depth_margin(reach) >= depth;
        !goes_on_behind
    }
}

/// Σ|vᵢ|.
#[inline(always)]
fn norm_1(v: DVec3) -> f64 {
    v.x.abs() + v.y.abs() + v.z.abs()
}

/// A triangle of which up to four sides were cut off.
struct Polygon {
    points: [DVec3; MAX_CORNERS],
    n_points: usize,
}

/// Each of four cuts makes a corner more of the three; a power of two.
const MAX_CORNERS: usize = 8;

impl Polygon {
    fn triangle([a, b, c]: [DVec3; 3]) -> Polygon {
        let mut polygon = Polygon { points: [DVec3::ZERO; MAX_CORNERS], n_points: 3 };
        (polygon.points[0], polygon.points[1], polygon.points[2]) = (a, b, c);
        polygon
    }

    fn corners(&self) -> &[DVec3] {
        &self.points[..self.n_points]
    }

    #[inline(always)]
    fn push(&mut self, point: DVec3) {
        self.points[self.n_points % MAX_CORNERS] = point;
        self.n_points = (self.n_points + 1).min(MAX_CORNERS);
    }

    /// What has plane·p ≥ −margin (Sutherland and Hodgman 1974). What is not a number is kept.
    #[inline(always)]
    fn cut(self, plane: DVec3, margin: f64) -> Polygon {
        let corners = self.corners();
        let mut part = Polygon { points: [DVec3::ZERO; MAX_CORNERS], n_points: 0 };
        let Some(&last) = corners.last() else { return part };
        let (mut from, mut from_inside) = (last, plane.dot(last) + margin);
        for &to in corners {
            let to_inside = plane.dot(to) + margin;
            let [from_is_out, to_is_out] = [from_inside < 0.0, to_inside < 0.0];
            if from_is_out != to_is_out {
                part.push(from + from_inside / (from_inside - to_inside) * (to - from));
            }
            if !to_is_out {
                part.push(to);
            }
            (from, from_inside) = (to, to_inside);
        }
        part
    }
}
