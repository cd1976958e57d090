//! Options about the program's messages, plans and threads: `--quiet`, `--progress`, `--dry-run`, `--color`,
//! `--threads`; and manual pages.

use std::fs;

use crate::program::{Run, run, sample_folder, succeed};
use crate::tree::tree;

fn text(run: &Run) -> &str {
    std::str::from_utf8(&run.out).unwrap()
}

fn words(line: &str) -> Vec<&str> {
    line.split_whitespace().collect()
}

#[test]
fn quiet_commands_print_errors_alone() {
    let folder = sample_folder();
    let run_of = |more: &str| {
        let line = format!("eval a.dat bad.dat -o out --overwrite {more}");
        run(folder.path(), &words(&line))
    };
    let (loud, quiet) = (run_of(""), run_of("--quiet"));
    assert_eq!((loud.code, quiet.code), (3, 3));
    assert!(loud.words.contains("1 result made"), "{}", loud.words);
    assert!(!quiet.words.contains("made"), "{}", quiet.words);
    assert!(quiet.words.contains("bad.dat"), "{}", quiet.words);
    // Manifests have everything.
    let manifest = fs::read_to_string(folder.path().join("out/manifest.jsonl")).unwrap();
    assert!(manifest.contains("bad.dat"), "{manifest}");
    assert!(!manifest.contains("quiet"), "{manifest}");
}

#[test]
fn supervisors_read_the_progress_as_json() {
    let folder = sample_folder();
    let line = "eval a.dat b.dat -o out --quiet --progress json";
    let run = succeed(folder.path(), &words(line));
    let last = run.words.lines().last().unwrap();
    let last: serde_json::Value = serde_json::from_str(last).unwrap();
    let bytes: u64 = ["a.npy", "b.npy"]
        .iter()
        .map(|name| {
            fs::metadata(folder.path().join("out").join(name))
                .unwrap()
                .len()
        })
        .sum();
    assert_eq!(last["progress"], "inputs");
    assert_eq!(last["done"], 2);
    assert_eq!(last["total"], 2);
    assert_eq!(last["failed"], 0);
    assert_eq!(last["bytes"], bytes);
    assert_eq!(last["seconds_left"], 0.0);
}

#[test]
fn a_dry_run_lists_results_and_writes_none() {
    let folder = sample_folder();
    let run_of = |line: &str| succeed(folder.path(), &words(line));
    let run = run_of("eval a.dat b.dat -o out --to csv --dry-run");
    assert_eq!(text(&run), "a.dat → out/a.csv\nb.dat → out/b.csv\n");
    assert!(
        run.words
            .contains("2 results would be made; nothing was written")
    );
    assert!(!folder.path().join("out").exists());
    run_of("eval a.dat -o out/ --to csv");
    let before = fs::read(folder.path().join("out/manifest.jsonl")).unwrap();
    let run = run_of("convert a.dat b.dat -o out --to csv -n --overwrite --json");
    let planned: serde_json::Value = serde_json::from_slice(&run.out).unwrap();
    assert_eq!(planned[0]["state"], "planned");
    assert_eq!(planned[0]["exists"], true);
    assert_eq!(planned[1]["output"], "out/b.csv");
    assert_eq!(planned[1]["exists"], false);
    let run = run_of("eval a.dat b.dat -o out --to csv -n --resume");
    assert_eq!(
        text(&run),
        "a.dat → out/a.csv (complete, would be kept)\nb.dat → out/b.csv\n"
    );
    assert_eq!(
        fs::read(folder.path().join("out/manifest.jsonl")).unwrap(),
        before
    );
    assert!(!folder.path().join("out/b.csv").exists());
    // As without it: a file is not replaced.
    let run = crate::program::run(folder.path(), &words("eval a.dat b.dat -o out --to csv -n"));
    assert_eq!(run.code, 3);
    assert!(run.words.contains("--overwrite"), "{}", run.words);
}

