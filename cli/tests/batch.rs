//! Batches: many inputs, failures among them, kills, and the manifest that proves what
//! is there.

use std::fs;
use std::path::Path;
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
    // The results of a list keep its tree.
    let listed = ["b.npy", "manifest.jsonl", "walks/a.npy"];
    assert_eq!(names(&folder.join("listed")), listed);
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

/// Manifests call options by the names that they have now, and are understood if they have older ones: an older batch is
/// resumed by its old line and by the new one.
#[test]
fn batches_of_older_names_of_options_are_resumed() {
    let temporary = sample_folder();
    let folder = temporary.path();
    let batch = ["smooth", "a.dat", "b.dat", "-o", "out"];
    let [old, new] = ["--ends", "--edges"].map(|option| [&batch[..], &[option, "loop"]].concat());
    succeed(folder, &old);
    let manifest = fs::read_to_string(folder.join("out/manifest.jsonl")).unwrap();
    assert!(manifest.contains(" edges=loop "), "{manifest}");
    for line in [&new, &old] {
        let older = manifest.replace(" edges=loop ", " ends=loop ");
        fs::write(folder.join("out/manifest.jsonl"), older).unwrap();
        let again = succeed(folder, &[&line[..], &["--resume"]].concat());
        assert!(again.words.contains("2 results kept"), "{}", again.words);
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
    let check = run(folder, &["check", "out"]);
    assert_eq!(check.code, 8, "{}", check.words);
    let failed = "1 input failed (the first: bad.dat:2:8: error[E020]";
    assert!(check.words.contains(failed), "{}", check.words);

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
        resumed.words.contains("2 results kept"),
        "{}",
        resumed.words
    );
    assert_eq!(tree(&folder.join("out")), whole);
    let slerp = run(folder, &[&batch[..], &["--resume", "-m", "slerp"]].concat());
    assert!(
        !slerp.words.contains("(already complete)"),
        "{}",
        slerp.words
    );
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
    let report = run(folder, &["check", "out", "--json"]);
    assert_eq!(report.code, 8, "{}", report.words);
    let report: serde_json::Value = serde_json::from_slice(&report.out).unwrap();
    assert_eq!(
        (&report["complete"], &report["results"]),
        (&false.into(), &2.into())
    );
    assert_eq!(report["differ"][0]["output"], "a.npy", "{report}");
    assert_eq!(report["differ"][1]["input"], "b.dat", "{report}");
    let check = run(folder, &["check", "out"]);
    assert!(
        check.words.contains("a.npy: cannot be read"),
        "{}",
        check.words
    );
    let resumed = succeed(folder, &[&batch[..], &["--resume"]].concat());
    assert!(
        !resumed.words.contains("(already complete)"),
        "{}",
        resumed.words
    );
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
    assert_eq!(names(&folder.join("failed")), ["manifest.jsonl"]);
    assert_eq!(run(folder, &["check", "failed"]).code, 8);
    let single = run(folder, &["eval", "a.dat", "-o", "o.npy", "--resume"]);
    assert_eq!(single.code, 2, "{}", single.words);
}

/// The lines of a manifest.
fn manifest(folder: &Path) -> Vec<serde_json::Value> {
    let text = fs::read_to_string(folder.join("manifest.jsonl")).unwrap();
    text.lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect()
}

/// The hash of a glTF includes its buffer beside it.
#[cfg(unix)]
#[test]
fn an_input_is_all_files_that_it_refers_to() {
    let temporary = sample_folder();
    let folder = temporary.path();
    let mut model: serde_json::Value =
        serde_json::from_str(&crate::attack::two_animations()).unwrap();
    model["buffers"][0]["uri"] = "keys.bin".into();
    fs::write(folder.join("m.gltf"), model.to_string()).unwrap();
    let numbers = |w: f32| [0f32, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.6, w];
    let write = |w: f32| {
        let bytes: Vec<u8> = numbers(w).iter().flat_map(|it| it.to_le_bytes()).collect();
        fs::write(folder.join("keys.bin"), bytes).unwrap();
    };
    write(0.8);
    let batch = [
        "eval", "m.gltf", "a.dat", "-o", "out", "--resume", "--device", "cpu",
    ];
    succeed(folder, &batch);
    succeed(folder, &["check", "out"]);
    let again = succeed(folder, &batch);
    let kept = "3 results of 2 inputs kept";
    assert!(again.words.contains(kept), "{}", again.words);
    let before = tree(&folder.join("out"));
    write(-0.8);
    let check = run(folder, &["check", "out"]);
    assert_eq!(check.code, 8, "{}", check.words);
    let stale = "m.Run.npy: its input m.gltf (or a file that belongs to it) has changed";
    assert!(check.words.contains(stale), "{}", check.words);
    let again = succeed(folder, &batch);
    let made = "2 results made of 1 input, 1 result kept";
    assert!(again.words.contains(made), "{}", again.words);
    assert_ne!(tree(&folder.join("out"))["m.Run.npy"], before["m.Run.npy"]);
    succeed(folder, &["check", "out"]);
}

