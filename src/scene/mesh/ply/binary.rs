//! The binary encodings: values back to back, in either byte order.

use glam::Vec3;
use rayon::prelude::*;

use super::super::faces::Faces;
use super::super::finding::{At, Finding, Outcome, counted};
use super::body::{Columns, FaceRow, Step, Values, Vertices};
use super::header::{Element, Kind};

#[derive(Debug)]
pub(super) struct Binary<'a, const LITTLE_ENDIAN: bool> {
    bytes: &'a [u8],
    at: usize,
    /// Where the latest value began, for messages.
    value_start: usize,
}

/// The first `N` bytes.
#[inline]
fn head<const N: usize>(bytes: &[u8]) -> Option<[u8; N]> {
    bytes.first_chunk::<N>().copied()
}

impl<'a, const LITTLE_ENDIAN: bool> Binary<'a, LITTLE_ENDIAN> {
    pub fn new(bytes: &'a [u8], body_start: usize) -> Self {
        Binary { bytes, at: body_start.min(bytes.len()), value_start: 0 }
    }

    fn rest_bytes(&self) -> &'a [u8] {
        &self.bytes[self.at..]
    }

    #[inline]
    fn u16(bytes: &[u8]) -> Option<u16> {
        let bytes = head(bytes)?;
        Some(if LITTLE_ENDIAN { u16::from_le_bytes(bytes) } else { u16::from_be_bytes(bytes) })
    }

    #[inline]
    fn u32(bytes: &[u8]) -> Option<u32> {
        let bytes = head(bytes)?;
        Some(if LITTLE_ENDIAN { u32::from_le_bytes(bytes) } else { u32::from_be_bytes(bytes) })
    }

    #[inline]
    fn u64(bytes: &[u8]) -> Option<u64> {
        let bytes = head(bytes)?;
        Some(if LITTLE_ENDIAN { u64::from_le_bytes(bytes) } else { u64::from_be_bytes(bytes) })
    }

    /// Every kind fits an f64 exactly.
    #[inline]
    fn value(bytes: &[u8], kind: Kind) -> Option<f64> {
        Some(match kind {
            Kind::I8 => f64::from(i8::from_ne_bytes(head(bytes)?)),
            Kind::U8 => f64::from(*bytes.first()?),
            Kind::I16 => f64::from(Self::u16(bytes)?.cast_signed()),
            Kind::U16 => f64::from(Self::u16(bytes)?),
            Kind::I32 => f64::from(Self::u32(bytes)?.cast_signed()),
            Kind::U32 => f64::from(Self::u32(bytes)?),
            Kind::F32 => f64::from(f32::from_bits(Self::u32(bytes)?)),
            Kind::F64 => f64::from_bits(Self::u64(bytes)?),
        })
    }

    #[cold]
    fn ends_early(&self, n_bytes: usize) -> Box<Finding> {
        let left = counted(self.n_bytes_left(), "byte", "bytes");
        Finding::byte(self.at, "the file ends inside a row").found(left).expected(format!("{n_bytes} more")).into()
    }
}

