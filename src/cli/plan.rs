//! Settles how to render: the command line over the scene's `[render]` table over the defaults.

use clap::error::ErrorKind;

use super::args::{AccelArg, CompatArg, FilterArg, RenderArgs, SamplerArg, UpArg, missing_isa};
use super::budget::{self, Budget};
use super::exr_args::{CropOutputArg, ExrList};
use super::failure::Failure;
use super::{output, picture_args};
use crate::accel::{AccelKind, Preset};
use crate::film::{Display, Region};
use crate::render::{Filter, Sampler, Settings, Spread};
use crate::scene::{Compiled, FilterKey, Overrides, RenderKeys, SamplerKey, UpAxis};
use crate::simd::Isa;

const DEFAULT_SAMPLES: u32 = 16;
const DEFAULT_MAX_DEPTH: u32 = 5;
/// A third of the first step of 8-bit sRGB, 1/255 of 1/12.92.
const DEFAULT_CUTOFF: f64 = 1e-4;
const DEFAULT_TILE_SIZE_PX: u32 = 32;

/// The original's 2×2 samples and depth.
const COURSE_SAMPLES: u32 = 4;
const COURSE_MAX_DEPTH: u32 = 5;

/// Everything that is settled before a render starts.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// How to render.
    pub settings: Settings,
    /// What it may cost.
    pub budget: Budget,
    /// How to find hits.
    pub accel: AccelKind,
    /// What to spend on the tree.
    pub preset: Preset,
    /// Instruction set.
    pub isa: Isa,
    /// What PNGs show.
    pub display: Display,
    /// What EXR files are.
    pub exr: ExrList,
    /// Whether the files of a crop are padded to the whole image.
    pub pads_crop: bool,
}

/// Finds options that contradict each other, before anything is loaded.
///
/// # Errors
/// Wrong usage.
pub fn check(args: &RenderArgs) -> Result<(), Failure> {
    let conflict = |message: &str| Err(Failure::usage("render", ErrorKind::ArgumentConflict, message));
    budget::check(args)?;
    let several = args.samples.is_some_and(|samples| samples > 1);
    if args.compat == Some(CompatArg::Course) {
        if args.samples.is_some_and(|samples| samples != COURSE_SAMPLES) {
            return conflict("'--compat course' takes 4 samples: leave out '--samples'");
        }
        if args.sampler.is_some_and(|sampler| sampler != SamplerArg::Grid) {
            return conflict("'--compat course' takes its samples on a grid: leave out '--sampler'");
        }
        if args.max_depth.is_some_and(|max_depth| max_depth != COURSE_MAX_DEPTH) {
            return conflict("'--compat course' traces to depth 5: leave out '--max-depth'");
        }
        if args.cutoff.is_some_and(|cutoff| cutoff > 0.0) {
            return conflict("'--compat course' sends every ray: leave out '--cutoff'");
        }
        if args.terminator == Some(true) {
            return conflict("'--compat course' starts its shadow rays at the facet: leave out '--terminator'");
        }
    } else if args.sampler == Some(SamplerArg::Center) && several {
        return conflict("'--sampler center' takes one sample: it cannot be used with '--samples' above 1");
    }
    if args.accel == Some(AccelArg::Linear) && args.bvh.is_some() {
        return conflict("'--accel linear' builds no tree: leave out '--bvh'");
    }
    Ok(())
}

/// The instruction set asked for, or the fastest.
fn isa(args: &RenderArgs) -> Result<Isa, Failure> {
    let isa = args.isa.map_or_else(Isa::detect, Isa::from);
    if isa.is_available() { Ok(isa) } else { Err(missing_isa("render", isa)) }
}

/// What the command line changes about a scene before it is compiled.
pub fn overrides(args: &RenderArgs) -> Overrides {
    Overrides {
        width_px: args.width,
        height_px: args.height,
        fov_y_degrees: args.fov,
        up: up_axis(args.up),
        strict: args.strict,
        find_duplicates: false,
    }
}

