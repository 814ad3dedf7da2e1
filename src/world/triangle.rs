//! Triangles over shared vertex columns, and the meshes they come in.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::{Bounds, Hit, MaterialId, MeshId, ObjectId, PrimRef, World};
use crate::error::{Error, Place, Problem};
use crate::numeric::prepared::PreparedRay;
use crate::numeric::triangle::{intersect, is_degenerate, unit_normal};

/// Triangles of all meshes, mesh after mesh.
#[derive(Clone, Debug, Default)]
pub struct Triangles {
    /// Positions of all vertices in world space; finite.
    pub positions: Vec<Vec3>,
    /// Unit normals of the vertices of smooth meshes; [`Meshes::first_normal`] says where a mesh's begin.
    pub normals: Vec<Vec3>,
    /// Rows of `positions`, counter-clockwise seen from the side the normal points to.
    pub vertices: Vec<[u32; 3]>,
}

/// One row per mesh, or per part of one that has a material of its own; parts share the vertices of their mesh.
#[derive(Clone, Debug, Default)]
pub struct Meshes {
    /// First triangle; the mesh ends where the next begins.
    pub first_triangle: Vec<u32>,
    /// First vertex.
    pub first_vertex: Vec<u32>,
    /// Row of [`Triangles::normals`] that belongs to the first vertex; `None` for flat shading.
    pub first_normal: Vec<Option<u32>>,
    /// Material of the whole row.
    pub materials: Vec<MaterialId>,
    /// Object of the whole row.
    pub objects: Vec<ObjectId>,
}

/// A mesh to be added to a world.
#[derive(Clone, Debug, Default)]
pub struct MeshInput {
    /// Vertex positions in world space.
    pub positions: Vec<Vec3>,
    /// Rows of `positions`.
    pub triangles: Vec<[u32; 3]>,
    /// One unit normal per vertex for smooth shading.
    pub normals: Option<Vec<Vec3>>,
    /// Material of the triangles before the first of `parts`.
    pub material: MaterialId,
    /// Where other materials begin, each beyond the one before it.
    pub parts: Vec<MeshPart>,
    /// Object of the scene file.
    pub object: ObjectId,
}

/// Triangles of a mesh with a material of their own, up to where the next part begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MeshPart {
    /// Row of [`MeshInput::triangles`].
    pub first_triangle: u32,
    /// Material.
    pub material: MaterialId,
}

/// Faces that were left out of a mesh because no ray can hit them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Dropped {
    /// Faces with a NaN or infinite vertex.
    pub non_finite: usize,
    /// Faces whose corners lie on one line or point.
    pub zero_area: usize,
}

impl Dropped {
    /// What becomes of one face.
    fn of(face: &[u32; 3], positions: &[Vec3]) -> Dropped {
        let corners = face.map(|vertex| positions[vertex as usize]);
        let finite = corners.iter().all(|corner| corner.is_finite());
        Dropped { non_finite: usize::from(!finite), zero_area: usize::from(finite && is_degenerate(corners)) }
    }

    fn plus(self, other: Dropped) -> Dropped {
        let Dropped { non_finite, zero_area } = other;
        Dropped { non_finite: self.non_finite + non_finite, zero_area: self.zero_area + zero_area }
    }
}

impl Triangles {
    /// Number of triangles.
    pub fn len(&self) -> usize {
        self.vertices.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.vertices.is_empty()
    }

    /// The corners of a triangle.
    #[inline]
    pub fn corners(&self, row: usize) -> [Vec3; 3] {
        self.vertices[row].map(|vertex| self.positions[vertex as usize])
    }

    /// The box around a triangle; exact, since corners are f32.
    pub fn bounds(&self, row: usize) -> Bounds {
        let [a, b, c] = self.corners(row);
        Bounds { lo: a.min(b).min(c), hi: a.max(b).max(c) }
    }

    /// The unit normal of the plane, by the winding.
    #[inline(always)]
    pub fn ng(&self, row: usize) -> DVec3 {
        unit_normal(self.corners(row))
    }

    /// The hit of a row within the ray's interval.
    #[inline(always)]
    pub fn intersect(&self, row: usize, ray: &PreparedRay) -> Option<Hit> {
        let hit = intersect(ray, self.corners(row))?;
        Some(Hit::of_triangle(&hit, row))
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        (self.positions.len() + self.normals.len()) * size_of::<Vec3>() + self.len() * size_of::<[u32; 3]>()
    }
}

impl Meshes {
    /// Number of meshes.
    pub fn len(&self) -> usize {
        self.first_triangle.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.first_triangle.is_empty()
    }

    /// The mesh that a triangle belongs to: the last that begins at or before it, so that empty meshes own nothing.
    #[inline]
    pub fn of_triangle(&self, row: usize) -> MeshId {
        MeshId(self.first_triangle.partition_point(|&first| first as usize <= row) as u32 - 1)
    }

    /// The material of a triangle.
    #[inline]
    pub fn material_of(&self, row: usize) -> MaterialId {
        self.materials[self.of_triangle(row).idx()]
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        self.len() * (2 * size_of::<u32>() + size_of::<Option<u32>>() + size_of::<MaterialId>() + size_of::<ObjectId>())
    }
}

