//! A report as one self-contained page: plots as inline SVG, tables, no scripts, nothing from elsewhere.

use std::fmt::Write;

use super::report::{Report, Row, Spread};

const STYLE: &str = "\
body{font:15px/1.5 system-ui,sans-serif;max-width:62rem;margin:2rem auto;padding:0 1rem;color:#1c2024;background:#fff}\
h1{font-size:1.5rem}h2{font-size:1.15rem;margin-top:2.2rem}\
table{border-collapse:collapse;font-variant-numeric:tabular-nums;margin:.5rem 0}\
th,td{padding:.15rem .7rem;text-align:right;border-bottom:1px solid #e3e6e9}\
th{color:#5b6570;font-weight:600}.l{text-align:left}.bad{color:#b3261e}\
svg{display:block;width:100%;height:auto;font:13px system-ui,sans-serif}summary{cursor:pointer;color:#5b6570}";

/// Of flatray, of Embree, of Embree's robust mode.
const COLORS: [&str; 3] = ["#2f6fb0", "#c9772b", "#9a8f83"];

const PLOT_WIDTH: f64 = 960.0;
const LABEL_WIDTH: f64 = 390.0;
const BAR_PITCH: f64 = 24.0;
const BAR_HEIGHT: f64 = 15.0;
/// Room for the figures at the right.
const FIGURE_WIDTH: f64 = 60.0;

/// The page. `title` names the scene, `about` says what is in it.
pub fn page(title: &str, about: &str, report: &Report) -> String {
    let mut body = format!("<h1>flatray bench throughput: {}</h1><p>{}</p>", escaped(title), escaped(about));
    body.push_str(
        "<p>Million rays per second: the median over repeats that all took in turns; thin lines are minimum and \
         maximum. Every answer of flatray was checked before its time was taken. Of a kind of engine and mode the \
         fastest instruction set and build quality is shown, and the table below holds all.</p>",
    );
    ratios(report, &mut body);
    let mut kinds: Vec<&str> = report.sets.iter().map(|set| set.rays).collect();
    kinds.dedup();
    for kind in kinds {
        rays(report, kind, &mut body);
    }
    builds(report, &mut body);
    for note in &report.notes {
        body.push_str(&format!("<p>{}</p>", escaped(note)));
    }
    format!(
        "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" \
         content=\"width=device-width\"><title>{} – flatray bench throughput</title><style>{STYLE}</style></head>\
         <body>{body}</body></html>\n",
        escaped(title)
    )
}

/// Text as HTML shows it.
pub(in crate::measure) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// A bar of a plot.
struct Bar {
    label: String,
    color: &'static str,
    value: Spread,
}

/// Horizontal bars from 0, longest value at full width; `mark` draws a line at a value.
fn bars(bars: &[Bar], mark: Option<f64>) -> String {
    let height = BAR_PITCH * bars.len() as f64 + 6.0;
    let longest = bars.iter().map(|bar| bar.value.max).fold(mark.unwrap_or(0.0), f64::max).max(f64::MIN_POSITIVE);
    let scale = (PLOT_WIDTH - LABEL_WIDTH - FIGURE_WIDTH) / longest;
    let x = |value: f64| LABEL_WIDTH + scale * value;
    let mut svg = format!("<svg viewBox=\"0 0 {PLOT_WIDTH} {height}\" role=\"img\">");
    for (row, Bar { label, color, value }) in bars.iter().enumerate() {
        let top = 3.0 + BAR_PITCH * row as f64;
        let (middle, text) = (top + 0.5 * BAR_HEIGHT, top + 0.8 * BAR_HEIGHT);
        // Writing to a string cannot fail.
        let _ = write!(
            svg,
            "<text x=\"{:.1}\" y=\"{text:.1}\" text-anchor=\"end\" fill=\"#1c2024\">{}</text>\
             <rect x=\"{LABEL_WIDTH}\" y=\"{top:.1}\" width=\"{:.1}\" height=\"{BAR_HEIGHT}\" fill=\"{color}\"/>\
             <path d=\"M{:.1} {middle:.1}H{:.1}\" stroke=\"#1c2024\"/>\
             <text x=\"{:.1}\" y=\"{text:.1}\" fill=\"#1c2024\">{:.2}</text>",
            LABEL_WIDTH - 8.0,
            escaped(label),
            scale * value.median,
            x(value.min),
            x(value.max),
            x(value.max) + 8.0,
            value.median,
        );
    }
    if let Some(at) = mark {
        let _ = write!(svg, "<path d=\"M{0:.1} 0V{height}\" stroke=\"#1c2024\" stroke-dasharray=\"3 3\"/>", x(at));
    }
    svg + "</svg>"
}

fn ratios(report: &Report, body: &mut String) {
    if report.ratios.is_empty() {
        return;
    }
    body.push_str(
        "<h2>Ratios</h2><p>Above 1 flatray is faster or smaller. Bars are ratios of \
         medians, thin lines reach to those of the fastest repeats.</p>",
    );
    let of = |ratio: &super::report::Ratio| Bar {
        label: format!("{} {} · bvh {} · threads {}", ratio.rays, short(ratio.what), ratio.quality, ratio.threads),
        color: COLORS[0],
        value: Spread { median: ratio.value, min: ratio.value.min(ratio.fastest), max: ratio.value.max(ratio.fastest) },
    };
    body.push_str(&bars(&report.ratios.iter().map(of).collect::<Vec<_>>(), Some(1.0)));
}