/// A dry run says of each result what the batch then does: those of clips, those that are complete, and those whose
/// inputs are gone.
#[test]
fn a_dry_run_names_the_results_that_the_batch_then_makes_skips_and_removes() {
    let folder = sample_folder();
    let folder = folder.path();
    let run_of = |line: &str| succeed(folder, &words(line));
    fs::create_dir(folder.join("in")).unwrap();
    fs::write(folder.join("in/m.gltf"), crate::attack::two_animations()).unwrap();
    for name in ["a", "b", "c"] {
        fs::copy(folder.join("a.dat"), folder.join(format!("in/{name}.dat"))).unwrap();
    }
    let planned = run_of("eval in -o out -n");
    let planned: Vec<&str> = text(&planned).lines().collect();
    let of_clips = [
        "in/m.gltf Run → out/m.Run.npy",
        "in/m.gltf Walk → out/m.Walk.npy",
    ];
    assert_eq!(planned[3..], of_clips, "{planned:?}");
    assert!(!folder.join("out").exists());
    run_of("eval in -o out");
    fs::remove_file(folder.join("in/b.dat")).unwrap();
    fs::copy(folder.join("b.dat"), folder.join("in/d.dat")).unwrap();
    let changed = fs::read_to_string(folder.join("a.dat")).unwrap() + "\n";
    fs::write(folder.join("in/c.dat"), changed).unwrap();
    let before = tree(&folder.join("out"));
    let dry = run_of("eval in -o out -n --resume --prune");
    assert_eq!(
        text(&dry).lines().collect::<Vec<_>>(),
        [
            "in/a.dat → out/a.npy (complete, would be kept)",
            "in/c.dat → out/c.npy (made again: its input changed)",
            "in/d.dat → out/d.npy",
            "in/m.gltf → out/m.Run.npy (complete, would be kept)",
            "in/m.gltf → out/m.Walk.npy (complete, would be kept)",
            "removes out/b.npy (its input is gone)",
        ]
    );
    let summary =
        "2 results would be made, 3 kept (already complete), 1 removed; nothing was written";
    assert!(dry.words.contains(summary), "{}", dry.words);
    assert_eq!(tree(&folder.join("out")), before);
    let json = run_of("eval in -o out -n --resume --prune --json");
    let json: serde_json::Value = serde_json::from_slice(&json.out).unwrap();
    let states: Vec<&str> = json
        .as_array()
        .unwrap()
        .iter()
        .map(|it| it["state"].as_str().unwrap())
        .collect();
    assert_eq!(
        states,
        ["kept", "planned", "planned", "kept", "kept", "pruned"]
    );
    // The batch does what the dry run has announced.
    let done = run_of("eval in -o out --resume --prune");
    let summary = "2 results made, 3 results of 2 inputs kept (already complete)";
    assert!(done.words.contains(summary), "{}", done.words);
    assert!(!folder.join("out/b.npy").exists() && folder.join("out/d.npy").exists());
    // The dry run names the reason why an input is evaluated again.
    let reason = |line: &str| {
        let dry = run_of(line);
        text(&dry).lines().next().unwrap().to_owned()
    };
    assert_eq!(
        reason("eval in -o out -n --resume --fps 30"),
        "in/a.dat → out/a.npy (made again: option --fps changed)"
    );
    fs::write(folder.join("out/a.npy"), "damaged").unwrap();
    assert_eq!(
        reason("eval in -o out -n --resume"),
        "in/a.dat → out/a.npy (made again: its file was changed or damaged)"
    );
    fs::remove_file(folder.join("out/a.npy")).unwrap();
    assert_eq!(
        reason("eval in -o out -n --resume"),
        "in/a.dat → out/a.npy (made again: its file is missing)"
    );
    #[cfg(unix)]
    {
        let of_link = "in/a.dat → out/a.npy (made again: its file was replaced by a link)";
        for target in ["m.Run.npy", "../a.dat", "nothing"] {
            std::os::unix::fs::symlink(target, folder.join("out/a.npy")).unwrap();
            let found = reason("eval in -o out -n --resume");
            assert_eq!(found, of_link, "{target}");
            let check = run(folder, &words("check out"));
            let expected = "out/a.npy: its file was replaced by a link";
            assert!(check.words.contains(expected), "{}", check.words);
            fs::remove_file(folder.join("out/a.npy")).unwrap();
        }
        // A link to the same bytes is as good.
        std::os::unix::fs::symlink("d.npy", folder.join("out/a.npy")).unwrap();
        let whole = "in/a.dat → out/a.npy (complete, would be kept)";
        assert_eq!(reason("eval in -o out -n --resume"), whole);
    }
    let one = run(folder, &words("eval in/m.gltf -o m.npy -n"));
    assert!(
        one.code == 4 && one.words.contains("--animation"),
        "{}",
        one.words
    );
}

