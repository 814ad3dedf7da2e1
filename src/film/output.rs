//! Output files: written beside their place and renamed, so that nobody ever sees half a file.

use std::fs::{self, File, Permissions};
use std::io::{self, BufWriter, Cursor, Seek, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use crate::error::{Error, Place, Problem};

/// An image format that can be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// OpenEXR.
    Exr,
    /// PNG.
    Png,
    /// Portable float map.
    Pfm,
}

impl Format {
    /// The format that a file's extension names, in either case.
    ///
    /// # Errors
    /// No extension, or another one.
    pub fn of_path(path: impl AsRef<Path>) -> Result<Format, Error> {
        let path = path.as_ref();
        let extension = path.extension().map(|extension| extension.to_string_lossy().to_lowercase());
        match extension.as_deref() {
            Some("exr") => Ok(Format::Exr),
            Some("png") => Ok(Format::Png),
            Some("pfm") => Ok(Format::Pfm),
            other => Err(Problem::new(Place::file(path), "the file's extension does not name an image format")
                .found(other.map_or("no extension".to_string(), |extension| format!(".{extension}")))
                .expected(".exr, .png or .pfm")
                .into()),
        }
    }
}

/// What a writer is given.
pub trait WriteSeek: Write + Seek {}
impl<T: Write + Seek> WriteSeek for T {}

/// Finds out, before any work is done, whether a file can be written, by creating and removing a file beside it.
///
/// # Errors
/// A missing directory, one without permission, a path that is a directory, a write-protected file.
pub fn check_writable(path: impl AsRef<Path>) -> Result<(), Error> {
    match resolve(path.as_ref())? {
        Target::Regular(target) => create_beside(&target, path.as_ref()).map(drop),
        Target::Special => Ok(()),
    }
}

/// Writes a file through `write`: into a new file in the same directory, which then takes the name. An existing file keeps
/// its permissions, a new one gets the usual ones (0666 less the umask); a symbolic link is followed. When anything goes
/// wrong, or the process unwinds, the old file is untouched and the new one removed.
///
/// A path that exists and is no regular file (a device, a pipe) is written to directly, once all bytes are known.
///
/// # Errors
/// As [`check_writable`], and what `write` or the file system answers.
pub fn write_file(
    path: impl AsRef<Path>,
    write: impl FnOnce(&mut dyn WriteSeek) -> io::Result<()>,
) -> Result<(), Error> {
    let path = path.as_ref();
    let cannot_write = |error: io::Error| Error::io(path, "write the file", &error);
    match resolve(path)? {
        Target::Regular(target) => {
            let mut file = create_beside(&target, path)?;
            let mut buffered = BufWriter::new(file.as_file_mut());
            write(&mut buffered).and_then(|()| buffered.flush()).map_err(cannot_write)?;
            drop(buffered);
            file.persist(&target).map(drop).map_err(|error| cannot_write(error.error))
        }
        Target::Special => {
            let mut bytes = Cursor::new(Vec::new());
            write(&mut bytes).map_err(cannot_write)?;
            let mut file = File::options().write(true).open(path).map_err(cannot_write)?;
            file.write_all(bytes.get_ref()).map_err(cannot_write)
        }
    }
}

/// What stands at a path, or will.
enum Target {
    /// A regular file, or nothing yet; links are resolved.
    Regular(PathBuf),
    /// A device or pipe.
    Special,
}

fn resolve(path: &Path) -> Result<Target, Error> {
    let refused =
        |found: &str| -> Error { Problem::new(Place::file(path), "cannot write the file").found(found).into() };
    if path.file_name().is_none() {
        return Err(refused("a path without a file name"));
    }
    match fs::metadata(path) {
        Ok(metadata) if metadata.is_dir() => Err(refused("a directory of that name")),
        Ok(metadata) if !metadata.is_file() => Ok(Target::Special),
        Ok(metadata) if metadata.permissions().readonly() => Err(refused("a write-protected file of that name")),
        Ok(_) => {
            let target = fs::canonicalize(path).map_err(|error| Error::io(path, "write the file", &error))?;
            Ok(Target::Regular(target))
        }
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(Target::Regular(path.to_path_buf())),
        Err(error) => Err(Error::io(path, "write the file", &error)),
    }
}

fn create_beside(target: &Path, named: &Path) -> Result<NamedTempFile, Error> {
    let directory = match target.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let mut builder = tempfile::Builder::new();
    builder.prefix(".flatray-").suffix(".tmp");
    let usual = usual_permissions();
    if let Some(permissions) = usual {
        builder.permissions(permissions);
    }
    let cannot_write = |error: io::Error| {
        let doing = format!("write into the directory {}", directory.display());
        // Only the kind: the whole text would name the temporary file, by another name every time.
        Error::io(named, &doing, &error.kind().into())
    };
    let file = builder.tempfile_in(directory).map_err(cannot_write)?;
    if let Ok(metadata) = fs::metadata(target) {
        file.as_file().set_permissions(metadata.permissions()).map_err(cannot_write)?;
    }
    Ok(file)
}

