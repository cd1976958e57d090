//! Clips as plain arrays, for pickles and copies, and whether two clips are the same.

use std::path::PathBuf;
use std::sync::Arc;

use glam::{DVec3, Quat, Vec3};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use tumble::{Channel, Tcb, Track, TrackError, TrackSet};
use tumble_formats::motion::{
    Body, ChannelInterpolation, Channels, Joint, Motion, Scalar, Shape, Transform,
};
use tumble_formats::motion::{WrittenChannel, WrittenJoint};

use crate::clip::{Clip, Source};
use crate::errors::{guarded, input, of_track};
use crate::values::{chunks, list, rows};

/// The kinds of vector keys; a pickle contains their indices.
const VECTORS: [Channel; 2] = [Channel::Translation, Channel::Scale];

/// The interpolations of channels; a pickle contains their index plus 1, or 0 for none.
const SAMPLERS: [ChannelInterpolation; 3] = [
    ChannelInterpolation::Step,
    ChannelInterpolation::Linear,
    ChannelInterpolation::Cubic,
];

/// All data of a clip, without the other contents of its file.
pub(crate) fn state<'py>(py: Python<'py>, clip: &Clip) -> PyResult<Bound<'py, PyDict>> {
    let motion = &*clip.motion;
    let tracks: Vec<Track<'_>> = motion.set.tracks().collect();
    let state = PyDict::new(py);
    let names: Vec<Option<&str>> = tracks.iter().map(|track| track.name).collect();
    state.set_item("names", names)?;
    // Times that several tracks share are stored once.
    let (times, mut times_of) = (PyList::empty(py), Vec::<i64>::new());
    let mut last: Option<&[f64]> = None;
    for track in &tracks {
        if !last.is_some_and(|last| std::ptr::eq(last, track.times)) {
            times.append(PyArray1::from_slice(py, track.times))?;
            last = Some(track.times);
        }
        times_of.push(times.len() as i64 - 1);
    }
    state.set_item("times", times)?;
    state.set_item("times_of", PyArray1::from_vec(py, times_of))?;
    let mut keys = Vec::with_capacity(4 * motion.set.key_count());
    for track in &tracks {
        py.check_signals()?;
        keys.extend(track.keys.iter().flat_map(Quat::to_array));
    }
    state.set_item("keys", rows(py, keys, 4)?)?;
    let numbers = PyList::empty(py);
    for (track_index, track) in tracks.iter().enumerate() {
        let velocities: Vec<f64> = (track.velocities.iter())
            .flat_map(DVec3::to_array)
            .collect();
        let tangents: Vec<f32> = (track.tangents.iter().flatten())
            .flat_map(Quat::to_array)
            .collect();
        let tcb = |of: &Tcb| [of.tension, of.continuity, of.bias];
        let tcb: Vec<f64> = track.tcb.iter().flat_map(tcb).collect();
        if !(velocities.is_empty() && tangents.is_empty() && tcb.is_empty()) {
            let tangents = rows(py, tangents, 4)?;
            numbers.append((
                track_index,
                rows(py, velocities, 3)?,
                tangents,
                rows(py, tcb, 3)?,
            ))?;
        }
    }
    state.set_item("numbers", numbers)?;
    let vectors = PyList::empty(py);
    for (kind, channel) in VECTORS.into_iter().enumerate() {
        for track in 0..tracks.len() {
            let Some(vector_keys) = motion.set.vector_keys(channel, track) else {
                continue;
            };
            let keys: Vec<f32> = vector_keys.keys.iter().flat_map(Vec3::to_array).collect();
            let tangents: Vec<f32> = (vector_keys.tangents.iter().flatten())
                .flat_map(Vec3::to_array)
                .collect();
            let times = PyArray1::from_slice(py, vector_keys.times);
            vectors.append((
                kind,
                track,
                times,
                rows(py, keys, 3)?,
                rows(py, tangents, 3)?,
            ))?;
        }
    }
    state.set_item("vectors", vectors)?;
    let parent = |joint: &Joint| joint.parent.map_or(-1, |parent| parent as i64);
    let parents: Vec<i64> = motion.skeleton.iter().map(parent).collect();
    state.set_item("parents", PyArray1::from_vec(py, parents))?;
    let rest = |joint: &Joint| {
        let Transform {
            translation,
            rotation,
            scale,
        } = joint.rest;
        let parts = [
            &translation.to_array()[..],
            &rotation.to_array(),
            &scale.to_array(),
        ];
        parts.concat()
    };
    let rests: Vec<f32> = motion.skeleton.iter().flat_map(rest).collect();
    state.set_item("rests", rows(py, rests, 10)?)?;
    let number = |sampler: Option<ChannelInterpolation>| {
        let index = SAMPLERS.iter().position(|&one| Some(one) == sampler);
        index.map_or(0, |index| index as i64 + 1)
    };
    let channels = motion.channels.iter();
    let channels: Vec<i64> = channels
        .flat_map(|channel| [channel.rotation, channel.translation, channel.scale].map(number))
        .collect();
    state.set_item("channels", rows(py, channels, 3)?)?;
    let scalars = PyList::empty(py);
    for index in 0..motion.set.scalar_count() {
        let Some(keys) = motion.set.scalar(index) else {
            continue;
        };
        let scalar = motion.scalar(index);
        scalars.append((
            keys.name,
            PyArray1::from_slice(py, keys.times),
            PyArray1::from_slice(py, keys.keys),
            rows(py, keys.tangents.as_flattened().to_vec(), 2)?,
            scalar.kind.name(),
            scalar.origin,
            scalar.limits,
            number(scalar.interpolation),
        ))?;
    }
    state.set_item("scalars", scalars)?;
    let origins: Vec<f64> = motion.origins.iter().flat_map(DVec3::to_array).collect();
    state.set_item("origins", rows(py, origins, 3)?)?;
    let bvh = PyList::empty(py);
    for joint in &motion.written_joints {
        let number = |channel: &WrittenChannel| match *channel {
            WrittenChannel::Position(axis) => axis,
            WrittenChannel::Rotation(axis) => 3 + axis,
        };
        let channels: Vec<usize> = joint.channels.iter().map(number).collect();
        let sites: Vec<f32> = joint.end_sites.iter().flat_map(Vec3::to_array).collect();
        bvh.append((channels, rows(py, sites, 3)?))?;
    }
    state.set_item("bvh", bvh)?;
    state.set_item("name", &motion.name)?;
    state.set_item("place", motion.index)?;
    state.set_item("rate", motion.rate.map(|rate| rate.to_string()))?;
    state.set_item("is_world", motion.is_world)?;
    state.set_item("time_offset", motion.time_offset)?;
    state.set_item("no_world", &motion.no_world)?;
    let body = motion.body.as_ref();
    state.set_item("pelvis", body.map(|body| body.pelvis.to_array()))?;
    state.set_item("betas", body.map(|body| body.shape.betas.clone()))?;
    state.set_item("gender", body.map(|body| body.shape.gender.clone()))?;
    let up = body.and_then(|body| body.up);
    state.set_item("up", up.map(|up| up.to_array()))?;
    if let Some(source) = &clip.source {
        state.set_item("path", &source.path)?;
        state.set_item("clips", source.clips)?;
        state.set_item("box_length", source.box_length)?;
    }
    Ok(state)
}

