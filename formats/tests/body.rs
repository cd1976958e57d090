//! Bodies of SMPL, whose joints a model places: a generated model, compared with NumPy's numbers.

use std::path::{Path, PathBuf};

use glam::DVec3;
use tumble::{Device, Engine, SampleTimes};
use tumble_formats::adjust::set_offsets;
use tumble_formats::motion::Motion;
use tumble_formats::npz::{body_offsets, read_npz};
use tumble_formats::sample::ChannelMethods;
use tumble_formats::world::world;
use tumble_formats::{Code, Limits, ReadOptions};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/body")
}

fn motion(gender: &str) -> Motion {
    let path = folder().join(gender).with_extension("npz");
    let bytes = std::fs::read(path).unwrap();
    let options = ReadOptions {
        has_body_model: true,
        ..ReadOptions::default()
    };
    let mut loaded = read_npz(gender, bytes, &options).unwrap();
    assert_eq!(loaded.warnings, []);
    loaded.clips.remove(0)
}

/// Gender, joint, its position in the world in the last frame: by `make.py`.
#[rustfmt::skip]
const JOINT_POSITIONS: [(&str, usize, [f64; 3]); 8] = [
    ("male", 0, [0.739601876, 2.134199698, -0.477145803]),
    ("male", 5, [0.671289189, 2.142247895, -0.412429092]),
    ("male", 15, [0.682057473, 2.159934554, -0.375826037]),
    ("male", 23, [0.710879857, 2.128169847, -0.288906901]),
    ("female", 0, [1.380977847, -0.529194456, 0.562163364]),
    ("female", 5, [1.633550478, -0.461485261, 0.483442609]),
    ("female", 15, [1.286130367, -0.652333497, 0.516215938]),
    ("female", 23, [1.479026343, -0.617361272, 0.649278564]),
];

/// The model of the body's gender is found in the folder, and its joints are where NumPy has them.
#[test]
fn joints_are_where_the_model_has_them_for_the_shape() {
    let engine = Engine::new(Device::Cpu).unwrap();
    for (gender, joint, expected) in JOINT_POSITIONS {
        let mut clip = motion(gender);
        assert!(clip.no_world.is_some());
        let shape = &clip.body.as_ref().unwrap().shape;
        assert_eq!((shape.betas.len(), &*shape.gender), (5, gender));
        let offsets = body_offsets(&folder().join("models"), &clip, Limits::default()).unwrap();
        set_offsets(&mut clip, &offsets).unwrap();
        let frames = SampleTimes::at(vec![2.0 / 30.0]);
        let samples = ChannelMethods::AUTHORED
            .sample(&engine, &clip, &frames)
            .unwrap();
        let found = world(&clip, &samples).unwrap()[joint].position;
        let off = found.distance(DVec3::from_array(expected));
        assert!(off < 1e-6, "{gender} {joint}: {found}, {off:e}");
    }
}

#[test]
fn what_is_no_model_of_the_body_is_refused() {
    let clip = motion("male");
    let refused =
        |path: &Path, clip: &Motion| body_offsets(path, clip, Limits::default()).unwrap_err();
    let model = folder().join("models/SMPL_MALE.npz");
    assert!(body_offsets(&model, &clip, Limits::default()).is_ok());
    // Refused: the motion itself as a model; a gender for which there is no file; more betas than the
    // model has; a clip without a body.
    let fault = refused(&folder().join("male.npz"), &clip);
    assert_eq!(fault.code, Code::BodyModel);
    assert!(fault.message.contains("`v_template`"), "{fault}");
    let mut other = clip.clone();
    other.body.as_mut().unwrap().shape.gender = String::new();
    let fault = refused(&folder().join("models"), &other);
    assert!(fault.message.contains("`neutral`"), "{fault}");
    other.body.as_mut().unwrap().shape.betas = vec![0.5; 7];
    let fault = refused(&model, &other);
    assert!(fault.message.contains("7 betas and the model 6"), "{fault}");
    other.body = None;
    assert_eq!(refused(&model, &other).code, Code::BodyModel);
    let mut other = clip.clone();
    other.skeleton[4].parent = Some(2);
    assert!(refused(&model, &other).message.contains("24 joints"));
    assert_eq!(refused(&folder().join("none.npz"), &clip).code, Code::Open);
}
