//! The recipes for conda, Homebrew, vcpkg and Nix, which the tools that read them are not at hand to try: their version,
//! licence and description are those of Cargo.toml, the files that they name exist, and the commands in them run.

use std::collections::BTreeSet;
use std::fs;

use crate::program::{root, succeed};

/// The recipes that `scripts/recipes.sh` fills in.
const FILLED: [&str; 4] = [
    "conda/recipe.yaml",
    "homebrew/tumble.rb",
    "vcpkg/vcpkg.json",
    "vcpkg/portfile.cmake",
];

fn read(path: &str) -> String {
    fs::read_to_string(root().join(path)).unwrap_or_else(|error| panic!("{path}: {error}"))
}

fn recipe(path: &str) -> String {
    read(&format!("packaging/{path}"))
}

/// A field of Cargo.toml, the first of its name, as the script takes it.
fn field(name: &str) -> String {
    let text = read("Cargo.toml");
    let start = format!("{name} = \"");
    let line = text.lines().find_map(|line| line.strip_prefix(&start));
    line.unwrap().trim_end_matches('"').to_owned()
}

/// The names between two `@` in a text.
fn fields_in(text: &str) -> BTreeSet<&str> {
    let is_name = |part: &&str| {
        let is_letter = |c: char| c.is_ascii_uppercase() || c.is_ascii_digit() || c == '_';
        !part.is_empty() && part.chars().all(is_letter)
    };
    text.split('@').skip(1).step_by(2).filter(is_name).collect()
}

#[test]
fn recipes_have_the_version_the_licence_and_the_description_of_cargo_toml() {
    let [version, license, description] = ["version", "license", "description"].map(field);
    assert_eq!(version, env!("CARGO_PKG_VERSION"));
    let script = read("scripts/recipes.sh");
    let filled = fields_in(&script);
    for path in FILLED {
        let text = recipe(path);
        assert!(script.contains(path), "{path} is not filled in");
        let unknown: Vec<&str> = fields_in(&text).difference(&filled).copied().collect();
        assert!(unknown.is_empty(), "{path}: {unknown:?} have no value");
        assert!(fields_in(&text).contains("VERSION"), "{path}");
        for fixed in [&version, &license, &description] {
            assert!(
                !text.contains(fixed.as_str()),
                "{path}: `{fixed}` is in Cargo.toml"
            );
        }
    }
    let filled = recipe("vcpkg/vcpkg.json")
        .replace("@VERSION@", &version)
        .replace("@LICENSE@", &license)
        .replace("@DESCRIPTION@", &description);
    let port: serde_json::Value = serde_json::from_str(&filled).unwrap();
    assert_eq!(port["license"], license.as_str());
    // Nix reads the version from Cargo.toml; it has other names for the licences.
    let flake = recipe("nix/flake.nix");
    assert!(!flake.contains(&version) && flake.contains("version = manifest.version;"));
    assert_eq!(flake.matches(&description).count(), 1, "{description}");
    assert_eq!(license, "MIT OR Apache-2.0");
    assert!(flake.contains("[ mit asl20 ]"));
}

#[test]
fn recipes_name_files_packages_and_commands_that_exist() {
    let named = [
        (
            "conda/recipe.yaml",
            &["LICENSE-APACHE", "LICENSE-MIT", "cli"][..],
        ),
        (
            "homebrew/tumble.rb",
            &[
                "README.md",
                "CHANGELOG.md",
                "LICENSE-APACHE",
                "LICENSE-MIT",
                "cli",
            ],
        ),
        (
            "vcpkg/portfile.cmake",
            &["scripts/library.sh", "LICENSE-MIT", "LICENSE-APACHE"],
        ),
        ("nix/flake.nix", &["Cargo.toml", "Cargo.lock"]),
    ];
    for (path, files) in named {
        let text = recipe(path);
        for file in files {
            assert!(text.contains(file), "{path} does not name {file}");
            assert!(root().join(file).exists(), "{path}: {file} does not exist");
        }
    }
    let flake = recipe("nix/flake.nix");
    assert!(flake.contains(&format!("\"-p\" \"{}\"", env!("CARGO_PKG_NAME"))));
    // The port installs the folder that the script makes.
    let (port, library) = (recipe("vcpkg/portfile.cmake"), read("scripts/library.sh"));
    assert!(library.contains("name=libtumble-$version-$host"));
    assert!(port.contains("target/library/libtumble-@VERSION@-*"));
    // The tests of the recipes.
    let folder = tempfile::tempdir().unwrap();
    for line in [
        "--version",
        "generate -o chain.dat",
        "verify chain.dat --device cpu -m slerp",
        "completions zsh",
        "man",
    ] {
        let words: Vec<&str> = line.split(' ').collect();
        let quoted: Vec<String> = words.iter().map(|word| format!("\"{word}\"")).collect();
        let texts = [
            recipe("conda/recipe.yaml"),
            recipe("homebrew/tumble.rb"),
            flake.clone(),
        ];
        let is_used = |text: &String| text.contains(line) || text.contains(&quoted.join(", "));
        assert!(texts.iter().any(is_used), "no recipe runs `tumble {line}`");
        succeed(folder.path(), &words);
    }
}
