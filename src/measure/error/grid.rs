//! Which ways to render are compared.

use super::setting::{Amount, Setting, Way};
use crate::accel::{AccelKind, Preset};
use crate::measure::povray::Antialiasing;
use crate::render::Sampler;
use crate::simd::Isa;

/// All combinations of what is listed. An empty list leaves its place to the frame's own settings; samples go with
/// samplers, and errors stand for themselves.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Grid {
    /// Samples per pixel.
    pub samples: Vec<u32>,
    /// Where they lie.
    pub samplers: Vec<Sampler>,
    /// Errors to reach by adaptive samples.
    pub errors: Vec<f64>,
    /// Longest chains of rays.
    pub max_depths: Vec<u32>,
    /// Contribution cut-offs.
    pub cutoffs: Vec<f64>,
    /// How hits are found.
    pub accels: Vec<AccelKind>,
    /// What is spent on the tree.
    pub presets: Vec<Preset>,
    /// Instruction sets.
    pub isas: Vec<Isa>,
}

impl Grid {
    /// The combinations, in the order of the lists.
    pub fn settings(&self) -> Vec<Setting> {
        let samplers = if self.samplers.is_empty() { &[Sampler::default()][..] } else { &self.samplers };
        let uniform = self
            .samples
            .iter()
            .flat_map(|&samples| samplers.iter().map(move |&sampler| Amount::Samples { sampler, samples }));
        let amounts = uniform.chain(self.errors.iter().map(|&error| Amount::Error(error)));
        let mut settings: Vec<Setting> = amounts.map(Setting::of).collect();
        vary(&mut settings, &self.max_depths, |setting, &depth| setting.max_depth = Some(depth));
        vary(&mut settings, &self.cutoffs, |setting, &cutoff| setting.cutoff = Some(cutoff));
        vary(&mut settings, &self.accels, |setting, &accel| setting.accel = accel);
        vary(&mut settings, &self.presets, |setting, &preset| setting.preset = preset);
        vary(&mut settings, &self.isas, |setting, &isa| setting.isa = Some(isa));
        settings
    }
}

/// Each setting once for each value.
fn vary<T>(settings: &mut Vec<Setting>, values: &[T], set: impl Fn(&mut Setting, &T)) {
    if values.is_empty() {
        return;
    }
    let varied = settings.iter().flat_map(|setting| {
        values.iter().map(|value| {
            let mut setting = setting.clone();
            set(&mut setting, value);
            setting
        })
    });
    *settings = varied.collect();
}

/// Scenes of no more primitives than this are scanned in full, too.
const MAX_SCANNED: usize = 100;

/// What is compared unless a file says otherwise: samples by samplers, errors to reach, and one after another what else there
/// is to choose, at a few samples.
pub fn default_grids(n_prims: usize, max_depth: u32) -> Vec<Grid> {
    let one = |samples: u32| Grid { samples: vec![samples], ..Grid::default() };
    let mut grids = vec![
        Grid {
            samples: vec![1, 4, 16, 64, 256],
            samplers: vec![Sampler::Sobol, Sampler::Jitter, Sampler::Grid, Sampler::Random],
            ..Grid::default()
        },
        Grid { errors: vec![1e-2, 3e-3, 1e-3], ..Grid::default() },
        Grid { cutoffs: vec![0.0, 1e-2], ..one(16) },
        Grid { presets: vec![Preset::Fast, Preset::High], ..one(16) },
    ];
    if max_depth > 2 {
        grids.push(Grid { max_depths: vec![2], ..one(16) });
    }
    if n_prims <= MAX_SCANNED {
        grids.push(Grid { accels: vec![AccelKind::Linear], ..one(16) });
    }
    let slower: Vec<Isa> = Isa::ALL.into_iter().filter(|isa| isa.is_available() && *isa != Isa::detect()).collect();
    if !slower.is_empty() {
        grids.push(Grid { isas: slower, ..one(16) });
    }
    grids
}

impl Grid {
    /// Number of combinations.
    pub fn len(&self) -> usize {
        let lengths =
            [self.max_depths.len(), self.cutoffs.len(), self.accels.len(), self.presets.len(), self.isas.len()];
        let amounts = self.samples.len().saturating_mul(self.samplers.len().max(1)).saturating_add(self.errors.len());
        lengths.into_iter().map(|length| length.max(1)).fold(amounts, usize::saturating_mul)
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// POV-Ray's ways, unless a file says otherwise.
pub fn default_antialiasing() -> Vec<Antialiasing> {
    let uniform = [1, 2, 3, 4, 6, 9].map(|grid| Antialiasing::Uniform { grid });
    let adaptive =
        [(0.3, 2), (0.3, 3), (0.1, 3), (0.1, 4), (0.01, 3), (0.01, 4), (1e-3, 4), (1e-3, 5), (1e-4, 6), (1e-4, 7)];
    let adaptive = adaptive.map(|(threshold, depth)| Antialiasing::Adaptive { threshold, depth });
    uniform.into_iter().chain(adaptive).collect()
}

/// All ways of grids and antialiasing, each once.
pub fn ways(grids: &[Grid], antialiasing: &[Antialiasing]) -> Vec<Way> {
    let settings = grids.iter().flat_map(Grid::settings).map(Way::Flatray);
    let all = settings.chain(antialiasing.iter().map(|&antialiasing| Way::Povray(antialiasing)));
    all.fold(Vec::new(), |mut ways, way| {
        if !ways.contains(&way) {
            ways.push(way);
        }
        ways
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grid_is_the_product_of_its_lists_and_every_way_stands_once() {
        let grid = Grid {
            samples: vec![1, 4],
            samplers: vec![Sampler::Jitter, Sampler::Sobol],
            errors: vec![1e-3],
            cutoffs: vec![0.0, 1e-3],
            ..Grid::default()
        };
        let names: Vec<String> = ways(&[grid.clone(), grid], &[]).iter().map(Way::name).collect();
        let expected = [
            "center 1 cutoff 0e0",
            "center 1 cutoff 1e-3",
            "jitter 4 cutoff 0e0",
            "jitter 4 cutoff 1e-3",
            "sobol 4 cutoff 0e0",
            "sobol 4 cutoff 1e-3",
            "adaptive 1e-3 cutoff 0e0",
            "adaptive 1e-3 cutoff 1e-3",
        ];
        assert_eq!(names, expected);
    }

    #[test]
    fn the_default_grids_hold_what_the_scene_can_show() {
        let names = |n_prims, max_depth| -> Vec<String> {
            ways(&default_grids(n_prims, max_depth), &default_antialiasing()).iter().map(Way::name).collect()
        };
        let small = names(10, 5);
        for name in ["center 1", "sobol 256", "random 4", "adaptive 1e-3", "sobol 16 linear", "sobol 16 depth 2"] {
            assert!(small.iter().any(|other| other == name), "{name} in {small:?}");
        }
        let large = names(1_000_000, 1);
        assert!(!large.iter().any(|name| name.contains("linear") || name.contains("depth 2")));
    }
}