impl<const LITTLE_ENDIAN: bool> Values for Binary<'_, LITTLE_ENDIAN> {
    #[inline]
    fn number(&mut self, kind: Kind) -> Outcome<f64> {
        let value = Self::value(self.rest_bytes(), kind).ok_or_else(|| self.ends_early(kind.size()))?;
        self.value_start = self.at;
        self.at += kind.size();
        Ok(value)
    }

    #[inline]
    fn list_length(&mut self, count_kind: Kind, item_kind: Kind) -> Outcome<usize> {
        let at = self.at;
        let value = self.number(count_kind)?;
        if value < 0.0 {
            return Err(Finding::byte(at, "a list has no such length").found(value).expected("0 or more").into());
        }
        let length = value as usize;
        if length > self.n_bytes_left() / item_kind.size() {
            return Err(Finding::byte(at, "a list is longer than the rest of the file")
                .found(format!("{} of {} bytes", counted(length, "item", "items"), item_kind.size()))
                .expected(format!("at most the {} bytes left can hold", self.n_bytes_left()))
                .into());
        }
        Ok(length)
    }

    #[inline]
    fn skip(&mut self, kind: Kind, n_values: usize) -> Outcome<()> {
        let n_bytes = kind.size().saturating_mul(n_values);
        if n_bytes > self.n_bytes_left() {
            return Err(self.ends_early(n_bytes));
        }
        self.at += n_bytes;
        Ok(())
    }

    #[inline]
    fn end_row(&mut self) -> Outcome<()> {
        Ok(())
    }

    #[inline]
    fn begin_row(&mut self) -> At {
        At::Byte(self.at)
    }

    fn last_value_at(&self) -> At {
        At::Byte(self.value_start)
    }

    fn check_count(&self, element: &Element) -> Outcome<()> {
        let Element { name, count, .. } = element;
        let least = Self::least_row_bytes(element);
        let n_left = self.n_bytes_left();
        if count.checked_mul(least).is_some_and(|needed| needed <= n_left) {
            return Ok(());
        }
        Err(Finding::byte(self.bytes.len(), format!("the file ends before the {count} rows of `{name}` do"))
            .key(format!("{name}[{}]", n_left / least.max(1)))
            .found(counted(n_left, "byte", "bytes"))
            .expected(format!("at least {least} bytes a row"))
            .into())
    }

    fn n_bytes_left(&self) -> usize {
        self.bytes.len() - self.at
    }

    fn least_row_bytes(element: &Element) -> usize {
        element.properties.iter().map(|property| property.count_kind.unwrap_or(property.kind).size()).sum()
    }

    /// Some writers end a binary file with a line end.
    fn finish(self, findings: &mut Vec<Finding>) {
        if !self.rest_bytes().trim_ascii().is_empty() {
            let bytes = counted(self.n_bytes_left(), "byte is", "bytes are");
            findings.push(Finding::byte(self.at, format!("{bytes} left behind the last element, and ignored")));
        }
    }

    /// The common layouts, floats or doubles among other scalars, by all threads.
    fn bulk_vertices(&mut self, element: &Element, columns: &Columns, vertices: &mut Vertices) -> Outcome<usize> {
        if element.count == 0 || element.properties.iter().any(|property| property.count_kind.is_some()) {
            return Ok(0);
        }
        let places = [Some(columns.xyz), columns.normal].map(|place| place.map(|place| Triple::of(element, place)));
        let (xyz, normal) = match places {
            [Some(Some(xyz)), None] => (xyz, None),
            [Some(Some(xyz)), Some(Some(normal))] => (xyz, Some(normal)),
            _ => return Ok(0),
        };
        let stride = Self::least_row_bytes(element);
        let n_bytes = stride.saturating_mul(element.count);
        let Some(data) = self.rest_bytes().get(..n_bytes) else { return Err(self.ends_early(n_bytes)) };
        Self::triples(data, stride, xyz, &mut vertices.positions);
        if let Some(normal) = normal {
            Self::triples(data, stride, normal, &mut vertices.normals);
        }
        self.at += n_bytes;
        Ok(element.count)
    }

    /// The common layouts, a list with four bytes for an index between scalars, by all threads.
    fn bulk_triangles(&mut self, face: &FaceRow, n_rows: usize, n_vertices: usize, faces: &mut Faces) -> usize {
        let Some(layout) = TriangleRow::of(face) else { return 0 };
        let triangle = |row: &[u8]| Self::triangle(row, layout, n_vertices);
        let mut n_done = 0;
        // More each time, so that what is read in vain, behind a row that is no triangle, is little beside what was of
        // use; and nothing where that row is the first.
        let mut n_rows_each = 1 << 10;
        while n_done < n_rows {
            let rest = self.rest_bytes();
            let n_next = n_rows_each.min(n_rows - n_done).min(rest.len() / layout.stride);
            let rows = &rest[..n_next * layout.stride];
            if rows.get(..layout.stride).and_then(triangle).is_none() {
                break;
            }
            let rows = rows.par_chunks_exact(layout.stride).with_min_len(1 << 12);
            let n_triangles = faces.extend_triangles(rows.map(triangle));
            self.at += n_triangles * layout.stride;
            n_done += n_triangles;
            if n_triangles < n_next {
                break;
            }
            n_rows_each = n_rows_each.saturating_mul(8);
        }
        n_done
    }
}