/// The name of a result depends on its input alone.
#[test]
fn a_result_keeps_its_name_when_another_input_appears_beside_it() {
    let temporary = sample_folder();
    let folder = temporary.path();
    fs::create_dir(folder.join("walks")).unwrap();
    fs::copy(folder.join("a.dat"), folder.join("walks/walk.dat")).unwrap();
    let batch = ["eval", "walks", "-o", "out", "--resume", "--device", "cpu"];
    succeed(folder, &batch);
    fs::copy(folder.join("b.dat"), folder.join("walks/walk.tum")).unwrap();
    let both = run(folder, &[&batch[..], &["--from", "dat"]].concat());
    assert_eq!(both.code, 3, "{}", both.words);
    let refused = "walks/walk.tum: its result and that of walks/walk.dat would both be out/walk.npy; \
                   give --names full";
    assert!(both.words.contains(refused), "{}", both.words);
    assert!(
        both.words.contains("1 result made, 1 input failed"),
        "{}",
        both.words
    );
    assert_eq!(manifest(&folder.join("out"))[0]["input"], "walks/walk.dat");
    let full = [
        "eval", "walks", "-o", "full", "--from", "dat", "--names", "full",
    ];
    succeed(folder, &full);
    let expected = ["manifest.jsonl", "walk.dat.npy", "walk.tum.npy"];
    assert_eq!(names(&folder.join("full")), expected);
    let again = succeed(folder, &[&full[..], &["--resume"]].concat());
    assert!(again.words.contains("2 results kept"), "{}", again.words);
}

/// A result is replaced if its input has changed, and not by that of another input of the same name.
#[test]
fn resuming_does_not_replace_the_result_of_another_input() {
    let temporary = sample_folder();
    let folder = temporary.path();
    for (from, to) in [
        ("a.dat", "m1/x.dat"),
        ("a.dat", "m2/x.dat"),
        ("a.dat", "m3/x.txt"),
    ] {
        fs::create_dir_all(folder.join(to).parent().unwrap()).unwrap();
        fs::copy(folder.join(from), folder.join(to)).unwrap();
    }
    let other = fs::read_to_string(folder.join("a.dat"))
        .unwrap()
        .replace("0.5 ", "0.625 ");
    fs::write(folder.join("m2/x.dat"), &other).unwrap();
    fs::write(folder.join("m3/x.txt"), &other).unwrap();
    for (out, shard) in [("out", &[][..]), ("shards", &["--shard", "1/1"])] {
        let batch = |input: &str, more: &[&str]| {
            let line = [
                "eval", input, "--from", "dat", "-o", out, "--resume", "--device", "cpu",
            ];
            // One named input of a directory that exists has its result in it.
            run(folder, &[&line[..], shard, more].concat())
        };
        fs::create_dir(folder.join(out)).unwrap();
        fs::create_dir_all(folder.join("m4")).unwrap();
        fs::copy(folder.join("m1/x.dat"), folder.join("m4/x.dat")).unwrap();
        assert_eq!(batch("m1/x.dat", &[]).code, 0);
        if !shard.is_empty() {
            succeed(folder, &["merge", out]);
        }
        let before = tree(&folder.join(out));
        for (input, remedy) in [
            (
                "m2/x.dat",
                "name their common directory (its tree is kept), or use --base",
            ),
            ("m3/x.txt", "give --names full"),
            // It has the bytes of m1/x.dat. That file still exists, and its result may have been made with other
            // options.
            (
                "m4/x.dat",
                "name their common directory (its tree is kept), or use --base",
            ),
        ] {
            let refused = batch(input, &[]);
            let words = format!("{input}: {out}/x.npy is the result of m1/x.dat; {remedy}");
            assert!(
                refused.code != 0 && refused.words.contains(&words),
                "{}",
                refused.words
            );
            assert_eq!(tree(&folder.join(out))["x.npy"], before["x.npy"]);
        }
        // The same file by another path.
        let same = batch("./m1/x.dat", &[]);
        assert_eq!(same.code, 0, "{}", same.words);
        // A result is replaced when the user asks for it, and written where nothing is replaced.
        assert_eq!(batch("m2/x.dat", &["--overwrite"]).code, 0);
        assert_ne!(tree(&folder.join(out))["x.npy"], before["x.npy"]);
        if !shard.is_empty() {
            succeed(folder, &["merge", out]);
        }
        fs::rename(folder.join("m2"), folder.join("gone")).unwrap();
        let replaced = batch("m1/x.dat", &[]);
        let words = format!(
            "1 result was made from other inputs, which do not exist any more; the first is {out}/x.npy"
        );
        assert!(
            replaced.code == 0 && replaced.words.contains(&words),
            "{}",
            replaced.words
        );
        fs::rename(folder.join("gone"), folder.join("m2")).unwrap();
    }
}

