//! What a render can put into the film beside the beauty, and the planes that it takes.

use crate::film::{Content, Plane, Samples};

/// A layer of the film. Their order is that of the planes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Aov {
    /// Parts of the radiance at the first hit: k_a·O_a. The six parts sum up to the beauty.
    Ambient,
    /// What lights bring by the diffuse term.
    Diffuse,
    /// What lights bring by the specular term.
    Specular,
    /// What is mirrored, total internal reflection included.
    Reflection,
    /// What is refracted.
    Refraction,
    /// What camera rays see that hit nothing.
    Background,
    /// The light of each group, through every bounce, and what comes from no light: ambient terms and background.
    /// They sum up to the beauty too.
    Lights,
    /// k_d·O_d; 0 where nothing is.
    Albedo,
    /// Distance along the view axis; infinite where nothing is.
    Z,
    /// World position.
    P,
    /// Unit shading normal as it is shaded with, in world space.
    N,
    /// Unit geometric normal, as the primitive gives it.
    Ng,
    /// Barycentric weights of a triangle's second and third corner; 0 for other kinds.
    Uv,
    /// The object's row in the scene plus 1; 0 where nothing is.
    Object,
    /// The material's row plus 1; 0 where nothing is.
    Material,
    /// Samples taken.
    Samples,
    /// Cryptomatte of objects.
    CryptoObject,
    /// Cryptomatte of materials.
    CryptoMaterial,
    /// Nodes and leaves visited and rays sent for the pixel's samples, each ray walked by itself.
    Cost,
}

impl Aov {
    /// All of them, in order.
    pub const ALL: [Aov; 19] = [
        Aov::Ambient,
        Aov::Diffuse,
        Aov::Specular,
        Aov::Reflection,
        Aov::Refraction,
        Aov::Background,
        Aov::Lights,
        Aov::Albedo,
        Aov::Z,
        Aov::P,
        Aov::N,
        Aov::Ng,
        Aov::Uv,
        Aov::Object,
        Aov::Material,
        Aov::Samples,
        Aov::CryptoObject,
        Aov::CryptoMaterial,
        Aov::Cost,
    ];

    /// The parts of the beauty at the first hit. They come first among all layers.
    pub const LOBES: [Aov; 6] =
        [Aov::Ambient, Aov::Diffuse, Aov::Specular, Aov::Reflection, Aov::Refraction, Aov::Background];
}

/// Some layers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AovSet(u32);

impl AovSet {
    /// The set of these.
    pub fn of(aovs: &[Aov]) -> AovSet {
        AovSet(aovs.iter().fold(0, |bits, &aov| bits | 1 << aov as u32))
    }

    /// Whether a layer is in it.
    #[inline]
    pub fn has(self, aov: Aov) -> bool {
        self.0 & 1 << aov as u32 != 0
    }
}

/// What is asked for of a render beside the beauty; nothing by default.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Aovs {
    /// The layers.
    pub wanted: AovSet,
    /// Names of the light groups, by [`LightGroupId`](crate::world::LightGroupId), for the layers of [`Aov::Lights`].
    pub light_groups: Vec<String>,
    /// For [`Aov::CryptoObject`] the Cryptomatte id of each object, by row; objects of one id are one matte.
    pub object_mattes: Vec<u32>,
    /// The same of materials.
    pub material_mattes: Vec<u32>,
    /// Ids a pixel that a matte keeps, those that cover most of it; two to a layer of four channels.
    pub matte_levels: u32,
}

/// Ids a pixel in a Cryptomatte unless asked for otherwise.
pub const DEFAULT_MATTE_LEVELS: u32 = 6;

impl Aovs {
    /// Asks for layers, of a scene without light groups and mattes: the fields are for those.
    pub fn of(wanted: &[Aov]) -> Aovs {
        Aovs { wanted: AovSet::of(wanted), matte_levels: DEFAULT_MATTE_LEVELS, ..Aovs::default() }
    }

    /// Whether a layer is asked for.
    #[inline]
    pub fn has(&self, aov: Aov) -> bool {
        self.wanted.has(aov)
    }

    /// Whether any is.
    #[inline]
    pub fn any(&self) -> bool {
        self.wanted != AovSet::default()
    }

    /// Whether any of several is.
    pub fn any_of(&self, aovs: &[Aov]) -> bool {
        aovs.iter().any(|&aov| self.has(aov))
    }

    /// Those that are asked for, in order.
    pub fn iter(&self) -> impl Iterator<Item = Aov> {
        Aov::ALL.into_iter().filter(|&aov| self.has(aov))
    }

