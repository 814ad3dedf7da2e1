//! POV-Ray 3.7 as a peer: the same frame in its language, rendered by its program.
//!
//! | room | does |
//! |---|---|
//! | `export` | a frame as a scene of POV-Ray |
//! | `material` | materials, lights and camera among it |
//! | `program` | the program, run on it |
//!
//! The two agree pixel by pixel where this model is expressed (`docs/ERROR.md`); what cannot be is refused by name.

pub mod export;
mod material;
pub mod program;

/// How POV-Ray spreads its samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Antialiasing {
    /// `grid`² jittered samples in every pixel (`+AM1 +A0.0 +Rn +J1.0`); one sample is the pixel's centre, without antialiasing.
    Uniform {
        /// Samples along an edge of the pixel, from 1 to [`MAX_DEPTH`].
        grid: u32,
    },
    /// Pixels are halved where their corners differ by more than a threshold (`+AM2 +At +Rn +J1.0`).
    Adaptive {
        /// Sum of the differences of red, green and blue.
        threshold: f64,
        /// How often a pixel is halved at most, from 1 to [`MAX_DEPTH`].
        depth: u32,
    },
}

impl Antialiasing {
    /// A name of its own.
    pub fn name(&self) -> String {
        match self {
            Antialiasing::Uniform { grid } => format!("povray am1 {}", grid * grid),
            Antialiasing::Adaptive { threshold, depth } => format!("povray am2 {threshold} r{depth}"),
        }
    }

    /// `povray am1` or `povray am2`.
    pub fn family(&self) -> String {
        match self {
            Antialiasing::Uniform { .. } => "povray am1".to_owned(),
            Antialiasing::Adaptive { .. } => "povray am2".to_owned(),
        }
    }

    /// Samples per pixel, where they are the same in all.
    pub fn samples(&self) -> Option<u32> {
        match self {
            Antialiasing::Uniform { grid } => Some(grid * grid),
            Antialiasing::Adaptive { .. } => None,
        }
    }

    /// The options of the program.
    pub fn options(&self) -> Vec<String> {
        // A whole number would not be understood as a threshold. Differences are judged, and samples averaged, in linear light.
        let common = |method: &str, threshold: f64, depth: u32| {
            let options = [method, &format!("+A{threshold:?}"), &format!("+R{depth}"), "+J1.0", "Antialias_Gamma=1.0"];
            options.map(str::to_owned).into()
        };
        match *self {
            Antialiasing::Uniform { grid: 1 } => vec!["-A".to_owned(), "-J".to_owned()],
            Antialiasing::Uniform { grid } => common("+AM1", 0.0, grid),
            Antialiasing::Adaptive { threshold, depth } => common("+AM2", threshold, depth),
        }
    }
}

/// The largest grid and depth: POV-Ray takes what is above for it, without a word.
pub const MAX_DEPTH: u32 = 9;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thresholds_are_written_as_povray_reads_them() {
        let options = |antialiasing: Antialiasing| antialiasing.options().join(" ");
        assert_eq!(options(Antialiasing::Uniform { grid: 1 }), "-A -J");
        assert_eq!(options(Antialiasing::Uniform { grid: 3 }), "+AM1 +A0.0 +R3 +J1.0 Antialias_Gamma=1.0");
        let adaptive = Antialiasing::Adaptive { threshold: 1.0, depth: 4 };
        assert_eq!(options(adaptive), "+AM2 +A1.0 +R4 +J1.0 Antialias_Gamma=1.0");
    }
}
