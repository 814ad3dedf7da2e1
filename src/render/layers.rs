//! The layers beside the beauty: from the samples of a tile to its pixels.
//!
//! Colours are means over the samples, all of one weight, like the beauty. Positions, normals and ids have no mean: they are
//! those of one sample, the one whose hit is nearest to the viewer, the first of equals. No filter widens them: samples that a
//! filter has placed outside of the pixel count only where none is inside.

use glam::DVec3;

use super::aov::{Aov, Aovs};
use super::camera_ray::CameraRays;
use super::cost::Cost;
use super::surface::{Surface, describe, shading_normal};
use super::trace::Level;
use crate::world::{Hit, Ray, World};

/// The layers of a tile, in memory that is used again for every tile.
#[derive(Debug)]
pub struct Layers<'a> {
    aovs: &'a Aovs,
    world: &'a World,
    camera: &'a CameraRays,
    /// The first plane of each layer, in the order of [`Aov::ALL`].
    starts: [usize; Aov::ALL.len()],
    n_planes: usize,
    /// Pixel after pixel, a value for each plane.
    values: Vec<f64>,
    /// By pixel; empty unless a layer needs it.
    nearest: Vec<Nearest>,
    needs_nearest: bool,
    /// Samples by pixel.
    n_samples: Vec<u32>,
    /// By ray of the batch: whether it goes through its own pixel.
    is_inside: Vec<bool>,
    /// By pixel; empty unless asked for.
    objects: Vec<Matte>,
    materials: Vec<Matte>,
    costs: Vec<Cost>,
}

/// The sample of a pixel whose hit is nearest to the viewer.
#[derive(Clone, Copy, Debug)]
struct Nearest {
    is_inside: bool,
    z: f64,
    ray: Ray,
    hit: Hit,
}

impl Nearest {
    fn none() -> Nearest {
        Nearest { is_inside: false, z: f64::INFINITY, ray: Ray::new(DVec3::ZERO, DVec3::Z), hit: Hit::MISS }
    }
}

/// What covers a pixel: Cryptomatte ids, and the weight of the samples that hit each.
type Matte = Vec<(u32, f64)>;

/// Layers that describe one point of a pixel.
const OF_THE_NEAREST: [Aov; 7] = [Aov::Z, Aov::P, Aov::N, Aov::Ng, Aov::Uv, Aov::Object, Aov::Material];

