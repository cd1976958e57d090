//! Trees that are written by hand; `formats/tests/robots.rs` compares whole robots with `MuJoCo` and pinocchio.

use super::*;

fn body(name: &str, parent: Option<usize>, joints: Vec<TreeJoint>) -> TreeBody {
    TreeBody {
        name: name.to_owned(),
        parent,
        position: DVec3::X,
        rotation: DQuat::IDENTITY,
        joints,
        mass_centre: None,
    }
}

fn mimic(name: &str, joint_name: &str, multiplier: f64, offset: f64) -> TreeJoint {
    TreeJoint {
        mimic: Some(Mimic {
            joint: joint_name.to_owned(),
            multiplier,
            offset,
        }),
        ..TreeJoint::new(name, JointKind::Hinge)
    }
}

#[test]
fn hinges_turn_and_slides_shift_what_hangs_from_them() {
    let slide = TreeJoint {
        axis: DVec3::X,
        reference: 0.5,
        ..TreeJoint::new("slide", JointKind::Slide)
    };
    let bodies = vec![
        body(
            "base",
            None,
            vec![TreeJoint::new("hinge", JointKind::Hinge)],
        ),
        body("arm", Some(0), vec![slide]),
        body("tool", Some(1), Vec::new()),
    ];
    let tree = Tree::new(bodies).unwrap();
    let mut configuration = tree.rest();
    assert_eq!(configuration.scalars, [0.0, 0.5]);
    assert_eq!(tree.poses(&configuration).unwrap()[2].position.x, 3.0);
    configuration.scalars = vec![std::f64::consts::FRAC_PI_2, 1.0];
    let mut rates = tree.no_rates();
    rates.scalars = vec![2.0, 1.0];
    let motions = tree.motions(&configuration, &rates).unwrap();
    let tool = motions[2];
    assert!(tool.pose.position.distance(DVec3::new(1.0, 2.5, 0.0)) < 1e-14);
    // It is 2.5 m from the axis, and moves away from it.
    assert!(tool.velocity.linear.distance(DVec3::new(-5.0, 1.0, 0.0)) < 1e-14);
    assert_eq!(tool.velocity.angular, DVec3::new(0.0, 0.0, 2.0));
}

#[test]
fn joints_that_mimic_are_followed_through_others() {
    let joints = [
        mimic("c", "b", 2.0, 1.0),
        mimic("b", "a", -3.0, 0.5),
        TreeJoint::new("a", JointKind::Hinge),
    ];
    let values = joint_values(&joints.each_ref()).unwrap().0;
    let expected = [(-6.0, 2.0), (-3.0, 0.5), (1.0, 0.0)];
    for (value, (multiplier, offset)) in values.into_iter().zip(expected) {
        let index = 0;
        assert_eq!(
            value,
            JointValue::Scalar {
                index,
                multiplier,
                offset
            }
        );
    }
}

#[test]
fn bodies_that_are_no_tree_are_refused() {
    let hinge = |name| TreeJoint::new(name, JointKind::Hinge);
    let refused = |bodies: Vec<TreeBody>| Tree::new(bodies).unwrap_err().to_string();
    let with = |joints| vec![body("base", None, joints)];
    let ball = TreeJoint::new("ball", JointKind::Ball);
    let mut askew = hinge("a");
    askew.axis = DVec3::new(0.0, 0.0, 2.0);
    let cases = [
        (
            vec![body("base", Some(0), Vec::new())],
            "parents come before",
        ),
        (
            with(vec![hinge("a"), hinge("a")]),
            "two joints have the name `a`",
        ),
        (with(vec![askew]), "the axis, a unit vector, of `a` is"),
        (
            with(vec![TreeJoint::new("free", JointKind::Free), hinge("a")]),
            "a free joint is alone",
        ),
        (with(vec![mimic("a", "b", 1.0, 0.0)]), "does not exist"),
        (
            with(vec![mimic("a", "ball", 1.0, 0.0), ball]),
            "neither a hinge nor a slide",
        ),
        (
            with(vec![mimic("a", "b", 1.0, 0.0), mimic("b", "a", 1.0, 0.0)]),
            "in a circle",
        ),
    ];
    for (bodies, message) in cases {
        let found = refused(bodies);
        assert!(found.contains(message), "{found}");
    }
    let tree = Tree::new(with(vec![hinge("a")])).unwrap();
    let mut configuration = tree.rest();
    configuration.scalars[0] = f64::NAN;
    assert!(matches!(
        tree.poses(&configuration),
        Err(TreeError::Value { .. })
    ));
    configuration.scalars.clear();
    assert!(matches!(
        tree.poses(&configuration),
        Err(TreeError::Count { .. })
    ));
}
