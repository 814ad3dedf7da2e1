use super::*;

const ALL: [ToneMap; 8] = [
    ToneMap::Clip,
    ToneMap::Reinhard { white: None },
    ToneMap::Reinhard { white: Some(4.0) },
    ToneMap::Hable { white: hable::DEFAULT_WHITE },
    ToneMap::Hable { white: 0.5 },
    ToneMap::AcesHill,
    ToneMap::KhronosNeutral,
    ToneMap::AgxApprox,
];

fn expose(radiance: f64, exposure_stops: f64) -> f64 {
    expose_by(radiance, exposure_factor(exposure_stops))
}

fn display(tone_map: ToneMap, color: [f64; 3]) -> [f64; 3] {
    tone_map.operator().map(color.map(|c| expose(c, 0.0)))
}

fn srgb8(tone_map: ToneMap, color: [f64; 3]) -> [u8; 3] {
    display(tone_map, color).map(|c| quantize8(srgb_from_linear(c)))
}

/// What few operations on numbers of about 1 round by, in units of their last place (`docs/NUMERICS.md`, "Constants
/// elsewhere").
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// The same for the dozens of operations of a whole curve.
const CURVE_ROUNDING: f64 = 40.0 * f64::EPSILON;

/// The same for the difference of neighbouring greys.
const NEIGHBOUR_ROUNDING: f64 = 10.0 * f64::EPSILON;

/// The same for the AgX polynomial: 7 terms of up to 40, which cancel.
const AGX_ROUNDING: f64 = 7.0 * 40.0 * f64::EPSILON;

/// What the last row of Hill's output matrix, which sums to 0.99999, makes greys differ by.
const HILL_GREY: f64 = 1e-5;

/// Less than what a hundredth below a white point is below white by, at the largest white point that is tested: a bound from
/// below.
const LEAST_BELOW_WHITE: f64 = 1e-6;

#[track_caller]
fn assert_near(found: [f64; 3], expected: [f64; 3], tolerance: f64) {
    let near = found.iter().zip(expected).all(|(found, expected)| (found - expected).abs() <= tolerance);
    assert!(near, "{found:?} is not {expected:?}");
}

#[test]
fn greys_get_the_published_bytes() {
    let published = [
        (ToneMap::Clip, [118, 255, 255, 255]),
        (ToneMap::Reinhard { white: None }, [109, 188, 231, 248]),
        (ToneMap::AcesHill, [91, 206, 245, 254]),
        (ToneMap::Hable { white: hable::DEFAULT_WHITE }, [100, 186, 246, 255]),
        (ToneMap::KhronosNeutral, [105, 240, 253, 255]),
        (ToneMap::AgxApprox, [128, 202, 239, 254]),
    ];
    for (tone_map, bytes) in published {
        assert_eq!(srgb8(tone_map, [0.0; 3]), [0; 3], "{tone_map:?}");
        for (grey, byte) in [0.18, 1.0, 4.0, 16.0].into_iter().zip(bytes) {
            assert_eq!(srgb8(tone_map, [grey; 3]), [byte; 3], "{tone_map:?} of grey {grey}");
        }
    }
}

#[test]
fn of_two_greys_the_brighter_never_comes_out_darker() {
    /// From one grey to the next around a joint, as a share of it.
    const STEP: f64 = 1e-8;
    /// No operator rises by more when grey grows by a share of itself, in units of that share.
    const STEEPEST: f64 = 1.0;
    for tone_map in ALL {
        let operator = tone_map.operator();
        let mut darker = [0.0; 3];
        // Twelve decades, and densely around the joints: of Khronos, of the ends of the logarithm, of white.
        let decades = (0..=1_200_000).map(|step| libm::exp10(f64::from(step) / 100_000.0 - 6.0));
        let joints = [0.08, 0.8, libm::exp2(-12.473_93), libm::exp2(4.026_069), 1.0, 4.0, 5.6, 0.5];
        let around = |joint: f64| (0..2000).map(move |step| joint * (1.0 + STEP * f64::from(step - 1000)));
        for grey in decades {
            let brighter = operator.map([grey; 3]);
            assert!(brighter.iter().all(|c| (0.0..=1.0).contains(c)), "{tone_map:?} of {grey}: {brighter:?}");
            assert!((0..3).all(|c| brighter[c] >= darker[c]), "{tone_map:?} at {grey}: {darker:?} {brighter:?}");
            darker = brighter;
        }
        for joint in joints {
            let mut darker = [0.0; 3];
            for grey in around(joint) {
                let brighter = operator.map([grey; 3]);
                // Neighbours this close may be turned round by rounding alone.
                let allowed = NEIGHBOUR_ROUNDING;
                assert!((0..3).all(|c| brighter[c] >= darker[c] - allowed), "{tone_map:?} at {grey}");
                assert!(
                    darker[0] == 0.0 || brighter[0] - darker[0] <= 1.001 * STEEPEST * STEP + allowed,
                    "{tone_map:?} jumps at {grey}"
                );
                darker = brighter;
            }
        }
    }
}

