//! The binary encodings: values back to back, in either byte order.

use glam::Vec3;

use super::super::faces::Faces;
use super::super::finding::{At, Finding, Outcome, counted};
use super::body::{FaceRow, Step, Values};
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

    /// The common layouts, three floats or three doubles side by side among other scalars, in one loop.
    fn bulk_vertices(&mut self, element: &Element, xyz: [usize; 3], positions: &mut Vec<Vec3>) -> Outcome<usize> {
        let [x, y, z] = xyz;
        let properties = &element.properties;
        let kind = properties[x].kind;
        let is_plain = (y, z) == (x + 1, x + 2)
            && properties.iter().all(|property| property.count_kind.is_none())
            && properties[y].kind == kind
            && properties[z].kind == kind
            && matches!(kind, Kind::F32 | Kind::F64);
        if !is_plain || element.count == 0 {
            return Ok(0);
        }
        let stride = Self::least_row_bytes(element);
        let offset: usize = properties[..x].iter().map(|property| property.kind.size()).sum();
        let n_bytes = stride.saturating_mul(element.count);
        let Some(data) = self.rest_bytes().get(..n_bytes) else { return Err(self.ends_early(n_bytes)) };
        let float = |row: &[u8], axis: usize| Self::u32(row.get(4 * axis..)?).map(f32::from_bits);
        let double = |row: &[u8], axis: usize| Some(f64::from_bits(Self::u64(row.get(8 * axis..)?)?) as f32);
        let rows = data.chunks_exact(stride).map(|row| &row[offset..]);
        let position = |x: Option<f32>, y: Option<f32>, z: Option<f32>| Some(Vec3::new(x?, y?, z?));
        // No row can fail: all of them were sliced to the stride, which holds the three values.
        if kind == Kind::F32 {
            positions.extend(rows.filter_map(|row| position(float(row, 0), float(row, 1), float(row, 2))));
        } else {
            positions.extend(rows.filter_map(|row| position(double(row, 0), double(row, 1), double(row, 2))));
        }
        self.at += n_bytes;
        Ok(element.count)
    }

    /// The common layout: a byte for the count and four for an index, between scalars.
    fn bulk_triangles(&mut self, face: &FaceRow, n_rows: usize, n_vertices: usize, faces: &mut Faces) -> usize {
        let (mut before, mut after, mut found) = (0, 0, false);
        for &step in &face.steps {
            match step {
                Step::Skip(kind, n_values) => {
                    let n_bytes = kind.size() * n_values;
                    *(if found { &mut after } else { &mut before }) += n_bytes;
                }
                Step::Indices { count_kind: Kind::U8 | Kind::I8, kind: Kind::I32 | Kind::U32 } => found = true,
                _ => return 0,
            }
        }
        let stride = before + 13 + after;
        let mut n_done = 0;
        for row in self.rest_bytes().chunks_exact(stride).take(n_rows) {
            let list = &row[before..before + 13];
            if list[0] != 3 {
                break;
            }
            let [Some(a), Some(b), Some(c)] = [1, 5, 9].map(|at| Self::u32(&list[at..])) else { break };
            // A negative index is beyond any count of vertices here, which fit 31 bits.
            if a.max(b).max(c) as usize >= n_vertices {
                break;
            }
            faces.push_triangle([a, b, c]);
            n_done += 1;
        }
        self.at += n_done * stride;
        n_done
    }
}