/// An input that a batch has not come to is not forgotten.
#[test]
fn an_unfinished_batch_is_not_called_complete() {
    let temporary = sample_folder();
    let folder = temporary.path();
    let batch = [
        "eval", "a.dat", "b.dat", "-o", "out", "--resume", "--device", "cpu",
    ];
    succeed(folder, &batch);
    let whole = tree(&folder.join("out"));
    let path = folder.join("out/manifest.jsonl");
    let text = fs::read_to_string(&path).unwrap();
    let first = text.lines().next().unwrap();
    let pending = r#"{"state":"pending","input":"b.dat","result":"b.npy"}"#;
    fs::write(&path, format!("{first}\n{pending}\n")).unwrap();
    fs::remove_file(folder.join("out/b.npy")).unwrap();
    let check = run(folder, &["check", "out"]);
    assert_eq!(check.code, 8, "{}", check.words);
    let unfinished = "1 input has no result yet (the first: b.dat)";
    assert!(check.words.contains(unfinished), "{}", check.words);
    succeed(folder, &batch);
    assert_eq!(tree(&folder.join("out")), whole);
    succeed(folder, &["check", "out"]);

    // A first line that cannot be read has a remedy that works.
    fs::write(&path, text.replacen("output", "0utput", 1)).unwrap();
    let check = run(folder, &["check", "out"]);
    assert_eq!(check.code, 8, "{}", check.words);
    assert!(
        check.words.contains("--overwrite` makes all results again"),
        "{}",
        check.words
    );
    let again = [&batch[..5], &["--overwrite", "--device", "cpu"]].concat();
    succeed(folder, &again);
    assert_eq!(tree(&folder.join("out")), whole);
}

/// Another rule of names leaves results under their old names, which are told, and not counted twice.
#[test]
fn results_under_other_names_are_told_and_pruned() {
    let temporary = sample_folder();
    let folder = temporary.path();
    fs::create_dir(folder.join("in")).unwrap();
    for name in ["a.dat", "b.dat", "bad.dat"] {
        fs::copy(folder.join(name), folder.join("in").join(name)).unwrap();
    }
    let batch = ["eval", "in", "-o", "out"];
    assert_eq!(run(folder, &batch).code, 3);
    let full = [&batch[..], &["--resume", "--names", "full"]].concat();
    let renamed = run(folder, &full);
    let words = "2 results have another name now (--prune removes the old ones)";
    assert!(renamed.words.contains(words), "{}", renamed.words);
    let check = run(folder, &["check", "out"]);
    assert!(check.words.contains("1 input failed"), "{}", check.words);
    run(folder, &[&full[..], &["--prune"]].concat());
    assert_eq!(
        names(&folder.join("out")),
        ["a.dat.npy", "b.dat.npy", "manifest.jsonl"]
    );
    // Results of another format stay: they are no old names.
    run(folder, &[&batch[..], &["--to", "csv"]].concat());
    run(
        folder,
        &[&batch[..], &["--to", "csv", "--resume", "--prune"]].concat(),
    );
    assert_eq!(names(&folder.join("out")).len(), 5);
}

/// A directory that was empty, and has files now, has not failed any more.
#[test]
fn a_directory_that_failed_is_forgotten_when_it_can_be_read() {
    let temporary = sample_folder();
    let folder = temporary.path();
    fs::create_dir(folder.join("late")).unwrap();
    let batch = ["eval", "late", "a.dat", "-o", "out", "--resume"];
    assert_eq!(run(folder, &batch).code, 3);
    assert_eq!(run(folder, &["check", "out"]).code, 8);
    fs::copy(folder.join("b.dat"), folder.join("late/b.dat")).unwrap();
    succeed(folder, &batch);
    succeed(folder, &["check", "out"]);
}

