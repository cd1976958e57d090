//! Libraries of clips from motion files.

use std::ffi::{CStr, CString};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::ptr::{null, null_mut};

use glam::{Quat, Vec3};
use tempfile::TempDir;
use tumble::crowd::{CrowdLayer, CrowdLibrary, CrowdOutput, CrowdValues};
use tumble::{Skeleton, TrackSet, VectorMethod, method};
use tumble_formats::{Format, ReadOptions};

use super::crowd::*;
use super::{cpu, defaults, fails};
use crate::crowd::file::*;
use crate::crowd::layer::*;
use crate::crowd::library::*;
use crate::crowd::player::*;
use crate::engine::*;
use crate::file::*;
use crate::interpolation::*;
use crate::result::*;

fn load(path: &Path) -> *mut TumbleFile {
    let path = CString::new(path.to_str().unwrap()).unwrap();
    let mut file = null_mut();
    // SAFETY: text, and room for the handle.
    done(unsafe { tumble_file_load(path.as_ptr(), &raw mut file) });
    file
}

fn library_of(file: *const TumbleFile) -> *mut TumbleCrowdLibrary {
    let mut library = null_mut();
    // SAFETY: room for the handle.
    done(unsafe { tumble_crowd_library_of_file(file, 0, &raw mut library) });
    library
}

fn push_clip(
    library: *mut TumbleCrowdLibrary,
    file: *const TumbleFile,
    clip: usize,
    how: *const TumbleInterpolation,
    vectors: Option<&CStr>,
) -> TumbleResult {
    let vectors = vectors.map_or(null(), CStr::as_ptr);
    // SAFETY: null or a structure, and null or text.
    unsafe { tumble_crowd_library_push_clip(library, file, clip, how, vectors, null_mut()) }
}

/// The poses of both libraries' clips at many times, all values but skinning.
#[track_caller]
fn same(library: *mut TumbleCrowdLibrary, rust_library: &CrowdLibrary) {
    assert_eq!(
        tumble_crowd_library_clip_count(library),
        rust_library.clip_count()
    );
    let engine = cpu();
    let shape = (11 * rust_library.clip_count(), 1);
    let (crowd, mut expected) = (
        c_crowd(engine, library, shape),
        rust_crowd(rust_library, shape),
    );
    for instance in 0..shape.0 {
        let clip = instance % rust_library.clip_count();
        assert_eq!(
            tumble_crowd_library_clip_ticks(library, clip),
            rust_library.ticks(clip).unwrap()
        );
        let time = i64::from(rust_library.ticks(clip).unwrap()) * instance as i64 / shape.0 as i64;
        let layer = TumbleCrowdLayer {
            instance,
            clip,
            time,
            ..still()
        };
        done(set_layers(crowd, &[layer]));
        let plays = CrowdLayer::new(clip).at(time).with_speed(0.0);
        expected.set(instance, 0, plays).unwrap();
    }
    for values in [
        CrowdValues::Rotations,
        CrowdValues::Local,
        CrowdValues::Model,
    ] {
        let output = CrowdOutput::from(values);
        assert!(
            bits(crowd, output, false) == rust_bits(&mut expected, output),
            "{values:?}"
        );
    }
    done(tumble_crowd_free(crowd));
    done(tumble_engine_free(engine));
}

fn name(library: *const TumbleCrowdLibrary, joint: usize) -> String {
    let name = tumble_crowd_library_joint_name(library, joint);
    // SAFETY: text of a library that is not freed yet.
    unsafe { CStr::from_ptr(name) }.to_str().unwrap().to_owned()
}

fn write(folder: &TempDir, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    path
}

const HALF: f32 = std::f32::consts::FRAC_1_SQRT_2;
const ROTATIONS: [[f32; 4]; 2] = [[0.0, 0.0, 0.0, 1.0], [HALF, 0.0, 0.0, HALF]];
const MOVES: [[f32; 3]; 2] = [[0.0, -0.5, 0.0], [0.25, -0.75, 0.0]];