#[test]
fn greys_stay_grey() {
    for tone_map in ALL {
        for step in 0..=1200 {
            let [r, g, b] = display(tone_map, [libm::exp10(f64::from(step) / 100.0 - 6.0); 3]);
            let allowed = if tone_map == ToneMap::AcesHill { HILL_GREY + CURVE_ROUNDING } else { AGX_ROUNDING };
            assert!((r - g).abs() <= allowed && (r - b).abs() <= allowed, "{tone_map:?}: {r} {g} {b}");
        }
    }
}

#[test]
fn every_colour_stays_in_the_displays_range() {
    let steps: Vec<f64> = (0..=24).map(|step| libm::exp10(f64::from(step) / 2.0 - 6.0)).chain([0.0]).collect();
    for tone_map in ALL {
        for &r in &steps {
            for &g in &steps {
                for &b in &steps {
                    let mapped = display(tone_map, [r, g, b]);
                    assert!(mapped.iter().all(|c| (0.0..=1.0).contains(c)), "{tone_map:?}: {mapped:?}");
                }
            }
        }
    }
}

#[test]
fn nan_and_negative_radiance_is_black_and_infinite_is_white() {
    for tone_map in ALL {
        assert_eq!(srgb8(tone_map, [f64::NAN; 3]), [0; 3], "{tone_map:?}");
        assert_eq!(srgb8(tone_map, [-1.0, f64::NEG_INFINITY, -0.0]), [0; 3], "{tone_map:?}");
        assert_eq!(srgb8(tone_map, [f64::INFINITY; 3]), [255; 3], "{tone_map:?}");
    }
    assert_eq!(srgb8(ToneMap::KhronosNeutral, [f64::INFINITY, 0.0, f64::NAN]), [255; 3]);
    assert_eq!(srgb8(ToneMap::Reinhard { white: Some(2.0) }, [f64::INFINITY, 0.0, f64::NAN]), [255, 0, 0]);
    assert_eq!(expose(0.0, 5000.0), 0.0);
    assert_eq!(expose(1.0, -5000.0), 0.0);
}

#[test]
fn a_stop_of_exposure_doubles() {
    assert_eq!(expose(0.25, 1.0), 0.5);
    assert_eq!(expose(0.25, -2.0), 0.0625);
}

#[test]
fn the_white_point_is_the_least_radiance_that_is_white() {
    for white in [1e-3, 0.5, 1.0, 5.6, 1e3] {
        for tone_map in [ToneMap::Reinhard { white: Some(white) }, ToneMap::Hable { white }] {
            let at = display(tone_map, [white, white * 0.99, white * 2.0]);
            assert!(
                (at[0] - 1.0).abs() <= CURVE_ROUNDING && at[1] < 1.0 - LEAST_BELOW_WHITE && at[2] == 1.0,
                "{tone_map:?}: {at:?}"
            );
        }
    }
    // Equation 4 by hand: 2·(1 + 2/16)/(1 + 2) and 1·(1 + 1/16)/2.
    let mapped = display(ToneMap::Reinhard { white: Some(4.0) }, [2.0, 1.0, 0.0]);
    assert_near(mapped, [0.75, 0.53125, 0.0], ROUNDING);
    // The farther white is, the nearer is equation 3: they differ by x²/(w²·(1 + x)).
    let difference = 3.0 * 3.0 / (1e6 * 1e6 * 4.0);
    let mapped = display(ToneMap::Reinhard { white: Some(1e6) }, [3.0, 1.0, 0.25]);
    assert_near(mapped, [0.75, 0.5, 0.2], difference + ROUNDING);
}

