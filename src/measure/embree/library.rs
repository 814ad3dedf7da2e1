//! The shared library: its functions, its objects, and the only `unsafe` outside of `simd`.
//!
//! Handles are released when their owners go, scenes before their device. The library itself stays loaded to the end of
//! the process: its worker threads would not survive being unloaded.

#![allow(unsafe_code)]

use std::ffi::{CString, c_char, c_void};
use std::marker::PhantomData;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};

use super::packet::{N_COLUMNS, RayPacket, answer};
use super::{Geometry, PeerIsa, Quality};

type Handle = *mut c_void;
type Monitor = extern "C" fn(*mut c_void, isize, bool) -> bool;
/// rtcIntersect1 and rtcOccluded1. Embree 3: scene, context, ray. Embree 4: scene, ray, arguments.
type Single = unsafe extern "C" fn(Handle, *mut c_void, *mut c_void);
/// rtcIntersect4 and its like. Embree 3: valid, scene, context, rays. Embree 4: valid, scene, rays, arguments.
type Packet = unsafe extern "C" fn(*const i32, Handle, *mut c_void, *mut c_void);

/// Declares the table of functions and how it is loaded: a function that is missing is an error that names it.
macro_rules! functions {
    ($($name:ident: $type:ty = $symbol:literal;)*) => {
        #[derive(Clone, Copy, Debug)]
        struct Functions {
            $($name: $type,)*
        }

        impl Functions {
            fn load(library: &libloading::Library) -> Result<Functions, String> {
                Ok(Functions {
                    // SAFETY: each type is that of the function of this name in rtcore_*.h of Embree 3 and 4; what
                    // differs between them is told apart by the version before anything is called.
                    $($name: *unsafe { library.get::<$type>(concat!($symbol, "\0")) }
                        .map_err(|_| concat!("a library without ", $symbol).to_owned())?,)*
                })
            }
        }
    };
}

functions! {
    new_device: unsafe extern "C" fn(*const c_char) -> Handle = "rtcNewDevice";
    release_device: unsafe extern "C" fn(Handle) = "rtcReleaseDevice";
    device_property: unsafe extern "C" fn(Handle, i32) -> isize = "rtcGetDeviceProperty";
    device_error: unsafe extern "C" fn(Handle) -> i32 = "rtcGetDeviceError";
    set_memory_monitor: unsafe extern "C" fn(Handle, Monitor, *mut c_void) = "rtcSetDeviceMemoryMonitorFunction";
    new_scene: unsafe extern "C" fn(Handle) -> Handle = "rtcNewScene";
    release_scene: unsafe extern "C" fn(Handle) = "rtcReleaseScene";
    set_scene_flags: unsafe extern "C" fn(Handle, i32) = "rtcSetSceneFlags";
    set_scene_quality: unsafe extern "C" fn(Handle, i32) = "rtcSetSceneBuildQuality";
    commit_scene: unsafe extern "C" fn(Handle) = "rtcCommitScene";
    attach_geometry: unsafe extern "C" fn(Handle, Handle) -> u32 = "rtcAttachGeometry";
    new_geometry: unsafe extern "C" fn(Handle, i32) -> Handle = "rtcNewGeometry";
    release_geometry: unsafe extern "C" fn(Handle) = "rtcReleaseGeometry";
    commit_geometry: unsafe extern "C" fn(Handle) = "rtcCommitGeometry";
    share_buffer: unsafe extern "C" fn(Handle, i32, u32, i32, *const c_void, usize, usize, usize)
        = "rtcSetSharedGeometryBuffer";
    intersect1: Single = "rtcIntersect1";
    intersect4: Packet = "rtcIntersect4";
    intersect8: Packet = "rtcIntersect8";
    intersect16: Packet = "rtcIntersect16";
    occluded1: Single = "rtcOccluded1";
    occluded4: Packet = "rtcOccluded4";
    occluded8: Packet = "rtcOccluded8";
    occluded16: Packet = "rtcOccluded16";
}

