//! A film with planes of every kind, and all that an EXR file may be.

use flatray::film::exr::{ColorType, ExrCompression, ExrLayout, ExrOptions, ExrParts};
use flatray::film::{Film, Plane, Region, Samples};

/// Bits of a fixed function of place and plane.
fn hash(x: u32, y: u32, salt: u32) -> u32 {
    let mut bits = x.wrapping_mul(0x9e37_79b9) ^ y.wrapping_mul(0x85eb_ca6b) ^ salt.wrapping_mul(0xc2b2_ae35);
    bits ^= bits >> 15;
    bits = bits.wrapping_mul(0x2c1b_3c6d);
    bits ^ bits >> 12
}

/// A slope with noise, and now and then a value at the border of what 16 bits can say.
fn color(x: u32, y: u32, salt: u32) -> f32 {
    const SPECIAL: [f32; 10] =
        [f32::INFINITY, f32::NEG_INFINITY, -0.0, 1e9, -65520.0, 65519.0, 1e-8, 6e-5, f32::NAN, f32::MIN_POSITIVE];
    let bits = hash(x, y, salt);
    match bits % 64 {
        at @ 0..10 => SPECIAL[at as usize],
        _ => x as f32 / 64.0 + y as f32 / 100.0 + (bits >> 20) as f32 / 4096.0,
    }
}

/// Any float but NaN.
fn any_float(x: u32, y: u32, salt: u32) -> f32 {
    let value = f32::from_bits(hash(x, y, salt));
    if value.is_nan() { -0.0 } else { value }
}

/// A part of a film of 150×100 pixels: colour, a lobe, depth, ids and the ranks of a Cryptomatte. What a pixel holds depends on
/// its place alone.
pub fn layered_film(data_window: Region) -> Film {
    let places =
        || (data_window.y0..data_window.y1).flat_map(|y| (data_window.x0..data_window.x1).map(move |x| (x, y)));
    let f32s = |value: fn(u32, u32, u32) -> f32, salt| Samples::F32(places().map(|(x, y)| value(x, y, salt)).collect());
    let names = ["R", "G", "B", "A", "diffuse.R", "diffuse.G", "diffuse.B"];
    let mut planes: Vec<Plane> = (0..).zip(names).map(|(salt, name)| Plane::color(name, f32s(color, salt))).collect();
    planes.push(Plane::data("Z", f32s(|x, y, _| 1.0 + x as f32 * 0.37 + y as f32, 0)));
    planes.push(Plane::data("object.I", Samples::U32(places().map(|(x, y)| hash(x / 20, y / 20, 9)).collect())));
    planes.push(Plane::data("CryptoObject00.R", f32s(any_float, 10)));
    planes.push(Plane::data("CryptoObject01.R", f32s(any_float, 11)));
    Film { width_px: 150, height_px: 100, data_window, planes }
}

/// Everything that an EXR file may be, with a name.
pub fn all_options() -> Vec<(String, ExrOptions)> {
    use ExrCompression::{None, Piz, Rle, Zip, Zips};
    let mut all = Vec::new();
    for compression in [None, Rle, Zips, Zip, Piz] {
        for layout in [ExrLayout::Scanlines, ExrLayout::Tiles] {
            for color in [ColorType::Half, ColorType::Float] {
                for parts in [ExrParts::Single, ExrParts::Multi] {
                    let options = ExrOptions { color, compression, layout, parts };
                    all.push((format!("{compression:?}_{layout:?}_{color:?}_{parts:?}").to_lowercase(), options));
                }
            }
        }
    }
    all
}
