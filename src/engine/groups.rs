//! Sets whose tracks have several interpolations. Tracks with equal interpolations are a group. Each group has its
//! [`Plan`] and is evaluated as a separate set, so that a track's values do not depend on its neighbours. Then the
//! values are copied to the positions of the tracks in the whole result.

use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;

use glam::Quat;

use crate::checks::{check_encoding, check_window};
use crate::curve::options::Quantity;
use crate::engine::Engine;
use crate::error::Error;
use crate::evaluate;
use crate::evaluate::pieces::PreparedWindow;
use crate::evaluate::uploaded::{ClipSource, Uploaded};
use crate::machine::Machine;
use crate::machine::error::EvaluateError;
use crate::machine::plan::{Chunks, PREPARED, Plan, tracks_at_once};
use crate::method::interpolation::Interpolation;
use crate::output::buffer::OutputBuffer;
use crate::output::encoded::EncodedOutput;
use crate::output::encoding::Encoding;
use crate::output::rotations::Layout;
use crate::output::window::Window;
use crate::prepare::preparation::SetRequest;
use crate::stream::{Chunk, run};
use crate::time::frames::Timeline;
use crate::tracks::per_track::{PerTrack, PerTrackCountError, TrackGroup};
use crate::tracks::set::TrackSet;

/// Evaluates the tracks of a window group by group. `evaluate` gets the group's index, a range of its list of tracks,
/// and memory for their samples in the window.
pub(crate) fn fill_by_group<'g>(
    groups: impl Iterator<Item = &'g [usize]>,
    window: &Window,
    output: EncodedOutput<'_>,
    mut evaluate: impl FnMut(usize, Range<usize>, EncodedOutput<'_>) -> Result<(), Error>,
) -> Result<(), Error> {
    let samples = window.samples.len();
    if output.len() == 0 {
        return Ok(());
    }
    let (encoding, value_bytes) = (output.encoding, output.encoding.bytes());
    let mut buffer = OutputBuffer::new(0)?;
    for (index, tracks) in groups.enumerate() {
        let range = listed(tracks, &window.tracks);
        let step = tracks_at_once(samples);
        for start in range.clone().step_by(step) {
            let part = start..range.end.min(start + step);
            let bytes = part.len() * samples * value_bytes;
            if buffer.len() * size_of::<Quat>() < bytes {
                buffer = OutputBuffer::new(bytes.div_ceil(size_of::<Quat>()))?;
            }
            let bytes: &mut [u8] = &mut bytemuck::cast_slice_mut(&mut buffer)[..bytes];
            let found = EncodedOutput {
                encoding,
                bytes: &mut *bytes,
            };
            evaluate(index, part.clone(), found)?;
            scatter(bytes, &tracks[part], window, value_bytes, output.bytes);
        }
    }
    Ok(())
}

/// The part of an increasing list of tracks that lies in a range.
fn listed(tracks: &[usize], range: &Range<usize>) -> Range<usize> {
    let before = |end| tracks.partition_point(|&track| track < end);
    before(range.start)..before(range.end)
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

    /// The tracks prepared for any sample times; groups whose segments exceed the engine's memory limit are prepared
    /// piece by piece by each evaluation.
    pub(crate) fn prepared(&self) -> Result<GroupedTracks, Error> {
        self.with(&(0..self.set.track_count()), |machine, set, value| {
            Uploaded::whole(machine, &set, value)
        })
    }

    /// Some of the tracks, which each evaluation prepares.
    pub(crate) fn unprepared(&self, tracks: &Range<usize>) -> Result<GroupedTracks, Error> {
        self.with(tracks, |_, set, value| Uploaded::of_set(set, value))
    }

    fn with(
        &self,
        range: &Range<usize>,
        upload: impl Fn(&Arc<dyn Machine>, TrackSet, Interpolation) -> Result<Uploaded, EvaluateError>,
    ) -> Result<GroupedTracks, Error> {
        let Self { engine, set, .. } = *self;
        let (of_all, quantity) = (self.groups()?, self.quantity()?);
        let mut groups = Vec::with_capacity(of_all.len());
        for TrackGroup { value, tracks } in of_all {
            let tracks = tracks[listed(tracks, range)].to_vec();
            if tracks.is_empty() {
                continue;
            }
            let set = set.select(tracks.iter().copied())?;
            let uploaded = upload(&engine.machine, set, *value);
            let uploaded = uploaded.map_err(|error| Error::from(error).of_tracks(&tracks))?;
            groups.push(Group { tracks, uploaded });
        }
        Ok(GroupedTracks {
            groups,
            track_count: set.track_count(),
            time_span: set.time_span(),
            quantity,
        })
    }
}

