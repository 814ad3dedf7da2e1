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
            let statements = counted(count, "statement is", "statements are");
            format!("{statements} ignored: no `newmtl` stands above")
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

#[cfg(test)]
mod tests {
    use super::*;

    /// The one material of a text, and the findings.
    fn one(text: &str) -> (MeshMaterial, Vec<String>) {
        let Library { materials, findings } = parse(text.as_bytes());
        assert_eq!(materials.len(), 1, "{text}");
        (materials[0].phong(), findings.into_iter().map(|finding| finding.what).collect())
    }

    /// Columns that the tables are made of: ambient, diffuse, specular, mirror.
    fn columns(text: &str) -> (DVec3, DVec3, DVec3, f64) {
        let Material { ambient, diffuse, specular, k_a, k_d, k_s, reflectance, .. } = one(text).0.material;
        (k_a * ambient, k_d * diffuse, k_s * specular, reflectance.unwrap())
    }

    const PAINT: &str = "newmtl a\nKa 0.5 0.5 1\nKd 0.2 0.4 0.6\nKs 0.1 0.2 0.6\nNs 32\n";

    #[test]
    fn illumination_models_say_which_terms_there_are() {
        let (ambient, diffuse, specular) =
            (DVec3::new(0.05, 0.05, 0.1), DVec3::new(0.2, 0.4, 0.6), DVec3::new(0.1, 0.2, 0.6));
        let of_model = |model: &str| columns(&format!("{PAINT}{model}"));
        assert_eq!(of_model("illum 0"), (diffuse, DVec3::ZERO, DVec3::ZERO, 0.0));
        assert_eq!(of_model("illum 1"), (ambient, diffuse, DVec3::ZERO, 0.0));
        for highlight in ["", "illum 2", "illum 10"] {
            assert_eq!(of_model(highlight), (ambient, diffuse, specular, 0.0), "{highlight}");
        }
        for model in 3..=9 {
            let (a, d, s, mirror) = of_model(&format!("illum {model}"));
            assert_eq!((a, d, s), (ambient, diffuse, specular));
            assert!((mirror - 0.3).abs() < 1e-15, "the mean of Ks: {mirror}");
        }
        assert_eq!(one(PAINT).0.material.shininess, 32.0);
    }

    #[test]
    fn what_is_not_stated_has_a_default_and_ke_glows() {
        let grey = DVec3::splat(0.8);
        assert_eq!(columns("newmtl a"), (0.1 * grey, grey, DVec3::ZERO, 0.0));
        assert_eq!(columns("newmtl a\nKd 0.5\nKe 1 2 3").0, DVec3::new(1.05, 2.05, 3.05));
        assert_eq!(one("newmtl a").0.material.shininess, 1.0);
        assert_eq!(columns("newmtl a\nKa 3e38\nKe 3.4e38").0.max_element(), f64::from(f32::MAX));
    }

    #[test]
    fn what_is_dissolved_lets_the_rest_through_and_bends_where_the_model_refracts() {
        let through = |text: &str| {
            let Material { k_t, ior, .. } = one(&format!("newmtl a\n{text}")).0.material;
            (k_t, ior)
        };
        assert_eq!(through("d 0.25\nNi 1.3"), (0.75, 1.0));
        assert_eq!(through("d 0.25\nNi 1.3\nillum 6"), (0.75, 1.3));
        assert_eq!(through("d -halo 0.25\nillum 4"), (0.75, Material::default().ior));
        assert_eq!(through("Tr 0.25"), (0.25, 1.0));
        assert_eq!(through("Tr 1\nd 1").0, 0.0, "d overrules Tr");
        let (ambient, diffuse, specular, _) = columns(&format!("{PAINT}d 0.5"));
        assert_eq!(
            (2.0 * ambient, 2.0 * diffuse, 2.0 * specular.x),
            (DVec3::new(0.05, 0.05, 0.1), DVec3::new(0.2, 0.4, 0.6), 0.1)
        );
    }

    #[test]
    fn names_may_have_blanks_and_any_bytes_and_statements_any_line_end_and_indentation() {
        let Library { materials, findings } =
            parse(b"# made by hand\r\n  newmtl \t two words #2 \r\n\tKd 1 0 \\\r\n 0\r\nnewmtl caf\xe9\rKd 0 1 0");
        assert!(findings.is_empty(), "{findings:?}");
        assert_eq!(
            (materials[0].name.as_slice(), materials[1].name.as_slice()),
            (&b"two words #2"[..], &b"caf\xe9"[..])
        );
        assert_eq!((materials[0].diffuse, materials[1].diffuse), (Some(DVec3::X), Some(DVec3::Y)));
        assert_eq!(materials[1].phong().name, "caf\u{fffd}");
    }

    #[test]
    fn malformed_values_are_passed_over_and_counted_once_with_the_first() {
        let text = "Kd 1 1 1\nnewmtl a\nKd 0.5\nKd 1 x 1\nKd -1 0 0\nKd 1 2\nKs nan 0 0\nNs\nillum 1.5\nillum 99\nd 2\nNi 0\n\
                    Ka spectral a.rfl\nKa xyz 1 1 1\nmap_Kd a.png\nbump b.png\nmap_Bump c.png\nPr 1\nTf 1 1 1\nsharpness 60\n";
        let Library { materials, findings } = parse(text.as_bytes());
        assert_eq!(materials[0].phong().material.diffuse, DVec3::splat(0.5));
        let told: Vec<String> = findings.iter().map(|f| format!("{:?} {} {:?}", f.at, f.what, f.found)).collect();
        assert_eq!(
            told,
            [
                "Line(0) 1 statement is ignored: no `newmtl` stands above None",
                "Line(25) 11 values are ignored Some(\"`Kd 1 x 1`\")",
                "Line(124) 3 textures are ignored: colours come from Ka, Kd and Ks alone None",
                "Line(163) 1 statement is ignored Some(\"`Pr`\")",
            ]
        );
    }

    #[test]
    fn mutated_libraries_give_materials_that_tables_can_hold() {
        let valid =
            format!("{PAINT}illum 3\nd 0.5\nNi 1.5\nKe 1\nmap_Kd a.png\n{PAINT}Tr 0.5 \\\n # x\nfoo 1\n").into_bytes();
        let mut state = 3_u64;
        let mut random = |below: usize| {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 33) as usize % below
        };
        for _ in 0..5000 {
            let mut text = valid.clone();
            for _ in 0..=random(5) {
                let at = random(text.len());
                match random(3) {
                    0 => text[at] = b"9-.e \\\n\r#\xff"[random(10)],
                    1 => text.insert(at, text[random(text.len())]),
                    _ => drop(text.drain(at..(at + random(9)).min(text.len()))),
                }
            }
            for material in parse(&text).materials {
                let Material { ambient, diffuse, specular, reflectance, shininess, k_t, ior, .. } =
                    material.phong().material;
                let colors = [ambient, diffuse, specular].into_iter().flat_map(|color| color.to_array());
                let numbers = colors.chain([shininess, reflectance.unwrap(), ior]);
                assert!(numbers.into_iter().all(|x| (0.0..=MOST).contains(&x)), "{}", text.escape_ascii());
                assert!((0.0..=1.0).contains(&k_t) && ior > 0.0);
            }
        }
    }
}
