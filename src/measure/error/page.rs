//! Reports as one self-contained page: plots as inline SVG, tables, images as data; no scripts, nothing from elsewhere.

use std::fmt::Write;

use super::pictures::{ERROR_RANGE, Shown, base64};
use super::plot::{FAINT, Mark, Plot};
use super::report::{Report, Row};
use crate::measure::throughput::page::escaped;

const STYLE: &str = "\
body{font:15px/1.5 system-ui,sans-serif;max-width:64rem;margin:2rem auto;padding:0 1rem;color:#1c2024;background:#fff}\
h1{font-size:1.5rem}h2{font-size:1.25rem;margin-top:2.6rem}h3{font-size:1.05rem;margin-top:1.8rem}\
table{border-collapse:collapse;font-variant-numeric:tabular-nums;margin:.5rem 0}\
th,td{padding:.1rem .6rem;text-align:right;border-bottom:1px solid #e3e6e9}\
th{color:#5b6570;font-weight:600}.l{text-align:left}.f{font-weight:600}.g{color:#8a929a}\
svg{display:block;width:100%;height:auto;font:13px system-ui,sans-serif;fill:#1c2024}summary{cursor:pointer;color:#5b6570}\
.s{display:inline-block;width:.8em;height:.8em;border-radius:50%;margin:0 .35em 0 1em}\
figure{display:inline-block;margin:.5rem .6rem .5rem 0;vertical-align:top}figure img{display:block;max-width:24rem;image-rendering:pixelated}\
figcaption{font-size:13px;color:#5b6570}figure div{display:flex;gap:4px}";

/// Colours of families, by what their names begin with; and of all others.
const COLORS: [(&str, &str); 8] = [
    ("adaptive", "#b3261e"),
    ("sobol", "#2f6fb0"),
    ("jitter", "#2a8f7a"),
    ("grid", "#7a5ea8"),
    ("random", "#8a7a3a"),
    ("center", "#1c2024"),
    ("povray am1", "#d9a03f"),
    ("povray am2", "#c9772b"),
];

fn color_of(family: &str) -> &'static str {
    COLORS.iter().find(|(name, _)| family.starts_with(name)).map_or("#1c2024", |(_, color)| color)
}

/// One frame on the page.
#[derive(Clone, Debug)]
pub struct Section {
    /// What it is called.
    pub title: String,
    /// What is in it.
    pub about: String,
    /// What was found.
    pub report: Report,
    /// Images.
    pub shown: Vec<Shown>,
}

/// The page.
pub fn page(sections: &[Section]) -> String {
    let titles: Vec<&str> = sections.iter().map(|section| section.title.as_str()).collect();
    let title = escaped(&titles.join(", "));
    let mut body = format!("<h1>flatray bench error: {title}</h1>");
    body.push_str(
        "<p>Every point is one way to render: the time it takes and the root mean square difference of its image from a \
         reference, both as medians over repeats in random order. The front is what nothing else beats in both. No error \
         below three times the reference&#39;s own is told.</p>",
    );
    sections.iter().for_each(|one| section(one, &mut body));
    format!(
        "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" \
         content=\"width=device-width\"><title>{title} – flatray bench error</title><style>{STYLE}</style></head>\
         <body>{body}</body></html>\n"
    )
}

fn section(section: &Section, body: &mut String) {
    let Section { title, about, report, shown } = section;
    let times = if report.whole_processes { "whole processes" } else { "renders, with the tree's build" };
    // Writing to a string cannot fail, here and below.
    let _ = write!(
        body,
        "<h2>{}</h2><p>{}; {}×{} pixels, threads: {}, repeats: {}; times of {times}. Reference: {} samples a pixel and more, \
         floor {:.1e}.</p>",
        escaped(title),
        escaped(about),
        report.size_px[0],
        report.size_px[1],
        report.threads,
        report.repeats,
        report.reference_samples,
        report.floor,
    );
    for note in &report.notes {
        let _ = write!(body, "<p>{}</p>", escaped(note));
    }
    legend(report, body);
    body.push_str("<h3>Error over time</h3>");
    body.push_str(&over_time(report).svg());
    body.push_str("<h3>Error over samples</h3>");
    body.push_str(&over_samples(report).svg());
    slopes(report, body);
    reaches(report, body);
    images(shown, body);
    table(report, body);
}

