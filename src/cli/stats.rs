//! What a render took: the stats file and the closing summary.

use std::path::Path;

use serde::Serialize;

use super::{quantity, terminal};
use crate::render::RayCounts;

/// The stats file; its keys are stable.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Stats {
    /// Wall-clock times.
    pub seconds: Seconds,
    /// Rays by kind.
    pub rays: Rays,
    /// Primitive tests that only exact arithmetic could decide.
    pub exact_tests: u64,
    /// Memory.
    pub memory_bytes: MemoryBytes,
    /// Width of the whole image in pixels.
    pub width: u32,
    /// Height of the whole image in pixels.
    pub height: u32,
    /// Samples per pixel; null where they are as many as each pixel needs.
    pub samples: Option<u32>,
    /// The root mean square error that the samples tell; null where they do not.
    pub rmse_estimate: Option<f64>,
    /// Worker threads.
    pub threads: usize,
    /// The preset of the tree; null where there is none.
    pub bvh: Option<&'static str>,
}

/// Wall-clock times in seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Seconds {
    /// Reading and compiling the scene.
    pub load: f64,
    /// Building the acceleration structure.
    pub build: f64,
    /// Tracing and shading.
    pub trace: f64,
    /// Writing the images.
    pub write: f64,
    /// From the first argument read to the last image written.
    pub total: f64,
}

/// Rays by kind; each counts once, when it is sent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Rays {
    /// Camera rays.
    pub camera: u64,
    /// Camera rays that hit something.
    pub camera_hit: u64,
    /// Mirror rays.
    pub reflection: u64,
    /// Refracted rays.
    pub refraction: u64,
    /// Shadow rays.
    pub shadow: u64,
}

/// Memory in bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct MemoryBytes {
    /// The scene's tables.
    pub tables: u64,
    /// The acceleration structure.
    pub accel: u64,
    /// What was expected to be held at the peak, when it was compared with what the machine has.
    pub estimate: u64,
    /// The most the process has held; null where the system does not say.
    pub peak: Option<u64>,
}

impl From<RayCounts> for Rays {
    fn from(counts: RayCounts) -> Rays {
        let RayCounts { camera, camera_hit, reflection, refraction, shadow } = counts;
        Rays { camera, camera_hit, reflection, refraction, shadow }
    }
}

impl Stats {
    /// The stats file's text.
    pub fn to_json(&self) -> String {
        // Numbers and fixed keys always serialise; the fallback is never taken.
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }

    /// The closing summary, one fact a line.
    pub fn summary(&self, written: &[&Path]) -> String {
        let Stats { seconds, rays, exact_tests, memory_bytes, width, height, samples, rmse_estimate, threads, bvh } =
            self;
        let n_rays = rays.camera + rays.reflection + rays.refraction + rays.shadow;
        let count = quantity::count;
        let plural = |n: u64| if n == 1 { "" } else { "s" };
        let spread = match samples {
            Some(samples) => format!("{samples} sample{} per pixel", plural(u64::from(*samples))),
            None => "samples where they are needed".to_owned(),
        };
        let mut lines = vec![
            format!("image   {width}x{height}, {spread}, {threads} thread{}", plural(*threads as u64)),
            format!(
                "time    load {}, build {}{}, trace {}, write {}, total {}",
                quantity::seconds(seconds.load),
                quantity::seconds(seconds.build),
                bvh.map_or_else(String::new, |preset| format!(" ({preset})")),
                quantity::seconds(seconds.trace),
                quantity::seconds(seconds.write),
                quantity::seconds(seconds.total)
            ),
            format!(
                "rays    camera {} ({} hit), reflection {}, refraction {}, shadow {}",
                count(rays.camera),
                count(rays.camera_hit),
                count(rays.reflection),
                count(rays.refraction),
                count(rays.shadow)
            ),
            format!(
                "speed   {} rays at {:.2} Mray/s",
                count(n_rays),
                quantity::mega_rays_per_second(n_rays, seconds.trace)
            ),
            format!(
                "memory  tables {}, acceleration {}, peak {}",
                quantity::bytes(memory_bytes.tables),
                quantity::bytes(memory_bytes.accel),
                memory_bytes.peak.map_or_else(|| "unknown".to_owned(), quantity::bytes)
            ),
        ];
        if let Some(rmse) = rmse_estimate {
            lines.insert(1, format!("error   {rmse:.2e} root mean square, estimated"));
        }
        if *exact_tests > 0 {
            lines.push(format!(
                "exact   {} primitive test{} needed exact arithmetic",
                count(*exact_tests),
                plural(*exact_tests)
            ));
        }
        lines.extend(written.iter().map(|path| format!("wrote   {}", terminal::shown(path))));
        lines.join("\n") + "\n"
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_stats_file_has_the_agreed_keys() {
        let stats = Stats {
            seconds: Seconds { load: 0.5, ..Seconds::default() },
            rays: Rays { camera: 4, camera_hit: 3, ..Rays::default() },
            exact_tests: 0,
            memory_bytes: MemoryBytes { tables: 10, accel: 20, estimate: 30, peak: None },
            width: 2,
            height: 1,
            samples: Some(2),
            rmse_estimate: Some(0.25),
            threads: 1,
            bvh: Some("medium"),
        };
        let json: serde_json::Value = serde_json::from_str(&stats.to_json()).unwrap();
        let expected = serde_json::json!({
            "seconds": {"load": 0.5, "build": 0.0, "trace": 0.0, "write": 0.0, "total": 0.0},
            "rays": {"camera": 4, "camera_hit": 3, "reflection": 0, "refraction": 0, "shadow": 0},
            "exact_tests": 0,
            "memory_bytes": {"tables": 10, "accel": 20, "estimate": 30, "peak": null},
            "width": 2, "height": 1, "samples": 2, "rmse_estimate": 0.25, "threads": 1, "bvh": "medium"
        });
        assert_eq!(json, expected);
        assert!(stats.summary(&[]).contains("camera 4 (3 hit)"));
        assert!(!stats.summary(&[]).contains("exact"), "what did not happen is not told");
        assert!(Stats { exact_tests: 1234, ..stats }.summary(&[]).contains("exact   1,234 primitive tests"));
    }
}
