//! POV-Ray with one frame, once its pixels are found to be ours.

use tempfile::TempDir;

use super::engine::{Engines, Shot};
use super::frame::Frame;
use super::reference::Reference;
use super::setting::{Amount, Setting, Way};
use crate::error::{Error, Place};
use crate::film::Film;
use crate::measure::povray::program::{Job, Program, write_scene};
use crate::measure::povray::{Antialiasing, export};
use crate::measure::process::Ended;
use crate::render::{Control, Sampler};

/// The program, and the frame as it has it.
#[derive(Debug)]
pub struct Peer {
    program: Program,
    job: Job,
    /// The folder of the job.
    _folder: TempDir,
}

/// Samples in pixels' centres agree to this share of white: a PNG has steps of 1/65535, and two programs are some roundings apart.
const AGREEMENT: f64 = 1e-3;

/// Pixels that may differ by more: those whose centre an edge passes so closely that tolerances decide.
const MAX_FAR_SHARE: f64 = 0.01;

impl Peer {
    /// Exports a frame. The reference tells how bright it is.
    ///
    /// # Errors
    /// What POV-Ray cannot express, or a file that cannot be written.
    pub fn new(program: Program, frame: &Frame, reference: &Reference) -> Result<Peer, Error> {
        let white = white_of(&reference.film);
        let text = export::scene(frame.world, frame.camera, frame.settings, white).map_err(|refused| {
            let what: Vec<&str> = refused.iter().map(|what| what.0).collect();
            Error::new(Place::default(), format!("POV-Ray cannot express {}", what.join("; nor ")))
        })?;
        let folder = tempfile::tempdir()
            .map_err(|error| Error::new(Place::default(), format!("cannot make a temporary folder: {error}")))?;
        write_scene(folder.path(), &text)?;
        let size_px = [frame.camera.width_px, frame.camera.height_px];
        let job = Job { folder: folder.path().to_owned(), size_px, threads: frame.settings.threads, white };
        Ok(Peer { program, job, _folder: folder })
    }

    /// Renders, and says how long the process took.
    ///
    /// # Errors
    /// As [`Program::render`].
    pub fn render(&self, antialiasing: &Antialiasing, control: &Control) -> Result<(Film, f64), Ended> {
        self.program.render(&self.job, antialiasing, control)
    }

    /// What the program calls its version.
    pub fn version(&self) -> &str {
        &self.program.version
    }

    /// Half a step of its pictures.
    pub fn rounding(&self) -> f64 {
        self.job.white / 65_535.0 / 2.0
    }

    /// How long it takes for one pixel: to start, and to read the scene.
    ///
    /// # Errors
    /// As [`Program::render`].
    pub fn start_seconds(&self, control: &Control) -> Result<f64, Ended> {
        let job = Job { size_px: [1, 1], ..self.job.clone() };
        self.program.render(&job, &Antialiasing::Uniform { grid: 1 }, control).map(|(_, seconds)| seconds)
    }
}

/// The power of two, at least 1, that nothing in the image comes near.
fn white_of(film: &Film) -> f64 {
    let planes = film.planes.iter().take(3);
    let values = planes.flat_map(|plane| (0..plane.samples.len()).map(|index| plane.samples.get(index)));
    let largest = values.fold(0.0, f64::max);
    let mut white = 1.0;
    // Single samples are brighter than the pixels that they are part of.
    while white < 1.25 * largest && white < 1e9 {
        white *= 2.0;
    }
    white
}

/// What both make of the samples in the pixels' centres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Agreement {
    /// Pixels that differ by more than a thousandth of white.
    pub far: usize,
    /// Pixels.
    pub n_pixels: usize,
}

impl Agreement {
    /// Whether their times can be compared.
    pub fn holds(&self) -> bool {
        self.far as f64 <= MAX_FAR_SHARE * self.n_pixels as f64
    }
}

/// Compares the two at one sample a pixel, in its centre.
///
/// # Errors
/// A stop, or a process that fails.
pub fn agreement(engines: &mut Engines, control: &Control) -> Result<Agreement, Ended> {
    let center = Setting::of(Amount::Samples { sampler: Sampler::Center, samples: 1 });
    let Shot { film: ours, .. } = engines.render(&Way::Flatray(center), 0, control)?;
    let Shot { film: theirs, .. } = engines.render(&Way::Povray(Antialiasing::Uniform { grid: 1 }), 0, control)?;
    let white = engines.peer().map_or(1.0, |peer| peer.job.white);
    let n_pixels = ours.n_pixels();
    let far = match (ours.color_planes(), theirs.color_planes()) {
        (Some(a), Some(b)) if theirs.n_pixels() == n_pixels => {
            let differs = |index: usize, channel: usize| {
                (a[channel].samples.get(index) - b[channel].samples.get(index)).abs() > AGREEMENT * white
            };
            (0..n_pixels).filter(|&index| (0..3).any(|channel| differs(index, channel))).count()
        }
        _ => n_pixels,
    };
    Ok(Agreement { far, n_pixels })
}
