//! What memory the machine has, and what a render will want of it.

use std::fs;

use super::quantity;
use crate::accel::AccelKind;
use crate::error::{Error, Place, Problem};
use crate::render::Settings;
use crate::scene::machine::kib_field;
use crate::world::World;

/// Four planes of f32, or of f64 in the compatible mode.
const FILM_BYTES_PER_PIXEL: u64 = 16;
const COURSE_FILM_BYTES_PER_PIXEL: u64 = 32;

/// What an EXR and a PNG of 16 bits hold of a pixel if nothing can be compressed: files are kept until the last pixel is known.
const ENCODED_BYTES_PER_PIXEL: u64 = 16 + 8;

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
    /// What a render of these settings wants.
    pub fn of(world: &World, settings: &Settings, kind: AccelKind) -> Need {
        let planes = if settings.course { COURSE_FILM_BYTES_PER_PIXEL } else { FILM_BYTES_PER_PIXEL };
        let per_pixel = planes + ENCODED_BYTES_PER_PIXEL;
        let n_pixels = u64::from(settings.region.width_px()) * u64::from(settings.region.height_px());
        Need { film: n_pixels.saturating_mul(per_pixel), ..Need::of_structure(world, kind) }
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
    fn a_film_larger_than_memory_is_refused_and_one_that_fits_is_not() {
        let need = Need { film: 1000, tables: 5000, accel: 500 };
        assert!(need.check(Some(1500)).is_ok());
        assert!(need.check(None).is_ok());
        let message = need.check(Some(1499)).unwrap_err().to_string();
        assert!(message.contains("do not fit into memory") && message.contains("--crop"), "{message}");
        assert!(Need { film: u64::MAX, ..need }.check(None).is_err());
    }
}
