//! `flatray stress`: the kernels against exact arithmetic, suite by suite.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use clap::error::ErrorKind;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::failure::Failure;
use super::{files, quantity, terminal};
use crate::measure::stress::case::Replay;
use crate::measure::stress::replay::replay;
use crate::measure::stress::tally::Textbook;
use crate::measure::stress::{SUITES, Suite, Tally, share_out};

const EXAMPLES: &str = "\
Examples:
  flatray stress                            All suites, about a minute
  flatray stress --suite sphere --suite quadric --count 1e7
  flatray stress --json stress.json
  flatray stress --replay 'sphere#17 seed=1 o=0x1p+1,0x0p+0,0x0p+0 d=… prim=sphere(…)'

Columns: cases; wrong hits or misses; t in f64 ulps, p in ulps of the largest coordinate involved,
n absolute: the worst errors seen; exact: primitive tests per case that needed exact arithmetic;
wrong answers of the textbook formulas in f32 to the same questions (of terminator: points that
are black without the correction).

Keys of --json: seed, seconds, suites [{name, about, cases, wrong, inaccurate, judged, max_ulp_t,
max_ulp_t_f32, max_ulp_p, max_err_n, exact_tests, exact_share, naive_f32 {cases, wrong},
moller_trumbore_f32 {cases, wrong}, failures [text], seconds}].

Exit codes: 0 nothing is wrong, 1 something is, 2 wrong usage, 130 interrupted.";

/// Cases of a run unless told otherwise: about a minute on two cores.
const DEFAULT_COUNT: u64 = 5_000_000;

/// Arguments of `flatray stress`.
#[derive(clap::Args, Clone, Debug)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Run only this suite; repeat for several
    #[arg(long = "suite", value_name = "NAME", value_parser = SUITES.map(|suite| suite.name))]
    pub suites: Vec<String>,

    /// Cases over all suites that run, such as 1e8
    #[arg(long, value_name = "N", default_value_t = DEFAULT_COUNT, value_parser = count)]
    pub count: u64,

    /// Seed: the same seed gives the same cases
    #[arg(long, value_name = "S", default_value_t = 1)]
    pub seed: u64,

    /// Write the figures as JSON
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,

    /// Run one failing case again, as it was printed, and say everything about it
    #[arg(long, value_name = "CASE", conflicts_with_all = ["suites", "json"])]
    pub replay: Option<String>,
}

/// Reads a count; 1e9 is one.
fn count(text: &str) -> Result<u64, String> {
    let expected = || "expected a whole number from 1 to 1e15, such as 5000 or 1e8".to_owned();
    let value: f64 = text.trim().replace('_', "").parse().map_err(|_| expected())?;
    let whole = value.fract() == 0.0 && (1.0..=1e15).contains(&value);
    if whole { Ok(value as u64) } else { Err(expected()) }
}

/// A suite's result.
struct Row {
    suite: Suite,
    tally: Tally,
    seconds: f64,
}

/// Runs the command.
///
/// # Errors
/// When something is wrong with the kernels, or a file cannot be written.
pub fn run(args: &Args) -> Result<(), Failure> {
    if let Some(text) = &args.replay {
        return run_again(text);
    }
    if let Some(path) = &args.json {
        files::check_writable(path)?;
    }
    let suites: Vec<Suite> = match args.suites.as_slice() {
        [] => SUITES.to_vec(),
        names => names.iter().filter_map(|name| Suite::named(name)).collect(),
    };
    let counts = share_out(&suites, args.count);
    let started = Instant::now();
    let mut progress = Progress::start(counts.iter().sum());
    let mut rows = Vec::new();
    for (suite, n_cases) in suites.into_iter().zip(counts) {
        let begun = Instant::now();
        let tally = suite.run(args.seed, n_cases, &mut |done| {
            progress.update(suite.name, done);
            true
        });
        progress.done += n_cases;
        rows.push(Row { suite, tally, seconds: begun.elapsed().as_secs_f64() });
    }
    progress.finish();
    let seconds = started.elapsed().as_secs_f64();
    terminal::print(&table(&rows, args.seed, seconds))?;
    if let Some(path) = &args.json {
        let json = to_json(&rows, args.seed, seconds);
        files::write_together(&[(path, Box::new(|out| out.write_all(json.as_bytes())))])?;
    }
    let failed = rows.iter().any(|row| row.tally.wrong + row.tally.inaccurate > 0);
    if failed { Err(Failure::OverLimit) } else { Ok(()) }
}

fn run_again(text: &str) -> Result<(), Failure> {
    let usage = |message: String| Failure::usage("stress", ErrorKind::ValueValidation, message);
    let replayed = Replay::parse(text).and_then(|case| replay(&case)).map_err(usage)?;
    terminal::print(&replayed.report)?;
    if replayed.right { Ok(()) } else { Err(Failure::OverLimit) }
}