/// The axis that `--up` names.
pub fn up_axis(up: Option<UpArg>) -> Option<UpAxis> {
    up.map(|up| match up {
        UpArg::Y => UpAxis::Y,
        UpArg::Z => UpAxis::Z,
    })
}

/// Threads asked for, or one per core.
pub fn threads(args: &RenderArgs) -> usize {
    let cores = || std::thread::available_parallelism().map_or(1, |n| n.get());
    args.threads.map_or_else(cores, |n| n as usize)
}

/// Settles the plan for a scene.
///
/// # Errors
/// Wrong usage: a crop that is not inside the image.
pub fn settle(args: &RenderArgs, scene: &Compiled) -> Result<Plan, Failure> {
    let (width_px, height_px) = (scene.camera.width_px, scene.camera.height_px);
    let region = args.crop.unwrap_or(Region::whole(width_px, height_px));
    if region.x1 > width_px || region.y1 > height_px {
        let Region { x0, y0, x1, y1 } = region;
        let message = format!("'--crop {x0},{y0},{x1},{y1}' reaches out of the image of {width_px}x{height_px} pixels");
        return Err(Failure::usage("render", ErrorKind::ValueValidation, message));
    }
    let course = args.compat == Some(CompatArg::Course);
    let (sampler, samples) = if course { (Sampler::Grid, COURSE_SAMPLES) } else { sampling(args, &scene.render) };
    let max_depth =
        if course { COURSE_MAX_DEPTH } else { args.max_depth.or(scene.render.max_depth).unwrap_or(DEFAULT_MAX_DEPTH) };
    let settings = Settings {
        samples,
        sampler,
        filter: if course { Filter::Box } else { filter(args, &scene.render) },
        seed: args.seed.or(scene.render.seed).unwrap_or(0),
        max_depth,
        cutoff: if course { 0.0 } else { args.cutoff.unwrap_or(DEFAULT_CUTOFF) },
        tile_size_px: args.tile_size.unwrap_or(DEFAULT_TILE_SIZE_PX),
        threads: threads(args),
        region,
        terminator: !course && args.terminator.or(scene.render.terminator).unwrap_or(false),
        course,
        spread: Spread::Uniform,
        aovs: args.aov.settle(scene, course, output::writes_exr(args))?,
    };
    let accel = match args.accel {
        None | Some(AccelArg::Bvh) => AccelKind::Bvh,
        Some(AccelArg::Linear) => AccelKind::Linear,
    };
    let picture = picture_args::settle(&args.picture, &scene.render, "render")?;
    Ok(Plan {
        settings,
        budget: args.budget.budget(),
        accel,
        preset: args.bvh.map_or_else(Preset::default, Preset::from),
        isa: isa(args)?,
        display: if course { Display::Course } else { Display::Picture(picture) },
        exr: args.exr.exr.unwrap_or_default(),
        pads_crop: args.exr.crop_output == Some(CropOutputArg::Full) && region != Region::whole(width_px, height_px),
    })
}

/// The sampler and its samples. `center` means one sample; whichever of the two is asked for more directly, on the
/// command line rather than in the scene, decides what becomes of the other.
fn sampling(args: &RenderArgs, scene: &RenderKeys) -> (Sampler, u32) {
    let asked = args.sampler.map(sampler_of_arg);
    let in_scene = scene.sampler.map(sampler_of_key);
    let overruled = in_scene == Some(Sampler::Center) && args.samples.is_some_and(|samples| samples > 1);
    let sampler = asked.or(in_scene.filter(|_| !overruled)).unwrap_or_default();
    let samples = match sampler {
        Sampler::Center => 1,
        Sampler::Grid | Sampler::Jitter | Sampler::Random | Sampler::Sobol => {
            args.samples.or(scene.samples).unwrap_or(DEFAULT_SAMPLES)
        }
    };
    (sampler, samples)
}

