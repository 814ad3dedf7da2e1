//! What the command line accepts. Every name here is stable.

use std::path::PathBuf;

use clap::error::ErrorKind;
use clap::{Args, Parser, Subcommand, ValueEnum, value_parser};

use super::aov_args::AovArgs;
use super::budget::BudgetArgs;
use super::exr_args::ExrArgs;
use super::failure::Failure;
use super::picture_args::{PICTURE_OPTIONS, PictureArgs};
use super::value;
use crate::accel::Preset;
use crate::film::Region;
use crate::measure::error_map::MapKind;
use crate::simd::Isa;

// The first three are the ranges that scene files have too.
const MAX_LENGTH_PX: i64 = 65_535;
const MAX_SAMPLES: i64 = 65_536;
const MAX_DEPTH: i64 = 1000;
/// A tile is one worker's piece of work; beyond this there is only one of them in most images.
const MAX_TILE_SIZE_PX: i64 = 1024;
/// More threads than any machine has cores.
const MAX_THREADS: i64 = 1024;

const EXAMPLES: &str = "\
Examples:
  flatray                                   Render the built-in scene to flatray.exr and flatray.png
  flatray render scene.toml                 Render a scene to scene.exr and scene.png
  flatray render dragon.ply.gz -o dragon.png --width 1920 --height 1080
  flatray info scene.toml                   What a scene holds and what it costs
  flatray diff a.exr b.exr --max-rmse 1e-4  Compare two images
  flatray tonemap a.exr a.png --exposure 1  The PNG of an EXR, afterwards

Exit codes: 0 success, 1 failure, 2 wrong usage, 130 interrupted.";

const RENDER_EXAMPLES: &str = "\
Examples:
  flatray render                            The built-in scene
  flatray render scene.toml -o out.exr      Only an EXR, scene-linear
  flatray render bunny.ply --up z --samples 64
  flatray render scene.toml --crop 100,50,300,250 --stats stats.json
  flatray render scene.toml --compat course The original's image, byte for byte

The command line overrules the scene's [render] table, which overrules the defaults.
Nothing is written unless the render succeeds; files appear whole or not at all.

Exit codes: 0 success, 1 failure, 2 wrong usage, 130 interrupted.";

const INFO_EXAMPLES: &str = "\
Examples:
  flatray info scene.toml
  flatray info dragon.ply.gz --json

Keys of --json: input, primitives {spheres, quadrics, unbounded_quadrics, triangles, meshes, vertices},
bounds {lo, hi} (null without a bounded primitive), materials [{name, ambient, diffuse, specular,
reflectance, shininess}] (colours already multiplied by k_a, k_d, k_s), lights [{position or
direction, intensity}],
camera {position, fov_y_degrees, width, height}, background, features {found, skipped},
memory_bytes {one key per table, total}, bvh {preset, nodes, leaves, depth, sah_cost,
build_seconds, memory_bytes}, load_seconds, warnings [text].";

const DIFF_EXAMPLES: &str = "\
Examples:
  flatray diff render.exr reference.exr
  flatray diff a.png b.png --max-differing 0.1 --out difference.png
  flatray diff a.png b.exr --linear --json
  flatray diff render.exr reference.exr --out flip.png --map flip --max-flip 0.02

Colour is compared scene-linear, alpha is not compared. Keys, in text and JSON:
  differing  pixels with any differing channel; JSON has differing_percent beside it
  max        largest absolute difference of any channel
  mae, rmse  mean absolute and root mean square difference over all channels
  relmse     mean of (a - b)^2 / (b^2 + 0.01): errors in shares of what is there
  psnr       20 log10(1 / rmse) in decibels; null when the images are equal
  p999       99.9 % of the pixels differ by no more than this
  flip       mean FLIP, the difference an eye sees at 67 pixels a degree: 0 none, 1 the largest;
             HDR-FLIP of the second image's exposures unless one of the files is a PNG
  ssim       mean structural similarity, 1 for equal images; of sRGB levels if one is a PNG