/// A program that reads the JSON learns of an output that cannot be written, and of a batch that the disk ends.
#[test]
fn a_command_that_fails_before_its_results_prints_its_failure_as_json() {
    let folder = sample_folder();
    for (line, code, words_of) in [
        ("eval a.dat -o none/o.npy --json", 7, "none does not exist"),
        ("eval a.dat b.dat -o old.npy --json", 2, "need a directory"),
        ("check none.jsonl --json", 4, "cannot be read"),
        ("compare bad.dat a.dat --json", 4, "E020"),
    ] {
        let run = run(folder.path(), &words(line));
        assert_eq!(run.code, code, "{line}: {}", run.words);
        let json: serde_json::Value = serde_json::from_slice(&run.out).unwrap();
        // In the form of the command's results: a list, or one object.
        let json = if json.is_array() {
            json[0].clone()
        } else {
            json
        };
        assert_eq!(
            (&json["state"], &json["code"]),
            (&"failed".into(), &code.into())
        );
        assert!(
            json["message"].as_str().unwrap().contains(words_of),
            "{json}"
        );
    }
    let silent = run(folder.path(), &words("eval a.dat -o none/o.npy"));
    assert!(silent.out.is_empty());
}

#[test]
fn patterns_that_leave_nothing_out_are_told() {
    let folder = sample_folder();
    let line = "eval folder b.dat -o out --exclude b.* --exclude *_draft.dat -n";
    let run = succeed(folder.path(), &words(line));
    let warned: Vec<&str> = run
        .words
        .lines()
        .filter(|line| line.contains("--exclude"))
        .collect();
    assert_eq!(
        warned,
        [
            "warning: --exclude '*_draft.dat' leaves nothing out: no name of a file or a folder matches it"
        ]
    );
}

/// As `plot` and `info`: an input that fails does not take the others away.
#[test]
fn a_page_has_the_inputs_that_can_be_read() {
    let folder = sample_folder();
    let run = run(
        folder.path(),
        &words("view bad.dat a.dat -o page.html --device cpu"),
    );
    assert_eq!(run.code, 3, "{}", run.words);
    assert!(run.words.contains("1 of 2 inputs failed"), "{}", run.words);
    assert!(folder.path().join("page.html").exists());
}

#[test]
fn colours_and_threads_are_chosen() {
    let folder = sample_folder();
    let coloured = |when: &str| {
        let line = format!("eval a.dat -o old.npy --color {when}");
        let run = run(folder.path(), &words(&line));
        run.words.contains('\u{1b}')
    };
    assert!(coloured("always"));
    assert!(!coloured("auto") && !coloured("never"));
    let bits = |threads: &str| {
        let file = format!("{threads}.npy");
        succeed(
            folder.path(),
            &["eval", "a.dat", "-o", &file, "-j", threads],
        );
        fs::read(folder.path().join(file)).unwrap()
    };
    assert_eq!(bits("1"), bits("3"));
    assert_eq!(run(folder.path(), &["eval", "a.dat", "-j", "0"]).code, 2);
}

#[test]
fn every_command_has_a_manual_page() {
    let folder = sample_folder();
    let page = |words: &[&str]| text(&succeed(folder.path(), words)).to_owned();
    assert!(
        page(&["man"]).contains(".TH tumble 1"),
        "{}",
        page(&["man"])
    );
    for command in crate::commands::commands() {
        let name = command.get_name();
        let page = page(&["man", name]);
        assert!(page.contains(&format!(".TH tumble-{name} 1")), "{page}");
    }
    let run = run(folder.path(), &["man", "evil"]);
    assert_eq!(run.code, 2);
    assert!(run.words.contains("did you mean eval?"), "{}", run.words);
}

