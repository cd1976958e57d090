//! Clips from arrays.

use glam::{DVec3, Quat, Vec3};
use pyo3::prelude::*;
use tumble::{Tcb, TrackError, TrackSet};
use tumble_formats::motion::{Joint, Motion, Transform, circle};

use crate::arrays::{ArrayValues, Order, doubles, parts, quaternions};
use crate::errors::{input, of_track};

/// Key times: one list for all tracks, or one for each.
enum Times {
    Shared(Vec<f64>),
    Each(Vec<Vec<f64>>),
}

impl Times {
    fn new(value: &Bound<'_, PyAny>) -> PyResult<Self> {
        if let Some(parts) = parts(value) {
            let list = |part| match doubles(part, "times")? {
                ArrayValues { shape, values } if shape.len() == 1 => Ok(values),
                ArrayValues { shape, .. } => Err(input(format!(
                    "times: a part of the list has shape {shape:?}; give a list of times for each \
                     track"
                ))),
            };
            return parts
                .iter()
                .map(list)
                .collect::<PyResult<_>>()
                .map(Self::Each);
        }
        let ArrayValues { shape, values } = doubles(value, "times")?;
        match *shape {
            [_] => Ok(Self::Shared(values)),
            [tracks, count] => Ok(Self::Each(match count {
                0 => vec![Vec::new(); tracks],
                _ => values.chunks(count).map(<[f64]>::to_vec).collect(),
            })),
            _ => Err(input(format!(
                "times: the shape is {shape:?}; give (keys,), (tracks, keys), or a list with an \
                 array for each track"
            ))),
        }
    }
}

/// A clip of these keys, and whether they are one track's alone.
pub(crate) fn clip_of(
    times: &Bound<'_, PyAny>,
    keys: &Bound<'_, PyAny>,
    order: Order,
    names: Option<&[String]>,
) -> PyResult<(Motion, bool)> {
    let times = Times::new(times)?;
    let (tracks, is_one) = tracks_of(keys, order)?;
    let count = tracks.len();
    if let Some(names) = names
        && names.len() != count
    {
        return Err(input(format!(
            "names: there are {} for {count} tracks",
            names.len()
        )));
    }
    if let Times::Each(each) = &times
        && each.len() != count
    {
        return Err(input(format!(
            "times: there are lists for {} tracks, and keys for {count}",
            each.len()
        )));
    }
    let set = match (times, names) {
        (Times::Shared(times), None) if tracks.are_alike(times.len()) => {
            TrackSet::from_shared_times(times, tracks.keys).map_err(|error| of_track(&error))?
        }
        (times, names) => {
            let mut set = TrackSet::new();
            for track in 0..count {
                let times = match &times {
                    Times::Shared(times) => times,
                    Times::Each(each) => &each[track],
                };
                let name = names.map_or("", |names| &names[track]);
                set.push(name, times, tracks.of(track))
                    .map_err(|error| of_track(&error))?;
            }
            set
        }
    };
    let motion = Motion {
        set,
        ..Motion::default()
    };
    Ok((motion, is_one))
}

/// Keys of all tracks, one behind the other.
struct Tracks {
    keys: Vec<Quat>,
    /// Where each track ends.
    ends: Vec<usize>,
}

impl Tracks {
    fn len(&self) -> usize {
        self.ends.len()
    }

    fn of(&self, track: usize) -> &[Quat] {
        let start = track.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.keys[start..self.ends[track]]
    }

    /// Whether there are tracks, and all have so many keys.
    fn are_alike(&self, keys: usize) -> bool {
        keys > 0 && (0..self.len()).all(|track| self.of(track).len() == keys)
    }
}

