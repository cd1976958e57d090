//! TRAM's motion of a person: an NPY file with a dict, the parameters of an SMPL body in the camera's axes.

use super::{Axis, Dialect, member, root, smpl_body};
use crate::npz::plan::{KeyArray, KeyKind};

pub(super) static DIALECT: Dialect = Dialect {
    name: "tram",
    summary: "`pred_rotmat`, `pred_trans`, `frame`, matrices of SMPL in the camera's axes; by TRAM",
    arrays: &[
        (
            "pred_rotmat",
            &[Axis::Frames, Axis::Is(24), Axis::Is(3), Axis::Is(3)],
        ),
        ("pred_trans", &[Axis::Frames, Axis::Is(1), Axis::Is(3)]),
    ],
    plan: |archive, _| {
        let mut plan = smpl_body(24);
        plan.add(archive, KeyArray::of_matrices(archive, "pred_rotmat")?)?;
        plan.add(
            archive,
            root(archive, "pred_trans", KeyKind::Translation, 0)?,
        )?;
        // Frames in which the person is not visible are missing in the file.
        plan.frame_numbers = member(archive, "frame").ok();
        plan.read_rate(archive, &["fps"])?;
        Ok(plan)
    },
};
