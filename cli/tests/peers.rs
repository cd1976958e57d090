//! Beside numbers that are not ours: `SciPy` and the Python package `splines`
//! (`cli/tests/peers/check.py`). `scripts/test.sh` makes the environment.

use std::process::Command;

#[test]
fn scipy_and_splines_agree() {
    let root = crate::program::root();
    let python = root.join("target/peers/bin/python");
    if !python.exists() {
        assert!(
            std::env::var_os("CI").is_none(),
            "CI must have the peers: scripts/test.sh installs them into target/peers"
        );
        eprintln!("NO PEERS (scripts/test.sh installs them): this test compared nothing");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let output = Command::new(python)
        .arg(root.join("cli/tests/peers/check.py"))
        .arg(env!("CARGO_BIN_EXE_tumble"))
        .arg(folder.path())
        .output()
        .unwrap();
    println!("{}", String::from_utf8_lossy(&output.stdout));
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
}
