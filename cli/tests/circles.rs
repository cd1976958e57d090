//! Files import in one direction: types are below the code that lists or uses them. A circle of imports would have no
//! file with which a reader can begin.
//!
//! The imports are taken from the text: paths that begin with `crate`, `super` or `self`. A file and its
//! child modules count as one: a child's imports from its parent do not count. Unit tests may import from
//! anywhere.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

/// The circles that still exist, one per line: files of a package's folder. The table may only become
/// shorter.
const KNOWN: &[(&str, &str)] = &[
    ("src", ""),
    ("verify/src", ""),
    ("formats/src", ""),
    ("cli/src", ""),
    ("python/src", ""),
    ("npm/src", ""),
    ("capi/src", ""),
];

/// A module's path, without `crate`.
type ModulePath = Vec<String>;

/// The sources of a folder, by their paths below it.
fn sources(folder: &Path) -> BTreeMap<String, String> {
    let mut found = BTreeMap::new();
    let mut pending = vec![folder.to_owned()];
    while let Some(directory) = pending.pop() {
        for entry in fs::read_dir(directory).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                pending.push(path);
            } else if path.extension().is_some_and(|name| name == "rs") {
                let name = path.strip_prefix(folder).unwrap().to_str().unwrap();
                let name = name.replace('\\', "/");
                found.insert(name, fs::read_to_string(&path).unwrap());
            }
        }
    }
    found
}

fn module_of(file: &str) -> ModulePath {
    let stem = file.strip_suffix(".rs").unwrap_or(file);
    let mut path: ModulePath = stem.split('/').map(str::to_owned).collect();
    let is_root = |name: &String| ["mod", "lib", "main"].contains(&&**name);
    if path.last().is_some_and(is_root) {
        path.pop();
    }
    path
}

/// The source without comments, and without the module of unit tests at its end.
fn code(text: &str) -> String {
    let mut kept: Vec<&str> = Vec::new();
    let mut is_of_tests = false;
    for line in text.lines() {
        if is_of_tests && line.starts_with("mod ") && line.ends_with('{') {
            break;
        }
        is_of_tests = line.trim() == "#[cfg(test)]";
        kept.push(line.split("//").next().unwrap_or_default());
    }
    kept.join("\n")
}

/// Reads a path or a tree of paths, `a::{b, c::d}`, behind `prefix`; gives what follows it.
fn read_tree<'a>(
    text: &'a str,
    prefix: &mut Vec<&'a str>,
    found: &mut Vec<Vec<&'a str>>,
) -> &'a str {
    let depth = prefix.len();
    let mut rest = text.trim_start();
    if let Some(inner) = rest.strip_prefix('{') {
        rest = inner.trim_start();
        while !rest.is_empty() && !rest.starts_with('}') {
            let behind = read_tree(rest, prefix, found).trim_start();
            // A part that is no path, such as `*`, has been read as its prefix.
            let end = behind.find([',', '}']).unwrap_or(behind.len());
            rest = behind[end..].trim_start_matches(',').trim_start();
        }
        return rest.strip_prefix('}').unwrap_or(rest);
    }
    let is_of_name = |character: char| character.is_alphanumeric() || character == '_';
    let end = rest.find(|c| !is_of_name(c)).unwrap_or(rest.len());
    prefix.extend((end > 0).then_some(&rest[..end]));
    rest = &rest[end..];
    rest = match rest.strip_prefix("::") {
        Some(behind) if end > 0 => read_tree(behind, prefix, found),
        _ => {
            found.push(prefix.clone());
            rest
        }
    };
    prefix.truncate(depth);
    rest
}

/// The paths in a source that begin with `crate`, `super` or `self`.
fn paths(code: &str) -> Vec<Vec<&str>> {
    let mut found = Vec::new();
    for root in ["crate::", "super::", "self::"] {
        for (at, _) in code.match_indices(root) {
            let before = &code[..at];
            let is_inside = before.ends_with(|c: char| c.is_alphanumeric() || "_:".contains(c));
            // `pub(in crate::…)` imports nothing.
            if !is_inside && !before.ends_with("(in ") {
                read_tree(&code[at..], &mut Vec::new(), &mut found);
            }
        }
    }
    found
}