    /// The planes of a layer: names, and what they hold.
    fn outlines(&self, aov: Aov) -> Vec<Outline> {
        match aov {
            Aov::Ambient => rgb("ambient"),
            Aov::Diffuse => rgb("diffuse"),
            Aov::Specular => rgb("specular"),
            Aov::Reflection => rgb("reflection"),
            Aov::Refraction => rgb("refraction"),
            Aov::Background => rgb("background"),
            Aov::Lights => {
                let groups = self.light_groups.iter().map(|group| format!("light_{group}"));
                std::iter::once("light_ambient".to_owned()).chain(groups).flat_map(|layer| rgb(&layer)).collect()
            }
            Aov::Albedo => rgb("albedo"),
            Aov::Z => vec![("Z".to_owned(), Kind::Float)],
            Aov::P => channels("P", &["X", "Y", "Z"], Kind::Float),
            Aov::N => channels("N", &["X", "Y", "Z"], Kind::Float),
            Aov::Ng => channels("Ng", &["X", "Y", "Z"], Kind::Float),
            Aov::Uv => channels("uv", &["U", "V"], Kind::Float),
            Aov::Object => channels("object", &["I"], Kind::Uint),
            Aov::Material => channels("material", &["I"], Kind::Uint),
            Aov::Samples => channels("samples", &["I"], Kind::Uint),
            Aov::CryptoObject => self.matte("CryptoObject"),
            Aov::CryptoMaterial => self.matte("CryptoMaterial"),
            Aov::Cost => channels("cost", &["nodes", "leaf_tests", "rays"], Kind::Uint),
        }
    }

    /// Id and coverage, id and coverage: two ranks to a layer (Cryptomatte specification 1.2.0, "Channel naming").
    fn matte(&self, name: &str) -> Vec<Outline> {
        let layers = 0..self.matte_levels.div_ceil(2);
        layers.flat_map(|layer| channels(&format!("{name}{layer:02}"), &["R", "G", "B", "A"], Kind::Float)).collect()
    }

    /// Planes of a layer.
    pub(super) fn n_planes_of(&self, aov: Aov) -> usize {
        self.outlines(aov).len()
    }

    /// The planes of all layers that are asked for, black.
    pub(super) fn planes(&self, n_pixels: usize) -> Vec<Plane> {
        let plane = |(name, kind)| match kind {
            Kind::Color => Plane { name, content: Content::Color, samples: Samples::F32(vec![0.0; n_pixels]) },
            Kind::Float => Plane { name, content: Content::Data, samples: Samples::F32(vec![0.0; n_pixels]) },
            Kind::Uint => Plane { name, content: Content::Data, samples: Samples::U32(vec![0; n_pixels]) },
        };
        self.iter().flat_map(|aov| self.outlines(aov)).map(plane).collect()
    }
}

type Outline = (String, Kind);

#[derive(Clone, Copy)]
enum Kind {
    Color,
    Float,
    Uint,
}

fn rgb(layer: &str) -> Vec<Outline> {
    channels(layer, &["R", "G", "B"], Kind::Color)
}

fn channels(layer: &str, names: &[&str], kind: Kind) -> Vec<Outline> {
    names.iter().map(|name| (format!("{layer}.{name}"), kind)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_list_of_all_is_in_order_and_complete() {
        assert!(Aov::ALL.iter().enumerate().all(|(index, &aov)| aov as usize == index));
        assert_eq!(Aov::Cost as usize + 1, Aov::ALL.len());
        assert_eq!(Aov::LOBES, Aov::ALL[..6]);
    }

    #[test]
    fn planes_come_in_the_order_of_layers_whatever_the_order_of_asking() {
        assert!(!Aovs::of(&[]).any() && Aovs::default().planes(4).is_empty());
        let wanted = Aovs::of(&[Aov::CryptoObject, Aov::Z, Aov::Object, Aov::Lights]);
        let aovs = Aovs { light_groups: vec!["key".to_owned()], matte_levels: 3, ..wanted };
        let planes = aovs.planes(4);
        let names: Vec<&str> = planes.iter().map(|plane| plane.name.as_str()).collect();
        let lights =
            ["light_ambient.R", "light_ambient.G", "light_ambient.B", "light_key.R", "light_key.G", "light_key.B"];
        assert_eq!(names[..6], lights);
        assert_eq!(names[6..10], ["Z", "object.I", "CryptoObject00.R", "CryptoObject00.G"]);
        assert_eq!(names[14..], ["CryptoObject01.B", "CryptoObject01.A"]);
        assert!(planes[..6].iter().all(|plane| plane.content == Content::Color));
        assert!(planes[6..].iter().all(|plane| plane.content == Content::Data && plane.samples.len() == 4));
    }
}
