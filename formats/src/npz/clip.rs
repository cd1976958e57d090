//! Reads the arrays of a plan as a clip.

use std::ops::Range;

use glam::{DQuat, DVec3, Quat, Vec3};
use tumble::{TrackError, TrackSet};

use crate::array::Element;
use crate::diagnostic::{Code, Diagnostic, Location};
use crate::format::ReadOptions;
use crate::motion::keys::{Duplicates, Origin, quiet_unit, select};
use crate::motion::origin::relative;
use crate::motion::signs::continue_signs;
use crate::motion::{
    Body, Joint, Motion, RecordedBodies, RecordedRobot, RecordedSample, Transform,
};
use crate::npz::archive::Archive;
use crate::npz::array::{Array, AsStored, MIN_PARALLEL_KEYS, Make, Strides, TOGETHER};
use crate::npz::body_model::shape_of;
use crate::npz::plan::{ArchivePlan, KeyArray, KeyKind};
use crate::npz::rotation_vector;
use crate::quaternion::ComponentOrder::{self, Wxyz, Xyzw};
use crate::quaternion::rounded;
use crate::rotation_form::RotationForm;
use crate::warnings::Warnings;

/// Bytes of memory of a key while it is read and in the set: its time, its rotation and its vectors.
const KEY: usize = 64;

/// Bytes of memory of a track without its keys.
const TRACK: usize = 400;

/// Reads the clip, and stores its rate in the plan.
pub(crate) fn read(
    archive: &Archive,
    plan: &mut ArchivePlan,
    options: &ReadOptions,
    warnings: &mut Warnings,
) -> Result<Motion, Diagnostic> {
    let arrays: Vec<Array<'_>> = plan
        .parts
        .iter()
        .map(|part| archive.array(part.member))
        .collect::<Result<_, _>>()?;
    archive.take(plan.tracks.saturating_mul(plan.frames), KEY)?;
    archive.take(plan.tracks, TRACK)?;
    // There cannot be more frames than the bytes of the arrays allow.
    let mut times = plan.read_times(archive, options)?;
    if let Some(message) = plan.two_rates.take() {
        warnings.warn(Code::TwoRates, || (None, message));
    }
    plan.all_times.clone_from(&times);
    let kept = kept_frames(archive, plan, &arrays, &mut times, options, warnings)?;
    select(&mut times, kept.as_deref());
    let mut motion = Motion {
        name: plan.name.clone(),
        rate: plan.rate,
        is_world: plan.is_world,
        no_world: plan.no_world.clone(),
        body: match plan.is_body {
            true => Some(Body {
                shape: shape_of(archive)?,
                ..Body::default()
            }),
            false => None,
        },
        channels: plan.channels.clone(),
        written_joints: plan.written_joints.clone(),
        ..Motion::default()
    };
    let set = &mut motion.set;
    set.reserve(plan.tracks, plan.tracks.saturating_mul(times.len()));
    let refuse = |error: TrackError| {
        Diagnostic::new(
            &archive.file,
            Code::TooLarge,
            format!("the clip cannot be kept: {error}"),
        )
    };
    // While the keys of some tracks are added to the set, the keys of the next tracks are read.
    let at_once = TOGETHER * std::thread::available_parallelism().map_or(1, usize::from);
    let read_of = read_tracks(plan, options);
    let is_read = |track: usize| read_of.get(track).copied().unwrap_or(true);
    let jobs = plan.parts.iter().zip(&arrays).flat_map(|(part, array)| {
        let all: Vec<usize> = part.tracks.clone().collect();
        let runs = all.chunk_by(|&a, &b| is_read(a) == is_read(b));
        let runs = runs.flat_map(|run| run.chunks(at_once));
        let jobs = runs.map(|run| (part, array, run[0]..run[0] + run.len()));
        jobs.collect::<Vec<_>>()
    });
    let mut origins = Vec::new();
    let mut push = |track: usize, values: KeyKind, keys: TrackKeys| match keys {
        TrackKeys::NotRead if !values.is_rotation() => Ok(()),
        TrackKeys::NotRead => {
            let name = plan.names.get(track).map_or("", String::as_str);
            let times = &times[..times.len().min(1)];
            let rest = &[Quat::IDENTITY][..times.len()];
            set.push(name, times, rest).map_err(refuse)
        }
        TrackKeys::Rotations(mut keys) => {
            select(&mut keys, kept.as_deref());
            let name = plan.names.get(track).map_or("", String::as_str);
            set.push(name, &times, &keys).map_err(refuse)
        }
        TrackKeys::Vectors(origin, mut keys) => {
            origins.push((track, origin));
            select(&mut keys, kept.as_deref());
            let set_keys = match values {
                KeyKind::Scale => TrackSet::set_scales,
                _ => TrackSet::set_translations,
            };
            set_keys(set, track, &times, &keys, &[]).map_err(refuse)
        }
    };
    let is_small = plan.tracks.saturating_mul(plan.frames) < MIN_PARALLEL_KEYS;
    let mut pending = Vec::new();
    for (part, array, tracks) in jobs {
        let mut push_pending = || {
            let mut pending = pending.drain(..);
            pending.try_for_each(|(track, values, keys)| push(track, values, keys))
        };
        let mut read = || match is_read(tracks.start) {
            true => read_keys(archive, part, array, tracks.clone(), plan.frames, warnings),
            false => Ok(tracks.clone().map(|_| TrackKeys::NotRead).collect()),
        };
        let (pushed, read) = match is_small {
            true => (push_pending(), read()),
            false => {
                let together =
                    tumble::on_threads(|| rayon::join(&mut push_pending, &mut read)).ok();
                // If the system refuses to start threads, this thread does all the work.
                together.unwrap_or_else(|| (push_pending(), read()))
            }
        };
        pushed?;
        pending = tracks
            .zip(read?)
            .map(|(track, keys)| (track, part.kind, keys))
            .collect();
    }
    pending
        .into_iter()
        .try_for_each(|(track, values, keys)| push(track, values, keys))?;
    for (track, origin) in origins {
        motion.set_origin(track, origin);
    }
    let all = || (0..plan.frames).collect();
    let frames = kept.clone().unwrap_or_else(all);
    for part in &plan.scalars {
        part.read(archive, (&times, &frames), &mut motion)?;
    }
    if let Some(message) = motion.angle_jump() {
        warnings.warn(Code::AngleJumps, || (None, message));
    }
    if let Some(message) = motion.coarse_angle() {
        warnings.warn(Code::CoarseAngles, || (None, message));
    }
    motion.robot = recorded_robot(archive, plan, &frames)?;
    if !plan.parents.is_empty() || !plan.rest.is_empty() {
        for track in 0..plan.tracks {
            let parent = plan.parents.get(track).copied().flatten();
            let rest = plan.rest.get(track).map(|&(rest, position)| Transform {
                translation: motion.resting_at(track, parent, position),
                ..rest
            });
            motion.skeleton.push(Joint {
                parent,
                rest: rest.unwrap_or_default(),
            });
        }
    }
    Ok(motion)
}

