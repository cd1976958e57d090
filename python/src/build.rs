//! Clips from arrays.

use glam::{DVec3, Quat, Vec3};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tumble::{Layout, Tcb, TrackError, TrackSet};
use tumble_formats::motion::{Joint, Motion, Transform, circle, clock_second};

use crate::arrays::{ArrayValues, Order, doubles, has_arrays, parts, quaternions};
use crate::errors::{input, of_track, of_track_since, warn_of};
use crate::output::shown;
use crate::samples::{joint_offsets, joint_parents};

/// Key times: one list for all tracks, or one for each.
enum Times {
    Shared(Vec<f64>),
    Each(Vec<Vec<f64>>),
}

impl Times {
    fn new(value: &Bound<'_, PyAny>) -> PyResult<Self> {
        if let Some(parts) = parts(value)? {
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

/// How a call states which axis of its keys is the axis of tracks.
#[derive(Debug, Clone, Copy)]
pub(crate) enum KeysLayout {
    /// By its argument `layout`, which may have been left out. Names of tracks speak for the order of the
    /// documentation, which is then assumed with a warning.
    Argument {
        layout: Option<Layout>,
        has_names: bool,
    },
    /// It cannot, because its `layout` is that of the result. Messages then advise to make a `Clip` first.
    OfClip,
}

impl KeysLayout {
    fn said(self) -> Option<Layout> {
        match self {
            Self::Argument { layout, .. } => layout,
            Self::OfClip => None,
        }
    }

    /// The argument that chooses a layout, for messages.
    fn spelling(self, layout: Layout) -> String {
        let layout = format!("layout=\"{}\"", layout.name());
        match self {
            Self::Argument { .. } => layout,
            Self::OfClip => format!("Clip(times, keys, {layout}).evaluate(…)"),
        }
    }
}

/// The keys of a clip as passed to the constructor.
pub(crate) struct ClipKeys {
    times: Times,
    tracks: Tracks,
    /// Whether the keys are of a single track, without an axis of tracks.
    pub(crate) is_one: bool,
}

impl ClipKeys {
    /// Reads times and keys.
    pub(crate) fn new(
        times: &Bound<'_, PyAny>,
        keys: &Bound<'_, PyAny>,
        order: Order,
        layout: KeysLayout,
    ) -> PyResult<Self> {
        let times = Times::new(times)?;
        let (tracks, is_one) = tracks_of(keys, order, &times, layout)?;
        let count = tracks.len();
        if let Times::Each(each) = &times
            && each.len() != count
        {
            return Err(input(format!(
                "times: there are lists for {} tracks, and keys for {count}",
                each.len()
            )));
        }
        Ok(Self {
            times,
            tracks,
            is_one,
        })
    }

    pub(crate) fn track_count(&self) -> usize {
        self.tracks.len()
    }

    pub(crate) fn key_count(&self) -> usize {
        self.tracks.keys.len()
    }

    /// The clip. Times of a clock that counts from 1970 count from a whole second, as those of files do.
    pub(crate) fn clip(self, names: Option<&[String]>) -> PyResult<Motion> {
        let Self {
            mut times, tracks, ..
        } = self;
        let time_offset = match &times {
            Times::Shared(times) => clock_second(times),
            Times::Each(each) => clock_second(each.iter().flatten()),
        };
        if time_offset != 0 {
            let since = |times: &mut Vec<f64>| {
                times
                    .iter_mut()
                    .for_each(|time| *time -= time_offset as f64);
            };
            match &mut times {
                Times::Shared(times) => since(times),
                Times::Each(each) => each.iter_mut().for_each(since),
            }
        }
        let refused = |error: TrackError| of_track_since(time_offset, &error);
        let set = match (times, names) {
            (Times::Shared(times), None) if tracks.are_alike(times.len()) => {
                TrackSet::from_shared_times(times, tracks.keys).map_err(refused)?
            }
            (times, names) => {
                let mut set = TrackSet::new();
                for track in 0..tracks.len() {
                    let times = match &times {
                        Times::Shared(times) => times,
                        Times::Each(each) => &each[track],
                    };
                    let name = names.map_or("", |names| &names[track]);
                    set.push(name, times, tracks.of(track)).map_err(refused)?;
                }
                set
            }
        };
        Ok(Motion {
            set,
            time_offset,
            ..Motion::default()
        })
    }
}

/// The keys of all tracks, track after track.
struct Tracks {
    keys: Vec<Quat>,
    /// The index after the last key of each track.
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

    /// Whether there are tracks, and each has this number of keys.
    fn are_alike(&self, keys: usize) -> bool {
        keys > 0 && (0..self.len()).all(|track| self.of(track).len() == keys)
    }
}

/// Reads the keys of all tracks, and whether there is a single track without an axis of tracks.
fn tracks_of(
    value: &Bound<'_, PyAny>,
    order: Order,
    times: &Times,
    layout: KeysLayout,
) -> PyResult<(Tracks, bool)> {
    // A list is divided by tracks, unless the layout was stated to be by frames.
    if layout.said() != Some(Layout::FrameMajor)
        && let Some(parts) = parts(value)?
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
        [first, second] => {
            let (keys, [tracks, count]) =
                match layout_of(value.py(), [first, second], times, layout)? {
                    Layout::TrackMajor => (values, [first, second]),
                    Layout::FrameMajor => (swapped(&values, [first, second], 1), [second, first]),
                };
            let ends = (1..=tracks).map(|track| track * count).collect();
            Ok((Tracks { keys, ends }, false))
        }
        _ => Err(input(format!(
            "keys: the shape is {}; give (keys, 4), (tracks, keys, 4), or a list with an array (keys, 4) for each \
             track; {} reads (frames, tracks, 4)",
            shown(&[&*shape, &[4]].concat()),
            layout.spelling(Layout::FrameMajor)
        ))),
    }
}

/// The order of the two axes of keys: as `layout` says; without it (tracks, keys), if the shape is not ambiguous.
fn layout_of(
    py: Python<'_>,
    [first, second]: [usize; 2],
    times: &Times,
    layout: KeysLayout,
) -> PyResult<Layout> {
    let said = layout.said();
    let Times::Shared(times) = times else {
        return Ok(said.unwrap_or(Layout::TrackMajor));
    };
    let count = times.len();
    let shape = shown(&[first, second, 4]);
    let found = format!("keys: the shape is {shape}, and there are {count} times:");
    let refused = |why: String| Err(input(format!("{found} {why}")));
    let [by_track, by_frame] =
        [Layout::TrackMajor, Layout::FrameMajor].map(|it| layout.spelling(it));
    match said {
        None if first == count && second == count && count > 1 => match layout {
            KeysLayout::Argument {
                has_names: true, ..
            } => {
                let message = format!(
                    "{found} read as (tracks, keys, 4); say so by {by_track}, or that they are (frames, tracks, 4) \
                     by {by_frame}"
                );
                warn_of(py, &[message])?;
                Ok(Layout::TrackMajor)
            }
            _ => refused(format!(
                "both axes may be the axis of the frames; state which one it is by {by_track}, (tracks, keys, 4), \
                 or {by_frame}, (frames, tracks, 4)"
            )),
        },
        None | Some(Layout::TrackMajor) if second != count && first == count => refused(format!(
            "the axes are those of {by_frame}, (frames, tracks, 4); give that, or swap them: \
                 np.swapaxes(keys, 0, 1)"
        )),
        Some(Layout::FrameMajor) if first != count && second == count => refused(format!(
            "the axes are those of {by_track}, (tracks, keys, 4)"
        )),
        said => Ok(said.unwrap_or(Layout::TrackMajor)),
    }
}

/// Swaps the two axes of an array whose elements are `each` values.
fn swapped<T: Copy>(values: &[T], [rows, columns]: [usize; 2], each: usize) -> Vec<T> {
    let mut found = Vec::with_capacity(values.len());
    for column in 0..columns {
        for row in 0..rows {
            let start = (row * columns + column) * each;
            found.extend_from_slice(&values[start..start + each]);
        }
    }
    found
}

/// The arguments of `Clip` other than times and rotations.
pub(crate) struct ClipArguments<'a, 'py> {
    pub(crate) parents: Option<Vec<Option<i64>>>,
    pub(crate) offsets: Option<&'a Bound<'py, PyAny>>,
    pub(crate) translations: Option<&'a Bound<'py, PyAny>>,
    pub(crate) scales: Option<&'a Bound<'py, PyAny>>,
    pub(crate) velocities: Option<&'a Bound<'py, PyAny>>,
    pub(crate) tangents: Option<&'a Bound<'py, PyAny>>,
    pub(crate) tcb: Option<&'a Bound<'py, PyAny>>,
}

/// The name, the key times and the values of a scalar.
pub(crate) type ScalarRow = (String, Vec<f64>, Vec<f64>);

/// Reads scalars: their times and keys by their names.
pub(crate) fn scalar_keys(scalars: Option<&Bound<'_, PyDict>>) -> PyResult<Vec<ScalarRow>> {
    let read = |(name, keys): (Bound<'_, PyAny>, Bound<'_, PyAny>)| {
        let name: String = name.extract()?;
        let refused = || {
            input(format!(
                "scalars[{name:?}]: give a pair (times, keys) of two lists of one length"
            ))
        };
        let (times, keys): (Bound<'_, PyAny>, Bound<'_, PyAny>) =
            keys.extract().map_err(|_| refused())?;
        let (times, keys) = (doubles(&times, "scalars")?, doubles(&keys, "scalars")?);
        match (times.shape.len(), times.shape == keys.shape) {
            (1, true) => Ok((name, times.values, keys.values)),
            _ => Err(refused()),
        }
    };
    scalars.into_iter().flatten().map(read).collect()
}

/// Adds scalars to a clip.
pub(crate) fn put_scalars(clip: &mut Motion, scalars: &[ScalarRow]) -> PyResult<()> {
    for (name, times, keys) in scalars {
        if clip.set.scalar_named(name).is_some() {
            return Err(input(format!("scalars: `{name}` is there twice")));
        }
        let offset = clip.time_offset as f64;
        let times: Vec<f64> = times.iter().map(|time| time - offset).collect();
        let keys: Vec<f32> = keys.iter().map(|&key| key as f32).collect();
        clip.set
            .push_scalar(name.as_str(), &times, &keys, &[])
            .map_err(|error| of_track_since(clip.time_offset, &error))?;
    }
    Ok(())
}

/// The reason why positions of joints are unknown.
pub(crate) const NO_OFFSETS: &str = "the joints have parents, but no offsets; give `offsets`";

/// Numbers of the tracks that have any, by the index of the track.
type TrackRows = Vec<(usize, Vec<f64>)>;

/// The checked data of a clip other than times and rotations.
pub(crate) struct ClipParts {
    skeleton: Vec<Joint>,
    has_offsets: bool,
    translations: TrackRows,
    scales: TrackRows,
    velocities: TrackRows,
    tangents: TrackRows,
    tcb: TrackRows,
}

impl ClipArguments<'_, '_> {
    /// Reads and checks the data, for a clip with this number of tracks and these names.
    pub(crate) fn read(
        &self,
        tracks: usize,
        names: Option<&[String]>,
        layout: Layout,
    ) -> PyResult<ClipParts> {
        Ok(ClipParts {
            skeleton: self.skeleton(tracks, names)?,
            has_offsets: self.offsets.is_some(),
            translations: rows(self.translations, "translations", tracks, &[3], layout)?,
            scales: rows(self.scales, "scales", tracks, &[3], layout)?,
            velocities: rows(self.velocities, "velocities", tracks, &[3], layout)?,
            tangents: rows(self.tangents, "tangents", tracks, &[2, 4], layout)?,
            tcb: rows(self.tcb, "tcb", tracks, &[3], layout)?,
        })
    }

    /// The skeleton.
    fn skeleton(&self, tracks: usize, names: Option<&[String]>) -> PyResult<Vec<Joint>> {
        if self.parents.is_none() && self.offsets.is_none() {
            return Ok(Vec::new());
        }
        let parents = match &self.parents {
            None => vec![None; tracks],
            Some(parents) => joint_parents(parents, tracks)?,
        };
        if let Some(track) = circle(&parents) {
            let name = names.map_or_else(String::new, |names| format!(" (`{}`)", names[track]));
            return Err(input(format!(
                "parents: track {track}{name} is its own ancestor; the parent of a root is None or -1"
            )));
        }
        let offsets = match self.offsets {
            None => vec![Vec3::ZERO; tracks],
            Some(value) => joint_offsets(value, tracks)?,
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
        Ok(parents.into_iter().zip(offsets).map(joint).collect())
    }
}

impl ClipParts {
    /// Stores the data in a clip; the components of tangents are in `order`.
    pub(crate) fn put_into(self, clip: &mut Motion, order: Order) -> PyResult<()> {
        clip.skeleton = self.skeleton;
        let of_track = |error: TrackError| of_track(&error);
        for (track, row) in self.translations {
            let times = clip.set.track(track).times.to_vec();
            let positions: Vec<DVec3> = threes(&row).collect();
            let moved = clip.set_positions(track, &times, &positions);
            moved.map_err(of_track)?;
        }
        if !self.has_offsets && clip.has_unplaced_joints() {
            clip.no_world = Some(NO_OFFSETS.to_owned());
        }
        let set = &mut clip.set;
        for (track, row) in self.scales {
            let times = set.track(track).times.to_vec();
            let scales: Vec<Vec3> = threes(&row).map(DVec3::as_vec3).collect();
            let scaled = set.set_scales(track, &times, &scales, &[]);
            scaled.map_err(of_track)?;
        }
        for (track, row) in self.velocities {
            let velocities: Vec<DVec3> = threes(&row).collect();
            set.set_velocities(track, &velocities).map_err(of_track)?;
        }
        for (track, row) in self.tcb {
            let tcb = |of: DVec3| Tcb {
                tension: of.x,
                continuity: of.y,
                bias: of.z,
            };
            let all: Vec<Tcb> = threes(&row).map(tcb).collect();
            set.set_tcb(track, &all).map_err(of_track)?;
        }
        for (track, row) in self.tangents {
            let one = |of: &[f64; 4]| Quat::from_array(order.xyzw(of.map(|it| it as f32)));
            let pairs = row.as_chunks().0.as_chunks::<2>().0;
            let tangents: Vec<[Quat; 2]> = pairs.iter().map(|[a, b]| [one(a), one(b)]).collect();
            set.set_tangents(track, &tangents).map_err(of_track)?;
        }
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
/// None, for each track. By frames, arrays are (frames, tracks, …) and lists have an array for each frame, as those of
/// the keys; a list that contains None is one of tracks.
fn rows(
    value: Option<&Bound<'_, PyAny>>,
    label: &str,
    tracks: usize,
    each: &[usize],
    layout: Layout,
) -> PyResult<TrackRows> {
    let Some(value) = value else {
        return Ok(Vec::new());
    };
    let wrong = |shape: &[usize]| {
        let (axes, list) = match layout {
            Layout::TrackMajor => (format!("{tracks}, keys"), "a list with"),
            Layout::FrameMajor => (
                format!("frames, {tracks}"),
                "a list with an array for each frame, or, where some tracks have none,",
            ),
        };
        let numbers: Vec<String> = each.iter().map(usize::to_string).collect();
        input(format!(
            "{label}: the shape is {}; give ({axes}, {}), or {list} an array or None for each of the {tracks} tracks",
            shown(shape),
            numbers.join(", ")
        ))
    };
    if let Some(parts) = parts(value)?
        && (parts.iter().any(Bound::is_none) || layout == Layout::TrackMajor && has_arrays(&parts)?)
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
    let ArrayValues { shape, mut values } = doubles(value, label)?;
    let size: usize = match &*shape {
        [_, rest @ ..] if rest == each && tracks == 1 => values.len(),
        [keys, count, rest @ ..]
            if layout == Layout::FrameMajor && rest == each && *count == tracks =>
        {
            let together = each.iter().product();
            values = swapped(&values, [*keys, *count], together);
            keys * together
        }
        [_, _, ..] if layout == Layout::FrameMajor => return Err(wrong(&shape)),
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
