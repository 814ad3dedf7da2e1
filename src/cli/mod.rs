//! The command line: arguments, progress, summaries, exit codes. All printing lives here.

use std::process::ExitCode;

/// Runs the command line of this process.
pub fn main() -> ExitCode {
    ExitCode::SUCCESS
}