/// For each track, whether its keys are read.
fn read_tracks(plan: &ArchivePlan, options: &ReadOptions) -> Vec<bool> {
    let name = |track: usize| plan.names.get(track).map_or("", String::as_str);
    match &options.tracks {
        Some(selection) => selection.are_needed((0..plan.tracks).map(name), &plan.parents),
        None => vec![true; plan.tracks],
    }
}

/// At how many keys the bodies of a robot are read, for the check of their order.
const CHECKED_KEYS: usize = 8;

/// The robot as the file describes it, with its bodies at some of the keys; `frames` are those of the keys. `None` if
/// the plan has no robot.
fn recorded_robot(
    archive: &Archive,
    plan: &ArchivePlan,
    frames: &[usize],
) -> Result<Option<RecordedRobot>, Diagnostic> {
    let Some(robot) = &plan.robot else {
        return Ok(None);
    };
    let mut recorded = RecordedRobot {
        dialect: robot.dialect,
        names_joints: robot.names_joints,
        bodies: None,
    };
    let Some([positions, rotations]) = robot.bodies else {
        return Ok(Some(recorded));
    };
    let arrays = [archive.array(positions)?, archive.array(rotations)?];
    let count = arrays[0].header.shape[1];
    archive.take(count * CHECKED_KEYS, KEY)?;
    let at = |array: &Array<'_>, frame: usize| {
        let strides = array.header.strides();
        Strides {
            first: frame * strides[0],
            track: strides[1],
            frame: strides[0],
            component: strides[2],
        }
    };
    let step = frames.len().div_ceil(CHECKED_KEYS).max(1);
    let keys = (0..frames.len()).step_by(step);
    let samples = keys.map(|key| {
        let [positions, rotations] = &arrays;
        let of_bodies =
            positions
                .tracks::<AsStored, 3, _>(at(positions, frames[key]), 0..count, 1, |list| list);
        let root =
            rotations.tracks::<AsStored, 4, _>(at(rotations, frames[key]), 0..1, 1, |list| list);
        RecordedSample {
            key,
            positions: of_bodies
                .concat()
                .into_iter()
                .map(DVec3::from_array)
                .collect(),
            root: root.concat().first().copied().unwrap_or_default(),
        }
    });
    recorded.bodies = Some(RecordedBodies {
        positions: archive.members[positions].name.clone(),
        rotations: archive.members[rotations].name.clone(),
        order: robot.order,
        names: robot.body_names.clone(),
        count,
        samples: samples.collect(),
    });
    Ok(Some(recorded))
}

