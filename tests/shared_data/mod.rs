//! Data that lie beside the project and are not part of it.

/// How a test says so.
#[path = "../skip/mod.rs"]
pub mod skip;

use std::path::{Path, PathBuf};

use skip::skip;

/// A file or folder of the shared data, such as `meshes/lucy.ply`; `None`, said aloud, where it is absent.
pub fn shared(relative: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data").join(relative);
    if path.exists() {
        return Some(path);
    }
    skip(&format!("this test needs ../shared/data/{relative}"));
    None
}
