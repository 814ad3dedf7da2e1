//! Numbers in text, read to the nearest f64.

/// Powers of ten that f64 holds exactly.
const EXACT_POWERS_OF_TEN: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20,
    1e21, 1e22,
];

/// Whether a byte separates values: blanks, line ends and other control characters.
#[inline]
pub(in crate::scene) fn is_blank(byte: u8) -> bool {
    byte <= b' '
}

/// Whether a byte ends a line.
#[inline]
pub(in crate::scene) fn is_line_end(byte: u8) -> bool {
    byte == b'\n' || byte == b'\r'
}

/// A number ends before a blank, or before the backslash that continues an OBJ line.
#[inline]
fn ends_number(bytes: &[u8], at: usize) -> bool {
    bytes.get(at).is_none_or(|&b| is_blank(b) || b == b'\\')
}

/// The number that begins at `at`, and the offset behind it; `None` when there is none.
///
/// Rounded once, to the nearest f64: a mantissa up to 2⁵³ times or over an exact power of ten is one rounding
/// (Clinger 1990, "How to read floating point numbers accurately", the fast case); everything else goes to the
/// standard library. `nan` and `inf` are numbers in any case of letters, also as old Microsoft C libraries print them
/// (`1.#IND`, `-1.#INF`, `-nan(ind)`).
#[inline]
pub(in crate::scene) fn parse_f64(bytes: &[u8], at: usize) -> Option<(f64, usize)> {
    let mut end = at;
    let sign = bytes.get(at).copied();
    if matches!(sign, Some(b'-' | b'+')) {
        end += 1;
    }
    let mut mantissa = 0;
    let first_digit = end;
    end = digits(bytes, end, &mut mantissa);
    let mut n_digits = end - first_digit;
    let mut exponent = 0;
    if bytes.get(end) == Some(&b'.') {
        let first_decimal = end + 1;
        end = digits(bytes, first_decimal, &mut mantissa);
        n_digits += end - first_decimal;
        exponent = -((end - first_decimal).min(99) as i32);
    }
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let negative = bytes.get(end + 1) == Some(&b'-');
        let first = end + 1 + usize::from(matches!(bytes.get(end + 1), Some(b'-' | b'+')));
        let mut power = 0;
        end = digits(bytes, first, &mut power);
        if end == first || end > first + 9 {
            return parse_f64_slow(bytes, at);
        }
        exponent += if negative { -(power as i32) } else { power as i32 };
    }
    // 19 digits cannot overflow the u64.
    let exact = n_digits > 0 && n_digits <= 19 && mantissa <= 1 << 53;
    let power = EXACT_POWERS_OF_TEN.get(exponent.unsigned_abs() as usize);
    match power {
        Some(&power) if exact && ends_number(bytes, end) => {
            let magnitude = if exponent < 0 { mantissa as f64 / power } else { mantissa as f64 * power };
            Some((if sign == Some(b'-') { -magnitude } else { magnitude }, end))
        }
        _ => parse_f64_slow(bytes, at),
    }
}

/// The number that begins at `at`, rounded once to the nearest f32, and the offset behind it.
///
/// Rounding the nearest f64 once more goes wrong only where that lies in the middle between two f32, or where f32 has
/// fewer digits than usual: there the text is read again.
#[inline]
pub(super) fn parse_f32(bytes: &[u8], at: usize) -> Option<(f32, usize)> {
    /// The bits that f64 has more, and what they are in the middle.
    const MORE_BITS: u64 = (1 << 29) - 1;
    const MIDDLE: u64 = 1 << 28;
    let (value, end) = parse_f64(bytes, at)?;
    let is_middle = value.to_bits() & MORE_BITS == MIDDLE;
    let is_small = value.abs() < f64::from(f32::MIN_POSITIVE) && value != 0.0;
    if is_middle || is_small {
        return Some((nearest_f32(bytes, at, end).unwrap_or(value as f32), end));
    }
    Some((value as f32, end))
}

#[cold]
#[inline(never)]
fn nearest_f32(bytes: &[u8], at: usize, end: usize) -> Option<f32> {
    std::str::from_utf8(bytes.get(at..end)?).ok()?.parse().ok()
}

/// Appends digits to `value`, wrapping, and returns the offset behind them.
#[inline]
fn digits(bytes: &[u8], mut at: usize, value: &mut u64) -> usize {
    while let Some(&byte) = bytes.get(at) {
        let digit = byte.wrapping_sub(b'0');
        if digit > 9 {
            break;
        }
        *value = value.wrapping_mul(10).wrapping_add(u64::from(digit));
        at += 1;
    }
    at
}

#[cold]
#[inline(never)]
fn parse_f64_slow(bytes: &[u8], at: usize) -> Option<(f64, usize)> {
    let end = token_end(bytes, at);
    let token = std::str::from_utf8(bytes.get(at..end)?).ok()?;
    if let Ok(value) = token.parse::<f64>() {
        return Some((value, end));
    }
    let (negative, magnitude) = match token.strip_prefix('-') {
        Some(rest) => (true, rest),
        None => (false, token.strip_prefix('+').unwrap_or(token)),
    };
    let magnitude = magnitude.to_ascii_lowercase();
    let value = match magnitude.trim_end_matches('0') {
        "1.#inf" => f64::INFINITY,
        "1.#ind" | "1.#qnan" | "1.#snan" | "nan(ind)" | "nan(snan)" => f64::NAN,
        _ => return None,
    };
    Some((if negative { -value } else { value }, end))
}

