//! The header: which elements and properties follow, in what encoding.

use super::super::MAX_VERTICES;
use super::super::finding::{Finding, Outcome, quoted};
use super::super::number::is_blank;

/// More elements, or properties of one element, than this are refused: names are compared each with each. Scanners and
/// splat files stay below a hundred.
const MAX_ELEMENTS: usize = 256;
const MAX_PROPERTIES: usize = 1024;

/// How the body is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    BinaryLittleEndian,
    BinaryBigEndian,
}

/// The scalar types.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Property {
    pub name: String,
    /// The type of the value, or of a list's items.
    pub kind: Kind,
    /// For a list, the type of the count before the items.
    pub count_kind: Option<Kind>,
}

#[derive(Clone, Debug)]
pub(super) struct Element {
    pub name: String,
    /// Number of rows, as the header says; not yet compared with the data.
    pub count: usize,
    pub properties: Vec<Property>,
    /// Offset of the line that declares it.
    pub declared_at: usize,
}

#[derive(Clone, Debug)]
pub(super) struct Header {
    pub encoding: Encoding,
    pub elements: Vec<Element>,
    /// Offset of the first byte behind `end_header` and its line end.
    pub body_start: usize,
}

impl Kind {
    fn by_name(name: &[u8]) -> Option<Kind> {
        Some(match name {
            b"char" | b"int8" => Kind::I8,
            b"uchar" | b"uint8" => Kind::U8,
            b"short" | b"int16" => Kind::I16,
            b"ushort" | b"uint16" => Kind::U16,
            b"int" | b"int32" => Kind::I32,
            b"uint" | b"uint32" => Kind::U32,
            b"float" | b"float32" => Kind::F32,
            b"double" | b"float64" => Kind::F64,
            _ => return None,
        })
    }

    /// Bytes in a binary body.
    pub fn size(self) -> usize {
        match self {
            Kind::I8 | Kind::U8 => 1,
            Kind::I16 | Kind::U16 => 2,
            Kind::I32 | Kind::U32 | Kind::F32 => 4,
            Kind::F64 => 8,
        }
    }

    fn is_integer(self) -> bool {
        !matches!(self, Kind::F32 | Kind::F64)
    }
}

impl Element {
    /// Position of a property among its row's.
    pub fn property(&self, name: &str) -> Option<usize> {
        self.properties.iter().position(|property| property.name == name)
    }

    /// The list that names vertices, under either of its customary names.
    pub fn index_list(&self) -> Option<usize> {
        ["vertex_indices", "vertex_index"]
            .iter()
            .find_map(|name| self.property(name))
            .filter(|&row| self.properties[row].count_kind.is_some())
    }
}

impl Header {
    /// The only element of a name.
    pub fn element(&self, name: &str) -> Option<&Element> {
        self.elements.iter().find(|element| element.name == name)
    }
}

/// Lines of the header with their offsets. A file whose first line ends with a lone `\r` keeps that custom throughout,
/// so that a first data byte of 10 is not mistaken for half a line end.
struct Lines<'a> {
    bytes: &'a [u8],
    at: usize,
    line_end: u8,
}

/// Offset, words, and the whole line.
type Line<'a> = (usize, Vec<&'a [u8]>, &'a [u8]);

impl<'a> Lines<'a> {
    fn new(bytes: &'a [u8]) -> Lines<'a> {
        let first_end = bytes.iter().position(|&b| b == b'\n' || b == b'\r');
        let lone_return = first_end.is_some_and(|end| bytes[end] == b'\r' && bytes.get(end + 1) != Some(&b'\n'));
        Lines { bytes, at: 0, line_end: if lone_return { b'\r' } else { b'\n' } }
    }

    /// `None` at the end of the file.
    fn next(&mut self) -> Option<Line<'a>> {
        let start = self.at;
        let rest = self.bytes.get(start..).filter(|rest| !rest.is_empty())?;
        let length = rest.iter().position(|&b| b == self.line_end).unwrap_or(rest.len());
        self.at = (start + length + 1).min(self.bytes.len());
        let line = rest[..length].trim_ascii_end();
        let words = line.split(|&b| is_blank(b)).filter(|word| !word.is_empty()).collect();
        Some((start, words, line))
    }
}