impl World {
    /// Adds a mesh, as a row of [`Meshes`] and one more for each of its parts, and returns the first. Faces with non-finite vertices and faces without area are dropped and counted: no ray can hit them.
    ///
    /// # Errors
    /// When an index names no vertex, the number of normals is not that of vertices, parts are out of order, or the
    /// tables would outgrow their 30-bit row numbers. The world is unchanged then.
    pub fn add_mesh(&mut self, mesh: MeshInput) -> Result<(MeshId, Dropped), Error> {
        check_mesh(&mesh, self)?;
        let MeshInput { mut positions, triangles: mut faces, normals, material, mut parts, object } = mesh;

        // Drop what cannot be hit; a non-finite position that no face uses any more must not reach the tables either.
        let dropped = faces
            .par_iter()
            .with_min_len(1 << 12)
            .map(|face| Dropped::of(face, &positions))
            .reduce(Dropped::default, Dropped::plus);
        if dropped != Dropped::default() {
            drop_faces(&mut faces, &positions, &mut parts);
        }
        positions.par_chunks_mut(1 << 14).flatten_iter().filter(|position| !position.is_finite()).for_each(
            |position| {
                *position = Vec3::ZERO;
            },
        );

        // Append the columns; the first mesh is moved, not copied.
        let tables = &mut self.triangles;
        let id = MeshId(self.meshes.len() as u32);
        let first_vertex = tables.positions.len() as u32;
        let first_triangle = tables.vertices.len() as u32;
        let first_normal = normals.as_ref().map(|_| tables.normals.len() as u32);
        let first_part = MeshPart { first_triangle: 0, material };
        let has_first_part = parts.first().is_none_or(|part| part.first_triangle > 0);
        let all_parts = has_first_part.then_some(first_part).into_iter().chain(parts);
        for MeshPart { first_triangle: before, material } in all_parts {
            self.meshes.first_triangle.push(first_triangle + before);
            self.meshes.first_vertex.push(first_vertex);
            self.meshes.first_normal.push(first_normal);
            self.meshes.materials.push(material);
            self.meshes.objects.push(object);
        }
        if first_vertex > 0 {
            faces.iter_mut().flatten().for_each(|vertex| *vertex += first_vertex);
        }
        append(&mut tables.positions, positions);
        append(&mut tables.vertices, faces);
        append(&mut tables.normals, normals.unwrap_or_default());
        Ok((id, dropped))
    }

    /// A world of one mesh with a default material, for those who only want to ask what a ray hits.
    ///
    /// # Errors
    /// As [`World::add_mesh`].
    pub fn from_triangles(positions: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Result<World, Error> {
        let mut world = World::default();
        let material = world.materials.add(&super::Material::default());
        world.add_mesh(MeshInput { positions, triangles, material, ..MeshInput::default() })?;
        Ok(world)
    }
}

/// Takes out the faces that cannot be hit, and moves the beginnings of parts to where their faces are then.
fn drop_faces(faces: &mut Vec<[u32; 3]>, positions: &[Vec3], parts: &mut [MeshPart]) {
    let (mut n_seen, mut n_kept) = (0, 0);
    let mut parts = parts.iter_mut().peekable();
    faces.retain(|face| {
        while let Some(part) = parts.next_if(|part| part.first_triangle == n_seen) {
            part.first_triangle = n_kept;
        }
        let is_kept = Dropped::of(face, positions) == Dropped::default();
        n_seen += 1;
        n_kept += u32::from(is_kept);
        is_kept
    });
    parts.for_each(|part| part.first_triangle = n_kept);
}

fn append<T>(column: &mut Vec<T>, mut rows: Vec<T>) {
    if column.is_empty() {
        *column = rows;
    } else {
        column.append(&mut rows);
    }
}

fn check_mesh(mesh: &MeshInput, world: &World) -> Result<(), Error> {
    let n_vertices = mesh.positions.len();
    // Pieces without a branch in them are what the compiler makes fast; the face is looked for when there is one.
    let is_out_of_range = |vertices: &[u32]| vertices.iter().max().is_some_and(|&vertex| vertex as usize >= n_vertices);
    let has_out_of_range = |faces: &[[u32; 3]]| is_out_of_range(faces.as_flattened());
    if mesh.triangles.par_chunks(1 << 14).any(has_out_of_range) {
        let face = mesh.triangles.iter().position(|vertices| is_out_of_range(vertices)).unwrap_or_default();
        let vertex = mesh.triangles[face].into_iter().find(|&vertex| vertex as usize >= n_vertices).unwrap_or_default();
        return Err(Problem::new(Place::default(), format!("face {face} names a vertex that does not exist"))
            .found(vertex)
            .expected(format!("0 to {}", n_vertices as i64 - 1))
            .into());
    }
    if let Some(normals) = mesh.normals.as_ref().filter(|normals| normals.len() != n_vertices) {
        return Err(Problem::new(Place::default(), "a smooth mesh needs one normal per vertex")
            .found(normals.len())
            .expected(n_vertices)
            .into());
    }
    let is_ascending = mesh.parts.is_sorted_by(|a, b| a.first_triangle < b.first_triangle);
    if !is_ascending || mesh.parts.last().is_some_and(|part| part.first_triangle as usize > mesh.triangles.len()) {
        let problem = Problem::new(Place::default(), "the parts of a mesh do not begin one behind the other");
        return Err(problem.expected(format!("rows up to {}", mesh.triangles.len())).into());
    }
    let tables = &world.triangles;
    let rows = (tables.len() + mesh.triangles.len()).max(tables.positions.len() + n_vertices);
    if rows > PrimRef::MAX_ROWS {
        return Err(Problem::new(Place::default(), "too many triangles or vertices")
            .found(rows)
            .expected(format!("at most {}", PrimRef::MAX_ROWS))
            .into());
    }
    Ok(())
}
