//! The material libraries that an OBJ file names, found and read.

use std::collections::{HashMap, HashSet};
use std::fs;
use std::path::{Path, PathBuf};

use super::super::MeshMaterial;
use super::super::finding::{Finding, counted, quoted};
use super::MaterialStatements;
use super::mtl::{self, MtlMaterial};
use crate::error::Problem;
use crate::scene::source::Source;

/// Bytes that all libraries of a file may have: a material takes some 200.
const MOST_LIBRARY_BYTES: u64 = 64 << 20;

/// Names in one `mtllib` at most.
const MOST_NAMES: usize = 64;

/// The materials of a file.
#[derive(Debug, Default)]
pub struct Materials {
    /// Those in use, in the order of their first use.
    pub materials: Vec<MeshMaterial>,
    /// By name in [`MaterialStatements`]: its row; `None` where no library has it.
    pub of_name: Vec<Option<u32>>,
    /// What could not be found or read.
    pub warnings: Vec<Problem>,
}

/// Reads the libraries, looked for beside the OBJ file. Whatever is wrong with them is a warning.
pub(in super::super) fn load(obj: &Source, statements: &MaterialStatements) -> Materials {
    let mut loader = Loader {
        obj,
        directory: obj.path().parent().unwrap_or(Path::new("")),
        opened: HashSet::new(),
        bytes_left: MOST_LIBRARY_BYTES,
        found: Vec::new(),
        warnings: Vec::new(),
    };
    for (offset, names) in &statements.libraries {
        loader.statement(*offset, names);
    }
    let Loader { found, mut warnings, .. } = loader;
    // The first definition of a name counts.
    let mut by_name: HashMap<&[u8], &MtlMaterial> = HashMap::new();
    for material in &found {
        by_name.entry(&material.name).or_insert(material);
    }
    let mut materials = Vec::new();
    let mut missing = None;
    let mut n_missing = 0;
    let of_name = statements.names.iter().map(|(offset, name)| {
        let material = by_name.get(name.as_slice()).or_else(|| by_name.get(without_comment(name)));
        if material.is_none() {
            missing.get_or_insert((*offset, name));
            n_missing += 1;
        }
        materials.push(material?.phong());
        Some(materials.len() as u32 - 1)
    });
    let of_name = of_name.collect();
    if let Some((offset, name)) = missing {
        let what = counted(n_missing, "material is in no library", "materials are in no library");
        let finding = Finding::line(offset, format!("{what}: their faces get the default material"));
        warnings.push(finding.found(quoted(name)).into_problem(obj));
    }
    Materials { materials, of_name, warnings }
}

/// A name without what may be a comment behind it.
fn without_comment(name: &[u8]) -> &[u8] {
    let end = name.windows(2).position(|pair| pair[0].is_ascii_whitespace() && pair[1] == b'#');
    name[..end.unwrap_or(name.len())].trim_ascii()
}

struct Loader<'a> {
    obj: &'a Source,
    directory: &'a Path,
    opened: HashSet<PathBuf>,
    bytes_left: u64,
    found: Vec<MtlMaterial>,
    warnings: Vec<Problem>,
}

impl Loader<'_> {
    /// One `mtllib`: file names apart by blanks, each of which may contain blanks itself. From the left, the longest
    /// that is a file is taken.
    fn statement(&mut self, offset: usize, names: &[u8]) {
        let names = without_comment(names);
        let ends: Vec<usize> = (1..=names.len()).filter(|&end| is_end_of_word(names, end)).take(MOST_NAMES).collect();
        let mut start = 0;
        while let Some(&first_end) = ends.iter().find(|&&end| end > start) {
            let longest = ends.iter().rev().take_while(|&&end| end > start).find_map(|&end| {
                let path = self.path_of(names[start..end].trim_ascii())?;
                Some((end, path))
            });
            match longest {
                Some((end, path)) => {
                    self.open(offset, &path);
                    start = end;
                }
                None => {
                    self.missing(offset, names[start..first_end].trim_ascii());
                    start = first_end;
                }
            }
        }
    }

    /// The file that a name means, if there is one: as it stands, without quotes, or with the separators of Windows.
    fn path_of(&self, name: &[u8]) -> Option<PathBuf> {
        let name = String::from_utf8_lossy(name);
        let name = name.strip_prefix('"').and_then(|name| name.strip_suffix('"')).unwrap_or(&name);
        [self.directory.join(name), self.directory.join(name.replace('\\', "/"))]
            .into_iter()
            .find(|path| path.is_file())
    }

    fn missing(&mut self, offset: usize, name: &[u8]) {
        let finding =
            Finding::line(offset, "the material library is not there: its materials are replaced by the default")
                .found(quoted(name))
                .expected(format!("a file beside {}", self.obj.path().display()));
        self.warn(finding);
    }

    fn warn(&mut self, finding: Finding) {
        /// A file of a million broken statements need not answer with as many warnings.
        const MOST_WARNINGS: usize = 20;
        if self.warnings.len() < MOST_WARNINGS {
            self.warnings.push(finding.into_problem(self.obj));
        }
    }

    fn open(&mut self, offset: usize, path: &Path) {
        if !self.opened.insert(path.to_path_buf()) {
            return;
        }
        // Asked before it is opened, so that no more is read.
        let n_bytes = fs::metadata(path).map_or(0, |metadata| metadata.len());
        let source = if n_bytes <= self.bytes_left { Source::open(path).map(Some) } else { Ok(None) };
        let library = match source {
            Ok(source) => source.filter(|source| source.bytes().len() as u64 <= self.bytes_left),
            Err(error) => return self.warnings.extend(error.problems),
        };
        let Some(library) = library else {
            let finding = Finding::line(offset, "the material library is too large and is not read")
                .found(format!("{n_bytes} bytes in {}", path.display()))
                .expected(format!("at most {} MiB in all libraries", MOST_LIBRARY_BYTES >> 20));
            return self.warn(finding);
        };
        self.bytes_left -= library.bytes().len() as u64;
        let read = mtl::parse(library.bytes());
        self.warnings.extend(read.findings.into_iter().map(|finding| finding.into_problem(&library)));
        self.found.extend(read.materials);
    }
}

/// Whether a word ends in front of this offset.
fn is_end_of_word(bytes: &[u8], end: usize) -> bool {
    let is_blank = |byte: &u8| byte.is_ascii_whitespace();
    !is_blank(&bytes[end - 1]) && bytes.get(end).is_none_or(is_blank)
}
