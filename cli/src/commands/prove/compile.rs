//! Measures how long the driver takes to compile each kernel without caches, in a separate process in which the
//! drivers' caches are off.

use std::io::{BufRead as _, BufReader, Write as _};
use std::process::{Command, Stdio};
use std::sync::mpsc;
use std::time::{Duration, Instant};

use tumble::{Device, Engine, EngineOptions};

use crate::arguments::device::refused;
use crate::commands::prove::report::{CompileTime, CompileTimes};
use crate::messages::exit::Failure;

/// The environment variables that turn off the caches of Mesa's, NVIDIA's and AMD's drivers, and the engine's.
const NO_CACHES: [(&str, &str); 5] = [
    ("MESA_SHADER_CACHE_DISABLE", "true"),
    ("MESA_GLSL_CACHE_DISABLE", "true"),
    ("__GL_SHADER_DISK_CACHE", "0"),
    ("AMD_SHADER_DISK_CACHE", "0"),
    ("TUMBLE_CACHE_DIR", ""),
];

/// The last line that the process prints.
const END: &str = "end";

/// The process that compiles: a line of JSON for each kernel, then [`END`].
pub(crate) fn run(device: Device) -> Result<(), Failure> {
    let mut options = EngineOptions::default();
    options.allow_inexact = true;
    let engine = Engine::with_options(device, &options).map_err(|error| refused(&error))?;
    let mut said = Ok(());
    let compiled = engine.compile_kernels(&mut |kernel, time| {
        let line = CompileTime {
            kernel: kernel.to_owned(),
            milliseconds: time.as_secs_f64() * 1e3,
        };
        let line = serde_json::to_string(&line).expect("a name and a number");
        let mut out = std::io::stdout().lock();
        said = writeln!(out, "{line}").and_then(|()| out.flush());
        said.is_ok()
    });
    said.map_err(|error| Failure::writing("standard output", &error))?;
    compiled.map_err(|error| refused(&error))?;
    let written = writeln!(std::io::stdout(), "{END}");
    written.map_err(|error| Failure::writing("standard output", &error))
}

/// Compiles every kernel in another process, for as long as there is time.
pub(crate) fn measure(uuid: &str, limit: Duration) -> Result<CompileTimes, String> {
    let program = std::env::current_exe().map_err(|error| error.to_string())?;
    let mut child = Command::new(program)
        .args(["prove", "--compile-kernels", "--device"])
        .arg(format!("uuid:{uuid}"))
        .envs(NO_CACHES)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .map_err(|error| format!("another process cannot be started: {error}"))?;
    let (sender, lines) = mpsc::channel();
    let out = child.stdout.take();
    let reader = std::thread::Builder::new().spawn(move || {
        for line in out.into_iter().flat_map(|out| BufReader::new(out).lines()) {
            let Ok(line) = line else { return };
            if sender.send(line).is_err() {
                return;
            }
        }
    });
    let deadline = Instant::now() + limit;
    let mut times = CompileTimes::default();
    if reader.is_ok() {
        // The loop ends if no line arrives in time, or if the process ends.
        while let Some(left) = deadline.checked_duration_since(Instant::now())
            && let Ok(line) = lines.recv_timeout(left)
        {
            if line == END {
                times.is_complete = true;
                break;
            }
            if let Ok(time) = serde_json::from_str::<CompileTime>(&line) {
                times.milliseconds_total += time.milliseconds;
                times.kernels.push(time);
            }
        }
    }
    let _ = child.kill(); // it may have ended
    let _ = child.wait();
    match times.kernels.is_empty() {
        true => Err("no kernel was compiled in a child process".to_owned()),
        false => Ok(times),
    }
}
