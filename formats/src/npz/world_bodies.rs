//! Motion of bodies in the world, in a layout of robot learning: `body_rotations` (frames, bodies, w x y z),
//! `body_positions`, `body_names` and `fps`.

use tumble::Layout;

use crate::diagnostic::Diagnostic;
use crate::npz::archive::Archive;
use crate::npz::plan::{ArchivePlan, KeyArray, KeyKind};
use crate::quaternion::ComponentOrder;

/// Arrays that these files usually have besides the bodies' poses: their rates, and the same motion as angles of
/// joints.
const BESIDE: [&str; 5] = [
    "body_angular_velocities",
    "body_linear_velocities",
    "dof_names",
    "dof_positions",
    "dof_velocities",
];

/// The plan of a file in this layout; `None` for other files.
pub(crate) fn plan(archive: &Archive) -> Result<Option<ArchivePlan>, Diagnostic> {
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
    plan.add(archive, rotations)?;
    if let Some(positions) = array("body_positions", KeyKind::Translation)? {
        plan.add(archive, positions)?;
    }
    plan.read_names(archive, "body_names")?;
    plan.read_rate(archive, &["fps"])?;
    Ok(Some(plan))
}
