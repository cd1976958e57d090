//! The motion of mjlab and of `BeyondMimic`, whose files differ only in the order of bodies and joints: depth first and
//! breadth first. The first body is the root in both.

use super::{Axis, BODY_NAMES, Dialect, JOINT_NAMES, root_and_joints};
use crate::quaternion::ComponentOrder;

pub(super) static DIALECT: Dialect = Dialect {
    name: "mjlab",
    summary: "`joint_pos`, `body_pos_w`, `body_quat_w` (w x y z), `fps`; by mjlab, and by BeyondMimic in another order",
    arrays: &[
        ("joint_pos", &[Axis::Frames, Axis::Any]),
        ("body_pos_w", &[Axis::Frames, Axis::Any, Axis::Is(3)]),
        ("body_quat_w", &[Axis::Frames, Axis::Any, Axis::Is(4)]),
    ],
    plan: |archive, warnings| {
        let rotation = ("body_quat_w", ComponentOrder::Wxyz);
        let beside = &[
            "joint_vel",
            "body_lin_vel_w",
            "body_ang_vel_w",
            JOINT_NAMES,
            BODY_NAMES,
            "order",
            "quaternion",
            "tumble",
        ];
        root_and_joints(
            archive,
            "mjlab",
            rotation,
            "body_pos_w",
            "joint_pos",
            beside,
            warnings,
        )
    },
};
