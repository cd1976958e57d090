//! Files of an attacker: broken in ways that each format's structure allows, with names that contain a terminal's
//! commands, or with headers that claim more data than there is.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

use tumble_formats::FORMATS;

use super::{run, times};
use crate::cases;
use crate::commands;
use crate::program::{Run, root, sample_folder};
use crate::support::Random;

/// A run, which must end by itself within the limit, without a bug.
fn attempt(folder: &Path, line: &[&str]) -> Run {
    let run = run(folder, line);
    let known = [0, 2, 3, 4, 5, 7, 8];
    assert!(
        known.contains(&run.code),
        "{line:?}: {} {}",
        run.code,
        run.words
    );
    assert!(
        !run.words.contains("internal error"),
        "{line:?}: {}",
        run.words
    );
    run
}

const NOTHING_MOVES: &str =
    r#"{"asset":{"version":"2.0"},"nodes":[{}],"animations":[{"channels":[],"samplers":[]}]}"#;

/// Two animations, each of one channel with that input and that sampler.
fn animations(faults: [(usize, usize); 2]) -> String {
    let animation = |(input, sampler): (usize, usize)| {
        format!(
            r#"{{"channels":[{{"sampler":{sampler},"target":{{"node":0,"path":"rotation"}}}}],
            "samplers":[{{"input":{input},"output":1}}]}}"#
        )
    };
    let [one, two] = faults.map(animation);
    format!(
        r#"{{"asset":{{"version":"2.0"}},"nodes":[{{"name":"a"}}],"buffers":[{{"byteLength":40,
        "uri":"data:;base64,AAAAAAAAgD8AAAAAAAAAAAAAAAAAAIA/AAAAAAAAAACamRk/zcxMPw=="}}],
        "bufferViews":[{{"buffer":0,"byteLength":8}},{{"buffer":0,"byteOffset":8,"byteLength":32}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":2,"type":"SCALAR","min":[0],"max":[1]}},
        {{"bufferView":1,"componentType":5126,"count":2,"type":"VEC4"}}],"animations":[{one},{two}]}}"#
    )
}

/// Inputs that are broken completely or in part, and the exit code of a command with only this input.
fn broken(folder: &Path) -> Vec<(&'static str, i32)> {
    let cases = [
        ("nothing_moves.gltf", NOTHING_MOVES.to_owned(), 4),
        ("two_broken.gltf", animations([(1, 0), (0, 7)]), 4),
        ("one_of_two.gltf", animations([(0, 0), (0, 7)]), 3),
        ("void.csv", String::new(), 4),
        ("header.bvh", "HIERARCHY\n".to_owned(), 4),
        ("no_pose.tum", "# nothing\n".to_owned(), 4),
    ];
    for (name, text, _) in &cases {
        fs::write(folder.join(name), text).unwrap();
    }
    let mut all: Vec<_> = cases.iter().map(|&(name, _, code)| (name, code)).collect();
    all.extend([
        ("bad.dat", 4),
        ("missing.dat", 4),
        ("empty", 4),
        ("a.dat", 0),
    ]);
    all
}

/// The arguments beside inputs of the commands that do not make a result of each input.
const COMMANDS: [&[&str]; 3] = [
    &["verify", "-m", "slerp", "--device", "cpu"],
    &["plot", "-o", "pictures"],
    &["render", "-o", "film.gif", "--fps", "2", "--size", "32x32"],
];

/// The commands that take any inputs, with their other arguments: by [`COMMANDS`], a format and an output of
/// all that make a result of each input, else nothing.
fn taking_inputs() -> Vec<Vec<String>> {
    // `compare` takes two inputs, `view` writes one page for all inputs, and the other two need a skeleton and
    // more arguments.
    const NOT_HERE: [&str; 4] = ["compare", "view", "retarget", "features"];
    let owned = |line: &[&str]| line.iter().map(|word| (*word).to_owned()).collect();
    let mut all: Vec<Vec<String>> = COMMANDS.iter().map(|line| owned(line)).collect();
    let formats = ["npz", "glb"].into_iter().cycle();
    for (name, format) in commands::writing_results().iter().zip(formats) {
        all.push(owned(&[name, "--to", format, "-o", "out/"]));
    }
    for command in commands::commands() {
        let name = command.get_name();
        let is_known = all.iter().any(|line| line[0] == name) || NOT_HERE.contains(&name);
        if !is_known && commands::has(&command, "files_from") {
            all.push(owned(&[name]));
        }
    }
    all
}

