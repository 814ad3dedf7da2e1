//! Wavefront MTL: materials, mapped on the Phong model. (Wavefront, "Advanced Visualizer" manual, "MTL material format".)
//!
//! `docs/SCENE_FORMAT.md` states the mapping. Values that are no numbers or out of range are passed over with a warning;
//! textures are ignored with one.

use glam::DVec3;

use super::super::MeshMaterial;
use super::super::finding::{At, Finding, Tally, counted, quoted};
use super::super::number::{parse_f64, token};
use super::cursor::Cursor;
use crate::world::Material;

/// The light from all around that `Ka` reflects; the file does not say how much there is.
const AMBIENT_LIGHT: f64 = 0.1;

/// `Kd` of a material that does not state it.
const DEFAULT_DIFFUSE: DVec3 = DVec3::splat(0.8);

/// A material as the file states it.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct MtlMaterial {
    pub name: Vec<u8>,
    ambient: Option<DVec3>,
    diffuse: Option<DVec3>,
    specular: Option<DVec3>,
    emission: Option<DVec3>,
    exponent: Option<f64>,
    illumination_model: Option<f64>,
    /// `d`, which overrules `Tr`.
    dissolve: Option<f64>,
    transparency: Option<f64>,
    ior: Option<f64>,
}

/// What a library holds, in its order.
#[derive(Debug)]
pub(super) struct Library {
    pub materials: Vec<MtlMaterial>,
    pub findings: Vec<Finding>,
}

/// Reads a whole library; there is no text that is refused.
pub(super) fn parse(bytes: &[u8]) -> Library {
    let mut reader = Reader { bytes, ..Reader::default() };
    let mut cursor = Cursor { bytes, at: 0 };
    while cursor.at < bytes.len() {
        if cursor.seek_value() {
            reader.statement(cursor);
        }
        cursor.skip_statement();
    }
    reader.finish()
}

#[derive(Default)]
struct Reader<'a> {
    bytes: &'a [u8],
    materials: Vec<MtlMaterial>,
    textures: Tally,
    malformed: Tally,
    unknown: Tally,
    homeless: Tally,
}

impl Reader<'_> {
    fn statement(&mut self, mut cursor: Cursor) {
        let start = cursor.at;
        let keyword = cursor.token();
        cursor.at += keyword.len();
        if keyword == b"newmtl" {
            self.materials.push(MtlMaterial { name: cursor.rest_of_statement(), ..MtlMaterial::default() });
            return;
        }
        let Some(material) = self.materials.last_mut() else {
            self.homeless.add(At::Line(start));
            return;
        };
        let is_read = match keyword {
            b"Ka" => set(&mut material.ambient, color(cursor)),
            b"Kd" => set(&mut material.diffuse, color(cursor)),
            b"Ks" => set(&mut material.specular, color(cursor)),
            b"Ke" => set(&mut material.emission, color(cursor)),
            b"Ns" => set(&mut material.exponent, number(&mut cursor, |ns| (0.0..=MOST).contains(&ns))),
            b"Ni" => set(&mut material.ior, number(&mut cursor, |ni| ni > 0.0 && ni <= MOST)),
            b"illum" => {
                let is_model = |model: f64| (0.0..=10.0).contains(&model) && model.fract() == 0.0;
                set(&mut material.illumination_model, number(&mut cursor, is_model))
            }
            b"d" => {
                if cursor.seek_value() && cursor.token() == b"-halo" {
                    cursor.at += b"-halo".len();
                }
                set(&mut material.dissolve, number(&mut cursor, |d| (0.0..=1.0).contains(&d)))
            }
            b"Tr" => set(&mut material.transparency, number(&mut cursor, |tr| (0.0..=1.0).contains(&tr))),
            b"Tf" | b"sharpness" => true,
            _ if is_texture(keyword) => {
                self.textures.add(At::Line(start));
                true
            }
            _ => {
                self.unknown.add(At::Line(start));
                true
            }
        };
        if !is_read {
            self.malformed.add(At::Line(start));
        }
    }

    fn finish(self) -> Library {
        let Reader { bytes, materials, textures, malformed, unknown, homeless } = self;
        let statement = |finding: &Finding| match finding.at {
            At::Line(start) => {
                let mut cursor = Cursor { bytes, at: start };
                cursor.skip_statement();
                quoted(bytes[start..cursor.at].trim_ascii())
            }
            _ => String::new(),
        };
        let keyword = |finding: &Finding| match finding.at {
            At::Line(start) => quoted(token(bytes, start)),
            _ => String::new(),
        };
        let mut findings = Vec::new();
        findings.extend(homeless.finding(|count| {
            format!("{} before the first `newmtl` and ignored", counted(count, "statement stands", "statements stand"))
        }));
        findings.extend(
            malformed.finding(|count| format!("{} ignored", counted(count, "value is", "values are"))).map(|finding| {
                let found = statement(&finding);
                finding.found(found).expected("a colour of 1 or 3 numbers, or a number, within the range of its key")
            }),
        );
        findings.extend(textures.finding(|count| {
            format!("{} ignored: colours come from Ka, Kd and Ks alone", counted(count, "texture is", "textures are"))
        }));
        let unknown = unknown.finding(|count| format!("{} ignored", counted(count, "statement is", "statements are")));
        findings.extend(unknown.map(|finding| {
            let found = keyword(&finding);
            finding.found(found)
        }));
        Library { materials, findings }
    }
}

