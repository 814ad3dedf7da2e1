//! Why a command ended without success, and the exit code that says so.

use super::{diagnostic, terminal};
use crate::error::Error;

/// The ways to end without success.
#[derive(Debug)]
pub enum Failure {
    /// The command line is wrong. Exit code 2.
    Usage(clap::Error),
    /// Anything that went wrong with files, memory or the machine. Exit code 1.
    Error(Error),
    /// An image is over a limit; the command has already said so. Exit code 1.
    OverLimit,
    /// The user asked to stop. Exit code 130, as a shell reports SIGINT.
    Interrupted,
}

impl Failure {
    /// Wrong usage of a command, in the words and form of clap's own messages.
    pub fn usage(command: &str, kind: clap::error::ErrorKind, message: impl std::fmt::Display) -> Failure {
        let mut root = <super::args::Cli as clap::CommandFactory>::command();
        root.build();
        let error = match root.find_subcommand_mut(command) {
            Some(subcommand) => subcommand.error(kind, message),
            None => root.error(kind, message),
        };
        Failure::Usage(error)
    }

    /// Tells the user and returns the exit code. `outcome` completes the count of problems: `nothing was rendered`.
    pub fn report(self, outcome: &str) -> u8 {
        match self {
            Failure::Usage(error) => {
                let code = error.exit_code();
                let _ = error.print();
                u8::try_from(code).unwrap_or(2)
            }
            Failure::Error(error) => {
                terminal::print_error(&diagnostic::errors(&error, outcome, terminal::stderr_is_coloured()));
                1
            }
            Failure::OverLimit => 1,
            Failure::Interrupted => {
                terminal::print_error("interrupted\n");
                130
            }
        }
    }
}

impl From<Error> for Failure {
    fn from(error: Error) -> Failure {
        Failure::Error(error)
    }
}