fn legend(report: &Report, body: &mut String) {
    let families = || report.rows.iter().map(|row| row.way.family());
    body.push_str("<p>");
    for (name, color) in COLORS.iter().filter(|(name, _)| families().any(|family| family.starts_with(name))) {
        let _ = write!(body, "<span class=\"s\" style=\"background:{color}\"></span>{name}");
    }
    let _ = write!(body, "<span class=\"s\" style=\"background:{FAINT}\"></span>dominated</p>");
}

fn mark(row: &Row, report: &Report, x: f64, x_range: (f64, f64), is_faint: bool) -> Mark {
    let rmse = row.told_rmse(report.least);
    Mark {
        x,
        y: rmse.max(f64::MIN_POSITIVE),
        x_range,
        color: color_of(&row.way.family()),
        is_faint,
        title: escaped(&format!("{}: {:.4} s, RMSE {rmse:.2e}", row.way.name(), row.seconds.median)),
    }
}

fn over_time(report: &Report) -> Plot<'_> {
    let time = |row: &Row| mark(row, report, row.seconds.median, (row.seconds.min, row.seconds.max), !row.on_front);
    let mut front: Vec<(f64, f64)> = report
        .rows
        .iter()
        .filter(|row| row.on_front)
        .map(|row| (row.seconds.median, row.told_rmse(report.least).max(f64::MIN_POSITIVE)))
        .collect();
    front.sort_by(|a, b| a.0.total_cmp(&b.0));
    Plot {
        x_label: "seconds",
        y_label: "root mean square error",
        marks: report.rows.iter().map(time).collect(),
        lines: vec![(front, "#1c2024")],
        level: (report.least > 0.0).then_some((report.least, "three floors")),
    }
}

fn over_samples(report: &Report) -> Plot<'_> {
    let known = |row: &&Row| row.samples_per_pixel.is_some();
    let samples = |row: &Row| row.samples_per_pixel.unwrap_or(1.0);
    let mut lines: Vec<(String, Vec<(f64, f64)>)> = Vec::new();
    for row in report.rows.iter().filter(known) {
        let point = (samples(row), row.told_rmse(report.least).max(f64::MIN_POSITIVE));
        match lines.iter_mut().find(|(family, _)| *family == row.way.family()) {
            Some((_, points)) => points.push(point),
            None => lines.push((row.way.family(), vec![point])),
        }
    }
    lines.iter_mut().for_each(|(_, points)| points.sort_by(|a, b| a.0.total_cmp(&b.0)));
    let at = |row: &Row| mark(row, report, samples(row), (samples(row), samples(row)), false);
    Plot {
        x_label: "camera rays per pixel",
        y_label: "root mean square error",
        marks: report.rows.iter().filter(known).map(at).collect(),
        lines: lines.into_iter().map(|(family, points)| (points, color_of(&family))).collect(),
        level: (report.least > 0.0).then_some((report.least, "three floors")),
    }
}

fn slopes(report: &Report, body: &mut String) {
    let slopes = report.slopes();
    if slopes.is_empty() {
        return;
    }
    body.push_str("<p>Slopes of the logarithm of error over that of samples, by least squares: ");
    let text: Vec<String> = slopes
        .iter()
        .map(|slope| format!("{} {:.2} ({} points)", escaped(&slope.family), slope.slope, slope.n_points))
        .collect();
    let _ = write!(body, "{}.</p>", text.join(", "));
}