/// What a ratio is of, in the width of a label.
fn short(what: &str) -> String {
    what.replace(", single ray", "").replace(", best packets", " packets").replace(" per primitive", "")
}

fn rays(report: &Report, kind: &str, body: &mut String) {
    let threads = report.rows.first().map_or(1, |row| row.threads);
    let rows: Vec<&Row> = report.rows.iter().filter(|row| row.rays == kind).collect();
    body.push_str(&format!("<h2>{kind} rays, threads: {threads}</h2>"));
    for set in report.sets.iter().filter(|set| set.rays == kind) {
        body.push_str(&format!(
            "<p>{} rays in {}: {:.1} % hit; {} answers judged by the full scan.</p>",
            set.count,
            set.ray_precision,
            100.0 * set.hits as f64 / set.count.max(1) as f64,
            set.judged
        ));
    }
    for visited in report.visits.iter().filter(|visited| visited.rays == kind) {
        body.push_str(&format!(
            "<p>A single ray visits {:.1} nodes and {:.2} leaves (bvh {}).</p>",
            visited.nodes_per_ray, visited.leaves_per_ray, visited.quality
        ));
    }
    body.push_str(&bars(&fastest(&rows, threads), None));
    body.push_str(&table(&rows));
}

/// The fastest row of each engine, mode and precision.
fn fastest(rows: &[&Row], threads: usize) -> Vec<Bar> {
    let mut best: Vec<&Row> = Vec::new();
    for row in rows.iter().filter(|row| row.threads == threads) {
        let alike = |other: &&mut &Row| {
            (&other.engine, &other.mode, other.ray_precision) == (&row.engine, &row.mode, row.ray_precision)
        };
        match best.iter_mut().find(alike) {
            Some(other) if other.mrays_per_s.median < row.mrays_per_s.median => *other = row,
            Some(_) => {}
            None => best.push(row),
        }
    }
    best.sort_by(|a, b| b.mrays_per_s.median.total_cmp(&a.mrays_per_s.median));
    let bar = |row: &&Row| Bar {
        label: format!("{} {} · {} {} · {}", row.engine, row.mode, row.quality, row.isa, row.ray_precision),
        color: match row.engine.as_str() {
            "flatray" => COLORS[0],
            "embree:robust" => COLORS[2],
            _ => COLORS[1],
        },
        value: row.mrays_per_s,
    };
    best.iter().map(bar).collect()
}

fn table(rows: &[&Row]) -> String {
    let mut table = "<details><summary>All figures</summary><table><tr><th class=\"l\">engine<th class=\"l\">quality\
         <th class=\"l\">mode<th class=\"l\">isa<th class=\"l\">rays<th>threads<th>Mray/s<th>min<th>max<th>wrong<th>t off</tr>"
        .to_owned();
    let figure = |n: Option<u64>| match n {
        None => "<td>–".to_owned(),
        Some(0) => "<td>0".to_owned(),
        Some(n) => format!("<td class=\"bad\">{n}"),
    };
    for row in rows {
        let Row { engine, quality, mode, isa, ray_precision, threads, mrays_per_s, wrong, t_off, .. } = row;
        let Spread { median, min, max } = mrays_per_s;
        let _ = write!(
            table,
            "<tr><td class=\"l\">{engine}<td class=\"l\">{quality}<td class=\"l\">{mode}<td class=\"l\">{isa}\
             <td class=\"l\">{ray_precision}<td>{threads}<td>{median:.2}<td>{min:.2}<td>{max:.2}{}{}</tr>",
            figure(*wrong),
            figure(*t_off)
        );
    }
    table + "</table></details>"
}

fn builds(report: &Report, body: &mut String) {
    body.push_str(
        "<h2>Build and memory</h2><table><tr><th class=\"l\">engine<th class=\"l\">quality<th>threads<th>seconds\
         <th>min<th>max<th>bytes per primitive<th>with tables</tr>",
    );
    for build in &report.builds {
        let Spread { median, min, max } = build.seconds;
        let _ = write!(
            body,
            "<tr><td class=\"l\">{}<td class=\"l\">{}<td>{}<td>{median:.3}<td>{min:.3}<td>{max:.3}<td>{:.1}<td>{:.1}</tr>",
            build.engine,
            build.quality,
            build.threads,
            build.bytes_per_primitive,
            build.bytes_per_primitive + build.table_bytes_per_primitive
        );
    }
    body.push_str("</table>");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_cannot_become_markup_and_nothing_is_loaded_from_elsewhere() {
        let page = page("<script>\"&", "1 triangle", &Report::default());
        assert!(page.contains("&lt;script&gt;&quot;&amp;") && !page.contains("<script"));
        assert!(!page.contains("http") && !page.contains("src="));
    }
}
