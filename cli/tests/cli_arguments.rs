//! The program's edges: every row of the table of arguments, missing devices, closed
//! pipes, full disks, signals.

use std::fs;
use std::process::{Command, Stdio};

use crate::program::{command, finish, no_vulkan, run, sample_folder};
use crate::support::vulkan_devices;

/// Exit code, command line, a part of the message.
const ARGUMENTS: &str = "
2 | eval                                         | required
2 | evl a.dat                                    | eval
2 | eval a.dat -o o.npy --fps 0                  | `0` is no frame rate
2 | eval a.dat -o o.npy --fps -1                 | `-1` is no frame rate
2 | eval a.dat -o o.npy --fps nan                | `nan` is no frame rate
2 | eval a.dat -o o.npy --fps inf                | `inf` is no frame rate
2 | eval a.dat -o o.npy --fps 30fps              | `30fps` is no frame rate
2 | eval a.dat -o o.npy --fps 1/0                | `1/0` is no frame rate
2 | eval a.dat -o o.npy --fps 1e13               | at most 1099511627776 frames
2 | eval a.dat -o o.npy --fps 5e11               | 2 tracks × 1000000000001 frames are 32.0 TB
0 | eval a.dat -o o.npy --fps 1e-9               | 1 frame,
0 | eval a.dat -o o.npy --fps 29.97              | 30000/1001
0 | eval a.dat -o o.npy --fps 23.976             | 24000/1001
0 | eval a.dat -o o.npy --fps 59.94              | 60000/1001
0 | eval a.dat -o o.npy --fps 30000/1001         | 2 tracks × 60 frames
2 | eval a.dat -o o.npy --start 2 --end 1        | before it starts at 2 s
2 | eval a.dat -o o.npy --start 5                | before it starts
2 | eval a.dat -o o.npy --start nan              | `nan` is no time
0 | eval a.dat -o o.npy --start -1 --end 1       | keys lie from 0 to 2 s
4 | eval a.dat -o o.npy --times none.txt         | none.txt
2 | eval a.dat -o o.npy --times t.txt --fps 9    | cannot be used with
2 | eval a.dat -o o.npy -m slerb                 | a similar value exists: 'slerp'
2 | eval a.dat -o o.npy -m slerb                 | bessel-overhauser
2 | eval a.dat -o o.npy --layot track            | --layout
2 | eval a.dat -o o.npy --ends lop               | loop
4 | eval a.dat -o o.npy --ends loop              | repeat the first
2 | eval a.dat -o o.npy --memory 5parsecs        | 256MiB
2 | eval a.dat -o o.txt                          | .npy, .parquet
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
4 | eval antipodal.dat -o o.npy --path as-authored | as-authored
4 | eval /dev/null -o o.npy                      | is a device
4 | eval a.dat/b -o o.npy                        | Not a directory
4 | eval --files-from none.txt -o out            | the list cannot be read
2 | eval --files-from old.npy a.dat -o -         | need a directory
2 | eval - --files-from - -o out                 | standard input cannot be both
2 | eval a.dat -o o.npy --resume                 | for a directory of results
4 | check none.jsonl                             | none.jsonl
4 | check a.dat                                  | is no manifest
2 | eval a.dat -o o.npy --device vulcan          | vulkan
7 | eval a.dat -o /proc/o.npy                    | /proc/o.npy
7 | eval a.dat -o /proc/self/o.npy --overwrite   | cannot be written
4 | eval a.dat -o o.npy --max-size 20B           | --max-size
2 | eval a.dat b.dat -o -                        | -o DIRECTORY
2 | eval a.dat b.dat -o o.npy                    | need a directory
2 | eval a.dat b.dat -o old.npy                  | need a directory
2 | eval a.dat folder/a.dat -o out               | would both write
0 | eval a.dat a.dat -o o.npy                    | given twice
0 | eval a.dat b.dat -o out                      | b.npy
3 | eval a.dat none.dat -o out                   | 1 of 2 inputs failed
4 | eval bad.dat none.dat -o out                 | all 2 inputs failed
2 | eval - --times - -o o.npy                    | standard input cannot be both
2 | verify a.dat --fps 5e11                      | of memory that are free
2 | verify a.dat -m none                         | catmull-rom
4 | verify none.dat                              | none.dat
3 | info a.dat none.dat                          | none.dat
2 | generate -o old.npy                          | --overwrite
2 | generate -o g.dat --boxes 0                  | 1..=65536
2 | generate -o g.dat --seconds nan              | positive
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
        let place = sample_folder();
        let run = run(place.path(), &line);
        if run.code != code || !run.words.contains(fragment) {
            wrong.push(format!(
                "{line:?}: {code}, `{fragment}`; but {}: {}",
                run.code, run.words
            ));
        }
        let old = fs::read(place.path().join("old.npy")).unwrap();
        if old != b"old" && !line.contains(&"--overwrite") {
            wrong.push(format!("{line:?} changed old.npy"));
        }
        if code != 0 && place.path().join("o.npy").exists() {
            wrong.push(format!("{line:?} left an output"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn a_link_to_the_input_is_not_overwritten() {
    let place = sample_folder();
    let input = fs::read(place.path().join("a.dat")).unwrap();
    #[cfg(unix)]
    std::os::unix::fs::symlink("a.dat", place.path().join("link.npy")).unwrap();
    #[cfg(unix)]
    assert_eq!(
        run(
            place.path(),
            &["eval", "a.dat", "-o", "link.npy", "--overwrite"]
        )
        .code,
        2
    );
    fs::hard_link(place.path().join("a.dat"), place.path().join("hard.npy")).unwrap();
    run(
        place.path(),
        &["eval", "a.dat", "-o", "hard.npy", "--overwrite"],
    );
    assert_eq!(fs::read(place.path().join("a.dat")).unwrap(), input);
    fs::copy(
        place.path().join("a.dat"),
        place.path().join("folder/c.npy"),
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
    assert_eq!(run(place.path(), &line).code, 2);
    assert_eq!(fs::read(place.path().join("folder/c.npy")).unwrap(), input);
}

#[test]
fn without_vulkan_the_cpu_stands_in_unless_vulkan_was_demanded() {
    let place = sample_folder();
    let without = |line: &[&str]| {
        finish(
            no_vulkan(&mut command(place.path(), line))
                .output()
                .unwrap(),
        )
    };
    let started = std::time::Instant::now();
    for device in ["vulkan", "0", "llvmpipe"] {
        let run = without(&["eval", "a.dat", "-o", "out.npy", "--device", device]);
        assert_eq!(run.code, 5, "{device}: {}", run.words);
        assert!(run.words.contains("no Vulkan device"), "{}", run.words);
        assert!(!place.path().join("out.npy").exists());
    }
    assert!(started.elapsed().as_secs() < 10);
    let run = without(&["eval", "a.dat", "-o", "out.npy"]);
    assert_eq!(run.code, 0, "{}", run.words);
    assert!(run.words.contains("on CPU (no Vulkan: "), "{}", run.words);
    let run = without(&["verify", "a.dat"]);
    assert_eq!(run.code, 0, "{}", run.words);
    assert!(String::from_utf8_lossy(&run.out).contains("NOTHING was compared"));
    let run = without(&["devices"]);
    assert_eq!(run.code, 0);
    assert!(String::from_utf8_lossy(&run.out).contains("mesa-vulkan-drivers"));
}

#[test]
fn an_unknown_device_is_answered_with_those_there_are() {
    let Some(device) = vulkan_devices().into_iter().next() else {
        return;
    };
    let place = sample_folder();
    for name in ["llvmpip3", "99"] {
        let run = run(
            place.path(),
            &["eval", "a.dat", "-o", "out.npy", "--device", name],
        );
        assert_eq!(run.code, 2, "{}", run.words);
        assert!(run.words.contains(device.name()), "{}", run.words);
    }
    let run = run(
        place.path(),
        &["eval", "a.dat", "-o", "out.npy", "--device", "vulcan"],
    );
    assert!(
        run.words.contains("did you mean `vulkan`?"),
        "{}",
        run.words
    );
}

#[cfg(unix)]
#[test]
fn a_closed_pipe_ends_quietly_and_a_full_disk_does_not() {
    let place = sample_folder();
    let big = ["eval", "a.dat", "--fps", "100000", "-o", "-"];
    for (line, code) in [
        (&big[..], 141),
        (&["methods"], 0),
        (&["completions", "bash"], 0),
    ] {
        let mut child = command(place.path(), line)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        drop(child.stdout.take());
        let run = finish(child.wait_with_output().unwrap());
        assert_eq!((run.code, run.words.as_str()), (code, ""), "{line:?}");
    }
    if cfg!(target_os = "linux") {
        for line in [&big[..], &["methods"]] {
            let full = fs::File::options().write(true).open("/dev/full").unwrap();
            let run = finish(command(place.path(), line).stdout(full).output().unwrap());
            assert_eq!(run.code, 7, "{line:?}: {}", run.words);
            assert!(run.words.contains("cannot be written"), "{}", run.words);
        }
    }
}

/// Renaming a result over a pipe or a device would replace it.
#[cfg(unix)]
#[test]
fn an_output_that_is_no_file_is_refused() {
    let place = sample_folder();
    let pipe = place.path().join("pipe.npy");
    assert!(
        Command::new("mkfifo")
            .arg(&pipe)
            .status()
            .unwrap()
            .success()
    );
    let run = run(
        place.path(),
        &["eval", "a.dat", "-o", "pipe.npy", "--overwrite"],
    );
    assert_eq!(run.code, 2, "{}", run.words);
    assert!(!pipe.metadata().unwrap().is_file());
}

#[cfg(unix)]
#[test]
fn signals_stop_the_program_and_leave_no_file() {
    for (signal, code) in [("INT", 130), ("TERM", 143)] {
        let place = sample_folder();
        fs::create_dir(place.path().join("out")).unwrap();
        // Some seconds of text.
        let line = ["eval", "a.dat", "--fps", "1000000", "-o", "out/o.csv"];
        let mut child = command(place.path(), &line).spawn().unwrap();
        let out = place.path().join("out");
        while fs::read_dir(&out).unwrap().count() == 0 {
            assert!(
                child.try_wait().unwrap().is_none(),
                "it ended before it could be stopped"
            );
            std::thread::sleep(std::time::Duration::from_millis(5));
        }
        let sent = Command::new("kill")
            .args([&format!("-{signal}"), &child.id().to_string()])
            .status();
        assert!(sent.unwrap().success());
        let started = std::time::Instant::now();
        assert_eq!(child.wait().unwrap().code(), Some(code));
        assert!(started.elapsed().as_secs() < 3, "{:?}", started.elapsed());
        assert_eq!(
            fs::read_dir(&out).unwrap().count(),
            0,
            "something was left behind"
        );
    }
}

/// A disk that is full, as a limit on the size of files shows it: the temporary file goes,
/// the old output stays.
#[cfg(target_os = "linux")]
#[test]
fn a_file_that_cannot_grow_leaves_the_old_one_intact() {
    let place = sample_folder();
    let program = env!("CARGO_BIN_EXE_tumble");
    let line = format!(
        "ulimit -f 100; exec '{program}' eval a.dat --fps 100000 -o old.npy --overwrite --device cpu"
    );
    let mut shell = Command::new("sh");
    shell.current_dir(place.path()).args(["-c", &line]);
    let before = names(place.path());
    let run = finish(shell.output().unwrap());
    assert_eq!(run.code, 7, "{}", run.words);
    assert!(
        run.words
            .contains("old.npy: cannot be written: File too large"),
        "{}",
        run.words
    );
    assert_eq!(fs::read(place.path().join("old.npy")).unwrap(), b"old");
    assert_eq!(names(place.path()), before);
}

#[cfg(unix)]
fn names(folder: &std::path::Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<String> = entries
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

/// Where nobody may write, nothing is worked out first.
#[cfg(unix)]
#[test]
fn a_read_only_directory_is_refused_before_any_work() {
    use std::os::unix::fs::PermissionsExt;

    let place = sample_folder();
    let folder = place.path().join("folder");
    fs::set_permissions(&folder, fs::Permissions::from_mode(0o555)).unwrap();
    // Whoever may do everything has to be told otherwise.
    let is_root = fs::write(folder.join("try"), "").is_ok();
    let line = ["eval", "a.dat", "-o", "folder/o.npy", "--device", "cpu"];
    let mut command = command(place.path(), &line);
    if is_root {
        std::os::unix::fs::chown(place.path(), Some(65_534), None).unwrap();
        fs::set_permissions(place.path(), fs::Permissions::from_mode(0o755)).unwrap();
        std::os::unix::process::CommandExt::uid(&mut command, 65_534);
    }
    let run = finish(command.output().unwrap());
    assert_eq!(run.code, 7, "{}", run.words);
    assert!(
        run.words
            .contains("folder/o.npy: cannot be written: Permission denied"),
        "{}",
        run.words
    );
    let _ = fs::remove_file(folder.join("try"));
}

/// Named pipes are read when that is asked for, standard input always; a file that grows
/// while it is read is refused.
#[cfg(target_os = "linux")]
#[test]
fn pipes_standard_input_and_files_that_change() {
    use std::io::Write;

    let place = sample_folder();
    let text = fs::read(place.path().join("a.dat")).unwrap();
    let pipe = place.path().join("pipe.dat");
    assert!(
        Command::new("mkfifo")
            .arg(&pipe)
            .status()
            .unwrap()
            .success()
    );
    let refused = run(place.path(), &["eval", "pipe.dat", "-o", "o.npy"]);
    assert_eq!(refused.code, 4);
    assert!(
        refused.words.contains("is a named pipe"),
        "{}",
        refused.words
    );
    assert!(refused.words.contains("--pipes"), "{}", refused.words);
    let line = [
        "eval", "pipe.dat", "--pipes", "-o", "o.npy", "--device", "cpu",
    ];
    let child = command(place.path(), &line)
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    fs::write(&pipe, &text).unwrap();
    let read = finish(child.wait_with_output().unwrap());
    assert_eq!(read.code, 0, "{}", read.words);
    let expected = fs::read(place.path().join("o.npy")).unwrap();

    let mut child = command(place.path(), &["eval", "-", "-o", "-", "--device", "cpu"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    child.stdin.take().unwrap().write_all(&text).unwrap();
    let run = finish(child.wait_with_output().unwrap());
    assert_eq!((run.code, run.out == expected), (0, true), "{}", run.words);

    // Large enough that it is still being read when it grows.
    let grown = place.path().join("grown.dat");
    let mut file = fs::File::create(&grown).unwrap();
    file.write_all(b"# 1 1\n").unwrap();
    let rows: String = (0..400_000).map(|i| format!("{i} 1 0 0 0\n")).collect();
    file.write_all(rows.as_bytes()).unwrap();
    let child = command(place.path(), &["info", "grown.dat"])
        .stderr(Stdio::piped())
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    for i in 0..100 {
        writeln!(file, "{} 1 0 0 0", 400_000 + i).unwrap();
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    let run = finish(child.wait_with_output().unwrap());
    assert_eq!(run.code, 4, "{}", run.words);
    assert!(run.words.contains("error[E003]"), "{}", run.words);
}

/// Inputs that no file in a clone can stand for.
#[cfg(unix)]
#[test]
fn what_is_no_readable_file_is_refused_with_the_systems_reason() {
    use std::os::unix::fs::{PermissionsExt, symlink};

    let place = sample_folder();
    let at = place.path();
    symlink(at.join("loop2.dat"), at.join("loop1.dat")).unwrap();
    symlink(at.join("loop1.dat"), at.join("loop2.dat")).unwrap();
    let _listener = std::os::unix::net::UnixListener::bind(at.join("socket.dat")).unwrap();
    // More than 64 MiB of one line.
    let mut long = b"# 1 1\n0 1 0 0 0".to_vec();
    long.resize(65 << 20, b' ');
    fs::write(at.join("long.dat"), long).unwrap();
    fs::copy(at.join("a.dat"), at.join("secret.dat")).unwrap();
    fs::set_permissions(at.join("secret.dat"), fs::Permissions::from_mode(0o000)).unwrap();
    let is_root = fs::read(at.join("secret.dat")).is_ok();
    fs::set_permissions(at, fs::Permissions::from_mode(0o777)).unwrap();
    for (name, code, words) in [
        ("loop1.dat", "E001", "symbolic links"),
        ("socket.dat", "E002", "is a socket"),
        ("long.dat", "E007", "longer than 67108864 bytes"),
        ("secret.dat", "E001", "Permission denied"),
    ] {
        let mut command = command(at, &["eval", name, "-o", "o.npy", "--device", "cpu"]);
        if is_root {
            std::os::unix::process::CommandExt::uid(&mut command, 65_534);
        }
        let run = finish(command.output().unwrap());
        assert_eq!(run.code, 4, "{}", run.words);
        assert!(run.words.contains(words), "{}", run.words);
        assert!(
            run.words.contains(&format!("error[{code}]")),
            "{}",
            run.words
        );
        assert!(!at.join("o.npy").exists());
    }
}
