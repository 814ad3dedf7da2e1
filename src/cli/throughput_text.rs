//! The tables of `flatray bench throughput`.

use super::quantity;
use crate::measure::throughput::report::{Report, Row};
use crate::world::World;

/// What is in a scene.
pub fn about(world: &World) -> String {
    format!(
        "{} triangles, {} spheres, {} quadrics, {} placements, {} lights",
        quantity::count(world.triangles.len() as u64),
        quantity::count(world.spheres.len() as u64),
        quantity::count(world.quadrics.len() as u64),
        quantity::count(world.instances.len() as u64),
        quantity::count(world.lights.len() as u64),
    )
}

/// Everything that a run found, as text.
pub fn tables(input: &str, world: &World, report: &Report) -> String {
    let mut text = format!("{input}: {}\n", about(world));
    builds(report, &mut text);
    for set in report.sets.iter().filter(|set| set.ray_precision == "f32") {
        text.push_str(&format!(
            "\n{} rays: {}, {:.1} % hit; {} judged by the full scan\n",
            set.rays,
            quantity::count(set.count as u64),
            100.0 * set.hits as f64 / set.count.max(1) as f64,
            quantity::count(set.judged as u64),
        ));
        for visited in report.visits.iter().filter(|visited| visited.rays == set.rays) {
            text.push_str(&format!(
                "a single ray visits {:.1} nodes and {:.2} leaves (bvh {})\n",
                visited.nodes_per_ray, visited.leaves_per_ray, visited.quality
            ));
        }
        rows(report, set.rays, &mut text);
    }
    ratios(report, &mut text);
    for note in &report.notes {
        text.push_str(&format!("note: {note}\n"));
    }
    text
}

fn builds(report: &Report, text: &mut String) {
    text.push_str(&format!(
        "\n{:<16} {:<8} {:>7} {:>9} {:>21} {:>13} {:>9}\n",
        "build", "quality", "threads", "seconds", "min..max", "bytes/prim", "+ tables"
    ));
    for build in &report.builds {
        text.push_str(&format!(
            "{:<16} {:<8} {:>7} {:>9.3} {:>21} {:>13.1} {:>9.1}\n",
            build.engine,
            build.quality,
            build.threads,
            build.seconds.median,
            format!("{:.3}..{:.3}", build.seconds.min, build.seconds.max),
            build.bytes_per_primitive,
            build.table_bytes_per_primitive,
        ));
    }
}

fn rows(report: &Report, kind: &str, text: &mut String) {
    text.push_str(&format!(
        "{:<16} {:<8} {:<9} {:<8} {:>4} {:>7} {:>9} {:>17} {:>9} {:>7}\n",
        "engine", "quality", "mode", "isa", "rays", "threads", "Mray/s", "min..max", "wrong", "t off"
    ));
    let mut rows: Vec<&Row> = report.rows.iter().filter(|row| row.rays == kind).collect();
    rows.sort_by(|a, b| {
        let key = |row: &Row| (row.threads, !row.is_flatray(), row.ray_precision);
        key(a).cmp(&key(b)).then_with(|| a.engine.cmp(&b.engine)).then_with(|| {
            let speed = |row: &Row| row.mrays_per_s.median;
            speed(b).total_cmp(&speed(a))
        })
    });
    let figure = |n: Option<u64>| n.map_or_else(|| "-".to_owned(), quantity::count);
    for row in rows {
        text.push_str(&format!(
            "{:<16} {:<8} {:<9} {:<8} {:>4} {:>7} {:>9.2} {:>17} {:>9} {:>7}\n",
            row.engine,
            row.quality,
            row.mode,
            row.isa,
            row.ray_precision,
            row.threads,
            row.mrays_per_s.median,
            format!("{:.2}..{:.2}", row.mrays_per_s.min, row.mrays_per_s.max),
            figure(row.wrong),
            figure(row.t_off),
        ));
    }
}

fn ratios(report: &Report, text: &mut String) {
    if report.ratios.is_empty() {
        return;
    }
    text.push_str(&format!(
        "\n{:<44} {:<8} {:<11} {:>7} {:>7} {:>11}\n",
        "ratio", "bvh", "rays", "threads", "ratio", "of fastest"
    ));
    for ratio in &report.ratios {
        text.push_str(&format!(
            "{:<44} {:<8} {:<11} {:>7} {:>7.2} {:>11.2}\n",
            ratio.what, ratio.quality, ratio.rays, ratio.threads, ratio.value, ratio.fastest
        ));
    }
    text.push('\n');
}
