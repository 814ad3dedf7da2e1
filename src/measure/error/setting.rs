//! One way to render a frame: what a run is named and told apart by.

use crate::accel::{AccelKind, Preset};
use crate::measure::povray::Antialiasing;
use crate::render::{Sampler, Settings};
use crate::simd::Isa;

/// A way to render, by one engine.
#[derive(Clone, Debug, PartialEq)]
pub enum Way {
    /// flatray's.
    Flatray(Setting),
    /// POV-Ray's.
    Povray(Antialiasing),
}

/// How flatray renders. What is `None` is as the frame has it.
#[derive(Clone, Debug, PartialEq)]
pub struct Setting {
    /// What decides the error and the time.
    pub amount: Amount,
    /// Longest chain of rays.
    pub max_depth: Option<u32>,
    /// Contribution cut-off.
    pub cutoff: Option<f64>,
    /// How hits are found.
    pub accel: AccelKind,
    /// What is spent on the tree.
    pub preset: Preset,
    /// Instruction set; the fastest unless said.
    pub isa: Option<Isa>,
}

/// How much is sampled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Amount {
    /// The same in every pixel.
    Samples {
        /// Where samples lie.
        sampler: Sampler,
        /// Samples per pixel.
        samples: u32,
    },
    /// As much as it takes for an estimated root mean square error.
    Error(f64),
}

impl Setting {
    /// An amount, everything else as the frame has it.
    pub fn of(amount: Amount) -> Setting {
        // A single sample is the pixel's centre, whatever the sampler.
        let amount = match amount {
            Amount::Samples { samples, sampler } if samples == 1 || sampler == Sampler::Center => {
                Amount::Samples { sampler: Sampler::Center, samples: 1 }
            }
            other => other,
        };
        Setting { amount, max_depth: None, cutoff: None, accel: AccelKind::Bvh, preset: Preset::default(), isa: None }
    }

    /// What runs of one curve have in common: all but how much is sampled.
    pub fn family(&self) -> String {
        let base = match self.amount {
            Amount::Samples { sampler, .. } => sampler.name(),
            Amount::Error(_) => "adaptive",
        };
        base.to_owned() + &self.variant()
    }

    /// The name: all that differs from the frame's own settings.
    pub fn name(&self) -> String {
        let base = match self.amount {
            Amount::Samples { sampler, samples } => format!("{} {samples}", sampler.name()),
            Amount::Error(target) => format!("adaptive {target:e}"),
        };
        base + &self.variant()
    }

    fn variant(&self) -> String {
        let mut text = String::new();
        if let Some(max_depth) = self.max_depth {
            text.push_str(&format!(" depth {max_depth}"));
        }
        if let Some(cutoff) = self.cutoff {
            text.push_str(&format!(" cutoff {cutoff:e}"));
        }
        match self.accel {
            AccelKind::Linear => text.push_str(" linear"),
            AccelKind::Bvh if self.preset != Preset::default() => {
                text.push_str(&format!(" bvh {}", self.preset.name()))
            }
            AccelKind::Bvh => {}
        }
        if let Some(isa) = self.isa {
            text.push_str(&format!(" isa {}", isa.name()));
        }
        text
    }

    /// The settings of a render by this way, on the base of the frame's.
    pub fn applied(&self, frame: &Settings, seed: u64) -> Settings {
        let mut settings = frame.clone();
        if let Amount::Samples { sampler, samples } = self.amount {
            (settings.sampler, settings.samples) = (sampler, samples);
        }
        settings.seed = seed;
        settings.max_depth = self.max_depth.unwrap_or(frame.max_depth);
        settings.cutoff = self.cutoff.unwrap_or(frame.cutoff);
        settings
    }
}

impl Way {
    /// `flatray` or `povray`.
    pub fn engine(&self) -> &'static str {
        match self {
            Way::Flatray(_) => "flatray",
            Way::Povray(_) => "povray",
        }
    }

    /// As [`Setting::name`].
    pub fn name(&self) -> String {
        match self {
            Way::Flatray(setting) => setting.name(),
            Way::Povray(antialiasing) => antialiasing.name(),
        }
    }

    /// As [`Setting::family`], with the engine where it is not flatray.
    pub fn family(&self) -> String {
        match self {
            Way::Flatray(setting) => setting.family(),
            Way::Povray(antialiasing) => antialiasing.family(),
        }
    }

    /// Samples per pixel, where the way says.
    pub fn samples(&self) -> Option<u32> {
        match self {
            Way::Flatray(Setting { amount: Amount::Samples { samples, .. }, .. }) => Some(*samples),
            Way::Flatray(_) => None,
            Way::Povray(antialiasing) => antialiasing.samples(),
        }
    }

    /// The error that is asked for, where the way says.
    pub fn target(&self) -> Option<f64> {
        match self {
            Way::Flatray(Setting { amount: Amount::Error(target), .. }) => Some(*target),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_says_all_that_differs_and_a_family_all_but_the_amount() {
        let sixteen = Setting::of(Amount::Samples { sampler: Sampler::Sobol, samples: 16 });
        assert_eq!((sixteen.name(), sixteen.family()), ("sobol 16".into(), "sobol".into()));
        let varied = Setting { max_depth: Some(2), cutoff: Some(0.0), preset: Preset::High, ..sixteen.clone() };
        assert_eq!(varied.name(), "sobol 16 depth 2 cutoff 0e0 bvh high");
        assert_eq!(varied.family(), "sobol depth 2 cutoff 0e0 bvh high");
        let linear = Setting { accel: AccelKind::Linear, isa: Some(Isa::Baseline), ..Setting::of(Amount::Error(1e-3)) };
        assert_eq!(
            (linear.name(), linear.family().as_str()),
            ("adaptive 1e-3 linear isa baseline".into(), "adaptive linear isa baseline")
        );
    }

    #[test]
    fn one_sample_of_any_sampler_is_the_centre() {
        for sampler in Sampler::ALL {
            assert_eq!(Setting::of(Amount::Samples { sampler, samples: 1 }).name(), "center 1");
        }
        assert_eq!(Setting::of(Amount::Samples { sampler: Sampler::Center, samples: 9 }).name(), "center 1");
    }
}
