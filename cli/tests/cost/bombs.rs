//! Small inputs that claim to be large: the memory for reading one is bounded by its length, measured by the allocator.
//! Earlier versions used gigabytes for some of them.

use std::fmt::Write as _;
use std::io::Write as _;

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use flate2::write::DeflateEncoder;
use flate2::{Compression, FlushCompress};
use glam::Quat;
use tumble_formats::FORMATS;
use tumble_formats::budget::{BASE, FACTOR};
use tumble_formats::bvh;
use tumble_formats::format::{FormatOption, MotionOptions, ReadOptions};
use tumble_formats::gltf::meshes::triangles_of;
use tumble_formats::gltf::read_gltf;
use tumble_formats::keyed::keyed;
use tumble_formats::motion::{Joint, Motion, Transform};
use tumble_formats::npz::{read_npy, read_npz};
use tumble_formats::path::{Pace, read_paths};
use tumble_formats::{Code, Diagnostic, Limits};

use crate::{cases, one_at_a_time, peak_of};

/// The refusal of an input, which takes no more than its length allows.
fn refusal<T>(length: usize, read: impl FnOnce() -> Result<T, Diagnostic>) -> Diagnostic {
    let (read, peak) = peak_of(read);
    let limit = length as u64 * (FACTOR + 4) + BASE;
    assert!(
        peak as u64 <= limit,
        "{peak} bytes for an input of {length}, which gets {limit}"
    );
    match read {
        Ok(_) => panic!("{length} bytes were read, in {peak}"),
        Err(refusal) => refusal,
    }
}

/// A glTF file of these parts, whose only buffer has these bytes.
pub(crate) fn gltf(buffer: &[u8], parts: &str) -> Vec<u8> {
    let data = BASE64_STANDARD.encode(buffer);
    let length = buffer.len();
    format!(
        r#"{{"asset":{{"version":"2.0"}},"buffers":[{{"byteLength":{length},"uri":"data:;base64,{data}"}}],{parts}}}"#
    )
    .into_bytes()
}

fn list(count: usize, entry: impl Fn(usize) -> String) -> String {
    let entries: Vec<String> = (0..count).map(entry).collect();
    entries.join(",")
}

/// Times from 0 on, then a rotation for each.
pub(crate) fn keys(count: usize) -> Vec<u8> {
    let times = (0..count).flat_map(|key| (key as f32).to_le_bytes());
    let unit = [0.0f32, 0.0, 0.0, 1.0].map(f32::to_le_bytes).concat();
    times.chain(unit.repeat(count)).collect()
}

fn accessors(count: usize) -> String {
    format!(
        r#""bufferViews":[{{"buffer":0,"byteLength":{}}},{{"buffer":0,"byteOffset":{},"byteLength":{}}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":{count},"type":"SCALAR"}},
        {{"bufferView":1,"componentType":5126,"count":{count},"type":"VEC4"}}]"#,
        4 * count,
        4 * count,
        16 * count
    )
}

