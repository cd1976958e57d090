//! Motion of robots in the layouts of the programs that learn from it.

use std::path::PathBuf;

use tumble::glam::Quat;
use tumble_formats::motion::{Motion, ScalarKind};
use tumble_formats::npy::read_numbers;
use tumble_formats::pickle::Contents;
use tumble_formats::{Code, Format, Loaded, ReadOptions};

use crate::support::shared_data;

fn layouts() -> Option<PathBuf> {
    Some(shared_data()?.join("robots/layouts"))
}

fn open(file: &str) -> Loaded {
    let path = layouts().unwrap().join(file);
    Format::open_detected(&path, &ReadOptions::default()).unwrap()
}

/// An array of `expected.npz`.
fn expected(name: &str) -> Vec<f64> {
    let path = layouts().unwrap().join("expected.npz");
    let mut zip = zip::ZipArchive::new(std::fs::File::open(path).unwrap()).unwrap();
    let mut bytes = Vec::new();
    let mut member = zip.by_name(&format!("{name}.npy")).unwrap();
    std::io::Read::read_to_end(&mut member, &mut bytes).unwrap();
    read_numbers(name, &bytes, |_| Ok(())).unwrap().values
}

/// The same bits; of numbers in centimetres and degrees in f32, within a step of f32.
fn assert_near(file: &str, found: &[f32], expected: &[f32]) {
    if file != "bones_seed_g1.csv" {
        assert_eq!(found, expected, "{file}");
        return;
    }
    assert_eq!(found.len(), expected.len());
    for (found, expected) in found.iter().zip(expected) {
        assert!(
            (found - expected).abs() <= f32::EPSILON * expected.abs(),
            "{found} {expected}"
        );
    }
}

/// The root's positions and the joints are those of `expected.npz` to the last bit of f32, its rotations as near as f32
/// is.
fn check(file: &str, clip: &Motion, of: &str) {
    let (positions, rotations, joints) = match of {
        "" => (
            "root_pos".to_owned(),
            "root_quat_wxyz".to_owned(),
            "joint_pos".to_owned(),
        ),
        of => (
            format!("{of}_root_pos"),
            format!("{of}_root_quat_wxyz"),
            format!("{of}_joint_pos"),
        ),
    };
    let keys = clip
        .set
        .vector_keys(tumble::Channel::Translation, 0)
        .unwrap();
    let found: Vec<f32> = keys
        .keys
        .iter()
        .flat_map(tumble::glam::Vec3::to_array)
        .collect();
    let stored = |name: &str| -> Vec<f32> { expected(name).iter().map(|&n| n as f32).collect() };
    assert_near(file, &found, &stored(&positions));
    let rotation =
        |q: &[f64; 4]| Quat::from_xyzw(q[1] as f32, q[2] as f32, q[3] as f32, q[0] as f32);
    let values = expected(&rotations);
    for (found, expected) in clip.set.track(0).keys.iter().zip(values.as_chunks::<4>().0) {
        let expected = rotation(expected);
        let off = (*found - expected)
            .length()
            .min((*found + expected).length());
        assert!(off < 3e-7, "{file}: {found} {expected}");
    }
    let count = clip.set.scalar_count();
    let frames = clip.set.track(0).keys.len();
    assert_eq!((count, values.len()), (13, 4 * frames), "{file}");
    let all: Vec<f32> = (0..frames)
        .flat_map(|frame| (0..count).map(move |joint| (frame, joint)))
        .map(|(frame, joint)| clip.set.scalar(joint).unwrap().keys[frame])
        .collect();
    assert_near(file, &all, &stored(&joints));
    assert_eq!(clip.scalar(0).kind, ScalarKind::Angle, "{file}");
}

/// Every file of one motion in other programs' layouts holds its numbers.
#[test]
fn files_of_robots_hold_the_stored_numbers() {
    if layouts().is_none() {
        return;
    }
    for (file, of, codes) in [
        ("gmr_p2.pkl", "", vec![Code::UnnamedJoints]),
        ("gmr_p4.pkl", "", vec![Code::UnnamedJoints]),
        ("gmr_p5.pkl", "", vec![Code::UnnamedJoints]),
        ("motion_lib.pkl", "", vec![Code::UnnamedJoints]),
        ("motion_lib_zlib.pkl", "", vec![Code::UnnamedJoints]),
        ("motion_lib_lz4.pkl", "", vec![Code::UnnamedJoints]),
        (
            "protomotions.motion",
            "",
            vec![Code::InertObjects, Code::UnnamedJoints],
        ),
        ("mimickit.pkl", "", vec![Code::UnnamedJoints]),
        ("mjlab.npz", "peer50", vec![Code::UnnamedJoints]),
        ("isaaclab_amp.npz", "", vec![]),
        (
            "unitree_lafan1.csv",
            "",
            vec![Code::AssumedRate, Code::UnnamedJoints],
        ),
        ("bones_seed_g1.csv", "", vec![Code::AssumedRate]),
    ] {
        let loaded = open(file);
        assert_eq!(
            (loaded.clips.len(), &loaded.refused),
            (1, &Vec::new()),
            "{file}"
        );
        let found: Vec<Code> = loaded.warnings.iter().map(|warning| warning.code).collect();
        assert_eq!(found, codes, "{file}: {:?}", loaded.warnings);
        check(file, &loaded.clips[0], of);
    }
    let library = open("motion_lib.pkl");
    assert_eq!(library.clips[0].name.as_deref(), Some("walk__A001"));
    assert_eq!(library.clips[0].set.track_name(0), "root");
    let named = open("isaaclab_amp.npz");
    assert_eq!(named.clips[0].set.scalar(0).unwrap().name, "waist_yaw");
    // The same with w first is known by the first line alone.
    let path = layouts().unwrap().join("kimodo_qpos.csv");
    let codes =
        |loaded: &Loaded| -> Vec<Code> { loaded.warnings.iter().map(|it| it.code).collect() };
    let order = "wxyz".parse().ok();
    let loaded = Format::open_detected(
        &path,
        &ReadOptions {
            source_order: order,
            ..ReadOptions::default()
        },
    );
    let loaded = loaded.unwrap();
    check("kimodo_qpos.csv", &loaded.clips[0], "");
    assert_eq!(codes(&loaded), [Code::AssumedRate, Code::UnnamedJoints]);
    let doubtful = open("kimodo_qpos.csv");
    assert!(codes(&doubtful).contains(&Code::QuaternionOrder));
    assert_eq!(
        open("bones_seed_g1.csv").clips[0]
            .set
            .scalar(0)
            .unwrap()
            .name,
        "waist_yaw"
    );
    // A person, whose pelvis is where `transl` has it.
    let person = open("gvhmr.pt");
    assert_eq!(codes(&person), [Code::AssumedRate]);
    let path = layouts().unwrap().join("gvhmr.pt");
    let stored = Contents::open(&path, &ReadOptions::default()).unwrap();
    let stored = stored.numbers("smpl_params_global.transl").unwrap().values;
    let set = &person.clips[0].set;
    let keys = set.vector_keys(tumble::Channel::Translation, 0).unwrap();
    let found: Vec<f64> = keys
        .keys
        .iter()
        .flat_map(|key| key.as_dvec3().to_array())
        .collect();
    assert_eq!((found, set.track_count()), (stored, 22));
    // Breadth first, with other joints in other places, and nothing that says so.
    assert_eq!(open("beyondmimic.npz").clips[0].set.scalar_count(), 13);
}