/// The offset behind the value that begins at `at`.
pub(super) fn token_end(bytes: &[u8], at: usize) -> usize {
    let mut end = at.min(bytes.len());
    while !ends_number(bytes, end) {
        end += 1;
    }
    end
}

/// The value that begins at `at`, for messages.
pub(super) fn token(bytes: &[u8], at: usize) -> &[u8] {
    bytes.get(at..token_end(bytes, at)).unwrap_or_default()
}

/// The integer that begins at `at`, and the offset behind its digits; `None` when there is no digit or it does not fit.
#[inline]
pub(super) fn parse_i64(bytes: &[u8], at: usize) -> Option<(i64, usize)> {
    let negative = bytes.get(at) == Some(&b'-');
    let first = at + usize::from(matches!(bytes.get(at), Some(b'-' | b'+')));
    let mut magnitude = 0;
    let end = digits(bytes, first, &mut magnitude);
    if end == first || end - first > 18 {
        return None;
    }
    let magnitude = magnitude as i64;
    Some((if negative { -magnitude } else { magnitude }, end))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(text: &str) -> Option<f64> {
        parse_f64(text.as_bytes(), 0).filter(|&(_, end)| end == text.len()).map(|(value, _)| value)
    }

    #[test]
    fn numbers_equal_those_of_the_standard_library_bit_for_bit() {
        let mut texts: Vec<String> = "0 -0 +1 1. .5 -.25 007 1e5 1E-5 1.5e+3 3.14159265358979323846 9007199254740993 \
             123456789012345678901234567890 1e22 1e23 1e-22 1e-23 4.9e-324 1e-400 1e400 0.1e-30 179769313486231570000e300 \
             0.000000000000000000000000000001 1e0000000000000000001 0e999999999999"
            .split_whitespace()
            .map(str::to_string)
            .collect();
        let mut state = 0x9e37_79b9_7f4a_7c15_u64;
        for _ in 0..20_000 {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            let float = f32::from_bits((state >> 32) as u32);
            if float.is_finite() {
                texts.extend([format!("{float}"), format!("{float:e}"), format!("{:.6}", float % 1000.0)]);
            }
        }
        for text in texts {
            let expected: f64 = text.parse().unwrap();
            assert_eq!(value(&text).map(f64::to_bits), Some(expected.to_bits()), "{text}");
        }
    }

    #[test]
    fn the_nearest_f32_is_found_in_one_rounding_also_where_f64_lies_in_the_middle() {
        // A hair above and below the middle of 1 and the f32 behind it: the nearest f64 of both is the middle.
        let mut texts: Vec<String> = "1.00000005960464477539062500001 1.00000005960464477539062499999 1.000000059604644775390625 \
             -16777217.000000000001 16777216.999999999999 16777217 340282356779733661637539395458142568447.9999 \
             340282356779733661637539395458142568448 1e-45 7.006492321624085354618e-46 7.00649232162408536e-46 1e-46 -0 0 \
             1.1754943508222875e-38 1.17549428e-38 nan inf 1e39 0.1 1.1 3.14159265358979"
            .split_whitespace()
            .map(str::to_string)
            .collect();
        let mut state = 7_u64;
        for _ in 0..20_000 {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            let float = f32::from_bits((state >> 33) as u32);
            let middle = 0.5 * (f64::from(float) + f64::from(f32::from_bits(float.to_bits() + 1)));
            texts.extend([float.to_string(), middle.to_string(), format!("{middle}000000000001")]);
        }
        for text in texts.iter().filter(|text| !text.contains("NaN0") && !text.contains("inf0")) {
            let expected: f32 = text.parse().unwrap();
            let (value, end) = parse_f32(text.as_bytes(), 0).unwrap();
            assert_eq!((value.to_bits() & 0x7fff_ffff, end), (expected.to_bits() & 0x7fff_ffff, text.len()), "{text}");
            assert_eq!(value.is_sign_negative(), expected.is_sign_negative(), "{text}");
        }
    }

    #[test]
    fn what_is_no_number_is_none() {
        for text in ["", "-", ".", "e5", "1e", "1e+", "1.2.3", "0x10", "1,5", "--1", "1f", "x", "1.#", "1.#FOO"] {
            assert_eq!(value(text), None, "{text}");
        }
    }

    #[test]
    fn nan_and_infinity_are_numbers_also_as_old_libraries_print_them() {
        for text in ["nan", "-nan", "NaN", "1.#IND", "-1.#IND", "1.#QNAN0", "1.#IND00", "-nan(ind)"] {
            assert!(value(text).is_some_and(f64::is_nan), "{text}");
        }
        assert_eq!(value("-inf"), Some(f64::NEG_INFINITY));
        assert_eq!(value("1.#INF"), Some(f64::INFINITY));
        assert_eq!(value("-1.#INF00"), Some(f64::NEG_INFINITY));
    }

    #[test]
    fn an_integer_ends_behind_its_digits_and_must_fit() {
        assert_eq!(parse_i64(b"-12/3", 0), Some((-12, 3)));
        assert_eq!(parse_i64(b"x7", 1), Some((7, 2)));
        assert_eq!(parse_i64(b"-", 0), None);
        assert_eq!(parse_i64(b"9999999999999999999", 0), None);
    }
}