/// What a program asks for when it creates a file; the system takes the umask off. Temporary files would be private.
#[cfg(unix)]
fn usual_permissions() -> Option<Permissions> {
    use std::os::unix::fs::PermissionsExt;
    Some(Permissions::from_mode(0o666))
}

/// Elsewhere files are created as usual.
#[cfg(not(unix))]
fn usual_permissions() -> Option<Permissions> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names_in(directory: &Path) -> Vec<String> {
        fs::read_dir(directory).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect()
    }

    #[test]
    fn a_written_file_replaces_the_old_one_and_leaves_nothing_beside_it() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.png");
        for text in ["old", "new"] {
            write_file(&path, |out| out.write_all(text.as_bytes())).unwrap();
            assert_eq!(fs::read_to_string(&path).unwrap(), text);
        }
        assert_eq!(names_in(directory.path()), ["a.png"]);
    }

    #[test]
    fn a_failing_write_leaves_the_old_file_and_no_new_one() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.png");
        fs::write(&path, "old").unwrap();
        let error = write_file(&path, |out| {
            out.write_all(&[0; 100_000])?;
            Err(io::Error::other("disk full"))
        });
        assert!(error.unwrap_err().to_string().contains("disk full"));
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        assert_eq!(names_in(directory.path()), ["a.png"]);
    }

    #[test]
    fn unwritable_places_are_refused_early() {
        let directory = tempfile::tempdir().unwrap();
        let missing = check_writable(directory.path().join("none/a.png")).unwrap_err().to_string();
        assert!(missing.contains("cannot write into the directory") && missing.ends_with("not found"), "{missing}");
        let is_directory = check_writable(directory.path()).unwrap_err().to_string();
        assert!(is_directory.contains("a directory of that name"), "{is_directory}");
        assert!(check_writable("").is_err());

        let file = directory.path().join("file");
        fs::write(&file, "").unwrap();
        assert!(check_writable(file.join("a.png")).is_err());
        let mut permissions = fs::metadata(&file).unwrap().permissions();
        permissions.set_readonly(true);
        fs::set_permissions(&file, permissions).unwrap();
        let protected = check_writable(&file).unwrap_err().to_string();
        assert!(protected.contains("write-protected"), "{protected}");
    }

    #[test]
    fn checking_creates_nothing() {
        let directory = tempfile::tempdir().unwrap();
        check_writable(directory.path().join("a.exr")).unwrap();
        assert!(names_in(directory.path()).is_empty());
    }

    #[cfg(unix)]
    #[test]
    fn permissions_are_the_usual_ones_or_those_of_the_old_file() {
        use std::os::unix::fs::PermissionsExt;
        let directory = tempfile::tempdir().unwrap();
        let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode() & 0o777;
        let (plain, ours) = (directory.path().join("plain"), directory.path().join("ours"));
        fs::write(&plain, "").unwrap();
        write_file(&ours, |_| Ok(())).unwrap();
        assert_eq!(mode(&ours), mode(&plain));
        fs::set_permissions(&ours, Permissions::from_mode(0o640)).unwrap();
        write_file(&ours, |_| Ok(())).unwrap();
        assert_eq!(mode(&ours), 0o640);
    }

    #[cfg(unix)]
    #[test]
    fn a_link_is_followed_and_a_device_is_not_replaced() {
        let directory = tempfile::tempdir().unwrap();
        let (real, link) = (directory.path().join("real"), directory.path().join("link"));
        fs::write(&real, "old").unwrap();
        std::os::unix::fs::symlink(&real, &link).unwrap();
        write_file(&link, |out| out.write_all(b"new")).unwrap();
        assert_eq!(fs::read_to_string(&real).unwrap(), "new");
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());

        write_file("/dev/null", |out| out.write_all(b"gone")).unwrap();
        assert!(!fs::metadata("/dev/null").unwrap().is_file());
    }

    #[test]
    fn the_extension_names_the_format() {
        assert_eq!(Format::of_path("a/b.EXR"), Ok(Format::Exr));
        assert_eq!(Format::of_path("b.png"), Ok(Format::Png));
        let error = Format::of_path("picture.jpg").unwrap_err().to_string();
        assert_eq!(
            error,
            "picture.jpg: the file's extension does not name an image format: found .jpg, expected .exr, .png or .pfm"
        );
    }
}
