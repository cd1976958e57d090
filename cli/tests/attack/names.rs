//! Names of any kind: if an input cannot be processed because of its name, only this input fails.

use std::ffi::OsStr;
use std::fs;
use std::os::unix::ffi::OsStrExt;

use crate::attack::{entries, run, succeed, two_animations};
use crate::program::sample_folder;
use crate::tree::tree;

/// Names that are too long, not UTF-8, or unusual: the results of the other inputs are made, and
/// resuming ends.
#[test]
fn no_name_ends_a_batch() {
    let temporary = sample_folder();
    let folder = temporary.path();
    let walks = folder.join("walks");
    fs::create_dir(&walks).unwrap();
    let keys = fs::read(folder.join("a.dat")).unwrap();
    // The result's name has 255 bytes, and 257: too long.
    let just = format!("{}.dat", "x".repeat(251));
    let long = format!("{}.d", "y".repeat(253));
    let names: [&OsStr; 8] = [
        OsStr::new("a.dat"),
        OsStr::new(&just),
        OsStr::from_bytes(b"no\xfftext.dat"),
        OsStr::new("two\nlines.dat"),
        OsStr::new("-o.dat"),
        OsStr::new("\x1b[2Jescape.dat"),
        OsStr::new("a b.dat"),
        OsStr::new("z.dat"),
    ];
    for name in names {
        fs::write(walks.join(name), &keys).unwrap();
    }
    fs::write(walks.join(&long), &keys).unwrap();
    let list: Vec<String> = vec![format!("walks/{long}"), "walks".to_owned()];
    fs::write(folder.join("list"), list.join("\n")).unwrap();
    let line = ["eval", "--files-from", "list", "--from", "dat", "-o", "out"];
    let first = run(folder, &line);
    assert_eq!(first.code, 3, "{}", first.words);
    assert!(
        first.words.contains("2 of 9 inputs failed"),
        "{}",
        first.words
    );
    assert!(first.words.contains("is not UTF-8"), "{}", first.words);
    assert!(
        first.words.contains("7 results made, 2 inputs failed"),
        "{}",
        first.words
    );
    let made = entries(&folder.join("out"));
    // Results of the inputs in a list have the directories of the list.
    assert_eq!(made.len(), 9, "{made:?}");
    assert!(made.contains(&format!("walks/{}.npy", "x".repeat(251))));
    let whole = tree(&folder.join("out"));
    for _ in 0..2 {
        let resumed = run(folder, &[&line[..], &["--resume"]].concat());
        assert_eq!(resumed.code, 3, "{}", resumed.words);
        assert!(
            resumed.words.contains("7 results kept"),
            "{}",
            resumed.words
        );
        assert_eq!(tree(&folder.join("out")), whole);
    }
    let check = run(folder, &["check", "out"]);
    assert_eq!(check.code, 8, "{}", check.words);
    assert!(check.words.contains("2 inputs failed"), "{}", check.words);

    let line = [
        "eval",
        "--files-from",
        "list",
        "--from",
        "dat",
        "-o",
        "shards",
        "--shard",
        "1/1",
    ];
    let shard = run(folder, &line);
    assert_eq!(shard.code, 3, "{}", shard.words);
    let merged = run(folder, &["merge", "shards"]);
    assert_eq!(merged.code, 3, "{}", merged.words);
    assert_eq!(tree(&folder.join("shards")), whole);
}

/// An animation may be called anything, and at any length.
#[test]
fn animations_of_any_name_get_files() {
    let temporary = sample_folder();
    let folder = temporary.path();
    let long = "n".repeat(250);
    let other = format!("{}x", "n".repeat(249));
    let renames = [
        (long.as_str(), other.as_str()),
        ("../../up", "/etc/passwd"),
        ("a\nb", "\u{1b}[2J"),
        ("", "."),
    ];
    for (round, (run_name, walk)) in renames.into_iter().enumerate() {
        let mut model: serde_json::Value = serde_json::from_str(&two_animations()).unwrap();
        model["animations"][0]["name"] = run_name.into();
        model["animations"][1]["name"] = walk.into();
        fs::write(folder.join("m.gltf"), model.to_string()).unwrap();
        let out = format!("out{round}");
        succeed(folder, &["eval", "m.gltf", "a.dat", "-o", &out]);
        let made = entries(&folder.join(&out));
        assert_eq!(made.len(), 4, "{made:?}");
        assert!(
            made.iter()
                .all(|name| !name.contains(['/', '\n', '\u{1b}'])),
            "{made:?}"
        );
        let resumed = succeed(folder, &["eval", "m.gltf", "a.dat", "-o", &out, "--resume"]);
        assert!(
            resumed.words.contains("3 results of 2 inputs kept"),
            "{}",
            resumed.words
        );
        succeed(folder, &["check", &out]);
    }
}

