//! The fuzz targets of `fuzz/`, without `cargo fuzz`: inputs are mutated at random, and
//! those that lead to something new are mutated further.
//!
//! `FUZZ_SECONDS` says how long each target runs; 600 is a run on demand, `scripts/test.sh`
//! takes 3. A failing input is kept under `target/fuzz/`.

#![allow(clippy::disallowed_methods)] // as in tests/all.rs

#[path = "../../formats/tests/cases.rs"]
mod cases;
#[path = "../../tests/support/mod.rs"]
mod support;
#[path = "../../fuzz/src/targets.rs"]
mod targets;

use std::collections::{BTreeSet, HashSet};
use std::fs;
use std::panic::{RefUnwindSafe, catch_unwind};
use std::path::Path;
use std::time::{Duration, Instant};

use support::Random;
use tumble_formats::FORMATS;

/// Longer inputs find no more, and take longer.
const LONGEST: usize = 4096;

/// A target: from bytes to a hash of the outcome.
type Target<'a> = &'a (dyn Fn(&[u8]) -> u64 + RefUnwindSafe);

/// Runs a target on mutations of `corpus`; `words` are pieces that its inputs are made of.
fn fuzz(name: &str, target: Target<'_>, corpus: Vec<Vec<u8>>, words: &[&str]) {
    let words: Vec<&[u8]> = words.iter().map(|word| word.as_bytes()).collect();
    fuzz_for(1.0, name, target, corpus, &words);
}

/// As [`fuzz`], for a quarter of the time: files whose tests also damage them.
fn fuzz_files(name: &str, target: Target<'_>, corpus: Vec<Vec<u8>>, words: &[&str]) {
    let words: Vec<&[u8]> = words.iter().map(|word| word.as_bytes()).collect();
    fuzz_for(0.25, name, target, corpus, &words);
}

fn fuzz_for(share: f64, name: &str, target: Target<'_>, mut corpus: Vec<Vec<u8>>, words: &[&[u8]]) {
    let seconds = std::env::var("FUZZ_SECONDS").map_or(1.0, |text| text.parse().unwrap());
    let seconds: f64 = share * seconds;
    let mut random = Random(name.bytes().map(u64::from).sum());
    let mut seen = HashSet::new();
    for input in &corpus {
        seen.insert(run(name, target, input));
    }
    let started = Instant::now();
    let mut runs = 0u64;
    while started.elapsed() < Duration::from_secs_f64(seconds) {
        let mut input = corpus[random.next() as usize % corpus.len()].clone();
        for _ in 0..1 + random.next() % 6 {
            mutate(&mut input, &mut random, &corpus, words);
        }
        let is_new = seen.insert(run(name, target, &input));
        if is_new && corpus.len() < 20_000 {
            corpus.push(input);
        }
        runs += 1;
    }
    println!("{name}: {runs} runs, {} kinds of outcome", seen.len());
    assert!(
        seen.len() > 4,
        "{name}: only {} kinds of outcome",
        seen.len()
    );
}

/// If the target panics, its input is kept.
fn run(name: &str, target: Target<'_>, input: &[u8]) -> u64 {
    catch_unwind(|| target(input)).unwrap_or_else(|_| {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../target/fuzz");
        fs::create_dir_all(&folder).unwrap();
        let file = folder.join(name);
        fs::write(&file, input).unwrap();
        panic!("{name} fails on the input in {}", file.display());
    })
}

fn mutate(input: &mut Vec<u8>, random: &mut Random, corpus: &[Vec<u8>], words: &[&[u8]]) {
    let mut below = |limit: usize| random.next() as usize % limit.max(1);
    let offset = below(input.len());
    match below(9) {
        0 if !input.is_empty() => input[offset] ^= 1 << below(8),
        1 if !input.is_empty() => input[offset] = below(256) as u8,
        2 => input.insert(offset, below(256) as u8),
        3 if !input.is_empty() => {
            let end = (offset + 1 + below(16)).min(input.len());
            input.drain(offset..end);
        }
        4 if !input.is_empty() => {
            let end = (offset + 1 + below(64)).min(input.len());
            let piece = input[offset..end].to_vec();
            let to = below(input.len());
            input.splice(to..to, piece);
        }
        5 => input.truncate(offset),
        6 => {
            let other = &corpus[below(corpus.len())];
            let from = below(other.len());
            let piece = other[from..(from + below(64)).min(other.len())].to_vec();
            input.splice(offset..offset, piece);
        }
        _ if !words.is_empty() => {
            let word = words[below(words.len())].iter().copied();
            let end = (offset + below(3) * below(8)).min(input.len());
            input.splice(offset..end, word);
        }
        _ => {}
    }
    input.truncate(LONGEST);
}

