//! Kills, signals, full disks and folders that may not be written: all files under their names are whole, and
//! nothing is left behind.

use std::collections::BTreeMap;
use std::fs;
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::attack::{ended, entries, parts, run, succeed, times, two_animations, wait};
use crate::commands;
use crate::program::{command, is_writing, sample_folder, with_signals};
use crate::support::Random;
use crate::tree::tree;

/// Commands with the file or folder that each writes; [`writers`] adds the commands that make a result of each input.
const WRITERS: &[(&str, &str)] = &[
    ("eval a.dat --fps 20000 -o out/o.npy", "out/o.npy"),
    ("eval a.dat --fps 20000 -o out/o.csv", "out/o.csv"),
    ("eval walks --fps 4000 -o out/all", "out/all"),
    (
        "smooth a.dat --fps 4000 -o out/o.npy --plot out/o.svg",
        "out/o.npy",
    ),
    (
        "reduce a.dat --fps 4000 -o out/o.npz --plot out/o.svg",
        "out/o.npz",
    ),
    ("follow path.csv --fps 20000 -o out/o.npy", "out/o.npy"),
    ("plot a.dat -o out/o.svg", "out/o.svg"),
    ("plot a.dat -o out/pictures", "out/pictures"),
    ("render a.dat --size 64x48 -o out/o.png", "out/o.png"),
    (
        "retarget m.bvh --onto m.bvh --bones bones.json -o out/o.bvh --report out/o.json",
        "out/o.bvh",
    ),
    (
        "features m.bvh --fps 100 --sets positions,mirror -o out/o.npz",
        "out/o.npz",
    ),
    ("view a.dat -o out/o.html", "out/o.html"),
    ("generate --boxes 400 --keys 200 -o out/o.dat", "out/o.dat"),
    (
        "generate --hill -o out/hill.obj --rocks out/rocks.obj",
        "out/hill.obj",
    ),
    (
        "route hill.obj --start-point 1,0,1 --end-point 8,0,8 -o out/o.csv --plot out/o.svg",
        "out/o.csv",
    ),
];

/// Every command line that writes, with the file or folder that it writes: those of [`WRITERS`], and two for each
/// other command that makes a result of each input, one with a file and one with a folder.
fn writers() -> Vec<(String, String)> {
    // They need a Vulkan device and take minutes.
    const NOT_HERE: [&str; 2] = ["prove", "lab"];
    let lines = WRITERS.iter().copied();
    let mut all: Vec<(String, String)> = lines
        .map(|(line, made)| (line.to_owned(), made.to_owned()))
        .collect();
    let making_results = commands::writing_results();
    for command in commands::commands() {
        let name = command.get_name();
        let is_listed = WRITERS
            .iter()
            .any(|(line, _)| line.split(' ').next() == Some(name));
        if is_listed || NOT_HERE.contains(&name) || !commands::has(&command, "out") {
            continue;
        }
        let is_alike = making_results.iter().any(|one| one == name);
        assert!(is_alike, "`{name}` writes: WRITERS needs a line that does");
        all.push((format!("{name} a.dat -o out/o.npz"), "out/o.npz".to_owned()));
        all.push((
            format!("{name} walks --to npz -o out/all"),
            "out/all".to_owned(),
        ));
    }
    all
}