/// Reads the header.
///
/// # Errors
/// When the magic, the format line or `end_header` is missing, or a line is not what may stand in a header.
pub(super) fn parse(bytes: &[u8]) -> Outcome<Header> {
    let mut lines = Lines::new(bytes);
    match lines.next() {
        Some((_, words, _)) if words == [b"ply"] => {}
        other => {
            let found = other.map_or("nothing".to_string(), |(_, _, line)| quoted(line));
            return Err(Finding::line(0, "this is not a PLY file").found(found).expected("`ply`").into());
        }
    }
    let mut encoding = None;
    let mut elements: Vec<Element> = Vec::new();
    while let Some((at, words, line)) = lines.next() {
        let bad = |what: &str, expected: &str| Finding::line(at, what).found(quoted(line)).expected(expected);
        match words.as_slice() {
            [] | [b"comment" | b"obj_info", ..] => {}
            [b"format", name, version] => encoding = Some(parse_format(at, name, version)?),
            [b"element", name, count] => elements.push(parse_element(at, name, count, &elements)?),
            [b"property", declaration @ ..] => {
                let Some(element) = elements.last_mut() else {
                    return Err(bad("a property stands before any element", "an `element` line first").into());
                };
                let property =
                    parse_property(declaration).ok_or_else(|| bad("unknown property declaration", PROPERTY_FORMS))?;
                if element.properties.len() == MAX_PROPERTIES {
                    return Err(bad("too many properties", &format!("at most {MAX_PROPERTIES} of an element")).into());
                }
                if element.property(&property.name).is_some() {
                    let what = format!("the property `{}` of `{}` is declared twice", property.name, element.name);
                    return Err(Finding::line(at, what).into());
                }
                element.properties.push(property);
            }
            [b"end_header"] => {
                let Some(encoding) = encoding else {
                    return Err(bad("the header names no format", "a `format` line before it").into());
                };
                return Ok(Header { encoding, elements, body_start: lines.at });
            }
            _ => return Err(bad("unknown header line", HEADER_LINES).into()),
        }
    }
    Err(Finding::line(bytes.len(), "the file ends inside the header").expected("`end_header`").into())
}

const PROPERTY_FORMS: &str = "`property TYPE NAME` or `property list COUNT_TYPE TYPE NAME` with types char, uchar, \
    short, ushort, int, uint, float, double, or int8 to float64; counts are integers";

const HEADER_LINES: &str =
    "`format NAME 1.0`, `comment`, `obj_info`, `element NAME COUNT`, `property …` or `end_header`";

fn parse_format(at: usize, name: &[u8], version: &[u8]) -> Outcome<Encoding> {
    if version != b"1.0" {
        return Err(Finding::line(at, "unknown version of the format").found(quoted(version)).expected("`1.0`").into());
    }
    match name {
        b"ascii" => Ok(Encoding::Ascii),
        b"binary_little_endian" => Ok(Encoding::BinaryLittleEndian),
        b"binary_big_endian" => Ok(Encoding::BinaryBigEndian),
        _ => Err(Finding::line(at, "unknown format")
            .found(quoted(name))
            .expected("`ascii`, `binary_little_endian` or `binary_big_endian`")
            .into()),
    }
}

fn parse_element(at: usize, name: &[u8], count: &[u8], before: &[Element]) -> Outcome<Element> {
    if before.len() == MAX_ELEMENTS {
        return Err(Finding::line(at, "too many elements").expected(format!("at most {MAX_ELEMENTS}")).into());
    }
    let shown = quoted(name);
    let name = String::from_utf8_lossy(name).into_owned();
    if before.iter().any(|element| element.name == name) {
        return Err(Finding::line(at, format!("the element {shown} is declared twice")).into());
    }
    let parsed = std::str::from_utf8(count).ok().and_then(|text| text.parse::<usize>().ok());
    let Some(parsed) = parsed else {
        return Err(Finding::line(at, format!("the count of the element {shown} is no number of rows"))
            .found(quoted(count))
            .expected("a whole number, 0 or more")
            .into());
    };
    if name == "vertex" && parsed > MAX_VERTICES {
        return Err(Finding::line(at, "too many vertices")
            .found(parsed)
            .expected(format!("at most {MAX_VERTICES}"))
            .into());
    }
    Ok(Element { name, count: parsed, properties: Vec::new(), declared_at: at })
}

fn parse_property(declaration: &[&[u8]]) -> Option<Property> {
    let (kind, count_kind, name) = match *declaration {
        [b"list", count_kind, kind, name] => (Kind::by_name(kind)?, Some(Kind::by_name(count_kind)?), name),
        [kind, name] => (Kind::by_name(kind)?, None, name),
        _ => return None,
    };
    if count_kind.is_some_and(|kind| !kind.is_integer()) {
        return None;
    }
    Some(Property { name: String::from_utf8_lossy(name).into_owned(), kind, count_kind })
}