/// `latest -> shots` sorts before `shots`, and a link to the directory above leads back into it.
#[cfg(unix)]
#[test]
fn results_are_named_by_paths_without_links() {
    let folder = sample_folder();
    let inputs = folder.path().join("inputs");
    fs::create_dir_all(inputs.join("shots")).unwrap();
    fs::copy(folder.path().join("a.dat"), inputs.join("shots/a.dat")).unwrap();
    fs::write(inputs.join("shots/notes.txt"), "notes").unwrap();
    std::os::unix::fs::symlink("shots", inputs.join("latest")).unwrap();
    std::os::unix::fs::symlink("..", inputs.join("shots/above")).unwrap();
    let run = succeed(folder.path(), &words("eval inputs -o out"));
    assert!(
        folder.path().join("out/shots/a.npy").exists(),
        "{}",
        run.words
    );
    assert!(!folder.path().join("out/latest").exists(), "{}", run.words);
    let said = "inputs/latest/a.dat: is the same file as inputs/shots/a.dat, and is processed once";
    assert!(run.words.contains(said), "{}", run.words);
    assert!(
        run.words.contains("because of their endings (.txt)"),
        "{}",
        run.words
    );
}

/// Equal files are different inputs as long as both exist.
#[test]
fn equal_inputs_have_results_of_their_own() {
    let folder = sample_folder();
    succeed(folder.path(), &words("eval a.dat -o out/ --fps 30"));
    let run_of = |line: &str| run(folder.path(), &words(line));
    let run = run_of("eval folder/a.dat -o out/ --fps 60 --resume");
    assert_eq!(run.code, 2, "{}", run.words);
    assert!(
        run.words.contains("is the result of a.dat"),
        "{}",
        run.words
    );
    fs::remove_file(folder.path().join("a.dat")).unwrap();
    assert_eq!(
        run_of("eval folder/a.dat -o out/ --fps 60 --resume").code,
        0
    );
}

/// JSON names the animation of a result, and why the others of its input failed.
#[test]
fn json_tells_why_animations_failed() {
    // Three keys at 0, 0.1 and 1.03 s, which are no frames, and the first two of them.
    const KEYS: &str =
        "AAAAAM3MzD0K14M/AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAmpkZP83MTD8AAAAAAAAAAAAAAAAAAIA/";
    let folder = sample_folder();
    let animation = |name: &str, input: u32| {
        serde_json::json!({
            "name": name,
            "channels": [{"sampler": 0, "target": {"node": 0, "path": "rotation"}}],
            "samplers": [{"input": input, "output": input + 1}],
        })
    };
    let accessor = |view: u32, count: u32, of: &str, max: f64| match of {
        "SCALAR" => serde_json::json!({
            "bufferView": view, "componentType": 5126, "count": count, "type": of, "min": [0.0], "max": [max],
        }),
        _ => {
            serde_json::json!({"bufferView": view, "componentType": 5126, "count": count, "type": of})
        }
    };
    let file = serde_json::json!({
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": 60, "uri": format!("data:application/octet-stream;base64,{KEYS}")}],
        "bufferViews": [
            {"buffer": 0, "byteLength": 12},
            {"buffer": 0, "byteOffset": 12, "byteLength": 48},
        ],
        "accessors": [
            accessor(0, 3, "SCALAR", f64::from(1.03f32)),
            accessor(1, 3, "VEC4", 0.0),
            accessor(0, 2, "SCALAR", f64::from(0.1f32)),
            accessor(1, 2, "VEC4", 0.0),
        ],
        "nodes": [{"name": "a"}],
        "animations": [animation("uneven", 0), animation("even", 2)],
    });
    fs::write(folder.path().join("two.gltf"), file.to_string()).unwrap();
    let run = run(
        folder.path(),
        &words("convert two.gltf -o out/ --to bvh --json"),
    );
    let records: serde_json::Value = serde_json::from_slice(&run.out).unwrap();
    let with_state = |state: &str| {
        let mut records = records.as_array().unwrap().iter();
        records.find(|record| record["state"] == state).unwrap()
    };
    let (failed, made) = (with_state("failed"), with_state("made"));
    assert_eq!(failed["input"], "two.gltf");
    assert!(
        failed["causes"][0].as_str().unwrap().contains("uneven"),
        "{failed}"
    );
    assert_eq!(made["input"], "two.gltf");
    assert_eq!(made["animation"], "even");
}