/// Three numbers of one kind in a row: the offset of each.
#[derive(Clone, Copy, Debug)]
struct Triple {
    offsets: [usize; 3],
    is_double: bool,
}

impl Triple {
    /// `None` when they are no floats and no doubles.
    fn of(element: &Element, places: [usize; 3]) -> Option<Triple> {
        let properties = &element.properties;
        let is_double = properties[places[0]].kind == Kind::F64;
        let kind = if is_double { Kind::F64 } else { Kind::F32 };
        let offset = |place: usize| properties[..place].iter().map(|property| property.kind.size()).sum();
        places.iter().all(|&place| properties[place].kind == kind).then_some(())?;
        Some(Triple { offsets: places.map(offset), is_double })
    }
}

/// A row of a triangle.
#[derive(Clone, Copy, Debug)]
struct TriangleRow {
    stride: usize,
    /// Offsets of the count and of the three indices.
    count: usize,
    indices: usize,
}

impl TriangleRow {
    /// `None` for another layout than a list of four-byte indices among scalars.
    fn of(face: &FaceRow) -> Option<TriangleRow> {
        let (mut stride, mut list) = (0, None);
        for &step in &face.steps {
            match step {
                Step::Skip(kind, n_values) => stride += kind.size() * n_values,
                Step::Indices { count_kind, kind: Kind::I32 | Kind::U32 } => {
                    list = Some((stride, stride + count_kind.size()));
                    stride += count_kind.size() + 12;
                }
                _ => return None,
            }
        }
        list.map(|(count, indices)| TriangleRow { stride, count, indices })
    }
}

impl<const LITTLE_ENDIAN: bool> Binary<'_, LITTLE_ENDIAN> {
    /// Appends three numbers of each row.
    fn triples(rows: &[u8], stride: usize, triple: Triple, to: &mut Vec<Vec3>) {
        let Triple { offsets, is_double } = triple;
        let rows = rows.par_chunks_exact(stride).with_min_len(1 << 12);
        // No number can be missing: the stride holds them all.
        let float = |row: &[u8], at: usize| f32::from_bits(row.get(at..).and_then(Self::u32).unwrap_or_default());
        let double = |row: &[u8], at: usize| f64::from_bits(row.get(at..).and_then(Self::u64).unwrap_or_default());
        if is_double {
            to.par_extend(rows.map(|row| Vec3::from_array(offsets.map(|at| double(row, at) as f32))));
        } else {
            to.par_extend(rows.map(|row| Vec3::from_array(offsets.map(|at| float(row, at)))));
        }
    }

    /// The corners of a row that has three, all in range.
    #[inline]
    fn triangle(row: &[u8], layout: TriangleRow, n_vertices: usize) -> Option<[u32; 3]> {
        let TriangleRow { count, indices, .. } = layout;
        let n_corners = match indices - count {
            1 => u32::from(*row.get(count)?),
            2 => u32::from(Self::u16(row.get(count..)?)?),
            _ => Self::u32(row.get(count..)?)?,
        };
        let list: &[u8; 12] = row.get(indices..)?.first_chunk()?;
        let [a, b, c] = [Self::u32(list)?, Self::u32(&list[4..])?, Self::u32(&list[8..])?];
        // A negative index is beyond any count of vertices here, which fit 31 bits.
        (n_corners == 3 && (a.max(b).max(c) as usize) < n_vertices).then_some([a, b, c])
    }
}