/// Every good and bad file of a format's fixtures, by the format's name and extensions.
fn fixtures(format: &str) -> Vec<Vec<u8>> {
    let paths = fs::read_dir(cases::folder(format))
        .unwrap()
        .map(|entry| entry.unwrap().path());
    let of = tumble_formats::Format::of;
    let files = paths.filter(|path| of(path).is_some_and(|of| of.name == format));
    files.map(|path| fs::read(path).unwrap()).collect()
}

/// Every format of the table, each for about a third of the time: their tests also damage files.
#[test]
fn formats() {
    for &format in FORMATS {
        let mut corpus = fixtures(format.name);
        // The fuzzer truncates long logs, and a truncated chunk cannot be read. Therefore logs
        // without chunks are added.
        let logs = corpus.iter().filter(|file| file.starts_with(LOG));
        let unpacked: Vec<Vec<u8>> = logs.map(|log| unpacked(log)).collect();
        corpus.extend(unpacked);
        let words = words(&corpus);
        let words: Vec<&[u8]> = words.iter().map(Vec::as_slice).collect();
        let target = |bytes: &[u8]| targets::formats::format(format, bytes);
        fuzz_for(0.3, format.name, &target, corpus, &words);
    }
}

/// The words that the files of a format are made of, with extreme numbers, lines and lengths.
fn words(corpus: &[Vec<u8>]) -> Vec<Vec<u8>> {
    let everywhere: [&[u8]; 24] = [
        b"\n",
        b"\r\n",
        b"\t",
        b" ",
        b",",
        b"#",
        b"\"",
        b"{",
        b"}",
        b"[",
        b"-1",
        b"0",
        b"1.5e-3",
        b"1e39",
        b"1e-400",
        b"nan",
        b"inf",
        b"18446744073709551615",
        b"\xef\xbb\xbf",
        b"\xc2\xa0",
        b"\0",
        b"\0\0\0\0",
        b"\x01\0\0\0\0\0\0\0",
        b"\xff\xff\xff\xff",
    ];
    let mut words: BTreeSet<Vec<u8>> = everywhere.map(<[u8]>::to_vec).into();
    for file in corpus {
        let lines = file.split_inclusive(|&byte| byte == b'\n');
        let parts = file.split(|byte| !byte.is_ascii_graphic());
        let pieces = lines
            .chain(parts)
            .filter(|part| (2..=48).contains(&part.len()));
        words.extend(pieces.map(<[u8]>::to_vec));
    }
    words.into_iter().collect()
}

/// How a log of MCAP begins.
const LOG: &[u8] = b"\x89MCAP0\r\n";

/// The first records of a log whose first chunk is not compressed, without the chunk.
fn unpacked(log: &[u8]) -> Vec<u8> {
    let mut at = 8;
    while let Some(&kind) = log.get(at) {
        let length = log
            .get(at + 1..at + 9)
            .and_then(|bytes| bytes.first_chunk());
        let Some(length) = length.map(|bytes| u64::from_le_bytes(*bytes) as usize) else {
            break;
        };
        if kind == 6 && log.get(at + 37..at + 41) == Some(&[0; 4]) {
            let records = &log[at + 9 + 40..(at + 9 + length).min(log.len())];
            return [&log[..8], records].concat();
        }
        at = at.saturating_add(9).saturating_add(length);
    }
    log.to_vec()
}

#[test]
fn outputs() {
    let seeds = (0..32u8).map(|i| (0..200).map(|j| i.wrapping_mul(31) ^ j).collect());
    fuzz("outputs", &targets::outputs, seeds.collect(), &[]);
}

