//! Sets of rays for measuring, made from a scene: the same on every machine.
//!
//! Camera rays come in blocks of 4×4 pixels, so that any 4, 8 or 16 neighbours make a packet; the other kinds start
//! from their hits, in the same order. Each set comes in two precisions: as the renderer traces it, and with values that
//! f32 holds exactly, for tracers that know nothing else.

use glam::{DMat3, DVec3};

use super::generate::hash_unit;
use crate::accel::Accel;
use crate::render::surface::{self, Surface, shading_normal};
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

/// Edge of the blocks that camera rays come in, in pixels.
const BLOCK_PX: u32 = 4;
/// Edge of the tiles that the blocks come in, in pixels, as in the renderer.
const TILE_PX: u32 = 32;
/// Where a shadow ray ends, the light being at 1. In f32 a direction is rounded by 2⁻²⁴; see `render/shade` for f64.
const JUST_BEFORE_LIGHT_F64: f64 = 1.0 - 64.0 * crate::numeric::U;
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
            RayPrecision::F64 => JUST_BEFORE_LIGHT_F64,
        };
        let to_light = |light: DVec3| {
            self.points.iter().filter(move |point| (light - point.surface.p).dot(point.ng) > 0.0).map(move |point| {
                let origin = start(point, light - point.surface.p, precision);
                Ray::new(origin, light - origin).until(t_max)
            })
        };
        self.world.lights.positions.iter().flat_map(|&light| to_light(light)).collect()
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

/// Rays through the centres of all pixels, tile by tile and in a tile block by block.
fn camera_rays(camera: &Camera) -> Vec<Ray> {
    let (width, height) = (camera.width_px, camera.height_px);
    let mut rays = Vec::with_capacity(width as usize * height as usize);
    for (tile_x, tile_y) in cells(0..width, 0..height, TILE_PX) {
        let tile = (tile_x..width.min(tile_x + TILE_PX), tile_y..height.min(tile_y + TILE_PX));
        for (x0, y0) in cells(tile.0.clone(), tile.1.clone(), BLOCK_PX) {
            let block = (x0..tile.0.end.min(x0 + BLOCK_PX), y0..tile.1.end.min(y0 + BLOCK_PX));
            rays.extend(cells(block.0, block.1, 1).map(|(x, y)| camera_ray(camera, x, y)));
        }
    }
    rays
}

/// The upper left corners of the cells of a region, row by row.
fn cells(x: std::ops::Range<u32>, y: std::ops::Range<u32>, size: u32) -> impl Iterator<Item = (u32, u32)> {
    y.step_by(size as usize).flat_map(move |y| x.clone().step_by(size as usize).map(move |x| (x, y)))
}

/// The ray through a pixel's centre, as the renderer sends it.
fn camera_ray(camera: &Camera, x_px: u32, y_px: u32) -> Ray {
    let (width, height) = (f64::from(camera.width_px), f64::from(camera.height_px));
    let half_height = libm::tan(0.5 * camera.fov_y_radians);
    let x = (2.0 * (f64::from(x_px) + 0.5) / width - 1.0) * half_height * width / height;
    let y = (1.0 - 2.0 * (f64::from(y_px) + 0.5) / height) * half_height;
    let direction = DMat3::from_mat4(camera.world_from_camera) * DVec3::new(x, y, -1.0).normalize();
    Ray::new(camera.world_from_camera.w_axis.truncate(), direction)
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
    }

    #[test]
    fn every_pixel_has_one_camera_ray_and_sixteen_neighbours_are_a_block() {
        let camera = Camera { world_from_camera: DMat4::IDENTITY, fov_y_radians: 1.0, width_px: 45, height_px: 34 };
        let rays = camera_rays(&camera);
        assert_eq!(rays.len(), 45 * 34);
        for (x, y) in cells(0..45, 0..34, 1) {
            assert_eq!(rays.iter().filter(|ray| **ray == camera_ray(&camera, x, y)).count(), 1);
        }
        let block: Vec<Ray> = cells(0..4, 0..4, 1).map(|(x, y)| camera_ray(&camera, x, y)).collect();
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