fn folder() -> tempfile::TempDir {
    let temporary = sample_folder();
    let folder = temporary.path();
    fs::create_dir_all(folder.join("walks/deep")).unwrap();
    for name in ["walks/deep/a.dat", "walks/deep/b.dat"] {
        fs::copy(folder.join("a.dat"), folder.join(name)).unwrap();
    }
    fs::write(
        folder.join("path.csv"),
        "t,x,y,z\n0,0,0,0\n1,1,0,0\n2,1,1,0\n3,0,1,1\n",
    )
    .unwrap();
    fs::write(folder.join("m.gltf"), two_animations()).unwrap();
    let joint = "{ OFFSET 0 1 0 CHANNELS 3 Zrotation Xrotation Yrotation";
    let mut bvh =
        format!("HIERARCHY ROOT a {joint} JOINT b {joint} End Site {{ OFFSET 0 1 0 }} }} }}\n");
    bvh += &format!(
        "MOTION\nFrames: 2000\nFrame Time: 0.01\n{}",
        "1 2 3 4 5 6\n".repeat(2000)
    );
    fs::write(folder.join("m.bvh"), bvh).unwrap();
    fs::write(folder.join("bones.json"), r#"{"a": "a", "b": "b"}"#).unwrap();
    succeed(folder, &["generate", "--hill", "-o", "hill.obj"]);
    fs::create_dir(folder.join("out")).unwrap();
    temporary
}

fn words(line: &str) -> Vec<&str> {
    line.split(' ').collect()
}

fn quiet(folder: &Path, line: &[&str]) -> Command {
    let mut command = command(folder, line);
    command.stdout(Stdio::null()).stderr(Stdio::null());
    command
}

/// Kills at random moments, in every command that writes: each file is whole or absent, the same
/// command does its work afterwards, and nothing half-written stays.
#[test]
fn kills_leave_whole_files_and_nothing_else() {
    let temporary = folder();
    let folder = temporary.path();
    let mut random = Random(28);
    let (mut kills, mut left) = (0, 0);
    for (line, _) in &writers() {
        let line = words(line);
        let started = Instant::now();
        succeed(folder, &line);
        let longest = started.elapsed().as_micros() as u64;
        let whole = tree(&folder.join("out"));
        for _ in 0..2 * times() {
            fs::remove_dir_all(folder.join("out")).unwrap();
            fs::create_dir(folder.join("out")).unwrap();
            let mut child = quiet(folder, &line).spawn().unwrap();
            std::thread::sleep(Duration::from_micros(random.next() % longest.max(1)));
            child.kill().unwrap();
            kills += u32::from(child.wait().unwrap().code().is_none());
            left += parts(&folder.join("out")).len();
            for (name, bytes) in tree(&folder.join("out")) {
                let is_part = name.ends_with(".part") || name.ends_with("manifest.jsonl");
                assert!(
                    is_part || whole[&name] == bytes,
                    "{line:?}: {name} is not whole"
                );
            }
            let has_manifest = whole.keys().any(|name| name.ends_with("manifest.jsonl"));
            let again = if has_manifest {
                "--resume"
            } else {
                "--overwrite"
            };
            succeed(folder, &[&line[..], &[again]].concat());
            assert_eq!(parts(&folder.join("out")), Vec::<String>::new(), "{line:?}");
            assert_eq!(tree(&folder.join("out")), whole, "{line:?}");
        }
        fs::remove_dir_all(folder.join("out")).unwrap();
        fs::create_dir(folder.join("out")).unwrap();
    }
    assert!(
        kills > 0,
        "no kill came in time; {left} files were left half-way"
    );
}

/// Leftovers are removed too where all results lie in sub-folders, and those of inputs that no longer exist.
#[test]
fn what_was_left_anywhere_below_a_folder_of_results_goes() {
    let temporary = folder();
    let folder = temporary.path();
    let line = ["eval", "walks", "-o", "out"];
    succeed(folder, &line);
    for name in ["out/.tumble-aBcDeF.part", "out/deep/.tumble-aBcDeF.part"] {
        fs::write(folder.join(name), "half").unwrap();
    }
    fs::remove_file(folder.join("walks/deep/b.dat")).unwrap();
    fs::copy(folder.join("a.dat"), folder.join("walks/c.dat")).unwrap();
    fs::remove_file(folder.join("walks/deep/a.dat")).unwrap();
    succeed(folder, &[&line[..], &["--resume"]].concat());
    assert_eq!(parts(&folder.join("out")), Vec::<String>::new());
}

/// Writing this text takes some seconds; a first part has been written.
fn writing(at: &Path, ignored: Option<&str>) -> Child {
    let line = "eval a.dat --fps 1000000 --device cpu -o out/o.csv";
    let program = env!("CARGO_BIN_EXE_tumble");
    let trap = ignored.map_or(String::new(), |signal| format!("trap '' {signal}; "));
    let mut child = with_signals("sh")
        .args(["-c", &format!("{trap}exec '{program}' {line}")])
        .current_dir(at)
        .stdin(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let started = Instant::now();
    while !is_writing(&child, &at.join("out")) {
        assert!(
            child.try_wait().unwrap().is_none(),
            "it ended before it could be stopped"
        );
        assert!(started.elapsed().as_secs() < 60, "it does not begin");
        std::thread::sleep(Duration::from_millis(2));
    }
    child
}

fn send(signal: &str, child: &Child) {
    let sent = Command::new("kill")
        .args([&format!("-{signal}"), &child.id().to_string()])
        .status();
    assert!(sent.unwrap().success());
}

#[test]
fn every_signal_that_ends_programs_leaves_no_file() {
    let temporary = folder();
    let folder = temporary.path();
    for (signal, code) in [("INT", 130), ("TERM", 143), ("HUP", 129), ("QUIT", 131)] {
        for twice in [false, true] {
            let mut child = writing(folder, None);
            send(signal, &child);
            if twice {
                send(signal, &child);
            }
            assert_eq!(
                wait(&mut child).code(),
                Some(code),
                "{signal}, twice: {twice}"
            );
            assert_eq!(
                entries(&folder.join("out")).len(),
                0,
                "{signal}, twice: {twice}"
            );
        }
    }
}

/// Signals that were ignored when the program was started stay ignored, as SIGHUP under `nohup`.
#[cfg(target_os = "linux")]
#[test]
fn ignored_signals_stay_ignored() {
    let temporary = folder();
    let folder = temporary.path();
    for signal in ["INT", "HUP", "QUIT", "TERM"] {
        let mut child = writing(folder, Some(signal));
        send(signal, &child);
        std::thread::sleep(Duration::from_millis(100));
        assert!(child.try_wait().unwrap().is_none(), "{signal} ended it");
        let other = if signal == "TERM" { "INT" } else { "TERM" };
        send(other, &child);
        assert!(!wait(&mut child).success());
        assert_eq!(entries(&folder.join("out")).len(), 0, "{signal}");
    }
}

/// A disk that is full, as a limit on the size of files shows it, in every command that writes: the
/// old files stay as they are, and nothing is left half-way.
#[test]
fn a_full_disk_leaves_what_was_there() {
    let temporary = folder();
    let folder = temporary.path();
    let program = env!("CARGO_BIN_EXE_tumble");
    for (line, made) in &writers() {
        let line = words(line);
        succeed(folder, &line);
        let before = tree(&folder.join("out"));
        let largest = before.values().map(Vec::len).max().unwrap();
        // The limit is half of the largest file, so this file cannot be written; some commands
        // finish a smaller one first.
        let blocks = (largest / 2 / 512).max(1);
        let script = format!(
            "ulimit -f {blocks}; exec '{program}' {} --overwrite 2>words",
            line.join(" ")
        );
        let mut shell = Command::new("sh");
        shell.current_dir(folder).args(["-c", &script]);
        let run = ended(&mut shell);
        let said = fs::read_to_string(folder.join("words")).unwrap();
        let whole = largest <= 512;
        assert!(
            whole || matches!(run.code, 3 | 4 | 7),
            "{line:?}: {}: {said}",
            run.code
        );
        // Manifests may differ, because they list what failed.
        let results = |mut all: BTreeMap<String, Vec<u8>>| {
            all.retain(|name, _| !name.ends_with("manifest.jsonl"));
            all
        };
        let after = tree(&folder.join("out"));
        assert_eq!(results(after), results(before), "{line:?}: {made}");
        fs::remove_dir_all(folder.join("out")).unwrap();
        fs::create_dir(folder.join("out")).unwrap();
    }
}

/// A file system that is full: only where this process may mount one.
#[cfg(target_os = "linux")]
#[test]
fn a_full_file_system_ends_a_batch_and_resuming_finishes_it() {
    let temporary = folder();
    let folder = temporary.path();
    let mount = |size: &str| {
        Command::new("mount")
            .args(["-t", "tmpfs", "-o", &format!("{size},mode=777"), "tumble"])
            .arg(folder.join("out"))
            .stderr(Stdio::null())
            .status()
            .is_ok_and(|status| status.success())
    };
    if !mount("size=64k") {
        eprintln!("no file system may be mounted here: the limit on files' sizes stands for it");
        return;
    }
    let unmounted = Unmount(folder.join("out"));
    let line = ["eval", "walks", "--fps", "1000", "-o", "out/all"];
    let full = run(folder, &line);
    // Either each input is refused before anything is written, or writing fails when the disk is
    // full.
    assert!(matches!(full.code, 4 | 7), "{}", full.words);
    assert!(
        full.words.contains("are free") || full.code == 7,
        "{}",
        full.words
    );
    assert_eq!(parts(&folder.join("out")), Vec::<String>::new());
    assert!(mount("remount,size=16m"));
    succeed(folder, &[&line[..], &["--resume"]].concat());
    succeed(folder, &["check", "out/all"]);
    drop(unmounted);
}

struct Unmount(std::path::PathBuf);

impl Drop for Unmount {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(&self.0).status();
    }
}

/// In a folder that may not be written, every command says so and changes nothing.
#[test]
fn a_read_only_folder_is_refused_by_every_command() {
    use std::os::unix::fs::PermissionsExt;

    const NOBODY: u32 = 65_534;
    let temporary = folder();
    let folder = temporary.path();
    let out = folder.join("out");
    fs::set_permissions(&out, fs::Permissions::from_mode(0o555)).unwrap();
    let is_root = fs::write(out.join("try"), "").is_ok();
    let _ = fs::remove_file(out.join("try"));
    if is_root {
        fs::set_permissions(folder, fs::Permissions::from_mode(0o755)).unwrap();
    }
    for (line, _) in &writers() {
        let mut command = command(folder, &words(line));
        if is_root {
            // Root may write everywhere: the program runs as another user.
            command.uid(NOBODY);
        }
        let run = ended(command.stdout(Stdio::piped()).stderr(Stdio::piped()));
        assert_eq!(run.code, 7, "{line}: {}", run.words);
        assert_eq!(entries(&out).len(), 0, "{line}");
    }
    fs::set_permissions(&out, fs::Permissions::from_mode(0o755)).unwrap();
}