/// The keys of tracks, and whether they are one track's alone.
fn tracks_of(value: &Bound<'_, PyAny>, order: Order) -> PyResult<(Tracks, bool)> {
    if let Some(parts) = parts(value)
        && let first = quaternions(&parts[0], order, "keys[0]")
        && first.as_ref().map_or(true, |first| first.shape.len() == 1)
    {
        first?;
        let mut tracks = Tracks {
            keys: Vec::new(),
            ends: Vec::new(),
        };
        for (track, part) in parts.iter().enumerate() {
            let label = format!("keys[{track}]");
            let ArrayValues { shape, values } = quaternions(part, order, &label)?;
            if shape.len() != 1 {
                return Err(input(format!(
                    "{label}: a track of a list has keys of shape (keys, 4)"
                )));
            }
            tracks.keys.extend(values);
            tracks.ends.push(tracks.keys.len());
        }
        return Ok((tracks, false));
    }
    let ArrayValues { shape, values } = quaternions(value, order, "keys")?;
    match *shape {
        [count] => Ok((
            Tracks {
                keys: values,
                ends: vec![count],
            },
            true,
        )),
        [tracks, count] => Ok((
            Tracks {
                keys: values,
                ends: (1..=tracks).map(|track| track * count).collect(),
            },
            false,
        )),
        _ => Err(input(format!(
            "keys: the shape is {:?}; give (keys, 4), (tracks, keys, 4), or a list with an array \
             (keys, 4) for each track",
            [&*shape, &[4]].concat()
        ))),
    }
}

/// What clips may have beside rotations.
pub(crate) struct ClipParts<'a, 'py> {
    pub(crate) parents: Option<Vec<Option<i64>>>,
    pub(crate) offsets: Option<&'a Bound<'py, PyAny>>,
    pub(crate) translations: Option<&'a Bound<'py, PyAny>>,
    pub(crate) scales: Option<&'a Bound<'py, PyAny>>,
    pub(crate) velocities: Option<&'a Bound<'py, PyAny>>,
    pub(crate) tangents: Option<&'a Bound<'py, PyAny>>,
    pub(crate) tcb: Option<&'a Bound<'py, PyAny>>,
}

/// Why positions of joints are unknown.
pub(crate) const NO_OFFSETS: &str = "the joints have parents, but no offsets; give `offsets`";

impl ClipParts<'_, '_> {
    /// Sets them in a clip; the tangents have their components in `order`.
    pub(crate) fn put_into(self, clip: &mut Motion, order: Order) -> PyResult<()> {
        self.hang(clip)?;
        let tracks = clip.set.track_count();
        let of_track = |error: TrackError| of_track(&error);
        for (label, value) in [("translations", self.translations), ("scales", self.scales)] {
            for (track, row) in rows(value, label, tracks, &[3])? {
                let times = clip.set.track(track).times.to_vec();
                let vectors: Vec<DVec3> = threes(&row).collect();
                if label == "translations" {
                    clip.set_positions(track, &times, &vectors)
                        .map_err(of_track)?;
                    continue;
                }
                let scales: Vec<Vec3> = vectors.iter().map(|scale| scale.as_vec3()).collect();
                let scaled = clip.set.set_scales(track, &times, &scales, &[]);
                scaled.map_err(of_track)?;
            }
        }
        if self.offsets.is_none() && clip.has_unplaced_joints() {
            clip.no_world = Some(NO_OFFSETS.to_owned());
        }
        let set = &mut clip.set;
        for (track, row) in rows(self.velocities, "velocities", tracks, &[3])? {
            let velocities: Vec<DVec3> = threes(&row).collect();
            set.set_velocities(track, &velocities).map_err(of_track)?;
        }
        for (track, row) in rows(self.tcb, "tcb", tracks, &[3])? {
            let tcb = |of: DVec3| Tcb {
                tension: of.x,
                continuity: of.y,
                bias: of.z,
            };
            let all: Vec<Tcb> = threes(&row).map(tcb).collect();
            set.set_tcb(track, &all).map_err(of_track)?;
        }
        for (track, row) in rows(self.tangents, "tangents", tracks, &[2, 4])? {
            let one = |of: &[f64; 4]| Quat::from_array(order.xyzw(of.map(|it| it as f32)));
            let pairs = row.as_chunks().0.as_chunks::<2>().0;
            let tangents: Vec<[Quat; 2]> = pairs.iter().map(|[a, b]| [one(a), one(b)]).collect();
            set.set_tangents(track, &tangents).map_err(of_track)?;
        }
        Ok(())
    }

