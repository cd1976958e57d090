//! Shards: many processes fill one directory, and merging makes of it what one process would have.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Child, Stdio};

use crate::program::{command, finish, run, sample_folder, succeed};
use crate::tree::{names, tree};

/// Twelve clips in two folders, in shards of about four.
fn library() -> (tempfile::TempDir, String) {
    let place = sample_folder();
    let at = place.path();
    fs::create_dir_all(at.join("walks/deep")).unwrap();
    for i in 0..12 {
        let folder = if i % 3 == 0 { "walks/deep" } else { "walks" };
        fs::copy(at.join("a.dat"), at.join(format!("{folder}/{i:02}.dat"))).unwrap();
    }
    let size = fs::metadata(at.join("a.dat")).unwrap().len();
    (place, (4 * size).to_string())
}

fn shard<'a>(out: &'a str, bytes: &'a str, part: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    let line = ["eval", "walks", "-o", out, "--shard", part];
    [&line[..], &["--shard-bytes", bytes], more].concat()
}

/// The bytes of a merged directory are those of one process, and nothing else is left in it.
#[test]
fn merged_shards_equal_one_process() {
    let (place, bytes) = library();
    let at = place.path();
    succeed(at, &["eval", "walks", "-o", "one"]);
    let whole = tree(&at.join("one"));
    for parts in [1, 2, 5] {
        let out = format!("out{parts}");
        for part in (1..=parts).rev() {
            let part = format!("{part}/{parts}");
            succeed(at, &shard(&out, &bytes, &part, &[]));
        }
        let check = run(at, &["check", &out]);
        assert_eq!(check.code, 8, "{}", check.words);
        assert!(check.words.contains("3 of 3 shards"), "{}", check.words);
        assert!(check.words.contains("tumble merge"), "{}", check.words);
        succeed(at, &["merge", &out]);
        assert_eq!(tree(&at.join(&out)), whole, "{parts} parts");
        succeed(at, &["check", &out]);
        let resumed = succeed(at, &["eval", "walks", "-o", &out, "--resume"]);
        assert!(
            resumed.words.contains("12 results skipped"),
            "{}",
            resumed.words
        );
        assert_eq!(run(at, &["merge", &out]).code, 4);
        assert_eq!(tree(&at.join(&out)), whole);
    }
}

/// Processes that begin at once find no strangers in each other's results.
#[test]
fn parts_may_run_at_once() {
    let (place, bytes) = library();
    let at = place.path();
    succeed(at, &["eval", "walks", "-o", "one"]);
    for round in 0..5 {
        let out = format!("out{round}");
        let parts: Vec<String> = (1..=4).map(|part| format!("{part}/4")).collect();
        let start = |part: &String| {
            let mut command = command(at, &shard(&out, &bytes, part, &[]));
            command.stderr(Stdio::piped()).spawn().unwrap()
        };
        let running: Vec<Child> = parts.iter().map(start).collect();
        for child in running {
            let ended = finish(child.wait_with_output().unwrap());
            assert_eq!(ended.code, 0, "{}", ended.words);
        }
        succeed(at, &["merge", &out]);
        assert_eq!(tree(&at.join(&out)), tree(&at.join("one")), "round {round}");
    }
}

