//! One number that tells worlds apart: files of two renders are of one frame only if their worlds are the same.

use crc32fast::Hasher;
use glam::{DAffine3, DVec3, Vec3};
use rayon::prelude::*;

use super::{Instances, Lights, Materials, Meshes, Prototypes, Quadrics, Spheres, Triangles, World};
use crate::numeric::clip::Clip;
use crate::numeric::quadric::Quadric;

/// Rows that one thread sums up at a time.
const CHUNK: usize = 1 << 14;

/// A sum of columns, each with its length.
#[derive(Default)]
struct Sum(Hasher);

impl Sum {
    /// Adds a column, whose rows are bytes each.
    fn add<T: Sync, const N: usize>(&mut self, column: &[T], bytes: impl Fn(&T) -> [u8; N] + Sync) {
        self.0.update(&(column.len() as u64).to_le_bytes());
        let runs: Vec<Hasher> = column
            .par_chunks(CHUNK)
            .map(|run| {
                let mut hasher = Hasher::new();
                hasher.update(&run.iter().flat_map(&bytes).collect::<Vec<u8>>());
                hasher
            })
            .collect();
        runs.iter().for_each(|run| self.0.combine(run));
    }

    fn add_f64(&mut self, column: &[f64]) {
        self.add(column, |value| value.to_le_bytes());
    }

    fn add_vectors(&mut self, column: &[DVec3]) {
        self.add(column, |vector| bytes_of(vector.to_array()));
    }

    fn add_vectors_f32(&mut self, column: &[Vec3]) {
        self.add(column, |vector| joined::<3, 4, 12>(vector.to_array().map(f32::to_le_bytes)));
    }

    fn add_ids<T: Sync>(&mut self, column: &[T], id: impl Fn(&T) -> u32 + Sync) {
        self.add(column, |row| id(row).to_le_bytes());
    }

    fn add_transforms(&mut self, column: &[DAffine3]) {
        self.add(column, |transform| joined::<12, 8, 96>(transform.to_cols_array().map(f64::to_le_bytes)));
    }
}

fn bytes_of(values: [f64; 3]) -> [u8; 24] {
    joined::<3, 8, 24>(values.map(f64::to_le_bytes))
}

/// `N` words of `W` bytes, which are `B`.
fn joined<const N: usize, const W: usize, const B: usize>(words: [[u8; W]; N]) -> [u8; B] {
    const { assert!(N * W == B) };
    std::array::from_fn(|i| words[i / W][i % W])
}

impl World {
    /// A checksum (CRC-32) of all that the tables state. What is computed from them, boxes and inverses, is left out. Worlds
    /// that differ have the same one by a chance of 2⁻³².
    pub fn fingerprint(&self) -> u32 {
        let World {
            spheres,
            quadrics,
            triangles,
            meshes,
            prototypes,
            instances,
            materials,
            lights,
            background,
            two_sided,
        } = self;
        let mut sum = Sum::default();
        let Spheres { centers, radii, materials: of_spheres, objects } = spheres;
        sum.add_vectors(centers);
        sum.add_f64(radii);
        sum.add_ids(of_spheres, |id| id.0);
        sum.add_ids(objects, |id| id.0);
        add_quadrics(&mut sum, quadrics);
        let Triangles { positions, vertices, normals } = triangles;
        sum.add_vectors_f32(positions);
        sum.add(vertices, |corners| joined::<3, 4, 12>(corners.map(u32::to_le_bytes)));
        sum.add_vectors_f32(normals);
        let Meshes { first_triangle, first_vertex, first_normal, materials: of_meshes, objects } = meshes;
        sum.add_ids(first_triangle, |&row| row);
        sum.add_ids(first_vertex, |&row| row);
        sum.add_ids(first_normal, |row| row.map_or(u32::MAX, |row| row));
        sum.add_ids(of_meshes, |id| id.0);
        sum.add_ids(objects, |id| id.0);
        let Prototypes { triangles: rows, bounds: _ } = prototypes;
        sum.add(rows, |rows| joined::<2, 4, 8>([rows.start, rows.end].map(u32::to_le_bytes)));
        add_instances(&mut sum, instances);
        add_look(&mut sum, materials, lights);
        sum.add_vectors(&[*background]);
        sum.add_ids(&[*two_sided], |&flag| u32::from(flag));
        sum.0.finalize()
    }
}

