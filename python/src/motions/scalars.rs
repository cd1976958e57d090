//! The scalars of a library's clips, such as the angles of a robot's joints: tables of bodies without parents that do not
//! rotate. Up to three scalars are the coordinates of a body, so that they are sampled as positions are, and their rates as
//! velocities.

use std::borrow::Cow;

use glam::{Quat, Vec3};
use pyo3::prelude::*;
use tumble::crowd::{KeyPrecision, MotionClip};
use tumble::{ScalarKeys, Skeleton, TrackError, TrackSet, VectorMethod, method};
use tumble_formats::motion::{ChannelInterpolation, Motion, ScalarKind};
use tumble_formats::sample::MethodChoice;

use crate::arrays::ListArgument;
use crate::clip::Clip;
use crate::errors::{input, of_track};
use crate::motions::{ListedClip, Motions, built};
use crate::options::method_named;
use crate::run::stoppable;

/// The coordinates of a body.
const COORDINATES: usize = 3;

/// The tables of scalars (None if there are none), their names, the coordinate of all bodies that each is, and why a library
/// has none although clips have some.
type ScalarMotions = (Option<Motions>, Vec<String>, Vec<usize>, Option<String>);

/// The scalars that all clips of a library have: those that are contacts, which are steps, or the others, which are
/// interpolated by the library's method. The names and their order are those of the first clip.
#[pyfunction]
#[pyo3(signature = (clips, method, ticks_per_second, *, contacts))]
pub(crate) fn scalar_motions(
    py: Python<'_>,
    clips: ListArgument<Clip>,
    method: &str,
    ticks_per_second: u32,
    contacts: bool,
) -> PyResult<ScalarMotions> {
    let ListArgument(clips) = clips;
    let method = method_named(method)?;
    let first = clips.first().map(|clip| &*clip.motion);
    let names = first.map_or_else(Vec::new, |first| names_of(first, contacts));
    for listed in ListedClip::all(&clips) {
        let motion = &listed.clip.motion;
        let of_names = difference(&names, &names_of(motion, contacts));
        let of_kinds = || first.and_then(|first| other_kind(first, motion, &names));
        if let Some(reason) = of_names.or_else(of_kinds) {
            return Ok((
                None,
                Vec::new(),
                Vec::new(),
                Some(format!("{listed} {reason}")),
            ));
        }
    }
    if names.is_empty() {
        return Ok((None, names, Vec::new(), None));
    }
    let starts = bodies(&clips, &names);
    let columns = starts.windows(2).enumerate().flat_map(|(body, ends)| {
        let count = ends[1] - ends[0];
        (0..count).map(move |coordinate| body * COORDINATES + coordinate)
    });
    let columns = columns.collect();
    let parts = py.detach(|| {
        stoppable(|| {
            let count = starts.len() - 1;
            let skeleton = Skeleton::new(vec![None; count], vec![Vec3::ZERO; count]);
            let skeleton = skeleton.map_err(|error| input(error.to_string()))?;
            let clip = |listed: ListedClip<'_>| {
                let motion = &listed.clip.motion;
                let set = set_of(motion, &names, &starts).map_err(|error| of_track(&error))?;
                Ok(MotionClip {
                    set: Cow::Owned(set),
                    interpolation: method::SLERP.into(),
                    vectors: match contacts {
                        true => VectorMethod::Step,
                        false => vector_method(motion, &names, method),
                    },
                })
            };
            built(
                &skeleton,
                (ticks_per_second, KeyPrecision::Exact),
                &clips,
                clip,
            )
        })
    })?;
    let motions = Motions::of_parts(py, parts, names.clone())?;
    Ok((Some(motions), names, columns, None))
}

/// The names of a clip's contacts, or of its other scalars.
fn names_of(motion: &Motion, contacts: bool) -> Vec<String> {
    let is_asked = |&index: &usize| (motion.scalar(index).kind == ScalarKind::Contact) == contacts;
    let indices = (0..motion.set.scalar_count()).filter(is_asked);
    let scalars = indices.filter_map(|index| motion.set.scalar(index));
    scalars.map(|scalar| scalar.name.to_owned()).collect()
}

