//! Batches: many inputs, failures among them, kills, and the manifest that proves what
//! is there.

use std::fs;
use std::process::Stdio;
use std::time::{Duration, Instant};

use crate::program::{command, finish, run, sample_folder, succeed};
use crate::support::Random;
use crate::tree::{names, tree};

#[test]
fn directories_patterns_and_lists_name_inputs() {
    let temporary = sample_folder();
    let folder = temporary.path();
    fs::create_dir_all(folder.join("walks/deep")).unwrap();
    for name in ["walks/a.dat", "walks/deep/a.dat", "walks/deep/b.DAT"] {
        fs::copy(folder.join("a.dat"), folder.join(name)).unwrap();
    }
    fs::write(folder.join("walks/notes.txt"), "no keyframes").unwrap();
    succeed(folder, &["eval", "walks", "-o", "tree"]);
    let expected = ["a.npy", "deep/a.npy", "deep/b.npy", "manifest.jsonl"];
    assert_eq!(names(&folder.join("tree")), expected);

    succeed(folder, &["eval", "walks/*/*.[dD]*", "-o", "matched"]);
    assert_eq!(
        names(&folder.join("matched")),
        ["a.npy", "b.npy", "manifest.jsonl"]
    );

    fs::write(folder.join("list"), "# two of them\n\nb.dat\nwalks/a.dat\n").unwrap();
    succeed(folder, &["eval", "--files-from", "list", "-o", "listed"]);
    assert_eq!(
        names(&folder.join("listed")),
        ["a.npy", "b.npy", "manifest.jsonl"]
    );
    let mut child = command(folder, &["info", "--files-from", "-", "a.dat"])
        .stdin(fs::File::open(folder.join("list")).unwrap())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    assert!(child.wait().unwrap().success());
    let output = child.wait_with_output().unwrap();
    let listing = String::from_utf8(output.stdout).unwrap();
    assert_eq!(listing.matches("walks/a.dat").count(), 1, "{listing}");

    // One file of a list goes into one file.
    fs::write(folder.join("one"), "b.dat\n").unwrap();
    succeed(folder, &["eval", "--files-from", "one", "-o", "one.npy"]);
}

/// Manifests call options as they did when these had other names: an older batch is resumed by its old line
/// and by the new one.
#[test]
fn batches_of_older_names_of_options_are_resumed() {
    let temporary = sample_folder();
    let folder = temporary.path();
    let batch = ["smooth", "a.dat", "b.dat", "-o", "out"];
    let [old, new] = ["--ends", "--edges"].map(|option| [&batch[..], &[option, "loop"]].concat());
    succeed(folder, &old);
    let manifest = fs::read_to_string(folder.join("out/manifest.jsonl")).unwrap();
    assert!(manifest.contains(" ends=loop "), "{manifest}");
    for line in [&new, &old] {
        let again = succeed(folder, &[&line[..], &["--resume"]].concat());
        assert!(again.words.contains("2 results skipped"), "{}", again.words);
    }
    let other = [&batch[..], &["--edges", "keep", "--resume"]].concat();
    assert!(succeed(folder, &other).words.contains("2 results made"));
}

#[test]
fn a_batch_goes_on_after_a_failure_and_can_be_checked() {
    let temporary = sample_folder();
    let folder = temporary.path();
    let batch = ["eval", "a.dat", "bad.dat", "b.dat", "-o", "out"];
    let first = run(folder, &batch);
    assert_eq!(first.code, 3, "{}", first.words);
    assert!(first.words.contains("1 of 3 inputs failed"));
    let whole = tree(&folder.join("out"));
    assert_eq!(
        whole.keys().collect::<Vec<_>>(),
        ["a.npy", "b.npy", "manifest.jsonl"]
    );
    succeed(folder, &["check", "out"]);

    // Again: refused, or skipped, or done again.
    let again = run(folder, &batch);
    assert_eq!(again.code, 2);
    assert!(
        again.words.contains("--resume skips what is done"),
        "{}",
        again.words
    );
    let resumed = run(folder, &[&batch[..], &["--resume"]].concat());
    assert_eq!(resumed.code, 3, "{}", resumed.words);
    assert!(
        resumed.words.contains("2 results skipped"),
        "{}",
        resumed.words
    );
    assert_eq!(tree(&folder.join("out")), whole);
    let slerp = run(folder, &[&batch[..], &["--resume", "-m", "slerp"]].concat());
    assert!(!slerp.words.contains("skipped"), "{}", slerp.words);
    assert_ne!(tree(&folder.join("out"))["a.npy"], whole["a.npy"]);
    run(folder, &[&batch[..], &["--overwrite"]].concat());
    assert_eq!(tree(&folder.join("out")), whole);
}

