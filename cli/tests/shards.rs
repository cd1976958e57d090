//! Shards: many processes fill one directory, and merging makes of it what one process would have.

use std::fs;
use std::path::Path;
use std::process::{Child, Stdio};

use crate::program::{command, finish, run, sample_folder, succeed};
use crate::tree::{names, tree};

/// Twelve clips in two folders, in shards of about four.
fn library() -> (tempfile::TempDir, String) {
    let temporary = sample_folder();
    let folder = temporary.path();
    fs::create_dir_all(folder.join("walks/deep")).unwrap();
    for i in 0..12 {
        let group = if i % 3 == 0 { "walks/deep" } else { "walks" };
        fs::copy(
            folder.join("a.dat"),
            folder.join(format!("{group}/{i:02}.dat")),
        )
        .unwrap();
    }
    let size = fs::metadata(folder.join("a.dat")).unwrap().len();
    (temporary, (4 * size).to_string())
}

fn shard<'a>(out: &'a str, bytes: &'a str, part: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    let line = ["eval", "walks", "-o", out, "--shard", part];
    [&line[..], &["--shard-bytes", bytes], more].concat()
}

/// The bytes of a merged directory are those of one process, and nothing else is left in it.
#[test]
fn merged_shards_equal_one_process() {
    let (temporary, bytes) = library();
    let folder = temporary.path();
    succeed(folder, &["eval", "walks", "-o", "one"]);
    let whole = tree(&folder.join("one"));
    for parts in [1, 2, 5] {
        let out = format!("out{parts}");
        for part in (1..=parts).rev() {
            let part = format!("{part}/{parts}");
            succeed(folder, &shard(&out, &bytes, &part, &[]));
        }
        let check = run(folder, &["check", &out]);
        assert_eq!(check.code, 8, "{}", check.words);
        assert!(check.words.contains("3 of 3 shards"), "{}", check.words);
        assert!(check.words.contains("tumble merge"), "{}", check.words);
        succeed(folder, &["merge", &out]);
        assert_eq!(tree(&folder.join(&out)), whole, "{parts} parts");
        succeed(folder, &["check", &out]);
        let resumed = succeed(folder, &["eval", "walks", "-o", &out, "--resume"]);
        assert!(
            resumed.words.contains("12 results kept"),
            "{}",
            resumed.words
        );
        assert_eq!(run(folder, &["merge", &out]).code, 4);
        assert_eq!(tree(&folder.join(&out)), whole);
    }
}

/// Processes that begin at once find no strangers in each other's results.
#[test]
fn parts_may_run_at_once() {
    let (temporary, bytes) = library();
    let folder = temporary.path();
    succeed(folder, &["eval", "walks", "-o", "one"]);
    for round in 0..5 {
        let out = format!("out{round}");
        let parts: Vec<String> = (1..=4).map(|part| format!("{part}/4")).collect();
        let start = |part: &String| {
            let mut command = command(folder, &shard(&out, &bytes, part, &[]));
            command.stderr(Stdio::piped()).spawn().unwrap()
        };
        let running: Vec<Child> = parts.iter().map(start).collect();
        for child in running {
            let ended = finish(child.wait_with_output().unwrap());
            assert_eq!(ended.code, 0, "{}", ended.words);
        }
        succeed(folder, &["merge", &out]);
        assert_eq!(
            tree(&folder.join(&out)),
            tree(&folder.join("one")),
            "round {round}"
        );
    }
}