/// The table, and under it what failed.
fn table(rows: &[Row], seed: u64, seconds: f64) -> String {
    let mut text = format!(
        "{:<12} {:>13} {:>6} {:>7} {:>7} {:>8} {:>9}   {:>14} {:>14}\n",
        "suite", "cases", "wrong", "t ulp", "p ulp", "n", "exact", "naive f32", "MT f32"
    );
    for Row { suite, tally, .. } in rows {
        text.push_str(&format!(
            "{:<12} {:>13} {:>6} {:>7.3} {:>7.3} {:>8.1e} {:>9}   {:>14} {:>14}\n",
            suite.name,
            quantity::count(tally.cases),
            tally.wrong + tally.inaccurate,
            tally.max_ulp_t,
            tally.max_ulp_p,
            tally.max_err_n,
            share(tally.exact_tests, tally.cases),
            wrong_of(tally.naive_f32),
            wrong_of(tally.moller_trumbore_f32),
        ));
    }
    let cases: u64 = rows.iter().map(|row| row.tally.cases).sum();
    let judged: u64 = rows.iter().map(|row| row.tally.judged).sum();
    let wrong: u64 = rows.iter().map(|row| row.tally.wrong + row.tally.inaccurate).sum();
    text.push_str(&format!(
        "\n{} cases in {}, {} judgements by exact arithmetic, seed {seed}: {wrong} wrong\n",
        quantity::count(cases),
        quantity::seconds(seconds),
        quantity::count(judged),
    ));
    for failure in rows.iter().flat_map(|row| &row.tally.failures) {
        text.push_str(&format!("wrong: {failure}\n"));
    }
    text
}

fn share(part: u64, whole: u64) -> String {
    if part == 0 { "0".to_owned() } else { format!("{:.1e}", part as f64 / whole.max(1) as f64) }
}

fn wrong_of(book: Textbook) -> String {
    if book.cases == 0 {
        return "-".to_owned();
    }
    format!("{:.3} %", 100.0 * book.wrong as f64 / book.cases as f64)
}

fn to_json(rows: &[Row], seed: u64, seconds: f64) -> String {
    let suites: Vec<serde_json::Value> = rows
        .iter()
        .map(|Row { suite, tally, seconds }| {
            serde_json::json!({
                "name": suite.name,
                "about": suite.about,
                "cases": tally.cases,
                "wrong": tally.wrong,
                "inaccurate": tally.inaccurate,
                "judged": tally.judged,
                "max_ulp_t": tally.max_ulp_t,
                "max_ulp_t_f32": tally.max_ulp_t_f32,
                "max_ulp_p": tally.max_ulp_p,
                "max_err_n": tally.max_err_n,
                "exact_tests": tally.exact_tests,
                "exact_share": tally.exact_tests as f64 / tally.cases.max(1) as f64,
                "naive_f32": tally.naive_f32,
                "moller_trumbore_f32": tally.moller_trumbore_f32,
                "failures": tally.failures,
                "seconds": seconds,
            })
        })
        .collect();
    let all = serde_json::json!({ "seed": seed, "seconds": seconds, "suites": suites });
    // Keys and numbers always serialise; the fallback is never taken.
    serde_json::to_string_pretty(&all).unwrap_or_default() + "\n"
}

const TEMPLATE: &str = "{msg:<12} [{bar:40}] {percent:>3} %  {pos}/{len} cases  ETA {eta}";

/// Plain lines come this often where no bar can be drawn.
const LINE_INTERVAL: Duration = Duration::from_secs(5);

/// How far a run has come, on standard error.
struct Progress {
    bar: Option<ProgressBar>,
    total: u64,
    /// Cases of suites that are finished.
    done: u64,
    last_line: Instant,
}

impl Progress {
    fn start(total: u64) -> Progress {
        let bar = terminal::stderr_is_terminal().then(|| {
            let style = ProgressStyle::with_template(TEMPLATE).unwrap_or_else(|_| ProgressStyle::default_bar());
            ProgressBar::with_draw_target(Some(total), ProgressDrawTarget::stderr())
                .with_style(style.progress_chars("=> "))
        });
        Progress { bar, total, done: 0, last_line: Instant::now() }
    }

    fn update(&mut self, suite: &str, done_in_suite: u64) {
        let done = self.done + done_in_suite;
        match &self.bar {
            Some(bar) => {
                bar.set_message(suite.to_owned());
                bar.set_position(done);
            }
            None if self.last_line.elapsed() >= LINE_INTERVAL => {
                self.last_line = Instant::now();
                let percent = 100.0 * done as f64 / self.total.max(1) as f64;
                terminal::print_error(&format!("{percent:>5.1} %  {suite}\n"));
            }
            None => {}
        }
    }

    fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_may_be_written_as_powers_of_ten() {
        for (text, n) in [("1", 1), ("1e8", 100_000_000), ("2.5e3", 2500), ("1_000", 1000)] {
            assert_eq!(count(text), Ok(n));
        }
        for wrong in ["0", "-5", "1.5", "1e16", "nan", "many"] {
            assert!(count(wrong).unwrap_err().contains("whole number"), "{wrong}");
        }
    }

    #[test]
    fn the_template_of_the_bar_is_valid() {
        assert!(ProgressStyle::with_template(TEMPLATE).is_ok());
    }

    #[test]
    fn table_and_json_hold_the_agreed_keys() {
        let suite = SUITES[0];
        let tally = Tally { cases: 4, exact_tests: 1, ..Tally::default() };
        let rows = [Row { suite, tally, seconds: 0.5 }];
        let json: serde_json::Value = serde_json::from_str(&to_json(&rows, 1, 0.5)).unwrap();
        let first = &json["suites"][0];
        assert_eq!(first["name"], suite.name);
        assert_eq!((first["cases"].as_u64(), first["wrong"].as_u64()), (Some(4), Some(0)));
        assert_eq!((first["max_ulp_t"].as_f64(), first["exact_share"].as_f64()), (Some(0.0), Some(0.25)));
        assert!(table(&rows, 1, 0.5).contains(suite.name));
    }
}
