//! GMR's motion of a robot: a pickle of a dict.

use super::{Axis, DOF_NAMES, Dialect, JOINT_NAMES, root_and_joints};
use crate::quaternion::ComponentOrder;

pub(super) static DIALECT: Dialect = Dialect {
    name: "gmr",
    summary: "`root_pos`, `root_rot` (x y z w), `dof_pos`, `fps`; by GMR",
    arrays: &[
        ("root_pos", &[Axis::Frames, Axis::Is(3)]),
        ("root_rot", &[Axis::Frames, Axis::Is(4)]),
        ("dof_pos", &[Axis::Frames, Axis::Any]),
    ],
    plan: |archive, warnings| {
        let rotation = ("root_rot", ComponentOrder::Xyzw);
        let beside = &["local_body_pos", "link_body_list", JOINT_NAMES, DOF_NAMES];
        root_and_joints(
            archive, "gmr", rotation, "root_pos", "dof_pos", beside, warnings,
        )
    },
};