/// A hip with a knee and a tail, and clips that move different joints; the last one by two methods.
fn rig(folder: &TempDir) -> PathBuf {
    let mut bytes: Vec<u8> = Vec::new();
    bytes.extend([0.0_f32, 1.0].iter().flat_map(|x| x.to_le_bytes()));
    bytes.extend(
        ROTATIONS
            .as_flattened()
            .iter()
            .flat_map(|x| x.to_le_bytes()),
    );
    bytes.extend(MOVES.as_flattened().iter().flat_map(|x| x.to_le_bytes()));
    write(folder, "rig.bin", &bytes);
    // A node, the property that moves, and the interpolation.
    type Moved = (u32, &'static str, &'static str);
    let clips: [(&str, &[Moved]); 3] = [
        ("kick", &[(1, "rotation", "LINEAR")]),
        (
            "wag",
            &[(2, "rotation", "STEP"), (1, "translation", "LINEAR")],
        ),
        (
            "both",
            &[(2, "rotation", "STEP"), (1, "rotation", "LINEAR")],
        ),
    ];
    let mut animations = String::new();
    for (name, channels) in clips {
        let (mut samplers, mut targets) = (String::new(), String::new());
        for (i, (node, path, how)) in channels.iter().enumerate() {
            let output = if *path == "rotation" { 1 } else { 2 };
            let comma = if i == 0 { "" } else { "," };
            write!(
                samplers,
                r#"{comma}{{"input":0,"output":{output},"interpolation":"{how}"}}"#
            )
            .unwrap();
            write!(
                targets,
                r#"{comma}{{"sampler":{i},"target":{{"node":{node},"path":"{path}"}}}}"#
            )
            .unwrap();
        }
        let comma = if animations.is_empty() { "" } else { "," };
        write!(
            animations,
            r#"{comma}{{"name":"{name}","samplers":[{samplers}],"channels":[{targets}]}}"#
        )
        .unwrap();
    }
    let text = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[
        {{"name":"hip","translation":[0,1,0],"children":[1,2]}},
        {{"name":"knee","translation":[0,-0.5,0]}},
        {{"name":"tail","translation":[0,0,-1],"rotation":[0,{HALF},0,{HALF}],"scale":[2,1,1]}}],
        "buffers":[{{"uri":"rig.bin","byteLength":{}}}],
        "bufferViews":[{{"buffer":0,"byteLength":8}},{{"buffer":0,"byteOffset":8,"byteLength":32}},
        {{"buffer":0,"byteOffset":40,"byteLength":24}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":2,"type":"SCALAR","min":[0],"max":[1]}},
        {{"bufferView":1,"componentType":5126,"count":2,"type":"VEC4"}},
        {{"bufferView":2,"componentType":5126,"count":2,"type":"VEC3"}}],
        "animations":[{animations}]}}"#,
        bytes.len()
    );
    write(folder, "rig.gltf", text)
}

