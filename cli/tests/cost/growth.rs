//! How the cost of reading grows with the input, for each format and each kind of its contents: keys, tracks, names,
//! clips, nodes, layers, topics, columns. Of twice as many parts, reading takes at most twice the instructions and twice
//! the memory; a square would be four times as many. Instructions are counted by valgrind, memory by the allocator.

use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

use glam::Quat;
use tumble::FrameRate;
use tumble_formats::FORMATS;
use tumble_formats::budget::{BASE, FACTOR};
use tumble_formats::feature::Feature;
use tumble_formats::format::{Format, FormatOption, MotionOptions, ReadOptions};
use tumble_formats::keyed::keyed;
use tumble_formats::motion::{Joint, Motion, Transform};

use crate::log::{LogBuilder, Message, transform};
use crate::{one_at_a_time, peak_of};

/// How many parts the files of a case have.
const SIZES: [usize; 3] = [128, 256, 512];

/// By how much the second doubling may cost more than the first: twice as much, sorting, and lists that grow.
const FACTOR_OF_TWICE: f64 = 2.6;

/// Instructions and bytes by which two doublings may differ for other reasons.
const SLACK: [f64; 2] = [1e6, 256e3];

/// Contents that are made in any number.
struct Case {
    format: &'static Format,
    kind: &'static str,
    make: Box<dyn Fn(usize) -> Vec<u8>>,
    expected: Expected,
}

/// Whether all files of a case must be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Expected {
    Read,
    /// Such files are refused if they take more than a file of their length may; below this limit the cost
    /// may be quadratic.
    ReadOrRefused,
}

/// A clip with as many tracks, keys, and letters in its names.
fn clip(index: usize, tracks: usize, keys: usize, letters: usize) -> Motion {
    let mut clip = Motion {
        name: Some(format!("clip{index}")),
        index,
        rate: FrameRate::new(30, 1).ok(),
        ..Motion::default()
    };
    let times: Vec<f64> = (0..keys).map(|key| key as f64 / 30.0).collect();
    for track in 0..tracks {
        let name = format!("{:x<letters$}{track}", "");
        let key = |key: usize| Quat::from_rotation_y((key % 7) as f32 * 0.1 + track as f32);
        let keys: Vec<Quat> = (0..keys).map(key).collect();
        clip.set.push(&name, &times, &keys).unwrap();
        // Half of the joints form a chain; the others are children of the root.
        let parent = (track > 0).then(|| if track % 2 == 0 { track - 2 } else { 0 });
        clip.skeleton.push(Joint {
            parent,
            rest: Transform::default(),
        });
    }
    clip
}

/// The clips as a file; `None` where the format cannot hold them.
fn written(format: &Format, clips: &[Motion]) -> Option<Vec<u8>> {
    let samples: Vec<_> = clips.iter().map(|clip| keyed(clip).unwrap()).collect();
    let sampled = samples.iter().zip(clips);
    let sampled: Vec<_> = sampled
        .map(|(samples, clip)| samples.of(clip, clip.rate, &[]))
        .collect();
    let mut out = Vec::new();
    let options = MotionOptions {
        name: "t".to_owned(),
        format: format.name.to_owned(),
        ..MotionOptions::default()
    };
    let done = format.write_clips(&sampled, &options, &mut out);
    done.is_ok().then_some(out)
}

/// A case for each kind of content that a format can write: keys, tracks, names, clips.
fn written_cases() -> Vec<Case> {
    let mut cases = Vec::new();
    for &format in FORMATS.iter().filter(|format| format.writes_clips()) {
        let mut add = |kind, make: fn(usize) -> Vec<Motion>| {
            let make = Box::new(move |count| written(format, &make(count)).expect(kind));
            cases.push(Case {
                format,
                kind,
                make,
                expected: Expected::Read,
            });
        };
        add("keys", |count| vec![clip(0, 1, count, 0)]);
        if format.supports(Feature::SeveralTracks) {
            add("tracks", |count| vec![clip(0, count, 2, 0)]);
        }
        if format.supports(Feature::TrackNames) {
            add("names", |count| vec![clip(0, count / 4, 2, 400)]);
        }
        if format.supports(Feature::SeveralClips) {
            add("clips", |count| {
                (0..count / 4).map(|index| clip(index, 2, 2, 40)).collect()
            });
        }
    }
    cases
}