#[test]
fn channels_that_share_a_sampler() {
    let _one = one_at_a_time();
    let (count, nodes) = (10_000, 10_000);
    let channel =
        |node: usize| format!(r#"{{"sampler":0,"target":{{"node":{node},"path":"rotation"}}}}"#);
    let parts = format!(
        r#"{},"nodes":[{}],"animations":[{{"samplers":[{{"input":0,"output":1}}],"channels":[{}]}}]"#,
        accessors(count),
        list(nodes, |_| "{}".to_owned()),
        list(nodes, channel)
    );
    let bytes = gltf(&keys(count), &parts);
    let length = bytes.len();
    let fault = refusal(length, || {
        let loaded = read_gltf("t", bytes, None, &ReadOptions::default())?;
        loaded.refused.into_iter().next().map_or(Ok(()), Err)
    });
    assert_eq!(fault.code, Code::Memory, "{fault}");
}

/// Each animation of a leaf contains the whole chain of the leaf's ancestors.
#[test]
fn animations_of_the_end_of_a_chain() {
    let _one = one_at_a_time();
    let (nodes, animations) = (5_000, 5_000);
    let node = |node: usize| {
        if node + 1 < nodes {
            format!(r#"{{"children":[{}]}}"#, node + 1)
        } else {
            "{}".to_owned()
        }
    };
    let animation = format!(
        r#"{{"samplers":[{{"input":0,"output":1}}],"channels":[{{"sampler":0,"target":{{"node":{},"path":"rotation"}}}}]}}"#,
        nodes - 1
    );
    let parts = format!(
        r#"{},"nodes":[{}],"animations":[{}]"#,
        accessors(2),
        list(nodes, node),
        list(animations, |_| animation.clone())
    );
    let bytes = gltf(&keys(2), &parts);
    let fault = refusal(bytes.len(), || {
        let loaded = read_gltf("t", bytes, None, &ReadOptions::default())?;
        loaded.refused.into_iter().next().map_or(Ok(()), Err)
    });
    assert_eq!(fault.code, Code::Memory, "{fault}");
}

#[test]
fn nodes_without_anything() {
    let _one = one_at_a_time();
    let parts = format!(
        r#"{},"nodes":[{}],"animations":[{{"samplers":[],"channels":[]}}]"#,
        accessors(1),
        list(500_000, |_| "{}".to_owned())
    );
    let bytes = gltf(&keys(1), &parts);
    let fault = refusal(bytes.len(), || {
        read_gltf("t", bytes, None, &ReadOptions::default())
    });
    assert_eq!(fault.code, Code::Memory, "{fault}");
}

#[test]
fn nodes_that_carry_one_mesh() {
    let _one = one_at_a_time();
    let count = 3_000;
    let parts = format!(
        r#""bufferViews":[{{"buffer":0,"byteLength":{}}}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":{count},"type":"VEC3"}}],"nodes":[{}]"#,
        12 * count,
        list(10_000, |_| r#"{"mesh":0}"#.to_owned())
    );
    let bytes = gltf(&vec![0; 12 * count], &parts);
    let fault = refusal(bytes.len(), || {
        triangles_of("t", bytes, None, Limits::default())
    });
    assert_eq!(fault.code, Code::Memory, "{fault}");
}

#[test]
fn views_that_are_packed() {
    let _one = one_at_a_time();
    let count = 50_000_000;
    let parts = format!(
        r#""bufferViews":[{{"buffer":0,"byteLength":4,"extensions":{{"EXT_meshopt_compression":{{"buffer":0,
        "byteLength":4,"byteStride":16,"count":{count},"mode":"ATTRIBUTES"}}}}}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":1,"type":"SCALAR"}},
        {{"bufferView":0,"componentType":5126,"count":1,"type":"VEC4"}}],"nodes":[{{}}],
        "animations":[{{"samplers":[{{"input":0,"output":1}}],"channels":[{{"sampler":0,"target":{{"node":0,"path":"rotation"}}}}]}}]"#
    );
    let bytes = gltf(&[0xa0, 0, 0, 0], &parts);
    let fault = refusal(bytes.len(), || {
        let loaded = read_gltf("t", bytes, None, &ReadOptions::default())?;
        loaded.refused.into_iter().next().map_or(Ok(()), Err)
    });
    assert_eq!(fault.code, Code::Memory, "{fault}");
}

/// An archive of one deflated member and as many entries of the directory, by their names.
fn archive(packed: &[u8], size: u32, names: &[&str]) -> Vec<u8> {
    let fields = |name: &str| {
        let mut fields = vec![20, 0, 0, 0, 8, 0, 0, 0, 0, 0, 0, 0, 0, 0];
        fields.extend((packed.len() as u32).to_le_bytes());
        fields.extend(size.to_le_bytes());
        fields.extend((name.len() as u16).to_le_bytes());
        fields.extend([0, 0]);
        fields
    };
    let first = names[0];
    let mut bytes = [b"PK\x03\x04", &fields(first)[..], first.as_bytes(), packed].concat();
    let start = bytes.len() as u32;
    for name in names {
        bytes.extend(b"PK\x01\x02\x14\0");
        bytes.extend(fields(name));
        bytes.extend([0; 14]);
        bytes.extend(name.bytes());
    }
    let length = bytes.len() as u32 - start;
    let count = (names.len() as u16).to_le_bytes();
    bytes.extend(b"PK\x05\x06\0\0\0\0");
    bytes.extend([count, count].concat());
    bytes.extend(length.to_le_bytes());
    bytes.extend(start.to_le_bytes());
    bytes.extend([0, 0]);
    bytes
}

/// An NPY array of zeros, deflated to a thousandth of its length; and that length.
fn packed(shape: &str, bytes: usize) -> (Vec<u8>, u32) {
    const PIECE: usize = 1 << 20;
    let text = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}");
    let header = [b"\x93NUMPY\x01\0\x76\0", format!("{text:117}\n").as_bytes()].concat();
    // The compressed piece does not refer to data before it, so it can be repeated.
    let mut state = flate2::Compress::new(Compression::best(), false);
    let mut piece = Vec::with_capacity(1 << 16);
    state
        .compress_vec(&vec![0; PIECE], &mut piece, FlushCompress::Full)
        .unwrap();
    let mut start = DeflateEncoder::new(Vec::new(), Compression::none());
    start.write_all(&header).unwrap();
    start.flush().unwrap();
    let mut packed = start.get_ref().clone();
    for _ in 0..bytes / PIECE {
        packed.extend(&piece);
    }
    packed.extend([3, 0]); // the last block, which is empty
    let size = header.len() + bytes / PIECE * PIECE;
    (packed, size as u32)
}