#[test]
fn results_without_inputs_are_told_and_pruned() {
    let temporary = sample_folder();
    let folder = temporary.path();
    fs::create_dir_all(folder.join("walks/deep")).unwrap();
    for name in ["a.dat", "deep/b.dat", "deep/c.dat"] {
        fs::copy(folder.join("a.dat"), folder.join("walks").join(name)).unwrap();
    }
    fs::copy(folder.join("bad.dat"), folder.join("walks/bad.dat")).unwrap();
    let batch = ["eval", "walks", "-o", "out", "--resume", "--device", "cpu"];
    assert_eq!(run(folder, &batch).code, 3);
    let removed = ["bad.dat", "deep/b.dat", "deep/c.dat"];
    for name in removed {
        fs::remove_file(folder.join("walks").join(name)).unwrap();
    }
    let again = succeed(folder, &batch);
    let expected = "2 results have no input any more (--prune removes what has none)";
    assert!(again.words.contains(expected), "{}", again.words);
    let check = run(folder, &["check", "out"]);
    assert_eq!(check.code, 8, "{}", check.words);
    let removed = "2 results have no input any more (the first: deep/b.npy); `tumble eval … --resume --prune` removes \
                   them";
    assert!(check.words.contains(removed), "{}", check.words);
    succeed(folder, &["check", "out", "--results-only"]);
    // A file that no longer matches its line of the manifest stays.
    fs::write(folder.join("out/deep/c.npy"), "mine").unwrap();
    let pruned = succeed(folder, &[&batch[..], &["--prune"]].concat());
    assert!(
        pruned.words.contains("b.npy: removed; its input is gone"),
        "{}",
        pruned.words
    );
    assert!(
        pruned
            .words
            .contains("c.npy: has no input any more, but differs"),
        "{}",
        pruned.words
    );
    assert_eq!(
        names(&folder.join("out")),
        ["a.npy", "deep/c.npy", "manifest.jsonl"]
    );
    let refused = run(
        folder,
        &["eval", "walks", "-o", "s", "--shard", "1/1", "--prune"],
    );
    assert_eq!(refused.code, 2, "{}", refused.words);
}

/// A result stays if its input may be somewhere else: in another directory than the current one, or on a disk that is
/// not mounted.
#[test]
fn results_of_inputs_that_may_be_elsewhere_are_not_pruned() {
    let temporary = sample_folder();
    let folder = temporary.path();
    for name in ["one", "two", "disk/share"] {
        fs::create_dir_all(folder.join(name)).unwrap();
    }
    for name in ["one/x.dat", "one/w.dat", "two/z.dat", "disk/share/s.dat"] {
        fs::copy(folder.join("a.dat"), folder.join(name)).unwrap();
    }
    let share = folder.join("disk/share");
    let from = |directory: &str, inputs: &[&str], options: &[&str]| {
        let batch = [
            &["eval"][..],
            inputs,
            &["-o", "../out/", "--device", "cpu"],
            options,
        ];
        succeed(&folder.join(directory), &batch.concat())
    };
    let resume = ["--resume"];
    from("one", &["x.dat", "./w.dat"], &[]);
    from("one", &[share.to_str().unwrap()], &resume);
    fs::remove_file(share.join("s.dat")).unwrap();
    for unmounted in ["nothing is left in the directory", "there is no directory"] {
        let kept = from("two", &["z.dat"], &["--overwrite", "--prune"]);
        for expected in [
            "3 results stay: ",
            "was not found from this directory, but it may be somewhere else",
        ] {
            assert!(kept.words.contains(expected), "{unmounted}: {}", kept.words);
        }
        assert!(
            !kept.words.contains("removed"),
            "{unmounted}: {}",
            kept.words
        );
        assert_eq!(
            names(&folder.join("out")),
            ["manifest.jsonl", "s.npy", "w.npy", "x.npy", "z.npy"]
        );
        let _ = fs::remove_dir(&share);
    }
    // The directory is there and has other files.
    fs::create_dir(&share).unwrap();
    fs::copy(folder.join("a.dat"), share.join("t.dat")).unwrap();
    let pruned = from("two", &[share.to_str().unwrap()], &["--resume", "--prune"]);
    assert!(pruned.words.contains("s.npy: removed"), "{}", pruned.words);
    assert!(!folder.join("out/s.npy").exists());
}

/// A result whose input is somewhere else may be stale: that is no complete check.
#[test]
fn inputs_that_are_not_found_are_no_success() {
    let temporary = sample_folder();
    let folder = temporary.path();
    fs::create_dir_all(folder.join("work/in")).unwrap();
    for name in ["a.dat", "b.dat"] {
        fs::copy(folder.join(name), folder.join("work/in").join(name)).unwrap();
    }
    let work = folder.join("work");
    succeed(&work, &["eval", "in", "-o", "out", "--device", "cpu"]);
    succeed(&work, &["check", "out"]);
    // Seen from another directory, the paths in the manifest lead to no files.
    let check = run(folder, &["check", "work/out", "--json"]);
    assert_eq!(check.code, 8, "{}", check.words);
    let expected = "2 input files not found (the first: in/a.dat), so changes in them are not known; run it in the directory \
                    in which the batch ran, or add --results-only to check the results alone";
    assert!(check.words.contains(expected), "{}", check.words);
    let report: serde_json::Value = serde_json::from_slice(&check.out).unwrap();
    assert_eq!(report["complete"], false, "{report}");
    assert_eq!(
        report["not_found"],
        serde_json::json!(["in/a.dat", "in/b.dat"])
    );
    let alone = succeed(folder, &["check", "work/out", "--results-only"]);
    assert_eq!(
        String::from_utf8(alone.out).unwrap(),
        "2 results, unchanged since they were written\n"
    );
    // A directory with the name of an input does not count as the input.
    let input = work.join("in/a.dat");
    fs::remove_file(&input).unwrap();
    fs::create_dir(&input).unwrap();
    let check = run(&work, &["check", "out"]);
    assert_eq!(check.code, 8, "{}", check.words);
    // A result that has changed is found with this option too.
    fs::write(folder.join("work/out/a.npy"), "other").unwrap();
    let check = run(folder, &["check", "work/out", "--results-only"]);
    assert_eq!(check.code, 8, "{}", check.words);
}