/// What is missing is said, and made by `--resume`, by shards or by one process.
#[test]
fn missing_shards_are_named_and_made() {
    let (place, bytes) = library();
    let at = place.path();
    succeed(at, &["eval", "walks", "-o", "one"]);
    succeed(at, &shard("out", &bytes, "2", &[]));
    let merged = run(at, &["merge", "out"]);
    assert_eq!(merged.code, 8);
    assert!(
        merged.words.contains("1 of 3 shards are done"),
        "{}",
        merged.words
    );
    assert!(merged.words.contains("shard 1"), "{}", merged.words);
    let check = run(at, &["check", "out"]);
    assert!(check.words.contains("1 of 3 shards"), "{}", check.words);
    assert!(check.words.contains("--resume"), "{}", check.words);
    assert_eq!(run(at, &["eval", "walks", "-o", "out"]).code, 2);
    assert_eq!(
        run(at, &shard("out", &bytes, "2", &[])).code,
        2,
        "it is done"
    );
    assert_eq!(
        run(at, &shard("out", &bytes, "4", &[])).code,
        2,
        "there are three"
    );
    let other = run(at, &["eval", "a.dat", "-o", "out/", "--resume"]);
    assert_eq!(other.code, 2, "{}", other.words);

    // One process ends what shards have begun.
    fs::write(at.join("out/01.npy"), "a lost worker's").unwrap();
    let resumed = succeed(at, &["eval", "walks", "-o", "out", "--resume"]);
    assert!(
        resumed.words.contains("4 results skipped"),
        "{}",
        resumed.words
    );
    assert_eq!(tree(&at.join("out")), tree(&at.join("one")));
}

/// A shard is done when its file is there and its inputs and outputs are what it says.
#[test]
fn resuming_looks_at_bytes() {
    let (place, bytes) = library();
    let at = place.path();
    succeed(at, &shard("out", &bytes, "1/1", &[]));
    let before = tree(&at.join("out"));
    let again = succeed(at, &shard("out", &bytes, "1/1", &["--resume"]));
    assert_eq!(
        again.words.matches("4 results skipped").count(),
        3,
        "{}",
        again.words
    );
    assert_eq!(tree(&at.join("out")), before);

    fs::write(at.join("out/deep/00.npy"), "other bits").unwrap();
    succeed(at, &shard("out", &bytes, "1/1", &["--resume"]));
    assert_eq!(tree(&at.join("out")), before);
    // Other options are another plan.
    assert_eq!(
        run(at, &shard("out", &bytes, "1/1", &["-m", "slerp"])).code,
        2
    );
    let slerp = ["-m", "slerp", "--resume"];
    let made = succeed(at, &shard("out", &bytes, "1/1", &slerp));
    assert!(!made.words.contains("skipped"), "{}", made.words);
    succeed(at, &["merge", "out"]);
    succeed(at, &["eval", "walks", "-o", "one", "-m", "slerp"]);
    assert_eq!(tree(&at.join("out")), tree(&at.join("one")));
}

#[test]
fn strangers_are_not_replaced() {
    let (place, bytes) = library();
    let at = place.path();
    fs::create_dir(at.join("out")).unwrap();
    fs::write(at.join("out/05.npy"), "mine").unwrap();
    for more in [&[][..], &["--resume"]] {
        let refused = run(at, &shard("out", &bytes, "1/3", more));
        assert_eq!(refused.code, 2, "{}", refused.words);
        assert!(
            refused.words.contains("05.npy: exists"),
            "{}",
            refused.words
        );
    }
    assert_eq!(names(&at.join("out")), ["05.npy"]);
    succeed(at, &shard("out", &bytes, "1/1", &["--overwrite"]));
    succeed(at, &["merge", "out"]);
    assert_eq!(run(at, &shard("out", &bytes, "1/1", &[])).code, 2);
}

/// Inputs that are refused are in the end what they are for one process.
#[test]
fn refused_inputs_are_told_and_the_others_made() {
    let (place, bytes) = library();
    let at = place.path();
    fs::copy(at.join("bad.dat"), at.join("walks/05.dat")).unwrap();
    fs::copy(at.join("bad.dat"), at.join("walks/11x.dat")).unwrap();
    assert_eq!(run(at, &["eval", "walks", "-o", "one"]).code, 3);
    let part = run(at, &shard("out", &bytes, "1/1", &[]));
    assert_eq!(part.code, 3, "{}", part.words);
    assert!(
        part.words.contains("2 of 13 inputs failed"),
        "{}",
        part.words
    );
    let merged = run(at, &["merge", "out"]);
    assert_eq!(merged.code, 3, "{}", merged.words);
    assert!(merged.words.contains("05.dat"), "{}", merged.words);
    assert_eq!(tree(&at.join("out")), tree(&at.join("one")));

    fs::create_dir(at.join("bad")).unwrap();
    fs::copy(at.join("bad.dat"), at.join("bad/a.dat")).unwrap();
    let line = ["eval", "bad", "-o", "none", "--shard", "1/1"];
    assert_eq!(run(at, &line).code, 4);
    assert_eq!(run(at, &["merge", "none"]).code, 4);
    assert_eq!(tree(&at.join("none")), BTreeMap::new());
}

