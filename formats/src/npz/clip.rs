//! A plan's arrays as a clip.

use std::ops::Range;

use glam::{DQuat, Quat, Vec3};
use tumble::{TrackError, TrackSet, UNIT_TOLERANCE};

use crate::diagnostic::{Code, Diagnostic, Place};
use crate::format::ReadOptions;
use crate::keys::{Duplicates, Origin, QUIET_NORM, select};
use crate::motion::{Joint, Motion};
use crate::npy::ComponentOrder;
use crate::npz::archive::Archive;
use crate::npz::array::Array;
use crate::npz::plan::{Part, Plan, Values};
use crate::npz::rotation_vector;
use crate::quaternion::{dot, nearest_unit, rounded};
use crate::warnings::Warnings;

/// Tracks whose keys are held twice at a time, in the file's form and in ours.
const AT_ONCE: usize = 64;

/// Reads the clip. The plan then knows its rate.
pub(crate) fn read(
    archive: &Archive,
    plan: &mut Plan,
    options: &ReadOptions,
    warnings: &mut Warnings,
) -> Result<Motion, Diagnostic> {
    let mut times = plan.read_times(archive, options)?;
    plan.all_times.clone_from(&times);
    let arrays: Vec<Array<'_>> = plan
        .parts
        .iter()
        .map(|part| archive.array(part.member))
        .collect::<Result<_, _>>()?;
    let kept = kept_frames(archive, plan, &arrays, &times, options, warnings)?;
    select(&mut times, kept.as_deref());
    let mut motion = Motion {
        name: plan.name.clone(),
        rate: plan.rate,
        is_world: plan.is_world,
        ..Motion::default()
    };
    let set = &mut motion.set;
    let refuse = |error: TrackError| {
        Diagnostic::new(
            &archive.file,
            Code::TooLarge,
            format!("the clip cannot be kept: {error}"),
        )
    };
    for (part, array) in plan.parts.iter().zip(&arrays) {
        for start in part.tracks.clone().step_by(AT_ONCE) {
            let tracks = start..(start + AT_ONCE).min(part.tracks.end);
            if part.values.is_rotation() {
                let lists = rotations(archive, plan, part, array, tracks.clone(), warnings)?;
                for (track, mut keys) in tracks.zip(lists) {
                    select(&mut keys, kept.as_deref());
                    let name = plan.names.get(track).map_or("", String::as_str);
                    set.push(name, &times, &keys).map_err(refuse)?;
                }
                continue;
            }
            let lists = vectors(archive, plan, part, array, tracks.clone())?;
            for (track, mut keys) in tracks.zip(lists) {
                select(&mut keys, kept.as_deref());
                let set_keys = match part.values {
                    Values::Scale => TrackSet::set_scales,
                    _ => TrackSet::set_translations,
                };
                set_keys(set, track, &times, &keys, &[]).map_err(refuse)?;
            }
        }
    }
    if !plan.parents.is_empty() || !plan.rest.is_empty() {
        let joint = |track| Joint {
            parent: plan.parents.get(track).copied().flatten(),
            rest: plan.rest.get(track).copied().unwrap_or_default(),
        };
        motion.skeleton = (0..plan.tracks).map(joint).collect();
    }
    Ok(motion)
}