/// An entry that earlier versions did not write, because clips had no such property.
fn later_entry<'py>(state: &Bound<'py, PyDict>, name: &str) -> PyResult<Option<Bound<'py, PyAny>>> {
    Ok(state.get_item(name)?.filter(|value| !value.is_none()))
}

/// An entry that every version wrote; the error if it is missing.
fn entry<'py>(state: &Bound<'py, PyDict>, name: &str) -> PyResult<Bound<'py, PyAny>> {
    state.get_item(name)?.ok_or_else(|| {
        input(format!(
            "the pickle of a clip has no `{name}`: it was written by another version of tumble"
        ))
    })
}

/// Restores a clip from its state.
#[pyfunction]
pub(crate) fn clip_of_state(state: &Bound<'_, PyDict>) -> PyResult<Clip> {
    guarded(|| {
        let motion = motion_of(state)?;
        let source = match state.get_item("path")? {
            None => None,
            Some(path) => Some(Arc::new(Source {
                path: path.extract::<PathBuf>()?,
                document: None,
                clips: entry(state, "clips")?.extract()?,
                box_length: entry(state, "box_length")?.extract()?,
                warnings: Vec::new(),
                adjustment: None,
                is_changed: false,
            })),
        };
        Ok(Clip {
            motion: Arc::new(motion),
            source,
        })
    })
}