// Values of enumerations in rtcore_*.h; the same in Embree 3 and 4 unless said.
const DEVICE_PROPERTY_VERSION: i32 = 0;
const SCENE_FLAG_ROBUST: i32 = 1 << 2;
const BUILD_QUALITY_MEDIUM: i32 = 1;
const BUILD_QUALITY_HIGH: i32 = 2;
const GEOMETRY_TRIANGLE: i32 = 0;
const GEOMETRY_SPHERE_POINT: i32 = 50;
const BUFFER_INDEX: i32 = 0;
const BUFFER_VERTEX: i32 = 1;
const FORMAT_UINT3: i32 = 0x5003;
const FORMAT_FLOAT3: i32 = 0x9003;
const FORMAT_FLOAT4: i32 = 0x9004;
const INVALID_ID: u32 = u32::MAX;
const COHERENT_3: u32 = 1;
const COHERENT_4: u32 = 1 << 16;
const ALL_FEATURES: u32 = u32::MAX;

/// Embree, loaded.
#[derive(Clone, Debug)]
pub struct Library {
    functions: &'static Functions,
    /// Where it was found.
    pub path: PathBuf,
    /// Major, minor, patch.
    pub version: [u32; 3],
}

impl Library {
    /// Loads a library.
    ///
    /// # Errors
    /// What is wrong with it, as something that was found.
    pub fn load(path: &Path) -> Result<Library, String> {
        // SAFETY: loading runs the library's initialisers; Embree's ask nothing of the process. A file that is not
        // Embree is the user's choice, as with any program that is run by name.
        let loaded = unsafe { libloading::Library::new(path) }.map_err(|error| error.to_string())?;
        let loaded: &'static libloading::Library = Box::leak(Box::new(loaded));
        let functions: &'static Functions = Box::leak(Box::new(Functions::load(loaded)?));
        let unversioned = Library { functions, path: path.to_path_buf(), version: [4, 0, 0] };
        let device = unversioned.device("threads=1")?;
        // SAFETY: the device is alive.
        let version = unsafe { (functions.device_property)(device.handle, DEVICE_PROPERTY_VERSION) } as u32;
        let version = [version / 10_000, version / 100 % 100, version % 100];
        if !(3..=4).contains(&version[0]) {
            return Err(format!("version {}.{}, not 3 or 4", version[0], version[1]));
        }
        Ok(Library { version, ..unversioned })
    }

    /// A device with this many threads for building, all of them with one instruction set.
    ///
    /// # Errors
    /// What Embree says.
    pub fn device_with(&self, threads: usize, isa: PeerIsa) -> Result<Arc<Device>, String> {
        self.device(&format!("threads={threads},isa={}", isa.name()))
    }

    fn device(&self, config: &str) -> Result<Arc<Device>, String> {
        let functions = self.functions;
        let text = CString::new(config).map_err(|error| error.to_string())?;
        // SAFETY: the text ends with a zero and is only read during the call.
        let handle = unsafe { (functions.new_device)(text.as_ptr()) };
        if handle.is_null() {
            return Err(format!("no device with {config}"));
        }
        let device = Device { functions, handle, bytes: Box::new(AtomicI64::new(0)), major: self.version[0] };
        let bytes = (&raw const *device.bytes).cast_mut().cast();
        // SAFETY: the counter is boxed, so that it stays where it is, and outlives the device, which is released in
        // `drop` before it.
        unsafe { (functions.set_memory_monitor)(handle, count_bytes, bytes) };
        Ok(Arc::new(device))
    }
}

/// Counts what Embree allocates and frees. It may be called from several threads.
extern "C" fn count_bytes(counter: *mut c_void, bytes: isize, _after: bool) -> bool {
    // SAFETY: the pointer is the one given to `set_memory_monitor`: an atomic that outlives the device.
    let counter = unsafe { &*counter.cast::<AtomicI64>() };
    counter.fetch_add(bytes as i64, Ordering::Relaxed);
    true
}

/// A device: the threads and the instruction set of its scenes.
#[derive(Debug)]
pub struct Device {
    functions: &'static Functions,
    handle: Handle,
    bytes: Box<AtomicI64>,
    major: u32,
}

// SAFETY: Embree's functions may be called on a device from several threads ("Thread Safety" in the API reference).
unsafe impl Send for Device {}
// SAFETY: as above.
unsafe impl Sync for Device {}

impl Drop for Device {
    fn drop(&mut self) {
        // SAFETY: the handle is released once; scenes hold an `Arc` of the device, so that none is left.
        unsafe { (self.functions.release_device)(self.handle) };
    }
}