impl<'a> Layers<'a> {
    /// Layers of a render.
    pub fn new(aovs: &'a Aovs, world: &'a World, camera: &'a CameraRays) -> Layers<'a> {
        let mut starts = [0; Aov::ALL.len()];
        let mut n_planes = 0;
        for aov in aovs.iter() {
            starts[aov as usize] = n_planes;
            n_planes += aovs.n_planes_of(aov);
        }
        Layers {
            aovs,
            world,
            camera,
            starts,
            n_planes,
            values: Vec::new(),
            nearest: Vec::new(),
            n_samples: Vec::new(),
            needs_nearest: aovs.any_of(&OF_THE_NEAREST),
            is_inside: Vec::new(),
            objects: Vec::new(),
            materials: Vec::new(),
            costs: Vec::new(),
        }
    }

    /// Begins a tile.
    pub fn begin(&mut self, n_pixels: usize) {
        self.values.clear();
        self.values.resize(n_pixels * self.n_planes, 0.0);
        self.n_samples.clear();
        self.n_samples.resize(n_pixels, 0);
        if self.needs_nearest {
            self.nearest.clear();
            self.nearest.resize(n_pixels, Nearest::none());
        }
        for (aov, mattes) in [(Aov::CryptoObject, &mut self.objects), (Aov::CryptoMaterial, &mut self.materials)] {
            if self.aovs.has(aov) {
                mattes.iter_mut().for_each(Vec::clear);
                mattes.resize(n_pixels, Vec::new());
            }
        }
        if self.aovs.has(Aov::Cost) {
            self.costs.clear();
            self.costs.resize(n_pixels, Cost::default());
        }
    }

    /// Begins a batch of camera rays.
    pub fn begin_batch(&mut self) {
        self.is_inside.clear();
    }

    /// Notes where the next ray of the batch goes through the image, in pixels from the top left corner of its own pixel.
    pub fn note_place(&mut self, dx: f64, dy: f64) {
        let is_within = |d: f64| (0.0..1.0).contains(&d);
        self.is_inside.push(is_within(dx) && is_within(dy));
    }

    /// Adds a sample: a camera ray of a finished level, with its weight among those of its pixel.
    pub fn add(&mut self, pixel: usize, level: &Level, ray: usize, weight: f64) {
        let hit = &level.hits[ray];
        self.n_samples[pixel] += 1;
        let values = &mut self.values[pixel * self.n_planes..(pixel + 1) * self.n_planes];
        let mut add = |plane: usize, color: DVec3| {
            (0..3).for_each(|channel| values[plane + channel] += weight * color[channel]);
        };
        if let Some(lobes) = level.parts.lobes.get(ray) {
            for (lobe, &part) in Aov::LOBES.into_iter().zip(lobes) {
                if self.aovs.has(lobe) {
                    add(self.starts[lobe as usize], part);
                }
            }
        }
        if self.aovs.has(Aov::Lights) {
            for (group, &light) in level.parts.groups_of(ray).iter().enumerate() {
                add(self.starts[Aov::Lights as usize] + 3 * group, light);
            }
        }
        if self.needs_nearest {
            let z = if hit.is_some() { self.camera.depth(&level.rays[ray], hit.t) } else { f64::INFINITY };
            let (is_inside, nearest) = (self.is_inside[ray], &mut self.nearest[pixel]);
            if (is_inside && !nearest.is_inside) || (is_inside == nearest.is_inside && z < nearest.z) {
                *nearest = Nearest { is_inside, z, ray: level.rays[ray], hit: *hit };
            }
        }
        if self.aovs.has(Aov::Cost) {
            self.costs[pixel].add(level.parts.costs.of(ray));
        }
        if !hit.is_some() {
            return;
        }
        if self.aovs.has(Aov::Albedo) {
            let albedo = self.world.materials.diffuse[hit.material(self.world).idx()];
            add(self.starts[Aov::Albedo as usize], albedo);
        }
        if self.aovs.has(Aov::CryptoObject) {
            count(&mut self.objects[pixel], self.aovs.object_mattes[hit.object(self.world).idx()], weight);
        }
        if self.aovs.has(Aov::CryptoMaterial) {
            count(&mut self.materials[pixel], self.aovs.material_mattes[hit.material(self.world).idx()], weight);
        }
    }

    /// Ends a tile: pixel after pixel, a value for each plane. The weights of a pixel's samples have added up to `whole`.
    pub fn finish(&mut self, whole: f64) -> &[f64] {
        let n_pixels = self.values.len().checked_div(self.n_planes).unwrap_or(0);
        for pixel in 0..n_pixels {
            let values = &mut self.values[pixel * self.n_planes..(pixel + 1) * self.n_planes];
            // Sums of colours become means; the planes of data still hold zeros.
            values.iter_mut().for_each(|value| *value /= whole);
            if self.needs_nearest {
                put_nearest(self.world, self.aovs, &self.starts, &self.nearest[pixel], values);
            }
            if self.aovs.has(Aov::Samples) {
                values[self.starts[Aov::Samples as usize]] = f64::from(self.n_samples[pixel]);
            }
            if self.aovs.has(Aov::Cost) {
                let Cost { visits, rays } = self.costs[pixel];
                let counts = [visits.nodes, visits.leaves, rays].map(|count| count as f64);
                values[self.starts[Aov::Cost as usize]..][..counts.len()].copy_from_slice(&counts);
            }
            for (aov, mattes) in [(Aov::CryptoObject, &mut self.objects), (Aov::CryptoMaterial, &mut self.materials)] {
                if self.aovs.has(aov) {
                    let start = self.starts[aov as usize];
                    put_matte(&mut mattes[pixel], self.aovs.matte_levels as usize, whole, &mut values[start..]);
                }
            }
        }
        &self.values
    }
}

/// Writes what lies at the nearest hit of a pixel.
fn put_nearest(world: &World, aovs: &Aovs, starts: &[usize], nearest: &Nearest, values: &mut [f64]) {
    let Nearest { is_inside: _, z, ray, hit } = nearest;
    let mut put = |aov: Aov, data: &[f64]| {
        if aovs.has(aov) {
            values[starts[aov as usize]..][..data.len()].copy_from_slice(data);
        }
    };
    put(Aov::Z, &[*z]);
    if !hit.is_some() {
        return;
    }
    if aovs.any_of(&[Aov::P, Aov::N, Aov::Ng]) {
        let Surface { p, ng, extent: _ } = describe(world, ray, hit);
        let ns = shading_normal(world, hit, ng);
        let is_turned = world.two_sided && ng.dot(ray.direction) > 0.0;
        put(Aov::P, &p.to_array());
        put(Aov::N, &if is_turned { -ns } else { ns }.to_array());
        put(Aov::Ng, &ng.to_array());
    }
    put(Aov::Uv, &[hit.u, hit.v]);
    put(Aov::Object, &[f64::from(hit.object(world).0) + 1.0]);
    put(Aov::Material, &[f64::from(hit.material(world).0) + 1.0]);
}

fn count(matte: &mut Matte, id: u32, weight: f64) {
    match matte.iter_mut().find(|(known, _)| *known == id) {
        Some((_, sum)) => *sum += weight,
        None => matte.push((id, weight)),
    }
}

/// Writes the ids that cover most of a pixel, each with its share; of equal shares the smaller id comes first.
fn put_matte(matte: &mut Matte, n_levels: usize, whole: f64, values: &mut [f64]) {
    matte.sort_unstable_by(|(a, of_a), (b, of_b)| of_b.total_cmp(of_a).then(a.cmp(b)));
    for (&(id, weight), pair) in matte.iter().take(n_levels).zip(values.chunks_exact_mut(2)) {
        // The bits of the id are those of a float, which f64 holds as it is.
        pair[0] = f64::from(f32::from_bits(id));
        pair[1] = weight / whole;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mattes_are_ranked_by_coverage_and_end_where_levels_do() {
        let ids = [1.5_f32, -2.0, 7.0, 1e-3].map(f32::to_bits);
        let mut matte = Matte::new();
        for (id, n) in [(ids[0], 1), (ids[1], 3), (ids[2], 3), (ids[3], 1)] {
            (0..n).for_each(|_| count(&mut matte, id, 1.0));
        }
        let mut values = [0.0; 8];
        put_matte(&mut matte, 3, 10.0, &mut values);
        // The bits of 7 are less than those of −2, which has the sign bit.
        assert_eq!(values[..4], [7.0, 0.3, -2.0, 0.3]);
        assert_eq!(values[4..], [f64::from(1e-3_f32), 0.1, 0.0, 0.0]);
    }
}
