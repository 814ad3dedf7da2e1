//! Images beside maps of their errors, small enough for a page.

use std::io;

use super::engine::Engines;
use super::reference::Reference;
use super::report::{Report, Row};
use crate::film::color_map::sequential;
use crate::film::{Display, Film, Picture, Plane, Region, Samples, png};
use crate::measure::process::Ended;
use crate::render::Control;

/// An image on the page.
#[derive(Clone, Debug)]
pub struct Shown {
    /// What it is.
    pub title: String,
    /// What it took and how wrong it is.
    pub caption: String,
    /// The image as a PNG file.
    pub image: Vec<u8>,
    /// Where it is wrong, as another.
    pub error: Option<Vec<u8>>,
}

/// Images on a page at most, the reference not counted: noise cannot be compressed, and a page should stay below a megabyte.
const MAX_SHOWN: usize = 4;
/// Widest image in pixels; wider ones are averaged down.
const MAX_WIDTH_PX: u32 = 400;

/// Errors of the darkest and the lightest colour; between them colours follow the logarithm.
pub const ERROR_RANGE: [f64; 2] = [1e-4, 1.0];

/// The reference, and of each family of ways the one whose time is nearest to the middle of the front: images of about one
/// cost. They are rendered again.
///
/// # Errors
/// A stop, or a process that fails.
pub fn take(
    engines: &mut Engines,
    reference: &Reference,
    report: &Report,
    control: &Control,
) -> Result<Vec<Shown>, Ended> {
    let image = png_of_image(&reference.film);
    let caption = format!("{} samples a pixel and more; floor {:.1e}", reference.samples, reference.floor);
    let mut shown = vec![Shown { title: "reference".to_owned(), caption, image, error: None }];
    for row in at_one_cost(report) {
        let shot = engines.render(&row.way, engines.frame.settings.seed, control)?;
        let rmse = reference.rmse_of(&shot.film)?.max(report.least);
        shown.push(Shown {
            title: row.way.name(),
            caption: format!("{:.3} s, RMSE {rmse:.1e}", row.seconds.median),
            image: png_of_image(&shot.film),
            error: Some(png_of_error(&shot.film, &reference.film)),
        });
    }
    Ok(shown)
}

fn at_one_cost(report: &Report) -> Vec<&Row> {
    let front =
        || report.rows.iter().filter(|row| row.on_front).map(|row| row.seconds.median.max(f64::MIN_POSITIVE).ln());
    let middle = 0.5 * (front().fold(f64::INFINITY, f64::min) + front().fold(f64::NEG_INFINITY, f64::max));
    let distance = |row: &Row| (row.seconds.median.max(f64::MIN_POSITIVE).ln() - middle).abs();
    let mut chosen: Vec<&Row> = Vec::new();
    for row in &report.rows {
        match chosen.iter_mut().find(|other| other.way.family() == row.way.family()) {
            Some(other) if distance(row) < distance(other) => *other = row,
            Some(_) => {}
            None => chosen.push(row),
        }
    }
    // Families of several ways come before variants of a single one.
    let members = |row: &Row| report.rows.iter().filter(|other| other.way.family() == row.way.family()).count();
    chosen.sort_by_key(|row| std::cmp::Reverse(members(row)));
    chosen.truncate(MAX_SHOWN);
    chosen
}

/// Red, green and blue, averaged down to what a page shows.
struct Reduced {
    width_px: u32,
    rgb: Vec<[f64; 3]>,
}

fn reduced(film: &Film, value: impl Fn(usize) -> [f64; 3]) -> Reduced {
    let (width, height) = (film.data_window.width_px(), film.data_window.height_px());
    let factor = width.div_ceil(MAX_WIDTH_PX).max(1);
    let (out_width, out_height) = (width.div_ceil(factor), height.div_ceil(factor));
    let mut rgb = Vec::with_capacity((out_width * out_height) as usize);
    for (y, x) in (0..out_height).flat_map(|y| (0..out_width).map(move |x| (y * factor, x * factor))) {
        let (mut sum, mut n) = ([0.0; 3], 0.0);
        for (y, x) in (y..(y + factor).min(height)).flat_map(|y| (x..(x + factor).min(width)).map(move |x| (y, x))) {
            let value = value((y * width + x) as usize);
            sum = [0, 1, 2].map(|channel| sum[channel] + value[channel]);
            n += 1.0;
        }
        rgb.push(sum.map(|sum| sum / n));
    }
    Reduced { width_px: out_width, rgb }
}