fn add_quadrics(sum: &mut Sum, quadrics: &Quadrics) {
    let Quadrics { surfaces, bounds: _, clips, materials, objects } = quadrics;
    sum.add(surfaces, |surface| {
        let Quadric { center, diagonal, off_diagonal, linear, constant, tame: _ } = *surface;
        let [center, diagonal, off_diagonal, linear] =
            [center, diagonal, off_diagonal, linear].map(|vector| bytes_of(vector.to_array()));
        let vectors = joined::<4, 24, 96>([center, diagonal, off_diagonal, linear]);
        let mut bytes = [0; 104];
        bytes[..96].copy_from_slice(&vectors);
        bytes[96..].copy_from_slice(&constant.to_le_bytes());
        bytes
    });
    sum.add(clips, |clip| {
        let Some(Clip { center, rows: [x, y, z], lo, hi, tame: _ }) = *clip else { return [0; 144] };
        joined::<6, 24, 144>([center, x, y, z, lo, hi].map(|vector| bytes_of(vector.to_array())))
    });
    sum.add_ids(materials, |id| id.0);
    sum.add_ids(objects, |id| id.0);
}

fn add_instances(sum: &mut Sum, instances: &Instances) {
    let Instances { prototypes, object_from_world, world_from_object: _, bounds: _, extents: _, materials, objects } =
        instances;
    sum.add_ids(prototypes, |id| id.0);
    sum.add_transforms(object_from_world);
    sum.add_ids(materials, |id| id.map_or(u32::MAX, |id| id.0));
    sum.add_ids(objects, |id| id.0);
}

fn add_look(sum: &mut Sum, materials: &Materials, lights: &Lights) {
    let Materials { ambient, diffuse, specular, reflectance, shininess, transmittance, ior } = materials;
    [ambient, diffuse, specular].into_iter().for_each(|column| sum.add_vectors(column));
    [reflectance, shininess, transmittance, ior].into_iter().for_each(|column| sum.add_f64(column));
    let Lights { positions, intensities, groups, directions, directional_intensities, directional_groups } = lights;
    [positions, intensities, directions, directional_intensities]
        .into_iter()
        .for_each(|column| sum.add_vectors(column));
    [groups, directional_groups].into_iter().for_each(|column| sum.add_ids(column, |id| id.0));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::{MaterialId, ObjectId};

    fn world() -> World {
        let mut world = World::from_triangles(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]]).unwrap();
        world.spheres.add(DVec3::ONE, 2.0, MaterialId(0), ObjectId(1));
        world.lights.add(DVec3::Y, DVec3::ONE);
        world
    }

    #[test]
    fn equal_worlds_have_one_fingerprint_and_any_change_gives_another() {
        let own = world().fingerprint();
        assert_eq!(own, world().fingerprint());
        let changes: [fn(&mut World); 9] = [
            |world| world.spheres.radii[0] = 2.0_f64.next_up(),
            |world| world.spheres.materials[0] = MaterialId(1),
            |world| world.triangles.positions[1].x = 1.0_f32.next_down(),
            |world| world.triangles.vertices[0] = [1, 2, 0],
            |world| world.materials.shininess[0] += 1.0,
            |world| world.lights.intensities[0].y = 0.5,
            |world| world.lights.add(DVec3::X, DVec3::ZERO),
            |world| world.background.z = 0.1,
            |world| world.two_sided = !world.two_sided,
        ];
        for (index, change) in changes.into_iter().enumerate() {
            let mut changed = world();
            change(&mut changed);
            assert_ne!(changed.fingerprint(), own, "change {index}");
        }
    }
}