JSON also has width, height, infinite (pixels that differ by infinity or NaN) and, between two
8-bit files, levels {differing, more_than_8, max} of the stored bytes.
A figure that JSON has no number for is null.

Exit codes: 0 within every limit given, 1 over a limit or unreadable, 2 wrong usage.";

/// flatray: a Whitted ray tracer.
#[derive(Debug, Parser)]
#[command(
    name = "flatray",
    version,
    about = "A data-oriented Whitted ray tracer",
    long_about = "A data-oriented Whitted ray tracer. A scene or a mesh in, EXR and PNG out.\n\
                  Without a command it renders its built-in scene.",
    after_help = EXAMPLES,
    max_term_width = 100
)]
pub struct Cli {
    /// What to do; `render` of the built-in scene unless said.
    #[command(subcommand)]
    pub command: Option<Command>,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Render a scene or a mesh
    Render(Box<RenderArgs>),
    /// Say what a scene or a mesh holds, and what it costs
    Info(InfoArgs),
    /// Compare two images
    Diff(DiffArgs),
    /// Make the PNG of a scene-linear image
    Tonemap(super::tonemap::TonemapArgs),
    /// Join crops of one frame
    Merge(super::merge::MergeArgs),
    /// Test the kernels against exact arithmetic
    Stress(super::stress::Args),
    /// Measure speed
    Bench(super::bench::Args),
    /// Render an image that others are judged by
    Reference(Box<super::reference::Args>),
}

/// Arguments of `flatray render`.
#[derive(Args, Clone, Debug, Default)]
#[command(after_help = RENDER_EXAMPLES, allow_negative_numbers = true)]
pub struct RenderArgs {
    /// A scene (.toml, .nff) or a mesh (.ply .obj .stl .off, plain, .gz or .zst); the built-in scene unless given
    pub input: Option<PathBuf>,
    /// Refuse geometry with defects instead of mending it or leaving it out with a warning
    #[arg(long)]
    pub strict: bool,

    /// Write an image, .exr, .png or .pfm by its extension; repeat for several [default: STEM.exr and STEM.png]
    #[arg(short, long = "output", value_name = "FILE", help_heading = "Output")]
    pub outputs: Vec<PathBuf>,
    /// Write times, rays and memory as JSON
    #[arg(long, value_name = "FILE.json", help_heading = "Output")]
    pub stats: Option<PathBuf>,
    /// EXR files and crops
    #[command(flatten)]
    pub exr: ExrArgs,
    /// Print nothing but errors
    #[arg(short, long, help_heading = "Output")]
    pub quiet: bool,
    #[command(flatten)]
    pub aov: AovArgs,

    /// Width of the image in pixels
    #[arg(long, value_name = "PX", value_parser = value_parser!(u32).range(1..=MAX_LENGTH_PX), help_heading = "Image")]
    pub width: Option<u32>,
    /// Height of the image in pixels
    #[arg(long, value_name = "PX", value_parser = value_parser!(u32).range(1..=MAX_LENGTH_PX), help_heading = "Image")]
    pub height: Option<u32>,
    /// Render only the pixels X0 <= x < X1, Y0 <= y < Y1, counted from the top left
    #[arg(long, value_name = "X0,Y0,X1,Y1", value_parser = value::crop, help_heading = "Image")]
    pub crop: Option<Region>,
    /// Vertical field of view in degrees
    #[arg(long, value_name = "DEG", value_parser = value::fov_degrees, help_heading = "Image")]
    pub fov: Option<f64>,
    /// The axis of a mesh file that points up [default: y]
    #[arg(long, value_name = "AXIS", help_heading = "Image")]
    pub up: Option<UpArg>,