#[test]
fn one_flipped_bit_is_found_and_made_good() {
    let temporary = sample_folder();
    let folder = temporary.path();
    let batch = ["eval", "a.dat", "b.dat", "-o", "out", "--device", "cpu"];
    succeed(folder, &batch);
    let whole = tree(&folder.join("out"));
    let mut random = Random(1);
    for _ in 0..20 {
        let mut bytes = whole["b.npy"].clone();
        let bit = random.next() as usize % (bytes.len() * 8);
        bytes[bit / 8] ^= 1 << (bit % 8);
        fs::write(folder.join("out/b.npy"), bytes).unwrap();
        let check = run(folder, &["check", "out/manifest.jsonl"]);
        assert_eq!(check.code, 8, "bit {bit}: {}", check.words);
        assert!(
            check.words.contains("b.npy: its bits have changed"),
            "{}",
            check.words
        );
        assert!(!check.words.contains("a.npy"), "{}", check.words);
    }
    fs::remove_file(folder.join("out/a.npy")).unwrap();
    let check = run(folder, &["check", "out"]);
    assert!(
        check.words.contains("a.npy: cannot be read"),
        "{}",
        check.words
    );
    let resumed = succeed(folder, &[&batch[..], &["--resume"]].concat());
    assert!(!resumed.words.contains("skipped"), "{}", resumed.words);
    assert_eq!(tree(&folder.join("out")), whole);
    succeed(folder, &["check", "out"]);

    let check = run(folder, &["check", "a.dat"]);
    assert_eq!(check.code, 4);
    assert!(check.words.contains("is not a manifest"), "{}", check.words);
}

/// A stranger's file is no result of ours, whatever `--resume` says.
#[test]
fn resuming_does_not_replace_what_no_manifest_names() {
    let temporary = sample_folder();
    let folder = temporary.path();
    fs::create_dir(folder.join("out")).unwrap();
    fs::write(folder.join("out/b.npy"), "mine").unwrap();
    let resumed = run(folder, &["eval", "a.dat", "b.dat", "-o", "out", "--resume"]);
    assert_eq!(resumed.code, 2, "{}", resumed.words);
    assert_eq!(fs::read(folder.join("out/b.npy")).unwrap(), b"mine");
    assert_eq!(
        names(&folder.join("out")),
        ["b.npy"],
        "a refusal leaves nothing"
    );
    let failed = run(folder, &["eval", "bad.dat", "none.dat", "-o", "failed"]);
    assert_eq!(failed.code, 4, "{}", failed.words);
    assert_eq!(names(&folder.join("failed")), Vec::<String>::new());
    let single = run(folder, &["eval", "a.dat", "-o", "o.npy", "--resume"]);
    assert_eq!(single.code, 2, "{}", single.words);
}

/// Kills at random moments, each resumed: whatever lies under its name is whole at any
/// time, and what it all comes to is what an undisturbed run gives, byte for byte. `SOAK` kills 500 times.
#[cfg(unix)]
#[test]
fn two_hundred_kills_lose_nothing() {
    let temporary = sample_folder();
    let folder = temporary.path();
    fs::create_dir(folder.join("walks")).unwrap();
    for i in 0..12 {
        fs::copy(
            folder.join("a.dat"),
            folder.join(format!("walks/{i:02}.dat")),
        )
        .unwrap();
    }
    let batch = |out, more: &[&'static str]| {
        let line = ["eval", "walks", "--device", "cpu", "--fps", "3000", "-o"];
        [&line[..], &[out], more].concat()
    };
    let started = Instant::now();
    succeed(folder, &batch("undisturbed", &[]));
    let longest = 3 * started.elapsed().as_micros() as u64 / 2;
    let whole = tree(&folder.join("undisturbed"));
    let other = [&batch("other", &[])[..], &["-m", "slerp"]].concat();
    succeed(folder, &other);
    let other = tree(&folder.join("other"));

    let out = folder.join("out");
    let mut random = Random(7);
    let (mut kills, mut finished, mut interrupted) = (0, 0, 0);
    let enough = std::env::var_os("SOAK").map_or(200, |_| 500);
    while kills < enough {
        // Now into an empty directory, now over other results.
        let replacing = finished % 2 == 1;
        let mode: &[&str] = if replacing && interrupted == 0 {
            &["--overwrite"]
        } else {
            &["--resume"]
        };
        let mut child = command(folder, &batch("out", mode))
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(Duration::from_micros(random.next() % longest));
        let ended = child.try_wait().unwrap();
        child.kill().unwrap();
        let status = child.wait().unwrap();
        kills += 1;
        for (name, bytes) in tree(&out) {
            let is_result = name.ends_with(".npy");
            let known = whole.get(&name) == Some(&bytes) || other.get(&name) == Some(&bytes);
            assert!(!is_result || known, "{name} is not whole");
        }
        if ended.is_none() {
            interrupted += 1;
            continue;
        }
        assert!(status.success());
        assert_eq!(tree(&out), whole, "after {interrupted} kills");
        succeed(folder, &["check", "out"]);
        (finished, interrupted) = (finished + 1, 0);
        fs::remove_dir_all(&out).unwrap();
        if finished % 2 == 1 {
            let line = [&batch("out", &[])[..], &["-m", "slerp"]].concat();
            succeed(folder, &line);
        }
    }
    let last = finish(
        command(folder, &batch("out", &["--resume"]))
            .output()
            .unwrap(),
    );
    assert_eq!(last.code, 0, "{}", last.words);
    assert_eq!(tree(&out), whole);
    assert!(finished > 10, "only {finished} runs came to their end");
}
