//! What was measured, as figures.

use serde::Serialize;

use crate::accel::{Preset, Visits};
use crate::measure::rays::RayKind;

/// Median, minimum and maximum of repeated measurements.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spread {
    /// The middle one; of an even number the mean of the two in the middle.
    pub median: f64,
    /// The smallest.
    pub min: f64,
    /// The largest.
    pub max: f64,
}

impl Spread {
    /// The spread of measurements; zeros when there is none.
    pub fn of(mut values: Vec<f64>) -> Spread {
        values.sort_by(f64::total_cmp);
        let (Some(&min), Some(&max)) = (values.first(), values.last()) else { return Spread::default() };
        let median = 0.5 * (values[(values.len() - 1) / 2] + values[values.len() / 2]);
        Spread { median, min, max }
    }
}

/// Everything that a run found.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// Rays per second.
    pub rows: Vec<Row>,
    /// Builds.
    pub builds: Vec<Build>,
    /// The ray sets.
    pub sets: Vec<SetSummary>,
    /// What single rays visit.
    pub visits: Vec<Visited>,
    /// How engines compare.
    pub ratios: Vec<Ratio>,
    /// What the reader should know.
    pub notes: Vec<String>,
}

/// Rays per second of one way to trace one set of rays.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// `flatray`, `embree:default` or `embree:robust`.
    pub engine: String,
    /// Kind of rays.
    pub rays: &'static str,
    /// What the numbers of the rays are rounded to.
    pub ray_precision: &'static str,
    /// `single`, `batch` and `packet`; of Embree `single` and `packet4` to `packet16`.
    pub mode: String,
    /// Instruction set.
    pub isa: String,
    /// Preset or quality of the build.
    pub quality: &'static str,
    /// Threads.
    pub threads: usize,
    /// Million rays per second.
    pub mrays_per_s: Spread,
    /// Answers that say hit for miss or miss for hit; `None` when they cannot be compared.
    pub wrong: Option<u64>,
    /// Hits whose t is off by more than a thousandth; `None` when they cannot be compared.
    pub t_off: Option<u64>,
}

impl Row {
    /// Whether flatray has measured this.
    pub fn is_flatray(&self) -> bool {
        self.engine == "flatray"
    }
}

/// How long one way to build takes, and what it leaves.
#[derive(Clone, Debug, PartialEq)]
pub struct Build {
    /// `flatray` or `embree:default`.
    pub engine: String,
    /// Preset or quality.
    pub quality: &'static str,
    /// Threads.
    pub threads: usize,
    /// Seconds.
    pub seconds: Spread,
    /// Bytes of the acceleration structure per primitive.
    pub bytes_per_primitive: f64,
    /// Bytes of the tables beside it (vertices, indices, materials) per primitive; 0 for a peer, which shares them.
    pub table_bytes_per_primitive: f64,
}

/// A set of rays.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SetSummary {
    /// Kind of rays.
    pub rays: &'static str,
    /// What their numbers are rounded to.
    pub ray_precision: &'static str,
    /// How many there are.
    pub count: usize,
    /// How many hit something.
    pub hits: usize,
    /// How many answers were compared with the full scan; all were compared between modes.
    pub judged: usize,
}

/// What a single f32 ray visits in a tree, on average.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Visited {
    /// Kind of rays.
    pub rays: &'static str,
    /// Preset of the build.
    pub quality: &'static str,
    /// Nodes.
    pub nodes_per_ray: f64,
    /// Leaves.
    pub leaves_per_ray: f64,
}

impl Visited {
    /// Visits shared out among rays.
    pub fn new(kind: RayKind, preset: Preset, n_rays: usize, visits: Visits) -> Visited {
        let per_ray = |n: u64| n as f64 / n_rays.max(1) as f64;
        Visited {
            rays: kind.name(),
            quality: preset.name(),
            nodes_per_ray: per_ray(visits.nodes),
            leaves_per_ray: per_ray(visits.leaves),
        }
    }
}

/// A comparison; above 1 flatray is faster or smaller.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Ratio {
    /// What is compared with what.
    pub what: &'static str,
    /// Kind of rays; empty for builds and memory.
    pub rays: &'static str,
    /// flatray's preset.
    pub quality: &'static str,
    /// Threads.
    pub threads: usize,
    /// The ratio of medians.
    pub value: f64,
    /// The ratio of the fastest repeats, which tells more where other work disturbs.
    pub fastest: f64,
}

impl Report {
    /// The report as JSON.
    pub fn to_json(&self) -> serde_json::Value {
        let rows: Vec<_> = self.rows.iter().map(row_json).collect();
        let build: Vec<_> = self.builds.iter().map(build_json).collect();
        serde_json::json!({
            "rows": rows, "build": build, "sets": self.sets, "visits": self.visits, "ratios": self.ratios,
            "notes": self.notes,
        })
    }
}

fn row_json(row: &Row) -> serde_json::Value {
    let Row { engine, rays, ray_precision, mode, isa, quality, threads, mrays_per_s, wrong, t_off } = row;
    serde_json::json!({
        "engine": engine, "rays": rays, "ray_precision": ray_precision, "mode": mode, "isa": isa, "quality": quality,
        "threads": threads, "mrays_per_s": mrays_per_s.median, "min": mrays_per_s.min, "max": mrays_per_s.max,
        "wrong": wrong, "t_off": t_off,
    })
}

fn build_json(build: &Build) -> serde_json::Value {
    let Build { engine, quality, threads, seconds, bytes_per_primitive, table_bytes_per_primitive } = build;
    serde_json::json!({
        "engine": engine, "quality": quality, "threads": threads, "seconds": seconds.median, "min": seconds.min,
        "max": seconds.max, "bytes_per_primitive": bytes_per_primitive,
        "table_bytes_per_primitive": table_bytes_per_primitive,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_spread_of_measurements_is_their_middle_and_ends() {
        assert_eq!(Spread::of(vec![3.0, 1.0, 2.0]), Spread { median: 2.0, min: 1.0, max: 3.0 });
        assert_eq!(Spread::of(vec![4.0, 1.0]), Spread { median: 2.5, min: 1.0, max: 4.0 });
        assert_eq!(Spread::of(vec![]), Spread::default());
    }
}
