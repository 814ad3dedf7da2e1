//! Sets of rays for measuring, made from a scene: the same on every machine.
//!
//! Camera rays come in blocks of 4×4 pixels, so that any 4, 8 or 16 neighbours make a packet; the other kinds start
//! from their hits, in the same order. Each set comes in two precisions: as the renderer traces it, and with values that
//! f32 holds exactly, for tracers that know nothing else.

use glam::DVec3;

use super::generate::hash_unit;
use crate::accel::Accel;
use crate::render::block::block_order;
use crate::render::camera_ray::CameraRays;
use crate::render::surface::{self, JUST_BEFORE_LIGHT, Surface, shading_normal};
use crate::world::{Camera, Hit, Ray, World};

/// The kinds of rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RayKind {
    /// From the camera through pixel centres.
    Primary,
    /// From what the camera sees to each light in front of it, light after light.
    Shadow,
    /// From what the camera sees, mirrored.
    Reflection,
    /// From what the camera sees, distributed as the cosine to the normal.
    Diffuse,
}

impl RayKind {
    /// All of them.
    pub const ALL: [RayKind; 4] = [RayKind::Primary, RayKind::Shadow, RayKind::Reflection, RayKind::Diffuse];

    /// The name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            RayKind::Primary => "primary",
            RayKind::Shadow => "shadow",
            RayKind::Reflection => "reflection",
            RayKind::Diffuse => "diffuse",
        }
    }

    /// Whether it only matters if anything is hit.
    pub fn is_occlusion(self) -> bool {
        self == RayKind::Shadow
    }

    /// Whether neighbouring rays go nearly the same way.
    pub fn is_coherent(self) -> bool {
        matches!(self, RayKind::Primary | RayKind::Shadow)
    }
}

/// What the numbers of a ray are rounded to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RayPrecision {
    /// Every number is an f32.
    F32,
    /// As the renderer traces them.
    F64,
}

impl RayPrecision {
    /// The name in reports.
    pub fn name(self) -> &'static str {
        match self {
            RayPrecision::F32 => "f32",
            RayPrecision::F64 => "f64",
        }
    }
}

/// What camera rays see, and where other rays start.
#[derive(Clone, Debug)]
pub struct RaySource<'a> {
    world: &'a World,
    camera_rays: Vec<Ray>,
    /// Where camera rays hit, in their order.
    points: Vec<Point>,
}

/// A point that the camera sees.
#[derive(Clone, Copy, Debug)]
struct Point {
    surface: Surface,
    /// Unit geometric normal on the viewer's side.
    ng: DVec3,
    /// Unit shading normal on the viewer's side.
    ns: DVec3,
    /// Unit direction from the viewer.
    from_viewer: DVec3,
}

/// Edge of the tiles that the blocks come in, in pixels, as in the renderer.
const TILE_PX: u32 = 32;
/// Where an f32 shadow ray ends, the light being at 1: its direction is rounded by 2⁻²⁴, 256 times less.
const JUST_BEFORE_LIGHT_F32: f64 = 1.0 - 1.0 / 65536.0;
/// How much farther from the surface an f32 ray starts than an f64 one: 2⁻²⁰ of the size of the numbers, 16 roundings.
const F32_CLEARANCE: f64 = (1u64 << 30) as f64;

