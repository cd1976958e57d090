//! The scalars of a library's clips, such as the angles of a robot's joints: tables of tracks without parents that do not
//! rotate, of which up to three scalars are the positions.

use std::borrow::Cow;

use glam::Vec3;
use pyo3::prelude::*;
use tumble::crowd::{KeyPrecision, MotionClip};
use tumble::{Skeleton, TrackSet, VectorMethod, method};
use tumble_formats::motion::scalar_tracks::{ScalarTracks, scalar_of};
use tumble_formats::motion::{ChannelInterpolation, Motion, ScalarKind};
use tumble_formats::sample::MethodChoice;

use crate::arrays::ListArgument;
use crate::clip::Clip;
use crate::errors::{input, of_track};
use crate::motions::{ListedClip, Motions, Tables, built};
use crate::options::method_named;
use crate::run::stoppable;

/// The coordinates of a track.
const COORDINATES: usize = 3;

/// The tables of scalars (None if there are none), their names, the coordinate of all tracks that each is, and why a library
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
    let tracks = ScalarTracks::new(names.clone(), clips.iter().map(|clip| &*clip.motion));
    let columns = tracks.coordinates();
    let columns = columns.map(|[track, coordinate]| track * COORDINATES + coordinate);
    let columns = columns.collect();
    let parts = py.detach(|| {
        stoppable(|| {
            let count = tracks.track_count();
            let skeleton = Skeleton::new(vec![None; count], vec![Vec3::ZERO; count]);
            let skeleton = skeleton.map_err(|error| input(error.to_string()))?;
            let clip = |_: usize, listed: ListedClip<'_>| {
                let motion = &listed.clip.motion;
                let mut set = TrackSet::new();
                // The rest value 0 is never used, because every clip has all scalars.
                let added = tracks.add_to(&mut set, motion, |_| 0.0);
                added.map_err(|error| of_track(&error))?;
                Ok(MotionClip {
                    set: Cow::Owned(set),
                    interpolation: method::SLERP.into(),
                    vectors: match contacts {
                        true => VectorMethod::Step,
                        false => vector_method(motion, &names, method),
                    },
                })
            };
            let options = (ticks_per_second, KeyPrecision::Exact);
            let listed: Vec<_> = ListedClip::all(&clips).collect();
            built(&skeleton, options, &listed, clip)
        })
    })?;
    let (tables, spans, cells) = parts;
    let parts = (Tables::Skeleton(tables), spans, cells);
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

/// The method of scalars: that of the library, or, where it has none, that of the clip's first scalar.
pub(super) fn vector_method(
    motion: &Motion,
    names: &[String],
    method: MethodChoice,
) -> VectorMethod {
    if let Some(method) = method.0 {
        return method.scalar_method();
    }
    let first = names.iter().find_map(|name| motion.set.scalar_named(name));
    match first.and_then(|index| motion.scalar(index).interpolation) {
        Some(ChannelInterpolation::Step) => VectorMethod::Step,
        Some(ChannelInterpolation::Linear) => VectorMethod::Linear,
        Some(ChannelInterpolation::Cubic) => VectorMethod::GltfCubic,
        None => VectorMethod::BesselOverhauser,
    }
}
