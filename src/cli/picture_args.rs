//! Options that say how radiance becomes a picture, of `render` and of `tonemap`.

use clap::error::ErrorKind;
use clap::{Args, ValueEnum};

use super::failure::Failure;
use super::value;
use crate::film::tone_map::hable;
use crate::film::{BitDepth, Picture, ToneMap};
use crate::scene::{RenderKeys, ToneMapKey};

/// The names of these options, for what they conflict with.
pub const PICTURE_OPTIONS: [&str; 4] = ["tonemap", "exposure", "white_point", "png_bits"];

/// How radiance becomes a picture.
#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = "Picture")]
pub struct PictureArgs {
    /// Tone curve of the PNG; the EXR is scene-linear [default: khronos-neutral]
    #[arg(long, value_name = "OP")]
    pub tonemap: Option<ToneMapArg>,
    /// Exposure of the PNG in stops [default: 0]
    #[arg(long, value_name = "EV", value_parser = value::exposure_ev, allow_negative_numbers = true)]
    pub exposure: Option<f64>,
    /// Radiance that becomes white, after exposure; of reinhard [default: none] and hable [default: 5.6]
    #[arg(long, value_name = "X", value_parser = value::white_point)]
    pub white_point: Option<f64>,
    /// Bits of a sample of the PNG [default: 8]
    #[arg(long, value_name = "BITS")]
    pub png_bits: Option<PngBitsArg>,
}

/// `--tonemap`
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ToneMapArg {
    /// Cut at 1
    Clip,
    /// Reinhard et al. 2002, by channel
    Reinhard,
    /// Uncharted 2
    Hable,
    /// Stephen Hill's fit of ACES
    AcesHill,
    /// Khronos PBR Neutral
    KhronosNeutral,
    /// Benjamin Wrensch's approximation of AgX
    AgxApprox,
}

/// `--png-bits`
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum PngBitsArg {
    /// 256 levels
    #[value(name = "8")]
    Eight,
    /// 65536 levels
    #[value(name = "16")]
    Sixteen,
}

/// Settles the picture: the command line over the scene over the defaults. The white point of a scene is one of its own
/// operator: it is dropped when the command line chooses one that has none.
///
/// # Errors
/// Wrong usage: `--white-point` for an operator that has none.
pub fn settle(args: &PictureArgs, scene: &RenderKeys, command: &str) -> Result<Picture, Failure> {
    let operator = args.tonemap.or(scene.tone_map.map(arg_of_key)).unwrap_or(ToneMapArg::KhronosNeutral);
    let white = args.white_point.or(scene.white_point);
    let tone_map = match operator {
        ToneMapArg::Reinhard => ToneMap::Reinhard { white },
        ToneMapArg::Hable => ToneMap::Hable { white: white.unwrap_or(hable::DEFAULT_WHITE) },
        _ if args.white_point.is_some() => {
            let name = operator.to_possible_value().map(|value| value.get_name().to_owned()).unwrap_or_default();
            let message = format!("'{name}' has no white point: '--white-point' goes with reinhard and hable");
            return Err(Failure::usage(command, ErrorKind::ArgumentConflict, message));
        }
        ToneMapArg::Clip => ToneMap::Clip,
        ToneMapArg::AcesHill => ToneMap::AcesHill,
        ToneMapArg::KhronosNeutral => ToneMap::KhronosNeutral,
        ToneMapArg::AgxApprox => ToneMap::AgxApprox,
    };
    let exposure_stops = args.exposure.or(scene.exposure_ev).unwrap_or(0.0);
    let bit_depth = match args.png_bits {
        None | Some(PngBitsArg::Eight) => BitDepth::Eight,
        Some(PngBitsArg::Sixteen) => BitDepth::Sixteen,
    };
    Ok(Picture { tone_map, exposure_stops, bit_depth })
}

fn arg_of_key(key: ToneMapKey) -> ToneMapArg {
    match key {
        ToneMapKey::Clip => ToneMapArg::Clip,
        ToneMapKey::Reinhard => ToneMapArg::Reinhard,
        ToneMapKey::Hable => ToneMapArg::Hable,
        ToneMapKey::AcesHill => ToneMapArg::AcesHill,
        ToneMapKey::KhronosNeutral => ToneMapArg::KhronosNeutral,
        ToneMapKey::AgxApprox => ToneMapArg::AgxApprox,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_overrules_the_scene_and_drops_a_white_point_that_does_not_fit() {
        let scene = RenderKeys {
            tone_map: Some(ToneMapKey::Hable),
            white_point: Some(3.0),
            exposure_ev: Some(1.0),
            ..RenderKeys::default()
        };
        let settled = |args: PictureArgs| settle(&args, &scene, "render").unwrap();
        let of_scene = settled(PictureArgs::default());
        assert_eq!(of_scene.tone_map, ToneMap::Hable { white: 3.0 });
        assert_eq!((of_scene.exposure_stops, of_scene.bit_depth), (1.0, BitDepth::Eight));

        let tonemap = |arg| PictureArgs { tonemap: Some(arg), ..PictureArgs::default() };
        assert_eq!(settled(tonemap(ToneMapArg::Clip)).tone_map, ToneMap::Clip);
        assert_eq!(settled(tonemap(ToneMapArg::Reinhard)).tone_map, ToneMap::Reinhard { white: Some(3.0) });
        let asked = PictureArgs {
            exposure: Some(-1.0),
            white_point: Some(8.0),
            png_bits: Some(PngBitsArg::Sixteen),
            ..PictureArgs::default()
        };
        let expected =
            Picture { tone_map: ToneMap::Hable { white: 8.0 }, exposure_stops: -1.0, bit_depth: BitDepth::Sixteen };
        assert_eq!(settled(asked), expected);
    }

    #[test]
    fn the_defaults_are_the_published_operators() {
        let scene = RenderKeys::default();
        let settled = |args: PictureArgs| settle(&args, &scene, "render").unwrap();
        assert_eq!(settled(PictureArgs::default()), Picture::default());
        let tonemap = |arg| PictureArgs { tonemap: Some(arg), ..PictureArgs::default() };
        assert_eq!(settled(tonemap(ToneMapArg::Hable)).tone_map, ToneMap::Hable { white: 5.6 });
        assert_eq!(settled(tonemap(ToneMapArg::Reinhard)).tone_map, ToneMap::Reinhard { white: None });
    }

    #[test]
    fn a_white_point_for_an_operator_without_one_is_wrong_usage() {
        for tonemap in [None, Some(ToneMapArg::Clip), Some(ToneMapArg::AcesHill), Some(ToneMapArg::AgxApprox)] {
            let args = PictureArgs { tonemap, white_point: Some(2.0), ..PictureArgs::default() };
            assert!(matches!(settle(&args, &RenderKeys::default(), "tonemap"), Err(Failure::Usage(_))), "{args:?}");
        }
    }
}
