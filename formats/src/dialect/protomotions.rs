//! Motion of `ProtoMotions`: a file of `torch.save` with the state of a simulation, or a library of clips end to end.

use super::{Axis, Dialect, root_and_joints};
use crate::budget::Budget;
use crate::diagnostic::{Code, Diagnostic};
use crate::format::{Loaded, ReadOptions};
use crate::limits::Limits;
use crate::npz;
use crate::npz::archive::{Archive, Member};
use crate::npz::plan::read_numbers;
use crate::quaternion::ComponentOrder;
use crate::rate::{RateSource, of};

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

/// The arrays of a library, and what a file of one clip calls them.
const LIBRARY: [(&str, &str); 3] = [
    ("gts", "rigid_body_pos"),
    ("grs", "rigid_body_rot"),
    ("dps", "dof_pos"),
];

/// The clips of a library, which are rows of its arrays; `None` for other files.
pub(crate) fn library(
    archive: &Archive,
    options: &ReadOptions,
) -> Option<Result<Loaded, Diagnostic>> {
    let is_library = LIBRARY.iter().all(|(name, _)| archive.find(name).is_some())
        && archive.find("length_starts").is_some();
    is_library.then(|| clips_of(archive, options))
}

fn clips_of(archive: &Archive, options: &ReadOptions) -> Result<Loaded, Diagnostic> {
    let list = |name: &str| read_numbers(archive, super::member(archive, name)?);
    let starts = list("length_starts")?;
    let counts = list("motion_num_frames")?;
    let steps = list("motion_dt")?;
    let names = archive.texts("motion_files")?.unwrap_or_default();
    if counts.len() != starts.len() || steps.len() != starts.len() {
        let member = super::member(archive, "length_starts")?;
        let message = format!(
            "{} starts of clips, {} numbers of frames and {} durations of frames",
            starts.len(),
            counts.len(),
            steps.len()
        );
        return Err(archive.refuse(member, Code::Shape, message));
    }
    let mut all = Loaded::default();
    for (index, (&start, &count)) in starts.iter().zip(&counts).enumerate() {
        let mut options = options.clone();
        let rate = of(&RateSource::Number(1.0 / steps[index])).map(|found| found.grid);
        options.source_rate = options.source_rate.or(rate);
        let part = rows_of(archive, (start, count), options.limits)
            .and_then(|archive| npz::of_values(&archive, &options))
            .map_err(|error| error.inside(format!("clip {index}")));
        match part {
            Ok(mut loaded) => {
                for clip in &mut loaded.clips {
                    clip.index = index;
                    clip.name = names.get(index).cloned();
                }
                all.clips.append(&mut loaded.clips);
                for warning in loaded.warnings {
                    if !all.warnings.iter().any(|known| known.code == warning.code) {
                        all.warnings.push(warning);
                    }
                }
            }
            Err(error) => all.refused.push(error),
        }
    }
    match all.clips.is_empty() && !all.refused.is_empty() {
        true => Err(all.refused.swap_remove(0)),
        false => Ok(all),
    }
}

/// Some rows of the arrays of a library, with the names of those of one clip.
fn rows_of(
    archive: &Archive,
    (start, count): (f64, f64),
    limits: Limits,
) -> Result<Archive, Diagnostic> {
    let (mut members, mut bytes) = (Vec::new(), Vec::new());
    for (name, clip_name) in LIBRARY {
        let member = super::member(archive, name)?;
        let array = archive.array(member)?;
        let mut header = array.header.clone();
        let rows = header.shape.first().copied().unwrap_or(0);
        let is_row = |number: f64| number >= 0.0 && number.fract() == 0.0;
        if !(is_row(start) && is_row(count) && start + count <= rows as f64) || header.is_fortran {
            let message = format!(
                "a clip has {count} rows from row {start} on, but there are only {rows} rows"
            );
            return Err(archive.refuse(member, Code::Shape, message));
        }
        let whole = &array.bytes[header.start..];
        let row = whole.len() / rows.max(1);
        // Memory for the rows and for their keys. Clips may share rows, so the file's length is no bound.
        archive.take(count as usize * row, 16)?;
        let first = bytes.len();
        bytes.extend_from_slice(&whole[start as usize * row..][..count as usize * row]);
        header.shape[0] = count as usize;
        header.start = 0;
        let data = first..bytes.len();
        members.push(Member::of_value(
            clip_name.to_owned(),
            name.to_owned(),
            header,
            data,
        ));
    }
    let budget = Budget::of(bytes.len(), limits);
    Ok(Archive::of_values(&archive.file, bytes, budget, members))
}