/// An FBX file with so many nodes, layers and stacks, each with a curve; the keys of each layer have other times.
fn fbx([nodes, layers, stacks]: [usize; 3], letters: usize) -> Vec<u8> {
    const SECOND: usize = 46_186_158_000;
    let mut objects = String::new();
    let mut links = String::new();
    for node in 1..=nodes {
        let name = format!("{:x<letters$}{node}", "");
        let _ = writeln!(
            objects,
            "Model: {node}, \"Model::{name}\", \"LimbNode\" {{\n}}"
        );
        let _ = writeln!(links, "C: \"OO\",{node},0");
    }
    let mut next = 1_000_000;
    let mut id = || {
        next += 1;
        next
    };
    for stack in 0..stacks {
        let stack_id = id();
        let _ = writeln!(
            objects,
            "AnimationStack: {stack_id}, \"AnimStack::s{stack}\", \"\" {{\nProperties70:  {{\n\
             P: \"LocalStop\", \"KTime\", \"Time\", \"\",{SECOND}\n}}\n}}"
        );
        for layer in 0..layers {
            let layer_id = id();
            let _ = writeln!(
                objects,
                "AnimationLayer: {layer_id}, \"AnimLayer::l\", \"\" {{\n}}"
            );
            let _ = writeln!(links, "C: \"OO\",{layer_id},{stack_id}");
            for node in 1..=nodes {
                let (values, curve) = (id(), id());
                let middle = 1 + (layer * 7919) % (SECOND - 2);
                let _ = writeln!(
                    objects,
                    "AnimationCurveNode: {values}, \"AnimCurveNode::T\", \"\" {{\n}}\n\
                     AnimationCurve: {curve}, \"AnimCurve::\", \"\" {{\nDefault: 0\nKeyVer: 4009\n\
                     KeyTime: *3 {{\na: 0,{middle},{SECOND}\n}}\nKeyValueFloat: *3 {{\na: 0,7,3\n}}\n\
                     KeyAttrFlags: *1 {{\na: 4\n}}\nKeyAttrDataFloat: *4 {{\na: 0,0,218434821,0\n}}\n\
                     KeyAttrRefCount: *1 {{\na: 3\n}}\n}}"
                );
                let _ = writeln!(
                    links,
                    "C: \"OO\",{values},{layer_id}\nC: \"OP\",{values},{node}, \"Lcl Translation\"\n\
                     C: \"OP\",{curve},{values}, \"d|X\""
                );
            }
        }
    }
    format!(
        "; FBX 7.4.0 project file\nFBXHeaderExtension:  {{\nFBXHeaderVersion: 1003\nFBXVersion: 7400\n}}\n\
         Objects:  {{\n{objects}}}\nConnections:  {{\n{links}}}\n"
    )
    .into_bytes()
}

/// A glTF file with a node of a long name, which each of the animations moves.
fn gltf(animations: usize, letters: usize) -> Vec<u8> {
    let one = r#"{"samplers":[{"input":0,"output":1}],"channels":[{"sampler":0,"target":{"node":0,"path":"rotation"}}]}"#;
    let all = vec![one; animations].join(",");
    let name = "x".repeat(letters);
    let parts = format!(
        r#""bufferViews":[{{"buffer":0,"byteLength":8}},{{"buffer":0,"byteOffset":8,"byteLength":32}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":2,"type":"SCALAR"}},
        {{"bufferView":1,"componentType":5126,"count":2,"type":"VEC4"}}],"nodes":[{{"name":"{name}"}}],"animations":[{all}]"#
    );
    crate::bombs::gltf(&crate::bombs::keys(2), &parts)
}

