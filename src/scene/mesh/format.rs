//! Which format a mesh file has: by its content where that is certain, else by its name, else by what its content looks
//! like.

use std::path::Path;

use super::super::source::{Source, unpacked_name};
use super::number::is_blank;
use super::{off, ply, stl};
use crate::error::{Error, Place, Problem};

/// The formats that can be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Format {
    Ply,
    Obj,
    Stl,
    Off,
}

/// Whether a path has the extension of a mesh file: `.ply`, `.obj`, `.stl` or `.off`, each also with `.gz` or `.zst`
/// behind, in any case of letters. Reads nothing.
pub fn is_mesh_path(path: impl AsRef<Path>) -> bool {
    by_name(path.as_ref()).is_some()
}

/// Whether what has been read is a mesh, by its name or its content.
pub(in crate::scene) fn is_mesh(source: &mut Source) -> bool {
    of(source).is_ok()
}

fn by_name(path: &Path) -> Option<Format> {
    let name = unpacked_name(path);
    let (_, extension) = name.rsplit_once('.')?;
    match extension {
        "ply" => Some(Format::Ply),
        "obj" => Some(Format::Obj),
        "stl" => Some(Format::Stl),
        "off" => Some(Format::Off),
        _ => None,
    }
}

/// Content that is of one format and cannot be of another.
fn by_certain_content(bytes: &[u8]) -> Option<Format> {
    if ply::has_magic(bytes) {
        Some(Format::Ply)
    } else if off::has_keyword(bytes) {
        Some(Format::Off)
    } else {
        stl::is_certain(bytes).then_some(Format::Stl)
    }
}

/// An OBJ file has no mark: its first statement must be one that most of them begin with.
fn looks_like_obj(bytes: &[u8]) -> bool {
    const FIRST_STATEMENTS: [&[u8]; 7] = [b"v", b"vn", b"vt", b"o", b"g", b"mtllib", b"usemtl"];
    let head = &bytes[..bytes.len().min(64 << 10)];
    let mut lines = head.split(|&b| b == b'\n' || b == b'\r').map(<[u8]>::trim_ascii_start);
    let first = lines.find(|line| !line.is_empty() && line[0] != b'#');
    let word = first.and_then(|line| line.split(|&b| is_blank(b)).next());
    word.is_some_and(|word| FIRST_STATEMENTS.contains(&word))
}

/// The format of a source; passes over a byte order mark where the content is text.
///
/// # Errors
/// When neither name nor content tell.
pub(super) fn of(source: &mut Source) -> Result<Format, Error> {
    if !stl::has_binary_size(source.bytes()) {
        source.skip_byte_order_mark();
    }
    let bytes = source.bytes();
    let certain = by_certain_content(bytes).or_else(|| by_name(source.path()));
    certain.or_else(|| looks_like_obj(bytes).then_some(Format::Obj)).ok_or_else(|| {
        Problem::new(Place::file(source.path()), "the format of the mesh is unknown")
            .found(source.path().extension().map_or("no extension".into(), |e| format!("`.{}`", e.to_string_lossy())))
            .expected("`.ply`, `.obj`, `.stl` or `.off`, each also with `.gz` or `.zst` behind")
            .into()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn format(name: &str, bytes: &[u8]) -> Result<Format, String> {
        let mut source = Source::from_bytes(Path::new(name), bytes.to_vec()).unwrap();
        of(&mut source).map_err(|error| error.to_string())
    }

    #[test]
    fn mesh_paths_are_known_by_their_extension_in_any_case_plain_or_compressed() {
        for path in ["a.ply", "b/c.OBJ", "d.Stl", "e.ply.gz", "f.tar.obj.GZ", ".stl", "g.off", "h.OFF.Zst"] {
            assert!(is_mesh_path(path), "{path}");
        }
        for path in ["a.toml", "ply", "a.ply.zip", "a.gz", "a.nff", "stl/", "", "a.ply.gz.gz"] {
            assert!(!is_mesh_path(path), "{path}");
        }
    }

    #[test]
    fn an_unknown_extension_is_refused_with_those_that_are_known() {
        assert_eq!(
            format("x.fbx", b"stuff").unwrap_err(),
            "x.fbx: the format of the mesh is unknown: found `.fbx`, expected `.ply`, `.obj`, `.stl` or `.off`, each \
             also with `.gz` or `.zst` behind"
        );
    }

    #[test]
    fn certain_content_is_read_as_what_it_is_under_any_name() {
        let binary_stl = [&[b' '; 80][..], &1_u32.to_le_bytes(), &[0; 50]].concat();
        let ascii_stl = b"\n solid x\n facet normal 0 0 1\n";
        let contents: [(&[u8], Format); 5] = [
            (b"ply\r\nformat", Format::Ply),
            (b"# c\nCOFF\n3 1 0", Format::Off),
            (&binary_stl, Format::Stl),
            (ascii_stl, Format::Stl),
            (b"\xef\xbb\xbfOFF 3 1 0\n", Format::Off),
        ];
        for (bytes, expected) in contents {
            for name in ["a.obj", "a.ply", "a.dat", "a"] {
                assert_eq!(format(name, bytes), Ok(expected), "{name}");
            }
        }
    }

    #[test]
    fn what_looks_like_obj_is_obj_where_the_name_tells_nothing() {
        assert_eq!(format("a.txt", b"\xef\xbb\xbf# made by\n\nmtllib a.mtl\n"), Ok(Format::Obj));
        assert_eq!(format("a.off", b"v 0 0 0\n"), Ok(Format::Off), "the name is asked first");
        assert!(format("a.txt", b"vector 1 2\n").is_err() && format("a.txt", b"").is_err());
    }
}
