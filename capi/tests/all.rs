//! The header, and programs in C and C++ that use it; and an application's own device.

// Tests may use what systems round differently (clippy.toml).
#![allow(clippy::disallowed_methods)]

#[path = "../../tests/support/application.rs"]
mod application;
mod application_device;
#[path = "../../tests/support/layer.rs"]
mod layer;
mod passes;
mod scalars;
#[path = "../../tests/support/mod.rs"]
mod support;

use std::path::{Path, PathBuf};
use std::process::Command;

use glam::Quat;
use tumble::{Device, Engine, Layout, SampleTimes, TrackSet, method};
use tumble_formats::{Format, ReadOptions};

fn package_path(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// `UPDATE_HEADER=1` writes it.
#[test]
fn the_header_is_what_the_sources_say() {
    let mut builder = cbindgen::Builder::new()
        .with_config(cbindgen::Config::from_file(package_path("cbindgen.toml")).unwrap());
    let sources = [
        "version",
        "result",
        "engine",
        "set",
        "file",
        "interpolation",
        "samples",
        "clip",
        "sampler",
        "scalars",
        "request",
        "timed",
        "pass",
        "set_vectors",
        "vulkan",
        "crowd/library",
        "crowd/file",
        "crowd/layer",
        "crowd/player",
        "crowd/fade",
        "crowd/events",
        "crowd/visible",
        "crowd/output",
        "crowd/stages",
        "crowd/target",
    ];
    for source in sources {
        builder = builder.with_src(package_path(&format!("src/{source}.rs")));
    }
    let mut header = Vec::new();
    builder.generate().unwrap().write(&mut header);
    let header = String::from_utf8(header).unwrap();
    let mut functions = 0;
    let folders =
        ["src", "src/crowd"].map(|folder| std::fs::read_dir(package_path(folder)).unwrap());
    let files = folders
        .into_iter()
        .flatten()
        .map(|entry| entry.unwrap().path());
    for source in files.filter(|path| path.is_file()) {
        let text = std::fs::read_to_string(&source).unwrap();
        for exported in text.split("extern \"C\" fn tumble_").skip(1) {
            let name = exported.split('(').next().unwrap();
            assert!(
                header.contains(&format!("tumble_{name}(")),
                "tumble_{name} is exported, and not in the header: {} is missing in the list of sources",
                source.display()
            );
            functions += 1;
        }
    }
    assert!(functions > 20, "{functions} functions: {header}");
    let path = package_path("include/tumble.h");
    if std::env::var_os("UPDATE_HEADER").is_some() {
        std::fs::write(&path, &header).unwrap();
    }
    let found = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(
        found == header,
        "capi/include/tumble.h is not current: UPDATE_HEADER=1 cargo test -p tumble-capi"
    );
}

/// A compiler of the system's; CI must have it.
fn compiler(name: &str) -> Option<Command> {
    let is_there = Command::new(name).arg("--version").output().is_ok();
    assert!(
        is_there || std::env::var_os("CI").is_none(),
        "CI must have `{name}`"
    );
    if !is_there {
        eprintln!("NO `{name}`: nothing was compiled");
    }
    is_there.then(|| {
        let mut command = Command::new(name);
        command.args(["-O1", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-I"]);
        command.arg(package_path("include"));
        command
    })
}

fn succeed(command: &mut Command) -> String {
    let output = command.output().unwrap();
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{command:?}: {errors}");
    String::from_utf8(output.stdout).unwrap()
}

/// The folder of the libraries, which are built beside this test.
fn libraries() -> PathBuf {
    let test = std::env::current_exe().unwrap();
    let folder = test.parent().unwrap().to_owned();
    let library = folder.join("libtumble_capi.a");
    assert!(library.exists(), "{} is not built", library.display());
    folder
}

/// The track of the examples.
fn elbow() -> TrackSet {
    let keys = [
        [0.0, 0.0, 0.0, 1.0],
        [0.0, 0.0, 0.6, 0.8],
        [0.0, 0.0, 0.8, 0.6],
    ];
    let mut set = TrackSet::new();
    set.push("elbow", &[0.0, 0.5, 1.25], &keys).unwrap();
    set
}

/// The output that the example must print: the bits that the engine gives to Rust.
fn expected() -> String {
    let engine = Engine::new(Device::Cpu).unwrap();
    let set = elbow();
    let elbow = engine.evaluate(&set, method::SLERP, &SampleTimes::fps(60));
    let elbow = elbow.unwrap();
    let loaded = Format::open_detected(&pendulum(), &ReadOptions::default()).unwrap();
    let frames = SampleTimes::at(vec![0.0, 7.3, 1.0 / 3.0]);
    let (set, layout) = (&loaded.clips[0].set, Layout::FrameMajor);
    let file = engine
        .request(set, method::BESSEL_OVERHAUSER, &frames)
        .layout(layout)
        .evaluate();
    let file = file.unwrap();
    let lines = |name: &'static str, rotations: &[Quat]| -> Vec<String> {
        let components = rotations.iter().flat_map(Quat::to_array);
        components
            .map(|component| format!("{name} {:08x}\n", component.to_bits()))
            .collect()
    };
    let elbow = lines("elbow", elbow.as_quats());
    assert_eq!(elbow.len(), 4 * 76);
    [elbow, lines("file", file.as_quats())].concat().concat()
}

fn pendulum() -> PathBuf {
    package_path("../data/pendulum.dat")
}

/// Engines are written in C++.
const LANGUAGES: [(&str, &[&str]); 2] =
    [("cc", &["-std=c99"]), ("c++", &["-std=c++11", "-x", "c++"])];

/// An example, compiled as C and as C++, linked with the shared and with the static library; each with
/// the devices that it runs on.
fn programs(example: &str) -> Vec<(PathBuf, &'static [&'static str])> {
    let (libraries, out) = (libraries(), Path::new(env!("CARGO_TARGET_TMPDIR")));
    let mut programs = Vec::new();
    for (name, language) in LANGUAGES {
        for is_static in [false, true] {
            let Some(mut command) = compiler(name) else {
                continue;
            };
            let kind = if is_static { "static" } else { "shared" };
            let program = out.join(format!("{example}-{name}-{kind}"));
            let source = package_path(&format!("examples/{example}.c"));
            command
                .args(language)
                .arg(source)
                .args(["-x", "none", "-o"]);
            command.arg(&program);
            if is_static {
                command.arg(libraries.join("libtumble_capi.a"));
                // The system's libraries that Rust's standard library is linked with.
                command.args(["-lpthread", "-ldl", "-lm"]);
            } else {
                command.arg("-L").arg(&libraries).arg("-ltumble_capi");
                command.arg(format!("-Wl,-rpath,{}", libraries.display()));
            }
            succeed(&mut command);
            programs.push((program, devices(is_static)));
        }
    }
    programs
}

/// The CPU, and for shared libraries a Vulkan device where there is one.
fn devices(is_static: bool) -> &'static [&'static str] {
    if is_static || support::vulkan_devices().is_empty() {
        &["cpu"]
    } else {
        &["cpu", "vulkan"]
    }
}