fn motion_of(state: &Bound<'_, PyDict>) -> PyResult<Motion> {
    let of_set = |error: TrackError| of_track(&error);
    let broken = || input("the pickle of a clip is broken");
    let names: Vec<Option<String>> = entry(state, "names")?.extract()?;
    let times: Vec<Bound<'_, PyAny>> = entry(state, "times")?.extract()?;
    let times: Vec<Vec<f64>> = times.iter().map(list).collect::<PyResult<_>>()?;
    let times_of: Vec<i64> = list(&entry(state, "times_of")?)?;
    let keys: Vec<[f32; 4]> = chunks(&entry(state, "keys")?)?;
    let keys: Vec<Quat> = keys.into_iter().map(Quat::from_array).collect();
    let mut set = TrackSet::new();
    set.reserve(names.len(), keys.len());
    let mut left = &keys[..];
    for (track, name) in names.iter().enumerate() {
        state.py().check_signals()?;
        let times = times_of
            .get(track)
            .and_then(|&index| times.get(usize::try_from(index).ok()?));
        let times = times.ok_or_else(broken)?;
        let (track_keys, others) = left.split_at_checked(times.len()).ok_or_else(broken)?;
        left = others;
        set.push(name.as_deref().unwrap_or_default(), times, track_keys)
            .map_err(of_set)?;
    }
    type KeyParameters<'py> = (
        usize,
        Bound<'py, PyAny>,
        Bound<'py, PyAny>,
        Bound<'py, PyAny>,
    );
    let numbers: Vec<KeyParameters<'_>> = entry(state, "numbers")?.extract()?;
    for (track, velocities, tangents, tcb) in numbers {
        if track >= names.len() {
            return Err(broken());
        }
        let velocities: Vec<[f64; 3]> = chunks(&velocities)?;
        if !velocities.is_empty() {
            let velocities: Vec<DVec3> = velocities.into_iter().map(DVec3::from_array).collect();
            set.set_velocities(track, &velocities).map_err(of_set)?;
        }
        let tangents: Vec<[f32; 4]> = chunks(&tangents)?;
        if !tangents.is_empty() {
            let pairs = tangents.as_chunks::<2>().0.iter();
            let pairs: Vec<[Quat; 2]> = pairs.map(|pair| pair.map(Quat::from_array)).collect();
            set.set_tangents(track, &pairs).map_err(of_set)?;
        }
        let tcb: Vec<[f64; 3]> = chunks(&tcb)?;
        if !tcb.is_empty() {
            let one = |[tension, continuity, bias]: [f64; 3]| Tcb {
                tension,
                continuity,
                bias,
            };
            let tcb: Vec<Tcb> = tcb.into_iter().map(one).collect();
            set.set_tcb(track, &tcb).map_err(of_set)?;
        }
    }
    type Vectors<'py> = (
        usize,
        usize,
        Bound<'py, PyAny>,
        Bound<'py, PyAny>,
        Bound<'py, PyAny>,
    );
    let vectors: Vec<Vectors<'_>> = entry(state, "vectors")?.extract()?;
    for (kind, track, times, keys, tangents) in vectors {
        if track >= names.len() {
            return Err(broken());
        }
        let (times, keys) = (list(&times)?, chunks::<f32, 3>(&keys)?);
        let tangents: Vec<[f32; 3]> = chunks(&tangents)?;
        let pairs = tangents.as_chunks::<2>().0.iter();
        let tangents: Vec<[Vec3; 2]> = pairs.map(|pair| pair.map(Vec3::from_array)).collect();
        let added = match VECTORS.get(kind).ok_or_else(broken)? {
            Channel::Translation => set.set_translations(track, &times, &keys, &tangents),
            Channel::Scale => set.set_scales(track, &times, &keys, &tangents),
        };
        added.map_err(of_set)?;
    }
    let parents: Vec<i64> = list(&entry(state, "parents")?)?;
    let rests: Vec<[f32; 10]> = chunks(&entry(state, "rests")?)?;
    let joint = |(parent, rest): (i64, [f32; 10])| Joint {
        parent: usize::try_from(parent).ok(),
        rest: Transform {
            translation: Vec3::from_slice(&rest[..3]),
            rotation: Quat::from_slice(&rest[3..7]),
            scale: Vec3::from_slice(&rest[7..]),
        },
    };
    let sampler = |number: i64| {
        let index = usize::try_from(number).ok()?.checked_sub(1)?;
        SAMPLERS.get(index).copied()
    };
    let channels: Vec<[i64; 3]> = chunks(&entry(state, "channels")?)?;
    let channels = channels.into_iter().map(|numbers| {
        let [rotation, translation, scale] = numbers.map(sampler);
        Channels {
            rotation,
            translation,
            scale,
        }
    });
    type Scalars<'py> = (
        String,
        Bound<'py, PyAny>,
        Bound<'py, PyAny>,
        Bound<'py, PyAny>,
        String,
        f64,
        Option<[f64; 2]>,
        i64,
    );
    let mut scalars = Vec::new();
    let all = later_entry(state, "scalars")?.map(|all| all.extract());
    let all: Option<Vec<Scalars<'_>>> = all.transpose()?;
    for (name, times, keys, tangents, kind, origin, limits, interpolation) in
        all.unwrap_or_default()
    {
        let (times, keys): (Vec<f64>, Vec<f32>) = (list(&times)?, list(&keys)?);
        let tangents: Vec<[f32; 2]> = chunks(&tangents)?;
        set.push_scalar(name, &times, &keys, &tangents)
            .map_err(of_set)?;
        scalars.push(Scalar {
            kind: kind.parse().map_err(|_| broken())?,
            origin,
            limits,
            interpolation: sampler(interpolation),
        });
    }
    let origins: Vec<[f64; 3]> = chunks(&entry(state, "origins")?)?;
    let bvh: Vec<(Vec<usize>, Bound<'_, PyAny>)> = entry(state, "bvh")?.extract()?;
    let bvh = bvh.into_iter().map(|(channels, sites)| {
        let channel = |number: usize| match number {
            0..3 => WrittenChannel::Position(number),
            _ => WrittenChannel::Rotation((number - 3).min(2)),
        };
        let sites: Vec<[f32; 3]> = chunks(&sites)?;
        Ok(WrittenJoint {
            channels: channels.into_iter().map(channel).collect(),
            end_sites: sites.into_iter().map(Vec3::from_array).collect(),
        })
    });
    let rate: Option<String> = entry(state, "rate")?.extract()?;
    let rate = rate.map(|rate| rate.parse()).transpose();
    let pelvis: Option<[f32; 3]> = entry(state, "pelvis")?.extract()?;
    let betas = later_entry(state, "betas")?.map(|betas| betas.extract());
    let betas: Option<Vec<f64>> = betas.transpose()?;
    let gender = later_entry(state, "gender")?.map(|gender| gender.extract());
    let gender: Option<String> = gender.transpose()?;
    let up = later_entry(state, "up")?.map(|up| up.extract());
    let up: Option<[f64; 3]> = up.transpose()?;
    let shape = Shape {
        betas: betas.unwrap_or_default(),
        gender: gender.unwrap_or_default(),
    };
    Ok(Motion {
        name: entry(state, "name")?.extract()?,
        index: entry(state, "place")?.extract()?,
        set,
        scalars,
        skeleton: parents.into_iter().zip(rests).map(joint).collect(),
        channels: channels.collect(),
        rate: rate.map_err(|error: tumble::SampleTimesError| input(error.to_string()))?,
        is_world: entry(state, "is_world")?.extract()?,
        time_offset: entry(state, "time_offset")?.extract()?,
        origins: origins.into_iter().map(DVec3::from_array).collect(),
        no_world: entry(state, "no_world")?.extract()?,
        written_joints: bvh.collect::<PyResult<_>>()?,
        body: pelvis.map(|pelvis| Body {
            pelvis: Vec3::from_array(pelvis),
            shape,
            up: up.map(DVec3::from_array),
        }),
        // Not pickled: it is only used while a file is read, to check the orders.
        robot: None,
    })
}