/// An MCAP file with so many topics, messages of each, and letters in the name of each topic's schema.
fn mcap(topics: usize, messages: usize, letters: usize) -> Vec<u8> {
    let mut log = LogBuilder::new();
    for topic in 0..topics {
        let schema = match letters {
            0 => "geometry_msgs/msg/PoseStamped".to_owned(),
            _ => format!("other/msg/{}", "X".repeat(letters)),
        };
        let channel = log.topic(&format!("/topic{topic}"), &schema, "cdr");
        for message in 0..messages as u64 {
            let stamp = 1_000_000_000 + message * 10_000_000;
            let pose = Message::stamped(stamp, "map").pose(message as f64, 0.1);
            log.message(channel, stamp, &pose.data());
        }
    }
    log.finish()
}

/// An MCAP file with bodies that hang on each other, in one topic.
fn transforms(bodies: usize) -> Vec<u8> {
    let mut log = LogBuilder::new();
    let channel = log.topic("/tf", "tf2_msgs/msg/TFMessage", "cdr");
    for message in 0..2_u64 {
        for body in 0..bodies {
            let stamp = 1_000_000_000 + message * 10_000_000;
            let [parent, child] = [body, body + 1].map(|body| format!("b{body}"));
            log.message(channel, stamp, &transform(stamp, [&parent, &child], 1.0));
        }
    }
    log.finish()
}

/// A CSV file with so many unknown columns, and so many tracks below each other.
fn csv(others: usize, tracks: usize) -> Vec<u8> {
    let mut text = "track,t,qx,qy,qz,qw".to_owned();
    for other in 0..others {
        let _ = write!(text, ",other{other}");
    }
    text += "\n";
    for time in 0..2 {
        for track in 0..tracks {
            let _ = write!(text, "track{track},{time},0,0,0,1");
            text += &",0".repeat(others);
            text += "\n";
        }
    }
    text.into_bytes()
}

/// Files that are made to be bad for their readers.
fn bad_cases() -> Vec<Case> {
    use Expected::{Read, ReadOrRefused};

    let mut cases = Vec::new();
    let mut add = |format, kind, expected, make: fn(usize) -> Vec<u8>| {
        cases.push(Case {
            format: Format::named(format).unwrap(),
            kind,
            make: Box::new(make),
            expected,
        });
    };
    add("fbx", "nodes", Read, |count| fbx([count, 1, 1], 0));
    add("fbx", "layers", ReadOrRefused, |count| {
        fbx([1, count / 10, 1], 0)
    });
    add("fbx", "stacks", Read, |count| fbx([1, 1, count], 0));
    add("fbx", "names", Read, |count| fbx([count / 4, 1, 1], 400));
    add("gltf", "animations", Read, |count| gltf(count, 10));
    add("mcap", "topics", Read, |count| mcap(count, 2, 0));
    add("mcap", "messages", Read, |count| mcap(1, count, 0));
    add("mcap", "schemas", ReadOrRefused, |count| {
        mcap(count, 1, 400)
    });
    add("mcap", "transforms", Read, transforms);
    add("csv", "columns", Read, |count| csv(count, 1));
    add("csv", "tracks below each other", Read, |count| {
        csv(0, count)
    });
    cases
}

fn cases() -> Vec<Case> {
    let mut cases = written_cases();
    cases.extend(bad_cases());
    cases
}

/// Options with which the files of a format are read.
fn options(format: &Format) -> ReadOptions {
    let rate = FrameRate::new(30, 1).ok();
    ReadOptions {
        // A format without uneven times may have no times at all.
        source_rate: rate.filter(|_| {
            format.takes(FormatOption::SourceRate) && !format.supports(Feature::UnevenTimes)
        }),
        ..ReadOptions::default()
    }
}

/// Reads a file. Valgrind finds its cost by its name.
#[inline(never)]
fn measured(format: &Format, path: &Path) -> (usize, String) {
    let read = format.open(std::hint::black_box(path), &options(format));
    match read {
        Ok(loaded) => {
            let refused = loaded.refused.first();
            let why = refused.map_or(String::new(), ToString::to_string);
            (loaded.clips.len(), why)
        }
        Err(fault) => (0, fault.to_string()),
    }
}

