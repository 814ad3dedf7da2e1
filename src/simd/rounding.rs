//! Directed rounding from f64 to f32.

/// The largest f32 that is not above `x`; NaN stays NaN, −∞ stays −∞.
#[inline(always)]
pub fn f32_at_most(x: f64) -> f32 {
    let nearest = x as f32;
    step_down(nearest, f64::from(nearest) > x)
}

/// The smallest f32 that is not below `x`; NaN stays NaN, ∞ stays ∞.
#[inline(always)]
pub fn f32_at_least(x: f64) -> f32 {
    // −f32_at_most(−x), which costs nothing more.
    -f32_at_most(-x)
}

/// The next smaller f32 if `step`, without a branch: rounding goes wrong every other time. −∞, which nothing is rounded
/// up to, must not be stepped from.
#[inline(always)]
fn step_down(x: f32, step: bool) -> f32 {
    let (bits, step) = (x.to_bits(), u32::from(step));
    // Magnitudes of positive numbers shrink, those of negative ones and of zero grow.
    let down = if x > 0.0 { bits.wrapping_sub(step) } else { (bits | step << 31) + step };
    f32::from_bits(down)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directed_rounding_encloses_the_value_within_one_ulp() {
        for x in [0.0, -0.0, 0.1, -0.1, 1.0, 1e-50, -1e-50, 1e39, -1e39, 3.0e38, f64::MIN_POSITIVE, 16_777_217.0] {
            let (lo, hi) = (f32_at_most(x), f32_at_least(x));
            assert!(f64::from(lo) <= x && x <= f64::from(hi), "{x}: {lo} {hi}");
            assert!(lo == hi || lo.next_up() == hi, "{x}: {lo} {hi}");
        }
        assert_eq!(f32_at_least(1e39), f32::INFINITY);
        assert_eq!(f32_at_most(1e39), f32::MAX);
        assert!(f32_at_most(f64::NAN).is_nan());
    }
}
