//! Features, against values by NumPy where the sample files are there.

use std::fs;
use std::io::Read;

use tumble::glam::{DMat3, DQuat, DVec3};
use tumble_formats::learning::{
    ContactLimits, Ground, HUMANML3D_JOINTS, Humanml3dError, SixOrder, contacts, facing,
    forward_heading, humanml3d, majority, mirror_pairs, mirrored_point, mirrored_rotation,
    positions_of_humanml3d, rotation_of_six, six, twist_heading, without_partner,
};
use tumble_formats::npy::read_numbers;

use crate::support::shared_data;

fn arrays(file: &str, names: &[&str]) -> Option<Vec<(Vec<usize>, Vec<f64>)>> {
    let path = shared_data()?.join("robots").join(file);
    let mut archive = zip::ZipArchive::new(fs::File::open(path).unwrap()).unwrap();
    let mut array = |name: &&str| {
        let mut bytes = Vec::new();
        let mut member = archive.by_name(&format!("{name}.npy")).unwrap();
        member.read_to_end(&mut bytes).unwrap();
        let array = read_numbers(name, &bytes, |_| Ok(())).unwrap();
        (array.shape, array.values)
    };
    Some(names.iter().map(&mut array).collect())
}

fn json() -> Option<serde_json::Value> {
    let text = fs::read_to_string(shared_data()?.join("robots/features/features.json")).unwrap();
    Some(serde_json::from_str(&text).unwrap())
}

fn numbers(value: &serde_json::Value) -> Vec<f64> {
    match value {
        serde_json::Value::Array(list) => list.iter().flat_map(numbers).collect(),
        number => vec![number.as_f64().unwrap()],
    }
}

fn points(numbers: &[f64]) -> Vec<DVec3> {
    numbers
        .as_chunks::<3>()
        .0
        .iter()
        .map(|&p| DVec3::from_array(p))
        .collect()
}

fn rotations(numbers: &[f64]) -> Vec<DQuat> {
    let four = numbers.as_chunks::<4>().0.iter();
    four.map(|&[w, x, y, z]| DQuat::from_xyzw(x, y, z, w))
        .collect()
}

fn near(found: &[f64], expected: &[f64], tolerance: f64) {
    assert_eq!(found.len(), expected.len());
    for (i, (found, expected)) in found.iter().zip(expected).enumerate() {
        assert!(
            (found - expected).abs() <= tolerance,
            "{i}: {found} {expected}"
        );
    }
}

#[test]
fn six_numbers_have_the_three_orders() {
    let rotation = DQuat::from_rotation_z(0.5) * DQuat::from_rotation_x(0.25);
    let matrix = DMat3::from_quat(rotation);
    let [x, y] = [matrix.x_axis, matrix.y_axis];
    assert_eq!(
        six(rotation, SixOrder::Columns),
        [x.x, x.y, x.z, y.x, y.y, y.z]
    );
    assert_eq!(
        six(rotation, SixOrder::Interleaved),
        [x.x, y.x, x.y, y.y, x.z, y.z]
    );
    let rows = matrix.transpose();
    assert_eq!(six(rotation, SixOrder::Rows)[1], rows.x_axis.y);
    for order in SixOrder::ALL {
        let again = rotation_of_six(six(rotation, order), order).unwrap();
        assert!(again.dot(rotation).abs() > 1.0 - 1e-15);
        assert_eq!(rotation_of_six([0.0; 6], order), None);
        assert_eq!(rotation_of_six([1.0, 1.0, 1.0, 1.0, 1.0, 1.0], order), None);
        assert_eq!(rotation_of_six([f64::NAN; 6], order), None);
    }
    let Some(expected) = json() else { return };
    let all = rotations(&numbers(&expected["quaternions_wxyz"]));
    for order in SixOrder::ALL {
        let name = order.name().trim_start_matches("six-");
        let found: Vec<f64> = all.iter().flat_map(|&q| six(q, order)).collect();
        near(&found, &numbers(&expected["six"][name]), 1e-14);
        let noisy = numbers(&expected["noisy_six"][name]);
        let decoded = noisy.as_chunks::<6>().0.iter().flat_map(|&numbers| {
            let matrix = DMat3::from_quat(rotation_of_six(numbers, order).unwrap());
            matrix.transpose().to_cols_array()
        });
        near(
            &decoded.collect::<Vec<_>>(),
            &numbers(&expected["noisy_matrices"][name]),
            1e-14,
        );
    }
}

