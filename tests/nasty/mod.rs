//! The collected files that break readers.

use std::fs;
use std::path::{Path, PathBuf};

use flatray::scene::mesh;

use crate::shared_data::shared;

/// All of them that have the name of a mesh, sorted; `None`, said aloud, where they are absent.
pub fn nasty_files() -> Option<Vec<PathBuf>> {
    let mut files = Vec::new();
    add_files_below(&shared("nasty")?, &mut files);
    files.sort();
    assert!(files.len() > 100, "{}", files.len());
    Some(files)
}

fn add_files_below(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            add_files_below(&path, files);
        } else if mesh::is_mesh_path(&path) {
            files.push(path);
        }
    }
}
