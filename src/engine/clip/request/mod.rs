//! A request: which samples of a clip or of a set are evaluated, in which layout and encoding, and into which memory.

#[cfg(feature = "vulkan")]
pub(crate) mod on_device;

use std::ops::Range;
use std::sync::Arc;

use bytemuck::Pod;
use glam::{Quat, Vec4};

use crate::checks::{check_encoding, check_rows, check_within, in_quats};
use crate::curve::options::Quantity;
use crate::engine::Engine;
use crate::engine::clip::{Clip, ClipTracks};
use crate::engine::groups::{GroupedSet, GroupedTracks};
use crate::error::Error;
use crate::machine::plan::PREPARED;
use crate::memory::zeroed;
use crate::method::interpolation::Interpolation;
use crate::output::buffer::OutputBuffer;
use crate::output::encoded::EncodedOutput;
use crate::output::encoding::Encoding;
use crate::output::rotations::{Layout, Rotations, Samples, Vectors};
use crate::output::value::OutputValue;
use crate::output::window::Window;
use crate::prepare::preparation::SetRequest;
use crate::stream::Chunk;
use crate::time::frames::{SampleTimes, Timeline};
use crate::tracks::per_track::PerTrack;
use crate::tracks::set::TrackSet;

/// A request for samples of a clip ([`Clip::request`]) or of a set ([`Engine::request`]).
///
/// A request selects tracks and samples, and sets the layout and the encoding. Then one of the functions below
/// evaluates the samples into a destination. For a set, only the segments that the samples need are prepared, piece by
/// piece if that takes less memory.
///
/// ```
/// use tumble::{Device, Encoding, Engine, SampleTimes, Layout, TrackSet, method};
/// use glam::Quat;
///
/// let mut set = TrackSet::new();
/// let keys = [0.0, 0.7, 2.0].map(Quat::from_rotation_z);
/// set.push("elbow", &[0.0, 0.5, 1.0], &keys)?;
/// set.push("wrist", &[0.0, 0.5, 1.0], &keys)?;
/// let clip = Engine::new(Device::Cpu)?.upload(&set, method::SLERP)?;
///
/// // The second half of a second at 60 frames a second, of the wrist alone, as bits of f16.
/// let frames = SampleTimes::fps(60);
/// let request = clip.request(&frames).encoding(Encoding::F16).tracks(1..2).samples(30..61);
/// let mut halves = vec![[0_u16; 4]; 31];
/// request.evaluate_into(&mut halves)?;
/// # assert_eq!(halves[0][3], 0x3b84);
/// # Ok::<(), tumble::Error>(())
/// ```
#[derive(Debug, Clone)]
#[must_use = "a request does nothing until its result is sent somewhere"]
pub struct Request<'a> {
    source: RequestSource<'a>,
    times: &'a SampleTimes,
    layout: Layout,
    encoding: Encoding,
    tracks: Option<Range<usize>>,
    samples: Option<Range<usize>>,
}

/// The clip or the set that is evaluated.
#[derive(Debug, Clone)]
#[allow(clippy::large_enum_variant)] // it lives on the stack of one call
enum RequestSource<'a> {
    Clip(&'a Clip),
    Set {
        engine: &'a Engine,
        set: &'a TrackSet,
        interpolation: Interpolation,
    },
    /// A set whose tracks have several interpolations.
    Grouped(GroupedSet<'a>),
}

impl RequestSource<'_> {
    fn quantity(&self) -> Result<Quantity, Error> {
        match self {
            Self::Clip(clip) => Ok(clip.quantity()),
            Self::Set { interpolation, .. } => Ok(interpolation.quantity),
            Self::Grouped(grouped) => grouped.quantity(),
        }
    }

    fn track_count(&self) -> usize {
        match self {
            Self::Clip(clip) => clip.track_count(),
            Self::Set { set, .. } | Self::Grouped(GroupedSet { set, .. }) => set.track_count(),
        }
    }

    fn timeline(&self, times: &SampleTimes) -> Result<Timeline, Error> {
        Ok(match self {
            Self::Clip(clip) => clip.timeline(times)?,
            Self::Set { set, .. } | Self::Grouped(GroupedSet { set, .. }) => {
                times.resolve(set.track_count(), set.time_span())?
            }
        })
    }

    /// As [`Uploaded::kept_form`](crate::evaluate::uploaded::Uploaded::kept_form) of a clip.
    fn kept_form(&self) -> &'static str {
        match self {
            Self::Clip(Clip {
                tracks: ClipTracks::Alike(uploaded),
                ..
            }) => uploaded.kept_form(),
            _ => "",
        }
    }

    /// The work that evaluates a part of the result.
    fn work<'r>(&'r self, part: &'r RequestPart) -> Result<RequestWork<'r>, Error> {
        let (engine, set, interpolation) = match self {
            Self::Clip(clip) => match &clip.tracks {
                ClipTracks::Alike(uploaded) => match uploaded.unprepared() {
                    Some(set) => (clip.engine(), set, &uploaded.data().interpolation),
                    None => return Ok(RequestWork::Prepared(clip)),
                },
                ClipTracks::Grouped(groups) => {
                    let (engine, groups) = (clip.engine(), Arc::clone(groups));
                    return Ok(RequestWork::Groups { engine, groups });
                }
            },
            Self::Set {
                engine,
                set,
                interpolation,
            } => (*engine, *set, interpolation),
            Self::Grouped(grouped) => {
                let groups = Arc::new(grouped.unprepared(&part.window.tracks)?);
                let engine = grouped.engine;
                return Ok(RequestWork::Groups { engine, groups });
            }
        };
        let request = SetRequest::whole(set, interpolation, &part.timeline);
        let (tracks, samples) = (part.window.tracks.clone(), part.window.samples.clone());
        Ok(RequestWork::Set(SetWork {
            engine,
            request: request.part(tracks, samples),
        }))
    }
}

