//! Every example of the help does what it says, in a folder with the files that it names.
#![cfg(unix)]

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Command, Stdio};

use crate::program::{Run, finish, root, succeed};

/// Examples that take minutes, each with the line that runs instead: a shorter part of the same, or nothing where other
/// tests run the command.
const LONG: [(&str, Option<&str>); 12] = [
    // Models of bodies are not free.
    ("tumble features amass", None),
    ("tumble prove", None),
    ("tumble lab", None),
    ("tumble bench", None),
    (
        "tumble render data/pendulum.dat -o pendulum.gif",
        Some(" --end 0.1"),
    ),
    (
        "tumble render data/pendulum.dat -m slerp,",
        Some(" --end 0.1"),
    ),
    (
        "tumble render data/pendulum.dat --fps 60",
        Some(" --end 0.1"),
    ),
    ("tumble render walk.bvh", Some(" --end 0.1")),
    ("tumble render road.csv", Some(" --end 0.1")),
    ("tumble render walker.glb", Some(" --end 0.1")),
    ("tumble verify data/pendulum.dat", Some(" --end 1")),
    ("tumble generate --boxes 4096", None),
];

/// The commands to run before an example whose inputs are results of another command, or whose results are inputs of
/// others.
const BEFORE: [(&str, &str); 3] = [
    ("tumble check", "tumble eval walks -o results"),
    ("tumble merge", "tumble eval walks -o results --shard 1/1"),
    ("tumble generate --hill", "rm rocks.obj"),
];

/// A body of five joints that walks, as BVH.
const WALK: &str = "HIERARCHY\nROOT Hips\n{\n OFFSET 0 0 0\n CHANNELS 6 Xposition Yposition Zposition Zrotation \
    Xrotation Yrotation\n JOINT LeftUpLeg\n {\n  OFFSET 0.1 -0.1 0\n  CHANNELS 3 Zrotation Xrotation Yrotation\n  \
    JOINT LeftLeg\n  {\n   OFFSET 0 -0.4 0\n   CHANNELS 3 Zrotation Xrotation Yrotation\n   End Site\n   {\n    \
    OFFSET 0 -0.4 0\n   }\n  }\n }\n JOINT RightUpLeg\n {\n  OFFSET -0.1 -0.1 0\n  CHANNELS 3 Zrotation Xrotation \
    Yrotation\n  JOINT RightLeg\n  {\n   OFFSET 0 -0.4 0\n   CHANNELS 3 Zrotation Xrotation Yrotation\n   End Site\n   \
    {\n    OFFSET 0 -0.4 0\n   }\n  }\n }\n}\nMOTION\nFrames: 31\nFrame Time: 0.0333333\n";

fn walk() -> String {
    let frames = (0..31).map(|frame| {
        let t = f64::from(frame) / 30.0;
        let (swing, bend) = (30.0 * (6.0 * t).sin(), 20.0 - 20.0 * (6.0 * t).cos());
        format!(
            "0 {} {t} 0 0 5 0 {swing} 0 0 {bend} 0 0 {} 0 0 {bend} 0\n",
            0.9 + 0.01 * t,
            -swing
        )
    });
    WALK.to_owned() + &frames.collect::<String>()
}

/// An array of NumPy's.
fn npy(shape: &str, values: impl IntoIterator<Item = f64>) -> Vec<u8> {
    let header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': ({shape}), }}");
    let start = b"\x93NUMPY\x01\x00\x76\x00";
    let header = format!("{header:<117}\n");
    let values = values.into_iter().flat_map(f64::to_le_bytes);
    [&start[..], header.as_bytes(), &values.collect::<Vec<u8>>()].concat()
}