/// The frames that stay where times repeat: see [`Origin::increasing`].
fn kept_frames(
    archive: &Archive,
    plan: &Plan,
    arrays: &[Array<'_>],
    times: &[f64],
    options: &ReadOptions,
    warnings: &mut Warnings,
) -> Result<Option<Vec<usize>>, Diagnostic> {
    let name = match plan.times {
        Some(list) => &*archive.members[list.member].name,
        None => "",
    };
    let origin = Origin {
        file: &archive.file,
        place: &|frame| Place::Inside(format!("{name}[{frame}]")),
        duplicates: options.duplicates,
    };
    let equal = |a: usize, b: usize| {
        let mut parts = plan.parts.iter().zip(arrays);
        parts.all(|(part, array)| frame_of(part, array, a) == frame_of(part, array, b))
    };
    origin.increasing(times, equal, warnings)
}

/// The numbers of all tracks of a part at one frame.
fn frame_of(part: &Part, array: &Array<'_>, frame: usize) -> Vec<[f64; 4]> {
    let mut at = part.at;
    at.first += frame * at.frame;
    let tracks = 0..part.tracks.len();
    let first = |list: Vec<[f64; 4]>| list[0];
    match part.values {
        Values::Quaternion(_) => array.tracks(at, tracks, 1, |q: [f64; 4]| q, first),
        _ => array.tracks(at, tracks, 1, |[x, y, z]: [f64; 3]| [x, y, z, 0.0], first),
    }
}

/// The unit quaternions of some tracks of a part.
fn rotations(
    archive: &Archive,
    plan: &Plan,
    part: &Part,
    array: &Array<'_>,
    tracks: Range<usize>,
    warnings: &mut Warnings,
) -> Result<Vec<Vec<Quat>>, Diagnostic> {
    let own = tracks.start - part.tracks.start..tracks.end - part.tracks.start;
    let (at, frames) = (part.at, plan.frames);
    let done = |keys: Vec<Quat>| (keys.iter().all(|key| !key.w.is_nan())).then_some(keys);
    let lists = match part.values {
        Values::Quaternion(order) => {
            let make = |numbers: [f64; 4]| quiet_unit(quaternion(order, numbers));
            array.tracks(at, own.clone(), frames, make, done)
        }
        _ => {
            let make = |vector: [f64; 3]| rounded(rotation_vector::exp(vector));
            let done = |keys| done(continue_signs(keys));
            array.tracks(at, own.clone(), frames, make, done)
        }
    };
    let keys = lists.into_iter().zip(own).map(|(keys, own)| match keys {
        Some(keys) => Ok(keys),
        None => remarkable(archive, part, array, own, frames, warnings),
    });
    keys.collect()
}

fn quaternion(order: ComponentOrder, [a, b, c, d]: [f64; 4]) -> DQuat {
    match order {
        ComponentOrder::Xyzw => DQuat::from_xyzw(a, b, c, d),
        ComponentOrder::Wxyz => DQuat::from_xyzw(b, c, d, a),
    }
}

/// The nearest unit quaternion, or NaN where something is to be said about it.
fn quiet_unit(key: DQuat) -> Quat {
    let near = rounded(key);
    let exact = near.as_dquat();
    // |n² - 1| is about twice |n - 1|.
    if (dot(exact, exact) - 1.0).abs() <= 1.9 * UNIT_TOLERANCE {
        return near;
    }
    match (dot(key, key).sqrt() - 1.0).abs() <= QUIET_NORM {
        true => nearest_unit(key),
        false => Quat::NAN,
    }
}

/// The keys of a track that has some of which something is to be said.
fn remarkable(
    archive: &Archive,
    part: &Part,
    array: &Array<'_>,
    own: usize,
    frames: usize,
    warnings: &mut Warnings,
) -> Result<Vec<Quat>, Diagnostic> {
    let track = part.tracks.start + own;
    let origin = Origin {
        file: &archive.file,
        place: &|frame| Place::Inside(part.place(archive, track, frame)),
        duplicates: Duplicates::Refuse,
    };
    let one = own..own + 1;
    let Values::Quaternion(order) = part.values else {
        let vectors = array.tracks(part.at, one, frames, |vector: [f64; 3]| vector, |list| list);
        let is_bad = |vector: &[f64; 3]| !rotation_vector::exp(*vector).is_finite();
        let bad = vectors
            .iter()
            .flatten()
            .enumerate()
            .find(|(_, vector)| is_bad(vector));
        let (frame, vector) = bad.unwrap_or((0, &[f64::NAN; 3]));
        let message = format!("the rotation vector {vector:?} has no finite length; repair it");
        return Err(Diagnostic {
            place: Some((origin.place)(frame)),
            ..Diagnostic::new(&archive.file, Code::NotFinite, message)
        });
    };
    let make = |numbers: [f64; 4]| quaternion(order, numbers);
    let keys = array.tracks(part.at, one, frames, make, |list| list);
    origin.unit(keys.into_iter().flatten(), warnings)
}

/// Gives each rotation the sign that is nearer to the one before it: a vector that jumps to the other
/// side of π goes on on this side.
fn continue_signs(mut keys: Vec<Quat>) -> Vec<Quat> {
    for next in 1..keys.len() {
        if keys[next - 1].dot(keys[next]) < 0.0 {
            keys[next] = -keys[next];
        }
    }
    keys
}

/// The vectors of some tracks of a part.
fn vectors(
    archive: &Archive,
    plan: &Plan,
    part: &Part,
    array: &Array<'_>,
    tracks: Range<usize>,
) -> Result<Vec<Vec<Vec3>>, Diagnostic> {
    let own = tracks.start - part.tracks.start..tracks.end - part.tracks.start;
    let make = |numbers: [f64; 3]| Vec3::from_array(numbers.map(|number| number as f32));
    let lists = array.tracks(part.at, own, plan.frames, make, |list| {
        let bad = list.iter().position(|vector| !vector.is_finite());
        (list, bad)
    });
    let check = |(track, (list, bad)): (usize, (Vec<Vec3>, Option<usize>))| match bad {
        None => Ok(list),
        Some(frame) => {
            let message = format!("the vector {} is not finite in f32", list[frame]);
            let refusal = Diagnostic::new(&archive.file, Code::NotFinite, message);
            Err(refusal.inside(part.place(archive, track, frame)))
        }
    };
    tracks.zip(lists).map(check).collect()
}