#[test]
fn arguments() {
    use clap::CommandFactory;
    let program = tumble_cli::Arguments::command();
    let mut words: Vec<String> = [
        "\n",
        "a.dat",
        "o.npy",
        "-",
        "--",
        "=",
        "0",
        "-1",
        "1e9",
        "nan",
        "30000/1001",
        "256MiB",
        "1e400",
        "\u{fffd}",
        "all",
        "x=y",
    ]
    .map(str::to_owned)
    .into();
    let mut seeds = vec![b"eval\na.dat\n-o\no.npy".to_vec()];
    for command in program.get_subcommands() {
        words.push(format!("{}\n", command.get_name()));
        seeds.push(command.get_name().into());
        for argument in command.get_arguments() {
            words.extend(argument.get_long().map(|long| format!("\n--{long}\n")));
            words.extend(argument.get_short().map(|short| format!("\n-{short}")));
            let values = argument.get_possible_values();
            words.extend(values.iter().map(|value| format!("\n{}", value.get_name())));
        }
    }
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    fuzz("arguments", &targets::arguments, seeds, &words);
}

#[test]
fn frames() {
    let seeds = (0..32u8).map(|i| (0..64).map(|j| i.wrapping_mul(57) ^ (j * 3)).collect());
    let words = [
        "30000/1001",
        "1e-9",
        "24",
        "1/0",
        "0",
        "1e308",
        "\u{fa}",
        "\u{fd}",
    ];
    fuzz("frames", &targets::frames, seeds.collect(), &words);
}

#[test]
fn tracks() {
    let seeds = (0..64u8).map(|i| {
        let wave = |j: u8| i.wrapping_mul(j).wrapping_mul(37) ^ j.wrapping_mul(11);
        [i, 0].into_iter().chain((0..160).map(wave)).collect()
    });
    fuzz("tracks", &targets::tracks, seeds.collect(), &[]);
}

#[test]
fn spirv() {
    let expressions = [
        "a + b",
        "a * b - a",
        "-a * f32(i32(7))",
        "select(a, b, a < b)",
        "a / b",
        "sqrt(a)",
        "fma(a, b, a)",
        "bitcast<f32>(bitcast<u32>(a) ^ 5u)",
    ];
    let seeds = expressions.map(kernel_of);
    assert!(seeds.iter().all(|seed| seed.len() < LONGEST));
    let words = ["\u{3}\u{2}#\u{7}", "\0\0\0\0", "\u{1}\0\0\0"];
    fuzz("spirv", &targets::spirv, seeds.into(), &words);
}

/// A small shader, as bytes.
fn kernel_of(expression: &str) -> Vec<u8> {
    use naga::valid::{Capabilities, ValidationFlags, Validator};

    let source = format!(
        "@group(0) @binding(0) var<storage, read_write> values: array<f32>;
         @compute @workgroup_size(1) fn main() {{
             let a = values[0]; let b = values[1];
             values[2] = {expression};
         }}"
    );
    let module = naga::front::wgsl::parse_str(&source).unwrap();
    let info = Validator::new(ValidationFlags::all(), Capabilities::all())
        .validate(&module)
        .unwrap();
    let options = naga::back::spv::Options::default();
    let words = naga::back::spv::write_vec(&module, &info, &options, None).unwrap();
    words.iter().flat_map(|word| word.to_le_bytes()).collect()
}

#[test]
fn surfaces() {
    let words = [
        "v 0 0 0\n",
        "v 1 0 0\n",
        "v 0 1 0\n",
        "f 1 2 3\n",
        "f -1 -2 -3\n",
        "f 1/1 2/2 3/3\n",
        "usemtl\n",
        "o \n",
        "\\\n",
        "nan",
        "1e300",
        "4294967296",
        "ply\n",
        "format ascii 1.0\n",
        "format binary_little_endian 1.0\n",
        "element vertex 3\n",
        "element face 1\n",
        "property list uchar int vertex_indices\n",
        "end_header\n",
        "3 0 1 2\n",
        "\"mesh\":0",
        "\"primitives\":[{\"attributes\":{\"POSITION\":1}}]",
        "\"indices\":0",
        "\"mode\":5",
        "\"scene\":0",
    ];
    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
               property float z\nelement face 1\nproperty list uchar int vertex_indices\n\
               end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    let gltf = r#"{"asset":{"version":"2.0"},"nodes":[{"mesh":0}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}],
        "bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"byteLength":36,
        "uri":"data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]}"#;
    let mut seeds: Vec<Vec<u8>> = vec![
        b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n".to_vec(),
        ply.into(),
        gltf.into(),
    ];
    seeds.extend(fixtures("glb"));
    fuzz_files("surfaces", &targets::surfaces::surfaces, seeds, &words);
}

