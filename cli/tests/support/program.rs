//! The program, and a folder of files to run it on.
#![allow(dead_code)] // each test file uses some of it

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use glam::{Quat, Vec3};

/// The root of the repository.
pub(crate) fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Five keys of two tracks, as [`sample_folder`] writes them to `a.dat`.
pub(crate) fn pendulum() -> (Vec<f64>, Vec<Quat>) {
    let times = [0.0, 0.5, 1.0, 1.5, 2.0].to_vec();
    let angles = [0.0, 0.9, 0.25, -0.5, 0.125];
    let about = |axis: Vec3| angles.map(|angle| Quat::from_axis_angle(axis, angle));
    (times, [about(Vec3::Z), about(Vec3::X)].concat())
}

/// A folder with the valid files `a.dat`, `b.dat` and `folder/a.dat`, the invalid file `bad.dat`,
/// and `old.npy`, which a command may change only if it is told to.
pub(crate) fn sample_folder() -> tempfile::TempDir {
    let (times, keys) = pendulum();
    let mut text = String::from("# 2 3\n");
    for (i, time) in times.iter().enumerate() {
        let _ = write!(text, "{time}");
        for track in 0..2 {
            let q = keys[track * times.len() + i];
            let _ = write!(text, "  {} {} {} {}", q.w, q.x, q.y, q.z);
        }
        text.push('\n');
    }
    let temporary = tempfile::tempdir().expect("a temporary folder");
    let write = |name: &str, text: &str| std::fs::write(temporary.path().join(name), text).unwrap();
    for folder in ["folder", "empty"] {
        std::fs::create_dir(temporary.path().join(folder)).unwrap();
    }
    for name in ["a.dat", "b.dat", "folder/a.dat"] {
        write(name, &text);
    }
    write("bad.dat", "# 2 3\n0 1 0 0\n");
    write("old.npy", "old");
    write("antipodal.dat", "# 1 1\n0 1 0 0 0\n1 -1 0 0 0\n");
    write("t.txt", "0\n1\n");
    temporary
}

/// Hides every Vulkan driver from a program, as old and as new loaders know it.
pub(crate) fn no_vulkan(command: &mut Command) -> &mut Command {
    command
        .env("VK_DRIVER_FILES", "/nonexistent")
        .env("VK_ICD_FILENAMES", "/nonexistent")
}

/// A run of the program in `folder`.
pub(crate) struct Run {
    pub(crate) code: i32,
    pub(crate) out: Vec<u8>,
    pub(crate) words: String,
}

pub(crate) fn command(folder: &Path, line: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_tumble"));
    command.current_dir(folder).args(line).stdin(Stdio::null());
    command
}

/// A program that is ended by every signal: the tests may have been started with some signals ignored, as a
/// shell starts programs in the background.
#[cfg(unix)]
pub(crate) fn with_signals(program: &str) -> Command {
    if cfg!(target_os = "linux") {
        let mut command = Command::new("env");
        command.args(["--default-signal=INT,QUIT,HUP,TERM", program]);
        return command;
    }
    Command::new(program)
}

pub(crate) fn finish(output: Output) -> Run {
    Run {
        code: output.status.code().unwrap_or(-1),
        out: output.stdout,
        words: String::from_utf8(output.stderr).unwrap(),
    }
}

pub(crate) fn run(folder: &Path, line: &[&str]) -> Run {
    finish(command(folder, line).output().unwrap())
}

pub(crate) fn succeed(folder: &Path, line: &[&str]) -> Run {
    let run = run(folder, line);
    assert_eq!(run.code, 0, "{line:?}: {}", run.words);
    run
}

/// Whether a program writes a file into a folder: one that it has open there and that has no name yet, or
/// a temporary one.
pub(crate) fn is_writing(child: &std::process::Child, folder: &Path) -> bool {
    let open = format!("/proc/{}/fd", child.id());
    let open = std::fs::read_dir(open).into_iter().flatten().flatten();
    let folder = folder.canonicalize().expect("a folder");
    let mut files = open.filter_map(|file| std::fs::read_link(file.path()).ok());
    files.any(|file| file.starts_with(&folder) && file != folder)
        || std::fs::read_dir(&folder).is_ok_and(|mut files| files.next().is_some())
}
