//! WHAM's motion of people: joblib's file of a dict with a dict for each person, the parameters of an SMPL body in the world.

use tumble::Layout;

use super::{Axis, Dialect, member, smpl_body};
use crate::npz::plan::{KeyArray, KeyKind};

pub(super) static DIALECT: Dialect = Dialect {
    name: "wham",
    summary: "{person: `pose_world`, `trans_world`, `frame_ids`}, rotation vectors of SMPL; by WHAM",
    arrays: &[
        ("pose_world", &[Axis::Frames, Axis::Is(72)]),
        ("trans_world", &[Axis::Frames, Axis::Is(3)]),
    ],
    plan: |archive, _| {
        let array = |name, kind| {
            let found = KeyArray::of(archive, name, kind, 0, Layout::FrameMajor)?;
            found.ok_or_else(|| super::missing(archive, name))
        };
        let mut plan = smpl_body(24);
        plan.add(archive, array("pose_world", KeyKind::RotationVector)?)?;
        plan.add(archive, array("trans_world", KeyKind::Translation)?)?;
        // Frames in which the person is not visible are missing in the file.
        plan.frame_numbers = member(archive, "frame_ids").ok();
        plan.read_rate(archive, &["fps"])?;
        Ok(plan)
    },
};
