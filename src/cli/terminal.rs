//! The two streams of the process. Everything the program prints goes through here.

use std::io::{self, IsTerminal, Write};
use std::path::Path;

use crate::error::{Error, Place};

/// Writes to standard output. A reader that has gone away (`flatray info … | head`) is no failure.
///
/// # Errors
/// When the stream cannot be written for any other reason, for example because the disk is full.
pub fn print(text: &str) -> Result<(), Error> {
    let mut stdout = io::stdout().lock();
    match stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(Error::new(Place::default(), format!("cannot write to standard output: {error}")))
        }
        _ => Ok(()),
    }
}

/// Writes to standard error. If that fails there is nobody left to tell.
pub fn print_error(text: &str) {
    let _ = io::stderr().lock().write_all(text.as_bytes());
}

/// Whether standard error is a screen that understands cursor movement.
pub fn stderr_is_terminal() -> bool {
    io::stderr().is_terminal() && std::env::var_os("TERM").is_none_or(|term| term != "dumb")
}

/// Whether messages on standard error are coloured: on a terminal, unless `NO_COLOR` is set (no-color.org).
pub fn stderr_is_coloured() -> bool {
    stderr_is_terminal() && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty())
}

/// A path as it is shown: control characters in names must not reach the terminal.
pub fn shown(path: &Path) -> String {
    path.to_string_lossy().chars().map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect()
}