impl<'a> RaySource<'a> {
    /// Traces the camera rays of a scene; `camera` says how many.
    pub fn new(world: &'a World, accel: &Accel, camera: &Camera) -> RaySource<'a> {
        let camera_rays = camera_rays(camera);
        let mut hits = vec![Hit::MISS; camera_rays.len()];
        accel.closest_hit(world, &camera_rays, &mut hits);
        let points =
            camera_rays.iter().zip(&hits).filter(|(_, hit)| hit.is_some()).map(|(ray, hit)| point(world, ray, hit));
        RaySource { world, points: points.collect(), camera_rays }
    }

    /// The rays of a kind.
    pub fn rays(&self, kind: RayKind, precision: RayPrecision) -> Vec<Ray> {
        let rays: Vec<Ray> = match kind {
            RayKind::Primary => self.camera_rays.clone(),
            RayKind::Shadow => self.shadow_rays(precision),
            RayKind::Reflection => {
                self.bounced(precision, |_, point| point.from_viewer - 2.0 * point.from_viewer.dot(point.ns) * point.ns)
            }
            RayKind::Diffuse => self.bounced(precision, |index, point| cosine_distributed(point.ng, index as u64)),
        };
        match precision {
            RayPrecision::F64 => rays,
            RayPrecision::F32 => rays.iter().map(rounded).collect(),
        }
    }

    fn shadow_rays(&self, precision: RayPrecision) -> Vec<Ray> {
        let t_max = match precision {
            RayPrecision::F32 => JUST_BEFORE_LIGHT_F32,
            RayPrecision::F64 => JUST_BEFORE_LIGHT,
        };
        let to_light = |light: DVec3| {
            self.points.iter().filter(move |point| (light - point.surface.p).dot(point.ng) > 0.0).map(move |point| {
                let origin = start(point, light - point.surface.p, precision);
                Ray::new(origin, light - origin).until(t_max)
            })
        };
        let along = |direction: DVec3| {
            self.points
                .iter()
                .filter(move |point| direction.dot(point.ng) < 0.0)
                .map(move |point| Ray::new(start(point, -direction, precision), -direction))
        };
        let lights = &self.world.lights;
        let to_points = lights.positions.iter().flat_map(|&light| to_light(light));
        to_points.chain(lights.directions.iter().flat_map(|&direction| along(direction))).collect()
    }

    /// One ray from each point to the viewer's side of the surface; a direction that leads inside gives none.
    fn bounced(&self, precision: RayPrecision, direction: impl Fn(usize, &Point) -> DVec3) -> Vec<Ray> {
        let directions = self.points.iter().enumerate().map(|(index, point)| (point, direction(index, point)));
        directions
            .filter(|(point, direction)| direction.dot(point.ng) > 0.0)
            .map(|(point, direction)| Ray::new(start(point, direction, precision), direction))
            .collect()
    }
}

fn point(world: &World, ray: &Ray, hit: &Hit) -> Point {
    let surface = surface::describe(world, ray, hit);
    let ns = shading_normal(world, hit, surface.ng);
    let side = if surface.ng.dot(ray.direction) > 0.0 { -1.0 } else { 1.0 };
    Point { surface, ng: side * surface.ng, ns: side * ns, from_viewer: ray.direction.normalize_or_zero() }
}

/// Where a ray of a direction starts: off the surface by more than its own rounding.
fn start(point: &Point, direction: DVec3, precision: RayPrecision) -> DVec3 {
    match precision {
        RayPrecision::F64 => point.surface.leave(direction),
        RayPrecision::F32 => point.surface.p + F32_CLEARANCE * point.surface.clearance(0.0) * point.ng,
    }
}

/// The nearest ray whose numbers are f32.
fn rounded(ray: &Ray) -> Ray {
    Ray {
        origin: ray.origin.as_vec3().as_dvec3(),
        direction: ray.direction.as_vec3().as_dvec3(),
        t_min: f64::from(ray.t_min as f32),
        t_max: f64::from(ray.t_max as f32),
    }
}

/// A direction over the hemisphere of a normal, distributed as its cosine (Malley's method), by a hash of the index.
fn cosine_distributed(normal: DVec3, index: u64) -> DVec3 {
    let (radius_squared, turn) = (hash_unit(2 * index), hash_unit(2 * index + 1));
    let (sin, cos) = libm::sincos(std::f64::consts::TAU * turn);
    let (right, up) = normal.any_orthonormal_pair();
    let radius = radius_squared.sqrt();
    radius * cos * right + radius * sin * up + (1.0 - radius_squared).sqrt() * normal
}

/// Rays through the centres of all pixels in the renderer's order: tile by tile, in a tile block by block.
fn camera_rays(camera: &Camera) -> Vec<Ray> {
    let through = CameraRays::new(camera);
    let (width, height) = (camera.width_px, camera.height_px);
    let mut rays = Vec::with_capacity(width as usize * height as usize);
    for top in (0..height).step_by(TILE_PX as usize) {
        for left in (0..width).step_by(TILE_PX as usize) {
            let (tile_width, tile_height) = (TILE_PX.min(width - left), TILE_PX.min(height - top));
            let order = block_order(tile_width as usize, tile_height as usize, 1);
            rays.extend(order.into_iter().map(|index| {
                let (x, y) = (left + index % tile_width, top + index / tile_width);
                through.ray(f64::from(x) + 0.5, f64::from(y) + 0.5)
            }));
        }
    }
    rays
}

#[cfg(test)]
mod tests {
    use glam::DMat4;

