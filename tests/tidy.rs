//! The rules of the house, checked on the source itself.

use std::fs;
use std::path::{Path, PathBuf};

const ROOMS: [&str; 10] = ["error", "numeric", "simd", "world", "scene", "accel", "film", "render", "measure", "cli"];

/// What each room may import; `error` may import nothing of ours.
fn may_import(room: &str) -> &'static [&'static str] {
    match room {
        "error" | "simd" => &[],
        "numeric" => &["simd"],
        "world" => &["numeric", "simd", "error"],
        "scene" => &["world", "numeric", "error"],
        "accel" => &["world", "numeric", "simd"],
        "film" => &["numeric", "error"],
        "render" => &["world", "accel", "film", "numeric", "simd"],
        "measure" => &["error", "numeric", "simd", "world", "scene", "accel", "film", "render"],
        "cli" => &["error", "numeric", "simd", "world", "scene", "accel", "film", "render", "measure"],
        _ => unreachable!("no room of this name: {room}"),
    }
}

/// Crates that exactly one file may name, or the files of one folder.
const SINGLE_IMPORTERS: [(&str, &str); 10] = [
    ("obvhs", "src/accel/build.rs"),
    ("toml", "src/scene/toml.rs"),
    ("exr", "src/film/exr/"),
    ("half", "src/film/exr/"),
    ("image", "src/film/png.rs"),
    ("annotate_snippets", "src/cli/diagnostic.rs"),
    ("libloading", FOREIGN_LIBRARY),
    ("memmap2", FILE_MAPPING),
    ("ruzstd", "src/scene/source/unpack.rs"),
    ("murmur3", "src/film/cryptomatte.rs"),
];

/// Where a library of another language is loaded and called, and where files are mapped: the only files outside of
/// `simd` with unsafe code.
const FOREIGN_LIBRARY: &str = "src/measure/embree/library.rs";
const FILE_MAPPING: &str = "src/scene/source/map.rs";

const MAX_FILE_LINES: usize = 500;
const MAX_FUNCTION_LINES: usize = 70;

struct Source {
    path: String,
    text: String,
}

impl Source {
    /// The part in front of the unit tests: rules for the product do not bind its tests.
    fn product(&self) -> &str {
        self.text.split("#[cfg(test)]").next().unwrap_or(&self.text)
    }

    /// Lines of the product that are not comments.
    fn code_lines(&self) -> impl Iterator<Item = (usize, &str)> {
        self.product().lines().enumerate().filter(|(_, line)| !line.trim_start().starts_with("//"))
    }

    fn room(&self) -> &str {
        let inside = self.path.strip_prefix("src/").unwrap_or(&self.path);
        inside.split('/').next().unwrap_or(inside).trim_end_matches(".rs")
    }
}

fn sources() -> Vec<Source> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files = Vec::new();
    let mut folders = vec![root.join("src")];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path: PathBuf = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                let name = path.strip_prefix(root).unwrap().to_string_lossy().replace('\\', "/");
                files.push(Source { path: name, text: fs::read_to_string(&path).unwrap() });
            }
        }
    }
    assert!(files.len() > 40, "only {} source files found", files.len());
    // Unit tests in files of their own.
    files.retain(|source| !source.path.ends_with("/tests.rs"));
    files.sort_by(|a, b| a.path.cmp(&b.path));
    files
}

fn assert_none(what: &str, found: Vec<String>) {
    assert!(found.is_empty(), "{what}:\n{}", found.join("\n"));
}

/// The rooms that a line names behind `crate::`.
fn rooms_named(line: &str) -> impl Iterator<Item = &'static str> {
    let mut named = Vec::new();
    for part in line.split("crate::").skip(1) {
        let grouped = part.strip_prefix('{').map(|group| group.split('}').next().unwrap_or(group));
        match grouped {
            Some(group) => named.extend(
                ROOMS
                    .into_iter()
                    .filter(|room| group.split(',').any(|item| item.trim().split("::").next() == Some(*room))),
            ),
            None => {
                let first: String = part.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
                named.extend(ROOMS.into_iter().find(|room| *room == first));
            }
        }
    }
    named.into_iter()
}

#[test]
fn no_module_imports_against_the_flow() {
    let mut found = Vec::new();
    for source in sources().iter().filter(|source| !matches!(source.room(), "lib" | "main")) {
        for (number, line) in source.code_lines() {
            for room in rooms_named(line) {
                if room != source.room() && !may_import(source.room()).contains(&room) {
                    found.push(format!("{}:{}: {} imports {room}", source.path, number + 1, source.room()));
                }
            }
        }
    }
    assert_none("imports against the flow", found);
}

