//! How far an image is from its reference, in all the ways that are told.

use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::film::Film;
use crate::measure::difference;

/// Figures of one image, or medians over several; what each is says [`difference::Difference`]. As JSON, what is infinite becomes
/// `null`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Figures {
    /// Mean difference over all channels of all pixels.
    pub mae: f64,
    /// Root of the mean squared difference.
    pub rmse: f64,
    /// Mean of the squared difference by the square of the reference.
    pub relmse: f64,
    /// Largest difference of a channel.
    pub max: f64,
    /// 99.9 % of pixels differ by no more.
    pub p999: f64,
    /// Mean FLIP error.
    pub flip: f64,
    /// Mean structural similarity.
    pub ssim: f64,
}

impl Figures {
    /// Compares an image with its reference.
    ///
    /// # Errors
    /// Images of different sizes.
    pub fn of(film: &Film, reference: &Film) -> Result<Figures, Error> {
        let difference::Difference { mae, rmse, relmse, max, p999, flip, ssim, .. } =
            difference::compare(film, reference)?;
        Ok(Figures { mae, rmse, relmse, max, p999, flip, ssim })
    }

    /// The median of each figure.
    pub fn medians(all: &[Figures]) -> Figures {
        let median = |of: fn(&Figures) -> f64| median(all.iter().map(of));
        Figures {
            mae: median(|f| f.mae),
            rmse: median(|f| f.rmse),
            relmse: median(|f| f.relmse),
            max: median(|f| f.max),
            p999: median(|f| f.p999),
            flip: median(|f| f.flip),
            ssim: median(|f| f.ssim),
        }
    }
}

/// The middle of some values; 0 of none.
pub fn median(values: impl Iterator<Item = f64>) -> f64 {
    crate::measure::throughput::report::Spread::of(values.collect()).median
}
