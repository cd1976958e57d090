//! No file of the user's is lost, and nothing is written outside the folder of results.

use std::fs;
use std::io::Write as _;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::Stdio;

use crate::attack::{ended, entries, line, pipe, run, succeed, two_animations};
use crate::program::{command, sample_folder};
use crate::tree::tree;

const BATCH: [&str; 5] = ["eval", "a.dat", "b.dat", "-o", "out"];

fn with<'a>(line: &[&'a str], more: &[&'a str]) -> Vec<&'a str> {
    [line, more].concat()
}

/// A manifest is ours only if its first line says so.
#[test]
fn somebodys_manifest_is_kept() {
    let temporary = sample_folder();
    let folder = temporary.path();
    let out = folder.join("out");
    fs::create_dir(&out).unwrap();
    let path = out.join("manifest.jsonl");
    let ours = line("a.npy", "0", 1);
    let contents = [
        "",
        "my notes\n",
        "{\"output\":\"a.npy\"}\n",
        "\n",
        "a line that is not ended",
        &format!("my notes\n{ours}"),
    ];
    for content in contents {
        for more in [&[][..], &["--resume"]] {
            fs::write(&path, content).unwrap();
            let refused = run(folder, &with(&BATCH, more));
            assert_eq!(refused.code, 2, "{content:?}: {}", refused.words);
            assert!(
                refused.words.contains("manifest.jsonl: is not a manifest"),
                "{}",
                refused.words
            );
            assert_eq!(fs::read_to_string(&path).unwrap(), content);
            assert_eq!(entries(&out).len(), 1, "{:?}", entries(&out));
        }
        // A batch without any result does not replace it either.
        run(folder, &["eval", "bad.dat", "none.dat", "-o", "out"]);
        assert_eq!(fs::read_to_string(&path).unwrap(), content);
    }
    // `merge` does not replace it either.
    fs::write(&path, "my notes\n").unwrap();
    succeed(folder, &with(&BATCH, &["--shard", "1/1"]));
    let merged = run(folder, &["merge", "out"]);
    assert_eq!(merged.code, 2, "{}", merged.words);
    assert_eq!(fs::read_to_string(&path).unwrap(), "my notes\n");
    fs::remove_file(&path).unwrap();
    succeed(folder, &["merge", "out"]);
    succeed(folder, &["check", "out"]);

    // `--overwrite` replaces the foreign manifest.
    fs::write(&path, "my notes\n").unwrap();
    succeed(folder, &with(&BATCH, &["--overwrite"]));
    succeed(folder, &["check", "out"]);
}

#[test]
fn a_manifest_that_is_a_link_a_pipe_or_a_directory_is_refused() {
    let temporary = sample_folder();
    let folder = temporary.path();
    let out = folder.join("out");
    fs::create_dir(&out).unwrap();
    let ours = line("a.npy", "0", 1);
    fs::write(folder.join("outside"), &ours).unwrap();
    let path = out.join("manifest.jsonl");
    let kinds: [(&str, &dyn Fn()); 5] = [
        ("link", &|| symlink("../outside", &path).unwrap()),
        ("dangling link", &|| symlink("../nothing", &path).unwrap()),
        ("endless device", &|| symlink("/dev/zero", &path).unwrap()),
        ("pipe", &|| pipe(&path)),
        ("directory", &|| fs::create_dir(&path).unwrap()),
    ];
    for (kind, make) in kinds {
        make();
        for more in [&[][..], &["--resume"]] {
            let refused = run(folder, &with(&BATCH, more));
            assert_eq!(refused.code, 2, "{kind}: {}", refused.words);
        }
        assert_ne!(run(folder, &["check", "out"]).code, 0, "{kind}");
        assert!(!folder.join("nothing").exists(), "{kind}");
        assert_eq!(entries(&out).len(), 1, "{kind}: {:?}", entries(&out));
        match kind {
            "directory" => fs::remove_dir(&path).unwrap(),
            _ => fs::remove_file(&path).unwrap(),
        }
        assert_eq!(
            fs::read_to_string(folder.join("outside")).unwrap(),
            ours,
            "{kind}"
        );
    }
}

/// While the program waits for a named pipe, its directory of results, or one below it, is renamed, and a link to
/// another one put in its place: the other one is not written into, and no manifest in it is replaced.
#[test]
fn another_directory_in_the_place_of_that_of_the_results_is_not_written_into() {
    let commands: [(&[&str], &str); 9] = [
        (&["eval"], "out"),
        (&["eval"], "out/deep"),
        (&["eval", "--overwrite"], "out"),
        (&["eval", "--overwrite", "--prune"], "out/deep"),
        (&["convert", "--format", "csv"], "out"),
        (&["convert", "--format", "csv", "--overwrite"], "out/deep"),
        (&["eval", "--shard", "1/1", "--overwrite"], "out"),
        (&["eval", "--shard", "1/1", "--overwrite"], "out/deep"),
        (&["plot", "--overwrite"], "out"),
    ];
    for (words, swapped) in commands {
        let temporary = sample_folder();
        let folder = temporary.path();
        let keys = fs::read(folder.join("b.dat")).unwrap();
        fs::create_dir_all(folder.join("in/deep")).unwrap();
        fs::copy(folder.join("a.dat"), folder.join("in/deep/a.dat")).unwrap();
        let late = folder.join("in/deep/late.dat");
        pipe(&late);
        let foreign = folder.join("foreign");
        fs::create_dir_all(foreign.join("deep")).unwrap();
        for name in ["manifest.jsonl", "a.npy", "late.npy", "late.csv"] {
            fs::write(foreign.join(name), "theirs").unwrap();
            fs::write(foreign.join("deep").join(name), "theirs").unwrap();
        }
        let before = tree(&foreign);
        let line = with(words, &["in", "--pipes", "-o", "out"]);
        let [results, moved] = [swapped, "out-moved"].map(|name| folder.join(name));
        let swap = std::thread::spawn({
            let (late, results, moved, foreign) = (
                late.clone(),
                results.clone(),
                moved.clone(),
                foreign.clone(),
            );
            move || {
                // Opening it waits for its reader: by then the directory of results is open.
                let mut writer = fs::File::options().write(true).open(late).unwrap();
                fs::rename(&results, &moved).unwrap();
                symlink(&foreign, &results).unwrap();
                writer.write_all(&keys).unwrap();
            }
        });
        let mut program = command(folder, &line);
        let run = ended(program.stdout(Stdio::piped()).stderr(Stdio::piped()));
        swap.join().unwrap();
        assert_eq!(tree(&foreign), before, "{line:?}: {}", run.words);
        assert_eq!(run.code, 7, "{line:?}: {}", run.words);
        let said = run.words.matches("was moved or replaced meanwhile").count();
        assert_eq!(said, 1, "{line:?}: {}", run.words);
        if words[0] == "plot" {
            continue;
        }
        // When the directory is put back, `--resume` continues the batch.
        fs::remove_file(&results).unwrap();
        fs::rename(&moved, &results).unwrap();
        fs::remove_file(&late).unwrap();
        fs::copy(folder.join("b.dat"), &late).unwrap();
        let again = line.iter().filter(|&&word| word != "--overwrite");
        let again: Vec<&str> = again.copied().chain(["--resume"]).collect();
        succeed(folder, &again);
        if words.contains(&"--shard") {
            succeed(folder, &["merge", "out"]);
        }
        succeed(folder, &["check", "out"]);
    }
}

/// Whatever else is in a directory of results stays, whatever it is called.
#[test]
fn other_files_of_a_folder_of_results_stay() {
    let temporary = sample_folder();
    let folder = temporary.path();
    let out = folder.join("out");
    fs::create_dir_all(out.join("manifest.d")).unwrap();
    let mine = [
        "notes.txt",
        ".tumble-notes.part",
        ".tumble-my.draft.part",
        "manifest.jsonl.bak",
        "manifest.d/notes",
        "manifest.d/00007.jsonl",
    ];
    for name in mine {
        fs::write(out.join(name), "mine").unwrap();
    }
    pipe(&out.join(".tumble-aBcDeF.part"));
    symlink("../old.npy", out.join(".tumble-GhIjKl.part")).unwrap();
    succeed(folder, &BATCH);
    succeed(folder, &with(&BATCH, &["--resume"]));
    succeed(folder, &with(&BATCH, &["--overwrite", "--shard", "1/1"]));
    succeed(folder, &["merge", "out"]);
    succeed(folder, &["check", "out"]);
    for name in mine {
        assert_eq!(fs::read(out.join(name)).unwrap(), b"mine", "{name}");
    }
    assert_eq!(fs::read(folder.join("old.npy")).unwrap(), b"old");
    assert!(entries(&out).contains(".tumble-aBcDeF.part"));

    // A shard's file that no shard has written is not replaced.
    fs::write(out.join("manifest.d/00001.jsonl"), "mine").unwrap();
    let refused = run(folder, &with(&BATCH, &["--overwrite", "--shard", "1/1"]));
    assert_eq!(refused.code, 2, "{}", refused.words);
    assert_eq!(
        fs::read(out.join("manifest.d/00001.jsonl")).unwrap(),
        b"mine"
    );
}

/// Files that a manifest names are opened only below its folder, and no pipe or device is waited for.
#[test]
fn outputs_that_a_manifest_names_elsewhere_are_not_read() {
    let temporary = sample_folder();
    let folder = temporary.path();
    succeed(folder, &BATCH);
    let bytes = fs::read(folder.join("out/a.npy")).unwrap();
    let manifest = fs::read_to_string(folder.join("out/manifest.jsonl")).unwrap();
    let first: serde_json::Value = serde_json::from_str(manifest.lines().next().unwrap()).unwrap();
    fs::write(folder.join("outside"), &bytes).unwrap();
    let absolute = folder.join("outside");
    let out = folder.join("out");
    symlink("../outside", out.join("link")).unwrap();
    symlink("..", out.join("up")).unwrap();
    symlink("/dev/zero", out.join("zeros")).unwrap();
    pipe(&out.join("pipe"));
    let names = [
        absolute.to_str().unwrap(),
        "../outside",
        "x/../../outside",
        "link",
        "up/outside",
        "zeros",
        "pipe",
        "/dev/zero",
    ];
    for name in names {
        let mut entry = first.clone();
        entry["output"] = name.into();
        fs::write(out.join("manifest.jsonl"), format!("{manifest}{entry}\n")).unwrap();
        let check = run(folder, &["check", "out"]);
        assert_eq!(check.code, 8, "{name}: {}", check.words);
    }
    // Such a file does not count as an existing result.
    let result = out.join("a.npy");
    let others: [(&str, &dyn Fn()); 3] = [
        ("link", &|| symlink("../outside", &result).unwrap()),
        ("device", &|| symlink("/dev/zero", &result).unwrap()),
        ("pipe", &|| pipe(&result)),
    ];
    for (kind, make) in others {
        fs::write(out.join("manifest.jsonl"), &manifest).unwrap();
        fs::remove_file(&result).unwrap();
        make();
        let resumed = run(folder, &with(&BATCH, &["--resume"]));
        assert!(
            !resumed.words.contains("2 results kept"),
            "{kind}: {}",
            resumed.words
        );
        assert_eq!(fs::read(&absolute).unwrap(), bytes, "{kind}");
        if fs::symlink_metadata(&result).unwrap().is_file() {
            continue;
        }
        fs::remove_file(&result).unwrap();
        succeed(folder, &with(&BATCH, &["--resume"]));
    }
}

/// Merging looks for the leftovers of lost workers only in the folders of its results.
#[test]
fn merging_removes_nothing_elsewhere() {
    let temporary = sample_folder();
    let folder = temporary.path();
    fs::create_dir(folder.join("elsewhere")).unwrap();
    let part = folder.join("elsewhere/.tumble-shard00001-aBcDeF.part");
    fs::write(&part, "not ours").unwrap();
    succeed(folder, &with(&BATCH, &["--shard", "1/1"]));
    symlink("../elsewhere", folder.join("out/link")).unwrap();
    let record = folder.join("out/manifest.d/00001.jsonl");
    let honest = fs::read_to_string(&record).unwrap();
    let linked = line("link/x", "0", 1);
    let text = honest.clone() + &linked;
    let absolute = folder.join("elsewhere/x");
    for hostile in ["../elsewhere/x", absolute.to_str().unwrap()] {
        let text = text.clone() + &line(hostile, "0", 1);
        // Also if the line about the shard was changed to match the text.
        for text in [text.clone(), fitting(&text)] {
            fs::write(&record, text).unwrap();
            let merged = run(folder, &["merge", "out"]);
            assert_eq!(merged.code, 8, "{hostile}: {}", merged.words);
            assert!(part.exists());
        }
    }
    // Merging does not follow links to results, and keeps the lines of an earlier manifest without checking
    // them.
    fs::write(&record, fitting(&text)).unwrap();
    let merged = run(folder, &["merge", "out"]);
    assert_eq!(merged.code, 8, "{}", merged.words);
    assert!(merged.words.contains("link/x"), "{}", merged.words);
    fs::write(&record, honest).unwrap();
    fs::write(folder.join("out/manifest.jsonl"), &linked).unwrap();
    succeed(folder, &["merge", "out"]);
    let manifest = fs::read_to_string(folder.join("out/manifest.jsonl")).unwrap();
    assert!(manifest.contains("link/x"), "{manifest}");
    assert_eq!(fs::read(&part).unwrap(), b"not ours");
}

/// The record of a shard with the hash of its lines in the first line, as the program writes it.
fn fitting(text: &str) -> String {
    use sha2::{Digest, Sha256};

    let (first, lines) = text.split_once('\n').unwrap();
    let mut header: serde_json::Value = serde_json::from_str(first).unwrap();
    let hash = Sha256::digest(lines.as_bytes());
    let hash: String = hash.iter().map(|byte| format!("{byte:02x}")).collect();
    header["results"] = lines.lines().count().into();
    header["results_sha256"] = hash.into();
    format!("{header}\n{lines}")
}

/// A shard whose record has lost a line is not done; a plan without shards is invalid.
#[test]
fn records_of_shards_are_whole_or_made_again() {
    let temporary = sample_folder();
    let folder = temporary.path();
    succeed(folder, &BATCH);
    let whole = tree(&folder.join("out"));
    fs::remove_dir_all(folder.join("out")).unwrap();
    let shard = with(&BATCH, &["--shard", "1/1"]);
    succeed(folder, &shard);
    let record = folder.join("out/manifest.d/00001.jsonl");
    let text = fs::read_to_string(&record).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    fs::write(&record, format!("{}\n{}\n", lines[0], lines[1])).unwrap();
    let merged = run(folder, &["merge", "out"]);
    assert_eq!(merged.code, 8, "{}", merged.words);
    assert!(merged.words.contains("0 of 1 shard"), "{}", merged.words);
    succeed(folder, &with(&shard, &["--resume"]));

    let plan = folder.join("out/manifest.d/plan.json");
    let stated = fs::read_to_string(&plan).unwrap();
    let too_many = usize::MAX;
    for (from, shards) in [
        ("0 shards", 0),
        ("more shards than inputs", 3),
        ("too many", too_many),
    ] {
        let mut other: serde_json::Value = serde_json::from_str(&stated).unwrap();
        other["shards"] = shards.into();
        fs::write(&plan, other.to_string()).unwrap();
        for line in [
            &["merge", "out"][..],
            &["check", "out"],
            &with(&BATCH, &["--resume"]),
        ] {
            let refused = run(folder, line);
            assert_eq!(refused.code, 4, "{from}: {}", refused.words);
        }
        assert!(record.exists(), "{from}");
    }
    fs::write(&plan, &stated).unwrap();
    succeed(folder, &["merge", "out"]);
    assert_eq!(tree(&folder.join("out")), whole);
}

/// No result is written through a link in the folder of results.
#[test]
fn results_do_not_leave_their_folder() {
    let temporary = sample_folder();
    let folder = temporary.path();
    fs::create_dir_all(folder.join("walks/deep")).unwrap();
    fs::create_dir_all(folder.join("elsewhere")).unwrap();
    fs::create_dir(folder.join("out")).unwrap();
    fs::copy(folder.join("a.dat"), folder.join("walks/a.dat")).unwrap();
    fs::copy(folder.join("a.dat"), folder.join("walks/deep/b.dat")).unwrap();
    symlink("../elsewhere", folder.join("out/deep")).unwrap();
    for more in [
        &[][..],
        &["--resume"],
        &["--overwrite"],
        &["--overwrite", "--shard", "1/1"],
    ] {
        let run = run(folder, &with(&["eval", "walks", "-o", "out"], more));
        assert_eq!(run.code, 3, "{more:?}: {}", run.words);
        assert!(run.words.contains("deep/b.npy"), "{}", run.words);
        assert_eq!(entries(&folder.join("elsewhere")).len(), 0, "{more:?}");
        assert!(folder.join("out/a.npy").exists());
    }
}

/// Buffers and images are read from the folder of the file that names them, not through a link that
/// leads out of it.
#[test]
fn what_a_gltf_names_does_not_leave_its_folder() {
    let temporary = sample_folder();
    let folder = temporary.path();
    let secret = b"\x89PNG\r\n\x1a\nthe secret";
    fs::create_dir(folder.join("model")).unwrap();
    fs::write(folder.join("secret.png"), secret).unwrap();
    let mut model: serde_json::Value = serde_json::from_str(&two_animations()).unwrap();
    symlink("../secret.png", folder.join("model/image.png")).unwrap();
    symlink("..", folder.join("model/up")).unwrap();
    pipe(&folder.join("model/pipe.png"));
    for uri in ["image.png", "up/secret.png", "../secret.png", "pipe.png"] {
        model["images"] = serde_json::json!([{"uri": uri}]);
        fs::write(folder.join("model/m.gltf"), model.to_string()).unwrap();
        let line = ["eval", "model/m.gltf", "-o", "m.glb", "--overwrite"];
        let made = succeed(folder, &line);
        assert!(
            made.words.contains("the URI is kept"),
            "{uri}: {}",
            made.words
        );
        let bytes = fs::read(folder.join("m.glb")).unwrap();
        assert!(
            !bytes.windows(secret.len()).any(|part| part == secret),
            "{uri}"
        );
    }
    // An image in the folder itself is embedded.
    fs::copy(folder.join("secret.png"), folder.join("model/own.png")).unwrap();
    model["images"] = serde_json::json!([{"uri": "own.png"}]);
    fs::write(folder.join("model/m.gltf"), model.to_string()).unwrap();
    succeed(folder, &["eval", "model/m.gltf", "-o", "own.glb"]);
    let bytes = fs::read(folder.join("own.glb")).unwrap();
    assert!(bytes.windows(secret.len()).any(|part| part == secret));

    fs::write(folder.join("keys.bin"), [0; 40]).unwrap();
    symlink("../keys.bin", folder.join("model/keys.bin")).unwrap();
    symlink("/dev/zero", folder.join("model/zeros.bin")).unwrap();
    pipe(&folder.join("model/pipe.bin"));
    for uri in ["keys.bin", "up/keys.bin", "zeros.bin", "pipe.bin"] {
        model["buffers"] = serde_json::json!([{"byteLength": 40, "uri": uri}]);
        fs::write(folder.join("model/m.gltf"), model.to_string()).unwrap();
        let refused = run(folder, &["info", "model/m.gltf"]);
        assert_eq!(refused.code, 4, "{uri}: {}", refused.words);
    }
}

#[test]
fn tracks_of_walkers_do_not_leave_their_folder() {
    let temporary = sample_folder();
    let folder = temporary.path();
    succeed(folder, &["generate", "--hill", "-o", "hill.obj"]);
    fs::create_dir(folder.join("walkers")).unwrap();
    fs::write(folder.join("track.csv"), "t,x,y,z\n0,1,0,1\n9,9,0,9\n").unwrap();
    fs::copy(folder.join("track.csv"), folder.join("walkers/track.csv")).unwrap();
    symlink("../track.csv", folder.join("walkers/link.csv")).unwrap();
    symlink("/dev/zero", folder.join("walkers/zeros.csv")).unwrap();
    pipe(&folder.join("walkers/pipe.csv"));
    let route = |track: &str| {
        let list = format!(
            "name,radius,speed,x,y,z,to_x,to_y,to_z,track\nann,0.1,1,2,0,2,8,0,8,\n,0.1,,,,,,,,{track}\n"
        );
        fs::write(folder.join("walkers/list.csv"), list).unwrap();
        let _ = fs::remove_dir_all(folder.join("ways"));
        run(
            folder,
            &[
                "route",
                "hill.obj",
                "--walkers",
                "walkers/list.csv",
                "-o",
                "ways",
            ],
        )
    };
    let absolute = folder.join("track.csv");
    for track in [
        absolute.to_str().unwrap(),
        "../track.csv",
        "link.csv",
        "zeros.csv",
        "pipe.csv",
    ] {
        let refused = route(track);
        assert_eq!(refused.code, 4, "{track}: {}", refused.words);
        assert!(
            refused.words.contains("list.csv:3"),
            "{track}: {}",
            refused.words
        );
    }
    assert_eq!(route("track.csv").code, 0);
}

/// Two files of one command have two names, and a picture that cannot be drawn is refused before
/// anything is written.
#[test]
fn pictures_are_refused_before_anything_is_written() {
    let temporary = sample_folder();
    let folder = temporary.path();
    succeed(folder, &["generate", "--hill", "-o", "hill.obj"]);
    let before = entries(folder);
    let route = [
        "route",
        "hill.obj",
        "--start-point",
        "1,0,1",
        "--end-point",
        "8,0,8",
        "-o",
        "way.csv",
        "--plot",
    ];
    let smooth = ["smooth", "a.dat", "--fps", "30", "-o", "o.npy", "--plot"];
    let reduce = ["reduce", "a.dat", "--fps", "30", "-o", "o.npz", "--plot"];
    for line in [&route[..], &smooth, &reduce] {
        for (plot, code) in [
            ("picture.txt", 2),
            ("picture", 2),
            ("none/picture.svg", 7),
            ("old.npy", 2),
            ("a.dat", 2),
            ("empty", 2),
        ] {
            let refused = run(folder, &with(line, &[plot]));
            assert_eq!(refused.code, code, "{line:?} {plot}: {}", refused.words);
            assert_eq!(entries(folder), before, "{line:?} {plot}");
        }
    }
    let both = [
        "generate",
        "--hill",
        "-o",
        "x.obj",
        "--rocks",
        "./x.obj",
        "--overwrite",
    ];
    let refused = run(folder, &both);
    assert_eq!(refused.code, 2, "{}", refused.words);
    assert_eq!(entries(folder), before);
}

/// The folder of the results may be below the folder of the inputs, or the same folder.
#[test]
fn results_are_no_inputs_of_the_next_run() {
    let temporary = sample_folder();
    let folder = temporary.path();
    fs::create_dir_all(folder.join("walks/deep")).unwrap();
    fs::copy(folder.join("a.dat"), folder.join("walks/a.dat")).unwrap();
    fs::copy(folder.join("b.dat"), folder.join("walks/deep/b.dat")).unwrap();
    for out in ["walks/out", "walks"] {
        let line = ["convert", "walks", "-o", out, "--to", "npz"];
        succeed(folder, &line);
        let whole = tree(&folder.join("walks"));
        let resumed = succeed(folder, &with(&line, &["--resume"]));
        assert!(
            resumed.words.contains("2 results kept"),
            "{out}: {}",
            resumed.words
        );
        assert_eq!(tree(&folder.join("walks")), whole, "{out}");
        let _ = fs::remove_dir_all(folder.join("walks/out"));
    }
    let line = [
        "eval",
        "walks",
        "-o",
        "walks/shards",
        "--to",
        "npz",
        "--shard",
    ];
    fs::remove_file(folder.join("walks/manifest.jsonl")).unwrap();
    for name in ["walks/a.npz", "walks/deep/b.npz"] {
        fs::remove_file(folder.join(name)).unwrap();
    }
    let bytes = ["--shard-bytes", "100"];
    for part in ["1/2", "2/2"] {
        succeed(folder, &[&line[..], &[part], &bytes].concat());
    }
    succeed(folder, &["merge", "walks/shards"]);
    succeed(folder, &["check", "walks/shards"]);
    assert_eq!(entries(&folder.join("walks/shards")).len(), 4);
}

/// Results that a copy by hard links shares with another directory are replaced in one directory alone.
#[test]
fn a_copy_by_links_keeps_its_manifest() {
    let temporary = sample_folder();
    let folder = temporary.path();
    succeed(folder, &BATCH);
    fs::create_dir(folder.join("copy")).unwrap();
    for name in ["a.npy", "b.npy", "manifest.jsonl"] {
        fs::hard_link(
            folder.join("out").join(name),
            folder.join("copy").join(name),
        )
        .unwrap();
    }
    let before = tree(&folder.join("copy"));
    succeed(folder, &with(&BATCH, &["--overwrite", "-m", "slerp"]));
    assert_eq!(tree(&folder.join("copy")), before);
    assert!(Path::new(&folder.join("out/a.npy")).exists());
    assert_ne!(tree(&folder.join("out")), before);
}
