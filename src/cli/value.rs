//! Reads the values of options that clap has no ranges for. The messages complete clap's "invalid value … for …: ".

use crate::film::Region;

/// A finite number.
pub fn number(text: &str) -> Result<f64, String> {
    let value: f64 = text.trim().parse().map_err(|_| "expected a number".to_owned())?;
    if value.is_finite() { Ok(value) } else { Err("expected a finite number".to_owned()) }
}

/// A vertical field of view: above 0 and below 180 degrees.
pub fn fov_degrees(text: &str) -> Result<f64, String> {
    let value = number(text)?;
    let inside = 0.0 < value && value < 180.0;
    inside.then_some(value).ok_or_else(|| "expected degrees above 0 and below 180".to_owned())
}

/// An exposure in stops. Beyond ±64 every pixel is black or white whatever the scene.
pub fn exposure_ev(text: &str) -> Result<f64, String> {
    let value = number(text)?;
    (value.abs() <= 64.0).then_some(value).ok_or_else(|| "expected stops from -64 to 64".to_owned())
}

/// A radiance that becomes white: the range that scene files have too.
pub fn white_point(text: &str) -> Result<f64, String> {
    let value = number(text)?;
    (1e-6..=1e6).contains(&value).then_some(value).ok_or_else(|| "expected a radiance from 1e-6 to 1e6".to_owned())
}

/// A limit of `diff`: zero or more.
pub fn limit(text: &str) -> Result<f64, String> {
    let value = number(text)?;
    (value >= 0.0).then_some(value).ok_or_else(|| "expected a number of at least 0".to_owned())
}

/// An error to reach. Below 1e-6 the rounding of 32-bit floats is a part of it.
pub fn target_rmse(text: &str) -> Result<f64, String> {
    let value = number(text)?;
    (1e-6..=1e6).contains(&value).then_some(value).ok_or_else(|| "expected an error from 1e-6 to 1e6".to_owned())
}

/// A time to spend: at most a year.
pub fn seconds(text: &str) -> Result<f64, String> {
    let value = number(text)?;
    let is_time = 0.0 < value && value <= 3.2e7;
    is_time.then_some(value).ok_or_else(|| "expected seconds above 0 and at most 3.2e7".to_owned())
}

/// A limit in decibels.
pub fn decibels(text: &str) -> Result<f64, String> {
    number(text)
}

/// A rectangle `X0,Y0,X1,Y1` with X0 < X1 and Y0 < Y1.
pub fn crop(text: &str) -> Result<Region, String> {
    let expected = || "expected four whole numbers X0,Y0,X1,Y1".to_owned();
    let numbers: Vec<u32> =
        text.split(',').map(|part| part.trim().parse()).collect::<Result<_, _>>().map_err(|_| expected())?;
    let &[x0, y0, x1, y1] = numbers.as_slice() else { return Err(expected()) };
    if x0 >= x1 || y0 >= y1 {
        return Err("the rectangle is empty: expected X0 < X1 and Y0 < Y1".to_owned());
    }
    Ok(Region { x0, y0, x1, y1 })
}

/// The size of an image: `WIDTHxHEIGHT` in pixels.
pub fn resolution(text: &str) -> Result<[u32; 2], String> {
    let lengths: Vec<u32> = text.split('x').map_while(|part| part.trim().parse().ok()).collect();
    match lengths.as_slice() {
        &[width, height] if (1..=65_535).contains(&width) && (1..=65_535).contains(&height) => Ok([width, height]),
        _ => Err("expected WIDTHxHEIGHT from 1x1 to 65535x65535".to_owned()),
    }
}

/// A whole number from 1 to `max`; 1e6 is one.
pub fn count(text: &str, max: u32) -> Result<u32, String> {
    let value = number(&text.replace('_', ""))?;
    let inside = value.fract() == 0.0 && (1.0..=f64::from(max)).contains(&value);
    inside.then_some(value as u32).ok_or_else(|| format!("expected a whole number from 1 to {max}, such as 1e6"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_crop_is_four_numbers_of_a_rectangle_with_area() {
        assert_eq!(crop("1,2,3,5"), Ok(Region { x0: 1, y0: 2, x1: 3, y1: 5 }));
        assert_eq!(crop(" 0, 0, 4, 4"), Ok(Region { x0: 0, y0: 0, x1: 4, y1: 4 }));
        for wrong in ["", "1,2,3", "1,2,3,4,5", "a,b,c,d", "-1,0,4,4", "1.5,0,4,4", "0,0,4294967296,4"] {
            assert!(crop(wrong).unwrap_err().contains("four whole numbers"), "{wrong}");
        }
        for empty in ["3,0,3,4", "0,4,4,4", "4,0,3,4"] {
            assert!(crop(empty).unwrap_err().contains("empty"), "{empty}");
        }
    }

    #[test]
    fn sizes_and_counts_are_whole_and_at_least_one() {
        assert_eq!(resolution("640x480"), Ok([640, 480]));
        for wrong in ["", "640", "640x", "0x1", "1x2x3", "axb", "70000x1"] {
            assert!(resolution(wrong).unwrap_err().contains("WIDTHxHEIGHT"), "{wrong}");
        }
        assert_eq!(count("2.5e3", 5000), Ok(2500));
        assert!(count("0", 9).is_err() && count("10", 9).is_err() && count("1.5", 9).is_err());
    }

    #[test]
    fn numbers_outside_their_range_are_refused() {
        assert_eq!(fov_degrees("60"), Ok(60.0));
        for wrong in ["0", "180", "-1", "nan", "inf", "wide"] {
            assert!(fov_degrees(wrong).is_err(), "{wrong}");
        }
        assert_eq!(exposure_ev("-1.5"), Ok(-1.5));
        assert!(exposure_ev("65").is_err() && exposure_ev("NaN").is_err());
        assert_eq!(white_point("5.6"), Ok(5.6));
        assert!(white_point("0").is_err() && white_point("-1").is_err() && white_point("1e7").is_err());
        assert_eq!(limit("0"), Ok(0.0));
        assert!(limit("-1e-9").is_err() && limit("inf").is_err());
    }
}
