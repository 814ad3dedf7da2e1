//! References: images so good that others are judged by them, and what is known of their own error.
//!
//! Two renders A and B with independent samples make a reference, which is their mean M. Their errors are independent and of one
//! size σ, so that RMSE(A, B) = √2·σ and the error of M is σ/√2: RMSE(A, B)/2 is an estimate of it, the *floor*.

use std::io;
use std::path::Path;

use super::frame::Frame;
use crate::accel::Accel;
use crate::error::{Error, Place, Problem};
use crate::film::exr::{self, ColorType, ExrAttributes, ExrOptions};
use crate::film::output::WriteSeek;
use crate::film::{Film, Plane, Samples};
use crate::measure::difference;
use crate::render::{self, Adaptive, Control, MAX_SPLITS, Settings, Spread, Stopped};

/// No error below this many floors is told: there the reference's own error counts for 1/18 of what is measured.
pub const FLOORS: f64 = 3.0;

/// Rays that together change a sample by less are left out of references.
const CUTOFF: f64 = 1e-9;

/// Cells with a contrast to their neighbours are divided while contrast times area times samples is above this. At 4096 samples an
/// edge of contrast 1 is followed to a 320th of a pixel, by about five hundred cells: as many samples again as the pixel has
/// everywhere, with a thousandth of their error.
const THRESHOLD_SAMPLES: f64 = 0.04;

/// The second half's seed differs from the first's by this, and both from those of runs, which are small.
const HALF_SEEDS: [u64; 2] = [0x5eed_a000_0000, 0x5eed_b000_0000];

/// Attributes of the file.
const HASH: &str = "flatray/referenceHash";
const FLOOR: &str = "flatray/referenceFloor";
const SAMPLES: &str = "flatray/referenceSamples";

/// The planes of a half.
const HALVES: [[&str; 3]; 2] = [["a.R", "a.G", "a.B"], ["b.R", "b.G", "b.B"]];

/// A reference.
#[derive(Clone, Debug, PartialEq)]
pub struct Reference {
    /// `R`, `G`, `B`, the mean, then the halves as layers `a` and `b`; F32.
    pub film: Film,
    /// The root mean square error that the halves tell of.
    pub floor: f64,
    /// As [`Frame::hash`].
    pub hash: String,
    /// Samples that every pixel has at least.
    pub samples: u32,
}

/// Samples per pixel as cells make them: a power of 4, at least 4 and what is asked for.
pub fn rounded_samples(samples: u32) -> u32 {
    4 << (2 * splits(samples))
}

/// Largest number of samples that can be asked for.
pub const MAX_SAMPLES: u32 = 1 << 24;

/// How often pixels are halved at least: each of two renders has two samples in a cell.
fn splits(samples: u32) -> u32 {
    (0..MAX_SPLITS).find(|splits| 4_u32 << (2 * splits) >= samples).unwrap_or(MAX_SPLITS - 1)
}

/// Renders a reference: everything that [`Frame`] says, at least `samples` per pixel, stratified, and more along edges of
/// whatever kind. What is exact elsewhere is exact here.
///
/// # Errors
/// [`Stopped`] when `control` asked for it.
pub fn make(frame: &Frame, accel: &Accel, samples: u32, control: &Control) -> Result<Reference, Stopped> {
    let threshold = THRESHOLD_SAMPLES / f64::from(rounded_samples(samples));
    let spread = Spread::Adaptive(Adaptive { min_splits: splits(samples), ..Adaptive::new(threshold) });
    let half = |seed: u64| {
        let seed = frame.settings.seed.wrapping_add(seed);
        let settings = Settings { spread, seed, cutoff: CUTOFF, ..frame.settings.clone() };
        render::render(frame.world, accel, frame.camera, &settings, control).map(|rendered| rendered.film)
    };
    let (a, b) = (half(HALF_SEEDS[0])?, half(HALF_SEEDS[1])?);
    Ok(of_halves(&a, &b, frame.hash(), rounded_samples(samples)))
}

