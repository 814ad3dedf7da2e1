//! Data that lie beside the project and are not part of it.

use std::path::{Path, PathBuf};

/// A file or folder of the shared data, such as `meshes/lucy.ply`; `None`, said aloud, where it is absent.
#[allow(clippy::print_stderr)]
pub fn shared(relative: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data").join(relative);
    if path.exists() {
        return Some(path);
    }
    eprintln!("SKIPPED: this test needs ../shared/data/{relative}");
    None
}
