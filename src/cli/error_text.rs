//! The tables of `flatray bench error`.

use super::quantity;
use crate::measure::error::report::{Report, Row};

/// A report as text.
pub fn tables(title: &str, about: &str, report: &Report) -> String {
    let times = if report.whole_processes { "whole processes" } else { "renders, with the tree's build" };
    let mut text = format!(
        "{title}: {about}\n{}x{} pixels, threads {}, repeats {}, times of {times}\nreference: {} samples per pixel and more, floor \
         {:.1e}; no error below {:.1e} is told\n\n",
        report.size_px[0],
        report.size_px[1],
        report.threads,
        report.repeats,
        report.reference_samples,
        report.floor,
        report.least,
    );
    rows(report, &mut text);
    for slope in report.slopes() {
        let (family, points) = (slope.family, slope.n_points);
        text.push_str(&format!("slope of {family}: error falls as samples^{:.3} ({points} settings)\n", slope.slope));
    }
    reaches(report, &mut text);
    for note in &report.notes {
        text.push_str(&format!("note: {note}\n"));
    }
    text
}

fn rows(report: &Report, text: &mut String) {
    text.push_str(&format!(
        "{:<2}{:<34} {:>10} {:>21} {:>14} {:>9} {:>9} {:>9} {:>9} {:>8} {:>7} {:>9}\n",
        "", "setting", "seconds", "min..max", "rays", "rmse", "estimate", "relmse", "max", "flip", "ssim", "wrong ids"
    ));
    let mut rows: Vec<&Row> = report.rows.iter().collect();
    rows.sort_by(|a, b| a.seconds.median.total_cmp(&b.seconds.median));
    let absent = || "-".to_owned();
    for row in rows {
        let sign = if row.rmse.median < report.least { "<" } else { "" };
        text.push_str(&format!(
            "{:<2}{:<34} {:>10.4} {:>21} {:>14} {:>9} {:>9} {:>9.1e} {:>9.1e} {:>8.5} {:>7.5} {:>9}\n",
            if row.on_front { "*" } else { "" },
            row.way.name(),
            row.seconds.median,
            format!("{:.4}..{:.4}", row.seconds.min, row.seconds.max),
            row.rays.map_or_else(absent, quantity::count),
            format!("{sign}{:.2e}", row.told_rmse(report.least)),
            row.rmse_estimate.map_or_else(absent, |rmse| format!("{rmse:.2e}")),
            row.figures.relmse,
            row.figures.max,
            row.figures.flip,
            row.figures.ssim,
            row.wrong_ids.map_or_else(absent, quantity::count),
        ));
    }
    text.push_str("* on the front: nothing is faster and better\n\n");
}

/// Times to errors: of engines and of those families that reach them.
fn reaches(report: &Report, text: &mut String) {
    for reach in report.reaches() {
        if let (Some(seconds), Some(setting)) = (reach.seconds, reach.setting) {
            text.push_str(&format!("rmse {:.1e} by {}: {seconds:.4} s ({setting})\n", reach.rmse, reach.by));
        }
    }
}
