//! What to write beside the beauty: the options, and what they come to for a scene.

use clap::Args;
use clap::error::ErrorKind;

use super::failure::Failure;
use crate::error::{Place, Problem};
use crate::film::cryptomatte;
use crate::render::aov::DEFAULT_MATTE_LEVELS;
use crate::render::{Aov, Aovs};
use crate::scene::{AovKey, Compiled, Names};

/// Most ids a pixel that a Cryptomatte keeps.
const MAX_MATTE_LEVELS: i64 = 32;

/// Options of `flatray render`.
#[derive(Args, Clone, Debug, Default)]
pub struct AovArgs {
    /// Layers of the EXR beside the beauty, comma-separated: all, lobes (ambient, diffuse, specular, reflection, refraction,
    /// background), lights, albedo, Z, P, N, Ng, uv, object, material, samples, cryptomatte (CryptoObject, CryptoMaterial)
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = AovKey::parse, help_heading = "Output")]
    pub aov: Option<Vec<AovKey>>,
    /// Ids a pixel that a Cryptomatte keeps [default: 6]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=MAX_MATTE_LEVELS),
          help_heading = "Output")]
    pub cryptomatte_levels: Option<u32>,
}

impl AovArgs {
    /// The layers of a render: those of the command line, or else those of the scene. Without an EXR there are none.
    ///
    /// # Errors
    /// Wrong usage: layers for no EXR, parts of a beauty that is not their sum.
    pub fn settle(&self, scene: &Compiled, course: bool, writes_exr: bool) -> Result<Aovs, Failure> {
        if !writes_exr && (self.aov.is_some() || self.cryptomatte_levels.is_some()) {
            let message = "only an EXR holds AOVs: none is among the outputs";
            return Err(Failure::usage("render", ErrorKind::ArgumentConflict, message));
        }
        let asked = if writes_exr { self.aov.as_ref().unwrap_or(&scene.render.aovs).as_slice() } else { &[] };
        let wanted: Vec<Aov> = asked.iter().flat_map(|&key| aovs_of(key)).collect();
        let is_part = |aov: &Aov| *aov == Aov::Lights || Aov::LOBES.contains(aov);
        if course && wanted.iter().any(is_part) {
            let message = "'--compat course' clamps every bounce, so that lobes and lights do not add up: leave them out of \
                           '--aov'";
            return Err(Failure::usage("render", ErrorKind::ArgumentConflict, message));
        }
        let Names { objects, materials, light_groups } = &scene.names;
        let ids = |aov: Aov, names: &[String]| match wanted.contains(&aov) {
            true => names.iter().map(|name| cryptomatte::id_of(name)).collect(),
            false => Vec::new(),
        };
        Ok(Aovs {
            light_groups: light_groups.clone(),
            object_mattes: ids(Aov::CryptoObject, objects),
            material_mattes: ids(Aov::CryptoMaterial, materials),
            matte_levels: self.cryptomatte_levels.unwrap_or(DEFAULT_MATTE_LEVELS),
            ..Aovs::of(&wanted)
        })
    }
}

/// The Cryptomatte attributes of an EXR with these layers.
pub fn attributes(aovs: &Aovs, names: &Names) -> Vec<(String, String)> {
    mattes(aovs, names).flat_map(|(layer, names)| cryptomatte::attributes(layer, names)).collect()
}

/// What a user should know of the mattes: names that share one.
pub fn warnings(aovs: &Aovs, names: &Names) -> Vec<Problem> {
    let merged = mattes(aovs, names).flat_map(|(layer, names)| {
        cryptomatte::merged(names).into_iter().map(move |group| {
            let (first, n) = (group[0], group.len());
            let what = match group.iter().find(|&&name| name != first) {
                None => format!("{n} of the same name are one matte of {layer}"),
                Some(other) => format!("\"{first}\" and \"{other}\" have one id, and are one matte of {layer}"),
            };
            Problem::new(Place::default(), what).found(format!("\"{first}\""))
        })
    });
    merged.collect()
}

fn mattes<'a>(aovs: &Aovs, names: &'a Names) -> impl Iterator<Item = (&'static str, &'a [String])> {
    let layers = [
        (Aov::CryptoObject, "CryptoObject", &names.objects[..]),
        (Aov::CryptoMaterial, "CryptoMaterial", &names.materials[..]),
    ];
    let asked = layers.map(|(aov, layer, names)| aovs.has(aov).then_some((layer, names)));
    asked.into_iter().flatten()
}

fn aovs_of(key: AovKey) -> Vec<Aov> {
    match key {
        // Costs change how rays are traced, if not what they hit: they are asked for by name.
        AovKey::All => Aov::ALL.into_iter().filter(|&aov| aov != Aov::Cost).collect(),
        AovKey::Lobes => Aov::LOBES.into(),
        AovKey::Ambient => vec![Aov::Ambient],
        AovKey::Diffuse => vec![Aov::Diffuse],
        AovKey::Specular => vec![Aov::Specular],
        AovKey::Reflection => vec![Aov::Reflection],
        AovKey::Refraction => vec![Aov::Refraction],
        AovKey::Background => vec![Aov::Background],
        AovKey::Lights => vec![Aov::Lights],
        AovKey::Albedo => vec![Aov::Albedo],
        AovKey::Z => vec![Aov::Z],
        AovKey::P => vec![Aov::P],
        AovKey::N => vec![Aov::N],
        AovKey::Ng => vec![Aov::Ng],
        AovKey::Uv => vec![Aov::Uv],
        AovKey::Object => vec![Aov::Object],
        AovKey::Material => vec![Aov::Material],
        AovKey::Samples => vec![Aov::Samples],
        AovKey::Cryptomatte => vec![Aov::CryptoObject, Aov::CryptoMaterial],
        AovKey::CryptoObject => vec![Aov::CryptoObject],
        AovKey::CryptoMaterial => vec![Aov::CryptoMaterial],
        AovKey::Cost => vec![Aov::Cost],
    }
}
