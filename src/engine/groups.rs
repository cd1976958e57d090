//! Sets whose tracks have several interpolations: tracks with equal ones are evaluated together, and their values are
//! copied to where they belong among those of all tracks. Each group is evaluated as a set of its own, so that a
//! track's values do not depend on its neighbours.

use std::ops::Range;

use glam::Quat;

use crate::checks::{check_encoding, check_window};
use crate::curve::options::Quantity;
use crate::engine::Engine;
use crate::engine::stream::SEGMENT_BYTES;
use crate::error::Error;
use crate::evaluate::uploaded::Uploaded;
use crate::evaluate::uploaded::pieces::segment_bytes;
use crate::method::interpolation::Interpolation;
use crate::output::buffer::OutputBuffer;
use crate::output::encoding::Encoding;
use crate::output::rotations::Layout;
use crate::output::window::Window;
use crate::stream::{Chunk, run};
use crate::time::frames::Timeline;
use crate::tracks::per_track::{PerTrack, PerTrackCountError, TrackGroup};
use crate::tracks::set::TrackSet;

/// How many values of a group are evaluated before they are copied to their places: the memory that this takes.
const VALUES: usize = 1 << 22;

/// Evaluates the tracks of a window group by group. `evaluate` gets the group's index, a range of its list of tracks,
/// and memory for their samples in the window.
pub(crate) fn fill_by_group<'g>(
    groups: impl Iterator<Item = &'g [usize]>,
    window: &Window,
    value_bytes: usize,
    output: &mut [u8],
    mut evaluate: impl FnMut(usize, Range<usize>, &mut [u8]) -> Result<(), Error>,
) -> Result<(), Error> {
    let samples = window.samples.len();
    if output.is_empty() {
        return Ok(());
    }
    let mut buffer = OutputBuffer::new(0)?;
    for (index, tracks) in groups.enumerate() {
        let [first, end] = [window.tracks.start, window.tracks.end]
            .map(|end| tracks.partition_point(|&it| it < end));
        let step = (VALUES / samples).max(1);
        for start in (first..end).step_by(step) {
            let part = start..end.min(start + step);
            let bytes = part.len() * samples * value_bytes;
            if buffer.len() * size_of::<Quat>() < bytes {
                buffer = OutputBuffer::new(bytes.div_ceil(size_of::<Quat>()))?;
            }
            let found = &mut bytemuck::cast_slice_mut(&mut buffer)[..bytes];
            evaluate(index, part.clone(), found)?;
            scatter(found, &tracks[part], window, value_bytes, output);
        }
    }
    Ok(())
}

/// Copies the values of some tracks, in the window's layout, to their places in the window.
fn scatter(found: &[u8], tracks: &[usize], window: &Window, value_bytes: usize, output: &mut [u8]) {
    let samples = window.samples.clone();
    match window.layout {
        Layout::TrackMajor => {
            let row_bytes = samples.len() * value_bytes;
            for (row, &track) in found.chunks_exact(row_bytes).zip(tracks) {
                let start = window.offset(track, samples.start) * value_bytes;
                output[start..start + row_bytes].copy_from_slice(row);
            }
        }
        Layout::FrameMajor => {
            let rows = found.chunks_exact(tracks.len() * value_bytes);
            for (row, sample) in rows.zip(samples) {
                for (value, &track) in row.chunks_exact(value_bytes).zip(tracks) {
                    let start = window.offset(track, sample) * value_bytes;
                    output[start..start + value_bytes].copy_from_slice(value);
                }
            }
        }
    }
}

/// A set whose tracks are evaluated by several interpolations.
#[derive(Debug, Clone)]
pub(crate) struct GroupedSet<'a> {
    pub(crate) engine: &'a Engine,
    pub(crate) set: &'a TrackSet,
    groups: Result<Vec<TrackGroup<Interpolation>>, PerTrackCountError>,
}

impl<'a> GroupedSet<'a> {
    pub(crate) fn new(
        engine: &'a Engine,
        set: &'a TrackSet,
        interpolations: PerTrack<Interpolation>,
    ) -> Self {
        let groups = interpolations.groups(set.track_count());
        Self {
            engine,
            set,
            groups,
        }
    }

    pub(crate) fn groups(&self) -> Result<&[TrackGroup<Interpolation>], PerTrackCountError> {
        self.groups.as_deref().map_err(|&error| error)
    }

    /// The quantity of all tracks; that of none is the rotation.
    pub(crate) fn quantity(&self) -> Result<Quantity, Error> {
        let groups = self.groups()?;
        let Some(first) = groups.first() else {
            return Ok(Quantity::Rotation);
        };
        let quantity = first.value.quantity;
        match groups.iter().find(|group| group.value.quantity != quantity) {
            Some(other) => Err(Error::MixedQuantities {
                first: quantity,
                track: other.tracks[0],
                other: other.value.quantity,
            }),
            None => Ok(quantity),
        }
    }

    /// Evaluates a window of the result into memory, encoded, if they fit.
    pub(crate) fn encode_window_into(
        &self,
        timeline: &Timeline,
        window: &Window,
        encoding: Encoding,
        output: &mut [u8],
    ) -> Result<(), Error> {
        check_encoding(encoding, self.quantity()?)?;
        let tracks = self.set.track_count();
        check_window(window, tracks, timeline.len(), encoding, output)?;
        let groups = self.groups()?;
        let tracks = groups.iter().map(|group| &*group.tracks);
        let size = encoding.bytes();
        fill_by_group(tracks, window, size, output, |group, part, found| {
            let TrackGroup { value, tracks } = &groups[group];
            let tracks = &tracks[part];
            let set = self.set.select(tracks.iter().copied())?;
            let part = Window::of(0..tracks.len(), window.samples.clone(), window.layout);
            let timeline = timeline.of_listed(tracks);
            let destination = (encoding, found);
            let done =
                (self.engine).encode_window_into(&set, *value, &timeline, &part, destination);
            done.map_err(|error| error.of_tracks(tracks))
        })
    }