/// A batch that is interrupted says so, how much is done, and how to continue; its JSON is complete.
#[cfg(unix)]
#[test]
fn interrupted_batches_say_what_is_done() {
    use std::process::Stdio;
    use std::time::{Duration, Instant};

    let folder = sample_folder();
    let inputs = folder.path().join("inputs");
    fs::create_dir(&inputs).unwrap();
    for index in 0..2000 {
        let name = inputs.join(format!("{index:04}.dat"));
        fs::copy(folder.path().join("a.dat"), name).unwrap();
    }
    let mut command = crate::program::with_signals(env!("CARGO_BIN_EXE_tumble"));
    let child = command
        .current_dir(folder.path())
        .args(words("eval inputs -o out --fps 4000 --json --device cpu"))
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let first = folder.path().join("out/0000.npy");
    let started = Instant::now();
    while !first.exists() && started.elapsed() < Duration::from_secs(60) {
        std::thread::sleep(Duration::from_millis(1));
    }
    let process = child.id().to_string();
    let killed = std::process::Command::new("kill")
        .args(["-INT", &process])
        .status();
    assert!(killed.unwrap().success());
    let run = crate::program::finish(child.wait_with_output().unwrap());
    assert!(run.words.contains("interrupted by SIGINT"), "{}", run.words);
    assert!(
        run.words.contains("not reached (--resume makes them)"),
        "{}",
        run.words
    );
    let records: serde_json::Value = serde_json::from_slice(&run.out).unwrap();
    let records = records.as_array().unwrap();
    let in_state = |state: &str| records.iter().filter(|it| it["state"] == state).count();
    let made = fs::read_dir(folder.path().join("out")).unwrap().count() - 1;
    assert_eq!((in_state("made"), in_state("pending")), (made, 2000 - made));
}

/// Folder with inputs that cause warnings.
fn folder_of_warnings() -> tempfile::TempDir {
    let temporary = sample_folder();
    let write = |name: &str, text: &str| fs::write(temporary.path().join(name), text).unwrap();
    write(
        "lost.bvh",
        "HIERARCHY\nROOT Hips\n{\nOFFSET 0 0 0\nCHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation \
         Yrotation\nJOINT LeftHand\n{\nOFFSET 0 1 0\nCHANNELS 3 Zrotation Xrotation Yrotation\nEnd Site\n{\nOFFSET 0 1 \
         0\n}\n}\n}\nMOTION\nFrames: 3\nFrame Time: 0.05\n0 0 0 0 0 0 0 0 0\n1 0 0 0 0 0 9 0 0\n2 0 0 0 0 0 0 9 0\n",
    );
    write("still.csv", "t,x,y,z\n0,0,0,0\n1,0,0,0\n");
    write("long.dat", "# 1 2\n0 1 0 0 0\n1 0.8 0.6 0 0\n3 1 0 0 0\n");
    write("half.dat", "# 1 1\n0 1 0 0 0\n1 0 1 0 0\n");
    write("short.dat", "# 1 1\n0 1 0 0 0\n1 0.8 0.6 0 0\n");
    temporary
}

