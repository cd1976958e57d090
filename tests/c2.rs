//! The method c2 says where its angular acceleration is not continuous.

use glam::Quat;
use tumble::{Interpolation, InterpolationWarning, TrackSet, method};

fn warnings(times: &[f64]) -> Vec<InterpolationWarning> {
    let angle = 20f32.to_radians();
    let keys = [
        Quat::IDENTITY,
        Quat::from_rotation_x(angle),
        Quat::from_rotation_y(angle),
        Quat::from_rotation_z(angle),
    ];
    let mut set = TrackSet::new();
    set.push("", times, &keys).unwrap();
    Interpolation::from(method::C2).warnings(&set)
}

/// Even keys have a curve with continuous acceleration; a short interval beside long ones has none that
/// the iteration finds, and that is said.
#[test]
fn jumps_of_the_acceleration_are_told() {
    assert_eq!(warnings(&[0.0, 1.0, 2.0, 3.0]), []);
    let found = warnings(&[0.0, 1.0, 1.05, 2.0]);
    let [InterpolationWarning::AccelerationJumps { track, key, count }] = *found else {
        panic!("{found:?}");
    };
    assert_eq!((track, key), (0, 1));
    assert!(count >= 1);
    assert!(found[0].to_string().contains("key 1"), "{}", found[0]);
}