#[test]
fn archives_that_unpack_to_much() {
    let _one = one_at_a_time();
    let (packed, size) = packed("(1048576, 100, 1)", 800 << 20);
    let bytes = archive(&packed, size, &["poses.npy"]);
    assert!(bytes.len() < 1_000_000, "{}", bytes.len());
    let options = ReadOptions {
        map: Some("rotations=poses:wxyz:track".to_owned()),
        ..ReadOptions::default()
    };
    let fault = refusal(bytes.len(), || read_npz("t", bytes, &options));
    let known = [Code::Memory, Code::Shape, Code::MemberSize];
    assert!(known.contains(&fault.code), "{fault}");
    let (packed, size) = self::packed("(209715, 4, 125)", 800 << 20);
    let bytes = archive(&packed, size, &["rotations.npy"]);
    let fault = refusal(bytes.len(), || {
        read_npz("t", bytes, &ReadOptions::default())
    });
    assert!(fault.code != Code::Open, "{fault}");
}

/// Many members, all of the same bytes.
#[test]
fn members_that_lie_upon_each_other() {
    let _one = one_at_a_time();
    let (packed, size) = packed("(131072, 1)", 1 << 20);
    let names: Vec<String> = (0..2000).map(|i| format!("{i}.npy")).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let bytes = archive(&packed, size, &names);
    let fault = refusal(bytes.len(), || {
        read_npz("t", bytes, &ReadOptions::default())
    });
    assert_eq!(fault.code, Code::Archive, "{fault}");
}

/// Twelve bytes state a header of 4 GB, and brackets are nested deeply.
#[test]
fn headers_of_arrays() {
    let _one = one_at_a_time();
    let nested = |depth: usize| {
        let text = format!("{{'descr': {}", "[".repeat(depth));
        let mut bytes = b"\x93NUMPY\x01\0".to_vec();
        bytes.extend((text.len() as u16).to_le_bytes());
        bytes.extend(text.bytes());
        bytes
    };
    let mut cases = vec![b"\x93NUMPY\x02\0\xff\xff\xff\xff".to_vec()];
    cases.extend([5, 150, 20_000].map(nested));
    for bytes in cases {
        let pace = Some(Pace::Seconds(1.0));
        let fault = refusal(bytes.len(), || read_paths("t", "t", &bytes, pace));
        assert_eq!(fault.code, Code::ArrayHeader, "{fault}");
        let fault = refusal(bytes.len(), || {
            read_npy("t", bytes, &ReadOptions::default())
        });
        assert_eq!(fault.code, Code::ArrayHeader, "{fault}");
    }
}

/// Blanks before the joints of a long chain are not its joints times its depth.
#[test]
fn chains_of_joints_are_written_in_their_own_length() {
    let _one = one_at_a_time();
    let mut clip = Motion::default();
    let joints: usize = 20_000;
    for joint in 0..joints {
        let name = format!("j{joint}");
        clip.set
            .push(&name, &[0.0, 0.5], &[Quat::IDENTITY; 2])
            .unwrap();
        clip.skeleton.push(Joint {
            parent: joint.checked_sub(1),
            rest: Transform::default(),
        });
    }
    clip.rate = tumble::FrameRate::new(2, 1).ok();
    let samples = keyed(&clip).unwrap();
    let mut out = Vec::new();
    let sampled = [samples.of(&clip, clip.rate, &[])];
    let options = MotionOptions::default();
    bvh::FORMAT
        .write_clips(&sampled, &options, &mut out)
        .unwrap();
    assert!(out.len() < joints * 1500, "{} bytes", out.len());
    let again = bvh::read_bvh("t", &*out, &ReadOptions::default()).unwrap();
    assert_eq!(again.clips[0].set.track_count(), joints);
}

/// Every reader respects the memory budget: a good file of each format is refused with a budget of one byte.
#[test]
fn every_reader_asks_for_its_memory() {
    let _one = one_at_a_time();
    let mut report = String::new();
    for format in FORMATS {
        let files = std::fs::read_dir(cases::folder(format.name)).unwrap();
        let mut asked = 0;
        for file in files {
            let path = file.unwrap().path();
            let with = |memory, is_explained| {
                let limits = Limits {
                    memory,
                    ..Limits::default()
                };
                // A single array needs a map, and poses without times need a rate.
                let takes = |option| is_explained && format.takes(option);
                let options = ReadOptions {
                    limits,
                    source_rate: takes(FormatOption::SourceRate)
                        .then(|| tumble::FrameRate::new(30, 1).unwrap()),
                    map: takes(FormatOption::Map).then(|| "rotations=arr_0:xyzw:track".to_owned()),
                    ..ReadOptions::default()
                };
                let read = format.open(&path, &options);
                read.and_then(|mut loaded| {
                    if loaded.refused.is_empty() {
                        Ok(loaded)
                    } else {
                        Err(loaded.refused.remove(0))
                    }
                })
            };
            let mut explained = [false, true].into_iter();
            let Some(is_explained) = explained.find(|&it| with(None, it).is_ok()) else {
                continue;
            };
            let refused = with(Some(1), is_explained).err();
            assert_eq!(
                refused.map(|fault| fault.code),
                Some(Code::Memory),
                "{}",
                path.display()
            );
            asked += 1;
        }
        let _ = writeln!(report, "{}: {asked}", format.name);
        assert!(asked > 0, "no good file of {}", format.name);
    }
    println!("{report}");
}
