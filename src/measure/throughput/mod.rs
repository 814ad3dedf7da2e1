//! Rays per second: of flatray in all its modes, and of a peer on the same rays in the same run.
//!
//! Work is prepared and its answers are judged by the full scan ([`work`]); every way of tracing must give the same
//! answers on all rays before its time counts ([`contest`]); a peer's answers are compared with flatray's, which are
//! exact ([`check`]).

pub mod check;
pub mod contest;
pub mod export;
pub mod page;
pub mod pass;
pub mod peer;
pub mod ratio;
pub mod report;
pub mod work;

use super::embree::{Geometry, library::Library};
use super::rays::RayKind;
use crate::accel::{Mode, Preset};
use crate::error::Error;
use crate::simd::Isa;
use crate::world::World;
use contest::Contest;
use peer::Peers;
use report::{Report, Visited};
use work::Work;

/// What to measure. No list is empty, and the counts are at least 1.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Kinds of rays.
    pub kinds: Vec<RayKind>,
    /// Numbers of threads; the first is that of comparisons.
    pub threads: Vec<usize>,
    /// Instruction sets, all of them available.
    pub isas: Vec<Isa>,
    /// Modes.
    pub modes: Vec<Mode>,
    /// Presets of the build.
    pub presets: Vec<Preset>,
    /// Times that each is measured.
    pub repeats: usize,
    /// A measurement is repeated until it has taken this long.
    pub min_seconds: f64,
    /// Primitive tests that the full scan may spend on one set of rays.
    pub oracle_tests: u64,
}

/// Measures everything on prepared work. `progress` is told what comes next.
///
/// # Errors
/// When a way of tracing answers otherwise than another.
pub fn measure(
    world: &World,
    work: &mut Work,
    settings: &Settings,
    library: Option<&Library>,
    progress: &mut dyn FnMut(&str),
) -> Result<Report, Error> {
    let mut report = Report { builds: work.builds.clone(), notes: work.notes.clone(), ..Report::default() };
    let geometry = Geometry::of(world);
    let peers = library.map(|library| {
        progress("building in Embree");
        Peers::build(library, &geometry, world, settings)
    });
    let mut scenes = Vec::new();
    match peers {
        Some(Ok(peers)) => {
            report.builds.extend(peers.builds);
            report.notes.extend(peers.notes);
            scenes = peers.scenes;
        }
        Some(Err(why)) => report.notes.push(format!("measured without Embree: {why}")),
        None => {}
    }
    for pair in &work.pairs {
        progress(&format!("tracing {} rays", pair.kind.name()));
        report.rows.extend(Contest::new(world, &mut work.trees, pair, &scenes, settings).run(settings)?);
        for tree in &work.trees {
            let rays = &pair.f32.rays;
            let visits = match pair.kind.is_occlusion() {
                true => tree.accel.visits_of_occluded(world, rays),
                false => tree.accel.visits_of_closest_hit(world, rays),
            };
            report.visits.push(Visited::new(pair.kind, tree.preset, rays.len(), visits));
        }
        report.sets.extend([&pair.f32, &pair.f64].map(|set| set.summary(pair.kind)));
    }
    report.ratios = ratio::all(&report, settings);
    Ok(report)
}
