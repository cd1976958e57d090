//! Motion of bodies in the world, in a layout of robot learning: `body_rotations` (frames, bodies, w x y z),
//! `body_positions`, `body_names` and `fps`; and the joints between them, `dof_positions` (frames, joints), `dof_names`.

use tumble::Layout;

use crate::diagnostic::Diagnostic;
use crate::motion::ScalarKind;
use crate::npz::archive::Archive;
use crate::npz::plan::{ArchivePlan, KeyArray, KeyKind, RobotArrays};
use crate::quaternion::ComponentOrder;
use crate::warnings::Warnings;

/// Arrays that these files usually have besides the poses: their rates.
const BESIDE: [&str; 3] = [
    "body_angular_velocities",
    "body_linear_velocities",
    "dof_velocities",
];

/// The plan of a file in this layout; `None` for other files.
pub(crate) fn plan(
    archive: &Archive,
    warnings: &mut Warnings,
) -> Result<Option<ArchivePlan>, Diagnostic> {
    let array = |name, values| KeyArray::of(archive, name, values, 0, Layout::FrameMajor);
    let quaternions = KeyKind::Quaternion(ComponentOrder::Wxyz);
    let Some(rotations) = array("body_rotations", quaternions)? else {
        return Ok(None);
    };
    let mut plan = ArchivePlan {
        is_world: true,
        companions: &BESIDE,
        ..ArchivePlan::default()
    };
    let rotation_member = rotations.0.member;
    plan.add(archive, rotations)?;
    let positions = array("body_positions", KeyKind::Translation)?;
    let position_member = positions.as_ref().map(|positions| positions.0.member);
    if let Some(positions) = positions {
        plan.add(archive, positions)?;
    }
    plan.read_names(archive, "body_names")?;
    let members = position_member.map(|member| [member, rotation_member]);
    if let Some(member) = archive.find("dof_positions") {
        let names = archive.texts("dof_names")?;
        let columns = (member, Layout::FrameMajor, 0);
        let is_of_bodies =
            |&member: &usize| (archive.header(member)).is_ok_and(|header| header.shape.len() == 3);
        plan.robot = Some(RobotArrays {
            bodies: members.filter(|members| members.iter().all(is_of_bodies)),
            order: ComponentOrder::Wxyz,
            body_names: plan.names.clone(),
            ..RobotArrays::of("isaaclab", names.is_some())
        });
        plan.add_scalars(archive, columns, names, |_| ScalarKind::Angle, warnings)?;
        plan.constants.extend(archive.find("dof_names"));
    }
    plan.read_rate(archive, &["fps"])?;
    Ok(Some(plan))
}