/// The file of a case; the first cases have the first numbers.
fn file(folder: &Path, number: usize, case: &Case, size: usize) -> std::path::PathBuf {
    folder.join(format!("{number}-{size}.{}", case.format.name))
}

const FILES: &str = "TUMBLE_GROWTH_FILES";

/// Reads the files one after the other; valgrind runs it.
#[test]
#[ignore = "reads files that another test has made"]
fn read_all() {
    let folder = std::env::var(FILES).expect("set by the other test");
    for (number, case) in cases().iter().enumerate() {
        for size in SIZES {
            measured(case.format, &file(Path::new(&folder), number, case, size));
        }
    }
}

/// The instructions of each file, in order; `None` where valgrind is not installed, which in CI it must be.
fn instructions(folder: &Path) -> Option<Vec<u64>> {
    let run = Command::new("valgrind")
        .args(["--tool=callgrind", "--dump-line=no"])
        .args([
            "--zero-before=cost::growth::measured",
            "--dump-after=cost::growth::measured",
        ])
        .arg(format!(
            "--callgrind-out-file={}",
            folder.join("costs").display()
        ))
        .arg(std::env::current_exe().unwrap())
        .args([
            "growth::read_all",
            "--exact",
            "--ignored",
            "--test-threads",
            "1",
        ])
        .env(FILES, folder)
        .env("RAYON_NUM_THREADS", "1")
        .output();
    let output = match run {
        Ok(output) => output,
        Err(error) => {
            assert!(std::env::var_os("CI").is_none(), "valgrind: {error}");
            eprintln!("valgrind: {error}: instructions are not counted");
            return None;
        }
    };
    let words = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{words}");
    let counts = (1..).map_while(|number| {
        let costs = std::fs::read_to_string(folder.join(format!("costs.{number}"))).ok()?;
        let totals = costs.lines().find_map(|line| line.strip_prefix("totals: "));
        Some(totals.expect("totals").trim().parse().expect("a number"))
    });
    Some(counts.collect())
}

#[test]
fn twice_as_much_takes_twice_as_much_to_read() {
    let folder = tempfile::tempdir().unwrap();
    let cases = cases();
    let mut memory: Vec<[f64; 3]> = Vec::new();
    {
        let _one = one_at_a_time();
        for (number, case) in cases.iter().enumerate() {
            let of = format!("{}, {}", case.format.name, case.kind);
            memory.push(SIZES.map(|size| {
                let path = file(folder.path(), number, case, size);
                let bytes = (case.make)(size);
                std::fs::write(&path, &bytes).unwrap();
                let ((clips, why), peak) = peak_of(|| measured(case.format, &path));
                let is_whole = clips > 0 && why.is_empty();
                let may_refuse = case.expected == Expected::ReadOrRefused;
                assert!(is_whole || may_refuse, "{of}: {why}");
                let limit = bytes.len() as u64 * (FACTOR + 4) + BASE;
                assert!(peak as u64 <= limit, "{of}: {peak} bytes of {limit}");
                peak as f64
            }));
        }
    }
    let counted = instructions(folder.path());
    let mut wrong = Vec::new();
    let mut judge = |case: &Case, kind: &str, costs: [f64; 3], slack: f64| {
        let [once, again] = [costs[1] - costs[0], costs[2] - costs[1]];
        let line = format!(
            "{}, {}: {kind} {costs:.0?}, {:.2} times",
            case.format.name,
            case.kind,
            again / once
        );
        println!("{line}");
        if case.expected == Expected::Read && again > FACTOR_OF_TWICE * once + slack {
            wrong.push(line);
        }
    };
    for (case, &costs) in cases.iter().zip(&memory) {
        judge(case, "bytes", costs, SLACK[1]);
    }
    if let Some(counts) = counted {
        assert_eq!(counts.len(), cases.len() * SIZES.len());
        for (case, counts) in cases.iter().zip(counts.chunks(SIZES.len())) {
            let costs = [0, 1, 2].map(|index| counts[index] as f64);
            judge(case, "instructions", costs, SLACK[0]);
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
