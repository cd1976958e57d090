//! The readers of robots.

use tumble::trees::{BodyOrder, Siblings};
use tumble_formats::Severity;
use tumble_formats::robot::Robot;

use super::{location_is_inside, signature};

/// MJCF or URDF: a robot that is read is a tree, in every order, and its bodies have poses at rest.
pub(crate) fn robot(bytes: &[u8]) -> u64 {
    let robot = match Robot::read("fuzz", bytes.to_vec()) {
        Ok(robot) => robot,
        Err(refusal) => {
            location_is_inside(bytes, &refusal);
            assert!(!refusal.message.is_empty(), "{refusal}");
            assert_eq!(refusal.code.severity(), Severity::Error, "{refusal}");
            let words = refusal.message.chars().filter(char::is_ascii_alphabetic);
            return signature((refusal.code, words.rev().take(12).collect::<String>()));
        }
    };
    let (tree, mut warnings) = (&robot.tree, Vec::new());
    for warning in &robot.warnings {
        location_is_inside(bytes, warning);
        assert_eq!(warning.code.severity(), Severity::Warning, "{warning}");
        warnings.push(warning.code);
    }
    let count = tree.bodies().len();
    assert!((1..=65_536).contains(&count));
    for (index, body) in tree.bodies().iter().enumerate() {
        assert!(
            body.parent.is_none_or(|parent| parent < index),
            "a child before its parent"
        );
        assert!((body.rotation.length() - 1.0).abs() < 1e-9 && body.position.is_finite());
    }
    for order in BodyOrder::ALL {
        for siblings in Siblings::ALL {
            let mut listed = tree.order(order, siblings);
            listed.sort_unstable();
            assert!(listed.into_iter().eq(0..count), "{order} {siblings}");
        }
    }
    let configurations = robot.poses.iter().map(|(_, configuration)| configuration);
    let rest = tree.rest();
    let mut outcomes = Vec::new();
    for configuration in configurations.chain([&rest]).take(4) {
        let poses = tree
            .poses(configuration)
            .expect("a configuration of the tree");
        assert_eq!(poses.len(), count);
        for pose in &poses {
            assert!(
                (pose.rotation.length() - 1.0).abs() < 1e-6,
                "{}",
                pose.rotation
            );
        }
        outcomes.push(poses.iter().any(|pose| pose.position.x > 0.0));
    }
    let counts = tree.counts();
    signature((
        robot.format,
        warnings,
        outcomes,
        count.min(6),
        format!("{counts:?}").len(),
        robot.couplings.min(2),
    ))
}