fn colors(film: &Film) -> impl Fn(usize) -> [f64; 3] + '_ {
    let planes = film.color_planes();
    move |index| planes.map_or([0.0; 3], |planes| planes.map(|plane| plane.samples.get(index)))
}

fn png_of_image(film: &Film) -> Vec<u8> {
    png_of(&reduced(film, colors(film)), &Display::Picture(Picture::default()))
}

/// The largest error of a channel, by colour.
fn png_of_error(film: &Film, reference: &Film) -> Vec<u8> {
    let (own, truth) = (colors(film), colors(reference));
    let mut errors = reduced(film, |index| {
        let (own, truth) = (own(index), truth(index));
        let largest = (0..3).map(|channel| (own[channel] - truth[channel]).abs()).fold(0.0, f64::max);
        [largest; 3]
    });
    let [least, most] = ERROR_RANGE;
    for value in &mut errors.rgb {
        let share = (value[0].max(least) / least).ln() / (most / least).ln();
        // The middle of what the linear bytes of this display make one level of.
        *value = sequential(share).map(|byte| (f64::from(byte) + 0.5) / 256.0);
    }
    png_of(&errors, &Display::Course)
}

fn png_of(image: &Reduced, display: &Display) -> Vec<u8> {
    let (width_px, height_px) = (image.width_px, image.rgb.len() as u32 / image.width_px.max(1));
    let plane = |channel: usize| {
        let values = image.rgb.iter().map(|rgb| rgb[channel] as f32).collect();
        Plane::color(["R", "G", "B"][channel], Samples::F32(values))
    };
    let planes = [0, 1, 2].map(plane).into();
    let film = Film { width_px, height_px, data_window: Region::whole(width_px, height_px), planes };
    let mut file = io::Cursor::new(Vec::new());
    // A film of three planes is written to memory without fail.
    let _ = png::write(&film, display, &mut file);
    file.into_inner()
}

/// Bytes in the base 64 of RFC 4648, section 4.
pub fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for group in bytes.chunks(3) {
        let bits = group.iter().chain(&[0; 2]).take(3).fold(0_u32, |bits, &byte| bits << 8 | u32::from(byte));
        for digit in 0..4 {
            let is_padding = digit > group.len();
            let value = bits >> (18 - 6 * digit) & 63;
            text.push(if is_padding { '=' } else { char::from(DIGITS[value as usize]) });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base_64_is_that_of_the_standards_test_vectors() {
        let vectors =
            [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foob", "Zm9vYg=="), ("foobar", "Zm9vYmFy")];
        for (text, encoded) in vectors {
            assert_eq!(base64(text.as_bytes()), encoded);
        }
        assert_eq!(base64(&[0xff, 0xfe, 0xfb]), "//77");
    }

    #[test]
    fn wide_images_are_averaged_and_errors_coloured_by_their_logarithm() {
        let film = |value: f32, width_px: u32| {
            let planes =
                ["R", "G", "B"].map(|name| Plane::color(name, Samples::F32(vec![value; 2 * width_px as usize])));
            Film { width_px, height_px: 2, data_window: Region::whole(width_px, 2), planes: planes.into() }
        };
        let decode = |bytes: &[u8]| png::decode(bytes, None, std::path::Path::new("memory")).unwrap();
        let wide = decode(&png_of_image(&film(0.5, 900)));
        assert_eq!((wide.film.width_px, wide.film.height_px), (300, 1));
        let error = |value: f32| decode(&png_of_error(&film(value, 4), &film(0.0, 4))).rgb8.unwrap()[0];
        assert_eq!((error(0.0), error(1.0), error(0.1)), (sequential(0.0), sequential(1.0), sequential(0.75)));
    }
}