/// The surface of [`crate::route::plaza`] as one file.
fn plaza_glb(folder: &Path) {
    crate::route::plaza(folder);
    let text = fs::read_to_string(folder.join("plaza.gltf")).unwrap();
    let mut text = text.replace(r#""uri":"plaza.bin","#, "");
    text += &" ".repeat(text.len().next_multiple_of(4) - text.len());
    let bin = fs::read(folder.join("plaza.bin")).unwrap();
    let word = |number: usize| u32::try_from(number).unwrap().to_le_bytes();
    let parts = [
        &b"glTF"[..],
        &word(2),
        &word(28 + text.len() + bin.len()),
        &word(text.len()),
        b"JSON",
        text.as_bytes(),
        &word(bin.len()),
        b"BIN\0",
        &bin,
    ];
    fs::write(folder.join("plaza.glb"), parts.concat()).unwrap();
}

/// The files that the examples name.
fn write_inputs(folder: &Path) {
    let write = |name: &str, bytes: &[u8]| {
        let path = folder.join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    };
    for name in ["pendulum.dat", "pendulum-random.dat"] {
        write(
            &format!("data/{name}"),
            &fs::read(root().join("data").join(name)).unwrap(),
        );
    }
    write("arm.xml", crate::cli_listings::ARM.as_bytes());
    write("g1.xml", crate::robots::ROBOT.as_bytes());
    write("lafan1/walk.csv", crate::robots::take().as_bytes());
    let generate = |line: &str| {
        succeed(folder, &line.split(' ').collect::<Vec<_>>());
    };
    generate("generate --boxes 2 --seconds 2 -o a.dat");
    for name in [
        "b.dat",
        "chain.dat",
        "walk.dat",
        "clips/a.dat",
        "before/a.dat",
        "after/a.dat",
        "walks/a.dat",
        "walks/more/b.dat",
    ] {
        write(name, &fs::read(folder.join("a.dat")).unwrap());
    }
    for name in ["walk.bvh", "retargeted.bvh", "clips/b.bvh"] {
        write(name, walk().as_bytes());
    }
    let human = crate::retarget::human(|role| role);
    for name in ["take.bvh", "takes/one.bvh", "takes/b/two.bvh"] {
        write(name, human.as_bytes());
    }
    fs::create_dir(folder.join("amass")).unwrap();
    for name in [
        "walk.glb",
        "dance.glb",
        "walk.npz",
        "cleaned.npz",
        "amass/walk.npz",
    ] {
        generate(&format!("convert walk.bvh -o {name}"));
    }
    generate("reduce walk.bvh --tolerance 0.1deg -o reduced.glb");
    generate("convert take.bvh -o character.glb");
    generate("convert lafan1/walk.csv --robot g1.xml --dialect gmr -o walk.pkl");
    write(
        "bones.json",
        br#"{"hips": "hips", "spine": "spine", "head": "head"}"#,
    );
    for name in ["one.npy", "other.npy"] {
        generate(&format!("eval a.dat -o {name}"));
    }
    let road = b"t,x,y,z\n0,0,0,0\n1,1,0,1\n2,2,0,0\n3,1,0,-1\n4,0,0,0\n";
    for name in [
        "road.csv",
        "lap.csv",
        "orbit.csv",
        "paths/one.csv",
        "paths/two.csv",
    ] {
        write(name, road);
    }
    let points = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 1.0],
        [2.0, 0.0, 0.0],
        [3.0, 0.0, 1.0],
    ];
    write("points.npy", &npy("1, 4, 3", points.into_iter().flatten()));
    let poses: String = (0..50)
        .map(|i| {
            let t = f64::from(i) / 10.0;
            format!("{t} {} {} {} 0 0 0 1\n", t, t.sin(), t.cos())
        })
        .collect();
    write("truth.tum", poses.as_bytes());
    write("estimate.tum", poses.as_bytes());
    generate("generate --hill -o hill.obj --rocks rocks.obj");
    generate("follow road.csv -o walker.glb");
    write("pairs.txt", b"0,0,0 9,5,0\n1,1,0 8,5,0\n");
    plaza_glb(folder);
    let people = "name,radius,speed,x,y,z,to_x,to_y,to_z,track\none,0.5,1,5,1,10,15,1,10,\n\
                  two,0.5,1,10,1,5,10,1,15,\n";
    write("people.csv", people.as_bytes());
    let net = (0..4).flat_map(|i| (0..4).map(move |j| (f64::from(i) / 3.0, f64::from(j) / 3.0)));
    write(
        "hood.npy",
        &npy("4, 4, 3", net.flat_map(|(x, y)| [x, x * y, y])),
    );
}

