//! How far a render has come: a bar on a terminal, plain lines elsewhere.

use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::{quantity, terminal};

/// Plain lines come at every tenth, but never faster than this.
const LINE_INTERVAL: Duration = Duration::from_secs(1);

const TEMPLATE: &str = "{bar:32} {percent:>3} %  {pos}/{len} tiles  ETA {eta}  {msg}";

/// Shows the progress of one render on standard error.
pub struct Progress {
    n_tiles: u64,
    started: Instant,
    style: Style,
}

enum Style {
    Bar(ProgressBar),
    Lines(Pace),
    Silent,
}

impl Progress {
    /// Begins to show a render of so many tiles.
    pub fn start(n_tiles: u64, quiet: bool) -> Progress {
        let started = Instant::now();
        let style = if quiet {
            Style::Silent
        } else if terminal::stderr_is_terminal() {
            let bar = ProgressBar::with_draw_target(Some(n_tiles), ProgressDrawTarget::stderr());
            // The template is a constant that a test parses; the default style stands in for what cannot happen.
            let style = ProgressStyle::with_template(TEMPLATE).unwrap_or_else(|_| ProgressStyle::default_bar());
            bar.set_style(style.progress_chars("=> "));
            Style::Bar(bar)
        } else {
            Style::Lines(Pace::new(started))
        };
        Progress { n_tiles, started, style }
    }

    /// Shows the current figures.
    pub fn update(&mut self, tiles_done: u64, rays_traced: u64) {
        // Rounds towards a target may have more tiles than the one that was announced.
        let tiles_done = tiles_done.min(self.n_tiles);
        let elapsed = self.started.elapsed();
        let rate = quantity::mega_rays_per_second(rays_traced, elapsed.as_secs_f64());
        match &mut self.style {
            Style::Bar(bar) => {
                bar.set_message(format!("{rate:.2} Mray/s"));
                bar.set_position(tiles_done);
            }
            Style::Lines(pace) => {
                let percent = (100 * tiles_done).checked_div(self.n_tiles).unwrap_or(100);
                if pace.is_due(percent, Instant::now()) {
                    let left = elapsed.as_secs_f64() * (100.0 - percent as f64) / (percent as f64).max(1.0);
                    terminal::print_error(&format!(
                        "{percent:>3} %  {tiles_done}/{} tiles  ETA {left:.0} s  {rate:.2} Mray/s\n",
                        self.n_tiles
                    ));
                }
            }
            Style::Silent => {}
        }
    }

    /// Takes the bar off the screen; lines stay.
    pub fn finish(self) {
        if let Style::Bar(bar) = self.style {
            bar.finish_and_clear();
        }
    }
}

/// When the next plain line is due.
struct Pace {
    next_percent: u64,
    last_line: Instant,
}

impl Pace {
    fn new(now: Instant) -> Pace {
        Pace { next_percent: 10, last_line: now }
    }

    fn is_due(&mut self, percent: u64, now: Instant) -> bool {
        let due = percent >= self.next_percent && now.duration_since(self.last_line) >= LINE_INTERVAL;
        if due {
            self.next_percent = (percent / 10 + 1) * 10;
            self.last_line = now;
        }
        due
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_template_of_the_bar_is_valid() {
        assert!(ProgressStyle::with_template(TEMPLATE).is_ok());
    }

    #[test]
    fn lines_come_at_most_once_a_second_and_once_a_tenth() {
        let start = Instant::now();
        let mut pace = Pace::new(start);
        let at = |tenths: u64| start + Duration::from_millis(100 * tenths);
        assert!(!pace.is_due(50, at(5)), "too early");
        assert!(!pace.is_due(9, at(20)), "no tenth is complete");
        assert!(pace.is_due(23, at(20)));
        assert!(!pace.is_due(40, at(29)), "less than a second later");
        assert!(!pace.is_due(29, at(60)), "the same tenth");
        assert!(pace.is_due(30, at(61)));
    }
}
