//! The program's edges: every row of the table of arguments, missing devices.

use std::fs;

use crate::program::{command, finish, no_vulkan, run, sample_folder};
use crate::support::vulkan_devices;

/// Exit code, command line, a part of the message.
const ARGUMENTS: &str = "
2 | eval                                         | required
2 | evl a.dat                                    | eval
2 | eval a.dat -o o.npy --fps 0                  | `0` is not a frame rate
2 | eval a.dat -o o.npy --fps -1                 | `-1` is not a frame rate
2 | eval a.dat -o o.npy --fps nan                | `nan` is not a frame rate
2 | eval a.dat -o o.npy --fps inf                | `inf` is not a frame rate
2 | eval a.dat -o o.npy --fps 30fps              | `30fps` is not a frame rate
2 | eval a.dat -o o.npy --fps 1/0                | `1/0` is not a frame rate
2 | eval a.dat -o o.npy --fps 1e13               | at most 1099511627776 frames
7 | eval a.dat -o o.npy --fps 5e11               | 32000000000032 bytes) are needed for 2 tracks × 1000000000001 frames, and
 7 | eval a.dat -o o.csv --fps 5e11               | 16.0 TB
 7 | eval a.dat -o o.arrow --fps 5e11             | 72.0 TB
0 | eval a.dat -o o.npy --fps 1e-9               | 1 frame,
0 | eval a.dat -o o.npy --fps 29.97              | 30000/1001
0 | eval a.dat -o o.npy --fps 23.976             | 24000/1001
0 | eval a.dat -o o.npy --fps 59.94              | 60000/1001
0 | eval a.dat -o o.npy --fps 30000/1001         | 2 tracks × 60 frames
2 | eval a.dat -o o.npy --start 2 --end 1        | before it starts at 2 s
2 | eval a.dat -o o.npy --start 5                | before it starts
2 | eval a.dat -o o.npy --start nan              | invalid time `nan`
0 | eval a.dat -o o.npy --start -1 --end 1       | exceed the keys, 0 to 2 s
4 | eval a.dat -o o.npy --times none.txt         | none.txt
2 | eval a.dat -o o.npy --times t.txt --fps 9    | cannot be used with
2 | eval a.dat -o o.npy -m slerb                 | a similar value exists: 'slerp'
2 | eval a.dat -o o.npy -m slerb                 | bessel-overhauser
2 | eval a.dat -o o.npy --layot track            | --layout
2 | eval a.dat -o o.npy --ends lop               | loop
4 | eval a.dat -o o.npy --ends loop              | equals the first
2 | eval a.dat -o o.npy --memory 5parsecs        | 256MiB
2 | eval a.dat -o o.txt                          | .npy, .parquet
2 | eval a.dat -o z.glb --to npy                | its name is one of glb, and --format says npy
2 | eval a.dat --output velocity                | --quantity velocity
2 | eval a.dat -o world                         | for a directory of this name give -o ./world
2 | eval a.dat -o a.dat --format npy --overwrite | is the input
2 | eval a.dat -o old.npy                        | --overwrite
0 | eval a.dat -o old.npy --overwrite            | old.npy
0 | eval a.dat -o folder                         | folder/a.npy
7 | eval a.dat -o none/o.npy                     | none does not exist
4 | eval none.dat -o o.npy                       | none.dat: error[E001]
4 | eval empty -o o.npy                         | is a directory
0 | eval folder -o out                           | a.npy
4 | eval bad.dat -o o.npy                        | bad.dat:2:8: error[E020]
0 | eval antipodal.dat -o o.npy                  | 1 track
4 | eval antipodal.dat -o o.npy --signs as-authored | as-authored
4 | eval /dev/null -o o.npy                      | is a device
4 | eval a.dat/b -o o.npy                        | Not a directory
4 | eval --files-from none.txt -o out            | the list cannot be read
2 | eval --files-from old.npy a.dat -o -         | need a directory
2 | eval - --files-from - -o out                 | standard input cannot be both
2 | eval a.dat -o o.npy --resume                 | for a directory of results
2 | eval a.dat -o o.npy --base .                 | --base is for a directory of results
2 | eval a.dat -o o.npy --names full             | --names full is for a directory of results
2 | eval a.dat -o o.npy --shard 1/2              | shards, need a directory
4 | check none.jsonl                             | none.jsonl
4 | check a.dat                                  | is not a manifest
2 | eval a.dat -o o.npy --device vulcan          | vulkan
7 | eval a.dat -o /proc/o.npy                    | /proc/o.npy
7 | eval a.dat -o /proc/self/o.npy --overwrite   | cannot be written
4 | eval a.dat -o o.npy --max-size 20B           | --max-size
2 | eval a.dat b.dat -o -                        | -o DIRECTORY
2 | eval a.dat b.dat -o o.npy                    | need a directory
2 | eval a.dat b.dat -o old.npy                  | need a directory
4 | eval a.dat folder/a.dat -o out               | would both be
0 | eval a.dat a.dat -o o.npy                    | named twice
0 | eval a.dat b.dat -o out                      | b.npy
3 | eval a.dat none.dat -o out                   | 1 of 2 inputs failed
4 | eval bad.dat none.dat -o out                 | all 2 inputs failed
2 | eval - --times - -o o.npy                    | standard input cannot be both
4 | verify a.dat --fps 5e11                      | are needed for 2 tracks × 1000000000001 frames, and
2 | verify a.dat -m none                         | catmull-rom
4 | verify none.dat                              | none.dat
3 | info a.dat none.dat                          | none.dat
2 | generate -o old.npy                          | --overwrite
2 | generate -o g.dat --boxes 0                  | from 1 to 65536
2 | generate -o g.dat --seconds nan              | a number above 0
2 | generate -o g.dat --keys 1000000000          | 4e-6 s a key
2 | generate -o g.dat --uniform --random         | cannot be used with
2 | completions powerbash                        | bash
2 | explain E099                                 | there is no code
";

