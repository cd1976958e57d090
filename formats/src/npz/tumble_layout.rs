//! Tumble's layout: `rotations` (tracks, frames, x y z w), and related arrays.

use glam::{DQuat, DVec3};
use tumble::Layout;

use crate::diagnostic::{Code, Diagnostic};
use crate::motion::WrittenJoint;
use crate::motion::{ChannelInterpolation, Channels, Transform};
use crate::npz::archive::Archive;
use crate::npz::plan::{ArchivePlan, KeyArray, KeyKind, TimeList, read_numbers};
use crate::quaternion::ComponentOrder;
use crate::warnings::Warnings;

/// Arrays of the layout that do not contain keys: data of the clip that do not depend on frames.
pub(crate) const CONSTANTS: [&str; 13] = [
    "name",
    "names",
    "parents",
    "rest",
    "is_world",
    NO_WORLD,
    SAMPLERS,
    BVH_CHANNELS,
    END_SITES,
    SCALAR_NAMES,
    SCALAR_KINDS,
    SCALAR_SAMPLERS,
    SCALAR_LIMITS,
];

/// The array of scalars: (scalars, frames).
pub(crate) const SCALARS: &str = "scalars";

/// The array with the name of each scalar.
pub(crate) const SCALAR_NAMES: &str = "scalar_names";

/// The array with the kind of each scalar: `angle`, `length`, `plain` or `contact`.
pub(crate) const SCALAR_KINDS: &str = "scalar_kinds";

/// The array with the interpolation of each scalar: `STEP`, `LINEAR`, or empty if it is not stated.
pub(crate) const SCALAR_SAMPLERS: &str = "scalar_samplers";

/// The array with the limits of each scalar, the smallest and the largest value; NaN for a scalar without.
pub(crate) const SCALAR_LIMITS: &str = "scalar_limits";

/// The array with the interpolation of rotation, translation and scale of each track: `STEP`, `LINEAR`, or empty for
/// a channel at rest.
pub(crate) const SAMPLERS: &str = "samplers";

/// The text that says why poses in the world cannot be computed.
pub(crate) const NO_WORLD: &str = "no_world";

/// The array with the BVH channels of each track: `Zrotation Xrotation Yrotation`.
pub(crate) const BVH_CHANNELS: &str = "bvh_channels";

/// The array with the End Sites of BVH: the track of each, and x y z.
pub(crate) const END_SITES: &str = "end_sites";

