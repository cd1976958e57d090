//! `MimicKit`'s motion of a robot: a pickle of a dict, with a list for each frame.

use tumble::Layout;

use super::{Axis, Dialect, member, root};
use crate::motion::ScalarKind;
use crate::npz::plan::{ArchivePlan, KeyKind, RobotArrays};

pub(super) static DIALECT: Dialect = Dialect {
    name: "mimickit",
    summary: "`frames`: root x y z, its rotation vector, joints; `fps`, `loop_mode`; by MimicKit",
    arrays: &[
        ("frames", &[Axis::Frames, Axis::Over(6)]),
        ("loop_mode", &[]),
        ("fps", &[]),
    ],
    plan: |archive, warnings| {
        let mut plan = ArchivePlan {
            is_world: true,
            is_part: true,
            names: vec!["root".to_owned()],
            companions: &["loop_mode"],
            robot: Some(RobotArrays::of("mimickit", false)),
            ..ArchivePlan::default()
        };
        plan.add(
            archive,
            root(archive, "frames", KeyKind::RotationVector, 3)?,
        )?;
        plan.add(archive, root(archive, "frames", KeyKind::Translation, 0)?)?;
        // Joints that are balls have three numbers each, but the file does not say which joints are balls.
        let columns = (member(archive, "frames")?, Layout::FrameMajor, 6);
        plan.add_scalars(archive, columns, None, |_| ScalarKind::Angle, warnings)?;
        plan.read_rate(archive, &["fps"])?;
        Ok(plan)
    },
};