    use super::*;
    use crate::accel::AccelKind;
    use crate::measure::generate::terrain;

    fn scene() -> (World, Camera) {
        let (positions, triangles) = terrain(16);
        let mut world = World::from_triangles(positions, triangles).unwrap();
        world.lights.add(DVec3::new(1.0, 3.0, 1.0), DVec3::ONE);
        world.lights.add(DVec3::new(-2.0, 1.0, 1.0), DVec3::ONE);
        world.lights.add_directional(DVec3::new(0.5, -2.0, 0.3), DVec3::ONE);
        let frame = Camera::look_at_frame(DVec3::new(0.2, 1.2, 1.8), DVec3::ZERO, DVec3::Y).unwrap();
        (world, Camera { world_from_camera: frame, fov_y_radians: 0.8, width_px: 45, height_px: 34 })
    }

    #[test]
    fn sets_are_the_same_every_time_and_their_f32_variants_are_f32() {
        let (world, camera) = scene();
        let accel = Accel::build(&world, AccelKind::Bvh);
        let [once, again] = [(); 2].map(|()| RaySource::new(&world, &accel, &camera));
        for kind in RayKind::ALL {
            for precision in [RayPrecision::F32, RayPrecision::F64] {
                let rays = once.rays(kind, precision);
                assert!(rays.len() > 300, "{kind:?}: {} rays", rays.len());
                assert_eq!(rays, again.rays(kind, precision));
            }
            assert!(once.rays(kind, RayPrecision::F32).iter().all(|ray| *ray == rounded(ray)), "{kind:?}");
            assert!(once.rays(kind, RayPrecision::F64).iter().any(|ray| *ray != rounded(ray)), "{kind:?}");
        }
        // Those to the directional light come last, and end nowhere.
        let shadow = once.rays(RayKind::Shadow, RayPrecision::F64);
        let n_endless = shadow.iter().rev().take_while(|ray| ray.t_max == f64::INFINITY).count();
        assert!(n_endless > 100 && n_endless < shadow.len(), "{n_endless} of {}", shadow.len());
    }

    #[test]
    fn every_pixel_has_one_camera_ray_and_sixteen_neighbours_are_a_block() {
        let camera = Camera { world_from_camera: DMat4::IDENTITY, fov_y_radians: 1.0, width_px: 45, height_px: 34 };
        let rays = camera_rays(&camera);
        assert_eq!(rays.len(), 45 * 34);
        let through = CameraRays::new(&camera);
        let pixel = |x: u32, y: u32| through.ray(f64::from(x) + 0.5, f64::from(y) + 0.5);
        for (x, y) in (0..34).flat_map(|y| (0..45).map(move |x| (x, y))) {
            assert_eq!(rays.iter().filter(|ray| **ray == pixel(x, y)).count(), 1);
        }
        let block: Vec<Ray> = (0..4).flat_map(|y| (0..4).map(move |x| (x, y))).map(|(x, y)| pixel(x, y)).collect();
        assert_eq!(rays[..16], block);
    }

    #[test]
    fn rays_that_leave_a_surface_do_not_meet_it_where_they_start() {
        let (world, camera) = scene();
        let accel = Accel::build(&world, AccelKind::Bvh);
        let source = RaySource::new(&world, &accel, &camera);
        for precision in [RayPrecision::F32, RayPrecision::F64] {
            let rays = source.rays(RayKind::Diffuse, precision);
            let mut hits = vec![Hit::MISS; rays.len()];
            accel.closest_hit(&world, &rays, &mut hits);
            assert!(hits.iter().all(|hit| hit.t > 1e-5), "{precision:?}");
        }
    }
}