/// The joints are those of all clips; joints that a clip does not have rest.
#[test]
fn clips_of_a_file_that_move_different_joints_share_a_library() {
    let folder = tempfile::tempdir().unwrap();
    let file = load(&rig(&folder));
    let library = library_of(file);
    assert_eq!(
        [0, 1, 2].map(|joint| name(library, joint)),
        ["hip", "knee", "tail"]
    );
    done(push_clip(library, file, 0, null(), None));
    done(push_clip(library, file, 1, null(), None));
    let two = push_clip(library, file, 2, null(), None);
    let (one, other) = ("slerp", "step");
    fails(
        two,
        TumbleResult::InvalidInput,
        "give one interpolation for all",
    );
    fails(two, TumbleResult::InvalidInput, one);
    fails(two, TumbleResult::InvalidInput, other);
    let how = TumbleInterpolation {
        method: c"nlerp".as_ptr(),
        ..defaults()
    };
    done(push_clip(library, file, 2, &raw const how, Some(c"step")));
    let missing = push_clip(library, file, 3, null(), None);
    fails(
        missing,
        TumbleResult::OutOfRange,
        "no clip 3; the file has 3",
    );

    let offsets = vec![Vec3::Y, Vec3::new(0.0, -0.5, 0.0), -Vec3::Z];
    let skeleton = Skeleton::new(vec![None, Some(0), Some(0)], offsets).unwrap();
    let mut rust_library = CrowdLibrary::new(&skeleton).unwrap();
    let rests = [
        Quat::IDENTITY,
        Quat::IDENTITY,
        Quat::from_xyzw(0.0, HALF, 0.0, HALF),
    ];
    for (turning, moving, method, vectors) in [
        (vec![1], None, method::SLERP, VectorMethod::Linear),
        (vec![2], Some(1), method::STEP, VectorMethod::Linear),
        (vec![1, 2], None, method::NLERP, VectorMethod::Step),
    ] {
        let mut set = TrackSet::new();
        for (joint, rest) in rests.into_iter().enumerate() {
            let pushed = if turning.contains(&joint) {
                set.push("", &[0.0, 1.0], &ROTATIONS)
            } else {
                set.push("", &[0.0], &[rest])
            };
            pushed.unwrap();
        }
        if let Some(joint) = moving {
            set.set_translations(joint, &[0.0, 1.0], &MOVES, &[])
                .unwrap();
        }
        set.set_scales(2, &[0.0], &[[2.0, 1.0, 1.0]], &[]).unwrap();
        rust_library.push(&set, method, vectors).unwrap();
    }
    same(library, &rust_library);

    // A clip of another rig has other joint names; a clip made of arrays has none.
    let bvh = "HIERARCHY\nROOT pelvis\n{\nOFFSET 0 3 0\nCHANNELS 6 Xposition Yposition Zposition \
               Zrotation Xrotation Yrotation\nJOINT head\n{\nOFFSET 0 1 0\nCHANNELS 3 Zrotation \
               Xrotation Yrotation\nEnd Site\n{\nOFFSET 0 1 0\n}\n}\n}\nMOTION\nFrames: 3\n\
               Frame Time: 0.04\n0 3 0 0 0 0 0 0 0\n1 3 0 10 20 30 40 0 5\n2 3 1 20 0 30 10 9 5\n";
    let other = load(&write(&folder, "other.bvh", bvh));
    let pushed = push_clip(library, other, 0, null(), None);
    fails(
        pushed,
        TumbleResult::InvalidInput,
        "the library has none of that name",
    );
    let (arrays, _) = libraries();
    let pushed = push_clip(arrays, other, 0, null(), None);
    fails(pushed, TumbleResult::InvalidInput, "clip 0 has a joint");
    // In a separate library, this clip plays as the file states.
    let of_other = library_of(other);
    done(push_clip(of_other, other, 0, null(), None));
    same(
        of_other,
        &by_hand(&folder.path().join("other.bvh"), method::SLERP),
    );
    for library in [library, arrays, of_other] {
        done(tumble_crowd_library_free(library));
    }
    done(tumble_file_free(file));
    done(tumble_file_free(other));
}

/// A file whose joints are in another order is the same motion; other parents are refused.
#[test]
fn joints_of_other_files_are_matched_by_name_and_parent() {
    let folder = tempfile::tempdir().unwrap();
    let joint = |kind: &str, name: &str, offset: &str, inside: &str| {
        format!(
            "{kind} {name}\n{{\nOFFSET {offset}\nCHANNELS 3 Zrotation Xrotation Yrotation\n{inside}}}\n"
        )
    };
    let end = "End Site\n{\nOFFSET 0 1 0\n}\n";
    let file = |name: &str, inside: String, rows: [&str; 2]| {
        let text = format!(
            "HIERARCHY\n{}MOTION\nFrames: 2\nFrame Time: 0.5\n{}\n{}\n",
            joint("ROOT", "hip", "0 3 0", &inside),
            rows[0],
            rows[1]
        );
        load(&write(&folder, name, text))
    };
    let left = |inside: &str| joint("JOINT", "left", "1 0 0", inside);
    let right = |inside: &str| joint("JOINT", "right", "-1 0 0", inside);
    let one = file(
        "one.bvh",
        left(end) + &right(end),
        ["0 0 0 0 0 0 0 0 0", "10 0 0 20 0 0 0 30 0"],
    );
    let other = file(
        "other.bvh",
        right(end) + &left(end),
        ["0 0 0 0 0 0 0 0 0", "10 0 0 0 30 0 20 0 0"],
    );
    let chain = file(
        "chain.bvh",
        left(&right(end)),
        ["0 0 0 0 0 0 0 0 0", "10 0 0 20 0 0 0 30 0"],
    );
    let library = library_of(one);
    done(push_clip(library, one, 0, null(), None));
    done(push_clip(library, other, 0, null(), None));
    let refused = push_clip(library, chain, 0, null(), None);
    let text = "`right` has the parent `hip` in the library, but has the parent `left` in clip 0";
    fails(refused, TumbleResult::InvalidInput, text);
    let engine = cpu();
    let crowd = c_crowd(engine, library, (2, 1));
    for clip in 0..2 {
        let layer = TumbleCrowdLayer {
            instance: clip,
            clip,
            time: 705_600 / 2,
            ..still()
        };
        done(set_layers(crowd, &[layer]));
    }
    let found = bits(crowd, CrowdOutput::from(CrowdValues::Model), false);
    let (first, second) = found.split_at(found.len() / 2);
    assert_eq!(first, second);
    done(tumble_crowd_free(crowd));
    done(tumble_engine_free(engine));
    done(tumble_crowd_library_free(library));
    for file in [one, other, chain] {
        done(tumble_file_free(file));
    }
}

