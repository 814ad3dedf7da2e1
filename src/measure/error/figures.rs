//! How far an image is from its reference, in all the ways that are told.

use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::film::Film;
use crate::measure::difference;

/// Figures of one image, or medians over several. As JSON, what is infinite becomes `null`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Figures {
    /// Mean difference over all channels of all pixels.
    pub mae: f64,
    /// Root of the mean squared difference.
    pub rmse: f64,
    /// Largest difference of a channel.
    pub max: f64,
    /// 99.9 % of pixels differ by no more.
    pub p999: f64,
}

impl Figures {
    /// Compares an image with its reference.
    ///
    /// # Errors
    /// Images of different sizes.
    pub fn of(film: &Film, reference: &Film) -> Result<Figures, Error> {
        let difference::Difference { mae, rmse, max, p999, .. } = difference::compare(film, reference)?;
        Ok(Figures { mae, rmse, max, p999 })
    }

    /// The median of each figure.
    pub fn medians(all: &[Figures]) -> Figures {
        let median = |of: fn(&Figures) -> f64| median(all.iter().map(of));
        Figures { mae: median(|f| f.mae), rmse: median(|f| f.rmse), max: median(|f| f.max), p999: median(|f| f.p999) }
    }
}

/// The middle of some values; 0 of none.
pub fn median(values: impl Iterator<Item = f64>) -> f64 {
    crate::measure::throughput::report::Spread::of(values.collect()).median
}
