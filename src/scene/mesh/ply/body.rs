//! The body: rows of elements, the same for every encoding.

use glam::Vec3;

use super::super::faces::Faces;
use super::super::finding::{At, Finding, Outcome, counted};
use super::super::{Attributes, Soup};
use super::header::{Element, Header, Kind};

/// What an encoding must be able to do: give one value after the other.
pub(super) trait Values: Sized {
    /// The next scalar; its kind matters to binary encodings only.
    fn number(&mut self, kind: Kind) -> Outcome<f64>;
    /// The count before a list, compared with the data that is left.
    fn list_length(&mut self, count_kind: Kind, item_kind: Kind) -> Outcome<usize>;
    /// Passes over scalars.
    fn skip(&mut self, kind: Kind, n_values: usize) -> Outcome<()>;
    /// Sees to it that a row ends here.
    fn end_row(&mut self) -> Outcome<()>;
    /// Moves to the next row, and says where it begins.
    fn begin_row(&mut self) -> At;
    /// Where the value began that was read last.
    fn last_value_at(&self) -> At;
    /// Refuses a number of rows that the rest of the file cannot hold, where this is known beforehand.
    fn check_count(&self, _element: &Element) -> Outcome<()> {
        Ok(())
    }
    /// Bytes not yet read.
    fn n_bytes_left(&self) -> usize;
    /// The least bytes that a row of an element takes.
    fn least_row_bytes(element: &Element) -> usize;
    /// Warns of data that was passed over, also behind the last element.
    fn finish(self, findings: &mut Vec<Finding>);

    /// Reads rows of vertices at once, as many as the encoding has a fast way for; the others go value by value.
    fn bulk_vertices(&mut self, _element: &Element, _columns: &Columns, _vertices: &mut Vertices) -> Outcome<usize> {
        Ok(0)
    }

    /// Reads rows of faces at once while they are well-formed triangles, at most `n_rows`, and returns how many.
    fn bulk_triangles(&mut self, _face: &FaceRow, _n_rows: usize, _n_vertices: usize, _faces: &mut Faces) -> usize {
        0
    }
}

/// Which properties of a vertex are read.
#[derive(Clone, Copy, Debug)]
pub(super) struct Columns {
    pub xyz: [usize; 3],
    /// `nx ny nz`, when they are there and asked for.
    pub normal: Option<[usize; 3]>,
}

/// What is read of vertices.
#[derive(Debug, Default)]
pub(super) struct Vertices {
    pub positions: Vec<Vec3>,
    /// One per position when [`Columns::normal`] is there, else none.
    pub normals: Vec<Vec3>,
}

/// What to do with the next property of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Step {
    /// Keep: a coordinate of this axis; behind the three of the position come those of the normal.
    Coordinate(usize, Kind),
    /// Keep: the list of vertex indices.
    Indices { count_kind: Kind, kind: Kind },
    /// Pass over scalars of one kind.
    Skip(Kind, usize),
    /// Pass over a list.
    SkipList { count_kind: Kind, kind: Kind },
}

/// The layout of a row of faces.
#[derive(Debug)]
pub(super) struct FaceRow {
    pub steps: Vec<Step>,
}

/// Reads all elements in their order; normals of vertices only when they are wanted.
///
/// # Errors
/// When the data ends early or holds what the header did not announce, or an index names no vertex.
pub(super) fn read<V: Values>(header: &Header, mut values: V, wanted: Attributes) -> Outcome<Soup> {
    let Some(vertex) = header.element("vertex") else {
        let what = "the header declares no element `vertex`";
        return Err(Finding::line(header.body_start.saturating_sub(1), what).into());
    };
    let columns = Columns { xyz: coordinates(vertex)?, normal: normal(vertex).filter(|_| wanted.normals) };
    let n_vertices = vertex.count;
    let mut vertices = Vertices::default();
    let mut faces = Faces::default();
    let mut findings = Vec::new();
    for element in &header.elements {
        values.check_count(element)?;
        match (element.name.as_str(), element.index_list()) {
            ("vertex", _) => read_vertices(element, &columns, &mut values, &mut vertices)?,
            ("face", Some(list)) => read_faces(element, list, &mut values, n_vertices, &mut faces)?,
            ("tristrips", Some(list)) => read_strips(element, list, &mut values, n_vertices, &mut faces)?,
            (name, _) => {
                if matches!(name, "face" | "tristrips") && element.count > 0 {
                    let rows = counted(element.count, "row has", "rows have");
                    let what = format!("`{name}` has no list `vertex_indices` or `vertex_index`: its {rows} no effect");
                    findings.push(Finding::line(element.declared_at, what));
                }
                skip_rows(element, &mut values)?;
            }
        }
    }
    values.finish(&mut findings);
    let Vertices { positions, normals } = vertices;
    Ok(Soup { positions, normals: columns.normal.map(|_| normals), faces, findings })
}