/// The output has a line for every input, whatever the other inputs are; the exit code is that of
/// the worst one.
#[test]
fn no_input_ends_without_a_line() {
    let mut random = Random(18);
    for command in taking_inputs() {
        let command: Vec<&str> = command.iter().map(|word| &**word).collect();
        let folder = sample_folder();
        let all = broken(folder.path());
        let mut sets: Vec<Vec<(&str, i32)>> = all.iter().map(|&one| vec![one]).collect();
        for _ in 0..2 * times() {
            let mut set = all.clone();
            while set.len() > 1 + (random.next() % 3) as usize {
                set.remove(random.next() as usize % set.len());
            }
            sets.push(set);
        }
        for mut set in sets {
            if command[0] == "render" && set.len() > 1 {
                continue; // one at a time
            }
            for made in ["out", "pictures"] {
                let _ = fs::remove_dir_all(folder.path().join(made));
            }
            let names: Vec<&str> = set.iter().map(|one| one.0).collect();
            let mut line = [&command[..], &names[..]].concat();
            if commands::has(&commands::named(command[0]), "overwrite") {
                line.push("--overwrite");
            }
            let run = attempt(folder.path(), &line);
            // A file that is written again may not have an animation that cannot be read.
            for (name, code) in &mut set {
                if *name == "one_of_two.gltf" && command.contains(&"glb") {
                    *code = 4;
                }
            }
            let worst = match (
                set.iter().all(|one| one.1 == 4),
                set.iter().all(|one| one.1 == 0),
            ) {
                (true, _) => 4,
                (_, true) => 0,
                _ => 3,
            };
            assert_eq!(run.code, worst, "{line:?}: {}", run.words);
            let said = String::from_utf8_lossy(&run.out) + &*run.words;
            for (name, code) in &set {
                let picture = ["plot", "render"].contains(&command[0]) && *code != 4;
                assert!(
                    said.contains(name) || picture,
                    "{line:?} says nothing of {name}: {said}"
                );
            }
        }
    }
}

/// Every command reports each animation that is refused.
#[test]
fn all_broken_animations_are_told() {
    let folder = sample_folder();
    broken(folder.path());
    for command in taking_inputs() {
        let command: Vec<&str> = command.iter().map(|word| &**word).collect();
        let line = [&command[..], &["two_broken.gltf"]].concat();
        let run = attempt(folder.path(), &line);
        assert!(
            run.words.contains("/animations/0/"),
            "{line:?}: {}",
            run.words
        );
        assert!(
            run.words.contains("/animations/1/"),
            "{line:?}: {}",
            run.words
        );
    }
}

/// Escape sequences, line ends, and marks that reverse the direction of text.
const NAMES: [&str; 2] = [
    "\x1b]0;FORGED\x07\x1b[2J\x1b[1;1H\u{9b}31mFORGED\u{202e}",
    "a\nFORGED: unchanged since they were written\r\x1b[KFORGED",
];

fn is_quiet(text: &str, line: &[&str]) {
    let active = |c: char| c != '\n' && (c.is_control() || ('\u{202a}'..='\u{202e}').contains(&c));
    let found = text.chars().find(|&c| active(c));
    assert_eq!(found, None, "{line:?}: {text:?}");
    let forged = text.lines().find(|line| line.starts_with("FORGED"));
    assert_eq!(forged, None, "{line:?}: {text:?}");
}