/// On the CPU and on a Vulkan device.
#[test]
fn the_example_in_c_prints_the_engines_bits() {
    let expected = expected();
    for (program, devices) in programs("evaluate") {
        for device in devices {
            let said = succeed(Command::new(&program).arg(device).arg(pendulum()));
            assert!(said == expected, "{device}, {}: {said}", program.display());
        }
    }
}

/// The header for C++, in the oldest standard that it is for and in that of engines today.
#[test]
fn handles_of_cpp_free_themselves_and_have_the_engines_bits() {
    let engine = Engine::new(Device::Cpu).unwrap();
    let set = elbow();
    let times = SampleTimes::at(vec![0.0, 0.25, 0.5]);
    let expected = engine.evaluate(&set, method::SLERP, &times).unwrap();
    let expected: Vec<f32> = expected
        .as_quats()
        .iter()
        .flat_map(Quat::to_array)
        .collect();
    let (libraries, out) = (libraries(), Path::new(env!("CARGO_TARGET_TMPDIR")));
    for standard in ["c++11", "c++17"] {
        let Some(mut command) = compiler("c++") else {
            continue;
        };
        let program = out.join(format!("poses-{standard}"));
        command.arg(format!("-std={standard}"));
        command
            .arg(package_path("examples/poses.cpp"))
            .arg("-o")
            .arg(&program);
        command.arg("-L").arg(&libraries).arg("-ltumble_capi");
        command.arg(format!("-Wl,-rpath,{}", libraries.display()));
        succeed(&mut command);
        let said = succeed(&mut Command::new(&program));
        let numbers = said.lines().flat_map(|line| line.split(' ').skip(1));
        let numbers: Vec<f32> = numbers.map(|number| number.parse().unwrap()).collect();
        assert_eq!(numbers, expected, "{standard}: {said}");
    }
}

