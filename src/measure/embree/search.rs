//! Where an Embree library may be.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Names that the system's loader may know, the newest first.
const SYSTEM_NAMES: [&str; 4] = ["libembree4.so.4", "libembree4.so", "libembree3.so.3", "libembree3.so"];

/// Prints where Python keeps the package, without importing it.
const ASK_PYTHON: &str = "import importlib.util as u; s = u.find_spec('embreex'); print(s.origin if s else '')";

/// All places to try, in order: the wheel of the default Python, then what the system's loader finds.
pub fn candidates() -> Vec<PathBuf> {
    let bundled = embreex_package().map(|package| bundled_with(&package)).unwrap_or_default();
    bundled.into_iter().chain(SYSTEM_NAMES.map(PathBuf::from)).collect()
}

/// The folder of the package `embreex`; `None` without it or without Python.
fn embreex_package() -> Option<PathBuf> {
    let output = Command::new("python3").args(["-c", ASK_PYTHON]).output().ok()?;
    let origin = String::from_utf8(output.stdout).ok()?;
    Some(Path::new(origin.trim()).parent()?.to_path_buf()).filter(|folder| folder.is_dir())
}

/// Wheels for Linux keep their libraries in `NAME.libs` beside the package, those for macOS inside it.
fn bundled_with(package: &Path) -> Vec<PathBuf> {
    let folders = [package.with_extension("libs"), package.join(".dylibs")];
    let files = folders.iter().filter_map(|folder| fs::read_dir(folder).ok()).flatten().flatten();
    let mut found: Vec<PathBuf> = files.map(|entry| entry.path()).filter(|path| is_embree(path)).collect();
    found.sort();
    found
}

fn is_embree(path: &Path) -> bool {
    path.file_name().is_some_and(|name| name.to_string_lossy().starts_with("libembree"))
}
