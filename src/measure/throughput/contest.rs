//! All ways to trace one kind of rays, measured in turns so that what the machine does besides falls on all alike.

use std::time::Instant;

use super::pass::{self, Answers, Packets};
use super::peer::PeerScene;
use super::report::{Row, Spread};
use super::work::{Pair, RaySet, Tree};
use super::{Settings, check};
use crate::accel::Mode;
use crate::error::Error;
use crate::measure::generate::hash_unit;
use crate::measure::rays::{RayKind, RayPrecision};
use crate::simd::Isa;
use crate::world::World;

/// A way to trace.
#[derive(Clone, Copy, Debug)]
enum Way {
    Flatray {
        tree: usize,
        isa: Isa,
        mode: Mode,
        precision: RayPrecision,
    },
    /// `width` rays at a time: 1, 4, 8 or 16.
    Embree {
        scene: usize,
        width: usize,
    },
}

/// A way to trace on some threads, and how long it took each time.
#[derive(Clone, Debug)]
struct Entry {
    way: Way,
    threads: usize,
    /// Passes that make one measurement long enough.
    n_passes: u32,
    mrays_per_s: Vec<f64>,
    mistakes: Option<check::Mistakes>,
}

/// Rays as Embree wants them.
struct PeerRays {
    one: Packets<1>,
    four: Packets<4>,
    eight: Packets<8>,
    sixteen: Packets<16>,
}

/// Everybody who traces one kind of rays.
pub struct Contest<'a> {
    world: &'a World,
    trees: &'a mut [Tree],
    pair: &'a Pair,
    scenes: &'a [PeerScene<'a>],
    peer_rays: Option<PeerRays>,
    /// Room for flatray's answers to the f32 and to the f64 rays.
    answers: [Answers; 2],
    entries: Vec<Entry>,
}

