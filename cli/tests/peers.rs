//! Compares with numbers of other programs: `SciPy` and the Python package `splines` (`cli/tests/peers`).
//! `scripts/test.sh` makes the environment.

use std::process::Command;

/// Runs a script of `cli/tests/peers` with the program, an empty folder and further arguments.
fn peer(script: &str, arguments: &[&str]) {
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
        .arg(root.join("cli/tests/peers").join(script))
        .arg(env!("CARGO_BIN_EXE_tumble"))
        .arg(folder.path())
        .args(arguments)
        .output()
        .unwrap();
    println!("{}", String::from_utf8_lossy(&output.stdout));
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
}

#[test]
fn scipy_and_splines_agree() {
    peer("check.py", &[]);
}

/// Compared for hundreds of sets with unevenly spaced keys; with `SOAK`, for 2 000.
#[test]
fn c2_is_scipy_s_spline_wherever_that_is_continuous() {
    let sets = match std::env::var_os("SOAK") {
        Some(_) => "2000",
        None => "200",
    };
    peer("c2.py", &[sets]);
}
