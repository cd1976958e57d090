//! Attacks by input, and by files, disks and signals. `ATTACK` says how many times as long the random parts
//! run as in CI; 50 is a run on demand.

mod files;
mod input;
mod names;
mod stopped;

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::program::{Run, command, finish};

/// No run of these tests takes longer.
const LIMIT: Duration = Duration::from_secs(60);

/// How many times as long as in CI.
fn times() -> u64 {
    std::env::var("ATTACK").map_or(1, |text| text.parse().unwrap())
}

/// Runs the program, which must end within the limit.
fn run(folder: &Path, line: &[&str]) -> Run {
    let mut command = command(folder, line);
    ended(command.stdout(Stdio::piped()).stderr(Stdio::piped()))
}

fn succeed(folder: &Path, line: &[&str]) -> Run {
    let run = run(folder, line);
    assert_eq!(run.code, 0, "{line:?}: {}", run.words);
    run
}

/// Waits for a program, and kills it if it hangs.
fn ended(command: &mut Command) -> Run {
    let mut child = command.spawn().unwrap();
    let process = child.id();
    let (done, is_done) = std::sync::mpsc::channel::<()>();
    let watch = std::thread::spawn(move || {
        let hangs = is_done.recv_timeout(LIMIT).is_err();
        if hangs {
            let _ = Command::new("kill")
                .args(["-9", &process.to_string()])
                .status();
        }
        hangs
    });
    // Its pipes are read while it runs, because it would wait if they were full.
    let out = child.stdout.take();
    let words = child.stderr.take();
    let read = |pipe: Option<Box<dyn std::io::Read + Send>>| {
        std::thread::spawn(move || {
            let mut bytes = Vec::new();
            if let Some(mut pipe) = pipe {
                pipe.read_to_end(&mut bytes).unwrap();
            }
            bytes
        })
    };
    let out = read(out.map(|pipe| Box::new(pipe) as _));
    let words = read(words.map(|pipe| Box::new(pipe) as _));
    let status = child.wait().unwrap();
    let _ = done.send(());
    assert!(!watch.join().unwrap(), "{command:?} hangs");
    finish(std::process::Output {
        status,
        stdout: out.join().unwrap(),
        stderr: words.join().unwrap(),
    })
}

/// Whether a child ends within the limit.
fn wait(child: &mut Child) -> std::process::ExitStatus {
    let started = Instant::now();
    loop {
        if let Some(status) = child.try_wait().unwrap() {
            return status;
        }
        if started.elapsed() > LIMIT {
            child.kill().unwrap();
            panic!("it hangs");
        }
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// The names of everything below a directory; no link is followed.
fn entries(directory: &Path) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    let mut pending = vec![directory.to_owned()];
    while let Some(next) = pending.pop() {
        for entry in fs::read_dir(next).into_iter().flatten() {
            let path = entry.unwrap().path();
            let kind = fs::symlink_metadata(&path).unwrap();
            let name = path.strip_prefix(directory).unwrap();
            found.insert(name.to_string_lossy().into_owned());
            if kind.is_dir() {
                pending.push(path);
            }
        }
    }
    found
}

/// The files that writers leave if they are killed.
fn parts(directory: &Path) -> Vec<String> {
    let all = entries(directory).into_iter();
    all.filter(|name| name.ends_with(".part")).collect()
}

pub(crate) fn pipe(path: &Path) {
    let made = Command::new("mkfifo").arg(path).status();
    assert!(made.unwrap().success());
}

/// A line of a manifest about an output.
fn line(output: &str, sha256: &str, bytes: usize) -> String {
    let entry = serde_json::json!({
        "output": output,
        "output_sha256": sha256,
        "output_bytes": bytes,
        "input": "a.dat",
        "input_sha256": null,
        "options": "",
        "kernels_sha256": "",
        "tumble": "",
        "device": "CPU",
    });
    format!("{entry}\n")
}

/// Two animations, `Run` and `Walk`, of one node.
pub(crate) fn two_animations() -> String {
    two_animations_at([0.0, 1.0])
}

/// As [`two_animations`], with keys at these times.
pub(crate) fn two_animations_at(times: [f32; 2]) -> String {
    let [min, max] = times;
    let times: Vec<u8> = times.iter().flat_map(|time| time.to_le_bytes()).collect();
    let keys: Vec<u8> = [0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.6, 0.8]
        .iter()
        .flat_map(|part| part.to_le_bytes())
        .collect();
    let bytes = base64(&[times, keys].concat());
    let animation = |name: &str| {
        serde_json::json!({
            "name": name,
            "channels": [{"sampler": 0, "target": {"node": 0, "path": "rotation"}}],
            "samplers": [{"input": 0, "output": 1}],
        })
    };
    serde_json::json!({
        "asset": {"version": "2.0"},
        "buffers": [{
            "byteLength": 40,
            "uri": format!("data:application/octet-stream;base64,{bytes}"),
        }],
        "bufferViews": [
            {"buffer": 0, "byteLength": 8},
            {"buffer": 0, "byteOffset": 8, "byteLength": 32},
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 2, "type": "SCALAR", "min": [min], "max": [max]},
            {"bufferView": 1, "componentType": 5126, "count": 2, "type": "VEC4"},
        ],
        "nodes": [{"name": "a"}],
        "animations": [animation("Run"), animation("Walk")],
    })
    .to_string()
}

fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let groups = bytes.chunks(3).map(|chunk| {
        let byte = |at: usize| u32::from(chunk.get(at).copied().unwrap_or(0));
        let word = byte(0) << 16 | byte(1) << 8 | byte(2);
        let letter = |at: usize| {
            if at <= chunk.len() {
                char::from(LETTERS[(word >> (18 - 6 * at) & 63) as usize])
            } else {
                '='
            }
        };
        [0, 1, 2, 3].map(letter).iter().collect::<String>()
    });
    groups.collect()
}