/// Tracks with several interpolations, prepared or not.
pub(crate) struct GroupedTracks {
    groups: Vec<Group>,
    pub(super) track_count: usize,
    /// The first and the last key time of all tracks.
    pub(super) time_span: Option<(f64, f64)>,
    pub(super) quantity: Quantity,
}

/// The source of the samples of each group, and for each track the index of its group and its index there.
type GroupsAndTracks = (Vec<ClipSource>, Vec<(usize, usize)>);

/// The tracks that have equal interpolations.
struct Group {
    /// Their indices among all tracks, increasing.
    tracks: Vec<usize>,
    uploaded: Uploaded,
}

/// How the part of a group that is in a window is evaluated.
struct GroupWork<'g> {
    group: &'g Group,
    source: WorkSource<'g>,
}

enum WorkSource<'g> {
    /// Segments for any sample times.
    Prepared(Cow<'g, Timeline>),
    /// Segments for the samples of the window.
    PreparedWindow(Box<PreparedWindow>),
    Planned(SetRequest<'g>, Plan),
}

impl GroupWork<'_> {
    /// Evaluates some tracks of the group's list at some samples.
    fn fill(
        &self,
        engine: &Engine,
        window: &Window,
        output: EncodedOutput<'_>,
    ) -> Result<(), EvaluateError> {
        match &self.source {
            WorkSource::Prepared(timeline) => {
                let prepared = self.group.uploaded.prepared()?;
                prepared.evaluate_into(timeline, window, output)
            }
            WorkSource::PreparedWindow(prepared) => prepared.evaluate_into(window, output),
            WorkSource::Planned(request, plan) => {
                let part = request.part(window.tracks.clone(), window.samples.clone());
                let plan = plan.of_chunk(request, window);
                evaluate::fill(&engine.machine, &part, &plan, output)
            }
        }
    }
}

