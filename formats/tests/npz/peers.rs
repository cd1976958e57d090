//! Compares Tumble's numbers with those that `NumPy` and `SciPy` compute from the samples, or read from the files that
//! Tumble writes (`npz/peers.py`). `scripts/test.sh` makes the environment.

use std::path::Path;
use std::process::Command;

use tumble_formats::format::MotionOptions;
use tumble_formats::motion::SampledClip;
use tumble_formats::npz::write::write_npz;

use super::{Picked, read, sample};

#[test]
fn numpy_and_scipy_agree() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let python = root.join("target/peers/bin/python");
    let Some(path) = sample("smplh_like.npz") else {
        return;
    };
    if !python.exists() {
        eprintln!("NO PEERS (scripts/test.sh installs them): this test compared nothing");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    for name in ["smplh_like.npz", "smplx_like.npz"] {
        let loaded = read(std::fs::read(path.with_file_name(name)).unwrap()).unwrap();
        let clip = &loaded.clips[0];
        let picked = Picked::of(clip, 1);
        let sampled = SampledClip {
            rate: clip.rate,
            ..picked.sampled(clip)
        };
        let (mut rebuilt, mut kept) = (Vec::new(), Vec::new());
        write_npz(
            std::slice::from_ref(&sampled),
            &MotionOptions::default(),
            &mut rebuilt,
        )
        .unwrap();
        let document = loaded.document.as_ref().unwrap();
        let options = MotionOptions::default();
        document
            .write(&[(0, sampled)], &options, Path::new("kept.npz"), &mut kept)
            .unwrap();
        std::fs::write(folder.path().join(format!("own_{name}")), rebuilt).unwrap();
        std::fs::write(folder.path().join(format!("kept_{name}")), kept).unwrap();
    }
    let script = root.join("formats/tests/npz/peers.py");
    let output = Command::new(python)
        .arg(script)
        .args([path.parent().unwrap(), folder.path()])
        .output()
        .unwrap();
    println!("{}", String::from_utf8_lossy(&output.stdout));
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
}
