//! A motion of `ProtoMotions`: a file of `torch.save` with the state of a simulation.

use super::{Axis, Dialect, root_and_joints};
use crate::quaternion::ComponentOrder;

pub(super) static DIALECT: Dialect = Dialect {
    name: "protomotions",
    summary: "`dof_pos`, `rigid_body_pos`, `rigid_body_rot` (x y z w), `fps`; by ProtoMotions",
    arrays: &[
        ("dof_pos", &[Axis::Frames, Axis::Any]),
        ("rigid_body_pos", &[Axis::Frames, Axis::Any, Axis::Is(3)]),
        ("rigid_body_rot", &[Axis::Frames, Axis::Any, Axis::Is(4)]),
    ],
    plan: |archive, warnings| {
        let rotation = ("rigid_body_rot", ComponentOrder::Xyzw);
        let beside = &[
            "dof_vel",
            "rigid_body_vel",
            "rigid_body_ang_vel",
            "rigid_body_contacts",
            "local_rigid_body_rot",
        ];
        root_and_joints(
            archive,
            "protomotions",
            rotation,
            "rigid_body_pos",
            "dof_pos",
            beside,
            warnings,
        )
    },
};
