//! Where references are kept, so that none is made twice.

use std::fs;
use std::path::{Path, PathBuf};

use super::reference::Reference;
use crate::error::Error;
use crate::film::output::write_file;

/// The folder of references: `flatray/references` in the user's cache, where the XDG Base Directory Specification has it.
/// `None` where the environment names none.
pub fn default_folder(variable: impl Fn(&str) -> Option<PathBuf>) -> Option<PathBuf> {
    // The specification wants relative paths ignored.
    let absolute = |name: &str| variable(name).filter(|path| path.is_absolute());
    let base = absolute("XDG_CACHE_HOME").or_else(|| absolute("HOME").map(|home| home.join(".cache")))?;
    Some(base.join("flatray").join("references"))
}

/// The file of a reference: named after what made it, this version included.
pub fn file_of(folder: &Path, hash: &str, samples: u32) -> PathBuf {
    folder.join(format!("{hash}-{samples}-{}.exr", env!("CARGO_PKG_VERSION")))
}

/// What is kept under a name, if it is what the name says; a damaged file is as none.
pub fn find(path: &Path, hash: &str) -> Option<Reference> {
    Reference::read(path).ok().filter(|reference| reference.hash == hash)
}

/// Keeps a reference.
///
/// # Errors
/// A folder that cannot be made, or a file that cannot be written.
pub fn keep(path: &Path, reference: &Reference) -> Result<(), Error> {
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder).map_err(|error| Error::io(folder, "create the folder", &error))?;
    }
    write_file(path, |out| reference.write(out))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cache_is_where_the_environment_says() {
        let folder = |xdg: &'static str, home: &'static str| {
            default_folder(move |name| {
                let value = if name == "HOME" { home } else { xdg };
                (!value.is_empty()).then(|| PathBuf::from(value))
            })
        };
        assert_eq!(folder("/c", "/h"), Some("/c/flatray/references".into()));
        assert_eq!(folder("", "/h"), Some("/h/.cache/flatray/references".into()));
        assert_eq!(folder("relative", "/h"), Some("/h/.cache/flatray/references".into()));
        assert_eq!(folder("", ""), None);
    }

    #[test]
    fn a_damaged_file_is_as_none() {
        let directory = tempfile::tempdir().unwrap();
        let path = file_of(directory.path(), "0123", 16);
        assert!(find(&path, "0123").is_none());
        fs::write(&path, "no image").unwrap();
        assert!(find(&path, "0123").is_none());
    }
}
