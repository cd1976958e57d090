//! Kimodo's motion: matrices and positions of all joints in the world, y up, without names, parents or a rate.

use tumble::Layout;

use super::{Axis, Dialect, member, missing};
use crate::diagnostic::Code;
use crate::motion::ScalarKind;
use crate::npz::plan::{ArchivePlan, KeyArray, KeyKind};
use crate::npz::smpl::joints_of_body;

/// The columns of `foot_contacts`.
const CONTACTS: [&str; 4] = [
    "left_heel.contact",
    "left_toe.contact",
    "right_heel.contact",
    "right_toe.contact",
];

pub(super) static DIALECT: Dialect = Dialect {
    name: "kimodo",
    summary: "`posed_joints`, `global_rot_mats`, `local_rot_mats`, `root_positions`, in the world, y up; by Kimodo",
    arrays: &[
        (
            "global_rot_mats",
            &[Axis::Frames, Axis::Any, Axis::Is(3), Axis::Is(3)],
        ),
        (
            "local_rot_mats",
            &[Axis::Frames, Axis::Any, Axis::Is(3), Axis::Is(3)],
        ),
        ("posed_joints", &[Axis::Frames, Axis::Any, Axis::Is(3)]),
        ("root_positions", &[Axis::Frames, Axis::Is(3)]),
    ],
    plan: |archive, warnings| {
        let mut plan = ArchivePlan {
            is_world: true,
            is_part: true,
            // No warning names these arrays, because their contents follow from the poses of all joints.
            companions: &[
                "local_rot_mats",
                "root_positions",
                "smooth_root_pos",
                "global_root_heading",
            ],
            ..ArchivePlan::default()
        };
        plan.add(archive, KeyArray::of_matrices(archive, "global_rot_mats")?)?;
        let positions = KeyArray::of(
            archive,
            "posed_joints",
            KeyKind::Translation,
            0,
            Layout::FrameMajor,
        )?;
        plan.add(
            archive,
            positions.ok_or_else(|| missing(archive, "posed_joints"))?,
        )?;
        let count = plan.tracks;
        // Kimodo has several skeletons; only this one can be recognised by its number of joints.
        match joints_of_body(count).filter(|_| count == 22) {
            Some((names, parents)) => (plan.names, plan.parents) = (names, parents),
            None => {
                warnings.warn(Code::UnnamedJoints, || {
                    let message = format!(
                        "the file does not name its joints ({count}); they are called joint_0, joint_1 …, and their poses are in \
                         world space"
                    );
                    (None, message)
                });
                plan.names = (0..count).map(|joint| format!("joint_{joint}")).collect();
            }
        }
        if let Ok(contacts) = member(archive, "foot_contacts")
            && archive.header(contacts)?.shape == [plan.frames, CONTACTS.len()]
        {
            let names = CONTACTS.map(str::to_owned).to_vec();
            let columns = (contacts, Layout::FrameMajor, 0);
            plan.add_scalars(
                archive,
                columns,
                Some(names),
                |_| ScalarKind::Contact,
                warnings,
            )?;
        }
        plan.read_rate(archive, &["fps"])?;
        Ok(plan)
    },
};