/// Every text in a JSON value that is a warning's message.
fn recorded(value: &serde_json::Value, found: &mut Vec<String>) {
    match value {
        serde_json::Value::Object(members) => {
            let warnings = members.get("warnings").and_then(|it| it.as_array());
            let texts = warnings.into_iter().flatten();
            let message = |it: &serde_json::Value| it["message"].as_str().map(str::to_owned);
            found.extend(
                texts.map(|it| message(it).unwrap_or_else(|| it.as_str().unwrap().to_owned())),
            );
            members.values().for_each(|value| recorded(value, found));
        }
        serde_json::Value::Array(values) => values.iter().for_each(|value| recorded(value, found)),
        _ => {}
    }
}

/// No command prints a warning that is not in its JSON, and `--quiet` leaves none out there.
#[test]
fn every_warning_that_is_printed_is_in_the_json() {
    let temporary = folder_of_warnings();
    let folder = temporary.path();
    let hill = "generate --hill -o hill.obj";
    succeed(folder, &words(hill));
    for (index, (line, expected)) in [
        ("features lost.bvh --sets positions,mirror -o OUT.npz", "W932"),
        ("follow still.csv -o OUT.npy", "W601"),
        ("smooth a.dat --fps 0.7 -o OUT.npy", "W017"),
        ("smooth a.dat --edges loop -o OUT.npy", "W018"),
        ("eval a.dat --fps 25 --end 3 -o OUT.npy", "W015"),
        ("eval long.dat --fps 4 --max-gap 1 --in-gaps hold -o OUT.npy", "W016"),
        ("eval a.dat a.dat --fps 29.97 --exclude *_draft -o OUT", "warning: a.dat: named twice"),
        ("eval a.dat --fps 29.97 --shard 1/1 -o OUT", "warning: exactly 29.97"),
        ("convert lost.bvh -o OUT.npy --tracks LeftHand", ""),
        ("verify a.dat half.dat -m slerp --fps 5 --end 3 --device cpu", "W015"),
        ("info a.dat --exclude *_draft", "warning: --exclude"),
        ("compare short.dat long.dat", "warning: "),
        ("plot half.dat -m slerp -o OUT.svg", "W012"),
        ("render half.dat --size 32x32 --fps 1 -o OUT.gif", "W012"),
        ("view half.dat --fps 5 -o OUT.html", "W012"),
        ("route hill.obj --start-point 1,9,1 --end-point 8,0,8 -o OUT.csv", "warning: "),
        // A command that fails, and an input that does.
        ("eval a.dat --fps 29.97 -o old.npy", "warning: exactly 29.97"),
        ("verify half.dat -m slerp --start 5 --end 6 --before leave-out --after leave-out --device cpu", "W012"),
    ].into_iter().enumerate() {
        let of = |out: &str, more: &[&str]| {
            let line = line.replace("OUT", &format!("{out}{index}"));
            run(folder, &[&words(&line)[..], more].concat())
        };
        let (loud, quiet) = (of("loud", &[]), of("quiet", &["--json", "-q"]));
        assert_eq!(loud.code, quiet.code, "{line}: {}", loud.words);
        assert!(loud.words.contains(expected), "{line}: {}", loud.words);
        assert!(!quiet.words.contains("warning"), "{line}: {}", quiet.words);
        let json: serde_json::Value = serde_json::from_slice(&quiet.out)
            .unwrap_or_else(|error| panic!("{line}: {error}: {}", text(&quiet)));
        let mut messages = Vec::new();
        recorded(&json, &mut messages);
        for printed in loud.words.lines().filter(|line| line.contains("warning")) {
            let printed = printed.replace("loud", "quiet");
            let is_recorded = messages.iter().any(|message| printed.contains(&**message));
            assert!(is_recorded, "{line}: `{printed}` is not in {json:#}");
        }
    }
}

