use super::*;
use crate::film::{Plane, Samples};
use crate::measure::pixels::{Pixels, Referred};

const WIDTH: u32 = 90;
const HEIGHT: u32 = 70;

/// Both images of a pair: blocks of many colours, and the same with some of them changed. Every value is a whole number
/// of 64ths, so that other programs can make the same.
fn pair(scale: f32) -> [[Vec<f32>; 3]; 2] {
    let value = |x: u32, y: u32, channel: u32| (x / 4 * 5 + y / 6 * 11 + channel * 17) % 64;
    let changed = |x: u32, y: u32, channel: u32| match (x * x + 3 * y) % 41 {
        0..3 => (value(x, y, channel) + 9 * (channel + 1)) % 64,
        _ => value(x, y, channel),
    };
    let channel = |of: &dyn Fn(u32, u32, u32) -> u32, channel: u32| -> Vec<f32> {
        let places = (0..HEIGHT).flat_map(|y| (0..WIDTH).map(move |x| (x, y)));
        places.map(|(x, y)| of(x, y, channel) as f32 / 64.0 * scale).collect()
    };
    [[0, 1, 2].map(|index| channel(&changed, index)), [0, 1, 2].map(|index| channel(&value, index))]
}

fn flip_of(width_px: u32, referred: Referred, [a, b]: &[[Vec<f32>; 3]; 2]) -> FlipMap {
    let planes = |image: &[Vec<f32>; 3]| image.each_ref().map(|values| Plane::color("", Samples::F32(values.clone())));
    let (a, b) = (planes(a), planes(b));
    flip(&Pixels::new(width_px, referred, &a.each_ref(), &b.each_ref()))
}

fn plain(colors: [[f32; 3]; 2], n_pixels: usize) -> [[Vec<f32>; 3]; 2] {
    colors.map(|color| color.map(|value| vec![value; n_pixels]))
}

#[test]
fn plain_images_have_the_error_of_their_colors_everywhere() {
    // Black and white: HyAB 100, to the power 0.7 25.119; of the largest, 41.28, 0.4 are the knee, 16.51: 0.95 + 0.05 ·
    // (25.119 − 16.51)/(41.28 − 16.51) = 0.9674.
    let map = flip_of(9, Referred::Display, &plain([[0.0; 3], [1.0; 3]], 90));
    assert!(map.errors.iter().all(|error| (error - 0.9674).abs() < 1e-4), "{:?}", map.errors[0]);
    // Linear 0.5 and 0.4: CIE lightness 76.07 and 69.47, HyAB 6.60, to the power 0.7 3.747, times 0.95/16.51: 0.2156.
    let map = flip_of(70, Referred::Display, &plain([[0.5; 3], [0.4; 3]], 140 * 70));
    assert!(map.errors.iter().all(|error| (error - 0.2156).abs() < 2e-4), "{:?}", map.errors[0]);
}

#[test]
fn equal_images_have_no_error_and_one_that_is_clipped_away_none_on_a_screen() {
    let [_, b] = pair(1.0);
    for referred in [Referred::Display, Referred::Scene] {
        assert_eq!(flip_of(WIDTH, referred, &[b.clone(), b.clone()]).mean, 0.0);
    }
    assert_eq!(flip_of(3, Referred::Display, &plain([[7.0; 3], [1.0; 3]], 9)).mean, 0.0);
    assert_eq!(flip_of(3, Referred::Display, &plain([[-7.0; 3], [0.0; 3]], 9)).mean, 0.0);
    let dark = flip_of(3, Referred::Scene, &plain([[0.0; 3], [0.0; 3]], 9));
    assert_eq!(dark.mean, 0.0);
}

#[test]
fn exposures_go_from_the_brightest_pixel_to_the_median() {
    let [r, g, b] = [1.0, 2.0, 4.0, 0.25, 0.125].map(|y| [y; 3]).into_iter().fold(
        [vec![], vec![], vec![]],
        |mut channels: [Vec<f32>; 3], color| {
            channels.iter_mut().zip(color).for_each(|(channel, value)| channel.push(value));
            channels
        },
    );
    let planes = [r, g, b].map(|values| Plane::color("", Samples::F32(values)));
    let planes = planes.each_ref();
    let factors = exposure_factors(&Pixels::new(5, Referred::Scene, &planes, &planes));
    // The median is 1, two stops below the brightest, 4: two exposures, two stops apart.
    assert_eq!(factors.len(), 2);
    assert!((factors[1] / factors[0] - 4.0).abs() < 1e-5);
    assert!((color::aces(factors[0] * 4.0) - 0.85).abs() < 1e-6 && (color::aces(factors[1]) - 0.85).abs() < 1e-6);
}

#[test]
fn a_screen_sees_more_of_a_scene_at_several_exposures_than_at_one() {
    let dark = pair(1.0 / 256.0);
    let display = flip_of(WIDTH, Referred::Display, &dark).mean;
    let scene = flip_of(WIDTH, Referred::Scene, &dark).mean;
    assert!(scene > 4.0 * display, "{scene} {display}");
}

#[test]
fn extreme_values_give_errors_in_their_range() {
    let values = [0.0, f32::MIN_POSITIVE, 1e-40, 1.0, 1e20, f32::MAX, -1.0, f32::MIN];
    let channel = |shift: usize| (0..64).map(|at| values[(at / 3 + at * shift) % values.len()]).collect::<Vec<f32>>();
    let images = [[0, 1, 2].map(channel), [3, 1, 5].map(channel)];
    for referred in [Referred::Display, Referred::Scene] {
        let map = flip_of(8, referred, &images);
        assert!(map.errors.iter().all(|error| (0.0..=1.0).contains(error)), "{:?}", map.errors);
        assert!(map.mean > 0.0);
    }
}

#[test]
fn the_figures_are_those_of_the_authors_program() {
    // flip-evaluator 1.7: LDR with inputsRGB=False, HDR of the pair four times and a 256th as bright.
    let cases = [(Referred::Display, 1.0, LDR), (Referred::Scene, 4.0, HDR), (Referred::Scene, 1.0 / 256.0, HDR)];
    for (referred, scale, expected) in cases {
        let map = flip_of(WIDTH, referred, &pair(scale));
        assert!((map.mean - expected).abs() < TOLERANCE, "{referred:?} {scale}: {} {expected}", map.mean);
    }
}

const LDR: f64 = 0.0;
const HDR: f64 = 0.0;
/// Both compute in f32, whose rounding reaches errors through square roots of differences near zero.
const TOLERANCE: f64 = 1e-5;