fn reaches(report: &Report, body: &mut String) {
    body.push_str("<h3>Time to an error, and error at a time</h3><table><tr><th class=\"l\">by");
    let (reaches, allowed) = (report.reaches(), report.allowed());
    let mut names: Vec<&str> = Vec::new();
    let mut heads: Vec<String> = Vec::new();
    for (name, head) in reaches
        .iter()
        .map(|reach| (&reach.by, format!("s to {:.1e}", reach.rmse)))
        .chain(allowed.iter().map(|allowed| (&allowed.by, format!("RMSE at {} s", allowed.seconds))))
    {
        if !names.contains(&name.as_str()) {
            names.push(name);
        }
        if !heads.contains(&head) {
            let _ = write!(body, "<th>{head}");
            heads.push(head);
        }
    }
    body.push_str("</tr>");
    for name in names {
        let _ = write!(body, "<tr><td class=\"l\">{}", escaped(name));
        for reach in reaches.iter().filter(|reach| reach.by == name) {
            body.push_str(&reach.seconds.map_or("<td>–".to_owned(), |seconds| format!("<td>{seconds:.3}")));
        }
        for allowed in allowed.iter().filter(|allowed| allowed.by == name) {
            body.push_str(&allowed.rmse.map_or("<td>–".to_owned(), |rmse| format!("<td>{rmse:.1e}")));
        }
        body.push_str("</tr>");
    }
    body.push_str("</table>");
}

fn images(shown: &[Shown], body: &mut String) {
    if shown.is_empty() {
        return;
    }
    let [least, most] = ERROR_RANGE;
    let _ = write!(
        body,
        "<h3>Images of about one cost</h3><p>Beside each the largest error of a channel, dark at {least:e} and below, light at \
         {most}, by its logarithm.</p>"
    );
    for Shown { title, caption, image, error } in shown {
        let picture =
            |png: &[u8], what: &str| format!("<img alt=\"{what}\" src=\"data:image/png;base64,{}\">", base64(png));
        let error = error.as_ref().map_or_else(String::new, |png| picture(png, "its errors"));
        let _ = write!(
            body,
            "<figure><div>{}{error}</div><figcaption>{}: {}</figcaption></figure>",
            picture(image, "the image"),
            escaped(title),
            escaped(caption)
        );
    }
}

fn table(report: &Report, body: &mut String) {
    body.push_str(
        "<details><summary>All figures</summary><table><tr><th class=\"l\">setting<th>seconds<th>min<th>max<th>rays\
         <th>rays/px<th>RMSE<th>estimate<th>MAE<th>relMSE<th>max<th>99.9 %<th>FLIP<th>SSIM<th>wrong ids</tr>",
    );
    let mut rows: Vec<&Row> = report.rows.iter().collect();
    rows.sort_by(|a, b| a.seconds.median.total_cmp(&b.seconds.median));
    for row in rows {
        let class = if row.on_front { "l f" } else { "l g" };
        let number = |value: Option<f64>| value.map_or("–".to_owned(), |value| format!("{value:.1e}"));
        let rmse = row.told_rmse(report.least);
        let sign = if row.rmse.median < report.least { "&lt; " } else { "" };
        let _ = write!(
            body,
            "<tr><td class=\"{class}\">{}<td>{:.4}<td>{:.4}<td>{:.4}<td>{}<td>{}<td>{sign}{rmse:.1e}<td>{}",
            escaped(&row.way.name()),
            row.seconds.median,
            row.seconds.min,
            row.seconds.max,
            row.rays.map_or("–".to_owned(), |rays| rays.to_string()),
            row.samples_per_pixel.map_or("–".to_owned(), |samples| format!("{samples:.1}")),
            number(row.rmse_estimate),
        );
        let figures = &row.figures;
        let _ = write!(
            body,
            "<td>{:.1e}<td>{:.1e}<td>{:.1e}<td>{:.1e}<td>{:.4}<td>{:.5}<td>{}</tr>",
            figures.mae,
            figures.relmse,
            figures.max,
            figures.p999,
            figures.flip,
            figures.ssim,
            row.wrong_ids.map_or("–".to_owned(), |wrong| wrong.to_string())
        );
    }
    body.push_str("</table></details>");
}
