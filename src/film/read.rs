//! Any image file, chosen by its first bytes.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use crate::error::{Error, Place, Problem};
use crate::film::png_chunk::Transfer;
use crate::film::{Film, exr, pfm, png};

/// An image that was read from a file.
#[derive(Clone, Debug, PartialEq)]
pub struct ImageFile {
    /// The scene-linear image.
    pub film: Film,
    /// The bytes of an 8-bit file before its transfer was undone, one triple per pixel; grey is three times the same.
    pub rgb8: Option<Vec<[u8; 3]>>,
    /// Whether the values are what a screen shows (PNG) and not radiance.
    pub is_picture: bool,
}

/// Reads a PNG, EXR or PFM file. Which one it is, its first bytes say; the extension does not matter.
///
/// `png_transfer` overrides what a PNG says about its transfer; EXR and PFM are linear.
///
/// # Errors
/// A file that cannot be read, is of none of these formats, or is damaged.
pub fn read_image(path: impl AsRef<Path>, png_transfer: Option<Transfer>) -> Result<ImageFile, Error> {
    let path = path.as_ref();
    let bytes = read_bytes(path)?;
    let start = |n_bytes: usize| &bytes[..n_bytes.min(bytes.len())];
    if start(8) == png::SIGNATURE {
        png::decode(&bytes, png_transfer, path)
    } else if start(4) == exr::MAGIC {
        Ok(ImageFile { film: exr::decode(&bytes, path)?, rgb8: None, is_picture: false })
    } else if matches!(start(2), b"PF" | b"Pf") {
        Ok(ImageFile { film: pfm::decode(&bytes, path)?, rgb8: None, is_picture: false })
    } else {
        Err(Problem::new(Place::file(path), "not an image that can be read")
            .found(describe_start(start(4)))
            .expected("a PNG, EXR or PFM file")
            .into())
    }
}

fn describe_start(bytes: &[u8]) -> String {
    match bytes {
        [] => "an empty file".to_string(),
        _ => format!("a file that starts with \"{}\"", bytes.escape_ascii()),
    }
}

/// All bytes of a regular file; devices and pipes could go on for ever.
pub(super) fn read_bytes(path: &Path) -> Result<Vec<u8>, Error> {
    let cannot_read = |error: std::io::Error| Error::io(path, "read the image", &error);
    let mut file = File::open(path).map_err(cannot_read)?;
    let metadata = file.metadata().map_err(cannot_read)?;
    if !metadata.is_file() {
        let found = if metadata.is_dir() { "a directory" } else { "a device or pipe" };
        let problem = Problem::new(Place::file(path), "cannot read the image");
        return Err(problem.found(found).expected("a file").into());
    }
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes).map_err(cannot_read)?;
    Ok(bytes)
}

/// A vector of one value, or an error when memory does not suffice.
pub(super) fn filled<T: Clone>(length: usize, value: T, path: &Path) -> Result<Vec<T>, Error> {
    let mut values = Vec::new();
    values
        .try_reserve_exact(length)
        .map_err(|_| Error::new(Place::file(path), format!("not enough memory for a plane of {length} samples")))?;
    values.resize(length, value);
    Ok(values)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_image_is_refused_with_its_first_bytes() {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), "ply\nformat").unwrap();
        let error = read_image(file.path(), None).unwrap_err().to_string();
        assert!(error.contains(r#"starts with "ply\n""#), "{error}");
        std::fs::write(file.path(), "").unwrap();
        assert!(read_image(file.path(), None).unwrap_err().to_string().contains("an empty file"));
    }

    #[test]
    fn a_directory_and_a_missing_file_are_refused() {
        let directory = tempfile::tempdir().unwrap();
        let error = read_image(directory.path(), None).unwrap_err().to_string();
        assert!(error.contains("directory"), "{error}");
        let error = read_image(directory.path().join("none.png"), None).unwrap_err().to_string();
        assert!(error.contains("none.png") && error.contains("cannot read"), "{error}");
    }
}
