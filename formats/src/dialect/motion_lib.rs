//! A clip of the motion libraries of PHC, ASAP and GR00T: joblib's file of a dict with a dict for each clip.

use super::{Axis, Dialect, root_and_joints};
use crate::quaternion::ComponentOrder;

pub(super) static DIALECT: Dialect = Dialect {
    name: "motion-lib",
    summary: "{clip: `root_trans_offset`, `root_rot` (x y z w), `dof`, `fps`}; by PHC, ASAP and GR00T",
    arrays: &[
        ("root_trans_offset", &[Axis::Frames, Axis::Is(3)]),
        ("root_rot", &[Axis::Frames, Axis::Is(4)]),
        ("dof", &[Axis::Frames, Axis::Any]),
    ],
    plan: |archive, warnings| {
        let rotation = ("root_rot", ComponentOrder::Xyzw);
        let beside = &["pose_aa", "smpl_joints", "action"];
        root_and_joints(
            archive,
            "motion-lib",
            rotation,
            "root_trans_offset",
            "dof",
            beside,
            warnings,
        )
    },
};
