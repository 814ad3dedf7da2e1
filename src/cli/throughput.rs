//! `flatray bench throughput`: what to measure, on what, and where the figures go.

use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::{ValueEnum, value_parser};

use super::args::{BvhArg, IsaArg, missing_isa};
use super::failure::Failure;
use super::files::{self, Writing};
use super::{diagnostic, terminal, throughput_text, value};
use crate::accel::{Mode, Preset};
use crate::error::Error;
use crate::measure::embree::{self, library::Library};
use crate::measure::generate::{building, sphereflake, terrain_camera, terrain_world};
use crate::measure::rays::RayKind;
use crate::measure::throughput::page;
use crate::measure::throughput::report::Report;
use crate::measure::throughput::work::Work;
use crate::measure::throughput::{Settings, export, measure};
use crate::scene::Overrides;
use crate::simd::Isa;
use crate::world::{Camera, World};

const EXAMPLES: &str = "\
Examples:
  flatray bench throughput dragon.ply.gz
  flatray bench throughput terrain --rays primary,diffuse --threads 1,2 --bvh high --peer embree
  flatray bench throughput building --quick --json building.json --html building.html
  flatray bench throughput bunny.ply --up z --export work/

INPUT is a scene or mesh as `flatray render` takes it, or one of these:
  terrain, terrain:N   fractal terrain of 10 million triangles, or about N
  building             a building with interior, long thin triangles as in CAD exports
  sphereflake          7381 spheres on a floor, the SPD's \"balls\"

Nothing is timed before its answer is right: flatray's are compared with the full scan on as many rays as are
affordable, and between modes, instruction sets, presets and threads on all, bit for bit. A peer's are compared
with these; wrong counts hits for misses and misses for hits, t off hits whose t differs by over a thousandth.

Columns: million rays per second, median (minimum to maximum) over repeats in turns. Embree has f32 rays;
flatray is measured on the same rays, and on its own f64 rays besides.

--export writes little-endian f32 without header: triangles.f32 (9 per triangle: three corners), rays-NAME.f32
(8 per ray: origin, t_min, direction, t_max), hits-NAME.f32 (1 per ray: t of the closest hit, inf for a miss).

Keys of --json: input, seconds, rows [{engine, rays, ray_precision, mode, isa, quality, threads, mrays_per_s, min,
max, wrong, t_off}], build [{engine, quality, threads, seconds, min, max, bytes_per_primitive,
table_bytes_per_primitive}], sets [{rays, ray_precision, count, hits, judged}], visits [{rays, quality,
nodes_per_ray, leaves_per_ray}], ratios [{what, rays, quality, threads, value, fastest}], notes [text].

Exit codes: 0 success, 1 failure or a wrong answer of flatray, 2 wrong usage.";

/// More than any comparison needs.
const MAX_REPEATS: i64 = 1000;
const DEFAULT_REPEATS: u32 = 5;
const QUICK_REPEATS: u32 = 2;
const DEFAULT_SIZE_PX: [u32; 2] = [1024, 768];
const QUICK_SIZE_PX: [u32; 2] = [160, 120];
const TERRAIN_TRIANGLES: u32 = 10_000_000;
/// Tests of the full scan per set of rays: some seconds, or tenths of one.
const ORACLE_TESTS: u64 = 100_000_000;
const QUICK_ORACLE_TESTS: u64 = 3_000_000;
/// A measurement takes at least this long.
const MIN_SECONDS: f64 = 0.05;