/// The files that each file imports from.
fn imports(sources: &BTreeMap<String, String>) -> BTreeMap<&str, BTreeSet<&str>> {
    let homes: BTreeMap<ModulePath, &str> = (sources.keys())
        .map(|file| (module_of(file), &**file))
        .collect();
    let of_file = |file: &str, text: &str| -> BTreeSet<&str> {
        let module = module_of(file);
        let code = code(text);
        let mut all = BTreeSet::new();
        for path in paths(&code) {
            let mut names = &path[1..];
            let mut absolute = match path[0] {
                "crate" => Vec::new(),
                "self" => module.clone(),
                _ => module[..module.len().saturating_sub(1)].to_vec(),
            };
            while let Some(("super", behind)) = names.split_first().map(|(name, all)| (*name, all))
            {
                absolute.pop();
                names = behind;
            }
            absolute.extend(names.iter().copied().map(str::to_owned));
            let home = (1..=absolute.len())
                .rev()
                .find_map(|end| homes.get_key_value(&absolute[..end]));
            // A file is a child of the module that its path begins with, or that module itself.
            let others = home.filter(|(home, _)| !module.starts_with(home));
            all.extend(others.map(|(_, file)| *file));
        }
        all
    };
    (sources.iter())
        .map(|(file, text)| (&**file, of_file(file, text)))
        .collect()
}

/// The circles: sets of files each of which imports, by way of others, from all others of the set.
fn circles<'a>(imports: &BTreeMap<&'a str, BTreeSet<&'a str>>) -> BTreeSet<BTreeSet<&'a str>> {
    let reached_from = |start: &'a str| {
        let mut reached = BTreeSet::new();
        let mut pending = vec![start];
        while let Some(file) = pending.pop() {
            let news = imports[file].iter().filter(|next| reached.insert(**next));
            pending.extend(news);
        }
        reached
    };
    let reached: BTreeMap<&str, BTreeSet<&str>> = (imports.keys())
        .map(|file| (*file, reached_from(file)))
        .collect();
    let circle_of = |file: &'a str| -> BTreeSet<&'a str> {
        let all = reached[file].iter().copied();
        all.filter(|other| reached[other].contains(file)).collect()
    };
    let all = imports.keys().map(|file| circle_of(file));
    all.filter(|circle| circle.len() > 1).collect()
}

/// The faults of a package: circles that the table does not have, and files of the table that are in no circle
/// any more.
fn faults(sources: &BTreeMap<String, String>, known: &str) -> Vec<String> {
    let imports = imports(sources);
    let circles = circles(&imports);
    let known: Vec<BTreeSet<&str>> = (known.lines())
        .map(|line| line.split_whitespace().collect())
        .collect();
    let is_known = |circle: &&BTreeSet<&str>| known.iter().any(|all| circle.is_subset(all));
    let new = circles.iter().filter(|circle| !is_known(circle));
    let new = new.map(|circle| {
        let mut fault = "a circle of imports:".to_owned();
        for file in circle {
            let inside: Vec<&str> = imports[file].intersection(circle).copied().collect();
            fault += &format!("\n    {file} imports from {}", inside.join(", "));
        }
        fault
    });
    let in_circles: BTreeSet<&str> = circles.iter().flatten().copied().collect();
    let removed = known
        .iter()
        .flatten()
        .filter(|file| !in_circles.contains(**file));
    let removed = removed.map(|file| format!("{file} is in no circle: take it out of the table"));
    new.chain(removed).collect()
}

#[test]
fn files_import_in_one_direction() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let faults = KNOWN.iter().flat_map(|(package, known)| {
        let sources = sources(&root.join(package));
        assert!(sources.len() > 3, "{package}: {} files", sources.len());
        let faults = faults(&sources, known).into_iter();
        faults.map(move |fault| format!("{package}: {fault}"))
    });
    let faults: Vec<String> = faults.collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn a_circle_of_imports_is_found() {
    let mut package: BTreeMap<String, String> = [
        ("lib.rs", "mod a;\nuse crate::a::f;"),
        ("a.rs", "use crate::{b::{self, c::D}, e::*};\n"),
        ("b/mod.rs", "// use crate::a;\npub(crate) mod c;\n"),
        (
            "b/c.rs",
            "#[cfg(test)]\nmod tests {\n    use crate::a;\n}\n",
        ),
        ("e.rs", "fn f() { self::g() }"),
    ]
    .map(|(file, text)| (file.to_owned(), text.to_owned()))
    .into();
    assert_eq!(faults(&package, ""), [""; 0]);
    assert_eq!(
        imports(&package)["a.rs"],
        ["b/c.rs", "b/mod.rs", "e.rs"].into()
    );
    package.insert("b/c.rs".into(), "fn f() { super::super::a::g() }".into());
    let [fault] = &faults(&package, "")[..] else {
        panic!("one circle");
    };
    let expected =
        "a circle of imports:\n    a.rs imports from b/c.rs\n    b/c.rs imports from a.rs";
    assert_eq!(fault, expected);
    assert_eq!(
        faults(&package, "e.rs a.rs b/c.rs"),
        ["e.rs is in no circle: take it out of the table"]
    );
    assert_eq!(faults(&package, "a.rs b/c.rs"), [""; 0]);
}
