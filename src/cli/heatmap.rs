//! `--heatmap`: a picture of where the work went, beside the outputs.

use std::io;
use std::path::PathBuf;

use clap::ValueEnum;

use super::output::Output;
use super::quantity;
use crate::film::output::WriteSeek;
use crate::film::{Film, png};
use crate::measure::cost_map::CostMap;

/// What to make a picture of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum HeatmapArg {
    /// Nodes and leaves visited for each pixel
    Cost,
}

/// A picture to be written.
pub struct Heatmap {
    /// The picture.
    pub map: CostMap,
    /// Where it goes.
    pub path: PathBuf,
}

/// Where it goes: beside the first output and named after it.
pub fn path_of(asked: Option<HeatmapArg>, outputs: &[Output]) -> Option<PathBuf> {
    let HeatmapArg::Cost = asked?;
    Some(outputs.first()?.path.with_extension("cost.png"))
}

impl Heatmap {
    /// The picture of a finished film, if there is to be one.
    pub fn new(film: &Film, path: Option<PathBuf>) -> Option<Heatmap> {
        let path = path?;
        Some(Heatmap { map: CostMap::new(film)?, path })
    }

    /// A line of the summary: what its colours mean.
    pub fn summary(&self) -> String {
        let brightest = quantity::count(self.map.brightest as u64);
        format!("cost    from none, black, to {brightest} nodes and leaves a pixel, the brightest colour\n")
    }
}

/// Writes the picture as a PNG.
///
/// # Errors
/// What `out` answers.
pub fn write(map: &CostMap, out: &mut dyn WriteSeek) -> io::Result<()> {
    png::write(&map.picture, &CostMap::display(), out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::output::Format;

    #[test]
    fn the_picture_stands_beside_the_first_output() {
        let output = |path: &str| Output { format: Format::of_path(path).unwrap(), path: path.into() };
        let outputs = [output("out/a.b.exr"), output("c.png")];
        assert_eq!(path_of(Some(HeatmapArg::Cost), &outputs), Some("out/a.b.cost.png".into()));
        assert_eq!(path_of(None, &outputs), None);
    }
}
