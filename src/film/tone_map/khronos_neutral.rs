//! The Khronos PBR Neutral tone curve.
//!
//! Source: Khronos Group, *PBR Neutral Tone Mapper* specification (repository `ToneMapping`, folder `PBR_Neutral`), with
//! its constants F₉₀ = 0.04, start of compression 0.8 − F₉₀, desaturation 0.15.

/// The display values of a colour. Colours whose largest channel is below 0.8 only lose the offset, the 4 % that a dielectric
/// reflects at normal incidence (less where the smallest channel is below 0.08); brighter ones are compressed and drawn
/// towards white.
#[inline]
pub fn map(color: [f64; 3]) -> [f64; 3] {
    const F90: f64 = 0.04;
    const START_COMPRESSION: f64 = 0.8 - F90;
    const DESATURATION: f64 = 0.15;

    let smallest = color[0].min(color[1]).min(color[2]);
    let offset = if smallest < 2.0 * F90 { smallest - smallest * smallest / (4.0 * F90) } else { F90 };
    let color = color.map(|c| c - offset);

    let peak = color[0].max(color[1]).max(color[2]);
    if peak < START_COMPRESSION {
        return color;
    }
    let room = 1.0 - START_COMPRESSION;
    let new_peak = 1.0 - room * room / (peak + room - START_COMPRESSION);
    let whiteness = 1.0 - 1.0 / (DESATURATION * (peak - new_peak) + 1.0);
    color.map(|c| {
        let scaled = c * (new_peak / peak);
        scaled * (1.0 - whiteness) + new_peak * whiteness
    })
}