impl Device {
    /// Bytes that Embree holds for this device.
    pub fn bytes(&self) -> u64 {
        self.bytes.load(Ordering::Relaxed).max(0) as u64
    }

    /// What went wrong since this was last asked.
    fn check(&self) -> Result<(), String> {
        // SAFETY: the device is alive.
        match unsafe { (self.functions.device_error)(self.handle) } {
            0 => Ok(()),
            code => Err(format!("Embree's error {code}")),
        }
    }

    /// Builds a scene over geometry that it shares.
    ///
    /// # Errors
    /// What Embree says.
    pub fn build<'g>(
        self: &Arc<Device>,
        geometry: &'g Geometry,
        quality: Quality,
        robust: bool,
    ) -> Result<Scene<'g>, String> {
        let functions = self.functions;
        // SAFETY: the device is alive, and the scene keeps it alive.
        let handle = unsafe { (functions.new_scene)(self.handle) };
        let scene = Scene { device: Arc::clone(self), handle, geometry: PhantomData };
        self.check()?;
        let quality = match quality {
            Quality::Medium => BUILD_QUALITY_MEDIUM,
            Quality::High => BUILD_QUALITY_HIGH,
        };
        // SAFETY: the scene is alive.
        unsafe {
            (functions.set_scene_quality)(handle, quality);
            (functions.set_scene_flags)(handle, if robust { SCENE_FLAG_ROBUST } else { 0 });
        }
        let Geometry { positions, triangles, spheres } = geometry;
        if !triangles.is_empty() {
            let vertices = Column { of: BUFFER_VERTEX, format: FORMAT_FLOAT3, data: positions.as_ptr().cast() };
            let indices = Column { of: BUFFER_INDEX, format: FORMAT_UINT3, data: triangles.as_ptr().cast() };
            let columns = [(vertices, 12, positions.len() / 3), (indices, 12, triangles.len())];
            scene.attach(GEOMETRY_TRIANGLE, &columns);
        }
        if !spheres.is_empty() {
            let points = Column { of: BUFFER_VERTEX, format: FORMAT_FLOAT4, data: spheres.as_ptr().cast() };
            scene.attach(GEOMETRY_SPHERE_POINT, &[(points, 16, spheres.len())]);
        }
        // SAFETY: the scene is alive, and its shared buffers are for `'g`.
        unsafe { (functions.commit_scene)(handle) };
        self.check()?;
        Ok(scene)
    }
}

/// A buffer to be shared.
struct Column {
    of: i32,
    format: i32,
    data: *const c_void,
}

/// A scene that is built and can be traced. It shares the geometry it was built from.
#[derive(Debug)]
pub struct Scene<'g> {
    device: Arc<Device>,
    handle: Handle,
    geometry: PhantomData<&'g Geometry>,
}

// SAFETY: a committed scene may be traced from several threads ("Thread Safety" in the API reference), and is not
// changed any more.
unsafe impl Send for Scene<'_> {}
// SAFETY: as above.
unsafe impl Sync for Scene<'_> {}

impl Drop for Scene<'_> {
    fn drop(&mut self) {
        // SAFETY: the handle is released once, and its device is still alive.
        unsafe { (self.device.functions.release_scene)(self.handle) };
    }
}

/// A ray query as Embree wants it: the rays, then what was hit.
#[repr(C, align(64))]
struct RayHit<const W: usize> {
    rays: [[u32; W]; N_COLUMNS],
    normal_and_barycentrics: [[u32; W]; 5],
    prim_ids: [u32; W],
    geometry_ids: [u32; W],
    /// Ids of instances and of their primitives, for as many levels as any build of Embree has.
    instances: [[u32; W]; 16],
}

/// What Embree's vector loads ask of the mask.
#[repr(C, align(64))]
struct Valid<const W: usize>([i32; W]);

/// RTCIntersectContext of Embree 3.
#[repr(C)]
struct Context3 {
    flags: u32,
    filter: *const c_void,
    instances: [u32; 10],
}

/// RTCIntersectArguments and RTCOccludedArguments of Embree 4.
#[repr(C)]
struct Arguments4 {
    flags: u32,
    features: u32,
    context: *const c_void,
    filter: *const c_void,
    intersect: *const c_void,
    min_width: [f32; 2],
}

