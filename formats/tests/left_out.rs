//! Warnings name the contents of a file that are no part of its motion, in every format.

use tumble_formats::{Code, Format, Loaded, ReadOptions};

fn read(fixture: &str, options: &ReadOptions) -> Loaded {
    let (format, name) = fixture.split_once('/').unwrap();
    let path = crate::cases::folder(format).join(name);
    Format::open_detected(&path, options).unwrap()
}

/// The warnings of a code.
fn said(loaded: &Loaded, code: Code) -> Vec<String> {
    let all = loaded
        .warnings
        .iter()
        .filter(|warning| warning.code == code);
    all.map(|warning| warning.message.clone()).collect()
}

/// Catches a reader that passes over something without a word, or names something else.
#[test]
fn what_is_no_part_of_the_motion_is_named() {
    let cases = [
        (
            "npz/foreign_members.npz",
            Code::ArraysNotRead,
            "not read: `README.txt`; ",
        ),
        (
            "npz/objects_beside.npz",
            Code::ObjectsBeside,
            "`labels` holds pickled objects",
        ),
        (
            "csv/left_out.csv",
            Code::ColumnsLeftOut,
            "`note`, `temperature`",
        ),
        (
            "tum/further_numbers.tum",
            Code::FurtherNumbers,
            "2 numbers after",
        ),
        (
            "euroc/velocities.euroc",
            Code::FurtherNumbers,
            "1 number after",
        ),
        (
            "bvh/frames_fewer.bvh",
            Code::BvhMoreRows,
            "a row after the last of 2 frames",
        ),
        #[cfg(feature = "fbx")]
        ("fbx/properties.fbx", Code::FbxProperties, "`Visibility`"),
        #[cfg(feature = "mcap")]
        ("mcap/good.mcap", Code::McapOthers, "`/log`"),
    ];
    for (fixture, code, words) in cases {
        let said = said(&read(fixture, &ReadOptions::default()), code);
        assert_eq!(said.len(), 1, "{fixture}: {said:?}");
        assert!(said[0].contains(words), "{fixture}: {said:?}");
    }
}

/// Catches a warning about data that another option uses, and about notes in our own files.
#[test]
fn what_is_used_is_not_named() {
    for fixture in [
        "npz/smpl.npz",
        // Bodies usually have arrays of their shape, and of soft tissue.
        "npz/arrays_beside.npz",
        "npz/pieces.npz",
        "npz/own.npz",
        "npz/bodies.npz",
    ] {
        let said = said(&read(fixture, &ReadOptions::default()), Code::ArraysNotRead);
        assert!(said.is_empty(), "{fixture}: {said:?}");
    }
    let map = "pelvis=poses[0:3]:rotvec,fps=mocap_framerate";
    let mapped = ReadOptions {
        map: Some(map.to_owned()),
        ..ReadOptions::default()
    };
    let said = said(&read("npz/arrays_beside.npz", &mapped), Code::ArraysNotRead);
    assert!(
        said[0].contains("not read: `trans`, `betas`, `dmpls`, `gender`; "),
        "{said:?}"
    );
}