#[test]
fn each_of_these_crates_has_one_importer() {
    let sources = sources();
    for (name, importer) in SINGLE_IMPORTERS {
        // Where a module of ours bears a crate's name, only an import of the crate itself counts.
        let shadowed = sources.iter().any(|source| {
            [format!("/{name}.rs"), format!("/{name}/mod.rs")].iter().any(|end| source.path.ends_with(end))
        });
        let import = [format!("use {name}::"), format!("use {name};"), format!("use ::{name}")];
        let path = [format!(" {name}::"), format!("({name}::"), format!("<{name}::")];
        let names = |source: &&Source| {
            source.code_lines().any(|(_, line)| {
                import.iter().any(|start| line.trim_start().starts_with(start.as_str()))
                    || (!shadowed && !line.contains("use ") && path.iter().any(|part| line.contains(part.as_str())))
            })
        };
        let importers: Vec<&str> = sources.iter().filter(names).map(|source| source.path.as_str()).collect();
        match importer.ends_with('/') {
            true => {
                let strangers: Vec<&&str> = importers.iter().filter(|path| !path.starts_with(importer)).collect();
                assert!(strangers.is_empty() && !importers.is_empty(), "importers of {name}: {strangers:?}");
            }
            false => assert_eq!(importers, [importer], "importers of {name}"),
        }
    }
}

#[test]
fn files_are_short() {
    let long = sources()
        .iter()
        .filter(|source| source.text.lines().count() > MAX_FILE_LINES)
        .map(|s| s.path.clone())
        .collect();
    assert_none("files of more than 500 lines", long);
}

#[test]
fn functions_are_short() {
    let mut found = Vec::new();
    for source in sources() {
        let lines: Vec<&str> = source.text.lines().collect();
        for (start, line) in lines.iter().enumerate() {
            let indent = line.len() - line.trim_start().len();
            let code = line.trim_start();
            let is_function = code.split_whitespace().take(5).any(|word| word == "fn") && !code.starts_with("//");
            // A declaration without a body ends in a semicolon, some lines on perhaps.
            let last_of_signature = lines[start..].iter().find(|line| line.ends_with('{') || line.ends_with(';'));
            if !is_function || last_of_signature.is_none_or(|line| line.ends_with(';')) {
                continue;
            }
            let closing = format!("{}}}", " ".repeat(indent));
            let end = lines[start..].iter().position(|line| *line == closing).unwrap_or(0);
            if end + 1 > MAX_FUNCTION_LINES {
                found.push(format!("{}:{}: {} lines", source.path, start + 1, end + 1));
            }
        }
    }
    assert_none("functions of more than 70 lines", found);
}

#[test]
fn rooms_have_names_that_say_what_is_in_them() {
    let vague = ["utils", "util", "helpers", "helper", "manager", "common", "misc"];
    let found = sources()
        .iter()
        .filter(|source| source.path.split('/').any(|part| vague.contains(&part.trim_end_matches(".rs"))))
        .map(|source| source.path.clone())
        .collect();
    assert_none("vague names", found);
}

#[test]
fn the_product_does_not_panic_on_purpose_or_print() {
    let forbidden = [
        ".unwrap()",
        ".expect(",
        // The lints of Cargo.toml see to the macros that mark unfinished work.
        "panic!(",
        "println!(",
        "eprintln!(",
        "print!(",
        "eprint!(",
        "process::exit",
    ];
    let mut found = Vec::new();
    for source in sources() {
        for (number, line) in source.code_lines() {
            // A parser may have a method of this name.
            let line = line.replace("self.expect(", "");
            if let Some(word) = forbidden.into_iter().find(|word| line.contains(word)) {
                found.push(format!("{}:{}: {word}", source.path, number + 1));
            }
        }
    }
    assert_none("in product code", found);
}

#[test]
fn unsafe_code_is_where_it_may_be_and_argued() {
    let sources = sources();
    let may_be_unsafe =
        |source: &&Source| source.room() == "simd" || [FOREIGN_LIBRARY, FILE_MAPPING].contains(&source.path.as_str());
    for source in sources.iter().filter(may_be_unsafe) {
        let unsafe_parts = ["unsafe {", "unsafe impl"].map(|part| source.product().matches(part).count());
        let argued = source.product().matches("// SAFETY:").count();
        assert_eq!(argued, unsafe_parts.iter().sum::<usize>(), "{}: one SAFETY per block", source.path);
    }
    let found = sources
        .iter()
        .filter(|source| !may_be_unsafe(source))
        .flat_map(|source| {
            source
                .code_lines()
                .filter(|(_, line)| line.split(|c: char| !c.is_alphanumeric() && c != '_').any(|w| w == "unsafe"))
                .map(|(number, _)| format!("{}:{}", source.path, number + 1))
                .collect::<Vec<_>>()
        })
        .collect();
    assert_none("unsafe code", found);
}

#[test]
fn render_and_film_read_no_clock() {
    let mut found = Vec::new();
    for source in
        sources().iter().filter(|source| ["render", "film", "accel", "world", "numeric"].contains(&source.room()))
    {
        for (number, line) in
            source.code_lines().filter(|(_, line)| line.contains("Instant::") || line.contains("SystemTime"))
        {
            found.push(format!("{}:{}: {line}", source.path, number + 1));
        }
    }
    assert_none("clocks", found);
}

#[test]
fn the_import_check_sees_what_it_should() {
    let named = |line| rooms_named(line).collect::<Vec<_>>();
    assert_eq!(named("use crate::render::Settings;"), ["render"]);
    assert_eq!(named("let x = crate::accel::Accel::build(crate::world::World::default());"), ["accel", "world"]);
    assert_eq!(named("use crate::{film::Film, world};"), ["world", "film"]);
    assert_eq!(named("use super::render;"), Vec::<&str>::new());
}
