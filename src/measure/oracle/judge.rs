//! Whether an answer is right, and by how much its t is off.

use super::Polynomial;

/// An f64 of a hit may be this many of its ulps from the exact root.
pub const ALLOWED_ULPS: u32 = 4;

/// What is to be said of an answer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Judgement {
    /// Whether hit or miss is right, the root is the first in the interval, and t is within [`ALLOWED_ULPS`].
    pub right: bool,
    /// Of a hit: exact root − t; added to t it is the root to about 30 digits.
    pub delta: f64,
    /// Of a hit: |delta| in ulps of t.
    pub ulps: f64,
}

/// The distance between neighbours at |x|, on the side away from zero.
pub fn ulp(x: f64) -> f64 {
    let x = x.abs();
    if x < f64::MAX { x.next_up() - x } else { x - x.next_down() }
}

fn step(mut x: f64, n: u32, to: fn(f64) -> f64) -> f64 {
    for _ in 0..n {
        x = to(x);
    }
    x.clamp(f64::MIN, f64::MAX)
}

/// Judges the first hit in the open interval from `t_min >= 0` to `t_max`. `truth` holds the roots at which the line
/// meets the primitive, if any.
///
/// The ends of the interval are sharp for the f64: a root within an ulp of an end may round to either side of it.
pub fn judge(truth: Option<&Polynomial>, answer: Option<f64>, t_min: f64, t_max: f64) -> Judgement {
    let verdict = |right| Judgement { right, delta: 0.0, ulps: 0.0 };
    let lowest = step(t_min, 1, f64::next_up);
    let highest = step(t_max, 1, f64::next_down);
    match (truth, answer) {
        (None, answer) => verdict(answer.is_none()),
        (Some(roots), None) => {
            let clear = t_min == 0.0 && !roots.has_positive_root();
            verdict(clear || lowest > highest || !roots.has_root_within(lowest, highest))
        }
        (Some(_), Some(t)) if !(t > t_min && t < t_max) => verdict(false),
        (Some(roots), Some(t)) => {
            let (delta, first) = roots.nearest_root(t);
            let ulps = delta.abs() / ulp(t);
            // An earlier root that had to be reported instead: below what t's own error reaches.
            let skipped = || {
                let reach = step(t, ALLOWED_ULPS + 1, f64::next_down);
                lowest <= reach && roots.has_root_within(lowest, reach)
            };
            // Of two roots that are this close either may be the one that counts.
            let reach = |to| step(t, ALLOWED_ULPS, to);
            let counts = || roots.keeps_all() || roots.has_root_within(reach(f64::next_down), reach(f64::next_up));
            let only = first || roots.n_roots() == 1;
            Judgement { right: ulps <= f64::from(ALLOWED_ULPS) && counts() && (only || !skipped()), delta, ulps }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn roots() -> Polynomial {
        // 9t² − 12t + 3 = 3(3t − 1)(t − 1): 1/3 and 1.
        Polynomial::new(9.into(), (-6).into(), 3.into(), 0).unwrap()
    }

    #[test]
    fn the_right_answer_is_the_first_root_in_the_interval() {
        let third = 1.0 / 3.0;
        let over = |answer, t_min, t_max| judge(Some(&roots()), answer, t_min, t_max).right;
        assert!(over(Some(third), 0.0, f64::INFINITY));
        assert!(!over(Some(1.0), 0.0, f64::INFINITY), "skips the first root");
        assert!(!over(None, 0.0, f64::INFINITY));
        assert!(over(Some(1.0), 0.5, f64::INFINITY));
        assert!(!over(Some(third), 0.5, f64::INFINITY), "outside of the interval");
        assert!(over(None, 0.5, 1.0), "the interval is open");
        assert!(over(None, 1.0, f64::INFINITY));
        assert!(!over(Some(third * (1.0 + 1e-15)), 0.0, f64::INFINITY), "more than 4 ulp");
        // 1/3 rounds down: at the end that is the f64 itself, a miss is right, and one more ulp away it is not.
        assert!(over(Some(1.0), third, f64::INFINITY));
        assert!(!over(Some(1.0), third.next_down().next_down(), f64::INFINITY));
    }

    #[test]
    fn nothing_is_hit_where_there_is_no_root() {
        assert!(judge(None, None, 0.0, 1.0).right);
        assert!(!judge(None, Some(0.5), 0.0, 1.0).right);
    }

    #[test]
    fn the_error_is_counted_in_ulps() {
        let judged = judge(Some(&roots()), Some(1.0f64.next_up()), 0.5, 2.0);
        assert!(judged.right && (judged.ulps - 1.0).abs() < 1e-9, "{judged:?}");
    }
}