/// Whether two clips are equal in all their data: tracks, keys, names and all other properties. Their files may differ.
pub(crate) fn is_same(a: &Motion, b: &Motion) -> bool {
    let tracks = a.set.track_count();
    let is_same_track = |track: usize| {
        let (first, second) = (a.set.track(track), b.set.track(track));
        let tcb = |of: &Tcb| [of.tension, of.continuity, of.bias];
        let vectors = |channel: Channel| {
            let [first, second] = [a, b].map(|of| of.set.vector_keys(channel, track));
            let parts = |of: Option<tumble::VectorKeys<'_>>| {
                of.map(|of| (of.times.to_vec(), of.keys.to_vec(), of.tangents.to_vec()))
            };
            parts(first) == parts(second)
        };
        first.name == second.name
            && first.times == second.times
            && first.keys == second.keys
            && first.velocities == second.velocities
            && first.tangents == second.tangents
            && first.tcb.iter().map(tcb).eq(second.tcb.iter().map(tcb))
            && VECTORS.into_iter().all(vectors)
    };
    tracks == b.set.track_count()
        && a.set.key_count() == b.set.key_count()
        && a.name == b.name
        && a.skeleton == b.skeleton
        && a.channels == b.channels
        && a.rate == b.rate
        && a.is_world == b.is_world
        && a.time_offset == b.time_offset
        && a.origins == b.origins
        && a.no_world == b.no_world
        && a.written_joints == b.written_joints
        && a.body == b.body
        && (0..tracks).all(is_same_track)
        && a.set.scalar_count() == b.set.scalar_count()
        && (0..a.set.scalar_count()).all(|index| {
            a.set.scalar(index) == b.set.scalar(index) && a.scalar(index) == b.scalar(index)
        })
}
