//! The names of what a render can write beside the beauty, as scenes and the command line state them.

use super::nearest::advice;

/// Something to write beside the beauty, or several things under one name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum AovKey {
    /// Everything but costs.
    All,
    /// The six parts of the beauty that follow.
    Lobes,
    Ambient,
    Diffuse,
    Specular,
    Reflection,
    Refraction,
    Background,
    /// The light of each group, and what comes from no light.
    Lights,
    Albedo,
    Z,
    P,
    N,
    Ng,
    Uv,
    Object,
    Material,
    Samples,
    /// The two that follow.
    Cryptomatte,
    CryptoObject,
    CryptoMaterial,
    Cost,
}

impl AovKey {
    /// What they are called.
    pub const WORDS: [(&'static str, AovKey); 22] = [
        ("all", AovKey::All),
        ("lobes", AovKey::Lobes),
        ("ambient", AovKey::Ambient),
        ("diffuse", AovKey::Diffuse),
        ("specular", AovKey::Specular),
        ("reflection", AovKey::Reflection),
        ("refraction", AovKey::Refraction),
        ("background", AovKey::Background),
        ("lights", AovKey::Lights),
        ("albedo", AovKey::Albedo),
        ("Z", AovKey::Z),
        ("P", AovKey::P),
        ("N", AovKey::N),
        ("Ng", AovKey::Ng),
        ("uv", AovKey::Uv),
        ("object", AovKey::Object),
        ("material", AovKey::Material),
        ("samples", AovKey::Samples),
        ("cryptomatte", AovKey::Cryptomatte),
        ("CryptoObject", AovKey::CryptoObject),
        ("CryptoMaterial", AovKey::CryptoMaterial),
        ("cost", AovKey::Cost),
    ];

    /// The one that a word names, in upper or lower case.
    ///
    /// # Errors
    /// A sentence that names the nearest word, or all of them.
    pub fn parse(word: &str) -> Result<AovKey, String> {
        let found = AovKey::WORDS.iter().find(|(name, _)| name.eq_ignore_ascii_case(word));
        let advice = || advice(word, AovKey::WORDS.iter().map(|(name, _)| *name));
        found.map(|&(_, key)| key).ok_or_else(|| format!("unknown AOV, {}", advice()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_found_in_either_case_and_slips_of_the_pen_are_told_the_nearest() {
        assert_eq!(AovKey::parse("z"), Ok(AovKey::Z));
        assert_eq!(AovKey::parse("cryptoobject"), Ok(AovKey::CryptoObject));
        assert_eq!(AovKey::parse("difuse"), Err("unknown AOV, did you mean 'diffuse'?".to_owned()));
        assert!(AovKey::parse("quux").unwrap_err().contains("all, lobes, ambient"));
    }
}
