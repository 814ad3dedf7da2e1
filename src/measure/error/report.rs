//! What a benchmark of time against error found, as figures.

use serde::Serialize;
use serde_json::{Value, json};

use super::figures::{Figures, median};
use super::front::{self, Point};
use super::partial::Run;
use super::setting::Way;
use crate::measure::throughput::report::Spread;

/// A way to render, and what came of it.
#[derive(Clone, Debug)]
pub struct Row {
    /// The way.
    pub way: Way,
    /// Seconds over repeats.
    pub seconds: Spread,
    /// Rays of all kinds, where they are known; median.
    pub rays: Option<u64>,
    /// Camera rays per pixel, or the samples that the way says.
    pub samples_per_pixel: Option<f64>,
    /// Medians over repeats.
    pub figures: Figures,
    /// Root mean square error over repeats.
    pub rmse: Spread,
    /// What renders estimate; median.
    pub rmse_estimate: Option<f64>,
    /// Pixels whose centre shows another primitive than the full scan finds.
    pub wrong_ids: Option<u64>,
    /// Whether nothing is faster and better.
    pub on_front: bool,
}

impl Row {
    /// A row of several runs of one way.
    pub fn of(way: &Way, runs: &[Run], n_pixels: usize, wrong_ids: Option<u64>) -> Row {
        let spread = |of: fn(&Run) -> f64| Spread::of(runs.iter().map(of).collect());
        let known = |of: fn(&Run) -> Option<f64>| -> Option<f64> {
            let values: Vec<f64> = runs.iter().filter_map(of).collect();
            (!values.is_empty()).then(|| median(values.into_iter()))
        };
        let camera_rays = known(|run| run.camera_rays.map(|rays| rays as f64));
        let counted = camera_rays.map(|rays| rays / n_pixels as f64);
        Row {
            way: way.clone(),
            seconds: spread(|run| run.seconds),
            rays: known(|run| run.rays.map(|rays| rays as f64)).map(|rays| rays as u64),
            samples_per_pixel: counted.or(way.samples().map(f64::from)),
            figures: Figures::medians(&runs.iter().map(|run| run.figures).collect::<Vec<_>>()),
            rmse: spread(|run| run.figures.rmse),
            rmse_estimate: known(|run| run.rmse_estimate),
            wrong_ids,
            on_front: false,
        }
    }

    /// The error that is told of: no less than the reference allows.
    pub fn told_rmse(&self, least: f64) -> f64 {
        self.rmse.median.max(least)
    }

    /// As a point. Nothing is told to be without error, or to take no time.
    pub fn point(&self, least: f64) -> Point {
        let rmse = self.told_rmse(least).max(f64::MIN_POSITIVE);
        Point { seconds: self.seconds.median.max(f64::MIN_POSITIVE), rmse }
    }
}

/// How long an error takes, by one engine or family.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Reach {
    /// The error.
    pub rmse: f64,
    /// Who: an engine, or a family of ways.
    pub by: String,
    /// Seconds, between the points of the front; `None` where none is as good.
    pub seconds: Option<f64>,
    /// The fastest way that is at least as good.
    pub setting: Option<String>,
}

/// The error that a time allows, by one engine or family.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Allowed {
    /// The time.
    pub seconds: f64,
    /// Who.
    pub by: String,
    /// The error; `None` where nothing is as fast.
    pub rmse: Option<f64>,
}

/// How the error of a family falls with samples.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Slope {
    /// The family.
    pub family: String,
    /// The exponent of samples per pixel.
    pub slope: f64,
    /// Ways that it is fitted to.
    pub n_points: usize,
}

/// Everything about one frame.
#[derive(Clone, Debug)]
pub struct Report {
    /// The rows, in the order of the ways.
    pub rows: Vec<Row>,
    /// The reference's own error.
    pub floor: f64,
    /// The least error that is told of.
    pub least: f64,
    /// Samples per pixel of the reference.
    pub reference_samples: u32,
    /// The frame, as a hash.
    pub hash: String,
    /// Width and height.
    pub size_px: [u32; 2],
    /// Threads.
    pub threads: usize,
    /// Repeats.
    pub repeats: usize,
    /// Whether times are those of whole processes.
    pub whole_processes: bool,
    /// Pixels whose ids were judged.
    pub judged_ids: usize,
    /// What the reader should know.
    pub notes: Vec<String>,
}

/// Errors that a time is told for, beside the least that the reference allows.
pub const TARGETS: [f64; 2] = [1e-2, 1e-3];

/// Ways that a slope is fitted to at least.
const MIN_SLOPE_POINTS: usize = 3;

impl Report {
    /// Finds the front.
    pub fn find_front(&mut self) {
        let points: Vec<Point> = self.rows.iter().map(|row| row.point(self.least)).collect();
        for (row, on_front) in self.rows.iter_mut().zip(front::on_front(&points)) {
            row.on_front = on_front;
        }
    }