#[test]
fn headings_are_about_the_axis_that_points_up() {
    let rotated = DQuat::from_rotation_z(2.0) * DQuat::from_rotation_x(0.1);
    assert!((twist_heading(rotated, Ground::Z) - 2.0).abs() < 1e-12);
    assert!((twist_heading(-rotated, Ground::Z) - 2.0).abs() < 1e-12);
    assert!((forward_heading(rotated, DVec3::X, Ground::Z) - 2.0).abs() < 1e-15);
    let rotated = DQuat::from_rotation_y(-1.0);
    assert!((forward_heading(rotated, DVec3::Z, Ground::Y) + 1.0).abs() < 1e-15);
    let across = [DVec3::X, DVec3::NEG_X];
    assert_eq!(facing(across, across, Ground::Y), Some(DVec3::Z));
    assert_eq!(
        facing([DVec3::ZERO; 2], [DVec3::Y, DVec3::ZERO], Ground::Y),
        None
    );
    let (Some(expected), Some(all)) = (
        json(),
        arrays("layouts/expected.npz", &["exact30_root_quat_wxyz"]),
    ) else {
        return;
    };
    let found = rotations(&all[0].1).into_iter();
    let found = found.flat_map(|q| {
        [
            twist_heading(q, Ground::Z),
            forward_heading(q, DVec3::X, Ground::Z),
        ]
    });
    let expected = numbers(&expected["heading_of_root"]["values"]);
    near(&found.collect::<Vec<_>>(), &expected, 1e-12);
}

#[test]
fn contacts_are_below_both_limits() {
    let limits = ContactLimits {
        height: 0.1,
        speed: 0.2,
    };
    let at = [
        DVec3::new(5.0, 5.0, 0.05),
        DVec3::new(0.0, 0.0, 0.1),
        DVec3::ZERO,
    ];
    let slow = DVec3::new(0.1, 0.1, 0.0);
    let found = contacts(&at, &[slow, slow, 2.0 * slow], Ground::Z, limits);
    assert_eq!(found, [true, false, false]);
    let frames = [true, false, true, true, false, false, true, false];
    assert_eq!(
        majority(&frames, 3),
        [true, true, true, true, false, false, false, false]
    );
    assert_eq!(majority(&frames, 1), frames);
    assert!(majority(&[], 3).is_empty());
    let names = ["exact30_body_pos_w", "exact30_body_lin_vel_w"];
    let (Some(expected), Some(all)) = (json(), arrays("layouts/expected.npz", &names)) else {
        return;
    };
    for (height, speed, name) in [(0.1, 0.15, "0.15/0.1"), (0.2, 1.0, "1.0/0.2")] {
        let limits = ContactLimits { height, speed };
        let found = contacts(&points(&all[0].1), &points(&all[1].1), Ground::Z, limits);
        let expected = expected["contacts"][name].as_array().unwrap().iter();
        let expected = expected.flat_map(|frame| frame.as_array().unwrap());
        assert!(expected.map(|it| it.as_bool().unwrap()).eq(found), "{name}");
    }
}

