//! `--settings FILE`: which ways are compared, as TOML.

use std::path::Path;

use super::grid::Grid;
use crate::accel::{AccelKind, Preset};
use crate::error::{Error, Place, Problem};
use crate::measure::povray::{self, Antialiasing};
use crate::render::Sampler;
use crate::scene::report::Report;
use crate::scene::toml::{Table, walk};
use crate::scene::validate::NumberRule;
use crate::simd::Isa;

/// Longest file that is read, in bytes; and most ways that one may ask for.
const MAX_BYTES: usize = 1 << 20;
const MAX_WAYS: usize = 10_000;

const TARGET: NumberRule =
    NumberRule { expected: "root mean square errors from 1e-6 to 1", holds: |x| (1e-6..=1.0).contains(&x) };
const CUTOFF: NumberRule = NumberRule { expected: "radiances from 0 to 1", holds: |x| (0.0..=1.0).contains(&x) };
const THRESHOLD: NumberRule = NumberRule { expected: "thresholds above 0, at most 3", holds: |x| x > 0.0 && x <= 3.0 };

/// What a file asks for.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Asked {
    /// `[[grid]]`, flatray's ways.
    pub grids: Vec<Grid>,
    /// `[[povray]]`.
    pub antialiasing: Vec<Antialiasing>,
}

/// Reads a file.
///
/// # Errors
/// Everything that is wrong with it, by line and column.
pub fn read(path: &Path) -> Result<Asked, Error> {
    let bytes = std::fs::read(path).map_err(|error| Error::io(path, "read the settings", &error))?;
    if bytes.len() > MAX_BYTES {
        let problem = Problem::new(Place::file(path), "the file of settings is too long");
        return Err(problem.found(format!("{} bytes", bytes.len())).expected(format!("at most {MAX_BYTES}")).into());
    }
    let text = String::from_utf8(bytes)
        .map_err(|error| Error::new(Place::byte(path, error.utf8_error().valid_up_to() as u64), "not UTF-8 text"))?;
    parse(&text, path)
}

/// Reads a text; `path` is what messages call it.
///
/// # Errors
/// As [`read`].
pub fn parse(text: &str, path: &Path) -> Result<Asked, Error> {
    let report = Report::new(path, text);
    let asked = walk(text, &report, |mut root| {
        let asked = Asked {
            grids: root.tables("grid").into_iter().map(grid).collect(),
            antialiasing: root.tables("povray").into_iter().flat_map(antialiasing).collect(),
        };
        root.finish();
        asked
    });
    report.finish()?;
    let n_ways = asked.grids.iter().map(Grid::len).fold(asked.antialiasing.len(), usize::saturating_add);
    if n_ways == 0 || n_ways > MAX_WAYS {
        return Err(Problem::new(Place::file(path), "the file asks for no or too many settings")
            .found(n_ways)
            .expected(format!("1 to {MAX_WAYS}, under [[grid]] and [[povray]]"))
            .into());
    }
    Ok(asked)
}

fn grid(mut table: Table<'_>) -> Grid {
    let accels = [("bvh", AccelKind::Bvh), ("linear", AccelKind::Linear)];
    let presets = [("fast", Preset::Fast), ("medium", Preset::Medium), ("high", Preset::High)];
    let isas = Isa::ALL.map(|isa| (isa.name(), isa));
    let samplers = Sampler::ALL.map(|sampler| (sampler.name(), sampler));
    let grid = Grid {
        samples: whole(&mut table, "samples", 1..=65_536, "whole numbers from 1 to 65536"),
        samplers: table.words("sampler", &samplers).unwrap_or_default(),
        errors: table.numbers("error", &TARGET).unwrap_or_default(),
        max_depths: whole(&mut table, "max_depth", 1..=1000, "whole numbers from 1 to 1000"),
        cutoffs: table.numbers("cutoff", &CUTOFF).unwrap_or_default(),
        accels: table.words("accel", &accels).unwrap_or_default(),
        presets: table.words("bvh", &presets).unwrap_or_default(),
        isas: table.words("isa", &isas).unwrap_or_default(),
    };
    if !["samples", "error"].into_iter().any(|key| table.has(key)) {
        table.require("samples", "samples per pixel, or `error`, errors to reach");
    }
    if let Some(missing) = grid.isas.iter().find(|isa| !isa.is_available()) {
        table.mistake(
            "isa",
            Problem::new(Place::default(), "this processor lacks an instruction set").found(missing.name()),
        );
    }
    table.finish();
    grid
}

