//! `flatray diff`: how far one image is from another.

use clap::error::ErrorKind;
use serde::Serialize;

use super::args::DiffArgs;
use super::failure::Failure;
use super::output::ImageKind;
use super::{files, terminal};

/// The figures of a comparison; the keys of the JSON object are stable.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Figures {
    /// Percent of pixels with any differing channel.
    pub differing: f64,
    /// Largest absolute difference of any channel.
    pub max: f64,
    /// Mean absolute difference over all channels.
    pub mae: f64,
    /// Root mean square difference over all channels.
    pub rmse: f64,
    /// Peak signal-to-noise ratio in decibels, the peak being 1; `None`, in JSON null, when the images are equal.
    pub psnr: Option<f64>,
    /// 99.9th percentile of the pixels' largest channel difference.
    pub p999: f64,
}

/// Runs the command.
///
/// # Errors
/// Unreadable images, images of different sizes, a limit that is exceeded.
pub fn run(args: &DiffArgs) -> Result<(), Failure> {
    if let Some(path) = &args.out {
        if ImageKind::of(path) != Some(ImageKind::Png) {
            let shown = terminal::shown(path);
            let message = format!("unknown kind of output '{shown}': expected a name that ends in .png");
            return Err(Failure::usage("diff", ErrorKind::ValueValidation, message));
        }
        files::check_writable(path)?;
    }
    let figures = files::compare(&args.a, &args.b, args.linear, args.out.as_deref())?;
    terminal::print(&if args.json { to_json(&figures) } else { describe(&figures) })?;

    let exceeded = exceeded_limits(args, &figures);
    for message in &exceeded {
        terminal::print_error(&format!("over the limit: {message}\n"));
    }
    if exceeded.is_empty() { Ok(()) } else { Err(Failure::OverLimit) }
}

fn to_json(figures: &Figures) -> String {
    // Numbers always serialise, those that JSON cannot say as null; the fallback is never taken.
    serde_json::to_string_pretty(figures).unwrap_or_default() + "\n"
}

fn describe(figures: &Figures) -> String {
    let Figures { differing, max, mae, rmse, psnr, p999 } = figures;
    let psnr = psnr.map_or_else(|| "equal images".to_owned(), |psnr| format!("{psnr:.2} dB"));
    format!(
        "differing  {differing} %\nmax        {max:e}\nmae        {mae:e}\nrmse       {rmse:e}\n\
         psnr       {psnr}\np999       {p999:e}\n"
    )
}

/// The limits that are exceeded, each as key, value and limit. A figure that is no number exceeds every limit.
fn exceeded_limits(args: &DiffArgs, figures: &Figures) -> Vec<String> {
    let at_most = [
        ("differing", figures.differing, args.max_differing),
        ("max", figures.max, args.max_abs),
        ("mae", figures.mae, args.max_mae),
        ("rmse", figures.rmse, args.max_rmse),
        ("p999", figures.p999, args.max_p999),
    ];
    let mut exceeded: Vec<String> = at_most
        .into_iter()
        .filter_map(|(key, value, limit)| Some((key, value, limit?)))
        .filter(|&(_, value, limit)| value.is_nan() || value > limit)
        .map(|(key, value, limit)| format!("{key} is {value}, at most {limit} allowed"))
        .collect();
    if let (Some(psnr), Some(limit)) = (figures.psnr, args.min_psnr)
        && (psnr.is_nan() || psnr < limit)
    {
        exceeded.push(format!("psnr is {psnr}, at least {limit} required"));
    }
    exceeded
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;
    use crate::cli::args::{Cli, Command};

    const FIGURES: Figures = Figures { differing: 2.0, max: 0.5, mae: 0.01, rmse: 0.05, psnr: Some(26.0), p999: 0.4 };

    fn exceeded(options: &[&str], figures: &Figures) -> usize {
        let cli = Cli::try_parse_from([&["flatray", "diff", "a.png", "b.png"], options].concat()).unwrap();
        let Some(Command::Diff(args)) = cli.command else { panic!("{options:?}") };
        exceeded_limits(&args, figures).len()
    }

    #[test]
    fn a_limit_is_exceeded_only_by_a_larger_figure() {
        assert_eq!(exceeded(&[], &FIGURES), 0);
        assert_eq!(exceeded(&["--max-differing", "2", "--max-abs", "0.5", "--max-rmse", "0.05"], &FIGURES), 0);
        assert_eq!(exceeded(&["--max-differing", "1.9", "--max-abs", "0.4", "--max-rmse", "0"], &FIGURES), 3);
        assert_eq!(exceeded(&["--max-mae", "0.001", "--max-p999", "0.1", "--min-psnr", "30"], &FIGURES), 3);
        let not_a_number = Figures { max: f64::NAN, ..FIGURES };
        assert_eq!(exceeded(&["--max-abs", "1e9"], &not_a_number), 1);
    }

    #[test]
    fn equal_images_have_a_null_psnr_and_meet_every_limit() {
        let equal = Figures { differing: 0.0, max: 0.0, mae: 0.0, rmse: 0.0, psnr: None, p999: 0.0 };
        assert_eq!(exceeded(&["--min-psnr", "99", "--max-abs", "0"], &equal), 0);
        let json: serde_json::Value = serde_json::from_str(&to_json(&equal)).unwrap();
        assert_eq!(json["psnr"], serde_json::Value::Null);
        assert_eq!(json.as_object().unwrap().len(), 6);
    }
}
