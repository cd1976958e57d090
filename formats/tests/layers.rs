//! The table of formats lies above all formats: it names each of them, and none of them imports it.

use std::fs;
use std::path::{Path, PathBuf};

/// What names all formats, and the module with which they are asked for.
const TABLES: [&str; 4] = ["FORMATS", "SURFACES", "PATHS", "format::registry"];

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|end| end == "rs") {
            found.push(path);
        }
    }
}

#[test]
fn no_format_imports_the_registry() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    sources(&root, &mut files);
    assert!(files.len() > 50, "{}", files.len());
    let above =
        ["lib.rs", "format/registry.rs", "surface/mod.rs", "path.rs"].map(|file| root.join(file));
    for file in files.iter().filter(|file| !above.contains(file)) {
        let text = fs::read_to_string(file).unwrap();
        let mut code = text
            .lines()
            .filter(|line| !line.trim_start().starts_with("//"));
        assert!(
            !code.any(|line| TABLES.iter().any(|name| line.contains(name))),
            "{}: formats lie below their table",
            file.display()
        );
    }
}
