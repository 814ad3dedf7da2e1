//! One image of two independent ones, each with the weight that its error leaves it.

use crate::film::{Content, Film, Plane, Samples};

/// An image and the root mean square error that it has.
#[derive(Clone, Debug)]
pub struct Told {
    /// The image.
    pub film: Film,
    /// Its error.
    pub rmse: f64,
}

impl Told {
    /// Makes `film`, an independent image with an error, the mean of both that has the least variance: weights are as the inverse squares of
    /// errors. Colours are means, counts of samples and costs sums; other data stay those of `film`. Returns the error of the mean.
    pub fn join(&self, film: &mut Film, rmse: f64) -> f64 {
        let (own, other) = (self.rmse * self.rmse, rmse * rmse);
        // Without an error there is nothing to mend, and what is no number is left as it is.
        let share = if own > 0.0 && own.is_finite() && other.is_finite() { own / (own + other) } else { 1.0 };
        for (plane, before) in film.planes.iter_mut().zip(&self.film.planes) {
            join_plane(plane, before, share);
        }
        (share * share * other + (1.0 - share) * (1.0 - share) * own).sqrt()
    }
}

/// `share` is the weight of `plane`.
fn join_plane(plane: &mut Plane, before: &Plane, share: f64) {
    let mean = |value: f64, before: f64| share * value + (1.0 - share) * before;
    match (&mut plane.samples, &before.samples) {
        (Samples::F32(values), Samples::F32(before)) if plane.content == Content::Color => {
            for (value, &before) in values.iter_mut().zip(before) {
                *value = mean(f64::from(*value), f64::from(before)) as f32;
            }
        }
        (Samples::F64(values), Samples::F64(before)) if plane.content == Content::Color => {
            for (value, &before) in values.iter_mut().zip(before) {
                *value = mean(*value, before);
            }
        }
        (Samples::U32(values), Samples::U32(before)) if is_count(&plane.name) => {
            for (value, &before) in values.iter_mut().zip(before) {
                *value = value.saturating_add(before);
            }
        }
        _ => {}
    }
}

/// Whether a plane counts what has been done for a pixel.
fn is_count(name: &str) -> bool {
    name.starts_with("samples.") || name.starts_with("cost.")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::Region;

    fn film(red: f32, z: f32, samples: u32) -> Film {
        let planes = vec![
            Plane::color("R", Samples::F32(vec![red])),
            Plane::data("Z", Samples::F32(vec![z])),
            Plane::data("samples.I", Samples::U32(vec![samples])),
        ];
        Film { width_px: 1, height_px: 1, data_window: Region::whole(1, 1), planes }
    }

    #[test]
    fn the_better_image_counts_more_and_the_mean_is_better_than_both() {
        let mut joined = film(1.0, 7.0, 5);
        // Errors of 1 and 2: weights of 4/5 and 1/5.
        let rmse = Told { film: film(2.0, 9.0, 3), rmse: 2.0 }.join(&mut joined, 1.0);
        assert_eq!(joined, film(1.2, 7.0, 8));
        // Six roundings of numbers below 1.
        assert!((rmse - (0.8_f64).sqrt()).abs() <= 6.0 * f64::EPSILON, "{rmse}");
    }

    #[test]
    fn errors_that_are_no_weights_leave_the_newer_image() {
        for (own, other) in [(0.0, 1.0), (f64::INFINITY, 1.0), (1.0, f64::INFINITY), (f64::NAN, 1.0)] {
            let mut joined = film(1.0, 7.0, 5);
            Told { film: film(2.0, 9.0, 3), rmse: own }.join(&mut joined, other);
            assert_eq!(joined.plane("R"), film(1.0, 7.0, 5).plane("R"), "{own} {other}");
        }
    }

    #[test]
    fn an_image_without_error_stays() {
        let mut joined = film(1.0, 7.0, 5);
        let rmse = Told { film: film(2.0, 9.0, 3), rmse: 2.0 }.join(&mut joined, 0.0);
        assert_eq!((joined.plane("R").unwrap().samples.get(0), rmse), (1.0, 0.0));
    }
}