/// Names in files, names of files, URIs, headers, lists and manifests: messages contain nothing that a
/// terminal obeys, and no name begins a line.
#[test]
fn no_name_reaches_a_terminal_as_it_is() {
    let json = |name: &str| serde_json::to_string(name).unwrap();
    let mut seen = 0;
    for name in NAMES {
        let folder = sample_folder();
        let write = |file: &str, text: String| fs::write(folder.path().join(file), text).unwrap();
        let quoted = json(name);
        let whole = animations([(0, 0), (0, 0)]);
        let named = whole.replacen(r#"{"name":"a"}"#, &format!(r#"{{"name":{quoted}}}"#), 1);
        let named = named.replace(
            r#"{"channels""#,
            &format!(r#"{{"name":{quoted},"channels""#),
        );
        write("names.gltf", named.clone());
        write(
            "fault.gltf",
            named.replacen(
                r#""output":1"#,
                &format!(r#""output":1,"interpolation":{quoted}"#),
                1,
            ),
        );
        write(
            "uri.gltf",
            named.replacen(
                "data:;base64,",
                &name.escape_default().to_string().replace('\\', "%5C"),
                1,
            ),
        );
        write(
            "uri2.gltf",
            whole.replacen(
                r#""data:;base64,AAAAAAAAgD8AAAAAAAAAAAAAAAAAAIA/AAAAAAAAAACamRk/zcxMPw==""#,
                &quoted,
                1,
            ),
        );
        let word = name.replace(['\n', '\r'], "_");
        write(
            "joint.bvh",
            format!("HIERARCHY\nROOT {word}\n{{\nOFFSET 0 0 0\nCHANNELS 1 {word}\n}}\n"),
        );
        write(
            "header.csv",
            format!(
                "time,\"{name}.x\",\"{name}.y\",\"{name}.z\",\"{name}.w\"\n0,0,0,0,1\n1,0,0,0,1\n"
            ),
        );
        write("columns.csv", format!("time,\"{name}\"\n0,0\n"));
        write("cell.csv", format!("time,x,y,z,w\n0,0,0,0,\"{name}\"\n"));
        write("token.dat", format!("# 1 1\n0 1 0 0 {word}\n"));
        write("token.tum", format!("0 0 0 0 0 0 0 {word}\n"));
        write("path.csv", format!("t,x,y,\"{name}\"\n"));
        write("pairs.txt", format!("{word}\n"));
        write(
            "walkers.csv",
            format!("name,radius,speed,x,y,z,to_x,to_y,to_z\n\"{name}\",1,1,0,0,0,1,1,0\n"),
        );
        write(
            "flat.obj",
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n".to_owned(),
        );
        write("word.obj", format!("v 0 0 {word}\n"));
        write("word.ply", format!("ply\nformat {word}\n"));
        write("list.txt", format!("{word}.dat\n"));
        fs::create_dir(folder.path().join("results")).unwrap();
        let entry = |output: &str| {
            format!(
                "{{\"output\":{output},\"output_bytes\":1,\"output_sha256\":{quoted},\"input\":{quoted},\"input_sha256\":{quoted},\
                 \"options\":{quoted},\"kernels_sha256\":{quoted},\"tumble\":{quoted},\"device\":{quoted}}}\n"
            )
        };
        write(
            "results/manifest.jsonl",
            entry(&quoted) + &entry("\"x.npy\""),
        );
        let file = format!("{}.dat", name.replace('/', "_"));
        let is_named = fs::copy(folder.path().join("a.dat"), folder.path().join(&file)).is_ok();
        let mut lines: Vec<Vec<&str>> = Vec::new();
        for input in [
            "names.gltf",
            "fault.gltf",
            "uri.gltf",
            "uri2.gltf",
            "joint.bvh",
            "header.csv",
            "columns.csv",
            "cell.csv",
            "token.dat",
            "token.tum",
            &file,
        ] {
            lines.push(vec!["info", input]);
            lines.push(vec!["convert", input, "--overwrite", "-o", "o.npz"]);
        }
        for input in ["names.gltf", "header.csv", &*file] {
            lines.push(vec!["info", "--json", input]);
            lines.push(vec![
                "eval",
                input,
                "--animation",
                "1",
                "--overwrite",
                "-o",
                "o.npy",
            ]);
            lines.push(vec![
                "eval",
                input,
                "--overwrite",
                "-o",
                "out/",
                "--explain-route",
            ]);
            lines.push(vec!["eval", input, "--tracks", "none"]);
            lines.push(vec!["verify", "--device", "cpu", "-m", "slerp", input]);
            lines.push(vec!["compare", input, "a.dat", "--fps", "2"]);
            lines.push(vec![
                "reduce",
                input,
                "--to",
                "glb",
                "--overwrite",
                "-o",
                "small/",
            ]);
            lines.push(vec!["plot", input, "--overwrite", "-o", "pictures"]);
            lines.push(vec!["view", input, "--overwrite", "-o", "page.html"]);
        }
        lines.push(vec!["smooth", &file, "--overwrite", "-o", "s.npy"]);
        lines.push(vec!["follow", "path.csv", "-o", "f.npy"]);
        lines.push(vec![
            "route",
            "flat.obj",
            "--pairs",
            "pairs.txt",
            "-o",
            "ways/",
        ]);
        lines.push(vec![
            "route",
            "flat.obj",
            "--walkers",
            "walkers.csv",
            "-o",
            "ways/",
        ]);
        for mesh in ["word.obj", "word.ply"] {
            lines.push(vec![
                "route",
                mesh,
                "--start-point",
                "0,0,0",
                "--end-point",
                "1,0,0",
                "-o",
                "w.csv",
            ]);
        }
        lines.push(vec!["eval", "--files-from", "list.txt", "-o", "o/"]);
        lines.push(vec!["check", "results"]);
        lines.push(vec!["eval", "folder", "-o", "results", "--resume"]);
        lines.push(vec!["merge", "results"]);
        lines.push(vec!["info", name]);
        lines.push(vec!["eval", "a.dat", "-m", name]);
        lines.push(vec![
            "eval",
            "a.dat",
            "--device",
            name,
            "--overwrite",
            "-o",
            "o.npy",
        ]);
        lines.push(vec!["explain", name]);
        lines.push(vec![name]);
        for line in lines {
            if line.contains(&&*file) && !is_named {
                continue;
            }
            let run = attempt(folder.path(), &line);
            is_quiet(&run.words, &line);
            is_quiet(&String::from_utf8_lossy(&run.out), &line);
            seen += usize::from(run.words.contains("FORGED"));
        }
    }
    assert!(seen > 40, "only {seen} messages had a name at all");
}

/// Values that a field of a file is not expected to have.
const NUMBERS: [&str; 14] = [
    "-1",
    "0",
    "1",
    "2147483648",
    "4294967295",
    "4294967296",
    "18446744073709551615",
    "1e39",
    "-1e308",
    "1e-320",
    "null",
    "[]",
    "{}",
    "\"\"",
];

/// Damages the structure of a file: numbers in JSON and text, words of four and eight bytes in binary data,
/// repeated and missing parts.
fn mutated(bytes: &[u8], random: &mut Random) -> Vec<u8> {
    let mut below = |limit: usize| random.next() as usize % limit.max(1);
    let mut bytes = bytes.to_vec();
    let is_text = !bytes.contains(&0);
    for _ in 0..1 + below(3) {
        // Changes a number of the text, or of the JSON of a GLB.
        let starts: Vec<usize> = (1..bytes.len())
            .filter(|&i| {
                bytes[i].is_ascii_digit()
                    && matches!(bytes[i - 1], b' ' | b':' | b',' | b'[' | b'(' | b'\n')
            })
            .collect();
        let kind = below(6);
        match kind {
            0..=2 if !starts.is_empty() && (is_text || bytes.starts_with(b"glTF")) => {
                let start = starts[below(starts.len())];
                let length = bytes[start..]
                    .iter()
                    .take_while(|b| b.is_ascii_digit())
                    .count();
                let number = NUMBERS[below(NUMBERS.len())];
                bytes.splice(start..start + length, number.bytes());
            }
            3 if is_text => {
                // Repeats or removes a line, or an object of JSON.
                let mark = if bytes.starts_with(b"{") { b'{' } else { b'\n' };
                let marks: Vec<usize> = (0..bytes.len()).filter(|&i| bytes[i] == mark).collect();
                if marks.len() > 1 {
                    let from = below(marks.len() - 1);
                    let part = bytes[marks[from]..marks[from + 1]].to_vec();
                    let twice = below(2) == 0;
                    let to = marks[from] + if twice { 0 } else { part.len() };
                    bytes.splice(marks[from]..to, if twice { part } else { Vec::new() });
                }
            }
            4 if bytes.len() > 16 && !is_text => {
                let offset = below(bytes.len() - 8);
                let words = [0, 1, u32::MAX, i32::MAX as u32, 1 << 31, 0xffff, 1 << 20];
                bytes[offset..offset + 4].copy_from_slice(&words[below(words.len())].to_le_bytes());
            }
            5 => bytes.truncate(below(bytes.len())),
            _ if !bytes.is_empty() => {
                let offset = below(bytes.len());
                bytes[offset] = below(256) as u8;
            }
            _ => {}
        }
    }
    bytes
}

/// Mutated files of every format through commands: each ends within the limit, with a code, and says why.
#[test]
fn mutated_files_end_with_a_code() {
    let mut random = Random(38_200);
    let body = root().join("formats/tests/fixtures/body");
    let folders = FORMATS.iter().map(|format| cases::folder(format.name));
    let mut seeds = Vec::new();
    for folder in folders.chain([body]) {
        let files = fs::read_dir(folder).unwrap();
        let files = files.map(|file| file.unwrap().path());
        seeds.extend(files.filter(|file| file.is_file()));
    }
    seeds.sort();
    let temporary = sample_folder();
    fs::write(
        temporary.path().join("flat.obj"),
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n",
    )
    .unwrap();
    fs::write(
        temporary.path().join("path.csv"),
        "t,x,y,z,ux,uy,uz\n0,0,0,0,0,1,0\n1,1,0,0,,,\n2,3,1,0,,,\n",
    )
    .unwrap();
    seeds.extend(["flat.obj", "path.csv"].map(|name| temporary.path().join(name)));
    let mut refused = 0;
    let count = 120 * times() as usize;
    for round in 0..count {
        let seed = &seeds[random.next() as usize % seeds.len()];
        let bytes = mutated(&fs::read(seed).unwrap(), &mut random);
        let extension = seed.extension().unwrap().to_str().unwrap();
        let name = format!("m.{extension}");
        fs::write(temporary.path().join(&name), &bytes).unwrap();
        let line: &[&str] = match (extension, round % 5) {
            ("obj", _) => &[
                "route",
                &name,
                "--start-point",
                "0,0,0",
                "--end-point",
                "1,1,0",
                "--overwrite",
                "-o",
                "w.csv",
            ],
            (_, 0) => &["info", "--json", &name],
            (_, 1) => &["eval", &name, "--fps", "9", "--overwrite", "-o", "o.npy"],
            (_, 2) => &["convert", &name, "--overwrite", "-o", "o.glb"],
            (_, 3) => &["plot", &name, "--fps", "9", "--overwrite", "-o", "o.svg"],
            _ => &[
                "follow",
                &name,
                "--seconds",
                "2",
                "--overwrite",
                "-o",
                "o.npy",
            ],
        };
        let run = attempt(temporary.path(), line);
        assert!(
            run.code == 0 || !run.words.trim().is_empty(),
            "{line:?} says nothing"
        );
        refused += usize::from(run.code != 0);
    }
    assert!(
        refused * 4 > count,
        "only {refused} of {count} were refused"
    );
}

/// Inputs that once took minutes, or never ended.
#[test]
fn nothing_small_takes_long() {
    let folder = sample_folder();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    write("far.dat", "# 1 1\n0 1 0 0 0\n1000000000 0 1 0 0\n");
    write(
        "long.dat",
        &format!("# 1 1\n0 1 0 0 0\n{} 0 1 0 0\n", u32::MAX),
    );
    let mut nested = b"\x93NUMPY\x01\0\x80\0{'descr': ".to_vec();
    nested.extend(vec![b'['; 118]);
    fs::write(folder.path().join("nested.npy"), &nested).unwrap();
    // Five thousand nodes with meshes in a chain.
    let nodes: Vec<String> = (0..5000)
        .map(|node| match node {
            4999 => r#"{"mesh":0}"#.to_owned(),
            _ => format!(r#"{{"mesh":0,"children":[{}]}}"#, node + 1),
        })
        .collect();
    let mut text = animations([(0, 0), (0, 0)]);
    let meshes = format!(
        r#""meshes":[{{"primitives":[]}}],"nodes":[{}],"#,
        nodes.join(",")
    );
    text = text.replacen(r#""nodes":[{"name":"a"}],"#, &meshes, 1);
    write("chain.gltf", &text);
    // Each of these animations has a fault.
    let mut text = animations([(0, 0), (0, 7)]);
    let fault =
        r#",{"channels":[{"sampler":9,"target":{"node":0,"path":"rotation"}}],"samplers":[]}"#;
    text = text.replacen("]}]}", &format!("]}}{}]}}", fault.repeat(20_000)), 1);
    write("faults.gltf", &text);
    write(&"a".repeat(200), "");
    let stars = format!("{}b", "*a".repeat(40));
    let sparse = fs::File::create(folder.path().join("folder/sparse.dat")).unwrap();
    sparse.set_len(300 << 30).unwrap();
    fs::create_dir_all(folder.path().join("shards/manifest.d")).unwrap();
    let plan = format!(
        r#"{{"plan":"{0}","shards":{1},"inputs":{1},"shard_bytes":1,"outputs_sha256":"{0}","options":"","kernels_sha256":"{0}",
        "tumble":""}}"#,
        "0".repeat(64),
        u64::MAX
    );
    write("shards/manifest.d/plan.json", &plan);
    for (line, code) in [
        (&["eval", "folder", "-o", "out"][..], 3),
        (&["merge", "shards"], 4),
        (&["plot", "far.dat", "-o", "far.svg"], 2),
        (&["plot", "long.dat", "-o", "long.svg"], 2),
        (&["plot", "nested.npy", "-o", "n.svg"], 4),
        (&["render", "nested.npy", "-o", "n.gif"], 4),
        (&["view", "nested.npy", "-o", "n.html"], 4),
        (
            &["follow", "nested.npy", "--seconds", "1", "-o", "n.bvh"],
            4,
        ),
        (
            &[
                "route",
                "nested.npy",
                "--start-point",
                "0,0,0",
                "--end-point",
                "1,1,1",
                "-o",
                "n.csv",
            ],
            4,
        ),
        (
            &[
                "route",
                "chain.gltf",
                "--start-point",
                "0,0,0",
                "--end-point",
                "1,1,1",
                "-o",
                "n.csv",
            ],
            4,
        ),
        (&["info", "faults.gltf"], 3),
        (&["info", &stars], 4),
        (&["eval", "a.dat", "--tracks", &stars, "-o", "t.npy"], 2),
    ] {
        let started = Instant::now();
        let run = attempt(folder.path(), line);
        assert_eq!(run.code, code, "{line:?}: {}", run.words);
        let elapsed = started.elapsed();
        assert!(elapsed < Duration::from_secs(20), "{line:?}: {elapsed:?}");
    }
}

/// Velocities of channels with different samplers, a table that a library's decoder refuses, and errors
/// that no other test covers.
#[test]
fn faults_of_inputs_are_no_bugs() {
    let folder = sample_folder();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    let whole = animations([(0, 0), (0, 0)]);
    let mixed = whole
        .replacen(r#"{"name":"a"}"#, r#"{"name":"a"},{"name":"b"}"#, 1)
        .replacen(
            r#""path":"rotation"}}],"#,
            r#""path":"rotation"}},{"sampler":1,"target":{"node":1,"path":"rotation"}}],"#,
            1,
        )
        .replacen(
            r#""output":1}]"#,
            r#""output":1},{"input":0,"output":1,"interpolation":"STEP"}]"#,
            1,
        );
    write("mixed.gltf", &mixed);
    for quantity in ["velocity", "acceleration", "rotation"] {
        let line = [
            "eval",
            "mixed.gltf",
            "--animation",
            "0",
            "--quantity",
            quantity,
            "--explain-route",
            "--overwrite",
            "-o",
            "v.npy",
        ];
        let line = match quantity {
            "rotation" => [&line[..4], &line[6..]].concat(),
            _ => line.to_vec(),
        };
        let run = attempt(folder.path(), &line);
        assert_eq!(run.code, 0, "{quantity}: {}", run.words);
        for route in [": 1 track by slerp: ", ": 1 track by step: "] {
            assert!(run.words.contains(route), "{quantity}: {}", run.words);
        }
        let bytes = fs::read(folder.path().join("v.npy")).unwrap();
        let file = npyz::NpyFile::new(&bytes[..]).unwrap();
        let width = if quantity == "rotation" { 4 } else { 3 };
        assert_eq!((file.shape()[0], file.shape()[2]), (2, width), "{quantity}");
        let values: Vec<f32> = file.into_vec().unwrap();
        assert!(values.iter().all(|value| value.is_finite()));
        let second = &values[values.len() / 2..];
        if quantity != "rotation" {
            assert!(
                second.iter().all(|&value| value == 0.0),
                "a step stands still"
            );
        }
        if quantity == "velocity" {
            assert!(
                (values[2] - 1.2870).abs() < 1e-4,
                "an arc turns by so much in a second"
            );
        }
    }
    let mut output = String::new();
    write("flat.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    write("none.obj", "v 0 0 0\n");
    write("pairs.txt", "0 0 0 1\n");
    write("walkers.csv", "name,radius\nx,1\n");
    write("offsets.txt", "0 0 1\n");
    let array = format!(
        "{:117}\n",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 2, 2), }"
    );
    let net = [&b"\x93NUMPY\x01\0\x76\0"[..], array.as_bytes(), &[0; 32]].concat();
    fs::write(folder.path().join("net.npy"), &net).unwrap();
    // One row of four points is no surface.
    let mut row = net;
    row.truncate(128);
    let shape = row.windows(9).position(|part| part == b"(2, 2, 2)");
    let shape = shape.expect("the shape is in the header");
    row[shape..shape + 9].copy_from_slice(b"(1, 2, 3)");
    row.extend([0; 24]);
    fs::write(folder.path().join("row.npy"), row).unwrap();
    for (line, code) in [
        (
            &[
                "route",
                "none.obj",
                "--start-point",
                "0,0,0",
                "--end-point",
                "1,0,0",
                "-o",
                "w.csv",
            ][..],
            "E610",
        ),
        (
            &[
                "route",
                "net.npy",
                "--start-point",
                "0,0,0",
                "--end-point",
                "1,0,0",
                "-o",
                "w.csv",
            ],
            "E309",
        ),
        (
            &[
                "route",
                "row.npy",
                "--start-point",
                "0,0,0",
                "--end-point",
                "1,0,0",
                "-o",
                "w.csv",
            ],
            "E611",
        ),
        (
            &["route", "flat.obj", "--pairs", "pairs.txt", "-o", "ways/"],
            "E612",
        ),
        (
            &[
                "route",
                "flat.obj",
                "--walkers",
                "walkers.csv",
                "-o",
                "ways/",
            ],
            "E613",
        ),
        (&["info", "a.dat", "--offsets", "offsets.txt"], "E614"),
    ] {
        let run = attempt(folder.path(), line);
        let _ = writeln!(output, "{}", run.words);
        assert_eq!(run.code, 4, "{line:?}: {}", run.words);
        assert!(
            run.words.contains(&format!("error[{code}]")),
            "{line:?}: {}",
            run.words
        );
    }
}