    /// The skeleton.
    fn hang(&self, clip: &mut Motion) -> PyResult<()> {
        if self.parents.is_none() && self.offsets.is_none() {
            return Ok(());
        }
        let tracks = clip.set.track_count();
        let wrong = |label: &str, count: usize| {
            input(format!("{label}: there are {count} for {tracks} tracks"))
        };
        let parents = match &self.parents {
            None => vec![None; tracks],
            Some(parents) if parents.len() == tracks => parents
                .iter()
                .enumerate()
                .map(|(track, &parent)| match parent {
                    None | Some(-1) => Ok(None),
                    Some(parent) => usize::try_from(parent)
                        .ok()
                        .filter(|&parent| parent < tracks && parent != track)
                        .map(Some)
                        .ok_or_else(|| {
                            input(format!(
                                "parents: track {track} cannot have the parent {parent}"
                            ))
                        }),
                })
                .collect::<PyResult<_>>()?,
            Some(parents) => return Err(wrong("parents", parents.len())),
        };
        if let Some(track) = circle(&parents) {
            let name = clip.set.track_name(track);
            return Err(input(format!(
                "parents: track {track} (`{name}`) is its own ancestor; the parent of a root is None or -1"
            )));
        }
        let offsets = match self.offsets {
            None => vec![Vec3::ZERO; tracks],
            Some(value) => match doubles(value, "offsets")? {
                ArrayValues { shape, values } if *shape == [tracks, 3] => {
                    threes(&values).map(DVec3::as_vec3).collect()
                }
                ArrayValues { shape, .. } => {
                    return Err(input(format!(
                        "offsets: the shape is {shape:?}; give ({tracks}, 3)"
                    )));
                }
            },
        };
        if let Some(track) = offsets.iter().position(|offset| !offset.is_finite()) {
            return Err(input(format!(
                "offsets: that of track {track} is not finite"
            )));
        }
        let joint = |(parent, translation): (Option<usize>, Vec3)| Joint {
            parent,
            rest: Transform {
                translation,
                ..Transform::default()
            },
        };
        clip.skeleton = parents.into_iter().zip(offsets).map(joint).collect();
        Ok(())
    }
}

fn threes(numbers: &[f64]) -> impl Iterator<Item = DVec3> {
    numbers
        .as_chunks()
        .0
        .iter()
        .map(|&of| DVec3::from_array(of))
}

/// The numbers of each track, of arrays (keys, …) or (tracks, keys, …), or lists with an array, or
/// None, for each track.
fn rows(
    value: Option<&Bound<'_, PyAny>>,
    label: &str,
    tracks: usize,
    each: &[usize],
) -> PyResult<Vec<(usize, Vec<f64>)>> {
    let Some(value) = value else {
        return Ok(Vec::new());
    };
    let wrong = |shape: &[usize]| {
        input(format!(
            "{label}: the shape is {shape:?}; give (tracks, keys, …) with {each:?} numbers for each \
             key of {tracks} tracks, or a list with an array or None for each track"
        ))
    };
    if let Some(parts) = parts(value)
        && parts
            .iter()
            .any(|part| part.is_none() || part.hasattr("shape").unwrap_or(false))
    {
        if parts.len() != tracks {
            return Err(wrong(&[parts.len()]));
        }
        let mut rows = Vec::new();
        for (track, part) in parts.iter().enumerate().filter(|(_, part)| !part.is_none()) {
            let ArrayValues { shape, values } = doubles(part, label)?;
            if shape.get(1..) != Some(each) {
                return Err(wrong(&shape));
            }
            rows.push((track, values));
        }
        return Ok(rows);
    }
    let ArrayValues { shape, values } = doubles(value, label)?;
    let size: usize = match &*shape {
        [_, rest @ ..] if rest == each && tracks == 1 => values.len(),
        [count, keys, rest @ ..] if rest == each && *count == tracks => {
            keys * each.iter().product::<usize>()
        }
        _ => return Err(wrong(&shape)),
    };
    Ok(values
        .chunks(size.max(1))
        .map(<[f64]>::to_vec)
        .enumerate()
        .collect())
}