impl<'g> Scene<'g> {
    fn attach(&self, kind: i32, columns: &[(Column, usize, usize)]) {
        let functions = self.device.functions;
        // SAFETY: device and scene are alive. Each column has as many rows of its stride as it says, a vertex column of
        // three floats one float more, and lives for `'g`. The scene keeps its own reference to the geometry.
        unsafe {
            let geometry = (functions.new_geometry)(self.device.handle, kind);
            for (column, stride, n) in columns {
                (functions.share_buffer)(geometry, column.of, 0, column.format, column.data, 0, *stride, *n);
            }
            (functions.commit_geometry)(geometry);
            (functions.attach_geometry)(self.handle, geometry);
            (functions.release_geometry)(geometry);
        }
    }

    /// Answers packets with t of the closest hits, [`answer::MISS`] without one.
    pub fn closest_hit<const W: usize>(&self, coherent: bool, packets: &[RayPacket<W>], t: &mut [[f32; W]]) {
        let functions = self.device.functions;
        let packet = match W {
            4 => functions.intersect4,
            8 => functions.intersect8,
            _ => functions.intersect16,
        };
        self.query(coherent, functions.intersect1, packet, packets, t, |query, lane| {
            if query.geometry_ids[lane] == INVALID_ID { answer::MISS } else { f32::from_bits(query.rays[8][lane]) }
        });
    }

    /// Answers packets with [`answer::OCCLUDED`] for each ray whose way is not free.
    pub fn occluded<const W: usize>(&self, coherent: bool, packets: &[RayPacket<W>], t: &mut [[f32; W]]) {
        let functions = self.device.functions;
        let packet = match W {
            4 => functions.occluded4,
            8 => functions.occluded8,
            _ => functions.occluded16,
        };
        self.query(coherent, functions.occluded1, packet, packets, t, |query, lane| {
            f32::from_bits(query.rays[8][lane])
        });
    }

    /// Asks one question after another. `W` must be 1, 4, 8 or 16.
    #[inline(always)]
    fn query<const W: usize>(
        &self,
        coherent: bool,
        single: Single,
        packet: Packet,
        packets: &[RayPacket<W>],
        answers: &mut [[f32; W]],
        answer: impl Fn(&RayHit<W>, usize) -> f32,
    ) {
        const { assert!(W == 1 || W == 4 || W == 8 || W == 16) };
        let flag = |set: u32| if coherent { set } else { 0 };
        let null = std::ptr::null();
        let mut context = Context3 { flags: flag(COHERENT_3), filter: null, instances: [INVALID_ID; 10] };
        let mut arguments = Arguments4 {
            flags: flag(COHERENT_4),
            features: ALL_FEATURES,
            context: null,
            filter: null,
            intersect: null,
            min_width: [0.0; 2],
        };
        let mut query = RayHit::<W> {
            rays: [[0; W]; N_COLUMNS],
            normal_and_barycentrics: [[0; W]; 5],
            prim_ids: [0; W],
            geometry_ids: [INVALID_ID; W],
            instances: [[INVALID_ID; W]; 16],
        };
        for (packed, answers) in packets.iter().zip(answers) {
            query.rays = packed.columns;
            query.geometry_ids = [INVALID_ID; W];
            let valid = Valid(packed.valid);
            let rays: *mut c_void = (&raw mut query).cast();
            // Embree 3 takes its context before the rays, Embree 4 its arguments behind them.
            let (third, fourth) = match self.device.major {
                3 => ((&raw mut context).cast(), rays),
                _ => (rays, (&raw mut arguments).cast()),
            };
            // SAFETY: the scene is committed. `query` and `valid` have the layout and alignment of the structs for `W`
            // rays, and the functions are those for `W`; `query` has room for all levels of instances. Context and
            // arguments are those of this version, with no callbacks.
            unsafe {
                match W {
                    1 => single(self.handle, third, fourth),
                    _ => packet(valid.0.as_ptr(), self.handle, third, fourth),
                }
            }
            for (lane, answered) in answers.iter_mut().enumerate() {
                *answered = answer(&query, lane);
            }
        }
    }
}