/// Arguments of `flatray bench throughput`.
#[derive(clap::Args, Clone, Debug)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// A scene, a mesh, or terrain[:N], building, sphereflake
    pub input: PathBuf,

    /// Kinds of rays
    #[arg(long, value_name = "KIND", value_delimiter = ',', default_value = "primary,shadow,reflection,diffuse")]
    pub rays: Vec<RayArg>,
    /// Numbers of threads; the first is compared with the peer's [default: 1 and all cores]
    #[arg(long, value_name = "N", value_delimiter = ',', value_parser = value_parser!(u32).range(1..=1024))]
    pub threads: Vec<u32>,
    /// Instruction sets [default: all that this processor has]
    #[arg(long, value_name = "ISA", value_delimiter = ',')]
    pub isa: Vec<IsaArg>,
    /// How rays walk the tree
    #[arg(long, value_name = "MODE", value_delimiter = ',', default_value = "single,batch,packet")]
    pub mode: Vec<ModeArg>,
    /// Presets of the build
    #[arg(long, value_name = "PRESET", value_delimiter = ',', default_value = "medium")]
    pub bvh: Vec<BvhArg>,
    /// How often each is measured [default: 5]
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..=MAX_REPEATS))]
    pub repeats: Option<u32>,
    /// Pixels, one camera ray each [default: 1024x768]
    #[arg(long, value_name = "WxH", value_parser = value::resolution)]
    pub resolution: Option<[u32; 2]>,
    /// The axis of a mesh file that points up [default: y]
    #[arg(long, value_name = "AXIS")]
    pub up: Option<super::args::UpArg>,
    /// Few rays, two repeats, one thread unless said: whether it works, not how fast it is
    #[arg(long)]
    pub quick: bool,

    /// Measure another tracer on the same work: embree, or embree=LIBRARY
    #[arg(long, value_name = "PEER", value_parser = peer)]
    pub peer: Option<Peer>,

    /// Write triangles, rays and hits into a folder
    #[arg(long, value_name = "DIR")]
    pub export: Option<PathBuf>,
    /// Write the figures as JSON
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Write a page with plots
    #[arg(long, value_name = "FILE")]
    pub html: Option<PathBuf>,
}

/// `--rays`
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum RayArg {
    /// Camera rays in tile order
    Primary,
    /// To each light from what the camera sees
    Shadow,
    /// Mirrored from what the camera sees
    Reflection,
    /// Distributed as the cosine from what the camera sees
    Diffuse,
}

/// `--mode`
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ModeArg {
    /// One ray after another
    Single,
    /// Several rays in flight
    Batch,
    /// Neighbouring rays together, the others in flight; what the renderer uses
    Packet,
}

/// `--peer`
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Peer {
    /// A library that is named.
    pub library: Option<PathBuf>,
}

fn peer(text: &str) -> Result<Peer, String> {
    match text.split_once('=') {
        None if text == "embree" => Ok(Peer { library: None }),
        Some(("embree", path)) if !path.is_empty() => Ok(Peer { library: Some(path.into()) }),
        _ => Err("expected embree or embree=LIBRARY".to_owned()),
    }
}

/// Runs the command.
///
/// # Errors
/// Wrong usage, bad input, an unwritable place, and above all a wrong answer.
pub fn run(args: &Args) -> Result<(), Failure> {
    let started = Instant::now();
    let settings = settings(args)?;
    args.json.iter().chain(&args.html).try_for_each(files::check_writable)?;
    if let Some(folder) = &args.export {
        fs::create_dir_all(folder).map_err(|error| Error::io(folder, "create the folder", &error))?;
    }
    let mut progress = |what: &str| terminal::print_error(&format!("{what}\n"));
    let (world, camera) = load(args)?;
    let library = args.peer.as_ref().and_then(open);
    let mut work = Work::prepare(&world, &camera, &settings, &mut progress)?;
    if let Some(folder) = &args.export {
        export_to(folder, &world, &work)?;
    }
    let report = measure(&world, &mut work, &settings, library.as_ref(), &mut progress)?;
    terminal::print(&throughput_text::tables(&terminal::shown(&args.input), &world, &report))?;
    write(args, &world, &report, started.elapsed().as_secs_f64())
}

/// Loads the peer; without it the benchmark goes on.
fn open(peer: &Peer) -> Option<Library> {
    match embree::open(peer.library.as_deref()) {
        Ok(library) => Some(library),
        Err(error) => {
            terminal::print_error(&diagnostic::warnings(&error.problems, terminal::stderr_is_coloured()));
            None
        }
    }
}