    /// Samples per pixel; one sample is the pixel's centre [default: 16]
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..=MAX_SAMPLES), help_heading = "Quality")]
    pub samples: Option<u32>,
    /// Where samples lie; center means one sample [default: sobol]
    #[arg(long, value_name = "SAMPLER", help_heading = "Quality")]
    pub sampler: Option<SamplerArg>,
    #[command(flatten)]
    pub budget: BudgetArgs,
    /// How samples are weighted, by where they are placed [default: box]
    #[arg(long, value_name = "FILTER", help_heading = "Quality")]
    pub filter: Option<FilterArg>,
    /// Seed of all that is random [default: 0]
    #[arg(long, value_name = "N", help_heading = "Quality")]
    pub seed: Option<u64>,
    /// Longest chain of rays, the camera ray being 1 [default: 5]
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..=MAX_DEPTH), help_heading = "Quality")]
    pub max_depth: Option<u32>,
    /// Leave out rays that together cannot change a sample by more than this radiance [default: 1e-4]
    #[arg(long, value_name = "RADIANCE", value_parser = value::limit, help_heading = "Quality")]
    pub cutoff: Option<f64>,
    /// Correct the shadow terminator of coarse smooth meshes [default: false]
    #[arg(long, value_name = "BOOL", num_args = 0..=1, require_equals = true, default_missing_value = "true",
          help_heading = "Quality")]
    pub terminator: Option<bool>,
    /// Be another renderer, bit for bit: fixes samples, depth, clamping and PNG encoding
    #[arg(long, value_name = "RENDERER", conflicts_with = "filter", conflicts_with_all = PICTURE_OPTIONS,
          help_heading = "Quality")]
    pub compat: Option<CompatArg>,

    /// Worker threads [default: all cores]
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..=MAX_THREADS), help_heading = "Speed")]
    pub threads: Option<u32>,
    /// Edge of the square tiles in pixels [default: 32]
    #[arg(long, value_name = "PX", value_parser = value_parser!(u32).range(1..=MAX_TILE_SIZE_PX),
          help_heading = "Speed")]
    pub tile_size: Option<u32>,
    /// How hits are found; both give the same bits [default: bvh]
    #[arg(long, value_name = "KIND", help_heading = "Speed")]
    pub accel: Option<AccelArg>,
    /// What to spend on the tree; every preset gives the same bits [default: medium]
    #[arg(long, value_name = "PRESET", help_heading = "Speed")]
    pub bvh: Option<BvhArg>,
    /// Instruction set; every one gives the same bits [default: the fastest that this processor has]
    #[arg(long, value_name = "ISA", help_heading = "Speed")]
    pub isa: Option<IsaArg>,

    #[command(flatten)]
    pub picture: PictureArgs,
}

/// Arguments of `flatray info`.
#[derive(Args, Debug)]
#[command(after_help = INFO_EXAMPLES)]
pub struct InfoArgs {
    /// A scene (.toml, .nff) or a mesh (.ply .obj .stl .off, plain, .gz or .zst)
    pub input: PathBuf,
    /// Refuse geometry with defects instead of telling of it in warnings
    #[arg(long)]
    pub strict: bool,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
    /// What to spend on the tree [default: medium]
    #[arg(long, value_name = "PRESET")]
    pub bvh: Option<BvhArg>,
}