/// Pruning removes what has no input, and nothing else: an input that has failed is still without its result.
#[test]
fn pruning_forgets_no_failure_of_an_input_that_exists() {
    let temporary = sample_folder();
    let folder = temporary.path();
    let all = ["eval", "a.dat", "bad.dat", "-o", "out/", "--device", "cpu"];
    assert_eq!(run(folder, &all).code, 3);
    let one = [
        "eval", "a.dat", "-o", "out/", "--device", "cpu", "--resume", "--prune",
    ];
    succeed(folder, &one);
    let check = run(folder, &["check", "out"]);
    assert_eq!(check.code, 8, "{}", check.words);
    assert!(check.words.contains("1 input failed"), "{}", check.words);
    fs::remove_file(folder.join("bad.dat")).unwrap();
    let pruned = succeed(folder, &one);
    let forgotten = "1 input without a result is forgotten: bad.dat was not found";
    assert!(pruned.words.contains(forgotten), "{}", pruned.words);
    succeed(folder, &["check", "out"]);
}

/// Inputs that are refused before the work begins are in JSON too.
#[test]
fn json_has_the_inputs_without_a_job() {
    let temporary = sample_folder();
    let folder = temporary.path();
    let inputs = ["a.dat", "folder/a.dat", "-o", "out", "--json"];
    let made = run(folder, &[&["eval"][..], &inputs].concat());
    let json: Vec<serde_json::Value> = serde_json::from_slice(&made.out).unwrap();
    let failed: Vec<_> = json.iter().filter(|it| it["state"] == "failed").collect();
    assert_eq!(failed.len(), 2, "{json:?}");
    let message = failed[0]["message"].as_str().unwrap();
    assert!(message.contains("would both be"), "{message}");
}

/// `--exclude` tests what is below a named directory, not the directories above it.
#[test]
fn exclusion_begins_below_what_is_named() {
    let temporary = sample_folder();
    let folder = temporary.path().join("old/takes");
    fs::create_dir_all(folder.join("drafts")).unwrap();
    for name in ["walk.dat", "drafts/run.dat"] {
        fs::copy(temporary.path().join("a.dat"), folder.join(name)).unwrap();
    }
    let takes = folder.to_str().unwrap();
    let eval = |pattern: &str, out: &str| {
        run(
            temporary.path(),
            &[
                "eval",
                takes,
                "-o",
                out,
                "--exclude",
                pattern,
                "--device",
                "cpu",
            ],
        )
    };
    assert_eq!(eval("old", "all").code, 0);
    let results = ["drafts/run.npy", "manifest.jsonl", "walk.npy"];
    assert_eq!(names(&temporary.path().join("all")), results);
    assert_eq!(eval("drafts", "some").code, 0);
    assert_eq!(names(&temporary.path().join("some")), results[1..]);
    let none = eval("*.dat", "none");
    assert_eq!(none.code, 2, "{}", none.words);
    let expected = "--exclude leaves out all inputs (2 inputs)";
    assert!(none.words.contains(expected), "{}", none.words);
}

