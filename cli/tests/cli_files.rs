//! Pipes, signals, full disks and files that cannot be read or written.

use std::fs;
use std::process::{Command, Stdio};

use crate::program::{command, finish, is_writing, run, sample_folder, succeed, with_signals};

#[cfg(unix)]
#[test]
fn a_closed_pipe_ends_quietly_and_a_full_disk_does_not() {
    let folder = sample_folder();
    let big = ["eval", "a.dat", "--fps", "100000", "-o", "-"];
    for (line, code) in [
        (&big[..], 141),
        (&["methods"], 0),
        (&["completions", "bash"], 0),
    ] {
        let mut child = command(folder.path(), line)
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
            let run = finish(command(folder.path(), line).stdout(full).output().unwrap());
            assert_eq!(run.code, 7, "{line:?}: {}", run.words);
            assert!(run.words.contains("cannot be written"), "{}", run.words);
        }
    }
}

/// Renaming a result over a pipe or a device would replace it.
#[cfg(unix)]
#[test]
fn an_output_that_is_no_file_is_refused() {
    let folder = sample_folder();
    let pipe = folder.path().join("pipe.npy");
    assert!(
        Command::new("mkfifo")
            .arg(&pipe)
            .status()
            .unwrap()
            .success()
    );
    let run = run(
        folder.path(),
        &["eval", "a.dat", "-o", "pipe.npy", "--overwrite"],
    );
    assert_eq!(run.code, 2, "{}", run.words);
    assert!(!pipe.metadata().unwrap().is_file());
}

