//! Floats as text without rounding: `0x1.8p+3`, as C's `%a` writes them.

use glam::DVec3;

/// A float in hexadecimal.
pub fn hex(x: f64) -> String {
    if x.is_nan() {
        return "nan".to_owned();
    }
    let sign = if x.is_sign_negative() { "-" } else { "" };
    if x.is_infinite() {
        return format!("{sign}inf");
    }
    let bits = x.to_bits();
    let (biased, fraction) = ((bits >> 52) & 0x7ff, bits & ((1 << 52) - 1));
    let (whole, exponent) = match (biased, fraction) {
        (0, 0) => return format!("{sign}0x0p+0"),
        (0, _) => (0, -1022),
        _ => (1, biased as i64 - 1023),
    };
    let digits = format!("{fraction:013x}");
    let digits = digits.trim_end_matches('0');
    let point = if digits.is_empty() { "" } else { "." };
    format!("{sign}0x{whole}{point}{digits}p{exponent:+}")
}

/// Several floats, set apart by commas.
pub fn hex_list(values: impl IntoIterator<Item = f64>) -> String {
    values.into_iter().map(hex).collect::<Vec<_>>().join(",")
}

/// Reads a float in hexadecimal or decimal.
///
/// # Errors
/// When it is neither.
pub fn parse(text: &str) -> Result<f64, String> {
    let wrong = || format!("expected a number such as 0x1.8p+3 or -2.5, found '{text}'");
    let text = text.trim();
    let (negative, rest) = match text.strip_prefix('-') {
        Some(rest) => (true, rest),
        None => (false, text.strip_prefix('+').unwrap_or(text)),
    };
    let Some(digits) = rest.strip_prefix("0x").or_else(|| rest.strip_prefix("0X")) else {
        return text.parse().map_err(|_| wrong());
    };
    let (mantissa, exponent) = digits.split_once(['p', 'P']).unwrap_or((digits, "0"));
    let exponent: i32 = exponent.parse().map_err(|_| wrong())?;
    let (whole, fraction) = mantissa.split_once('.').unwrap_or((mantissa, ""));
    let all = format!("{whole}{fraction}");
    // 14 digits are 56 bits; a value that hex() wrote has 53 of them, the first being the whole.
    if all.is_empty() || all.len() > 14 || !all.chars().all(|c| c.is_ascii_hexdigit()) {
        return Err(wrong());
    }
    let integer = u64::from_str_radix(&all, 16).map_err(|_| wrong())?;
    let exponent = exponent.clamp(-5000, 5000) - 4 * fraction.len() as i32;
    let value = libm::ldexp(integer as f64, exponent);
    Ok(if negative { -value } else { value })
}

/// A list of floats.
#[derive(Debug)]
pub struct Reader {
    numbers: Vec<f64>,
}

impl Reader {
    /// Reads a list set apart by commas.
    ///
    /// # Errors
    /// When an item is no number.
    pub fn new(text: &str) -> Result<Reader, String> {
        Ok(Reader { numbers: text.split(',').map(parse).collect::<Result<_, _>>()? })
    }

    /// Whether there are so many.
    ///
    /// # Errors
    /// When there are not.
    pub fn exactly(&self, n: usize) -> Result<(), String> {
        let found = self.numbers.len();
        if found == n { Ok(()) } else { Err(format!("expected {n} numbers, found {found}")) }
    }

    /// A number; NaN beyond the last.
    pub fn number(&self, at: usize) -> f64 {
        self.numbers.get(at).copied().unwrap_or(f64::NAN)
    }

    /// Three numbers.
    pub fn vector(&self, at: usize) -> DVec3 {
        DVec3::new(self.number(at), self.number(at + 1), self.number(at + 2))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn floats_survive_the_text() {
        for x in [0.0, -0.0, 1.0, -12.0, 0.1, f64::MAX, f64::MIN_POSITIVE, 5e-324, 1e-310, f64::INFINITY, -1e300] {
            assert_eq!(parse(&hex(x)).map(f64::to_bits), Ok(x.to_bits()), "{}", hex(x));
        }
        assert_eq!(hex(12.0), "0x1.8p+3");
        assert!(parse(&hex(f64::NAN)).is_ok_and(f64::is_nan));
        assert_eq!(parse("2.5"), Ok(2.5));
        for wrong in ["", "0x", "0x1.8p", "0xg", "one", "0x123456789abcdef0p0"] {
            assert!(parse(wrong).is_err(), "{wrong}");
        }
    }
}