/// The largest value that tables hold.
const MOST: f64 = f32::MAX as f64;

/// Keeps a value that could be read; the last one counts.
fn set<T>(place: &mut Option<T>, value: Option<T>) -> bool {
    let is_read = value.is_some();
    *place = value.or(place.take());
    is_read
}

fn number(cursor: &mut Cursor, is_in_range: impl Fn(f64) -> bool) -> Option<f64> {
    if !cursor.seek_value() {
        return None;
    }
    let (value, end) = parse_f64(cursor.bytes, cursor.at)?;
    cursor.at = end;
    Some(value).filter(|&value| is_in_range(value))
}

/// Red, green and blue, or one number for all three. Spectral files and CIE XYZ are not read.
fn color(mut cursor: Cursor) -> Option<DVec3> {
    let is_in_range = |value: f64| (0.0..=MOST).contains(&value);
    let red = number(&mut cursor, is_in_range)?;
    if !cursor.seek_value() {
        return Some(DVec3::splat(red));
    }
    Some(DVec3::new(red, number(&mut cursor, is_in_range)?, number(&mut cursor, is_in_range)?))
}

fn is_texture(keyword: &[u8]) -> bool {
    let keyword = keyword.to_ascii_lowercase();
    keyword.starts_with(b"map_") || matches!(keyword.as_slice(), b"bump" | b"disp" | b"decal" | b"refl" | b"norm")
}

impl MtlMaterial {
    /// The material on the Phong model.
    pub fn phong(&self) -> MeshMaterial {
        let diffuse = self.diffuse.unwrap_or(DEFAULT_DIFFUSE);
        let ambient = self.ambient.unwrap_or(diffuse);
        let specular = self.specular.unwrap_or(DVec3::ZERO);
        let emission = self.emission.unwrap_or(DVec3::ZERO);
        // Highlights without a mirror where nothing is said, as all programs take it.
        let model = self.illumination_model.map_or(2, |model| model as u8);
        let glow = if model == 0 { diffuse } else { AMBIENT_LIGHT * ambient };
        let is_lit = f64::from(u8::from(model != 0));
        let has_highlight = f64::from(u8::from(model >= 2));
        let is_mirror = (3..=9).contains(&model);
        // What is dissolved lets the rest through, bent only where the model asks for refraction.
        let k_t = self.dissolve.map(|d| 1.0 - d).or(self.transparency).unwrap_or(0.0);
        let opacity = 1.0 - k_t;
        let bends = matches!(model, 4 | 6 | 7 | 9);
        MeshMaterial {
            name: String::from_utf8_lossy(&self.name).into_owned(),
            material: Material {
                ambient: (glow + emission).min(DVec3::splat(MOST)),
                diffuse,
                specular,
                k_a: opacity,
                k_d: opacity * is_lit,
                k_s: opacity * has_highlight,
                reflectance: Some(if is_mirror { specular.element_sum() / 3.0 } else { 0.0 }),
                shininess: self.exponent.unwrap_or(Material::default().shininess),
                k_t,
                ior: self.ior.filter(|_| bends).unwrap_or(if bends { Material::default().ior } else { 1.0 }),
            },
        }
    }
}