/// Warnings and failures are in the manifest and in JSON; a long batch prints a line for each code.
#[test]
fn a_long_batch_prints_at_most_a_screen() {
    let temporary = sample_folder();
    let folder = temporary.path();
    fs::create_dir(folder.join("walks")).unwrap();
    fs::write(folder.join("turned.dat"), "# 1 1\n0 1 0 0 0\n1 0 1 0 0\n").unwrap();
    for number in 0..30 {
        let copy = |from: &str, to: String| {
            fs::copy(folder.join(from), folder.join("walks").join(to)).unwrap();
        };
        copy("turned.dat", format!("{number}.dat"));
        copy("bad.dat", format!("bad{number}.dat"));
    }
    let batch = ["eval", "walks", "-o", "out", "--device", "cpu", "--json"];
    let made = run(folder, &batch);
    assert_eq!(made.code, 3, "{}", made.words);
    let lines = made.words.lines().count();
    assert!(lines <= 16, "{lines}: {}", made.words);
    let said = [
        "W012 30 files: neighbouring keys 180° apart; the first: walks/0.dat:",
        "E020 20 more files: the wrong number of columns; the first: ",
        "30 results made, 30 inputs failed; listed in out/manifest.jsonl",
    ];
    for line in said {
        assert!(made.words.contains(line), "{}", made.words);
    }
    let json: Vec<serde_json::Value> = serde_json::from_slice(&made.out).unwrap();
    let states = |state: &str| json.iter().filter(|it| it["state"] == state).count();
    assert_eq!((states("made"), states("failed")), (30, 30));
    assert_eq!(json[0]["warnings"][0]["code"], "W012");
    let lines = manifest(&folder.join("out"));
    assert_eq!(lines.len(), 60);
    assert_eq!(lines[0]["warnings"][0]["code"], "W012");
    assert_eq!(lines[59]["state"], "failed");
    let all = run(
        folder,
        &[&batch[..], &["--overwrite", "--verbose"]].concat(),
    );
    assert_eq!(all.words.matches("warning[W012]").count(), 30);
    assert_eq!(all.words.matches("error[E020]").count(), 30);
    assert_eq!(all.words.matches(".npy\n").count(), 30, "{}", all.words);
}

/// Pipes, sockets, links in circles and empty directories get a line each, and all other inputs are evaluated.
#[cfg(unix)]
#[test]
fn directories_may_have_anything() {
    use std::os::unix::fs::symlink;

    let temporary = sample_folder();
    let folder = temporary.path();
    fs::create_dir_all(folder.join("walks/old")).unwrap();
    for name in ["walks/a.dat", "walks/a_draft.dat", "walks/old/b.dat"] {
        fs::copy(folder.join("a.dat"), folder.join(name)).unwrap();
    }
    symlink("..", folder.join("walks/old/up")).unwrap();
    symlink("round.dat", folder.join("walks/round.dat")).unwrap();
    symlink("nowhere", folder.join("walks/notes.txt")).unwrap();
    let pipe = std::process::Command::new("mkfifo")
        .arg(folder.join("walks/pipe.dat"))
        .status();
    assert!(pipe.unwrap().success());
    let _socket = std::os::unix::net::UnixListener::bind(folder.join("walks/s.dat")).unwrap();
    let line = [
        "eval",
        "walks",
        "-o",
        "out",
        "--exclude",
        "*_draft.*",
        "--device",
        "cpu",
    ];
    let made = succeed(folder, &line);
    for expected in [
        "walks/old/up: is a link to walks, the directory that contains it; not followed",
        "walks/round.dat: is a link in a circle of links; not followed",
        "walks/pipe.dat: is a named pipe; skipped (--pipes reads it)",
        "walks/s.dat: is a socket; skipped",
    ] {
        assert!(made.words.contains(expected), "{}", made.words);
    }
    assert_eq!(
        names(&folder.join("out")),
        ["a.npy", "manifest.jsonl", "old/b.npy"]
    );
    let lines = manifest(&folder.join("out"));
    let skipped = lines.iter().filter(|line| line["state"] == "skipped");
    assert_eq!(skipped.count(), 4);
    succeed(folder, &["check", "out"]);
    let shards = [&line[..3], &["shards"], &line[4..], &["--shard", "1/1"]].concat();
    succeed(folder, &shards);
    succeed(folder, &["merge", "shards"]);
    assert_eq!(tree(&folder.join("shards")), tree(&folder.join("out")));

    let empty = run(folder, &["eval", "empty", "walks/old", "-o", "partly"]);
    assert_eq!(empty.code, 3, "{}", empty.words);
    let expected = "empty: error[E002]: is a directory without files in readable formats";
    assert!(empty.words.contains(expected), "{}", empty.words);
    let none = run(folder, &["eval", "a.dat", "-o", "none", "--exclude", "*"]);
    assert_eq!(none.code, 2, "{}", none.words);
    assert!(
        none.words
            .contains("--exclude leaves out all inputs (1 input)"),
        "{}",
        none.words
    );

    // A list ended by NUL characters, named below a directory.
    fs::write(folder.join("list"), "walks/a.dat\0walks/old/b.dat\0").unwrap();
    let listed = [
        "eval",
        "--files-from",
        "list",
        "-0",
        "--base",
        "walks",
        "-o",
        "based",
    ];
    succeed(folder, &listed);
    assert_eq!(
        names(&folder.join("based")),
        ["a.npy", "manifest.jsonl", "old/b.npy"]
    );
    let outside = run(
        folder,
        &[
            "eval",
            "a.dat",
            "walks/a.dat",
            "--base",
            "walks",
            "-o",
            "no",
        ],
    );
    assert_eq!(outside.code, 2, "{}", outside.words);
    assert!(
        outside.words.contains("a.dat: is not below --base walks"),
        "{}",
        outside.words
    );
}