/// Joins two independent renders of one frame, which have the planes `R`, `G` and `B`.
fn of_halves(a: &Film, b: &Film, hash: String, samples: u32) -> Reference {
    let values = |film: &Film, name: &str| -> Vec<f64> {
        let plane = film.plane(name).map(|plane| &plane.samples);
        (0..film.n_pixels()).map(|index| plane.map_or(0.0, |samples| samples.get(index))).collect()
    };
    let plane = |name: &str, values: Vec<f64>| {
        Plane::color(name, Samples::F32(values.into_iter().map(|value| value as f32).collect()))
    };
    let (mut means, mut halves, mut squares) = (Vec::new(), Vec::new(), 0.0);
    for (channel, name) in ["R", "G", "B"].into_iter().enumerate() {
        let (a, b) = (values(a, name), values(b, name));
        squares += a.iter().zip(&b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>();
        means.push(plane(name, a.iter().zip(&b).map(|(a, b)| 0.5 * (a + b)).collect()));
        halves.push(plane(HALVES[0][channel], a));
        halves.push(plane(HALVES[1][channel], b));
    }
    let floor = 0.5 * (squares / (3.0 * a.n_pixels() as f64)).sqrt();
    let film = with_planes(a, means.into_iter().chain(halves).collect());
    Reference { film, floor, hash, samples }
}

/// A film of the outline of another.
fn with_planes(film: &Film, planes: Vec<Plane>) -> Film {
    let Film { width_px, height_px, data_window, .. } = *film;
    Film { width_px, height_px, data_window, planes }
}

impl Reference {
    /// The least error that is told of.
    pub fn least(&self) -> f64 {
        FLOORS * self.floor
    }

    /// Writes the reference as an EXR file of 32-bit floats: mean and halves, and in the header the hash, the floor and the
    /// samples.
    ///
    /// # Errors
    /// What `out` answers.
    pub fn write(&self, mut out: &mut dyn WriteSeek) -> io::Result<()> {
        let text = |name: &str, value: String| (name.to_owned(), value);
        let attributes = ExrAttributes {
            texts: vec![text(HASH, self.hash.clone()), text(FLOOR, format!("{:e}", self.floor))],
            // Below 2^24.
            numbers: vec![(SAMPLES.to_owned(), self.samples as i32)],
            ..ExrAttributes::default()
        };
        let options = ExrOptions { color: ColorType::Float, ..ExrOptions::default() };
        exr::write(&self.film, &options, &attributes, &mut out)
    }

    /// Reads what [`Reference::write`] wrote. The floor is worked out from the halves.
    ///
    /// # Errors
    /// A file that cannot be read, or is no reference.
    pub fn read(path: &Path) -> Result<Reference, Error> {
        let attributes = exr::read_attributes(path)?;
        let film = exr::read(path)?;
        let text = |name: &str| attributes.texts.iter().find(|(own, _)| own == name).map(|(_, value)| value.clone());
        let number = |name: &str| attributes.numbers.iter().find(|(own, _)| own == name).map(|&(_, value)| value);
        let has = |name: &&str| film.plane(name).is_some();
        let (Some(hash), Some(samples), true) =
            (text(HASH), number(SAMPLES), HALVES.as_flattened().iter().chain(&["R", "G", "B"]).all(has))
        else {
            return Err(Problem::new(
                Place::file(path),
                "the image is no reference: it does not say what scene it is of",
            )
            .expected("what `flatray reference` writes")
            .into());
        };
        let half = |names: [&str; 3]| {
            let planes = names
                .iter()
                .zip(["R", "G", "B"])
                .filter_map(|(name, own)| film.plane(name).map(|plane| Plane::color(own, plane.samples.clone())));
            with_planes(&film, planes.collect())
        };
        Ok(of_halves(&half(HALVES[0]), &half(HALVES[1]), hash, u32::try_from(samples).unwrap_or(0)))
    }

    /// Refuses a reference of another size or scene.
    ///
    /// # Errors
    /// Which of the two, with what was found and expected.
    pub fn check(&self, frame: &Frame, path: &Path) -> Result<(), Error> {
        let own = (self.film.width_px, self.film.height_px);
        let wanted = (frame.camera.width_px, frame.camera.height_px);
        let size = |(width, height): (u32, u32)| format!("{width}×{height} pixels");
        if own != wanted || self.film.data_window.n_pixels() != frame.settings.region.n_pixels() {
            let problem = Problem::new(Place::file(path), "the reference has another size than the scene's image");
            return Err(problem.found(size(own)).expected(size(wanted)).into());
        }
        let hash = frame.hash();
        if self.hash != hash {
            let what = "the reference is of another scene, camera, depth or filter";
            return Err(Problem::new(Place::file(path), what)
                .found(format!("hash {}", self.hash))
                .expected(format!("hash {hash}"))
                .help("make it with `flatray reference`, with the same options")
                .into());
        }
        Ok(())
    }

    /// Root mean square difference of an image from the mean.
    ///
    /// # Errors
    /// An image of another size.
    pub fn rmse_of(&self, film: &Film) -> Result<f64, Error> {
        difference::compare(film, &self.film).map(|difference| difference.rmse)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::Region;

    #[test]
    fn samples_are_a_power_of_four() {
        assert_eq!(splits(4096), 5);
        for (asked, made) in [(1, 4), (4, 4), (5, 16), (4096, 4096), (4097, 16_384), (MAX_SAMPLES, MAX_SAMPLES)] {
            assert_eq!(rounded_samples(asked), made, "{asked}");
        }
    }

    fn film(values: &[f64]) -> Film {
        let width_px = values.len() as u32;
        let planes = ["R", "G", "B"].map(|name| Plane::color(name, Samples::F64(values.to_vec())));
        Film { width_px, height_px: 1, data_window: Region::whole(width_px, 1), planes: planes.into() }
    }

    #[test]
    fn the_floor_is_half_the_distance_of_the_halves_and_survives_a_file() {
        let reference = of_halves(&film(&[0.5, 0.25]), &film(&[0.25, 0.25]), "0123".into(), 64);
        assert_eq!(reference.floor, 0.5 * (0.0625f64 / 2.0).sqrt());
        assert_eq!(reference.film.plane("G").unwrap().samples, Samples::F32(vec![0.375, 0.25]));
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("r.exr");
        crate::film::output::write_file(&path, |out| reference.write(out)).unwrap();
        let read = Reference::read(&path).unwrap();
        assert_eq!((read.floor, &read.hash, read.samples), (reference.floor, &reference.hash, 64));
        assert_eq!(read.film.plane("a.B").unwrap().samples, Samples::F32(vec![0.5, 0.25]));
    }
}