/// The clip or the set that a request evaluates.
#[allow(clippy::large_enum_variant)] // it lives on the stack of one call
enum RequestWork<'r> {
    /// A clip whose segments are prepared.
    Prepared(&'r Clip),
    Set(SetWork<'r>),
    /// Tracks with several interpolations.
    Groups {
        engine: &'r Engine,
        groups: Arc<GroupedTracks>,
    },
}

/// Samples of a set, and the engine that evaluates them.
struct SetWork<'r> {
    engine: &'r Engine,
    request: SetRequest<'r>,
}

/// The sample times of a request, and the part of them that the result has.
pub(crate) struct RequestPart {
    pub(crate) timeline: Timeline,
    pub(crate) window: Window,
}

impl<'a> Request<'a> {
    /// All tracks of a clip, track by track, as values of four f32.
    pub(crate) fn of_clip(clip: &'a Clip, times: &'a SampleTimes) -> Self {
        Self::new(RequestSource::Clip(clip), times)
    }

    /// The same of a set.
    pub(crate) fn of_set(
        engine: &'a Engine,
        set: &'a TrackSet,
        interpolations: PerTrack<Interpolation>,
        times: &'a SampleTimes,
    ) -> Self {
        let source = match interpolations.uniform(set.track_count()) {
            Some(interpolation) => RequestSource::Set {
                engine,
                set,
                interpolation,
            },
            None => RequestSource::Grouped(GroupedSet::new(engine, set, interpolations)),
        };
        Self::new(source, times)
    }

    fn new(source: RequestSource<'a>, times: &'a SampleTimes) -> Self {
        Self {
            source,
            times,
            layout: Layout::TrackMajor,
            encoding: Encoding::F32,
            tracks: None,
            samples: None,
        }
    }
}

