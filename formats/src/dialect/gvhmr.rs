//! GVHMR's motion of a person: a file of `torch.save` with the parameters of an SMPL-X body in the world, and the same in
//! the camera's axes, at 30 frames a second.

use tumble::FrameRate;

use crate::diagnostic::{Code, Diagnostic};
use crate::format::ReadOptions;
use crate::npz::archive::Archive;

/// The dict with the parameters in the world, and how the names of its values begin.
const WORLD: &str = "smpl_params_global.";

/// Keeps only the parameters of the body in world space, and gives them the names of the body model; `None` for other
/// files. Returns the options with the rate, and a warning that it is assumed.
pub(crate) fn narrowed(
    archive: &mut Archive,
    options: &ReadOptions,
) -> Option<(ReadOptions, Option<Diagnostic>)> {
    let has = |name: &str| archive.find(&format!("{WORLD}{name}")).is_some();
    if !["body_pose", "global_orient", "transl"]
        .into_iter()
        .all(has)
    {
        return None;
    }
    archive
        .members
        .retain(|member| member.name.starts_with(WORLD));
    for member in &mut archive.members {
        member.name.drain(..WORLD.len());
    }
    let mut options = options.clone();
    let is_stated = options.source_rate.or(options.override_rate).is_some();
    options.source_rate = options.source_rate.or_else(|| FrameRate::new(30, 1).ok());
    let warning = (!is_stated).then(|| {
        let message = "the file has no rate; 30 frames a second are assumed, as for GVHMR; --source-fps gives another";
        Diagnostic::new(&archive.file, Code::AssumedRate, message)
    });
    Some((options, warning))
}
