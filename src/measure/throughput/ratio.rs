//! How flatray compares with a peer and with itself.

use super::report::{Build, Ratio, Report, Row};
use super::{Settings, preset_name};
use crate::measure::rays::{RayKind, RayPrecision};

/// flatray's better of batch and single against Embree's best single ray.
pub const BEST_TO_DEFAULT: &str = "best / Embree default, single ray";
/// The same against its robust mode.
pub const BEST_TO_ROBUST: &str = "best / Embree robust, single ray";
/// flatray one ray at a time against Embree's best single ray.
pub const SINGLE_TO_DEFAULT: &str = "single / Embree default, single ray";
/// flatray's packets against Embree's best packets.
pub const PACKET_TO_PACKET: &str = "packet / Embree default, best packets";
/// flatray's best mode against itself on one thread.
pub const THREADS: &str = "threads over one";
/// Speed of the build, medium against medium and high against high.
pub const BUILD: &str = "build speed / Embree's";
/// Embree's bytes per primitive, medium, against flatray's.
pub const BYTES: &str = "Embree's bytes per primitive / flatray's";

/// All ratios that the figures allow, on rays whose numbers are f32. Only a peer whose answers can be compared counts.
pub fn all(report: &Report, settings: &Settings) -> Vec<Ratio> {
    let mut ratios = Vec::new();
    for &preset in &settings.presets {
        let quality = preset_name(preset);
        for &kind in &settings.kinds {
            ratios.extend(of_rays(report, settings, kind, quality));
        }
        ratios.extend(of_builds(report, settings, quality));
    }
    ratios
}

fn of_rays(report: &Report, settings: &Settings, kind: RayKind, quality: &'static str) -> Vec<Ratio> {
    let threads = settings.threads.first().copied().unwrap_or(1);
    let rows: Vec<&Row> = report
        .rows
        .iter()
        .filter(|row| row.rays == kind.name() && row.ray_precision == RayPrecision::F32.name() && row.wrong.is_some())
        .collect();
    let best = |threads: usize, fits: &dyn Fn(&Row) -> bool| {
        let fitting = rows.iter().filter(|row| row.threads == threads && fits(row));
        fitting.map(|row| row.mrays_per_s.median).max_by(f64::total_cmp)
    };
    let ours = |modes: &'static [&'static str]| {
        move |row: &Row| row.is_flatray() && row.quality == quality && modes.contains(&row.mode.as_str())
    };
    let theirs = |engine: &'static str| move |row: &Row| row.engine == engine && row.mode == "single";
    let packets = |row: &Row| row.engine == "embree:default" && row.mode.starts_with("packet");

    let single = best(threads, &ours(&["single"]));
    let either = best(threads, &ours(&["single", "batch"]));
    let default = best(threads, &theirs("embree:default"));
    let mut ratios = Vec::new();
    let mut add = |what, threads, ours: Option<f64>, theirs: Option<f64>| {
        if let (Some(ours), Some(theirs)) = (ours, theirs.filter(|&theirs| theirs > 0.0)) {
            ratios.push(Ratio { what, rays: kind.name(), quality, threads, value: ours / theirs });
        }
    };
    add(BEST_TO_DEFAULT, threads, either, default);
    add(BEST_TO_ROBUST, threads, either, best(threads, &theirs("embree:robust")));
    add(SINGLE_TO_DEFAULT, threads, single, default);
    add(PACKET_TO_PACKET, threads, best(threads, &ours(&["packet"])), best(threads, &packets));
    if settings.threads.contains(&1) {
        for &more in settings.threads.iter().filter(|&&threads| threads > 1) {
            let any = ours(&["single", "batch", "packet", "auto"]);
            add(THREADS, more, best(more, &any), best(1, &any));
        }
    }
    ratios
}

fn of_builds(report: &Report, settings: &Settings, quality: &'static str) -> Vec<Ratio> {
    let find = |engine: &str, quality: &str, threads: usize| {
        let fits = |build: &&Build| build.engine == engine && build.quality == quality && build.threads == threads;
        report.builds.iter().find(fits)
    };
    let mut ratios = Vec::new();
    let mut add = |what, threads, value| ratios.push(Ratio { what, rays: "", quality, threads, value });
    for &threads in &settings.threads {
        // Embree has no quality that is like flatray's fastest; its default is what people use.
        let like = if quality == "high" { "high" } else { "medium" };
        if let (Some(ours), Some(theirs)) = (find("flatray", quality, threads), find("embree:default", like, threads)) {
            add(BUILD, threads, theirs.seconds.median / ours.seconds.median.max(1e-9));
        }
    }
    let threads = settings.threads.first().copied().unwrap_or(1);
    if let (Some(ours), Some(theirs)) = (find("flatray", quality, threads), find("embree:default", "medium", threads)) {
        if ours.bytes_per_primitive > 0.0 {
            add(BYTES, threads, theirs.bytes_per_primitive / ours.bytes_per_primitive);
        }
    }
    ratios
}