impl Request<'_> {
    /// Sets the order of the result; by default `[track][sample]`.
    pub fn layout(mut self, layout: Layout) -> Self {
        self.layout = layout;
        self
    }

    /// Sets the encoding of each value; by default four f32.
    pub fn encoding(mut self, encoding: Encoding) -> Self {
        self.encoding = encoding;
        self
    }

    /// Limits the result to these tracks; indices count from 0.
    pub fn tracks(mut self, tracks: Range<usize>) -> Self {
        self.tracks = Some(tracks);
        self
    }

    /// Limits the result to these samples of the request's times; indices count from 0.
    pub fn samples(mut self, samples: Range<usize>) -> Self {
        self.samples = Some(samples);
        self
    }

    /// The number of values of the result, and the bytes of each.
    ///
    /// # Errors
    /// * When the sample times do not fit the tracks ([`SampleTimes::resolve`](crate::SampleTimes::resolve)).
    /// * When the selected tracks or samples are out of range.
    /// * When the encoding is only for rotations, and the quantity is a velocity or an acceleration.
    /// * When the set's interpolations are for another number of tracks, or have several quantities.
    pub fn size(&self) -> Result<(usize, usize), Error> {
        let RequestPart { window, .. } = self.part()?;
        Ok((window.len(), self.encoding.bytes()))
    }

    /// Evaluates rotations.
    ///
    /// # Errors
    /// As [`Request::size`]; also when the quantity is a velocity or an acceleration, the encoding is not f32, there
    /// is not enough memory for the result, or the device fails.
    pub fn evaluate(&self) -> Result<Rotations, Error> {
        check_rows::<Quat>(self.source.quantity()?)?;
        self.values()
    }

    /// Evaluates velocities or accelerations
    /// ([`Interpolation::quantity`](crate::method::interpolation::Interpolation::quantity)).
    ///
    /// # Errors
    /// As [`Request::evaluate`], but the quantity must not be the rotation.
    pub fn rates(&self) -> Result<Vectors, Error> {
        check_rows::<Vec4>(self.source.quantity()?)?;
        self.values()
    }

    /// Evaluates to bytes in the request's encoding, which the device applies; the same bytes as [`Encoding::encode`]
    /// of the rotations.
    ///
    /// # Errors
    /// As [`Request::size`]; also when there is not enough memory for the result, or the device fails.
    pub fn evaluate_bytes(&self) -> Result<Vec<u8>, Error> {
        let part = self.part()?;
        let bytes = part.window.len().saturating_mul(self.encoding.bytes());
        let mut output = zeroed(bytes, "a result")?;
        self.fill(&part, &mut output)?;
        Ok(output)
    }

    /// Evaluates into the caller's memory, of any type. Its bytes are those of [`Request::evaluate_bytes`], in the
    /// order of the layout. Memory that is aligned to 16 bytes is filled without a copy.
    ///
    /// # Errors
    /// As [`Request::size`]; also when `output` is not exactly as many bytes as the result, there is not enough
    /// memory, or the device fails.
    pub fn evaluate_into<T: Pod>(&self, output: &mut [T]) -> Result<(), Error> {
        self.fill(&self.part()?, bytemuck::cast_slice_mut(output))
    }

    /// As [`Request::evaluate_into`], for values of the result's type only.
    pub(crate) fn evaluate_values_into<R: OutputValue>(
        &self,
        output: &mut [R],
    ) -> Result<(), Error> {
        check_rows::<R>(self.source.quantity()?)?;
        let part = self.part()?;
        in_quats(output, part.window.len(), |quats| {
            self.fill(&part, bytemuck::cast_slice_mut(quats))
        })
    }

    /// Evaluates in chunks of about `chunk` values, which should be at least one row of the layout. `sink` uses one
    /// chunk while the next ones are evaluated.
    ///
    /// A stream needs memory for three chunks, and for a set also for segments:
    ///
    /// * track by track, if a chunk has whole tracks: the segments of one chunk's tracks at a time;
    /// * otherwise: all segments that the request's samples need, if they take no more than
    ///   [`EngineOptions::memory`](crate::machine::options::EngineOptions::memory) (256 MiB if it has no limit), and else
    ///   those of a part of a chunk at a time.
    ///
    /// If tracks have several interpolations, it also needs memory for a copy of the keys, sorted by interpolation.
    ///
    /// ```
    /// # use glam::{Quat, Vec4};
    /// # use tumble::{Device, Engine, Error, SampleTimes, Layout, TrackSet, method};
    /// # let mut set = TrackSet::new();
    /// # set.push("", &[0.0, 1.0], &[Quat::IDENTITY, Quat::from_rotation_x(1.0)]).unwrap();
    /// # let clip = Engine::new(Device::Cpu)?.upload(&set, method::SLERP)?;
    /// let mut largest: f32 = 0.0;
    /// clip.request(&SampleTimes::fps(60)).layout(Layout::FrameMajor).stream(1 << 20, |chunk| {
    ///     largest = chunk.rows.iter().map(|[x, ..]| *x).fold(largest, f32::max);
    ///     Ok::<(), Error>(())
    /// })?;
    /// # assert_eq!(largest, (0.5f32).sin());
    /// # Ok::<(), Error>(())
    /// ```
    ///
    /// # Errors
    /// The first error of `sink`; as [`Request::size`]; and when the encoding is not f32, there is not enough memory,
    /// or the device fails.
    pub fn stream<E: From<Error>>(
        &self,
        chunk: usize,
        sink: impl FnMut(Chunk<'_>) -> Result<(), E>,
    ) -> Result<(), E> {
        self.check_f32()?;
        let part = self.part()?;
        match self.source.work(&part)? {
            RequestWork::Prepared(clip) => {
                clip.stream_window(&part.timeline, &part.window, chunk, sink)
            }
            RequestWork::Set(SetWork { engine, request }) => {
                engine.stream_request(&request, self.layout, chunk, sink)
            }
            RequestWork::Groups { engine, groups } => {
                groups.stream(engine, &part.timeline, &part.window, chunk, sink)
            }
        }
    }

    /// Describes in words how this request would be evaluated: what is prepared, in which pieces, and what is done
    /// with the values. All routes give the same bits. If tracks have several interpolations, there is a line for each of
    /// them.
    ///
    /// ```
    /// # use tumble::{Device, Encoding, Engine, SampleTimes, TrackSet, method};
    /// # use glam::Quat;
    /// # let mut set = TrackSet::new();
    /// # set.push("", &[0.0, 1.0], &[Quat::IDENTITY, Quat::from_rotation_x(1.0)])?;
    /// let engine = Engine::new(Device::Cpu)?;
    /// let frames = SampleTimes::fps(60);
    /// let request = engine.request(&set, method::SLERP, &frames).encoding(Encoding::F16);
    /// assert!(request.explain()?.starts_with("in batches"));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// As [`Request::size`].
    pub fn explain(&self) -> Result<String, Error> {
        self.explained(None)
    }

    /// As [`Request::explain`], for [`Request::stream`] with chunks of this size.
    ///
    /// # Errors
    /// As [`Request::size`].
    pub fn explain_stream(&self, chunk: usize) -> Result<String, Error> {
        self.explained(Some(chunk))
    }

    fn explained(&self, chunk: Option<usize>) -> Result<String, Error> {
        let part = self.part()?;
        Ok(match self.source.work(&part)? {
            RequestWork::Prepared(_) => PREPARED.to_owned(),
            RequestWork::Set(SetWork { engine, request }) => {
                let plan = engine.plan(&request, self.layout, self.encoding, chunk);
                format!("{}{plan}", self.source.kept_form())
            }
            RequestWork::Groups { engine, groups } => {
                groups.explain(engine, &part.timeline, &part.window, self.encoding, chunk)?
            }
        })
    }

    /// The values of any quantity.
    fn values<T>(&self) -> Result<Samples<T>, Error> {
        self.check_f32()?;
        let part = self.part()?;
        let window = &part.window;
        let work = self.source.work(&part)?;
        match &work {
            RequestWork::Set(SetWork { engine, request }) => {
                return engine.samples(request, self.layout);
            }
            RequestWork::Prepared(clip)
                if *window
                    == Window::whole(clip.track_count(), part.timeline.len(), self.layout) =>
            {
                return clip.samples(&part.timeline, self.layout);
            }
            _ => {}
        }
        let mut quats = OutputBuffer::new(window.len())?;
        self.fill_by(&work, &part, bytemuck::cast_slice_mut(&mut quats))?;
        let (tracks, samples) = (window.tracks.len(), window.samples.len());
        Ok(Samples::new(Box::new(quats), tracks, samples, self.layout))
    }

    /// Evaluates a part of the result into `bytes`, in the request's encoding; refuses what does not fit.
    fn fill(&self, part: &RequestPart, bytes: &mut [u8]) -> Result<(), Error> {
        self.fill_by(&self.source.work(part)?, part, bytes)
    }

    fn fill_by(
        &self,
        work: &RequestWork<'_>,
        part: &RequestPart,
        bytes: &mut [u8],
    ) -> Result<(), Error> {
        let encoding = self.encoding;
        let output = EncodedOutput { encoding, bytes };
        match work {
            RequestWork::Prepared(clip) => clip.fill_window(&part.timeline, &part.window, output),
            RequestWork::Set(SetWork { engine, request }) => {
                engine.fill_request(request, self.layout, output)
            }
            RequestWork::Groups { engine, groups } => {
                groups.fill(engine, &part.timeline, &part.window, output)
            }
        }
    }

    /// Refuses encodings other than f32.
    fn check_f32(&self) -> Result<(), Error> {
        match self.encoding {
            Encoding::F32 => Ok(()),
            encoding => Err(Error::ResultOfF32 { encoding }),
        }
    }

    /// The sample times of the request, and the part of them that the result has.
    pub(crate) fn part(&self) -> Result<RequestPart, Error> {
        check_encoding(self.encoding, self.source.quantity()?)?;
        let timeline = self.source.timeline(self.times)?;
        let (tracks, samples) = (self.source.track_count(), timeline.len());
        let part = |asked: &Option<Range<usize>>, all| asked.clone().unwrap_or(0..all);
        let (window_tracks, window_samples) =
            (part(&self.tracks, tracks), part(&self.samples, samples));
        let window = Window::of(window_tracks, window_samples, self.layout);
        check_within(&window, tracks, samples)?;
        Ok(RequestPart { timeline, window })
    }
}
