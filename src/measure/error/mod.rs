//! Run time against error: one frame rendered in many ways, each judged by a reference.
//!
//! | room | does |
//! |---|---|
//! | `frame` | what is rendered, and a hash of all that decides its true image |
//! | `setting`, `grid`, `settings_file` | the ways to render it |
//! | `reference`, `cache` | what images are judged by, its own error, and where it is kept |
//! | `engine`, `peer` | what renders: this process, whole processes, POV-Ray |
//! | `figures`, `ids` | how wrong an image is |
//! | `partial` | what has been measured so far |
//! | `front`, `report` | what it comes to |
//! | `page`, `plot`, `pictures` | the report as a page |

pub mod cache;
pub mod engine;
pub mod figures;
pub mod frame;
pub mod front;
pub mod grid;
pub mod ids;
pub mod page;
pub mod partial;
pub mod peer;
pub mod pictures;
mod plot;
pub mod reference;
pub mod report;
pub mod setting;
pub mod settings_file;

use crate::accel::{AccelKind, Preset};
use crate::measure::process::Ended;
use crate::measure::throughput::contest::shuffled;
use crate::render::Control;
use crate::simd::Isa;
use engine::{Engines, Shot};
use figures::Figures;
use frame::Frame;
use ids::Centers;
use partial::{Partial, Run};
use reference::Reference;
use report::{Report, Row, TARGETS};
use setting::Way;

/// Renders every way several times, in another random order each time and each time with another seed, and reports. What `partial`
/// knows already is not rendered again.
///
/// # Errors
/// A stop that `control` asked for, a process that fails, a file that cannot be written; `partial` then holds what was measured.
pub fn measure(
    engines: &mut Engines,
    reference: &Reference,
    ways: &[Way],
    repeats: usize,
    partial: &mut Partial,
    control: &Control,
    progress: &mut dyn FnMut(&str),
) -> Result<Report, Ended> {
    let Frame { camera, settings, .. } = engines.frame;
    let key = key_of(engines, reference);
    let mut runs: Vec<Vec<Run>> = vec![Vec::new(); ways.len()];
    let n_runs = ways.len() * repeats;
    let mut n_done = 0;
    let mut is_warm = false;
    for repeat in 0..repeats {
        for index in shuffled(ways.len(), repeat) {
            n_done += 1;
            let key = format!("{key} {} {repeat}", ways[index].name());
            if let Some(run) = partial.take(&key) {
                runs[index].push(run);
                continue;
            }
            if !is_warm {
                // The first render pays for what all others find ready: files, pages, clocks.
                is_warm = engines.render(&ways[index], 0, control).map(|_| true)?;
            }
            progress(&format!("{n_done} of {n_runs}: {}", ways[index].name()));
            let shot = engines.render(&ways[index], settings.seed.wrapping_add(repeat as u64), control)?;
            let run = run_of(&shot, reference)?;
            partial.add(key, run)?;
            runs[index].push(run);
        }
    }
    progress("judging what pixels show");
    let (wrong_ids, judged_ids) = wrong_ids(engines, ways);
    let n_pixels = camera.width_px as usize * camera.height_px as usize;
    let rows = ways.iter().zip(&runs).zip(wrong_ids).map(|((way, runs), wrong)| Row::of(way, runs, n_pixels, wrong));
    let mut report = Report {
        rows: rows.collect(),
        floor: reference.floor,
        least: reference.least(),
        reference_samples: reference.samples,
        hash: reference.hash.clone(),
        size_px: [camera.width_px, camera.height_px],
        threads: settings.threads,
        repeats,
        whole_processes: engines.are_processes(),
        judged_ids,
        notes: notes(ways, reference),
    };
    report.find_front();
    Ok(report)
}

/// What runs have in common that may be taken for each other.
fn key_of(engines: &Engines, reference: &Reference) -> String {
    let settings = engines.frame.settings;
    format!(
        "{} {} {:e} {} threads, seed {}, cutoff {:e}, {}:",
        env!("CARGO_PKG_VERSION"),
        reference.hash,
        reference.floor,
        settings.threads,
        settings.seed,
        settings.cutoff,
        if engines.are_processes() { "processes" } else { "renders" },
    )
}

fn run_of(shot: &Shot, reference: &Reference) -> Result<Run, Ended> {
    let Shot { film, seconds, rays, camera_rays, rmse_estimate } = shot;
    let figures = Figures::of(film, &reference.film)?;
    Ok(Run { seconds: *seconds, rays: *rays, camera_rays: *camera_rays, rmse_estimate: *rmse_estimate, figures })
}

/// Wrong ids of each way, where they can be known, and pixels judged.
fn wrong_ids(engines: &mut Engines, ways: &[Way]) -> (Vec<Option<u64>>, usize) {
    let Frame { world, camera, .. } = engines.frame;
    let centers = Centers::judge(world, camera, engines.accel(AccelKind::Linear, Preset::default(), Isa::detect()));
    // Ways that find hits alike are asked once.
    let mut known: Vec<((AccelKind, Preset, Isa), u64)> = Vec::new();
    let mut wrong = Vec::new();
    for way in ways {
        let Way::Flatray(setting) = way else {
            wrong.push(None);
            continue;
        };
        let how = (setting.accel, setting.preset, setting.isa.unwrap_or_else(Isa::detect));
        let count = known.iter().find(|(other, _)| *other == how).map(|&(_, count)| count);
        let count = count.unwrap_or_else(|| {
            let count = centers.wrong(world, engines.accel(how.0, how.1, how.2));
            known.push((how, count));
            count
        });
        wrong.push(Some(count));
    }
    (wrong, centers.len())
}

/// What the reader should know of the errors that are asked for.
fn notes(ways: &[Way], reference: &Reference) -> Vec<String> {
    let least = reference.least();
    let below = |name: String| {
        format!("{name} is below three floors of the reference, {least:.1e}, where no error can be told")
    };
    let targets = ways.iter().filter(|way| way.target().is_some_and(|target| target < least));
    let told = TARGETS.into_iter().filter(|&target| target < least);
    let told = told.map(|target| below(format!("an error of {target:e}")));
    targets.map(|way| below(format!("the target of {}", way.name()))).chain(told).collect()
}