#[cfg(unix)]
#[test]
fn signals_stop_the_program_and_leave_no_file() {
    for (signal, code) in [("INT", 130), ("TERM", 143)] {
        let folder = sample_folder();
        fs::create_dir(folder.path().join("out")).unwrap();
        // Writing this text takes some seconds.
        let line = ["eval", "a.dat", "--fps", "1000000", "-o", "out/o.csv"];
        let mut child = with_signals(env!("CARGO_BIN_EXE_tumble"))
            .current_dir(folder.path())
            .args(line)
            .stdin(Stdio::null())
            .spawn()
            .unwrap();
        let out = folder.path().join("out");
        while !is_writing(&child, &out) {
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
    let folder = sample_folder();
    let program = env!("CARGO_BIN_EXE_tumble");
    let line = format!(
        "ulimit -f 100; exec '{program}' eval a.dat --fps 100000 -o old.npy --overwrite --device cpu"
    );
    let mut shell = Command::new("sh");
    shell.current_dir(folder.path()).args(["-c", &line]);
    let before = names(folder.path());
    let run = finish(shell.output().unwrap());
    assert_eq!(run.code, 7, "{}", run.words);
    assert!(
        run.words
            .contains("old.npy: cannot be written: File too large"),
        "{}",
        run.words
    );
    assert_eq!(fs::read(folder.path().join("old.npy")).unwrap(), b"old");
    assert_eq!(names(folder.path()), before);
}

/// The shell limits the stack to less than the program's calls need.
#[cfg(target_os = "linux")]
#[test]
fn a_small_stack_is_enough() {
    let folder = sample_folder();
    let program = env!("CARGO_BIN_EXE_tumble");
    let line = format!("ulimit -s 64; exec '{program}' eval a.dat -o small.npy --device cpu");
    let mut shell = Command::new("sh");
    shell.current_dir(folder.path()).args(["-c", &line]);
    let run = finish(shell.output().unwrap());
    assert_eq!(run.code, 0, "{}", run.words);
    assert!(folder.path().join("small.npy").exists());
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

/// A folder that may not be written is refused before anything is evaluated.
#[cfg(unix)]
#[test]
fn a_read_only_directory_is_refused_before_any_work() {
    use std::os::unix::fs::PermissionsExt;

    let temporary = sample_folder();
    let folder = temporary.path().join("folder");
    fs::set_permissions(&folder, fs::Permissions::from_mode(0o555)).unwrap();
    // Root may write everywhere: the program runs as another user.
    let is_root = fs::write(folder.join("try"), "").is_ok();
    let line = ["eval", "a.dat", "-o", "folder/o.npy", "--device", "cpu"];
    let mut command = command(temporary.path(), &line);
    if is_root {
        std::os::unix::fs::chown(temporary.path(), Some(65_534), None).unwrap();
        fs::set_permissions(temporary.path(), fs::Permissions::from_mode(0o755)).unwrap();
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

    let folder = sample_folder();
    let text = fs::read(folder.path().join("a.dat")).unwrap();
    let pipe = folder.path().join("pipe.dat");
    assert!(
        Command::new("mkfifo")
            .arg(&pipe)
            .status()
            .unwrap()
            .success()
    );
    let refused = run(folder.path(), &["eval", "pipe.dat", "-o", "o.npy"]);
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
    let child = command(folder.path(), &line)
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    fs::write(&pipe, &text).unwrap();
    let read = finish(child.wait_with_output().unwrap());
    assert_eq!(read.code, 0, "{}", read.words);
    let expected = fs::read(folder.path().join("o.npy")).unwrap();

    let mut child = command(folder.path(), &["eval", "-", "-o", "-", "--device", "cpu"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    child.stdin.take().unwrap().write_all(&text).unwrap();
    let run = finish(child.wait_with_output().unwrap());
    assert_eq!((run.code, run.out == expected), (0, true), "{}", run.words);

    // Large enough that it is still being read when it grows.
    let grown = folder.path().join("grown.dat");
    let mut file = fs::File::create(&grown).unwrap();
    file.write_all(b"# 1 1\n").unwrap();
    let rows: String = (0..400_000).map(|i| format!("{i} 1 0 0 0\n")).collect();
    file.write_all(rows.as_bytes()).unwrap();
    let child = command(folder.path(), &["info", "grown.dat"])
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

/// Inputs that cannot be files of the repository, such as very long ones.
#[cfg(unix)]
#[test]
fn what_is_no_readable_file_is_refused_with_the_systems_reason() {
    use std::os::unix::fs::{PermissionsExt, symlink};

    let temporary = sample_folder();
    let folder = temporary.path();
    symlink(folder.join("loop2.dat"), folder.join("loop1.dat")).unwrap();
    symlink(folder.join("loop1.dat"), folder.join("loop2.dat")).unwrap();
    let _listener = std::os::unix::net::UnixListener::bind(folder.join("socket.dat")).unwrap();
    // More than 64 MiB of one line.
    let mut long = b"# 1 1\n0 1 0 0 0".to_vec();
    long.resize(65 << 20, b' ');
    fs::write(folder.join("long.dat"), long).unwrap();
    fs::copy(folder.join("a.dat"), folder.join("secret.dat")).unwrap();
    fs::set_permissions(folder.join("secret.dat"), fs::Permissions::from_mode(0o000)).unwrap();
    let is_root = fs::read(folder.join("secret.dat")).is_ok();
    fs::set_permissions(folder, fs::Permissions::from_mode(0o777)).unwrap();
    for (name, code, words) in [
        ("loop1.dat", "E001", "symbolic links"),
        ("socket.dat", "E002", "is a socket"),
        ("long.dat", "E007", "longer than 67108864 bytes"),
        ("secret.dat", "E001", "Permission denied"),
    ] {
        let mut command = command(folder, &["eval", name, "-o", "o.npy", "--device", "cpu"]);
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
        assert!(!folder.join("o.npy").exists());
    }
}

/// Before a result is written, the program asks for the least room that its format may need. A motion that stands still
/// is compressed best, and its file takes no less than that.
#[test]
fn no_result_is_smaller_than_what_is_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(
        folder.path().join("still.dat"),
        "# 2 1\n0 1 0 0 0 1 0 0 0\n5 1 0 0 0 1 0 0 0\n",
    )
    .unwrap();
    for format in tumble_formats::FORMATS {
        let Some(write) = &format.write else { continue };
        let out = format!("out.{}", format.name);
        succeed(
            folder.path(),
            &["eval", "still.dat", "--fps", "1000", "-o", &out],
        );
        let bytes = fs::metadata(folder.path().join(&out)).unwrap().len() as f64;
        let each = (write.rotation_bytes)(tumble::Encoding::default());
        assert!(
            each > 0.0 && each * 10_002.0 <= bytes,
            "{out}: {each}, {bytes}"
        );
    }
}
