//! `flatray diff`: how far one image is from another.

use clap::error::ErrorKind;

use super::args::DiffArgs;
use super::failure::Failure;
use super::files::{self, Difference};
use super::terminal;
use crate::film::output::Format;
use crate::measure::difference::SMALL_LEVELS;

/// Runs the command.
///
/// # Errors
/// Unreadable images, images of different sizes, a limit that is exceeded.
pub fn run(args: &DiffArgs) -> Result<(), Failure> {
    if let Some(path) = &args.out {
        if Format::of_path(path) != Ok(Format::Png) {
            let shown = terminal::shown(path);
            let message = format!("unknown kind of output '{shown}': expected a name that ends in .png");
            return Err(Failure::usage("diff", ErrorKind::ValueValidation, message));
        }
        files::check_writable(path)?;
    }
    let kind = args.map.unwrap_or_default().into();
    let map = args.out.as_deref().map(|path| (path, kind));
    let figures = files::compare(&args.a, &args.b, args.linear, map)?;
    terminal::print(&if args.json { to_json(&figures) } else { describe(&figures) })?;

    let exceeded = exceeded_limits(args, &figures);
    for message in &exceeded {
        terminal::print_error(&format!("over the limit: {message}\n"));
    }
    if exceeded.is_empty() { Ok(()) } else { Err(Failure::OverLimit) }
}

fn to_json(figures: &Difference) -> String {
    // Numbers always serialise, those that JSON cannot say as null; the fallback is never taken.
    serde_json::to_string_pretty(figures).unwrap_or_default() + "\n"
}

fn describe(figures: &Difference) -> String {
    let Difference { width, height, differing, differing_percent, infinite, levels, .. } = figures;
    let Difference { max, mae, rmse, relmse, psnr, p999, flip, ssim, .. } = figures;
    let psnr = if psnr.is_infinite() && *psnr > 0.0 { "equal images".to_owned() } else { format!("{psnr:.2} dB") };
    let mut text = format!(
        "differing  {differing} of {width}x{height} pixels ({differing_percent:.6} %)\nmax        {max:e}\n\
         mae        {mae:e}\nrmse       {rmse:e}\nrelmse     {relmse:e}\npsnr       {psnr}\np999       {p999:e}\n\
         flip       {flip:.6}\nssim       {ssim:.6}\n"
    );
    if *infinite > 0 {
        text.push_str(&format!("infinite   {infinite} pixels\n"));
    }
    if let Some(levels) = levels {
        text.push_str(&format!(
            "levels     {} pixels differ, {} by more than {SMALL_LEVELS}, largest {}\n",
            levels.differing, levels.more_than_8, levels.max
        ));
    }
    text
}

/// The limits that are exceeded, each as key, value and limit. A figure that is no number exceeds every limit.
fn exceeded_limits(args: &DiffArgs, figures: &Difference) -> Vec<String> {
    let at_most = [
        ("differing", figures.differing_percent, args.max_differing),
        ("max", figures.max, args.max_abs),
        ("mae", figures.mae, args.max_mae),
        ("rmse", figures.rmse, args.max_rmse),
        ("p999", figures.p999, args.max_p999),
        ("relmse", figures.relmse, args.max_relmse),
        ("flip", figures.flip, args.max_flip),
    ];
    let mut exceeded: Vec<String> = at_most
        .into_iter()
        .filter_map(|(key, value, limit)| Some((key, value, limit?)))
        .filter(|&(_, value, limit)| value.is_nan() || value > limit)
        .map(|(key, value, limit)| format!("{key} is {value}, at most {limit} allowed"))
        .collect();
    let at_least = [("psnr", figures.psnr, args.min_psnr), ("ssim", figures.ssim, args.min_ssim)];
    let below = at_least
        .into_iter()
        .filter_map(|(key, value, limit)| Some((key, value, limit?)))
        .filter(|&(_, value, limit)| value.is_nan() || value < limit)
        .map(|(key, value, limit)| format!("{key} is {value}, at least {limit} required"));
    exceeded.extend(below);
    exceeded
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;
    use crate::cli::args::{Cli, Command};

    const FIGURES: Difference = Difference {
        width: 10,
        height: 5,
        differing: 1,
        differing_percent: 2.0,
        infinite: 0,
        max: 0.5,
        mae: 0.01,
        rmse: 0.05,
        relmse: 0.2,
        psnr: 26.0,
        p999: 0.4,
        flip: 0.1,
        ssim: 0.9,
        levels: None,
    };
    const EQUAL: Difference = Difference {
        differing: 0,
        differing_percent: 0.0,
        max: 0.0,
        mae: 0.0,
        rmse: 0.0,
        relmse: 0.0,
        psnr: f64::INFINITY,
        p999: 0.0,
        flip: 0.0,
        ssim: 1.0,
        ..FIGURES
    };

    fn exceeded(options: &[&str], figures: &Difference) -> usize {
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
        assert_eq!(exceeded(&["--max-relmse", "0.2", "--max-flip", "0.1", "--min-ssim", "0.9"], &FIGURES), 0);
        assert_eq!(exceeded(&["--max-relmse", "0.1", "--max-flip", "0", "--min-ssim", "0.95"], &FIGURES), 3);
        let not_a_number = Difference { max: f64::NAN, ..FIGURES };
        assert_eq!(exceeded(&["--max-abs", "1e9"], &not_a_number), 1);
    }

    #[test]
    fn equal_images_have_a_null_psnr_and_meet_every_limit() {
        assert_eq!(exceeded(&["--min-psnr", "99", "--max-abs", "0"], &EQUAL), 0);
        let json: serde_json::Value = serde_json::from_str(&to_json(&EQUAL)).unwrap();
        assert_eq!(json["psnr"], serde_json::Value::Null);
        for key in ["differing", "max", "mae", "rmse", "relmse", "p999", "flip"] {
            assert_eq!(json[key].as_f64(), Some(0.0), "{key}");
        }
        assert!(describe(&EQUAL).contains("equal images"));
    }

    #[test]
    fn the_text_has_every_key() {
        let text = describe(&FIGURES);
        for key in ["differing", "max", "mae", "rmse", "relmse", "psnr", "p999", "flip", "ssim"] {
            assert!(text.lines().any(|line| line.starts_with(key)), "{key} is not in:\n{text}");
        }
    }
}
