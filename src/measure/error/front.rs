//! What is worth its time: the Pareto front, and what can be read off it.

/// A way to render, as a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// What it costs; above 0.
    pub seconds: f64,
    /// How wrong it is; above 0.
    pub rmse: f64,
}

/// Which points no other is both as fast and as right as, and faster or more right. Of equal points all are.
pub fn on_front(points: &[Point]) -> Vec<bool> {
    let dominates = |a: &Point, b: &Point| a.seconds <= b.seconds && a.rmse <= b.rmse && a != b;
    points.iter().map(|point| !points.iter().any(|other| dominates(other, point))).collect()
}

/// The points of the front by time, equal ones once.
fn front(points: &[Point]) -> Vec<Point> {
    let mut front: Vec<Point> = points.iter().zip(on_front(points)).filter(|(_, on)| *on).map(|(&p, _)| p).collect();
    front.sort_by(|a, b| a.seconds.total_cmp(&b.seconds));
    front.dedup();
    front
}

/// The time that an error takes: on the straight line, in logarithms, between the two points of the front around it. `None`
/// where no point is as good; the time of the fastest where that is better already.
pub fn seconds_to(points: &[Point], rmse: f64) -> Option<f64> {
    let front = front(points);
    let reached = front.iter().position(|point| point.rmse <= rmse)?;
    let after = front[reached];
    let Some(before) = reached.checked_sub(1).map(|before| front[before]) else { return Some(after.seconds) };
    let share = (before.rmse / rmse).ln() / (before.rmse / after.rmse).ln();
    Some(before.seconds * (after.seconds / before.seconds).powf(share))
}

/// The error that a time allows, likewise. `None` where nothing is as fast; the least there is where there is more time than
/// that takes.
pub fn rmse_at(points: &[Point], seconds: f64) -> Option<f64> {
    let front = front(points);
    let before = *front.iter().rev().find(|point| point.seconds <= seconds)?;
    let Some(after) = front.iter().find(|point| point.seconds > seconds) else { return Some(before.rmse) };
    let share = (seconds / before.seconds).ln() / (after.seconds / before.seconds).ln();
    Some(before.rmse * (after.rmse / before.rmse).powf(share))
}

/// The slope of y over x in logarithms, by least squares; `None` of fewer than two different x.
pub fn slope(points: &[(f64, f64)]) -> Option<f64> {
    let logs: Vec<(f64, f64)> = points.iter().map(|&(x, y)| (x.ln(), y.ln())).collect();
    let n = logs.len() as f64;
    let mean = |of: fn(&(f64, f64)) -> f64| logs.iter().map(of).sum::<f64>() / n;
    let (x, y) = (mean(|p| p.0), mean(|p| p.1));
    let (above, below) =
        logs.iter().fold((0.0, 0.0), |(a, b), p| (a + (p.0 - x) * (p.1 - y), b + (p.0 - x) * (p.0 - x)));
    let slope = above / below;
    slope.is_finite().then_some(slope)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(seconds: f64, rmse: f64) -> Point {
        Point { seconds, rmse }
    }

    #[test]
    fn the_front_is_what_nothing_else_beats() {
        let points =
            [point(1.0, 0.5), point(2.0, 0.1), point(2.0, 0.2), point(3.0, 0.1), point(4.0, 0.01), point(0.5, 0.6)];
        assert_eq!(on_front(&points), [true, true, false, false, true, true]);
        assert_eq!(on_front(&[point(1.0, 1.0); 2]), [true, true], "equal points are both on it");
        assert_eq!(on_front(&[]), Vec::<bool>::new());
    }

    #[test]
    fn times_and_errors_between_points_lie_on_a_line_in_logarithms() {
        // error = 1/time², and a point that is dominated.
        let points = [point(1.0, 1.0), point(10.0, 1e-2), point(100.0, 1e-4), point(50.0, 0.5)];
        let near = |a: Option<f64>, b: f64| (a.unwrap() / b - 1.0).abs() < 1e-12;
        assert!(near(seconds_to(&points, 1e-3), 10f64.powf(1.5)));
        assert!(near(rmse_at(&points, 10f64.powf(0.5)), 0.1));
        assert!(near(seconds_to(&points, 1e-2), 10.0) && near(rmse_at(&points, 10.0), 1e-2));
        assert_eq!((seconds_to(&points, 2.0), seconds_to(&points, 1e-5)), (Some(1.0), None));
        assert_eq!((rmse_at(&points, 0.5), rmse_at(&points, 1e3)), (None, Some(1e-4)));
    }

    #[test]
    fn a_power_law_has_its_exponent_as_slope() {
        let law: Vec<(f64, f64)> = [1.0, 4.0, 16.0, 64.0].iter().map(|&n: &f64| (n, 0.3 * n.powf(-0.75))).collect();
        assert!((slope(&law).unwrap() + 0.75).abs() < 1e-12);
        // Not on a line: x = 0, 1, 2 and y = 0, 1, 0 in logarithms of base e.
        let bent = [(1.0, 1.0), (1f64.exp(), 1f64.exp()), (2f64.exp(), 1.0)];
        assert!(slope(&bent).unwrap().abs() < 1e-12);
        assert_eq!((slope(&[]), slope(&[(1.0, 1.0)]), slope(&[(2.0, 1.0), (2.0, 3.0)])), (None, None, None));
    }
}