/// A result may be discarded on purpose; one that cannot be written is no success, and a terminal gets no binary numbers.
#[cfg(target_os = "linux")]
#[test]
fn results_are_discarded_only_where_that_is_asked_for() {
    let temporary = sample_folder();
    let folder = temporary.path();
    let program = env!("CARGO_BIN_EXE_tumble");
    let shell = |line: &str| {
        let mut shell = std::process::Command::new("sh");
        finish(
            shell
                .current_dir(folder)
                .args(["-c", line])
                .output()
                .unwrap(),
        )
    };
    // `subprocess.DEVNULL` and Node.js open it for reading too, as Rust's runtime does for a descriptor that is closed.
    for null in [">/dev/null", "1<>/dev/null", ">&-"] {
        let null = shell(&format!("{program} eval a.dat -o - {null}"));
        assert_eq!(null.code, 0, "{}", null.words);
    }
    let full = shell(&format!("{program} eval a.dat -o - >/dev/full"));
    assert_eq!(full.code, 7, "{}", full.words);
    let has_script = std::process::Command::new("script")
        .arg("--version")
        .output();
    if has_script.is_err() {
        eprintln!("NO script (util-linux): a terminal was not tried");
        return;
    }
    let terminal = |format: &str| {
        let line = format!("{program} eval a.dat -o - --format {format}");
        let output = shell(&format!("script -qec '{line}' /dev/null </dev/null"));
        (output.code, String::from_utf8(output.out).unwrap())
    };
    let (code, words) = terminal("npy");
    assert_eq!(code, 2, "{words}");
    assert!(words.contains("standard output is a terminal"), "{words}");
    assert_eq!(terminal("csv").0, 0);
}

/// Kills at random moments, each resumed: every file under its name is whole at any time, and
/// the results are those of an undisturbed run, byte for byte. There are 60 kills; `SOAK` makes 500.
#[cfg(unix)]
#[test]
fn kills_lose_nothing() {
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
    let enough = std::env::var_os("SOAK").map_or(60, |_| 500);
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
    assert!(
        finished * 20 > enough,
        "only {finished} runs came to their end"
    );
}

/// `check` names the command that made a directory, and no other command resumes it.
#[test]
fn a_directory_is_resumed_by_its_command() {
    let temporary = sample_folder();
    let folder = temporary.path();
    let line = |text: &str| run(folder, &text.split(' ').collect::<Vec<_>>());
    let convert = "convert a.dat b.dat -o out --to csv";
    assert_eq!(line(convert).code, 0);
    fs::write(folder.join("out/a.csv"), "other").unwrap();
    let check = line("check out");
    assert_eq!(check.code, 8, "{}", check.words);
    let expected = "error: 1 of 2 results changed; `tumble convert … --resume` makes them again\n";
    assert!(check.words.ends_with(expected), "{}", check.words);
    let before = tree(&folder.join("out"));
    for (refused, made) in [
        ("eval a.dat b.dat -o out --to csv --resume", "out/a.csv"),
        ("eval a.dat b.dat -o out --to csv --resume -n", "out/a.csv"),
        ("eval a.dat b.dat -o out --to npy --resume", "out"),
        (
            "eval a.dat b.dat -o out --to csv --resume --shard 1/1",
            "out/a.csv",
        ),
    ] {
        let run = line(refused);
        assert_eq!(run.code, 2, "{refused}: {}", run.words);
        let expected = format!("error: {made}: was made by `tumble convert`");
        assert!(run.words.contains(&expected), "{refused}: {}", run.words);
        assert!(run.words.contains("another directory"), "{}", run.words);
        assert_eq!(tree(&folder.join("out")), before);
    }
    assert_eq!(line(&format!("{convert} --resume")).code, 0);
    assert_eq!(line("check out").code, 0);
    // An input that failed has no options that name the command.
    assert_eq!(
        line("convert a.dat bad.dat -o out --to csv --resume").code,
        3
    );
    let check = line("check out");
    let expected = "`tumble convert … --resume` tries them again";
    assert!(check.words.contains(expected), "{}", check.words);
    assert_eq!(
        line("eval a.dat b.dat -o out --to csv --resume --overwrite").code,
        0
    );
}

