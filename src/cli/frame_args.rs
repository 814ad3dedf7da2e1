//! Options that say what frame is rendered, of the commands that render one frame many times or very well.

use std::ffi::OsString;
use std::path::Path;

use clap::{Args, ValueEnum, value_parser};

use super::args::{FilterArg, RenderArgs, UpArg};
use super::value;

/// What frame is rendered.
#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = "Frame")]
pub struct FrameArgs {
    /// Width of the image in pixels
    #[arg(long, value_name = "PX", value_parser = value_parser!(u32).range(1..=65_535))]
    pub width: Option<u32>,
    /// Height of the image in pixels
    #[arg(long, value_name = "PX", value_parser = value_parser!(u32).range(1..=65_535))]
    pub height: Option<u32>,
    /// Vertical field of view in degrees
    #[arg(long, value_name = "DEG", value_parser = value::fov_degrees)]
    pub fov: Option<f64>,
    /// The axis of a mesh file that points up [default: y]
    #[arg(long, value_name = "AXIS")]
    pub up: Option<UpArg>,
    /// Longest chain of rays, the camera ray being 1 [default: 5]
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..=1000))]
    pub max_depth: Option<u32>,
    /// How samples are weighted [default: box]
    #[arg(long, value_name = "FILTER")]
    pub filter: Option<FilterArg>,
    /// Correct the shadow terminator of coarse smooth meshes
    #[arg(long)]
    pub terminator: bool,
    /// Seed of all that is random [default: 0]
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
    /// Worker threads [default: all cores]
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..=1024))]
    pub threads: Option<u32>,
}

impl FrameArgs {
    /// The same as arguments of `flatray render`.
    pub fn render_args(&self, input: Option<&Path>) -> RenderArgs {
        RenderArgs {
            input: input.map(Path::to_path_buf),
            width: self.width,
            height: self.height,
            fov: self.fov,
            up: self.up,
            max_depth: self.max_depth,
            filter: self.filter,
            terminator: self.terminator.then_some(true),
            seed: self.seed,
            threads: self.threads,
            quiet: true,
            ..RenderArgs::default()
        }
    }

    /// The same as words of its command line, but for the seed, which runs choose.
    pub fn words(&self, input: Option<&Path>, threads: usize) -> Vec<OsString> {
        let mut words: Vec<OsString> = input.map(Into::into).into_iter().collect();
        let name = |value: Option<clap::builder::PossibleValue>| value.map(|value| value.get_name().to_owned());
        let options = [
            ("--width", self.width.map(|n| n.to_string())),
            ("--height", self.height.map(|n| n.to_string())),
            ("--fov", self.fov.map(|degrees| format!("{degrees:e}"))),
            ("--up", name(self.up.and_then(|up| up.to_possible_value()))),
            ("--max-depth", self.max_depth.map(|n| n.to_string())),
            ("--filter", name(self.filter.and_then(|filter| filter.to_possible_value()))),
            ("--threads", Some(threads.to_string())),
        ];
        for (option, value) in options {
            words.extend(value.into_iter().flat_map(|value| [option.into(), value.into()]));
        }
        if self.terminator {
            words.push("--terminator".into());
        }
        words
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::super::args::{Cli, Command};
    use super::*;

    #[test]
    fn the_words_say_what_the_arguments_are() {
        let args = FrameArgs {
            width: Some(30),
            height: Some(20),
            fov: Some(45.5),
            up: Some(UpArg::Z),
            max_depth: Some(3),
            filter: Some(FilterArg::BlackmanHarris),
            terminator: true,
            seed: Some(9),
            threads: Some(2),
        };
        let input = Path::new("a.ply");
        let line = ["flatray", "render"].map(OsString::from).into_iter().chain(args.words(Some(input), 2));
        let Some(Command::Render(parsed)) = Cli::try_parse_from(line).unwrap().command else { panic!("render") };
        let wanted = RenderArgs { seed: None, quiet: false, ..args.render_args(Some(input)) };
        assert_eq!(format!("{parsed:?}"), format!("{wanted:?}"));
    }
}