impl<'a> Contest<'a> {
    /// Lists who takes part: flatray on f32 rays with all numbers of threads, on f64 rays with the first; Embree's
    /// packets where rays are coherent, and its robust mode with the first number of threads.
    pub fn new(
        world: &'a World,
        trees: &'a mut [Tree],
        pair: &'a Pair,
        scenes: &'a [PeerScene<'a>],
        settings: &Settings,
    ) -> Contest<'a> {
        let mut entries = Vec::new();
        let mut enter = |way, threads| {
            entries.push(Entry { way, threads, n_passes: 1, mrays_per_s: Vec::new(), mistakes: None });
        };
        for (count, &threads) in settings.threads.iter().enumerate() {
            for tree in 0..trees.len() {
                for &isa in &settings.isas {
                    for &mode in &settings.modes {
                        enter(Way::Flatray { tree, isa, mode, precision: RayPrecision::F32 }, threads);
                        if count == 0 {
                            enter(Way::Flatray { tree, isa, mode, precision: RayPrecision::F64 }, threads);
                        }
                    }
                }
            }
            for (scene, peer) in scenes.iter().enumerate() {
                let widths: &[usize] = match pair.kind {
                    _ if count > 0 && peer.robust => &[],
                    RayKind::Primary if count == 0 => &[1, 4, 8, 16],
                    RayKind::Shadow if count == 0 => &[1, 8, 16],
                    RayKind::Primary | RayKind::Shadow => &[1, 16],
                    RayKind::Reflection | RayKind::Diffuse => &[1],
                };
                widths.iter().for_each(|&width| enter(Way::Embree { scene, width }, threads));
            }
        }
        let rays = &pair.f32.rays;
        let peer_rays = (!scenes.is_empty()).then(|| PeerRays {
            one: Packets::of(rays),
            four: Packets::of(rays),
            eight: Packets::of(rays),
            sixteen: Packets::of(rays),
        });
        let answers = [&pair.f32, &pair.f64].map(|set| Answers::room(pair.kind, set.rays.len()));
        Contest { world, trees, pair, scenes, peer_rays, answers, entries }
    }

    /// Checks everybody's answers, then measures them in turns.
    ///
    /// # Errors
    /// When flatray answers otherwise in one way than in another.
    pub fn run(mut self, settings: &Settings) -> Result<Vec<Row>, Error> {
        let mut entries = std::mem::take(&mut self.entries);
        for entry in &mut entries {
            let seconds = self.measure(entry);
            entry.n_passes = (settings.min_seconds / seconds.max(1e-9)).ceil().clamp(1.0, 1e6) as u32;
            entry.mistakes = self.check(entry)?;
        }
        for repeat in 0..settings.repeats {
            for index in shuffled(entries.len(), repeat) {
                let seconds = self.measure(&entries[index]);
                let n_rays = self.set(&entries[index]).rays.len();
                entries[index].mrays_per_s.push(n_rays as f64 / seconds.max(1e-9) * 1e-6);
            }
        }
        Ok(entries.into_iter().map(|entry| self.row(entry)).collect())
    }

    fn set(&self, entry: &Entry) -> &'a RaySet {
        match entry.way {
            Way::Flatray { precision: RayPrecision::F64, .. } => &self.pair.f64,
            _ => &self.pair.f32,
        }
    }

    /// Seconds per pass.
    fn measure(&mut self, entry: &Entry) -> f64 {
        let set = self.set(entry);
        if let Way::Flatray { tree, isa, mode, .. } = entry.way {
            self.trees[tree].accel.choose(isa, mode);
        }
        let started = Instant::now();
        for _ in 0..entry.n_passes {
            self.pass(entry, set);
        }
        started.elapsed().as_secs_f64() / f64::from(entry.n_passes)
    }

    fn pass(&mut self, entry: &Entry, set: &RaySet) {
        let threads = entry.threads;
        match (entry.way, &mut self.peer_rays) {
            (Way::Flatray { tree, precision, .. }, _) => {
                let answers = &mut self.answers[usize::from(precision == RayPrecision::F64)];
                pass::trace(&self.trees[tree].accel, self.world, &set.rays, answers, threads);
            }
            (Way::Embree { scene, width }, Some(rays)) => {
                let (scene, kind) = (&self.scenes[scene].scene, self.pair.kind);
                match width {
                    1 => rays.one.trace(scene, kind, threads),
                    4 => rays.four.trace(scene, kind, threads),
                    8 => rays.eight.trace(scene, kind, threads),
                    _ => rays.sixteen.trace(scene, kind, threads),
                }
            }
            (Way::Embree { .. }, None) => {}
        }
    }

    /// Compares the answers of the last pass with the exact ones.
    fn check(&self, entry: &Entry) -> Result<Option<check::Mistakes>, Error> {
        let set = self.set(entry);
        match (entry.way, &self.peer_rays) {
            (Way::Flatray { tree, isa, mode, precision }, _) => {
                let given = &self.answers[usize::from(precision == RayPrecision::F64)];
                let (preset, isa) = (self.trees[tree].preset.name(), isa.name());
                let by = format!("preset {preset}, isa {isa}, mode {}, threads {}", mode.name(), entry.threads);
                check::same(&set.rays, &set.answers, given, "the first way", &by)?;
                Ok(Some(check::Mistakes::default()))
            }
            (Way::Embree { scene, width }, Some(rays)) => {
                let t = match width {
                    1 => rays.one.answers(),
                    4 => rays.four.answers(),
                    8 => rays.eight.answers(),
                    _ => rays.sixteen.answers(),
                };
                Ok(self.scenes[scene].complete.then(|| check::mistakes(&set.answers, t)))
            }
            (Way::Embree { .. }, None) => Ok(None),
        }
    }

    fn row(&self, entry: Entry) -> Row {
        let set = self.set(&entry);
        let Entry { way, threads, mrays_per_s, mistakes, .. } = entry;
        let (engine, mode, isa, quality) = match way {
            Way::Flatray { tree, isa, mode, .. } => {
                ("flatray", mode.name().to_owned(), isa.name().to_owned(), self.trees[tree].preset.name())
            }
            Way::Embree { scene, width } => {
                let peer = &self.scenes[scene];
                let mode = if width == 1 { "single".to_owned() } else { format!("packet{width}") };
                (peer.engine(), mode, peer.isa.name().to_owned(), peer.quality.name())
            }
        };
        Row {
            engine: engine.to_owned(),
            rays: self.pair.kind.name(),
            ray_precision: set.precision.name(),
            mode,
            isa,
            quality,
            threads,
            mrays_per_s: Spread::of(mrays_per_s),
            wrong: mistakes.map(|mistakes| mistakes.wrong),
            t_off: mistakes.map(|mistakes| mistakes.t_off),
        }
    }
}

/// The numbers below `n` in another order for each repeat.
pub(in crate::measure) fn shuffled(n: usize, repeat: usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&a, &b| {
        let key = |index: usize| hash_unit((repeat as u64) << 32 | index as u64);
        key(a).total_cmp(&key(b))
    });
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_repeat_has_all_entries_in_an_order_of_its_own() {
        let (first, second) = (shuffled(20, 0), shuffled(20, 1));
        assert_ne!(first, second);
        for mut order in [first, second] {
            order.sort_unstable();
            assert!(order.into_iter().eq(0..20));
        }
    }
}