/// The plan of a file in this layout; `None` for other files.
pub(crate) fn plan(
    archive: &Archive,
    warnings: &mut Warnings,
) -> Result<Option<ArchivePlan>, Diagnostic> {
    let array = |name, values| KeyArray::of(archive, name, values, 0, Layout::TrackMajor);
    let quaternions = KeyKind::Quaternion(ComponentOrder::Xyzw);
    let mut plan = ArchivePlan {
        is_tumble_layout: true,
        ..ArchivePlan::default()
    };
    match (array("rotations", quaternions)?, frames_of_scalars(archive)) {
        (Some(rotations), _) => plan.add(archive, rotations)?,
        // A clip without tracks: its scalars give the number of frames.
        (None, Some(frames)) => (plan.frames, plan.is_part) = (frames, true),
        (None, None) => return Ok(None),
    }
    for (name, values) in [
        ("translations", KeyKind::Translation),
        ("scales", KeyKind::Scale),
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
    read_scalars(archive, &mut plan, warnings)?;
    read_samplers(archive, &mut plan)?;
    read_bvh(archive, &mut plan)?;
    if let Some(member) = archive.find("is_world") {
        plan.is_world = read_numbers(archive, member)? == [1.0];
    }
    for (name, text) in [("name", &mut plan.name), (NO_WORLD, &mut plan.no_world)] {
        if let Some(texts) = archive.texts(name)? {
            *text = texts.into_iter().next();
        }
    }
    Ok(Some(plan))
}

/// The number of frames of scalars in this layout.
fn frames_of_scalars(archive: &Archive) -> Option<usize> {
    let &[_, frames] = archive.shape(SCALARS)? else {
        return None;
    };
    let has = |name| archive.find(name).is_some();
    (has(SCALAR_NAMES) && has("times")).then_some(frames)
}

/// The texts of an array with `each` of them for each track; `None` if there is no such array.
fn texts(
    archive: &Archive,
    plan: &mut ArchivePlan,
    name: &str,
    each: usize,
) -> Result<Option<Vec<String>>, Diagnostic> {
    let Some(member) = archive.find(name) else {
        return Ok(None);
    };
    let texts = archive.texts(name)?.unwrap_or_default();
    if texts.len() != each * plan.tracks {
        let (found, tracks) = (texts.len(), plan.tracks);
        let message =
            format!("the array has {found} texts; {each} are read for each of {tracks} tracks");
        return Err(archive.refuse(member, Code::Shape, message));
    }
    plan.constants.push(member);
    Ok(Some(texts))
}

fn read_scalars(
    archive: &Archive,
    plan: &mut ArchivePlan,
    warnings: &mut Warnings,
) -> Result<(), Diagnostic> {
    let Some(member) = archive.find(SCALARS) else {
        return Ok(());
    };
    let names = archive.texts(SCALAR_NAMES)?;
    let kinds = archive.texts(SCALAR_KINDS)?.unwrap_or_default();
    let kind = |index: usize| {
        let kind = kinds.get(index).and_then(|kind| kind.parse().ok());
        kind.unwrap_or_default()
    };
    let rows = (member, Layout::TrackMajor, 0);
    plan.add_scalars(archive, rows, names, kind, warnings)?;
    if let (Some(samplers), Some(array)) =
        (archive.texts(SCALAR_SAMPLERS)?, plan.scalars.last_mut())
    {
        for ((_, scalar), text) in array.scalars.iter_mut().zip(&samplers) {
            scalar.interpolation = match text.as_str() {
                "STEP" => Some(ChannelInterpolation::Step),
                "LINEAR" => Some(ChannelInterpolation::Linear),
                _ => None,
            };
        }
    }
    if let (Some(member), Some(array)) = (archive.find(SCALAR_LIMITS), plan.scalars.last_mut()) {
        let limits = read_numbers(archive, member)?;
        let limits = limits.as_chunks::<2>().0;
        for ((_, scalar), limits) in array.scalars.iter_mut().zip(limits) {
            scalar.limits = Some(*limits).filter(|limits| limits[0] <= limits[1]);
        }
    }
    Ok(())
}

fn read_samplers(archive: &Archive, plan: &mut ArchivePlan) -> Result<(), Diagnostic> {
    let Some(texts) = texts(archive, plan, SAMPLERS, 3)? else {
        return Ok(());
    };
    let sampler = |text: &String| match text.as_str() {
        "" => Ok(None),
        "STEP" => Ok(Some(ChannelInterpolation::Step)),
        "LINEAR" => Ok(Some(ChannelInterpolation::Linear)),
        other => {
            let message =
                format!("`{SAMPLERS}` has `{other}`; STEP, LINEAR and an empty text are read");
            Err(Diagnostic::new(&archive.file, Code::Shape, message))
        }
    };
    let all: Vec<Option<ChannelInterpolation>> =
        texts.iter().map(sampler).collect::<Result<_, _>>()?;
    let of_track = |three: &[Option<ChannelInterpolation>; 3]| Channels {
        rotation: three[0],
        translation: three[1],
        scale: three[2],
    };
    plan.channels = all.as_chunks().0.iter().map(of_track).collect();
    Ok(())
}

fn read_bvh(archive: &Archive, plan: &mut ArchivePlan) -> Result<(), Diagnostic> {
    let Some(texts) = texts(archive, plan, BVH_CHANNELS, 1)? else {
        return Ok(());
    };
    for text in &texts {
        let Some(channels) = WrittenJoint::channels_of(text) else {
            let message = format!("`{BVH_CHANNELS}` has `{text}`, no channels of BVH");
            return Err(Diagnostic::new(&archive.file, Code::BvhChannel, message));
        };
        plan.written_joints.push(WrittenJoint {
            channels,
            end_sites: Vec::new(),
        });
    }
    let Some(member) = archive.find(END_SITES) else {
        return Ok(());
    };
    plan.constants.push(member);
    let numbers = read_numbers(archive, member)?;
    let (rows, rest) = numbers.as_chunks::<4>();
    for &[track, x, y, z] in rows {
        let site = DVec3::new(x, y, z).as_vec3();
        let joint = (track >= 0.0 && track.fract() == 0.0).then_some(track as usize);
        let joint = joint.and_then(|joint| plan.written_joints.get_mut(joint));
        match joint.filter(|_| site.is_finite() && rest.is_empty()) {
            Some(joint) => joint.end_sites.push(site),
            None => {
                let message = "rows are a track and three finite numbers";
                return Err(archive.refuse(member, Code::Shape, message.to_owned()));
            }
        }
    }
    Ok(())
}

/// Reads rest transforms: for each track tx ty tz, x y z w, sx sy sz.
fn read_rest(
    archive: &Archive,
    member: usize,
    tracks: usize,
) -> Result<Vec<(Transform, DVec3)>, Diagnostic> {
    let numbers = read_numbers(archive, member)?;
    if numbers.len() != 10 * tracks {
        let message = format!(
            "the array has {} numbers; (tracks, 10) is read, for {tracks} tracks",
            numbers.len()
        );
        return Err(archive.refuse(member, Code::Shape, message));
    }
    if let Some(bad) = numbers
        .iter()
        .position(|&number| !(number as f32).is_finite())
    {
        let message = format!("number {bad} of the array is {}, not finite", numbers[bad]);
        return Err(archive.refuse(member, Code::NotFinite, message));
    }
    let (rows, _) = numbers.as_chunks::<10>();
    let rest = |&[tx, ty, tz, x, y, z, w, sx, sy, sz]: &[f64; 10]| {
        let position = DVec3::new(tx, ty, tz);
        let rest = Transform {
            translation: position.as_vec3(),
            rotation: DQuat::from_xyzw(x, y, z, w).as_quat(),
            scale: DVec3::new(sx, sy, sz).as_vec3(),
        };
        (rest, position)
    };
    Ok(rows.iter().map(rest).collect())
}