/// Arguments of `flatray diff`.
#[derive(Args, Debug)]
#[command(after_help = DIFF_EXAMPLES, allow_negative_numbers = true)]
pub struct DiffArgs {
    /// The image to judge: .png, .exr or .pfm
    pub a: PathBuf,
    /// The image to judge it by
    pub b: PathBuf,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
    /// Take PNG values as linear, whatever the file says; else its chunks say, and sRGB without them
    #[arg(long)]
    pub linear: bool,
    /// Write a picture of the differences
    #[arg(long, value_name = "D.png")]
    pub out: Option<PathBuf>,
    /// What the picture shows [default: abs]
    #[arg(long, value_name = "MAP", requires = "out")]
    pub map: Option<MapArg>,
    /// Fail when more percent of the pixels differ
    #[arg(long, value_name = "PERCENT", value_parser = value::limit, help_heading = "Limits")]
    pub max_differing: Option<f64>,
    /// Fail when the largest difference is larger
    #[arg(long, value_name = "X", value_parser = value::limit, help_heading = "Limits")]
    pub max_abs: Option<f64>,
    /// Fail when the mean absolute difference is larger
    #[arg(long, value_name = "X", value_parser = value::limit, help_heading = "Limits")]
    pub max_mae: Option<f64>,
    /// Fail when the root mean square difference is larger
    #[arg(long, value_name = "X", value_parser = value::limit, help_heading = "Limits")]
    pub max_rmse: Option<f64>,
    /// Fail when the 99.9th percentile is larger
    #[arg(long, value_name = "X", value_parser = value::limit, help_heading = "Limits")]
    pub max_p999: Option<f64>,
    /// Fail when the peak signal-to-noise ratio is smaller
    #[arg(long, value_name = "DB", value_parser = value::decibels, help_heading = "Limits")]
    pub min_psnr: Option<f64>,
    /// Fail when the relative mean square error is larger
    #[arg(long, value_name = "X", value_parser = value::limit, help_heading = "Limits")]
    pub max_relmse: Option<f64>,
    /// Fail when the mean FLIP error is larger
    #[arg(long, value_name = "X", value_parser = value::limit, help_heading = "Limits")]
    pub max_flip: Option<f64>,
    /// Fail when the structural similarity is smaller
    #[arg(long, value_name = "X", value_parser = value::number, help_heading = "Limits")]
    pub min_ssim: Option<f64>,
}

/// `--map`
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum MapArg {
    /// Sizes of differences in each channel, white where they are largest
    #[default]
    Abs,
    /// Red where the first image has more, blue where it has less
    Signed,
    /// How much of the difference an eye sees, black to cream
    Flip,
}

impl From<MapArg> for MapKind {
    fn from(map: MapArg) -> MapKind {
        match map {
            MapArg::Abs => MapKind::Abs,
            MapArg::Signed => MapKind::Signed,
            MapArg::Flip => MapKind::Flip,
        }
    }
}

/// `--sampler`
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum SamplerArg {
    /// One sample in the pixel's centre
    Center,
    /// Centres of equal cells
    Grid,
    /// A random point in each of equal cells
    Jitter,
    /// Random points
    Random,
    /// Sobol's sequence, scrambled by pixel
    Sobol,
}

/// `--filter`
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum FilterArg {
    /// The pixel itself
    Box,
    /// A tent, 2 pixels wide
    Triangle,
    /// A Gaussian of half a pixel, cut at 3 pixels' width
    Gaussian,
    /// Blackman-Harris, 3 pixels wide
    BlackmanHarris,
}

/// `--up`
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum UpArg {
    /// +y
    Y,
    /// +z
    Z,
}

/// `--accel`
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum AccelArg {
    /// Bounding volume hierarchy
    Bvh,
    /// Every ray against every primitive
    Linear,
}

/// `--bvh`
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum BvhArg {
    /// Built quickest
    Fast,
    /// A good tree in reasonable time
    Medium,
    /// The best tree, built in several times the time
    High,
}

impl From<BvhArg> for Preset {
    fn from(arg: BvhArg) -> Preset {
        match arg {
            BvhArg::Fast => Preset::Fast,
            BvhArg::Medium => Preset::Medium,
            BvhArg::High => Preset::High,
        }
    }
}

/// `--isa`
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum IsaArg {
    /// What every processor of the architecture has
    Baseline,
    /// AVX2 and FMA
    Avx2,
    /// The same lanes with AVX-512's encodings
    Avx512,
}

impl From<IsaArg> for Isa {
    fn from(arg: IsaArg) -> Isa {
        match arg {
            IsaArg::Baseline => Isa::Baseline,
            IsaArg::Avx2 => Isa::Avx2,
            IsaArg::Avx512 => Isa::Avx512,
        }
    }
}

/// The refusal of an instruction set that this processor lacks.
pub fn missing_isa(command: &str, isa: Isa) -> Failure {
    Failure::usage(command, ErrorKind::ValueValidation, format!("this processor does not have '--isa {}'", isa.name()))
}

/// `--compat`
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum CompatArg {
    /// The course's template: 2×2 samples, depth 5, clamped bounces, linear bytes
    Course,
}
