//! What memory the machine has, and what a render will want of it.

use std::fs;

use super::budget::Budget;
use super::output::Output;
use super::plan::Plan;
use super::quantity;
use crate::accel::AccelKind;
use crate::error::{Error, Place, Problem};
use crate::film::exr::{ColorType, ExrOptions};
use crate::film::output::Format;
use crate::film::{Content, Film, Plane, Region, Samples};
use crate::render::{self, Settings};
use crate::scene::machine::kib_field;
use crate::world::{Camera, World};

/// What a PNG of 16 bits holds of a pixel if nothing can be compressed.
const PNG_BYTES_PER_PIXEL: u64 = 8;

/// What building the BVH wants at its peak for one primitive, with the finished tree: within a factor of two of all that
/// was measured. Smooth meshes take 120 to 320, separate beams, of which no two can be clustered, 370, and a million
/// slivers in one box, whose tree alone takes 186, 480.
const BUILD_BYTES_PER_PRIM: u64 = 240;

/// What a render has and wants, in bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Need {
    /// The image's planes, and the files that are made of them.
    pub film: u64,
    /// The tables: already there when this is asked.
    pub tables: u64,
    /// An estimate for building the acceleration structure.
    pub accel: u64,
}

impl Need {
    /// What a render of this plan wants. Files are kept until the last pixel is known; a crop that is padded is held twice.
    pub fn of(world: &World, camera: &Camera, plan: &Plan, outputs: &[Output]) -> Need {
        let one_pixel = Settings { region: Region::whole(1, 1), ..plan.settings.clone() };
        let film = render::new_film(camera, &one_pixel);
        // Rounds of a target or a time keep the image of the one before.
        let n_films = if plan.budget == Budget::Samples { 1 } else { 2 };
        let planes = film_bytes_per_pixel(&film) * n_films;
        let files: u64 =
            outputs.iter().map(|output| file_bytes_per_pixel(output.format, &film, plan.exr.options)).sum();
        let n_pixels = |region: Region| u64::from(region.width_px()) * u64::from(region.height_px());
        let (rendered, whole) =
            (n_pixels(plan.settings.region), n_pixels(Region::whole(camera.width_px, camera.height_px)));
        let bytes = match plan.pads_crop {
            false => rendered.saturating_mul(planes + files),
            true => (rendered + whole).saturating_mul(planes).saturating_add(whole.saturating_mul(files)),
        };
        Need { film: bytes, ..Need::of_structure(world, plan.accel) }
    }

    /// What the acceleration structure alone wants.
    pub fn of_structure(world: &World, kind: AccelKind) -> Need {
        let accel = match kind {
            AccelKind::Bvh => world.n_prims() as u64 * BUILD_BYTES_PER_PRIM,
            AccelKind::Linear => 0,
        };
        Need { film: 0, tables: table_bytes(world), accel }
    }

    /// Everything that is held at the peak.
    pub fn total(&self) -> u64 {
        let Need { film, tables, accel } = *self;
        film.saturating_add(tables).saturating_add(accel)
    }

    /// Refuses what does not fit. `available` is what the system says it can still give, if it says.
    ///
    /// # Errors
    /// When film and acceleration structure are larger than what is left, or than one allocation may be.
    pub fn check(&self, available: Option<u64>) -> Result<(), Error> {
        let still_wanted = self.film.saturating_add(self.accel);
        if available.is_some_and(|available| still_wanted > available) || !can_reserve(still_wanted) {
            let Need { film, tables, accel } = *self;
            let what = format!(
                "the image and the scene do not fit into memory: image {}, scene tables {} (loaded), acceleration about {}",
                quantity::bytes(film),
                quantity::bytes(tables),
                quantity::bytes(accel)
            );
            let left = available.map_or_else(|| "less".to_owned(), |available| quantity::bytes(available) + " free");
            return Err(Problem::new(Place::default(), what)
                .found(left)
                .expected(format!("{} free", quantity::bytes(still_wanted)))
                .help("render a smaller image, or parts of it with --crop")
                .into());
        }
        Ok(())
    }
}

/// What the planes of a film hold of a pixel.
fn film_bytes_per_pixel(film: &Film) -> u64 {
    let bytes = film.planes.iter().map(|plane| match plane.samples {
        Samples::F32(_) | Samples::U32(_) => 4,
        Samples::F64(_) => 8,
    });
    bytes.sum()
}

/// What a file of a film holds of a pixel if nothing can be compressed.
fn file_bytes_per_pixel(format: Format, film: &Film, exr: ExrOptions) -> u64 {
    let exr_bytes = |plane: &Plane| match (plane.content, exr.color) {
        (Content::Color, ColorType::Half) => 2,
        _ => 4,
    };
    match format {
        Format::Exr => film.planes.iter().map(exr_bytes).sum(),
        Format::Png => PNG_BYTES_PER_PIXEL,
        // Written as it is made.
        Format::Pfm => 0,
    }
}

/// Bytes of all tables.
pub fn table_bytes(world: &World) -> u64 {
    world.memory_bytes().iter().map(|&(_, bytes)| bytes as u64).sum()
}

/// Whether the allocator would hand out a block of this size; where no system figure is known (and under `ulimit -v`)
/// this is what stands between a slip of the finger and an abort.
fn can_reserve(bytes: u64) -> bool {
    usize::try_from(bytes).is_ok_and(|bytes| Vec::<u8>::new().try_reserve_exact(bytes).is_ok())
}

/// The most memory this process has held so far, in bytes; `None` where the system does not say.
pub fn peak_bytes() -> Option<u64> {
    kib_field(&fs::read_to_string("/proc/self/status").ok()?, "VmHWM:")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pixel_takes_what_its_planes_and_files_hold() {
        let color = |name| Plane::color(name, Samples::F32(vec![0.0]));
        let planes = vec![
            color("R"),
            color("G"),
            Plane::color("B", Samples::F64(vec![0.0])),
            Plane::data("object.I", Samples::U32(vec![0])),
        ];
        let film = Film { width_px: 1, height_px: 1, data_window: Region::whole(1, 1), planes };
        assert_eq!(film_bytes_per_pixel(&film), 20);
        assert_eq!(file_bytes_per_pixel(Format::Exr, &film, ExrOptions::default()), 10);
        assert_eq!(file_bytes_per_pixel(Format::Exr, &film, ExrOptions::FLOAT), 16);
    }

    #[test]
    fn a_film_larger_than_memory_is_refused_and_one_that_fits_is_not() {
        let need = Need { film: 1000, tables: 5000, accel: 500 };
        assert!(need.check(Some(1500)).is_ok());
        assert!(need.check(None).is_ok());
        let message = need.check(Some(1499)).unwrap_err().to_string();
        assert!(message.contains("do not fit into memory") && message.contains("--crop"), "{message}");
        assert!(Need { film: u64::MAX, ..need }.check(None).is_err());
    }
}