/// Each fault has its line, with what mends it.
#[test]
fn faults_that_are_found_have_a_line_each() {
    let temporary = sample_folder();
    let folder = temporary.path();
    let line = |text: &str| run(folder, &text.split(' ').collect::<Vec<_>>());
    assert_eq!(line("eval a.dat bad.dat b.dat -o out --shard 1/1").code, 3);
    fs::write(folder.join("out/a.npy"), "other").unwrap();
    fs::remove_file(folder.join("b.dat")).unwrap();
    let check = line("check out");
    let lines: Vec<&str> = check.words.lines().collect();
    assert_eq!(lines.len(), 5, "{}", check.words);
    for (line, expected) in lines[1..].iter().zip([
        "error: 1 of 2 results changed; `tumble eval … --resume` makes them again",
        "1 input failed (the first: bad.dat:2:8: error[E020]: ",
        "1 input file not found (the first: b.dat), so changes in them are not known; run it in the directory",
        "out: 1 of 1 shard is done; `tumble merge out` combines them",
    ]) {
        assert!(line.starts_with(expected), "{line}");
    }
    assert!(
        lines[2].ends_with("; `tumble eval … --resume` tries them again"),
        "{}",
        lines[2]
    );
}

/// An input that became a directory is none any more: its result is pruned.
#[test]
fn the_result_of_an_input_that_became_a_directory_is_pruned() {
    let temporary = sample_folder();
    let folder = temporary.path();
    let line = |text: &str| run(folder, &text.split(' ').collect::<Vec<_>>());
    fs::create_dir(folder.join("in")).unwrap();
    for name in ["a", "b"] {
        fs::copy(folder.join("a.dat"), folder.join(format!("in/{name}.dat"))).unwrap();
    }
    assert_eq!(line("eval in -o out").code, 0);
    fs::remove_file(folder.join("in/b.dat")).unwrap();
    fs::create_dir(folder.join("in/b.dat")).unwrap();
    let check = line("check out");
    let expected = "1 result has no input any more (the first: b.npy); `tumble eval … --resume --prune` removes them";
    assert!(check.words.contains(expected), "{}", check.words);
    let pruned = line("eval in -o out --resume --prune");
    assert_eq!(pruned.code, 0, "{}", pruned.words);
    assert!(
        pruned.words.contains("b.npy: removed; its input is gone"),
        "{}",
        pruned.words
    );
    assert_eq!(names(&folder.join("out")), ["a.npy", "manifest.jsonl"]);
    assert_eq!(line("check out").code, 0);
}

/// A file has the same results by whatever path it is named: they have its name without its folders.
#[test]
fn results_do_not_depend_on_the_path_of_the_input() {
    let temporary = sample_folder();
    let folder = temporary.path();
    let line = |text: &str| run(folder, &text.split(' ').collect::<Vec<_>>());
    for command in ["eval --fps 30", "smooth", "convert"] {
        for (input, out) in [("a.dat", "one"), ("folder/../a.dat", "two")] {
            let made = line(&format!("{command} {input} -o {out}.npz --overwrite"));
            assert_eq!(made.code, 0, "{}", made.words);
        }
        let of = |name: &str| fs::read(folder.join(name)).unwrap();
        assert!(of("one.npz") == of("two.npz"), "{command}");
        let text = of("one.npz")
            .windows(5 * 4)
            .any(|it| it == "a\0\0\0.\0\0\0d\0\0\0a\0\0\0t\0\0\0".as_bytes());
        assert!(text, "{command}: no name of the input");
    }
}

/// A dry run refuses the results that the batch then refuses.
#[cfg(unix)]
#[test]
fn a_dry_run_refuses_what_cannot_be_replaced() {
    let temporary = sample_folder();
    let folder = temporary.path();
    let line = |text: &str| run(folder, &text.split(' ').collect::<Vec<_>>());
    fs::create_dir_all(folder.join("in/deep")).unwrap();
    for name in ["in/a.dat", "in/deep/b.dat", "in/c.dat"] {
        fs::copy(folder.join("a.dat"), folder.join(name)).unwrap();
    }
    assert_eq!(line("eval in -o out").code, 0);
    fs::remove_file(folder.join("out/a.npy")).unwrap();
    crate::attack::pipe(&folder.join("out/a.npy"));
    fs::rename(folder.join("out/deep"), folder.join("other")).unwrap();
    std::os::unix::fs::symlink("../other", folder.join("out/deep")).unwrap();
    let (dry, done) = (
        line("eval in -o out --resume -n"),
        line("eval in -o out --resume"),
    );
    assert_eq!(
        (dry.code, done.code),
        (3, 3),
        "{} {}",
        dry.words,
        done.words
    );
    let refusals = |words: &str| -> Vec<String> {
        let lines = words.lines().filter(|line| line.starts_with("error: out/"));
        lines.map(str::to_owned).collect()
    };
    assert_eq!(refusals(&dry.words), refusals(&done.words));
    assert_eq!(refusals(&done.words).len(), 2, "{}", done.words);
}