fn normal(vertex: &Element) -> Option<[usize; 3]> {
    let scalar = |name| vertex.property(name).filter(|&row| vertex.properties[row].count_kind.is_none());
    Some([scalar("nx")?, scalar("ny")?, scalar("nz")?])
}

fn coordinates(vertex: &Element) -> Outcome<[usize; 3]> {
    let mut xyz = [0; 3];
    for (place, name) in xyz.iter_mut().zip(["x", "y", "z"]) {
        let row = vertex.property(name).filter(|&row| vertex.properties[row].count_kind.is_none());
        *place = row.ok_or_else(|| {
            Finding::line(vertex.declared_at, format!("the element `vertex` has no scalar property `{name}`"))
                .expected("`x`, `y` and `z`")
        })?;
    }
    Ok(xyz)
}

/// What to do with each property; neighbours of one kind that are skipped are skipped together.
fn steps(element: &Element, keep: impl Fn(usize) -> Option<Step>) -> Vec<Step> {
    let mut steps: Vec<Step> = Vec::with_capacity(element.properties.len());
    for (row, property) in element.properties.iter().enumerate() {
        let step = keep(row).unwrap_or(match property.count_kind {
            Some(count_kind) => Step::SkipList { count_kind, kind: property.kind },
            None => Step::Skip(property.kind, 1),
        });
        match (steps.last_mut(), step) {
            (Some(Step::Skip(kind, n_values)), Step::Skip(next, 1)) if *kind == next => *n_values += 1,
            _ => steps.push(step),
        }
    }
    steps
}

/// Names the row in an error's key; the key is made only when there is an error.
fn in_row<T>(element: &Element, row: usize, outcome: Outcome<T>) -> Outcome<T> {
    outcome.map_err(|mut finding| {
        finding.key.get_or_insert_with(|| format!("{}[{row}]", element.name));
        finding
    })
}

fn read_vertices<V: Values>(
    element: &Element,
    columns: &Columns,
    values: &mut V,
    vertices: &mut Vertices,
) -> Outcome<()> {
    let Columns { xyz, normal } = *columns;
    let n_expected = element.count.min(values.n_bytes_left() / V::least_row_bytes(element));
    vertices.positions.reserve_exact(n_expected);
    vertices.normals.reserve_exact(if normal.is_some() { n_expected } else { 0 });
    let steps = steps(element, |row| {
        let kept = xyz.into_iter().chain(normal.into_iter().flatten());
        let axis = kept.enumerate().find_map(|(axis, place)| (place == row).then_some(axis))?;
        Some(Step::Coordinate(axis, element.properties[row].kind))
    });
    let n_done = values.bulk_vertices(element, columns, vertices)?;
    for row in n_done..element.count {
        let [position, direction] = in_row(element, row, read_vertex(&steps, values))?;
        vertices.positions.push(position);
        if normal.is_some() {
            vertices.normals.push(direction);
        }
    }
    Ok(())
}

#[inline]
fn read_vertex<V: Values>(steps: &[Step], values: &mut V) -> Outcome<[Vec3; 2]> {
    let mut coordinates = [0.0; 6];
    values.begin_row();
    for &step in steps {
        match step {
            Step::Coordinate(axis, kind) => coordinates[axis] = values.number(kind)? as f32,
            Step::Skip(kind, n_values) => values.skip(kind, n_values)?,
            Step::SkipList { count_kind, kind } | Step::Indices { count_kind, kind } => {
                let n_items = values.list_length(count_kind, kind)?;
                values.skip(kind, n_items)?;
            }
        }
    }
    values.end_row()?;
    let [x, y, z, nx, ny, nz] = coordinates;
    Ok([Vec3::new(x, y, z), Vec3::new(nx, ny, nz)])
}

