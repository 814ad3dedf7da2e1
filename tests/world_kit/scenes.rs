//! The example scenes.

use std::path::Path;

use flatray::scene::{self, Compiled, Overrides};

/// The names of all scenes in `scenes/`, without `.toml`, sorted.
pub fn scene_names() -> Vec<String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut names: Vec<String> = files
        .filter(|path| path.extension().is_some_and(|extension| extension == "toml"))
        .map(|path| path.file_stem().unwrap().to_str().unwrap().to_string())
        .collect();
    names.sort();
    assert!(names.len() >= 12, "only {} scenes found", names.len());
    names
}

/// A scene of `scenes/` at another size.
pub fn load_scene(name: &str, width_px: u32, height_px: u32) -> Compiled {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name).with_extension("toml");
    let overrides = Overrides { width_px: Some(width_px), height_px: Some(height_px), ..Overrides::default() };
    scene::load(&path, &overrides).unwrap_or_else(|error| panic!("{error}"))
}