fn settings(args: &Args) -> Result<Settings, Failure> {
    let cores = std::thread::available_parallelism().map_or(1, |n| n.get());
    let threads = match args.threads.as_slice() {
        [] if args.quick || cores == 1 => vec![1],
        [] => vec![1, cores],
        threads => distinct(threads.iter().map(|&n| n as usize)),
    };
    let isas = match args.isa.as_slice() {
        [] => Isa::ALL.into_iter().rev().filter(|isa| isa.is_available()).collect(),
        isas => distinct(isas.iter().map(|&isa| Isa::from(isa))),
    };
    if let Some(missing) = isas.iter().find(|isa| !isa.is_available()) {
        return Err(missing_isa("bench", *missing));
    }
    let default_repeats = if args.quick { QUICK_REPEATS } else { DEFAULT_REPEATS };
    Ok(Settings {
        kinds: distinct(args.rays.iter().map(|kind| match kind {
            RayArg::Primary => RayKind::Primary,
            RayArg::Shadow => RayKind::Shadow,
            RayArg::Reflection => RayKind::Reflection,
            RayArg::Diffuse => RayKind::Diffuse,
        })),
        threads,
        isas,
        modes: distinct(args.mode.iter().map(|mode| match mode {
            ModeArg::Single => Mode::Single,
            ModeArg::Batch => Mode::Batch,
            ModeArg::Packet => Mode::Packet,
        })),
        presets: distinct(args.bvh.iter().map(|&preset| Preset::from(preset))),
        repeats: args.repeats.unwrap_or(default_repeats) as usize,
        min_seconds: if args.quick { 0.0 } else { MIN_SECONDS },
        oracle_tests: if args.quick { QUICK_ORACLE_TESTS } else { ORACLE_TESTS },
    })
}

/// The values in their order, each once.
fn distinct<T: PartialEq>(values: impl Iterator<Item = T>) -> Vec<T> {
    values.fold(Vec::new(), |mut list, value| {
        if !list.contains(&value) {
            list.push(value);
        }
        list
    })
}

/// The scene: a file's, or one of those that are generated.
fn load(args: &Args) -> Result<(World, Camera), Failure> {
    let default = if args.quick { QUICK_SIZE_PX } else { DEFAULT_SIZE_PX };
    let [width, height] = args.resolution.unwrap_or(default);
    let name = args.input.as_os_str().to_str().unwrap_or_default();
    if let Some(n) = name.strip_prefix("terrain:") {
        let n_triangles = value::count(n, TERRAIN_TRIANGLES * 10)
            .map_err(|message| Failure::usage("bench", clap::error::ErrorKind::ValueValidation, message))?;
        return Ok((terrain_world(n_triangles)?, terrain_camera(width, height)));
    }
    match name {
        "terrain" => Ok((terrain_world(TERRAIN_TRIANGLES)?, terrain_camera(width, height))),
        "building" => Ok((building::world()?, building::camera(width, height))),
        "sphereflake" => Ok((sphereflake::world(sphereflake::DEPTH), sphereflake::camera(width, height))),
        _ => {
            let up = super::plan::up_axis(args.up);
            let overrides = Overrides { width_px: Some(width), height_px: Some(height), up, ..Overrides::default() };
            let scene = files::load(Some(Path::new(&args.input)), &overrides)?;
            Ok((scene.world, scene.camera))
        }
    }
}

fn export_to(folder: &Path, world: &World, work: &Work) -> Result<(), Error> {
    let contents = export::contents(world, work);
    let files: Vec<(PathBuf, Vec<f32>)> =
        contents.into_iter().map(|(name, values)| (folder.join(OsStr::new(&name)), values)).collect();
    let writings: Vec<Writing> = files
        .iter()
        .map(|(path, values)| -> Writing { (path, Box::new(move |mut out| export::write(values, &mut out))) })
        .collect();
    files::write_together(&writings)
}

fn write(args: &Args, world: &World, report: &Report, seconds: f64) -> Result<(), Failure> {
    let input = terminal::shown(&args.input);
    let mut json = report.to_json();
    json["input"] = input.as_str().into();
    json["seconds"] = seconds.into();
    // Keys and numbers always serialise; the fallback is never taken.
    let json = serde_json::to_string_pretty(&json).unwrap_or_default() + "\n";
    let mut writings: Vec<Writing> = Vec::new();
    if let Some(path) = &args.json {
        writings.push((path, Box::new(|out| out.write_all(json.as_bytes()))));
    }
    if let Some(path) = &args.html {
        let page = page::page(&input, &throughput_text::about(world), report);
        writings.push((path, Box::new(move |out| out.write_all(page.as_bytes()))));
    }
    Ok(files::write_together(&writings)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_peer_is_embree_with_or_without_a_library() {
        assert_eq!(peer("embree"), Ok(Peer { library: None }));
        assert_eq!(peer("embree=/a/b.so"), Ok(Peer { library: Some("/a/b.so".into()) }));
        for wrong in ["", "embree=", "optix", "optix=/a"] {
            assert!(peer(wrong).unwrap_err().contains("embree"), "{wrong}");
        }
    }
}
