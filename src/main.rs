//! The `flatray` command: arguments in, exit code out; nothing else.

use std::process::ExitCode;

fn main() -> ExitCode {
    flatray::cli::main()
}