/// Messages name the missing shards, and `--resume` makes them, by shards or by one process.
#[test]
fn missing_shards_are_named_and_made() {
    let (temporary, bytes) = library();
    let folder = temporary.path();
    succeed(folder, &["eval", "walks", "-o", "one"]);
    succeed(folder, &shard("out", &bytes, "2", &[]));
    let merged = run(folder, &["merge", "out"]);
    assert_eq!(merged.code, 8);
    assert!(
        merged.words.contains("1 of 3 shards are done"),
        "{}",
        merged.words
    );
    assert!(merged.words.contains("shard 1"), "{}", merged.words);
    let check = run(folder, &["check", "out"]);
    assert!(check.words.contains("1 of 3 shards"), "{}", check.words);
    assert!(check.words.contains("--resume"), "{}", check.words);
    assert_eq!(run(folder, &["eval", "walks", "-o", "out"]).code, 2);
    assert_eq!(
        run(folder, &shard("out", &bytes, "2", &[])).code,
        2,
        "it is done"
    );
    assert_eq!(
        run(folder, &shard("out", &bytes, "4", &[])).code,
        2,
        "there are three"
    );
    let other = run(folder, &["eval", "a.dat", "-o", "out/", "--resume"]);
    assert_eq!(other.code, 2, "{}", other.words);

    // One process can finish a batch that shards have begun.
    fs::write(folder.join("out/01.npy"), "a lost worker's").unwrap();
    let resumed = succeed(folder, &["eval", "walks", "-o", "out", "--resume"]);
    assert!(
        resumed.words.contains("4 results kept"),
        "{}",
        resumed.words
    );
    assert_eq!(tree(&folder.join("out")), tree(&folder.join("one")));
}

/// Without `plan.json` nothing says how many shards there are: each command names the file, and resuming shards
/// writes it again.
#[test]
fn a_lost_plan_is_named_and_written_again() {
    let (temporary, bytes) = library();
    let folder = temporary.path();
    succeed(folder, &["eval", "walks", "-o", "one"]);
    succeed(folder, &shard("out", &bytes, "2", &[]));
    let plan = folder.join("out/manifest.d/plan.json");
    let before = fs::read(&plan).unwrap();
    fs::remove_file(&plan).unwrap();
    for (line, code) in [
        ("merge out", 8),
        ("check out", 8),
        ("eval walks -o out --resume", 2),
        ("eval walks -o out --resume --dry-run", 2),
    ] {
        let line: Vec<&str> = line.split(' ').collect();
        let refused = run(folder, &line);
        assert_eq!(refused.code, code, "{line:?}: {}", refused.words);
        let expected = "plan.json: is missing, and there are files of 1 shard; `tumble eval";
        assert!(refused.words.contains(expected), "{}", refused.words);
    }
    let resumed = succeed(folder, &shard("out", &bytes, "1/1", &["--resume"]));
    assert!(
        resumed.words.contains("4 results kept"),
        "{}",
        resumed.words
    );
    assert_eq!(fs::read(&plan).unwrap(), before);
    succeed(folder, &["merge", "out"]);
    assert_eq!(tree(&folder.join("out")), tree(&folder.join("one")));
    // The file of a shard may be lost, too. If the plan was cut, the message says what to do.
    for is_cut in [false, true] {
        let out = if is_cut { "cut" } else { "lost" };
        let plan = folder.join(out).join("manifest.d/plan.json");
        succeed(folder, &shard(out, &bytes, "1/1", &[]));
        fs::remove_file(folder.join(out).join("manifest.d/00002.jsonl")).unwrap();
        match is_cut {
            true => fs::write(&plan, &before[..100]).unwrap(),
            false => fs::remove_file(&plan).unwrap(),
        }
        if is_cut {
            for line in ["merge cut", "check cut", "eval walks -o cut --resume"] {
                let line: Vec<&str> = line.split(' ').collect();
                let refused = run(folder, &line);
                assert_eq!(refused.code, 4, "{line:?}: {}", refused.words);
                let expected = "; remove it; then `tumble eval … --shard 1/1 --resume`, with the same inputs and options, writes it again";
                assert!(refused.words.contains(expected), "{}", refused.words);
            }
            fs::remove_file(&plan).unwrap();
        }
        let resumed = succeed(folder, &shard(out, &bytes, "1/1", &["--resume"]));
        assert_eq!(
            resumed.words.matches("4 results kept").count(),
            2,
            "{}",
            resumed.words
        );
        succeed(folder, &["merge", out]);
        assert_eq!(tree(&folder.join(out)), tree(&folder.join("one")));
    }
    let merged = run(folder, &["merge", "nowhere"]);
    assert!(merged.code == 4 && merged.words.contains("nowhere: cannot be read: "));
}