#[test]
fn channel_by_channel_operators_do_not_mix_channels() {
    assert_eq!(display(ToneMap::Clip, [2.0, 0.5, 0.1]), [1.0, 0.5, 0.1]);
    assert_near(display(ToneMap::Reinhard { white: None }, [3.0, 1.0, 0.0]), [0.75, 0.5, 0.0], ROUNDING);
    // The published form, with both fractions apart.
    let f = |x: f64| (x * (0.15 * x + 0.05) + 0.004) / (x * (0.15 * x + 0.5) + 0.06) - 0.02 / 0.3;
    let expected = [2.0, 0.5, 0.1].map(|c: f64| f(2.0 * c) / f(11.2));
    assert_near(display(ToneMap::Hable { white: hable::DEFAULT_WHITE }, [2.0, 0.5, 0.1]), expected, CURVE_ROUNDING);
}

// Colours through the operators that mix channels were worked out beside this program, in another language, from the published
// listings; the bound for AgX is what balancing its rows changes.

#[test]
fn saturated_colours_go_through_hills_matrices() {
    let mapped = display(ToneMap::AcesHill, [1.0, 0.0, 0.0]);
    assert_near(mapped, [0.688_027_874_341_686_1, 0.0, 0.002_639_006_746_677_132], CURVE_ROUNDING);
    let mapped = display(ToneMap::AcesHill, [0.0, 0.0, 4.0]);
    assert_near(
        mapped,
        [0.111_528_013_423_718_2, 0.004_823_176_555_677_580_5, 0.953_880_624_985_007_7],
        CURVE_ROUNDING,
    );
    let mapped = display(ToneMap::AcesHill, [2.0, 0.5, 0.1]);
    assert_near(mapped, [0.901_499_261_236_591_6, 0.418_689_446_118_982_34, 0.105_000_790_760_897_1], CURVE_ROUNDING);
}

#[test]
fn saturated_colours_go_through_the_inset_and_outset_of_agx() {
    assert_eq!(srgb8(ToneMap::AgxApprox, [1.0, 0.0, 0.0]), [221, 56, 56]);
    assert_eq!(srgb8(ToneMap::AgxApprox, [0.0, 0.0, 4.0]), [146, 146, 249]);
    let expected = [0.907_278_363_852_791_5, 0.695_351_447_308_721_9, 0.492_681_067_538_440_43];
    let mapped = display(ToneMap::AgxApprox, [2.0, 0.5, 0.1]).map(|c| libm::pow(c, 1.0 / 2.2));
    // The rows of the matrices are balanced by up to 1.7e-4: of the outset, and of the inset by 1.7e-4/ln 2 of 16.5 stops on a
    // slope of 2.07 at most.
    let balanced = 1.7e-4 + 2.07 * 1.7e-4 / (std::f64::consts::LN_2 * 16.5);
    assert_near(mapped, expected, balanced);
}

#[test]
fn below_khronos_start_of_compression_only_the_offset_is_taken() {
    for color in [[0.08, 0.3, 0.7], [0.1, 0.79, 0.2]] {
        assert_near(khronos_neutral::map(color), color.map(|c| c - 0.04), ROUNDING);
    }
    // With no white in the colour nothing is taken at all.
    assert_eq!(khronos_neutral::map([0.0, 0.5, 0.7]), [0.0, 0.5, 0.7]);
}

#[test]
fn bright_colours_are_compressed_and_whitened_as_khronos_says() {
    let mapped = display(ToneMap::KhronosNeutral, [2.0, 0.5, 0.1]);
    assert_near(mapped, [0.96, 0.321_135_758_651_286_5, 0.150_771_960_958_296_26], CURVE_ROUNDING);
    let mapped = display(ToneMap::KhronosNeutral, [0.0, 0.0, 4.0]);
    assert_near(mapped, [0.306_367_415_504_061_3, 0.306_367_415_504_061_3, 0.983_448_275_862_069], CURVE_ROUNDING);
    let mapped = display(ToneMap::KhronosNeutral, [5.0, 0.02, 0.5]);
    assert_near(mapped, [0.987_092_436_974_789_8, 0.370_203_617_768_064_6, 0.429_662_781_065_098_36], CURVE_ROUNDING);
}

#[test]
fn bright_saturated_colours_go_towards_white() {
    for tone_map in [ToneMap::KhronosNeutral, ToneMap::AgxApprox, ToneMap::AcesHill] {
        let mild = display(tone_map, [2.0, 0.0, 0.0]);
        let strong = display(tone_map, [200.0, 0.0, 0.0]);
        assert!(strong[2] > mild[2] && strong[2] < strong[0], "{tone_map:?}: {mild:?} {strong:?}");
    }
}