#[test]
fn each_argument_gets_its_exit_code_and_message() {
    let mut wrong = Vec::new();
    for row in ARGUMENTS.trim().lines() {
        let [code, line, fragment] = *row.split('|').map(str::trim).collect::<Vec<_>>() else {
            panic!("not a row: {row}");
        };
        let code: i32 = code.parse().unwrap();
        let line: Vec<&str> = line.split_whitespace().collect();
        let folder = sample_folder();
        let run = run(folder.path(), &line);
        if run.code != code || !run.words.contains(fragment) {
            wrong.push(format!(
                "{line:?}: {code}, `{fragment}`; but {}: {}",
                run.code, run.words
            ));
        }
        let old = fs::read(folder.path().join("old.npy")).unwrap();
        if old != b"old" && !line.contains(&"--overwrite") {
            wrong.push(format!("{line:?} changed old.npy"));
        }
        if code != 0 && folder.path().join("o.npy").exists() {
            wrong.push(format!("{line:?} left an output"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn a_link_to_the_input_is_not_overwritten() {
    let folder = sample_folder();
    let input = fs::read(folder.path().join("a.dat")).unwrap();
    #[cfg(unix)]
    std::os::unix::fs::symlink("a.dat", folder.path().join("link.npy")).unwrap();
    #[cfg(unix)]
    assert_eq!(
        run(
            folder.path(),
            &["eval", "a.dat", "-o", "link.npy", "--overwrite"]
        )
        .code,
        2
    );
    fs::hard_link(folder.path().join("a.dat"), folder.path().join("hard.npy")).unwrap();
    run(
        folder.path(),
        &["eval", "a.dat", "-o", "hard.npy", "--overwrite"],
    );
    assert_eq!(fs::read(folder.path().join("a.dat")).unwrap(), input);
    fs::copy(
        folder.path().join("a.dat"),
        folder.path().join("folder/c.npy"),
    )
    .unwrap();
    let line = [
        "eval",
        "b.dat",
        "folder/c.npy",
        "-o",
        "folder",
        "--overwrite",
    ];
    // One input fails; the result of the other is made.
    assert_eq!(run(folder.path(), &line).code, 3);
    assert!(folder.path().join("folder/b.npy").exists());
    assert_eq!(fs::read(folder.path().join("folder/c.npy")).unwrap(), input);
}

#[test]
fn without_vulkan_the_cpu_stands_in_unless_vulkan_was_demanded() {
    let folder = sample_folder();
    let without = |line: &[&str]| {
        finish(
            no_vulkan(&mut command(folder.path(), line))
                .output()
                .unwrap(),
        )
    };
    let started = std::time::Instant::now();
    for device in ["vulkan", "0", "llvmpipe"] {
        let run = without(&["eval", "a.dat", "-o", "out.npy", "--device", device]);
        assert_eq!(run.code, 5, "{device}: {}", run.words);
        assert!(run.words.contains("no Vulkan device"), "{}", run.words);
        assert!(!folder.path().join("out.npy").exists());
    }
    assert!(started.elapsed().as_secs() < 10);
    let run = without(&["eval", "a.dat", "-o", "out.npy", "--device", "first"]);
    assert_eq!(run.code, 0, "{}", run.words);
    assert!(run.words.contains("on CPU (no Vulkan: "), "{}", run.words);
    let run = without(&["eval", "a.dat", "-o", "auto.npy"]);
    assert_eq!(run.code, 0, "{}", run.words);
    assert!(run.words.contains("on CPU in "), "{}", run.words);
    // The CPU is near the reference, and no two devices were compared.
    for (line, code) in [
        (&["verify", "a.dat"][..], 5),
        (&["verify", "a.dat", "--device", "first"], 5),
        (&["verify", "a.dat", "--device", "cpu"], 0),
    ] {
        let run = without(line);
        assert_eq!(run.code, code, "{}", run.words);
        let text = String::from_utf8_lossy(&run.out);
        assert!(text.contains("NOTHING was compared") && text.contains("reference-only"));
    }
    let run = without(&["devices"]);
    assert_eq!(run.code, 0);
    assert!(String::from_utf8_lossy(&run.out).contains("mesa-vulkan-drivers"));
}

/// Times outside the keys cause a warning unless an option says how tracks behave there.
#[test]
fn chosen_motion_outside_the_keys_causes_no_warning() {
    let folder = sample_folder();
    for (range, chosen, is_warned) in [
        ("--start=-1", "", true),
        ("--start=-1", "--before=loop", false),
        ("--start=-1", "--after=loop", true),
        ("--end=9", "--after=mirror", false),
    ] {
        let mut line = vec!["eval", "a.dat", "-o", "o.npy", "--overwrite", range];
        line.extend(Some(chosen).filter(|it| !it.is_empty()));
        let run = run(folder.path(), &line);
        let warns = run.words.contains("exceed the keys, 0 to 2 s");
        assert_eq!(
            (run.code, warns),
            (0, is_warned),
            "{range} {chosen}: {}",
            run.words
        );
    }
}

#[test]
fn an_unknown_device_is_answered_with_those_there_are() {
    let Some(device) = vulkan_devices().into_iter().next() else {
        return;
    };
    let folder = sample_folder();
    for name in ["llvmpip3", "99"] {
        let run = run(
            folder.path(),
            &["eval", "a.dat", "-o", "out.npy", "--device", name],
        );
        assert_eq!(run.code, 2, "{}", run.words);
        assert!(run.words.contains(device.name()), "{}", run.words);
    }
    let run = run(
        folder.path(),
        &["eval", "a.dat", "-o", "out.npy", "--device", "vulcan"],
    );
    assert!(
        run.words.contains("did you mean `vulkan`?"),
        "{}",
        run.words
    );
}