/// If one clip cannot be written, only this clip fails.
#[test]
fn one_clip_that_cannot_be_written_does_not_end_the_others() {
    let temporary = sample_folder();
    let folder = temporary.path();
    fs::write(folder.join("m.gltf"), two_animations()).unwrap();
    fs::create_dir_all(folder.join("out/m.Run.npy")).unwrap();
    let line = ["eval", "m.gltf", "a.dat", "-o", "out", "--overwrite"];
    let made = run(folder, &line);
    assert_eq!(made.code, 3, "{}", made.words);
    assert!(
        made.words.contains("1 of 2 animations failed"),
        "{}",
        made.words
    );
    let there = entries(&folder.join("out"));
    assert!(
        there.contains("m.Walk.npy") && there.contains("a.npy"),
        "{there:?}"
    );
    let check = run(folder, &["check", "out"]);
    assert_eq!(check.code, 8, "{}", check.words);
    let failed = "1 input failed in part (the first: m.gltf: 1 of 2 animations failed);";
    assert!(check.words.contains(failed), "{}", check.words);
    fs::remove_dir(folder.join("out/m.Run.npy")).unwrap();
    succeed(
        folder,
        &["eval", "m.gltf", "a.dat", "-o", "out", "--resume"],
    );
    assert!(folder.join("out/m.Run.npy").is_file());
    succeed(folder, &["check", "out"]);
}

/// Only inputs whose results would have the same name fail; `--names full` distinguishes two with the
/// same stem.
#[test]
fn results_never_share_a_name() {
    let temporary = sample_folder();
    let folder = temporary.path();
    fs::create_dir(folder.join("walks")).unwrap();
    let keys = fs::read(folder.join("a.dat")).unwrap();
    for name in ["walks/walk.dat", "walks/walk.DAT", "walks/other.dat"] {
        fs::write(folder.join(name), &keys).unwrap();
    }
    let stems = run(folder, &["eval", "walks", "-o", "stems"]);
    assert_eq!(stems.code, 3, "{}", stems.words);
    assert!(stems.words.contains("give --names full"), "{}", stems.words);
    let full = ["eval", "walks", "--names", "full", "-o"];
    succeed(folder, &[&full[..], &["out"]].concat());
    let made = entries(&folder.join("out"));
    let expected = [
        "manifest.jsonl",
        "other.dat.npy",
        "walk.DAT.npy",
        "walk.dat.npy",
    ];
    assert!(made.iter().eq(expected), "{made:?}");
    let resumed = succeed(folder, &[&full[..], &["out", "--resume"]].concat());
    assert!(
        resumed.words.contains("3 results kept"),
        "{}",
        resumed.words
    );
    succeed(folder, &[&full[..], &["shards", "--shard", "1/1"]].concat());
    succeed(folder, &["merge", "shards"]);
    assert_eq!(tree(&folder.join("shards")), tree(&folder.join("out")));

    let shared = run(
        folder,
        &["eval", "a.dat", "folder/a.dat", "b.dat", "-o", "shared"],
    );
    assert_eq!(shared.code, 3, "{}", shared.words);
    assert!(
        shared.words.contains("2 of 3 inputs failed"),
        "{}",
        shared.words
    );
    assert!(
        entries(&folder.join("shared"))
            .iter()
            .eq(["b.npy", "manifest.jsonl"])
    );
    // The input is in a directory `manifest.d`, whose name in a result belongs to shards.
    fs::create_dir_all(folder.join("odd/manifest.d")).unwrap();
    fs::write(folder.join("odd/manifest.d/a.dat"), &keys).unwrap();
    fs::write(folder.join("odd/b.dat"), &keys).unwrap();
    let odd = run(folder, &["eval", "odd", "-o", "odd-out"]);
    assert_eq!(odd.code, 3, "{}", odd.words);
    assert!(
        odd.words.contains("manifest.d is the directory of shards"),
        "{}",
        odd.words
    );
}
