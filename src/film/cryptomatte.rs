//! Cryptomatte: ids of names, and what a header says of them. (Friedman and Jones, *Cryptomatte specification*, 1.2.0.)
//!
//! The only file that uses the `murmur3` crate.

use std::collections::BTreeMap;

use serde_json::{Map, Value};

/// The id of a name: MurmurHash3 (x86, 32 bits, seed 0) of its UTF-8 bytes, as the bits of a float. Where these would be an
/// infinity, a NaN or a denormal, the lowest bit of the exponent is flipped.
pub fn id_of(name: &str) -> u32 {
    // Reading from memory does not fail.
    let hash = murmur3::murmur3_32(&mut name.as_bytes(), 0).unwrap_or_default();
    let exponent = hash >> 23 & 0xff;
    if exponent == 0 || exponent == 0xff { hash ^ 1 << 23 } else { hash }
}

/// The header's attributes for a matte of some names: `layer` is `CryptoObject` or another that the file has.
pub fn attributes(layer: &str, names: &[String]) -> Vec<(String, String)> {
    let key = format!("{:08x}", id_of(layer));
    let prefix = format!("cryptomatte/{}/", &key[..7]);
    let manifest: Map<String, Value> =
        names.iter().map(|name| (name.clone(), Value::String(format!("{:08x}", id_of(name))))).collect();
    let texts = [
        ("name", layer.to_owned()),
        ("hash", "MurmurHash3_32".to_owned()),
        ("conversion", "uint32_to_float32".to_owned()),
        ("manifest", Value::Object(manifest).to_string()),
    ];
    texts.map(|(what, text)| (prefix.clone() + what, text)).into()
}

/// Names of which a matte cannot tell one from another: equal ones, and others of one id. Each group once, in the order of its
/// first.
pub fn merged(names: &[String]) -> Vec<Vec<&str>> {
    let mut of_id: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for (row, name) in names.iter().enumerate() {
        of_id.entry(id_of(name)).or_default().push(row);
    }
    let mut groups: Vec<Vec<usize>> = of_id.into_values().filter(|rows| rows.len() > 1).collect();
    groups.sort_unstable();
    groups.into_iter().map(|rows| rows.into_iter().map(|row| names[row].as_str()).collect()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_are_those_that_others_compute() {
        // `tests/compositing.py` has an implementation of its own.
        assert_eq!(id_of("torus"), 4_053_562_365);
        assert_eq!(id_of("равнина"), 2_518_896_926);
        assert_eq!(format!("{:08x}", id_of("torus")), "f19c73fd");
    }

    #[test]
    fn ids_are_normal_floats() {
        for index in 0..200_000 {
            let id = f32::from_bits(id_of(&format!("object {index}")));
            assert!(id.is_normal(), "{index}: {id}");
        }
    }

    #[test]
    fn a_manifest_is_sorted_json_and_names_are_escaped() {
        let names = ["torus", "a \"b\"", "равнина"].map(str::to_owned);
        let attributes = attributes("CryptoObject", &names);
        assert!(attributes.iter().all(|(key, _)| key.len() == 20 + key.split('/').next_back().unwrap().len()));
        assert_eq!(attributes[0].1, "CryptoObject");
        let manifest: BTreeMap<String, String> = serde_json::from_str(&attributes[3].1).unwrap();
        assert_eq!(manifest["torus"], "f19c73fd");
        assert_eq!(manifest["равнина"], "9623511e");
        assert_eq!(manifest.len(), 3);
    }

    #[test]
    fn names_that_share_an_id_are_told() {
        let names = ["a", "b", "a", "c", "b", "a"].map(str::to_owned);
        assert_eq!(merged(&names), [vec!["a", "a", "a"], vec!["b", "b"]]);
        assert!(merged(&names[3..4]).is_empty());
    }
}