    /// Families of several ways, with their rows; one point is no curve.
    fn families(&self) -> Vec<(String, Vec<&Row>)> {
        let mut families: Vec<(String, Vec<&Row>)> = Vec::new();
        for row in &self.rows {
            let family = row.way.family();
            match families.iter_mut().find(|(other, _)| *other == family) {
                Some((_, rows)) => rows.push(row),
                None => families.push((family, vec![row])),
            }
        }
        families.retain(|(_, rows)| rows.len() > 1);
        families
    }

    /// Engines and families, each with the curves that are read for it: an engine's are its families' and that of all its ways.
    fn curves(&self) -> Vec<(String, Vec<Vec<&Row>>)> {
        let families = self.families();
        let mut curves: Vec<(String, Vec<Vec<&Row>>)> = Vec::new();
        for engine in ["flatray", "povray"] {
            let own = |rows: &[&Row]| rows.iter().all(|row| row.way.engine() == engine);
            let all: Vec<&Row> = self.rows.iter().filter(|row| row.way.engine() == engine).collect();
            if !all.is_empty() {
                let families = families.iter().filter(|(_, rows)| own(rows)).map(|(_, rows)| rows.clone());
                curves.push((engine.to_owned(), families.chain([all]).collect()));
            }
        }
        curves.extend(families.into_iter().map(|(name, rows)| (name, vec![rows])));
        curves
    }

    /// The least that any of some curves says.
    fn least_of(&self, curves: &[Vec<&Row>], read: impl Fn(&[Point]) -> Option<f64>) -> Option<f64> {
        let points = |rows: &Vec<&Row>| -> Vec<Point> { rows.iter().map(|row| row.point(self.least)).collect() };
        curves.iter().filter_map(|rows| read(&points(rows))).min_by(f64::total_cmp)
    }

    /// How long the targets take, and the least error that can be told.
    pub fn reaches(&self) -> Vec<Reach> {
        let targets = TARGETS.into_iter().filter(|&target| target >= self.least).chain([self.least]);
        let curves = self.curves();
        let mut reaches = Vec::new();
        for rmse in targets.filter(|&target| target > 0.0) {
            for (by, curves) in &curves {
                let good = curves.iter().flatten().filter(|row| row.told_rmse(self.least) <= rmse);
                let fastest = good.min_by(|a, b| a.seconds.median.total_cmp(&b.seconds.median));
                reaches.push(Reach {
                    rmse,
                    by: by.clone(),
                    seconds: self.least_of(curves, |points| front::seconds_to(points, rmse)),
                    setting: fastest.map(|row| row.way.name()),
                });
            }
        }
        reaches
    }

    /// What some round times allow.
    pub fn allowed(&self) -> Vec<Allowed> {
        let curves = self.curves();
        let mut allowed = Vec::new();
        for seconds in round_times(&self.rows) {
            for (by, curves) in &curves {
                let rmse = self.least_of(curves, |points| front::rmse_at(points, seconds));
                allowed.push(Allowed { seconds, by: by.clone(), rmse });
            }
        }
        allowed
    }

    /// Slopes of families, of rows whose error can be told. A single sample is no member of a sequence.
    pub fn slopes(&self) -> Vec<Slope> {
        let is_told = |row: &&&Row| row.rmse.median > self.least && row.samples_per_pixel.is_some_and(|n| n > 1.0);
        let slopes = self.families().into_iter().filter_map(|(family, rows)| {
            let told = rows.iter().filter(is_told);
            let points: Vec<(f64, f64)> =
                told.filter_map(|row| Some((row.samples_per_pixel?, row.rmse.median))).collect();
            let slope = front::slope(&points).filter(|_| points.len() >= MIN_SLOPE_POINTS)?;
            Some(Slope { family, slope, n_points: points.len() })
        });
        slopes.collect()
    }

    /// The report as JSON; `docs/ERROR.md` and the command's help list the keys.
    pub fn to_json(&self) -> Value {
        let row = |row: &Row| {
            let Figures { mae, relmse, max, p999, flip, ssim, .. } = row.figures;
            json!({
                "engine": row.way.engine(),
                "setting": row.way.name(),
                "family": row.way.family(),
                "seconds": row.seconds.median,
                "seconds_min": row.seconds.min,
                "seconds_max": row.seconds.max,
                "rays": row.rays,
                "samples_per_pixel": row.samples_per_pixel,
                "rmse": row.told_rmse(self.least),
                "rmse_min": row.rmse.min.max(self.least),
                "rmse_max": row.rmse.max.max(self.least),
                "below_floor": row.rmse.median < self.least,
                "rmse_estimate": row.rmse_estimate,
                "mae": mae,
                "relmse": relmse,
                "max": max,
                "p999": p999,
                "flip": flip,
                "ssim": ssim,
                "wrong_ids": row.wrong_ids,
                "on_front": row.on_front,
            })
        };
        json!({
            "runs": self.rows.iter().map(row).collect::<Vec<_>>(),
            "floor": self.floor,
            "least_rmse": self.least,
            "reference_samples": self.reference_samples,
            "hash": self.hash,
            "width": self.size_px[0],
            "height": self.size_px[1],
            "threads": self.threads,
            "repeats": self.repeats,
            "whole_processes": self.whole_processes,
            "judged_ids": self.judged_ids,
            "time_to_rmse": self.reaches(),
            "rmse_at_time": self.allowed(),
            "slopes": self.slopes(),
            "notes": self.notes,
        })
    }
}

