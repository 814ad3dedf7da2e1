//! How flatray compares with a peer and with itself.

use super::Settings;
use super::report::{Build, Ratio, Report, Row, Spread};
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
        let quality = preset.name();
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
        let fitting = rows.iter().filter(|row| row.threads == threads && fits(row)).map(|row| row.mrays_per_s);
        fitting.reduce(|a, b| Spread { median: a.median.max(b.median), min: a.min.max(b.min), max: a.max.max(b.max) })
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
    let mut add = |what, threads, ours: Option<Spread>, theirs: Option<Spread>| {
        if let (Some(ours), Some(theirs)) = (ours, theirs.filter(|theirs| theirs.median > 0.0)) {
            let (value, fastest) = (ours.median / theirs.median, ours.max / theirs.max);
            ratios.push(Ratio { what, rays: kind.name(), quality, threads, value, fastest });
        }
    };
    add(BEST_TO_DEFAULT, threads, either, default);
    add(BEST_TO_ROBUST, threads, either, best(threads, &theirs("embree:robust")));
    add(SINGLE_TO_DEFAULT, threads, single, default);
    add(PACKET_TO_PACKET, threads, best(threads, &ours(&["packet"])), best(threads, &packets));
    if settings.threads.contains(&1) {
        for &more in settings.threads.iter().filter(|&&threads| threads > 1) {
            let any = ours(&["single", "batch", "packet"]);
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
    let mut add =
        |what, threads, value, fastest| ratios.push(Ratio { what, rays: "", quality, threads, value, fastest });
    for &threads in &settings.threads {
        // Embree has no quality that is like flatray's fastest; its default is what people use.
        let like = if quality == "high" { "high" } else { "medium" };
        if let (Some(ours), Some(theirs)) = (find("flatray", quality, threads), find("embree:default", like, threads)) {
            let speed = |ours: f64, theirs: f64| theirs / ours.max(1e-9);
            let fastest = speed(ours.seconds.min, theirs.seconds.min);
            add(BUILD, threads, speed(ours.seconds.median, theirs.seconds.median), fastest);
        }
    }
    let threads = settings.threads.first().copied().unwrap_or(1);
    let ours = find("flatray", quality, threads).filter(|build| build.bytes_per_primitive > 0.0);
    if let (Some(ours), Some(theirs)) = (ours, find("embree:default", "medium", threads)) {
        let bytes = theirs.bytes_per_primitive / ours.bytes_per_primitive;
        add(BYTES, threads, bytes, bytes);
    }
    ratios
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::{Mode, Preset};
    use crate::simd::Isa;

    fn row(engine: &str, mode: &str, threads: usize, median: f64) -> Row {
        Row {
            engine: engine.to_owned(),
            rays: "primary",
            ray_precision: "f32",
            mode: mode.to_owned(),
            isa: "avx2".to_owned(),
            quality: "medium",
            threads,
            mrays_per_s: Spread { median, min: median, max: median },
            wrong: Some(0),
            t_off: Some(0),
        }
    }

    #[test]
    fn the_best_of_each_side_are_compared() {
        let rows = vec![
            row("flatray", "single", 1, 4.0),
            row("flatray", "batch", 1, 6.0),
            row("flatray", "packet", 1, 30.0),
            row("flatray", "packet", 2, 54.0),
            row("embree:default", "single", 1, 5.0),
            row("embree:default", "packet8", 1, 15.0),
            row("embree:default", "packet16", 1, 20.0),
            row("embree:robust", "single", 1, 3.0),
            Row { wrong: None, ..row("embree:default", "single", 1, 100.0) },
        ];
        let report = Report { rows, ..Report::default() };
        let settings = Settings {
            kinds: vec![RayKind::Primary],
            threads: vec![1, 2],
            isas: vec![Isa::Baseline],
            modes: vec![Mode::Single],
            presets: vec![Preset::Medium],
            repeats: 1,
            min_seconds: 0.0,
            oracle_tests: 1,
        };
        let found: Vec<(&str, f64)> = all(&report, &settings).iter().map(|ratio| (ratio.what, ratio.value)).collect();
        let expected = [
            (BEST_TO_DEFAULT, 1.2),
            (BEST_TO_ROBUST, 2.0),
            (SINGLE_TO_DEFAULT, 0.8),
            (PACKET_TO_PACKET, 1.5),
            (THREADS, 1.8),
        ];
        assert_eq!(found, expected);
    }
}