/// A file's clips, all of the same joints, as a library.
fn by_hand(path: &Path, method: tumble::Method) -> CrowdLibrary {
    let loaded = Format::open_detected(path, &ReadOptions::default()).unwrap();
    let joints = &loaded.clips[0].skeleton;
    let parents = joints.iter().map(|joint| joint.parent).collect();
    let offsets = joints.iter().map(|joint| joint.rest.translation).collect();
    let mut rust_library = CrowdLibrary::new(&Skeleton::new(parents, offsets).unwrap()).unwrap();
    for motion in &loaded.clips {
        assert!(
            motion
                .skeleton
                .iter()
                .all(|joint| joint.rest.scale == Vec3::ONE)
        );
        let vectors = match method.name {
            "slerp" => VectorMethod::Linear,
            _ => VectorMethod::BesselOverhauser,
        };
        rust_library.push(&motion.set, method, vectors).unwrap();
    }
    rust_library
}

/// Khronos' fox, where it is at hand.
#[test]
fn a_fox_plays_its_clips() {
    let fox = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../shared/data/gltf/Fox.glb"
    );
    let fox = Path::new(fox);
    if !fox.exists() {
        eprintln!("NO {}: this test compared nothing", fox.display());
        return;
    }
    let file = load(fox);
    let clips = tumble_file_clip_count(file);
    assert_eq!(clips, 3);
    let rust_library = by_hand(fox, method::SLERP);
    // Poses are the same however clips are stored.
    for (storage, bytes) in [(c"segments", 40.0..70.0), (c"compact", 16.0..24.0)] {
        let library = library_of(file);
        // SAFETY: text.
        done(unsafe { tumble_crowd_library_set_storage(library, storage.as_ptr()) });
        for clip in 0..clips {
            done(push_clip(library, file, clip, null(), None));
        }
        same(library, &rust_library);
        let found = tumble_crowd_library_bytes_per_key(library);
        assert!(bytes.contains(&found), "{storage:?}: {found}");
        // SAFETY: text.
        let unknown = unsafe { tumble_crowd_library_set_storage(library, c"keys".as_ptr()) };
        fails(unknown, TumbleResult::InvalidArgument, "`keys`");
        done(tumble_crowd_library_free(library));
    }
    done(tumble_file_free(file));
}

/// Poses that are relative to the world, and joints that share a name, make no library.
#[test]
fn files_without_a_hierarchy_of_their_own_are_roots_or_refused() {
    let file = load(Path::new(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../data/pendulum.dat"
    )));
    let library = library_of(file);
    let mut parents = [7; 4];
    // SAFETY: memory of that size.
    done(unsafe { tumble_crowd_library_parents(library, parents.as_mut_ptr(), 4) });
    assert_eq!(parents, [-1; 4]);
    let mut null_library = null_mut();
    // SAFETY: null pointers, which are refused, and room for a handle.
    unsafe {
        let made = tumble_crowd_library_of_file(file, 0, null_mut());
        fails(made, TumbleResult::InvalidPointer, "`library` is null");
        let made = tumble_crowd_library_of_file(null(), 0, &raw mut null_library);
        fails(made, TumbleResult::InvalidHandle, "the file is null");
        let made = tumble_crowd_library_of_file(file, u32::MAX, &raw mut null_library);
        fails(made, TumbleResult::InvalidArgument, "ticks a second");
    }
    assert!(null_library.is_null());
    done(tumble_crowd_library_free(library));
    done(tumble_file_free(file));
}