/// Kills at random moments, of shards that are resumed: nothing is lost, nothing half-written stays.
#[cfg(unix)]
#[test]
fn killed_shards_are_made_again() {
    use std::time::{Duration, Instant};

    use crate::support::Random;

    let (place, bytes) = library();
    let at = place.path();
    let more = ["--fps", "3000", "--device", "cpu"];
    let one = [&["eval", "walks", "-o", "one"][..], &more].concat();
    let started = Instant::now();
    succeed(at, &one);
    let longest = 3 * started.elapsed().as_micros() as u64 / 2;
    let whole = tree(&at.join("one"));
    let mut random = Random(7);
    let (mut kills, mut left) = (0, 0);
    for _ in 0..200 {
        let out = format!("out{}", kills % 3);
        let line = shard(&out, &bytes, "1/1", &["--resume"]);
        let mut child = command(at, &[&line[..], &more].concat());
        child.stderr(Stdio::null());
        let mut child = child.spawn().unwrap();
        std::thread::sleep(Duration::from_micros(random.next() % longest));
        let is_running = child.try_wait().unwrap().is_none();
        child.kill().unwrap();
        child.wait().unwrap();
        left += names(&at.join(&out))
            .iter()
            .filter(|name| name.ends_with(".part"))
            .count();
        if is_running {
            kills += 1;
        } else {
            // It was done before the kill came: there is nothing left to resume.
            fs::remove_dir_all(at.join(&out)).unwrap();
        }
        if kills == 12 {
            break;
        }
    }
    assert_eq!(kills, 12);
    for round in 0..3 {
        let out = format!("out{round}");
        let line = shard(&out, &bytes, "1/1", &["--resume"]);
        succeed(at, &[&line[..], &more].concat());
        succeed(at, &["merge", &out]);
        assert_eq!(
            tree(&at.join(&out)),
            whole,
            "{kills} kills, {left} files half-way"
        );
    }
}

/// A device is found by the UUID that `tumble devices` tells.
#[test]
fn a_device_goes_by_its_uuid() {
    let place = sample_folder();
    let at: &Path = place.path();
    let listed = succeed(at, &["devices", "--json"]);
    let listed: serde_json::Value = serde_json::from_slice(&listed.out).unwrap();
    let devices = listed["devices"].as_array().unwrap();
    assert!(!devices.is_empty(), "lavapipe is there");
    for device in devices {
        let uuid = device["uuid"].as_str().unwrap();
        assert_eq!(uuid.len(), 36, "{uuid}");
        let plain = format!("uuid:GPU-{}", uuid.replace('-', "").to_uppercase());
        for given in [&format!("uuid:{uuid}"), &plain] {
            let line = [
                "eval",
                "a.dat",
                "-o",
                "a.npy",
                "--overwrite",
                "--device",
                given,
            ];
            let told = succeed(at, &line);
            assert!(
                told.words.contains(device["name"].as_str().unwrap()),
                "{}",
                told.words
            );
        }
    }
    let line = ["eval", "a.dat", "-o", "b.npy", "--device", "uuid:0123"];
    let refused = run(at, &line);
    assert_eq!(refused.code, 2);
    assert!(
        refused.words.contains("there is no device `uuid:0123`"),
        "{}",
        refused.words
    );
}
