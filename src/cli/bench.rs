//! `flatray bench`: one file per benchmark.

use super::failure::Failure;
use super::{error, throughput};

/// Arguments of `flatray bench`.
#[derive(clap::Args, Clone, Debug)]
pub struct Args {
    /// What to measure
    #[command(subcommand)]
    pub benchmark: Benchmark,
}

/// The benchmarks.
#[derive(clap::Subcommand, Clone, Debug)]
pub enum Benchmark {
    /// Rays per second, build time and memory, beside Embree's if asked for
    Throughput(Box<throughput::Args>),
    /// Run time against error, beside POV-Ray's if asked for
    Error(Box<error::Args>),
}

/// Runs the command.
///
/// # Errors
/// As the benchmark.
pub fn run(args: &Args) -> Result<(), Failure> {
    match &args.benchmark {
        Benchmark::Throughput(args) => throughput::run(args),
        Benchmark::Error(args) => error::run(args),
    }
}
