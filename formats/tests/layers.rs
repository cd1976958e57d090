//! The table of formats lies above all formats: it names each of them, and none of them imports it. Clips and the
//! operations on them lie below.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// The tables that name all formats, and the module that looks up formats.
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

/// The folder of the sources.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
}

/// The modules that read and write files: those that the tables of `lib.rs` name, and the modules that they share.
fn format_modules() -> BTreeSet<String> {
    let text = fs::read_to_string(root().join("lib.rs")).unwrap();
    let named = text.lines().filter_map(|line| {
        let (path, constant) = line.trim().strip_prefix('&')?.rsplit_once("::")?;
        let is_row = ["FORMAT,", "SURFACE,", "PATH_FORMAT,"].contains(&constant);
        is_row.then(|| path.split("::").next().unwrap().to_owned())
    });
    named.chain(["table".to_owned()]).collect()
}

/// The formats that a source imports, its unit tests apart.
fn imported<'m>(text: &str, modules: &'m BTreeSet<String>) -> Vec<&'m str> {
    let code = text.split("#[cfg(test)]\nmod tests").next().unwrap();
    let code = code.lines().map(|line| line.split("//").next().unwrap());
    let paths = code.flat_map(|line| line.split("crate::").skip(1));
    let first = paths.filter_map(|path| {
        path.split(|c: char| !c.is_alphanumeric() && c != '_')
            .next()
    });
    first
        .filter_map(|name| modules.get(name))
        .map(|it| &**it)
        .collect()
}

#[test]
fn clips_and_operations_on_them_know_no_format() {
    let modules = format_modules();
    assert!(modules.len() > 12, "{modules:?}");
    let mut files = vec![root().join("motion.rs")];
    sources(&root().join("motion"), &mut files);
    assert!(files.len() > 20, "{}", files.len());
    for file in &files {
        let text = fs::read_to_string(file).unwrap();
        let found = imported(&text, &modules);
        assert!(
            found.is_empty(),
            "{}: {found:?} read and write clips",
            file.display()
        );
    }
    let mistake =
        "use crate::bvh::read_bvh;\n// crate::npz\n#[cfg(test)]\nmod tests { use crate::dat; }";
    assert_eq!(imported(mistake, &modules), ["bvh"]);
}

#[test]
fn no_format_imports_the_registry() {
    let root = root();
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
