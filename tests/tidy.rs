//! Rules of the house that a compiler does not know.

use std::fs;
use std::path::{Path, PathBuf};

use tumble::METHODS;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn files(directory: &str, extension: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut pending = vec![root().join(directory)];
    while let Some(directory) = pending.pop() {
        for entry in fs::read_dir(directory).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                pending.push(path);
            } else if path.extension().is_some_and(|own| own == extension) {
                found.push(path);
            }
        }
    }
    found
}

fn read(path: impl AsRef<Path>) -> String {
    fs::read_to_string(root().join(path)).unwrap()
}

#[test]
fn unsafe_code_stays_in_its_two_homes() {
    let sources = ["src", "formats/src", "cli/src"].map(|folder| files(folder, "rs"));
    for path in sources.concat() {
        let relative = path.strip_prefix(root()).unwrap();
        let home = relative.starts_with("src/gpu")
            || relative.starts_with("src/cpu/dispatch")
            || relative.ends_with("cpu/dispatch.rs");
        let blocks = read(&path)
            .lines()
            .filter(|line| !line.trim_start().starts_with("//"))
            .filter(|line| line.contains("unsafe {") || line.contains("unsafe fn"))
            .count();
        assert!(
            home || blocks == 0,
            "{}: {blocks} unsafe",
            relative.display()
        );
    }
}

/// A form, a helper or a canary in WGSL without its twin would go unchecked.
#[test]
fn every_shader_function_has_its_twin() {
    for shader in files("shaders", "wgsl") {
        let text = read(&shader);
        let name = shader.file_stem().unwrap().to_str().unwrap();
        let Some(twin) = text.lines().find_map(|line| line.split("Twin: ").nth(1)) else {
            let glue = [
                "launch",
                "kernel",
                "kernel_singles",
                "kernel_storage",
                "kernel_texels",
                "items_storage",
                "items_texels",
                "singles_storage",
                "singles_texels",
                "arc_texels",
                "polynomial_texels",
                "sampled_storage",
                "sampled_texels",
                "joints_storage",
                "joints_texels",
                "distance_in_frames",
                "distance_in_seconds",
                "store_f32",
                "store_f32_wide",
                "wide",
                "pass",
                "store_matrix3x3",
                "store_matrix3x4",
                "store_vector",
            ];
            assert!(glue.contains(&name), "{name}.wgsl names no twin");
            continue;
        };
        let twin = twin.trim_end_matches('.');
        assert!(
            read(twin).contains(&format!("{name}.wgsl")),
            "{twin} does not name {name}.wgsl"
        );
    }
}

/// Two that share a mistake agree: the reference may use no line of the engine.
#[test]
fn the_reference_shares_nothing_with_the_engine() {
    for path in files("src/reference", "rs") {
        let imports = |line: &&str| line.contains("crate::") && !line.contains("crate::tracks");
        for line in read(&path).lines().filter(imports) {
            assert!(
                line.contains("crate::method::"),
                "{}: {line}",
                path.display()
            );
            for word in ["curve", "Curve", "Keys", "numeric"] {
                assert!(!line.contains(word), "{}: {line}", path.display());
            }
        }
    }
}

#[test]
fn every_method_is_in_the_readme() {
    let readme = read("README.md");
    for method in METHODS {
        assert!(
            readme.contains(&format!("| `{}` |", method.name)),
            "{method}"
        );
        let file = format!("src/method/{}.rs", method.name.replace('-', "_"));
        assert!(root().join(&file).exists(), "{file}");
    }
}

/// A file that needs scrolling for minutes is two files.
#[test]
fn files_stay_short() {
    let sources = ["src", "formats/src", "cli/src"].map(|folder| files(folder, "rs"));
    for path in sources
        .into_iter()
        .chain([files("shaders", "wgsl")])
        .flatten()
    {
        let lines = read(&path).lines().count();
        assert!(lines <= 450, "{}: {lines} lines", path.display());
    }
}

/// A crate that nobody can say the use of is one to leave out.
#[test]
fn every_dependency_is_justified() {
    let manifest = read("Cargo.toml");
    let architecture = read("ARCHITECTURE.md");
    let mut section = "";
    let mut count = 0;
    for line in manifest.lines() {
        if line.starts_with('[') {
            section = line;
        } else if section == "[workspace.dependencies]"
            && let Some((name, _)) = line.split_once(" = ")
            && !name.starts_with("tumble")
        {
            count += 1;
            assert!(
                architecture.contains(&format!("`{name}`")),
                "ARCHITECTURE.md does not say what {name} is for"
            );
        }
    }
    assert!(count > 30, "only {count} dependencies were found");
}

/// The oldest Rust that works is the one that the tests run with; a newer one may be used,
/// and is not asked for.
#[test]
fn the_oldest_rust_is_declared_once() {
    let declared = read("Cargo.toml")
        .lines()
        .find_map(|line| line.strip_prefix("rust-version = ").map(str::to_owned))
        .unwrap();
    let version = declared.trim_matches('"');
    let readme = read("README.md");
    assert!(
        readme.contains(&format!("Rust {version}")),
        "README.md names Rust {version}"
    );
    let script = read("scripts/test.sh");
    assert!(
        script.contains("rust-version"),
        "scripts/test.sh checks with the oldest Rust where it is installed"
    );
}