/// Whole numbers in a range, as one or several.
fn whole(table: &mut Table<'_>, key: &'static str, range: std::ops::RangeInclusive<u64>, expected: &str) -> Vec<u32> {
    let numbers = table.integers(key, range, expected).unwrap_or_default();
    // The ranges end far below 2^32.
    numbers.into_iter().map(|n| n as u32).collect()
}

fn antialiasing(mut table: Table<'_>) -> Vec<Antialiasing> {
    const MAX: u64 = povray::MAX_DEPTH as u64;
    let grids = whole(&mut table, "grid", 1..=MAX, "whole numbers from 1 to 9, samples along an edge of the pixel");
    let thresholds = table.numbers("threshold", &THRESHOLD).unwrap_or_default();
    let depths = whole(&mut table, "depth", 1..=MAX, "whole numbers from 1 to 9, how often a pixel is halved");
    if table.has("threshold") != table.has("depth") {
        table.require("threshold", "thresholds of adaptive antialiasing, beside `depth`");
        table.require("depth", "how often a pixel is halved, beside `threshold`");
    }
    table.finish();
    let uniform = grids.into_iter().map(|grid| Antialiasing::Uniform { grid });
    let adaptive = thresholds
        .iter()
        .flat_map(|&threshold| depths.iter().map(move |&depth| Antialiasing::Adaptive { threshold, depth }));
    uniform.chain(adaptive).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wrong(text: &str) -> String {
        parse(text, Path::new("s.toml")).unwrap_err().to_string()
    }

    #[test]
    fn a_file_of_grids_is_read() {
        let text = "[[grid]]\nsamples = [4, 16]\nsampler = [\"sobol\", \"jitter\"]\ncutoff = [0, 1e-3]\n\
                    [[grid]]\nerror = 1e-3\nbvh = [\"high\"]\n[[povray]]\ngrid = 3\nthreshold = [0.1, 0.01]\ndepth = [3]\n";
        let asked = parse(text, Path::new("s.toml")).unwrap();
        let first = &asked.grids[0];
        assert_eq!(
            (first.samples.as_slice(), first.samplers.as_slice()),
            (&[4, 16][..], &[Sampler::Sobol, Sampler::Jitter][..])
        );
        assert_eq!((first.cutoffs.as_slice(), asked.grids[1].errors.as_slice()), (&[0.0, 1e-3][..], &[1e-3][..]));
        let adaptive = |threshold| Antialiasing::Adaptive { threshold, depth: 3 };
        assert_eq!(asked.antialiasing, [Antialiasing::Uniform { grid: 3 }, adaptive(0.1), adaptive(0.01)]);
    }

    #[test]
    fn mistakes_are_told_by_line_and_column() {
        let unknown = wrong("[[grid]]\nsamples = [4]\nmax_deph = [2]\n");
        assert!(
            unknown.contains("s.toml:3:1: grid[0].max_deph: unknown key") && unknown.contains("`max_depth`"),
            "{unknown}"
        );
        let range = wrong("[[grid]]\nsamples = [4, 0]\n");
        assert!(range.contains("s.toml:2:15: grid[0].samples[1]: value out of range: found 0"), "{range}");
        assert!(wrong("[[grid]]\nerror = [2.0]\n").contains("grid[0].error[0]"));
        assert!(wrong("[[grid]]\nsampler = [\"sobol\"]\n").contains("missing key"));
        assert!(wrong("[[povray]]\nthreshold = 0.1\n").contains("depth: missing key"));
        assert!(wrong("").contains("no or too many settings"));
        assert!(wrong("[[grid]]\nsamples = [4\n").contains("not valid TOML"));
    }

    #[test]
    fn more_settings_than_anybody_can_wait_for_are_refused() {
        let many = (1..=200).map(|n| n.to_string()).collect::<Vec<_>>().join(",");
        let text = format!("[[grid]]\nsamples = [{many}]\nmax_depth = [{many}]\n");
        assert!(wrong(&text).contains("found 40000"), "{}", wrong(&text));
    }
}