/// A task that is queued again after its shards were merged changes nothing, also if an input of it had failed; one whose
/// input has changed makes its shard.
#[test]
fn a_merged_directory_stays_complete() {
    let (temporary, bytes) = library();
    let folder = temporary.path();
    for name in ["walks/03b.dat", "walks/deep/x.dat"] {
        fs::copy(folder.join("bad.dat"), folder.join(name)).unwrap();
    }
    let parts = ["1/2", "2/2"];
    for part in parts {
        run(folder, &shard("out", &bytes, part, &[]));
    }
    assert_eq!(run(folder, &["merge", "out"]).code, 3);
    let merged = tree(&folder.join("out"));
    for part in parts {
        let again = run(folder, &shard("out", &bytes, part, &["--resume"]));
        assert!(again.code == 3, "{}", again.words);
        assert!(
            again.words.contains("are not tried again"),
            "{}",
            again.words
        );
        assert!(!again.words.contains("results made of"), "{}", again.words);
        assert!(again.words.contains("inputs failed"), "{}", again.words);
        assert_eq!(tree(&folder.join("out")), merged);
    }
    let json = run(
        folder,
        &shard("out", &bytes, "1/2", &["--resume", "--json"]),
    );
    let json: serde_json::Value = serde_json::from_slice(&json.out).unwrap();
    let states: Vec<&str> = json
        .as_array()
        .unwrap()
        .iter()
        .map(|it| it["state"].as_str().unwrap())
        .collect();
    let kept = states.iter().filter(|it| **it == "kept").count();
    assert!(
        kept >= 3 && states.len() == kept + 1 && states.contains(&"failed"),
        "{states:?}"
    );
    fs::copy(folder.join("antipodal.dat"), folder.join("walks/01.dat")).unwrap();
    run(folder, &shard("out", &bytes, "1/1", &["--resume"]));
    assert!(folder.join("out/manifest.d/plan.json").exists());
}

/// A part of which there are no shards says so.
#[test]
fn a_part_without_shards_is_said() {
    let (temporary, bytes) = library();
    let folder = temporary.path();
    let part = succeed(folder, &shard("out", &bytes, "1/4", &["--json"]));
    let expected = "--shard 1/4: there are 3 shards, and none of them is of this part\n";
    assert_eq!(part.words, expected);
    assert_eq!(part.out, b"[]\n");
}

/// Merging finds results that are gone or cut, and leaves the shards as they are until these are made again.
#[test]
fn missing_results_are_not_merged() {
    let (temporary, bytes) = library();
    let folder = temporary.path();
    succeed(folder, &["eval", "walks", "-o", "one"]);
    succeed(folder, &shard("out", &bytes, "1/1", &[]));
    fs::remove_file(folder.join("out/02.npy")).unwrap();
    fs::write(folder.join("out/deep/03.npy"), "cut").unwrap();
    let merged = run(folder, &["merge", "out"]);
    assert_eq!(merged.code, 8, "{}", merged.words);
    let expected = "2 of 12 results missing or damaged (the first: 02.npy cannot be read: ";
    assert!(merged.words.contains(expected), "{}", merged.words);
    assert!(!folder.join("out/manifest.jsonl").exists());
    succeed(folder, &shard("out", &bytes, "1/1", &["--resume"]));
    succeed(folder, &["merge", "out"]);
    assert_eq!(tree(&folder.join("out")), tree(&folder.join("one")));
}