/// How the names of a clip's scalars differ from those of the first clip.
fn difference(first: &[String], names: &[String]) -> Option<String> {
    let repeated = (names.iter().enumerate()).find(|(index, name)| names[..*index].contains(name));
    if let Some((_, name)) = repeated {
        return Some(format!("has several scalars `{name}`"));
    }
    let missing = first.iter().find(|name| !names.contains(name));
    let missing = missing.map(|name| format!("has no scalar `{name}`, as the first clip has"));
    let extra = || names.iter().find(|name| !first.contains(name));
    missing.or_else(|| {
        extra().map(|name| format!("has a scalar `{name}`, and the first clip has none"))
    })
}

/// The first scalar that is another quantity in a clip than in the first clip.
fn other_kind(first: &Motion, motion: &Motion, names: &[String]) -> Option<String> {
    let kind = |motion: &Motion, name: &str| Some(motion.scalar(scalar_of(motion, name)?.0).kind);
    names.iter().find_map(|name| {
        let [kind, expected] = [kind(motion, name)?, kind(first, name)?];
        (kind != expected).then(|| {
            let [kind, expected] = [kind.name(), expected.name()];
            format!("has the scalar `{name}` of the kind `{kind}`, and the first clip of the kind `{expected}`")
        })
    })
}

fn scalar_of<'a>(motion: &'a Motion, name: &str) -> Option<(usize, ScalarKeys<'a>)> {
    let index = motion.set.scalar_named(name)?;
    Some((index, motion.set.scalar(index)?))
}

/// The first scalar of each body, and their number: the scalars of a body have the same key times in every clip.
fn bodies(clips: &[Clip], names: &[String]) -> Vec<usize> {
    let mut starts = vec![0];
    for index in 1..names.len() {
        let start = starts[starts.len() - 1];
        let joins = |clip: &Clip| {
            let keys = [start, index].map(|it| scalar_of(&clip.motion, &names[it]));
            let [Some((_, first)), Some((_, next))] = keys else {
                return false;
            };
            first.times == next.times && first.tangents.is_empty() == next.tangents.is_empty()
        };
        if index - start == COORDINATES || !clips.iter().all(joins) {
            starts.push(index);
        }
    }
    starts.push(names.len());
    starts
}

/// The method of scalars: that of the library, or, where it has none, that of the clip's first scalar.
fn vector_method(motion: &Motion, names: &[String], method: MethodChoice) -> VectorMethod {
    if let Some(method) = method.0 {
        return method.scalar_method();
    }
    let first = names.first().and_then(|name| scalar_of(motion, name));
    match first.and_then(|(index, _)| motion.scalar(index).interpolation) {
        Some(ChannelInterpolation::Step) => VectorMethod::Step,
        Some(ChannelInterpolation::Linear) => VectorMethod::Linear,
        Some(ChannelInterpolation::Cubic) => VectorMethod::GltfCubic,
        None => VectorMethod::BesselOverhauser,
    }
}

/// The scalars of a clip as translations of bodies.
fn set_of(motion: &Motion, names: &[String], starts: &[usize]) -> Result<TrackSet, TrackError> {
    let mut set = TrackSet::new();
    // The bodies have the start and the end of the clip.
    let (first, last) = motion.set.time_span().unwrap_or_default();
    let (ends, rest) = ([first, last], [Quat::IDENTITY; 2]);
    let count = if first < last { 2 } else { 1 };
    for (body, pair) in starts.windows(2).enumerate() {
        set.push("", &ends[..count], &rest[..count])?;
        let scalars = names[pair[0]..pair[1]].iter();
        let scalars = scalars.filter_map(|name| scalar_of(motion, name));
        let scalars: Vec<(f64, ScalarKeys<'_>)> = scalars
            .map(|(index, keys)| (motion.scalar(index).origin, keys))
            .collect();
        let Some((_, keys)) = scalars.first() else {
            continue;
        };
        let mut points = vec![Vec3::ZERO; keys.times.len()];
        let mut tangents = vec![[Vec3::ZERO; 2]; keys.tangents.len()];
        for (coordinate, (origin, keys)) in scalars.iter().enumerate() {
            for (point, &key) in points.iter_mut().zip(keys.keys) {
                point[coordinate] = (f64::from(key) + origin) as f32;
            }
            for (tangent, sides) in tangents.iter_mut().zip(keys.tangents) {
                (tangent[0][coordinate], tangent[1][coordinate]) = (sides[0], sides[1]);
            }
        }
        set.set_translations(body, keys.times, &points, &tangents)?;
    }
    Ok(set)
}
