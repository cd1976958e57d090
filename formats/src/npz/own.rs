//! Our own layout: `rotations` (tracks, frames, x y z w) and what belongs to it.

use glam::{Quat, Vec3};
use tumble::Layout;

use crate::diagnostic::{Code, Diagnostic};
use crate::motion::Transform;
use crate::npy::ComponentOrder;
use crate::npz::archive::Archive;
use crate::npz::plan::{Part, Plan, TimeList, Values, read_numbers};

/// Arrays of the layout that are no keys: what the clip is, in all frames.
pub(crate) const CONSTANTS: [&str; 5] = ["name", "names", "parents", "rest", "is_world"];

/// The plan of such a file; `None` for another.
pub(crate) fn plan(archive: &Archive) -> Result<Option<Plan>, Diagnostic> {
    let array = |name, values| Part::of(archive, name, values, 0, Layout::TrackMajor);
    let quaternions = Values::Quaternion(ComponentOrder::Xyzw);
    let Some(rotations) = array("rotations", quaternions)? else {
        return Ok(None);
    };
    let mut plan = Plan {
        is_own: true,
        ..Plan::default()
    };
    plan.add(archive, rotations)?;
    for (name, values) in [
        ("translations", Values::Translation),
        ("scales", Values::Scale),
    ] {
        if let Some(vectors) = array(name, values)? {
            plan.add(archive, vectors)?;
        }
    }
    plan.times = archive
        .find("times")
        .map(|member| TimeList { member, column: 0 });
    plan.read_names(archive, "names")?;
    plan.read_parents(archive, "parents")?;
    plan.read_rate(archive, &["fps"])?;
    if let Some(member) = archive.find("rest") {
        plan.rest = read_rest(archive, member, plan.tracks)?;
        plan.constants.push(member);
    }
    if let Some(member) = archive.find("is_world") {
        plan.is_world = read_numbers(archive, member)? == [1.0];
    }
    if let Some(array) = archive.array_named("name")? {
        plan.name = array
            .texts()
            .ok()
            .and_then(|texts| texts.into_iter().next());
    }
    Ok(Some(plan))
}

/// Rest poses: for each track tx ty tz, x y z w, sx sy sz.
fn read_rest(
    archive: &Archive,
    member: usize,
    tracks: usize,
) -> Result<Vec<Transform>, Diagnostic> {
    let numbers = read_numbers(archive, member)?;
    if numbers.len() != 10 * tracks {
        let message = format!(
            "the array has {} numbers; (tracks, 10) is read, for {tracks} tracks",
            numbers.len()
        );
        return Err(archive.refuse(member, Code::Shape, message));
    }
    let numbers: Vec<f32> = numbers.into_iter().map(|number| number as f32).collect();
    if let Some(bad) = numbers.iter().position(|number| !number.is_finite()) {
        let message = format!("number {bad} of the array is {}, not finite", numbers[bad]);
        return Err(archive.refuse(member, Code::NotFinite, message));
    }
    let (rows, _) = numbers.as_chunks::<10>();
    let rest = |&[tx, ty, tz, x, y, z, w, sx, sy, sz]: &[f32; 10]| Transform {
        translation: Vec3::new(tx, ty, tz),
        rotation: Quat::from_xyzw(x, y, z, w),
        scale: Vec3::new(sx, sy, sz),
    };
    Ok(rows.iter().map(rest).collect())
}