/// In a batch they are in the manifest too, also those of inputs that fail, and of shards; and they are summed up.
#[test]
fn manifests_have_every_warning_about_an_input() {
    let temporary = folder_of_warnings();
    let folder = temporary.path();
    fs::create_dir(folder.join("in")).unwrap();
    for name in ["a", "b", "c"] {
        fs::copy(
            folder.join("lost.bvh"),
            folder.join(format!("in/{name}.bvh")),
        )
        .unwrap();
    }
    let features = "features in --sets positions,mirror -o out";
    let made = succeed(folder, &words(features));
    assert_eq!(made.words.matches("[W932]").count(), 1, "{}", made.words);
    assert!(made.words.contains("W932 3 files: "), "{}", made.words);
    let manifest = fs::read_to_string(folder.join("out/manifest.jsonl")).unwrap();
    let warning = r#""warnings":[{"code":"W932","message":"mirrored in place: 1 joint with the name of a side and no partner on the other (the first: LeftHand)"}]"#;
    assert_eq!(manifest.matches(warning).count(), 3, "{manifest}");
    let quiet = succeed(folder, &words(&format!("{features} --overwrite --json -q")));
    let json: serde_json::Value = serde_json::from_slice(&quiet.out).unwrap();
    assert_eq!(json[2]["warnings"][0]["code"], "W932", "{json:#}");

    // One that fails after its warning.
    fs::create_dir(folder.join("some")).unwrap();
    fs::copy(folder.join("half.dat"), folder.join("some/a.dat")).unwrap();
    fs::copy(folder.join("a.dat"), folder.join("some/b.dat")).unwrap();
    let leaves_out = "eval some --start 1.5 --end 2 --after leave-out -q -o";
    let failed = run(folder, &words(&format!("{leaves_out} one")));
    assert_eq!(failed.code, 3, "{}", failed.words);
    let manifest = fs::read_to_string(folder.join("one/manifest.jsonl")).unwrap();
    let line = manifest
        .lines()
        .find(|line| line.contains(r#""state":"failed""#))
        .unwrap();
    assert!(line.contains(r#""warnings":[{"code":"W012""#), "{line}");
    let part = run(folder, &words(&format!("{leaves_out} two --shard 1/1")));
    assert_eq!(part.code, 3, "{}", part.words);
    assert_eq!(run(folder, &words("merge two -q")).code, 3);
    assert_eq!(tree(&folder.join("two")), tree(&folder.join("one")));
}

/// The lines of a source that print a warning which nothing records.
fn unrecorded_warnings<'a>(file: &str, source: &'a str) -> Vec<&'a str> {
    // The pipeline and its summary record warnings themselves; `load` prints errors of parts.
    let records = [
        "batch/pipeline.rs",
        "batch/summary.rs",
        "arguments/input.rs",
    ];
    let prints = |line: &&str| {
        let prints_kept = line.contains("print_kept(") && !records.contains(&file);
        let prints_note = [
            "words::note(&warning",
            "words::note(&fault",
            "words::line(&warning",
        ];
        let beside = line.contains("stderr()") || line.contains("eprint");
        prints_kept
            || prints_note.iter().any(|print| line.contains(print))
            || line.contains("words::note(&format!(\"{fault}")
            || line.contains("words::note(&format!(\"{warning}")
            || beside
    };
    match file.starts_with("messages/") {
        true => Vec::new(),
        false => source.lines().filter(prints).collect(),
    }
}

/// Warnings go through the function that also keeps them for JSON and manifests.
#[test]
fn no_source_prints_a_warning_that_is_not_recorded() {
    let sources = crate::program::root().join("cli/src");
    let mut pending = vec![sources.clone()];
    let mut found = Vec::new();
    let mut count = 0;
    while let Some(folder) = pending.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                pending.push(path);
            } else if path.extension().is_some_and(|ending| ending == "rs") {
                count += 1;
                let file = path.strip_prefix(&sources).unwrap().to_str().unwrap();
                let file = file.replace('\\', "/");
                let source = fs::read_to_string(&path).unwrap();
                let lines = unrecorded_warnings(&file, &source).into_iter();
                found.extend(lines.map(|line| format!("{file}: {}", line.trim())));
            }
        }
    }
    assert!(count > 100, "{count} files");
    assert!(found.is_empty(), "{}", found.join("\n"));
    for wrong in [
        "words::note(&warning.to_string());",
        "words::print_kept(&loaded.warnings);",
        "eprintln!(\"{warning}\");",
    ] {
        assert_eq!(unrecorded_warnings("commands/x.rs", wrong), [wrong]);
    }
}
