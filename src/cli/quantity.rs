//! Numbers as people read them.

/// A count with thousands set apart: `1,234,567`.
pub fn count(n: u64) -> String {
    let digits = n.to_string();
    let mut text = String::with_capacity(digits.len() + digits.len() / 3);
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// Bytes in binary multiples: `512 B`, `1.5 KiB`, `23.4 GiB`.
pub fn bytes(n: u64) -> String {
    const UNITS: [&str; 6] = ["KiB", "MiB", "GiB", "TiB", "PiB", "EiB"];
    if n < 1024 {
        return format!("{n} B");
    }
    let unit = ((63 - n.leading_zeros()) / 10).min(6) as usize;
    format!("{:.1} {}", n as f64 / 1024f64.powi(unit as i32), UNITS[unit - 1])
}

/// A duration: milliseconds below a second, minutes from one on.
pub fn seconds(s: f64) -> String {
    if s < 0.9995 {
        format!("{:.1} ms", s * 1e3)
    } else if s < 60.0 {
        format!("{s:.2} s")
    } else {
        format!("{} min {:02.0} s", (s / 60.0).floor(), (s % 60.0).floor())
    }
}

/// Million rays per second; 0 when no time has passed.
pub fn mega_rays_per_second(rays: u64, seconds: f64) -> f64 {
    if seconds > 0.0 { rays as f64 / seconds * 1e-6 } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_grouped_by_thousands() {
        let cases = [(0, "0"), (999, "999"), (1000, "1,000"), (1234567, "1,234,567"), (100000, "100,000")];
        for (n, text) in cases {
            assert_eq!(count(n), text);
        }
    }

    #[test]
    fn bytes_and_seconds_take_the_unit_that_fits() {
        let cases = [(0, "0 B"), (1023, "1023 B"), (1536, "1.5 KiB"), (1 << 20, "1.0 MiB"), (u64::MAX, "16.0 EiB")];
        for (n, text) in cases {
            assert_eq!(bytes(n), text);
        }
        for (s, text) in [(0.0, "0.0 ms"), (0.0123, "12.3 ms"), (1.5, "1.50 s"), (3601.0, "60 min 01 s")] {
            assert_eq!(seconds(s), text);
        }
    }
}
