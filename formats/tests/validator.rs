//! Khronos' glTF validator, which was written independently (`formats/tests/validator/`).
//! `scripts/test.sh` installs it.

use std::path::{Path, PathBuf};
use std::process::Command;

use serde::Deserialize;

/// The validator's messages about a file, a text each.
#[derive(Debug, Deserialize)]
pub(crate) struct Report {
    pub(crate) errors: Vec<String>,
    pub(crate) warnings: Vec<String>,
}

/// A report for each of the files; if the validator is missing, prints this and returns `None`.
pub(crate) fn validate(files: &[PathBuf]) -> Option<Vec<Report>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let package = folder.join("../target/validator");
    let node = Command::new("node").arg("--version").output();
    if node.is_err() || !package.join("node_modules/gltf-validator").exists() {
        assert!(
            std::env::var_os("CI").is_none(),
            "CI must have node and gltf-validator: scripts/test.sh installs them"
        );
        eprintln!("NO VALIDATOR (scripts/test.sh installs it): this test validated nothing");
        return None;
    }
    let output = Command::new("node")
        .arg(folder.join("tests/validator/validate.mjs"))
        .arg(package)
        .args(files)
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    let text = String::from_utf8(output.stdout).unwrap();
    let lines = text.lines().map(|line| serde_json::from_str(line).unwrap());
    let reports: Vec<Report> = lines.collect();
    assert_eq!(reports.len(), files.len(), "{said}");
    Some(reports)
}

/// A validator that finds nothing anywhere would prove nothing.
#[test]
fn the_validator_finds_what_is_wrong() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| {
        let file = folder.path().join(name);
        std::fs::write(&file, text).unwrap();
        file
    };
    let files = [
        write("good.gltf", r#"{"asset": {"version": "2.0"}}"#),
        write("bad.gltf", r#"{"asset": {"version": "2.0"}, "scene": 3}"#),
        write("none.glb", "glTF? no"),
    ];
    let Some(reports) = validate(&files) else {
        return;
    };
    let errors: Vec<usize> = reports.iter().map(|report| report.errors.len()).collect();
    assert_eq!(errors, [0, 1, 1], "{reports:?}");
}