/// 1 and 3 times powers of ten between the fastest and the slowest row.
fn round_times(rows: &[Row]) -> Vec<f64> {
    let seconds = || rows.iter().map(|row| row.seconds.median);
    let (fastest, slowest) = (seconds().fold(f64::INFINITY, f64::min), seconds().fold(0.0, f64::max));
    // The doubles nearest to the decimals, which products are not.
    let decimal = |text: String| text.parse().unwrap_or(0.0);
    let times = (-4..5).flat_map(|power| [1, 3].map(|digit| decimal(format!("{digit}e{power}"))));
    times.filter(|time| (fastest..=slowest).contains(time)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::error::setting::{Amount, Setting};
    use crate::measure::povray::Antialiasing;
    use crate::render::Sampler;

    fn run(seconds: f64, rmse: f64, camera_rays: Option<u64>) -> Run {
        let figures = Figures { rmse, ..Figures::default() };
        Run { seconds, rays: camera_rays, camera_rays, rmse_estimate: None, figures }
    }

    fn sobol(samples: u32) -> Way {
        Way::Flatray(Setting::of(Amount::Samples { sampler: Sampler::Sobol, samples }))
    }

    fn report(rows: Vec<Row>) -> Report {
        let mut report = Report {
            rows,
            floor: 1e-5,
            least: 3e-5,
            reference_samples: 64,
            hash: "0".into(),
            size_px: [10, 10],
            threads: 1,
            repeats: 3,
            whole_processes: false,
            judged_ids: 100,
            notes: Vec::new(),
        };
        report.find_front();
        report
    }

    #[test]
    fn a_row_holds_medians_and_no_error_below_three_floors_is_told() {
        let runs = [run(3.0, 2e-5, Some(400)), run(1.0, 1e-5, Some(400)), run(2.0, 4e-6, Some(400))];
        let report = report(vec![Row::of(&sobol(4), &runs, 100, Some(0))]);
        let json = report.to_json();
        let row = &json["runs"][0];
        assert_eq!((row["seconds"].as_f64(), row["samples_per_pixel"].as_f64()), (Some(2.0), Some(4.0)));
        assert_eq!((row["rmse"].as_f64(), row["rmse_min"].as_f64()), (Some(3e-5), Some(3e-5)));
        assert_eq!((row["below_floor"].as_bool(), row["on_front"].as_bool()), (Some(true), Some(true)));
        for key in ["engine", "setting", "rays", "relmse", "max", "flip"] {
            assert!(!row[key].is_null(), "{key}");
        }
    }

    #[test]
    fn slopes_and_times_are_those_of_the_law_that_made_the_rows() {
        // error = 0.1/samples, 10 ms a sample; the last is below three floors, and left out of the slope.
        let law = [2u32, 8, 32, 1 << 14].map(|n| {
            Row::of(&sobol(n), &[run(0.01 * f64::from(n), 0.1 / f64::from(n), Some(u64::from(n) * 100))], 100, None)
        });
        let povray = Way::Povray(Antialiasing::Uniform { grid: 2 });
        let slow = Row::of(&povray, &[run(1.0, 0.02, None)], 100, None);
        let report = report(law.into_iter().chain([slow]).collect());
        let slopes = report.slopes();
        assert_eq!((slopes.len(), slopes[0].family.as_str(), slopes[0].n_points), (1, "sobol", 3));
        assert!((slopes[0].slope + 1.0).abs() < 1e-12);
        assert_eq!(report.rows.iter().map(|row| row.on_front).collect::<Vec<_>>(), [true, true, true, true, false]);
        let hundredth = report.reaches().into_iter().find(|reach| reach.by == "sobol" && reach.rmse == 1e-2).unwrap();
        assert!((hundredth.seconds.unwrap() - 0.1).abs() < 1e-12, "{hundredth:?}");
        assert_eq!(hundredth.setting.as_deref(), Some("sobol 32"));
        let tenth =
            report.allowed().into_iter().find(|allowed| allowed.seconds == 0.1 && allowed.by == "sobol").unwrap();
        assert!((tenth.rmse.unwrap() - 0.01).abs() < 1e-12, "{tenth:?}");
        // A target below three floors is not among them.
        assert!(report.reaches().iter().all(|reach| reach.rmse >= report.least));
    }
}