fn sampler_of_arg(arg: SamplerArg) -> Sampler {
    match arg {
        SamplerArg::Center => Sampler::Center,
        SamplerArg::Grid => Sampler::Grid,
        SamplerArg::Jitter => Sampler::Jitter,
        SamplerArg::Random => Sampler::Random,
        SamplerArg::Sobol => Sampler::Sobol,
    }
}

fn sampler_of_key(key: SamplerKey) -> Sampler {
    match key {
        SamplerKey::Center => Sampler::Center,
        SamplerKey::Grid => Sampler::Grid,
        SamplerKey::Jitter => Sampler::Jitter,
        SamplerKey::Random => Sampler::Random,
        SamplerKey::Sobol => Sampler::Sobol,
    }
}

/// The pixel filter.
fn filter(args: &RenderArgs, scene: &RenderKeys) -> Filter {
    let asked = args.filter.map(|arg| match arg {
        FilterArg::Box => Filter::Box,
        FilterArg::Triangle => Filter::Triangle,
        FilterArg::Gaussian => Filter::Gaussian,
        FilterArg::BlackmanHarris => Filter::BlackmanHarris,
    });
    let in_scene = scene.filter.map(|key| match key {
        FilterKey::Box => Filter::Box,
        FilterKey::Triangle => Filter::Triangle,
        FilterKey::Gaussian => Filter::Gaussian,
        FilterKey::BlackmanHarris => Filter::BlackmanHarris,
    });
    asked.or(in_scene).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use glam::DMat4;

    use super::*;
    use crate::cli::args::BvhArg;
    use crate::cli::picture_args::PictureArgs;
    use crate::film::Picture;
    use crate::scene::Names;
    use crate::world::{Camera, World};

    fn scene(render: RenderKeys) -> Compiled {
        let camera = Camera { world_from_camera: DMat4::IDENTITY, fov_y_radians: 1.0, width_px: 40, height_px: 30 };
        Compiled { world: World::default(), camera, render, names: Names::default(), warnings: Vec::new() }
    }

    fn settings(args: RenderArgs, keys: RenderKeys) -> Settings {
        settle(&args, &scene(keys)).unwrap().settings
    }

    #[test]
    fn the_command_line_overrules_the_scene_which_overrules_the_defaults() {
        let keys = RenderKeys {
            samples: Some(9),
            sampler: Some(SamplerKey::Grid),
            seed: Some(7),
            max_depth: Some(3),
            exposure_ev: Some(1.0),
            terminator: Some(true),
            ..RenderKeys::default()
        };
        let plain = settings(RenderArgs::default(), RenderKeys::default());
        assert_eq!((plain.samples, plain.sampler, plain.seed, plain.max_depth), (16, Sampler::Sobol, 0, 5));
        assert_eq!((plain.tile_size_px, plain.region), (32, Region::whole(40, 30)));
        assert!(!plain.terminator);

        let of_scene = settings(RenderArgs::default(), keys.clone());
        assert_eq!((of_scene.samples, of_scene.sampler, of_scene.seed, of_scene.max_depth), (9, Sampler::Grid, 7, 3));

        let args = RenderArgs {
            samples: Some(2),
            sampler: Some(SamplerArg::Jitter),
            seed: Some(1),
            max_depth: Some(1),
            picture: PictureArgs { exposure: Some(-2.0), ..PictureArgs::default() },
            terminator: Some(false),
            ..RenderArgs::default()
        };
        let asked = settings(args.clone(), keys.clone());
        assert_eq!((asked.samples, asked.sampler, asked.seed, asked.max_depth), (2, Sampler::Jitter, 1, 1));
        assert!(of_scene.terminator && !asked.terminator);
        let picture = Picture { exposure_stops: -2.0, ..Picture::default() };
        assert_eq!(settle(&args, &scene(keys)).unwrap().display, Display::Picture(picture));
    }

    #[test]
    fn the_center_sampler_means_one_sample_and_explicit_samples_overrule_the_scenes_center() {
        let center = RenderKeys { samples: Some(9), sampler: Some(SamplerKey::Center), ..RenderKeys::default() };
        assert_eq!(settings(RenderArgs::default(), center.clone()).samples, 1);

        let args = RenderArgs { sampler: Some(SamplerArg::Center), ..RenderArgs::default() };
        let keys = RenderKeys { samples: Some(9), ..RenderKeys::default() };
        assert_eq!(settings(args, keys).samples, 1);

        let args = RenderArgs { samples: Some(4), ..RenderArgs::default() };
        let explicit = settings(args, center);
        assert_eq!((explicit.samples, explicit.sampler), (4, Sampler::Sobol));
    }

    #[test]
    fn the_filter_is_the_command_lines_or_the_scenes_or_a_box() {
        let keys = RenderKeys { filter: Some(FilterKey::Gaussian), ..RenderKeys::default() };
        let args = RenderArgs { filter: Some(FilterArg::Triangle), ..RenderArgs::default() };
        assert_eq!(settings(RenderArgs::default(), RenderKeys::default()).filter, Filter::Box);
        assert_eq!(settings(RenderArgs::default(), keys.clone()).filter, Filter::Gaussian);
        assert_eq!(settings(args, keys.clone()).filter, Filter::Triangle);
        let course = RenderArgs { compat: Some(CompatArg::Course), ..RenderArgs::default() };
        assert_eq!(settings(course, keys).filter, Filter::Box);
    }

    #[test]
    fn the_compatible_mode_ignores_the_scenes_sampling() {
        let keys = RenderKeys { samples: Some(9), max_depth: Some(2), terminator: Some(true), ..RenderKeys::default() };
        let args = RenderArgs { compat: Some(CompatArg::Course), ..RenderArgs::default() };
        let course = settings(args, keys);
        assert_eq!((course.samples, course.sampler, course.max_depth, course.course), (4, Sampler::Grid, 5, true));
        assert!(!course.terminator);
    }

    #[test]
    fn contradictions_are_wrong_usage_and_agreement_is_not() {
        let course = RenderArgs { compat: Some(CompatArg::Course), ..RenderArgs::default() };
        let wrong = [
            RenderArgs { sampler: Some(SamplerArg::Center), samples: Some(2), ..RenderArgs::default() },
            RenderArgs { samples: Some(16), ..course.clone() },
            RenderArgs { sampler: Some(SamplerArg::Jitter), ..course.clone() },
            RenderArgs { max_depth: Some(6), ..course.clone() },
            RenderArgs { terminator: Some(true), ..course.clone() },
            RenderArgs { accel: Some(AccelArg::Linear), bvh: Some(BvhArg::Fast), ..RenderArgs::default() },
        ];
        for args in wrong {
            assert!(matches!(check(&args), Err(Failure::Usage(_))), "{args:?}");
        }
        let right = [
            RenderArgs { sampler: Some(SamplerArg::Center), samples: Some(1), ..RenderArgs::default() },
            RenderArgs { samples: Some(4), sampler: Some(SamplerArg::Grid), max_depth: Some(5), ..course },
            RenderArgs { accel: Some(AccelArg::Bvh), bvh: Some(BvhArg::High), ..RenderArgs::default() },
        ];
        for args in right {
            assert!(check(&args).is_ok(), "{args:?}");
        }
    }

    #[test]
    fn a_crop_must_lie_inside_the_image() {
        let crop = |x1, y1| RenderArgs { crop: Some(Region { x0: 0, y0: 0, x1, y1 }), ..RenderArgs::default() };
        let keys = RenderKeys::default;
        assert_eq!(settings(crop(40, 30), keys()).region.n_pixels(), 1200);
        assert!(matches!(settle(&crop(41, 30), &scene(keys())), Err(Failure::Usage(_))));
        assert!(matches!(settle(&crop(40, 31), &scene(keys())), Err(Failure::Usage(_))));
    }
}
