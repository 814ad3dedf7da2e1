//! The command line: arguments, progress, summaries, exit codes. All printing lives here.
//!
//! | room | does |
//! |---|---|
//! | `args`, `aov_args`, `exr_args`, `frame_args`, `picture_args`, `value` | what may be said, and how it is read |
//! | `render`, `info`, `diff`, `tonemap`, `merge`, `stress`, `bench`, `reference` | one command each; `throughput` and `error` are of `bench` |
//! | `plan`, `budget`, `output`, `heatmap`, `exr_attributes` | what a render will do and write, settled before it starts |
//! | `progress`, `watch`, `stats`, `info_text`, `throughput_text`, `error_text`, `quantity` | what is shown |
//! | `diagnostic`, `terminal` | how problems look, and where text goes |
//! | `files` | where the library reads and writes files |
//! | `interrupt`, `memory` | signals, and what the machine has |
//! | `failure` | exit codes |

mod aov_args;
mod args;
mod bench;
mod budget;
mod diagnostic;
mod diff;
mod error;
mod error_text;
mod exr_args;
mod exr_attributes;
mod failure;
mod files;
mod frame_args;
mod heatmap;
mod info;
mod info_text;
mod interrupt;
mod memory;
mod merge;
mod output;
mod picture_args;
mod plan;
mod progress;
mod quantity;
mod reference;
mod render;
mod stats;
mod stress;
mod terminal;
mod throughput;
mod throughput_text;
mod tonemap;
mod value;
mod watch;

use std::process::ExitCode;

use clap::Parser;

use args::{Cli, Command, RenderArgs};
use failure::Failure;

/// Runs the command line of this process: 0 success, 1 failure, 2 wrong usage, 130 interrupted.
pub fn main() -> ExitCode {
    let (result, outcome) = match Cli::try_parse() {
        Err(error) => (Err(Failure::Usage(error)), ""),
        Ok(Cli { command: None }) => (render::run(&RenderArgs::default()), "nothing was rendered"),
        Ok(Cli { command: Some(Command::Render(args)) }) => (render::run(&args), "nothing was rendered"),
        Ok(Cli { command: Some(Command::Info(args)) }) => (info::run(&args), "nothing to tell"),
        Ok(Cli { command: Some(Command::Diff(args)) }) => (diff::run(&args), "nothing was compared"),
        Ok(Cli { command: Some(Command::Tonemap(args)) }) => (tonemap::run(&args), "nothing was written"),
        Ok(Cli { command: Some(Command::Merge(args)) }) => (merge::run(&args), "nothing was written"),
        Ok(Cli { command: Some(Command::Stress(args)) }) => (stress::run(&args), "nothing was tested"),
        Ok(Cli { command: Some(Command::Bench(args)) }) => (bench::run(&args), "nothing was measured"),
        Ok(Cli { command: Some(Command::Reference(args)) }) => (reference::run(&args), "nothing was rendered"),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => ExitCode::from(failure.report(outcome)),
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn every_option_of_the_agreed_interface_is_accepted() {
        let line = "flatray render scene.toml -o a.exr -o a.png --width 10 --height 20 --samples 4 --sampler grid \
                    --seed 7 --max-depth 3 --fov 45.5 --up z --threads 2 --tile-size 8 --crop 0,0,5,5 --exposure -1.5 \
                    --accel linear --stats s.json --quiet";
        let cli = Cli::try_parse_from(line.split_whitespace()).unwrap();
        let Some(Command::Render(args)) = cli.command else { panic!() };
        assert_eq!(args.outputs.len(), 2);
        assert_eq!((args.picture.exposure, args.fov, args.seed), (Some(-1.5), Some(45.5), Some(7)));
        assert!(Cli::try_parse_from(["flatray", "render", "--compat", "course"]).is_ok());
        assert!(Cli::try_parse_from(["flatray"]).unwrap().command.is_none());
    }
}
