//! Values as they stand in a file.

use half::f16;
use half::slice::HalfFloatSliceExt;

use crate::film::rows::RowSamples;
use ::exr::meta::attribute::SampleType;

/// Appends values in the byte order of the machine.
pub(super) fn append(bytes: &mut Vec<u8>, values: RowSamples, sample_type: SampleType) {
    match (values, sample_type) {
        (RowSamples::F32(values), SampleType::F16) => append_halves(bytes, values.iter().copied()),
        (RowSamples::F64(values), SampleType::F16) => append_halves(bytes, values.iter().map(|&v| rounded_to_odd(v))),
        (RowSamples::F32(values), _) => bytes.extend(values.iter().flat_map(|value| value.to_ne_bytes())),
        (RowSamples::F64(values), _) => bytes.extend(values.iter().flat_map(|&value| (value as f32).to_ne_bytes())),
        (RowSamples::U32(values), _) => bytes.extend(values.iter().flat_map(|value| value.to_ne_bytes())),
    }
}

/// Values that are converted at a time.
const CHUNK: usize = 64;

fn append_halves(bytes: &mut Vec<u8>, mut values: impl Iterator<Item = f32>) {
    let (mut floats, mut halves) = ([0.0_f32; CHUNK], [f16::ZERO; CHUNK]);
    loop {
        let mut n = 0;
        for (float, value) in floats.iter_mut().zip(&mut values) {
            *float = in_range_of_half(value);
            n += 1;
        }
        halves[..n].convert_from_f32_slice(&floats[..n]);
        bytes.extend(halves[..n].iter().flat_map(|half| half.to_ne_bytes()));
        if n < CHUNK {
            return;
        }
    }
}

/// Finite values stay finite: one infinity, filtered or blurred in a compositor, spreads over the picture.
#[inline]
fn in_range_of_half(value: f32) -> f32 {
    const LARGEST: f32 = 65504.0;
    if value.is_infinite() { value } else { value.clamp(-LARGEST, LARGEST) }
}

/// The 32-bit float next to a double in the direction of zero, its last bit set when it is not the double itself: rounded
/// to 16 bits, it becomes what the double would (Boldo and Melquiond, *Emulation of FMA and correctly rounded sums: proved
/// algorithms using rounding to odd*, 2008). Rounding to nearest twice would not.
#[inline]
fn rounded_to_odd(value: f64) -> f32 {
    let nearest = value as f32;
    if f64::from(nearest) == value || value.is_nan() {
        return nearest;
    }
    let is_away_from_zero = f64::from(nearest).abs() > value.abs();
    f32::from_bits((nearest.to_bits() - u32::from(is_away_from_zero)) | 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn half_of(values: RowSamples) -> u16 {
        let mut bytes = Vec::new();
        append(&mut bytes, values, SampleType::F16);
        u16::from_ne_bytes([bytes[0], bytes[1]])
    }

    fn of_f32(value: f32) -> u16 {
        half_of(RowSamples::F32(&[value]))
    }

    fn of_f64(value: f64) -> u16 {
        half_of(RowSamples::F64(&[value]))
    }

    /// The next half above and the middle between the two, both exact.
    fn middle(bits: u16) -> (f64, u16) {
        let (low, high) = (f16::from_bits(bits).to_f64(), f16::from_bits(bits + 1).to_f64());
        (0.5 * (low + high), if bits.is_multiple_of(2) { bits } else { bits + 1 })
    }

    #[test]
    fn every_half_comes_back_and_middles_go_to_the_even_one() {
        for bits in 0..0x7bff_u16 {
            let value = f16::from_bits(bits);
            assert_eq!((of_f32(value.to_f32()), of_f64(value.to_f64())), (bits, bits));
            assert_eq!(of_f32(-value.to_f32()), bits | 0x8000);
            let (middle, even) = middle(bits);
            assert_eq!((of_f32(middle as f32), of_f64(middle)), (even, even), "{middle}");
            let (below, above) = (f32::next_down(middle as f32), f32::next_up(middle as f32));
            assert_eq!((of_f32(below), of_f32(above)), (bits, bits + 1));
            // So near to the middle that a float in between could not tell.
            assert_eq!((of_f64(middle.next_down()), of_f64(middle.next_up())), (bits, bits + 1));
        }
    }

    #[test]
    fn finite_values_stay_finite_and_the_others_what_they_are() {
        for value in [65504.0, 65519.0, 65520.0, 1e9, f32::MAX] {
            assert_eq!((of_f32(value), of_f32(-value)), (0x7bff, 0xfbff), "{value}");
            assert_eq!(of_f64(f64::from(value)), 0x7bff);
        }
        assert_eq!((of_f64(1e300), of_f64(f64::MIN)), (0x7bff, 0xfbff));
        assert_eq!((of_f32(f32::INFINITY), of_f64(f64::NEG_INFINITY)), (0x7c00, 0xfc00));
        assert_eq!((of_f32(-0.0), of_f64(-1e-300), of_f32(1e-45)), (0x8000, 0x8000, 0));
        assert!(f16::from_bits(of_f32(f32::NAN)).is_nan() && f16::from_bits(of_f64(f64::NAN)).is_nan());
    }

    #[test]
    fn long_rows_are_converted_whole() {
        let values: Vec<f32> = (0..200).map(|at| at as f32).collect();
        for n in [0, 63, 64, 65, 128, 200] {
            let mut bytes = vec![7];
            append(&mut bytes, RowSamples::F32(&values[..n]), SampleType::F16);
            let halves = bytes[1..].chunks_exact(2).map(|b| f16::from_ne_bytes([b[0], b[1]]).to_f32());
            assert!(halves.eq(values[..n].iter().copied()), "{n}");
        }
    }
}
