//! The scenes that Embree traces, and how long it takes to build them.

use super::Settings;
use super::report::Build;
use super::work::repeat_build;
use crate::measure::embree::library::{Library, Scene};
use crate::measure::embree::{Geometry, PeerIsa, Quality};
use crate::world::World;

const QUALITIES: [Quality; 2] = [Quality::Medium, Quality::High];

/// A scene and what it was built with.
#[derive(Debug)]
pub struct PeerScene<'g> {
    /// The scene.
    pub scene: Scene<'g>,
    /// Instruction set.
    pub isa: PeerIsa,
    /// Quality of the build.
    pub quality: Quality,
    /// Whether its robust mode is on.
    pub robust: bool,
    /// Whether it holds all that flatray's scene holds.
    pub complete: bool,
}

impl PeerScene<'_> {
    /// The name in reports.
    pub fn engine(&self) -> &'static str {
        engine(self.robust)
    }
}

fn engine(robust: bool) -> &'static str {
    if robust { "embree:robust" } else { "embree:default" }
}

/// All scenes of Embree.
#[derive(Debug)]
pub struct Peers<'g> {
    /// One per instruction set, quality and mode.
    pub scenes: Vec<PeerScene<'g>>,
    /// How long builds took.
    pub builds: Vec<Build>,
    /// What the reader should know.
    pub notes: Vec<String>,
}

impl<'g> Peers<'g> {
    /// Builds everything.
    ///
    /// # Errors
    /// What Embree says.
    pub fn build(
        library: &Library,
        geometry: &'g Geometry,
        world: &World,
        settings: &Settings,
    ) -> Result<Peers<'g>, String> {
        let [major, minor, patch] = library.version;
        let mut notes = vec![format!("Embree {major}.{minor}.{patch}: {}", library.path.display())];
        let isas = PeerIsa::available();
        let Some(&newest) = isas.last() else { return Err("the processor has no instruction set of it".to_owned()) };
        let complete = world.quadrics.is_empty() && world.instances.is_empty();
        if !complete {
            let what = "quadrics, and placements as flatray has them";
            notes.push(format!("Embree has no {what}: it traces the scene without them, and is not compared"));
        }
        if geometry.has_rounded_spheres(world) {
            notes.push("Embree's spheres are rounded to f32; some of its wrong answers may come from that".to_owned());
        }
        // First alone, since Embree's devices share their threads.
        let builds = timed_builds(library, geometry, settings, newest)?;
        let threads = settings.threads.iter().copied().max().unwrap_or(1);
        let mut scenes = Vec::new();
        for isa in isas {
            let device = library.device_with(threads, isa)?;
            for quality in QUALITIES {
                for robust in [false, true] {
                    let scene = device.build(geometry, quality, robust)?;
                    scenes.push(PeerScene { scene, isa, quality, robust, complete });
                }
            }
        }
        Ok(Peers { scenes, builds, notes })
    }
}

fn timed_builds(
    library: &Library,
    geometry: &Geometry,
    settings: &Settings,
    isa: PeerIsa,
) -> Result<Vec<Build>, String> {
    let mut builds = Vec::new();
    for &threads in &settings.threads {
        let device = library.device_with(threads, isa)?;
        for quality in QUALITIES {
            let before = device.bytes();
            let build = || device.build(geometry, quality, false);
            let (scene, seconds) = repeat_build(settings.repeats, build)?;
            let bytes = device.bytes().saturating_sub(before);
            drop(scene);
            builds.push(Build {
                engine: engine(false).to_owned(),
                quality: quality.name(),
                threads,
                seconds,
                bytes_per_primitive: bytes as f64 / geometry.n_prims().max(1) as f64,
                table_bytes_per_primitive: 0.0,
            });
        }
    }
    Ok(builds)
}