fn face_row(element: &Element, list: usize) -> FaceRow {
    let property = &element.properties[list];
    let indices = property.count_kind.map(|count_kind| Step::Indices { count_kind, kind: property.kind });
    FaceRow { steps: steps(element, |row| indices.filter(|_| row == list)) }
}

fn read_faces<V: Values>(
    element: &Element,
    list: usize,
    values: &mut V,
    n_vertices: usize,
    faces: &mut Faces,
) -> Outcome<()> {
    let layout = face_row(element, list);
    // A triangle takes at least three indices more than the least row, which has an empty list.
    let triangle_bytes = V::least_row_bytes(element) + 3;
    faces.reserve(element.count.min(values.n_bytes_left() / triangle_bytes));
    let mut corners = Vec::new();
    let mut row = 0;
    while row < element.count {
        row += values.bulk_triangles(&layout, element.count - row, n_vertices, faces);
        if row < element.count {
            let at = values.begin_row();
            let read = read_indices(&layout, values, &mut corners, |value| index(value, n_vertices));
            in_row(element, row, read)?;
            faces.push(&corners, at);
            row += 1;
        }
    }
    Ok(())
}

/// Reads one row and collects what `index` makes of its indices.
#[inline]
fn read_indices<V: Values>(
    layout: &FaceRow,
    values: &mut V,
    corners: &mut Vec<u32>,
    index: impl Fn(f64) -> Outcome<u32>,
) -> Outcome<()> {
    corners.clear();
    for &step in &layout.steps {
        match step {
            Step::Indices { count_kind, kind } => {
                let n_items = values.list_length(count_kind, kind)?;
                corners.reserve(n_items);
                for _ in 0..n_items {
                    let value = values.number(kind)?;
                    let corner = index(value).map_err(|mut finding| {
                        finding.at = values.last_value_at();
                        finding
                    })?;
                    corners.push(corner);
                }
            }
            Step::Skip(kind, n_values) => values.skip(kind, n_values)?,
            Step::Coordinate(_, kind) => values.skip(kind, 1)?,
            Step::SkipList { count_kind, kind } => {
                let n_items = values.list_length(count_kind, kind)?;
                values.skip(kind, n_items)?;
            }
        }
    }
    values.end_row()
}

#[inline]
fn index(value: f64, n_vertices: usize) -> Outcome<u32> {
    let whole = value as i64;
    if whole as f64 == value && (0..n_vertices as i64).contains(&whole) {
        return Ok(whole as u32);
    }
    Err(no_such_vertex(value, n_vertices))
}

#[cold]
fn no_such_vertex(value: f64, n_vertices: usize) -> Box<Finding> {
    let expected = match n_vertices {
        0 => "none: the file has no vertices".to_string(),
        n => format!("a whole number from 0 to {}", n - 1),
    };
    Finding::file("an index names a vertex that does not exist").found(value).expected(expected).into()
}

/// Strips end with their row, and at −1 within it.
fn read_strips<V: Values>(
    element: &Element,
    list: usize,
    values: &mut V,
    n_vertices: usize,
    faces: &mut Faces,
) -> Outcome<()> {
    const RESTART: u32 = u32::MAX;
    let layout = face_row(element, list);
    let mut strips = Vec::new();
    for row in 0..element.count {
        let strip_index = |value: f64| if value == -1.0 { Ok(RESTART) } else { index(value, n_vertices) };
        values.begin_row();
        in_row(element, row, read_indices(&layout, values, &mut strips, strip_index))?;
        strips.split(|&corner| corner == RESTART).filter(|strip| !strip.is_empty()).for_each(|s| faces.push_strip(s));
    }
    Ok(())
}

fn skip_rows<V: Values>(element: &Element, values: &mut V) -> Outcome<()> {
    if element.properties.is_empty() {
        // Rows of nothing take no bytes: their number is the header's word alone.
        return Ok(());
    }
    let layout = FaceRow { steps: steps(element, |_| None) };
    let mut none = Vec::new();
    for row in 0..element.count {
        values.begin_row();
        in_row(element, row, read_indices(&layout, values, &mut none, |_| Ok(0)))?;
    }
    Ok(())
}