/// A chain of three joints, where no model is given.
const CHAIN: &str = "HIERARCHY\nROOT hip\n{\nOFFSET 0 1 0\nCHANNELS 6 Xposition Yposition Zposition \
    Zrotation Xrotation Yrotation\nJOINT knee\n{\nOFFSET 0 -0.5 0\nCHANNELS 3 Zrotation Xrotation \
    Yrotation\nJOINT foot\n{\nOFFSET 0 -0.5 0\nCHANNELS 3 Zrotation Xrotation Yrotation\nEnd Site\n{\n\
    OFFSET 0 0 0.2\n}\n}\n}\n}\nMOTION\nFrames: 3\nFrame Time: 0.25\n\
    0 1 0 0 0 0 0 0 0 0 0 0\n0 1 1 10 20 30 5 40 0 0 -20 3\n0 1 2 0 5 60 0 10 0 2 0 9\n";

/// The example compares the bytes itself; here, that it did, and that all programs found the same.
#[test]
fn crowds_in_c_have_the_same_bytes_on_the_cpu_and_a_device() {
    let folder = tempfile::tempdir().unwrap();
    let chain = folder.path().join("chain.bvh");
    std::fs::write(&chain, CHAIN).unwrap();
    let mut first = None;
    for (program, devices) in programs("crowd") {
        for device in devices {
            let said = succeed(Command::new(&program).arg(device).arg(&chain));
            let lines = |prefix: &str| said.lines().filter(|line| line.starts_with(prefix)).count();
            assert!(
                said.contains("figures: 3000 instances of 13 joints, 3 clips\n"),
                "{said}"
            );
            assert!(
                said.contains("file: 300 instances of 3 joints, 1 clips\n"),
                "{said}"
            );
            assert_eq!(
                (lines("figures "), lines("file ")),
                (4 * 8, 4 * 6),
                "{said}"
            );
            assert!(said.ends_with("all bytes are the same\n"), "{said}");
            let first = first.get_or_insert_with(|| said.clone());
            assert!(said == *first, "{device}, {}: {said}", program.display());
        }
    }
    let Some(first) = first else {
        return;
    };
    // All frames have different hashes.
    let mut hashes: Vec<&str> = first
        .lines()
        .filter_map(|line| line.split(' ').nth(3))
        .collect();
    hashes.sort_unstable();
    hashes.dedup();
    assert!(hashes.len() >= 4 * 14, "{first}");
}

#[test]
fn the_header_is_c_plus_plus_too() {
    let Some(mut command) = compiler("c++") else {
        return;
    };
    let header = package_path("include/tumble.h");
    let check = command.args(["-std=c++11", "-fsyntax-only", "-x", "c++"]);
    succeed(check.arg(header));
}