/// A shard is done when its record is there and its inputs and outputs have the recorded hashes.
#[test]
fn resuming_looks_at_bytes() {
    let (temporary, bytes) = library();
    let folder = temporary.path();
    succeed(folder, &shard("out", &bytes, "1/1", &[]));
    let before = tree(&folder.join("out"));
    let again = succeed(folder, &shard("out", &bytes, "1/1", &["--resume"]));
    assert_eq!(
        again.words.matches("4 results kept").count(),
        3,
        "{}",
        again.words
    );
    assert_eq!(tree(&folder.join("out")), before);

    fs::write(folder.join("out/deep/00.npy"), "other bits").unwrap();
    succeed(folder, &shard("out", &bytes, "1/1", &["--resume"]));
    assert_eq!(tree(&folder.join("out")), before);
    // Other options are another plan.
    assert_eq!(
        run(folder, &shard("out", &bytes, "1/1", &["-m", "slerp"])).code,
        2
    );
    let slerp = ["-m", "slerp", "--resume"];
    let refused = run(folder, &shard("out", &bytes, "1/1", &slerp));
    let expected =
        "out: has shards that were made with another value of option --method; use the same value";
    assert!(
        refused.code == 2 && refused.words.contains(expected),
        "{}",
        refused.words
    );
    assert_eq!(tree(&folder.join("out")), before);
    let slerp = ["-m", "slerp", "--overwrite"];
    let made = succeed(folder, &shard("out", &bytes, "1/1", &slerp));
    assert!(!made.words.contains("(already complete)"), "{}", made.words);
    succeed(folder, &["merge", "out"]);
    succeed(folder, &["eval", "walks", "-o", "one", "-m", "slerp"]);
    assert_eq!(tree(&folder.join("out")), tree(&folder.join("one")));
}

#[test]
fn strangers_are_not_replaced() {
    let (temporary, bytes) = library();
    let folder = temporary.path();
    fs::create_dir(folder.join("out")).unwrap();
    fs::write(folder.join("out/05.npy"), "mine").unwrap();
    for more in [&[][..], &["--resume"]] {
        let refused = run(folder, &shard("out", &bytes, "1/3", more));
        assert_eq!(refused.code, 2, "{}", refused.words);
        assert!(
            refused.words.contains("05.npy: exists"),
            "{}",
            refused.words
        );
    }
    assert_eq!(names(&folder.join("out")), ["05.npy"]);
    succeed(folder, &shard("out", &bytes, "1/1", &["--overwrite"]));
    let merged = succeed(folder, &["merge", "out", "--json"]);
    let report: serde_json::Value = serde_json::from_slice(&merged.out).unwrap();
    let manifest = fs::read_to_string(folder.join("out/manifest.jsonl")).unwrap();
    let results = manifest.lines().count();
    assert_eq!(report["results"], results, "{report}");
    assert_eq!(report["failed"], serde_json::json!([]), "{report}");
    assert_eq!(run(folder, &shard("out", &bytes, "1/1", &[])).code, 2);
}

/// Inputs that are refused are in the end what they are for one process.
#[test]
fn refused_inputs_are_told_and_the_others_made() {
    let (temporary, bytes) = library();
    let folder = temporary.path();
    fs::copy(folder.join("bad.dat"), folder.join("walks/05.dat")).unwrap();
    fs::copy(folder.join("bad.dat"), folder.join("walks/11x.dat")).unwrap();
    assert_eq!(run(folder, &["eval", "walks", "-o", "one"]).code, 3);
    let part = run(folder, &shard("out", &bytes, "1/1", &[]));
    assert_eq!(part.code, 3, "{}", part.words);
    assert!(
        part.words.contains("2 of 13 inputs failed"),
        "{}",
        part.words
    );
    let merged = run(folder, &["merge", "out"]);
    assert_eq!(merged.code, 3, "{}", merged.words);
    assert!(merged.words.contains("05.dat"), "{}", merged.words);
    assert_eq!(tree(&folder.join("out")), tree(&folder.join("one")));

    fs::create_dir(folder.join("bad")).unwrap();
    fs::copy(folder.join("bad.dat"), folder.join("bad/a.dat")).unwrap();
    let line = ["eval", "bad", "-o", "none", "--shard", "1/1"];
    assert_eq!(run(folder, &line).code, 4);
    assert_eq!(run(folder, &["merge", "none"]).code, 4);
    let text = fs::read_to_string(folder.join("none/manifest.jsonl")).unwrap();
    let failed = r#"{"state":"failed","input":"bad/a.dat","result":"a.npy","code":4,"#;
    assert!(
        text.starts_with(failed) && text.lines().count() == 1,
        "{text}"
    );
}

