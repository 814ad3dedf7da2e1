//! Points on logarithmic axes, as inline SVG.

use std::fmt::Write;

/// What is drawn.
pub(super) struct Plot<'a> {
    pub x_label: &'a str,
    pub y_label: &'a str,
    pub marks: Vec<Mark>,
    /// Lines through points in their order, with a colour.
    pub lines: Vec<(Vec<(f64, f64)>, &'static str)>,
    /// A level that no point is below, with its name.
    pub level: Option<(f64, &'a str)>,
}

/// A point.
pub(super) struct Mark {
    pub x: f64,
    pub y: f64,
    /// Ends of a thin line in x.
    pub x_range: (f64, f64),
    pub color: &'static str,
    pub is_faint: bool,
    pub title: String,
}

const WIDTH: f64 = 960.0;
const HEIGHT: f64 = 520.0;
const LEFT: f64 = 70.0;
const BOTTOM: f64 = 46.0;
const TOP: f64 = 12.0;
const RIGHT: f64 = 16.0;

/// What dominated points are drawn in.
pub(super) const FAINT: &str = "#b9bec4";

/// An axis from a power of ten to another.
struct Axis {
    lo: f64,
    hi: f64,
}

impl Axis {
    fn around(values: impl Iterator<Item = f64>) -> Axis {
        let (lo, hi) = values
            .filter(|value| value.is_finite() && *value > 0.0)
            .map(f64::log10)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), value| (lo.min(value), hi.max(value)));
        if lo > hi {
            return Axis { lo: 0.0, hi: 1.0 };
        }
        // A little room, so that no mark is cut.
        let (lo, hi) = (lo - 0.08, hi + 0.08);
        Axis { lo, hi: hi.max(lo + 0.5) }
    }

    fn place(&self, value: f64) -> f64 {
        ((value.max(f64::MIN_POSITIVE).log10() - self.lo) / (self.hi - self.lo)).clamp(0.0, 1.0)
    }

    /// Digits times powers of ten inside; all nine of them for lines, with whether they are named.
    fn ticks(&self) -> Vec<(f64, bool)> {
        let powers = self.lo.floor() as i32..=self.hi.ceil() as i32;
        let few = self.hi - self.lo < 1.5;
        powers
            .flat_map(|power| (1..10).map(move |digit| (power, digit)))
            .map(|(power, digit)| (f64::from(digit) * 10f64.powi(power), digit == 1 || few && [2, 5].contains(&digit)))
            .filter(|(value, _)| (self.lo..=self.hi).contains(&value.log10()))
            .collect()
    }
}

impl Plot<'_> {
    pub fn svg(&self) -> String {
        let line_points = || self.lines.iter().flat_map(|(points, _)| points);
        let xs = self.marks.iter().flat_map(|mark| [mark.x, mark.x_range.0, mark.x_range.1]);
        let x_axis = Axis::around(xs.chain(line_points().map(|point| point.0)));
        let ys = self.marks.iter().map(|mark| mark.y).chain(line_points().map(|point| point.1));
        let y_axis = Axis::around(ys.chain(self.level.map(|(level, _)| level)));
        let x = |value: f64| LEFT + x_axis.place(value) * (WIDTH - LEFT - RIGHT);
        let y = |value: f64| HEIGHT - BOTTOM - y_axis.place(value) * (HEIGHT - BOTTOM - TOP);
        let mut svg = format!("<svg viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\">");
        // Writing to a string cannot fail.
        self.grid(&x_axis, &y_axis, &x, &y, &mut svg);
        if let Some((level, name)) = self.level {
            let _ = write!(
                svg,
                "<path d=\"M{LEFT} {0:.1}H{1}\" stroke=\"#b3261e\" stroke-dasharray=\"5 4\"/>\
                 <text x=\"{2}\" y=\"{3:.1}\" text-anchor=\"end\" fill=\"#b3261e\">{name}</text>",
                y(level),
                WIDTH - RIGHT,
                WIDTH - RIGHT - 4.0,
                y(level) - 5.0
            );
        }
        for (points, color) in &self.lines {
            let path: Vec<String> = points.iter().map(|point| format!("{:.1} {:.1}", x(point.0), y(point.1))).collect();
            if path.len() > 1 {
                let path = path.join("L");
                let _ = write!(svg, "<path d=\"M{path}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"1.5\"/>");
            }
        }
        // What counts lies on top.
        let (faint, clear): (Vec<&Mark>, Vec<&Mark>) = self.marks.iter().partition(|mark| mark.is_faint);
        for mark in faint.into_iter().chain(clear) {
            let color = if mark.is_faint { FAINT } else { mark.color };
            let _ = write!(
                svg,
                "<path d=\"M{:.1} {:.1}H{:.1}\" stroke=\"{color}\"/>\
                 <circle cx=\"{:.1}\" cy=\"{1:.1}\" r=\"4.5\" fill=\"{color}\" stroke=\"{}\"><title>{}</title></circle>",
                x(mark.x_range.0),
                y(mark.y),
                x(mark.x_range.1),
                x(mark.x),
                mark.color,
                mark.title,
            );
        }
        svg + "</svg>"
    }

    fn grid(&self, x_axis: &Axis, y_axis: &Axis, x: &dyn Fn(f64) -> f64, y: &dyn Fn(f64) -> f64, svg: &mut String) {
        let (right, bottom) = (WIDTH - RIGHT, HEIGHT - BOTTOM);
        let color = |is_named: bool| if is_named { "#d5d9dd" } else { "#eef0f2" };
        for (value, is_named) in x_axis.ticks() {
            let at = x(value);
            let _ = write!(svg, "<path d=\"M{at:.1} {TOP}V{bottom}\" stroke=\"{}\"/>", color(is_named));
            if is_named {
                let _ = write!(
                    svg,
                    "<text x=\"{at:.1}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
                    bottom + 17.0,
                    short(value)
                );
            }
        }
        for (value, is_named) in y_axis.ticks() {
            let at = y(value);
            let _ = write!(svg, "<path d=\"M{LEFT} {at:.1}H{right}\" stroke=\"{}\"/>", color(is_named));
            if is_named {
                let _ = write!(
                    svg,
                    "<text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
                    LEFT - 6.0,
                    at + 4.0,
                    short(value)
                );
            }
        }
        let (middle_x, middle_y) = (0.5 * (LEFT + right), 0.5 * (TOP + bottom));
        let _ = write!(
            svg,
            "<text x=\"{middle_x}\" y=\"{}\" text-anchor=\"middle\">{}</text>\
             <text transform=\"translate(16 {middle_y}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
            HEIGHT - 8.0,
            self.x_label,
            self.y_label
        );
    }
}

/// A tick's number.
fn short(value: f64) -> String {
    if (0.01..10_000.0).contains(&value) { format!("{}", (value * 1e4).round() / 1e4) } else { format!("{value:.0e}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_axis_names_powers_of_ten_and_puts_them_in_order() {
        let axis = Axis::around([0.003, 40.0, f64::NAN, 0.0].into_iter());
        let named: Vec<f64> = axis.ticks().into_iter().filter(|tick| tick.1).map(|tick| tick.0).collect();
        assert_eq!(named.iter().map(|&value| short(value)).collect::<Vec<_>>(), ["0.01", "0.1", "1", "10"]);
        assert!(axis.place(0.003) > 0.0 && axis.place(0.1) < axis.place(1.0) && axis.place(40.0) < 1.0);
        assert!(Axis::around(std::iter::empty()).ticks().len() > 1);
    }
}