#[test]
fn left_and_right_change_places() {
    let names = [
        "left_hip",
        "right_hip",
        "RightArm",
        "LeftArm",
        "hip",
        "foot_l",
        "foot_r",
        "Arm.L",
        "Arm.R",
        "L_Foot",
        "R_Foot",
        "Bip01 L Thigh",
        "Bip01 R Thigh",
        "kLeftElbow",
        "kRightElbow",
        "cleft",
        "cright",
        "Leftover",
        "l_wrist",
        "left_only",
        "LThumb",
        "RThumb",
        "LOD",
    ];
    let pairs = mirror_pairs(&names);
    let expected = [
        1, 0, 3, 2, 4, 6, 5, 8, 7, 10, 9, 12, 11, 14, 13, 15, 16, 17, 18, 19, 21, 20, 22,
    ];
    assert_eq!(pairs, expected);
    assert_eq!(without_partner(&names, &pairs), [18, 19]);
    // Serial numbers may differ where no other name is the same without them.
    let names = [
        "b_LeftHand_011",
        "b_RightHand_08",
        "b_LeftLeg01_015",
        "b_RightLeg01_019",
        "b_LeftLeg02_016",
        "left_toe_1",
        "left_toe_2",
        "right_toe_3",
        "Arm.L.001",
        "Arm.R.002",
    ];
    let pairs = mirror_pairs(&names);
    assert_eq!(pairs, [1, 0, 3, 2, 4, 5, 6, 7, 9, 8]);
    assert_eq!(without_partner(&names, &pairs), [4, 5, 6, 7]);
    let (point, rotation) = (
        DVec3::new(1.0, 2.0, 3.0),
        DQuat::from_xyzw(0.1, 0.2, 0.3, 0.9).normalize(),
    );
    for axis in 0..3 {
        let [p, q] = [
            mirrored_point(point, axis),
            mirrored_rotation(rotation, axis) * point,
        ];
        assert_eq!(mirrored_point(p, axis), point);
        assert_eq!(
            mirrored_rotation(mirrored_rotation(rotation, axis), axis),
            rotation
        );
        // Mirroring a rotated point gives the mirrored point, rotated by the mirrored rotation.
        let other = mirrored_point(rotation * mirrored_point(point, axis), axis);
        assert!((q - other).length() < 1e-14);
    }
    let Some(expected) = json() else { return };
    let mirror = &expected["mirror"];
    let after = points(&numbers(&mirror["positions"]["after"]));
    for (before, after) in points(&numbers(&mirror["positions"]["before"]))
        .into_iter()
        .zip(after)
    {
        assert_eq!(mirrored_point(before, 1), after);
    }
    let after = rotations(&numbers(&mirror["rotations_wxyz"]["after"]));
    for (before, after) in rotations(&numbers(&mirror["rotations_wxyz"]["before"]))
        .into_iter()
        .zip(after)
    {
        assert_eq!(mirrored_rotation(before, 1), after);
    }
}

#[test]
fn features_of_humanml3d_are_those_of_the_formulas_and_come_back() {
    let still = [[DVec3::ZERO; HUMANML3D_JOINTS]; 3];
    assert_eq!(
        humanml3d(&still, 0.002),
        Err(Humanml3dError::NoFacing { frame: 0 })
    );
    assert_eq!(humanml3d(&still[..1], 0.002), Ok(Vec::new()));
    let mut broken = still;
    broken[1][7].x = f64::NAN;
    assert_eq!(
        humanml3d(&broken, 0.002),
        Err(Humanml3dError::NotFinite { frame: 1, joint: 7 })
    );
    let Some(all) = arrays(
        "features/humanml3d.npz",
        &["joints", "features", "positions"],
    ) else {
        return;
    };
    let frames = |numbers: &[f64]| -> Vec<[DVec3; HUMANML3D_JOINTS]> {
        let points = points(numbers);
        points.as_chunks().0.to_vec()
    };
    let found = humanml3d(&frames(&all[0].1), 0.002).unwrap();
    near(found.as_flattened(), &all[1].1, 1e-12);
    let back = positions_of_humanml3d(&found);
    let expected = frames(&all[2].1);
    for (found, expected) in back.iter().flatten().zip(expected.iter().flatten()) {
        assert!((*found - *expected).length() < 1e-12);
    }
}