/// Kills at random moments, of shards that are resumed: nothing is lost, nothing half-written stays.
#[cfg(unix)]
#[test]
fn killed_shards_are_made_again() {
    use std::time::{Duration, Instant};

    use crate::support::Random;

    let (temporary, bytes) = library();
    let folder = temporary.path();
    let more = ["--fps", "3000", "--device", "cpu"];
    let one = [&["eval", "walks", "-o", "one"][..], &more].concat();
    let started = Instant::now();
    succeed(folder, &one);
    let longest = 3 * started.elapsed().as_micros() as u64 / 2;
    let whole = tree(&folder.join("one"));
    let mut random = Random(7);
    let (mut kills, mut left) = (0, 0);
    for _ in 0..200 {
        let out = format!("out{}", kills % 3);
        let line = shard(&out, &bytes, "1/1", &["--resume"]);
        let mut child = command(folder, &[&line[..], &more].concat());
        child.stderr(Stdio::null());
        let mut child = child.spawn().unwrap();
        std::thread::sleep(Duration::from_micros(random.next() % longest));
        let is_running = child.try_wait().unwrap().is_none();
        child.kill().unwrap();
        child.wait().unwrap();
        left += names(&folder.join(&out))
            .iter()
            .filter(|name| name.ends_with(".part"))
            .count();
        if is_running {
            kills += 1;
        } else {
            // The process ended before it was killed, so there is nothing left to resume.
            fs::remove_dir_all(folder.join(&out)).unwrap();
        }
        if kills == 12 {
            break;
        }
    }
    assert_eq!(kills, 12);
    for round in 0..3 {
        let out = format!("out{round}");
        let line = shard(&out, &bytes, "1/1", &["--resume"]);
        succeed(folder, &[&line[..], &more].concat());
        succeed(folder, &["merge", &out]);
        assert_eq!(
            tree(&folder.join(&out)),
            whole,
            "{kills} kills, {left} files half-way"
        );
    }
}

/// A device is found by the UUID that `tumble devices` tells.
#[test]
fn a_device_goes_by_its_uuid() {
    let temporary = sample_folder();
    let folder: &Path = temporary.path();
    let listed = succeed(folder, &["devices", "--json"]);
    let listed: serde_json::Value = serde_json::from_slice(&listed.out).unwrap();
    let devices = listed["devices"].as_array().unwrap();
    assert!(!devices.is_empty(), "lavapipe is there");
    for device in devices {
        let uuid = device["uuid"].as_str().unwrap();
        assert_eq!(uuid.len(), 36, "{uuid}");
        let plain = format!("uuid:GPU-{}", uuid.replace('-', "").to_uppercase());
        for selector in [&format!("uuid:{uuid}"), &plain] {
            let line = [
                "eval",
                "a.dat",
                "-o",
                "a.npy",
                "--overwrite",
                "--device",
                selector,
            ];
            let evaluated = succeed(folder, &line);
            assert!(
                evaluated.words.contains(device["name"].as_str().unwrap()),
                "{}",
                evaluated.words
            );
        }
    }
    let line = ["eval", "a.dat", "-o", "b.npy", "--device", "uuid:0123"];
    let refused = run(folder, &line);
    assert_eq!(refused.code, 2);
    assert!(
        refused.words.contains("there is no device `uuid:0123`"),
        "{}",
        refused.words
    );
}