/// The frames that are kept if times repeat: see [`Origin::increasing`].
fn kept_frames(
    archive: &Archive,
    plan: &ArchivePlan,
    arrays: &[Array<'_>],
    times: &mut [f64],
    options: &ReadOptions,
    warnings: &mut Warnings,
) -> Result<Option<Vec<usize>>, Diagnostic> {
    let name = match plan.times {
        Some(list) => &*archive.members[list.member].name,
        None => "",
    };
    let origin = Origin {
        file: &archive.file,
        location: &|frame| Location::Inside(format!("{name}[{frame}]")),
        duplicates: options.duplicates,
    };
    let equal = |a: usize, b: usize| {
        let mut parts = plan.parts.iter().zip(arrays);
        parts.all(|(part, array)| frame_of(part, array, a) == frame_of(part, array, b))
    };
    origin.increasing(times, equal, warnings)
}

/// The numbers of all tracks of an array at one frame.
fn frame_of(part: &KeyArray, array: &Array<'_>, frame: usize) -> Vec<Vec<f64>> {
    let mut at = part.at;
    at.first += frame * at.frame;
    let tracks = 0..part.tracks.len();
    match part.kind {
        KeyKind::Quaternion(_) => array.tracks::<AsStored, 4, _>(at, tracks, 1, |l| l.concat()),
        KeyKind::Form(RotationForm::Matrix) => {
            array.tracks::<AsStored, 9, _>(at, tracks, 1, |l| l.concat())
        }
        _ => array.tracks::<AsStored, 3, _>(at, tracks, 1, |l| l.concat()),
    }
}

/// The keys of one track.
enum TrackKeys {
    /// The track is at rest, because it will not be selected.
    NotRead,
    /// Unit quaternions.
    Rotations(Vec<Quat>),
    /// Translations or scales, and the vector to add to translations.
    Vectors(DVec3, Vec<Vec3>),
}

/// The keys of some tracks of an array.
fn read_keys(
    archive: &Archive,
    part: &KeyArray,
    array: &Array<'_>,
    tracks: Range<usize>,
    frames: usize,
    warnings: &mut Warnings,
) -> Result<Vec<TrackKeys>, Diagnostic> {
    let in_part = tracks.start - part.tracks.start..tracks.end - part.tracks.start;
    let at = part.at;
    let quiet = |keys: Vec<Quat>| (keys.iter().all(|key| !key.w.is_nan())).then_some(keys);
    let lists = match part.kind {
        KeyKind::Quaternion(Xyzw) => {
            array.tracks::<QuietXyzw, 4, _>(at, in_part.clone(), frames, quiet)
        }
        KeyKind::Quaternion(Wxyz) => {
            array.tracks::<QuietWxyz, 4, _>(at, in_part.clone(), frames, quiet)
        }
        KeyKind::RotationVector => {
            // If a rotation vector jumps to the other side of π, its quaternion is continued without a jump.
            let finish = |mut keys: Vec<Quat>| {
                continue_signs(&mut keys, 1);
                quiet(keys)
            };
            array.tracks::<FromVector, 3, _>(at, in_part.clone(), frames, finish)
        }
        KeyKind::Form(form) => {
            return of_form(archive, part, array, (form, in_part), frames);
        }
        _ => return vectors(archive, part, array, in_part, frames),
    };
    let keys = lists
        .into_iter()
        .zip(in_part)
        .map(|(keys, track)| match keys {
            Some(keys) => Ok(TrackKeys::Rotations(keys)),
            None => {
                remarkable(archive, part, array, track, frames, warnings).map(TrackKeys::Rotations)
            }
        });
    keys.collect()
}

#[inline(always)]
fn quaternion(order: ComponentOrder, [a, b, c, d]: [f64; 4]) -> DQuat {
    match order {
        Xyzw => DQuat::from_xyzw(a, b, c, d),
        Wxyz => DQuat::from_xyzw(b, c, d, a),
    }
}

/// Unit quaternions of rotation vectors.
struct FromVector;
/// Unit quaternions, or NaN if a warning or an error is needed.
struct QuietXyzw;
/// Likewise.
struct QuietWxyz;

impl Make<3> for FromVector {
    type Key = Quat;

    #[inline(always)]
    fn make(vector: [f64; 3]) -> Quat {
        rounded(rotation_vector::exp(vector))
    }
}

impl Make<4> for QuietXyzw {
    type Key = Quat;

    #[inline(always)]
    fn make(numbers: [f64; 4]) -> Quat {
        quiet_unit(quaternion(Xyzw, numbers))
    }
}

impl Make<4> for QuietWxyz {
    type Key = Quat;

    #[inline(always)]
    fn make(numbers: [f64; 4]) -> Quat {
        quiet_unit(quaternion(Wxyz, numbers))
    }
}

/// Translations and scales.
struct InF32;

impl Make<3> for InF32 {
    type Key = Vec3;

    #[inline(always)]
    fn make(numbers: [f64; 3]) -> Vec3 {
        Vec3::from_array(numbers.map(|number| number as f32))
    }
}

/// The keys of a track of which at least one needs a warning or an error.
fn remarkable(
    archive: &Archive,
    part: &KeyArray,
    array: &Array<'_>,
    part_track: usize,
    frames: usize,
    warnings: &mut Warnings,
) -> Result<Vec<Quat>, Diagnostic> {
    let track = part.tracks.start + part_track;
    let origin = Origin {
        file: &archive.file,
        location: &|frame| Location::Inside(part.index_text(archive, track, frame)),
        duplicates: Duplicates::Refuse,
    };
    let one = part_track..part_track + 1;
    let KeyKind::Quaternion(order) = part.kind else {
        let vectors = array.tracks::<AsStored, 3, _>(part.at, one, frames, |list| list);
        let is_bad = |vector: &[f64; 3]| !rotation_vector::exp(*vector).is_finite();
        let bad = vectors
            .iter()
            .flatten()
            .enumerate()
            .find(|(_, vector)| is_bad(vector));
        let (frame, vector) = bad.unwrap_or((0, &[f64::NAN; 3]));
        let message = format!("the rotation vector {vector:?} has no finite length; repair it");
        return Err(Diagnostic {
            location: Some((origin.location)(frame)),
            ..Diagnostic::new(&archive.file, Code::NotFinite, message)
        });
    };
    let keys = array.tracks::<AsStored, 4, _>(part.at, one, frames, |list| list);
    let keys = keys.into_iter().flatten();
    origin.unit(keys.map(|numbers| quaternion(order, numbers)), warnings)
}

/// The rotations of some tracks of an array that are not quaternions.
fn of_form(
    archive: &Archive,
    part: &KeyArray,
    array: &Array<'_>,
    (form, tracks): (RotationForm, Range<usize>),
    frames: usize,
) -> Result<Vec<TrackKeys>, Diagnostic> {
    fn keys<const N: usize>(form: RotationForm, list: &[[f64; N]]) -> Result<Vec<Quat>, usize> {
        let key =
            |(frame, numbers): (usize, &[f64; N])| form.rotation(numbers).map(rounded).ok_or(frame);
        let mut keys = list
            .iter()
            .enumerate()
            .map(key)
            .collect::<Result<Vec<_>, _>>()?;
        continue_signs(&mut keys, 1);
        Ok(keys)
    }
    let range = tracks.clone();
    let lists = match form.width() {
        9 => array.tracks::<AsStored, 9, _>(part.at, range, frames, |list| keys(form, &list)),
        _ => array.tracks::<AsStored, 3, _>(part.at, range, frames, |list| keys(form, &list)),
    };
    let check = |(track, found): (usize, Result<Vec<Quat>, usize>)| {
        found.map(TrackKeys::Rotations).map_err(|frame| {
            let message = "these numbers are not a rotation; repair the array, or say another form";
            let refusal = Diagnostic::new(&archive.file, Code::NoRotation, message);
            refusal.inside(part.index_text(archive, part.tracks.start + track, frame))
        })
    };
    tracks.zip(lists).map(check).collect()
}

/// The vectors of some tracks of an array.
fn vectors(
    archive: &Archive,
    part: &KeyArray,
    array: &Array<'_>,
    in_part: Range<usize>,
    frames: usize,
) -> Result<Vec<TrackKeys>, Diagnostic> {
    let checked = |origin, list: Vec<Vec3>| {
        let bad = list.iter().position(|vector| !vector.is_finite());
        (origin, list, bad)
    };
    // Positions in f32 have already lost the digits that an origin would keep.
    let has_origin = part.kind == KeyKind::Translation && array.header.element == Element::F64;
    let lists = match has_origin {
        true => array.tracks::<AsStored, 3, _>(part.at, in_part.clone(), frames, |list| {
            let points: Vec<DVec3> = list.into_iter().map(DVec3::from_array).collect();
            let (origin, list) = relative(&points);
            checked(origin, list)
        }),
        false => array.tracks::<InF32, 3, _>(part.at, in_part.clone(), frames, |list| {
            checked(DVec3::ZERO, list)
        }),
    };
    let check = |(track, (origin, list, bad)): (usize, (DVec3, Vec<Vec3>, Option<usize>))| match bad
    {
        None => Ok(TrackKeys::Vectors(origin, list)),
        Some(frame) => {
            let message = format!("the vector {} is not finite in f32", list[frame]);
            let refusal = Diagnostic::new(&archive.file, Code::NotFinite, message);
            Err(refusal.inside(part.index_text(archive, part.tracks.start + track, frame)))
        }
    };
    in_part.zip(lists).map(check).collect()
}
