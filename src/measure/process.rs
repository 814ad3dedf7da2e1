//! Programs run for their time: whole processes, from their start to their end.

use std::io::{self, Read};
use std::path::PathBuf;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use crate::error::{Error, Place, Problem};
use crate::render::{Control, Stopped};

/// How often a process is looked after. It is noticed that late that one has ended.
const POLL_INTERVAL: Duration = Duration::from_micros(200);

/// Why a process gave nothing.
#[derive(Debug)]
pub enum Ended {
    /// It was asked to stop.
    Stopped,
    /// Anything else.
    Failed(Error),
}

impl From<Error> for Ended {
    fn from(error: Error) -> Ended {
        Ended::Failed(error)
    }
}

impl From<Stopped> for Ended {
    fn from(_: Stopped) -> Ended {
        Ended::Stopped
    }
}

/// Runs a process to its end and says how many seconds it took; its output is kept for the message should it fail.
///
/// # Errors
/// A process that cannot be started, fails, or is stopped by `control`.
pub fn run(command: &mut Command, control: &Control) -> Result<f64, Ended> {
    let program = PathBuf::from(command.get_program());
    let cannot = |doing: &str, error: &io::Error| Ended::Failed(Error::io(&program, doing, error));
    // What it says goes to a file: a pipe that nobody empties would stop it.
    let mut said = tempfile::tempfile().map_err(|error| cannot("make a temporary file", &error))?;
    let stderr = said.try_clone().map_err(|error| cannot("make a temporary file", &error))?;
    let started = Instant::now();
    let mut child = command
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(stderr)
        .spawn()
        .map_err(|error| cannot("start the program", &error))?;
    let status = wait(&mut child, control).map_err(|error| cannot("wait for the program", &error))?;
    let seconds = started.elapsed().as_secs_f64();
    match status {
        Some(status) if status.success() => Ok(seconds),
        Some(_) if stops_soon(control) => Err(Ended::Stopped),
        Some(status) => {
            let mut text = Vec::new();
            let read = io::Seek::rewind(&mut said).and_then(|()| said.read_to_end(&mut text));
            let last = read.map(|_| last_lines(&String::from_utf8_lossy(&text))).unwrap_or_default();
            let problem = Problem::new(Place::file(&program), format!("the program failed: {status}"));
            Err(Ended::Failed(problem.found(last).into()))
        }
        None => Err(Ended::Stopped),
    }
}

/// Waits for the end; `None` when the process was ended because a stop was asked for.
fn wait(child: &mut Child, control: &Control) -> io::Result<Option<ExitStatus>> {
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok((!control.stop.load(Ordering::Relaxed)).then_some(status));
        }
        if control.stop.load(Ordering::Relaxed) {
            child.kill()?;
            child.wait()?;
            return Ok(None);
        }
        std::thread::sleep(POLL_INTERVAL);
    }
}

/// How long a stop may come after the end of a program that the same interrupt has ended.
const STOP_DELAY: Duration = Duration::from_millis(200);

/// Whether a stop is asked for, or about to be.
fn stops_soon(control: &Control) -> bool {
    let is_stopped = || control.stop.load(Ordering::Relaxed);
    if !is_stopped() {
        std::thread::sleep(STOP_DELAY);
    }
    is_stopped()
}

/// The last of what a program said.
fn last_lines(text: &str) -> String {
    const LINES: usize = 6;
    let lines: Vec<&str> = text.lines().map(str::trim).filter(|line| !line.is_empty()).collect();
    lines[lines.len().saturating_sub(LINES)..].join(" | ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_that_a_program_said_is_kept_short() {
        let text: String = (0..20).map(|line| format!("line {line}\n\n")).collect();
        assert_eq!(last_lines(&text), "line 14 | line 15 | line 16 | line 17 | line 18 | line 19");
    }

    #[cfg(unix)]
    #[test]
    fn a_process_is_timed_stopped_or_heard() {
        let control = Control::default();
        assert!(run(Command::new("sleep").arg("0.05"), &control).is_ok_and(|seconds| seconds >= 0.05));
        let Err(Ended::Failed(error)) = run(Command::new("sh").args(["-c", "echo why >&2; exit 3"]), &control) else {
            panic!("a failure");
        };
        assert!(error.to_string().contains("exit status: 3") && error.to_string().contains("why"), "{error}");
        control.request_stop();
        assert!(matches!(run(Command::new("sleep").arg("60"), &control), Err(Ended::Stopped)));
    }
}