impl GroupedTracks {
    /// The names of the methods.
    pub(super) fn methods(&self) -> impl Iterator<Item = &'static str> {
        let groups = self.groups.iter();
        groups.map(|group| group.uploaded.data().interpolation.method.name)
    }

    /// The data of every group, and for each track the index of its group and its index there; an error if the segments
    /// of a group exceed the engine's memory limit.
    pub(super) fn prepared_tracks(&self) -> Result<GroupsAndTracks, EvaluateError> {
        let mut groups = Vec::with_capacity(self.groups.len());
        let mut tracks = vec![(0, 0); self.track_count];
        for (index, group) in self.groups.iter().enumerate() {
            groups.push(group.uploaded.source()?);
            for (in_group, &track) in group.tracks.iter().enumerate() {
                tracks[track] = (index, in_group);
            }
        }
        Ok((groups, tracks))
    }

    /// Bytes that the tracks take on the host.
    pub(super) fn bytes(&self) -> usize {
        self.groups.iter().map(|group| group.uploaded.bytes()).sum()
    }

    /// The sample times of each group's tracks.
    fn timelines(&self, timeline: &Timeline) -> Vec<Timeline> {
        let groups = self.groups.iter();
        groups
            .map(|group| timeline.of_listed(&group.tracks))
            .collect()
    }

    /// How each group that has tracks in a window is evaluated; with `chunk`, as a stream in chunks of so many values.
    fn works<'g>(
        &'g self,
        engine: &Engine,
        timelines: &'g [Timeline],
        window: &Window,
        encoding: Encoding,
        chunk: Option<usize>,
    ) -> Result<Vec<GroupWork<'g>>, Error> {
        let mut prepared = Vec::new();
        let (mut planned, mut requests) = (Vec::new(), Vec::new());
        for (group, timeline) in self.groups.iter().zip(timelines) {
            let (tracks, data) = (listed(&group.tracks, &window.tracks), group.uploaded.data());
            match group.uploaded.unprepared() {
                _ if tracks.is_empty() => {}
                None => prepared.push(GroupWork {
                    group,
                    source: WorkSource::Prepared(data.folded(timeline)?),
                }),
                Some(set) => {
                    let request = SetRequest::whole(set, &data.interpolation, timeline);
                    requests.push(request.part(tracks, window.samples.clone()));
                    planned.push(group);
                }
            }
        }
        let limits = engine.machine.limits();
        let plans = Plan::of_groups(&requests, window, encoding, chunk, &limits);
        let planned = planned.into_iter().zip(requests).zip(plans);
        let planned = planned.map(|((group, request), plan)| GroupWork {
            group,
            source: WorkSource::Planned(request, plan),
        });
        Ok(prepared.into_iter().chain(planned).collect())
    }

    /// Evaluates a window of the result into `output`, in an encoding; refuses what does not fit.
    pub(crate) fn fill(
        &self,
        engine: &Engine,
        timeline: &Timeline,
        window: &Window,
        output: EncodedOutput<'_>,
    ) -> Result<(), Error> {
        let encoding = output.encoding;
        check_encoding(encoding, self.quantity)?;
        check_window(
            window,
            self.track_count,
            timeline.len(),
            encoding,
            output.bytes,
        )?;
        let timelines = self.timelines(timeline);
        let works = self.works(engine, &timelines, window, encoding, None)?;
        fill_window(engine, &works, window, output)
    }

    /// Evaluates a window of the result in chunks of about `chunk` values.
    pub(crate) fn stream<E: From<Error>>(
        &self,
        engine: &Engine,
        timeline: &Timeline,
        window: &Window,
        chunk: usize,
        sink: impl FnMut(Chunk<'_>) -> Result<(), E>,
    ) -> Result<(), E> {
        let timelines = self.timelines(timeline);
        let mut works = self.works(engine, &timelines, window, Encoding::F32, Some(chunk))?;
        for GroupWork { group, source } in &mut works {
            let of_tracks = |error| Error::from(error).of_tracks(&group.tracks);
            if let WorkSource::Planned(request, plan) = source
                && plan.chunks == Chunks::PreparedOnce
            {
                let prepared = PreparedWindow::whole(&engine.machine, request);
                *source = WorkSource::PreparedWindow(Box::new(prepared.map_err(of_tracks)?));
            }
        }
        let fill = |window: &Window, output: &mut [Quat]| {
            let output = EncodedOutput::of_values(bytemuck::cast_slice_mut(output));
            fill_window(engine, &works, window, output)
        };
        run(window.cut(chunk), self.quantity, fill, sink)
    }

    /// A line for each group that has tracks in a window of the result: their number, the method and how they are
    /// evaluated.
    pub(crate) fn explain(
        &self,
        engine: &Engine,
        timeline: &Timeline,
        window: &Window,
        encoding: Encoding,
        chunk: Option<usize>,
    ) -> Result<String, Error> {
        let timelines = self.timelines(timeline);
        let works = self.works(engine, &timelines, window, encoding, chunk)?;
        let mut lines = Vec::new();
        for GroupWork { group, source } in &works {
            let count = listed(&group.tracks, &window.tracks).len();
            let method = group.uploaded.data().interpolation.method;
            let tracks = if count == 1 { "track" } else { "tracks" };
            let route = match source {
                WorkSource::Planned(_, plan) => format!("{}{plan}", group.uploaded.kept_form()),
                WorkSource::Prepared(_) | WorkSource::PreparedWindow(_) => PREPARED.to_owned(),
            };
            lines.push(format!("{count} {tracks} by {method}: {route}"));
        }
        Ok(lines.join("\n"))
    }
}

/// Evaluates a window of the result into `output`, which is exactly as long.
fn fill_window(
    engine: &Engine,
    works: &[GroupWork<'_>],
    window: &Window,
    output: EncodedOutput<'_>,
) -> Result<(), Error> {
    let tracks = works.iter().map(|work| &*work.group.tracks);
    fill_by_group(tracks, window, output, |index, tracks, found| {
        let work = &works[index];
        let part = Window::of(tracks, window.samples.clone(), window.layout);
        let done = work.fill(engine, &part, found);
        done.map_err(|error| Error::from(error).of_tracks(&work.group.tracks))
    })
}