    /// Evaluates a window of the result in chunks of about `chunk` values.
    ///
    /// If a chunk has whole tracks, the segments of one chunk's tracks exist at a time. Otherwise every chunk needs
    /// segments that others need too, so all are prepared at once, unless that takes too much.
    pub(crate) fn stream<E: From<Error>>(
        &self,
        timeline: &Timeline,
        window: &Window,
        chunk: usize,
        sink: impl FnMut(Chunk<'_>) -> Result<(), E>,
    ) -> Result<(), E> {
        let (groups, quantity) = (self.groups().map_err(Error::from)?, self.quantity()?);
        let is_track_major = window.layout == Layout::TrackMajor;
        let has_whole_tracks = is_track_major && window.samples.len() <= chunk;
        let needed = |group: &TrackGroup<Interpolation>| segment_bytes(self.set, &group.value);
        let limit = self.engine.backend.budget().unwrap_or(SEGMENT_BYTES);
        let is_small = || groups.iter().all(|group| needed(group) <= limit);
        if !has_whole_tracks && is_small() {
            return GroupedClip::new(self)?.stream(timeline, window, chunk, sink);
        }
        let fill = |window: &Window, output: &mut [Quat]| {
            let output = bytemuck::cast_slice_mut(output);
            self.encode_window_into(timeline, window, Encoding::F32, output)
        };
        run(window.cut(chunk), quantity, fill, sink)
    }
}

/// Prepared tracks with several interpolations.
pub(crate) struct GroupedClip {
    parts: Vec<ClipPart>,
    pub(super) track_count: usize,
    /// The first and the last key time of all tracks.
    pub(super) time_span: Option<(f64, f64)>,
    pub(super) quantity: Quantity,
}

/// The tracks of a clip that have equal interpolations.
struct ClipPart {
    /// Their indices in the clip, increasing.
    tracks: Vec<usize>,
    uploaded: Uploaded,
}

impl GroupedClip {
    pub(crate) fn new(grouped: &GroupedSet<'_>) -> Result<Self, Error> {
        let GroupedSet { engine, set, .. } = *grouped;
        let (groups, quantity) = (grouped.groups()?, grouped.quantity()?);
        let mut parts = Vec::with_capacity(groups.len());
        for group in groups {
            let tracks = group.tracks.clone();
            let set = set.select(tracks.iter().copied())?;
            let uploaded = Uploaded::whole(&engine.backend, &set, group.value);
            let uploaded = uploaded.map_err(|error| Error::from(error).of_tracks(&tracks))?;
            parts.push(ClipPart { tracks, uploaded });
        }
        Ok(Self {
            parts,
            track_count: set.track_count(),
            time_span: set.time_span(),
            quantity,
        })
    }

    /// The names of the methods.
    pub(super) fn methods(&self) -> impl Iterator<Item = &'static str> {
        let parts = self.parts.iter();
        parts.map(|part| part.uploaded.data.interpolation.method.name)
    }

    /// The timeline of each part, in the form that [`Uploaded::evaluate_into`] requires.
    fn timelines(&self, timeline: &Timeline) -> Result<Vec<Timeline>, Error> {
        let timelines = self.parts.iter().map(|part| {
            let timeline = timeline.of_listed(&part.tracks);
            Ok(part.uploaded.folded(&timeline)?.into_owned())
        });
        timelines.collect()
    }

    fn fill(
        &self,
        timelines: &[Timeline],
        window: &Window,
        encoding: Encoding,
        output: &mut [u8],
    ) -> Result<(), Error> {
        let tracks = self.parts.iter().map(|part| &*part.tracks);
        let size = encoding.bytes();
        fill_by_group(tracks, window, size, output, |index, tracks, found| {
            let window = Window::of(tracks, window.samples.clone(), window.layout);
            let (uploaded, timeline) = (&self.parts[index].uploaded, &timelines[index]);
            Ok(uploaded.evaluate_into(timeline, &window, encoding, found)?)
        })
    }

    /// Evaluates a window of the result into `output`, which is exactly as long.
    pub(super) fn evaluate_into(
        &self,
        timeline: &Timeline,
        window: &Window,
        encoding: Encoding,
        output: &mut [u8],
    ) -> Result<(), Error> {
        self.fill(&self.timelines(timeline)?, window, encoding, output)
    }

    /// Evaluates a window of the result in chunks of about `chunk` values.
    pub(crate) fn stream<E: From<Error>>(
        &self,
        timeline: &Timeline,
        window: &Window,
        chunk: usize,
        sink: impl FnMut(Chunk<'_>) -> Result<(), E>,
    ) -> Result<(), E> {
        let timelines = self.timelines(timeline)?;
        let fill = |window: &Window, output: &mut [Quat]| {
            let output = bytemuck::cast_slice_mut(output);
            self.fill(&timelines, window, Encoding::F32, output)
        };
        run(window.cut(chunk), self.quantity, fill, sink)
    }
}