/// Runs lines of a shell script in `folder`, with the programs of `folder/bin`.
fn shell(folder: &Path, line: &str) -> Run {
    let path = format!(
        "{}/bin:{}",
        folder.display(),
        std::env::var("PATH").unwrap()
    );
    let mut command = Command::new("bash");
    command
        .args(["-e", "-o", "pipefail", "-c", line])
        .current_dir(folder.join("bin"));
    command
        .env("PATH", path)
        .env("HOME", folder.join("home"))
        .stdin(Stdio::null());
    finish(command.output().unwrap())
}

/// The lines after `Examples:`, without their comments; a line may go on in the next.
fn examples(help: &str) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    let after = help
        .split_once("Examples:\n")
        .map_or("", |(_, after)| after);
    for line in after.lines().take_while(|line| line.starts_with("  ")) {
        match lines.last_mut().filter(|last| last.ends_with('\\')) {
            Some(last) => *last += &format!("\n{line}"),
            None => {
                let (line, _) = line[2..].split_once("  ").unwrap_or((&line[2..], ""));
                lines.push(line.to_owned());
            }
        }
    }
    lines
}

#[test]
fn every_example_of_the_help_runs() {
    let temporary = tempfile::tempdir().unwrap();
    let (inputs, folder) = (
        temporary.path().join("inputs"),
        temporary.path().join("run"),
    );
    fs::create_dir(&inputs).unwrap();
    write_inputs(&inputs);
    let program = env!("CARGO_BIN_EXE_tumble");
    let help = String::from_utf8(succeed(&inputs, &["--help"]).out).unwrap();
    let commands = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    let commands = commands.take_while(|line| !line.is_empty());
    // The summary of a command may go on in a further line.
    let commands = commands.filter(|line| !line.starts_with("   "));
    let mut commands: Vec<&str> = commands
        .filter_map(|line| line.split_whitespace().next())
        .collect();
    commands.retain(|command| *command != "help");
    assert!(commands.len() > 15, "{commands:?}");
    // These replace the browser, and programs that may not be installed.
    for (name, text) in [
        ("tumble", format!("exec '{program}' \"$@\"")),
        ("xdg-open", String::new()),
        ("jq", "cat".to_owned()),
        ("python3", "cat".to_owned()),
    ] {
        let path = folder.join("bin").join(name);
        fs::create_dir_all(folder.join("bin")).unwrap();
        fs::write(&path, format!("#!/bin/sh\n{text}\n")).unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
    }
    for name in [
        ".config/fish/completions",
        ".local/share/bash-completion/completions",
    ] {
        fs::create_dir_all(folder.join("home").join(name)).unwrap();
    }
    let (mut count, mut failed) = (0, Vec::new());
    for command in std::iter::once("").chain(commands) {
        let mut line_of_help = vec![command, "--help"];
        line_of_help.retain(|word| !word.is_empty());
        let help = String::from_utf8(succeed(&inputs, &line_of_help).out).unwrap();
        for example in examples(&help) {
            let mut line = example.replace("seq 64", "seq 3").replace("/64", "/3");
            match LONG.iter().find(|(start, _)| example.starts_with(start)) {
                Some((_, None)) => continue,
                Some((_, Some(shorter))) => line += shorter,
                None => {}
            }
            // Some examples read the results of others.
            let out = example.split(" -o ").nth(1);
            let out = out.and_then(|rest| rest.split_whitespace().next());
            let before = BEFORE.iter().find(|(start, _)| example.starts_with(start));
            let before = before.map_or("", |(_, before)| before);
            let fresh = format!(
                "rm -rf ../here; cp -r ../../inputs ../here; cd ../here; rm -rf {}",
                out.unwrap_or_default()
            );
            let run = shell(&folder, &format!("{fresh}\n{before}\n{line}"));
            if run.code != 0 {
                failed.push(format!("{command}: {example}\n{}", run.words));
            }
            count += 1;
        }
    }
    assert!(failed.is_empty(), "{}", failed.join("\n"));
    assert!(count > 70, "{count}");
}