/// Files of robots, of each kind and with its elements: whatever a file states about bodies, the
/// tree stays valid.
#[test]
fn robots() {
    let mjcf = r#"<mujoco model="m"><compiler angle="radian" eulerseq="zyx"/><default><joint axis="0 1 0"/>
        <default class="c"><joint range="-1 1"/></default></default><worldbody>
        <body name="a" pos="0 0 1" euler="0.1 0.2 0.3"><freejoint/><inertial pos="0 0 .1" mass="1"/>
        <frame pos="0 1 0"><body name="b" childclass="c"><joint name="h" ref="0.5" pos="0 0 .1"/>
        <joint name="s" type="slide"/></body></frame><body><joint type="ball" name="l"/></body></body></worldbody>
        <equality><joint joint1="h" joint2="s"/></equality>
        <keyframe><key name="home" qpos="0 0 1 1 0 0 0 0 0 1 0 0 0"/></keyframe></mujoco>"#;
    let urdf = r#"<robot name="u"><link name="a"/><link name="b"><inertial><origin xyz="0 0 .1"/></inertial></link>
        <link name="c"/><joint name="h" type="revolute"><parent link="a"/><child link="b"/><origin xyz="0 0 1" rpy="0 1 0"/>
        <axis xyz="0 1 0"/><limit lower="-1" upper="1"/></joint><joint name="m" type="continuous"><parent link="b"/>
        <child link="c"/><mimic joint="h" multiplier="2" offset="1"/></joint></robot>"#;
    for (name, seed) in [("mjcf", mjcf), ("urdf", urdf)] {
        let corpus = vec![seed.as_bytes().to_vec()];
        let mut words = words(&corpus);
        words.extend(
            seed.split_inclusive('>')
                .map(|element| element.trim().as_bytes().to_vec()),
        );
        let words: Vec<&[u8]> = words.iter().map(Vec::as_slice).collect();
        fuzz_for(0.3, name, &targets::robots::robot, corpus, &words);
    }
}

/// Also headers that nest, and that say they are longer than any file.
#[test]
fn paths_and_numbers() {
    let array = |shape: &str, numbers: usize| {
        let dictionary = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': {shape}, }}");
        let header = format!("{dictionary:117}\n");
        let start = &b"\x93NUMPY\x01\0\x76\0"[..];
        [start, header.as_bytes(), &vec![0; 4 * numbers]].concat()
    };
    let mut seeds = vec![
        array("(1, 3, 3)", 9),
        array("(2, 2, 3)", 12),
        b"\x93NUMPY\x02\0\xff\xff\xff\xff".to_vec(),
        [&b"\x93NUMPY\x01\0\x80\0{'descr': "[..], &[b'['; 118]].concat(),
    ];
    let words = [
        "'<f8'",
        "'>f4'",
        "'<f2'",
        "True",
        "(2, 2, 3)",
        "(99999999999, 4, 3)",
        "((",
        "[[[[",
        "{",
        "}",
    ];
    let target = &targets::surfaces::numbers;
    fuzz_files("numbers", target, seeds.clone(), &words);
    seeds.push(b"t,x,y,z,ux,uy,uz\n0,0,0,0,0,1,0\n1,1,0,0,,,\n".to_vec());
    seeds.push(b"x,y,z\n0,0,0\n1,1,0\n".to_vec());
    let words = [
        "t,",
        "x,y,z\n",
        "0,0,0,0\n",
        "1e39",
        "nan",
        "-1",
        ",,,",
        "\u{feff}",
        "(1, 3, 3)",
        "'<f8'",
    ];
    fuzz_files("paths", &targets::surfaces::paths, seeds, &words);
}
